"""Pictures to files: encoded in memory, verified, and only then put in place."""

import contextlib
import os
import shutil
from typing import Any

import numpy as np

from airlight.errors import AirlightError, MachineError
from airlight.files.atomic import check_output, output_format, replacing, scratch
from airlight.files.colour import alpha_of, encode_codes, is_neutral
from airlight.files.decode import MARK, SETTINGS, SOFTWARE, problem, tell
from airlight.files.images import Picture

HALF_MOST = 65504.0
# Metadata that describes the old file's storage, or the run that made it, not the picture.
_PREFIXES = ("oiio:", "openexr:", "tiff:", "png:", "jpeg:", "gif:", "hdr:", "bmp:", "thumbnail_", "ICCProfile", "airlight:")
_NAMES = {
    *("planarconfig", "compression", "CompressionQuality", "dwaCompressionLevel", "chromaticities", "colorInteropID"),
    *("chunkCount", "name", "version", "type"),
}
# Bytes of metadata in a JPEG: libjpeg ends the process where a block passes 64 KiB.
MOST_TEXT, MOST_SETTINGS = 30_000, 20_000
_LOSSLESS_EXR = ("none", "rle", "zip", "zips", "piz", "htj2k32", "htj2k256")


def write_image(
    path: str | os.PathLike[str],
    pixels: np.ndarray | None,
    like: Picture | None = None,
    *,
    changed: np.ndarray | None = None,
    alpha: np.ndarray | None = None,
    layer: np.ndarray | None = None,
    z: np.ndarray | None = None,
    overwrite: bool = False,
    bits: int | None = None,
    encoded: np.ndarray | None = None,
    settings: str | None = None,
) -> None:
    """Write (H, W, 3) linear pixels as PNG, JPEG, TIFF, WebP, EXR or HDR, by the extension; whole or not at all.

    pixels: in the RGB of `like`, Rec. 709 without it; that is kept in EXR and in the input's own float format, else made Rec. 709.
    like: the input; its encoding, depth, alpha, metadata and further EXR channels are kept where the format can.
    changed: (H, W) bool; where False the input's codes are written as they were (same depth and encoding only).
    alpha: (H, W) 0..1 instead of the input's. layer: (H, W, 3), in EXR written as airlight.R/G/B. z: (H, W) depths, likewise as Z, float.
    bits: 8, 16 or 32, default the input's. encoded: (H, W, 3) integer codes that the caller has encoded (then `pixels` may be None).
    settings: a text about the run, kept in the metadata of EXR, PNG, TIFF and JPEG.
    Raises AirlightError before writing, MachineError when the disk is full; warns of what the format cannot hold.
    """
    name = os.fsdecode(path)
    check_output(name, [like.path] if like is not None else [], overwrite)
    format, possible = output_format(name)
    if bits is not None and bits not in possible:
        raise AirlightError(f"{name}: {bits} bits are not possible in this format; use {' or '.join(map(str, possible))}")
    wanted = bits or (like.bits if like is not None else 8)
    depth = wanted if wanted in possible else max((b for b in possible if b <= wanted), default=possible[0])
    if format == "openexr" and bits is None and (like is None or like.format != "openexr"):
        depth = 16
    given = pixels if pixels is not None else encoded
    if given is None or given.ndim != 3 or given.shape[2] != 3 or (like is not None and given.shape[:2] != like.codes.shape[:2]):
        raise AirlightError(f"{name}: the pixels must be (height, width, 3) and as large as the input")
    real = format in ("openexr", "hdr") or (format == "tiff" and depth == 32)
    if like is not None and like.to_709 is not None and pixels is not None and format != "openexr" and not (real and format == like.format):
        pixels, changed = like.rec709(pixels), None  # the input's codes are none of this output's

    if real:
        colour, keeps_icc = _real_colour(pixels, like, format, depth, changed, name), False
    else:
        colour, keeps_icc = _integer_colour(pixels, like, depth, changed, encoded, format)
    grey = like is not None and like.colour_codes.shape[2] == 1 and format not in ("webp", "hdr")  # those hold colour only
    if grey and is_neutral(colour if pixels is None or real else pixels):
        colour = colour[..., :1]
    channels = [colour]
    transparency = _alpha(like, alpha, colour.dtype, real)
    if transparency is not None:
        if format in ("jpeg", "hdr"):
            if (transparency < (1 if real else np.iinfo(colour.dtype).max)).any():
                tell(f"{name}: this format has no transparency, which is dropped; use .png or .exr to keep it")
            transparency = None
        else:
            channels.append(transparency[..., None])
    if (layer is not None or z is not None) and format != "openexr":
        raise AirlightError(f"{name}: only .exr holds the layer beside the picture; write it to a file of its own")
    if layer is not None:
        channels.append(np.clip(np.nan_to_num(layer), -HALF_MOST, HALF_MOST))
    if z is not None:
        channels.append(z[..., None])
    if like is not None and like.extra is not None:
        if format == "openexr":
            channels.append(like.extra)
        else:
            tell(f"{name}: this format cannot keep {', '.join(like.extra_names[:5])}; use .exr to keep all layers")
    codes = np.ascontiguousarray(np.concatenate(channels, axis=2) if len(channels) > 1 else colour)
    further = (["half"] * 3 if layer is not None else []) + (["float"] if z is not None else [])
    spec = _spec(codes, colour.shape[2], transparency is not None, further, like, format, depth, keeps_icc)
    if settings is not None:
        _note(spec, format, settings, name)
    with scratch(name, codes.nbytes + (1 << 20)) as memory:
        _encode(memory, format, spec, codes, name)
        _verify(memory, codes, format, name)
        with open(memory, "rb") as source, replacing(name, overwrite) as file:
            shutil.copyfileobj(source, file, 1 << 20)


