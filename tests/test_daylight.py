"""Daylight in float64 against truth tables that other programs computed, and its own laws."""

import datetime
import re
import subprocess
import sys

import numpy as np
import pytest
from daylight_truth import LUMINANCE, colours, column, error, of_kind, rows, shadows

from airlight.daylight import Atmosphere, hoffman_preetham, sun_position
from airlight.daylight.columns import columns_table, columns_to_top, table_columns
from airlight.daylight.multiple import reach
from airlight.daylight.orders import from_cosines, table_azimuths, table_elevations, table_heights, to_cosines
from airlight.daylight.sun import refraction
from airlight.errors import AirlightError
from airlight.reference import daylight as reference

PLAIN = {"wavelengths": "rgb", "multiple": "none"}


def test_sunlight_is_the_tables() -> None:
    table = of_kind("sun")
    found = Atmosphere(**PLAIN).sun(column(table, "sun_elevation_deg"), column(table, "altitude_m"))
    assert error(found, colours(table, "T_")).max() < 1e-5


def test_single_scattering_is_the_tables() -> None:
    """Sky, aerial perspective, and this with a part of the ray in shadow, to the third figure; D is 0 to the bit where all is lit."""
    table = of_kind("sky", "aerial", "shadowed")
    angles = [column(table, f"{name}_deg") for name in ("view_elevation", "azimuth_from_sun", "sun_elevation")]
    parts = Atmosphere(**PLAIN).parts(*angles, column(table, "altitude_m"), column(table, "distance_m"), shadows(table))
    assert len(table) == 176
    assert error(parts.shadowed, colours(table, "L1_")).max() < 1e-3
    assert error(parts.transmittance, colours(table, "T_")).max() < 1e-3
    assert not parts.multiple.any()
    lit = np.array([row["kind"] == "aerial" for row in table])
    dark = np.array([row["kind"] == "shadowed" for row in table])
    assert (parts.single[lit] == parts.shadowed[lit]).all() and (parts.dark[lit] == 0).all()
    assert error(parts.single[dark], parts.single[lit]).max() < 1e-4  # the same light, cut at other places
    share = parts.dark[dark][parts.single[dark] > 0]
    assert len(share) > 90 and share.min() > 0.2 and share.max() < 0.6


def rows_of_psi(sun: str) -> None:
    """Light scattered once to 1e-3, psi to 2e-3. Towards a sun at 0 degrees the table's rays have 0.18 % more psi than a solve for the sun
    at each of their points says, and than its own rows of psi do."""
    table = [row for row in of_kind("psi", "sky", "aerial", "shadowed") if row["sun_elevation_deg"] == sun]
    air = Atmosphere(wavelengths="rgb", multiple="psi")
    alone = [row for row in table if row["kind"] == "psi"]
    found = air.psi(column(alone, "altitude_m"), column(alone, "sun_elevation_deg"))
    assert error(found, colours(alone, "Lms_")).max() < 2e-3
    rays = [row for row in table if row["kind"] != "psi"]
    angles = [column(rays, f"{name}_deg") for name in ("view_elevation", "azimuth_from_sun", "sun_elevation")]
    place = (column(rays, "altitude_m"), column(rays, "distance_m"), shadows(rays))
    radiance, transmittance = air.aerial(*angles, *place)
    once, more = colours(rays, "L1_"), colours(rays, "Lms_")
    assert error(transmittance, colours(rays, "T_")).max() < 1e-3
    assert error(air.parts(*angles, *place).multiple, more).max() < 2e-3
    least = 0.01 * once.max(axis=-1, keepdims=True)
    assert (np.abs(radiance - once - more) <= 1e-3 * np.maximum(once, least) + 2e-3 * more).all()


def test_psi_is_the_tables() -> None:
    rows_of_psi("90")


@pytest.mark.slow
@pytest.mark.parametrize("sun", ["45", "20", "10", "5", "2", "0", "-3"])
def test_psi_is_the_tables_at_other_suns(sun: str) -> None:
    rows_of_psi(sun)


