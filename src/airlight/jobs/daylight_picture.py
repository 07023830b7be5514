"""Puts daylight on pictures: what `airlight image --daylight` asks for."""

import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from airlight.errors import AirlightError, warn
from airlight.jobs import outputs
from airlight.jobs.clips import Settled
from airlight.jobs.daylight_sun import PRINTED, Sun, atmosphere, check_sun, resolve_altitude, resolve_sun, resolve_where
from airlight.jobs.daylight_text import read_span
from airlight.jobs.image_work import ImageWork, Loaded
from airlight.jobs.light_text import LightText, place
from airlight.jobs.tasks import PictureTask
from airlight.messages import number, say
from airlight.options import Composite, Daylight, DaylightPicture, Look, declared

if TYPE_CHECKING:
    from airlight.daylight.camera import Camera
    from airlight.daylight.picture import Daylit
    from airlight.files import Picture
    from airlight.jobs.image import ImageRequest

HIDES_ALL, SHOWS_NOTHING = 0.01, 0.99  # transmittance of the nearest land, and of the farthest
AT_ODDS = 2.0  # times brighter or darker than the model's, that a photograph's own sky is worth a line
CLIPPED = 0.97  # linear: what is as bright says nothing of how bright it was


def check_request(request: "ImageRequest", day: Daylight, where: DaylightPicture) -> None:
    """Refuse what does not go with daylight, before any file is read. Raises AirlightError."""
    check_sun(day, where)
    if where.fov is None:
        raise AirlightError("--daylight needs the camera's angle of view: add --fov DEGREES, of the picture's smaller side, or --fov exif")
    if not request.has_depth and where.distance is None:
        raise AirlightError("--daylight needs to know how far things are: add --depth FILE, or --distance METRES for all that is not sky")
    if request.has_depth and where.distance is not None:
        raise AirlightError("--depth and --distance both say how far things are: give one of them")
    if where.depth_range is not None:
        read_span(where.depth_range)
    if not request.has_depth:
        for name in ("depth_range", "depth_unit", "depth_kind"):
            if name in request.values and request.values[name] != getattr(DaylightPicture(), name):
                raise AirlightError(f"--{name.replace('_', '-')} describes the depths: add --depth FILE, or leave it out")
    elif where.depth_range is not None and where.depth_unit != 1:
        raise AirlightError("--depth-range and --depth-unit both say what depths stand for: give one of them")
    unused = {one.name: one for group in (Look, Composite) for one in group.options()}
    for name, value in request.values.items():
        if name in unused and value != unused[name].default and value != "classic":
            raise AirlightError(f"{unused[name].flag} shapes shafts that are added, and daylight has its own measure: leave it out")
    for name in ("subject", "subject_layer", "cookie", "debug"):
        if getattr(request, name) is not None:
            raise AirlightError(f"--{name.replace('_', '-')} does not go with --daylight: leave it out")
    for name in ("depth_near", "near_range", "depth_hides"):
        if name in request.explicit:
            option = "depth-aware" if name == "depth_hides" else name.replace("_", "-")
            raise AirlightError(f"--{option} is for shafts that are added: with --daylight, --depth-kind and --depth-range say what depths are")
    for light in request.lights:
        if light.color != (1.0, 1.0, 1.0) or light.strength != 1 or light.kind is not None or light.cookie is not None:
            raise AirlightError(f"--light {light.text}: the sun's colour and strength come of the air: leave all but its place out")
        if light.angle is not None:
            raise AirlightError("--angle has no place in the picture: with --daylight give --light X,Y, or --sun AZ,EL with --heading")
    if len(request.lights) != 1:
        raise AirlightError("--daylight has one sun: give one --light")


@dataclass
class Scene:
    """Holds what a picture's daylight is computed of."""

    camera: "Camera"
    sun: Sun
    azimuth: float  # the sun's
    altitude: float
    light: tuple[float, float] | None  # where the sun is, parts of the picture's size; None behind the camera


@dataclass
class DaylightWork(ImageWork):
    """Reads, renders, writes each picture with its daylight."""

    day: Daylight = Daylight()
    where: DaylightPicture = DaylightPicture()

    def __post_init__(self) -> None:
        super().__post_init__()
        self._span = read_span(self.where.depth_range) if self.where.depth_range is not None else None
        self._air = None if self.day.daylight == PRINTED else atmosphere(self.day)

    def planes(self, task: PictureTask, picture: "Picture") -> tuple[Any, ...]:
        """Read the mask of the sky, and depths as they are stored."""
        from airlight.files.depths import read_depths

        reading = self.request.reading
        depths = read_depths(task.depth, reading.depth_layer, picture, reading.on_damage, reading.view) if self.request.has_depth else None
        return reading.mask(task.mask, picture), depths, None

    def _settled(self, task: PictureTask, loaded: Loaded, tell: Callable[[str], object]) -> Settled:
        """Find sun and camera of a picture, and render it."""
        picture = loaded.picture
        scene = self._scene(picture, tell)
        written, parameters = [], self.parameters
        if scene.light is not None:
            written = [LightText(f"{scene.light[0]!r},{scene.light[1]!r}")]
        parameters = self._knee(picture, written)
        done = self._placed(task, loaded, scene, parameters, tell)
        return Settled(written, parameters, scene, done, True)

    def _shone(self, task: PictureTask, loaded: Loaded, lights: list[Any], parameters: Any, held: Any) -> Any:
        """Render a frame by the sun and the camera of another."""
        return self._placed(task, loaded, held, parameters, lambda _: None)

    def _fraction(self, loaded: Loaded, lights: list[Any], parameters: Any) -> "np.ndarray":
        return self._dark(loaded.picture, self._distances(loaded, parameters, lengths=None).sky, place_of(lights), parameters, bool(loaded.far))
