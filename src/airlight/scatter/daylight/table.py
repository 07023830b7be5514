"""Fills the table of view rays: what they gather of daylight, from an eye at one altitude, with the sun at one elevation."""

from typing import Any

import numpy as np

from airlight.daylight.atmosphere import ALTITUDE, LOWEST_SUN, Atmosphere
from airlight.daylight.checks import number
from airlight.daylight.columns import SIZE
from airlight.daylight.multiple import reach
from airlight.daylight.rays import earth_shadow
from airlight.gpu.device import Device
from airlight.gpu.structs import struct_dtype
from airlight.gpu.timing import compute
from airlight.reference.daylight import AEROSOL_HEIGHT, LEVEL_TO_TOP, TOP_RADIUS, horizon_cosine
from airlight.reference.daylight_view import (
    AZIMUTHS,
    BELOW,
    DISTANCES,
    ELEVATIONS,
    column_azimuths,
    elevation_rows,
    row_elevations,
    way_nodes,
)
from airlight.scatter.daylight.further import Further, numbers_of

FILL, VIEW = "scatter/daylight/fill_view.wgsl", "scatter/daylight/view_table.wgsl"
RECORD, RAY, DAYLIGHT = struct_dtype(FILL, "Fill"), struct_dtype(FILL, "ViewRay"), struct_dtype(VIEW, "Daylight")
SUMS = struct_dtype(FILL, "Sums")
WIDEST = 16384.0  # that radiance of an irradiance of 1 is stored as: of half floats' 65504
TWILIGHT = 0.25  # powers of 10 by which light falls, or more, for a degree of the sun below the horizon
NEAREST, NEAREST_BY_HEIGHT, NEAREST_HIGH = 300.0, 0.08, 1500.0  # m, about even over the way within; by the eye's height, up to the last
WARP, WARP_BY_DIP = np.radians(0.4), 0.07  # radians within which it is even over elevation, and what is added of the horizon's depression


