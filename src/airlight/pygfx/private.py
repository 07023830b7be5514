"""Wraps every private attribute of pygfx that Airlight touches behind a function; tests/test_scene_private.py names those that go away."""

import weakref
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
import pygfx as gfx
import wgpu
from pygfx.cameras._perspective import fov_distance_factor
from pygfx.renderers.wgpu.engine import renderer as rendering
from pygfx.renderers.wgpu.engine.binding import Binding
from pygfx.renderers.wgpu.engine.pipeline import RenderPipelineContainer
from pygfx.renderers.wgpu.engine.renderstate import BlendRenderState, CombinedRenderState, LightRenderState, get_renderstate
from pygfx.renderers.wgpu.engine.shadowutil import render_shadow_maps
from pygfx.renderers.wgpu.engine.shared import get_shared
from pygfx.renderers.wgpu.engine.update import update_resource
from pygfx.renderers.wgpu.engine.utils import GfxSampler, GfxTextureView, nchannels_from_format, registry, to_texture_format
from pygfx.renderers.wgpu.shader import templating
from pygfx.renderers.wgpu.shader.base import ShaderInterface
from pygfx.renderers.wgpu.shaders.meshshader import MeshShader
from pygfx.resources import Buffer, Texture
from pygfx.resources._base import resource_update_registry
from pygfx.utils import array_from_shadertype
from pygfx.utils.trackable import PropTracker

from airlight.gpu.shader import load
from airlight.projection import Matrix
from airlight.pygfx.private_surfaces import GlassBinding, Shaders

__all__ = [
    "Blender",
    "MeshShader",
    "Pipelines",
    "SurfaceState",
    "TwoSided",
    "alpha_tested",
    "channels",
    "contents",
    "drawn",
    "extent",
    "influences",
    "is_hdr",
    "shade_surfaces",
    "shader_of",
    "unlit",
    "update_object",
    "upload",
    "use_copies",
    "use_hdr",
    "vertices",
    "view_offset",
    "write_camera",
]
HDR = "rgba16float"
SHAPE_SIDE = 512  # texels of a light's shape on surfaces


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


def use_copies(renderer: Any) -> None:
    """Let the picture that a renderer draws, before its effects, be copied from and onto. Touches what `use_hdr` does."""
    renderer._blender._texture_info["color"]["usage"] |= wgpu.TextureUsage.COPY_SRC | wgpu.TextureUsage.COPY_DST
    renderer._blender._textures.pop("color", None)


def drawn(renderer: Any) -> Any:
    """Find the texture that a renderer has drawn on, before its effects. Touches renderer._blender."""
    return renderer._blender.get_texture("color")


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


def contents(pipelines: Pipelines) -> list[Any]:
    """Lists all that decides what the pipelines of an object draw, but for the camera: shaders, ranges, buffers and textures with their
    revisions. While the lists of two frames are equal these draw the same; textures that a GPU draws into may change in silence, and are
    like nothing. Touches shader_hash, render_info, bindings_dicts."""
    camera, found = get_shared().uniform_buffer, list[Any]()
    for container in pipelines.containers or ():
        found.append((container.shader_hash, container.render_info))
        for one in (one for group in container.bindings_dicts.values() for one in group.values()):
            bound = getattr(one.resource, "texture", one.resource)
            if bound is not camera:
                is_told = not isinstance(bound, Texture) or bound.data is not None
                found.append((bound, getattr(bound, "rev", 0)) if is_told else object())
    return found


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


def vertices(container: Any) -> int:
    """Counts what a pipeline of an object draws, over its instances; 0 of a broken one. Touches render_info."""
    found = (container.render_info or {"indices": (0, 0)})["indices"]
    return int(found[0] * found[1])


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


# ---------------------------------------------------------------- shadows on surfaces

KINDS = {"directional": gfx.DirectionalLight, "spot": gfx.SpotLight, "point": gfx.PointLight}
MAPS = {"flat": ("directional", "spot"), "cube": ("point",)}  # shadow maps of surfaces, and which kinds of lights have layers in them
CASTERS = 2**16  # objects that are told apart
LAYERS = {"directional": 1, "spot": 1, "point": 6}  # of a light
PLANES = 12  # that bound a light, at most
Casting = tuple[tuple[bool, ...], ...]  # of each kind of KINDS, which of its lights have a shadow map


