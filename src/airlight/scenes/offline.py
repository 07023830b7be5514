"""Stages rendered to arrays: no window, no clock, the same frame for the same time whatever came before."""

from __future__ import annotations

import contextlib
import dataclasses
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import msgspec
import numpy as np
import pygfx as gfx

from airlight.errors import AirlightError
from airlight.lights.punctual import Triple
from airlight.luminance import REC709_F32
from airlight.messages import nearest
from airlight.options import Composite, March, Medium, Parameters, SceneOptions
from airlight.projection import depth_terms, pixel_rays
from airlight.pygfx import LightShafts, SceneLight, use_hdr
from airlight.pygfx.divided import DividedRenderer
from airlight.pygfx.origin import near_origin
from airlight.pygfx.particles import follow, undrawn
from airlight.pygfx.projector import Projector
from airlight.scatter.methods import METHODS
from airlight.scenes.daylight import light_stage
from airlight.scenes.exposure import FAR_STOPS, METERED_WIDTH, STOPS, Exposure, expose, meter
from airlight.scenes.lamps import NamedLight, lighting, named
from airlight.scenes.origin import origin
from airlight.scenes.raised import raised
from airlight.scenes.stage import Stage

FAR_METRES = 1e10  # the depth where nothing is drawn, as Blender writes it; an infinity would spoil a compositor's filters
NEAREST_METRES = 1e-6
LINEAR_FILES = (".exr", ".hdr")  # that hold light, whatever a display can show


@dataclass(frozen=True)
class Shot:
    """Says how a stage is filmed. samples: along each side of a pixel; their mean is the pixel. smooth: edges after that, where tones are.

    camera: one of the stage's by name, None: its first; or eye instead, with target, None: the stage's centre, and fov: degrees, of the
    picture's smaller side. lights: instead of those that the stage has, as `lamps.lighting` takes them.
    """

    width: int
    height: int
    samples: int = 2
    smooth: bool = False
    camera: str | None = None
    eye: Triple | None = None
    target: Triple | None = None
    fov: float = 50.0
    lights: tuple[SceneLight | NamedLight | Projector, ...] = ()


