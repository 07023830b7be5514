"""The shader functions of the passes over a scene's picture one by one, over random arrays, against their float64 twins."""

from typing import Any

import numpy as np
import pytest
from calling import call

from airlight.composite.adapt import Ramp
from airlight.composite.scene import UNIFORMS
from airlight.reference import scene as twin
from airlight.reference import tone as tone_twin

RNG = np.random.default_rng(7)
COUNT = 300


def unit(count: int) -> np.ndarray:
    v = RNG.normal(size=(count, 3)) * (1, 1, 0.3) - (0, 0, 1)
    return np.asarray(v / np.linalg.norm(v, axis=1, keepdims=True), np.float32)


@pytest.fixture
def view() -> Any:
    """Of a camera with perspective, five cones, of which two are bodies, and three lights."""
    out = np.zeros((), UNIFORMS)
    out["rays"], out["depth"] = (1.8, -1.0, -0.9, 0.5), (0.0, 10.0, -9.9, 10.0)
    out["pixels"], out["pixel"], out["clear"] = (320, 180), (1 / 320, 1 / 180), (0.1, 0.2, 0.4)
    cone, aim = out["cone"], out["aim"]
    cone["direction"], cone["cosine"], cone["sharp"] = unit(8), RNG.uniform(0.8, 0.99, 8), 40.0
    cone["near"][:2], cone["far"][:2], cone["disc"][2:] = 2.0, 5.0, RNG.uniform(0.5, 2, 6)
    aim["direction"], aim["fade"] = unit(8), np.arange(8) < 3
    return out


def uv() -> np.ndarray:
    return RNG.random((COUNT, 2)).astype(np.float32)


def test_rays_and_depths(view: Any) -> None:
    own, at, depth = {"view": view}, uv(), RNG.random(COUNT).astype(np.float32)
    found = call("composite/scene_merge.wgsl", "view_ray", [at], bindings=own)
    np.testing.assert_allclose(found, twin.view_ray(at, view["rays"]), rtol=1e-5, atol=1e-6)
    for factors in (view["depth"].copy(), (99.9, 0.1, 0.0, 1.0)):  # with perspective, and without
        view["depth"] = factors
        found = call("composite/scene_merge.wgsl", "axial", [depth], bindings=own)
        np.testing.assert_allclose(found, twin.axial(depth, view["depth"].astype(float)), rtol=1e-4)


def test_tones() -> None:
    color = 10.0 ** RNG.uniform(-4, 4, (COUNT, 3))
    np.testing.assert_allclose(call("composite/tone.wgsl", "filmic", [color]), tone_twin.filmic(color), rtol=1e-3, atol=1e-5)
    y, scale, white, share = 10.0 ** RNG.uniform(-4, 4, COUNT), 0.7, 3.0, RNG.random(COUNT)
    found = call("composite/tone.wgsl", "ramp_gain", [y, scale, white, share])
    np.testing.assert_allclose(found, twin.ramp_gain(y, scale, white, share), rtol=1e-4)
    np.testing.assert_allclose(twin.ramp_gain(y, scale, white, 1.0), Ramp(scale, white).gain(y.astype(np.float32)), rtol=1e-5)


def test_a_surface_through_a_medium() -> None:
    surface, transmittance, in_scattered = RNG.random((3, COUNT, 3))
    found = call("composite/medium.wgsl", "through_medium", [surface, transmittance, in_scattered, 0.4])
    np.testing.assert_allclose(found, twin.through_medium(surface, in_scattered, transmittance, 0.4), rtol=1e-5)


def test_lines(view: Any) -> None:
    at, color = uv(), RNG.random((COUNT, 3))
    found = call("composite/scene_merge.wgsl", "lines", [at, color], bindings={"view": view})
    truth = twin.lines(at.astype(float), color, view)
    drawn = (np.abs(truth - 0.25 * color) > 1e-3).any(axis=1)
    assert 0.02 < drawn.mean() < 0.9
    assert np.isclose(found, truth, rtol=1e-4).all(axis=1).mean() > 0.98  # a line's edge


def test_what_lights_are_at_a_ray(view: Any) -> None:
    found, ray = RNG.random((COUNT, 4)), twin.view_ray(uv(), view["rays"]).astype(np.float32)
    cone, inverse = view["cone"][RNG.integers(0, 8, COUNT)], 1 / np.linalg.norm(ray, axis=1)
    cone["direction"] = ray * inverse[:, None] + RNG.normal(size=(COUNT, 3)) * 0.3
    gave = call("pygfx/mask.wgsl", "with_light", [found, cone, ray, inverse])
    truth = twin.with_light(found, cone, ray.astype(float), inverse)
    np.testing.assert_allclose(gave, truth, rtol=2e-3, atol=2e-4)
    assert 0.05 < (gave[:, 1] != found[:, 1].astype(np.float32)).mean() < 0.95
    for cones in range(9):
        at = uv()
        view["cone"]["direction"] = twin.view_ray(at[:8], view["rays"])
        view["cone"]["direction"] /= np.linalg.norm(view["cone"]["direction"], axis=1, keepdims=True)
        gave = call("pygfx/mask.wgsl", "lights_at", [at], bindings={"view": view}, constants={"CONES": cones})
        np.testing.assert_allclose(gave, twin.lights_at(at.astype(float), view, cones), rtol=2e-3, atol=2e-3)
        assert gave.any() == (cones > 0)


@pytest.mark.parametrize("cones", [0, 1, 2])
@pytest.mark.parametrize("cleared", [False, True])
def test_what_is_emitted(view: Any, cones: int, cleared: bool) -> None:
    depth = np.where(RNG.random(COUNT) < 0.3, 1.0, RNG.uniform(0.5, 0.99, COUNT)).astype(np.float32)
    light = np.stack([RNG.random(COUNT), RNG.random(COUNT), RNG.uniform(0, 3, COUNT), RNG.uniform(3, 60, COUNT)], axis=1)
    view["depth"] = (3.0, 7.0, -9.9, 10.0)  # as of no camera: each counts
    own: Any = {"bindings": {"view": view}, "constants": {"CONES": cones, "CLEAR": cleared}}
    found = call("pygfx/mask.wgsl", "emits", [depth, light], **own)
    truth = twin.emits(depth.astype(float), light, view, cones)
    np.testing.assert_allclose(found, truth, rtol=1e-5)
    assert (np.unique(truth).size > 3) == (cones > 0)
    color, open = 10.0 ** RNG.uniform(-3, 6, (COUNT, 3)), depth >= 1
    found = call("pygfx/mask.wgsl", "radiance", [color, open, light], **own)
    np.testing.assert_allclose(found, twin.radiance(color, open, light, view, cones, cleared), rtol=1e-5)