def _real_colour(
    pixels: np.ndarray | None, like: Picture | None, format: str, depth: int, changed: np.ndarray | None, name: str
) -> np.ndarray:
    if pixels is None:
        raise AirlightError(f"{name}: a float format needs linear pixels, not codes")
    most = HALF_MOST if depth == 16 else float(np.finfo(np.float32).max)
    colour = np.nan_to_num(np.array(pixels, np.float32), nan=0.0, posinf=most, neginf=-most)
    if like is not None and like.alpha is not None and format == "openexr" and not like.associated:
        colour *= like.alpha[..., None]
    elif like is not None and like.codes.dtype.kind == "f" and changed is not None:
        np.copyto(colour, like.colour_codes, where=~changed[..., None])
    return np.clip(colour, -most, most, out=colour) if depth == 16 else colour


def _integer_colour(
    pixels: np.ndarray | None, like: Picture | None, depth: int, changed: np.ndarray | None, encoded: np.ndarray | None, format: str
) -> tuple[np.ndarray, bool]:
    """Codes (H, W, 3), and whether they are in the input's ICC profile."""
    dtype = np.dtype(f"uint{depth}")
    integer = like is not None and like.codes.dtype.kind == "u"
    profile = like.profile if integer and like is not None and format != "webp" else None
    flat = integer and like is not None and like.encoding == "linear" and like.format != "raw" and format == "png"
    encoding = "icc" if profile is not None else "linear" if flat else "srgb"
    keeps_icc = integer and like is not None and like.icc is not None and (encoding == "icc" or like.encoding == "srgb")
    same = like is not None and like.codes.dtype == dtype and like.encoding == encoding
    if encoded is not None and encoded.dtype == dtype:
        colour = encoded.copy()
    elif pixels is None:
        raise AirlightError("codes of another depth than the output's need linear pixels as well")
    elif same and changed is not None and not changed.any():
        colour = np.empty(pixels.shape, dtype)
    else:
        if like is not None and like.associated and like.alpha is not None:
            safe = np.where(like.alpha > 0, like.alpha, 1)[..., None]
            pixels = (pixels / safe).astype(np.float32)
        colour = encode_codes(pixels, dtype, profile, flat)
    if same and like is not None and changed is not None:
        np.copyto(colour, like.colour_codes, where=~changed[..., None])
    return colour, keeps_icc


def _alpha(like: Picture | None, alpha: np.ndarray | None, dtype: Any, real: bool) -> np.ndarray | None:
    if alpha is None:
        if like is None or like.alpha is None:
            return None
        if like.codes.dtype == dtype:
            return np.clip(like.codes[..., -1], -HALF_MOST, HALF_MOST) if real else like.codes[..., -1]
        alpha = like.alpha
    alpha = alpha_of(np.nan_to_num(np.asarray(alpha, np.float32)))
    return alpha if real else np.rint(alpha * np.iinfo(dtype).max).astype(dtype)


