"""Draws what is seen through, as glass, smoke and soft edges, in the medium: pygfx draws the rest, the march keeps profiles of the rays
that meet it, and then pygfx's own shaders draw it over the fogged picture, each fragment fogged at its own distance. Nothing of the scene
is touched.
"""

import weakref
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import pygfx as gfx

from airlight.composite.scene import SceneLayer
from airlight.gpu.device import Device
from airlight.gpu.structs import struct_dtype
from airlight.gpu.timing import Timer, compute, divide, timing
from airlight.projection import depth_terms, eye_rays
from airlight.pygfx import private, private_panes
from airlight.pygfx.prepass import pattern, silhouette, solid
from airlight.scatter.march.profile import Profile, blendable
from airlight.scatter.methods import METHODS

if TYPE_CHECKING:
    from airlight.pygfx.effect import LightShafts

FORMAT, LAYER = "rgba16float", "rgba32float"
FOG = struct_dtype("pygfx/pane_camera.wgsl", "PaneFog")
BEHIND, THROUGH = "composite/behind_panes.wgsl", "composite/through_panes.wgsl"
OPAQUE = 0.95  # alpha from which a fragment of what is blended is solid, as in pane_fog.wgsl
OVER, PREMULTIPLIED, ADDED, TINT, VEIL, DARKEN, DARK_VEIL = range(7)  # numbered as in pane_fog.wgsl
VEILS = {TINT: VEIL, DARKEN: DARK_VEIL}  # what is drawn after them
MODES = {  # of factors of a fragment and of what is behind it
    ("src-alpha", "one-minus-src-alpha"): OVER,
    ("one", "one-minus-src-alpha"): PREMULTIPLIED,
    ("src-alpha", "one"): ADDED,
    ("one", "one"): ADDED,
    ("zero", "src"): TINT,
    ("dst", "zero"): TINT,
    ("zero", "one-minus-src"): DARKEN,
}
NOWHERE = (-65504, -65504, 0, 0)
UNIFORM: dict[str, Any] = {"buffer": {"type": "uniform"}}
STORAGE: dict[str, Any] = {"buffer": {"type": "read-only-storage"}}
DEPTH: dict[str, Any] = {"texture": {"sample_type": "depth"}}


def mode_of(alpha: dict[str, Any]) -> int | None:
    """Tells how a material's alpha_config blends; None where it does not, or as nothing that fog is known for."""
    if alpha["method"] != "blended" or alpha.get("color_op", "add") != "add":
        return None
    return MODES.get((alpha["color_src"], alpha["color_dst"]))


def is_seen_through(wobject: Any) -> bool:
    """Tells whether one sees through an object, or a part of it. What pygfx blends by "auto" though all of it is there is solid."""
    material = wobject.material
    mode = mode_of(material.alpha_config)
    if isinstance(wobject, gfx.Background) or mode is None or (mode in VEILS and not isinstance(wobject, gfx.Mesh)):
        return False  # points that overlap cannot be veiled one by one
    if material.alpha_mode != "auto":
        return True
    if isinstance(wobject, gfx.Mesh):
        return not solid(wobject, material) and not is_opaque(wobject)
    return bool(material.opacity < 1)


_least: Any = weakref.WeakKeyDictionary()  # of textures and buffers: their revision, and the least alpha that they hold


def least_alpha(resource: Any) -> float:
    """Finds the least alpha, 0..1, of a gfx.Texture or gfx.Buffer of four numbers an item; 0 where that is not known."""
    if resource is None:
        return 1.0
    data = resource.data
    if data is None or private.channels(resource) != 4 or data.dtype.kind not in "uf":
        return 0.0
    if resource not in _least or _least[resource][0] != resource.rev:
        least = float(data[..., -1].min()) if data.size else 1.0
        _least[resource] = resource.rev, least / (np.iinfo(data.dtype).max if data.dtype.kind == "u" else 1.0)
    found: float = _least[resource][1]
    return found


def is_opaque(wobject: Any) -> bool:
    """Tells whether an object `is_split`, and all of it is opaque: many a texture has an alpha that says nothing."""
    if not is_split(wobject):
        return False
    colors = getattr(wobject.geometry, "colors", None)
    colors = colors if colors is not None and private.channels(colors) == 4 else None
    map = getattr(wobject.material, "map", None)
    texture = map.texture if map is not None and private.channels(map.texture) == 4 else None
    return least_alpha(colors) * least_alpha(texture) >= OPAQUE


def is_split(wobject: Any) -> bool:
    """Tells whether an object's opaque fragments are drawn as solid ones: of a mesh that is blended over what is behind, where a map or
    vertex colours decide on its alpha, and no alpha test does."""
    material = wobject.material
    if not isinstance(wobject, gfx.Mesh) or mode_of(material.alpha_config) != OVER or private.alpha_tested(material):
        return False
    return material.opacity >= 1 and getattr(getattr(material, "color", None), "a", 1.0) >= 1 and pattern(wobject, material)


