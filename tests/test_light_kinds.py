"""The table of light kinds: what each says of itself, to the shaders, to shadow maps and to the float64 twins, is the same light."""

import re
from typing import Any

import numpy as np
import pytest
from calling import call

from airlight.gpu.shader import load
from airlight.gpu.structs import struct_dtype
from airlight.lights.kinds import KINDS
from airlight.lights.point import PointLight
from airlight.lights.punctual import PositionalLight, PunctualLight
from airlight.medium.resolve import resolve
from airlight.options import March, Medium
from airlight.reference import medium as twin
from airlight.reference import tracer
from airlight.scatter.march.records import frame_record, light_record

RNG = np.random.default_rng(5)
PROJECTION = np.array([[1.0, 0, 0, 0], [0, 1, 0, 0], [0, 0, -1, -0.1], [0, 0, -1, 0]])  # of a camera that looks along -Z
EXAMPLES: dict[str, dict[str, Any]] = {
    "directional": {"direction": (0.48, 0.6, 0.64)},
    "spot": {"position": (1.0, 2.0, 0.5), "direction": (0.0, -0.8, -0.6), "inner": 0.4, "outer": 1.2, "range": 9.0},
    "point": {"position": (1.0, 2.0, 0.5), "range": 7.0},
    "projector": {"position": (1.0, 2.0, 0.5), "direction": (0.0, -0.8, -0.6), "fov": (1.9, 1.5), "far": 7.0, "falloff": "inverse"},
}


def made(kind: str) -> PunctualLight:
    return KINDS[kind]((3.0, 2.0, 1.0), strength=1.5, anisotropy=0.5, **EXAMPLES[kind])


def medium() -> Any:
    return resolve(Medium(sigma_t=(0.1, 0.2, 0.05), max_distance=20.0), March(), "normal", 5.0)


def test_the_table() -> None:
    assert set(KINDS) == set(EXAMPLES) and all(kind.kind == name and kind.word for name, kind in KINDS.items())
    overrides = set(re.findall(r"^override (\w+): bool", load("scatter/march/scene.wgsl"), re.M))
    assert set().union(*(kind.flags for kind in KINDS.values())) <= overrides
    assert all(kind.directional != issubclass(kind, PositionalLight) for kind in KINDS.values())


@pytest.mark.parametrize("kind", KINDS)
def test_it_shines_in_the_shader_as_in_float64(kind: str) -> None:
    """In-scattered radiance at random points around the eye, which looks along -Z from the origin."""
    light, air, count = made(kind), medium(), 200
    direction = RNG.normal(size=(count, 3)) + (0, 0, -1)
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    t = RNG.uniform(0.5, 6, count)
    points = t[:, None] * direction
    truth = twin.in_scattered(light, air, direction, points, t)
    record = light_record(light, None, np.eye(4), air)
    bindings = {"frame": frame_record(np.eye(4), PROJECTION, air, (8, 8), (8, 8)), "light": record}
    if light.directional:
        ray = np.zeros(count, struct_dtype("scatter/march/ray.wgsl", "Ray"))
        ray["direction"] = direction
        found = call("scatter/march/ray.wgsl", "in_scatter_directional", [ray], bindings=bindings, constants=light.flags)
        found = found * np.exp(-t[:, None] * air.sigma_t)
    else:
        away = points - record["position"]
        d = np.linalg.norm(away, axis=1)
        cosine, axis_cosine = -(away * direction).sum(axis=1) / d, away @ record["axis"] / d
        ray = np.zeros(count, struct_dtype("scatter/march/ray.wgsl", "Ray"))
        parts = ray, t, d, cosine, axis_cosine
        constants = {**light.flags, "FALLS": light.falloff_terms() != (1.0, 0.0, 0.0)}
        found = call("scatter/march/ray.wgsl", "in_scatter_punctual", parts, bindings=bindings, constants=constants)
        planes = light.planes()  # to which rays are clipped
        found = found / d[:, None] ** 2 * np.all(points @ planes[:, :3].T + planes[:, 3] >= 0, axis=1)[:, None]
    assert (truth[:, 0] > 0).mean() > 0.1 and np.ptp(truth) > 0
    np.testing.assert_allclose(found, truth, rtol=1e-3, atol=1e-4 * truth.mean())


@pytest.mark.parametrize("kind", KINDS)
def test_its_views_are_as_many_as_it_says_and_its_light_travels_from_it(kind: str) -> None:
    light, air = made(kind), medium()
    hulls = RNG.uniform(-4, 4, (6, 1, 3)) + RNG.uniform(-0.5, 0.5, (6, 8, 3))
    views = light.shadow_views(np.eye(4), PROJECTION, hulls, air)
    assert 1 <= len(views) <= light.shadow_layers(air)
    points = RNG.uniform(-3, 3, (20, 3))
    to_light, path_length, irradiance = light.incident(points)
    travel = light.travel(points)
    np.testing.assert_allclose(-travel / np.linalg.norm(travel, axis=1, keepdims=True), to_light, atol=1e-12)
    assert (path_length >= 0).all() and (irradiance >= 0).all() and irradiance.any()


class Hemisphere(PointLight):
    """A kind of one's own: a point that shines downwards alone."""

    kind = word = "hemisphere"

    def incident(self, points: Any) -> Any:
        to_light, path_length, irradiance = super().incident(points)
        return to_light, path_length, np.where(to_light[..., 1] > 0, irradiance, 0)


def test_the_tracer_takes_a_kind_of_ones_own() -> None:
    lights = [kind((1.0, 1.0, 1.0), (0.0, 0.0, -4.0)) for kind in (PointLight, Hemisphere)]
    whole, half = (tracer.layer(np.eye(4), PROJECTION, (9, 8), np.zeros((0, 3, 3)), [light], medium()).radiance for light in lights)
    assert whole.min() > 0 and not half[:4].any()
    np.testing.assert_allclose(half[4:], whole[4:], rtol=1e-9)
