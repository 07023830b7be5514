"""Judges whether fog loses the light of suns: what of it is left in the air before an eye, and a depth of fog that lets it through."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from airlight.lights.directional import DirectionalLight
from airlight.lights.punctual import PunctualLight
from airlight.medium.resolve import VISIBLE_CONTRAST, ResolvedMedium
from airlight.messages import number
from airlight.projection import Matrix
from airlight.reference.height import height_column, height_density, mean_height_density

DARK_SHARE, LIT_SHARE = 0.05, 0.4  # of a sun's light: less makes dark fog; so much has the fog_depth that is advised
SIDES, STEPS = 5, 96  # rays along a side of the view, and steps of each
LEAST_CLIMB = 1e-6  # of a ray to the sun, a metre, as in the shaders
LEAST_DEPTH, TRIED = 1e-3, 50  # of a fog's own depth: the least that is advised; how many are tried


def doubt_of_suns(medium: ResolvedMedium, lights: Sequence[PunctualLight], view: Matrix, projection: Matrix) -> str | None:
    """Word one line where fog that is seen is dark, since of all suns' light hardly any gets through the air above; else None.

    view, projection: (4, 4), in the medium's coordinates. Other lights and ambient light are taken to show the fog.
    """
    shining = [light for light in lights if light.strength > 0 and max(light.intensity) > 0]
    suns = [light for light in shining if isinstance(light, DirectionalLight)]
    if not suns or len(suns) < len(shining) or not medium.fades_suns or medium.ambient.any():
        return None
    start, way = _rays(view, projection)
    lit, seen = lit_share(medium, suns, start, way)
    if seen < VISIBLE_CONTRAST or lit >= DARK_SHARE:
        return None
    depth = _depth_to_light(medium, suns, start, way)
    cure = f"a fog_depth of about {depth:g} m lets more of it through, or all with" if depth else "all of it does with"
    return f"the fog is dark: {100 * lit:.2g} % of the sun's light gets through the fog above; {cure} sun_extinction none"


def _rays(view: Matrix, projection: Matrix) -> tuple[Any, Any]:
    """Give (n, 3) starts and (n, 3) directions of rays spread over the view."""
    x, y = np.meshgrid(*[np.linspace(-0.8, 0.8, SIDES)] * 2)
    ends = np.stack([np.stack([x.ravel(), y.ravel(), np.full(x.size, z), np.ones(x.size)], axis=-1) for z in (0.0, 0.5)])
    ends = ends @ np.linalg.inv(np.asarray(projection, float) @ np.asarray(view, float)).T
    start, far = ends[..., :3] / ends[..., 3:]
    return start, (far - start) / np.linalg.norm(far - start, axis=1, keepdims=True)


def lit_share(medium: ResolvedMedium, suns: Sequence[DirectionalLight], start: Any, way: Any) -> tuple[float, float]:
    """Integrate the part of the light scattered along rays that is left by the fog between it and the sun it is most of; and the rays'
    mean opacity. Nothing but fog is looked at, in the colour that is dimmed least."""
    fog, layer = medium.settings.fog, (medium.fog_depth, medium.settings.fog_above)
    sigma = float(medium.sigma_t.min()) * medium.air
    edges = medium.max_distance * np.linspace(0, 1, STEPS + 1) ** 4
    t, step = (edges[1:] + edges[:-1]) / 2, np.diff(edges)
    first = start[:, 1:2] - medium.fog_base
    y = first + way[:, 1:2] * t
    scattered = sigma * height_density(y, layer, fog) * np.exp(-sigma * t * mean_height_density(first, y, layer, fog)) * step
    if not scattered.any():
        return 1.0, 0.0
    column = height_column(y, layer, fog)
    left = [np.exp(-sigma * s.density * s.extinction * column / max(s.direction[1], LEAST_CLIMB)) for s in suns]
    return max(float((scattered * one).sum() / scattered.sum()) for one in left), float(scattered.sum(axis=1).mean())


def _depth_to_light(medium: ResolvedMedium, suns: Sequence[DirectionalLight], start: Any, way: Any) -> float | None:
    """Find the greatest fog_depth, m, of which LIT_SHARE of a sun's light is left, to one digit; None where there is none."""
    for depth in medium.fog_depth * np.geomspace(1, LEAST_DEPTH, TRIED):
        if lit_share(replace(medium, fog_depth=float(depth)), suns, start, way)[0] >= LIT_SHARE:
            return float(number(float(depth), 1))
    return None
