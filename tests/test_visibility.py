"""The table of visibility: its functions against their float64 twins, a whole table, and the march that it makes against the exact walk."""

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
from airlight.projection import eye_rays
from airlight.reference import visibility as twin
from airlight.scatter.march.march import March
from airlight.scatter.visibility import table as tables
from airlight.scatter.visibility.base import GRID
from airlight.scatter.visibility.grid import EDGES, Fineness, block_count, row_grid
from airlight.shadows import Shadow
from airlight.shadows.fit import basis, orthographic_view

RNG = np.random.default_rng(21)
COUNT = 300
FOLDER = "scatter/visibility"
GRIDS = {"coarse": {"PER": 8.0, "WIDEST": 32.0}, "fine": {"PER": 16.0, "WIDEST": 4.0}}
FRAME, LIGHT, RAY = (struct_dtype(f"{FOLDER}/apply.wgsl", name) for name in ("Frame", "Light", "Ray"))
SUNS = {
    "in view": (0.2, 0.15, -1.0),
    "at the edge": (0.75, 0.1, -1.0),
    "beside": (1.0, 0.4, -0.3),
    "at right angles": (1.0, 0.5, 0.0),
    "above": (0.0, 1.0, 0.0),
    "straight below": (0.0, -1.0, 0.0),
    "behind": (0.2, 0.15, 1.0),
    "along the view": (0.0, 0.0, -1.0),
    "straight behind": (0.0, 0.0, 1.0),
}


def flat(rays: np.ndarray) -> dict[str, np.ndarray]:
    """The members of rays, and of their sums."""
    own = {name: rays[name] for name in rays.dtype.names or () if name != "sums"}
    return own | {name: rays["sums"][name] for name in rays["sums"].dtype.names or ()}


def between(low: float, high: float, *shape: int) -> np.ndarray:
    return RNG.uniform(low, high, (COUNT, *shape)).astype(np.float32)


@pytest.mark.parametrize("which", GRIDS)
def test_blocks(which: str) -> None:
    constants = GRIDS[which]
    per, widest = int(constants["PER"]), int(constants["WIDEST"])
    texels = np.concatenate([between(0, 40), between(0, 3000)])
    found = call(f"{FOLDER}/apply.wgsl", "block_at", [texels], constants=constants)
    np.testing.assert_allclose(found, twin.block_at(texels, per, widest), rtol=1e-5, atol=1e-5)
    block = np.arange(150).astype(np.float32)
    begins = call(f"{FOLDER}/apply.wgsl", "block_begin", [block], constants=constants)
    assert np.array_equal(begins, twin.block_begin(block, per, widest))
    np.testing.assert_allclose(twin.block_at(begins, per, widest), block, atol=1e-9)
    assert np.diff(begins).max() == widest and np.diff(begins).min() == 1


@pytest.mark.parametrize("rises", [False, True])
def test_counts_of_rays_are_those_of_samples(rises: bool) -> None:
    ends = between(-1, 1, 2)
    ends[:3] = (0, 0), (1, 1), (-1, -1)
    first = call(f"{FOLDER}/bits.wgsl", "lit_from", [ends[:, 0], ends[:, 1], np.float32(95), np.array(rises)])
    expected = twin.lit_from(ends[:, 0], ends[:, 1], 95, rises)
    assert np.abs(first - expected).max() <= 1 and np.mean(first != expected) < 0.02
    masks = np.stack([call(f"{FOLDER}/bits.wgsl", "lit_mask", [first, np.uint32(k), np.array(rises)]) for k in range(3)])
    assert np.array_equal(masks, [twin.lit_mask(first, k, rises) for k in range(3)])
    values = ends[:, :1] + np.linspace(0, 1, 96) * (ends[:, 1:] - ends[:, :1])
    ordered = (ends[:, 0] < ends[:, 1]) == rises  # slopes of a row all go one way
    rays = (masks.T[:, :, None] >> np.arange(32) & 1).reshape(COUNT, 96)
    assert np.mean(rays[ordered] != (values >= 0)[ordered]) < 1e-3


