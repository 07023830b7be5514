"""Adds up slices (Mitchell 2004) in float64: twins of scatter/slices/*.wgsl.

Arrays broadcast; vectors lie along the last axis. frame, light, slicing: records as the shaders have them, see scatter.slices.records.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from airlight.lights.punctual import PositionalLight, PunctualLight
from airlight.reference.colour import REC709
from airlight.reference.height import height_column, height_density
from airlight.reference.lights import cone_ramp, range_window
from airlight.reference.march import cascade_weight, clip_range, clip_to_cone, height, layer_of_fog, nearest_approach, optical_length
from airlight.reference.medium import transmittance
from airlight.reference.shape import clip_to_planes

Array = npt.NDArray[np.floating[Any]]
NOISE_CONSTANT, NOISE_SCALE, CHANNELS, CODES = 0.015, 0.05, 4, 255.0
GLOW, GRAIN, HAZE, STRIPS = 0.6, 0.08, 0.12, 0.5  # of earlier practice
BEND = 0.02  # of what is seen of a light, m: how near to it planes draw together


def _dot(a: Any, b: Any) -> Array:
    return np.asarray((np.asarray(a, float) * np.asarray(b, float)).sum(axis=-1))


# ---------------------------------------------------------------- the volume


def in_light(place: Any, slicing: Any) -> Array:
    """Transforms places (..., 3) to the light's right, up and ahead, m."""
    rows = slicing["rows"].astype(float)
    return np.asarray(np.asarray(place, float) @ rows[:, :3].T + rows[:, 3])


def picture_place(q: Any, slicing: Any, is_directional: bool) -> Array:
    """Finds (..., 2) where in a light's picture its light to places q (..., 3) along its axes lies."""
    q = np.asarray(q, float)
    ahead = np.ones_like(q[..., 2:]) if is_directional else q[..., 2:]
    return np.asarray(0.5 + np.array([0.5, -0.5]) * q[..., :2] / (ahead * slicing["tangents"]))


def clip_to_box(ray: Any, range: Any, slicing: Any) -> Array:
    """Clips ranges (..., 2) of t to the box, but for what is ahead."""
    for axis in (0, 1):
        start, along = ray["origin"][..., axis].astype(float), ray["direction"][..., axis].astype(float)
        range = clip_range(range, start - float(slicing["low"][axis]), along)
        range = clip_range(range, float(slicing["high"][axis]) - start, -along)
    return np.asarray(range)


def in_volume(place: Any, light: Any) -> npt.NDArray[np.bool_]:
    """Tells (...) whether places (..., 3) lie in the volume."""
    planes = light["planes"][: int(light["plane_count"])].astype(float)
    return np.asarray(np.all(np.asarray(place, float) @ planes[:, :3].T + planes[:, 3] >= 0, axis=-1))


def volume_range(ray: Any, frame: Any, light: Any, kind: str) -> Array:
    """Finds (..., 2) the range of t in a light's volume. kind: directional, cone, bounded, or any other."""
    reach = ray["reach"].astype(float)
    if kind == "directional":
        return np.stack([np.zeros_like(reach), np.minimum(reach, frame["sun_reach"])], axis=-1)
    range = np.stack([np.zeros_like(reach), reach], axis=-1)
    if kind == "cone":
        range = clip_to_cone(ray, range, light["cone_cosine"], light)
    if kind == "bounded":
        range = clip_to_planes(ray, range, light)
    if light["range"] > 0:
        range = clip_to_ball(nearest_approach(ray, light), range, float(light["range"]))
    return np.asarray(range)


def clip_to_ball(near: Any, range: Any, radius: Any) -> Array:
    """Clips ranges (..., 2) of t to a ball around the light, from rays' nearest approach (..., 2) to it."""
    half = np.sqrt(np.maximum(np.square(np.asarray(radius, float)) - near[..., 1] ** 2, 0))
    return np.stack([np.maximum(range[..., 0], near[..., 0] - half), np.minimum(range[..., 1], near[..., 0] + half)], axis=-1)