def rows_of_total(**only: str) -> None:
    """Three standard errors, and 2 % of luminance, or 4 % below 6 degrees; of dark channels too."""
    for air in ("earth", "visibility 40 km"):
        table = [row for row in rows("total") if row["air"] == air and all(row[name] == value for name, value in only.items())]
        angles = [column(table, f"{name}_deg") for name in ("view_elevation", "azimuth_from_sun", "sun_elevation")]
        atmosphere = Atmosphere(visibility=None if air == "earth" else 40, wavelengths="rgb")
        parts, truth = atmosphere.parts(*angles, 2), colours(table, "total_")
        assert error(parts.single, colours(table, "single_")).max() < 1e-3
        allowed = np.where(column(table, "sun_elevation_deg") < 6, 0.04, 0.02) * (truth @ LUMINANCE)
        off = np.abs(parts.single + parts.multiple - truth)
        assert (off <= 3 * colours(table, "se_") + allowed[:, None]).all()
        assert (off <= 3 * colours(table, "se_") + 0.01 * truth).all()  # which it does far better


def test_all_orders_are_the_tables() -> None:
    rows_of_total(sun_elevation_deg="60")


@pytest.mark.slow
def test_all_orders_are_the_tables_at_other_suns() -> None:
    rows_of_total()


def test_four_wavelengths_are_the_spectrum() -> None:
    """Of sun, sky and ways; 5 % where a channel is above 2 % of the largest, and the table's own four wavelengths to the fourth figure."""
    air = Atmosphere(multiple="none")
    table = rows("spectral")
    kinds = {kind: [row for row in table if row["kind"] == kind] for kind in ("sun", "sky", "way")}
    sky, far = kinds["sky"], column(kinds["way"], "view_elevation_or_distance")
    level = air.coefficients.rayleigh + air.coefficients.aerosol_extinction  # at sea level all the way, which no straight ray is
    found = {
        "sun": air.sun(column(kinds["sun"], "sun_elevation_deg"), 2),
        "sky": air.sky(*(column(sky, name) for name in ("view_elevation_or_distance", "azimuth_from_sun_deg", "sun_elevation_deg")), 2),
        "way": air.coefficients.channels(np.exp(-far[:, None] * level)),
    }
    assert sum(map(len, kinds.values())) == len(table) == 19
    for kind, values in found.items():
        truth = colours(kinds[kind], "", "RGB")
        counts = truth > 0.02 * truth.max(axis=-1, keepdims=True)
        assert np.abs(values / truth - 1)[counts].max() < 0.05
        assert error(values, colours(kinds[kind], "fit4_", "RGB")).max() < 2e-3
    near, transmittance = far[0], air.aerial(0, 0, 45, 0, far[0])[1]
    assert error(transmittance, air.coefficients.channels(np.exp(-near * level))).max() < 1e-3


def test_white_is_the_sun_outside_the_air() -> None:
    assert np.allclose(Atmosphere().sun(30, 100_000), 1, atol=1e-3)


def test_eq_1_is_the_tables() -> None:
    table = rows("eq1")
    assert {row["phase"] for row in table} == {"hp", "hg"} and len(table) == 72
    for phase in ("hp", "hg"):
        some = [row for row in table if row["phase"] == phase]
        place = (column(some, "g"), column(some, "s_m"), column(some, "theta_deg"))
        for l0, name in ((0.25, "L_"), (0, "Lin_")):
            found, truth = hoffman_preetham(l0, 3, colours(some, "bR_"), colours(some, "bM_"), *place, phase=phase), colours(some, name)
            assert (np.abs(found - truth) <= 1e-5 * truth).all()


