"""Lights that shine on a medium, in the units of glTF (KHR_lights_punctual): lux or candela; metres. NumPy only.

A kind of light is a subclass in a file of its own, and a line of `kinds.KINDS`; nothing else asks a light for its kind's name.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from airlight.lights.shape import Cookie, Photometry, axes_along
from airlight.medium.resolve import ResolvedMedium
from airlight.planes import smoothstep
from airlight.projection import Matrix
from airlight.shadows import ShadowView

Array = npt.NDArray[np.floating[Any]]
Triple = tuple[float, float, float]


def triple(v: Any) -> Triple:
    """Converts three numbers of any kind to floats."""
    return float(v[0]), float(v[1]), float(v[2])


@dataclass(frozen=True)
class PunctualLight(ABC):
    """Describes a light that shines on a medium.

    intensity: (3,) linear RGB: lux on a plane that faces a directional light, else candela. strength: factor of what the medium makes of
    it; anisotropy: instead of the medium's, -1..1. density, extinction: factors of the medium's, for this light alone; artistic.
    cookie, photometry: its shape, see shape.py, at most one of them; turned: (3, 3) the axes of that; None: see `axes`.

    kind: as KHR_lights_punctual names it; word: as messages and timings do. directional: its rays are parallel. flags: override constants
    of scatter/march/scene.wgsl that say what of a light's kind the shaders have to know.
    """

    intensity: Triple
    strength: float = field(default=1.0, kw_only=True)
    anisotropy: float | None = field(default=None, kw_only=True)
    density: float = field(default=1.0, kw_only=True)
    extinction: float = field(default=1.0, kw_only=True)
    cookie: Cookie | None = field(default=None, kw_only=True)
    photometry: Photometry | None = field(default=None, kw_only=True)
    turned: Any = field(default=None, kw_only=True, compare=False)

    kind: ClassVar[str]
    word: ClassVar[str]
    directional: ClassVar[bool] = False
    flags: ClassVar[Mapping[str, bool]] = {}

    def own_medium(self, medium: ResolvedMedium) -> ResolvedMedium:
        """Gives the medium as this light has it."""
        return medium.of_light(self.density, self.extinction)

    def fade(self, eye: Any, medium: ResolvedMedium) -> float:
        """Computes the light's factor for an eye at (3,), world, from Medium.lamp_distance and lamp_fade; 1 for directional lights."""
        return 1.0

    @abstractmethod
    def in_view(self, view: Matrix) -> Array:
        """Transforms its position, or the direction towards it, by (4, 4) world to view space, to (3,)."""

    def axis(self) -> Triple:
        """Returns the unit vector, world, around which its intensity varies; any where it does not."""
        return 0.0, 1.0, 0.0

    def axes(self) -> Array:
        """Returns the axes (3, 3) of its shape, rows right, up and ahead in the world: ahead is where it shines, of a point down."""
        return axes_along(self.axis(), (0.0, 1.0, 0.0)) if self.turned is None else np.asarray(self.turned, float)

    def cookie_place(self, q: Array) -> Array:
        """Computes (..., 2) where in its cookie the light to places q lies, 0..1 and beyond; q (..., 3), m: along axes, from its origin."""
        wide, high = self.tangents()
        return np.stack([0.5 + 0.5 * q[..., 0] / (q[..., 2] * wide), 0.5 - 0.5 * q[..., 1] / (q[..., 2] * high)], axis=-1)

    def tangents(self) -> tuple[float, float]:
        """Returns the tangents of the half angles, across and up, that its cookie fills."""
        return 1.0, 1.0

    def colour(self, points: Array) -> Array:
        """Evaluates (..., 3) its shape at points (..., 3), world: the factor of `intensity`; nothing is filtered."""
        q = (points - self.origin()) @ self.axes().T
        if self.photometry is not None:
            return np.broadcast_to(self.photometry.at(q)[..., None], points.shape)
        if self.cookie is None:
            return np.ones(points.shape)
        ahead = (q[..., 2] > 0) | self.directional
        at = self.cookie_place(np.where(ahead[..., None], q, 1.0))
        return np.where(ahead[..., None], self.cookie.at(at, self.directional), 0.0)

    def origin(self) -> Array:
        """Returns (3,) the place, world, from which its shape is seen; of one without a position the world's origin."""
        return np.zeros(3)

    def planes(self) -> Array:
        """Returns (N, 4) planes, world, n x + d >= 0 where there may be light, n of unit length."""
        return np.zeros((0, 4))

    def falloff_terms(self) -> Triple:
        """Returns the coefficients of 1/d^2, 1/d and 1 in what the irradiance at a distance d is of the intensity."""
        return 1.0, 0.0, 0.0

    def cone(self) -> tuple[float, float]:
        """Returns (scale, offset) of its angular falloff clamp(cos a scale + offset, 0, 1)^2 at an angle a to its axis; (0, 1): none."""
        return 0.0, 1.0

    def cone_cosine(self) -> float:
        """Returns the cosine of the half angle of the cone around its axis beyond which it is dark; -1: none."""
        return -1.0

    def attenuation_range(self) -> float:
        """Returns the distance in metres from which on it is dark, by the factor max(1 - (d / range)^4, 0); 0: none."""
        return 0.0

    def disc_tangent(self, default: float) -> float:
        """Returns the tangent of its angular radius, for soft shadows; default: the radius in degrees where it has none of its own."""
        return 0.0

    @abstractmethod
    def incident(self, points: Array) -> tuple[Array, Array, Array]:
        """Computes what reaches points (..., 3), world, through empty space.

        Returns (..., 3) unit vectors towards the light, (...) metres of the way from it that are in the medium, 0 for a directional light,
        and (...) the factor of `intensity` that makes it the irradiance of a plane that faces the light, lux.
        """

    @abstractmethod
    def travel(self, points: Array) -> Array:
        """Computes (..., 3) vectors of any length along which its light travels at points (..., 3), world."""

    def kink_cosines(self) -> tuple[float, ...]:
        """Returns the cosines to its axis at which the irradiance has a kink, where it is integrated in parts."""
        return ()

    @abstractmethod
    def shadow_layers(self, medium: ResolvedMedium) -> int:
        """Returns how many `shadow_views` there can be."""

    @abstractmethod
    def shadow_views(self, view: Any, projection: Any, hulls: Matrix, medium: ResolvedMedium) -> list[ShadowView]:
        """Fits its shadow map's views to hulls (N, 8, 3), world, for a camera with (4, 4) matrices view (world to view space) and
        projection (to clip space)."""


