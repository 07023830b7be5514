"""What holds of any daylight: energy, continuity, chance's own truth, the sun of another library. The long ones are slow."""

import datetime

import numpy as np
import pytest
from daylight_monte_carlo import multiple

from airlight.daylight import Atmosphere, sun_position
from airlight.daylight.orders import azimuth_weights, table_azimuths
from airlight.daylight.rays import gauss
from airlight.reference.daylight import GROUND_RADIUS, TOP_RADIUS, horizon_cosine


def flux(air: Atmosphere, height: float, sun: float) -> np.ndarray:
    """(3,) all light that goes down through level ground or air, less what goes up."""
    x, weight, _ = gauss(24)
    horizon = np.arcsin(horizon_cosine(height))
    up, down = np.pi / 2 - horizon, np.pi / 2 + horizon
    elevation = np.concatenate([horizon - down * x**2, horizon + up * x**2])
    belt = np.concatenate([down * 2 * x * weight, up * 2 * x * weight]) * np.cos(elevation) * np.sin(elevation) * 2 * np.pi
    parts = air.parts(np.degrees(elevation)[:, None], np.degrees(table_azimuths()), sun, height)
    direct = np.sin(np.radians(sun)) * air.sun(sun, height)
    return np.einsum("eac,e,a->c", parts.single + parts.multiple, belt, azimuth_weights()) + direct


@pytest.mark.slow
@pytest.mark.parametrize("visibility", [None, 40, 5])
def test_nothing_is_made_or_lost(visibility: float | None) -> None:
    """Over the whole planet, so over all suns, as much comes through the top of air that absorbs nothing as black ground takes in."""
    air = Atmosphere(visibility, ozone=0, ground_albedo=0, aerosol_albedo=1, wavelengths="rgb")
    x, weight, _ = gauss(7)
    edges = np.array([-0.3, horizon_cosine(99_999.0), 0, 0.2, 1])  # sines of elevation: light jumps where the sun sets, for each height
    suns = np.degrees(np.arcsin((edges[:-1, None] + np.diff(edges)[:, None] * x).ravel()))
    weights = (np.diff(edges)[:, None] * weight).ravel()
    ground, top = (sum(flux(air, height, sun) * w for sun, w in zip(suns, weights)) for height in (0.0, 99_999.0))
    assert np.abs(top * (TOP_RADIUS / GROUND_RADIUS) ** 2 / ground - 1).max() < 0.01


CASES = [
    # visibility, sun, view, azimuth, altitude, what more than chance is allowed, of light scattered more than once
    (None, 30, 20, 60, 2, 0.01),
    (40, 10, 10, 120, 2, 0.01),
    (5, 45, 30, 90, 2, 0.02),
    (1, 45, 30, 90, 2, 0.02),
    (0.3, 45, 30, 90, 2, 0.04),
    (None, 2, 30, 0, 2, 0.02),
    (None, 0, 10, 90, 2, 0.02),
    (None, -4, 10, 0, 2, 0.06),
    (None, 45, 45, 60, 8000, 0.02),
    (20, 20, -20, 40, 3000, 0.02),
]


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES)
def test_all_orders_are_those_of_chance(case: tuple) -> None:
    visibility, sun, view, azimuth, altitude, allowed = case
    air = Atmosphere(visibility, wavelengths="rgb")
    found = air.parts(view, azimuth, sun, altitude).multiple
    for channel in (0, 2):
        paths = {1: 60_000, 0.3: 100_000}.get(visibility, 400_000)
        truth, deviation = multiple(air.coefficients, channel, view, azimuth, sun, altitude, paths)
        assert abs(found[channel] - truth) < 3.5 * deviation + allowed * truth
        assert deviation < 0.05 * truth


@pytest.mark.slow
def test_the_ground_gets_what_comes_down() -> None:
    """Of a sun at 30 degrees and black ground: sun and sky together are the flux into the ground; at 0 degrees the sky lights it alone."""
    air = Atmosphere(20, ground_albedo=0, wavelengths="rgb")
    direct, sky = air.irradiance([30, 0], 0)
    assert np.allclose(direct[0] + sky[0], flux(air, 0.0, 30), rtol=0.01)
    assert (direct[1] == 0).all() and (sky[1] > 0).all() and (sky[0] > 10 * sky[1]).all()


