"""Lets a scene have projectors, which pygfx does not know."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pygfx as gfx

from airlight.errors import AirlightError
from airlight.lights.numbers import are_finite, is_finite, unit_plane
from airlight.lights.projector import FALLOFFS, LIMITS, MOST, MOST_CLIPS, NEAR
from airlight.lights.shape import Cookie

SHORT = 80  # characters of a value in a message


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
        super().__init__(color, decay=2, **more)
        _check_within("intensity", intensity, "candela")
        self.intensity = float(intensity)
        self.upwards, self.fov, self.near, self.far = up, fov, near, far
        self.falloff, self.ambient, self.cookie, self.clip = falloff, ambient, cookie, clip
        self.written = ""  # the option that it was made of
        self.check()
        self.upwards = tuple(float(v) for v in up)

    @property
    def fov(self) -> tuple[float, float]:
        """Full angles across and up, degrees; the cone that pygfx takes it for follows."""
        return self._fov

    @fov.setter
    def fov(self, value: Sequence[float]) -> None:
        if not are_finite(value, 2):
            raise AirlightError(f"a projector's fov must be two angles, across and up, degrees, not {_short(value)}")
        across, along = (float(v) for v in value)
        low, high = LIMITS["fov"]
        if not (low <= across <= high and low <= along <= high):
            raise AirlightError(f"a projector's fov must be {low:g} to {high:g} degrees, across and up, not {across:g}, {along:g}")
        self._fov = across, along
        self.angle = math.atan(math.hypot(*(math.tan(math.radians(v) / 2) for v in (across, along))))

    def check(self) -> None:
        """Raise AirlightError for what a projector cannot be, of its fields, which may be set at any time, and its axis."""
        near, far, up = self.near, self.far, self.upwards
        _check_within("near", near, "m")
        if far is not None:
            _check_within("far", far, "m")
            if not near < far:
                raise AirlightError(f"a projector's near must be above 0 and its far beyond it, m, not {near!r} and {far!r}")
        if not are_finite(up, 3) or not any(up):
            raise AirlightError(f"a projector's up must be three finite numbers, not all 0, not {_short(up)}")
        if self.falloff not in FALLOFFS:
            raise AirlightError(f"a projector's falloff must be {', '.join(FALLOFFS)}, not {self.falloff!r}")
        _check_within("ambient", self.ambient, "1/m^2")
        if not (is_finite(self.intensity) and self.intensity >= 0):  # an exposure may have scaled it beyond its limits
            raise AirlightError(f"a projector's intensity must be 0 candela or more, not {_short(self.intensity)}")
        if self.cookie is not None and not isinstance(self.cookie, Cookie):
            raise AirlightError(f"a projector's cookie must be a Cookie, as read_cookie gives it, not {type(self.cookie).__name__}")
        if not isinstance(self.clip, Sequence | np.ndarray):
            raise AirlightError(f"a projector's clip must be a list of planes a, b, c, d, not {_short(self.clip)}")
        if len(self.clip) > MOST_CLIPS:
            raise AirlightError(f"a projector's clip takes {MOST_CLIPS} planes at most, not {len(self.clip)}")
        if not all(are_finite(plane, 4) and any(plane[:3]) for plane in self.clip):
            raise AirlightError("a projector's clip takes planes of four finite numbers a, b, c, d, of which a, b, c are not all 0")
        if (far_away := next((plane for plane in self.clip if abs(unit_plane(plane)[3]) > MOST), None)) is not None:
            raise AirlightError(f"a projector's clip {_short(far_away)} is more than {MOST:g} m away: give a greater normal or less d")


def _check_within(name: str, value: Any, unit: str) -> None:
    """Raise AirlightError for a number that is beyond the limits that it has in texts and files too."""
    low, high = LIMITS[name]
    if not (is_finite(value) and low <= value <= high):
        raise AirlightError(f"a projector's {name} must be {low:g} to {high:g} {unit}, not {_short(value)}")


def _short(value: Any) -> str:
    """Write a value for a message, cut where it is long; an integer of thousands of digits may not be written at all."""
    try:
        text = repr(value)
    except ValueError:
        return "a number of thousands of digits"
    return text if len(text) <= SHORT else f"{text[: SHORT - 3]}..."