class _Fogged:
    """Stands in for the blender of a renderer, `base`, where fogged fragments are drawn onto picture, layer, and what is picked."""

    def __init__(self, base: Any, mode: int, format: str) -> None:
        """format: of picture and layer."""
        self.base, self.mode, self.format = base, mode, format
        self.hash = f"airlight pane {mode} {base.hash}"

    def get_shader_kwargs(self, pick: bool, alpha: dict[str, Any]) -> dict[str, Any]:
        return {"alpha_method": alpha["method"], "fragment_output_code": "", "write_pick": pick and "pick" in self.base.texture_info}

    def get_color_descriptors(self, pick: bool, alpha: dict[str, Any]) -> list[dict[str, Any]]:
        veils = self.mode in VEILS.values()
        source, target = ("one", "one") if veils else (alpha["color_src"], alpha["color_dst"])
        color = {"operation": "add", "src_factor": source, "dst_factor": target}
        own = {"operation": alpha.get("alpha_op", "add"), "src_factor": alpha["alpha_src"], "dst_factor": alpha["alpha_dst"]}
        marked = {"operation": "max", "src_factor": "one", "dst_factor": "one"}
        marks = self.format == FORMAT  # the layer itself holds lengths there
        found = [
            {"format": self.format, "blend": {"color": color, "alpha": own}, "write_mask": 7 if veils else 15},
            {"format": self.format, "blend": {"color": color, "alpha": marked}, "write_mask": 15 if marks else 7},
        ]
        picked = self.base.get_color_descriptors(pick and not veils, alpha)[1:]
        return [*found, *picked]

    def get_depth_descriptor(self, test: bool, compare: str, write: bool) -> Any:
        return self.base.get_depth_descriptor(test, compare, write)


class _Spans(private.Blender):
    """Keeps the distances of what is seen through."""

    def __init__(self, format: str) -> None:
        super().__init__(f"spans of panes {format}", "pygfx/cast.wgsl")
        self.format = format

    def get_color_descriptors(self, pick: bool, alpha: dict[str, Any]) -> list[dict[str, Any]]:
        ways = ({"operation": operation, "src_factor": "one", "dst_factor": "one"} for operation in ("max", "add"))
        return [{"format": self.format, "blend": {"color": way, "alpha": way}, "write_mask": 15} for way in ways]

    def get_depth_descriptor(self, test: bool, compare: str, write: bool) -> dict[str, Any]:
        return {"format": "depth32float", "depth_write_enabled": False, "depth_compare": "always"}  # some shaders write one


class _Opaque:
    """Stands in for the blender of a renderer, `base`, where the opaque fragments of what is blended are drawn as solid ones."""

    def __init__(self, base: Any) -> None:
        self.base, self.hash = base, f"airlight opaque {base.hash}"

    def get_shader_kwargs(self, pick: bool, alpha: dict[str, Any]) -> dict[str, Any]:
        picked = pick and "pick" in self.base.texture_info
        return {"alpha_method": "opaque", "airlight_split": True, "fragment_output_code": "", "write_pick": picked}

    def get_color_descriptors(self, pick: bool, alpha: dict[str, Any]) -> Any:
        return self.base.get_color_descriptors(pick, {"method": "opaque"})

    def get_depth_descriptor(self, test: bool, compare: str, write: bool) -> Any:
        return self.base.get_depth_descriptor(test, compare, True)


class _Dithered(_Opaque):
    """Stands in for the blender of a renderer, `base`, where what is blended is drawn fragment by fragment, or not, by its alpha."""

    ALPHA = {"method": "stochastic", "pattern": "blue_noise", "seed": "element"}

    def __init__(self, base: Any) -> None:
        super().__init__(base)
        self.hash = f"airlight dithered {base.hash}"

    def get_shader_kwargs(self, pick: bool, alpha: dict[str, Any]) -> dict[str, Any]:
        found: dict[str, Any] = self.base.get_shader_kwargs(pick, self.ALPHA)
        return found