def test_counters() -> None:
    masks = RNG.integers(0, 2**32, (15, COUNT), np.uint32)
    planes = other = np.zeros((COUNT, 4), np.uint32)
    for mask in masks:
        planes, other = call(f"{FOLDER}/bits.wgsl", "counted", [planes, mask]), twin.counted(other, mask)
    assert np.array_equal(planes, other)
    for q in range(4):
        n = call(f"{FOLDER}/table.wgsl", "nibbles", [planes, np.uint32(q)])
        assert np.array_equal(n, twin.nibbles(planes, q))
        counts = (n[:, None] >> (4 * np.arange(8, dtype=np.uint32))) & 15
        expected = np.stack([(masks >> np.uint32(q + 4 * k) & 1).sum(axis=0) for k in range(8)], axis=1)
        assert np.array_equal(counts, expected)


def test_between_planes() -> None:
    values, part = between(0, 1, 4), between(0, 3)
    found = call(f"{FOLDER}/apply.wgsl", "between_planes", [values, part])
    np.testing.assert_allclose(found, twin.between_planes(values, part), atol=1e-6)


def test_mean_of_four() -> None:
    x = between(0, 3, 4)
    x[0] = 0
    np.testing.assert_allclose(call(f"{FOLDER}/table.wgsl", "mean_of_four", [x]), twin.mean_of_four(x), rtol=1e-5)


def test_range_in_map() -> None:
    near, far, ahead, whole = between(0, 5), between(5, 9), between(0.2, 1), between(1, 20)
    found = call(f"{FOLDER}/apply.wgsl", "range_in_map", [near, far, ahead, whole])
    np.testing.assert_allclose(found, twin.range_in_map(near, far, ahead, whole), rtol=1e-5)


def test_pace_in_map() -> None:
    light, rays = np.zeros((), LIGHT), np.zeros(COUNT, RAY)
    light["view"]["matrix"], rays["direction"] = RNG.normal(size=(6, 4, 4)), between(-1, 1, 3)
    which = RNG.integers(0, 4, COUNT, np.uint32)
    found = call(f"{FOLDER}/apply.wgsl", "pace_in_map", [which, rays], bindings={"light": light})
    np.testing.assert_allclose(found, twin.pace_in_map(which, rays, light), rtol=1e-4)


@pytest.mark.parametrize("which", SUNS)
def test_pixels_find_their_place_in_the_grid(which: str) -> None:
    """As the twin does; and the rays of the rows find themselves."""
    size = (101, 67)
    towards = np.array(SUNS[which]) / np.linalg.norm(SUNS[which])
    grid = row_grid(towards, eye_rays(projection())[0], size, Fineness(6, 12, 8))
    wide = np.array(size, np.float32)
    p = (RNG.random((COUNT, 2)) * wide).astype(np.float32)
    given = [wide, np.float32(grid.slope), grid.offset.astype(np.float32), grid.rate.astype(np.float32)]
    given += [grid.first.astype(np.float32), grid.rays.astype(np.float32)]
    found = call(f"{FOLDER}/apply.wgsl", "place_in_grid", [p, *given])
    row, ray, rays = twin.place_in_grid(p, *given)
    same = found["rays"] == rays  # at a corner of the picture either edge will do
    assert same.mean() > 0.98
    np.testing.assert_allclose(found["row"][same], row[same], atol=2e-3)
    np.testing.assert_allclose(found["ray"][same], ray[same], atol=5e-3)
    last = np.where(grid.last >= grid.first, grid.last, 0)
    assert np.all(row >= 0) and np.all(row <= last.max()) and np.all((ray >= 0) & (ray <= rays - 1))
    for k in RNG.choice(len(grid.begin), 20):
        at = grid.begin[k] + 0.4 * (grid.end[k] - grid.begin[k])
        if not np.all((at > 0) & (at < wide)) or not np.any((grid.end[k] > 1) & (grid.end[k] < wide - 1)):
            continue  # another edge may be as near
        own_row, own_ray, count = twin.place_in_grid(at[None], wide, grid.slope, grid.offset, grid.rate, grid.first, grid.rays)
        np.testing.assert_allclose((own_row[0], own_ray[0]), (k, 0.4 * (count[0] - 1)), atol=1e-3)


def test_rows_lie_no_farther_apart_than_said() -> None:
    for towards in SUNS.values():
        grid = row_grid(np.array(towards) / np.linalg.norm(towards), eye_rays(projection())[0], (160, 90), Fineness(6, 12, 8))
        assert len(grid.begin) == len(grid.edge) and grid.words <= 4 and np.isfinite(grid.begin).all()
        steps = np.linalg.norm(np.diff(grid.end, axis=0), axis=1)[np.diff(grid.edge) == 0]
        assert steps.max(initial=0) <= grid.apart
        assert len(EDGES) == len(grid.rays)


