"""Reads what a user writes of the sun's place and of depths: angles, times, places, spans. Each failure is one line with its cure."""

import datetime
import math

from airlight.errors import AirlightError

LOWEST_SUN = -18.0  # degrees
BY_DAY = "give a --when by day, or in twilight"
LOWEST, HIGHEST = -430.0, 9000.0  # m, of a place on the ground


def read_sun(text: str) -> tuple[float, float]:
    """Read `AZ,EL`: azimuth, any, and elevation, -18..90, degrees."""
    found = _numbers(text)
    if found is None or len(found) != 2:
        raise AirlightError(f"cannot read --sun {text}: write azimuth and elevation in degrees, as in --sun 240,12")
    return found[0], check_elevation(found[1], f"--sun {text}")


def check_elevation(elevation: float, written: str, cure: str = "give -18 to 90") -> float:
    """Refuse a sun that gives no daylight. written: as it stands on the command line."""
    if not LOWEST_SUN <= elevation <= 90:
        low = f"the sun is {elevation:.1f} degrees high, and below {LOWEST_SUN:g} no daylight is left"
        raise AirlightError(f"{written}: {low if elevation < 0 else 'the sun is no higher than 90 degrees'}: {cure}")
    return elevation


def read_where(text: str) -> tuple[float, float, float | None]:
    """Read `LAT,LON[,ALT]`: degrees north and east, metres above the sea or None."""
    found = _numbers(text)
    if found is None or len(found) not in (2, 3):
        form = "write latitude and longitude in degrees, and metres if you like, as in --where 47.42,10.98,2962"
        raise AirlightError(f"cannot read --where {text}: {form}")
    latitude, longitude, *altitude = found
    if abs(latitude) > 90:
        swapped = ", or is it the longitude? Latitude comes first" if abs(longitude) <= 90 else ""
        raise AirlightError(f"--where {text}: the latitude {latitude:g} is beyond 90 degrees north or south: give -90 to 90{swapped}")
    if abs(longitude) > 180:
        raise AirlightError(f"--where {text}: the longitude {longitude:g} is beyond 180 degrees east or west: give -180 to 180")
    if altitude and not LOWEST <= altitude[0] <= HIGHEST:
        high = f"the place is {altitude[0]:g} m high, and the ground {LOWEST:g} to {HIGHEST:g}"
        raise AirlightError(f"--where {text}: {high}: give --altitude for an eye above it")
    return latitude, longitude, altitude[0] if altitude else None


def read_when(text: str, name: str = "--when") -> datetime.datetime:
    """Read a time by ISO 8601 with its zone. name: of the option."""
    try:
        found = datetime.datetime.fromisoformat(text.strip())
    except ValueError as error:
        reason = str(error) if "must be in" in str(error) or "out of range" in str(error) else ""
        no_such = f"there is no such time ({reason})" if reason else "that is no time by ISO 8601"
        raise AirlightError(f"{name} {text}: {no_such}: write it as 2026-06-21T19:30+02:00, or with Z") from None
    if found.utcoffset() is None:
        raise AirlightError(f"{name} {text}: the time has no zone: add Z, or as for Central European Summer Time +02:00")
    return found


def read_span(text: str) -> tuple[float, float]:
    """Read `NEAR,FAR` of --depth-range, metres; FAR may be inf."""
    found = _numbers(text, infinite=True)
    if found is None or len(found) != 2 or not 0 < found[0] < found[1] or math.isinf(found[0]):
        raise AirlightError(f"--depth-range {text}: write two distances in metres, the nearer first, as in --depth-range 2,5000")
    return found[0], found[1]


def _numbers(text: str, infinite: bool = False) -> list[float] | None:
    """Read numbers between commas; None where some are none, or not finite."""
    try:
        found = [float(part) for part in text.split(",")]
    except ValueError:
        return None
    return found if all(math.isfinite(one) or (infinite and one == math.inf) for one in found) else None