def _spec(
    codes: np.ndarray, colours: int, alpha: bool, further: list[str], like: Picture | None, format: str, depth: int, keeps_icc: bool
) -> Any:
    """further: the types of what follows colour and alpha in an EXR: the layer's halves, a float of depth."""
    import OpenImageIO as oiio

    height, width, channels = codes.shape
    kind = {8: "uint8", 16: "half" if format == "openexr" else "uint16", 32: "float"}[depth]
    spec = oiio.ImageSpec(width, height, channels, kind)
    names = (["R", "G", "B"] if colours == 3 else ["Y"]) + (["A"] if alpha else [])
    if format == "openexr" and like is not None and like.layer:
        names = list(like.channels) if len(names) == len(like.channels) else [f"{like.layer}.{name}" for name in names]
    if like is not None:
        _hand_on(spec, like, format)
    if format == "openexr":
        kinds = [kind] * len(names)
        if like is not None and len(like.formats) == len(names) and depth == like.bits:
            kinds = list(like.formats)
        kinds += further
        names += (["airlight.R", "airlight.G", "airlight.B"] if "half" in further else []) + (["Z"] if "float" in further else [])
        compression = ""
        if like is not None and like.format == "openexr":
            names += like.extra_names
            kinds += like.extra_formats
            compression = like.spec.get_string_attribute("compression")
            spec.x, spec.y = like.data_window[:2]
            spec.full_x, spec.full_y, spec.full_width, spec.full_height = like.display_window
            if like.spec.get_string_attribute("colorInteropID"):
                spec.attribute("colorInteropID", like.spec.get_string_attribute("colorInteropID"))
        spec.channelformats = tuple(oiio.TypeDesc(k) for k in kinds)
        spec.attribute("compression", compression if compression in _LOSSLESS_EXR else "zips")
        if like is not None and like.chromaticities is not None:
            spec.attribute("chromaticities", "float[8]", like.chromaticities)
    spec.channelnames = tuple(names)
    if alpha:
        spec.alpha_channel = colours
        if format != "openexr" and not (depth == 32 and like is not None and like.associated):
            spec.attribute("oiio:UnassociatedAlpha", 1)
    if like is not None and keeps_icc and like.icc is not None and (like.icc[16:20] == b"GRAY") == (colours == 1):
        spec.attribute("ICCProfile", f"uint8[{len(like.icc)}]", np.frombuffer(like.icc, np.uint8))
    elif depth < 32 and format != "openexr":
        linear = like is not None and like.encoding == "linear" and like.format != "raw" and like.codes.dtype.kind == "u"
        spec.attribute("oiio:ColorSpace", "lin_rec709_scene" if linear and format == "png" else "srgb_rec709_scene")
    # Without it the time of writing would be put in: the same command gives the same bytes.
    if spec.getattribute("DateTime") is None:
        spec.attribute("DateTime", "")
    spec.attribute("Orientation", 1)
    if format == "jpeg":
        spec.attribute("compression", "jpeg:95")
        spec.attribute("jpeg:subsampling", "4:4:4")
    elif format == "png":
        spec.attribute("png:compressionLevel", 4)
    elif format == "webp":
        spec.attribute("compression", "lossless:10" if like is None or like.lossless else "webp:95")
    elif format == "tiff":
        spec.attribute("compression", "zip")
    return spec


def _hand_on(spec: Any, like: Picture, format: str) -> None:
    """Give the spec the input's metadata."""
    room, lost = MOST_TEXT, []
    for item in like.spec.extra_attribs:
        with contextlib.suppress(UnicodeError, TypeError, RuntimeError):  # text that is not UTF-8 cannot be handed on
            settings = item.name == SOFTWARE and str(item.value).startswith(MARK)
            if item.name.startswith(_PREFIXES) or item.name in _NAMES or settings:
                continue
            size = len(item.value.encode()) if isinstance(item.value, str) else item.type.size()
            if format == "jpeg" and size > room:
                lost.append(item.name)
                continue
            room -= size
            spec.attribute(item.name, item.type, item.value)
    if lost:
        tell(f"{like.path}: has more metadata than a JPEG can hold; left out: {', '.join(lost[:5])}", 5)


def _note(spec: Any, format: str, settings: str, name: str) -> None:
    """Put the settings of the run into the spec."""
    if format == "jpeg" and len(settings) > MOST_SETTINGS:
        tell(f"{name}: the settings are too long for a JPEG and are left out", 4)
    elif format in ("openexr", "png"):
        spec.attribute(SETTINGS, settings)
    else:
        spec.attribute(SOFTWARE, MARK + settings)


def _encode(memory: str, format: str, spec: Any, codes: np.ndarray, name: str) -> None:
    import OpenImageIO as oiio

    out = oiio.ImageOutput.create(format)
    if out is None:
        raise MachineError(f"{name}: this OpenImageIO cannot write {format} ({problem(oiio)}); use another format")
    fine = out.open(memory, spec)
    text = problem(out)
    if fine:
        fine = out.write_image(codes)
        text += problem(out)
        fine = out.close() and fine
        late = problem(out)
        # OpenImageIO 3.2 says so of every TIFF without Exif data, and the file is right.
        text += "" if late.startswith("failed TIFFWriteCustomDirectory() of the Exif data") else late
    if not fine or text:
        raise MachineError(f"{name}: could not be encoded ({' '.join(text.replace(memory, 'it').split())[:200] or 'no reason given'})")


def _verify(memory: str, codes: np.ndarray, format: str, name: str) -> None:
    """Decode what was encoded; codes must come back as they were where the format is exact."""
    import OpenImageIO as oiio

    hints = oiio.ImageSpec()
    hints.attribute("oiio:UnassociatedAlpha", 1)
    inp = oiio.ImageInput.open(memory, hints)
    back, text = None, problem(oiio)
    if inp is not None:
        kind = codes.dtype.name if codes.dtype.kind == "u" else "half" if format == "openexr" else "float"
        back = inp.read_image(0, 0, 0, codes.shape[2], kind)
        text += problem(inp)
        inp.close()
        text += problem(inp)
    exact = format in ("png", "tiff")
    if text or back is None or back.shape[:2] != codes.shape[:2] or (exact and not np.array_equal(np.reshape(back, codes.shape), codes)):
        raise MachineError(f"{name}: did not read back as it was written; nothing was saved, try again or another format")
