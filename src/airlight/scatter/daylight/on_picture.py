"""Puts daylight on a picture part by part, so that large ones fit on the device: `OnPicture`."""

from typing import Any, cast

import numpy as np

from airlight.daylight.atmosphere import Atmosphere
from airlight.daylight.camera import Camera, direction_of
from airlight.gpu.device import Device
from airlight.gpu.floats import FloatReader
from airlight.reference.daylight import horizon_cosine
from airlight.scatter.daylight.passes import DaylightPass, Sky
from airlight.scatter.daylight.table import ViewTable

Plane = np.ndarray
HORIZON_AZIMUTHS = 64  # at which the sky at the horizon is computed
SOUTH = np.array([1.0, 1.0, -1.0])  # of (east, up, north), as the passes' worlds have z


class OnPicture:
    """Puts daylight on parts of one picture.

    sun_azimuth, sun_elevation: degrees; altitude: of the eye, m; irradiance: of the sun, above the air, in even air at the eye. sky,
    attenuate: as `DaylightPass`. even_air: beta_rayleigh, beta_mie and g of Eq. 1 instead of the air. A sky that
    is no picture's own alone goes on below the horizon.
    """

    def __init__(
        self, device: Device, air: Atmosphere, camera: Camera, sun_azimuth: float, sun_elevation: float, altitude: float, irradiance: float,
        sky: str = "keep", attenuate: str = "source", even_air: dict[str, Any] | None = None,
    ) -> None:  # fmt: skip
        self._device, self._camera, self._more = device, camera, even_air or {}
        self._air, self._azimuth, self._elevation, self._altitude = air, sun_azimuth, sun_elevation, altitude
        self._table = ViewTable(device)
        self._table.update(air, sun_elevation, altitude)
        self._to_sun, self._irradiance = direction_of(sun_azimuth, sun_elevation) * SOUTH, irradiance
        self._kinds = cast(Sky, sky), even_air is not None, attenuate
        self._passes: dict[tuple[int, int], DaylightPass] = {}

    def part(
        self, left: int, top: int, light: Plane, metres: Plane, sky: Plane, dark: Plane, of_land: Plane | None = None
    ) -> tuple[Plane, Plane]:
        """Give what is let through and what is added, (H, W, 3) float32: the picture becomes its light times the first plus the second.

        left, top: of the part in the camera's picture, pixels. light: (H, W, 3) linear Rec. 709; metres: (H, W) along rays of what is no
        sky; sky: (H, W) the share of a pixel that is sky; dark: D, (H, W). of_land: (H, W, 3) the part of a pixel's light that is not
        the sky's; None: 1 - sky. By it the old sky goes out of mixed pixels, where it is drawn anew, and stays in them, where it is kept.
        """
        height, width = metres.shape
        source, shadow = np.ones((height, width, 4), np.float32), np.ones((height, width, 4), np.float16)
        source[..., :3], shadow[..., :3] = light, dark[..., None]
        is_sky = sky >= 1
        through, added = self._run(left, top, source, shadow, np.where(is_sky, np.inf, metres).astype(np.float32))
        self._as_at_the_horizon(left, top, is_sky, dark, through, added)
        share = np.where(is_sky, 0, sky).astype(np.float32)[..., None]
        if not share.any():
            return through, added
        behind = self._run(left, top, source, shadow, np.full_like(metres, np.inf))
        self._as_at_the_horizon(left, top, share[..., 0] > 0, dark, *behind)
        own = 1 - share if of_land is None else np.where(share > 0, of_land, np.where(is_sky, 0, 1)[..., None]).astype(np.float32)
        of_sky = 1 - own if self._kinds[0] == "keep" else share  # what a kept sky lacks in shadows is of its own light
        mixed = share > 0
        through = np.where(mixed, behind[0] + own * (through - behind[0]), through)
        return through, np.where(mixed, (1 - share) * added + of_sky * behind[1], added)

    def _as_at_the_horizon(self, left: int, top: int, seen: Plane, dark: Plane, through: Plane, added: Plane) -> None:
        """Let a sky that is drawn anew, or air before the picture's own, go on below the horizon, as from a hill whose height is not told:
        the model has ground there."""
        if self._kinds[0] == "keep" or self._kinds[1] or not seen.any():
            return
        y, x = np.nonzero(seen)
        camera = self._camera
        rays = camera.at((left + x + 0.5) / camera.width, (top + y + 0.5) / camera.height)
        horizon = float(np.arcsin(horizon_cosine(self._altitude)))
        below = rays[:, 1] < np.sin(horizon)
        if not below.any():
            return
        y, x, rays = y[below], x[below], rays[below]
        turns = np.degrees(np.arctan2(rays[:, 0], rays[:, 2])) - self._azimuth
        apart = np.abs((turns + 180) % 360 - 180)
        grid = np.linspace(apart.min(), apart.max(), HORIZON_AZIMUTHS)
        parts = self._air.parts(np.degrees(horizon) + 1e-4, grid, self._elevation, self._altitude)
        single, multiple, left_of_it = (
            np.stack([np.interp(apart, grid, one[:, i]) for i in range(3)], axis=1)
            for one in (parts.single, parts.multiple, parts.transmittance)
        )
        lit = 1 - dark[y, x, None]
        radiance = lit * (single + multiple) if self._kinds[2] == "all" else lit * single + multiple
        added[y, x] = self._irradiance * radiance
        if self._kinds[0] == "air":  # of one that is replaced nothing is left
            through[y, x] = lit * left_of_it if self._kinds[2] == "all" else left_of_it

    def _run(self, left: int, top: int, source: Plane, shadow: Plane, ways: Plane) -> tuple[Plane, Plane]:
        height, width = ways.shape
        one = self._passes.get((width, height))
        if one is None:
            one = DaylightPass(self._device, (width, height), "ray", *self._kinds)
            self._passes = {(width, height): one}
        projection = self._camera.projection(left, top, width, height)
        one.update(self._table, self._camera.view, projection, self._to_sun, irradiance=self._irradiance, **self._more)
        inputs = []
        for values, format in ((ways, "r32float"), (source, "rgba32float"), (shadow, "rgba16float")):
            texture = self._device.texture(width, height, format, target=False)
            self._device.write(texture, values, values.itemsize * (1 if values.ndim == 2 else 4) * width)
            inputs.append(texture)
        encoder = self._device.encoder()
        ways_seen, seen, hidden = inputs
        one.record(encoder, ways_seen, seen, hidden, parts=True)
        self._device.submit(encoder)
        transmittance, radiance = (FloatReader(self._device, found).read() for found in (one.transmittance, one.radiance))
        return transmittance, radiance
