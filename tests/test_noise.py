"""Noise of a medium's density: its mean, its fading, its period, and the shader against the float64 twin."""

from itertools import product
from typing import Any

import numpy as np
import pytest
from calling import call

from airlight.gpu.structs import struct_dtype
from airlight.medium.noise import PERIOD, noise_record
from airlight.reference import noise

SHADER = "medium/noise.wgsl"
NOISE = struct_dtype(SHADER, "Noise")
RNG = np.random.default_rng(29)
COUNT = 2000


def record(amount: float = 3, octaves: int = 3, size: float = 1.0, seed: int = 0, **other: Any) -> Any:
    out = np.zeros((), NOISE)
    for name, value in noise_record(**{"origin": (0, 0, 0), "wind": (0, 0, 0), "time": 0.0} | other, size=size, seed=seed,
                                    amount=amount, octaves=octaves).items():
        out[name] = value
    return out


def mean_at(a: Any, inside: Any) -> Any:
    """The mean of e^(a n) over the gradients of a cell's corners, which are independent, at places inside it."""
    found = np.ones(np.broadcast_shapes(np.shape(a), inside.shape[:-1]))
    fade = inside**3 * (inside * (inside * 6 - 15) + 10)
    for corner in product((0, 1), repeat=3):
        weight = np.where(np.array(corner) == 1, fade, 1 - fade).prod(axis=-1)
        c = np.cosh(np.asarray(a * weight)[..., None] * (inside - corner))
        found = found * (c[..., 0] * c[..., 1] + c[..., 0] * c[..., 2] + c[..., 1] * c[..., 2]) / 3
    return found


def mean_exponential(a: float) -> float:
    """The mean of e^(a n) over a cell, by Gauss's rule on an eighth of it."""
    nodes, weights = np.polynomial.legendre.leggauss(20)
    inside = np.stack(np.meshgrid(*[(nodes + 1) / 4] * 3), axis=-1)
    return float(np.einsum("ijk,i,j,k", mean_at(a, inside), *[weights / 2] * 3))


def test_the_logarithm_of_the_mean_is_fitted() -> None:
    a = np.linspace(0, 8, 60)
    truth = np.log([mean_exponential(v) for v in a])
    np.testing.assert_allclose(noise.log_mean_exponential(a), truth, atol=1e-6)
    assert truth[-1] > 2


@pytest.mark.parametrize(("amount", "octaves"), [(8, 1), (8, 2), (8, 3), (4, 3), (1, 2)])
def test_octaves_together_have_a_mean_of_1(amount: float, octaves: int) -> None:
    """Over the places of a cell, which all octaves share."""
    own = record(amount, octaves)
    side = (np.arange(48) + 0.5) / 48
    inside = np.stack(np.meshgrid(side, side, side), axis=-1)
    found, a = np.ones(inside.shape[:-1]), float(own["amplitude"])
    for _ in range(octaves):
        found = found * mean_at(a, inside) / np.exp(noise.log_mean_exponential(a))
        inside, a = (2 * inside + noise.APART) % 1, a / 2
    assert abs(found.mean() - 1) < 1e-5
    assert octaves == 1 or found.std() > 0.01 * amount / 8


@pytest.mark.parametrize(("amount", "octaves", "footprint"), [(1, 1, 0), (4, 3, 0), (8, 3, 0), (4, 4, 0.1), (8, 2, 0.3)])
def test_a_large_part_has_a_mean_of_1(amount: float, octaves: int, footprint: float) -> None:
    """So the hash's gradients are as good as random: within 4 standard errors of as many cells as are looked at."""
    at = RNG.uniform(0, PERIOD, (150_000, 3))
    found = noise.noise_density(at, footprint, record(amount, octaves))
    assert abs(found.mean() - 1) < 4 * found.std() / np.sqrt(len(at))
    assert found.min() > 0 and found.std() > 0.1


def test_gradients_are_as_many_of_each_and_do_not_depend_on_each_other() -> None:
    """Frequencies of the 12, and the largest correlation with a neighbour at any distance, for several seeds."""
    side = 48
    i = np.stack(np.meshgrid(*[np.arange(side)] * 3, indexing="ij"), axis=-1)
    for seed in (0, 1, 77):
        own = record(seed=seed)
        key = i.astype(np.uint32) * noise.PRIMES
        key = key[..., 0] ^ key[..., 1] ^ key[..., 2] ^ own["seed"]
        gradient = np.stack([noise.along_gradient(key, np.eye(3)[k]) for k in range(3)], axis=-1)
        kinds, counts = np.unique(gradient.reshape(-1, 3), axis=0, return_counts=True)
        assert len(kinds) == 12 and set((np.abs(kinds)).sum(axis=1)) == {2}
        assert ((counts - side**3 / 12) ** 2).sum() / (side**3 / 12) < 31  # chi squared of 11: 0.1 %
        power = (np.abs(np.fft.fftn(gradient, axes=(0, 1, 2))) ** 2).sum(axis=-1)
        together = np.fft.ifftn(power).real / power.mean()
        assert np.abs(together.ravel()[1:]).max() * np.sqrt(3 * side**3) < 6


