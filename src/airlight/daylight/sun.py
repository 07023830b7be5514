"""Finds the sun's place in the sky, by the package sunposition: Reda and Andreas 2004."""

import datetime
from typing import Any

import numpy as np

from airlight.daylight.checks import broadcast, numbers
from airlight.errors import AirlightError
from airlight.reference.daylight import Array

DELTA_T = 69.0  # seconds of earth's slower turning, of these years; 30 more or less are 0.0004 degrees
PRESSURE, TEMPERATURE = 1013.25, 12.0  # hPa, degrees Celsius: of the refraction
UP = -0.8333  # degrees: below it the sun's upper edge is down, and refraction fades
FADE = 4.0  # degrees over which it does
ALTITUDE = (-430.0, 100_000.0)  # m
YEARS = (1000, 6000)  # which the algorithm's authors tested it for, and which a datetime can say


def sun_position(when: Any, latitude: Any, longitude: Any, altitude: Any = 0.0) -> tuple[Array, Array, Array]:
    """Find (elevation, azimuth, apparent elevation) of the sun's centre, degrees, each (...).

    when: ISO 8601 with a zone, as "2026-06-21T12:00:00Z" or "...+02:00", an aware datetime, or a list of these; latitude, -90..90, and
    longitude, -180..180, degrees, east positive; altitude: m, -430..100000. Arguments broadcast.

    elevation: geometric; azimuth: 0..360 from north by east; apparent elevation: raised by refraction, at 1013.25 hPa and 12 degrees
    Celsius, which fades below the horizon without a jump: light by it. Error: 0.001 degrees; near the horizon refraction itself varies by
    0.1 or more. Source: Reda and Andreas 2004. Raises AirlightError.
    """
    given = _objects(when)
    times = np.reshape([_timestamp(one) for one in given.flat], given.shape).astype(float)
    times, latitude, longitude, altitude = broadcast(
        when=times, latitude=numbers("latitude", latitude, -90, 90), longitude=numbers("longitude", longitude, -180, 180),
        altitude=numbers("altitude", altitude, *ALTITUDE, unit="m"),
    )  # fmt: skip
    if times.size == 0:
        return times, times.copy(), times.copy()
    from sunposition import sunpos  # when it is asked for: it imports for a tenth of a second

    azimuth, zenith = sunpos(times, latitude, longitude, altitude, pressure=0, delta_t=DELTA_T, jit=False)[:2]
    elevation = 90 - np.asarray(zenith, float)
    return elevation, np.asarray(azimuth, float) % 360, elevation + refraction(elevation)


def refraction(elevation: Any) -> Array:
    """Evaluate how far, degrees, the air raises the sun of a geometric elevation, degrees: Reda and Andreas 2004, equation 42.

    That is for a sun that is up; below, where nobody sees it, it fades over 4 degrees, so that a setting sun's apparent elevation does not
    jump.
    """
    elevation = np.asarray(elevation, float)
    up = np.maximum(elevation, UP)
    raised = PRESSURE / 1010 * 283 / (273 + TEMPERATURE) * 1.02 / (60 * np.tan(np.radians(up + 10.3 / (up + 5.11))))
    return np.asarray(raised * np.clip(1 - (UP - elevation) / FADE, 0, 1) * (elevation < 89.9))


def _objects(when: Any) -> Any:
    """Hold times as an array of objects, of the shape in which they are given."""
    if isinstance(when, np.ndarray) and when.dtype.kind in "OU":
        return when.astype(object)
    if isinstance(when, list | tuple):
        out = np.empty(len(when), object)
        out[:] = when
        return out
    out = np.empty((), object)
    out[()] = when
    return out


def _timestamp(when: Any) -> float:
    """Read one time as seconds since 1970."""
    if isinstance(when, str):
        try:
            time = datetime.datetime.fromisoformat(when)
        except ValueError as error:
            cure = "give it as 2026-06-21T12:00:00Z, or with +02:00 for the Z"
            raise AirlightError(f"when is {when!r}, which is no time ({error}); {cure}") from None
    elif isinstance(when, datetime.datetime):
        time = when
    else:
        raise AirlightError(f"when is a {type(when).__name__}; give ISO 8601 with a zone, or a datetime that has one")
    if time.utcoffset() is None:
        raise AirlightError(f"when is {str(when)!r}, without a zone; add Z or, as for Central European Summer Time, +02:00")
    if not YEARS[0] <= time.year <= YEARS[1]:
        raise AirlightError(f"when is in the year {time.year}; give {YEARS[0]} to {YEARS[1]}")
    return time.timestamp()
