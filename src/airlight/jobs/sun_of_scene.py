"""Reads which daylight a scene has: its air, and where its sun stands, by angles, by time and place, or through a day."""

from __future__ import annotations

import datetime
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from airlight.daylight import Atmosphere, sun_position
from airlight.daylight.atmosphere import LOWEST_SUN
from airlight.errors import AirlightError, warn
from airlight.options import Daylight, DaylightScene, Medium
from airlight.scatter.methods import FOR_MEDIUM

if TYPE_CHECKING:
    from airlight.scenes.daylight import Daylight as SceneDaylight
    from airlight.scenes.daylight import Track
    from airlight.scenes.stage import Stage

UP = -0.27  # degrees of the apparent centre, at which the sun's upper edge is at the horizon
ALTITUDE = 2.0  # m, of y = 0, unless given
WHERE = ("latitude", -90.0, 90.0), ("longitude", -180.0, 180.0), ("altitude", -430.0, 9000.0)
OF_AIR = ("visibility", "turbidity", "ozone", "ground_albedo", "aerosol_albedo", "aerosol_anisotropy", "wavelengths", "multiple")
OF_PICTURES = ("attenuate", "sky", "beta_rayleigh", "beta_mie")  # which a scene has no use for


@dataclass(frozen=True)
class SunRequest:
    """Says where the sun of a scene stands: suns, texts AZ,EL, as given by --sun; begin, end: times of the day, of --from and --to.

    seconds: of the first and the last frame.
    """

    suns: Sequence[str] = ()
    begin: str | None = None
    end: str | None = None
    seconds: tuple[float, float] = (0.0, 0.0)


def atmosphere(options: Daylight) -> Atmosphere:
    """Make the air that is asked for. Raises AirlightError."""
    return Atmosphere(**{name: getattr(options, name) for name in OF_AIR})


def read_where(text: str) -> tuple[float, float, float | None]:
    """Read LAT,LON[,ALT], degrees and m. Raises AirlightError."""
    parts = text.split(",")
    try:
        found = [float(part) for part in parts]
    except ValueError:
        found = []
    if len(found) not in (2, 3):
        raise AirlightError(f"cannot read --where {text!r}: write latitude and longitude in degrees, and metres above the sea: 47.42,10.98,2962")
    for value, (name, low, high) in zip(found, WHERE):
        if not low <= value <= high:
            raise AirlightError(f"--where {text}: a {name} of {value:g} is not within {low:g} to {high:g}")
    return found[0], found[1], found[2] if len(found) > 2 else None


def scene_daylight(options: Daylight, day: DaylightScene, request: SunRequest) -> SceneDaylight | None:
    """Make the daylight of a scene; None where there is none. Raises AirlightError."""
    if options.daylight == "none":
        _refuse_idle(options, day, request)
        return None
    if options.daylight != "air":
        raise AirlightError("--daylight hoffman-preetham is for pictures: its even air has no sky; in a scene give --daylight air")
    for name in OF_PICTURES:
        if getattr(options, name) != getattr(Daylight(), name):
            raise AirlightError(f"--{name.replace('_', '-')} is for pictures: leave it out, a scene's sky is drawn anew and keeps its Lms")
    from airlight.scenes.daylight import SUN_LUX
    from airlight.scenes.daylight import Daylight as SceneDaylight

    where = None if options.where is None else read_where(options.where)
    track, middle = _track(options, day, request, where)
    lowest = min(track(request.seconds[0])[1], track(request.seconds[1])[1])
    if lowest < LOWEST_SUN and middle is None:
        raise AirlightError(f"the sun stands at {lowest:.1f} degrees, and the dusk ends at {LOWEST_SUN:g}: give a time with more light")
    altitude = options.altitude if options.altitude is not None else (where[2] if where and where[2] is not None else ALTITUDE)
    lux = SUN_LUX if options.sun_strength is None else options.sun_strength
    return SceneDaylight(atmosphere(options), track, max(altitude, 0.0), lux, middle)


def with_daylight(values: dict[str, Any], has_densities: bool) -> dict[str, Any]:
    """Add to the values of a scene what goes with daylight: the method that sees its shadows, and no medium but the air, unless one is given.

    has_densities: volumes or particles lie in it.
    """
    if values.get("daylight", "none") == "none":
        return values
    has_medium = has_densities or any(one.name in values for one in Medium.options())
    return {"method": FOR_MEDIUM} | ({} if has_medium else {"sigma_t": (0.0, 0.0, 0.0)}) | values


def put_daylight(stage: Stage, built: dict[type, Any], request: SunRequest) -> None:
    """Light a stage by the daylight that is asked for, if one is. built: its options. Raises AirlightError."""
    daylight = scene_daylight(built[Daylight], built[DaylightScene], request)
    if daylight is not None:
        daylight.put(stage)


def _refuse_idle(options: Daylight, day: DaylightScene, request: SunRequest) -> None:
    """Raise AirlightError for what says something of a daylight that is not asked for."""
    for group in (options, day):
        for one in group.options():
            if one.name != "daylight" and getattr(group, one.name) != one.default:
                raise AirlightError(f"{one.flag} goes with --daylight air; give it too")
    if request.begin is not None or request.end is not None:
        raise AirlightError("--from and --to go with --day and --daylight air; give them too")


