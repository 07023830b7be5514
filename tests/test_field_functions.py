"""The shader functions of a density that varies against their float64 twins."""

from typing import Any

import numpy as np
import pytest
from calling import call

from airlight.gpu.structs import struct_dtype
from airlight.medium.field import BLENDS
from airlight.medium.resolve import FOGS
from airlight.reference import field, grid, march, march_field

RNG = np.random.default_rng(1812)
COUNT = 600
FRAME, LIGHT, RAY = (struct_dtype("scatter/march/walk.wgsl", name) for name in ("Frame", "Light", "Ray"))
GRID, FIELD, SHADE, STEPS = "medium/grid.wgsl", "scatter/march/field.wgsl", "scatter/march/shade.wgsl", "scatter/march/steps.wgsl"


def single(*shape: int, low: float = -3.0, high: float = 3.0) -> np.ndarray:
    return RNG.uniform(low, high, (COUNT, *shape)).astype(np.float32)


def close(found: Any, truth: Any, rtol: float = 1e-5, atol: float = 1e-5) -> None:
    assert np.shape(found) == np.shape(truth) and np.ptp(truth) > 0
    np.testing.assert_allclose(found, truth, rtol=rtol, atol=atol)


def test_indices() -> None:
    rows, place = single(3, 4), single(3)
    close(call(GRID, "grid_index", [rows, place]), grid.grid_index(rows, place), atol=1e-4)
    close(call(GRID, "grid_step", [rows, place]), grid.grid_step(rows, place), atol=1e-4)
    count, edge = RNG.integers(1, 7, (COUNT, 3)).astype(np.uint32), RNG.choice([0.0, 0.5], COUNT).astype(np.float32)
    at = single(3, low=-1, high=7)
    at[:100] = np.round(at[:100])
    inside = grid.in_grid_box(at, count, edge)
    assert 0.02 < inside.mean() < 0.9 and (call(GRID, "in_grid_box", [at, count, edge]) == inside).all()


def test_rays_meet_boxes_and_planes() -> None:
    b, a = single(3, low=-4, high=9), single(3)
    a[::7, 1] = 0
    count, edge = RNG.integers(1, 7, (COUNT, 3)).astype(np.uint32), RNG.choice([0.0, 0.5], COUNT).astype(np.float32)
    found, truth = (f(b, a, np.array([[0, 4]], np.float32), count, edge) for f in (
        lambda *v: call(GRID, "clip_to_grid", list(v)), grid.clip_to_grid))  # fmt: skip
    some = truth[:, 1] > truth[:, 0]
    assert some.sum() > 20 and ((found[:, 1] > found[:, 0]) == some).all()
    close(found[some], truth[some], 1e-4, 1e-4)
    ends = b[some] + truth[some, 1:] * a[some]  # at the faces, or at t = 4
    assert (grid.in_grid_box(ends, count[some], edge[some] + 1e-4)).all()
    b[:50] = np.round(b[:50]) + np.float32(1e-3)
    close(call(GRID, "to_next_plane", [b, a]), grid.to_next_plane(b, a), 1e-3, 1e-3)


def test_blends() -> None:
    before, found = np.abs(single()), np.abs(single())
    for i, name in enumerate(BLENDS):
        gave = call(GRID, "blended", [before, found, np.full(COUNT, i, np.uint32)])
        close(gave, grid.blended(before, found, i))
        close(gave, field.blend(before, found, True, name))


def test_faces_of_a_cube() -> None:
    q = single(3)
    found = call(SHADE, "table_face", [q])
    close(found, grid.table_face(q), 1e-5, 1e-5)
    assert set(found[:, 2]) == {0, 1, 2, 3, 4, 5} and np.abs(found[:, :2]).max() <= 1
    back = call(SHADE, "from_table_face", [found[:, :2], found[:, 2].astype(np.uint32)])
    close(back, grid.from_table_face(found[:, :2], found[:, 2]))
    np.testing.assert_allclose(np.cross(back, q), 0, atol=1e-5)
    assert ((back * q).sum(axis=1) > 0).all()


