"""Lights of the image plane, and the forms in which a user writes a position there."""

import math
import re
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from airlight.errors import AirlightError
from airlight.messages import nearest

if TYPE_CHECKING:
    from airlight.lights.shape import Cookie

_NUMBER = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(px|%)?\s*")
IMAGE_LIGHT_KINDS = ("disc", "opening", "glow", "lamps", "beyond")  # a sun's disc, a window, a bright part, lamps; beyond the border
FAR_LIMIT = 1e6  # image sizes; beyond this the shafts are parallel to f32 precision
BRIGHTEST = 1e6  # as weight and exposure, so that their product is a float
PARALLEL = 1e5  # of the image's longer side: where a parallel light is put; rays then differ by 0.01 px a thousand from parallel ones


@dataclass(frozen=True)
class ImageLight:
    """Describes a light of the image plane.

    position: (x, y), normalised: (0, 0) is the image's top-left corner, (1, 1) its bottom-right; may lie outside.
    color: linear RGB factors, each >= 0.  strength: factor >= 0.
    angle: of a parallel light, see `parallel`; its position then only says the direction, and `placed` where it is.
    kind: what it is, as in `detect.Candidate`; None: to be told by the picture.
    cookie: a picture that is held upon it, whose colours its shafts take, see lights/around.py; None or a white one: none.
    """

    position: tuple[float, float]
    color: tuple[float, float, float] = (1.0, 1.0, 1.0)
    strength: float = 1.0
    angle: float | None = None
    kind: str | None = None
    cookie: "Cookie | None" = None

    @classmethod
    def parallel(cls, angle: float, color: tuple[float, float, float] = (1.0, 1.0, 1.0), strength: float = 1.0) -> "ImageLight":
        """Make a light so far away that its rays are parallel, the limit of a far one.

        angle: degrees, where the light comes from: 0 right, 90 above, counter-clockwise. The length of a ray is density image widths.
        """
        try:
            turn = math.radians(angle)
            if not math.isfinite(turn):
                raise ValueError
        except (TypeError, ValueError, OverflowError):  # no number, or not a finite one
            raise AirlightError(f"light angle must be a finite number of degrees, not {angle!r}") from None
        return cls((0.5 + PARALLEL * math.cos(turn), 0.5 - PARALLEL * math.sin(turn)), color, strength, float(angle))

    def placed(self, width: int, height: int, density: float) -> tuple[tuple[float, float], float]:
        """Give (position, density) of the sum over an image of width x height pixels."""
        if self.angle is None:
            return self.position, density
        far = PARALLEL * max(width, height)
        x, y = (0.5 + (v - 0.5) / PARALLEL * far / side for v, side in zip(self.position, (width, height), strict=True))
        return (x, y), density * width / far

    def __post_init__(self) -> None:
        for name, value, size in (("position", self.position, 2), ("color", self.color, 3)):
            try:
                numbers = tuple(float(v) for v in value)
            except (TypeError, ValueError, OverflowError):  # the last of integers beyond all floats
                numbers = ()
            if len(numbers) != size or not all(math.isfinite(v) for v in numbers):
                raise AirlightError(f"light {name} must be {size} finite numbers, not {value!r}")
            object.__setattr__(self, name, numbers)
        if self.kind is not None and not (isinstance(self.kind, str) and self.kind in IMAGE_LIGHT_KINDS):
            hint = nearest(str(self.kind), IMAGE_LIGHT_KINDS, f": there is {', '.join(IMAGE_LIGHT_KINDS)}")
            raise AirlightError(f"light kind {self.kind!r}{hint}")
        if self.cookie is not None and not hasattr(self.cookie, "revision"):
            raise AirlightError(f"a light's cookie is what airlight.read_cookie gives, not {type(self.cookie).__name__}")
        if self.cookie is not None and self.angle is not None:
            raise AirlightError("a parallel light has no angles around it for a cookie: give the light's place, or leave the cookie out")
        if max(abs(v) for v in self.position) > FAR_LIMIT:
            raise AirlightError(f"light position {self.position} is too far away: at most {FAR_LIMIT:g} image sizes")
        try:
            object.__setattr__(self, "strength", float(self.strength + 0))  # texts do not add up
        except (TypeError, ValueError, OverflowError):
            raise AirlightError(f"light strength must be a finite number, not {str(self.strength)[:80]!r}") from None
        if not (math.isfinite(self.strength) and self.strength >= 0 and min(self.color) >= 0):
            raise AirlightError("light color and strength must be finite and not negative")
        if max(self.rgb) > BRIGHTEST:
            raise AirlightError(f"light color times strength is {max(self.rgb):g}: at most {BRIGHTEST:g}")

    @property
    def rgb(self) -> tuple[float, float, float]:
        """Multiply color and strength."""
        r, g, b = self.color
        return (r * self.strength, g * self.strength, b * self.strength)


def parse_position(text: str, width: int, height: int) -> tuple[float, float]:
    """Read `0.4,0.3`, `960px,540px` or `50%,20%` as a normalised position in an image of width x height pixels.

    Pixels count from the corner: `0.5px,0.5px` is the centre of the first pixel.
    """
    parts = text.split(",")
    found = [_NUMBER.fullmatch(part) for part in parts]
    if len(parts) != 2 or not all(found):
        raise AirlightError(f"cannot read the light position {text!r}: write x,y as in 0.5,0.2 or 960px,200px or 50%,20%")
    unit = {None: (1.0, 1.0), "%": (100.0, 100.0), "px": (float(width), float(height))}
    x, y = (float(m[1]) / unit[m[2]][axis] for axis, m in enumerate(found) if m)
    return x, y


def as_lights(light: object, cookie: object = None) -> list[ImageLight]:
    """Make a list of lights of a light, an (x, y) pair, what find_light gives, or a sequence of them. cookie: as `as_cookie`, of those that
    have none."""
    if cookie is not None:
        from airlight.lights.around import as_cookie  # which needs NumPy, as help does not

        shared = as_cookie(cookie)
        return [one if one.cookie is not None else replace(one, cookie=shared) for one in as_lights(light)]
    if isinstance(light, ImageLight):
        return [light]
    if hasattr(light, "position") and hasattr(light, "kind"):  # what was found in a picture
        return [ImageLight(light.position, kind=light.kind)]
    wrong = f"light must be (x, y), an airlight.Light, or a list of them, not {light!r}"
    if isinstance(light, (str, bytes)):
        raise AirlightError(f"{wrong}; airlight.find_light finds one")
    try:
        items = list(light)  # type: ignore[call-overload]
    except TypeError:
        raise AirlightError(wrong) from None
    if len(items) == 2 and all(not isinstance(v, ImageLight) and not hasattr(v, "__len__") for v in items):
        return [ImageLight(position=(items[0], items[1]))]
    if not items:
        raise AirlightError("no light given: pass at least one position")
    return [as_lights(item)[0] if hasattr(item, "position") else ImageLight(position=item) for item in items]
