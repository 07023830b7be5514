"""Functions of the passes of rendered scenes, each over random arrays against its float64 twin."""

from typing import Any

import numpy as np
import pytest
from calling import call

from airlight.gpu.structs import struct_dtype
from airlight.reference import scene

RNG = np.random.default_rng(21)
MERGE, MASK = "pygfx/merge.wgsl", "pygfx/mask.wgsl"
RAYS, TERMS = np.float32([1.6, -0.9, -0.8, 0.45]), np.float32([0.0, 0.1, -0.9995, 1.0])  # of near 0.1 m, far 200 m


def unit(x: Any) -> np.ndarray:
    return np.asarray(x) / np.linalg.norm(x)


@pytest.fixture
def view() -> np.ndarray:
    """A view with two lights, one a disc and one a body, neither over all of the picture."""
    v = np.zeros((), struct_dtype("pygfx/view.wgsl", "View"))
    v["rays"], v["depth"], v["pixels"], v["clear"] = RAYS, TERMS, (640, 360), (0.2, 0.4, 0.9)
    for i, (to, far) in enumerate((((0.3, 0.1, -1), 0), ((-0.4, -0.2, -1), 60))):
        cone, aim = v["cone"][i], v["aim"][i]
        cone["direction"] = aim["direction"] = unit(to)
        cone["cosine"], cone["near"], cone["far"], cone["sharp"], cone["disc"] = np.cos(0.25), 20, far, 40, 3 - i
        aim["fade"] = 1 - i  # the second is faded out
    return v


def uvs(count: int = 2000) -> np.ndarray:
    return RNG.random((count, 2)).astype(np.float32)


def test_view_ray(view: np.ndarray) -> None:
    uv = uvs()
    np.testing.assert_allclose(call(MERGE, "view_ray", [uv], bindings={"view": view}), scene.view_ray(uv, RAYS), atol=1e-6)


def test_axial(view: np.ndarray) -> None:
    depth = RNG.uniform(0, 0.99, 2000).astype(np.float32)
    found = call(MERGE, "axial", [depth], bindings={"view": view})
    np.testing.assert_allclose(found, scene.axial(depth.astype(float), TERMS.astype(float)), rtol=1e-5)


def test_add_cone(view: np.ndarray) -> None:
    """Of each light alone, over others that cover some of the view."""
    found, uv = RNG.random((2000, 4)).astype(np.float32), uvs()
    ray = scene.view_ray(uv, RAYS)
    inverse = 1 / np.linalg.norm(ray, axis=-1)
    for cone in view["cone"][:2]:
        expected = scene.add_cone(found, cone, ray, inverse)
        close = np.isclose(call(MERGE, "add_cone", [found, cone, ray, inverse]), expected, rtol=1e-4, atol=1e-4)
        assert close.mean() > 0.999  # a cover that is another's to a float may win or not
        assert (expected != found).any(axis=1).mean() > 0.01


def test_cones_at(view: np.ndarray) -> None:
    uv = uvs()
    found = call(MERGE, "cones_at", [uv], constants={"CONES": 2}, bindings={"view": view})
    expected = scene.cones_at(uv.astype(float), RAYS.astype(float), view["cone"][:2])
    np.testing.assert_allclose(found, expected, rtol=1e-4, atol=2e-4)
    assert (expected[:, 0] > 1).any() and (expected[:, 1] == 1).any() and (expected == 0).all(axis=1).any()


@pytest.mark.parametrize("cones", [0, 2])
def test_pixel_emission(view: np.ndarray, cones: int) -> None:
    depth = RNG.uniform(0.99, 1.0, 4000).astype(np.float32)
    depth[::3] = 1
    light = np.stack([RNG.random(4000), RNG.random(4000), np.full(4000, 20), np.full(4000, 60)], axis=-1).astype(np.float32)
    found = call(MASK, "pixel_emission", [depth, light], constants={"CONES": cones}, bindings={"view": view})
    light = light.astype(float) if cones else np.zeros((4000, 4)) - 1
    expected = scene.pixel_emission(depth.astype(float), light, TERMS.astype(float))
    assert np.isclose(found, expected, atol=1e-6).mean() > 0.999
    assert (expected == 1).any() and (expected == 0).any() and (not cones or ((expected > 0) & (expected < 1)).any())


@pytest.mark.parametrize("cones", [0, 2])
@pytest.mark.parametrize("clear", [False, True])
def test_emitted_radiance(view: np.ndarray, cones: int, clear: bool) -> None:
    color, light = RNG.uniform(-1, 2, (2000, 3)).astype(np.float32), RNG.random((2000, 4)).astype(np.float32)
    color[:10] = 1e6
    is_open = RNG.random(2000) < 0.5
    constants = {"CONES": cones, "CLEAR": clear}
    found = call(MASK, "emitted_radiance", [color, is_open, light], constants=constants, bindings={"view": view})
    discs = light.astype(float) * (1.0 if cones else (0.0, 1.0, 1.0, 1.0))
    expected = scene.emitted_radiance(color.astype(float), is_open, discs, view["clear"].astype(float) if clear else None)
    np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-6)


def test_filmic() -> None:
    color = np.concatenate([RNG.random((1000, 3)), np.exp(RNG.uniform(-9, 9, (1000, 3))), -RNG.random((10, 3))]).astype(np.float32)
    np.testing.assert_allclose(call(MERGE, "filmic", [color]), scene.filmic(color.astype(float)), atol=1e-5)


def test_light_lines(view: np.ndarray) -> None:
    """All but pixels whose distance from a line is 0.7 px to a float."""
    uv, color = uvs(4000), RNG.random((4000, 3)).astype(np.float32)
    found = call(MERGE, "light_lines", [uv, color], bindings={"view": view})
    expected = scene.light_lines(uv.astype(float), color.astype(float), RAYS.astype(float), view["aim"][:2], (640, 360))
    assert np.isclose(found, expected, atol=1e-6).all(axis=1).mean() > 0.99
    assert 0.02 < (expected[:, 2] == 0.6).mean() < 0.5
