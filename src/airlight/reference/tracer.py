"""Traces light that a medium scatters once, from triangles, as ground truth: float64, NumPy, nothing of the shaders or of shadow maps.

Visibility is exact. What a triangle hides from a light is a convex cone, cut off by the triangle's plane: four half spaces, so that a
ray is in it on one interval, whose ends are roots of linear functions. The lit rest of a ray is integrated in closed form for suns, for
lights with a position by Gauss's rule in v, t = t0 + h sinh v (t0, h: the ray's nearest point to the light, and its distance): there
t + d = t0 + h e^v, dt / d^2 = dv / (h cosh v), and every phase function is analytic to within pi / 2 of the real line, whatever its
anisotropy.
"""

from collections.abc import Callable, Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from airlight.lights.punctual import PositionalLight, PunctualLight
from airlight.medium.resolve import ResolvedMedium
from airlight.projection import depth_terms, eye_rays
from airlight.reference import paths
from airlight.reference.medium import Layer, glow_between, transmittance, transmittance_integral
from airlight.reference.medium import phase as phase_of
from airlight.reference.shaped import clipped, crossings, divided

Array = npt.NDArray[Any]
Segments = tuple[Array, Array, Array]  # (n,) rays, and where on each a segment starts and ends, m
TILE_PX = 16  # pixels, of a tile for which triangles are chosen
PANEL_WIDTH = 1.0  # of v, and nodes of Gauss's rule on it
NODES = np.polynomial.legendre.leggauss(12)
VARIED_PANEL_WIDTH, VARIED_NODES = 0.3, np.polynomial.legendre.leggauss(3)  # where panels are short anyway
TURN_PANEL_WIDTH = 0.05  # where a light's intensity is that of a table of directions
PATTERNED_DEPTH = 0.5  # optical depth of a panel of a directional light with a cookie, at most
BARYCENTRIC_SLACK = 1e-12  # of a barycentric coordinate: a ray through an edge that two triangles share meets one of them
MIN_APPROACH_METRES = 1e-9  # m: a ray is no nearer to a light


class Tile(NamedTuple):
    """Holds rays of a part of a picture: (R, 3) origins and directions, (R,) where they begin and end, m, and what encloses them."""

    origin: Array
    ray: Array
    near: Array
    reach: Array
    beam: tuple[Array, Array]


# Divides segments by the share of their light that reaches the eye; of a light's number, or None: of what is around
Divide = Callable[[Tile, int | None, Segments], Iterable[tuple[float, Segments]]]


def _undivided(tile: Tile, number: int | None, segments: Segments) -> Iterable[tuple[float, Segments]]:
    return ((1.0, segments),)


