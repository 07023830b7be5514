"""Where a light of a scene lies in the picture: properties that hold for every camera."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

pytest.importorskip("pygfx")
from airlight.projection import GUARD_HALF_SIZES, depth_terms, pixel_rays, project


def perspective(fov: float, aspect: float, near: float = 0.1, far: float = 1000.0) -> np.ndarray:
    """fov: degrees, vertical."""
    f = 1 / np.tan(np.deg2rad(fov) / 2)
    return np.array([[f / aspect, 0, 0, 0], [0, f, 0, 0], [0, 0, -far / (far - near), -far * near / (far - near)], [0, 0, -1, 0]])


def orthographic(width: float, height: float, near: float = 0.1, far: float = 1000.0) -> np.ndarray:
    return np.array([[2 / width, 0, 0, 0], [0, 2 / height, 0, 0], [0, 0, -1 / (far - near), -near / (far - near)], [0, 0, 0, 1.0]])


def turned(axis: np.ndarray, angle: float, eye: Any = (0, 0, 0)) -> np.ndarray:
    """A view matrix: turned about an axis (3,) by radians (Rodrigues), from an eye."""
    x, y, z = axis / np.linalg.norm(axis)
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    view = np.eye(4)
    view[:3, :3] = np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k
    view[:3, 3] = -view[:3, :3] @ np.asarray(eye, float)
    return view


unit = st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda v: np.linalg.norm(v) > 0.1).map(np.array)
fovs, aspects = st.floats(15, 100), st.floats(0.5, 2.5)


@given(fovs, aspects, st.floats(-0.99, 0.99), st.floats(-0.99, 0.99), st.floats(0.2, 900), st.booleans())
def test_in_view_it_is_where_it_is_drawn(fov: float, aspect: float, x: float, y: float, away: float, sun: bool) -> None:
    """Full, at the place and along the ray of its pixel, at the distance of its depth."""
    projection = perspective(fov, aspect)
    rays = pixel_rays(projection)
    u, v = 0.5 + 0.5 * x, 0.5 - 0.5 * y
    ray = np.array([rays[0] * u + rays[2], rays[1] * v + rays[3], -1.0])
    found = project(np.append(ray * away, 0.0 if sun else 1.0), np.eye(4), projection)
    np.testing.assert_allclose(found.position, (u, v), atol=1e-9)
    np.testing.assert_allclose(found.direction, ray / np.linalg.norm(ray), atol=1e-12)
    assert found.fade == 1.0
    assert found.distance == (np.inf if sun else pytest.approx(away * np.linalg.norm(ray)))
    for matrix in (projection, orthographic(3, 2)):
        clip = matrix @ np.append(ray * away, 1.0)
        a, b, c, d = depth_terms(matrix)
        depth = clip[2] / clip[3]
        assert (a * depth + b) / (c * depth + d) == pytest.approx(away, rel=1e-6)


@settings(max_examples=60)
@given(unit, unit, st.floats(-3.2, 3.2), fovs, aspects, st.booleans(), st.booleans())
def test_it_moves_and_fades_steadily(
    place: np.ndarray, axis: np.ndarray, start: float, fov: float, aspect: float, sun: bool, flat: bool
) -> None:
    """In steps of 0.1 degrees nothing jumps that is seen, whichever way the camera turns: the fade, and the place times the fade."""
    projection = orthographic(4, 4 / aspect) if flat else perspective(fov, aspect)
    steps = [project(np.append(5 * place, 0.0 if sun else 1.0), turned(axis, start + np.deg2rad(0.1) * i), projection) for i in range(200)]
    fades = np.array([s.fade for s in steps])
    places = np.array([s.position for s in steps])
    assert np.isfinite(places).all() and ((fades >= 0) & (fades <= 1)).all()
    assert np.abs(places - 0.5).max() <= GUARD_HALF_SIZES / 2 + 1e-9
    assert np.abs(np.diff(fades)).max() < (0.05 if flat else 0.012)
    seen = np.minimum(fades[1:], fades[:-1])[:, None]
    if not (flat and sun):  # which has a side, but no place
        assert (np.abs(np.diff(places, axis=0)) * seen).max() < 0.12


@given(unit, unit, st.floats(-3.2, 3.2), fovs, aspects)
def test_none_behind(place: np.ndarray, axis: np.ndarray, angle: float, fov: float, aspect: float) -> None:
    view = turned(axis, angle, (1, -2, 3))
    for w in (0.0, 1.0):
        found = project(np.append(place + (np.array([1, -2, 3]) if w else 0), w), view, perspective(fov, aspect))
        ahead = -found.direction[2]
        assert (found.fade > 0) == (ahead > 0) or abs(ahead) < 1e-6


@given(st.floats(0, 6.3), fovs, aspects, st.sampled_from([0.0, 1.0]))
def test_at_right_angles_it_is_on_its_side(turn: float, fov: float, aspect: float, w: float) -> None:
    """Exactly perpendicular, where its projection is at infinity; and straight ahead, straight behind, at the eye."""
    projection = perspective(fov, aspect)
    found = project((np.cos(turn), np.sin(turn), 0.0, w), np.eye(4), projection)
    assert found.fade == 0.0 and np.isfinite(found.position).all()
    side = np.array(found.position) - 0.5
    assert np.abs(side).max() == pytest.approx(GUARD_HALF_SIZES / 2)
    assert side @ np.array([np.cos(turn) / aspect, -np.sin(turn)]) > 0
    assert project((0, 0, -1, w), np.eye(4), projection).position == (0.5, 0.5)
    assert project((0, 0, 1, w), np.eye(4), projection).fade == 0.0
    assert project((0, 0, 0, 1), np.eye(4), projection).fade == 0.0
    assert project((np.nan, 0, 0, 1), np.eye(4), projection).fade == 0.0


def test_the_fade_is_full_to_the_border_and_falls_from_there() -> None:
    projection = perspective(50, 16 / 9)
    angles = np.arange(0, 181)
    fades = np.array([project((np.sin(a), 0, -np.cos(a), 0), np.eye(4), projection).fade for a in np.deg2rad(angles)])
    border = np.rad2deg(np.arctan(np.tan(np.deg2rad(25)) * 16 / 9))
    assert (fades[angles < border] == 1).all() and (fades[angles >= 90] < 1e-9).all()
    falling = fades[(angles > border) & (angles <= 90)]
    assert (np.diff(falling) < 0).all() and fades[60] > 0.5
