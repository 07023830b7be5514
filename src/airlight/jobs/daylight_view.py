"""Finds how a photograph with daylight is seen: sun, camera, and where in the picture the sun is."""

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from airlight.daylight.camera import MOST_APART, Camera, angle_between, direction_of, solve_pitch
from airlight.errors import AirlightError
from airlight.jobs.daylight_sun import SUN_DOWN, Sun, resolve_altitude, resolve_sun, resolve_where
from airlight.jobs.finding import resolve_lights
from airlight.jobs.light_text import LightText, windows
from airlight.lights import parse_position
from airlight.messages import say

if TYPE_CHECKING:
    from airlight.files import Picture
    from airlight.jobs.image import ImageRequest
    from airlight.options import Daylight, DaylightPicture


@dataclass(frozen=True)
class View:
    """Says how a picture is seen.

    camera: of the display window; corner: pixels of it, left and top, where the picture's own begin. azimuth: the sun's, in the camera's
    world. altitude: the eye's, m. light: where in the display window the sun is, parts of its size; None behind the camera. strength: the
    sun's irradiance above the air, None until it is chosen.
    """

    camera: Camera
    corner: tuple[int, int]
    sun: Sun
    azimuth: float
    altitude: float
    light: tuple[float, float] | None
    strength: float | None = None


def find_view(
    request: "ImageRequest", day: "Daylight", where: "DaylightPicture", picture: "Picture", many: bool,
    tell: Callable[[str], object] | None = None,
) -> tuple[View, list[LightText]]:  # fmt: skip
    """Find sun and camera of a picture, and its light as written, none where the sun is behind. Raises AirlightError.

    The sun's place in the picture is that of --light, where the user says it; else where the camera has it; else it is searched for.
    tell: takes the line that says all that was found. many: pictures are worked on: the line names its own.
    """
    seen: list[str] = []
    found = _find_view(request, day, where, picture, seen.append)
    if seen:
        (tell or functools.partial(say, prefix=""))((f"{picture.path}: " if many else "") + "; ".join(seen))
    return found


def _find_view(
    request: "ImageRequest", day: "Daylight", where: "DaylightPicture", picture: "Picture", tell: Callable[[str], object]
) -> tuple[View, list[LightText]]:
    """Find what `find_view` does, and tell each of its findings by itself."""
    place = resolve_where(day, picture.spec, picture.path)
    sun = resolve_sun(day, where, place, picture.spec, picture.path, tell)
    shown, data = windows(picture)
    camera = Camera(shown[2], shown[3], _fov(where.fov, shown, picture, tell), where.pitch or 0.0, where.roll, where.heading or 0.0)
    is_aimed = where.heading is not None and sun.azimuth is not None
    written = request.lights[0]
    light: tuple[float, float] | None = None
    lights: list[LightText] = []
    if not (is_aimed and written.searched is not None):
        coarse = picture.rec709(picture.linear(coarse=True)) if written.searched is not None else None
        lights = resolve_lights(request.lights, picture, request.origin, coarse, tell=lambda line: _tell_found(line, tell))
        if not lights:
            raise AirlightError(
                f"{picture.path}: the camera does not know where the sun is: give --light X,Y, or --heading with --sun AZ,EL or --when"
            )
        x, y = parse_position(lights[0].position, 1, 1)
        light = x, y
    if light is None:
        azimuth = sun.azimuth or 0.0
        light = camera.seen(direction_of(azimuth, sun.elevation))
        lights = [] if light is None else [LightText(f"{light[0]!r},{light[1]!r}")]
        if light is None and sun.elevation >= SUN_DOWN:
            tell("the sun is behind the camera: daylight, but no shafts")
    else:
        camera, azimuth = _aimed(camera, where, sun, light, written, tell)
    corner = data[0] - shown[0], data[1] - shown[1]
    return View(camera, corner, sun, azimuth, resolve_altitude(day, place), light), lights


def _tell_found(line: str, tell: Callable[[str], object]) -> None:
    """Tell where a light was found; where none was, the error that follows says it."""
    if "left as it is" not in line:
        tell(line)


def _aimed(
    camera: Camera, where: "DaylightPicture", sun: Sun, light: tuple[float, float], written: LightText, tell: Callable[[str], object]
) -> tuple[Camera, float]:
    """Turn the camera so that it has the sun at a point of the picture, or check that it has; give the sun's azimuth too."""
    if where.pitch is None:
        camera = replace(camera, pitch=solve_pitch(camera, light, sun.elevation))
        tell(f"camera looks {abs(camera.pitch):.1f} degrees {'up' if camera.pitch >= 0 else 'down'}, by the light and the sun")
    east, _, north = camera.at(*light)
    own = math.degrees(math.atan2(east, north))
    azimuth = sun.azimuth
    if where.heading is None:
        if azimuth is None:
            azimuth = own
        camera = replace(camera, heading=camera.heading + azimuth - own)
    elif azimuth is None:
        azimuth = own
    apart = angle_between(camera.at(*light), direction_of(azimuth, sun.elevation))
    if apart > MOST_APART:
        there = camera.seen(direction_of(azimuth, sun.elevation))
        place = f"at {there[0]:.3f},{there[1]:.3f}" if there is not None else "behind it"
        at = f"--light {written.position}" if written.searched is None else f"the light at {light[0]:.3f},{light[1]:.3f}"
        fewer = "--pitch or --heading" if where.heading is not None else "--pitch"
        raise AirlightError(
            f"{at} is {apart:.1f} degrees away from the sun, which this camera has {place}: mend --fov or the sun, or leave out {fewer}"
        )
    return camera, azimuth


def _fov(fov: Any, shown: Any, picture: "Picture", tell: Callable[[str], object]) -> float:
    """Give the angle of view of the smaller side, degrees: as given, or by the focal length that the photograph tells."""
    if fov != "exif":
        return float(fov)
    if picture.spec is None:
        raise AirlightError("--fov exif reads a photograph: give it in degrees")
    from airlight.files.exif import DIAGONAL_35MM, focal_length

    focal = focal_length(picture.spec, picture.path)
    half = DIAGONAL_35MM / 2 * min(shown[2:]) / math.hypot(*shown[2:])
    found = 2 * math.degrees(math.atan(half / focal))
    tell(f"angle of view {found:.1f} degrees, of a lens of {focal:g} mm on 35 mm film")
    return min(max(found, 1.0), 170.0)
