"""Reads lights as a user writes them.

Of a picture: `X,Y[;color=R,G,B][;strength=S][;kind=K][;cookie=FILE]`, `auto` for X,Y, or the angle of a parallel one; `auto:2` is the
second of the places where its light may be, `auto:3+` the first three together. Of a scene: `x,y,z`, an object's name, or
`azimuth,elevation`, with colour and strength; with a unit, as in `strength=800cd`, that is the light's own intensity, and surfaces have it
too; and with density and extinction, factors of the medium's as this light alone has them; of a lamp, with ies, a photometric file, and
absolute=1 for the candela of that; of a spot of the scene and of a sun, with cookie, a picture that it sends out, and size, how wide that
of a sun is in metres.
"""

import math
import re
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from airlight.errors import AirlightError
from airlight.lights import IMAGE_LIGHT_KINDS, ImageLight, parse_position
from airlight.messages import nearest

if TYPE_CHECKING:
    from airlight.files import Picture
    from airlight.files.images import Window
    from airlight.pygfx import SceneLight
    from airlight.scenes.lamps import NamedLight


_AUTO = re.compile(r"auto(?::([1-9]\d?)(\+)?)?")


@dataclass(frozen=True)
class LightText:
    """A light as written; where it is depends on the picture's size. angle: degrees, of a parallel light, which has no position."""

    position: str
    color: tuple[float, float, float] = (1.0, 1.0, 1.0)
    strength: float = 1.0
    angle: float | None = None
    kind: str | None = None  # see ImageLight
    cookie: str | None = None  # a file

    def light(self, x: float, y: float) -> ImageLight:
        return ImageLight((x, y), self.color, self.strength, kind=self.kind)

    @property
    def searched(self) -> tuple[int, bool] | None:
        """Give (rank, whether all of the better ones are meant too) of a light to be found; rank 0: the best, if it is good enough."""
        found = _AUTO.fullmatch(self.position)
        return (int(found[1] or 0), bool(found[2])) if found else None

    @property
    def text(self) -> str:
        """Write it as `read_light` reads it."""
        color = "" if self.color == (1.0, 1.0, 1.0) else ";color=" + ",".join(repr(float(c)) for c in self.color)
        place = self.position if self.angle is None else repr(self.angle)
        kind = "" if self.kind is None else f";kind={self.kind}"
        cookie = "" if self.cookie is None else f";cookie={self.cookie}"
        return place + color + ("" if self.strength == 1.0 else f";strength={float(self.strength)!r}") + kind + cookie


def read_light(text: str, parallel: bool = False) -> LightText:
    """Read a light; parallel: an angle stands for the position."""
    position, known = split_light(text, "DEG" if parallel else "X,Y")
    if parallel:
        try:
            known["angle"] = float(position)
        except ValueError:
            raise AirlightError(f"cannot read the angle {position!r}: write degrees, as in 90 for light from above") from None
        ImageLight.parallel(**known)
        return LightText("", **known)
    written = LightText(position, **known)
    if position.startswith("auto") and written.searched is None:
        raise AirlightError(f"cannot read {position!r}: write auto, auto:2 for the next place, or auto:3+ for the best three together")
    written.light(*(0.0, 0.0) if written.searched else _numbers(position))  # refuses bad values before any file is read
    return written


def _numbers(position: str) -> tuple[float, float]:
    try:
        return parse_position(position, 1, 1)
    except AirlightError as error:
        raise AirlightError(f"{error}{nearest(position.partition(':')[0], ('auto',), '; or auto, which finds it')}") from None


# Units of a strength: what one is in candela of a lamp, or in lux of a sun. Watts are radiant flux, evenly all around, at 683 lm/W, as
# Blender exports it.
LAMP_UNITS = {"cd": 1.0, "lm": 1 / (4 * math.pi), "w": 683 / (4 * math.pi)}
SUN_UNITS = {"lx": 1.0, "lux": 1.0, "w/m2": 683.0, "w/m²": 683.0}
_QUANTITY = re.compile(r"([-+]?[\d.]+(?:e[-+]?\d+)?+) *([a-z][a-z/²2]*)", re.IGNORECASE)