# ---------------------------------------------------------------- in a medium


def laid_planes(least: Any, most: Any, count: Any, lamp: Any, is_bent: bool) -> Array:
    """Lays so many planes from the least to the most that is seen of a light, m ahead: (..., 4), see struct Planes of slices.wgsl."""
    least, most, count, lamp = (np.asarray(one, float) for one in (least, most, count, lamp))
    zero = np.zeros_like(least + most)
    if not is_bent:
        return np.stack([least + zero, (most - least) / count, zero, zero], axis=-1)
    bend = np.maximum(BEND * (most - least), 1e-6)
    first, last = np.arcsinh((least - lamp) / bend), np.arcsinh((most - lamp) / bend)
    return np.stack([first + zero, (last - first) / count, lamp + zero, bend + zero], axis=-1)


def plane_place(k: Any, planes: Array, is_bent: bool) -> Array:
    """Places (...) where the k-th plane's part begins, m ahead."""
    at = planes[..., 0] + k * planes[..., 1]
    return np.asarray(planes[..., 2] + planes[..., 3] * np.sinh(at) if is_bent else at)


def plane_at(ahead: Any, planes: Array, is_bent: bool) -> Array:
    """Finds (...) in which plane's part places so many m ahead lie."""
    at = np.arcsinh((ahead - planes[..., 2]) / planes[..., 3]) if is_bent else np.asarray(ahead, float)
    return np.asarray((at - planes[..., 0]) / np.maximum(planes[..., 1], 1e-20))


def plane_offset(p: Any, cell: Any) -> Array:
    """Chooses (...) where in their part the planes of pixels p (..., 2) lie, 0..1, in cells of so many pixels a side."""
    cell = np.asarray(cell, np.int64)
    at, count = np.asarray(p, np.int64) % cell[..., None], cell * cell
    own = (at[..., 1] * cell + at[..., 0]) * np.where(count % 7 != 0, 7, 1) % count
    return np.asarray((own + 0.5) / count)


def directional_share(ray: Any, t: Any, frame: Any, light: Any, fog: str, fades: bool) -> Array:
    """Evaluates (..., 3) density times transmittance at t of rays through fog, of a directional light."""
    place = ray["origin"].astype(float) + np.asarray(t, float)[..., None] * ray["direction"]
    y, way = height(place, frame), optical_length(ray, np.asarray(t, float), frame, fog)
    if fades:
        way = way + height_column(y, layer_of_fog(frame), fog) / max(float(light["climb"]), 1e-6)
    return np.asarray(height_density(y, layer_of_fog(frame), fog)[..., None] * transmittance(way, frame["sigma_t"]))


def share_of_cascade(i: int, ahead: Any, light: Any) -> Array:
    """Weighs samples of cascade i so many metres ahead by the nearness to others."""
    own, last, ahead = light["view"][i], light["view"][max(i, 1) - 1], np.asarray(ahead, float)
    gains = cascade_weight(ahead, last["near"], last["far"], light["blend"])
    return np.where(ahead < own["near"], gains, 1 - cascade_weight(ahead, own["near"], own["far"], light["blend"]))