def _track(options: Daylight, day: DaylightScene, request: SunRequest, where: Any) -> tuple[Track, float | None]:
    """Find where the sun stands at a time of the scene, s, and when it is halfway; None of one that stands."""
    given = [name for name, one in (("--sun", request.suns), ("--when", options.when), ("--day", day.day)) if one]
    if not given:
        raise AirlightError("--daylight needs a sun: give --sun AZ,EL, or --when and --where, or --day and --where")
    if len(given) > 1:
        raise AirlightError(f"{' and '.join(given)} all say where the sun stands; give one of them")
    if day.day is None and (request.begin is not None or request.end is not None):
        raise AirlightError("--from and --to go with --day; give a date, as --day 2026-06-21")
    if request.suns:
        azimuth, elevation = _angles(request.suns)
        return (lambda _: (azimuth + day.north, elevation)), None
    if where is None:
        raise AirlightError(f"{given[0]} needs a place: give --where LAT,LON, as 47.42,10.98")
    place = where[0], where[1], where[2] or 0.0
    if options.when is not None:
        if options.when == "exif":
            raise AirlightError("--when exif is for photographs: of a scene give a time, as 2026-06-21T19:30+02:00")
        _, azimuth, elevation = (float(one) for one in sun_position(options.when, *place))
        return (lambda _: (azimuth + day.north, elevation)), None
    start, end = _span(str(day.day), request, place)
    first, last = request.seconds
    if last <= first:
        raise AirlightError("--day goes with several frames, as --frames 1-240; for one moment give --when")
    pace = (end - start) / (last - first)

    def track(time: float) -> tuple[float, float]:
        _, azimuth, elevation = (float(one) for one in sun_position(_at(start + pace * (time - first)), *place))
        return azimuth + day.north, elevation

    return track, (first + last) / 2


def checked_sun(values: dict[str, Any]) -> tuple[float, float] | None:
    """Take the sun out of the values of a view, which has one to begin with: None unset. Raises AirlightError for what goes not with others."""
    sun = values.pop("sun", None)
    if sun is None:
        return None
    if values.get("daylight", "none") == "none":
        raise AirlightError("--sun goes with --daylight air; give it too")
    if values.get("when") is not None:
        raise AirlightError("--sun and --when both say where the sun stands; give one of them")
    return _angles([sun])


def _angles(suns: Sequence[str]) -> tuple[float, float]:
    """Read the sun's azimuth and elevation, degrees."""
    if len(suns) > 1:
        raise AirlightError("daylight has one sun; give --sun once")
    try:
        azimuth, elevation = (float(part) for part in suns[0].split(","))
    except ValueError:
        raise AirlightError(f"--sun {suns[0]}: of daylight are azimuth and elevation alone, as 240,12: the air makes its colour") from None
    if not (math.isfinite(azimuth) and LOWEST_SUN <= elevation <= 90):
        raise AirlightError(f"--sun {suns[0]}: an elevation of {elevation:g} is not within {LOWEST_SUN:g}, where dusk ends, to 90 degrees")
    return azimuth, elevation


def _at(seconds: float) -> datetime.datetime:
    return datetime.datetime.fromtimestamp(seconds, datetime.UTC)


def _span(day: str, request: SunRequest, place: tuple[float, float, float]) -> tuple[float, float]:
    """Find the first and the last moment, seconds since 1970, of a day at a place: given, else of sunrise and sunset."""
    try:
        date = datetime.date.fromisoformat(day)
    except ValueError as error:
        raise AirlightError(f"--day is {day!r}, which is no date ({error}); give it as 2026-06-21") from None
    noon = datetime.datetime.combine(date, datetime.time(12), datetime.UTC).timestamp() - 240 * place[1]
    start, end = (None if text is None else _time_of(date, text, name) for text, name in ((request.begin, "--from"), (request.end, "--to")))
    if start is None or end is None:
        times = noon + np.linspace(-43_200, 43_200, 1441)
        up = sun_position([_at(t) for t in times], *place)[2] - UP
        if not (up > 0).any():
            raise AirlightError(f"the sun does not rise on {day} at {place[0]:g},{place[1]:g}: give --from and --to")
        if (up > 0).all():
            warn(f"the sun does not set on {day} at {place[0]:g},{place[1]:g}: the frames run through 24 hours")
        lit = np.flatnonzero(up > 0)
        rise, fall = int(lit[0]), int(lit[-1])
        rising = times[0] if rise == 0 else _crossing(times, up, rise - 1)
        setting = times[-1] if fall == len(times) - 1 else _crossing(times, up, fall)
        start, end = rising if start is None else start, setting if end is None else end
    if end <= start:
        raise AirlightError(f"--to is {_at(end):%H:%M}Z, not after {_at(start):%H:%M}Z, where the frames begin: give a later one")
    return start, end


def _crossing(times: Any, values: Any, i: int) -> float:
    return float(times[i] + (times[i + 1] - times[i]) * values[i] / (values[i] - values[i + 1]))


def _time_of(date: datetime.date, text: str, name: str) -> float:
    """Read HH:MM with a zone as a moment of a date."""
    try:
        found = datetime.time.fromisoformat(text)
    except ValueError:
        raise AirlightError(f"cannot read {name} {text!r}: write a time of the day with its zone, as 05:30+02:00 or 03:30Z") from None
    if found.tzinfo is None:
        raise AirlightError(f"{name} {text} has no zone: add Z or, as for Central European Summer Time, +02:00")
    return datetime.datetime.combine(date, found).timestamp()
