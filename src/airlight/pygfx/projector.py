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
        self.upwards, self.fov, self.near, self.far = up, fov, near, far
        self.falloff, self.ambient, self.cookie, self.clip = falloff, ambient, cookie, tuple(clip)
        self.written = ""  # the option that it was made of
        self.check()
        self.upwards = tuple(float(v) for v in up)

    @property
    def fov(self) -> tuple[float, float]:
        """Full angles across and up, degrees; the cone that pygfx takes it for follows."""
        return self._fov

    @fov.setter
    def fov(self, value: Sequence[float]) -> None:
        try:
            across, along = (float(v) for v in value)
        except (TypeError, ValueError):
            raise AirlightError(f"a projector's fov must be two angles, across and up, degrees, not {value!r}") from None
        if not (0 < across < 180 and 0 < along < 180):
            raise AirlightError(f"a projector's fov must be above 0 and below 180 degrees, across and up, not {across:g}, {along:g}")
        self._fov = across, along
        self.angle = math.atan(math.hypot(*(math.tan(math.radians(v) / 2) for v in (across, along))))

    def check(self) -> None:
        """Raise AirlightError for what a projector cannot be, of its fields, which may be set at any time, and its axis."""
        near, far, up = self.near, self.far, self.upwards
        if not _numbers((near,)) or not near > 0 or (far is not None and not (_numbers((far,)) and near < far)):
            raise AirlightError(f"a projector's near must be above 0 and its far beyond it, m, not {near!r} and {far!r}")
        if not _numbers(up, 3) or not any(up):
            raise AirlightError(f"a projector's up must be three finite numbers, not all 0, not {up!r}")
        if self.falloff not in FALLOFFS:
            raise AirlightError(f"a projector's falloff must be {', '.join(FALLOFFS)}, not {self.falloff!r}")
        if not (_numbers((self.ambient,)) and self.ambient >= 0):
            raise AirlightError(f"a projector's ambient must be 0 or more, not {self.ambient!r}")
        if self.cookie is not None and not isinstance(self.cookie, Cookie):
            raise AirlightError(f"a projector's cookie must be a Cookie, as read_cookie gives it, not {type(self.cookie).__name__}")
        if len(self.clip) > MOST_CLIPS:
            raise AirlightError(f"a projector's clip takes {MOST_CLIPS} planes at most, not {len(self.clip)}")
        if not all(_numbers(plane, 4) and any(plane[:3]) for plane in self.clip):
            raise AirlightError("a projector's clip takes planes of four finite numbers a, b, c, d, of which a, b, c are not all 0")


def _numbers(values: Any, count: int = 1) -> bool:
    """Tell whether these are so many finite numbers."""
    try:
        return len(values) == count and all(math.isfinite(v) for v in values)
    except TypeError:
        return False
