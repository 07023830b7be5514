"""Draws the occlusion pre-pass (GPU Gems 3, 13.5.1): the scene once more, occluders black and untextured, emitters and sky bright.

pygfx's own pipelines draw it, so that poses, instances, maps and whatever a user changes are followed; but what becomes of a fragment is
said here, and lights, shadows, sorting and post-processing are left out. Nothing of the scene is touched.
"""

import math
import weakref
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import numpy as np
import pygfx as gfx

from airlight.colour import srgb_decode
from airlight.gpu.device import Device
from airlight.gpu.structs import struct_dtype
from airlight.gpu.timing import Timer, timing
from airlight.options import SceneOptions
from airlight.options.scene import RESOLUTION
from airlight.projection import pixel_rays, project
from airlight.pygfx import private
from airlight.pygfx.lights import SceneLight

FORMAT, DEPTH = "rgba16float", "depth32float"
MAX_DISCS = 8  # discs, as in discs.wgsl
EMITTER_RADIANCE = 1.0  # emission beyond which a material is a light
DISCS = struct_dtype("pygfx/discs.wgsl", "Discs")
KEPT = {"operation": "add", "src_factor": "zero", "dst_factor": "one"}  # alpha


class Silhouette(private.MeshShader):  # type: ignore[misc]
    """Draws a mesh without light; also without its map and vertex colours, where these have no say in its opacity."""

    def __init__(self, wobject: Any) -> None:
        super().__init__(wobject)
        self["receive_shadow"] = self["flat_shading"] = False
        if wobject.material.color_mode in ("auto", "uniform") and not pattern(wobject, wobject.material):
            self["color_mode"], self["use_map"], self["use_vertex_color"] = "uniform", False, False


class Unlit(private.MeshShader):  # type: ignore[misc]
    """Draws a mesh in its own colours, without light."""

    def __init__(self, wobject: Any) -> None:
        super().__init__(wobject)
        self["receive_shadow"] = self["flat_shading"] = False


def silhouette(wobject: Any) -> Any:
    made: Any = private.shader_of(wobject)
    plain = getattr(made, "get_code", None) is private.MeshShader.get_code and issubclass(made, private.MeshShader)
    return Silhouette(wobject) if plain else made(wobject)


def _own(wobject: Any) -> Any:
    return private.shader_of(wobject)(wobject)


class Role(private.Blender):
    """Says how objects of one kind are put into the source.

    shaders: of an object. occludes: it darkens what is there by its opacity, or else covers it by its colour. writes: to the depth
    buffer; None: as its material says.
    """

    def __init__(self, name: str, shaders: Any, *, occludes: bool = False, writes: bool | None = None) -> None:
        super().__init__(name, "pygfx/drawn.wgsl")
        self.shaders, self.occludes, self.writes = shaders, occludes, writes

    def get_color_descriptors(self, pick: bool, alpha: dict[str, Any]) -> list[dict[str, Any]]:
        source, target, operation = blending(alpha)
        color = {"operation": operation, "src_factor": "zero" if self.occludes else source, "dst_factor": target}
        return [{"format": FORMAT, "blend": {"color": color, "alpha": KEPT}, "write_mask": 15}]

    def get_depth_descriptor(self, test: bool, compare: str, write: bool) -> dict[str, Any]:
        names = {"<": "less", "<=": "less-equal", "==": "equal", "!=": "not-equal", ">=": "greater-equal", ">": "greater"}
        written = write if self.writes is None else self.writes
        return {"format": DEPTH, "depth_write_enabled": written, "depth_compare": names[compare] if test else "always"}


def blending(alpha: dict[str, Any]) -> tuple[str, str, str]:
    """Finds (factor of the fragment, factor of what is there, operation) that a material's alpha_config means; alpha is its opacity."""
    method = alpha["method"]
    if method == "opaque" or alpha.get("alpha", "alpha") not in ("alpha", "use_alpha"):  # weighted, but solid
        return ("src-alpha" if alpha.get("premultiply_alpha") else "one"), "zero", "add"
    if method == "blended":
        return alpha["color_src"], alpha["color_dst"], alpha.get("color_op", "add")
    return "src-alpha", "one-minus-src-alpha", "add"


