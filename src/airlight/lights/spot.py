"""Defines spot lights."""

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from airlight.lights.punctual import PositionalLight, Triple
from airlight.medium.resolve import ResolvedMedium
from airlight.projection import Matrix
from airlight.shadows import ShadowView
from airlight.shadows.fit import perspective_view

WIDEST_HALF_ANGLE = math.radians(89.0)  # of a spot's shadow map


@dataclass(frozen=True)
class SpotLight(PositionalLight):
    """Describes a cone of light around `direction`, the unit vector in which it shines. One shadow view holds it.

    inner, outer: half angles, radians; between them the light falls as the square of a ramp that is linear in the cosine.
    """

    direction: Triple = (0.0, 1.0, 0.0)
    inner: float = field(default=0.0, kw_only=True)
    outer: float = field(default=math.pi / 4, kw_only=True)

    kind = "spot"
    word = "spot"
    flags = {"CONE": True}

    def axis(self) -> Triple:
        return self.direction

    def tangents(self) -> tuple[float, float]:
        half = math.tan(min(self.outer, WIDEST_HALF_ANGLE))
        return half, half

    def cone(self) -> tuple[float, float]:
        outer = math.cos(self.outer)
        scale = 1.0 / max(0.001, math.cos(self.inner) - outer)
        return scale, -outer * scale

    def cone_cosine(self) -> float:
        return math.cos(self.outer)

    def kink_cosines(self) -> tuple[float, ...]:
        scale, offset = self.cone()
        return -offset / scale, (1 - offset) / scale

    def shadow_layers(self, medium: ResolvedMedium) -> int:
        return 1

    def shadow_views(self, view: Any, projection: Any, hulls: Matrix, medium: ResolvedMedium) -> list[ShadowView]:
        """Fits the view that just holds the cone; of wider ones than WIDEST_HALF_ANGLE as much as that."""
        half = math.tan(min(self.outer, WIDEST_HALF_ANGLE))
        return [perspective_view(np.array(self.position), self.near, hulls, medium.shadow_size, self.direction, half)]
