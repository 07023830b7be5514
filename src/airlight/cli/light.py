"""How a light is written on the command line: `X,Y[;color=R,G,B][;strength=S]`, or `auto` for X,Y, or the angle of a parallel one."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import click

from airlight.errors import AirlightError
from airlight.lights import Light, parse_position

if TYPE_CHECKING:
    from airlight.files import Picture


@dataclass(frozen=True)
class LightText:
    """A light as written; where it is depends on the picture's size. angle: degrees, of a parallel light, which has no position."""

    position: str
    color: tuple[float, float, float] = (1.0, 1.0, 1.0)
    strength: float = 1.0
    angle: float | None = None

    def light(self, x: float, y: float) -> Light:
        return Light((x, y), self.color, self.strength)


class LightType(click.ParamType):
    name = "X,Y|auto"
    parallel = False

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> LightText:
        if isinstance(value, LightText):
            return value
        try:
            return read_light(value, self.parallel)
        except AirlightError as error:
            self.fail(str(error), param, ctx)


class AngleType(LightType):
    name = "DEG"
    parallel = True


def read_light(text: str, parallel: bool = False) -> LightText:
    """A light as written; parallel: an angle stands for the position."""
    position, *rest = (part.strip() for part in text.split(";"))
    known: dict[str, Any] = {}
    for part in rest:
        name, _, value = (word.strip() for word in part.partition("="))
        try:
            if name == "color":
                known[name] = tuple(float(v) for v in value.split(","))
            elif name == "strength":
                known[name] = float(value)
            else:
                form = "DEG" if parallel else "X,Y"
                raise AirlightError(f"cannot read {part!r} in the light {text!r}: write {form};color=R,G,B;strength=S")
        except ValueError:
            raise AirlightError(f"cannot read {part!r} in the light {text!r}: write numbers, as in color=1,0.8,0.6 or strength=2") from None
    if parallel:
        try:
            known["angle"] = float(position)
        except ValueError:
            raise AirlightError(f"cannot read the angle {position!r}: write degrees, as in 90 for light from above") from None
        Light.parallel(**known)
        return LightText("", **known)
    written = LightText(position, **known)
    written.light(*(0.0, 0.0) if position == "auto" else parse_position(position, 1, 1))  # refuses bad values before any file is read
    return written


def place(written: LightText, picture: "Picture", origin: str) -> Light:
    """The light in the picture's own pixels. The user counts in the display window, whose part the pixels may be."""
    if written.angle is not None:
        return Light.parallel(written.angle, written.color, written.strength)
    shown = picture.display_window
    if min(shown[2:]) <= 0:
        shown = (0, 0, picture.width, picture.height)
    x, y = parse_position(written.position, shown[2], shown[3])
    if origin == "bottom":
        y = 1 - y
    data = picture.data_window if min(picture.data_window[2:]) > 0 else shown
    return written.light((shown[0] + x * shown[2] - data[0]) / data[2], (shown[1] + y * shown[3] - data[1]) / data[3])
