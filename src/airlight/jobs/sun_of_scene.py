"""Reads which daylight a scene has: its air, and where its sun stands, by angles, by time and place, or through a day."""

from __future__ import annotations

import datetime
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from airlight.daylight.coefficients import KOSCHMIEDER
from airlight.errors import AirlightError, warn
from airlight.jobs.daylight_sun import AIR, EYE, NONE, OF_PRINTED, SUN_DOWN, atmosphere, is_daylight
from airlight.jobs.daylight_text import BY_DAY, check_elevation, read_sun, read_when, read_where
from airlight.messages import number, say
from airlight.options import Daylight, DaylightScene, Medium, declared
from airlight.scatter.methods import FOR_MEDIUM, METHODS

if TYPE_CHECKING:
    from airlight.scenes.daylight import Daylight as SceneDaylight
    from airlight.scenes.daylight import Track
    from airlight.scenes.stage import Stage

UP = -0.27  # degrees of the sun's apparent centre, at which its upper edge is at the horizon
OF_AIR = ("visibility", "turbidity", "ozone", "ground_albedo", "aerosol_albedo", "aerosol_anisotropy", "wavelengths", "multiple")
OF_PICTURES = ("attenuate", "sky", *OF_PRINTED)  # which a scene has no use for
OF_REACH = ("max_distance", "transparency", "particle_cells")  # of a medium, which say of none that there is one
DENSE_KM = 0.2  # visibility, up to which haze may let no daylight down
NO_LIGHT = 1e-6  # 1/sr: radiance of all directions on the mean, of 1 above the air, below which there is none by day
NO_SUN = "--daylight air needs a sun: add --sun AZ,EL, --when and --where, or --day and --where"
Place = tuple[float, float, float]


@dataclass(frozen=True)
class SunRequest:
    """Says where the sun of a scene stands: suns, texts AZ,EL, as given by --sun; begin, end: times of the day, of --from and --to.

    seconds: of the first and the last frame. own: azimuth, elevation of the scene's own sun, degrees, where none is given; None: it has
    none, or is not open yet.
    """

    suns: Sequence[str] = ()
    begin: str | None = None
    end: str | None = None
    seconds: tuple[float, float] = (0.0, 0.0)
    own: tuple[float, float] | None = None


def with_daylight(values: dict[str, Any], has_densities: bool) -> dict[str, Any]:
    """Add to the values of a scene what goes with daylight: the method that sees its shadows, and no medium but the air if none is given.

    has_densities: volumes or particles lie in it. Raises AirlightError for values that have no meaning.
    """
    if not is_daylight(values):
        return values
    if values["daylight"] != AIR:
        raise AirlightError(f"--daylight {values['daylight']} is for pictures: its even air has no sky; in a scene give --daylight {AIR}")
    for one in declared(scenes=True):
        if one.name in OF_PICTURES and values.get(one.name, one.default) != one.default:
            raise AirlightError(f"{one.flag} is for pictures: leave it out; a scene's sky is drawn anew, and shadows take sunlight alone")
    lit = {"method": FOR_MEDIUM} | values
    has_medium = has_densities or any(one.name in values and one.name not in OF_REACH for one in Medium.options())
    return lit if has_medium or not METHODS[lit["method"]].lights_medium else {"sigma_t": (0.0, 0.0, 0.0)} | lit


def check_view(values: dict[str, Any]) -> None:
    """Raise AirlightError for values of a view, which has a sun to begin with, that contradict each other."""
    if values.get("daylight", NONE) == NONE and values.get("sun") is not None:
        raise AirlightError("--sun is for daylight: add --daylight air, or leave it out")
    if values.get("day") is not None:
        raise AirlightError("--day is for frames, of `airlight render`: in the viewer give --when, and drag its hour")
    _one_sun({"--sun": values.get("sun"), "--when": values.get("when")})
    if values.get("sun") is not None:
        read_sun(values["sun"])
    if values.get("where") is not None:
        read_where(values["where"])
    if values.get("when") is not None:
        read_when(values["when"])


def foresee_daylight(options: Daylight, day: DaylightScene, request: SunRequest, scene: str) -> SceneDaylight | None:
    """Make the daylight of a scene that is not open yet; None where there is none, or its sun is the scene's own. Raises AirlightError for
    all that cannot be. scene: as it is opened."""
    from airlight.scenes.names import SUNLESS

    if options.daylight != NONE and not _given_suns(options, day, request):
        if scene in SUNLESS:
            raise AirlightError(NO_SUN)
        _check_rest(options, day, request)
        return None
    found = scene_daylight(options, day, request)
    if found is not None:
        refuse_darkness(options, found)
    return found


