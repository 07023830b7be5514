"""Fits the logarithm of the mean of e^(a n), n gradient noise, by a polynomial of a^2: the numbers of medium/noise.wgsl."""

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from test_noise import mean_exponential

DEGREE = 5
LARGEST = 8.0


def fitted(rounds: int = 3000) -> tuple[np.ndarray, float]:
    """Weighs the largest errors more and more (Lawson's method), which comes near the least greatest error."""
    a = np.linspace(0.02, LARGEST, 400)
    truth, x = np.log([mean_exponential(v) for v in a]), (a / LARGEST) ** 2
    powers, weight = np.stack([x**i for i in range(1, DEGREE + 2)], axis=1), np.ones_like(x)
    for _ in range(rounds):
        found = np.linalg.lstsq(powers * np.sqrt(weight)[:, None], truth * np.sqrt(weight), rcond=None)[0]
        error = np.abs(powers @ found - truth)
        weight *= error / (weight * error).sum()
    return found / LARGEST ** (2 * np.arange(1, DEGREE + 2)), float(error.max())


if __name__ == "__main__":
    terms, error = fitted()
    print("\n".join(f"{term:.6e}" for term in terms), f"to {error:.1e}", sep="\n")
