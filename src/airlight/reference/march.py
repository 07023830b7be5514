"""Evaluates the functions of scatter/march/*.wgsl in float64, each under its shader's name.

Arrays broadcast; vectors lie along the last axis. frame, light: records as the shaders have them, scatter.march.records.
"""

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from airlight.reference.height import BANDS, height_band, height_column, height_density, mean_height_density
from airlight.reference.lights import cone_ramp, range_window
from airlight.reference.medium import glow_between, mean_transmittance, phase, phase_between, transmittance, transmittance_integral

Array = npt.NDArray[np.floating[Any]]
QUADRATURE_WIDTHS = (0.25, 0.5, 0.25)  # of v, of a piece: before, in and behind a cone's fully lit part
GAUSS_NODES, GAUSS_WEIGHTS = np.array([-np.sqrt(0.6), 0, np.sqrt(0.6)]) / 2, np.array([5, 8, 5]) / 18
LAST_TEXELS = 4  # of a ray before a surface, whose visibility is that where they begin
GOLDEN_ANGLE = np.pi * (3 - np.sqrt(5))  # radians


def _dot(a: Any, b: Any) -> Array:
    return np.asarray((np.asarray(a, float) * np.asarray(b, float)).sum(axis=-1))


def sampled_pixel(p: Any, size: Any, pixels: Any) -> npt.NDArray[np.int64]:
    """Finds the pixels, of a picture of so many, at whose centres pixels p of a march of a smaller size are sampled."""
    return np.minimum((2 * np.asarray(p, np.int64) + 1) * pixels // (2 * np.asarray(size, np.int64)), np.asarray(pixels, np.int64) - 1)


# ---------------------------------------------------------------- what is scattered into a ray


def in_scatter_directional(direction: Any, frame: Any, light: Any, kind: int) -> Array:
    """Evaluates (..., 3) what a directional light scatters into rays along a metre of them, without extinction."""
    glow = frame["sun_glow"] * glow_between(direction, light["position"], frame["glow_concentration"].astype(float))
    there = (1 - frame["sun_glow"]) * phase_between(direction, light["position"], light["lobes"], kind) + glow
    return np.asarray(frame["sigma_s"].astype(float) * light["intensity"] * there[..., None])


def height(place: Any, frame: Any) -> Array:
    """Measures the height of places (..., 3) above the fog's base, m."""
    return np.asarray(float(frame["base_height"]) + _dot(place, frame["up"]))


def _at(ray: Any, t: Any) -> Array:
    return np.asarray(ray["origin"] + np.asarray(t, float)[..., None] * ray["direction"].astype(float))


def layer_of_fog(frame: Any) -> Array:
    """Reads (..., 2) the fog's depth and what is above it."""
    return np.stack([frame["fog_depth"], frame["fog_above"]], axis=-1).astype(float)


def optical_length(ray: Any, t: Any, frame: Any, fog: str) -> Array:
    """Integrates density by height along rays up to t: the length, m, of a path of density 1 through as much. fog: one of resolve.FOGS."""
    if fog == "none":
        return np.asarray(t, float)
    return np.asarray(t * mean_height_density(height(ray["origin"], frame), height(_at(ray, t), frame), layer_of_fog(frame), fog))


def directional_integral(ray: Any, range: Any, frame: Any, light: Any, fog: str, fades: bool) -> Array:
    """Integrates density times transmittance over lit ranges (..., 2) of t, from a directional light to the eye: (..., 3) m.

    Exact where the density is that of exponential fog, or of a ramp to nothing: L = e^(-D(a)) tau phi(D(b) - D(a)), with
    phi(x) = (1 - e^-x) / x, and D the optical depth from the light to the eye by way of a place. fades: the fog above dims the light.
    """
    first, last = (height(_at(ray, range[..., i]), frame) for i in (0, 1))
    along = (range[..., 1] - range[..., 0]) * mean_height_density(first, last, layer_of_fog(frame), fog)
    before = optical_length(ray, range[..., 0], frame, fog)
    ends = np.stack([before, before + along])
    if fades:
        ends = ends + np.stack([height_column(y, layer_of_fog(frame), fog) for y in (first, last)]) / max(float(light["climb"]), 1e-6)
    near, sigma = ends.min(axis=0), frame["sigma_t"].astype(float)
    return np.asarray(along[..., None] * transmittance(near, sigma) * mean_transmittance((ends.max(axis=0) - near)[..., None] * sigma))


def clip_to_band(ray: Any, range: Any, k: Any, frame: Any, fog: str) -> Array:
    """Clips ranges (..., 2) of t to the k-th band of heights; empty where the end is not behind the start."""
    band, start, climb = height_band(k, layer_of_fog(frame), fog), height(ray["origin"], frame), _dot(ray["direction"], frame["up"])
    return clip_range(clip_range(range, start - band[..., 0], climb), band[..., 1] - start, -climb)


def scattered_share(d: Any, cosine: Any, axis_cosine: Any, light: Any, kind: int) -> Array:
    """Evaluates the share of a light's intensity that reaches points d metres from it and is scattered to the eye, 1/sr, times d^2."""
    ramp = cone_ramp(axis_cosine, light["cone_scale"], light["cone_offset"])
    return np.asarray(phase(cosine, light["lobes"], kind) * ramp**2 * range_window(d, light["range"]))


def in_scatter_punctual(
    ray: Any, t: Any, d: Any, cosine: Any, axis_cosine: Any, frame: Any, light: Any, kind: int, fog: str = "none"
) -> Array:
    """Evaluates (..., 3) what a light scatters into rays from points at t, along a metre of them, times d^2; d: metres from the light."""
    strength = scattered_share(d, cosine, axis_cosine, light, kind)
    power, path = frame["sigma_s"].astype(float) * light["intensity"], optical_length(ray, np.asarray(t, float), frame, fog) + d
    if fog != "none":
        y = height(_at(ray, t), frame)
        strength = strength * height_density(y, layer_of_fog(frame), fog)
        path = path - d + d * mean_height_density(y, height(light["position"], frame), layer_of_fog(frame), fog)
    return np.asarray(power * strength[..., None] * transmittance(path, frame["sigma_t"]))


def nearest_approach(ray: Any, light: Any) -> Array:
    """Finds (..., 2) rays' nearest approach to the light: (t there, distance)."""
    to_light = light["position"].astype(float) - ray["origin"]
    t = _dot(to_light, ray["direction"])
    away = np.linalg.norm(to_light - t[..., None] * ray["direction"], axis=-1)
    return np.stack([t, np.maximum(away, 1e-6 * np.linalg.norm(to_light, axis=-1) + 1e-9)], axis=-1)


def sinh_parameter(nearest: Any, t: Any) -> Array:
    """Evaluates v of t = t0 + h sinh v, nearest = (t0, h)."""
    return np.asarray(np.arcsinh((t - nearest[..., 0]) / nearest[..., 1]))


def sinh_integrand(ray: Any, nearest: Any, v: Any, frame: Any, light: Any, kind: int, fog: str = "none") -> Array:
    """Evaluates (..., 3) the integrand over v, where t + d = t0 + h e^v and dt / d^2 = dv / (h cosh v)."""
    d, t = nearest[..., 1] * np.cosh(v), nearest[..., 0] + nearest[..., 1] * np.sinh(v)
    from_light = ray["origin"] + t[..., None] * ray["direction"].astype(float) - light["position"]
    there = in_scatter_punctual(ray, t, d, -np.tanh(v), _dot(from_light, light["axis"]) / d, frame, light, kind, fog)
    return np.asarray(there / d[..., None])


def integrate_punctual(ray: Any, nearest: Any, full: Any, segment: Any, frame: Any, light: Any, kind: int, fog: str = "none") -> Array:
    """Integrates (..., 3) in-scattered radiance over lit segments of rays, by Gauss's rule of three nodes on pieces of v."""
    inner = np.clip(full, segment[..., :1], segment[..., 1:])
    marks = np.stack([segment[..., 0], inner[..., 0], inner[..., 1], segment[..., 1]], axis=-1)
    ends = sinh_parameter(nearest[..., None, :], marks)
    total = np.zeros((*ends.shape[:-1], 3))
    for at in np.ndindex(ends.shape[:-1]):
        for part, width in enumerate(QUADRATURE_WIDTHS):
            low, high = ends[at][part], ends[at][part + 1]
            pieces = max(int(np.ceil((high - low) / width)), 0)
            for k in range(pieces):
                v = low + (high - low) / pieces * (k + 0.5 + GAUSS_NODES)
                values = sinh_integrand(ray[at], nearest[at][None], v, frame, light, kind, fog)
                total[at] += (high - low) / pieces * (GAUSS_WEIGHTS @ values)
    return total


def integrate_in_fog(ray: Any, nearest: Any, full: Any, segment: Any, frame: Any, light: Any, kind: int, fog: str) -> Array:
    """Integrates (..., 3) in-scattered radiance over lit segments of rays, band by band of the fog's heights."""
    if fog == "none":
        return integrate_punctual(ray, nearest, full, segment, frame, light, kind)
    parts = (clip_to_band(ray, segment, k, frame, fog) for k in range(len(BANDS[fog]) - 1))
    each = (np.where(part[..., 1:] > part[..., :1], part, segment[..., :1]) for part in parts)
    return np.asarray(sum(integrate_punctual(ray, nearest, full, part, frame, light, kind, fog) for part in each))


def integrate_evenly(ray: Any, segment: Any, frame: Any, light: Any, fog: str, fades: bool) -> Array:
    """Integrates density times transmittance over lit segments (..., 2) of rays, m; band by band where a part of it is not closed."""
    if fog == "none":
        start, end = (transmittance_integral(segment[..., i], frame["sigma_t"]) for i in (0, 1))
        return np.asarray(end - start)
    if fog == "exponential" or not fades:
        return directional_integral(ray, segment, frame, light, fog, fades)
    parts = (clip_to_band(ray, segment, k, frame, fog) for k in range(len(BANDS[fog]) - 1))
    each = (np.where(part[..., 1:] > part[..., :1], part, segment[..., :1]) for part in parts)
    return np.asarray(sum(directional_integral(ray, part, frame, light, fog, fades) for part in each))


def equiangular_angle(nearest: Any, t: Any) -> Array:
    """Evaluates the angle at the light between the nearest approach (t0, h) and rays at t."""
    return np.asarray(np.arctan2(t - nearest[..., 0], nearest[..., 1]))


def equiangular_integrand(ray: Any, nearest: Any, angle: Any, frame: Any, light: Any, kind: int, fog: str = "none") -> Array:
    """Evaluates (..., 3) the integrand over t, times dt / d(angle). Kulla and Fajardo 2012."""
    t, d = nearest[..., 0] + nearest[..., 1] * np.tan(angle), nearest[..., 1] / np.cos(angle)
    from_light = ray["origin"] + t[..., None] * ray["direction"].astype(float) - light["position"]
    there = in_scatter_punctual(ray, t, d, -np.sin(angle), _dot(from_light, light["axis"]) / d, frame, light, kind, fog)
    return np.asarray(there / nearest[..., 1:])


# ---------------------------------------------------------------- where a light reaches a ray


def clip_range(range: Any, b: Any, a: Any) -> Array:
    """Clips ranges (..., 2) of t to where b + t a >= 0; empty where the end is before the start."""
    low, high = np.asarray(range, float)[..., 0], np.asarray(range, float)[..., 1]
    a, b = np.asarray(a, float), np.asarray(b, float)
    at = -b / np.where(a == 0, 1, a)
    start = np.where(a > 0, np.maximum(low, at), low)
    end = np.where(a > 0, high, np.where(a < 0, np.minimum(high, at), np.where(b < 0, low - 1, high)))
    return np.stack(np.broadcast_arrays(start, end), axis=-1)


def clip_to_cone(ray: Any, range: Any, cosine: Any, light: Any) -> Array:
    """Clips ranges (..., 2) of t to a cone around a spot's axis, of a half angle with this cosine."""
    from_light, axis = ray["origin"].astype(float) - light["position"], light["axis"].astype(float)
    ahead = clip_range(range, _dot(from_light, axis), _dot(ray["direction"], axis))
    narrow = clip_to_narrow_cone(from_light, ray["direction"], axis, range, cosine)
    return np.where(np.asarray(cosine)[..., None] < 1e-3, ahead, narrow)


def clip_to_narrow_cone(q: Any, direction: Any, axis: Any, range: Any, cosine: Any) -> Array:
    """Clips ranges (..., 2) of t of rays q + t direction to a cone around an axis from the origin, less than a half space."""
    low, high = np.asarray(range, float)[..., 0], np.asarray(range, float)[..., 1]
    squared, along, at = np.square(np.asarray(cosine, float)), _dot(direction, axis), _dot(q, axis)
    a, b, c = along**2 - squared, along * at - squared * _dot(direction, q), at**2 - squared * _dot(q, q)
    root = np.sqrt(np.maximum(b * b - a * c, 0))
    under = np.where(np.abs(a) < 1e-9, np.where(a >= 0, 1e-9, -1e-9), a)
    first, second = np.sort(np.stack([(-b - root) / under, (-b + root) / under]), axis=0)
    steep = np.where(along > 0, np.maximum(low, second), low), np.where(along > 0, high, np.minimum(high, first))
    hit = (b * b > a * c) & (at + (first + second) / 2 * along > 0)
    flat = np.where(hit, np.maximum(low, first), low), np.where(hit, np.minimum(high, second), low - 1)
    return np.stack([np.where(a > 0, s, f) for s, f in zip(steep, flat, strict=True)], axis=-1)


def full_cone_range(ray: Any, range: Any, light: Any, is_cone: bool) -> Array:
    """Finds the part of ranges (..., 2) of t in which a spot's cone is fully lit; of other lights, all of them."""
    if not is_cone:
        return np.asarray(range, float)
    found = clip_to_cone(ray, range, np.minimum((1 - light["cone_offset"]) / light["cone_scale"], 1), light)
    end = np.broadcast_to(np.asarray(range, float)[..., 1:], found.shape)
    return np.where(found[..., 1:] > found[..., :1], found, end)


def project_ray(i: int, ray: Any, range: Any, margin: Any, light: Any) -> tuple[Array, Array, Array]:
    """Projects rays into view i: (a, b, range), homogeneous map coordinates (..., 4) b + t a, and the range (..., 2) in its map."""
    matrix = light["view"]["matrix"][i].astype(float)  # columns
    a, b = ray["direction"] @ matrix[:3], ray["origin"] @ matrix[:3] + matrix[3]
    side = light["side"] - margin
    for at, grows in (
        (b[..., 3], a[..., 3]),
        (b[..., 0] - margin * b[..., 3], a[..., 0] - margin * a[..., 3]),
        (b[..., 1] - margin * b[..., 3], a[..., 1] - margin * a[..., 3]),
        (side * b[..., 3] - b[..., 0], side * a[..., 3] - a[..., 0]),
        (side * b[..., 3] - b[..., 1], side * a[..., 3] - a[..., 1]),
    ):
        range = clip_range(range, at, grows)
    return a, b, range


def last_stretch(i: int, ray: Any, w: Any, frame: Any, light: Any, is_directional: bool) -> Array:
    """Finds t from which on rays take the visibility that they have there: four texels of view i before a surface. w: W at their ends."""
    texel = float(light["view"]["texel"][i]) * (1.0 if is_directional else np.maximum(w, 0))
    reach = np.asarray(ray["reach"], float)
    return np.where(reach < frame["max_distance"], np.maximum(reach - LAST_TEXELS * texel, 0), reach)


def line_to_t(s: Any, range: Any, w: Any, is_directional: bool) -> Array:
    """Converts shares s of lines in a map to t, between the ends of ranges (..., 2) of t, whose W are w (..., 2)."""
    share = s if is_directional else s * w[..., 0] / (s * w[..., 0] + (1 - s) * w[..., 1])
    return np.asarray(range[..., 0] + (range[..., 1] - range[..., 0]) * share)


# ---------------------------------------------------------------- shadow maps


def depth_bias(i: int, light: Any, is_biased: bool) -> float:
    """Converts the bias to view i's depth, or, of a light with a position, to the inverse of its depth."""
    return float(light["bias"] / light["view"]["depth_scale"][i]) if is_biased else 0.0


def biased_occluder_depth(occluder: Any, bias: Any, is_directional: bool) -> Array:
    """Moves depths that a map holds away from the light by the bias: from there on a point is lit."""
    occluder = np.asarray(occluder, float)
    return np.asarray(np.where(occluder == 0, -3e38, occluder - bias) if is_directional else occluder / (1 + bias * occluder))


def vogel_disc(k: Any, turn: Any, count: int = 12) -> Array:
    """Places (..., 2) the k-th of so many points on the unit disc, turned by a part of a full turn. Vogel 1979."""
    angle = GOLDEN_ANGLE * np.asarray(k, float) + 2 * np.pi * np.asarray(turn, float)
    return np.asarray(np.sqrt((np.asarray(k) + 0.5) / count)[..., None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1))


def cascade_weight(ahead: Any, near: Any, far: Any, blend: Any) -> Array:
    """Weighs the cascade after one from near to far, at metres ahead along the camera's axis: 0 before the part over which they blend."""
    return np.asarray(np.clip(1 - (far - ahead) / np.maximum(blend * (far - near), 1e-20), 0, 1))


def first_step(beyond: Any, each: Any, o: Any, n: Any) -> Array:
    """Finds the first of n steps, of a length each, whose sample lies at `beyond` or after it. o: where in its step."""
    return np.asarray(np.clip(np.ceil(beyond / np.maximum(each, 1e-20) - o), 0, n))


def tiles_along(side: Any, level: Any) -> Any:
    """Counts the tiles of a level, log2 of their texels, along a side of a map."""
    return -(-np.asarray(side, np.int64) // 2 ** np.asarray(level, np.int64))


def tile_index(side: Any, i: Any, level: Any, tile: Any) -> Any:
    """Finds the index of tiles (..., 2) of view i's map in the depth hierarchy's buffer; level 3 is fine, 6 coarse."""
    fine, coarse, level = tiles_along(side, 3), tiles_along(side, 6), np.asarray(level)
    begin = np.asarray(i, np.int64) * (fine**2 + coarse**2) + np.where(level == 3, 0, fine**2)
    return begin + tile[..., 1] * np.where(level == 3, fine, coarse) + tile[..., 0]


def pack_conservative(range: Any) -> npt.NDArray[np.uint32]:
    """Packs least and greatest depths (..., 2) as half floats, the one rounded down and the other up; none is subnormal."""
    smallest, range = 6.2e-5, np.asarray(range, float)
    least, greatest = range[..., 0] * (1 - 1 / 1024), np.maximum(range[..., 1] * (1 + 1 / 1024), 2 * smallest)
    both = np.stack([np.where(least > smallest, least, 0), np.where(range[..., 1] > 0, greatest, 0)], axis=-1)
    return np.ascontiguousarray(both.astype(np.float16)).view(np.uint32)[..., 0]


def relative_difference(a: Any, b: Any) -> Array:
    """Computes the difference of two lengths, relative to the shorter one."""
    return np.asarray(np.abs(a - b) / np.maximum(np.minimum(a, b), 1e-6))


def positions(sizes: Any, pixels: Any) -> Array:
    """Finds (2, H, W) where pixels of a picture (H, W) lie in a march of a smaller size (h, w): y, x, of its pixels' indices."""
    at = []
    for size, count in zip(sizes, pixels, strict=True):
        ratio, middle = count / size, size // 2
        shift = float(sampled_pixel(middle, size, count)) + 0.5 - (middle + 0.5) * ratio
        at.append((np.arange(count) + 0.5 - shift) / ratio - 0.5)
    return np.stack(np.meshgrid(*at, indexing="ij"))


def upsampled(marched: Array, lengths: Array, sigma_t: Any, sharpness: float = 24.0, threshold: float = 0.2) -> Array:
    """Upsamples to (H, W, 3) radiance, of rays of lengths (H, W), m, a march (h, w, 4) at a smaller size: radiance and lengths.

    Neighbours are weighted by their nearness and by the likeness of their lengths (Kopf et al. 2007, Joint Bilateral Upsampling). Where
    none is alike, the nearest on a spiral that is, is taken.
    """
    marched = np.asarray(marched, float)
    sizes = marched.shape[:2]

    def held(y: Any, x: Any, reach: Any) -> tuple[Array, Array]:
        texel = marched[np.clip(y, 0, sizes[0] - 1), np.clip(x, 0, sizes[1] - 1)]
        return texel, relative_difference(texel[..., 3], reach)

    y, x = positions(sizes, lengths.shape)
    sums, weights = np.zeros((*lengths.shape, 3)), np.zeros((*lengths.shape, 1))
    likest, least = np.zeros((*lengths.shape, 4)), np.full(lengths.shape, np.inf)
    for row, column in np.ndindex(4, 4):
        i, j = np.floor(y).astype(int) - 1 + row, np.floor(x).astype(int) - 1 + column
        texel, off = held(i, j, lengths)
        near = np.maximum(2 - np.abs(i - y), 0) * np.maximum(2 - np.abs(j - x), 0)
        weight = (near * np.exp(-sharpness * off) + 1e-20)[..., None]
        sums, weights = sums + weight * texel[..., :3], weights + weight
        better = (off < least) & (near > 1e-3)
        likest, least = np.where(better[..., None], texel, likest), np.where(better, off, least)
    out = sums / weights
    for p in zip(*np.nonzero(least > threshold), strict=True):
        best, off = likest[p], least[p]
        for k in range(64):
            angle, radius = 2.3999632 * k, np.sqrt(k + 4)
            row, column = y[p] + 0.5 + radius * np.sin(angle), x[p] + 0.5 + radius * np.cos(angle)
            texel, found = held(math.floor(row), math.floor(column), lengths[p])
            if found < off:
                best, off = texel, found
            if off <= threshold:
                break
        own, its = (transmittance_integral(length, sigma_t) for length in (lengths[p], best[3]))
        out[p] = best[:3] * np.minimum(own / np.maximum(its, 1e-20), 1)
    return np.asarray(out)