def test_block_counts() -> None:
    for texels in (0.5, 3.0, 8.0, 20.0, 255.0, 256.0, 257.0, 3000.0):
        count = block_count(texels, 8, 32)
        assert twin.block_begin(count, 8, 32) >= texels > twin.block_begin(count - 1, 8, 32) - 1e-9


@pytest.mark.parametrize("fog", ["none", "exponential"])
@pytest.mark.parametrize("fades", [False, True])
def test_blocks_are_summed_as_by_the_twin(fog: str, fades: bool) -> None:
    """Step by step, each from the shader's own sums, with surfaces in some of the blocks."""
    frame, light, grid = np.zeros((), FRAME), np.zeros((), LIGHT), np.zeros((), GRID)
    frame["base_height"], frame["fog_depth"], light["climb"], grid["middle"], grid["spread"] = 1.5, 3.0, 0.6, 0.08, 0.03
    constants = {"FOG": ("none", "exponential").index(fog), "FADES": fades, "COLOURS": True, "MAPS": 2}
    bindings = {"frame": frame, "light": light, "grid": grid}
    kind = struct_dtype(f"{FOLDER}/table.wgsl", "Rays")
    rays = np.zeros(COUNT, kind)
    rays["metres"], rays["climb"], rays["near"] = between(0.01, 0.1, 4), between(-0.05, 0.05, 4), between(0, 6, 4)
    rays["seen"] = 1
    rays["sums"] = call(f"{FOLDER}/table.wgsl", "begin_sums", [between(0, 60, 4)])
    for k in range(12):
        begin, share = 4.0 * k, np.round(between(-0.5, 1.5, 4).clip(0, 1) * 15) / 15
        expected = twin.add_block(flat(rays), share, begin, 4.0, frame, 0.08, fog, 0.6 if fades else None)
        rays = call(
            f"{FOLDER}/table.wgsl", "add_block", [rays, share, np.float32(begin), np.float32(4)], constants=constants, bindings=bindings
        )
        for name, values in flat(rays).items():
            if fog == "none" and name in ("dense", "way"):
                continue
            np.testing.assert_allclose(values, expected[name], rtol=2e-4, atol=2e-5, err_msg=f"{name} of block {k}")
    found = call(f"{FOLDER}/table.wgsl", "slopes", [rays["sums"]], bindings={"grid": grid})
    np.testing.assert_allclose(found, twin.slopes({n: v.astype(float) for n, v in flat(rays).items()}, 0.03), rtol=1e-3, atol=1e-5)
    y = between(-3, 9, 4)
    found = call(f"{FOLDER}/table.wgsl", "mean_densities", [y], constants={"FOG": 1}, bindings={"frame": frame})
    np.testing.assert_allclose(found, twin.mean_densities(y, frame, "exponential"), rtol=1e-4)
    found = call(f"{FOLDER}/table.wgsl", "columns", [y], constants={"FOG": 1}, bindings={"frame": frame})
    np.testing.assert_allclose(found, twin.columns(y, frame, "exponential"), rtol=1e-4)


@pytest.mark.parametrize("fog", ["none", "exponential"])
def test_lit_integral(fog: str) -> None:
    frame, light, rays = np.zeros((), FRAME), np.zeros((), LIGHT), np.zeros(COUNT, RAY)
    frame["sigma_t"], frame["fog_depth"], frame["up"], frame["base_height"], light["climb"] = (0.1, 0.2, 0.05), 3.0, (0, 1, 0), 1.0, 0.6
    way = RNG.normal(size=(COUNT, 3))
    rays["direction"], rays["reach"] = way / np.linalg.norm(way, axis=1, keepdims=True), 20
    ranges = np.sort(between(0, 12, 2), axis=1)
    constants = {"FOG": ("none", "exponential").index(fog), "FADES": True}
    found = call(f"{FOLDER}/apply.wgsl", "lit_integral", [rays, ranges], constants=constants, bindings={"frame": frame, "light": light})
    np.testing.assert_allclose(found, twin.lit_integral(rays, ranges, frame, light, fog, True), rtol=1e-3, atol=2e-5)


