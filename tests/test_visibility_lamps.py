"""The table of visibility of spots and points: functions against float64 twins, a whole table, and its march against the exact walk."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from calling import call
from tabled import SIZE, air, ground, layer, off, projection
from written import depth_texture

from airlight.errors import AirlightWarning
from airlight.gpu.device import open_device
from airlight.gpu.structs import struct_dtype
from airlight.lights.directional import DirectionalLight
from airlight.lights.point import PointLight
from airlight.lights.projector import ProjectorLight
from airlight.lights.punctual import PositionalLight
from airlight.lights.spot import SpotLight
from airlight.medium.resolve import PHASES
from airlight.projection import eye_rays
from airlight.reference import visibility as shared
from airlight.reference import visibility_lamps as twin
from airlight.scatter.march.march import March
from airlight.scatter.march.records import light_record
from airlight.scatter.visibility import lamps
from airlight.scatter.visibility import table as tables
from airlight.scatter.visibility.base import GRID
from airlight.scatter.visibility.grid import Fineness, row_grid
from airlight.shadows import Shadow

RNG = np.random.default_rng(22)
COUNT = 300
FOLDER = "scatter/visibility"
BITS, ENDS, TABLE, APPLY = (f"{FOLDER}/lamp_{name}.wgsl" for name in ("bits", "ends", "table", "apply"))
FRAME, LIGHT, RAYS, WEIGHTS = (struct_dtype(TABLE, name) for name in ("Frame", "Light", "LampRays", "Weights"))
LAMPS = {
    "in view": (0.6, 0.8, -6.0),
    "at the edge": (4.6, 0.9, -6.0),
    "beside": (6.0, 1.0, -5.0),
    "at right angles": (4.0, 1.0, 0.0),
    "above": (0.0, 5.0, 0.0),
    "straight below": (0.0, -4.0, 0.0),
    "behind": (0.5, 0.7, 4.0),
    "along the view": (0.0, 0.0, -6.0),
    "straight behind": (0.0, 0.0, 3.0),
    "far away": (30.0, 20.0, -30.0),
    "beside the eye": (0.2, 0.1, 0.0),
}

AMONG_FIRST = ("in view", "behind", "along the view")  # of those that are not slow


def between(low: float, high: float, *shape: int) -> np.ndarray:
    return RNG.uniform(low, high, (COUNT, *shape)).astype(np.float32)


def unit(angle: Any) -> np.ndarray:
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1).astype(np.float32)


def posts(light: PositionalLight, side: int = 192) -> tuple[PositionalLight, Shadow, np.ndarray]:
    """A lamp, and the shadow of eight blocks before the eye: (light, shadow, (views, side, side) depths)."""
    rng = np.random.default_rng(3)
    centres = np.column_stack([rng.uniform(-4, 4, 8), rng.uniform(-2, 2, 8), rng.uniform(-12, -4, 8)])
    corners = np.array([(i, j, k) for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)]) * 0.4
    boxes = centres[:, None] + corners
    views = light.shadow_views(np.eye(4), projection(), boxes, replace(air("table"), shadow_size=side))
    maps = np.zeros((len(views), side, side))
    for held, view in zip(maps, views, strict=True):
        for box in boxes:
            at = np.column_stack([box, np.ones(8)]) @ view.matrix.T
            if (at[:, 3] < 0.1).any():
                continue
            place = at[:, :2] / at[:, 3:]
            low, high = np.floor(place.min(axis=0)).astype(int).clip(0), np.ceil(place.max(axis=0)).astype(int).clip(0)
            part = held[low[1] : high[1], low[0] : high[0]]
            np.maximum(part, (at[:, 2] / at[:, 3]).mean(), out=part)
    return light, Shadow(depth_texture(open_device(), maps), side, views), maps


def spot(position: Any, towards: Any = (0.0, 0.0, -8.0), outer: float = 0.6, **more: Any) -> tuple[Any, Shadow]:
    way = np.subtract(towards, position)
    direction = tuple(way / np.linalg.norm(way))
    values = {"intensity": (30.0, 20.0, 10.0), "inner": outer / 2} | more
    return posts(SpotLight(position=tuple(position), direction=direction, outer=outer, **values))[:2]


def point(position: Any, **more: Any) -> tuple[Any, Shadow]:
    return posts(PointLight(intensity=(30.0, 20.0, 10.0), position=tuple(position), **more))[:2]


KINDS = {"spot": spot, "point": point}


# ---------------------------------------------------------------- functions


def test_angle_from() -> None:
    x, y = between(-1, 1), between(0, 1)
    x[:4], y[:4] = (1, -1, 0, 1e-3), (0, 0, 1, 1e-9)
    np.testing.assert_allclose(call(APPLY, "angle_from", [x, y]), twin.angle_from(x, y), rtol=1e-5, atol=1e-9)


def cube() -> np.ndarray:
    light = PointLight(intensity=(1.0, 1.0, 1.0), position=(1.0, 2.0, -3.0))
    turn = np.eye(4)
    turn[:3, :3] = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))[0]
    return light_record(light, posts(light, 32)[1], turn, air("table"))


def test_directions_and_faces_of_the_cube() -> None:
    light, v = cube(), between(-1, 1, 3)
    at, across, towards = unit(between(0, 3)), between(-1, 1, 3), between(-1, 1, 3)
    np.testing.assert_allclose(call(BITS, "from_lamp", [at, across, towards]), twin.from_lamp(at, across, towards), atol=1e-6)
    which = RNG.integers(0, 6, COUNT, np.uint32)
    found = call(BITS, "along_axis", [which, v], bindings={"light": light})
    np.testing.assert_allclose(found, twin.along_axis(which, v, light), atol=1e-5)
    assert np.array_equal(call(BITS, "face_towards", [v], bindings={"light": light}), twin.face_towards(v, light))
    matrix = light["view"]["matrix"][which]
    np.testing.assert_allclose(call(BITS, "projected", [matrix, v]), twin.projected(matrix, v), rtol=1e-4, atol=1e-4)


def test_blocks_of_places_ahead() -> None:
    frame, lamp = np.zeros((), FRAME), np.zeros((), lamps.LAMP)
    frame["depth"], lamp["away"], lamp["begin"], lamp["wide"] = (0.2, 3.0, -0.9, 1.0), 4.0, 0.1, 0.05
    depth = between(0, 1)
    found = call(ENDS, "ahead_at", [depth], bindings={"frame": frame})
    np.testing.assert_allclose(found, twin.ahead_at(depth, frame), rtol=1e-5)
    ahead, across, towards = between(0, 20), between(0, 2), between(-1, 2)
    found = call(ENDS, "block_ahead", [ahead, across, towards], bindings={"lamp": lamp})
    np.testing.assert_allclose(found, twin.block_ahead(ahead, across, towards, lamp), atol=1e-3)


@pytest.mark.parametrize("phase", ["henyey-greenstein", "rayleigh", "two-lobe"])
def test_weights_of_places(phase: str) -> None:
    kind = PHASES.index(phase)
    frame, light = np.zeros((), FRAME), np.zeros((), LIGHT)
    frame["sigma_t"], light["lobes"], light["range"] = (0.05, 0.1, 0.2), (0.6, -0.3, 0.2), 6.0
    eye_angle, angle = between(0.01, 3), between(0, 3)
    bindings, constants = {"frame": frame, "light": light}, {"PHASE": kind}
    eye, at = unit(eye_angle), unit(angle)
    found = call(APPLY, "scattered_at", [eye, at, np.float32(4)], bindings=bindings, constants=constants)
    clear = np.abs(np.sin(eye_angle + angle)) > 1e-2  # near its end a ray's way changes by more than its angle's digits
    np.testing.assert_allclose(found[clear], twin.scattered_at(eye, at, 4.0, frame, light, kind)[clear], rtol=1e-3, atol=1e-6)
    rays, angles = np.zeros(COUNT, RAYS), between(0.01, 2, 4)
    rays["cosine"], rays["sine"] = np.cos(angles), np.sin(angles)
    own = unit(np.float32(0.9))
    weighed = call(TABLE, "weigh", [rays, own, np.float32(0.1), np.float32(4)], bindings={"light": light}, constants=constants)
    for name, values in twin.weigh(rays, own, 0.1, 4.0, light, kind).items():
        np.testing.assert_allclose(weighed[name], values, rtol=1e-3, atol=1e-5)
    end = weighed.copy()
    end["weight"] *= 0.5
    for colours in (False, True):
        given = [rays, weighed, end, np.float32(0.3), unit(np.float32(1.0)), np.float32(0.1), np.float32(4)]
        found = call(TABLE, "weights_in_layer", given, bindings={"light": light}, constants=constants | {"COLOURS": colours})
        expected = twin.weights_in_layer(rays, weighed, end, 0.3, unit(1.0), 0.1, 4.0, light, kind, colours)
        for name, values in expected.items():
            np.testing.assert_allclose(found[name], values, rtol=1e-3, atol=1e-5)
    found = call(TABLE, "windows", [rays, own, np.float32(4)], bindings={"light": light})
    np.testing.assert_allclose(found, twin.windows(rays, own, 4.0, light), atol=1e-4)


def test_mean_of_cone() -> None:
    light = np.zeros((), LIGHT)
    light["cone_scale"], light["cone_offset"] = 3.0, -1.5
    axis = between(-0.7, 0.7, 2)
    at, eighth = unit(between(0, 3)), unit(np.float32(0.01))
    found = call(TABLE, "mean_of_cone", [axis, at, eighth], bindings={"light": light})
    np.testing.assert_allclose(found, twin.mean_of_cone(axis, at, eighth, light), atol=2e-6)


@pytest.mark.parametrize("wary", [False, True])
def test_sums_with_a_strength(wary: bool) -> None:
    grid = np.zeros((), GRID)
    grid["spread"] = 0.03
    surface, constants = between(0, 12, 4), {"COLOURS": True, "WARY": wary}
    sums, expected = call(TABLE, "begin_sums", [surface]), shared.begin_sums(surface)
    for k in range(10):
        share = (np.round(between(-0.5, 1.5, 4).clip(0, 1) * 15) / 15).astype(np.float32)
        weight, middle, strength = between(0.1, 1, 4), between(0, 9, 4), between(0, 1, 4)
        given = [share, weight, middle, strength]
        sums = call(TABLE, "add_weighed", [sums, *given, np.float32(k), np.float32(1)], constants=constants)
        expected = shared.add_weighed(expected, *given, float(k), 1.0, wary)
    for name, values in expected.items():
        np.testing.assert_allclose(sums[name], values, rtol=1e-4, atol=1e-5, err_msg=name)
    found = call(TABLE, "slopes", [sums], bindings={"grid": grid})
    np.testing.assert_allclose(found, shared.slopes(expected, 0.03), rtol=1e-3, atol=1e-5)


@pytest.mark.parametrize("rises", [False, True])
def test_rays_lie_denser_at_the_lamp(rises: bool) -> None:
    ends, constants = between(-1, 1, 2), {"DENSER": True}
    first = call(BITS, "lit_from", [ends[:, 0], ends[:, 1], np.float32(95), np.array(rises)], constants=constants)
    expected = shared.lit_from(ends[:, 0], ends[:, 1], 95, rises, denser=True)
    assert np.abs(first - expected).max() <= 1 and np.mean(first != expected) < 0.02
    grid = row_grid((0.1, 0.2, -0.97), eye_rays(projection())[0], (101, 67), Fineness(6, 6))
    wide = np.array((101, 67), np.float32)
    p = (RNG.random((COUNT, 2)) * wide).astype(np.float32)
    given = [wide, np.float32(grid.slope), grid.offset.astype(np.float32), grid.rate.astype(np.float32)]
    given += [grid.first.astype(np.float32), grid.rays.astype(np.float32)]
    found = call(APPLY, "place_in_grid", [p, *given], constants=constants)
    row, ray, rays = shared.place_in_grid(p, *given, denser=True)
    same = found["rays"] == rays
    assert same.mean() > 0.98
    np.testing.assert_allclose(found["row"][same], row[same], atol=2e-3)
    np.testing.assert_allclose(found["ray"][same], ray[same], atol=5e-3)


# ---------------------------------------------------------------- the march


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("which", [one if one in AMONG_FIRST else pytest.param(one, marks=pytest.mark.slow) for one in LAMPS])
def test_the_march_is_near_the_exact_walk(kind: str, which: str) -> None:
    size = (83, 47)  # neither whole words nor whole tiles
    one = KINDS[kind](LAMPS[which])
    truth, found = layer([one], air("exact"), size), layer([one], air("table", "final"), size)
    if which == "along the view":  # the middle pixel's ray meets the lamp, where light has no bound: as far as single floats go
        middle = truth[..., 0] == truth[..., 0].max()
        assert middle.sum() == 1 and np.abs(found[middle] / truth[middle] - 1).max() < 0.05
        y, x = np.argwhere(middle)[0]
        for one in (truth, found):
            one[y - 1 : y + 2, x - 1 : x + 2] = 0
    # So small a picture has a post's edge, seen edge-on, in one column of pixels, and straight ahead rays lie in seams of the cube's faces,
    # where the walk counts some texels twice, or none
    assert truth[..., :3].mean() > 1e-5 and off(found, truth) < (0.06 if kind == "spot" or which == "along the view" else 0.01)
    np.testing.assert_allclose(found[..., 3:], truth[..., 3:], atol=2e-6)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    "more",
    [
        {"sigma_t": (0.05, 0.1, 0.2), "ambient": (0.1, 0.1, 0.2)},
        {"sigma_t": (0.8, 0.8, 0.8)},
        {"anisotropy": 0.9},
        *(
            pytest.param(more, marks=pytest.mark.slow)
            for more in (
                {"anisotropy": -0.7, "shadow_bias": 0.05},
                {"phase": "two-lobe", "max_distance": 60.0},
                {"phase": "rayleigh", "max_distance": 7.0},
            )
        ),
    ],
)
def test_the_march_is_near_the_exact_walk_in_other_air(kind: str, more: dict[str, Any]) -> None:
    one = KINDS[kind](LAMPS["in view"])
    truth, found = layer([one], air("exact", **more)), layer([one], air("table", "final", **more))
    assert off(found, truth) < (0.06 if kind == "spot" else 0.015)
    np.testing.assert_allclose(found[..., 3:], truth[..., 3:], atol=2e-6)


@pytest.mark.parametrize(
    "more", [{"range": 9.0}, {"outer": math.radians(70.0), "inner": 0.2}, {"outer": math.radians(120.0), "inner": 1.0}, {"outer": 0.3}]
)
def test_cones_and_ranges(more: dict[str, Any]) -> None:
    """Before nothing: before a wall the walk takes the last texels of a wide cone's map, which are metres wide, as one."""
    one, size = spot((-1.0, 5.0, -7.0), **({"inner": 0.1} | more)), (160, 90)
    truth, found = (layer([one], air(steps, "final"), size, behind=False) for steps in ("exact", "table"))
    assert off(found, truth) < 0.04


