"""The table of visibility, float64: twins of the functions of scatter/visibility/*.wgsl, and a whole table of a sun without cascades."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from airlight.medium.resolve import ResolvedMedium
from airlight.projection import depth_terms, eye_rays
from airlight.reference import height as fog_twin
from airlight.reference.march import directional_integral, layer_of_fog
from airlight.reference.medium import transmittance_integral
from airlight.scatter.visibility.grid import WORD, Fineness, RowGrid

Array = npt.NDArray[Any]
SAMPLES = 15  # of a block
UNHIDDEN = -1e9
NO_SURFACE = 1e9
ROUNDING, HALF_SAMPLE, LEAST_SHARE = 0.07, 0.0333, 0.06
SUMS = ("seen", "dense", "way", "u", "lit", "stored", "lengths", "lit_lengths", "stored_lengths")


def block_at(texels: Any, per: int, widest: int) -> Array:
    """Finds the block at distances (...) and the part of it: octaves are divided evenly."""
    texels = np.asarray(texels, float)
    octave = np.floor(np.log2(np.maximum(texels, per) / per))
    octaves = per + per * (octave + np.maximum(texels, per) / (per * 2**octave) - 1)
    whole = per + per * np.log2(widest)
    return np.where(texels < per, texels, np.where(texels > per * widest, whole + (texels - per * widest) / widest, octaves))


def block_begin(block: Any, per: int, widest: int) -> Array:
    """Finds where whole blocks (...) begin, texels from the eye."""
    block, whole = np.asarray(block, float), per + per * np.log2(widest)
    octave, part = np.divmod(np.clip(block - per, 0, whole), per)
    return np.where(
        block < per, block, np.where(block > whole, per * widest + (block - whole) * widest, per * 2**octave * (1 + part / per))
    )


def lit_from(first: Any, last: Any, rays: Any, rises: bool, denser: bool = False) -> Array:
    """Finds the first ray that a sample lights, or else hides, of a linear function's values (...) at the first and the last ray.

    denser: rays lie at squares of even shares of their row.
    """
    first, last = np.asarray(first, float), np.asarray(last, float)
    change = first - last
    share = np.clip(first / np.where(change == 0, 1, change), 0, 1)
    crossing = np.ceil((np.sqrt(share) if denser else share) * rays)
    rising = np.where(first >= 0, 0, np.where(last < 0, rays + 1, crossing))
    falling = np.where(first < 0, 0, np.where(last >= 0, rays + 1, crossing))
    return (rising if rises else falling).astype(np.int64)


def lit_mask(first: Any, word: Any, rises: bool) -> Array:
    """Sets the bits of the rays of words that samples light."""
    shift = np.clip(np.asarray(first, np.int64) - 32 * np.asarray(word, np.int64), 0, 32)
    begun = (0xFFFFFFFF << shift) & 0xFFFFFFFF
    return np.asarray(begun if rises else begun ^ 0xFFFFFFFF, np.uint32)


def counted(planes: Any, mask: Any) -> Array:
    """Adds masks (...) to counters in bit planes (..., 4)."""
    planes, carry, out = np.asarray(planes, np.uint32), np.asarray(mask, np.uint32), []
    for k in range(4):
        out.append(planes[..., k] ^ carry)
        carry = planes[..., k] & carry
    return np.stack(out, axis=-1)


def nibbles(planes: Any, q: Any) -> Array:
    """Takes counts of rays q, q + 4, ... out of planes (..., 4), four bits each."""
    planes, q = np.asarray(planes, np.uint64), np.asarray(q, np.uint64)
    found = np.zeros(np.broadcast_shapes(planes.shape[:-1], q.shape), np.uint64)
    for k in range(4):
        found = found | (((planes[..., k] >> q) & np.uint64(0x11111111)) << np.uint64(k))
    return found.astype(np.uint32)


def place_in_grid(
    p: Any, size: Any, slope: Any, offset: Any, rate: Any, first: Any, rays: Any, denser: bool = False
) -> tuple[Array, Array, Array]:
    """Finds (row, ray, rays of the row) of pixels (..., 2). denser: as of lit_from."""
    p, size = np.asarray(p, float), np.asarray(size, float)
    away = slope * p - offset
    inverse, forward = 1 / np.maximum(np.abs(away), 1e-12), away > 0
    out = np.where(forward, size - p, p) * inverse
    back = (np.where(forward, p, size - p) + 2) * inverse
    t_out, t_in = out.min(axis=-1), np.minimum(back.min(axis=-1), 0.999999 / max(float(slope), 1e-30))
    sideways = out[..., 0] < out[..., 1]
    edge = np.where(sideways, forward[..., 0].astype(int), 2 + forward[..., 1].astype(int))
    end = p + t_out[..., None] * away
    along = np.where(sideways, end[..., 1] * rate[0], end[..., 0] * rate[1])
    count = np.asarray(rays, float)[edge]
    share = t_in / (t_in + t_out)
    return np.asarray(first, float)[edge] + along, (np.sqrt(share) if denser else share) * (count - 1), count


def between_planes(values: Any, part: Any) -> Array:
    """Interpolates between four values (..., 4) at 0 to 3."""
    values, part = np.asarray(values, float), np.asarray(part, float)
    low = np.clip(np.floor(part), 0, 2).astype(int)
    a, b = (np.take_along_axis(values, (low + k)[..., None], axis=-1)[..., 0] for k in (0, 1))
    return np.asarray(a + np.clip(part - low, 0, 1) * (b - a))


def lit_integral(ray: Any, range: Any, frame: Any, light: Any, fog: str, fades: bool) -> Array:
    """Integrates density times transmittance over ranges (..., 2) of t that are lit: (..., 3) m."""
    if fog == "none":
        sigma = frame["sigma_t"].astype(float)
        return np.asarray(transmittance_integral(range[..., 1], sigma) - transmittance_integral(range[..., 0], sigma))
    return directional_integral(ray, range, frame, light, fog, fades)


def mean_of_four(x: Any) -> Array:
    """Evaluates (1 - e^-x) / x."""
    x = np.asarray(x, float)
    return np.where(x == 0, 1.0, -np.expm1(-x) / np.where(x == 0, 1.0, x))


def mean_densities(y: Any, frame: Any, fog: str) -> Array:
    """Averages density by height from the eye to heights (...) above the fog's base."""
    return fog_twin.mean_height_density(float(frame["base_height"]), np.asarray(y, float), layer_of_fog(frame), fog)