def split_light(text: str, form: str) -> tuple[str, dict[str, Any]]:
    """Divide a light into its position as it is written, and {color, strength} where they are given, intensity for a strength with a unit,
    and a scene's density and extinction. form: of the position, to tell."""
    position, *rest = (part.strip() for part in text.split(";"))
    known: dict[str, Any] = {}
    for part in rest:
        name, _, value = (word.strip() for word in part.partition("="))
        try:
            if name == "color":
                known[name] = tuple(float(v) for v in value.split(","))
            elif name == "strength" and (found := _QUANTITY.fullmatch(value)):
                known["intensity"] = float(found[1]) * _unit(found[2], text, form)
            elif name in _shaping(form) and name != "size":
                known[name] = _file(name, value, text)
            elif name in ("strength", *_shaping(form)) or (name in OF_MEDIUM and form in SCENE_FORMS):
                known[name] = float(value)
            elif name == "kind" and form == "X,Y":
                known[name] = _kind(value, text)
            elif name == "cookie" and form == "X,Y":
                known[name] = _file(name, value, text)
            else:
                keys = ("color", "strength", *(("kind", "cookie") if form == "X,Y" else ()), *(OF_MEDIUM if form in SCENE_FORMS else ()))
                keys += _shaping(form)
                wrong = f"cannot read {part!r} in the light {text!r}: write {form};color=R,G,B;strength=S"
                raise AirlightError(wrong + nearest(name, keys))
        except ValueError:
            raise AirlightError(f"cannot read {part!r} in the light {text!r}: write numbers, as in color=1,0.8,0.6 or strength=2") from None
    return position, known


def _unit(unit: str, text: str, form: str) -> float:
    """Give what one of a unit is in candela of a lamp, or in lux of a sun. Raises AirlightError for another unit."""
    if form not in SCENE_FORMS:
        raise AirlightError(f"cannot read the unit {unit} in the light {text!r}: a picture's lights have none; write strength=2")
    units, others, what = (SUN_UNITS, LAMP_UNITS, "a sun") if form == SUN.upper() else (LAMP_UNITS, SUN_UNITS, "a lamp")
    if unit.lower() in units:
        return units[unit.lower()]
    known = "lx or W/m2, as in strength=68300lx" if what == "a sun" else "cd, lm or W, as in strength=800cd"
    wrong = f"{what} has no {unit}" if unit.lower() in others else f"cannot read the unit {unit}"
    raise AirlightError(f"{wrong} in the light {text!r}: write {known}")


def _shaping(form: str) -> tuple[str, ...]:
    """List the keys that shape a light of a form."""
    return OF_LAMP if form == PLACE.upper() else OF_SUN if form == SUN.upper() else ()


def _file(name: str, value: str, text: str) -> str:
    if not value and name in ("ies", "cookie"):
        raise AirlightError(f"{name} has no value in the light {text!r}: give a file, {name}=FILE")
    return value


def _kind(value: str, text: str) -> str:
    if value not in IMAGE_LIGHT_KINDS:
        hint = nearest(value, IMAGE_LIGHT_KINDS, f": there is {', '.join(IMAGE_LIGHT_KINDS)}")
        raise AirlightError(f"cannot read kind={value} in the light {text!r}{hint}")
    return value


def windows(picture: "Picture") -> "tuple[Window, Window]":
    """Read display and data window; the user counts in the first, of which the pixels may be a part."""
    shown, data = picture.display_window, picture.data_window
    if min(shown[2:]) <= 0:
        shown = (0, 0, picture.width, picture.height)
    return shown, data if min(data[2:]) > 0 else shown


def resolved(written: LightText, picture: "Picture", origin: str) -> LightText:
    """Write the light in numbers that need no picture: a part of the display window's size, from its top left."""
    if written.angle is not None:
        return written
    shown, _ = windows(picture)
    x, y = parse_position(written.position, shown[2], shown[3])
    return replace(written, position=f"{x!r},{1 - y if origin == 'bottom' else y!r}")


def found_at(picture: "Picture", position: tuple[float, float]) -> tuple[float, ...]:
    """Count a position of the picture's own pixels as the user does: (x, y) normalised, and in pixels of the display window."""
    shown, data = windows(picture)
    pixels = [data[i] + position[i] * data[2 + i] - shown[i] for i in (0, 1)]
    return pixels[0] / shown[2], pixels[1] / shown[3], *pixels


def place(written: LightText, picture: "Picture", origin: str = "top", cookie: str | None = None) -> ImageLight:
    """Place the light in the picture's own pixels. cookie: a file, of a light that has none of its own."""
    if written.angle is not None:
        return ImageLight.parallel(written.angle, written.color, written.strength)
    shown, data = windows(picture)
    x, y = parse_position(resolved(written, picture, origin).position, 1, 1)
    made = written.light((shown[0] + x * shown[2] - data[0]) / data[2], (shown[1] + y * shown[3] - data[1]) / data[3])
    path = written.cookie or cookie
    if path is None:
        return made
    from airlight.jobs.cookies import kept_cookie, of_option

    with of_option("--light" if written.cookie else "--cookie"):
        return replace(made, cookie=kept_cookie(path))