# In the order in which they are drawn: nothing within a role depends on order, but for lights that are seen through.
SKY = Role("sky", _own)
SOLID = Role("solid", silhouette, occludes=True, writes=True)
EMITTER = Role("lamp", _own, writes=True)
SHAPE = Role("shape", Unlit, writes=True)  # an emitter whose material waits for other lights: its colour is taken for its light
GLOW = Role("glow", _own)
VEIL = Role("veil", silhouette, occludes=True, writes=False)
ROLES = (SKY, SOLID, EMITTER, SHAPE, GLOW, VEIL)


def pattern(wobject: Any, material: Any) -> bool:
    """Tells whether a map or vertex colours may have a say in a mesh's opacity, or its colour in what is seen through it."""
    config = material.alpha_config
    method = config["method"]
    if method == "blended" and "alpha" not in config["color_dst"]:
        return True
    if (method == "opaque" or config["mode"] == "weighted_solid") and not private.alpha_tested(material):
        return False
    map, colors = getattr(material, "map", None), getattr(wobject.geometry, "colors", None)
    if map is not None and private.channels(map.texture) in (2, 4):
        return True
    return colors is not None and private.channels(colors) in (2, 4)


def solid(wobject: Any, material: Any) -> bool:
    """Tells whether nothing is seen through a mesh, but for holes that an alpha test cuts."""
    if material.alpha_method == "opaque":
        return True
    if material.alpha_mode != "auto" or material.opacity < 1 or pattern(wobject, material):
        return False
    color = getattr(material, "color", None)
    return color is None or color.a >= 1


def strength(material: Any) -> float | None:
    """Finds the greatest component of the linear radiance that a material emits, maps aside; None where it needs no light to be seen."""
    color = getattr(material, "emissive", None)
    return None if color is None else max(color.to_physical()[:3]) * getattr(material, "emissive_intensity", 1.0)


def margin(inside: int, room: int, positions: Sequence[float]) -> float:
    """Chooses the texels before the view, of `room` texels around its `inside` ones, so that the source reaches to lights at
    normalised positions.

    Rays from the view end at the lights: what lies on the other side is never summed. The first light stays at the centre of a texel, or
    what hides it would be cut otherwise from frame to frame, as a camera turns; on a half-sized source that is what flickers most.
    """
    if not positions or not room:
        return room / 2
    before = max(0.0, *(-position * inside for position in positions))
    after = max(0.0, *((position - 1) * inside for position in positions))
    spare = room - before - after
    start = before + spare / 2 if spare >= 0 else room * before / (before + after)
    off = (start + positions[0] * inside - 0.5) % 1.0
    return start - off if start >= off else start - off + 1


def _helps(wobject: Any) -> bool:
    return type(wobject).__module__.startswith("pygfx.helpers")


def shown(scene: Any, exclude: Iterable[Any] = ()) -> Iterator[Any]:
    """Finds all objects that are visible, but pygfx's helpers and what is excluded, with what is below them."""
    excluded = {id(thing) for thing in exclude}
    left = [scene]
    while left:
        thing = left.pop()
        if thing.visible and id(thing) not in excluded and not _helps(thing):
            yield thing
            left += reversed(thing.children)


