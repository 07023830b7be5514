"""The tracer against light that is summed in small steps, with shadows by rays, and against formulas."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from airlight.lights.directional import DirectionalLight
from airlight.lights.point import PointLight
from airlight.lights.punctual import PunctualLight
from airlight.lights.spot import SpotLight
from airlight.medium.resolve import ResolvedMedium, resolve
from airlight.options import March, Medium
from airlight.reference import tracer

SIZE = (16, 9)
EYE = np.array([0.0, 1.0, 6.0])


def look(eye: np.ndarray = EYE, near: float = 0.01, far: float = 1000.0, flat: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """view, projection of a camera that looks along -z; pygfx's depth, 0 to 1."""
    view = np.eye(4)
    view[:3, 3] = -eye
    s, k = math.tan(math.radians(25)), far / (near - far)
    if flat:
        return view, np.array([[1 / 6, 0, 0, 0], [0, 1 / 4, 0, 0], [0, 0, 1 / (near - far), near / (near - far)], [0, 0, 0, 1.0]])
    return view, np.array([[9 / 16 / s, 0, 0, 0], [0, 1 / s, 0, 0], [0, 0, k, k * near], [0, 0, -1.0, 0]])


def air(quality: str = "final", **medium: Any) -> ResolvedMedium:
    return resolve(Medium(**{"sigma_t": (0.1, 0.2, 0.4), "max_distance": 20.0, **medium}), March(), quality, 5.0)


def square(z: float, half: float = 100.0, x: float = 0.0, y: float = 0.0) -> np.ndarray:
    a, b, c, d = ([x + i * half, y + j * half, z] for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1)))
    return np.array([[a, b, c], [a, c, d]])


def blocked(points: np.ndarray, lamp: PunctualLight, triangles: np.ndarray) -> np.ndarray:
    """(n,) bool: whether a ray from each point to the lamp meets a triangle; Cramer's rule."""
    if lamp.directional:
        ways = np.broadcast_to(np.asarray(lamp.direction) * 1e4, points.shape)
    else:
        ways = np.asarray(lamp.position) - points
    found = np.zeros(len(points), bool)
    for a, b, c in triangles:
        for k, (point, way) in enumerate(zip(points, ways)):
            system = np.stack([b - a, c - a, -way], axis=1)
            if abs(np.linalg.det(system)) > 1e-12:
                u, v, t = np.linalg.solve(system, point - a)
                found[k] |= u >= 0 and v >= 0 and u + v <= 1 and 0 < t < 1
    return found


def scattered(seed: int, count: int = 12) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return rng.uniform(-2, 2, (count, 1, 3)) + rng.normal(0, 0.7, (count, 3, 3))


LAMPS = {
    "sun": DirectionalLight((2.0, 3.0, 4.0), direction=(0.48, 0.6, 0.64)),
    "spot": SpotLight((20.0, 30.0, 40.0), (0.4, 4.0, 1.0), (0.0, -0.8, -0.6), inner=0.3, outer=0.7),
    "point": PointLight((20.0, 30.0, 40.0), (0.3, 0.4, 0.5), range=5.0),
}


@pytest.mark.parametrize("kind", LAMPS)
@given(seed=st.integers(0, 10**6))
def test_a_point_is_lit_where_a_ray_from_it_says_so(kind: str, seed: int) -> None:
    triangles, lamp = scattered(seed), LAMPS[kind]
    rng = np.random.default_rng(seed)
    ray = rng.normal(size=(4, 3))
    ray /= np.linalg.norm(ray, axis=1)[:, None]
    origin, reach = rng.uniform(-4, 4, (4, 3)), rng.uniform(1, 9, 4)
    which, start, end = tracer.lit(origin, ray, reach, tracer.shadow_volumes(triangles, lamp)[0])
    assert np.all(start < end) and np.all(start >= 0) and np.all(end <= reach[which])
    for r in range(4):
        t = rng.uniform(0, reach[r], 8)
        mine = which == r
        assert np.all(start[mine][1:] > end[mine][:-1])
        inside = np.any((t[:, None] > start[mine]) & (t[:, None] < end[mine]), axis=1)
        assert np.array_equal(inside, ~blocked(origin[r] + t[:, None] * ray[r], lamp, triangles))


