"""Where shadow maps lie: what they hold, that their texels stand still, and where they begin."""

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from airlight.lights.directional import DirectionalLight
from airlight.lights.kinds import KINDS
from airlight.lights.point import PointLight
from airlight.lights.spot import WIDEST_HALF_ANGLE, SpotLight
from airlight.medium.resolve import ResolvedMedium, resolve
from airlight.options import March, Medium
from airlight.projection import Matrix, eye_rays
from airlight.shadows import ShadowView, fit

SIZE = 64


def air(max_distance: float = 100.0, size: int = SIZE, **march: Any) -> ResolvedMedium:
    return resolve(Medium(max_distance=max_distance), March(shadow_size=size, **march), "final", 1.0)


def turned(rng: np.random.Generator) -> Matrix:
    matrix = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    return matrix if np.linalg.det(matrix) > 0 else -matrix


def look(place: Any, turn: Matrix) -> Matrix:
    """(4, 4) world to view space."""
    into = np.eye(4)
    into[:3, :3], into[:3, 3] = turn, place
    return np.linalg.inv(into)


def lens(flat: bool = False, shift: tuple[float, float] = (0.0, 0.0)) -> Matrix:
    """A projection to clip space, twice as wide as high."""
    out = (
        np.diag([0.1, 0.2, -0.01, 1.0])
        if flat
        else np.array([[1.2, 0, shift[0], 0], [0, 2.4, shift[1], 0], [0, 0, -1, -0.1], [0, 0, -1, 0.0]])
    )
    if flat:
        out[:2, 3] = shift
    return out


def boxes(rng: np.random.Generator, count: int, reach: float, size: float = 1.0) -> Matrix:
    corners = np.array([(i, j, k) for i in (0, 1) for j in (0, 1) for k in (0, 1)], float)
    places, sizes = rng.uniform(-reach, reach, (count, 1, 3)), rng.uniform(0.1, size, (count, 1, 3))
    return places + (corners - 0.5) * sizes


def along(view: Matrix, projection: Matrix, ends: tuple[float, float], rng: np.random.Generator) -> tuple[Matrix, Matrix]:
    """(places in the world, their distances along the camera's axis) of what is seen between two of these."""
    u, v = rng.uniform(0, 1, (2, 300))
    ahead = rng.uniform(*ends, 300)
    (a, b, c, d), flat = eye_rays(projection)
    side = np.stack([a * u + c, b * v + d], axis=1) * (1.0 if flat else ahead[:, None])
    into = np.linalg.inv(view)
    return np.column_stack([side, -ahead]) @ into[:3, :3].T + into[:3, 3], ahead


def texels(view: ShadowView, places: Matrix) -> Matrix:
    """(N, 4): x, y in texels, depth, w."""
    at = places @ view.matrix[:, :3].T + view.matrix[:, 3]
    return np.column_stack([at[:, :3] / at[:, 3:], at[:, 3]])


def sun(rng: np.random.Generator) -> DirectionalLight:
    x, y, z = rng.normal(size=3)
    return DirectionalLight((1, 1, 1), direction=tuple(np.array([x, y, z]) / math.sqrt(x * x + y * y + z * z)))


seeds = st.integers(0, 2**32 - 1)


@given(seeds)
def test_a_basis_is_right_handed_and_rolls_steadily(seed: int) -> None:
    rng = np.random.default_rng(seed)
    z = turned(rng)[0]
    rows = fit.basis(z)
    np.testing.assert_allclose(rows @ rows.T, np.eye(3), atol=1e-9)
    assert np.linalg.det(rows) > 0
    np.testing.assert_array_equal(rows[2], z)
    near = z + 1e-4 * rng.normal(size=3)
    assert z[1] < -0.95 or np.abs(fit.basis(near / np.linalg.norm(near)) - rows).max() < 0.02
    np.testing.assert_allclose(fit.basis((0, -1, 0)) @ fit.basis((0, -1, 0)).T, np.eye(3))