def refuse_darkness(options: Daylight, daylight: SceneDaylight) -> None:
    """Raise AirlightError for haze that by day lets nothing of the sun's light down to the scene: a picture of it would be black."""
    if options.visibility is None or options.visibility > DENSE_KM:
        return
    from airlight.scenes.daylight import Sky

    elevation = daylight.track(0.0 if daylight.span is None else sum(daylight.span) / 2)[1]
    if elevation > 0 and float(Sky(daylight.air, elevation, daylight.altitude).mean.max()) < NO_LIGHT:
        near = f"fog near the ground, as by --sigma-t {number(KOSCHMIEDER / (1000 * options.visibility), 2)} without --visibility"
        deep = "of daylight next to nothing comes down through so much haze, which is kilometres deep"
        raise AirlightError(f"--visibility {options.visibility:g}: {deep}: give --visibility 0.2 or more, or {near}")


def put_daylight(stage: Stage, built: dict[type, Any], request: SunRequest, made: SceneDaylight | None = None) -> None:
    """Light a stage by the daylight that is asked for, if one is; the scene's own sun says where it stands if nothing else does.

    built: its options. made: its daylight, if it was made before. Raises AirlightError.
    """
    options, day = built[Daylight], built[DaylightScene]
    if made is None and options.daylight != NONE and not _given_suns(options, day, request):
        request = replace(request, own=own_sun(stage))
        if request.own is not None:
            azimuth, elevation = request.own
            say(f"sun at azimuth {azimuth:.1f}, {elevation:.1f} degrees high, as the scene's own; --sun AZ,EL sets it", prefix="")
    daylight = made or scene_daylight(options, day, request)
    if daylight is None:
        return
    if made is None:
        refuse_darkness(options, daylight)
    elevation = daylight.track(0.0)[1]
    if daylight.span is None and elevation < SUN_DOWN:
        warn(f"the sun is {-elevation:.1f} degrees below the horizon: the sky lights the scene, and there are no shafts of it")
    daylight.put(stage)


def own_sun(stage: Stage) -> tuple[float, float] | None:
    """Find azimuth and elevation, degrees, of the brightest of a stage's own suns, not below the horizon's dusk; None where it has none."""
    from airlight.lights.directional import DirectionalLight
    from airlight.pygfx.punctual import punctual_lights

    suns = [one for one in punctual_lights(stage.lights) if isinstance(one, DirectionalLight)]
    if not suns:
        return None
    x, y, z = (float(v) for v in max(suns, key=lambda one: max(one.intensity)).direction)
    elevation = math.degrees(math.atan2(y, math.hypot(x, z)))
    return math.degrees(math.atan2(x, -z)) % 360, check_elevation(elevation, "the scene's own sun", "give --sun AZ,EL")


def scene_daylight(options: Daylight, day: DaylightScene, request: SunRequest) -> SceneDaylight | None:
    """Make the daylight of a scene; None where there is none. Raises AirlightError."""
    if options.daylight == NONE:
        if request.begin is not None or request.end is not None:
            raise AirlightError("--from and --to are for daylight: add --day and --daylight air, or leave them out")
        return None
    from airlight.scenes.daylight import SUN_LUX
    from airlight.scenes.daylight import Daylight as SceneDaylight

    where = None if options.where is None else read_where(options.where)
    air = atmosphere(options)
    track, span = _track(options, day, request, where)
    lux = SUN_LUX if options.sun_strength is None else options.sun_strength
    return SceneDaylight(air, track, altitude_of(options, where), lux, span)


def altitude_of(options: Daylight, where: tuple[float, float, float | None] | None) -> float:
    """Choose the altitude of y = 0, m: as given, else that of the place."""
    if options.altitude is not None:
        return options.altitude
    return EYE if where is None or where[2] is None else max(where[2], 0.0)


def _one_sun(ways: dict[str, Any]) -> list[str]:
    """List the options by which a sun is given. Raises AirlightError for several."""
    given = [name for name, value in ways.items() if value]
    if len(given) > 1:
        raise AirlightError(f"{' and '.join(given)} both say where the sun is: give one of them")
    return given


def _given_suns(options: Daylight, day: DaylightScene, request: SunRequest) -> list[str]:
    """List the options by which the sun of a scene is given. Raises AirlightError for several."""
    return _one_sun({"--sun": request.suns, "--when": options.when, "--day": day.day})


def _check_rest(options: Daylight, day: DaylightScene, request: SunRequest) -> None:
    """Raise AirlightError for an air that cannot be, and for what goes with a day that is not given."""
    atmosphere(options)
    if options.where is not None:
        read_where(options.where)
    if day.day is None and (request.begin is not None or request.end is not None):
        raise AirlightError("--from and --to go with --day: add a date, as in --day 2026-06-21")


