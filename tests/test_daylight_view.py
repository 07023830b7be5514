"""Daylight on the device against the library: the shaders' functions, the table of view rays, and the pass."""

from typing import Any

import numpy as np
import pytest
from calling import call

from airlight.daylight import Atmosphere, hoffman_preetham
from airlight.daylight.multiple import SUNS
from airlight.gpu.device import open_device
from airlight.reference import daylight as air_twins
from airlight.reference import daylight_view as twins
from airlight.scatter.daylight import further
from airlight.scatter.daylight.passes import DaylightPass
from airlight.scatter.daylight.table import VIEW, ViewTable

FOLDER = "scatter/daylight/"
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
SKY = 1e9  # m
NAMES = ("daylight_once", "daylight_all", "daylight_through", "daylight_linear")
RNG = np.random.default_rng(20)
COUNT = 4000


def rays(count: int = COUNT) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Heights, cosines and ways of rays, many of them low, level and short."""
    height = 1e5 * RNG.uniform(size=count) ** 3
    mu = np.sin(np.pi / 2 * RNG.uniform(-1, 1, count) ** 3)
    return (height.astype("f4"), mu.astype("f4"), (1e6 * RNG.uniform(size=count) ** 4).astype("f4"))


def units(count: int = COUNT) -> np.ndarray:
    found = RNG.normal(size=(count, 3))
    return (found / np.linalg.norm(found, axis=1, keepdims=True)).astype("f4")


def test_rays_as_in_the_library() -> None:
    height, mu, t = rays()
    path = FOLDER + "fill_view.wgsl"
    cosine = RNG.uniform(-1, 1, COUNT).astype("f4")
    radius = call(path, "radius_along", [height, mu, t])
    np.testing.assert_allclose(radius, air_twins.radius_along(height, mu, t), rtol=1e-6)
    above = np.maximum(radius - air_twins.GROUND_RADIUS, 0) < 2e5  # where air may be
    along = call(path, "height_along", [height, mu, t])
    np.testing.assert_allclose(along[above], air_twins.height_along(height, mu, t)[above], atol=2)
    near = t < 1000
    np.testing.assert_allclose(along[near], air_twins.height_along(height, mu, t)[near], atol=0.01, rtol=1e-6)
    assert np.abs(call(path, "view_cosine_along", [height, mu, t]) - air_twins.view_cosine_along(height, mu, t)).max() < 1e-6
    sun = call(path, "sun_cosine_along", [height, mu, cosine, mu, t])
    assert np.abs(sun - air_twins.sun_cosine_along(height, mu, cosine, mu, t)).max() < 1e-6
    np.testing.assert_allclose(call(path, "distance_to_top", [height, mu]), air_twins.distance_to_top(height, mu), rtol=2e-5, atol=2)
    np.testing.assert_allclose(call(path, "air_density", [height]), air_twins.air_density(height), rtol=1e-5, atol=1e-7)
    np.testing.assert_allclose(call(path, "depth_table_position", [height, mu]), air_twins.depth_table_position(height, mu), atol=3e-5)
    elevation, azimuth = RNG.uniform(-1.57, 1.57, COUNT).astype("f4"), RNG.uniform(0, np.pi, COUNT).astype("f4")
    found = call(path, "orders_position", [height, elevation, azimuth])
    np.testing.assert_allclose(found, air_twins.orders_position(height, elevation, azimuth), atol=1e-4)


def test_ways_to_the_ground_as_in_the_library() -> None:
    height, mu, _ = rays()
    meets = twins.way_to_ground(height, mu) > 0
    assert 0.2 < meets.mean() < 0.8
    found = call(FOLDER + "fill_view.wgsl", "way_to_ground", [height, mu])
    grazing = np.abs(mu - air_twins.horizon_cosine(height)) < 1e-5  # a float's digits decide there
    np.testing.assert_allclose(found[~grazing], twins.way_to_ground(height, mu)[~grazing], rtol=3e-3)


def test_places_in_the_table() -> None:
    path = FOLDER + "coordinates.wgsl"
    t = (1e6 * RNG.uniform(size=COUNT) ** 6).astype("f4")
    near, dense = np.float32(120), np.float32(4)
    np.testing.assert_allclose(call(path, "way_coordinate", [t, near, dense]), twins.way_coordinate(t, near, dense), atol=6e-6)
    nodes = RNG.uniform(0, twins.DISTANCES - 1, COUNT).astype("f4")
    np.testing.assert_allclose(call(path, "way_at", [nodes, near, dense]), twins.way_at(nodes, near, dense), rtol=3e-5, atol=1e-3)
    at = twins.way_coordinate(twins.way_at(np.arange(twins.DISTANCES), near, dense), near, dense)
    np.testing.assert_allclose(at * twins.DISTANCES - 0.5, np.arange(twins.DISTANCES), atol=1e-9)
    elevation, horizon = RNG.uniform(-1.57, 1.57, COUNT).astype("f4"), np.array([np.sin(-0.03), np.cos(-0.03)], "f4")
    unit, (mu, level) = np.array(twins.elevation_rows(-0.03, 0.02), "f4"), (np.sin(elevation), np.cos(elevation))
    found = call(path, "elevation_row", [mu, level, horizon, unit])
    np.testing.assert_allclose(found, twins.elevation_row(mu, level, horizon, unit), atol=1e-3)
    rows = twins.row_elevations(-0.03, unit.astype(float))
    rows[twins.BELOW - 1] -= 1e-9  # the last below the horizon
    own = twins.elevation_row(np.sin(rows), np.cos(rows), (np.sin(-0.03), np.cos(-0.03)), unit)
    np.testing.assert_allclose(own, np.arange(twins.ELEVATIONS), atol=1e-4)
    np.testing.assert_allclose(rows[[0, -1]], [-np.pi / 2, np.pi / 2], atol=1e-6)
    along = level * np.cos(RNG.uniform(0, np.pi, COUNT).astype("f4"))
    np.testing.assert_allclose(call(path, "azimuth_column", [level, along]), twins.azimuth_column(level, along), atol=0.02)
    np.testing.assert_allclose(twins.azimuth_column(1.0, np.cos(twins.column_azimuths())), np.arange(twins.AZIMUTHS), atol=1e-6)


def test_octaves() -> None:
    path, x = FOLDER + "coordinates.wgsl", np.concatenate([[1, 2, 3, 4, 1024], np.exp2(RNG.uniform(0, 25, COUNT))]).astype("f4")
    assert list(twins.octaves(x[:5])) == [0, 1, 1.5, 2, 10]
    np.testing.assert_allclose(twins.of_octaves(twins.octaves(x)), x)
    found = call(path, "octaves", [x])
    np.testing.assert_allclose(found, twins.octaves(x), rtol=2e-7)
    np.testing.assert_allclose(call(path, "of_octaves", [found]), twins.of_octaves(found), rtol=4e-6)


@pytest.mark.parametrize("near, farthest", [(300, 1.1e6), (10, 1.1e6), (4000, 1.8e6)])
def test_the_last_way_is_the_end(near: float, farthest: float) -> None:
    own, dense = twins.way_nodes(near, farthest)
    assert dense == int(dense) and 0.3 < own / near < 3
    assert twins.way_at(twins.DISTANCES - 1, own, dense) == pytest.approx(farthest)


def test_arc_sine() -> None:
    x = np.concatenate([[-1, 0, 1], RNG.uniform(-1, 1, COUNT) ** 3]).astype("f4")
    assert np.abs(call(FOLDER + "atmosphere.wgsl", "arc_sine", [x]) - twins.arc_sine(x)).max() < 4e-7


def test_suns_stand_where_they_are_solved() -> None:
    np.testing.assert_allclose(twins.sun_position(SUNS), np.arange(len(SUNS)))
    sun = RNG.uniform(-30, 90, COUNT).astype("f4")
    np.testing.assert_allclose(call(FOLDER + "fill_view.wgsl", "sun_position", [sun]), twins.sun_position(sun), atol=1e-5)
    for elevation in (-18.0, -10.5, -3.2, 0.0, 7.9, 8.0, 11.3, 89.5, 90.0):
        first, last = further.needed(elevation)
        assert 0 <= first < last < len(SUNS) and last - first < further.SLOTS


def test_part_left_and_phases() -> None:
    x = np.concatenate([[0], np.geomspace(1e-9, 1e3, COUNT)]).astype("f4")
    found = call(FOLDER + "fill_view.wgsl", "part_left", [np.repeat(x[:, None], 4, axis=1)])
    np.testing.assert_allclose(found, np.repeat(twins.part_left(x)[:, None], 4, axis=1), rtol=3e-6)
    a, b = units(), units()
    b[:1000] = a[:1000] + 1e-3 * units(1000)  # close to the sun
    b /= np.linalg.norm(b, axis=1, keepdims=True)
    a, b = (one.astype(float) / np.linalg.norm(one.astype(float), axis=1, keepdims=True) for one in (a, b))
    cosine, sine2 = (a * b).sum(axis=1), (np.cross(a, b) ** 2).sum(axis=1)
    for g in (-0.9, 0.0, 0.8, 0.99):
        phase = twins.aerosol_phase(cosine, sine2, g)
        found = call(FOLDER + "phases.wgsl", "aerosol_phase", [cosine.astype("f4"), sine2.astype("f4"), np.float32(g)])
        np.testing.assert_allclose(found, phase, rtol=2e-3 if g == 0.99 else 2e-5)
        by_cosine = 3 / (8 * np.pi) * (1 - g * g) * (1 + cosine**2) / ((2 + g * g) * (1 + g * g - 2 * g * cosine) ** 1.5)
        np.testing.assert_allclose(phase, by_cosine, rtol=1e-6)


def test_quotients_are_undone() -> None:
    """What is folded with a share is the radiance again."""
    path = FOLDER + "fill_view.wgsl"
    rest, aerosol = RNG.uniform(0, 1, (2, COUNT, 3)).astype("f4")
    aerosol[:5] = 0
    broad, phase = np.array([0.5, 1, 2], "f4"), RNG.uniform(0.01, 4, COUNT).astype("f4")
    share = twins.broad_share(rest, aerosol, broad)
    np.testing.assert_allclose(call(path, "broad_share", [rest, aerosol, broad]), share, rtol=1e-5)
    assert (share[:5] == twins.MOST_SHARE).all()
    whole = rest + phase[:, None] * aerosol
    stored = np.concatenate([whole / (broad + phase[:, None] / share[:, None]), 1 / share[:, None]], axis=1).astype("f4")
    found = call(VIEW, "daylight_of", [stored, phase, broad, np.array([1, 2, 3], "f4")])
    np.testing.assert_allclose(found, twins.daylight_of(stored, phase, broad, [1, 2, 3]), rtol=1e-5)
    np.testing.assert_allclose(found, whole * [1, 2, 3], rtol=1e-5)
    k, row, column = (RNG.integers(0, most, 100).astype("u4") for most in (twins.DISTANCES, twins.ELEVATIONS, twins.AZIMUTHS))
    assert (call(path, "node_index", [k, row, column]) == twins.node_index(k, row, column)).all()


def test_angles_of_what_is_straight() -> None:
    ray, to_sun, up = (one.astype(float) for one in (units(), units(1)[0], units(1)[0]))
    up = np.cross(np.cross(to_sun, up), to_sun) + 0.3 * to_sun
    up /= np.linalg.norm(up)
    ahead = to_sun - up * (up @ to_sun)
    ahead /= np.linalg.norm(ahead)
    side = np.cross(up, ahead)
    ray[:500] = to_sun + 1e-3 * ray[:500]
    long = RNG.uniform(1, 3, COUNT)[:, None] * ray / np.linalg.norm(ray, axis=1, keepdims=True)
    off = np.stack([long @ side, long @ np.cross(to_sun, side)], axis=-1).astype("f4")
    toward = np.stack([long @ to_sun, long @ up, long @ ahead], axis=-1).astype("f4")
    found = call(FOLDER + "compose_metres.wgsl", "angles_of", [off, toward])
    unit = long / np.linalg.norm(long, axis=1, keepdims=True)
    truth = unit @ up, unit @ ahead, unit @ to_sun, (np.cross(unit, to_sun) ** 2).sum(axis=1), 1 / np.linalg.norm(long, axis=1)
    for name, own, true in zip(("mu", "along", "cosine", "sine2", "axial"), twins.angles_of(off, toward), truth, strict=True):
        np.testing.assert_allclose(own, true, atol=3e-7, rtol=1e-4)
        np.testing.assert_allclose(found[name], own, atol=1e-6, rtol=1e-5)


def test_even_air() -> None:
    path = FOLDER + "hoffman_preetham.wgsl"
    mu = np.sin(RNG.uniform(-1.57, 1.57, COUNT)).astype("f4")
    np.testing.assert_allclose(call(path, "way_in_even_air", [mu]), twins.way_in_even_air(mu), rtol=1e-4)
    assert twins.way_in_even_air(1.0) == pytest.approx(8000)
    theta, way = RNG.uniform(0, 180, COUNT), (3e5 * RNG.uniform(size=COUNT) ** 3).astype("f4")
    cosine, beta = np.cos(np.radians(theta)).astype("f4"), np.array([[7e-6, 1.2e-5, 2.4e-5], [2e-5, 3e-5, 4e-5]], "f4")
    for printed in (True, False):
        own = twins.hoffman_preetham_light(cosine, *beta, 0.7, way, printed)
        found = call(path, "hoffman_preetham_light", [cosine, *beta, np.float32(0.7), way, printed])
        np.testing.assert_allclose(found, own, rtol=2e-5)
        whole = hoffman_preetham(0, 1, *beta, 0.7, way, np.degrees(np.arccos(cosine.astype(float))), "hp" if printed else "hg")
        np.testing.assert_allclose(own, whole, rtol=1e-6)


def test_the_drawn_sun_gives_its_light() -> None:
    apart, radius = (3e-5 * RNG.uniform(size=COUNT)).astype("f4"), np.float32(0.0047)
    found = call(FOLDER + "compose_metres.wgsl", "disc_part", [apart, radius, np.float32(2e-4)])
    np.testing.assert_allclose(found, twins.disc_part(apart, radius, 2e-4), atol=1e-4)
    real = np.radians(air_twins.SUN_ANGULAR_RADIUS)
    for edge in (1e-5, 1e-3, 4e-3, 0.02):
        radius, share = twins.drawn_disc(edge)
        away = np.linspace(0, radius + edge, 20001)
        light = share * np.trapezoid(twins.disc_part(away**2 / 2, radius, edge) * 2 * np.pi * away, away)
        assert light == pytest.approx(np.pi * real**2, rel=2e-3)


@pytest.fixture(scope="module")
def table() -> ViewTable:
    """Of light scattered once, the sun at 12 degrees, which needs no solve."""
    found = ViewTable(open_device())
    assert found.update(Atmosphere(visibility=60, multiple="none"), 12, 30)
    return found


def bound(table: ViewTable, irradiance: Any = 1.0) -> dict[str, Any]:
    """The bindings of view_table.wgsl, in a world with z up and the sun's azimuth along x."""
    return {"daylight": table.record([1, 0, 0], [0, 0, 1], irradiance), **dict(zip(NAMES, table.resources))}


