"""The log-n multipass in float64: three passes of eight taps do the work of 512."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from airlight.options import Parameters
from airlight.reference.radial import Array, at_points, bilinear, pixel_centres
from airlight.scatter.epipolar.moments import mixture
from airlight.scatter.methods import check_ray
from airlight.scatter.multipass.multipass import FIT_TOLERANCE, NEAREST_TAP_SHARE, PASSES, TAPS


def _pass(image: Array, at: Sequence[float], shifts: Array, weights: Array, border: str) -> Array:
    """Sum sum_k weights_k I(x - shifts_k (x - l)) at all pixel centres."""
    centres = pixel_centres(image.shape[1], image.shape[0])
    out = np.zeros_like(image)
    for shift, weight in zip(shifts, weights, strict=True):
        x = centres - shift * (centres - np.asarray(at))
        out += weight * bilinear(image, x[..., 0], x[..., 1], border)
    return out


def multipass(emitted: Array, at: Any, *, density: float, lam: float, border: str = "clamp") -> Array:
    """Sum in geometric steps x -> l + gamma (x - l): S(x) of `converged`, density <= 1: (H, W, C).

    With u = q/r and the weight as powers c u^p (moments.py), S = sum c int_{1-D}^1 u^p I(l + u (x - l)) du. At u = gamma^(k + 1/2) the
    weights are gamma^(k (p+1)): steps and weights of eight taps, then of eight times, then of 64 times the step multiply to all 512.
    For border black the passes hold a texel of border, which the source has dark; where clamp meets positions outside the image, between
    passes, it is not exact.
    """
    if border == "black":
        wide = np.pad(emitted, ((1, 1), (1, 1), (0, 0)))
        sides = np.array(emitted.shape[1::-1])
        return multipass(wide, (np.array(at) * sides + 1) / (sides + 2), density=density, lam=lam)[1:-1, 1:-1]
    mix = mixture(density, lam, FIT_TOLERANCE)
    low = max(1 - density, NEAREST_TAP_SHARE)
    log_gamma = (np.log1p(-density) if 1 - density >= NEAREST_TAP_SHARE else np.log(NEAREST_TAP_SHARE)) / TAPS**PASSES
    total = np.zeros_like(emitted)
    for p, c in zip(mix.p, mix.c, strict=True):
        image = emitted
        for stage in range(PASSES):
            k = np.arange(TAPS) * TAPS**stage
            weights = np.exp(k * (p + 1) * log_gamma)
            shifts = -np.expm1((k + (0.5 if stage == 0 else 0.0)) * log_gamma)
            image = _pass(image, at, shifts, weights / weights.sum(), border)
        total += c * -np.expm1(TAPS**PASSES * (p + 1) * log_gamma) / (p + 1) * image
        if low > 1 - density:
            share = c * (low ** (p + 1) - (1 - density) ** (p + 1)) / (p + 1)
            total += share * _pass(emitted, at, np.array([1 - (low + 1 - density) / 2]), np.ones(1), border)
    return total


def arithmetic(emitted: Array, at: Sequence[float], *, density: float, lam: float, border: str = "clamp") -> Array:
    """Sum in equal steps, the common form, for comparison. Its passes do not multiply to a sum along the ray, so it is not exact."""
    image, scale = emitted, -np.expm1(-lam) / lam if lam else 1.0
    for stage in range(PASSES):
        s = (np.arange(TAPS) + (0.5 if stage == 0 else 0.0)) * TAPS**stage / TAPS**PASSES
        weights = np.exp(-lam * s)
        image = _pass(image, at, density * s, weights / weights.sum(), border)
    return scale * image


def reference(emitted: Array, at: Sequence[float], p: Parameters, *, points: Any = None, **_: Any) -> Array:
    """Give the layer of one white light, as `reference.radial.summed`. Raises AirlightError for a ray that passes the light."""
    check_ray(p.method, p.density)
    return at_points(p.exposure * p.weight * multipass(emitted, at, density=p.density, lam=p.lam, border=p.border), points, p.border)