class _SurfaceLights(LightRenderState):  # type: ignore[misc]
    """Keeps lights as pygfx's shaders read them, with shadow maps of ours.

    Overrides _setup_light_resources, _get_light_vars_code, prepare_for_draw.
    """

    def __init__(self, casting: Casting, sizes: dict[str, int], glass: int, shaping: Casting) -> None:
        self.casting, self.sizes, self.texels = dict(zip(KINDS, casting, strict=True)), sizes, glass
        numbers = iter(range(sum(map(sum, shaping))))
        self.shapes = {kind: [next(numbers) if one else -1 for one in own] for kind, own in zip(KINDS, shaping, strict=True)}
        self.shape_count = sum(map(sum, shaping))
        self.layers = layers_of(casting)
        super().__init__(*(len(self.casting[kind]) for kind in ("point", "directional", "spot")))

    def _setup_light_resources(self) -> None:
        count = max(sum(self.layers.values()), 2)
        fields = {"views": f"{count}*4x4xf4", "scales": f"{count}*4xf4", "casters": f"{CASTERS // 128}*4xu4", "glass": f"{count}*4xu4"}
        if (shapes := self.shape_count) > 0:
            counts = {"shape_rows": 3 * shapes, "shape_planes": PLANES * shapes}
            counts |= {name: max(shapes, 2) for name in ("shape_scales", "shape_falls")}
            fields |= {name: f"{number}*4xf4" for name, number in counts.items()}
        self.shared = Buffer(array_from_shadertype({**gfx.AmbientLight.uniform_type, **fields}), force_contiguous=True)
        self.bindings.append(Binding("u_ambient_light", "buffer/uniform", self.shared, structname="AmbientLight"))
        self.buffers: dict[str, Any] = {}
        for kind, made in KINDS.items():
            if self.casting[kind]:
                own = self.buffers[kind] = Buffer(array_from_shadertype(made.uniform_type, len(self.casting[kind])), force_contiguous=True)
                self.bindings.append(Binding(f"u_{kind}_lights", "buffer/uniform", own, structname=made.__name__))
        usage = wgpu.TextureUsage.RENDER_ATTACHMENT | wgpu.TextureUsage.TEXTURE_BINDING | wgpu.TextureUsage.COPY_SRC
        self.maps: dict[str, list[Any]] = {}  # a view of each layer
        for name, layers in self.layers.items():
            if layers:
                size = (self.sizes[name], self.sizes[name], layers)
                texture = self.device.create_texture(size=size, usage=usage, format="depth32float")
                self.maps[name] = [texture.create_view(dimension="2d", base_array_layer=i, array_layer_count=1) for i in range(layers)]
                self.bindings.append(Binding(f"u_{name}_maps", "shadow_texture/2d-array", texture.create_view(dimension="2d-array")))
        self.shape_texture: Any = None
        if self.shape_count:
            texels = np.zeros((max(self.shape_count, 2), SHAPE_SIDE, SHAPE_SIDE, 4), np.float16)
            self.shape_texture = Texture(texels, dim=2, size=(SHAPE_SIDE, SHAPE_SIDE, len(texels)), format="rgba16float")
            view = GfxTextureView(self.shape_texture, view_dim="2d-array")
            self.bindings.append(Binding("t_shapes", "texture/auto", view))
            self.bindings.append(Binding("s_shapes", "sampler/filtering", GfxSampler("linear", "repeat")))
        self.bindings.append(Binding("s_shadow", "sampler/non_filtering", GfxSampler("nearest", "clamp")))
        self.glass = GlassBinding(self.device, self.texels) if self.texels else None

    def _get_light_vars_code(self, bind_group_index: int) -> str:
        own = {"s_shadow": "sampler", "s_shapes": "sampler", "t_shapes": "texture_2d_array<f32>"}
        named = [(i, one.name) for i, one in enumerate(self.bindings) if one.name in own]
        more = [f"@group({bind_group_index}) @binding({i}) var {name}: {own[name]};" for i, name in named]
        return "\n".join([super()._get_light_vars_code(bind_group_index), *more, ""])

    def prepare_for_draw(self, point_lights: Any, directional_lights: Any, spot_lights: Any, ambient_color: Any) -> None:
        """Fills the lights' buffers; a shadow_bias is the number of the light's first view instead, by the order of `casters`."""
        named = {"point_lights": point_lights, "directional_lights": directional_lights, "spot_lights": spot_lights}
        self.lights = {**named, "ambient_color": ambient_color}
        self.shared.data["color"].flat = ambient_color
        view = 0
        for kind, own in self.buffers.items():
            for i, light in enumerate(named[f"{kind}_lights"]):
                light._gfx_update_uniform_buffer()
                own.data[i] = light.uniform_buffer.data
                own.data[i]["shadow_bias"] = view
                view += LAYERS[kind] * self.casting[kind][i]
            own.update_full()


