"""The pass: from a renderer's picture and depth to the picture with its shafts."""

import math
import weakref
from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import msgspec
import numpy as np
import pygfx as gfx
import wgpu

from airlight.colour import srgb_decode
from airlight.errors import AirlightError
from airlight.gpu.device import Device
from airlight.gpu.structs import struct_dtype
from airlight.gpu.timing import Timer, compute, timing
from airlight.lights import Light
from airlight.medium.resolve import ResolvedMedium, resolve
from airlight.options import Composite, March, Medium, Parameters, SceneOptions
from airlight.projection import Projected, depth_terms, pixel_rays, project
from airlight.pygfx.casters import Casters
from airlight.pygfx.lights import BODY, SceneLight
from airlight.pygfx.prepass import Prepass
from airlight.pygfx.private import use_hdr
from airlight.pygfx.punctual import punctual_lights
from airlight.scatter.methods import METHODS, check_ray
from airlight.scatter.render import Moving
from airlight.shadows import fit

MASK, LOOK, BALANCE, MERGE = (f"pygfx/{name}.wgsl" for name in ("mask", "look", "balance", "merge"))
MOST = 8  # lights, as in view.wgsl
SHOWN = {None: 0, "occlusion": 1, "source": 2, "lines": 3}
SAMPLED = 14400  # pixels that are measured, about
VIEW = struct_dtype("pygfx/view.wgsl", "View")
Region = tuple[float, float, float, float]
WHOLE: Region = (0.0, 0.0, 1.0, 1.0)


@lru_cache(maxsize=4)
def _device(device: Any) -> Device:
    """One cache of pipelines for each device."""
    return Device(device)


def enable_timing() -> bool:
    """Let pygfx's device measure times, for `profile`; called before anything of pygfx is on the GPU. False: too late, or none can."""
    adapter = wgpu.gpu.request_adapter_sync(power_preference="high-performance")
    if "timestamp-query" not in adapter.features:
        return False
    try:
        gfx.renderers.wgpu.enable_wgpu_features("timestamp-query")
    except RuntimeError:  # the device is there already
        return False
    return True


class _Textures:
    """What the pass holds for one size of the picture: the source, the layer, and the lights' plans over them."""

    def __init__(self, device: Device, source: Any, p: Parameters, apron: int) -> None:
        width, height = source.size[0] - 2 * apron, source.size[1] - 2 * apron
        self.source = source
        self.layer = device.texture(width, height, "rgba16float")
        self.moving = Moving(device, (width, height), p, source, self.layer)
        self.aimed: Any = None  # what `moving` was last aimed at

    def record(self, encoder: Any, lights: list[Light], p: Parameters, timer: Timer | None) -> None:
        if self.aimed != (lights, p):
            self.moving.aim(lights, p)
            self.aimed = lights, p
        self.moving.record(encoder, timer)


class _World:
    """What the pass holds for a method that lights a medium: the shadow maps' casters, and the march over one size of the picture."""

    def __init__(self, device: Device, scene: Any, method: str, size: tuple[int, int]) -> None:
        self.asked = method, size
        self.casters = Casters(device, scene)
        self.march: Any = METHODS[method].plan(device, size)


