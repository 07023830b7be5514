"""Lights a stage by daylight: sun, surroundings and background of an atmosphere, for a sun that may move."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pygfx as gfx

from airlight.colour import srgb_encode
from airlight.daylight import Atmosphere
from airlight.lights.punctual import triple
from airlight.luminance import REC709
from airlight.pygfx import SceneLight
from airlight.reference.daylight import SUN_ANGULAR_RADIUS, Array
from airlight.scatter.methods import METHODS
from airlight.scenes.environment import LIGHT_FACE, cube_directions
from airlight.scenes.lamps import cast_shadow
from airlight.scenes.stage import Stage

SUN_LUX = 132_600.0  # outside the air: ASTM G-173
BACKGROUND_FACE = 512  # pixels of a face of the cube that is seen behind all, where no pass draws the sky
ABOVE, BELOW, AROUND = 32, 10, 19  # nodes of the sky: elevations above and below the horizon, azimuths from the sun to the opposite
CROWDING = 2.0, 1.5  # power by which they crowd at the horizon, and at the sun
AT_HORIZON = 0.02  # degrees from the horizon, of the nodes next to it
LOWEST = -18.0  # degrees: suns below it count as there
NO_SUN = 1e-3  # lux, below which the sun casts nothing
FOLLOWED = 0.8  # of the stops by which the sky changes, that the exposure does: dusk is darker than noon
DISC_MOST = 24.0  # of the background as it is exposed: methods that sum the picture's light would show nothing but the sun's

Track = Callable[[float], tuple[float, float]]  # from seconds to azimuth and elevation, degrees


def sun_direction(azimuth: float, elevation: float) -> Array:
    """Find the unit direction (3,) to a sun; degrees, azimuth 0 at -Z and 90 at +X."""
    turn, up = math.radians(azimuth), math.radians(elevation)
    return np.array([math.sin(turn) * math.cos(up), math.sin(up), -math.cos(turn) * math.cos(up)])


class Sky:
    """Holds the radiance of the air, and of the ground beyond it, at nodes of a sky, for a sun at one elevation, of an irradiance of 1.

    ground: (3,) radiance of level ground. mean: (3,) radiance over all directions.
    """

    def __init__(self, air: Atmosphere, elevation: float, altitude: float) -> None:
        self.sun = elevation
        up, down = (AT_HORIZON + (90 - AT_HORIZON) * np.linspace(0, 1, n) ** CROWDING[0] for n in (ABOVE, BELOW))
        self.elevations, self.azimuths = np.concatenate([-down[::-1], up]), 180 * np.linspace(0, 1, AROUND) ** CROWDING[1]
        parts = air.parts(self.elevations[:, None], self.azimuths, elevation, altitude)
        self.radiance = np.maximum(parts.shadowed + parts.multiple, 0)
        belts, sectors = _shares(np.sin(np.radians(self.elevations))), _shares(self.azimuths) / 180
        solid = (2 * np.pi * belts[:, None] * sectors)[..., None]
        sine = np.maximum(np.sin(np.radians(self.elevations)), 0)[:, None, None]
        self.sunlight = np.maximum(air.sun(elevation, altitude, disc=True), 0)
        level = (solid * sine * self.radiance).sum(axis=(0, 1)) + max(math.sin(math.radians(elevation)), 0) * self.sunlight
        self.ground = np.maximum(air.coefficients.channels(air.coefficients.ground_albedo), 0) / np.pi * level
        below = self.elevations < 0
        self.radiance[below] += np.maximum(parts.transmittance[below], 0) * self.ground
        self.mean = (solid * self.radiance).sum(axis=(0, 1)) / (4 * np.pi)

    def towards(self, elevation: Array, azimuth: Array) -> Array:
        """Interpolate (..., 3) the radiance of directions, degrees, azimuth from the sun."""
        azimuth = np.abs((azimuth + 180) % 360 - 180)
        y, x = np.interp(elevation, self.elevations, np.arange(len(self.elevations))), np.interp(azimuth, self.azimuths, np.arange(AROUND))
        i, j = np.minimum(y.astype(int), len(self.elevations) - 2), np.minimum(x.astype(int), AROUND - 2)
        a, b = (y - i)[..., None].astype(np.float32), (x - j)[..., None].astype(np.float32)
        sky = np.log(np.maximum(self.radiance, 1e-30)).astype(np.float32)  # it changes by factors near the horizon
        found = (sky[i, j] * (1 - b) + sky[i, j + 1] * b) * (1 - a) + (sky[i + 1, j] * (1 - b) + sky[i + 1, j + 1] * b) * a
        return np.asarray(np.exp(found))

    def cube(self, size: int, azimuth: float, disc: bool) -> Array:
        """Make (6, size, size, 3) radiance as pygfx's cube textures have it, the sun at an azimuth, degrees. disc: with that of the sun."""
        towards = cube_directions(size)
        elevation = np.degrees(np.arcsin(np.clip(towards[..., 1] / np.linalg.norm(towards, axis=-1), -1, 1)))
        around = np.degrees(np.arctan2(towards[..., 0], -towards[..., 2])) - azimuth
        found = self.towards(elevation, around)
        if disc:
            cosine = towards @ sun_direction(azimuth, self.sun) / np.linalg.norm(towards, axis=-1)
            texel = 90 / size
            away = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
            share = np.clip((SUN_ANGULAR_RADIUS - away) / texel + 0.5, 0, 1) * (elevation > 0)
            found = found + share[..., None] * (self.sunlight / disc_solid_angle())
        return np.asarray(found)