def test_noise_fades_before_it_aliases_and_stays_smooth() -> None:
    own, at = record(amount=4, octaves=3), RNG.uniform(0, 20, (COUNT, 3))
    spread = [noise.noise_density(at, footprint, own).std() for footprint in (0, 1 / 16, 0.1, 0.2, 0.4, 0.5)]
    assert spread[0] == spread[1] and (np.diff(spread[1:]) < 0).all() and spread[-1] == 0
    assert noise.noise_wavelength([0, 0.12, 0.13, 0.3, 0.6], own).tolist() == [0.25, 0.25, 0.5, 1, noise.FAR]
    step = noise.noise_density(at + [1e-6, 0, 0], 0, own) - noise.noise_density(at, 0, own)
    assert np.abs(step).max() < 1e-3


def test_wind_moves_noise_and_may_blow_for_ever() -> None:
    at = RNG.uniform(-3, 3, (COUNT, 3))
    still, own = record(), record(wind=(1, -2, 0.5), time=3.0)
    np.testing.assert_allclose(noise.noise_density(at + [3, -6, 1.5], 0, own), noise.noise_density(at, 0, still), rtol=2e-5)
    later = record(wind=(PERIOD, 0, 0), time=1e6)
    np.testing.assert_allclose(noise.noise_density(at, 0, later), noise.noise_density(at, 0, still), rtol=1e-9)
    np.testing.assert_allclose(noise.noise_density(at + [0, PERIOD, 0], 0, still), noise.noise_density(at, 0, still), rtol=1e-9)
    near = record(origin=(1e6 + 0.25, -2e6, 7.5))
    truth = noise_record((0, 0, 0), (0, 0, 0), 0, 1.0, 0, 3, 3)
    np.testing.assert_allclose(
        noise.noise_density(at, 0, near), noise.noise_density(at + [1e6 + 0.25, -2e6, 7.5], 0, truth), rtol=1e-6
    )
    assert np.corrcoef(noise.noise_density(at, 0, still), noise.noise_density(at, 0, record(seed=1)))[0, 1] < 0.1


def exact_places(size: int) -> np.ndarray:
    """Places at which float32 finds the very coordinates in their cells."""
    return (RNG.integers(-(2**20), 2**20, (COUNT, 3)) / 2**16 * size).astype(np.float32)


@pytest.mark.parametrize(("amount", "octaves"), [(2, 1), (2, 3), (8, 3), (8, 6)])
def test_noise_in_the_shader(amount: float, octaves: int) -> None:
    own = record(amount, octaves, size=2, seed=5, origin=(1000.5, -3.25, 7))
    at, footprint = exact_places(2), (RNG.uniform(0, 1.2, COUNT) ** 3).astype(np.float32)
    found = call(SHADER, "noise_density", [at, footprint, own])
    np.testing.assert_allclose(found, noise.noise_density(at, footprint, own), rtol=1e-5)
    found = call(SHADER, "noise_wavelength", [footprint, own])
    np.testing.assert_allclose(found, noise.noise_wavelength(footprint, own), rtol=1e-6)


def test_noise_in_the_shader_anywhere() -> None:
    """As near to the twin as float32 knows the place."""
    own = record(4, 3, size=0.37)
    at = RNG.uniform(-40, 40, (COUNT, 3)).astype(np.float32)
    apart = call(SHADER, "noise_density", [at, np.float32(0.01), own]) / noise.noise_density(at, 0.01, own) - 1
    assert np.abs(apart).max() < 1e-3 and np.sqrt((apart**2).mean()) < 1e-4


def test_parts_of_noise_in_the_shader() -> None:
    cell, inside = RNG.integers(-(2**20), 2**20, (COUNT, 3)).astype(np.int32), RNG.uniform(0, 1, (COUNT, 3)).astype(np.float32)
    key = RNG.integers(0, 2**32, COUNT, dtype=np.uint32)
    found = call(SHADER, "gradient_noise", [cell, inside, np.uint32(1023), key])
    np.testing.assert_allclose(found, noise.gradient_noise(cell, inside, 1023, key), atol=3e-6)
    found = call(SHADER, "along_gradient", [key, inside])
    np.testing.assert_allclose(found, noise.along_gradient(key, inside.T), atol=1e-6)
    np.testing.assert_array_equal(call(SHADER, "flipped", [inside[:, 0], key]), noise.flipped(inside[:, 0], key))
    a = RNG.uniform(0, 8, COUNT).astype(np.float32)
    np.testing.assert_allclose(call(SHADER, "log_mean_exponential", [a]), noise.log_mean_exponential(a), rtol=1e-6, atol=1e-9)