def test_eq_2_hides_all_or_the_source() -> None:
    air = (0.25, 3, (1e-5, 2e-5, 3e-5), 4e-5, 0.8, [100.0, 5000.0], 30)
    whole, dark = hoffman_preetham(*air), hoffman_preetham(0.25, 0, *air[2:])
    assert whole.shape == (2, 3)
    assert np.allclose(hoffman_preetham(*air, dark=0.4), 0.6 * whole)
    assert np.allclose(hoffman_preetham(*air, dark=0.4, attenuate="source"), dark + 0.6 * (whole - dark))
    assert (hoffman_preetham(*air, dark=0, attenuate="source") == whole).all()
    assert np.allclose(hoffman_preetham(0.25, 3, 0, 0, 0.8, 1000, 30), 0.25)  # no air at all


def test_the_suns_place_is_the_tables() -> None:
    table = rows("sunpos")
    place = [column(table, name) for name in ("latitude", "longitude", "altitude_m")]
    elevation, azimuth, apparent = sun_position([row["utc"] for row in table], *place)
    for name, found in (("spa_elevation", elevation), ("spa_azimuth", azimuth), ("ephem_elevation", elevation), ("ephem_azimuth", azimuth)):
        assert np.abs(found - column(table, name)).max() < 0.01
    up = np.array([row["spa_apparent"] != "" for row in table])
    assert np.abs(apparent - column(table, "spa_apparent"))[up].max() < 1e-3


def test_times_are_what_they_say() -> None:
    zone = datetime.timezone(datetime.timedelta(hours=2))
    same = ["2026-06-21T12:00:00Z", "2026-06-21T14:00:00+02:00", datetime.datetime(2026, 6, 21, 14, tzinfo=zone), "2026-06-21 12:00+00"]
    found = np.array(sun_position(same, 51.4779, 0.0, 46.0))
    assert (found == found[:, :1]).all() and found.shape == (3, 4)
    alone = sun_position(same[0], 51.4779, 0.0, 46.0)
    assert np.shape(alone[0]) == () and np.array_equal(np.array(alone), found[:, 0])
    assert sun_position(np.array(same[:2]), np.zeros((5, 1)), 0)[1].shape == (5, 2)