@dataclass(frozen=True)
class PositionalLight(PunctualLight):
    """Describes a light at a point: irradiance intensity / d^2 at a distance d.

    position: metres, world. range: metres, see `attenuation_range`. near: no shadow caster is nearer to it, metres; 0: unknown.
    """

    position: Triple = (0.0, 0.0, 0.0)
    range: float = field(default=0.0, kw_only=True)
    near: float = field(default=0.0, kw_only=True)

    def fade(self, eye: Any, medium: ResolvedMedium) -> float:
        distance, fade = medium.settings.lamp_distance, medium.settings.lamp_fade
        if distance is None:
            return 1.0
        away = float(np.linalg.norm(np.asarray(self.position, float) - eye))
        if fade == 0:
            return float(away <= distance)
        return float(smoothstep(distance - away, 0.0, fade * distance))

    def in_view(self, view: Matrix) -> Array:
        return np.asarray((view @ np.append(self.position, 1.0))[:3])

    def attenuation_range(self) -> float:
        return self.range

    def origin(self) -> Array:
        return np.asarray(self.position, float)

    def travel(self, points: Array) -> Array:
        return np.asarray(points - self.origin())

    def incident(self, points: Array) -> tuple[Array, Array, Array]:
        away = self.travel(points)
        d = np.linalg.norm(away, axis=-1)
        scale, offset = self.cone()
        factor = np.clip(away @ np.array(self.axis()) / d * scale + offset, 0, 1) ** 2
        if self.range:
            factor = factor * np.maximum(1 - (d / self.range) ** 4, 0)
        if len(planes := self.planes()):
            factor = factor * np.all(points @ planes[:, :3].T + planes[:, 3] >= 0, axis=-1)
        square, inverse, constant = self.falloff_terms()
        return -away / d[..., None], d, factor * (square / d**2 + inverse / d + constant)
