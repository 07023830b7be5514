"""The private attributes of pygfx that Airlight touches: a new version that takes one away fails here, by its name."""

import inspect
import re
from pathlib import Path

import pytest

pytest.importorskip("pygfx")
from pygfx.renderers.wgpu.engine.blender import Blender


@pytest.mark.parametrize("name", ["_texture_info", "_textures", "texture_info"])
def test_the_blender_has(name: str) -> None:
    assert hasattr(Blender(), name), f"pygfx's Blender has no {name} any more: see airlight/pygfx/private.py"


def test_the_formats_are_said_in_the_info() -> None:
    info = Blender()._texture_info
    for name in ("color", "altcolor"):
        assert info[name]["format"] == "rgba8unorm-srgb", f"pygfx's Blender._texture_info[{name!r}]['format'] means something else now"


def test_the_renderer_has_a_blender() -> None:
    from pygfx.renderers.wgpu.engine.renderer import WgpuRenderer

    assert "self._blender = Blender()" in inspect.getsource(WgpuRenderer.__init__), "WgpuRenderer._blender: see airlight/pygfx/private.py"


def test_the_renderer_draws_as_it_is_divided() -> None:
    """What pygfx/divided.py overrides and stands in for."""
    from pygfx.renderers.wgpu.engine.pipeline import RenderPipelineContainer
    from pygfx.renderers.wgpu.engine.renderer import FlatScene, WgpuRenderer

    see = ": see airlight/pygfx/divided.py"
    assert list(inspect.signature(WgpuRenderer._render_recording).parameters)[1:] == ["renderstate", "flat", "physical_viewport"], see
    drawn, flushed = (inspect.getsource(f) for f in (WgpuRenderer._render_recording, WgpuRenderer.flush))
    for source in (drawn, flushed):
        assert "command_encoder = self._device.create_command_encoder()" in source, "WgpuRenderer._device" + see
    assert "in flat.iter_render_pipelines_per_pass_type():" in drawn and hasattr(FlatScene, "iter_render_pipelines_per_pass_type"), see
    made = inspect.getsource(RenderPipelineContainer.draw)
    assert 'self.render_info["indices"]' in made, "RenderPipelineContainer.render_info" + see
    assert "self._canvas_context.get_current_texture()" in flushed, "WgpuRenderer._canvas_context" + see


def test_the_engine_has_what_the_pre_pass_draws_with() -> None:
    import pygfx as gfx
    from pygfx.renderers.wgpu.engine import pipeline, renderstate, shared, update, utils
    from pygfx.renderers.wgpu.shader.base import BaseShader
    from pygfx.renderers.wgpu.shaders.meshshader import MeshShader
    from pygfx.resources._base import resource_update_registry
    from pygfx.utils.trackable import PropTracker

    def asked(function: object) -> list[str]:
        return list(inspect.signature(function).parameters)  # type: ignore[arg-type]

    see = ": see airlight/pygfx/private.py"
    container = pipeline.RenderPipelineContainer
    assert asked(container.__init__) == ["self", "shader"], "RenderPipelineContainer" + see
    updated = ["self", "wobject", "scene", "renderstate", "changed", "tracker"]
    assert asked(container.update) == updated, "RenderPipelineContainer.update" + see
    assert asked(container.draw) == ["self", "render_pass", "renderstate"], "RenderPipelineContainer.draw" + see
    assert asked(renderstate.get_renderstate) == ["light_dict", "blender"], "get_renderstate" + see
    assert asked(PropTracker.track_usage) == ["self", "label"] and asked(PropTracker.pop_changed) == ["self"], "PropTracker" + see
    assert asked(utils.registry.get_render_function) == ["wobject"], "registry.get_render_function" + see
    assert asked(update.update_resource) == ["resource"], "update_resource" + see
    assert asked(resource_update_registry.get_syncable_resources) == ["flush"], "get_syncable_resources" + see
    fields = {"cam_transform", "cam_transform_inv", "projection_transform", "projection_transform_inv"}
    fields |= {"ndc_offset", "physical_size", "logical_size"}
    assert fields == set(shared.stdinfo_uniform_type), "the shared uniform_buffer" + see
    assert hasattr(shared.Shared, "pre_render_hook"), "Shared.pre_render_hook" + see
    assert hasattr(MeshShader, "get_code") and BaseShader.needs_bake_function is False, "MeshShader, needs_bake_function" + see
    for name in ("lighting", "receive_shadow", "flat_shading", "color_mode", "use_map", "use_vertex_color"):
        assert f'self["{name}"]' in inspect.getsource(MeshShader.__init__), f"MeshShader[{name!r}]" + see
    assert hasattr(gfx.WorldObject, "_update_object"), "WorldObject._update_object" + see
    assert hasattr(gfx.Material, "_gfx_use_alpha_test"), "Material._gfx_use_alpha_test" + see
    assert gfx.PerspectiveCamera()._view_offset is None, "Camera._view_offset" + see
    state = inspect.getsource(renderstate.BlendRenderState) + inspect.getsource(pipeline.RenderPipelineContainer)
    for name in ("blender.hash", "get_shader_kwargs", "get_color_descriptors", "get_depth_descriptor"):
        assert name in state, f"what pipelines ask of a blender, {name}" + see


