"""Defines projectors: light in a frustum."""

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from airlight.lights.numbers import unit_plane
from airlight.lights.punctual import Array, PositionalLight, Triple
from airlight.lights.shape import axes_along
from airlight.medium.resolve import ResolvedMedium
from airlight.projection import Matrix
from airlight.shadows import ShadowView
from airlight.shadows.fit import perspective_view

NEAR = 0.1  # m: unset
MOST = 1e9  # m, candela, 1/m^2
LIMITS = {"near": (1e-6, MOST), "far": (1e-6, MOST), "fov": (1e-3, 179.0), "ambient": (0.0, MOST), "intensity": (0.0, MOST)}  # fov: degrees
MOST_CLIPS = 6  # beside the frustum's planes, as shape.wgsl holds 12
FALLOFFS = ("inverse-square", "inverse", "constant")  # with the distance; only the first is physical


@dataclass(frozen=True)
class ProjectorLight(PositionalLight):
    """Describes light in a frustum, as of a slide projector: candela on its axis and, without a cookie, alike all over it.

    direction, up: unit, at right angles. fov: full angles across and up, radians. near, far: m along the axis, between which there is light
    and its shadows begin; far 0: no end. The air dims it from the position on. falloff: one of FALLOFFS with the distance d, as of 1 m
    there: 1/d^2, 1/d, or 1; ambient: is added to it, 1/m^2. clip: (a, b, c, d), world: further planes, a x + b y + c z + d >= 0 where there
    is light.
    """

    direction: Triple = (0.0, 0.0, -1.0)
    up: Triple = (0.0, 1.0, 0.0)
    fov: tuple[float, float] = field(default=(math.pi / 4, math.pi / 4), kw_only=True)
    far: float = field(default=0.0, kw_only=True)
    falloff: str = field(default="inverse-square", kw_only=True)
    ambient: float = field(default=0.0, kw_only=True)
    clip: tuple[tuple[float, float, float, float], ...] = field(default=(), kw_only=True)

    kind = "projector"
    word = "projector"
    flags = {"BOUNDED": True}

    def axis(self) -> Triple:
        return self.direction

    def axes(self) -> Array:
        return axes_along(self.direction, self.up)

    def tangents(self) -> tuple[float, float]:
        """Computes the tangents of its half angles, across and up."""
        across, along = self.fov
        return math.tan(across / 2), math.tan(along / 2)

    def falloff_terms(self) -> Triple:
        kind = FALLOFFS.index(self.falloff)
        return float(kind == 0), float(kind == 1), float(kind == 2) + self.ambient

    def planes(self) -> Array:
        right, up, ahead = self.axes()
        wide, high = self.tangents()
        sides = [wide * ahead - right, wide * ahead + right, high * ahead - up, high * ahead + up]
        position = np.asarray(self.position, float)
        found = [np.append(n / np.linalg.norm(n), -n @ position / np.linalg.norm(n)) for n in sides]
        found.append(np.append(ahead, -ahead @ position - self.near))
        if self.far:
            found.append(np.append(-ahead, ahead @ position + self.far))
        return np.array([*found, *map(unit_plane, self.clip)])

    def shadow_layers(self, medium: ResolvedMedium) -> int:
        return 1

    def shadow_views(self, view: Any, projection: Any, hulls: Matrix, medium: ResolvedMedium) -> list[ShadowView]:
        """Fits the view that just holds the frustum, square texels or not."""
        position = np.array(self.position)
        return [perspective_view(position, self.near, hulls, medium.shadow_size, self.direction, self.tangents(), self.axes()[:2])]
