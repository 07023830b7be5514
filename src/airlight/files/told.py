"""Statements of a file about its colours: an ICC profile, code points, chromaticities, names; one of them counts."""

import contextlib
import re
from dataclasses import dataclass
from typing import Any

import numpy as np

from airlight.colour import Profile as Transform
from airlight.errors import AirlightError, warn
from airlight.files import jpeg_segments, png_chunks, spaces
from airlight.files.coded import PRIMARIES, Coding, Curve, by_cicp
from airlight.files.colour import Profile
from airlight.files.icc import is_grey_srgb

_XYZ = spaces.to_rec709(PRIMARIES[10]), PRIMARIES[10]
_HDR_PRIMARIES = re.compile(rb"^PRIMARIES\s*=((?:[ \t]*[-+.0-9eE]+){8})", re.MULTILINE)


@dataclass
class Told:
    """Colours of a picture: see `images.Picture`. linear: the codes are, in the picture's RGB."""

    icc: bytes | None = None
    profile: Transform | None = None
    coding: Coding | None = None
    to_709: np.ndarray | None = None
    chromaticities: tuple[float, ...] | None = None
    linear: bool = False
    gain_map: bool = False


def read(spec: Any, format: str, path: str, codes: np.ndarray, head: bytes, colorspace: str | None) -> Told:
    """Read the statements about codes (H, W, C). head: the file's first bytes. colorspace: of floats, instead: see `spaces.by_name`.

    Of several that contradict each other a PNG's cICP counts before its ICC profile, that before sRGB, gAMA and cHRM; an EXR's
    chromaticities before its colorInteropID. Raises AirlightError for a wrong colorspace.
    """
    if codes.dtype.kind == "f":
        return _of_floats(spec, format, path, head, colorspace)
    if colorspace is not None:
        raise AirlightError(f"{path}: holds integers, whose colours the file itself tells; --colorspace is for EXR, HDR, float TIFF")
    coding, gain_map = _coding(spec, format, path, codes, head)
    if coding is None:
        icc, profile = _profile(spec, path)
        linear = format != "png" and icc is None and spec.get_string_attribute("oiio:ColorSpace").startswith("lin")
        return Told(icc, profile, linear=linear, gain_map=gain_map)
    linear = (coding.curve, coding.narrow) == ("linear", 0) and coding.to_709 is None
    told = Told(None, None if linear else coding.profile, coding, coding.to_709, linear=linear, gain_map=gain_map)
    told.chromaticities = coding.chromaticities if coding.to_709 is not None else None
    return told


def _coding(spec: Any, format: str, path: str, codes: np.ndarray, head: bytes) -> tuple[Coding | None, bool]:
    """Find the coding of a picture of integers whose file tells it by numbers, else None; and whether the file has a gain map."""
    coding, gain_map = None, bool(spec.get_int_attribute("airlight:gain_map")) or b"tmap" in head[8:64]  # a brand of AVIF and HEIC
    if format == "png":
        coding = png_chunks.coding(path, codes.dtype.itemsize * 8)
    elif format == "jpeg":
        coding, gain_map = jpeg_segments.read(path)
        coding = coding if spec.getattribute("ICCProfile") is None else None
    elif (cicp := _cicp(spec)) is not None:
        grey = codes.shape[2] < 3 and cicp[0] == 0  # JPEG XL's code points of grey
        coding = by_cicp(2 if grey else cicp[0], cicp[1])
        if coding is None and spec.getattribute("ICCProfile") is None:
            warn(f"{path}: has an unusual transfer curve or primaries, taken as sRGB's; export it as PNG or TIFF for true colours", 6)
    if coding is not None and codes.shape[2] < 3:
        coding = coding.of_grey()
    return (None if coding is not None and coding.is_srgb else coding), gain_map


