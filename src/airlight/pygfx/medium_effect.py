"""Keeps the state of a pass whose method lights a medium: what casts shadows, and the march."""

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from airlight.composite.scene import SceneLayer
from airlight.errors import warn
from airlight.gpu.device import Device
from airlight.gpu.timing import Timer
from airlight.medium.field import as_field
from airlight.medium.resolve import ResolvedMedium, doubt, left_out, resolve
from airlight.options import March, Medium
from airlight.pygfx.air import AirOfScene
from airlight.pygfx.basin import Basin
from airlight.pygfx.casters import Casters, Gathered, height
from airlight.pygfx.dimmed_suns import doubt_of_suns
from airlight.pygfx.faint_fields import doubt_of_fields
from airlight.pygfx.glass_maps import GlassMaps
from airlight.pygfx.origin import current_origin
from airlight.pygfx.private_panes import camera_data, use_camera
from airlight.pygfx.punctual import punctual_lights
from airlight.pygfx.seen_lights import divide_lights
from airlight.scatter.methods import AUTO, METHODS
from airlight.scatter.screen_shadows.screen_shadows import LightsOnPicture
from airlight.shadows import fit

if TYPE_CHECKING:
    from airlight.pygfx.effect import LightShafts


class MediumState:
    """Lights a medium for a method and pictures of one size.

    key: (method, size). resolved: the medium of the last frame, with nothing unset. lacks: a line on what of the scene the method left out
    of it, or None.
    """

    def __init__(self, device: Device, scene: Any, method: str, size: tuple[int, int], casters: Casters | None = None) -> None:
        self.key = method, size
        self.casters = casters or Casters(device, scene)  # another size has the same pipelines
        self._basin = Basin(self.casters)
        self.march: Any = METHODS[method].plan(device, size)
        self.resolved: ResolvedMedium | None = None
        self.lacks: str | None = None
        self._over: SceneLayer | None = None  # with what is seen through
        self.glass = GlassMaps(device)
        self._air = AirOfScene(device, size)
        self.on_picture = LightsOnPicture(device, size) if method == AUTO else None
        self._marches = True  # or all of the last frame was on the picture
        self._told = False

    @property
    def layer(self) -> SceneLayer:
        on_picture = self.on_picture
        if on_picture is not None and on_picture.count:
            transmittance = self.march.transmittance if self._marches else on_picture.transmittance
            return SceneLayer(radiance=on_picture.layer, transmittance=transmittance)
        return self._over or self._air.layer or SceneLayer(radiance=self.march.layer, transmittance=self.march.transmittance)

    def draw_panes(self, shafts: "LightShafts", encoder: Any, color: Any, depth: Any, timer: Timer | None) -> Any:
        """Records the drawing of what is seen through onto the picture in its medium, and onto the layer; returns the picture, None where
        there is no such thing."""
        if not shafts.panes.held:
            return None
        picture, self._over = shafts.panes.draw(shafts, encoder, self.march.profile, color, depth, self.layer, timer)
        return picture

    def record(self, shafts: "LightShafts", encoder: Any, depth: Any, timer: Timer | None) -> None:
        """Draws and submits the shadow maps for this frame, and records the march through the picture's depth."""
        casters, p, camera = self.casters, shafts.parameters, camera_data()
        casters.scene, casters.lights, casters.exclude, casters.still = shafts.scene, shafts.lights, shafts.exclude, shafts.still
        gathered = casters.gather()
        ball = fit.ball(gathered[1]) if shafts.radius is None or shafts.doubts else None
        radius = shafts.radius if ball is None or shafts.radius is not None else ball[1]
        densities = shafts.fields, shafts.time, gathered, self._basin, shafts.camera
        settled = settle(shafts.medium, shafts.march, p.quality, radius or 1.0, *densities)
        settled = settled.exposed(shafts.pre_exposure)
        if shafts.daylight is not None:
            settled = replace(settled, ambient=settled.ambient + shafts.daylight.ambient * shafts.pre_exposure)
        medium = self.resolved = self.march.resolve(settled.seen_from(current_origin()))
        view, projection = (np.asarray(m, np.float64) for m in (shafts.camera.view_matrix, shafts.camera.projection_matrix))
        lights = punctual_lights(shafts.lights, shafts.pre_exposure)
        passes = shafts.medium.transparency != "none"
        glass, hulls = self.glass.gather(shafts.scene, shafts.exclude, shafts.lights) if passes else ([], None)
        method, varies = METHODS[p.method], settled.varies and not medium.varies
        noise = varies and settled.settings.noise_amount > 0 and settled.air > 0
        lacks = bool(glass) and not method.follows_glass, bool(glass) and method.follows_glass and not method.follows_fields
        self.lacks = left_out(p.method, noise, varies and bool(settled.fields), *lacks)
        if ball is not None and shafts.doubts:
            more = self.lacks
            if method.has_units:
                more = doubt_of_suns(medium, lights, view, projection) or doubt_of_fields(medium, view, projection, self.key[1][1]) or more
            self._tell(shafts, medium, *ball, more)
        if not method.follows_glass:
            glass, hulls = [], None
        if self.on_picture is not None:
            seen, lights, line = divide_lights(shafts, lights, medium, view, projection, bool(glass))
            self.on_picture.update(view, projection, seen, medium)
            self._marches = not seen or bool(lights)
            if line is not None and not self._told:
                self._told = True
                warn(line)
        shadows = casters.draw(view, projection, lights, medium, timer, gathered, hulls)
        if glass and hulls is not None:
            self.glass.draw(shadows, glass, hulls, medium.exact, timer)
        share: dict[str, Any] = {"share": shafts.in_scene.share(p)} if "resolution" in METHODS[p.method].options else {}
        if medium.varies:
            share["region"] = _region(gathered[1], np.linalg.inv(view)[:3, 3], radius or 1.0)
        panes = shafts.panes if shafts.panes.held else None
        if panes:
            share["panes"] = True
        has_fog = panes is not None or shafts.daylight is None or bool(medium.sigma_t.any())
        if has_fog and self._marches:
            self.march.update(view, projection, list(zip(lights, shadows, strict=True)), medium, jitter=p.offset, **share)
        if panes:
            panes.draw_spans(shafts, self.march, projection, depth, timer)
        use_camera(camera)  # of whoever draws on this encoder
        if has_fog and self._marches:
            self.march.record(encoder, depth, timer)
        if self.on_picture is not None and self.on_picture.count:
            self.on_picture.record(encoder, depth, self.march.layer if self._marches else None, timer)
        self._over = None
        fog = self.march if has_fog else None
        self._air.record(shafts, encoder, depth, list(zip(lights, shadows, strict=True)), medium, fog, timer)

    def _tell(self, shafts: "LightShafts", medium: ResolvedMedium, center: Any, radius: float, more: str | None) -> None:
        """Warn, once for a pass, of a medium that hides what casts shadows, or cannot be seen, or, in a line, of more. center, radius: of
        what casts shadows, metres."""
        has_units = METHODS[shafts.parameters.method].has_units
        line = doubt(medium, float(np.linalg.norm(shafts.camera.world.position - center)), radius) if radius > 0 and has_units else None
        if (line := line or more) is not None:
            shafts.doubts = False
            warn(line)