@pytest.mark.parametrize("kind", ["sun", "lamp", "lamp within"])
def test_places_in_a_lights_table(kind: str) -> None:
    light, sun = np.zeros((), LIGHT), kind == "sun"
    light["shade_count"], light["shade_faces"] = (9, 9, 12), 6 if kind == "lamp within" else 1
    light["shade_near"], light["shade_step"], light["shade_tangent"] = 0.5, 0.4, 1.0 if kind == "lamp within" else 0.7
    turn, _ = np.linalg.qr(RNG.normal(size=(3, 3)))
    rows = np.column_stack([turn, [2, 3, 1]]) * (2.0 if sun else 1.0)
    light["shade_rows"], light["shade_into"] = rows, np.linalg.inv(np.vstack([rows, [0, 0, 0, 1]]))[:3]
    own: Any = {"bindings": {"light": light}, "constants": {"DIRECTIONAL": sun}}
    q = grid.grid_index(light["shade_rows"], single(3)).astype(np.float32)
    found = call(SHADE, "shade_cell", [q], **own)
    truth = grid.shade_cell(q, light, sun)
    assert (truth[:, 3] >= 0).mean() > 0.02 and ((found[:, 3] >= 0) == (truth[:, 3] >= 0)).mean() > 0.995
    near = np.abs(truth[:, :3]).max(axis=1) < 100
    close(found[near, :3], truth[near, :3], 1e-3, 1e-3)
    # What a column places lies in the table where the column is
    column = np.column_stack([RNG.integers(0, 9, (COUNT, 2)), RNG.integers(0, int(light["shade_faces"]), COUNT)]).astype(np.uint32)
    k = RNG.uniform(0.1, 11, COUNT).astype(np.float32)
    placed = call("scatter/march/fill_shade.wgsl", "column_place", [column, k], **own)
    close(placed, grid.column_place(column, k, light, sun), 1e-4, 1e-4)
    within = np.all((column[:, :2] > 0) & (column[:, :2] < 8), axis=1)
    again = grid.shade_cell(grid.grid_index(light["shade_rows"], placed), light, sun)[within]
    np.testing.assert_allclose(again, np.column_stack([column[:, :2], k, column[:, 2]])[within], rtol=1e-3, atol=1e-3)


@pytest.mark.parametrize("kind", FOGS)
def test_air_by_height(kind: str) -> None:
    frame, fog = np.zeros((), FRAME), {"FOG": FOGS.index(kind), "VARIES": True}
    frame["up"], frame["base_height"], frame["fog_depth"], frame["fog_above"] = (0.36, 0.48, 0.8), 0.7, 2.5, 0.1
    frame["air"] = 0.7
    own: Any = {"bindings": {"frame": frame}, "constants": fog}
    a, b = single(3), single(3)
    gave = call(FIELD, "even_density", [a], **own)
    np.testing.assert_allclose(gave, march_field.even_density(a, frame, kind), rtol=1e-5, atol=1e-6)
    gave = call(FIELD, "mean_even_density", [a, b], **own)
    np.testing.assert_allclose(gave, march_field.mean_even_density(a, b, frame, kind), rtol=1e-4, atol=1e-5)
    ray = np.zeros(COUNT, RAY)
    ray["origin"], ray["reach"] = a, 9
    ray["direction"] = b / np.linalg.norm(b, axis=1, keepdims=True)
    t = np.abs(single())
    close(call(FIELD, "place_at", [ray, t]), march_field.place_at(ray, t))
    if kind != "none":
        close(call(FIELD, "fog_ahead", [ray, t], **own), march_field.fog_ahead(ray, t, frame, kind), 2e-2, 1e-3)
        y, z = march.height(a, frame), march.height(b, frame)
        densest = march.height_density(np.minimum(y, z), march.layer_of_fog(frame), kind)
        found = call("scatter/march/ray.wgsl", "mean_between_heights", [y, z, densest], **own)
        close(found, march_field.mean_between_heights(y, z, densest, frame, kind), 1e-4, 1e-5)


def test_means_and_footprints() -> None:
    first, apart = np.exp(-np.abs(single(3))), np.abs(single(3)) * RNG.choice([1e-4, 0.03, 1], (COUNT, 1)).astype(np.float32)
    second = first * np.exp(-apart)
    found = call("scatter/march/ray.wgsl", "mean_between", [first, second, apart])
    close(found, march_field.mean_between(first, second, apart), 1e-4, 1e-6)
    swapped = call("scatter/march/ray.wgsl", "mean_between", [second, first, apart])
    close(swapped, found)
    own = np.zeros((), struct_dtype(FIELD, "Field"))
    own["pixel"], own["flat_pixel"] = 0.01, 0.02
    t, panel = np.abs(single()), np.abs(single()) / 30
    for exact in (True, False):
        found = call(FIELD, "footprint", [t, panel], bindings={"field": own}, constants={"EXACT": exact})
        close(found, march_field.footprint(t, panel, 0.01, 0.02, exact))


