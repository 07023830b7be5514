"""Defines directional lights: suns."""

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from airlight.lights.punctual import Array, PunctualLight, Triple
from airlight.lights.shape import axes_along
from airlight.medium.resolve import ResolvedMedium
from airlight.projection import Matrix
from airlight.shadows import ShadowView
from airlight.shadows.fit import NEAR_SHARE, ball, basis, orthographic_view, rung, slice_ball, splits


@dataclass(frozen=True)
class DirectionalLight(PunctualLight):
    """Describes a light so far away that its rays are parallel, and lose nothing before they scatter.

    direction: unit, towards it. angular_radius: radians, for soft shadows; 0: the medium's setting.
    """

    direction: Triple = (0.0, 1.0, 0.0)
    angular_radius: float = field(default=0.0, kw_only=True)

    kind = "directional"
    word = "sun"
    directional = True
    flags = {"DIRECTIONAL": True}

    def in_view(self, view: Matrix) -> Array:
        return np.asarray(view[:3, :3] @ self.direction)

    def axis(self) -> Triple:
        return self.direction

    def axes(self) -> Array:
        return axes_along(np.negative(self.direction), (0.0, 1.0, 0.0)) if self.turned is None else np.asarray(self.turned, float)

    def cookie_place(self, q: Array) -> Array:
        assert self.cookie is not None
        rows, columns = self.cookie.pixels.shape[:2]
        wide = self.cookie.size
        return np.stack([0.5 + q[..., 0] / wide, 0.5 - q[..., 1] / (wide * rows / columns)], axis=-1)

    def disc_tangent(self, default: float) -> float:
        return math.tan(self.angular_radius or math.radians(default))

    def incident(self, points: Array) -> tuple[Array, Array, Array]:
        near = np.zeros(points.shape[:-1])
        return -self.travel(points), near, near + 1

    def travel(self, points: Array) -> Array:
        return np.broadcast_to(-np.asarray(self.direction, float), points.shape)

    def shadow_layers(self, medium: ResolvedMedium) -> int:
        return medium.march.cascades

    def shadow_views(self, view: Any, projection: Any, hulls: Matrix, medium: ResolvedMedium) -> list[ShadowView]:
        """Fits cascades, near to far: each holds a ball around its slice of what is seen, or, where that is larger, all casters.

        Balls and casters are held by whole texels of a lattice that is fixed in the world, so that edges do not swim as a camera moves.
        Where one map holds all casters it is the last one. Beyond a map everything is lit, since nothing casts there.
        """
        axes, size, march = basis(self.direction), medium.shadow_size, medium.march
        into = np.linalg.inv(np.asarray(view, np.float64))
        if not len(hulls):
            hulls = into[:3, 3] + np.zeros((1, 8, 3))
        local = hulls @ axes.T
        low, high = local.min(axis=(0, 1)), local.max(axis=(0, 1))
        half = rung(float((high - low)[:2].max()) / 2)
        centre, radius = ball(hulls)
        away = float(np.linalg.norm(centre - into[:3, 3]))
        far = min(medium.sun_reach, rung(away + radius))
        near = max(rung(away - radius, up=False), far * NEAR_SHARE)
        ends = splits(near if near < far else far * NEAR_SHARE, far, march.cascades, march.cascade_split)
        out: list[ShadowView] = []
        start = before = 0.0
        for end in [*ends, np.inf]:
            at, reach = slice_ball(projection, before, min(end, medium.sun_reach))
            if half <= reach:
                return [*out, orthographic_view(axes, (low + high) / 2, half, size, local, (start, np.inf))]
            out.append(orthographic_view(axes, axes @ (into @ np.append(at, 1.0))[:3], reach, size, local, (start, float(end))))
            before = end - march.cascade_blend * (end - start)
            start = end
        return out