@pytest.mark.parametrize("kind", LAMPS)
@pytest.mark.parametrize("flat", [False, True])
def test_a_picture_is_what_small_steps_sum_up_to(kind: str, flat: bool) -> None:
    """Some pixels, 3,000 steps each, on a wall behind 12 triangles: what culling leaves out would be missed."""
    triangles, lamp, medium = np.concatenate([scattered(3), square(-3.0)]), LAMPS[kind], air(anisotropy=0.6)
    view, projection = look(flat=flat)
    light, _, reach = tracer.layer(view, projection, (48, 27), triangles, [lamp], medium)
    for x, y in ((10, 12), (24, 13), (25, 20), (33, 9)):
        u, v = (x + 0.5) / 48 * 2 - 1, 1 - (y + 0.5) / 27 * 2
        ray = np.linalg.inv(projection) @ [u, v, 0.5, 1]
        origin, ray = (EYE + [ray[0], ray[1], 0], np.array([0, 0, -1.0])) if flat else (EYE, ray[:3] / np.linalg.norm(ray[:3]))
        steps = 3000
        t = (np.arange(steps) + 0.5) / steps * reach[y, x]
        points = origin + t[:, None] * ray
        d = np.ones(steps) if lamp.directional else np.linalg.norm(points - lamp.position, axis=1)
        to = np.broadcast_to(lamp.direction, points.shape) if lamp.directional else (np.asarray(lamp.position) - points) / d[:, None]
        power = np.full(steps, 1.0) if lamp.directional else np.exp(0 * d) / d**2
        if kind == "spot":
            scale, offset = lamp.cone()
            power *= np.clip(-to @ np.asarray(lamp.direction) * scale + offset, 0, 1) ** 2
        if kind == "point":
            power *= np.maximum(1 - (d / lamp.range) ** 4, 0)
        power *= 1 - fast_blocked(points, lamp, triangles)
        power *= tracer.phase(to @ ray, medium, lamp)
        path = t if lamp.directional else t + d
        want = medium.sigma_s * lamp.intensity * (np.exp(-path[:, None] * medium.sigma_t) * power[:, None]).mean(axis=0) * reach[y, x]
        assert np.allclose(light[y, x], want, rtol=4e-3, atol=1e-6)


def fast_blocked(points: np.ndarray, lamp: PunctualLight, triangles: np.ndarray) -> np.ndarray:
    """As `blocked`, by the signs of volumes."""
    a, b, c = triangles[:, None, 0], triangles[:, None, 1], triangles[:, None, 2]
    goal = points + np.asarray(lamp.direction) * 1e3 if lamp.directional else np.broadcast_to(lamp.position, points.shape)

    def volume(p: np.ndarray, q: np.ndarray, r: np.ndarray, s: np.ndarray) -> np.ndarray:
        return np.einsum("...j,...j->...", np.cross(q - p, r - p), s - p)

    sides = np.stack([volume(points, goal, p, q) for p, q in ((a, b), (b, c), (c, a))])
    through = np.all(sides > 0, axis=0) | np.all(sides < 0, axis=0)
    return np.any(through & (volume(a, b, c, points) * volume(a, b, c, goal) < 0), axis=0)


def test_the_first_surface_ends_a_ray_and_so_does_the_greatest_distance() -> None:
    view, projection = look()
    triangles = np.concatenate([square(-3.0), square(2.0, 1.0)])
    reach = tracer.layer(view, projection, SIZE, triangles, [], air(max_distance=9.5)).path_length
    _, rays, slope = tracer.camera_rays(np.linalg.inv(view), projection, np.array([0.53125]), np.array([0.5]))
    assert reach[4, 8] == pytest.approx(4 * slope[0], rel=1e-12)
    assert reach[0, 0] == 9.5 and reach[4, 1] == 9.5 and reach[4, 4] == pytest.approx(9 * np.linalg.norm([1, rays[0, 1]]), rel=0.1)
    assert np.all(tracer.layer(view, projection, SIZE, square(5.995), [], air()).path_length == 20.0)  # before the near plane
    assert np.all(tracer.layer(*look(far=5.0), SIZE, triangles, [], air()).path_length[0] == 20.0)  # beyond the far plane