@dataclass
class Frame:
    """Holds one frame as it was read back, with samples x samples of its pixels for one of the result.

    picture: (H, W, 4) half floats, linear: light, or what a display shows. terms, rays: `depth_terms` and `pixel_rays` of the camera.
    mix, reach: of the shafts. scale: factor of its radiances for the scene's, a power of 2; 1 where the picture is what a display shows.
    depth: (H, W) float32, 0..1. layer, source: (h, w, 4) half floats, at their own resolution; in the layer
    the view fills `region` (left, top, width, height, of 1). Of a medium that is lit the layer is (H, W, 4) float32: in-scattered radiance,
    and metres of the ray in it; layer_scale: as scale, of layer and source; exposure: factor of the scene's
    light for a display; layer_transmittance: (H, W, 3) float32 of the same.
    """

    picture: np.ndarray
    samples: int
    terms: np.ndarray
    rays: np.ndarray
    mix: float
    reach: float
    depth: np.ndarray | None = None
    layer: np.ndarray | None = None
    region: tuple[float, float, float, float] = (0.0, 0.0, 1.0, 1.0)
    source: np.ndarray | None = None
    layer_transmittance: np.ndarray | None = None
    scale: float = 1.0
    layer_scale: float = 1.0
    exposure: float = 1.0

    def pixels(self) -> np.ndarray:
        """Returns (height, width, 3) float32; where these are light, what halves do not hold is held at their greatest."""
        found = self.picture[..., :3].astype(np.float32)
        return box(found if self.scale == 1 else np.minimum(found, 65504) * np.float32(self.scale), self.samples)

    def distance(self) -> np.ndarray:
        """Computes (height, width) float32 metres along the view's axis, of a pixel's nearest sample; FAR_METRES where nothing is drawn."""
        assert self.depth is not None
        height, width = self.depth.shape
        n = self.samples
        nearest = self.depth.reshape(height // n, n, width // n, n).min(axis=(1, 3))
        return self.axial(nearest)

    def axial(self, depth: np.ndarray) -> np.ndarray:
        """Computes float32 metres along the view's axis of depths 0..1, an array of any shape; FAR_METRES where nothing is drawn."""
        a, b, c, e = self.terms
        with np.errstate(divide="ignore", invalid="ignore"):
            z = (a * depth.astype(np.float64) + b) / (c * depth.astype(np.float64) + e)
        return np.where(depth >= 1, FAR_METRES, np.clip(np.nan_to_num(z, nan=FAR_METRES), NEAREST_METRES, FAR_METRES)).astype(np.float32)

    def shafts(self) -> np.ndarray:
        """Computes (height, width, 3) float32: what the shafts add to the picture, as `composited` of composite/scene.wgsl; of a medium its
        radiance, whatever the mix."""
        assert self.layer is not None
        if self.layer_transmittance is not None:
            return box(self.layer[..., :3], self.samples) * np.float32(self.layer_scale)
        height, width = self.picture.shape[:2]
        left, top, across, down = self.region
        layer = self.layer[..., :3].astype(np.float32) * np.float32(self.mix * self.layer_scale)
        full = _along(_along(layer, top, down, height, 0), left, across, width, 1)
        if self.reach > 0 and self.depth is not None:
            x = self.rays[0] * (np.arange(width) + 0.5) / width + self.rays[2]
            y = self.rays[1] * (np.arange(height) + 0.5) / height + self.rays[3]
            distance = self.axial(self.depth) * np.sqrt(1 + x * x + (y * y)[:, None])
            full *= np.where(self.depth < 1, 1 - np.exp(-distance / self.reach), 1)[..., None].astype(np.float32)
        return box(full, self.samples)

    def shown(self, light: np.ndarray, path: str) -> np.ndarray:
        """Exposes (H, W, 3) light of the scene for a display, unless a file of this name holds light itself."""
        is_light = self.exposure == 1 or path.lower().endswith(LINEAR_FILES)
        return light if is_light else light * np.float32(self.exposure)

    def transmittance(self) -> np.ndarray | None:
        """Computes (height, width, 3) float32, 0..1: what a medium lets through of what is seen; None where none is lit."""
        return None if self.layer_transmittance is None else box(self.layer_transmittance, self.samples)


def box(values: np.ndarray, n: int) -> np.ndarray:
    """Averages (H n, W n, C) over n x n: (H, W, C)."""
    if n == 1:
        return values
    rows = values.reshape(values.shape[0] // n, n, *values.shape[1:])
    rows = sum((rows[:, i] for i in range(1, n)), rows[:, 0])
    columns = rows.reshape(rows.shape[0], rows.shape[1] // n, n, rows.shape[2])
    result: np.ndarray = sum((columns[:, :, i] for i in range(1, n)), columns[:, :, 0]) / np.float32(n * n)
    return result


def _along(values: np.ndarray, start: float, length: float, count: int, axis: int) -> np.ndarray:
    """Takes `count` linear samples along an axis, over the part of it that begins at `start` and is `length` long, of 1."""
    size = values.shape[axis]
    at = np.clip((start + length * (np.arange(count) + 0.5) / count) * size - 0.5, 0, size - 1)
    low = np.floor(at).astype(int)
    share = (at - low).astype(np.float32).reshape([-1 if i == axis else 1 for i in range(values.ndim)])
    first, second = values.take(low, axis), values.take(np.minimum(low + 1, size - 1), axis)
    return first + (second - first) * share


class _Shafts(LightShafts):
    """LightShafts that remember the depth they were given."""

    depths: Any = None

    def render(self, command_encoder: Any, color_tex: Any, depth_tex: Any, target_tex: Any) -> None:
        self.depths = depth_tex.texture
        super().render(command_encoder, color_tex, depth_tex, target_tex)


class Studio:
    """Films a stage with one renderer. Each frame is settled by itself: light adaptation looks at that frame alone, at its end.

    pre: factor that radiances have in the last frame.
    """

    def __init__(
        self,
        stage: Stage,
        shot: Shot,
        parameters: Parameters | None = None,
        composite: Composite | None = None,
        in_scene: SceneOptions | None = None,
        *,
        medium: Medium | None = None,
        march: March | None = None,
        exclude: Sequence[str] = (),
        linear: bool = False,
        exposure: Exposure | None = None,
        turns: Sequence[float] = (0.0,),
    ) -> None:
        """exclude: names of objects that hide nothing. linear: the picture as light, before exposure and view transform. exposure: instead
        of the automatic one, which is measured; turns: of the camera there, as `frame` has them. Raises AirlightError."""
        self.stage, self.shot = stage, shot
        self._followed = _chosen(stage, shot)
        self.camera = gfx.PerspectiveCamera(shot.fov)
        if self._followed is None:
            _place(self.camera, stage, shot)
        expose(stage, 1.0)
        self._lighting = lighting(stage, shot.lights)
        scene = in_scene or SceneOptions()
        scene = msgspec.structs.replace(scene, view_transform="none", ev=None) if linear else scene
        self.linear = linear
        asked = (in_scene or SceneOptions()).ev
        hidden = [thing for name in exclude for thing in named(stage.scene, name, "--exclude")]
        hidden += [body for body in self._lighting.bodies if all(body is not light.target for light in self._lighting.lights)]
        more: dict[str, Any] = {"medium": medium, "march": march, "exclude": hidden}
        self._described = (parameters or Parameters(), composite, scene), more
        with self._lighting.shining():
            self.exposure = meter(stage, self._metered(turns)) if exposure is None else exposure
            expose(stage, self.exposure.pre)
        self.ev = self.exposure.ev if asked is None else asked
        self.follows = stage.daylight is not None and stage.daylight.span is not None and asked is None and not linear
        self.renderer = make_renderer(shot)
        self.shafts = _Shafts(self.renderer, stage.scene, self.camera, self._lighting.lights, parameters, composite, scene, **more)
        self.shafts.radius, self.shafts.doubts, self.shafts.fields = stage.radius, False, stage.fields
        self.pre = self.shafts.pre_exposure = self.exposure.pre
        self.shafts.automatic_ev = math.log2(self.exposure.pre) if linear else self.exposure.ev
        self.renderer.effect_passes = [self.shafts]
        if shot.smooth and not linear:
            self.renderer.ppaa = "ddaa"  # after the shafts, on tones

    def frame(self, time: float = 0.0, turn: float = 0.0, *, depth: bool = False, layer: bool = False, source: bool = False) -> Frame:
        """Renders the stage at a time (seconds), its camera carried around the stage's centre by a part of a full turn, counter-clockwise
        seen from above. depth, layer, source: read these too. Raises AirlightError, MachineError."""
        if self.stage.pre_exposure != self.pre:  # another studio's is another; the shot's own lamps keep theirs
            expose(self.stage, self.pre)
        with self._lighting.shining():
            self._follow_sun(time)
            self._draw(self.renderer, self.shafts, time, turn)
        shafts, projection = self.shafts, self.camera.projection_matrix
        medium = METHODS[shafts.parameters.method].lights_medium
        reach = 0.0 if medium else shafts.in_scene.depth_aware
        scale = 1 / self.pre
        found = Frame(
            picture=self.renderer.snapshot(),
            samples=self.shot.samples,
            terms=depth_terms(projection),
            rays=pixel_rays(projection),
            mix=1.0 if shafts.composite.mix is None else shafts.composite.mix,
            reach=reach,
            scale=scale if self.linear else 1.0,
            layer_scale=scale,
            exposure=float(2.0 ** (shafts.automatic_ev if self.follows else self.ev)),
        )
        if depth or (layer and reach > 0):
            found.depth = self.depth()
        if layer:
            found.layer, found.region = self.read(shafts.layer, np.float32 if medium else np.float16), shafts.region
            if medium:
                clear = np.ones((*found.layer.shape[:2], 3), np.float32)
                found.layer_transmittance = clear if shafts.transmittance is None else self.read(shafts.transmittance, np.float32)[..., :3]
        if source and not medium:
            found.source = self.read(shafts.source, np.float16)
            if not shafts.is_lit:
                found.source = np.zeros_like(found.source)
        return found

    @contextlib.contextmanager
    def set_up(self) -> Iterator[None]:
        """Let the shot's lamps shine, and bring all near the origin, as for the last frame, while a block lasts."""
        with self._lighting.shining(), self._near():
            yield

    def _near(self) -> contextlib.AbstractContextManager[None]:
        stage = self.stage
        return near_origin(stage.scene, self.camera, origin(stage.center, stage.radius, self.camera), self._lighting.lights)

    def _draw(self, renderer: Any, effect: LightShafts, time: float, turn: float) -> None:
        """Poses the stage and its camera, and renders a frame."""
        self.stage.pose(time, self._followed)
        effect.time = time
        light_stage(self.stage, effect, time, self.exposure.ev if self.follows else None)
        follow((*self.stage.fields, *self.stage.cookies), time, self.stage.fps)
        self._lighting.move()
        self._carry(turn)
        with raised(), self._near(), undrawn(self.stage.fields):
            renderer.render(self.stage.scene, self.camera)

    def _follow_sun(self, time: float) -> None:
        """Scales radiances by what suits a sun that moves, where what suited halfway of its track is far from that: else half floats would
        not hold a night."""
        daylight = self.stage.daylight
        if daylight is None or daylight.span is None:
            return
        daylight.move(self.stage, time, background=False)
        stops = round(min(max(self.exposure.ev + daylight.stops(), STOPS[0]), STOPS[1]))
        pre = 2.0**stops if abs(stops - math.log2(self.exposure.pre)) > FAR_STOPS else self.exposure.pre
        if pre != self.pre:
            expose(self.stage, pre)
            self.pre = self.shafts.pre_exposure = pre
            if self.linear:
                self.shafts.automatic_ev = math.log2(pre)

    def _metered(self, turns: Sequence[float]) -> Callable[[float, float], tuple[np.ndarray, np.ndarray]]:
        """Prepares small pictures of the stage, for `meter`, from the turns of the camera that the shot may have."""
        options, more = self._described
        made: list[tuple[Any, _Shafts]] = []

        def seen(time: float, pre: float) -> tuple[np.ndarray, np.ndarray]:
            if not made:
                shot = self.shot
                height = max(2, round(METERED_WIDTH * shot.height / shot.width))
                small = make_renderer(dataclasses.replace(shot, width=METERED_WIDTH, height=height, samples=1, smooth=False))
                parameters, composite, scene = options
                parameters = msgspec.structs.replace(parameters, quality="draft")
                composite = msgspec.structs.replace(composite or Composite(), adapt=0.0)
                scene = msgspec.structs.replace(scene, view_transform="none", ev=None)
                shafts = _Shafts(small, self.stage.scene, self.camera, self._lighting.lights, parameters, composite, scene, **more)
                shafts.radius, shafts.doubts, shafts.fields = self.stage.radius, False, self.stage.fields
                small.effect_passes = [shafts]
                made.append((small, shafts))
            small, shafts = made[0]
            shafts.pre_exposure, shafts.automatic_ev = pre, math.log2(pre)
            found, drawn = [], []
            for turn in turns:
                self._draw(small, shafts, time, turn)
                found.append(small.snapshot()[..., :3].astype(np.float32) @ REC709_F32)
                daylit = self.stage.daylight is not None
                drawn.append(_read(small, shafts.depths, np.float32)[..., 0] < 1 if daylit else np.ones(found[-1].shape, bool))
            return np.concatenate(found), np.concatenate(drawn)

        return seen

    def depth(self) -> np.ndarray:
        """Reads the last frame's depth: (H, W) float32, 0..1."""
        return self.read(self.shafts.depths, np.float32)[..., 0]

    def surfaces(self) -> np.ndarray:
        """Draw the last frame again without its medium: (H, W, 3) float32, linear, in the scale of the layer."""
        effects, self.renderer.effect_passes = self.renderer.effect_passes, ()
        try:
            with self._lighting.shining(), raised(), self._near(), undrawn(self.stage.fields):
                self.renderer.render(self.stage.scene, self.camera)
            return self.renderer.snapshot()[..., :3].astype(np.float32)
        finally:
            self.renderer.effect_passes = effects

    def read(self, texture: Any, kind: type) -> np.ndarray:
        """Read (H, W, C) a texture of the renderer's device."""
        return _read(self.renderer, texture, kind)

    def _carry(self, turn: float) -> None:
        """Put the camera where the one that it follows is, then around the centre."""
        camera, followed = self.camera, self._followed
        if followed is not None:
            for name in ("fov", "width", "height", "zoom", "maintain_aspect", "depth", "depth_range"):
                setattr(camera, name, getattr(followed, name))
            self._at = np.asarray(followed.world.matrix, float)
        elif self._at is None:
            self._at = np.asarray(camera.world.matrix, float)
        angle = 2 * math.pi * turn
        around = np.eye(4)
        around[[0, 0, 2, 2], [0, 2, 0, 2]] = math.cos(angle), math.sin(angle), -math.sin(angle), math.cos(angle)
        around[:3, 3] = self.stage.center - around[:3, :3] @ self.stage.center
        camera.world.matrix = around @ self._at if turn else self._at

    _at: np.ndarray | None = None
    follows = False  # whether the exposure follows a sun that moves


def _read(renderer: Any, texture: Any, kind: type) -> np.ndarray:
    """Read (H, W, C) a texture of a renderer's device."""
    width, height, _ = texture.size
    size = {"rgba16float": 8, "rgba32float": 16}.get(texture.format, 4)  # bytes; of the depth 4
    whole = (width, height, 1)
    data = renderer.device.queue.read_texture({"texture": texture}, {"bytes_per_row": width * size, "rows_per_image": height}, whole)
    return np.frombuffer(data, kind).reshape(height, width, -1)


def make_renderer(shot: Shot) -> DividedRenderer:
    """Make a renderer for a shot, whose long passes may be carried out in parts. Raises AirlightError for one that is too large."""
    target = gfx.Texture(dim=2, size=(shot.width, shot.height, 1), format="rgba8unorm")  # which nobody reads
    renderer = DividedRenderer(target, pixel_scale=shot.samples, pixel_filter="nearest", ppaa="none")
    most = renderer.device.limits["max-texture-dimension-2d"]
    if max(shot.width, shot.height) * shot.samples > most:
        raise AirlightError(
            f"{shot.width}x{shot.height} with {shot.samples}x{shot.samples} samples is beyond this adapter's {most} pixels;"
            " make it smaller, or use --quality draft or --no-antialias"
        )
    use_hdr(renderer)
    return renderer


def _chosen(stage: Stage, shot: Shot) -> Any:
    """Finds the stage's camera that is requested, or None."""
    if shot.eye is not None:
        return None
    if shot.camera is None:
        return next(iter(stage.cameras.values()))
    if shot.camera not in stage.cameras:
        hint = nearest(shot.camera, stage.cameras)
        raise AirlightError(f"{stage.name}: has no camera {shot.camera!r}{hint} (it has {', '.join(stage.cameras)})")
    return stage.cameras[shot.camera]


def _place(camera: Any, stage: Stage, shot: Shot) -> None:
    """Put a camera at the shot's eye; its depths reach from a thousandth of the stage's radius to far beyond it."""
    eye = np.asarray(shot.eye, float)
    target = stage.center if shot.target is None else np.asarray(shot.target, float)
    ahead = target - eye
    distance = float(np.linalg.norm(ahead))
    if distance < 1e-9:
        raise AirlightError("--eye and --target are one place; put them apart")
    steep = math.hypot(ahead[0], ahead[2]) < 1e-6 * distance
    camera.world.reference_up = (0, 0, -1) if steep else (0, 1, 0)
    camera.world.position = eye
    camera.look_at(target)
    near, far = next((c.depth_range for c in stage.cameras.values() if c.depth_range), (math.inf, 0.0))
    away = float(np.linalg.norm(stage.center - eye))
    camera.depth_range = min(near, stage.radius / 1000), max(far, 4 * (away + stage.radius))