def columns(y: Any, frame: Any, fog: str) -> Array:
    """Integrates the fog above heights (...), m."""
    return fog_twin.height_column(np.asarray(y, float), layer_of_fog(frame), fog)


def pace_in_map(map: Any, ray: Any, light: Any) -> Array:
    """Measures the texels of maps (...) that rays (...) pass in a metre."""
    matrix = light["view"]["matrix"].astype(float)[map]  # columns
    seen = np.einsum("...i,...ij->...j", ray["direction"].astype(float), matrix[..., :3, :2])
    return np.maximum(np.linalg.norm(seen, axis=-1), 1e-6)


def range_in_map(near: Any, far: Any, ahead: Any, whole: Any) -> Array:
    """Clips rays to what a map counts for, (..., 2) m. ahead: metres along the camera's axis a metre of the ray."""
    ends = np.stack(np.broadcast_arrays(near, far), axis=-1) / np.maximum(ahead, 1e-6)[..., None]
    return np.clip(ends, 0, np.asarray(whole)[..., None])


def add_block(
    rays: Mapping[str, Array], share: Any, begin: float, wide: float, frame: Any, middle: float, fog: str, climb: float | None = None
) -> dict[str, Array]:
    """Adds a block in which such shares (...) of rays are lit to their sums.

    rays: members of the shader's Rays, (...). climb: of the light, where the fog above dims it.
    """
    old = {name: np.asarray(value, float) for name, value in rays.items()}
    sums, share = dict(old), np.asarray(share, float)
    counts = np.clip((begin + wide - old["near"]) / wide, 0, 1)
    if fog == "none":
        long = wide * old["metres"]
        each = long * mean_of_four(middle * long)
        weight, place = old["seen"] * each * counts, (begin + 0.5 * wide) * old["metres"]
        sums["seen"] = old["seen"] * (1 - middle * each)
    else:
        y = float(frame["base_height"]) + (begin + wide) * old["climb"]
        sums["dense"] = (begin + wide) * old["metres"] * mean_densities(y, frame, fog)
        sums["way"] = sums["dense"] + (0.0 if climb is None else columns(y, frame, fog) / max(climb, 1e-6))
        least, most = np.minimum(old["way"], sums["way"]), np.maximum(old["way"], sums["way"])
        weight = (sums["dense"] - old["dense"]) * np.exp(-middle * least) * mean_of_four(middle * (most - least)) * counts
        place = 0.5 * (old["way"] + sums["way"])
    return sums | add_weighed(old, share, weight, place, 1.0, begin, wide)


def begin_sums(surface: Any) -> dict[str, Array]:
    """Begins sums of rays that end at such surfaces (...)."""
    surface = np.asarray(surface, float)
    zeros = {name: np.zeros(surface.shape) for name in ("lit", "stored", "lengths", "lit_lengths", "stored_lengths")}
    return zeros | {"surface": surface, "u": np.full(surface.shape, 1e-30), "before": np.full(surface.shape, -1.0)}