def settle(
    medium: Medium,
    march: March,
    quality: str,
    radius: float,
    densities: Sequence[Any],
    time: float,
    gathered: Gathered,
    basin: Basin,
    camera: Any,
) -> ResolvedMedium:
    """Give all that is unset of a medium a value, with the densities that lie in it, those of lowlands among them.

    radius: of the scene, m. densities: see LightShafts.fields. time: s. gathered: what casts shadows. Raises AirlightError.
    """
    fields = [found for found in (as_field(one, medium.particle_cells) for one in densities) if found is not None]
    settled = resolve(medium, march, quality, radius, height(gathered), fields, time)
    seen = np.asarray(camera.world.position, float), settled.max_distance
    low = basin.field(gathered, medium.basin_level, medium.basin_density, medium.particle_cells, seen)
    return settled if low is None else resolve(medium, march, quality, radius, height(gathered), fields, time, low)


def _region(hulls: np.ndarray, eye: np.ndarray, radius: float) -> np.ndarray:
    """Bound (2, 3), m, where noise dims lights: what casts shadows, and what lies around the eye as far as a scene is large."""
    ends = [eye - radius, eye + radius]
    if len(hulls):
        ends += [hulls.min(axis=(0, 1)), hulls.max(axis=(0, 1))]
    return np.array([np.min(ends, axis=0), np.max(ends, axis=0)])
