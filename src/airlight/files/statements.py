"""One statement about colour in each output: ICC profile, PNG chunks, Exif and attributes say the same, or are not there."""

from typing import Any

import numpy as np

from airlight.errors import warn
from airlight.files import dpx, png_chunks
from airlight.files.coded import DIFFUSE_WHITE
from airlight.files.images import Picture
from airlight.files.told import numbers

ICC_FORMATS = ("png", "jpeg", "tiff", "webp", "jpegxl", "avif")  # that keep an input's ICC profile
SRGB, UNCALIBRATED = 1, 65535  # of Exif's ColorSpace: the second is for what a profile tells
# Metadata about the input's colours or its HDR part, which are said anew, or lost.
PREFIXES = ("hdrgm:", "HDRGainMap:", "Item:", "Container:", "GContainer:", "photoshop:ICCProfile", "photoshop:ColorMode")
NAMES = {"CICP", "Exif:ColorSpace", "Exif:Gamma", "xmpNote:HasExtendedXMP", "acesImageContainerFlag"}
_BEYOND, _BEYOND_PART = 0.005, 1e-3  # linear light out of range in this part of a picture is told


def keeps_own(like: Picture | None, format: str) -> bool:
    """Tell whether integer outputs of a format hold the input's own codes: its RGB and its curve, where these are not simply sRGB's."""
    coding = like.coding if like is not None else None
    if like is None or like.codes.dtype.kind != "u" or (like.profile is None and coding is None):
        return False
    if coding is None:
        return format in ICC_FORMATS and like.icc is not None and like.codes.shape[2] >= 3  # a profile of RGB holds no grey
    if format == "png":
        return bool(coding.chunks) or coding.is_hdr or coding.icc is not None
    if format == "jpegxl" and coding.is_hdr:
        return coding.cicp is not None and not coding.narrow
    return format in ICC_FORMATS and coding.icc is not None


def keeps_rgb(like: Picture, format: str) -> bool:
    """Tell whether float outputs of a format hold the input's own linear RGB."""
    if format == "openexr":
        return True
    unsaid = format == "hdr" and numbers(like.spec) is not None  # OpenImageIO does not write an HDR's PRIMARIES
    return format == like.format and like.codes.dtype.kind == "f" and not unsaid


def warn_of_loss(name: str, like: Picture | None, pixels: np.ndarray) -> None:
    """Tell of colours, linear Rec. 709, that an output in sRGB cannot hold, where the input's codes did."""
    if like is None or like.codes.dtype.kind != "u" or like.profile is None or (like.icc is None and like.coding is None):
        return
    if like.coding is not None and like.coding.is_hdr and not name.lower().endswith(".hdr") and pixels.max(initial=0) > 1 + _BEYOND:
        most = f"{pixels.max() * DIFFUSE_WHITE:.0f} cd/m2 where white is {DIFFUSE_WHITE:.0f}"
        warn(f"{name}: HDR light brighter than white ({most}) is cut; .exr keeps it, and .png as it was", 4)
    elif (pixels.min(axis=2) < -_BEYOND).mean() > _BEYOND_PART:
        warn(f"{name}: colours that sRGB does not hold are made less vivid; .exr and .png keep them", 4)


def state_floats(spec: Any, like: Picture, format: str) -> None:
    """Give the spec of a float output made of an input its statement: an EXR's chromaticities, a TIFF's ICC profile."""
    if format == "openexr":
        name = like.spec.get_string_attribute("colorInteropID") if like.format == "openexr" else ""
        if name:
            spec.attribute("colorInteropID", name)
        if like.chromaticities is not None:
            spec.attribute("chromaticities", "float[8]", like.chromaticities)
        if like.coding is not None and like.coding.is_hdr:
            spec.attribute("whiteLuminance", DIFFUSE_WHITE)
    elif format == "tiff" and like.format == "tiff" and like.codes.dtype.kind == "f" and like.icc is not None:
        spec.attribute("ICCProfile", f"uint8[{len(like.icc)}]", np.frombuffer(like.icc, np.uint8))


def state(spec: Any, like: Picture | None, format: str, own: bool, icc: bytes | None) -> None:
    """Give the spec of an integer output its statement: the ICC profile where there is one, the picture's own coding, or sRGB.

    own: as `keeps_own` says. icc: the input's profile where the output's codes are in it.
    """
    integer = like is not None and like.codes.dtype.kind == "u"
    linear = integer and like is not None and like.encoding == "linear" and like.format not in ("raw", *dpx.FORMATS) and format == "png"
    if own and icc is None and like is not None and like.coding is not None and not (format == "png" and own_chunks(like)):
        icc = like.coding.icc
    if own and icc is None and format == "jpegxl" and like is not None and like.coding is not None and like.coding.cicp is not None:
        spec.attribute("CICP", "int[4]", (*like.coding.cicp, 0, 1))
    elif icc is not None:
        spec.attribute("ICCProfile", f"uint8[{len(icc)}]", np.frombuffer(icc, np.uint8))
    else:
        spec.attribute("oiio:ColorSpace", "lin_rec709_scene" if linear else "srgb_rec709_scene")
    told = like is not None and like.spec.getattribute("Exif:ColorSpace") is not None
    if format in ("jpeg", "tiff") or told:
        srgb = not own and not linear and (icc is None or (like is not None and like.encoding == "srgb"))
        spec.attribute("Exif:ColorSpace", "uint16", SRGB if srgb else UNCALIBRATED)


def own_chunks(like: Picture | None) -> tuple[tuple[bytes, bytes], ...]:
    """List the chunks that tell an input's own coding in a PNG, where no ICC profile does: as they were in one, else cICP for HDR."""
    if like is None or like.coding is None:
        return ()
    coding = like.coding
    if not coding.chunks and coding.is_hdr and coding.cicp is not None:
        return ((b"cICP", bytes((*coding.cicp, 0, 1))),)
    return coding.chunks


def finish(memory: str, spec: Any, like: Picture | None, format: str, own: bool) -> None:
    """Put into an encoded file what OpenImageIO cannot write, and take out what it says beside an ICC profile."""
    if format == "png" and own and (chunks := own_chunks(like)):
        png_chunks.restate(memory, chunks)
    elif format == "png" and spec.getattribute("ICCProfile") is not None:
        png_chunks.restate(memory, (), b"iCCP")
