"""The concentric rectangular bands of 13.8 in float64: from ring to ring around the light, one new sample a pixel."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from airlight.options import Parameters
from airlight.reference.radial import Array, at_points, bilinear
from airlight.scatter.bands.bands import FIT_TOLERANCE, entering_taps
from airlight.scatter.epipolar.moments import mixture
from airlight.scatter.methods import check_ray


def state_index(odd: Any, side: Any, lane: Any, k: Any, lanes: int, powers: int) -> Any:
    """Index the shader's state [half, side, lane, power, RGB], flat, at red. odd: the half that odd rings write."""
    return np.ravel_multi_index((np.asarray(odd, int), side, lane, k, 0 * np.asarray(k)), (2, 4, lanes, powers, 3))


def bands(emitted: Array, at: Sequence[float], *, density: float, lam: float, border: str = "clamp") -> Array:
    """Sum from ring to ring: S(x) of `converged`, (H, W, C), density <= 1; for lam = 0, density = 1 S_c = ((c-1) S_{c-1} + I) / c.

    In general a ring keeps a moment M of the window for each power p of the weight (moments.py), at its far border c, which is the
    pixel's distance along the longer axis and a half: M(c) = g M(c - 1) + k (I(x) - (1-D)^(p+1) I(far end of the ray)),
    g = (1 - 1/c)^(p+1), k = (1 - g) / ((p+1) D). M(c - 1) lies between two pixels of the nearer ring. A pixel's own sum takes the
    half of that step. Where a ray enters the image M is the direct sum.
    """
    height, width, channels = emitted.shape
    size, mix = (width, height), mixture(density, lam, FIT_TOLERANCE)
    light = np.array([at[0] * width, at[1] * height])
    home = np.floor(light).astype(np.int64)
    q = mix.p + 1
    taps = entering_taps(size, (light[0], light[1]), density)
    s = (np.arange(taps) + 0.5) / taps
    enters = np.exp(mix.p[:, None] * np.log1p(-density * s)) / len(s)
    total = np.zeros_like(emitted)

    def sample(x: Array) -> Array:
        return bilinear(emitted, x[..., 0] / width, x[..., 1] / height, border)

    for axis in (0, 1):
        for sign in (1, -1):
            length = size[1 - axis]
            lane = np.arange(length)
            last = size[axis] - 1 - home[axis] if sign > 0 else home[axis]
            first = max(0, -home[axis] if sign > 0 else home[axis] - size[axis] + 1)
            state = np.zeros((len(q), length, channels))
            for ring in range(first, last + 1):
                major = home[axis] + sign * ring
                u = max(ring + sign * (0.5 - (light[axis] - home[axis])), 0.5 + 1e-9)  # less only on the light's own pixel
                away = np.abs(lane - home[1 - axis])
                on = np.flatnonzero(away <= ring)
                if not len(on):
                    continue
                x = np.empty((len(on), 2))
                x[:, axis], x[:, 1 - axis] = major + 0.5, on + 0.5
                own = emitted[on, major] if axis == 0 else emitted[major, on]
                if ring == 0:
                    m = middle = (1 - mix.before)[:, None, None] / q[:, None, None] / density * own
                else:
                    position = on - (on + 0.5 - light[1 - axis]) / u
                    entering = (position < 0) | (position > length - 1) | (ring == first)
                    position = np.clip(position, home[1 - axis] - ring + 1, home[1 - axis] + ring - 1)
                    position = np.clip(position, 0, length - 1)
                    low = np.minimum(position.astype(np.int64), max(length - 2, 0))
                    part = (position - low)[:, None]
                    before = state[:, low] * (1 - part) + state[:, np.minimum(low + 1, length - 1)] * part
                    far = sample(x - density * (x - light)) if mix.ratio else 0 * own
                    new = own - mix.before[:, None, None] * far
                    # to the far border of the pixel's band for the next ring, to its middle for the pixel
                    m, middle = (
                        np.exp(q * log)[:, None, None] * before - (np.expm1(q * log) / q / density)[:, None, None] * new
                        for log in (np.log1p(-1 / (u + 0.5)), np.log1p(-0.5 / u))
                    )
                    if entering.any():
                        rays = x[entering, None] - density * s[None, :, None] * (x[entering, None] - light)
                        m[:, entering] = middle[:, entering] = np.einsum("ntc,pt->pnc", sample(rays), enters)
                state = np.zeros_like(state)
                state[:, on] = m
                ours = (away[on] <= ring) if axis == 0 else (away[on] < ring)
                if ring == 0 and (axis, sign) != (0, 1):
                    ours[:] = False
                result = density * np.tensordot(mix.c, middle, axes=1)
                if axis == 0:
                    total[on[ours], major] = result[ours]
                else:
                    total[major, on[ours]] = result[ours]
    return np.maximum(total, 0)  # what is taken away was not spread sideways as it came


def reference(emitted: Array, at: Sequence[float], p: Parameters, *, points: Any = None, **_: Any) -> Array:
    """Give the layer of one white light, as `reference.radial.summed`. Raises AirlightError for a ray that passes the light."""
    check_ray(p.method, p.density)
    return at_points(p.exposure * p.weight * bands(emitted, at, density=p.density, lam=p.lam, border=p.border), points, p.border)