def add_weighed(
    old: Mapping[str, Array], share: Array, weight: Array, middle: Array, strength: Any, begin: float, wide: float, wary: bool = False
) -> dict[str, Array]:
    """Adds a block from `begin` on in which such shares (...) of rays are lit to their sums, of the shader's Sums. weight: of the block;
    middle: its optical length; strength: factor of the light, that U does not hold; wary: as the shader's constant."""
    sums, whole = dict(old), weight * strength
    sums["u"] = old["u"] + weight
    sums["lit"] = old["lit"] + whole * share
    part = np.clip((old["surface"] - begin) / wide, 0, 1)
    known = np.where(old["before"] < 0, share, old["before"])
    some = np.minimum((share + np.where(share > 0, HALF_SAMPLE, 0)) / np.maximum(part, LEAST_SHARE), 1)
    some = np.minimum(some, known) if wary else some
    held = np.where((part > 0) & (share <= part + ROUNDING), some, known)
    returns = (part >= 1) | ((part <= 0) & (share > 0))
    sums["stored"] = np.where(returns, sums["lit"], old["stored"] + whole * held)
    sums["surface"] = np.where(returns & (part <= 0), NO_SURFACE, old["surface"])
    met = np.where(part >= 1, 0.5 * (known + share), known)
    sums["before"] = np.where(np.asarray(strength) > 0, met, old["before"])
    sums["lengths"] = old["lengths"] + weight * middle
    sums["lit_lengths"] = old["lit_lengths"] + whole * share * middle
    sums["stored_lengths"] = np.where(returns, sums["lit_lengths"], old["stored_lengths"] + whole * held * middle)
    return {name: sums[name] for name in (*begin_sums(0.0),)}


def slopes(rays: Mapping[str, Array], spread: float) -> Array:
    """Finds dV / d sigma times the spread of the extinctions, (...)."""
    value = rays["stored"] / rays["u"]
    return np.asarray(spread * (value * rays["lengths"] - rays["stored_lengths"]) / rays["u"])


def visibilities(
    grid: RowGrid,
    fineness: Fineness,
    row: int,
    view: Any,
    projection: Any,
    matrix: Any,
    held: Any,
    depth: Any,
    medium: ResolvedMedium,
    blocks: int,
) -> tuple[Array, Array]:
    """Sums a row of a table in even air: V and its slope, as it is stored, (blocks, rays) each, after each block.

    view, projection: (4, 4); matrix: of the shadow map's view, world to texels and depth; held: (side, side) its depths; depth: (H, W) of
    the picture. The map's texels are looked up one by one.
    """  # fmt: skip
    count = int(grid.rays[grid.edge[row]])
    share = np.linspace(0, 1, count)[:, None]
    p = grid.begin[row] + share * (grid.end[row] - grid.begin[row])
    (scale_x, scale_y, from_x, from_y), _ = eye_rays(projection)
    ray = np.column_stack([p / np.array(grid.size) * (scale_x, scale_y) + (from_x, from_y), -np.ones(count)])
    into = np.asarray(matrix) @ np.linalg.inv(view)
    seen = ray @ into[:3, :3].T
    along = seen[-1, :2] / np.linalg.norm(seen[-1, :2])
    pace = np.maximum(seen[:, :2] @ along, 1e-6)
    at = np.clip(np.floor(p).astype(int), 0, np.array(grid.size) - 1)
    a, b, c, d = depth_terms(projection)
    z = np.asarray(depth, float)[at[:, 1], at[:, 0]]
    ahead, long = (a * z + b) / (c * z + d), np.linalg.norm(ray, axis=1)
    hit = (z < 1) & (ahead * long < medium.max_distance)
    zero = np.zeros(count)
    rays: dict[str, Array] = {name: zero for name in (*SUMS, "climb", "near")}
    rays |= {
        "metres": long / pace,
        "surface": np.where(hit, ahead * pace, NO_SURFACE),
        "before": zero - 1,
        "seen": zero + 1,
        "u": zero + 1e-30,
    }
    middle, spread = float(medium.sigma_t.max() + medium.sigma_t.min()) / 2, float(np.ptp(medium.sigma_t))
    values, changes, side = [], [], len(held)
    for k in range(blocks):
        begin, end = (float(block_begin(n, fineness.per, fineness.widest)) for n in (k, k + 1))
        lit = np.zeros(count)
        for r in begin + (np.arange(SAMPLES) + 0.5) * (end - begin) / SAMPLES:
            x, y = into[:2, 3] + along * r
            inside = 0 <= x < side and 0 <= y < side
            occluder = float(held[int(y), int(x)]) if inside else 0.0
            h = occluder - into[2, 3] if occluder > 0 else UNHIDDEN
            lit += seen[:, 2] * r - h * pace >= 0
        rays = add_block(rays, lit / SAMPLES, begin, end - begin, None, middle, "none")
        values.append(rays["stored"] / rays["u"])
        changes.append(slopes(rays, spread))
    assert count % WORD == 0
    return np.array(values), np.array(changes)