class Panes:
    """Holds back what is seen through in a LightShafts' scene, while that lights a medium that is to be seen through it, and draws it.

    held: of the last frame, (state, pipelines) in the order of their drawing.
    """

    def __init__(self, shafts: "LightShafts") -> None:
        self._shafts = weakref.ref(shafts)
        self.device: Device = shafts.device
        self.held: list[tuple[Any, Any]] = []
        self._objects: list[Any] = []
        self._camera: Any = None
        self._states: Any = weakref.WeakKeyDictionary()  # pygfx's render state -> what is drawn -> State
        self._fog = self.device.buffer(size=FOG.itemsize, uniform=True)
        self._spans: Any = weakref.WeakKeyDictionary()  # object -> material -> its pipelines
        self._blender = _Spans(blendable(shafts.device))
        self._span_states: dict[bool, Any] = {}  # whether opaque fragments are left out -> State
        self._targets: tuple[Any, ...] = ()  # picture; layer before and after, where the march's cannot be blended onto
        self._depth: Any = None  # a copy, where something that is seen through writes it
        private_panes.hold_back(shafts.renderer, self)

    @property
    def way(self) -> str:
        """Tells how what is seen through is drawn now: a value of Medium.transparency."""
        shafts = self._shafts()
        is_lit = shafts is not None and shafts.enabled and METHODS[shafts.parameters.method].follows_fields
        return shafts.medium.transparency if shafts is not None and is_lit and shafts in shafts.renderer.effect_passes else "none"

    # ------------------------------------------------------------ what pygfx's renderer asks

    def sort(self, scene: Any, objects: Sequence[Any], renderstate: Any) -> Any:
        """Chooses how each object is drawn, as private_panes.hold_back asks; None: as pygfx draws it."""
        shafts, way = self._shafts(), self.way
        if shafts is None or scene is not shafts.scene:  # which may be drawn over it, before the effects
            return None
        self.held, self._objects = [], []
        if way == "none":
            return None
        found = []
        for wobject in objects:
            seen = is_seen_through(wobject)
            if seen and way == "layers" and not is_opaque(wobject):
                self._objects.append(wobject)
            draws = self._layers if way == "layers" else self._dither
            found.append(draws(wobject, renderstate) if seen else None)
        return found if any(found) else None

    def hold(self, held: list[tuple[Any, Any]], camera: Any) -> None:
        self.held, self._camera = held, camera

    def _layers(self, wobject: Any, base: Any) -> list[tuple[Any, str]] | None:
        """Chooses to draw an object later, in the medium; what is opaque of it at once."""
        mode, split = mode_of(wobject.material.alpha_config), is_split(wobject)
        assert mode is not None
        opaque = self._state(base, "opaque", lambda: private_panes.State(base, _Opaque(base.blender), _OPAQUE))
        found = [(opaque, "solid")] if split else []
        if is_opaque(wobject):
            return found
        for one in (mode, *([VEILS[mode]] if mode in VEILS else ())):
            found.append((self._state(base, (one, split), lambda one=one: _fogged(base, one, split, self.device)), "held"))
        return found

    def _dither(self, wobject: Any, base: Any) -> list[tuple[Any, str]] | None:
        if mode_of(wobject.material.alpha_config) != OVER:
            return None
        return [(self._state(base, "dither", lambda: private_panes.State(base, _Dithered(base.blender))), "solid")]

    def _state(self, base: Any, key: Any, make: Any) -> Any:
        states = self._states.setdefault(base, {})
        if key not in states:
            states[key] = make()
        return states[key]

    # ------------------------------------------------------------ the frame

    def draw_spans(self, shafts: "LightShafts", march: Any, projection: Any, depth: Any, timer: Timer | None) -> None:
        """Draws and submits the distances at which rays of a march meet what is held; before it is recorded."""
        record = np.zeros((), FOG)
        medium = shafts.resolved_medium
        assert medium is not None
        record["rays"], record["flat"] = eye_rays(projection)
        record["depth"] = depth_terms(projection)
        record["sigma_t"], record["size"] = medium.sigma_t, march.size
        ratio = np.array(march.pixels) / march.size
        middle = np.array(march.size) // 2
        sampled = np.minimum((2 * middle + 1) * march.pixels // (2 * np.array(march.size)), np.array(march.pixels) - 1)
        record["ratio"], record["shift"] = ratio, sampled + 0.5 - (middle + 0.5) * ratio
        record["mix"] = 1.0 if shafts.composite.mix is None else shafts.composite.mix
        record["extinction"] = shafts.medium.extinction_share if shafts.medium.extinction else 0.0
        self.device.queue.write_buffer(self._fog, 0, record.tobytes())
        base = private.unlit(self._blender)
        if not self._span_states or self._span_states[False].base is not base:
            kinds = UNIFORM, DEPTH
            self._span_states = {split: private_panes.State(base, self._blender, _SPAN[split], kinds) for split in (False, True)}
        for state in self._span_states.values():
            state.bind(self.device.binding(self._fog), depth.create_view())
        drawn = []
        for wobject in self._objects:
            split = is_split(wobject)
            made = self._spans.setdefault(wobject, weakref.WeakKeyDictionary()).setdefault(wobject.material, {})
            pipelines, state = made.setdefault(split, private.Pipelines(silhouette)), self._span_states[split]
            pipelines.update(wobject, state)
            drawn.append((pipelines, state))
            for bake in pipelines.bakes:
                bake(wobject, shafts.camera, shafts.renderer.logical_size)
        private_panes.use_camera(self._camera, physical_size=march.size)
        encoder = self.device.encoder()
        found = ((march.profile.extremes, NOWHERE), (march.profile.sums, (0, 0, 0, 0)))
        targets = [{"view": one.create_view(), "load_op": "clear", "store_op": "store", "clear_value": clear} for one, clear in found]
        unused = {"depth_clear_value": 1.0, "depth_load_op": "clear", "depth_store_op": "discard"}
        known = {"color_attachments": targets, "depth_stencil_attachment": {"view": march.profile.depth.create_view(), **unused}}
        run = encoder.begin_render_pass(**known, **timing(timer, "pane spans", encoder))
        for pipelines, state in drawn:
            pipelines.draw(run, state)
        run.end()
        self.device.submit(encoder)

    def draw(
        self, shafts: "LightShafts", encoder: Any, profile: Profile, color: Any, depth: Any, layer: SceneLayer, timer: Timer | None
    ) -> tuple[Any, SceneLayer]:
        """Records the drawing of what is held onto the picture in its medium: (the picture, its layer)."""
        device, size = self.device, depth.size[:2]
        width, height = size
        if not self._targets or self._targets[0].size[:2] != size:
            kinds = () if blendable(device) == LAYER else (FORMAT, LAYER)
            spare = [device.texture(width, height, kind) for kind in kinds]
            self._targets = device.texture(width, height, blendable(device)), *spare
        picture, *spare = self._targets
        blended, over = spare or (layer.radiance, layer.radiance)
        targets = [{"view": one.create_view(), "load_op": "clear", "store_op": "store"} for one in (picture, blended)]
        extinct = shafts.medium.extinction and layer.transmittance is not None
        formats = "+".join(one.format for one in (picture, *spare[:1]))
        pipeline = device.raster(BEHIND, "cover", "behind" if spare else "picture_behind", formats, MEDIUM=True, EXTINCTION=extinct)
        run = encoder.begin_render_pass(color_attachments=targets[: 1 + bool(spare)], **timing(timer, "merge", encoder))
        run.set_pipeline(pipeline)
        run.set_bind_group(0, device.bind(BEHIND, *shafts.shared(color, depth, layer)))
        run.draw(3)
        run.end()
        divide(encoder)
        # Draw what is held
        private_panes.use_camera(self._camera)
        bound = [device.binding(buffer) for buffer in (self._fog, profile.spans, profile.values)]
        for state, _ in self.held:
            state.bind(*bound)
        targets = [{**target, "load_op": "load"} for target in targets]
        pick = private_panes.pick_attachment(shafts.renderer)
        targets += [pick] if pick is not None else []
        attached = {"view": self._depth_for(depth, encoder).create_view(), "depth_load_op": "load", "depth_store_op": "store"}
        run = encoder.begin_render_pass(color_attachments=targets, depth_stencil_attachment=attached, **timing(timer, "panes", encoder))
        for state, containers in self.held:
            for container in containers:
                container.draw(run, state)
        run.end()
        divide(encoder)
        if spare:
            pipeline = device.pipeline(THROUGH, "through")
            bind = device.bind(THROUGH, layer.radiance, blended, over)
            compute(encoder, pipeline, bind, (-(-width // 8), -(-height // 8)), "panes", timer)
        return picture, SceneLayer(radiance=over, transmittance=layer.transmittance)

    def _depth_for(self, depth: Any, encoder: Any) -> Any:
        """Finds the depth that what is held is tested against: the picture's, or, where some of it writes depth, a copy."""
        if not any(wobject.material.depth_write for wobject in self._objects):
            return depth
        if self._depth is None or self._depth.size != depth.size:
            usage = depth.usage | self.device.wgpu.TextureUsage.COPY_DST
            self._depth = self.device.device.create_texture(size=depth.size, format=depth.format, usage=usage)
        encoder.copy_texture_to_texture({"texture": depth}, {"texture": self._depth}, depth.size)
        return self._depth


_SPAN = {split: private_panes.code_of("pygfx/pane_span.wgsl", PANE_SPLIT=str(split).lower()) for split in (False, True)}
_OPAQUE = private_panes.code_of("pygfx/pane_opaque.wgsl")


def _fogged(base: Any, mode: int, split: bool, device: Device) -> Any:
    code = private_panes.code_of("pygfx/pane_fog.wgsl", PANE_MODE=f"{mode}u", PANE_SPLIT=str(split).lower())
    return private_panes.State(base, _Fogged(base.blender, mode, blendable(device)), code, (UNIFORM, STORAGE, STORAGE))