def test_refraction_leaves_no_jump() -> None:
    elevation = np.linspace(-10, 90, 200_001)
    apparent = elevation + refraction(elevation)
    assert (np.diff(apparent) >= 0).all() and np.diff(apparent).max() < 2e-3
    assert refraction(-10) == 0 and 0.4 < refraction(0) < 0.6 and abs(refraction(90)) < 1e-4


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ({"visibility": 20, "turbidity": 3}, "visibility and turbidity both"),
        ({"visibility": 300}, r"visibility is 300 km; give 0\.05 to 280 km; clean air has 289 km"),
        ({"visibility": float("nan")}, "visibility is nan"),
        ({"visibility": "far"}, "visibility is 'far', and no number; give 0.05 to 280 km"),
        ({"visibility": True}, "visibility is True, and no number"),
        ({"visibility": 1j}, "visibility is 1j, and no number"),
        ({"ozone": None}, "ozone is None, and no number; give 0 to 600 DU"),
        ({"ozone": 10**400}, "ozone is no number"),
        ({"ground_albedo": (0.1, None, 0.2)}, "ground_albedo is None, and no number"),
        ({"aerosol_albedo": np.bool_(True)}, "aerosol_albedo is True, and no number"),
        ({"wavelengths": 4}, "wavelengths is 4, and no text; give '4' or 'rgb'"),
        ({"multiple": None}, "multiple is None, and no text"),
        ({"visibility": [1, 2]}, "one number"),
        ({"turbidity": 0.5}, "give 1 to 10"),
        ({"ozone": 700}, "give 0 to 600 DU"),
        ({"ground_albedo": 1.5}, "give 0 to 1"),
        ({"ground_albedo": (0.1, 0.2)}, "red, green and blue"),
        ({"aerosol_albedo": -1}, "give 0 to 1"),
        ({"aerosol_anisotropy": 1}, r"give -0\.99 to 0\.99"),
        ({"wavelengths": "5"}, "give 4 or rgb"),
        ({"multiple": "order"}, "did you mean 'orders'"),
    ],
)
def test_airs_that_cannot_be(arguments: dict, says: str) -> None:
    with pytest.raises(AirlightError, match=says) as caught:
        Atmosphere(**arguments)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"sun_elevation": -19}, "sun_elevation is -19; give -18 to 90"),
        ({"view_elevation": 91}, "give -90 to 90"),
        ({"azimuth_from_sun": np.inf}, "give finite numbers"),
        ({"altitude": 200_000}, "give -500 to 100000 m"),
        ({"distance": -1}, "give 0 or more"),
        ({"distance": [5, True]}, "distance is True, and no number"),
        ({"distance": [[5], [6, 7]]}, r"distance is \[5\], and no number"),
        ({"view_elevation": None}, "view_elevation is None"),
        ({"shadow": [(None, 2)]}, "shadow's start is None"),
        ({"distance": np.nan}, "distance is nan"),
        ({"shadow": [5]}, r"list of \(start, end\)"),
        ({"shadow": [(5, 2)]}, "ends before it starts"),
        ({"view_elevation": np.zeros(3), "sun_elevation": np.zeros(4)}, r"view_elevation \(3,\).*sun_elevation \(4,\)"),
    ],
)
def test_views_that_cannot_be(change: dict, says: str) -> None:
    plain = {"view_elevation": 10, "azimuth_from_sun": 20, "sun_elevation": 30, "altitude": 2, "distance": 1000}
    with pytest.raises(AirlightError, match=says) as caught:
        Atmosphere(**PLAIN).aerial(**plain | change)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("2026-06-21T12:00:00", 0, 0), r"without a zone; add Z or.*\+02:00"),
        ((datetime.datetime(2026, 6, 21), 0, 0), "without a zone"),
        (("2026-02-30T12:00:00Z", 0, 0), "no time .*day"),
        (("yesterday", 0, 0), "give it as 2026-06-21T12:00:00Z"),
        ((1.5, 0, 0), "give ISO 8601"),
        (("0101-01-01T12:00:00Z", 0, 0), "give 1000 to 6000"),
        (("2026-06-21T12:00:00Z", 91, 0), "latitude is 91; give -90 to 90"),
        (("2026-06-21T12:00:00Z", 0, 181), "longitude is 181"),
        (("2026-06-21T12:00:00Z", True, 0), "latitude is True"),
        ((["2026-06-21T12:00:00Z", None], 0, 0), "give ISO 8601"),
        (("2026-06-21T12:00:00Z", 0, 0, -1000), "give -430 to 100000 m"),
    ],
)
def test_places_and_times_that_cannot_be(arguments: tuple, says: str) -> None:
    with pytest.raises(AirlightError, match=says) as caught:
        sun_position(*arguments)
    assert "\n" not in str(caught.value)


def test_eq_1_says_what_it_takes() -> None:
    good = {"l0": 1, "e_sun": 1, "beta_rayleigh": 1e-5, "beta_mie": 1e-5, "g": 0.5, "distance": 10, "theta": 5}
    for bad, says in (({"phase": "hh"}, "give hp or hg"), ({"g": 1}, "g is 1"), ({"distance": -1}, "distance is -1"),
                      ({"beta_mie": -1}, "beta_mie is -1"), ({"attenuate": "none"}, "give all or source"),
                      ({"theta": 181}, "theta is 181 degrees; give 0 to 180 degrees"), ({"theta": -1}, "theta is -1"),
                      ({"l0": "1"}, "l0 is '1', and"), ({"dark": True}, "dark is True"), ({"phase": 1}, "is 1, and")):  # fmt: skip
        with pytest.raises(AirlightError, match=re.escape(says)):
            hoffman_preetham(**good | bad)


def test_shapes_broadcast() -> None:
    air = Atmosphere(**PLAIN)
    radiance, transmittance = air.aerial(np.zeros((4, 1)), np.zeros(3), 20, 2, 1000, shadow=[(np.full(3, 200), 600), (500, 700)])
    assert radiance.shape == transmittance.shape == (4, 3, 3)
    assert air.sun(20).shape == (3,) and air.sky([], 0, 20).shape == (0, 3)