PLACE, SUN = "x,y,z", "azimuth,elevation"  # forms in which a scene's lights are written
SCENE_FORMS = (PLACE.upper(), SUN.upper())
OF_MEDIUM = ("density", "extinction")  # factors, of a scene's light
OF_LAMP = ("ies", "absolute", "cookie")
OF_SUN = ("cookie", "size")
SIZES = (1e-3, 1e6)  # m, of a sun's cookie
SUN_SIZE = 1.0  # degrees: half angle of the disc of a light that no lamp of the scene stands for


def numbers(text: str, form: str) -> tuple[float, ...]:
    """Read `1,2,0.5` as numbers, as many as the form (`x,y,z`) has. Raises AirlightError."""
    try:
        found = tuple(float(part) for part in str(text).split(","))
    except ValueError:
        found = ()
    if len(found) != form.count(",") + 1 or not all(math.isfinite(v) and abs(v) <= 1e9 for v in found):
        raise AirlightError(f"cannot read {text!r}: write {form} as numbers, as in {','.join(['0', '1.5', '-2'][: form.count(',') + 1])}")
    return found


def triple(text: str) -> tuple[float, float, float]:
    """Read `x,y,z` as numbers."""
    x, y, z = numbers(text, PLACE)
    return x, y, z


def light_numbers(text: str, form: str) -> tuple[tuple[float, ...], dict[str, Any]]:
    """Read the numbers of a light's position or direction, none where it is the name of an object, and {color, strength} as given."""
    place, known = split_light(text, form.upper())
    if not 0 <= known.get("intensity", 0) <= 1e9:
        raise AirlightError(f"the strength of the light {text!r} is beyond 0 to 1e9 candela or lux: give another")
    for name in OF_MEDIUM:
        if not 0 <= known.get(name, 1) <= 1e6:
            raise AirlightError(f"{name}={known[name]:g} of the light {text!r} is beyond 0 to 1e6 times the medium's: give another")
    if known.get("absolute", "1") not in ("0", "1") or ("absolute" in known and "ies" not in known):
        raise AirlightError(f"absolute is 0 or 1, and goes with ies, in the light {text!r}: write ies=lamp.ies;absolute=1")
    if "intensity" in known and known.get("absolute") == "1":
        raise AirlightError(f"the light {text!r} has two intensities: leave out the strength, or absolute")
    if {"ies", "cookie"} <= known.keys():
        raise AirlightError(f"the light {text!r} has two shapes: leave out ies, or cookie")
    if "size" in known and not ("cookie" in known and SIZES[0] <= known["size"] <= SIZES[1]):
        bounds = f"size is {SIZES[0]:g} to {SIZES[1]:g} m, and goes with cookie"
        raise AirlightError(f"{bounds}, in the light {text!r}: write cookie=FILE;size=2")
    ImageLight((0, 0), **{name: known[name] for name in known.keys() - {"intensity", *OF_MEDIUM, *OF_LAMP, *OF_SUN}})  # raises for these
    if form == PLACE and is_name(place):
        return (), known
    at = numbers(place, form)
    if form == SUN and abs(at[1]) > 90:
        raise AirlightError(f"the elevation of the sun {text!r} is beyond 90 degrees: write azimuth,elevation, as in 90,20")
    return at, known


def is_name(place: str) -> bool:
    """Tell the name of an object from numbers, badly written ones too."""
    return "," not in place and any(c.isalpha() for c in place.lower().replace("e", "", 1))


def read_scene_light(text: str, form: str) -> "SceneLight | NamedLight":
    """Read `x,y,z`, the name of an object, or `azimuth,elevation` (0 is -Z, clockwise from above: 90 is +X), with
    `;color=R,G,B;strength=S;density=D;extinction=E`, `;cookie=FILE` of a spot or a sun, of a sun with `;size=M`, and of a lamp
    `;ies=FILE;absolute=1` too. Raises AirlightError."""
    from airlight.files.photometry import read_photometry
    from airlight.jobs.cookies import of_option, open_cookie
    from airlight.pygfx import SceneLight
    from airlight.scenes.lamps import NamedLight

    at, known = light_numbers(text, form)
    absolute = known.pop("absolute", "0") == "1"
    if "ies" in known:
        with of_option("--light"):
            known["photometry"] = photometry = read_photometry(known.pop("ies"))
        known |= {"intensity": photometry.own_candela((0.0, -1.0, 0.0))} if absolute else {}
    if "cookie" in known:
        known["cookie"] = open_cookie(known["cookie"], known.pop("size", 1.0), "--light" if form == PLACE else "--sun")
    if not at:
        return NamedLight(split_light(text, form.upper())[0], **known)
    if form == PLACE:
        return SceneLight(position=(at[0], at[1], at[2]), disc_half_angle=SUN_SIZE, **known)
    turn, up = (math.radians(v) for v in at)
    direction = (math.sin(turn) * math.cos(up), math.sin(up), -math.cos(turn) * math.cos(up))
    return SceneLight(direction=direction, disc_half_angle=SUN_SIZE, **known)
