"""Makes the record of a medium's noise, struct Noise of medium/noise.wgsl: where its lattice lies, in float64 until it is near the eye."""

from typing import Any

import numpy as np

PERIOD = 256  # cells of the largest octave after which noise repeats, as NOISE_PERIOD in the shader


def noise_record(origin: Any, wind: Any, time: float, size: float, seed: int, amount: float, octaves: int) -> dict[str, Any]:
    """Computes the members of a record: offset (3,), amplitude, cell (3,), octaves, frequency, seed.

    origin: (3,) world, m, of the places that the record is for. wind: (3,) m/s, moves the noise for `time`, s. size: of the largest
    octave's waves, m. amount: of all octaves together, in the exponent.
    """
    place = (np.asarray(origin, float) - np.asarray(wind, float) * time) / size
    cell = np.floor(place)
    gains = 2 - 0.5 ** (octaves - 1)
    return {
        "offset": place - cell,
        "amplitude": amount / gains,
        "cell": np.mod(cell, PERIOD).astype(np.int32),
        "octaves": octaves,
        "frequency": 1 / size,
        "seed": (seed * 0x85EBCA6B + 0x68E31DA4) % 2**32,
    }