def test_splits_mix_even_distances_and_equal_ratios() -> None:
    assert fit.splits(1, 81, 4, 0) == pytest.approx([21, 41, 61])
    assert fit.splits(1, 81, 4, 1) == pytest.approx([3, 9, 27])
    assert fit.splits(1, 81, 4, 0.7) == pytest.approx([0.7 * a + 0.3 * b for a, b in ((3, 21), (9, 41), (27, 61))])
    assert fit.splits(1, 81, 1, 0.7) == []


@given(seeds, st.booleans(), st.floats(-0.6, 0.6))
def test_a_slices_ball_holds_it(seed: int, flat: bool, shift: float) -> None:
    rng = np.random.default_rng(seed)
    start, end = sorted(rng.uniform(0, 50, 2))
    projection = lens(flat, (shift, -shift / 2))
    centre, radius = fit.slice_ball(projection, start, end)
    places, _ = along(np.eye(4), projection, (start, end), rng)
    assert np.linalg.norm(places - centre, axis=1).max() <= radius * (1 + 1e-9)
    if not flat and shift == 0:  # no smaller one does, where the view's axis is its middle
        (a, b, c, d), _ = eye_rays(projection)
        rims = np.array([(x * k, y * k, -k) for k in (start, end) for x in (c, a + c) for y in (d, b + d)])
        assert np.isclose(np.linalg.norm(rims - centre, axis=1), radius, rtol=1e-6).sum() >= 4


@given(seeds, st.integers(1, 4), st.floats(0, 1), st.floats(0, 0.5), st.booleans(), st.sampled_from([0.5, 5.0, 200.0]))
def test_cascades_hold_all_that_is_seen_where_anything_casts(
    seed: int, count: int, split: float, blend: float, flat: bool, reach: float
) -> None:
    rng = np.random.default_rng(seed)
    view, projection, lamp = look(rng.uniform(-20, 20, 3), turned(rng)), lens(flat), sun(rng)
    hulls, settled = boxes(rng, 5, reach), air(cascades=count, cascade_split=split, cascade_blend=blend)
    views = lamp.shadow_views(view, projection, hulls, settled)
    assert 1 <= len(views) <= count and lamp.shadow_layers(settled) == count
    assert views[0].span[0] == 0 and views[-1].span[1] == np.inf
    assert all(one.span[1] == after.span[0] for one, after in pairwise(views))
    plane = fit.basis(lamp.direction)[:2]
    extent = hulls.reshape(-1, 3) @ plane.T
    for k, one in enumerate(views):
        begin, end = one.span[0], min(one.span[1], settled.max_distance)
        if k:
            begin -= blend * (views[k - 1].span[1] - views[k - 1].span[0])
        places, _ = along(view, projection, (begin, max(end, begin)), rng)
        across = places @ plane.T
        shadowed = ((across >= extent.min(axis=0)) & (across <= extent.max(axis=0))).all(axis=1)
        at = texels(one, places[shadowed])
        assert ((at[:, :2] >= 0.5) & (at[:, :2] <= SIZE - 0.5)).all()
    for one in views:  # what casts into a map is between its planes
        at = texels(one, hulls.reshape(-1, 3)).reshape(-1, 8, 4)
        inside = fit.reached(one.matrix, SIZE, hulls)
        assert ((at[inside, :, 2] > 0) & (at[inside, :, 2] < 1)).all()


def test_a_suns_depth_is_in_metres() -> None:
    rng = np.random.default_rng(1)
    lamp, hulls = sun(rng), boxes(rng, 4, 3)
    (one,) = lamp.shadow_views(look((0, 0, 9), np.eye(3)), lens(), hulls, air())
    places = rng.normal(size=(50, 3))
    at = texels(one, places)
    np.testing.assert_allclose(np.diff(at[:, 2]) * one.depth_scale, np.diff(places @ lamp.direction), atol=1e-9)
    apart = np.linalg.norm(np.diff(places @ fit.basis(lamp.direction)[:2].T, axis=0), axis=1)
    np.testing.assert_allclose(np.linalg.norm(np.diff(at[:, :2], axis=0), axis=1) * one.texel, apart, atol=1e-9)