def test_the_engine_has_what_shadow_maps_are_drawn_with() -> None:
    import numpy as np
    import pygfx as gfx
    from pygfx.renderers.wgpu.engine import pipeline

    see = ": see airlight/pygfx/private.py"
    composed = inspect.getsource(pipeline.RenderPipelineContainer._compose_pipeline)
    assert 'cull_mode = self.pipeline_info["cull_mode"]' in composed, "RenderPipelineContainer._compose_pipeline, pipeline_info" + see
    geometry = gfx.box_geometry()
    geometry.morph_positions = [np.zeros_like(geometry.positions.data)]
    mesh = gfx.Mesh(geometry, gfx.MeshBasicMaterial())
    assert mesh._morph_target_influences is None, "Mesh._morph_target_influences" + see
    mesh.morph_target_influences = [0.25]
    assert mesh._morph_target_influences.data["influence"].tolist() == [0.25, 0.75], "Mesh._morph_target_influences" + see


def test_the_engine_has_what_surfaces_take_their_shadows_by() -> None:
    """The functions that are replaced in pygfx's renderer, its render state, and the text of the shaders that ours stand in for."""
    import pygfx as gfx
    from pygfx.renderers.wgpu.engine import binding, renderer, renderstate, shadowutil
    from pygfx.renderers.wgpu.shader import templating

    see = ": see airlight/pygfx/private.py, shade_surfaces"
    drawing = inspect.getsource(renderer.WgpuRenderer.render) + inspect.getsource(renderer.WgpuRenderer._render_recording)
    calls = "get_renderstate(flat.lights, self._blender)", "render_shadow_maps(lights, flat.shadow_objects, command_encoder)"
    for call in calls:
        assert call in drawing, f"pygfx's renderer does no more say {call!r}" + see
    synced, recorded = drawing.index("get_syncable_resources"), drawing.index("self._render_recording(")
    assert synced < recorded, "shadow maps are drawn after all is uploaded" + see
    assert list(inspect.signature(shadowutil.render_shadow_maps).parameters) == ["lights", "wobjects", "command_encoder"], see
    assert list(inspect.signature(binding.Binding.__init__).parameters)[1:4] == ["name", "type", "resource"], "Binding" + see
    lights, combined = renderstate.LightRenderState, renderstate.CombinedRenderState
    assert "self._setup_light_resources()" in inspect.getsource(lights.__init__), "LightRenderState._setup_light_resources" + see
    given = ["self", "point_lights", "directional_lights", "spot_lights", "ambient_color"]
    assert list(inspect.signature(lights.prepare_for_draw).parameters) == given, "LightRenderState.prepare_for_draw" + see
    state = inspect.getsource(combined)
    for name in ("light_renderstate", "blend_renderstate", "wgpu_bind_group_layout, self.wgpu_bind_group = self._collect_bindings()"):
        assert f"self.{name}" in state, f"CombinedRenderState.{name}" + see
    assert {"cast_shadow", "shadow_bias"} < set(gfx.DirectionalLight.uniform_type), "uniforms of lights" + see
    assert "renderer_id" in gfx.WorldObject.uniform_type and "color" in gfx.AmbientLight.uniform_type, "renderer_id" + see
    assert hasattr(gfx.DirectionalLight(), "_gfx_update_uniform_buffer"), "Light._gfx_update_uniform_buffer" + see
    assert "pygfx" in templating.root_loader.mapping and hasattr(templating.jinja_env.cache, "clear"), "templating" + see

    source = Path(renderer.__file__).parents[1] / "wgsl"
    said = {path.name: path.read_text("utf-8") for path in source.glob("*.wgsl")}
    assert "light_shadow.wgsl" in said, "light_shadow.wgsl" + see
    for kind in ("point", "spot", "dir"):
        assert f"num_{kind}_lights > 0" in said["light_punctual.wgsl"], f"num_{kind}_lights" + see
    for kind in ("Point", "Spot", "Directional"):
        assert f"fn get{kind}LightInfo(" in said["light_common.wgsl"], f"get{kind}LightInfo" + see
        assert f"get{kind}LightInfo(" in said["light_punctual.wgsl"], f"get{kind}LightInfo" + see
    assert said["light_punctual.wgsl"].count("RE_Direct( punctual_light, geometry, material, &reflected_light );") == 3, "RE_Direct" + see
    names = "pygfx.light_shadow.wgsl", "pygfx.light_punctual.wgsl", "varyings.world_pos", "var normal = surface_normal", "geometry.position"
    for name in names:
        assert name in said["mesh.wgsl"], f"mesh.wgsl: {name}" + see


