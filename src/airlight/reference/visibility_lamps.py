"""The table of visibility of lamps, float64: twins of the functions of scatter/visibility/lamp*.wgsl, and a whole row of a table."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from airlight.medium.resolve import ResolvedMedium
from airlight.projection import depth_terms, eye_rays
from airlight.reference.lights import cone_ramp, range_window
from airlight.reference.medium import phase, transmittance
from airlight.reference.visibility import NO_SURFACE, SAMPLES, add_weighed, begin_sums, slopes
from airlight.scatter.visibility.grid import RowGrid

Array = npt.NDArray[Any]
LEAST_SINE = 1e-5  # of where a ray is seen from its end


def angle_from(x: Any, y: Any) -> Array:
    """Finds the angles of vectors from the axis of x, 0 to pi, for y of 0 or more."""
    return np.asarray(np.arctan2(np.asarray(y, float), np.asarray(x, float)))


def from_lamp(at: Any, across: Any, towards: Any) -> Array:
    """Finds directions (..., 3) from a lamp at which rays have so much of an angle there. at: (..., 2) cosine and sine of it."""
    at = np.asarray(at, float)
    return np.asarray(at[..., 1:] * np.asarray(across, float) - at[..., :1] * np.asarray(towards, float))


def along_axis(i: Any, v: Any, light: Any) -> Array:
    """Measures how far vectors (..., 3) go along the axes of shadow views (...)."""
    ahead = light["view"]["matrix"].astype(float)[i][..., :3, 3]  # columns
    return np.asarray((ahead * np.asarray(v, float)).sum(axis=-1))


def face_towards(v: Any, light: Any) -> npt.NDArray[np.int64]:
    """Chooses the faces of the cube around a point light that directions (..., 3) from it meet: those along whose axes they go farthest."""
    return np.stack([along_axis(i, v, light) for i in range(6)]).argmax(axis=0)


def projected(matrix: Any, v: Any) -> Array:
    """Projects vectors (..., 3) by a view's matrix, (..., 4, 4) columns: (..., 3) x w, y w, w, in texels."""
    out = np.einsum("...ji,...j->...i", np.asarray(matrix, float)[..., :3, :], np.asarray(v, float))
    return out[..., [0, 1, 3]]


def ahead_at(depth: Any, frame: Any) -> Array:
    """Converts depths (...) to m along the camera's axis."""
    a, b, c, d = frame["depth"].astype(float)
    return np.asarray((a * depth + b) / (c * depth + d))


def block_ahead(ahead: Any, across: Any, towards: Any, lamp: Any) -> Array:
    """Finds the blocks of places that lie `ahead` m along the camera's axis on rays that go so far across and towards the lamp a metre."""
    angle = np.arctan2(ahead * np.maximum(across, 0), float(lamp["away"]) - ahead * np.asarray(towards, float))
    return np.asarray((angle - float(lamp["begin"])) / float(lamp["wide"]))


def scattered_at(eye: Any, at: Any, away: Any, frame: Any, light: Any, kind: int) -> Array:
    """Evaluates (..., 3) phase function times transmittance at angles at the lamp, beyond the way from the lamp to the eye itself. eye, at:
    (..., 2) cosine and sine of the angles at the eye and at the lamp; away: m between them."""
    eye, at = np.asarray(eye, float), np.asarray(at, float)
    sine = at[..., 1] * eye[..., 0] + at[..., 0] * eye[..., 1]
    way = away * ((at[..., 1] + eye[..., 1]) / np.maximum(sine, LEAST_SINE) - 1)
    cosine = at[..., 0] * eye[..., 0] - at[..., 1] * eye[..., 1]
    there = phase(cosine, light["lobes"].astype(float), kind)[..., None] * transmittance(np.maximum(way, 0), frame["sigma_t"])
    return np.where((sine > LEAST_SINE)[..., None], there, 0.0)


def mean_of_cone(axis: Any, at: Any, eighth: Any, light: Any) -> Array:
    """Evaluates the mean of a spot's falloff over blocks, from four places each. axis: (..., 2) of their rows; at: (..., 2) cosine and
    sine of their middles; eighth: of an eighth of a block."""
    axis, at = np.asarray(axis, float), np.asarray(at, float)
    eighth = np.asarray(eighth, float)
    part = np.arctan2(eighth[..., 1], eighth[..., 0])[..., None] * np.array([-3, -1, 1, 3])
    middle = np.arctan2(at[..., 1], at[..., 0])[..., None] + part
    cosine = np.sin(middle) * axis[..., :1] - np.cos(middle) * axis[..., 1:]
    return np.asarray((cone_ramp(cosine, float(light["cone_scale"]), float(light["cone_offset"])) ** 2).mean(axis=-1))


def weigh(rays: Mapping[str, Array], at: Any, sigma: float, away: float, light: Any, kind: int) -> dict[str, Array]:
    """Weighs places of rays (...) by what is scattered there where all is lit. at: (2,) cosine and sine of their angle at the lamp."""
    cosine, sine = (np.asarray(rays[name], float) for name in ("cosine", "sine"))
    apart = at[1] * cosine + at[0] * sine
    way = np.maximum(away * ((at[1] + sine) / np.maximum(apart, LEAST_SINE) - 1), 0)
    there = phase(at[0] * cosine - at[1] * sine, light["lobes"].astype(float), kind) * np.exp(-sigma * way)
    return {"weight": np.where(apart > LEAST_SINE, there, 0.0), "way": way}