def _shares(nodes: Array) -> Array:
    """Give each of some nodes (N,) what lies nearer to it than to others, from the first to the last."""
    middles = (nodes[1:] + nodes[:-1]) / 2
    return np.diff(np.concatenate([nodes[:1], middles, nodes[-1:]]))


def disc_solid_angle() -> float:
    """Compute the solid angle of the sun's disc, steradians."""
    return 2 * math.pi * (1 - math.cos(math.radians(SUN_ANGULAR_RADIUS)))


class Daylight:
    """Lights a stage by the sun and the sky of an atmosphere.

    air: its atmosphere; track: where the sun stands at a time, seconds, in the scene: (azimuth, elevation) degrees, azimuth 0 at -Z and 90
    at +X. altitude: m of y = 0. lux: of the sun outside the air. span: seconds, from when to when it moves; None: it stands.
    light: the sun, as a medium has it. azimuth, elevation, sky: as last moved.
    """

    def __init__(
        self, air: Atmosphere, track: Track, altitude: float = 2.0, lux: float = SUN_LUX, span: tuple[float, float] | None = None
    ) -> None:
        self.air, self.track, self.altitude, self.lux, self.span = air, track, altitude, lux, span
        self._metered: float | None = None  # log2 of the sky's luminance then
        self.sun = gfx.DirectionalLight(name="the sun")
        self.light = SceneLight(self.sun, disc_half_angle=SUN_ANGULAR_RADIUS)
        self.azimuth, self.elevation = 0.0, 90.0
        self.sky: Sky | None = None
        self._of: Any = None  # what the sky holds for
        self._made: tuple[Any, Any] = (None, None)  # what surroundings and background hold for
        self._cubes = [_cube(LIGHT_FACE), _cube(BACKGROUND_FACE)]
        self._background = gfx.Background(None, gfx.BackgroundSkyboxMaterial(map=self._cubes[1]))
        self._before: Any = None  # of the stage

    @property
    def direction(self) -> Array:
        """Give the unit direction (3,) to the sun."""
        return sun_direction(self.azimuth, self.elevation)

    @property
    def ambient(self) -> Array:
        """Give the radiance (3,) of all directions on the mean."""
        assert self.sky is not None
        return self.lux * self.sky.mean

    def stops(self) -> float:
        """Find by how many stops the exposure is more than halfway of the sun's track: it follows the sky's light, for the greater part."""
        if self.span is None:
            return 0.0
        if self._metered is None:
            halfway = Sky(self.air, max(self.track(sum(self.span) / 2)[1], LOWEST), self.altitude)
            self._metered = math.log2(max(float(halfway.mean @ REC709), 1e-30))
        assert self.sky is not None
        return FOLLOWED * (self._metered - math.log2(max(float(self.sky.mean @ REC709), 1e-30)))

    def put(self, stage: Stage) -> None:
        """Light a stage, in place of its own suns, surroundings and background; its lamps stay."""
        hidden = [thing for thing in stage.scene.iter() if isinstance(thing, gfx.Background | gfx.DirectionalLight | gfx.AmbientLight)]
        suns = [light for light in stage.lights if _is_sun(light)]
        hidden += [light.target for light in suns if light.target is not None]
        lamps = [light for light in stage.lights if not _is_sun(light)]
        clear = [(mesh, mesh.material) for mesh in stage.hazy]
        self._before = [(thing, thing.visible) for thing in hidden], list(stage.lights), stage.scene.environment, stage.measured, clear
        for thing in hidden:
            thing.visible = False
        for mesh in stage.hazy:
            mesh.material = stage.clear
        stage.lights, stage.scene.environment, stage.measured, stage.daylight = [self.light, *lamps], self._cubes[0], True, self
        self.sun.target.local.position = stage.center
        stage.scene.add(self._background, self.sun, self.sun.target)
        self._made = (None, None)
        self.move(stage, 0.0, background=False)
        cast_shadow(self.sun, stage.center, stage.radius)

    def take_off(self, stage: Stage) -> None:
        """Give a stage back what it had before `put`."""
        hidden, lights, environment, measured, clear = self._before
        stage.scene.remove(self._background, self.sun, self.sun.target)
        for thing, visible in hidden:
            thing.visible = visible
        for mesh, material in clear:
            mesh.material = material
        stage.lights, stage.scene.environment, stage.measured, stage.daylight = lights, environment, measured, None

    def move(self, stage: Stage, time: float, background: bool = True) -> None:
        """Put the sun where it stands at a time, seconds, in the stage's pre-exposure. background: whether that is seen."""
        azimuth, elevation = self.track(time)
        self.azimuth, self.elevation = azimuth % 360, max(elevation, LOWEST)
        if self.sky is None or self._of != (id(self.air), self.elevation, self.altitude):
            self._of = id(self.air), self.elevation, self.altitude
            self.sky = Sky(self.air, self.elevation, self.altitude)
        light = self.lux * self.sky.sunlight
        top = float(light.max())
        self.sun.color = gfx.Color.from_physical(*(float(v) for v in (light / top if top > 0 else np.ones(3))))
        self.sun.intensity = top * stage.pre_exposure if top > NO_SUN else 0.0
        self.light.screen_tint = triple(light / max(top, 1e-30))
        self.sun.local.position = stage.center + 1.5 * stage.radius * self.direction
        self._surround(stage, background)

    def _surround(self, stage: Stage, background: bool) -> None:
        """Renew what lights the surfaces, and what is seen behind all, where the sun or the exposure is another."""
        assert self.sky is not None
        where, mean = (self._of, self.azimuth), max(float(self.sky.mean @ REC709), 1e-30)
        done = list(self._made)
        if done[0] != where:
            _fill(self._cubes[0], self.sky.cube(LIGHT_FACE, self.azimuth, disc=False) / mean)
        if background and done[1] != (where, stage.pre_exposure):
            light = self.sky.cube(BACKGROUND_FACE, self.azimuth, disc=True)
            light = light * (self.lux * stage.pre_exposure)
            _fill(self._cubes[1], light * np.minimum(1, DISC_MOST / np.maximum(light.max(axis=-1, keepdims=True), 1e-30)))
            done[1] = where, stage.pre_exposure
        done[0] = where
        self._made = done[0], done[1]
        share = self.lux * mean * stage.pre_exposure
        for thing in stage.scene.iter():
            material = getattr(thing, "material", None)
            if isinstance(material, gfx.MeshStandardMaterial) and material.env_map_intensity != share:
                material.env_map_intensity = share


def _is_sun(light: SceneLight) -> bool:
    """Tell whether a light is a sun, or a body that a sun hangs on."""
    below = () if light.target is None else light.target.iter()
    return light.direction is not None or any(isinstance(one, gfx.DirectionalLight) for one in below)


def _cube(size: int) -> gfx.Texture:
    return gfx.Texture(np.ones((6, size, size, 4), np.float16), dim=2, size=(size, size, 6), generate_mipmaps=True)


def _fill(texture: gfx.Texture, radiance: Array) -> None:
    """Fill a cube texture with radiance (6, size, size, 3), coded as pygfx expects it."""
    texture.data[..., :3] = srgb_encode(np.maximum(radiance, 0).astype(np.float32))
    texture.update_full()


def light_stage(stage: Stage, effect: Any, time: float, ev: float | None = None) -> None:
    """Put a stage's sun, if it has daylight, where it stands at a time, seconds, and give an effect pass its air.

    ev: stops halfway of the sun's track, where the exposure follows the sky; else None.
    """
    effect.daylight = stage.daylight
    if stage.daylight is not None:
        stage.daylight.move(stage, time, background=not METHODS[effect.parameters.method].lights_medium)
        if ev is not None:
            effect.automatic_ev = ev + stage.daylight.stops()
