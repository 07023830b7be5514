"""The weight of the converged sum as a short mixture of powers, and the steps of its moments. Host side, float64.

On a ray, with x = q/r the sample's distance from the light over the pixel's and a = lambda/D, the weight is
e^(-a(1-x)) = sum_k Poisson(k; a) x^k: a positive mixture of powers. Few real exponents do as well as many
integer ones, and the normalised moments

    A_p(r) = 1/r int_0^r (q/r)^p I(q) dq

obey a recurrence whose factors all lie in [0, 1]: nothing overflows or cancels in f32, for any D and lambda.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
MAX_BEYOND = 5  # powers that the shader keeps for what lies beyond the light; 3 for the near side
NEGLIGIBLE = 1e-5  # weight of the far end of the ray below which it is left out


@dataclass(frozen=True)
class Mixture:
    """Fits the weight by powers: S(r) = sum_j c_j [A_pj(r) - before_j A_pj(ratio r)] + sum_j beyond_c_j B_beyond_pj(ratio r).

    A: moments on the pixel's own side of the light, of which for D < 1 the part nearer than r (1 - D) is taken away.
    B: moments on the opposite side, D > 1.
    """

    p: Array
    c: Array
    before: Array  # (len(p)); zeros where nothing is taken away
    beyond_p: Array
    beyond_c: Array
    ratio: float  # |1 - D|: of the distance of the ray's far end over the pixel's; 0 where the far end does not count

    @property
    def opposite(self) -> bool:
        return len(self.beyond_p) > 0


def _fit(target: Callable[[Array], Array], low: float, start: Array, steps: int = 60) -> tuple[Array, Array, float]:
    """Fit sum_j c_j x^p_j to target on [low, 1], p >= 0; Levenberg steps on p alone, c by least squares. -> p, c, relative rms."""
    angle = np.pi * (np.arange(192) + 0.5) / 192
    x = low + (1 - low) * (0.5 - 0.5 * np.cos(angle))
    # even in log x, and a little stricter where the weight is small: the brightest samples lie near the light
    measure = np.sqrt(np.sin(angle) / x) * np.maximum(target(x), 1e-4) ** -0.25
    wanted, logx = target(x) * measure, np.log(x)

    def solve(root: Array) -> tuple[Array, Array, Array]:
        powers = np.exp(np.outer(logx, root * root)) * measure[:, None]
        c = np.linalg.lstsq(powers, wanted, rcond=1e-13)[0]
        return powers, c, powers @ c - wanted

    root, damping = np.sqrt(start), 1e-2
    powers, c, error = solve(root)
    for _ in range(steps):
        jacobian = powers * c * logx[:, None] * 2 * root
        basis = np.linalg.qr(powers)[0]
        jacobian = jacobian - basis @ (basis.T @ jacobian)
        normal = jacobian.T @ jacobian
        move = np.linalg.solve(normal + damping * np.diag(np.diag(normal) + 1e-15), -jacobian.T @ error)
        trial = solve(root + move)
        if trial[2] @ trial[2] < error @ error:
            root, (powers, c, error), damping = root + move, trial, damping * 0.2
        else:
            damping *= 5
        if damping > 1e9:
            break
    return root * root, c, float(np.sqrt(error @ error / (wanted @ wanted)))


def _charlier(a: float, count: int) -> Array:
    """Find the Gauss nodes of the Poisson distribution of mean a."""
    k = np.arange(count, dtype=float)
    off = np.sqrt(a * k[1:])
    return np.maximum(np.linalg.eigvalsh(np.diag(a + k) + np.diag(off, 1) + np.diag(off, -1)), 1e-2)


def _shortest(target: Callable[[Array], Array], low: float, start: Callable[[int], Array], tolerance: float) -> tuple[Array, Array]:
    """Fit the fewest powers (at most 3, what the shader keeps) that meet the tolerance."""
    best = (np.zeros(1), np.ones(1), np.inf)
    for count in (1, 2, 3):
        for spread in (1.0, 0.6, 0.35):  # Levenberg steps find the nearest minimum only
            found = _fit(target, low, spread * start(count))
            if found[2] < best[2] and np.abs(found[1]).max() < 100:
                best = found
            if best[2] <= tolerance:
                break
        if best[2] <= tolerance:
            break
    return best[0], best[1]


def _polynomial(b: float, tolerance: float) -> tuple[Array, Array]:
    """Fit whole powers to e^(-b y) on [0, 1]: it falls with y, and must be right at y = 0, where the light is."""
    y = 0.5 - 0.5 * np.cos(np.pi * np.arange(129) / 128)
    for count in range(1, MAX_BEYOND + 1):
        powers = y[:, None] ** np.arange(count)
        c = np.linalg.lstsq(powers, np.exp(-b * y), rcond=None)[0]
        if np.abs(powers @ c - np.exp(-b * y)).max() <= tolerance:
            break
    return np.arange(count, dtype=float), np.asarray(c, float)


@lru_cache(maxsize=256)
def mixture(density: float, lam: float, tolerance: float = 6e-4) -> Mixture:
    """Find the mixture for S = int_0^1 e^(-lam s) I(x - D s (x - l)) ds; density > 0, lam >= 0.

    tolerance: relative rms of the weight's fit; fewer powers are cheaper.
    """
    a = lam / density
    if lam == 0:
        p, c = np.zeros(1), np.ones(1)
    else:
        p, c = _shortest(lambda x: np.exp(-a * (1 - x)), max(1 - density, 1e-3), lambda k: _charlier(a, k), tolerance)
    none = np.zeros(0)
    if density < 1 and np.exp(-lam) >= NEGLIGIBLE:
        return Mixture(p, c / density, (1 - density) ** (p + 1), none, none, 1 - density)
    if density > 1 and np.exp(-a) >= NEGLIGIBLE:
        beyond = np.exp(-a) * (density - 1) / density  # weight where the ray passes the light
        b = a * (density - 1)
        if lam == 0:
            return Mixture(p, c / density, 0 * p, np.zeros(1), np.full(1, beyond), density - 1)
        beyond_p, beyond_c = _polynomial(b, tolerance / max(beyond, tolerance))
        return Mixture(p, c / density, 0 * p, beyond_p, beyond_c * beyond, density - 1)
    return Mixture(p, c / density, 0 * p, none, none, 0.0)


def step_weights(p: Array, u: Array) -> tuple[Array, Array, Array]:
    """Compute g, k1, k2 of A_p(b) = g A_p(a) + k1 I1 + k2 I2 from each node a to the next b, with I = I1 on the nearer half of the step and
    I2 on the other. Shapes (len(p), len(u) - 1)."""
    a, b = u[:-1], u[1:]
    q = p[:, None] + 1
    ra, rm = (_over(x, b)[None, :] ** q for x in (a, 0.5 * (a + b)))
    return ra, (rm - ra) / q, (1 - rm) / q


def end_weights(p: Array, u: Array, start: float) -> Array:
    """Compute k of A_p(b) = g A_p(a) + k I, with nothing nearer than start. Shape (len(p), len(u) - 1)."""
    a, b = u[:-1], u[1:]
    q = p[:, None] + 1
    return (1 - np.minimum(_over(np.maximum(a, start), b), 1.0)[None, :] ** q) / q


def _over(a: Array, b: Array) -> Array:
    return np.divide(a, b, out=np.ones_like(b), where=b > 0)
