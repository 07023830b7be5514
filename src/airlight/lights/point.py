"""Defines point lights."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from airlight.lights.punctual import PositionalLight, Triple
from airlight.medium.resolve import ResolvedMedium
from airlight.projection import Matrix
from airlight.shadows import ShadowView
from airlight.shadows.fit import perspective_view


@dataclass(frozen=True)
class PointLight(PositionalLight):
    """Describes a light that shines in all directions alike. Six shadow views are the faces of a cube around it."""

    kind = "point"
    word = "point"
    flags = {"CUBE": True}

    def axis(self) -> Triple:
        return 0.0, -1.0, 0.0

    def shadow_layers(self, medium: ResolvedMedium) -> int:
        return 6

    def shadow_views(self, view: Any, projection: Any, hulls: Matrix, medium: ResolvedMedium) -> list[ShadowView]:
        """Fits six views, along +X, -X, +Y, -Y, +Z, -Z of the world, each of 90 degrees and a margin of MARGIN_TEXELS around it.

        A position belongs to the view with the greatest w, its distance along the view's axis: the dominant of its coordinates.
        """
        position, size = np.array(self.position), medium.shadow_size
        return [perspective_view(position, self.near, hulls, size, sign * axis, 1.0) for axis in np.eye(3) for sign in (1, -1)]