class ViewTable:
    """Holds on the device what view rays gather up to any distance, for one air, one elevation of the sun and one altitude of the eye.

    textures: of sunlight scattered once, of all light, as quotients, and transmittance: in the order of view_table.wgsl's bindings, before
    a linear sampler.
    """

    def __init__(self, device: Device) -> None:
        self.device = device
        usage = device.wgpu.TextureUsage
        flags = usage.TEXTURE_BINDING | usage.STORAGE_BINDING | usage.COPY_SRC
        size = (DISTANCES, AZIMUTHS, ELEVATIONS)
        solid = [device.device.create_texture(size=size, dimension="3d", format="rgba16float", usage=flags) for _ in range(2)]
        self.textures = (*solid, device.texture(DISTANCES, ELEVATIONS, "rgba16float"))
        self._fill, self._fold = (device.pipeline(FILL, entry) for entry in ("fill_view", "fold_view"))
        self._gathered = device.buffer(size=SUMS.itemsize * AZIMUTHS * ELEVATIONS * DISTANCES)
        self._record = device.buffer(size=RECORD.itemsize, uniform=True)
        self._rays = device.buffer(size=RAY.itemsize * AZIMUTHS * ELEVATIONS)
        self._further = Further(device)
        self._depths: Any = None
        self._key: Any = None
        self._shared: dict[str, Any] = {}

    @property
    def resources(self) -> tuple[Any, ...]:
        """Give what a shader that includes view_table.wgsl binds after its record."""
        return (*self.textures, self.device.sampler())

    def update(self, air: Atmosphere, sun_elevation: float, altitude: float = 2.0) -> bool:
        """Fill the table if air, sun or altitude are others than before: True then. It is submitted at once.

        sun_elevation: degrees, -18..90; altitude: m. The first sun of an air is waited for; of one that moves, those that come next are
        solved in the background. Raises AirlightError for what is out of range.
        """
        sun = number("sun_elevation", sun_elevation, LOWEST_SUN, 90)
        height = max(number("altitude", altitude, *ALTITUDE, unit="m"), 0.0)
        own = numbers_of(air)
        if self._key == (own, sun, height):
            return False
        self._further.update(air, sun)
        c = air.coefficients
        if self._key is None or self._key[0] != own:
            depths = np.zeros((*SIZE, 4), np.float32)
            depths[..., : len(c.nm)] = air.optical_depth_table(SIZE)
            self._depths = self.device.buffer(depths.tobytes())
        horizon, mu_sun = float(np.arcsin(horizon_cosine(height))), float(np.sin(np.radians(sun)))
        warp = float(WARP - WARP_BY_DIP * horizon)
        density = np.exp(-height / AEROSOL_HEIGHT)
        even = max(NEAREST, min(NEAREST_BY_HEIGHT * height, NEAREST_HIGH))
        near = min(even, float(0.125 / np.max(c.rayleigh + c.aerosol_extinction * density)))
        farthest = LEVEL_TO_TOP - TOP_RADIUS * np.sin(horizon)  # along the ground's horizon, to the end of the air
        near, dense = way_nodes(near, float(farthest))
        rows = elevation_rows(horizon, warp)
        scale = WIDEST * 10 ** (TWILIGHT * max(0.0, -(sun - np.degrees(horizon))))
        record = np.zeros((), RECORD)
        by_name = {"rayleigh": c.rayleigh, "aerosol": c.aerosol_scattering, "extinct": c.aerosol_extinction, "ozone": c.ozone}
        for name, values in by_name.items():
            record[name][: len(c.nm)] = values
        record["to_channels"][: len(c.nm), :3] = c.to_channels.T
        rayleigh, aerosol = c.to_channels @ c.rayleigh, c.to_channels @ c.aerosol_scattering
        broad = rayleigh / aerosol if np.all(aerosol > 0) else rayleigh
        self._shared = {"height": height, "near": near, "dense": dense, "anisotropy": c.anisotropy, "broad": broad / broad[1]}
        for name, value in (self._shared | {"mu_sun": mu_sun, "sun": sun, "reach": reach(sun), "scale": scale}).items():
            record[name] = value
        record["rows"], record["columns"] = SIZE
        record["sun_row"] = BELOW + np.argmin(np.abs(row_elevations(horizon, rows)[BELOW:] - np.radians(sun)))
        self.device.queue.write_buffer(self._record, 0, record.tobytes())
        self.device.queue.write_buffer(self._rays, 0, _rays(height, horizon, rows, np.radians(sun)).tobytes())
        bind = self.device.bind(FILL, self._record, self._rays, self._depths, self._further.buffer, self._gathered, *self.textures)
        encoder = self.device.encoder()
        groups = -(-AZIMUTHS // 8), -(-ELEVATIONS // 8)
        compute(encoder, self._fill, bind, groups, "daylight table")
        compute(encoder, self._fold, bind, (*groups, DISTANCES), "daylight table")
        self.device.submit(encoder)
        self._key = own, sun, height
        self._shared |= {"horizon": (np.sin(horizon), np.cos(horizon)), "rows": rows}
        self._scale = scale
        return True

    def record(self, to_sun: Any, up: Any, irradiance: Any = 1.0) -> np.ndarray:
        """Make the record of view_table.wgsl, in the space of to_sun and up, unit vectors (3,), such as view space.

        irradiance: above the air, one number or red, green, blue. Only the azimuth is taken of to_sun; the elevation is the table's.
        """
        up, towards = np.asarray(up, float), np.asarray(to_sun, float)
        up = up / np.linalg.norm(up)
        level = towards - up * (towards @ up)
        if np.linalg.norm(level) < 1e-9:
            level = np.cross(up, np.eye(3)[np.argmin(np.abs(up))])
        ahead = level / np.linalg.norm(level)
        sun = np.radians(self._key[1])
        out = np.zeros((), DAYLIGHT)
        for name, value in self._shared.items():
            out[name] = value
        out["up"], out["ahead"], out["to_sun"] = up, ahead, np.sin(sun) * up + np.cos(sun) * ahead
        out["irradiance"] = np.broadcast_to(np.asarray(irradiance, float) / self._scale, (3,))
        return out


def _rays(height: float, horizon: float, rows: tuple[float, ...], sun: float) -> np.ndarray:
    """Make (ELEVATIONS, AZIMUTHS) records of the table's rays, and where they lie in the earth's shadow; radians."""
    elevation, azimuth = np.meshgrid(row_elevations(horizon, rows), column_azimuths(), indexing="ij")
    mu, mu_sun = np.sin(elevation), np.full(elevation.shape, np.sin(sun))
    cosine = np.clip(mu * mu_sun + np.cos(elevation) * np.cos(sun) * np.cos(azimuth), -1, 1)
    apart = np.sin((elevation - sun) / 2) ** 2 + np.cos(elevation) * np.cos(sun) * np.sin(azimuth / 2) ** 2  # (1 - cosine) / 2
    out = np.zeros(elevation.shape, RAY)
    out["mu"], out["cosine"], out["sine2"], out["azimuth"] = mu, cosine, 4 * apart * (1 - apart), azimuth
    out["first"], out["last"] = earth_shadow(np.full(elevation.shape, height), mu, mu_sun, cosine)
    return out
