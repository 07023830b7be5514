"""Animation of glTF files."""

import math
from pathlib import Path

import numpy as np
import pylinalg as la
import pytest
from gltf_stage import HAWK, Eye, corners, frontal
from gltfs import TRIANGLE, Writer
from hypothesis import given
from hypothesis import strategies as st

from airlight.scenes import open_scene
from airlight.scenes.gltf import animate


def test_interpolation() -> None:
    times, values = np.array([1, 3, 4], np.float32), np.array([[0, 2], [4, 0], [8, 8]], np.float32)
    linear, step = (animate.Track(0, "translation", kind, times, values) for kind in ("LINEAR", "STEP"))
    for t, soft, hard in ((0, [0, 2], [0, 2]), (2, [2, 1], [0, 2]), (3, [4, 0], [4, 0]), (3.75, [7, 6], [4, 0]), (9, [8, 8], [8, 8])):
        np.testing.assert_allclose(linear.at(t), soft)
        np.testing.assert_allclose(step.at(t), hard)


@given(st.floats(0, 1), st.lists(st.floats(-3, 3), min_size=4, max_size=4))
def test_cubic_spline_is_the_cubic(share: float, c: list[float]) -> None:
    """Values and slopes of a cubic at two times give that cubic in between, whatever the step."""
    start, step = 2.0, 4.0
    f = np.polynomial.Polynomial(c)
    slope = f.deriv()
    end = start + step
    values = np.array([[[9], [f(start)], [slope(start)]], [[slope(end)], [f(end)], [9]]], np.float32)
    track = animate.Track(0, "scale", "CUBICSPLINE", np.array([start, end], np.float32), values)
    assert track.at(start + share * step)[0] == pytest.approx(f(start + share * step), rel=1e-4, abs=1e-3)


@given(st.floats(0, 1), st.floats(-1.5, 1.5), st.floats(-1.5, 1.5), st.sampled_from((1, -1)))
def test_rotations_go_the_short_way(share: float, a: float, b: float, sign: int) -> None:
    start, end = (np.array([0, math.sin(x / 2), 0, math.cos(x / 2)]) for x in (a, b))
    found = animate.slerp(start, sign * end, share)
    angle = a + (b - a) * share
    assert abs(found @ [0, math.sin(angle / 2), 0, math.cos(angle / 2)]) == pytest.approx(1, abs=1e-9)
    matrix = animate.compose(np.array([1, 2, 3]), found, np.array([1, -2, 3]))
    np.testing.assert_allclose(matrix, la.mat_compose([1, 2, 3], found, [1, -2, 3]), atol=1e-12)


def test_pose_knows_no_past_and_loops() -> None:
    one, other = open_scene(HAWK, "none"), open_scene(HAWK, "none")
    assert one.duration == pytest.approx(0.9333, abs=1e-3)
    for t in (0.3, 5.0, 0.1, 0.7):
        one.pose(t, None)
    other.pose(0.7, None)
    assert np.array_equal(corners(one), corners(other))
    one.pose(0.7 + one.duration, None)
    np.testing.assert_allclose(corners(one), corners(other), atol=1e-5)
    one.pose(0.2, None)
    assert np.abs(corners(one) - corners(other)).max() > 0.5


def test_clips_that_move_other_things_run_together(tmp_path: Path) -> None:
    w = Writer()
    mesh = w.mesh(TRIANGLE)
    a, b = w.node(mesh=mesh), w.node(mesh=mesh)
    w.animate(a, "translation", [0, 1], [[0, 0, 0], [1, 0, 0]])
    w.animate(b, "translation", [0, 2], [[0, 0, 0], [0, 2, 0]])
    w.animate(a, "translation", [0, 9], [[0, 0, 0], [0, 0, 9]])  # would move what the first moves
    stage = open_scene(w.save(tmp_path), "none")
    assert stage.duration == 2
    stage.pose(0.5, None)
    np.testing.assert_allclose(corners(stage)[[0, 3]], [[-0.5, -1, 0], [-1, -0.5, 0]])


def test_a_scale_of_zero_and_a_turn_of_nothing(tmp_path: Path, eye: Eye) -> None:
    w = Writer()
    node = w.node(mesh=w.mesh(TRIANGLE, NORMAL=[[0, 0, 1]] * 3), rotation=[0, 0, 0, 0])
    w.animate(node, "scale", [0, 1], [[1, 1, 1], [0, 0, 0]])
    w.node(node, extensions=w.light(type="spot"))
    w.node(node, camera=w.add("cameras", type="perspective", perspective={"yfov": 1, "znear": 0.1}))
    stage = open_scene(w.save(tmp_path), "none")
    stage.pose(0.9999999, stage.cameras["camera 1"])
    assert np.isfinite(eye.linear(stage.scene, frontal())).all()
