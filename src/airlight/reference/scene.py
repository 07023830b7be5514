"""Evaluates the passes of rendered scenes in float64: twins of the functions of pygfx/*.wgsl and composite/*.wgsl, of the same names."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from airlight.composite.adapt import MIDDLE_GREY, Ramp
from airlight.reference.colour import REC709
from airlight.reference.radial import KEPT

Array = npt.NDArray[np.floating[Any]]
FACING = 8.0  # power of the cosine to the light with which fog thickens
LOWEST, BINS, COUNT = -17.0, 8, 256  # of the histogram of luminances: stops where it begins, bins a stop, bins


def axial(depth: Array, terms: Array) -> Array:
    """Find the distance along the view's axis. terms: projection.depth_terms."""
    a, b, c, d = terms
    return np.asarray((a * depth + b) / (c * depth + d))


def view_ray(uv: Array, rays: Array) -> Array:
    """Find the view ray (..., 3) of picture positions (..., 2), at -z = 1. rays: projection.pixel_rays."""
    xy = rays[:2] * uv + rays[2:]
    return np.concatenate([xy, -np.ones_like(xy[..., :1])], axis=-1)


def source(color: Array, depth: Array, factor: int, clear: Any = None, mean: Any = None) -> Array:
    """Compute S of a picture (H, W, 3) and its depth (H, W) at 1 / factor of its size, which factor divides.

    m is 1 where depth is 1. clear: (3,) instead of the picture there. mean: (3,) colour of the occluders, which are then in S too, with
    a quarter of their contrast.
    """
    m = (depth >= 1.0).astype(float)[..., None]
    seen = np.clip(color, 0, 65504) if clear is None else np.where(m > 0, clear, color)
    out = seen * m
    if mean is not None:
        out = out + (1 - m) * (np.asarray(mean) + KEPT * (seen - mean))
    height, width = depth.shape
    return np.asarray(out.reshape(height // factor, factor, width // factor, factor, 3).mean(axis=(1, 3)))


def sample_pixel(texel: Any, k: Any, taps: int, ratio: Any, pixels: Any) -> Array:
    """Find the pixel (..., 2) at the middle of part k of taps x taps of a texel (..., 2), row by row. ratio: pixels a texel, (2,); pixels:
    size of the picture."""
    k = np.asarray(k)
    middle = (np.stack([k % taps, k // taps], axis=-1) + 0.5) / taps
    return np.asarray(np.minimum(np.floor((np.asarray(texel) + middle) * ratio), np.asarray(pixels) - 1))


def look(color: Array, depth: Array, distance: Array) -> tuple[Array, float, float]:
    """Measure what contrast knows of a picture: (mean colour of the occluders, level of the fog, its distance).

    The level is the geometric mean luminance of what emits, with a fiftieth of the whole picture's, in case nothing does; the distance
    the geometric mean of the occluders'.
    """
    m = (depth >= 1.0).astype(float)
    logs = np.log(np.clip(color @ REC709, 1e-5, 1e5))
    weight = max((1 - m).sum(), 1e-6)
    mean = ((1 - m)[..., None] * color).sum(axis=(0, 1)) / weight
    level = np.exp(((logs * m).sum() + 0.02 * logs.sum()) / (m.sum() + 0.02 * m.size))
    away = np.where(m < 1, np.log(np.maximum(distance, 1e-20)), 0.0)
    return mean, float(level), float(np.exp(away.sum() / weight))


def gathered(added: Array, distance: Array, reach: float) -> Array:
    """Scale shafts (..., 3) before something at a distance (...): 1 - exp(-distance / reach) of them are gathered up to it."""
    return np.asarray(added * -np.expm1(-distance / reach)[..., None])


def through_medium(surface: Array, in_scattered: Array, transmittance: Any, mix: Any = 1.0) -> Array:
    """Attenuate a surface's radiance (..., 3) by the transmittance (..., 3) before it, or 1, and add a share of what is scattered there."""
    return np.asarray(surface * transmittance + mix * in_scattered)


def share_of_dimming(transmittance: Any, share: Any) -> Array:
    """Weaken the dimming of surfaces, of a transmittance (..., 3), to a share of it, which is artistic: 1 - share (1 - T)."""
    return np.asarray(1 - share * (1 - np.asarray(transmittance, float)))


def ramp_gain(luminance: Any, scale: Any, white: Any, share: Any) -> Array:
    """Evaluate a share of Reinhard's curve as a factor of a colour, from its luminance; whole, it is composite.adapt.Ramp.gain."""
    y = scale * np.maximum(luminance, 0)
    return np.asarray((scale * (1 + y / np.square(white)) / (1 + y)) ** share)


def lines(uv: Array, color: Array, view: Any) -> Array:
    """Draw every five degrees a line through each light, over (..., 3) the picture dimmed. view: composite.scene.UNIFORMS."""
    shown = 0.25 * np.asarray(color, float)
    ray, rays = view_ray(uv, view["rays"].astype(float)), view["rays"].astype(float)
    for aim in view["aim"]:
        to_light = aim["direction"].astype(float)
        at = (to_light[:2] / max(-to_light[2], 1e-3) - ray[..., :2]) / np.abs(rays[:2]) * view["pixels"]
        turn = np.arctan2(at[..., 1], at[..., 0]) * 72 / (2 * np.pi)
        off = np.abs(turn - np.floor(turn) - 0.5) * np.linalg.norm(at, axis=-1) * 2 * np.pi / 72
        shown = np.where(((off < 0.7) & (aim["fade"] > 0))[..., None], [0.05, 0.25, 0.6], shown)
    return shown


def with_light(found: Array, cone: Any, ray: Array, inverse: Array) -> Array:
    """Add lights' cones to what was found at rays: (..., 4) radiance of discs, cover of the body, its near and far along the axis.

    cone: records of composite/scene_uniforms.wgsl's Cone; inverse: of the rays' length.
    """
    cosine = (ray * cone["direction"]).sum(axis=-1) * inverse
    cover = np.clip((cosine - cone["cosine"]) * cone["sharp"] + 0.5, 0, 1)
    nearer = (cone["far"] > 0) & (cover > found[..., 1])
    own = np.stack(np.broadcast_arrays(cover, inverse * cone["near"], inverse * cone["far"]), axis=-1)
    discs = np.maximum(found[..., 0], cone["disc"] * cover)
    return np.concatenate([discs[..., None], np.where(nearer[..., None], own, found[..., 1:])], axis=-1)


def lights_at(uv: Array, view: Any, cones: int) -> Array:
    """Find the discs and the body of light at picture positions (..., 2), of so many cones: see `with_light`."""
    ray = view_ray(uv, view["rays"].astype(float))
    found = np.zeros((*ray.shape[:-1], 4))
    for cone in view["cone"][:cones]:
        found = with_light(found, cone, ray, 1 / np.linalg.norm(ray, axis=-1))
    return found


def emits(depth: Array, light: Array, view: Any, cones: int) -> Array:
    """Evaluate m of pixels: 1 where nothing writes depth, or where a light is. light: as `lights_at` gives it."""
    a, b, c, d = view["depth"].astype(float)
    over, under = a * depth + b, c * depth + d
    at_body = (over >= light[..., 2] * under) & (over <= light[..., 3] * under) & (cones > 0)
    return np.where(depth >= 1, 1.0, np.where(at_body, light[..., 1], 0.0))


def radiance(color: Array, open: Any, light: Array, view: Any, cones: int, is_cleared: bool) -> Array:
    """Convert colours (..., 3) of a scene to what they emit; open: nothing is drawn there. light: as `lights_at` gives it."""
    found, open = np.clip(color, 0, 65504), np.asarray(open)[..., None]
    if is_cleared:
        cover = light[..., 1:2]
        found = np.where(open, (1 - cover) * view["clear"].astype(float) + cover * found, found)
    return np.where(open, np.maximum(found, light[..., :1]), found) if cones else found


def fog(ray: Array, distance: Array, lights: Sequence[tuple[Any, float, Any]], level: float, reach: float) -> tuple[Array, Array]:
    """Find (colour, cover) of the fog between the eye and what lies at a distance along view rays (..., 3).

    lights: (unit direction in view space, fade, RGB) each. The cover is f (1 - exp(-distance / reach)), f = sum of fade cos^8 of the angle
    to each light, at most 1; the colour that of the lights, weighted alike, at the level.
    """
    unit = ray / np.linalg.norm(ray, axis=-1, keepdims=True)
    faced = np.stack([fade * np.maximum(unit @ np.asarray(to), 0) ** FACING for to, fade, _ in lights], axis=-1)
    total = faced.sum(axis=-1)
    color = faced @ np.array([rgb for _, _, rgb in lights], float) / np.maximum(total, 1e-6)[..., None] * level
    return color, np.minimum(total, 1) * -np.expm1(-distance / reach)


def balance(luminances: Array, before: Array | None = None, follow: float = 1.0) -> tuple[Ramp, Array]:
    """Find the ramp for a picture of these luminances, as composite.adapt.measure_ramp but by a histogram of an eighth of a stop; and what
    the next frame follows: average, least and greatest, in stops. before: the same of the last frame; follow: share of the way to the
    new."""
    lit = luminances[np.isfinite(luminances) & (luminances > 0)]
    bins = np.clip((np.log2(lit) - LOWEST) * BINS, 0, COUNT - 1).astype(int)
    counts = np.bincount(bins, minlength=COUNT).astype(float)
    ends = np.cumsum(counts)

    def percentile(share: float) -> float:
        at = int(np.argmax((ends >= share * ends[-1]) & (counts > 0)))
        return LOWEST + (at + (share * ends[-1] - (ends[at] - counts[at])) / counts[at]) / BINS

    least, greatest = percentile(0.001), percentile(0.999)
    middles = np.clip(LOWEST + (np.arange(COUNT) + 0.5) / BINS, least, greatest)
    now = np.array([counts @ middles / ends[-1], least, greatest])
    state = now if before is None else before + follow * (now - before)
    average, least, greatest = state
    lean = (2 * average - least - greatest) / (greatest - least) if greatest - least > 1e-6 else 0.0
    scale = MIDDLE_GREY * 4.0**lean * 2.0**-average
    return Ramp(float(scale), max(float(scale * 2.0**greatest), 1.0)), state