@pytest.mark.parametrize("flat", [False, True])
def test_texels_stand_still_while_a_camera_moves_and_turns(flat: bool) -> None:
    rng = np.random.default_rng(3)
    hulls, lamp, places = boxes(rng, 9, 300), sun(rng), rng.uniform(-50, 50, (40, 3))
    settled = air(40.0, cascades=3)
    before: list[tuple[float, Matrix]] = []
    moved = np.zeros(3, int)
    for frame in range(40):
        turn = 0.013 * frame
        rotation = np.array([[math.cos(turn), 0, math.sin(turn)], [0, 1, 0], [-math.sin(turn), 0, math.cos(turn)]])
        views = lamp.shadow_views(look((0.11 * frame, 0.03 * frame, 0.07 * frame), rotation), lens(flat), hulls, settled)
        assert len(views) == 3
        now = [(one.texel, texels(one, places)[:, :2]) for one in views]
        for k, ((size, at), (was, at_before)) in enumerate(zip(now, before)):
            assert size == was
            step = at - at_before
            np.testing.assert_allclose(step, np.broadcast_to(np.round(step[0]), step.shape), atol=1e-6)
            moved[k] += np.any(np.round(step[0]) != 0)
        before = now
    assert moved.min() > 2  # the maps did follow


def test_one_map_of_all_casters_stays_where_it_is() -> None:
    rng = np.random.default_rng(5)
    hulls, lamp = boxes(rng, 9, 2), sun(rng)
    settled = air(40.0, cascades=3)
    made = [lamp.shadow_views(look(rng.uniform(-2, 2, 3) + (0, 0, 30), turned(rng)), lens(), hulls, settled) for _ in range(20)]
    last = np.stack([views[-1].matrix for views in made])
    np.testing.assert_array_equal(last, np.broadcast_to(last[0], last.shape))
    at = texels(made[0][-1], hulls.reshape(-1, 3))
    assert ((at[:, :2] >= 1) & (at[:, :2] <= SIZE - 1)).all()
    assert np.ptp(at[:, :2], axis=0).max() > (SIZE - 3) / fit.RUNG_RATIO - 1
    hulls[0] += 1e-3  # what moves within does not stir the rest
    np.testing.assert_array_equal(lamp.shadow_views(look((0, 0, 30), np.eye(3)), lens(), hulls, settled)[-1].matrix[:2], last[0][:2])


@given(seeds, st.floats(0.01, math.pi / 2))
def test_a_spots_cone_lies_in_its_map(seed: int, outer: float) -> None:
    rng = np.random.default_rng(seed)
    right, up, ahead = turned(rng)
    place = rng.normal(size=3)
    lamp = SpotLight((1, 1, 1), tuple(place), tuple(ahead), outer=outer)
    (one,) = lamp.shadow_views(np.eye(4), lens(), boxes(rng, 3, 9), air())
    around, edge = np.linspace(0, 2 * np.pi, 720), min(outer, WIDEST_HALF_ANGLE)
    rim = math.cos(edge) * ahead + math.sin(edge) * (np.cos(around)[:, None] * right + np.sin(around)[:, None] * up)
    at = texels(one, place + 3 * rim)
    margin = fit.MARGIN_TEXELS
    assert at[:, :2].min() == pytest.approx(margin, abs=1e-3) and at[:, :2].max() == pytest.approx(SIZE - margin, abs=1e-3)
    np.testing.assert_allclose(at[:, 3], 3 * math.cos(edge), rtol=1e-6)
    np.testing.assert_allclose(at[:, 2] * at[:, 3], one.depth_scale, rtol=1e-9)
    centre = texels(one, (place + 2 * ahead)[None])[0]
    np.testing.assert_allclose(centre[:2], SIZE / 2, atol=1e-6)
    assert one.texel == pytest.approx(math.tan(edge) / (SIZE / 2 - fit.MARGIN_TEXELS))