def test_a_slab_of_sunlight() -> None:
    """A roof over part of the way: lit from t0 on, closed form; and the ambient term."""
    view, projection = look()
    roof = np.array([[[-50, 3, 60], [50, 3, 60], [50, 3, 2.0]], [[-50, 3, 60], [50, 3, 2.0], [-50, 3, 2.0]]])
    medium, sun = air(ambient=(0.1, 0.2, 0.3), phase="rayleigh"), DirectionalLight((1.0, 2.0, 3.0), direction=(0.0, 1.0, 0.0))
    light, transmittance, reach = tracer.layer(view, projection, SIZE, square(-3.0), [sun], medium, roof)
    np.testing.assert_allclose(transmittance, np.exp(-reach[..., None] * medium.sigma_t), rtol=1e-12)
    _, ray, slope = tracer.camera_rays(np.linalg.inv(view), projection, np.array([0.53125]), np.array([0.5]))
    t0, t1, s = 4 * slope[0], reach[4, 8], medium.sigma_t
    cosine = float(ray[0] @ (0, 1, 0))
    want = medium.sigma_s * 3 / (16 * np.pi) * (1 + cosine**2) * (1.0, 2.0, 3.0) * (np.exp(-s * t0) - np.exp(-s * t1)) / s
    want = want + medium.sigma_s * (0.1, 0.2, 0.3) * (1 - np.exp(-s * t1)) / s
    assert light[4, 8] == pytest.approx(want, rel=1e-12)


@pytest.mark.parametrize("g", [0.0, 0.95, -0.8])
def test_a_lamp_in_a_medium_without_shadows_is_integrated_to_1e_8(g: float) -> None:
    """Against Gauss's rule with 40,000 nodes in equal pieces; the ray passes the lamp at 2 cm."""
    lamp, medium = PointLight((1.0, 1.0, 1.0), (0.0, 0.02, 0.0)), air(anisotropy=g)
    origin, ray = np.array([[0.0, 0.0, 3.0]]), np.array([[0.0, 0.0, -1.0]])
    found = tracer.in_scattered(origin, ray, *tracer.lit(origin, ray, np.array([7.0]), np.zeros((0, 4, 4))), lamp, medium)
    nodes, weights = np.polynomial.legendre.leggauss(10)
    t = (np.arange(4000)[:, None] + (nodes + 1) / 2).ravel() * 7 / 4000
    d = np.hypot(t - 3, 0.02)
    power = tracer.phase((3 - t) / d, medium, lamp) / d**2 * np.tile(weights, 4000) * 7 / 8000
    want = medium.sigma_s * (power[:, None] * np.exp(-(t + d)[:, None] * medium.sigma_t)).sum(axis=0)
    assert found[0] == pytest.approx(want, rel=1e-8)


@pytest.mark.parametrize("phase", ["henyey-greenstein", "two-lobe", "isotropic", "rayleigh", "cornette-shanks"])
def test_phase_functions_integrate_to_one(phase: str) -> None:
    x, weights = np.polynomial.legendre.leggauss(200)
    values = tracer.phase(x, air(phase=phase, anisotropy=0.7), LAMPS["sun"])
    assert 2 * np.pi * (values @ weights) == pytest.approx(1, rel=1e-9)


def test_lengths_times_1000_and_coefficients_by_1000_are_the_same_picture() -> None:
    view, projection = look()
    triangles = np.concatenate([scattered(5), square(-3.0)])
    small = tracer.layer(view, projection, SIZE, triangles, [LAMPS["sun"]], air())[0]
    view = view.copy()
    view[:3, 3] *= 1000
    large = tracer.layer(
        view, look(near=10, far=1e6)[1], SIZE, triangles * 1000, [LAMPS["sun"]], air(sigma_t=(1e-4, 2e-4, 4e-4), max_distance=2e4)
    )[0]
    assert large == pytest.approx(small, rel=1e-9)


def test_no_medium_no_light() -> None:
    view, projection = look()
    assert not np.any(tracer.layer(view, projection, SIZE, square(-3.0), list(LAMPS.values()), air(sigma_t=(0, 0, 0)))[0])
    assert not np.any(tracer.layer(view, projection, SIZE, square(-3.0), list(LAMPS.values()), air(albedo=(0, 0, 0)))[0])
