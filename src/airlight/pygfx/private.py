"""Wraps every private attribute of pygfx that Airlight touches behind a function; tests/test_scene_private.py names those that go away."""

from collections.abc import Callable
from typing import Any

import numpy as np
from pygfx.cameras._perspective import fov_distance_factor
from pygfx.renderers.wgpu.engine.pipeline import RenderPipelineContainer
from pygfx.renderers.wgpu.engine.renderstate import get_renderstate
from pygfx.renderers.wgpu.engine.shared import get_shared
from pygfx.renderers.wgpu.engine.update import update_resource
from pygfx.renderers.wgpu.engine.utils import nchannels_from_format, registry, to_texture_format
from pygfx.renderers.wgpu.shader.base import ShaderInterface
from pygfx.renderers.wgpu.shaders.meshshader import MeshShader
from pygfx.resources import Texture
from pygfx.resources._base import resource_update_registry
from pygfx.utils.trackable import PropTracker

from airlight.gpu.shader import load

__all__ = [
    "Blender",
    "MeshShader",
    "Pipelines",
    "TwoSided",
    "alpha_tested",
    "channels",
    "extent",
    "influences",
    "is_hdr",
    "shader_of",
    "unlit",
    "update_object",
    "upload",
    "use_hdr",
    "view_offset",
    "write_camera",
]
HDR = "rgba16float"


def is_hdr(renderer: Any) -> bool:
    """Tells whether a gfx.WgpuRenderer keeps its picture in half floats. Touches renderer._blender."""
    return bool(renderer._blender.texture_info["color"]["format"] == HDR)


def use_hdr(renderer: Any) -> None:
    """Let a gfx.WgpuRenderer keep its picture in half floats, linear and beyond 1, from its next frame on.

    Touches renderer._blender, and its _texture_info and _textures: formats are those of the info, textures are made where missing.
    """
    if not is_hdr(renderer):
        for name in ("color", "altcolor"):
            renderer._blender._texture_info[name]["format"] = HDR
            renderer._blender._textures.pop(name, None)


def shader_of(wobject: Any) -> Any:
    """Finds the class of pygfx's shader for an object with its material, or a function that gives one or several."""
    return registry.get_render_function(wobject)


def alpha_tested(material: Any) -> bool:
    """Tells whether a material has an alpha test; trackers see a change of this, unlike of its alpha_test. Touches _gfx_use_alpha_test."""
    return bool(material._gfx_use_alpha_test)


def channels(resource: Any) -> int:
    """Counts the numbers of a texel of a gfx.Texture, or of an item of a gfx.Buffer. Touches to_texture_format, nchannels_from_format."""
    if isinstance(resource, Texture):
        kind = to_texture_format(resource.format)
        return len(kind) - len(kind.lstrip("rgba"))
    return int(nchannels_from_format(resource.format))


class Blender:
    """Stands in for what pygfx's pipelines ask of a renderer's blender, but for its targets: get_color_descriptors, get_depth_descriptor.

    output: what becomes of fragments, a .wgsl file.
    """

    def __init__(self, name: str, output: str) -> None:
        self.hash, self.output = f"airlight {name}", output

    def get_shader_kwargs(self, pick: bool, alpha: dict[str, Any]) -> dict[str, Any]:
        return {"alpha_method": alpha["method"], "fragment_output_code": load(self.output), "write_pick": False}


def unlit(blender: Blender) -> Any:
    """Makes the state that pygfx's pipelines are made for where no light shines, and `blender` says what becomes of fragments."""
    none: dict[str, Any] = {"point_lights": [], "directional_lights": [], "spot_lights": [], "ambient_color": [0, 0, 0]}
    return get_renderstate(none, blender)


class Pipelines:
    """Keeps the pipelines of an object with its material for a state of `unlit`, made anew only where pygfx's trackers see a change.

    shaders: a function of the object. Touches PropTracker and RenderPipelineContainer, as pygfx's PipelineContainerGroup does.
    """

    def __init__(self, shaders: Callable[[Any], Any], container: Any = RenderPipelineContainer) -> None:
        self.shaders, self.container = shaders, container
        self.tracker = PropTracker()
        self.containers: list[Any] | None = None
        self.bakes: list[Any] = []

    def update(self, wobject: Any, state: Any) -> None:
        changed = self.tracker.pop_changed()
        if self.containers is None:
            changed.add("create")
        if "create" in changed:
            with self.tracker.track_usage("create"):
                made = self.shaders(wobject)
            made = [made] if isinstance(made, ShaderInterface) else made
            self.containers = [self.container(shader) for shader in made if shader.type == "render"]
            self.bakes = [shader.bake_function for shader in made if shader.needs_bake_function]
        if changed and self.containers is not None:
            for container in self.containers:
                container.update(wobject, None, state, changed, self.tracker)

    def draw(self, run: Any, state: Any) -> None:
        for container in self.containers or ():
            container.draw(run, state)


class TwoSided(RenderPipelineContainer):  # type: ignore[misc]
    """Draws both sides, whatever the material says. Touches _compose_pipeline and pipeline_info."""

    pipeline_info: Any

    def _compose_pipeline(self, renderstate: Any) -> Any:
        self.pipeline_info: Any = {**self.pipeline_info, "cull_mode": "none"}
        return super()._compose_pipeline(renderstate)


def influences(wobject: Any) -> Any:
    """Reads the shares (K + 1,) of a mesh's morph targets and, last, of its own positions; None where pygfx draws it without. Touches
    _morph_target_influences."""
    buffer = getattr(wobject, "_morph_target_influences", None)
    return None if buffer is None else buffer.data["influence"]


def update_object(wobject: Any) -> None:
    """Let an object bring its buffers up to date, as a renderer does before it draws. Touches _update_object."""
    wobject._update_object()


def view_offset(camera: Any) -> tuple[float, float, float, float]:
    """Finds how a camera's own view lies in that of a set view offset: factor and offset of x and y. Touches _view_offset."""
    offset: tuple[float, float, float, float] = (1.0, 1.0, 0.0, 0.0) if camera._view_offset is None else camera._view_offset["ndc_offset"]
    return offset


def extent(fov: float, distance: float) -> float:
    """Computes the mean of width and height by which pygfx's controllers take a perspective camera for so far from what it looks at.

    Touches fov_distance_factor.
    """
    return float(distance / fov_distance_factor(fov))


def write_camera(camera: Any, **values: Any) -> None:
    """Fill the buffer of the camera that all of pygfx's shaders share, as a renderer does before it draws.

    camera: None for one whose space is the world. values: projection_transform, its inverse, ndc_offset, physical_size, logical_size. A
    renderer writes all of it anew for each of its own calls. Touches get_shared, its uniform_buffer and pre_render_hook.
    """
    shared = get_shared()
    shared.pre_render_hook()
    data = shared.uniform_buffer.data
    data["cam_transform"] = np.eye(4) if camera is None else camera.world.inverse_matrix.T
    data["cam_transform_inv"] = np.eye(4) if camera is None else camera.world.matrix.T
    for name, value in values.items():
        data[name] = value
    shared.uniform_buffer.update_full()


def upload() -> None:
    """Upload whatever of pygfx's buffers and textures has changed. Touches resource_update_registry, update_resource."""
    for resource in resource_update_registry.get_syncable_resources(flush=True):
        update_resource(resource)