# ---------------------------------------------------------------- the march


def posts(towards: Any, side: int = 192, spans: Any = ((0.0, np.inf),)) -> tuple[DirectionalLight, Shadow, np.ndarray]:
    """A sun, and the shadow of eight blocks before the eye, in a map a view: (light, shadow, (views, side, side) depths)."""
    towards = np.asarray(towards, float) / np.linalg.norm(towards)
    axes = basis(towards)
    rng = np.random.default_rng(3)
    centres = np.column_stack([rng.uniform(-4, 4, 8), rng.uniform(-2, 2, 8), rng.uniform(-12, -4, 8)])
    corners = np.array([(i, j, k) for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)]) * 0.6
    local = (centres[:, None] + corners) @ axes.T
    middle, views, maps = (local.min(axis=(0, 1)) + local.max(axis=(0, 1))) / 2, [], []
    for half, span in zip((9.0, 12.0), spans, strict=False):
        views.append(orthographic_view(axes, middle, half, side, local, span))
        held, into = np.zeros((side, side)), views[-1].matrix
        for box in local:
            at = np.column_stack([box @ axes, np.ones(8)]) @ into.T
            low, high = np.floor(at[:, :2].min(axis=0)).astype(int).clip(0), np.ceil(at[:, :2].max(axis=0)).astype(int)
            part = held[low[1] : high[1], low[0] : high[0]]
            np.maximum(part, at[:, 2].mean(), out=part)
        maps.append(held)
    texture = depth_texture(open_device(), np.array(maps))
    return DirectionalLight(intensity=(3.0, 2.0, 1.0), direction=tuple(towards)), Shadow(texture, side, views), np.array(maps)


@pytest.mark.parametrize("which", SUNS)
def test_the_march_is_near_the_exact_walk(which: str) -> None:
    size = (83, 47)  # neither whole words nor whole tiles
    light, shadow, _ = posts(SUNS[which], 187)
    light = [(light, shadow)]
    truth, found = layer(light, air("exact"), size), layer(light, air("table", "final"), size)
    assert off(found, truth) < 0.03
    np.testing.assert_allclose(found[..., 3:], truth[..., 3:], atol=2e-6)


@pytest.mark.parametrize(
    "more",
    [
        {"sigma_t": (0.05, 0.1, 0.2)},
        {"fog": "exponential", "fog_base": -2.0, "fog_depth": 2.0, "sigma_t": (0.1, 0.2, 0.3)},
        {"sun_distance": 9.0, "sun_glow": 0.3, "ambient": (0.1, 0.1, 0.2)},
        {"phase": "two-lobe", "shadow_bias": 0.05, "max_distance": 60.0},
    ],
)
def test_the_march_is_near_the_exact_walk_in_other_air(more: dict[str, Any]) -> None:
    light, shadow, _ = posts(SUNS["beside"])
    truth, found = layer([(light, shadow)], air("exact", **more)), layer([(light, shadow)], air("table", "final", **more))
    assert off(found, truth) < 0.025
    np.testing.assert_allclose(found[..., 3:], truth[..., 3:], atol=2e-6)


@pytest.mark.parametrize("which", ["in view", "beside", "behind"])
def test_cascades_have_a_table_each(which: str) -> None:
    light, shadow, _ = posts(SUNS[which], spans=((0.0, 6.0), (6.0, np.inf)))
    truth, found = layer([(light, shadow)], air("exact")), layer([(light, shadow)], air("table", "final"))
    assert len(shadow.views) == 2 and off(found, truth) < 0.03


@pytest.mark.parametrize("share", [1.0, 0.5])
def test_light_by_tables_and_by_steps_is_added(share: float) -> None:
    """Two suns by tables, a lamp by steps, at a smaller size: the sum of the three by themselves."""
    first, second = (posts(SUNS[name])[:2] for name in ("in view", "beside"))
    lamp = (PointLight(intensity=(5.0, 6.0, 7.0), position=(1.0, 0.5, -6.0)), None)
    medium = air("table", ambient=(0.1, 0.2, 0.3))
    dark = air("table")
    with pytest.warns(AirlightWarning, match="for light with shadows"):
        together = layer([first, lamp, second], medium, share=share)
        alone = layer([lamp], medium, share=share)
    others = sum(layer([one], dark, share=share)[..., :3] for one in (first, second))
    np.testing.assert_allclose(together[..., :3], alone[..., :3] + others, rtol=1e-4, atol=1e-6)
    np.testing.assert_allclose(together[..., 3:], alone[..., 3:], atol=2e-6)
    both = layer([first, second], dark, share=share)
    np.testing.assert_allclose(both[..., :3], others, rtol=1e-4, atol=1e-6)