class LightShafts(gfx.renderers.wgpu.EffectPass):
    """Light shafts on what a gfx.WgpuRenderer renders: a pass for its `effect_passes`, one instance for each place there.

    scene and camera: those that are rendered. lights: at most 8. parameters: how the shafts are summed (its occlusion, threshold,
    smoothness and scale mean nothing here); composite: its mix and adapt; in_scene: the rest. All may be set at any time.
    exclude, include: objects that hide nothing, or do although they are seen through; with occluders prepass.
    medium, march: with methods that light a medium, through shadow maps; of `in_scene` these take the resolution and the
    tones, of `exclude` what casts no shadow.

    lights, parameters, composite, in_scene, exclude, include, medium, march; `radius`: metres of a sphere around the scene, from which
    unset parts of the medium follow; None: around what casts shadows; `enabled`: False costs nothing; `dt`: seconds since the last frame,
    which light adaptation follows (0: it settles at once); `debug`: None, or occlusion (of a medium: what is seen through it), source (the
    light of the medium) or lines to see instead; `timing`: whether `profile` is wanted. `source`, `layer`: textures of the last frame,
    linear, rgba16float; of a medium, `resolved_medium`, there is no source, and the layer is rgba32float: in-scattered radiance, and the
    length of the ray in the medium, metres; `transmittance`, RGB, belongs to it: None where it is 1 everywhere. `region`: x, y, width,
    height of the view in `source` and `layer`, as parts of them. `statistics`, `levels`: buffers of what occluders by contrast and
    adaptation measured, as look.wgsl and balance.wgsl list them. Raises AirlightError.
    """

    USES_DEPTH = True

    def __init__(
        self,
        renderer: Any,
        scene: Any,
        camera: Any,
        lights: Sequence[SceneLight] | SceneLight,
        parameters: Parameters | None = None,
        composite: Composite | None = None,
        in_scene: SceneOptions | None = None,
        *,
        medium: Medium | None = None,
        march: March | None = None,
        exclude: Sequence[Any] = (),
        include: Sequence[Any] = (),
    ) -> None:
        super().__init__()
        self.renderer, self.scene, self.camera = renderer, scene, camera
        self.lights = [lights] if isinstance(lights, SceneLight) else list(lights)
        self.parameters = parameters or Parameters()
        self.composite, self.in_scene = composite or Composite(), in_scene or SceneOptions()
        self.medium, self.march = medium or Medium(), march or March()
        self.exclude, self.include = list(exclude), list(include)
        self.radius: float | None = None
        self.debug: str | None = None
        self.dt, self.timing = 0.0, False
        self.device = _device(renderer.device)
        self._view = np.zeros((), VIEW)
        self._uniform = self.device.buffer(size=VIEW.itemsize, uniform=True)
        self.statistics, self.levels = self.device.buffer(size=32), self.device.buffer(size=32)
        self._binds: dict[Any, Any] = {}
        self._textures: _Textures | None = None
        self._world: _World | None = None
        self._resolved: ResolvedMedium | None = None
        self._prepass: Prepass | None = None
        self._laid_out: Any = None
        self._timer: Timer | None = None
        self._encoder: Any = None  # which was recorded on last
        self.region = WHOLE
        self._settled = False  # whether adaptation has begun

    @property
    def parameters(self) -> Parameters:
        return self._parameters

    @parameters.setter
    def parameters(self, parameters: Parameters) -> None:
        check_ray(parameters.method, parameters.density)
        self._parameters = parameters if parameters.scale == 1.0 else msgspec.structs.replace(parameters, scale=1.0)

    @property
    def _summed(self) -> Parameters:
        """The parameters of the sum: a pre-pass has no apron, since it sees beyond the view."""
        p = self.parameters
        drawn = self.in_scene.occluders == "prepass" and p.border != "clamp"
        return msgspec.structs.replace(p, border="clamp") if drawn else p

    @property
    def source(self) -> Any:
        """What was summed, or None before the first frame, and where a medium is lit."""
        return self._textures.source if self._textures else None

    @property
    def layer(self) -> Any:
        """The shafts alone, at the resolution of the source, of a medium at that of the picture; None before the first frame."""
        if self._world:
            return self._world.march.layer
        return self._textures.layer if self._textures else None

    @property
    def transmittance(self) -> Any:
        """RGB, 0..1, of the medium of the last frame: what it lets through of each surface's radiance; None where that is all."""
        return self._world.march.transmittance if self._world else None

    @property
    def resolved_medium(self) -> ResolvedMedium | None:
        """The medium of the last frame, with nothing unset; None where none is lit."""
        return self._resolved if self._world else None

    def profile(self) -> list[tuple[str, float]]:
        """(label, ms) of each pass of the last frame, if `timing` was set then; empty where the device has no timestamps, see
        `enable_timing`. Waits for the frame."""
        return self._timer.milliseconds() if self._timer else []

    def render(self, command_encoder: Any, color_tex: Any, depth_tex: Any, target_tex: Any) -> None:
        """Record the passes, as EffectPass.render: from color_tex and depth_tex to target_tex, texture views."""
        if self._encoder is not None and self._encoder() is command_encoder:
            raise AirlightError("one LightShafts stands twice in effect_passes: make an instance for each place")
        self._encoder = weakref.ref(command_encoder)
        timer = self._begin_timing()
        color, depth = color_tex.texture, depth_tex.texture
        size: tuple[int, int] = color.size[:2]
        lit = self._project(size)
        if METHODS[self.parameters.method].lights_medium:
            self._light_medium(command_encoder, color, depth, target_tex, timer)
        else:
            self._sum_picture(command_encoder, color, depth, target_tex, lit, timer)
        if timer:
            timer.resolve(command_encoder)

    def _sum_picture(
        self, command_encoder: Any, color: Any, depth: Any, target: Any, lit: list[tuple[SceneLight, Projected]], timer: Timer | None
    ) -> None:
        """Record a method that works on the picture."""
        size: tuple[int, int] = color.size[:2]
        if self._world:
            self._world = None
            self._binds.clear()
        made, region = self._sources(size, bool(lit), timer)
        self._write(region)
        passes = self._passes(size, bool(lit), target.texture.format)
        binds = self._bound(color, depth, made)
        if lit:
            self._emit(command_encoder, passes, binds, made, timer)
            made.record(command_encoder, self._in_source(lit, region), self._summed, timer)
        elif made.aimed and made.aimed[0]:  # or the layer would go on holding shafts
            made.record(command_encoder, [], self._summed, timer)
        self._put(command_encoder, passes, binds, target, timer)

    def _light_medium(self, command_encoder: Any, color: Any, depth: Any, target: Any, timer: Timer | None) -> None:
        """Record a method that lights a medium; its shadow maps are drawn and submitted before."""
        size: tuple[int, int] = color.size[:2]
        p, world = self.parameters, self._world
        if world is None or world.asked != (p.method, size):
            self._textures = self._prepass = self._laid_out = None
            self._binds.clear()
            world = self._world = _World(self.device, self.scene, p.method, size)
        casters = world.casters
        casters.scene, casters.lights, casters.exclude = self.scene, self.lights, self.exclude
        gathered = casters.gather()
        radius = fit.ball(gathered[1])[1] if self.radius is None else self.radius
        resolved = self._resolved = world.march.resolve(resolve(self.medium, self.march, p.quality, radius or 1.0))
        view, projection = (np.asarray(m, np.float64) for m in (self.camera.view_matrix, self.camera.projection_matrix))
        shining = punctual_lights(self.lights)
        shadows = casters.draw(view, projection, shining, resolved, timer, gathered)
        pairs = list(zip(shining, shadows, strict=True))
        share = {"share": self.in_scene.share(p)} if "resolution" in METHODS[p.method].options else {}  # which has the picture's resolution
        world.march.aim(view, projection, pairs, resolved, jitter=p.offset, **share)
        self._write(WHOLE)
        device, step = self.device, self.measured_step(size)
        merging = {"WORLD": True, "EXTINCTION": self.medium.extinction and self.transmittance is not None}
        passes = {
            "measure": device.pipeline(BALANCE, "measure", STEP=step, **merging),
            "merge": device.raster(MERGE, "cover", "merge", target.texture.format, **merging, **self._last()),
        }
        binds = self._bound(color, depth, None)
        world.march.record(command_encoder, depth, timer)
        self._put(command_encoder, passes, binds, target, timer)

    def _begin_timing(self) -> Timer | None:
        if not self.timing:
            return None
        if self._timer is None:
            self._timer = Timer(self.device)
        self._timer.labels.clear()
        return self._timer

    def _project(self, size: tuple[int, int]) -> list[tuple[SceneLight, Projected]]:
        """The lights whose shafts are seen; and all the shaders need of the camera and of every light."""
        if len(self.lights) > MOST:
            raise AirlightError(f"{len(self.lights)} lights in LightShafts: at most {MOST}")
        camera, view = self.camera, self._view
        matrix, projection = np.asarray(camera.view_matrix, np.float64), np.asarray(camera.projection_matrix, np.float64)
        view["rays"], view["depth"], view["pixels"] = pixel_rays(projection), depth_terms(projection), size
        perspective = projection[3, 3] == 0
        texel = abs(view["rays"][1]) / max(1.0, self.in_scene.share(self.parameters) * size[1])  # its angle, at the view's axis
        lit: list[tuple[SceneLight, Projected]] = []
        cones = 0
        for light in self.lights:
            light.check()
            found = project(light.homogeneous(), matrix, projection)
            rgb = light.seen((0, 0)).rgb
            if found.fade * max(rgb) > 0:
                at = view["aim"][len(lit)]
                at["direction"], at["fade"], at["color"] = found.direction, found.fade, rgb
                lit.append((light, found))
            body = light.body() if perspective else None
            if perspective and cones < MOST and (body or (light.size > 0 and found.fade > 0)):
                _cone(view["cone"][cones], light, body, found, matrix, float(texel))
                cones += 1
        view["counts"] = cones, len(lit)
        view["aim"]["fade"][len(lit) :] = 0
        return lit

    def _sources(self, size: tuple[int, int], lit: bool, timer: Timer | None) -> tuple[_Textures, Region]:
        """The textures for a picture of this size, made anew where it or settings have changed; and where the view lies in them."""
        p, scene = self._summed, self.in_scene
        share = scene.share(p)
        texels = max(1, round(share * size[0])), max(1, round(share * size[1]))
        apron, source = (1 if p.border == "black" else 0), None
        if scene.occluders == "prepass":
            if lit:
                source, self.region = self._drawn(size, timer)
        else:
            self.region = WHOLE
        made = self._textures
        kept = made is not None and (source is made.source if source is not None else not lit or self._laid_out == (texels, apron))
        if made is None or not kept:
            if source is None:
                source = self.device.texture(texels[0] + 2 * apron, texels[1] + 2 * apron, "rgba16float")
            self._binds.clear()
            made = self._textures = _Textures(self.device, source, p, apron)
            self._laid_out = None if scene.occluders == "prepass" else (texels, apron)  # whose texture is another's
        view = self._view
        view["texels"], view["apron"] = texels, apron
        view["ratio"], view["pixel"] = np.array(size) / texels, 1 / np.array(size)
        return made, self.region

    def _drawn(self, size: tuple[int, int], timer: Timer | None) -> tuple[Any, Region]:
        """The source that the pre-pass draws, for a picture of this size; and where the view lies in it."""
        if self._prepass is None:
            self._prepass = Prepass(self.renderer, self.scene, self.lights, size)
        drawn = self._prepass
        drawn.scene, drawn.lights, drawn.size, drawn.in_scene = self.scene, self.lights, size, self.in_scene
        drawn.exclude, drawn.include = self.exclude, self.include
        drawn.draw(self.camera, timer)
        x, y, width, height = drawn.view
        across, down, _ = drawn.texture.size
        return drawn.texture, (x / across, y / down, width / across, height / down)

    def _in_source(self, lit: list[tuple[SceneLight, Projected]], region: Region) -> list[Light]:
        """The lights as the source sees them."""
        left, top, width, height = region
        places = [(left + width * at.position[0], top + height * at.position[1]) for _, at in lit]
        return [light.seen(place, at.fade) for place, (light, at) in zip(places, lit, strict=True)]

    def _write(self, region: Region) -> None:
        """Send what the shaders read."""
        view, scene = self._view, self.in_scene
        view["region"] = region
        if scene.clear is not None:
            view["clear"] = srgb_decode(np.array([int(scene.clear[i : i + 2], 16) for i in (1, 3, 5)]) / 255)
        view["mix"] = 1.0 if self.composite.mix is None else self.composite.mix
        view["reach"], view["adapt"] = scene.depth_aware, self.composite.adapt
        settle = not self._settled or self.dt <= 0 or scene.adapt_seconds == 0
        view["follow"] = 1.0 if settle else -math.expm1(-self.dt / scene.adapt_seconds)
        self.device.queue.write_buffer(self._uniform, 0, view.tobytes())

    def _flags(self) -> dict[str, Any]:
        return {"CONES": int(self._view["counts"][0]), "CLEAR": self.in_scene.clear is not None and self.in_scene.occluders == "stencil"}

    def _last(self) -> dict[str, Any]:
        """The constants of the last pass, which puts everything on the picture."""
        return {"ADAPT": self.composite.adapt > 0, "FILMIC": self.in_scene.tone == "filmic", "SHOW": SHOWN[self.debug]}

    def measured_step(self, size: tuple[int, int]) -> int:
        """Choose every how many-th row and column is measured, of a picture of this size."""
        return max(1, int(math.sqrt(size[0] * size[1] / SAMPLED)))

    def _passes(self, size: tuple[int, int], lit: bool, format: str) -> dict[str, Any]:
        """The pipelines for the settings as they are; each is compiled once."""
        scene = self.in_scene
        contrast = scene.occluders == "contrast"
        ratio = size[0] / self._view["texels"][0]
        taps = 1 if ratio < 4 / 3 else 2 if ratio < 3 else 4
        merging = {"CONTRAST": contrast, "GATHER": scene.depth_aware > 0}
        device, flags, step = self.device, self._flags(), self.measured_step(size)
        last = {**merging, **self._last()}
        both = [device.raster(MERGE, "cover", "merge", format, LIT=on, **last) for on in (False, True)]  # before one is wanted
        return {
            "mask": device.pipeline(MASK, "mask", TAPS=taps, CONTRAST=contrast, **flags),
            "look": device.pipeline(LOOK, "look", STEP=step, **flags),
            "measure": device.pipeline(BALANCE, "measure", STEP=step, LIT=lit, **merging),
            "merge": both[lit],
        }

    def _bound(self, color: Any, depth: Any, made: _Textures | None) -> dict[str, Any]:
        """The bind groups for the renderer's textures, made once for each of the two that it draws on in turn; without `made`, of a medium,
        whose shaders read neither source nor sums: the picture stands there."""
        key = id(color), id(depth), id(self.layer)
        if key not in self._binds:
            if len(self._binds) > 3:
                self._binds.clear()
            device, shared = self.device, (self._uniform, color, depth)
            source, layer, scattered = (made.source, made.layer, color) if made else (color, color, self.layer)
            transmittance = color if self.transmittance is None else self.transmittance
            after = (*shared, layer, device.sampler(), self.statistics, scattered, self.levels, transmittance)
            # all are held, so that no id is used again
            self._binds[key] = {"": after, "measure": device.bind(BALANCE, *after), "merge": device.bind(MERGE, *after, source)}
            if made:
                self._binds[key] |= {
                    "mask": device.bind(MASK, *shared, source, self.statistics, device.sampler("nearest"), device.sampler()),
                    "look": device.bind(LOOK, *shared, self.statistics),
                }
        found: dict[str, Any] = self._binds[key]
        return found

    def _emit(self, encoder: Any, passes: dict[str, Any], binds: dict[str, Any], made: _Textures, timer: Timer | None) -> None:
        """Record the source, where it is made of the picture."""
        if self.in_scene.occluders == "contrast":
            compute(encoder, passes["look"], binds["look"], (1, 1), "look", timer)
        if self.in_scene.occluders != "prepass":
            width, height, _ = made.source.size
            compute(encoder, passes["mask"], binds["mask"], (-(-width // 64), -(-height // 8)), "mask", timer)

    def _put(self, encoder: Any, passes: dict[str, Any], binds: dict[str, Any], target: Any, timer: Timer | None) -> None:
        """Record adaptation and the merge."""
        if self.composite.adapt > 0:
            compute(encoder, passes["measure"], binds["measure"], (1, 1), "adapt", timer)
            self._settled = True
        attachment = {"view": target, "load_op": "clear", "store_op": "store", "clear_value": (0, 0, 0, 1)}
        run = encoder.begin_render_pass(color_attachments=[attachment], **timing(timer, "merge", encoder))
        run.set_pipeline(passes["merge"])
        run.set_bind_group(0, binds["merge"])
        run.draw(3)
        run.end()


def _cone(record: Any, light: SceneLight, body: Any, found: Projected, matrix: Any, texel: float) -> None:
    """Write the record of a light that is a body or has a disc. texel: the angle of one of the source's texels."""
    direction, half, near, far = np.array(found.direction), math.radians(light.size), 0.0, 0.0
    if body:
        centre, radius, solid = body
        at = (matrix @ np.append(centre, 1.0))[:3]
        distance = float(np.linalg.norm(at))
        if distance > radius:
            direction, half = at / distance, math.asin(radius / distance)
        else:  # the eye is in it
            half = math.pi
        near, far = max(distance - BODY * radius, 0.0), distance + BODY * radius if solid else 3e38
    record["direction"], record["cosine"] = direction, math.cos(half)
    record["near"], record["far"] = near, far
    record["sharp"] = 1 / max(math.sin(half) * texel, 1e-9)
    record["disc"] = 1.0 if light.size > 0 else 0.0


def add_light_shafts(renderer: Any, scene: Any, camera: Any, lights: Sequence[SceneLight] | SceneLight, **keywords: Any) -> LightShafts:
    """A LightShafts, put behind the renderer's own effect passes but before its anti-aliasing, on a picture in half floats (`use_hdr`).

    keywords: as LightShafts.
    """
    use_hdr(renderer)
    shafts = LightShafts(renderer, scene, camera, lights, **keywords)
    passes = list(renderer.effect_passes)
    smoothing = [step for step in passes if isinstance(step, gfx.renderers.wgpu.PPAAPass)]
    renderer.effect_passes = [step for step in passes if step not in smoothing] + [shafts, *smoothing]
    return shafts