class SurfaceState(CombinedRenderState):  # type: ignore[misc]
    """Stands in for pygfx's render state where surfaces take their shadows from maps of ours. Touches BlendRenderState, _collect_bindings.

    casters: (light, name of its map) of those that cast, in the order of their views. maps: of a name, a view of each layer.
    """

    def __init__(self, casting: Casting, sizes: dict[str, int], glass: int, blend_hash: tuple[Any, ...], shaping: Casting) -> None:
        self.device = get_shared().device
        own = self.light_renderstate = _SurfaceLights(casting, sizes, glass, shaping)
        self._written: list[Any] = []
        self.blend_renderstate = BlendRenderState.obtain_from_hash(blend_hash)
        self.bindings = [*own.bindings, *([own.glass] if own.glass else []), *self.blend_renderstate.bindings]
        self.wgpu_bind_group_layout, self.wgpu_bind_group = self._collect_bindings()

    def get_shader_kwargs(self, bind_group_index: int = 1) -> dict[str, Any]:
        lights = self.light_renderstate
        casts = {kind: any(own) for kind, own in lights.casting.items()}
        own = {"airlight_casts": casts, "airlight_flat_layers": lights.layers["flat"], "airlight_casters": CASTERS}
        own |= {"airlight_planes": PLANES, "airlight_side": SHAPE_SIDE}
        own |= {"airlight_shapes": {kind: numbers if max(numbers, default=-1) >= 0 else [] for kind, numbers in lights.shapes.items()}}
        own["airlight_glass"] = (bind_group_index, len(lights.bindings)) if lights.glass else None
        return {**super().get_shader_kwargs(bind_group_index), **own}

    @property
    def maps(self) -> dict[str, list[Any]]:
        return self.light_renderstate.maps

    @property
    def glass(self) -> GlassBinding | None:
        return self.light_renderstate.glass

    @property
    def casters(self) -> list[tuple[Any, str]]:
        own, names = self.light_renderstate, {kind: name for name, kinds in MAPS.items() for kind in kinds}
        of_kind = ((kind, zip(own.lights[f"{kind}_lights"], own.casting[kind], strict=True)) for kind in KINDS)
        return [(light, names[kind]) for kind, lights in of_kind for light, casts in lights if casts]

    def write(self, views: Matrix, scales: Matrix, casters: Iterable[Any], glass: Any = ()) -> None:
        """Writes what the shaders know of the maps, (N, 4, 4) and (N, 4), see light_shadow.wgsl, which objects are drawn into them, and
        (N, 4) where those of glass lie, see surface_glass.wgsl."""
        shared = self.light_renderstate.shared
        data = shared.data
        data["views"], data["scales"] = 0, 0
        data["glass"][: len(glass)] = np.reshape(glass, (-1, 4))
        data["views"][: len(views)], data["scales"][: len(views)] = views.transpose(0, 2, 1), scales
        bits = np.zeros(CASTERS, np.uint8)
        bits[[min(int(thing.uniform_buffer.data["renderer_id"]), CASTERS - 1) for thing in casters]] = 1
        data["casters"] = np.packbits(bits, bitorder="little").view("<u4").reshape(-1, 4)
        shared.update_full()


    def write_shapes(self, records: Sequence[tuple[Any, ...]], layers: Sequence[Any]) -> None:
        """Writes shapes of lights: of each (rows, scale, falloff, planes), see light_punctual.wgsl, and its texels, SHAPE_SIDE x SHAPE_SIDE
        x 3 or (1, 1, 3); texels that are the very ones that are there are left."""
        shared, texture = self.light_renderstate.shared, self.light_renderstate.shape_texture
        for i, (rows, scale, falls, planes) in enumerate(records):
            shared.data["shape_rows"][3 * i : 3 * i + 3] = rows
            shared.data["shape_scales"][i], shared.data["shape_falls"][i] = scale, falls
            shared.data["shape_planes"][PLANES * i : PLANES * (i + 1)] = planes
        shared.update_full()
        if len(self._written) != len(layers) or any(a is not b for a, b in zip(self._written, layers, strict=True)):
            for i, texels in enumerate(layers):
                texture.data[i, ..., :3] = texels
            texture.update_full()
            self._written = list(layers)