def directions(elevation: Any, azimuth: Any) -> np.ndarray:
    """(..., 3) of degrees."""
    e, a = np.radians(elevation), np.radians(azimuth)
    return np.stack([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e) + 0 * a], axis=-1)


def test_a_ray_finds_its_place(table: ViewTable) -> None:
    record, view = table.record([1, 0, 0], [0, 0, 1]), units()
    found = call(VIEW, "daylight_ray", [view], bindings={"daylight": record})
    at, phase, way, end = twins.daylight_ray(view, record)
    np.testing.assert_allclose(found["at"], at, atol=1e-3)
    np.testing.assert_allclose(found["phase"], phase, rtol=1e-4)
    np.testing.assert_allclose(found["ground"], way, rtol=1e-3)
    np.testing.assert_allclose(found["end"], end, rtol=1e-3)
    off = np.cross(view, record["to_sun"])
    angles = view @ record["up"], view @ record["ahead"], view @ record["to_sun"], (off * off).sum(axis=-1)
    placed = call(VIEW, "daylight_place", angles, bindings={"daylight": record})
    for name, own in zip(("at", "phase", "ground", "end"), twins.daylight_place(*angles, record), strict=True):
        np.testing.assert_allclose(placed[name], own, atol=1e-3 if name == "at" else 0, rtol=1e-3)
    record["height"] = 9000
    high = call(VIEW, "daylight_ray", [view], bindings={"daylight": record})["end"]
    assert (high == twins.daylight_ray(view, record)[3]).all() and (high == twins.NO_END).all()