def test_a_spot_that_shines_elsewhere() -> None:
    one = spot(LAMPS["beside"], towards=(20.0, 1.0, 5.0))
    assert not layer([one], air("table"))[..., :3].any() and not layer([one], air("exact"))[..., :3].any()


@pytest.mark.parametrize("kind", KINDS)
def test_a_lamp_at_the_eye(kind: str) -> None:
    """Its light has no bound in there: it is finite, and alike from run to run."""
    one = KINDS[kind]((0.0, 0.0, 0.0))
    found = layer([one], air("table"))
    assert np.isfinite(found).all() and np.array_equal(layer([one], air("table")), found)


@pytest.mark.parametrize("share", [1.0, 0.5])
def test_light_of_all_kinds_is_added(share: float) -> None:
    """Two lamps by tables, a sun without shadows by steps: the sum of the three by themselves."""
    first, second = spot(LAMPS["in view"]), point(LAMPS["behind"])
    sun = (DirectionalLight(intensity=(1.0, 2.0, 3.0), direction=(0.0, 1.0, 0.0)), None)
    medium = air("table", ambient=(0.1, 0.2, 0.3))
    dark = air("table")
    with pytest.warns(AirlightWarning, match="for light with shadows"):
        together = layer([first, sun, second], medium, share=share)
        alone = layer([sun], medium, share=share)
    others = sum(layer([one], dark, share=share)[..., :3] for one in (first, second))
    np.testing.assert_allclose(together[..., :3], alone[..., :3] + others, rtol=1e-4, atol=1e-5)
    both = layer([first, second], dark, share=share)
    np.testing.assert_allclose(both[..., :3], others, rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("which", ["in view", "behind", "straight below"])
def test_the_same_bytes_and_none_of_another_frame(kind: str, which: str) -> None:
    one, other = KINDS[kind](LAMPS[which]), point(LAMPS["beside"])
    march = March(open_device(), SIZE)
    first = layer([one], air("table"), march=march)
    layer([other, one], air("table"), march=march)
    assert np.array_equal(layer([one], air("table"), march=march), first)
    atlas = march.visibility_tables.tables[0].atlas
    wide, high, _ = atlas.size
    march.device.write(atlas, np.full((high, wide, 4), 9, np.float16), 8 * wide)
    assert np.array_equal(layer([one], air("table"), march=march), first)
    assert np.array_equal(layer([one], air("table")), first)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("colours", [False, True])
def test_a_table_is_its_float64_self(kind: str, colours: bool) -> None:
    bare, _ = KINDS[kind](LAMPS["beside"])
    light, shadow, maps = posts(bare)
    medium = air("table", sigma_t=(0.05, 0.1, 0.2) if colours else (0.08,) * 3)
    device = open_device()
    march = March(device, SIZE)
    layer([(light, shadow)], medium, march=march)
    own = march.visibility_tables.tables[0]
    assert isinstance(own, lamps.LampTable)
    wide, high, _ = own.atlas.size
    atlas = np.frombuffer(device.read(own.atlas, 8), np.float16).reshape(high, wide, 4).astype(float)
    fineness = (tables.POINT_FINENESS if kind == "point" else tables.SPOT_FINENESS)["normal"].of_picture(SIZE)
    data = light_record(light, shadow, np.eye(4), medium)
    position = np.asarray(light.position)
    grid = row_grid(position / np.linalg.norm(position), eye_rays(projection())[0], SIZE, fineness)
    step, blocks = 2 if colours else 3, own.counts[0]
    for row in (0, len(grid.begin) // 2, len(grid.begin) - 2):
        values, changes = twin.lamp_visibilities(
            grid, row, projection(), maps, ground(SIZE), data, own.lamp, medium.lobes()[0], kind == "spot", medium, blocks
        )
        count = values.shape[1]
        found = atlas[row, : blocks // step * count].reshape(-1, count, 4)
        ends = np.frombuffer(device.queue.read_buffer(own.buffers["word_ends"]), np.float32)
        until = min(int(min(ends[row + k * len(grid.begin)] for k in range(count // 32))), blocks) // step
        expected = values[: until * step].reshape(until, step, count).transpose(0, 2, 1)
        wrong = np.abs(found[:until, :, 1 : 1 + step] - expected)
        assert until > 3 and wrong.mean() < 2e-3 and np.percentile(wrong, 98) < 1e-2
        if colours:
            assert np.abs(found[:until, :, 3] - changes[: until * 2 : 2]).mean() < 2e-3


def test_what_a_lamp_scatters_in_full_light() -> None:
    """Without casters a table is the closed form of light, but for the look-up's interpolation."""
    light = PointLight(intensity=(30.0, 20.0, 10.0), position=LAMPS["in view"])
    texture = depth_texture(open_device(), np.zeros((6, 16, 16)))
    shadow = Shadow(texture, 16, posts(light, 16)[1].views)
    for more in ({}, {"sigma_t": (0.05, 0.1, 0.2)}, {"anisotropy": 0.8}):
        truth, found = layer([(light, shadow)], air("exact", **more)), layer([(light, shadow)], air("table", **more))
        assert off(found, truth) < 3e-3


@pytest.mark.parametrize(
    ("lamp", "more", "line"),
    [
        pytest.param(
            PointLight, {"fog": "exponential", "fog_base": -1.0, "fog_depth": 2.0}, "lamps in even air", marks=pytest.mark.slow
        ),
        pytest.param(ProjectorLight, {}, "not for projectors", marks=pytest.mark.slow),
        (SpotLight, {"shadow_filter": "pcf"}, "shadow-filter nearest"),
    ],
)
def test_lamps_that_do_not_go_by_a_table_go_by_steps(lamp: Any, more: dict[str, Any], line: str) -> None:
    one = posts(lamp(intensity=(30.0, 20.0, 10.0), position=(1.0, 0.5, 2.0)))[:2]
    with pytest.warns(AirlightWarning, match=line):
        found = layer([one], air("table", **more))
    assert np.array_equal(found, layer([one], air(None, **more)))


def test_a_table_over_the_budget_is_left_out_with_a_line(monkeypatch: pytest.MonkeyPatch) -> None:
    one = point(LAMPS["in view"])
    monkeypatch.setattr(tables, "BUDGET", 2**14)
    with pytest.warns(AirlightWarning, match="MB"):
        found = layer([one], air("table"))
    assert np.array_equal(found, layer([one], air(64)))