def cell_weight(offset: Any, m: Any) -> Array:
    """Weighs neighbours at offsets (..., 2) of a cell of m x m pixels: those at the ends of an even one by halves."""
    at_end = np.abs(np.asarray(offset)) == (np.asarray(m) // 2)[..., None]
    return np.asarray(np.where(np.asarray(m) % 2 == 0, np.where(at_end.all(axis=-1), 0.25, np.where(at_end.any(axis=-1), 0.5, 1.0)), 1.0))


def averaged(found: Array, m: int, sharpness: float) -> Array:
    """Averages (H, W, 4) interleaved slices, radiance and a ray's length, over cells of m x m pixels, not over edges of depth."""
    height_, width = found.shape[:2]
    total = np.zeros((height_, width, 4))
    for y in range(-(m // 2), m // 2 + 1):
        for x in range(-(m // 2), m // 2 + 1):
            rows, columns = (_mirrored(np.arange(n) + k, n) for n, k in ((height_, y), (width, x)))
            other = found[rows[:, None], columns[None, :]].astype(float)
            off = np.abs(other[..., 3] - found[..., 3]) / np.maximum(np.minimum(other[..., 3], found[..., 3]), 1e-6)
            weight = cell_weight(np.array([x, y]), np.array(m)) * np.exp(-sharpness * off)
            total += weight[..., None] * np.concatenate([other[..., :3], np.ones_like(other[..., :1])], axis=-1)
    return np.concatenate([total[..., :3] / total[..., 3:], found[..., 3:]], axis=-1)


def _mirrored(at: Any, count: int) -> npt.NDArray[np.int64]:
    return np.clip(np.where(at > count - 1, 2 * (count - 1) - at, at), 0, count - 1)


# ---------------------------------------------------------------- as printed


def printed_falloff(d: Any, slicing: Any) -> Array:
    """Evaluates the falloff at d units from the light."""
    square, inverse, constant = slicing["printed"].astype(float)
    return np.asarray(square / np.square(np.asarray(d, float)) + inverse / d + constant)


def codes_of(light: Any, most: float = CODES) -> Array:
    """Rounds light to codes of 8 bits, up to the most there is."""
    return np.asarray(np.floor(most * np.clip(light, 0, 1) + 0.5))


def noise_place(q: Any, slicing: Any, is_cube: bool, is_directional: bool) -> Array:
    """Places (..., 2) points q (..., 3) along a light's axes in its noise maps, before they are moved."""
    if is_cube:
        q = np.asarray(q, float)
        return np.asarray(q[..., :2] / np.maximum(np.linalg.norm(q, axis=-1) + np.abs(q[..., 2]), 1e-20)[..., None])
    return picture_place(q, slicing, is_directional)


def printed(
    origins: Array,
    directions: Array,
    reaches: Array,
    view: Any,
    light: PunctualLight,
    box: tuple[Array, Array],
    count: int,
    *,
    most: int = 100,
    falloff: tuple[float, float, float] = (20000.0, 0.0, 0.35),
    unit: float = 100.0,
    mask: bool = True,
    codes: float = CODES,
    maps: Any = None,
    scroll: Sequence[float] = (0.0, 0.0, 0.0, 0.0),
    shadows: Sequence[tuple[Any, Any]] = (),
) -> Array:
    """Adds up a light's planes in a buffer of 8 bits: (...) 0..1 of rays.

    origins, directions (..., 3), world, unit; reaches (...): m to a surface; view: (4, 4) world to view space. box: (3,) its corners
    in view space: right, up, ahead. count, most: planes there are, and for which the scale is 9. falloff: of
    1 / d^2, 1 / d and 1, d in `unit` a m. codes: the
    greatest of a channel.
    maps: (H, W, 2) noise, None: a constant; scroll: how far both have moved. shadows: (4, 4) world to texels and depth, and (S, S) depths.
    """
    view, low, high = np.asarray(view, float), *(np.asarray(one, float) for one in box)
    buffer = np.zeros((*reaches.shape, CHANNELS))
    eye, turn = view[:3, 3], view[:3, :3]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        for k in range(count):
            ahead = low[2] + (k + 0.5) / count * (high[2] - low[2])
            t = (ahead + (origins @ turn.T + eye)[..., 2]) / -(directions @ turn.T)[..., 2]
            place = origins + t[..., None] * directions
            seen = place @ turn.T + eye
            inside = (t >= 0) & (t <= reaches) & np.all((seen[..., :2] >= low[:2]) & (seen[..., :2] <= high[:2]), axis=-1)
            sides = light.planes()
            inside &= np.all(place @ sides[:, :3].T + sides[:, 3] >= 0, axis=-1)
            found = 9.0 * most / count * _printed_sample(place, light, falloff, unit, maps, scroll) * _lit(place, shadows)
            added = codes_of(np.where(inside, np.nan_to_num(found), 0) / (1 if mask else CHANNELS), codes)
            channel = k % CHANNELS if mask else 0
            buffer[..., channel] = np.minimum(buffer[..., channel] + added, codes)
    return np.asarray(buffer.sum(axis=-1) / (CHANNELS if mask else 1) / codes)


def _printed_sample(place: Array, light: PunctualLight, falloff: Sequence[float], unit: float, maps: Any, scroll: Sequence[float]) -> Array:
    """Evaluates noise, cookie, falloff, cone and range at places (..., 3)."""
    q = (place - light.origin()) @ light.axes().T
    d = np.linalg.norm(q, axis=-1)
    far = np.maximum(0.0 if light.directional else d * unit, 1e-6)
    found = falloff[0] / far**2 + falloff[1] / far + falloff[2] * np.ones_like(d)
    if isinstance(light, PositionalLight):
        found = found * range_window(d, light.range) * cone_ramp(q[..., 2] / np.maximum(d, 1e-20), *light.cone()) ** 2
    if light.cookie is not None:
        found = found * (light.colour(place) @ REC709)
    if maps is None:
        return np.asarray(NOISE_CONSTANT * found)
    cube = light.cone_cosine() < 0 and not len(light.planes()) and not light.directional
    if cube:
        at = q[..., :2] / np.maximum(d + np.abs(q[..., 2]), 1e-20)[..., None]
    elif light.directional and light.cookie is None:
        at = 0.5 + np.array([0.5, -0.5]) * q[..., :2]
    else:
        at = light.cookie_place(q)
    first, second = _repeated(maps[..., 0], at + scroll[:2]), _repeated(maps[..., 1], at + scroll[2:])
    return np.asarray(NOISE_SCALE * first * second * found)


def _repeated(values: Any, at: Array) -> Array:
    """Interpolates (...) a map (H, W) that repeats between the centres of its texels, at places (..., 2) of it."""
    rows, columns = values.shape
    place = np.nan_to_num(at) * (columns, rows) - 0.5
    low = np.floor(place).astype(np.int64)
    x, y = np.moveaxis(place - low, -1, 0)
    a, b = low % (columns, rows), (low + 1) % (columns, rows)
    top = (1 - x) * values[a[..., 1], a[..., 0]] + x * values[a[..., 1], b[..., 0]]
    bottom = (1 - x) * values[b[..., 1], a[..., 0]] + x * values[b[..., 1], b[..., 0]]
    return np.asarray((1 - y) * top + y * bottom)


def _lit(place: Array, shadows: Sequence[tuple[Any, Any]]) -> Array:
    """Tests (...) places against the first map that holds them, by the texel around them: 1 lit, 0 dark."""
    out, open_ = np.ones(place.shape[:-1]), np.ones(place.shape[:-1], bool)
    for matrix, depths in shadows:
        matrix, side = np.asarray(matrix, float), depths.shape[-1]
        at = place @ matrix[:, :3].T + matrix[:, 3]
        texel = np.floor(at[..., :2] / at[..., 3:])
        holds = open_ & (at[..., 3] > 0) & np.all((texel >= 0) & (texel < side), axis=-1)
        x, y = np.moveaxis(np.where(holds[..., None], texel, 0).astype(np.int64), -1, 0)
        out = np.where(holds, (at[..., 2] / at[..., 3] >= depths[y, x]) | (depths[y, x] == 0), out)
        open_ &= ~holds
    return np.asarray(out, float)


def blur_place(k: Any, count: Any) -> Array:
    """Places (..., 2) the k-th of so many samples of a blur: one in its middle, the others evenly on a circle of radius 1."""
    k, count = np.asarray(k, float), np.asarray(count, float)
    angle = 2 * np.pi * (k - 1) / np.maximum(count - 1, 1)
    return np.where((k == 0)[..., None], 0.0, np.stack([np.cos(angle), np.sin(angle)], axis=-1))


def blurred(found: Array, pixels: tuple[int, int], count: int, radius: float) -> Array:
    """Averages (H, W, C) slices of any size around the pixels (width, height) of a picture, each sample interpolated."""
    rows, columns = found.shape[:2]
    y, x = np.meshgrid(np.arange(pixels[1]) + 0.5, np.arange(pixels[0]) + 0.5, indexing="ij")
    total = np.zeros((*x.shape, found.shape[2]))
    for k in range(count):
        off = radius * blur_place(k, count)
        u, v = (x + off[0]) * columns / pixels[0] - 0.5, (y + off[1]) * rows / pixels[1] - 0.5
        i, j = np.floor(u).astype(int), np.floor(v).astype(int)
        for di in (0, 1):
            for dj in (0, 1):
                weight = np.where(di, u - i, 1 - u + i) * np.where(dj, v - j, 1 - v + j)
                total += weight[..., None] * found[np.clip(j + dj, 0, rows - 1), np.clip(i + di, 0, columns - 1)]
    return total / count


# ---------------------------------------------------------------- earlier practice


def polygon_distance(q: Any, along: Any, part: Any) -> Array:
    """Finds (...) t at which rays meet the plane that a line across a window is extruded to; -1: nowhere. q, along (..., 2): their begin
    and direction across, and the half width there."""
    q, along, part = (np.asarray(one, float) for one in (q, along, part))
    under = along[..., 0] - part * along[..., 1]
    return np.where(under == 0, -1.0, -(q[..., 0] - part * q[..., 1]) / np.where(under == 0, 1, under))


def polygons(
    origins: Array, directions: Array, reaches: Array, light: PunctualLight, span: tuple[float, float], dices: int, maps: Any,
    scroll: Sequence[float] = (0.0, 0.0, 0.0, 0.0),
) -> Array:  # fmt: skip
    """Adds up (...) the polygons of a projector's or a spot's window, cut into so many strips each way; arguments as `printed` has them.
    span: m along the light's axis."""
    axes = light.axes()
    q, along = (origins - light.origin()) @ axes.T, directions @ axes.T
    total = np.zeros(reaches.shape)
    with np.errstate(divide="ignore", invalid="ignore"):
        for k in range(dices + 1):
            for axis, tangent in enumerate(light.tangents()):
                part = (2 * k / dices - 1) * tangent
                t = -(q[..., axis] - part * q[..., 2]) / (along[..., axis] - part * along[..., 2])
                at = q + t[..., None] * along
                own = light.cookie_place(at)[..., 1 - axis]
                place = np.stack([own, GRAIN * at[..., 2]], axis=-1)
                noise = _repeated(maps[..., 0], place + scroll[:2]) * _repeated(maps[..., 1], place + scroll[2:])
                inside = (t > 0) & (t < reaches) & (at[..., 2] >= span[0]) & (at[..., 2] <= span[1]) & (own >= 0) & (own <= 1)
                fade = 1 - (at[..., 2] - span[0]) / (span[1] - span[0])
                total += np.where(inside, GLOW * noise * fade, 0)
    return total / dices**STRIPS


def thickness(origins: Array, directions: Array, reaches: Array, light: PunctualLight) -> Array:
    """Measures (...) how much of rays lies between the planes around a light, times HAZE."""
    low, high = np.zeros(reaches.shape), reaches.astype(float)
    with np.errstate(divide="ignore", invalid="ignore"):
        for plane in light.planes():
            at, grows = origins @ plane[:3] + plane[3], directions @ plane[:3]
            low, high = np.where(grows > 0, np.maximum(low, -at / grows), low), np.where(grows < 0, np.minimum(high, -at / grows), high)
    return HAZE * np.maximum(high - low, 0)
