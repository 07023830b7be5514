"""Lets a scene have projectors, which pygfx does not know."""

import math
from collections.abc import Sequence
from typing import Any

import pygfx as gfx

from airlight.errors import AirlightError
from airlight.lights.projector import FALLOFFS, MOST_CLIPS, NEAR
from airlight.lights.shape import Cookie


class Projector(gfx.SpotLight):  # type: ignore[misc]
    """Describes light in a frustum, as of a slide projector, towards its target as a gfx.SpotLight shines.

    intensity: candela on the axis. up, later upwards: (3,) world; the nearest direction at right angles to its way counts. fov: full angles
    across and up, degrees, above 0 and below 180. near, far: m along the axis, between which there is light; far None: no end. falloff:
    inverse-square, or, not physical, inverse or constant, with the distance in metres; ambient: is added to it, 1/m^2, not physical either.
    cookie: a Cookie, or None. clip: planes (a, b, c, d), world, a x + b y + c z + d >= 0 where there is light.
    """

    def __init__(
        self,
        color: Any = "#ffffff",
        intensity: float = 100.0,
        *,
        up: Sequence[float] = (0.0, 1.0, 0.0),
        fov: Sequence[float] = (40.0, 30.0),
        near: float = NEAR,
        far: float | None = None,
        falloff: str = FALLOFFS[0],
        ambient: float = 0.0,
        cookie: Cookie | None = None,
        clip: Sequence[Sequence[float]] = (),
        **more: Any,
    ) -> None:
        super().__init__(color, intensity, decay=2, **more)
        across, along = (float(v) for v in fov)
        if not (0 < across < 180 and 0 < along < 180):
            raise AirlightError(f"a projector's fov must be above 0 and below 180 degrees, across and up, not {across:g}, {along:g}")
        if not 0 < near < math.inf or (far is not None and not near < far < math.inf):
            raise AirlightError(f"a projector's near must be above 0 and its far beyond it, m, not {near!r} and {far!r}")
        if falloff not in FALLOFFS:
            raise AirlightError(f"a projector's falloff must be {', '.join(FALLOFFS)}, not {falloff!r}")
        if not 0 <= ambient < math.inf:
            raise AirlightError(f"a projector's ambient must be 0 or more, not {ambient!r}")
        if len(clip) > MOST_CLIPS:
            raise AirlightError(f"a projector's clip takes {MOST_CLIPS} planes at most, not {len(clip)}")
        if not all(len(plane) == 4 and any(plane[:3]) and all(math.isfinite(v) for v in plane) for plane in clip):
            raise AirlightError("a projector's clip takes planes of four finite numbers a, b, c, d, of which a, b, c are not all 0")
        wide, high = (math.tan(math.radians(v) / 2) for v in (across, along))
        self.angle = math.atan(math.hypot(wide, high))
        self.upwards, self.fov, self.near, self.far = tuple(up), (across, along), float(near), far
        self.falloff, self.ambient, self.cookie, self.clip = falloff, float(ambient), cookie, tuple(clip)