def differences(table: ViewTable, air: Atmosphere, sun: float, altitude: float, elevation: Any, distances: Any) -> dict[str, float]:
    """The largest differences from the library: of luminance where it is above 1 % of the brightest, of transmittance."""
    e, a, t = (one.ravel() for one in np.meshgrid(elevation, [0.0, 17, 60, 119, 180], distances, indexing="ij"))
    ground = air_twins.distance_to_ground(altitude, np.sin(np.radians(e)))
    kept = (t >= SKY) | (t <= ground)  # heights below 0 count as 0 on the device, where ground is that of the scene
    e, a, t = e[kept], a[kept], t[kept]
    own = air.parts(e, a, sun, altitude, np.where(t < SKY, t, np.inf))
    found = call(VIEW, "daylight_at", [directions(e, a), t.astype("f4")], bindings=bound(table))
    assert np.isfinite(found["single"]).all() and np.isfinite(found["multiple"]).all()
    truth, got = (own.single + own.multiple) @ LUMINANCE, (found["single"] + found["multiple"]) @ LUMINANCE
    off, bright = np.zeros(len(t)), np.zeros(len(t), bool)
    for one in np.unique(t):
        same = t == one
        bright |= same & (truth > 0.01 * truth[same].max())
    off[bright] = np.abs(got / np.where(truth, truth, 1) - 1)[bright]
    through = np.abs(found["transmittance"] - own.transmittance)
    return {"luminance": off.max(), "typical": float(np.median(off[bright])), "transmittance": through.max()}