def _cicp(spec: Any) -> tuple[int, int] | None:
    """Read the code points of primaries and transfer."""
    value = spec.getattribute("CICP")
    return (int(value[0]), int(value[1])) if isinstance(value, tuple) and len(value) == 4 else None


def _profile(spec: Any, path: str) -> tuple[bytes | None, Profile | None]:
    """Read the embedded ICC profile, and its transform where it is not simply sRGB."""
    value = spec.getattribute("ICCProfile")
    if value is None:
        return None, None
    icc = bytes(bytearray(value))
    if icc[16:20] in (b"CMYK", b"Lab "):  # OpenImageIO has made RGB of the pixels already
        return None, None
    if is_grey_srgb(icc):
        return icc, None
    try:
        profile = Profile(icc)
        return icc, None if profile.is_srgb() else profile
    except ValueError as error:
        warn(f"{path}: its colour profile is not understood ({_short(error)}); taken as sRGB", 6)
        return icc, None


def _short(error: Exception) -> str:
    return " ".join(str(error).split())[:100].rstrip(".")


def numbers(spec: Any) -> tuple[float, ...] | None:
    """Read an EXR's chromaticities, not yet checked."""
    value = spec.getattribute("chromaticities")
    return value if isinstance(value, tuple) and len(value) == 8 else None


def _of_floats(spec: Any, format: str, path: str, head: bytes, colorspace: str | None) -> Told:
    if colorspace is not None:
        spec.erase_attribute("colorInteropID")
        to_709, chromaticities = spaces.by_name(colorspace)
        return Told(to_709=to_709, chromaticities=chromaticities, linear=True)
    if format not in ("openexr", "hdr"):
        return _of_coded_floats(spec, path)
    if format == "hdr" and (found := _HDR_PRIMARIES.search(head)):
        with contextlib.suppress(ValueError):
            spec.attribute("chromaticities", "float[8]", tuple(float(number) for number in found[1].split()))
    told, value, name = Told(linear=True), numbers(spec), spec.get_string_attribute("colorInteropID")
    if value is not None:
        try:
            told.to_709, told.chromaticities = spaces.to_rec709(value), value
        except ValueError as error:
            warn(f"{path}: has {error}; taken as Rec. 709 (--colorspace names another)", 6)
            return told
    elif not name and spec.get_int_attribute("acesImageContainerFlag"):
        name = "lin_ap0_scene"
    if name in ("", "unknown", "data"):
        return told
    try:
        to_709, chromaticities = _XYZ if name == "lin_ciexyzd65_scene" else spaces.by_name(name, own_config=False)
    except AirlightError as error:
        warn(f"{path}: {str(error).partition(';')[0]}; taken as linear (--colorspace names another)", 6)
        return told
    if value is None:
        told.to_709, told.chromaticities = to_709, chromaticities
    elif not spaces.is_same(to_709, told.to_709):
        spec.erase_attribute("colorInteropID")  # the chromaticities count
    return told


def _of_coded_floats(spec: Any, path: str) -> Told:
    """Read the ICC profile or the code points of floats, which may have a curve: that of `profile`, or none where they are linear."""
    value, cicp = spec.getattribute("ICCProfile"), _cicp(spec)
    coding = by_cicp(*cicp) if cicp is not None else None
    if coding is not None:
        chromaticities = coding.chromaticities if coding.to_709 is not None else None
        return Told(None, None if coding.curve == "linear" else Curve(coding), coding, coding.to_709, chromaticities, True)
    if value is None:
        return Told(linear=True)
    told = Told(icc=bytes(bytearray(value)), linear=True)
    try:
        profile = Profile(told.icc or b"")
        told.to_709, is_linear = profile.matrix()
        if is_linear:
            told.chromaticities = None if told.to_709 is None else spaces.chromaticities_of(told.to_709)
        else:
            told.profile, told.to_709 = profile, None
    except ValueError as error:
        warn(f"{path}: its colour profile is not understood ({_short(error)}); taken as linear Rec. 709", 6)
    return told