def _track(options: Daylight, day: DaylightScene, request: SunRequest, where: Any) -> tuple[Track, tuple[float, float] | None]:
    """Find where the sun stands at a time of the scene, s, and from when to when it moves; None of one that stands."""
    given = _given_suns(options, day, request)
    if not given and request.own is None:
        raise AirlightError(NO_SUN)
    _check_rest(options, day, request)
    if not given:
        own = request.own
        assert own is not None
        return (lambda _: own), None
    if request.suns:
        if len(request.suns) > 1:
            raise AirlightError("daylight has one sun: give --sun once")
        azimuth, elevation = read_sun(request.suns[0])
        return (lambda _: (azimuth + day.north, elevation)), None
    if where is None:
        raise AirlightError(f"{given[0]} needs the place too: add --where LAT,LON in degrees, as in --where 47.42,10.98,2962")
    place = where[0], where[1], where[2] or 0.0
    if options.when is not None:
        if options.when == "exif":
            raise AirlightError("--when exif reads a photograph, which a scene is not: give a time, as 2026-06-21T19:30+02:00")
        azimuth, elevation = _seen(read_when(options.when), place)
        check_elevation(elevation, f"--when {options.when}", BY_DAY)
        return (lambda _: (azimuth + day.north, elevation)), None
    start, end = _span(str(day.day), request, place)
    first, last = request.seconds
    if last <= first:
        raise AirlightError("--day goes with several frames, as in --frames 1-240: for one moment give --when")
    pace = (end - start) / (last - first)

    def track(time: float) -> tuple[float, float]:
        azimuth, elevation = _seen(_at(start + pace * (time - first)), place)
        return azimuth + day.north, elevation

    return track, (first, last)


def _seen(time: datetime.datetime, place: Place) -> tuple[float, float]:
    """Find azimuth and apparent elevation of the sun, degrees."""
    from airlight.daylight import sun_position

    _, azimuth, elevation = (float(one) for one in sun_position(time, *place))
    return azimuth, elevation


def _at(seconds: float) -> datetime.datetime:
    return datetime.datetime.fromtimestamp(seconds, datetime.UTC)


def _span(day: str, request: SunRequest, place: Place) -> tuple[float, float]:
    """Find the first and the last moment, seconds since 1970, of a day at a place: given, else of sunrise and sunset."""
    try:
        date = datetime.date.fromisoformat(day)
    except ValueError as error:
        raise AirlightError(f"--day {day}: there is no such date ({error}): write it as 2026-06-21") from None
    start, end = (None if text is None else _time_of(date, text, name) for text, name in ((request.begin, "--from"), (request.end, "--to")))
    if start is None or end is None:
        rise, fall = sun_up(date, place)
        start, end = rise if start is None else start, fall if end is None else end
    if end <= start:
        raise AirlightError(f"the frames end at {_at(end):%H:%M}Z, and begin at {_at(start):%H:%M}Z: give other --from and --to")
    return start, end


def sun_up(date: datetime.date, place: Place) -> tuple[float, float]:
    """Find sunrise and sunset, seconds since 1970, of the day around the sun's noon at a place. Raises AirlightError in a polar night."""
    from airlight.daylight import sun_position

    noon = datetime.datetime.combine(date, datetime.time(12), datetime.UTC).timestamp() - 240 * place[1]

    def above(times: np.ndarray) -> np.ndarray:
        """Measure how far the sun's upper edge is above the horizon, degrees."""
        return np.asarray(sun_position([_at(t) for t in times], *place)[2] - UP)

    times = noon + np.linspace(-43_200, 43_200, 97)
    up = above(times)
    lit = np.flatnonzero(up > 0)
    if not len(lit):
        raise AirlightError(f"--day {date}: the sun does not rise at {place[0]:g},{place[1]:g}: give --from and --to")
    if len(lit) == len(times):
        warn(f"the sun does not set on {date} at {place[0]:g},{place[1]:g}: the frames run through 24 hours")

    def crossing(i: int) -> float:
        finer = np.linspace(times[i], times[i + 1], 16)
        found = above(finer)
        k = int(np.flatnonzero((found[1:] > 0) != (found[:-1] > 0))[0])
        return float(finer[k] + (finer[k + 1] - finer[k]) * found[k] / (found[k] - found[k + 1]))

    first, last = int(lit[0]), int(lit[-1])
    return times[0] if first == 0 else crossing(first - 1), times[-1] if last == len(times) - 1 else crossing(last)


def _time_of(date: datetime.date, text: str, name: str) -> float:
    """Read HH:MM with a zone as a moment of a date."""
    try:
        found = datetime.time.fromisoformat(text)
    except ValueError:
        raise AirlightError(f"cannot read {name} {text}: write a time of the day with its zone, as 05:30+02:00 or 03:30Z") from None
    if found.utcoffset() is None:
        raise AirlightError(f"{name} {text}: the time has no zone: add Z, or as for Central European Summer Time +02:00")
    return datetime.datetime.combine(date, found).timestamp()