ELEVATIONS = np.array([-70, -20, -6, -1.5, -0.7, 0.05, 0.4, 1.1, 3.0, 7, 15, 33, 60, 88])


def test_table_is_that_of_the_library(table: ViewTable) -> None:
    air = Atmosphere(visibility=60, multiple="none")
    found = differences(table, air, 12, 30, ELEVATIONS, [40.0, 900, 2e4, SKY])
    assert found["luminance"] < 0.01 and found["typical"] < 0.002 and found["transmittance"] < 0.004, found


def test_table_is_filled_for_another_sun_air_or_altitude_only(table: ViewTable) -> None:
    air, other = Atmosphere(visibility=60, multiple="none"), ViewTable(open_device())
    assert other.update(air, 12, 30)
    assert not other.update(Atmosphere(visibility=60, multiple="none"), 12.0, 30.0)  # the same air, said again
    assert other.update(air, 12.5, 30) and other.update(air, 12.5, 31)
    assert other.update(Atmosphere(visibility=50, multiple="none"), 12.5, 31)
    assert other.update(air, 12, 30)
    for one, two in zip(table.textures, other.textures):
        assert bytes(read_solid(one)) == bytes(read_solid(two))


def read_solid(texture: Any) -> memoryview:
    width, height, layers = texture.size
    layout = {"bytes_per_row": width * 8, "rows_per_image": height}
    return open_device().queue.read_texture({"texture": texture}, layout, (width, height, layers))


