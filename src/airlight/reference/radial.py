"""Sum radially in float64, straight from the equations: the truth for tests, documents and benchmarks. Slow on purpose.

Images are (H, W, C) arrays; positions are normalised, (0, 0) the top-left corner and pixel centres at (i + 1/2)/W.
Every sum takes `points`, (P, 2) positions; without it, it is evaluated at all pixel centres. At 1920 x 1080 use a
random subset of them: 20,000 points at 3,000 taps take some ten seconds.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any

import msgspec
import numpy as np
import numpy.typing as npt

from airlight.errors import AirlightError
from airlight.lights import ImageLight
from airlight.lights.around import around_table
from airlight.occlusion.automatic import check
from airlight.options import Parameters
from airlight.reference.around import around_factor, around_span
from airlight.reference.colour import REC709
from airlight.scatter.methods import METHODS

Array = npt.NDArray[np.floating[Any]]
FLOAT16_MAX = 65504.0  # what the GPU's rgba16float source can hold
KEPT = 0.25  # of the occluders' contrast, with occlusion contrast
_CHUNK = 1 << 17  # samples at a time: the working set stays in the cache


def pixel_centres(width: int, height: int) -> Array:
    """List the normalised (x, y) of every pixel centre: (height, width, 2)."""
    x, y = np.meshgrid((np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height)
    return np.stack([x, y], axis=-1)


def _sampler(image: Array, border: str) -> Callable[[Array, Array], Array]:
    """Make a bilinear sampler of (H, W, C); the ring of texels beyond the border is padded once, positions beyond it clamp to it."""
    if border not in ("clamp", "black"):
        raise AirlightError(f"border = {border!r}: use clamp or black")
    height, width, channels = image.shape
    padded = np.pad(image, ((1, 1), (1, 1), (0, 0)), mode="edge" if border == "clamp" else "constant")
    texels = np.ascontiguousarray(padded).reshape(-1, channels)
    stride = width + 2

    def sample(x: Array, y: Array) -> Array:
        u = np.clip(x * width + 0.5, 0, width + 1)  # texel centres at whole numbers; the ring is 0 and width + 1
        v = np.clip(y * height + 0.5, 0, height + 1)
        i = np.minimum(u.astype(np.int64), width)
        j = np.minimum(v.astype(np.int64), height)
        fx = (u - i)[..., None].astype(image.dtype, copy=False)
        fy = (v - j)[..., None].astype(image.dtype, copy=False)
        at = j * stride + i
        top = texels[at] * (1 - fx) + texels[at + 1] * fx
        bottom = texels[at + stride] * (1 - fx) + texels[at + stride + 1] * fx
        return top * (1 - fy) + bottom * fy

    return sample


def bilinear(image: Array, x: Any, y: Any, border: str = "clamp") -> Array:
    """Sample image (H, W, C) bilinearly at normalised x, y of any shape: shape + (C,).

    border: clamp (GPU clamp-to-edge) or black (texels outside are zero, so the border fades over its last half pixel).
    """
    return _sampler(image, border)(np.asarray(x, np.float64), np.asarray(y, np.float64))


def _march(
    image: Array,
    light: Sequence[float],
    points: Array | None,
    shifts: Array,
    weights: Array,
    offset: Any,
    step: float,
    border: str,
    dtype: Any,
) -> Array:
    """Compute sum_i weights[i] I(x - (shifts[i] + offset) step (x - l)) for every point; offset a number or one per point."""
    height, width, channels = image.shape
    sample = _sampler(np.asarray(image, dtype), border)
    grid = pixel_centres(width, height) if points is None else np.asarray(points, np.float64)
    flat = grid.reshape(-1, 2)
    offsets = np.broadcast_to(np.asarray(offset, np.float64).reshape(-1), (len(flat),))
    out = np.zeros((len(flat), channels))
    rows = max(1, min(len(flat), _CHUNK // 64))
    taps = max(1, _CHUNK // rows)
    for p in range(0, len(flat), rows):
        here, o = flat[p : p + rows], offsets[p : p + rows, None]
        toward = here - np.asarray(light, np.float64)
        for t in range(0, len(shifts), taps):
            s = (shifts[t : t + taps] + o) * step
            values = sample(here[:, :1] - s * toward[:, :1], here[:, 1:] - s * toward[:, 1:])
            out[p : p + rows] += np.einsum("ptc,t->pc", values, weights[t : t + taps])
    return out.reshape(*grid.shape[:-1], channels)


def direct_sum(
    image: Array,
    light: Sequence[float],
    *,
    samples: int,
    density: float,
    decay: float,
    weight: float = 1.0,
    exposure: float = 1.0,
    normalization: str = "mean",
    jitter: Any = "fixed",
    border: str = "clamp",
    points: Array | None = None,
    dtype: Any = np.float64,
) -> Array:
    """Sum n samples, (H, W, C) or, with points (P, 2), (P, C). GPU Gems 3, ch. 13.

    mean     exposure weight / n  sum_{i<n} decay^(i+o) I(x - (i+o) (x - l) density / n)      Eq. 4, at o = 0
    listing  exposure (I(x) + weight sum_{i<n} decay^i I(x - (i+1+o) (x - l) density / n))    Listing 13-1, at o = 0

    jitter: fixed (o = 0), midpoint (o = 1/2: a true midpoint rule of `converged`) or o per point, in [0, 1).
    """
    named = {"fixed": 0.0, "midpoint": 0.5}
    if isinstance(jitter, str) and jitter not in named:
        raise AirlightError(f"jitter = {jitter!r}: the reference takes fixed, midpoint or an array of offsets")
    offset = np.asarray(named[jitter] if isinstance(jitter, str) else jitter, np.float64)
    i = np.arange(samples, dtype=np.float64)
    step = density / samples
    if normalization == "mean":
        total = _march(image, light, points, i, decay**i, offset, step, border, dtype)
        per_point = decay ** (offset if offset.ndim == 0 else offset.reshape(total.shape[:-1])[..., None])
        return exposure * weight / samples * per_point * total
    if normalization == "listing":
        total = _march(image, light, points, i + 1, decay**i, offset, step, border, dtype)
        return exposure * (at_points(image, points, border) + weight * total)
    raise AirlightError(f"normalization = {normalization!r}: use mean or listing")


def at_points(image: Array, points: Array | None, border: str) -> Array:
    """Sample I(x) at the points, or give the image itself."""
    return image if points is None else bilinear(image, points[..., 0], points[..., 1], border)


def enough_taps(shape: tuple[int, ...], light: Sequence[float], density: float) -> int:
    """Choose the taps of `converged`: at least 3,000 and four a pixel of the longest ray."""
    height, width = shape[:2]
    longest = max(math.hypot((x - light[0]) * width, (y - light[1]) * height) for x in (0, 1) for y in (0, 1))
    return max(3000, 4 * math.ceil(min(density * longest, 1e4)))  # of a longer ray nearly all taps lie outside


def converged(
    image: Array,
    light: Sequence[float],
    *,
    density: float,
    lam: float,
    border: str = "clamp",
    taps: int | None = None,
    points: Array | None = None,
    dtype: Any = np.float64,
) -> Array:
    """Integrate S(x) = int_0^1 e^(-lam s) I(x - density s (x - l)) ds by the midpoint rule: (H, W, C), or (P, C) with points.

    The limit of Eq. 4 for n to infinity at lam = -n ln(decay), without weight and exposure. density in (0, 16], lam >= 0.
    dtype float32 halves the cost of gathering; the sum stays float64.
    """
    n = taps or enough_taps(image.shape, light, density)
    s = (np.arange(n) + 0.5) / n
    return _march(image, light, points, s, np.exp(-lam * s) / n, 0.0, density, border, dtype)


def convergence_error(image: Array, light: Sequence[float], *, taps: int | None = None, **arguments: Any) -> float:
    """Bound the reference's own error: rmse over mean between `converged` with `taps` and with half of them, an upper estimate."""
    n = taps or enough_taps(image.shape, light, arguments["density"])
    fine = converged(image, light, taps=n, **arguments)
    coarse = converged(image, light, taps=max(1, n // 2), **arguments)
    mean = float(np.mean(np.abs(fine)))
    return float(np.sqrt(np.mean((fine - coarse) ** 2))) / mean if mean else 0.0


def soft_threshold(low: float, high: float, x: Array) -> Array:
    """Rise from 0 at low to 1 at high by 3t^2 - 2t^3; a step at low (>=) where the two agree."""
    if high <= low:
        return (x >= low).astype(np.float64)
    t = np.clip((x - low) / (high - low), 0.0, 1.0)
    return t * t * (3.0 - 2.0 * t)


def picture_luminance(c: Array, weights: Any = REC709) -> Array:
    """Weigh a picture's linear RGB (..., 3) to luminance (...), by the weights of its colour space."""
    return np.asarray(c @ np.asarray(weights))


def finite(image: Array) -> Array:
    """Limit the image to what a source may hold: negative and non-finite values are 0, the rest at most 65504."""
    image = np.asarray(image, np.float64)
    return np.where(np.isfinite(image), np.clip(np.nan_to_num(image), 0.0, FLOAT16_MAX), 0.0)


def mask(image: Array, alpha: Any, depth: Any, parameters: Parameters, luminance: Any = REC709) -> Array:
    """Find m in [0, 1], (H, W): 1 where light is emitted.

    luminance, contrast: smoothstep(threshold -+ smoothness) of the luminance of image (H, W, 3), linear, by these weights;
    alpha: 1 - alpha; depth: the same smoothstep of depth, (H, W) with 1 = far; none: 1. Raises AirlightError where alpha or depth is
    missing.
    """
    check(parameters, alpha is not None, depth is not None)
    low, high = parameters.knee
    if parameters.occlusion in ("luminance", "contrast"):
        return soft_threshold(low, high, picture_luminance(finite(image), luminance))
    if parameters.occlusion == "alpha":
        return 1.0 - np.clip(finite(alpha), 0.0, 1.0)
    if parameters.occlusion == "depth":
        return soft_threshold(low, high, finite(depth))
    return np.ones(image.shape[:2])


def source(
    image: Array,
    parameters: Parameters,
    *,
    alpha: Array | None = None,
    depth: Array | None = None,
    user_mask: Array | None = None,
    luminance: Any = REC709,
) -> Array:
    """Compute what is summed, I m, (H, W, 3); for alpha the light's own colour is emitted, so 1 m. user_mask (H, W) multiplies m.

    contrast (13.5.3): I m + (1 - m) (C + (I - C) / 4), C the mean colour of what does not emit, weighted by 1 - m.
    """
    m = mask(image, alpha, depth, parameters, luminance)
    if user_mask is not None:
        m = m * np.clip(finite(user_mask), 0.0, 1.0)
    if METHODS[parameters.method].stencilled:  # a stencil draws a pixel or does not (13.5.2)
        m = np.where(m >= 0.5, 1.0, 0.0)
    emitted = np.ones(3) if parameters.occlusion == "alpha" else finite(image)
    if parameters.occlusion == "contrast":
        occluder = 1 - m[..., None]
        mean = (occluder * emitted).sum(axis=(0, 1)) / max(occluder.sum(), 1e-6)
        return m[..., None] * emitted + occluder * (mean + KEPT * (emitted - mean))
    return m[..., None] * emitted


def layer(
    image: Array,
    lights: Sequence[ImageLight],
    parameters: Parameters,
    *,
    alpha: Array | None = None,
    depth: Array | None = None,
    user_mask: Array | None = None,
    offsets: Array | None = None,
    taps: int | None = None,
    points: Array | None = None,
    dtype: Any = np.float64,
    luminance: Any = REC709,
) -> Array:
    """Compute what `airlight.light_shafts` returns, in float64: (H, W, 3), or (P, 3) with points. image (H, W, 3), linear.

    epipolar: exposure weight S, or for listing its limit exposure (I + weight lam / (1 - decay) S); radial: `direct_sum`,
    at full resolution whatever `scale` says. offsets: one per point, needed where jitter is gradient or blue.
    """
    p = parameters
    emitted = source(image, p, alpha=alpha, depth=depth, user_mask=user_mask, luminance=luminance)
    height, width = emitted.shape[:2]
    total: Any = 0.0
    for light in lights:
        at, density = light.placed(width, height, p.density)
        own = msgspec.structs.replace(p, density=density)
        one = summed(emitted, at, own, offsets=offsets, taps=taps, points=points, dtype=dtype)
        if (table := around_table(light.cookie)) is not None:
            where = pixel_centres(width, height) if points is None else points
            one = one * around_factor(table, around_span((np.asarray(where, np.float64) - at) * (width, height)))
        total = total + one * np.asarray(light.rgb)
    return np.asarray(total)


def summed(
    emitted: Array,
    at: Sequence[float],
    p: Parameters,
    *,
    offsets: Array | None = None,
    taps: int | None = None,
    points: Array | None = None,
    dtype: Any = np.float64,
) -> Array:
    """Sum the layer of one white light at a position, of what is emitted, (H, W, C), by the method of p. Arguments as `layer`."""
    one: Array = METHODS[p.method].reference(emitted, at, p, offsets=offsets, taps=taps, points=points, dtype=dtype)
    return one


def direct(
    emitted: Array, at: Sequence[float], p: Parameters, *, offsets: Any = None, points: Any = None, dtype: Any = np.float64, **_: Any
) -> Array:
    """Sum the samples of Eq. 4, or of Listing 13-1, as `summed`."""
    if offsets is None and p.offset in ("gradient", "blue"):
        raise AirlightError(f"the reference needs the offsets of jitter {p.offset}")
    return direct_sum(
        emitted,
        at,
        samples=p.samples,
        density=p.density,
        decay=p.decay,
        weight=p.weight,
        exposure=p.exposure,
        normalization=p.normalization,
        jitter=p.offset if offsets is None else offsets,
        border=p.border,
        points=points,
        dtype=dtype,
    )


def limit(
    emitted: Array, at: Sequence[float], p: Parameters, *, taps: Any = None, points: Any = None, dtype: Any = np.float64, **_: Any
) -> Array:
    """Integrate along the ray what `direct` converges to, as `summed`."""
    one = converged(emitted, at, density=p.density, lam=p.lam, border=p.border, taps=taps, points=points, dtype=dtype)
    if p.normalization == "listing":
        terms = p.samples if p.decay == 1 else p.lam / (1 - p.decay)  # -> n as decay -> 1
        return np.asarray(p.exposure * (at_points(emitted, points, p.border) + p.weight * terms * one))
    return np.asarray(p.exposure * p.weight * one)


def occlusion_fraction(
    m: Array,
    light: Sequence[float],
    *,
    density: float,
    samples: int | None = None,
    jitter: Any = "fixed",
    border: str = "clamp",
    points: Array | None = None,
) -> Array:
    """Compute D(phi) = 1 - mean of m (H, W) over the samples of the sum, without decay or weight: (H, W) or (P,), in [0, 1].

    samples None: the converged mean. With border black, samples outside the image count as occluded.
    """
    if samples is None:
        mean = converged(m[..., None], light, density=density, lam=0.0, border=border, points=points)
    else:
        mean = direct_sum(m[..., None], light, samples=samples, density=density, decay=1.0, jitter=jitter, border=border, points=points)
    return 1.0 - mean[..., 0]
