"""Evaluates the density of a medium that varies by noise, in float64: twins of medium/noise.wgsl.

noise: a record of struct Noise, or a mapping of its members (medium/noise.py:noise_record).
"""

from typing import Any

import numpy as np
import numpy.typing as npt

from airlight.medium.noise import PERIOD

Array = npt.NDArray[Any]
APART = 0.25  # cells of an octave, from its lattice to that of the one before
FAR = 1e30  # m, the wavelength of what does not vary
OCTAVE_SEED = 0x9E3779B9
PRIMES = np.array((0x8DA6B343, 0xD8163841, 0xCB1AB31F), np.uint32)
LOG_MEAN = (3.645906e-2, -1.0170715e-4, 6.788781e-7, -4.975845e-9, 2.929922e-11, -8.961888e-14)  # of a^2, a^4, ...


def noise_density(place: Any, footprint: Any, noise: Any) -> Array:
    """Evaluates (...) the density at places (..., 3), averaged over footprints (...), m.

    place: m along the world's axes from the record's origin.
    """
    at = np.asarray(place, float) * float(noise["frequency"]) + np.asarray(noise["offset"], float)
    low = np.floor(at)
    inside, cell = at - low, np.asarray(noise["cell"], np.int64) + low.astype(np.int64)
    waves = 1 / np.maximum(np.asarray(footprint, float) * float(noise["frequency"]), 1e-30)
    exponent, amplitude = np.zeros(at.shape[:-1]), float(noise["amplitude"])
    for octave in range(int(noise["octaves"])):
        t = np.clip((waves - 2) / 2, 0, 1)
        own = amplitude * t * t * (3 - 2 * t)
        seed = (int(noise["seed"]) + octave * OCTAVE_SEED) % 2**32
        exponent = exponent + own * gradient_noise(cell, inside, (PERIOD << octave) - 1, seed) - log_mean_exponential(own)
        following = 2 * inside + APART
        low = np.floor(following)
        inside, cell = following - low, 2 * cell + low.astype(np.int64)
        amplitude, waves = amplitude / 2, waves / 2
    return np.asarray(np.exp(exponent))


def noise_wavelength(footprint: Any, noise: Any) -> Array:
    """Finds (...) the shortest wavelength, m, that noise has left over footprints (...), m; FAR where there is none."""
    lengths = 0.5 ** np.arange(int(noise["octaves"])) / float(noise["frequency"])
    left = lengths > 2 * np.asarray(footprint, float)[..., None]
    if noise["amplitude"] == 0:
        left = np.zeros_like(left)
    return np.asarray(np.where(left, lengths, FAR).min(axis=-1))


def gradient_noise(cell: Any, inside: Any, mask: Any, seed: Any) -> Array:
    """Evaluates (...) gradient noise inside cells (..., 3) of a lattice, at coordinates (..., 3) from 0 to 1. Perlin 2002.

    mask: the cells after which it repeats, less 1.
    """
    cell, inside = np.asarray(cell, np.int64), np.asarray(inside, float)
    fade = inside * inside * inside * (inside * (inside * 6 - 15) + 10)
    mask, ends = np.asarray(mask, np.int64)[..., None], inside - 1
    keys = [((cell + k) & mask).astype(np.uint32) * PRIMES for k in (0, 1)]
    found = []
    for x, y, z in np.ndindex(2, 2, 2):
        key = keys[x][..., 0] ^ keys[y][..., 1] ^ keys[z][..., 2] ^ np.asarray(seed, np.uint32)
        at = (inside, ends)
        found.append(along_gradient(key, (at[x][..., 0], at[y][..., 1], at[z][..., 2])))
    for axis in (2, 1, 0):  # the last of the pairs lie apart along z
        found = [a + fade[..., axis] * (b - a) for a, b in zip(found[::2], found[1::2], strict=True)]
    return np.asarray(found[0])


def along_gradient(key: Any, offset: Any) -> Array:
    """Multiplies offsets, three of (...), from lattice points by their gradients, each one of 12 that have a 0 and two of 1 or -1."""
    key, (x, y, z) = np.asarray(key, np.uint32), (np.asarray(v, float) for v in offset)
    with np.errstate(over="ignore"):  # of single numbers, which NumPy tells of
        hashed = (key ^ (key >> np.uint32(15))) * np.uint32(0x2C1B3C6D)
    third = np.asarray(hashed << np.uint32(2)).view(np.int32)
    return flipped(np.where(third < -715827883, y, x), hashed) + flipped(np.where(third > 715827882, y, z), hashed << np.uint32(1))


def flipped(value: Any, word: Any) -> Array:
    """Turns the sign of values (...) where a word's bit 31 is set."""
    return np.asarray(np.copysign(1.0, np.asarray(word, np.uint32).view(np.int32)) * value)


def log_mean_exponential(a: Any) -> Array:
    """Evaluates the logarithm of the mean of e^(a n), n gradient noise, for a from 0 to 8, by a polynomial."""
    x = np.asarray(a, float) ** 2
    return np.asarray(x * np.polynomial.polynomial.polyval(x, LOG_MEAN))