def layers_of(casting: Casting) -> dict[str, int]:
    """Counts the layers of each map of MAPS."""
    counts = {kind: LAYERS[kind] * sum(own) for kind, own in zip(KINDS, casting, strict=True)}
    return {name: sum(counts[kind] for kind in kinds) for name, kinds in MAPS.items()}


_states: Any = weakref.WeakValueDictionary()
_owners: Any = weakref.WeakKeyDictionary()  # of a renderer's blender: weak references to what draws maps for it
_chosen: list[Any] = [None]  # (owner, state) of the render state that was chosen last, where it is ours


def shade_surfaces(renderer: Any, owner: Any) -> None:
    """Let what a renderer draws take its shadows from maps of ours, while `owner` lives and says so.

    owner: has wants(lights), which tells whether to, glass_texels(layers), which tells how many texels of what dims lights there are,
    shapes(lights), which gives the shape of each, by kind, or None, write_shapes(state, shapes), and draw(state), which draws the maps of a
    SurfaceState; lights as in pygfx's render states. sizes: of the maps' sides. Touches renderer._blender; replaces two functions that
    pygfx's renderer calls, and two files of its shaders, which for all others stay as they are.
    """
    if rendering.get_renderstate is get_renderstate:
        rendering.get_renderstate, rendering.render_shadow_maps = _choose_state, _draw_shadows
        templating.root_loader.mapping["pygfx"] = Shaders(templating.root_loader.mapping["pygfx"])
        templating.jinja_env.cache.clear()
    _owners.setdefault(renderer._blender, []).append(weakref.ref(owner))


def _choose_state(lights: Any, blender: Any) -> Any:
    alive = [owner for owner in _owners.get(blender, ()) if owner() is not None]
    if alive:
        _owners[blender] = alive
    owner = next((owner() for owner in alive if owner().wants(lights)), None)
    if owner is None:
        _chosen[0] = None
        return get_renderstate(lights, blender)
    casting = tuple(tuple(bool(light.cast_shadow) for light in lights[f"{kind}_lights"]) for kind in KINDS)
    shapes = owner.shapes(lights)
    shaping = tuple(tuple(shape is not None for shape in shapes[kind]) for kind in KINDS)
    key = casting, tuple(owner.sizes.items()), owner.glass_texels(layers_of(casting)), BlendRenderState.state_to_hash(blender), shaping
    state = _states.get(key)
    if state is None:
        state = _states[key] = SurfaceState(casting, owner.sizes, *key[2:])
    state.prepare_for_draw(tuple(lights[name] for name in LIGHTS), (blender,))
    state.write(np.zeros((0, 4, 4)), np.zeros((0, 4)), ())  # where nothing casts pygfx draws none
    if any(map(any, shaping)):
        owner.write_shapes(state, [shape for kind in KINDS for shape in shapes[kind] if shape is not None])
    _chosen[0] = owner, state
    return state


def _draw_shadows(*parts: Any) -> None:
    """Draws the maps of the state that was chosen: by now all pipelines are made, and what they fill once without a word is uploaded."""
    if _chosen[0] is None:
        render_shadow_maps(*parts)
        return
    owner, state = _chosen[0]
    shared = get_shared().uniform_buffer
    before = shared.data.copy()
    owner.draw(state)
    shared.data[()] = before
    shared.update_full()
    upload()


LIGHTS = ("point_lights", "directional_lights", "spot_lights", "ambient_color")  # as pygfx hands them on
