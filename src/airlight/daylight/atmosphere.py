"""Evaluates daylight in a round atmosphere: `Atmosphere`, in float64."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from airlight.daylight.checks import broadcast, number, numbers, one_of, true_or_false
from airlight.daylight.coefficients import coefficients
from airlight.daylight.columns import SHADER_SIZE, columns_table, columns_to_top
from airlight.daylight.march import Gathered, Rays, gather
from airlight.daylight.multiple import KINDS, Orders, Psi, kept
from airlight.daylight.orders import azimuth_weights, table_azimuths
from airlight.daylight.rays import gauss
from airlight.errors import AirlightError
from airlight.reference.daylight import (
    TOP_HEIGHT,
    Array,
    distance_to_ground,
    distance_to_top,
    horizon_cosine,
    in_earth_shadow,
    sun_disc_part,
)

LOWEST_SUN = -18.0  # degrees: the end of the astronomical twilight
SKY_ELEVATIONS = 16  # by which the sky's irradiance is summed
MOST_NODES = 4096  # of a table, along each side
ALTITUDE = (-500.0, TOP_HEIGHT)  # m; what lies below the sea counts as its surface


class Parts(NamedTuple):
    """Holds what rays (..., 3) gather, linear Rec. 709, for an irradiance of 1 above the air: L = L0 transmittance + shadowed + multiple.

    transmittance: of the whole ray; single: light scattered once, L1; shadowed: (1 - D) L1, what is left of it where something hides the
    sun; multiple: light scattered more than once, Lms, which keeps its light in shadows.
    """

    transmittance: Array
    single: Array
    shadowed: Array
    multiple: Array

    @property
    def dark(self) -> Array:
        """Give D, 0..1: the part of light scattered once that is missing; 0 where there is none."""
        return np.where(self.single != 0, 1 - self.shadowed / np.where(self.single != 0, self.single, 1), 0)


class Atmosphere:
    """Evaluates sun, sky and aerial perspective in a round atmosphere of Rayleigh's air, an aerosol and ozone.

    visibility: km at the ground, 0.05..280 (Koschmieder's, at 550 nm; a grey aerosol), or turbidity: 1..10 (Preetham et al. 1999); neither:
    very clear air, of some 217 km. ozone: 0..600 Dobson units. ground_albedo: one number or red, green, blue, 0..1. aerosol_albedo: 0..1.
    aerosol_anisotropy: g of Cornette and Shanks 1992, -0.99..0.99. wavelengths: "4", at 630, 560, 500 and 450 nm, or "rgb", at 680, 550 and
    440 nm taken for red, green and blue, as most programs do. multiple: light scattered more than once, by successive "orders" with the
    real phase functions, by "psi", evenly to all sides (Hillaire 2020), or "none".

    Angles are in degrees, lengths in metres. Radiances are linear Rec. 709 (..., 3), 1/sr, for an irradiance of 1 above the air in each
    channel; with four wavelengths a strongly coloured light may have a channel below 0, outside of Rec. 709. Arguments broadcast. The sun
    is a point; its elevation, -18..90, is that at the eye, and the azimuth of a view is counted from it. The ground is a sphere: rays end
    there, and bring no light of it. Altitudes, -500..100000, count from it, those below as 0.

    Errors: light scattered once 1e-3, also at sunset; all light .2 % (median) to 1.5 % of luminance against Monte Carlo, docs/daylight.md.
    Raises AirlightError for what is out of range. Sources: Bruneton and Neyret 2008, Hillaire 2020; further orders: docs/daylight.md.
    """

    def __init__(
        self, visibility: float | None = None, turbidity: float | None = None, ozone: float = 300.0, ground_albedo: Any = 0.3,
        aerosol_albedo: float = 0.9, aerosol_anisotropy: float = 0.8, wavelengths: str = "4", multiple: str = "orders",
    ) -> None:  # fmt: skip
        self.coefficients = coefficients(visibility, turbidity, ozone, ground_albedo, aerosol_albedo, aerosol_anisotropy, wavelengths)
        self.multiple = one_of("multiple", multiple, KINDS)

    def sun(self, elevation: Any, altitude: Any = 2.0, disc: bool = False) -> Array:
        """Evaluate (..., 3) the sun's light after the air, of 1 above it: 0 where the ground hides the sun's centre.

        disc: times the part of the disc above the horizon instead, so that a setting sun fades. Error: 1e-6.
        """
        elevation, height = broadcast(elevation=numbers("elevation", elevation, -90, 90), altitude=_altitude(altitude))
        mu = np.sin(np.radians(elevation))
        if true_or_false("disc", disc):
            part = sun_disc_part(elevation, height)
            mu = np.maximum(mu, horizon_cosine(height))  # what shows of a disc that has half sunk stands at the horizon
        else:
            part = np.where(in_earth_shadow(height, mu), 0.0, 1.0)
        air = self.coefficients
        return air.channels(part[..., None] * np.exp(-columns_to_top(height, mu) @ air.extinction))

    def sky(self, view_elevation: Any, azimuth_from_sun: Any, sun_elevation: Any, altitude: Any = 2.0) -> Array:
        """Evaluate (..., 3) the radiance of the air along views from an altitude to space, or to the ground."""
        parts = self.parts(view_elevation, azimuth_from_sun, sun_elevation, altitude)
        return parts.shadowed + parts.multiple

    def aerial(
        self, view_elevation: Any, azimuth_from_sun: Any, sun_elevation: Any, altitude: Any, distance: Any,
        shadow: Sequence[Any] | None = None,
    ) -> tuple[Array, Array]:  # fmt: skip
        """Evaluate (..., 3) radiance of the air, and its transmittance, between the eye and what is seen at a distance, m.

        shadow: list of (start, end), m from the eye, in which something hides the sun: only light scattered once is missing there.
        """
        parts = self.parts(view_elevation, azimuth_from_sun, sun_elevation, altitude, distance, shadow)
        return parts.shadowed + parts.multiple, parts.transmittance

    def parts(
        self, view_elevation: Any, azimuth_from_sun: Any, sun_elevation: Any, altitude: Any = 2.0, distance: Any = np.inf,
        shadow: Sequence[Any] | None = None,
    ) -> Parts:  # fmt: skip
        """Evaluate the parts of `aerial` and `sky` by themselves: see `Parts`."""
        stretches = _stretches(shadow)
        view, azimuth, sun, height, length, *ends = broadcast(
            view_elevation=np.radians(numbers("view_elevation", view_elevation, -90, 90)),
            azimuth_from_sun=np.radians(numbers("azimuth_from_sun", azimuth_from_sun, -np.inf, np.inf)),
            sun_elevation=np.radians(numbers("sun_elevation", sun_elevation, LOWEST_SUN, 90)),
            altitude=_altitude(altitude), distance=numbers("distance", distance, 0, np.inf, finite=False),
            **{f"shadow {i // 2} {('start', 'end')[i % 2]}": end for i, end in enumerate(end for pair in stretches for end in pair)},
        )  # fmt: skip
        shape = view.shape
        view, azimuth, sun, height, length, *ends = (one.ravel() for one in (view, azimuth, sun, height, length, *ends))
        mu, mu_sun = np.sin(view), np.sin(sun)
        cosine = np.clip(mu * mu_sun + np.cos(view) * np.cos(sun) * np.cos(azimuth), -1, 1)
        length = np.minimum(length, np.minimum(distance_to_ground(height, mu), distance_to_top(height, mu)))
        further = None if self._solver is None else self._solver.further
        rays = Rays(height, mu, mu_sun, cosine, azimuth, length)
        found: Gathered = gather(self.coefficients, rays, further, list(zip(ends[::2], ends[1::2])))
        return Parts(*(self.coefficients.channels(one).reshape(*shape, 3) for one in found))

    def irradiance(self, sun_elevation: Any, altitude: Any = 2.0) -> tuple[Array, Array]:
        """Evaluate (..., 3) irradiance of a level plane that faces up, by the sun and by the sky, of 1 above the air.

        Of ground that has an albedo, albedo / pi times their sum is the radiance. Error: 1 %, beside that of the sky.
        """
        sun, height = broadcast(sun_elevation=numbers("sun_elevation", sun_elevation, LOWEST_SUN, 90), altitude=_altitude(altitude))
        x, weight, _ = gauss(SKY_ELEVATIONS)
        belt = 2 * np.pi * weight * x  # over sines of elevation, in which a level plane's cosine is linear
        radiance = self.sky(np.degrees(np.arcsin(x))[:, None], np.degrees(table_azimuths()), sun[..., None, None], height[..., None, None])
        direct = np.maximum(np.sin(np.radians(sun)), 0)[..., None] * self.sun(sun, height)
        return direct, np.einsum("...eac,e,a->...c", radiance, belt, azimuth_weights())

    def psi(self, altitude: Any, sun_elevation: Any) -> Array:
        """Evaluate (..., 3) psi, 1/sr: mean radiance of light scattered more than once, as if evenly at each time (Hillaire 2020).

        Whatever `multiple` is. Error: 1e-4; near sunset and after it 1e-3.
        """
        height, sun = broadcast(altitude=_altitude(altitude), sun_elevation=numbers("sun_elevation", sun_elevation, LOWEST_SUN, 90))
        solver: Psi = kept(Psi, self.coefficients)
        return self.coefficients.channels(solver.psi(height, np.radians(sun)))

    def orders_table(self, sun_elevation: float) -> Array:
        """Give (20, 48, 17, 2, W) float32, 1/sr: light scattered before, as Rayleigh's phase and the aerosol's turn it into a view.

        Axes: height, view elevation, azimuth from the sun, at `reference.daylight.orders_position`; phase; wavelength. A metre of air
        scatters its coefficients times that. Whatever `multiple` is. sun_elevation: -30..90, of the table's vertical.
        """
        solver: Orders = kept(Orders, self.coefficients)
        return solver.table(number("sun_elevation", sun_elevation, -30, 90))

    def optical_depth_table(self, size: tuple[int, int] = SHADER_SIZE) -> Array:
        """Give (heights, cosines, W) optical depth to the end of the air, at `reference.daylight.depth_table_ray`, ends included."""
        return columns_table(_table_size(size)) @ self.coefficients.extinction

    @property
    def _solver(self) -> Any:
        kind = KINDS[self.multiple]
        return None if kind is None else kept(kind, self.coefficients)


def _table_size(size: Any) -> tuple[int, int]:
    """Check a table's numbers of heights and cosines."""
    found = numbers("size", size, 2, MOST_NODES)
    if found.shape != (2,) or (found % 1 != 0).any():
        raise AirlightError(f"size is {size!r}; give two whole numbers, heights and cosines, of 2 to {MOST_NODES}")
    return int(found[0]), int(found[1])


def _altitude(altitude: Any) -> Array:
    return np.maximum(numbers("altitude", altitude, *ALTITUDE, unit="m"), 0)


def _stretches(shadow: Any) -> list[tuple[Array, Array]]:
    """Check a shadow's stretches, each (start, end) m."""
    try:
        pairs = [(start, end) for start, end in (() if shadow is None else shadow)]
    except (TypeError, ValueError):
        raise AirlightError("shadow is a list of (start, end), in metres from the eye") from None
    return [_stretch(start, end) for start, end in pairs]


def _stretch(start: Any, end: Any) -> tuple[Array, Array]:
    start, end = (numbers(f"shadow's {name}", one, 0, np.inf, unit="m", finite=False) for name, one in (("start", start), ("end", end)))
    if (end < start).any():
        raise AirlightError("shadow has a stretch that ends before it starts; give (start, end), in metres from the eye")
    return start, end