@pytest.mark.slow
def test_nothing_jumps() -> None:
    """Across the horizon, at sunset, with height, and between suns that are solved: steps become half as large when they are halved."""
    air = Atmosphere()
    sweeps = {
        "view": lambda x: air.parts(np.interp(x, [0, 1], [0.2, 4]), 40, 12, 2),
        "azimuth": lambda x: air.parts(5, 360 * x, 12, 2),
        "sun": lambda x: air.parts(10, 30, np.interp(x, [0, 1], [-6, 6]), 2),
        "high sun": lambda x: air.parts(40, 30, np.interp(x, [0, 1], [6, 16]), 2),
        "altitude": lambda x: air.parts(3, 30, 5, 20_000 * x**2),
        "distance": lambda x: air.parts(1, 30, -1, 2, 300_000 * x),
    }
    for name, sweep in sweeps.items():
        steps = []
        for count in (161, 321):
            parts = sweep(np.linspace(0, 1, count))
            radiance = parts.single + parts.multiple
            steps.append(np.abs(np.diff(radiance, axis=0)).max() / radiance.max())
        assert steps[1] < 0.65 * steps[0] + 1e-4, name


@pytest.mark.slow
def test_twilight_fades_to_the_earths_shadow() -> None:
    """Down to -18 degrees light falls with the sun and is finite everywhere; at -6 the earth's shadow stands opposite to it."""
    air, suns = Atmosphere(wavelengths="rgb"), np.array([6, 3, 0, -3, -6, -9, -12, -15, -18.0])
    sky = air.sky(np.array([[5], [30], [90]]), 0, suns, 2)
    assert np.isfinite(sky).all() and (sky > 0).all() and (np.diff(sky[1:], axis=1) < 0).all()
    assert (sky[2, -1] < 1e-6 * sky[2, 0]).all()
    opposite = air.parts([3, 3], [180, 0], -6, 2)
    assert opposite.single[0].max() < 0.05 * opposite.single[1].max()
    for elevation in (-18, 0):
        for more in ({}, {"visibility": 0.05}, {"turbidity": 10, "multiple": "psi"}):
            views, altitudes = np.array([-90, -5, 0, 1e-9, 5, 90.0]), np.array([[[-100]], [[0]], [[1e5]]])
            parts = Atmosphere(**more).parts(views, [[0], [180]], elevation, altitudes)
            assert all(np.isfinite(part).all() for part in parts)


@pytest.mark.slow
def test_orders_do_not_grow_in_fog() -> None:
    """In fog that turns light hundreds of times, and absorbs none, the sum of orders is finite, of the sun's own magnitude."""
    air = Atmosphere(0.2, ozone=0, ground_albedo=1, aerosol_albedo=1, wavelengths="rgb")
    table = air.orders_table(44.0)
    assert table.shape == (20, 48, 17, 2, 3) and np.isfinite(table).all()
    assert table.min() > 0 and table.max() < 2


@pytest.mark.slow
def test_the_suns_place_is_that_of_another_library() -> None:
    """2,000 places and times of VSOP87: within 0.01 degrees."""
    import ephem

    random = np.random.default_rng(20)
    start = datetime.datetime(1980, 1, 1, tzinfo=datetime.UTC)
    whens = [start + datetime.timedelta(seconds=float(s)) for s in random.uniform(0, 70 * 365.25 * 86400, 2000)]
    latitudes, longitudes = np.degrees(np.arcsin(random.uniform(-1, 1, 2000))), random.uniform(-180, 180, 2000)
    elevation, azimuth, _ = sun_position(whens, latitudes, longitudes, 0)
    worst, sun = 0.0, ephem.Sun()
    for when, latitude, longitude, up, along in zip(whens, latitudes, longitudes, elevation, azimuth):
        observer = ephem.Observer()
        observer.lat, observer.lon, observer.pressure = str(latitude), str(longitude), 0
        observer.date = ephem.Date(when.replace(tzinfo=None))
        sun.compute(observer)
        high, turned = np.degrees(float(sun.alt)), np.degrees(float(sun.az))
        across = (along - turned + 180) % 360 - 180
        worst = max(worst, abs(up - high), abs(across) * np.cos(np.radians(high)))
    assert worst < 0.01
