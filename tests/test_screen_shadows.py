"""The functions of screen-space shadows in the air one by one, over random arrays, against their float64 twins."""

from typing import Any

import numpy as np
import pytest
from calling import call

from airlight.gpu.structs import struct_dtype
from airlight.medium.resolve import FOGS
from airlight.reference import screen_shadows as twin
from airlight.scatter.screen_shadows.screen_shadows import BINS, OCTAVES, edges

SCAN, ADD = "scatter/screen_shadows/scan.wgsl", "scatter/screen_shadows/add.wgsl"
FRAME, LIGHT, RAY, RECORD = (struct_dtype(SCAN, name) for name in ("Frame", "Light", "Ray", "Scan"))
RNG, COUNT = np.random.default_rng(71), 300


def between(low: float, high: float, *shape: int) -> np.ndarray:
    return RNG.uniform(low, high, (COUNT, *shape)).astype(np.float32)


def unit(v: np.ndarray) -> np.ndarray:
    return np.asarray(v / np.linalg.norm(v, axis=-1, keepdims=True))


def rays() -> np.ndarray:
    out = np.zeros(COUNT, RAY)
    out["direction"], out["reach"] = unit(np.concatenate([between(-1, 1, 2), np.full((COUNT, 1), -1.0)], axis=1)), 30
    return out


@pytest.fixture
def frame() -> Any:
    out = np.zeros((), FRAME)
    out["sigma_t"], out["sigma_s"], out["max_distance"] = (0.1, 0.2, 0.05), (0.09, 0.1, 0.05), 30
    out["pixels"], out["rays"], out["air"] = (37, 23), (1.3, -0.8, -0.6, 0.5), 1
    out["up"], out["base_height"], out["fog_depth"], out["fog_above"] = (0, 1, 0), 1.5, 2.0, 0.1
    return out


@pytest.fixture
def light() -> Any:
    out = np.zeros((), LIGHT)
    out["intensity"], out["position"], out["axis"] = (3, 2, 1), (0.8, 0.4, -4.0), unit(np.array([0.2, -1.0, 0.1]))
    out["cone_scale"], out["cone_offset"], out["cone_cosine"] = 1.5, 0.1, -0.06
    out["lobes"], out["range"], out["climb"] = (0.5, -0.3, 0.25), 40.0, 0.3
    return out


def close(found: Any, truth: Any, rtol: float = 2e-5, atol: float = 1e-6) -> None:
    assert np.shape(found) == np.shape(truth) and np.ptp(truth) > 0
    np.testing.assert_allclose(found, truth, rtol=rtol, atol=atol)


def test_coordinates(light: Any) -> None:
    distance, place = between(0, 200), between(-5, 5, 3)
    close(call(SCAN, "sun_coordinate", [distance, between(0.2, 0.2), between(8, 8)]), twin.sun_coordinate(distance, 0.2, 8))
    close(call(SCAN, "lamp_coordinate", [place, np.array([0.8, 0.4, -4.0])]), twin.lamp_coordinate(place, light["position"]), atol=1e-5)
    record = np.zeros((), RECORD)
    record["nearest"], record["octaves"] = 0.2, 8
    for is_directional in (False, True):
        own: Any = {"bindings": {"scan": record, "light": light}, "constants": {"DIRECTIONAL": is_directional}}
        close(call(SCAN, "coordinate", [place], **own), twin.coordinate(place, light, is_directional, 0.2, 8), atol=1e-5)


def test_a_coordinate_grows_along_a_ray_and_belongs_to_a_ray_of_the_light(light: Any) -> None:
    """Of a lamp too: it tells rays of the light apart, and none of its points."""
    t, s, direction = np.linspace(0.1, 20, 50), np.linspace(0.01, 6, 7)[:, None], unit(np.array([0.3, 0.4, -1.0]))
    to_sun = unit(np.array([0.1, 0.2, -1.0]))
    for is_directional in (False, True):
        light["position"] = to_sun if is_directional else 4 * to_sun
        along = twin.coordinate(t[:, None] * direction, light, is_directional, 0.2, 8)
        assert (np.diff(along) > 0).all()
        there = 3 * direction
        shone = there - s * (to_sun if is_directional else unit(light["position"] - there))
        np.testing.assert_allclose(twin.coordinate(shone, light, is_directional, 0.2, 8), along[0] * 0 + twin.coordinate(
            there, light, is_directional, 0.2, 8), rtol=1e-6)  # fmt: skip


def test_parts_of_bins() -> None:
    range, first = between(-2, 40, 2), 4 * RNG.integers(0, 9, (COUNT, 1)) + np.arange(4.0)
    close(call(SCAN, "covered_part", [range, first]), twin.covered_part(range, first))
    whole = twin.covered_part(np.array([3.25, 7.5]), np.arange(36.0))
    assert whole.sum() == 4.25 and twin.covered_part(np.array([7.5, 3.25]), np.arange(36.0)).sum() == 0


def test_what_is_seen(frame: Any) -> None:
    p, angle = between(0, 37, 2), between(0.001, 0.02)
    close(call(SCAN, "ray_through", [p], bindings={"frame": frame}), twin.ray_through(p, frame))
    sphere = np.concatenate([between(-3, 3, 2), between(-9, -4, 1), between(0.5, 2, 1)], axis=1)
    place = sphere[:, :3] + 1.3 * sphere[:, 3:] * unit(between(-1, 1, 3)) * between(0, 1, 1)
    found = call(SCAN, "is_on_body", [place, sphere])
    assert np.array_equal(found, twin.is_on_body(place, sphere)) and 0 < found.mean() < 1
    inverse = between(0.1, 0.12, 3) * (between(0, 1, 3) > 0.1)
    inverse[::3] = 0.2 + np.arange(3) * between(0, 0.1, 1)[::3]  # planes
    found = call(SCAN, "is_joined", [inverse, angle])
    assert np.array_equal(found, twin.is_joined(inverse, angle)) and 0.1 < found.mean() < 0.9


@pytest.mark.parametrize("fog", FOGS)
def test_weights(fog: str, frame: Any, light: Any) -> None:
    ray, range = rays(), np.sort(between(0, 20, 2), axis=1)
    range[:, 1] += 0.2
    own: Any = {"bindings": {"frame": frame, "light": light}, "constants": {"FOG": FOGS.index(fog)}}
    sun = own | {"constants": own["constants"] | {"DIRECTIONAL": True, "FADES": fog != "none"}}
    close(call(SCAN, "sun_weight", [ray, range], **sun), twin.sun_weight(ray, range, frame, light, fog, fog != "none"), 1e-3, 2e-5)
    angle = between(0, np.pi)
    cosine, sine = np.cos(angle), np.sin(angle)
    lamp = own | {"constants": own["constants"] | {"CONE": True, "PHASE": 2}}
    truth = twin.lamp_weight(ray, cosine, sine, frame, light, 2, fog)
    assert 0.2 < (truth > 0).mean() < 1
    close(call(SCAN, "lamp_weight", [ray, cosine, sine], **lamp), truth, 2e-3, 1e-5)


def test_bins_end_where_their_coordinates_say() -> None:
    found = edges(0.2)
    np.testing.assert_allclose(twin.sun_coordinate(found[:, 0], 0.2, OCTAVES), np.arange(BINS + 1) / BINS, atol=1e-12)
    np.testing.assert_allclose(np.arctan2(found[:BINS, 2], found[:BINS, 1]) / np.pi, (np.arange(BINS) + 0.5) / BINS)