@given(seeds)
def test_a_points_views_tile_all_directions(seed: int) -> None:
    rng = np.random.default_rng(seed)
    place = rng.normal(size=3)
    views = PointLight((1, 1, 1), tuple(place)).shadow_views(np.eye(4), lens(), boxes(rng, 3, 9), air())
    ways = rng.normal(size=(500, 3))
    at = np.stack([texels(one, place + ways) for one in views])
    face = at[..., 3].argmax(axis=0)
    axis = np.abs(ways).argmax(axis=1)
    np.testing.assert_array_equal(face, 2 * axis + (ways[np.arange(500), axis] < 0))
    own = at[face, np.arange(500)]
    np.testing.assert_allclose(own[:, 3], np.abs(ways).max(axis=1), rtol=1e-9)
    assert ((own[:, :2] >= fit.MARGIN_TEXELS) & (own[:, :2] <= SIZE - fit.MARGIN_TEXELS)).all()


def test_a_lamps_map_begins_where_it_may() -> None:
    far = np.zeros((1, 8, 3)) + boxes(np.random.default_rng(0), 1, 0) + (0, 0, 500)
    assert fit.near_plane(np.zeros(3), 0, far, 1) == pytest.approx(0.5, rel=0.01)
    near = np.concatenate([far, boxes(np.random.default_rng(0), 1, 0, 0.11) + (0.3, 0.3, 0.3)])
    one = PointLight((1, 1, 1)).shadow_views(np.eye(4), lens(), near, air())[0]
    at = texels(one, near[1])
    assert (at[:, 2] < 1).all() and one.depth_scale < 0.3
    around = np.concatenate([near, boxes(np.random.default_rng(0), 1, 0) * 1e4])  # the lamp is in a room
    assert fit.near_plane(np.zeros(3), 0, around, 0.5) == fit.near_plane(np.zeros(3), 0, near, 0.5)
    assert fit.near_plane(np.zeros(3), 0.7, near, 1) == 0.7
    assert fit.near_plane(np.zeros(3), 0, far[:0], 1) > 0


@given(seeds, st.sampled_from(sorted(KINDS)))
def test_no_hull_that_is_seen_is_left_out(seed: int, kind: Any) -> None:
    rng = np.random.default_rng(seed)
    hulls = boxes(rng, 40, 10, 6)
    towards = {"direction": tuple(turned(rng)[0])}
    lamp = KINDS[kind]((1, 1, 1), **{"directional": towards, "spot": towards | {"outer": 0.4}}.get(kind, {}))
    views = lamp.shadow_views(look((0, 0, 0), turned(rng)), lens(), hulls, air(12.0, cascades=2))
    shares = rng.dirichlet(np.ones(8), (40, 30))
    some = False
    for one in views:
        at = np.einsum("nps,nsk->npk", shares, hulls) @ one.matrix[:, :3].T + one.matrix[:, 3]
        x, y, z, w = np.moveaxis(at, 2, 0)
        seen = ((x >= 0) & (y >= 0) & (x <= SIZE * w) & (y <= SIZE * w) & (z <= w) & (w > 0)).any(axis=1)
        reached = fit.reached(one.matrix, SIZE, hulls)
        assert reached[seen].all()
        some |= not reached.all()
    assert some or lamp.directional


@pytest.mark.parametrize("kind", KINDS)
def test_without_casters_there_is_still_a_map(kind: Any) -> None:
    views = KINDS[kind]((1, 1, 1)).shadow_views(look((3, 2, 1), np.eye(3)), lens(), np.zeros((0, 8, 3)), air(cascades=4))
    assert all(np.isfinite(np.linalg.inv(one.matrix)).all() for one in views) and views[-1].span[1] == np.inf
    assert fit.ball(np.zeros((0, 8, 3)))[1] == 0