def layer(
    view: Any,
    projection: Any,
    size: tuple[int, int],
    triangles: Array,
    lights: Sequence[PunctualLight],
    medium: ResolvedMedium,
    casters: Array | None = None,
    told: Callable[[float], None] = lambda share: None,
    divide: Divide = _undivided,
) -> Layer:
    """Computes the layer of a medium: radiance that it scatters to the eye, transmittance, and the distance to which these are summed.

    view, projection: (4, 4) of the camera; size: (width, height), one ray through the centre of each pixel. triangles: (N, 3, 3), world,
    what the eye sees; casters: (M, 3, 3) what hides light, None: the same. Both sides of them do.
    told: is called with the share that is done. divide: tells what dims light besides the medium, as `panes` does.
    """
    width, height = size
    triangles = np.asarray(triangles, float).reshape(-1, 3, 3)
    casters = triangles if casters is None else np.asarray(casters, float).reshape(-1, 3, 3)
    volumes = [shadow_volumes(casters, light) for light in lights]
    into = np.linalg.inv(np.asarray(view, float))
    near, far = _depths(projection)
    found, reach, lengths = np.zeros((height, width, 3)), np.zeros((height, width)), np.zeros((height, width))
    for top in range(0, height, TILE_PX):
        told(top / height)
        for left in range(0, width, TILE_PX):
            rows, columns = np.arange(top, min(top + TILE_PX, height)), np.arange(left, min(left + TILE_PX, width))
            y, x = (k.ravel() for k in np.meshgrid(rows, columns, indexing="ij"))
            where = np.s_[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
            origin, ray, slope = camera_rays(into, projection, (x + 0.5) / width, (y + 0.5) / height)
            u, v = np.array([[columns[0], columns[-1] + 1], [rows[0], rows[-1] + 1]]) / [[width], [height]]
            start, side, length = camera_rays(into, projection, u[[0, 1, 1, 0]], v[[0, 0, 1, 1]])
            beam = start, side * length[:, None]
            t = _hits(origin, ray, triangles[in_beam(triangles, beam)], near * slope, far * slope)
            t = np.minimum(t, medium.max_distance)
            along = None if paths.is_even(medium) else paths.Lengths(origin, ray, t, medium)
            length = t if along is None else along.total
            tile = Tile(origin, ray, near * slope, t, beam)
            radiance = np.zeros((len(t), 3))
            for share, segments in divide(tile, None, (np.arange(len(t)), np.zeros_like(t), t)):
                radiance += share * _from_around(*segments, medium, along, len(t))
            for number, (light, volume) in enumerate(zip(lights, volumes, strict=True)):
                end = np.minimum(t, medium.sun_reach) if light.directional else t
                own, fade = light.own_medium(medium), light.fade(into[:3, 3], medium)
                for share, segments in divide(tile, number, lit(origin, ray, end, in_reach(tile, *volume))):
                    radiance += share * fade * in_scattered(origin, ray, *segments, light, own, along and along.of(own))
            found[where], reach[where] = radiance.reshape(len(rows), -1, 3), t.reshape(len(rows), -1)
            lengths[where] = length.reshape(len(rows), -1)
    return Layer(found, transmittance(lengths, medium.sigma_t), reach)


# ---------------------------------------------------------------- rays


def camera_rays(into: Array, projection: Any, u: Array, v: Array) -> tuple[Array, Array, Array]:
    """Makes (R, 3) origins, (R, 3) unit directions, world, and (R,) metres along the ray for one along the view's axis."""
    (a, b, c, d), flat = eye_rays(projection)
    x, y = a * u + c, b * v + d
    zero, one = np.zeros_like(x), np.ones_like(x)
    ray = np.stack([(1 - flat) * x, (1 - flat) * y, -one], axis=1)
    slope = np.linalg.norm(ray, axis=1)
    start = np.stack([flat * x, flat * y, zero], axis=1)
    return start @ into[:3, :3].T + into[:3, 3], (ray / slope[:, None]) @ into[:3, :3].T, slope


def _depths(projection: Any) -> tuple[float, float]:
    """Computes the distances along the view's axis between which something is drawn."""
    a, b, c, e = depth_terms(projection)
    ends = [(a * d + b) / (c * d + e) if abs(c * d + e) > 1e-300 else np.inf for d in (0.0, 1.0)]
    return max(float(min(ends)), 0.0), float(max(ends))


def in_beam(corners: Array, beam: tuple[Array, Array], travel: Array | None = None) -> Array:
    """Selects, (K,) bool, hulls of corners (K, 3, 3), and of rays from them along travel (K, 3, 3), that may meet what 4 rays enclose."""
    origin, ray = beam
    middle = (origin + ray).mean(axis=0)
    out = np.zeros(len(corners), bool)
    for i in range(4):
        j = (i + 1) % 4
        normal = np.cross(ray[i], origin[j] + ray[j] - origin[i])
        normal *= -np.sign(normal @ (middle - origin[i]))  # outwards
        beyond = np.all((corners - origin[i]) @ normal > 0, axis=1)
        out |= beyond if travel is None else beyond & np.all(travel @ normal > 0, axis=1)
    return ~out


def _hits(origin: Array, ray: Array, triangles: Array, near: Array, far: Array) -> Array:
    """Finds (R,) the distance along each ray to the first triangle from near to far; inf where there is none."""
    return np.asarray(hit_distances(origin, ray, triangles, near, far).min(axis=1, initial=np.inf))


def hit_distances(origin: Array, ray: Array, triangles: Array, near: Array, far: Array) -> Array:
    """Finds (R, K) distances along rays to triangles (K, 3, 3) from near to far; inf where one is not met. Moeller and Trumbore 1997."""
    a, e, f = triangles[:, 0], triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        p = np.cross(ray[:, None], f)
        scale = 1 / np.einsum("rkj,kj->rk", p, e)
        away = origin[:, None] - a
        u = np.einsum("rkj,rkj->rk", away, p) * scale
        q = np.cross(away, e)
        v = np.einsum("rkj,rj->rk", q, ray) * scale
        t = np.einsum("rkj,kj->rk", q, f) * scale
        within = (t >= near[:, None]) & (t <= far[:, None])
        inside = within & (u >= -BARYCENTRIC_SLACK) & (v >= -BARYCENTRIC_SLACK) & (u + v <= 1 + BARYCENTRIC_SLACK)
    return np.asarray(np.where(inside, t, np.inf))


# ---------------------------------------------------------------- what is lit


def shadow_volumes(triangles: Array, light: PunctualLight) -> tuple[Array, Array, Array]:
    """Makes the volumes that triangles hide from a light: (K, 4, 4) planes, positive in one, (K, 3, 3) corners and (K, 3, 3) edges.

    Triangles that the light only grazes hide nothing.
    """
    travel = light.travel(triangles)
    face = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    away = np.einsum("kj,kj->k", face, travel[:, 0])
    some = np.abs(away) > 1e-14 * np.linalg.norm(face, axis=1) * np.linalg.norm(travel[:, 0], axis=1)
    triangles, travel, face, away = triangles[some], travel[some], face[some], away[some]
    planes = np.empty((len(triangles), 4, 4))
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        normal = np.cross(travel[:, i], triangles[:, j] - triangles[:, i] if light.directional else travel[:, j])
        planes[:, i, :3] = normal * np.sign(np.einsum("kj,kj->k", normal, triangles[:, k] - triangles[:, i]))[:, None]
        planes[:, i, 3] = -np.einsum("kj,kj->k", planes[:, i, :3], triangles[:, i])
    planes[:, 3, :3] = face * np.sign(away)[:, None]
    planes[:, 3, 3] = -np.einsum("kj,kj->k", planes[:, 3, :3], triangles[:, 0])
    return planes, triangles, np.asarray(travel)


def _meets(planes: Array, beam: tuple[Array, Array], reach: float) -> Array:
    """Selects, (K,) bool, the volumes of whose planes none parts them from what the beam's rays enclose up to a distance."""
    origin, ray = beam
    ends = np.concatenate([origin, origin + ray * reach])  # of which 1 m is one along the view's axis
    return np.asarray(np.all(np.any(planes[:, :, :3] @ ends.T + planes[:, :, 3:] > 0, axis=2), axis=1))


def in_reach(tile: Tile, planes: Array, corners: Array, edges: Array) -> Array:
    """Selects, (M, 4, 4), the planes of shadow volumes that rays of a tile may meet, see `shadow_volumes`."""
    planes = planes[in_beam(corners, tile.beam, edges)]
    return np.asarray(planes[_meets(planes, tile.beam, float(tile.reach.max()))])


def hidden(origin: Array, ray: Array, reach: Array, planes: Array) -> tuple[Array, Array]:
    """Finds (R, K) where rays, from 0 to reach (R,), enter the volumes (K, 4, 4), and leave them: before that, if they meet them not."""
    low, high = np.zeros((len(ray), len(planes))), np.repeat(reach[:, None], len(planes), axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        for i in range(4):
            at, grows = origin @ planes[:, i, :3].T + planes[:, i, 3], ray @ planes[:, i, :3].T
            root = -at / grows
            low = np.where(grows > 0, np.maximum(low, root), np.where((grows == 0) & (at <= 0), np.inf, low))
            high = np.where(grows < 0, np.minimum(high, root), high)
    return low, high


def lit(origin: Array, ray: Array, reach: Array, planes: Array) -> Segments:
    """Finds the lit segments of rays, from 0 to reach (R,), in none of the volumes (K, 4, 4)."""
    low, high = hidden(origin, ray, reach, planes)
    dark = low < high
    most = int(dark.sum(axis=1).max(initial=0))
    order = np.argsort(np.where(dark, low, np.inf), axis=1)[:, :most]
    low, high, dark = (np.take_along_axis(x, order, axis=1) for x in (low, high, dark))
    ends = np.column_stack([np.where(dark, low, 0.0), reach])
    starts = np.column_stack([np.zeros(len(ray)), np.maximum.accumulate(np.where(dark, high, 0.0), axis=1)])
    which, column = np.nonzero(ends > starts)
    return which, starts[which, column], ends[which, column]


# ---------------------------------------------------------------- light


def phase(cosine: Array, medium: ResolvedMedium, light: PunctualLight) -> Array:
    """Evaluates the medium's phase function, 1/sr, for a light; cosine 1: looking into the light."""
    kind, *lobes = medium.lobes(light.anisotropy)
    return phase_of(cosine, lobes, kind)


def _from_around(which: Array, start: Array, end: Array, medium: ResolvedMedium, along: paths.Lengths | None, count: int) -> Array:
    """Integrates (count, 3) radiance of ambient light over segments."""
    if not np.any(medium.ambient):
        return np.zeros((count, 3))
    low, high = (start, end) if along is None else (along.to(which, start), along.to(which, end))
    parts = np.exp(-low[:, None] * medium.sigma_t) * transmittance_integral(high - low, medium.sigma_t)
    return medium.sigma_s * medium.ambient * _summed(parts, which, count)


def in_scattered(
    origin: Array,
    ray: Array,
    which: Array,
    start: Array,
    end: Array,
    light: PunctualLight,
    medium: ResolvedMedium,
    along: paths.Lengths | None = None,
) -> Array:
    """Integrates (R, 3) radiance over lit segments, see `lit`. along: optical lengths of the rays; None: where density is 1 everywhere."""
    power = medium.sigma_s * light.intensity * light.strength
    which, start, end = clipped((which, start, end), origin, ray, light)
    if isinstance(light, PositionalLight):
        return power * _summed(*_over_panels(origin, ray, which, start, end, light, medium, along), len(ray))
    shaped = light.cookie is not None
    if shaped:
        _, (which, start, end) = divided((which, start, end), crossings(origin, ray, light, _farthest(which, end, len(ray))))
    if along is not None:
        parts, which = paths.directional(which, start, end, light, along, medium.sigma_t)
    elif shaped:
        parts, which = _patterned(origin, ray, which, start, end, light, medium)
    else:
        parts = np.exp(-start[:, None] * medium.sigma_t) * transmittance_integral(end - start, medium.sigma_t)
    to_light, _, irradiance = light.incident(origin)
    glow = medium.settings.sun_glow
    there = (1 - glow) * phase((ray * to_light).sum(axis=1), medium, light) + glow * glow_between(ray, to_light, medium.glow_concentration)
    there = there * irradiance
    return power * there[:, None] * _summed(parts, which, len(ray))


def _farthest(which: Array, end: Array, count: int) -> Array:
    """Finds (R,) where the last segment of each ray ends."""
    found = np.zeros(count)
    np.maximum.at(found, which, end)
    return found


def _patterned(
    origin: Array, ray: Array, which: Array, start: Array, end: Array, light: PunctualLight, medium: ResolvedMedium
) -> tuple[Array, Array]:
    """Integrates transmittance times a directional light's shape over segments in which that is smooth: (n, 3) m, and (n,) their rays."""
    parts = np.ceil((end - start) * medium.sigma_t.max() / PATTERNED_DEPTH).clip(1).astype(int)
    part = np.arange(parts.sum()) - np.repeat(np.cumsum(parts) - parts, parts)
    which, start, long = (np.repeat(x, parts) for x in (which, start, (end - start) / parts))
    found = np.zeros((len(which), 3))
    for node, weight in zip(*VARIED_NODES):
        t = start + long * (part + (node + 1) / 2)
        colour = light.colour(origin[which] + t[:, None] * ray[which])
        found += (weight * long / 2)[:, None] * np.exp(-t[:, None] * medium.sigma_t) * colour
    return found, which


def _summed(parts: Array, which: Array, count: int) -> Array:
    """Sums (n, 3) by the ray that each belongs to."""
    return np.stack([np.bincount(which, parts[:, c], count) for c in range(3)], axis=1)


def _over_panels(
    origin: Array,
    ray: Array,
    which: Array,
    start: Array,
    end: Array,
    light: PositionalLight,
    medium: ResolvedMedium,
    along: paths.Lengths | None,
) -> tuple[Array, Array]:
    """Integrates p E e^(-sigma (t + d)), E the irradiance, over panels of v: (n, 3) integrals, and (n,) their rays."""
    to_light = -light.travel(origin)
    nearest = np.einsum("rj,rj->r", to_light, ray)
    h = np.maximum(np.linalg.norm(to_light - nearest[:, None] * ray, axis=1), MIN_APPROACH_METRES)
    breaks = break_distances(light, ray, to_light, nearest, h)
    breaks = np.column_stack([breaks, crossings(origin, ray, light, nearest)])[which]
    if along is not None:
        part, start, end = paths.panels(which, start, end, along)
        which, breaks = which[part], breaks[part]
    marks = np.sort(np.column_stack([start, np.clip(breaks, start[:, None], end[:, None]), end]), axis=1)
    low, high = np.arcsinh((np.stack([marks[:, :-1], marks[:, 1:]]) - nearest[which, None]) / h[which, None])
    row, column = np.nonzero(high > low)
    which, low, high = which[row], low[row, column], high[row, column]
    width, rule = (VARIED_PANEL_WIDTH, VARIED_NODES) if medium.varies or light.cookie is not None else (PANEL_WIDTH, NODES)
    width = width if light.photometry is None else TURN_PANEL_WIDTH
    panels = np.ceil((high - low) / width).astype(int)
    part = np.arange(panels.sum()) - np.repeat(np.cumsum(panels) - panels, panels)
    which, low, half = (np.repeat(x, panels) for x in (which, low, (high - low) / panels / 2))
    result = np.zeros((len(which), 3))
    t0, h, start, ray = nearest[which], h[which], origin[which], ray[which]
    for node, weight in zip(*rule):
        v = low + half * (2 * part + 1 + node)
        d = h * np.cosh(v)
        place = start + (t0 + h * np.sinh(v))[:, None] * ray
        _, away, irradiance = light.incident(place)
        seen = (phase(-np.tanh(v), medium, light) * irradiance * away**2 * weight * half / d)[:, None] * light.colour(place)
        if along is None:
            result += seen * np.exp(-np.maximum(t0 + h * np.exp(v), 0)[:, None] * medium.sigma_t)
        else:
            result += seen * paths.lamp_factor(which, t0 + h * np.sinh(v), light, along, medium.sigma_t)
    return result, which


def break_distances(light: PositionalLight, ray: Array, to_light: Array, nearest: Array, h: Array) -> Array:
    """Finds (R, n) distances at which the integrand is not smooth: where a ray meets a light's range, and the kinks around its axis."""
    found = []
    if light.range:
        half = np.sqrt(np.maximum(light.range**2 - h**2, 0))
        found += [nearest - half, nearest + half]
    along, ahead = ray @ np.asarray(light.axis(), float), -(to_light @ np.asarray(light.axis(), float))
    for cosine in light.kink_cosines():
        # (ahead + along t)^2 = cosine^2 (h^2 + (t - nearest)^2)
        a, b = along**2 - cosine**2, ahead * along + cosine**2 * nearest
        c = ahead**2 - cosine**2 * (h**2 + nearest**2)
        root = np.sqrt(np.maximum(b * b - a * c, 0))
        q = -(b + np.where(b < 0, -root, root))
        with np.errstate(divide="ignore", invalid="ignore"):
            found += [np.nan_to_num(q / a, nan=0, posinf=0, neginf=0), np.nan_to_num(c / q, nan=0, posinf=0, neginf=0)]
    return np.stack(found, axis=1) if found else np.zeros((len(h), 0))
