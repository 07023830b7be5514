"""Refuses what does not go with daylight on a picture, or would do nothing there, in one line with its cure."""

from typing import TYPE_CHECKING

from airlight.errors import AirlightError
from airlight.jobs.daylight_sun import check_sun
from airlight.jobs.daylight_text import read_span
from airlight.options import Composite, Daylight, DaylightPicture, Look, Parameters
from airlight.scatter.methods import METHODS

if TYPE_CHECKING:
    from airlight.jobs.image import ImageRequest

OF_DEPTHS = ("depth_range", "depth_unit", "depth_kind")  # which describe a map
OF_SUM = ("decay", "weight", "exposure", "normalization")  # which D, a share, has not
OF_SAMPLES = ("samples", "jitter")  # which a converged D has not
OF_KNEE = ("threshold", "smoothness")


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
        for name in OF_DEPTHS:
            if name in request.values and request.values[name] != getattr(DaylightPicture(), name):
                raise AirlightError(f"--{name.replace('_', '-')} describes the depths: add --depth FILE, or leave it out")
    elif where.depth_range is not None and where.depth_unit != 1:
        raise AirlightError("--depth-range and --depth-unit both say what depths stand for: give one of them")
    _check_shafts(request)
    for name in ("subject", "subject_layer", "cookie", "debug"):
        if getattr(request, name) is not None:
            raise AirlightError(f"--{name.replace('_', '-')} does not go with --daylight: leave it out")
    if request.mask_invert and request.mask is None and request.mask_layer is None:
        raise AirlightError("--mask-invert inverts the image of --mask; give both")
    for name in ("depth_near", "near_range", "depth_hides"):
        if name in request.explicit:
            option = "depth-aware" if name == "depth_hides" else name.replace("_", "-")
            instead = "with --daylight, --depth-kind and --depth-range say what depths are"
            raise AirlightError(f"--{option} is for shafts that are added: {instead}")
    for light in request.lights:
        if light.color != (1.0, 1.0, 1.0) or light.strength != 1 or light.kind is not None or light.cookie is not None:
            raise AirlightError(f"--light {light.text}: the sun's colour and strength come of the air: leave all but its place out")
        if light.angle is not None:
            raise AirlightError("--angle has no place in the picture: with --daylight give --light X,Y, or --sun AZ,EL with --heading")
    if len(request.lights) != 1:
        raise AirlightError("--daylight has one sun: give one --light")


def _check_shafts(request: "ImageRequest") -> None:
    """Refuse options of shafts that are added, and those that D, the dark share of the way to a pixel, is not estimated by."""
    known = {one.name: one for group in (Look, Composite, Parameters) for one in group.options()}
    given = {name: known[name].flag for name, value in request.values.items() if name in known and value != known[name].default}
    added = {one.name for group in (Look, Composite) for one in group.options()} | set(OF_SUM)
    method = str(request.values.get("method", Parameters().method))
    by_brightness = request.values.get("occlusion") in ("luminance", "contrast")
    has_sky = request.has_depth or request.mask is not None or request.mask_layer is not None
    for name, flag in given.items():
        if name in added and request.values[name] != "classic":
            raise AirlightError(f"{flag} shapes shafts that are added, and daylight has its own measure: leave it out")
        if name in OF_SAMPLES and method in METHODS and METHODS[method].is_converged:
            raise AirlightError(f"{flag} does nothing with daylight by method {method}: leave it out, or add --method radial")
        if name in OF_KNEE and has_sky and not by_brightness:
            by = "--depth" if request.has_depth else "--mask"
            raise AirlightError(f"{flag} finds the sky by its brightness, and {by} says it: leave it out, or add --occlusion luminance")