def weights_in_layer(
    rays: Mapping[str, Array], begin: Any, end: Any, part: float, at: Any, sigma: float, away: float, light: Any, kind: int, colours: bool
) -> dict[str, Array]:
    """Weighs the middle of the block after `part` of a layer; where colours do not differ it lies evenly between the layer's ends."""
    if colours:
        return weigh(rays, at, sigma, away, light, kind)
    first, last = np.asarray(begin["weight"], float), np.asarray(end["weight"], float)
    return {"weight": first + part * (last - first), "way": np.asarray(begin["way"], float)}


def windows(rays: Mapping[str, Array], at: Any, away: float, light: Any) -> Array:
    """Evaluates the window of the light's range in places of rays (...). at: as of `weigh`."""
    cosine, sine = (np.asarray(rays[name], float) for name in ("cosine", "sine"))
    return range_window(away * sine / np.maximum(at[1] * cosine + at[0] * sine, LEAST_SINE), float(light["range"]))


def lamp_visibilities(
    grid: RowGrid,
    row: int,
    projection: Any,
    maps: Sequence[Any],
    depth: Any,
    light: Any,
    lamp: Any,
    kind: int,
    is_cone: bool,
    medium: ResolvedMedium,
    blocks: int,
) -> tuple[Array, Array]:
    """Sums a row of a lamp's table: V and its slope, as it is stored, (blocks, rays) each, after each block.

    maps: (side, side) depths of each of the light's views; depth: (H, W) of the picture; light, lamp: records as the shaders have them;
    kind: of the phase function. The maps' texels are looked up one by one.
    """
    count = int(grid.rays[grid.edge[row]])
    share = (np.arange(count) / (count - 1))[:, None] ** 2
    p = grid.begin[row] + share * (grid.end[row] - grid.begin[row])
    (scale_x, scale_y, from_x, from_y), _ = eye_rays(projection)
    ray = np.column_stack([p / np.array(grid.size) * (scale_x, scale_y) + (from_x, from_y), -np.ones(count)])
    aim, away, begin, wide = lamp["towards"].astype(float), float(lamp["away"]), float(lamp["begin"]), float(lamp["wide"])
    across = ray[-1] - (ray[-1] @ aim) * aim
    across /= np.linalg.norm(across)
    r, w, long = ray @ across, ray @ aim, np.linalg.norm(ray, axis=1)
    at = np.clip(np.floor(p).astype(int), 0, np.array(grid.size) - 1)
    a, b, c, d = depth_terms(projection)
    z = np.asarray(depth, float)[at[:, 1], at[:, 0]]
    ahead = (a * z + b) / (c * z + d)
    surface = np.where((z < 1) & (ahead * long < medium.max_distance), block_ahead(ahead, r, w, lamp), NO_SURFACE)
    rays: dict[str, Array] = {"cosine": w / long, "sine": np.maximum(r, 1e-9) / long}
    sums, spread = begin_sums(surface), float(np.ptp(medium.sigma_t))
    sigma = float(medium.sigma_t.max() + medium.sigma_t.min()) / 2
    axis = np.array([across @ light["axis"], aim @ light["axis"]])
    step, values, changes = 2 if spread > 0 else 3, [], []

    def turned(block: float) -> Array:
        angle = begin + block * wide
        return np.array([np.cos(angle), np.sin(angle)])

    def views(v: Array) -> Array:
        return np.stack([projected(light["view"]["matrix"][i], v) for i in range(len(maps))])

    for k in range(blocks):
        first = k // step * step
        start, end = (weigh(rays, turned(n), sigma, away, light, kind) for n in (first, first + step))
        lit = np.zeros(count)
        for j in range(SAMPLES):
            here = turned(k + (j + 0.5) / SAMPLES)
            q = views(from_lamp(here, across, aim))
            i = int(q[:, 2].argmax())
            x, y = q[i, :2] / q[i, 2]
            inside = q[i, 2] > 0 and 0 <= x < len(maps[i]) and 0 <= y < len(maps[i])
            h = away * q[i, 2] * float(maps[i][int(y), int(x)]) / float(light["view"]["depth_scale"][i]) if inside else 1e9
            lit += w * here[1] + r * (here[0] - h) >= 0
        middle = turned(k + 0.5)
        weights = weights_in_layer(rays, start, end, (k - first + 0.5) / step, middle, sigma, away, light, kind, spread > 0)
        cone = mean_of_cone(axis, middle, [np.cos(wide / 8), np.sin(wide / 8)], light) if is_cone else 1.0
        strength = cone * (windows(rays, middle, away, light) if light["range"] > 0 else 1.0)
        sums |= add_weighed(sums, lit / SAMPLES, weights["weight"], weights["way"], strength, float(k), 1.0, wary=True)
        values.append(sums["stored"] / sums["u"])
        changes.append(slopes(sums, spread))
    return np.array(values), np.array(changes)