def test_lit_stretches_add_up(table: ViewTable) -> None:
    """C(b) - C(a) is what the library gathers where all but a to b lies in shadow."""
    air, e, a = Atmosphere(visibility=60, multiple="none"), np.array([0.5, 5, 40]), np.array([20.0, 70, 150])
    view = directions(e, a)
    ends = [3000.0, 9000.0]
    first, last = (call(VIEW, "daylight_at", [view, np.float32(t)], bindings=bound(table))["single"] for t in ends)
    truth = air.parts(e, a, 12, 30, 2e4, shadow=[(0, ends[0]), (ends[1], 2e4)]).shadowed
    np.testing.assert_allclose(last - first, truth, rtol=0.02)


SIZE = (64, 48)


def scene() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Projection, metres along rays, with sky above, and a picture."""
    width, height = SIZE
    projection = np.array([[1.2 * height / width, 0, 0, 0], [0, 1.2, 0, 0], [0, 0, -1.0, -0.1], [0, 0, -1, 0]])
    metres = np.full((height, width), np.inf, "f4")
    metres[height // 2 :] = np.geomspace(8e4, 3, height // 2)[:, None]
    picture = np.random.default_rng(4).uniform(0.1, 2, (height, width, 4)).astype("f2")
    return projection, metres, picture


def drawn(
    table: ViewTable, dark: float | None = None, parts: bool = False, is_axial: bool = False, **settings: Any
) -> list[np.ndarray]:  # fmt: skip
    """What the pass makes of `scene`, sun ahead; with parts: what is added and let through; is_axial: of metres along the view's axis."""
    device, (projection, metres, picture) = open_device(), scene()
    if is_axial:
        metres = (metres * -pixel_rays()[..., 2]).astype("f4")
    planned = {name: settings.pop(name) for name in ("sky", "even_air", "attenuate") if name in settings}
    one = DaylightPass(device, SIZE, "axis" if is_axial else "ray", **planned)
    one.update(table, np.eye(4), projection, [0, 0.2, -1], [0, 1, 0], **{"irradiance": 3.0} | settings)
    depth, source, shadow = device.texture(*SIZE, "r32float"), device.texture(*SIZE, "rgba16float"), device.texture(*SIZE, "rgba16float")
    device.write(depth, metres, 4 * SIZE[0])
    device.write(source, picture, 8 * SIZE[0])
    device.write(shadow, np.full((*SIZE[::-1], 4), dark or 0, "f2"), 8 * SIZE[0])
    encoder = device.encoder()
    one.record(encoder, depth, source, None if dark is None else shadow, parts=parts)
    device.submit(encoder)
    targets = [(one.radiance, "f4"), (one.transmittance, "f4")] if parts else [(one.picture, "f2")]
    return [np.frombuffer(device.read(t, 4 * np.dtype(k).itemsize), k).reshape(*SIZE[::-1], 4)[..., :3].astype(float) for t, k in targets]


