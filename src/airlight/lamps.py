"""Lights of a world, in the units of glTF (KHR_lights_punctual): lux for suns, candela for lamps; metres. NumPy only."""

import math
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from airlight.planes import smoothstep

Triple = tuple[float, float, float]


def triple(v: Any) -> Triple:
    return float(v[0]), float(v[1]), float(v[2])


@dataclass(frozen=True)
class Lamp:
    """A light that shines on a medium.

    kind: sun, spot or point. intensity: (3,) linear RGB; a sun's is the irradiance of a plane that faces it (lux), the others' their
    radiant intensity (candela), so that the irradiance at a distance d is intensity / d^2. position: metres, world; not a sun's.
    direction: unit; a sun's is towards it, a spot's the way it shines. inner, outer: half angles of a spot's cone, radians; between them
    the light falls as the square of a ramp that is linear in the cosine. range: metres beyond which a lamp has no effect,
    max(1 - (d / range)^4, 0); 0: none. angular_radius: of a sun, radians, for soft shadows; 0: the medium's setting.
    strength: factor of what the medium makes of it; anisotropy: instead of the medium's. near: no shadow caster is nearer to a lamp, m.
    """

    kind: Literal["sun", "spot", "point"]
    intensity: Triple
    position: Triple = (0.0, 0.0, 0.0)
    direction: Triple = (0.0, 1.0, 0.0)
    inner: float = 0.0
    outer: float = math.pi / 4
    range: float = 0.0
    angular_radius: float = 0.0
    strength: float = 1.0
    anisotropy: float | None = None
    near: float = 0.0

    @property
    def is_sun(self) -> bool:
        return self.kind == "sun"

    def cone(self) -> tuple[float, float]:
        """(scale, offset): a spot's factor at an angle a to its direction is clamp(cos a scale + offset, 0, 1)^2; (0, 1) elsewhere."""
        if self.kind != "spot":
            return 0.0, 1.0
        outer = math.cos(self.outer)
        scale = 1.0 / max(0.001, math.cos(self.inner) - outer)
        return scale, -outer * scale

    def seen_from(self, eye: Any, distance: float | None, fade: float) -> float:
        """The lamp's factor for an eye at (3,), see Medium.lamp_distance and lamp_fade; 1 for suns."""
        if self.is_sun or distance is None:
            return 1.0
        away = float(np.linalg.norm(np.asarray(self.position, float) - eye))
        if fade == 0:
            return float(away <= distance)
        return float(smoothstep(distance - away, 0.0, fade * distance))
