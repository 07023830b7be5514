"""Reads what a photograph says of its making: time with its zone, place, focal length. Each lack is one line with its cure."""

import datetime
import math
import re
from typing import Any

from airlight.errors import AirlightError

DIAGONAL_35MM = 43.2666  # mm, of a frame of 35 mm film, by whose diagonal focal lengths are compared
LOWEST_M, HIGHEST_M = -430.0, 1e5  # of a camera, which may fly
_TIME = re.compile(r"(\d{4})[:-](\d\d)[:-](\d\d)[ T](\d\d):(\d\d):(\d\d)")


def taken_at(spec: Any, path: str) -> str:
    """Give when a photograph was taken, ISO 8601 with its offset from UTC: as the camera says, else by its GPS. Raises AirlightError."""
    cure = "give --when as 2026-06-21T19:30+02:00"
    said = _text(spec, "Exif:DateTimeOriginal") or _text(spec, "Exif:DateTimeDigitized") or _text(spec, "DateTime")
    offset = _text(spec, "Exif:OffsetTimeOriginal") or _text(spec, "Exif:OffsetTimeDigitized") or _text(spec, "Exif:OffsetTime")
    found = _TIME.match(said)
    if found is not None and re.fullmatch(r"[+-]\d\d:\d\d|Z", offset):
        return f"{found[1]}-{found[2]}-{found[3]}T{found[4]}:{found[5]}:{found[6]}{offset}"
    date, time = _text(spec, "GPS:DateStamp"), spec.getattribute("GPS:TimeStamp")
    if re.fullmatch(r"\d{4}:\d\d:\d\d", date) and isinstance(time, tuple) and len(time) == 3 and all(0 <= one < 60 for one in time):
        seconds = int(time[0] * 3600 + time[1] * 60 + time[2])  # not rounded: a day has no 24:00:00
        day = datetime.timedelta(seconds=seconds)
        return f"{date.replace(':', '-')}T{day // datetime.timedelta(hours=1):02}:{seconds // 60 % 60:02}:{seconds % 60:02}Z"
    if found is not None:
        local = f"{found[1]}-{found[2]}-{found[3]}T{found[4]}:{found[5]}"
        raise AirlightError(f"{path}: --when exif: its time {local} has no offset from UTC: give --when {local}+02:00, with its own")
    raise AirlightError(f"{path}: --when exif: it does not say when it was taken: {cure}")


def taken_from(spec: Any, path: str) -> tuple[float, float, float | None]:
    """Give where a photograph was taken: degrees north and east, metres above the sea or None. Raises AirlightError."""
    sides = []
    for name, back in (("Latitude", "S"), ("Longitude", "W")):
        value, side = spec.getattribute(f"GPS:{name}"), _text(spec, f"GPS:{name}Ref")
        if not isinstance(value, tuple) or len(value) != 3:
            raise AirlightError(f"{path}: --where exif: it does not say where it was taken: give --where LAT,LON in degrees")
        degrees = value[0] + value[1] / 60 + value[2] / 3600
        sides.append(-degrees if side.upper().startswith(back) else degrees)
    if not (abs(sides[0]) <= 90 and abs(sides[1]) <= 180):  # NaN too
        there = f"its place {sides[0]:g},{sides[1]:g} is not on the earth"
        raise AirlightError(f"{path}: --where exif: {there}: give --where LAT,LON in degrees")
    height = spec.getattribute("GPS:Altitude")
    if height is None or math.isnan(height):  # 0/0 is how files say that they do not know
        return sides[0], sides[1], None
    altitude = -float(height) if spec.getattribute("GPS:AltitudeRef") in (1, "1", b"\1", "\1") else float(height)
    if not LOWEST_M <= altitude <= HIGHEST_M:
        raise AirlightError(f"{path}: --where exif: its altitude {altitude:g} m is not one of the air: give --where LAT,LON,ALT")
    return sides[0], sides[1], altitude


def focal_length(spec: Any, path: str) -> float:
    """Give the focal length, mm, that 35 mm film would need for the same picture. Raises AirlightError."""
    value = spec.getattribute("Exif:FocalLengthIn35mmFilm")
    if value is None or not 1 <= float(value) <= 10_000:
        raise AirlightError(f"{path}: --fov exif: it does not say its focal length on 35 mm film: give --fov in degrees, as in --fov 50")
    return float(value)


def _text(spec: Any, name: str) -> str:
    """Read a text; "" where there is none."""
    value = spec.getattribute(name)
    return value.strip("\0 ") if isinstance(value, str) else ""