def pixel_rays() -> np.ndarray:
    """The unit rays of the scene's pixels, view space."""
    projection, metres, _ = scene()
    y, x = np.indices(metres.shape)
    across, down = (x + 0.5) / SIZE[0] * 2 - 1, (y + 0.5) / SIZE[1] * 2 - 1
    ray = np.stack([across / projection[0, 0], -down / projection[1, 1], -np.ones(x.shape)], axis=-1)
    return np.asarray(ray / np.linalg.norm(ray, axis=-1, keepdims=True))


def test_metres_along_the_axis_are_those_along_rays(table: ViewTable) -> None:
    for one, two in zip(drawn(table, parts=True), drawn(table, parts=True, is_axial=True)):
        np.testing.assert_allclose(one, two, rtol=1e-4, atol=1e-6)


def test_no_shadow_is_the_atmosphere_alone_to_the_bit(table: ViewTable) -> None:
    for sky in ("keep", "replace"):
        (alone,), (lit,) = drawn(table, sky=sky), drawn(table, 0.0, sky=sky)
        assert alone.tobytes() == lit.tobytes()
    assert np.isfinite(alone).all()


def test_a_sky_that_is_kept_stays_to_the_bit(table: ViewTable) -> None:
    _, metres, picture = scene()
    (kept,) = drawn(table, sky="keep")
    sky = np.isinf(metres)
    assert (kept[sky] == picture[..., :3][sky]).all() and (kept[~sky] != picture[..., :3][~sky]).any()
    (dark,) = drawn(table, 0.5, sky="keep")  # of light scattered once only half misses
    np.testing.assert_allclose(dark[sky], 0.5 * picture[..., :3][sky], rtol=2e-3)