def test_controllers_tell_a_distance_by_width_and_height() -> None:
    from pygfx.cameras import _perspective

    assert list(inspect.signature(_perspective.fov_distance_factor).parameters) == ["fov"], (
        "fov_distance_factor: see airlight/pygfx/private.py"
    )


def test_private_parts_of_pygfx_are_touched_in_one_file() -> None:
    """An import of a private module, or of a private name from one of pygfx's, elsewhere has no canary here."""
    import airlight

    private = re.compile(r"^\s*(from|import) pygfx[\w.]*\._|^\s*from pygfx[\w.]* import .*\b_", re.M)
    package = Path(airlight.__file__).parent
    found = [str(path.relative_to(package)) for path in package.rglob("*.py") if private.search(path.read_text(encoding="utf-8"))]
    assert found == [str(Path("pygfx", "private.py"))]


def test_the_renderer_holds_back_as_it_is_told() -> None:
    """What pygfx/private_panes.py overrides and stands in for."""
    from pygfx.renderers.wgpu.engine import pipeline
    from pygfx.renderers.wgpu.engine.renderer import WgpuRenderer, WobjectWrapper

    from airlight.pygfx.private_panes import FlatScene  # pygfx's own, which another may stand in for by now

    see = ": see airlight/pygfx/private_panes.py"
    source = inspect.getsource(FlatScene)
    for name in ("_wobject_wrappers", "_bake_functions", "_compute_pipeline_containers", "wrapper.render_containers"):
        assert f"{name}" in source, f"FlatScene.{name}" + see
    asked = list(inspect.signature(WobjectWrapper.__init__).parameters)
    assert asked == ["self", "wobject", "sort_key", "pass_type"], "WobjectWrapper" + see
    rendered = inspect.getsource(WgpuRenderer.render)
    assert "flat = FlatScene(scene" in rendered and "flat.collect_pipelines_container_groups(renderstate)" in rendered, "FlatScene" + see
    asked = list(inspect.signature(pipeline.get_pipeline_container_group).parameters)
    assert asked == ["wobject", "scene", "renderstate"], "get_pipeline_container_group" + see
    made = inspect.getsource(pipeline.RenderPipelineContainer)
    for name in ("renderstate.blender", "wgpu_bind_group_layout", "wgpu_bind_group", "shader_kwargs.update(renderstate_kwargs)"):
        assert name in made, f"what pipelines ask of a render state, {name}" + see
    blender = Blender()
    blender.ensure_target_size((4, 4))
    assert blender.get_color_attachments("opaque")[1].view is not None and blender.get_depth_attachment() is not None, "Blender" + see