def test_shadows_that_overlap_count_once() -> None:
    air = Atmosphere(**PLAIN)
    view = (5, 40, 20, 2, 9000)
    once, twice = (air.aerial(*view, shadow=shadow)[0] for shadow in ([(100, 4000)], [(300, 4000), (100, 2000), (500, 600)]))
    assert np.allclose(once, twice, rtol=1e-6)
    assert np.allclose(air.aerial(*view, shadow=[(0, 1e9)])[0], 0)
    assert (air.aerial(*view, shadow=[])[0] == air.aerial(*view)[0]).all()
    assert (air.aerial(*view, shadow=np.array([[100, 4000]]))[0] == once).all()
    for bad in (5, [5], [(1, 2, 3)]):
        with pytest.raises(AirlightError, match="shadow is a list of"):
            air.aerial(*view, shadow=bad)
    with pytest.raises(AirlightError, match="give one number"):
        air.orders_table([1, 2])


def test_switches_and_sizes_that_cannot_be() -> None:
    air = Atmosphere(**PLAIN)
    with pytest.raises(AirlightError, match="disc is 1; give True or False"):
        air.sun(20, disc=1)
    for bad in (5, (0, 4), (2.5, 4), (4, 4, 4), (4, True)):
        with pytest.raises(AirlightError, match="size is"):
            air.optical_depth_table(bad)


def test_ways_multiply() -> None:
    """T(a + b) = T(a) T(b), at any distance, and what lies beyond the ground is not reached."""
    air = Atmosphere(**PLAIN)
    way = np.array([0, 1, 30, 1000.0, 2e4, 1e6])
    first = air.aerial(0, 0, 45, 2000, way)[1]
    height, elevation = reference.height_along(2000, 0, way), np.degrees(np.arcsin(reference.view_cosine_along(2000, 0, way)))
    second = air.aerial(elevation[:-1], 0, 45, height[:-1], 3000)[1]
    assert np.allclose(air.aerial(0, 0, 45, 2000, way[:-1] + 3000)[1], first[:-1] * second, rtol=1e-6)
    assert (first[0] == 1).all() and (np.diff(first, axis=0) < 0).all()
    assert np.allclose(air.aerial(-90, 0, 45, 2000, 1e9)[1], air.aerial(-90, 0, 45, 2000, 2000)[1])


@pytest.mark.parametrize("kind", ["orders", "psi", "none"])
def test_rays_without_length_gather_nothing(kind: str) -> None:
    """At no distance, upwards from the end of the air, and downwards from the ground."""
    parts = Atmosphere(multiple=kind).parts([5, 90, -90], 20, 40, [2, 100_000, 0], [0, np.inf, np.inf])
    assert (parts.transmittance == parts.transmittance[0]).all() and np.allclose(parts.transmittance, 1, atol=1e-4)
    assert not any(part.any() for part in parts[1:])


def test_haze_and_turbidity_are_koschmieders_and_preethams() -> None:
    hazy = Atmosphere(visibility=10, wavelengths="rgb").coefficients
    assert np.allclose(np.exp(-10_000 * (hazy.rayleigh[1] + hazy.aerosol_extinction[1])), 0.02, rtol=1e-3)
    turbid = Atmosphere(turbidity=3).coefficients
    assert np.allclose(turbid.aerosol_extinction * 1200, (0.04608 * 3 - 0.04586) * (turbid.nm / 1000) ** -1.3)
    assert np.allclose(turbid.aerosol_scattering, 0.9 * turbid.aerosol_extinction)
    assert np.allclose(Atmosphere(ozone=150).coefficients.ozone * 2, Atmosphere().coefficients.ozone)
    assert np.allclose(Atmosphere().coefficients.rayleigh, (7.8755e-6, 12.615e-6, 19.850e-6, 30.254e-6), rtol=1e-4)


