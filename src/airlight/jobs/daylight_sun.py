"""Finds the sun of a picture or a scene with daylight, and refuses options that contradict each other."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from airlight.errors import AirlightError
from airlight.jobs.daylight_text import BY_DAY, check_elevation, read_sun, read_when, read_where
from airlight.messages import say
from airlight.options import Daylight, DaylightPicture, Option, declared

if TYPE_CHECKING:
    from airlight.daylight import Atmosphere

NONE, AIR, PRINTED = "none", "air", "hoffman-preetham"
SUN_DOWN = -0.83  # degrees: the upper edge of a sun raised by refraction
EYE = 2.0  # m, of an eye whose altitude is not told
OF_AIR = ("visibility", "turbidity", "ozone", "ground_albedo", "aerosol_albedo", "wavelengths", "multiple")  # which even air has not
OF_PRINTED = ("beta_rayleigh", "beta_mie")


@dataclass(frozen=True)
class Sun:
    """Says where the sun is seen: elevation, degrees; azimuth, clockwise from north, or None where only its elevation is told."""

    elevation: float
    azimuth: float | None = None


def is_daylight(values: Mapping[str, Any]) -> bool:
    """Tell whether values of declared parameters ask for daylight. Raises AirlightError for those that only daylight has, without it."""
    kind = values.get("daylight", NONE)
    options = {one.name: one for one in declared(scenes=True) if one.group == "daylight"}
    given = {name: options[name] for name, value in values.items() if name in options and value != options[name].default}
    if kind == NONE:
        if given:
            raise AirlightError(f"{next(iter(given.values())).flag} is for daylight: add --daylight air, or leave it out")
        return False
    wrong = [given[name] for name in (OF_AIR if kind == PRINTED else OF_PRINTED) if name in given]
    if wrong:
        other = AIR if kind == PRINTED else PRINTED
        raise AirlightError(f"{wrong[0].flag} means nothing with --daylight {kind}: leave it out, or give --daylight {other}")
    if "visibility" in given and "turbidity" in given:
        raise AirlightError("--visibility and --turbidity both say how hazy the air is: give one of them")
    return True


def check_sun(day: Daylight, place: DaylightPicture | None, other: str = "") -> None:
    """Refuse daylight without a sun, or with two. place: of a picture; other: of a scene, the option that gives a sun, if any."""
    ways = {"--when": day.when, "--sun": place.sun if place else other, "--sun-elevation": place.sun_elevation if place else None}
    given = [name for name, value in ways.items() if value not in (None, "")]
    if len(given) > 1:
        raise AirlightError(f"{' and '.join(given)} both say where the sun is: give one of them")
    if not given:
        ways_out = "--sun AZ,EL, --sun-elevation EL with --light, or --when and --where" if place else "--sun AZ,EL, or --when and --where"
        raise AirlightError(f"--daylight {day.daylight} needs a sun: add {ways_out}")
    if day.when is not None and day.where is None:
        raise AirlightError("--when needs the place too: add --where LAT,LON in degrees, as in --where 47.42,10.98,2962")
    if place is not None and day.where not in (None, "exif") and day.when is None and day.where.count(",") == 1:
        raise AirlightError(f"--where {day.where} places the sun by --when: give --when too, or --altitude for the height alone")
    for text, read in ((day.when, read_when), (day.where, read_where), (place.sun if place else None, read_sun)):
        if text is not None and text != "exif":
            read(text)


def resolve_where(day: Daylight, spec: Any = None, path: str = "") -> tuple[float, float, float | None] | None:
    """Read --where: degrees north and east, metres or None; None where it is unset. spec: of a photograph, for exif."""
    if day.where is None:
        return None
    if day.where == "exif":
        _need_photograph(spec, "--where")
        from airlight.files.exif import taken_from

        return taken_from(spec, path)
    return read_where(day.where)


def resolve_altitude(day: Daylight, where: tuple[float, float, float | None] | None) -> float:
    """Choose the eye's altitude, m: as given, else that of the place, else that of somebody who stands by the sea."""
    if day.altitude is not None:
        return day.altitude
    return EYE if where is None or where[2] is None else max(where[2] + EYE, 0.0)


def resolve_sun(
    day: Daylight, place: DaylightPicture | None, where: tuple[float, float, float | None] | None, spec: Any = None, path: str = "",
    tell: Callable[[str], object] = say,
) -> Sun:  # fmt: skip
    """Find the sun, by angles or by time and place; as it is seen, raised by refraction. Raises AirlightError."""
    if day.when is None:
        if place is not None and place.sun is not None:
            azimuth, elevation = read_sun(place.sun)
            return Sun(elevation, azimuth)
        assert place is not None and place.sun_elevation is not None
        return Sun(place.sun_elevation)
    text, name = day.when, "--when"
    if text == "exif":
        _need_photograph(spec, "--when")
        from airlight.files.exif import taken_at

        text, name = taken_at(spec, path), f"{path}: --when exif:"
    assert where is not None
    from airlight.daylight import sun_position

    time = read_when(text, name)
    _, azimuth, apparent = (float(one) for one in sun_position(time, where[0], where[1], where[2] or 0.0))
    tell(f"sun at azimuth {azimuth:.1f}, {apparent:.1f} degrees high")
    return Sun(check_elevation(apparent, f"{name} {text}", BY_DAY), azimuth)


def atmosphere(day: Daylight) -> "Atmosphere":
    """Make the air. Raises AirlightError."""
    from airlight.daylight import Atmosphere

    return Atmosphere(
        day.visibility, day.turbidity, day.ozone, day.ground_albedo, day.aerosol_albedo, day.aerosol_anisotropy, day.wavelengths,
        day.multiple,
    )  # fmt: skip


def option_named(name: str) -> Option:
    """Find a declared parameter."""
    return next(one for one in declared(scenes=True) if one.name == name)


def _need_photograph(spec: Any, name: str) -> None:
    if spec is None:
        raise AirlightError(f"{name} exif reads a photograph, which this is not: give it in numbers")