class Prepass:
    """Draws the source of the sum from a scene, for a picture of size (width, height) pixels.

    lights: their targets, where emitters, keep their colour, as do backgrounds, opaque meshes that write no depth, and materials that emit
    more than EMITTER_RADIANCE; discs of lights that have a size are drawn where nothing is. Other meshes are black, by their opacity where
    one sees through them. Lines, points, text, pygfx's helpers and what else is no mesh is left out. exclude, include: objects that, with
    their children, hide nothing, or do though they are no meshes; the nearest counts.

    renderer, scene, lights, size, in_scene, exclude, include may be set at any time.
    texture: rgba16float, linear; view: (x, y, width, height) of the picture in it, texels; both change with the settings.
    """

    def __init__(
        self,
        renderer: Any,
        scene: Any,
        lights: Sequence[SceneLight],
        size: tuple[int, int],
        in_scene: SceneOptions | None = None,
        exclude: Iterable[Any] = (),
        include: Iterable[Any] = (),
    ) -> None:
        self.renderer, self.scene, self.lights = renderer, scene, lights
        self.size, self.in_scene = size, in_scene or SceneOptions()
        self.exclude, self.include = exclude, include
        self.device = Device.of(renderer.device)
        self.texture: Any = None
        self.view = (0.0, 0.0, 0.0, 0.0)
        self._depth: Any = None
        self._views: Any = None
        self._made: Any = weakref.WeakKeyDictionary()  # object -> material -> role -> its pipelines
        self._states: dict[Role, Any] = {}
        self._discs: Any = None  # pipeline, bind group, buffer

    def _fit(self, camera: Any) -> None:
        """Have textures of the size that the settings ask for, and the view where the lights want it."""
        view = [max(1, round((self.in_scene.resolution or RESOLUTION) * n)) for n in self.size]
        room = [2 * math.ceil((self.in_scene.region - 1) / 2 * n - 1e-6) for n in view]
        whole = view[0] + room[0], view[1] + room[1]
        if self.texture is None or self.texture.size[:2] != whole:
            wgpu = self.device.wgpu
            self.texture = self.device.texture(*whole, FORMAT)
            usage = wgpu.TextureUsage.RENDER_ATTACHMENT
            self._depth = self.device.device.create_texture(size=(*whole, 1), format=DEPTH, usage=usage)
            self._views = self.texture.create_view(), self._depth.create_view()
        found = [project(light.homogeneous(), camera.view_matrix, camera.projection_matrix) for light in self.lights]
        x, y = (margin(view[i], room[i], [at.position[i] for at in found if at.fade > 0]) for i in (0, 1))
        self.view = x, y, float(view[0]), float(view[1])

    def _roles(self) -> Iterator[tuple[Role, Any]]:
        """Finds (role, object) of all that is drawn."""
        emitters = {id(light.target) for light in self.lights if light.emitter and light.target is not None}
        marks = {id(ob): True for ob in self.include} | {id(ob): False for ob in self.exclude}
        left: list[tuple[Any, bool | None]] = [(self.scene, None)]
        while left:
            wobject, mark = left.pop()
            if not wobject.visible:
                continue
            mark = marks.get(id(wobject), False if _helps(wobject) and mark is None else mark)
            left += [(child, mark) for child in reversed(wobject.children)]
            if wobject.material is not None:
                role = self._role(wobject, wobject.material, id(wobject) in emitters, mark)
                if role is not None:
                    yield role, wobject

    def _role(self, wobject: Any, material: Any, emitter: bool, mark: bool | None) -> Role | None:
        if isinstance(wobject, gfx.Background):
            return SKY if mark is not False and self.in_scene.clear is None else None
        mesh = isinstance(wobject, gfx.Mesh)
        if not emitter:
            if mark is False or (mark is None and not mesh):
                return None
            sky = material.alpha_method == "opaque" and not material.depth_write
            emitter = mesh and (sky or (strength(material) or 0.0) > EMITTER_RADIANCE)
        whole = mesh and solid(wobject, material)
        if not emitter:
            return SOLID if whole else VEIL
        if not whole:
            return GLOW
        return SHAPE if strength(material) == 0 else EMITTER

    def draw(self, camera: Any, timer: Timer | None = None) -> None:
        """Draw and submit what `camera` sees, and beyond it as far as the region reaches."""
        self._fit(camera)
        found: dict[Role, list[Any]] = {role: [] for role in ROLES}
        for role, wobject in self._roles():
            private.update_object(wobject)
            made = self._made.setdefault(wobject, weakref.WeakKeyDictionary()).setdefault(wobject.material, {})
            if role not in made:
                made[role] = private.Pipelines(role.shaders)
            found[role].append((wobject, made[role]))
        projection = self._look(camera)
        for role, drawn in found.items():
            if drawn:
                self._states[role] = private.unlit(role)
                for wobject, pipelines in drawn:
                    pipelines.update(wobject, self._states[role])
                    for bake in pipelines.bakes:
                        bake(wobject, camera, self.renderer.logical_size)
        private.upload()
        discs = self._aim(camera, projection)

        encoder = self.device.encoder()
        run = encoder.begin_render_pass(**self._attachments(), **timing(timer, "prepass", encoder))
        for role, drawn in found.items():
            if role is VEIL and discs:
                self._draw_discs(run)
            for _, pipelines in drawn:
                pipelines.draw(run, self._states[role])
        run.end()
        self.device.submit(encoder)

    def _attachments(self) -> dict[str, Any]:
        clear = [0.0, 0.0, 0.0]
        if self.in_scene.clear is not None:
            clear = srgb_decode(np.array([int(self.in_scene.clear[i : i + 2], 16) for i in (1, 3, 5)]) / 255).tolist()
        color, depth = self._views
        return {
            "color_attachments": [{"view": color, "load_op": "clear", "store_op": "store", "clear_value": (*clear, 1.0)}],
            "depth_stencil_attachment": {
                "view": depth,
                "depth_clear_value": 1.0,
                "depth_load_op": "clear",
                "depth_store_op": "discard",
            },
        }

    def _look(self, camera: Any) -> Any:
        """Let pygfx's shaders look through the camera and beyond its borders; (4, 4) its projection."""
        x, y, width, height = self.view
        whole = self.texture.size[:2]
        scale = width / whole[0], height / whole[1]
        shift = (2 * x + width) / whole[0] - 1, 1 - (2 * y + height) / whole[1]  # of the view's centre
        into = np.diag([*scale, 1.0, 1.0])
        into[:2, 3] = shift
        projection = into @ np.asarray(camera.projection_matrix, np.float64)
        a, b, c, d = private.view_offset(camera)
        logical = np.asarray(self.renderer.logical_size, float)
        private.write_camera(
            camera,
            projection_transform=projection.T,
            projection_transform_inv=np.linalg.inv(projection).T,
            ndc_offset=(a / scale[0], b / scale[1], c - a * shift[0] / scale[0], d - b * shift[1] / scale[1]),
            physical_size=whole,
            logical_size=logical / np.array(scale),
        )
        return projection

    def _aim(self, camera: Any, projection: Any) -> bool:
        """Send where discs are; whether there are any."""
        sized = [light for light in self.lights if light.disc_half_angle > 0][:MAX_DISCS]
        if not sized or projection[3, 3] != 0:
            return False
        data = np.zeros((), DISCS)
        data["rays"], data["size"] = pixel_rays(projection), self.texture.size[:2]
        texel = abs(data["rays"][1]) / self.texture.size[1]
        matrix = np.asarray(camera.view_matrix, np.float64)
        for light in sized:
            at = (matrix @ light.homogeneous())[:3]
            distance = np.linalg.norm(at)
            if distance > 0:
                disc, half = data["disc"][data["count"]], math.radians(light.disc_half_angle)
                disc["direction"], disc["cosine"], disc["soft"] = at / distance, math.cos(half), max(math.sin(half) * texel, 1e-9)
                data["count"] += 1
        if self._discs is None:
            self._discs = self._disc_pipeline()
        self.device.queue.write_buffer(self._discs[2], 0, data.tobytes())
        return bool(data["count"])

    def _disc_pipeline(self) -> tuple[Any, Any, Any]:
        brighter = {"operation": "max", "src_factor": "one", "dst_factor": "one"}
        pipeline = self.device.raster(
            "pygfx/discs.wgsl",
            "cover_far",
            "disc",
            FORMAT,
            blend={"color": brighter, "alpha": KEPT},
            depth={"format": DEPTH, "depth_write_enabled": False, "depth_compare": "less-equal"},
        )
        buffer = self.device.buffer(size=DISCS.itemsize, uniform=True)
        return pipeline, self.device.bind("pygfx/discs.wgsl", buffer), buffer

    def _draw_discs(self, run: Any) -> None:
        pipeline, bind, _ = self._discs
        run.set_pipeline(pipeline)
        run.set_bind_group(0, bind)
        run.draw(3)