def test_coordinates_of_the_depth_table_return() -> None:
    grid = np.stack(np.meshgrid(np.linspace(0, 1, 33), np.linspace(0, 1, 17)), axis=-1)
    ray = reference.depth_table_ray(grid)
    inside = grid[..., 1] < 1  # at the top all rays upwards are at 0
    assert np.abs(reference.depth_table_position(ray[..., 0], ray[..., 1]) - grid)[inside].max() < 1e-6
    assert ray[0, 0].tolist() == [0, 1] and abs(ray[0, -1, 1]) < 1e-9  # up, and level, from the ground
    random = np.random.default_rng(5)
    height, mu = 1e4 * random.random(400), random.random(400)
    extinction = Atmosphere(**PLAIN).coefficients.extinction
    exact = np.exp(-columns_to_top(height, mu) @ extinction)
    for table, bound in ((columns_table(), 3e-4), (columns_table((64, 256)), 1.5e-3)):
        assert np.abs(np.exp(-table_columns(height, mu, table) @ extinction) - exact).max() < bound


def test_coordinates_of_the_orders_table_return() -> None:
    for axis, nodes in enumerate((table_heights(), table_elevations(), table_azimuths())):
        point = [np.zeros(len(nodes))] * 3
        point[axis] = nodes
        assert np.allclose(reference.orders_position(*point)[:, axis], np.arange(len(nodes)))
    assert reference.orders_position(0, 0, [-0.3, 2 * np.pi + 0.3])[:, 2].tolist() == pytest.approx([0.3 / np.pi * 16] * 2)
    assert np.allclose(from_cosines() @ to_cosines(), np.eye(len(table_azimuths())))


def test_geometry_of_rays() -> None:
    height, mu, t = np.array([0, 2, 5e3, 9e4]), np.array([0.3, 0, -0.01, -0.2]), np.array([1e4, 1e3, 5e4, 1e5])
    x, y = t * np.sqrt(1 - mu**2), reference.GROUND_RADIUS + height + t * mu
    assert np.allclose(reference.height_along(height, mu, t), np.hypot(x, y) - reference.GROUND_RADIUS, atol=1e-6)
    assert np.allclose(reference.view_cosine_along(height, mu, t), (x * np.sqrt(1 - mu**2) + y * mu) / np.hypot(x, y))
    assert np.allclose(reference.height_along(height, mu, reference.distance_to_top(height, mu)), reference.TOP_HEIGHT)
    down = np.array([-0.5, -0.02, -0.9, -1])
    assert np.allclose(reference.height_along(height, down, reference.distance_to_ground(height, down)), 0, atol=1e-6)
    assert np.isinf(reference.distance_to_ground(5000, -0.01)) and reference.distance_to_ground(0, -0.5) == 0
    steps = np.linspace(0, 2e5, 400_001)
    summed = reference.air_density(reference.height_along(50_000, -0.3, steps))[:, 2].sum() * steps[1]
    assert reference.ozone_column(50_000, -0.3, 2e5) == pytest.approx(summed, rel=1e-4)


def test_the_sun_sets_without_a_jump() -> None:
    """The disc's part is the visible one, and its light fades; the point's ends with the horizon, which is lower from a height."""
    elevation, air = np.linspace(-2.5, 1, 1401), Atmosphere(**PLAIN)
    for height in (0, 2, 1500):
        light = air.sun(elevation, height, disc=True)
        assert np.abs(np.diff(light, axis=0)).max() < 0.01 and (light[0] == 0).all()
        assert np.allclose(light[-1], air.sun(1.0, height))
    assert reference.sun_disc_part(0, 0) == pytest.approx(0.5) and reference.sun_disc_part(0.3, 0) == 1
    assert air.sun(-1, 1500).any() and not air.sun(-1, 2).any()


def test_the_interpolated_sun_reaches_the_same_at_any_elevation() -> None:
    assert np.abs(np.diff(reach(np.linspace(-18, 90, 1000)))).max() < 0.1


def test_importing_needs_no_gpu_library() -> None:
    code = "import sys, airlight.daylight; print(sorted({'wgpu', 'pygfx', 'sunposition'} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=100)
    assert done.stdout.strip() == "[]", done.stderr
