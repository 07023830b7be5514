"""Settings from Hx Volumetric Lighting where a medium's density varies: noise, fog by height."""

import dataclasses
from typing import Any

import numpy as np
import pytest
from test_hx import cast, close
from test_march import CASES, SIZE, air, depths, projection

from airlight.gpu.device import open_device
from airlight.gpu.timing import run_ms
from airlight.reference import soften, tracer
from airlight.scatter.march.march import March

NOISY = {"noise_amount": 3.0, "noise_size": 4.0, "noise_octaves": 1}


def march_of(pairs: Any, medium: Any, share: float = 1.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Radiance, transmittance, and what was marched, of rays without an end."""
    device, march = open_device(), March(open_device(), SIZE)
    march.update(np.eye(4), projection(), pairs, medium, jitter="midpoint", share=share)
    seen = depths(np.ones(SIZE[::-1]))
    run_ms(device, lambda encoder: march.record(encoder, seen))
    textures = march.layer, march.transmittance, march.marched_layers[0]
    found = [np.frombuffer(device.read(t, 16), np.float32).reshape(t.size[1], t.size[0], 4) for t in textures]
    return found[0][..., :3], found[1][..., :3], found[2]


def test_a_lights_own_medium_in_fog_is_that_of_the_tracer() -> None:
    fogged = air(fog="exponential", fog_depth=2.0)
    for kind in ("sun", "spot"):
        own = dataclasses.replace(CASES[kind][0], density=2.0, extinction=0.25)
        scaled = dataclasses.replace(fogged, sigma_t=fogged.sigma_t / 2, sigma_s=2 * fogged.sigma_s)
        found, truth = (
            tracer.layer(np.eye(4), projection(), (6, 4), np.zeros((0, 3, 3)), [lamp], medium).radiance
            for lamp, medium in ((own, fogged), (CASES[kind][0], scaled))
        )
        np.testing.assert_allclose(found, truth, rtol=1e-12)


@pytest.mark.parametrize("steps", ["exact", 64])
@pytest.mark.parametrize("kind", ["sun", "spot"])
def test_a_lights_own_medium_and_a_suns_reach_where_density_varies(kind: str, steps: Any) -> None:
    lamp, shadow = cast(kind)
    medium = air(steps=steps, **NOISY)
    scaled = dataclasses.replace(medium, sigma_t=medium.sigma_t / 2, sigma_s=2 * medium.sigma_s)
    own = dataclasses.replace(lamp, density=2.0, extinction=0.25)
    np.testing.assert_allclose(march_of([(own, shadow)], medium)[0], march_of([(lamp, shadow)], scaled)[0], rtol=1e-5)
    if kind == "sun":
        near, ended = (march_of([(lamp, shadow)], air(steps=steps, **NOISY, **{name: 7.0}))[0] for name in ("sun_distance", "max_distance"))
        np.testing.assert_allclose(near, ended, rtol=2e-3 if steps == "exact" else 0.05, atol=1e-3 * ended.mean())


def test_a_layer_of_a_density_that_varies_is_softened_by_the_lengths_of_rays() -> None:
    pair = [cast("sun")]
    plain, soft = (march_of(pair, air(soften=passes, **NOISY))[2] for passes in (0, 2))
    lengths = np.full((*plain.shape[:2], 1), 20.0)
    close(soft[..., :3], soften.softened(np.concatenate([plain[..., :3], lengths], axis=-1), 2)[..., :3], rtol=1e-4)
    assert np.array_equal(soft[..., 3], plain[..., 3]) and np.ptp(plain[..., 3]) > 1


@pytest.mark.slow
def test_without_a_light_steps_see_as_much_of_the_density() -> None:
    exact, steps = (march_of([], air(steps=steps, ambient=(0.1, 0.1, 0.1), **NOISY)) for steps in ("exact", 64))
    for found, truth in zip(steps[:2], exact[:2], strict=True):
        np.testing.assert_allclose(found, truth, rtol=0.1)
    own = [(dataclasses.replace(CASES["spot"][0], density=2.0), None)]
    first = march_of(own, air(steps=64, ambient=(0.1, 0.1, 0.1), **NOISY))
    np.testing.assert_allclose(first[1], steps[1], rtol=1e-3)