def test_the_same_bytes_from_run_to_run_and_after_other_lights() -> None:
    one, other = (posts(SUNS[name])[:2] for name in ("in view", "behind"))
    march = March(open_device(), SIZE)
    first = layer([one], air("table"), march=march)
    layer([other, one], air("table"), march=march)
    assert np.array_equal(layer([one], air("table"), march=march), first)
    assert np.array_equal(layer([one], air("table")), first)


@pytest.mark.parametrize("which", SUNS)
def test_no_pixel_reads_what_this_frame_did_not_write(which: str) -> None:
    one, march = posts(SUNS[which])[:2], March(open_device(), SIZE)
    first = layer([one], air("table"), march=march)
    atlas = march.visibility_tables.tables[0].atlas
    wide, high, _ = atlas.size
    march.device.write(atlas, np.full((high, wide, 4), 9, np.float16), 8 * wide)
    assert np.array_equal(layer([one], air("table"), march=march), first)


@pytest.mark.parametrize("colours", [False, True])
def test_a_table_is_its_float64_self(colours: bool) -> None:
    light, shadow, maps = posts(SUNS["beside"])
    medium = air("table", sigma_t=(0.05, 0.1, 0.2) if colours else (0.08,) * 3)
    device = open_device()
    march = March(device, SIZE)
    layer([(light, shadow)], medium, march=march)
    own = march.visibility_tables.tables[0]
    wide, high, _ = own.atlas.size
    atlas = np.frombuffer(device.read(own.atlas, 8), np.float16).reshape(high, wide, 4).astype(float)
    fineness = tables.FINENESS["normal"].of_picture(SIZE)
    grid = row_grid(light.direction, eye_rays(projection())[0], SIZE, fineness)
    step = 2 if colours else 3
    for row in (0, len(grid.begin) // 2, len(grid.begin) - 2):
        blocks = own.counts[0]
        values, changes = twin.visibilities(
            grid, fineness, row, np.eye(4), projection(), shadow.views[0].matrix, maps[0], ground(SIZE), medium, blocks
        )
        count = values.shape[1]
        found = atlas[row, : blocks // step * count].reshape(-1, count, 4)
        written = np.frombuffer(device.queue.read_buffer(own.buffers["word_ends"]), np.float32)[row]
        until = int(twin.block_at(written, 8, 32)) // step
        expected = values[: until * step].reshape(until, step, count).transpose(0, 2, 1)
        wrong = np.abs(found[:until, :, 1 : 1 + step] - expected)
        assert until > 3 and wrong.mean() < 1e-3 and np.percentile(wrong, 98) < 4e-3
        if colours:
            wrong = np.abs(found[:until, :, 3] - changes[: until * 2 : 2])
            assert wrong.mean() < 1e-3


@pytest.mark.parametrize(
    ("more", "line"),
    [({"shadow_filter": "pcf"}, "shadow-filter nearest"), ({"fog": "linear", "fog_base": -1.0, "fog_depth": 2.0}, "exponential fog")],
)
def test_light_that_does_not_go_by_a_table_goes_by_steps(more: dict[str, Any], line: str) -> None:
    light, shadow, _ = posts(SUNS["beside"])
    with pytest.warns(AirlightWarning, match=line):
        found = layer([(light, shadow)], air("table", **more))
    assert np.array_equal(found, layer([(light, shadow)], air(None, **more)))


def test_a_table_over_the_budget_is_left_out_with_a_line(monkeypatch: pytest.MonkeyPatch) -> None:
    light, shadow, _ = posts(SUNS["beside"])
    monkeypatch.setattr(tables, "BUDGET", 2**14)
    with pytest.warns(AirlightWarning, match="MB"):
        found = layer([(light, shadow)], air("table"))
    assert np.array_equal(found, layer([(light, shadow)], air(64)))