def test_steps_are_placed() -> None:
    n = RNG.choice([16.0, 64.0, 7.0], COUNT).astype(np.float32)
    k = np.floor(RNG.uniform(0, 1, COUNT) * n).astype(np.float32)
    grids = np.sort(RNG.uniform(0, 1, (COUNT, 2)), axis=1).astype(np.float32) * n[:, None]
    size = call(STEPS, "group_size", [k, n, grids], constants={"VARIES": True})
    close(size, march_field.group_size(k, n, grids, True))
    assert (k + size <= np.maximum(n, k + 1)).all() and set(size) == {1, 4, 8}
    for kind in (1, 2):
        found = call(STEPS, "group_size", [k, n, grids], constants={"FOG": kind})
        close(found, march_field.group_size(k, n, grids, False, kind == 1))
    x, powers = single(3, low=0, high=1.5), RNG.choice([1.0, 2, 4, 8, 16], COUNT).astype(np.float32)
    close(call(STEPS, "sum_of_powers", [x, powers]), march_field.sum_of_powers(x, powers), 1e-4)
    reach = RNG.uniform(2, 9, COUNT).astype(np.float32)
    marks = np.sort(RNG.uniform(0, 1, (COUNT, 2)), axis=1) * reach[:, None]
    steps = np.sort(RNG.uniform(0, 1, (COUNT, 2)), axis=1) * n[:, None]
    stretch = np.column_stack([marks, steps]).astype(np.float32)
    stretch[::5] = np.column_stack([0 * reach, reach, 0 * n, n])[::5]
    part = (RNG.uniform(0, 1, COUNT) * n).astype(np.float32)
    placed = call(STEPS, "step_place", [part, n, reach, stretch])
    close(placed, march_field.step_place(part, n, reach, stretch), 1e-4, 1e-4)
    close(call(STEPS, "step_at", [placed, n, reach, stretch]), march_field.step_at(placed, n, reach, stretch), 1e-3, 1e-2)
    np.testing.assert_allclose(march_field.step_at(placed.astype(float), n, reach, stretch), part, rtol=1e-3, atol=2e-2)


def test_share_that_is_scattered() -> None:
    light = np.zeros((), LIGHT)
    light["lobes"], light["cone_scale"], light["cone_offset"], light["range"] = (0.5, -0.3, 0.25), 1.4, -0.2, 5.0
    d, cosine, axis = np.abs(single()), single(low=-1, high=1), single(low=-1, high=1)
    own: Any = {"bindings": {"light": light}, "constants": {"PHASE": 1, "CONE": True}}
    found = call("scatter/march/ray.wgsl", "scattered_share", [d, cosine, axis], **own)
    close(found, march.scattered_share(d, cosine, axis, light, 1), 1e-4, 1e-6)


def test_light_of_a_lamp_in_a_step() -> None:
    frame, light, step = np.zeros((), FRAME), np.zeros((), LIGHT), np.zeros(COUNT, struct_dtype(STEPS, "LampStep"))
    frame["sigma_t"], frame["sigma_s"], frame["air"] = (0.1, 0.2, 0.05), (0.09, 0.1, 0.05), 0.6
    light["intensity"], light["position"], light["axis"], light["lobes"] = (3, 2, 1), (1, 2, -2), (0, 0, 1), (0.5, -0.3, 0.25)
    light["cone_offset"] = 1.0
    step["range"], step["lengths"] = np.sort(single(2, low=0, high=9), axis=1), np.abs(single(2))
    step["excess"] = single(low=-0.3, high=2)
    ray = np.zeros(COUNT, RAY)
    direction = single(3)
    ray["origin"], ray["direction"] = single(3), direction / np.linalg.norm(direction, axis=1, keepdims=True)
    nearest = march.nearest_approach(ray, light).astype(np.float32)
    angle = single(low=-1.2, high=1.2)
    own: Any = {"bindings": {"frame": frame, "light": light}, "constants": {"VARIES": True, "PHASE": 1}}
    found = call(STEPS, "in_lamp_step", [ray, nearest, step, angle], **own)
    close(found, march_field.in_lamp_step(ray, nearest, step, angle, frame, light, 1, "none"), 2e-3, 1e-5)