def test_shadow_takes_light_scattered_once_only(table: ViewTable) -> None:
    picture = scene()[2][..., :3].astype(float)
    added, through = drawn(table, parts=True, sky="air")
    half, _ = drawn(table, 0.5, parts=True, sky="air")
    np.testing.assert_allclose(half, 0.5 * added, rtol=1e-3, atol=1e-6)  # nothing but that is in this air
    (whole,) = drawn(table, sky="air")
    np.testing.assert_allclose(whole, picture * through + added, rtol=1e-3)
    (printed,) = drawn(table, 0.5, sky="air", attenuate="all")
    np.testing.assert_allclose(printed, 0.5 * whole, rtol=2e-3)


def test_even_air_is_eq_1(table: ViewTable) -> None:
    _, metres, picture = scene()
    ray = pixel_rays()
    sun = np.array([0, np.sin(np.radians(12)), -np.cos(np.radians(12))])
    theta, seen = np.degrees(np.arccos(ray @ sun)), np.isfinite(metres)
    beta = {"beta_rayleigh": (7e-6, 1.2e-5, 2.4e-5), "beta_mie": (2e-5, 3e-5, 4e-5)}
    for attenuate in ("source", "all"):
        (found,) = drawn(table, 0.25, even_air=True, attenuate=attenuate, g=0.7, **beta)
        l0 = picture[..., :3][seen].astype(float)
        truth = hoffman_preetham(l0, 3, *beta.values(), 0.7, metres[seen], theta[seen], dark=0.25, attenuate=attenuate)
        np.testing.assert_allclose(found[seen], truth, rtol=2e-3)


def test_sun_and_ground_stand_in_a_sky_that_is_replaced(table: ViewTable) -> None:
    added, through = drawn(table, parts=True, ground=(0.5, 0.25, 0.125))
    plain, _ = drawn(table, parts=True, disc=False)
    sky = np.isinf(scene()[1])
    assert (through[sky] == 0).all() and (added >= plain).all()
    bright = (added - plain).sum(axis=-1)
    assert bright.max() > 50 and (bright > 1).sum() < 16  # a few pixels: the sun
    irradiance = 3.0 * Atmosphere(visibility=60).sun(12, 30)
    ray_y, ray_x = 2 / 1.2 / SIZE[1], 2 / 1.2 / SIZE[1]
    solid = ray_x * ray_y * np.cos(np.radians(12)) ** 3  # sr, of a pixel there
    np.testing.assert_allclose((added - plain).sum(axis=(0, 1)) * solid, irradiance, rtol=0.15)
