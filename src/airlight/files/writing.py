"""Write pictures to files: encoded in memory, verified, and only then put in place."""

import contextlib
import functools
import os
import shutil
from typing import Any

import numpy as np

from airlight.alpha import is_transparent, straighten
from airlight.colour import alpha_of, decode_codes, encode_codes, is_neutral
from airlight.errors import AirlightError, warn
from airlight.files import by_pillow, dpx, views
from airlight.files.atomic import check_output, output_format, replacing, scratch
from airlight.files.channels import legible
from airlight.files.decode import MARK, SETTINGS, SOFTWARE, decode
from airlight.files.encoding import encode_file, verify
from airlight.files.images import Picture, upright
from airlight.files.statements import NAMES, PREFIXES, finish, keeps_own, keeps_rgb, state, state_floats, warn_of_loss
from airlight.files.storage import describe
from airlight.options.storage import Storage
from airlight.planes import by_rows
from airlight.process import standard

HALF_MOST, FLOAT_MOST = 65504.0, float(np.finfo(np.float32).max)
# Metadata that describes the old file's storage, or the run that made it, not the picture.
_PREFIXES = ("oiio:", "openexr:", "tiff:", "png:", "jpeg:", "gif:", "hdr:", "bmp:", "thumbnail_", "ICCProfile", "airlight:", *PREFIXES)
_OF_CHANNELS = ("cryptomatte/", "multiView")  # which only an EXR has
_NAMES = {
    *("planarconfig", "compression", "CompressionQuality", "dwaCompressionLevel", "chromaticities", "colorInteropID"),
    *("chunkCount", "name", "version", "type"),
    *NAMES,
}
# Bytes of metadata in a JPEG: libjpeg ends the process where a block passes 64 KiB.
MOST_TEXT, MOST_SETTINGS = 30_000, 20_000
MOST_SIDE = {"webp": 16383, "avif": 32768, "jpeg": 65500}  # pixels, of those that their libraries write, and read again
COLOUR_ONLY = ("webp", "hdr", "avif", "jpegxl")


def write_image(
    path: str | os.PathLike[str],
    pixels: np.ndarray | None,
    like: Picture | None = None,
    *,
    changed: np.ndarray | None = None,
    alpha: np.ndarray | None = None,
    layer: np.ndarray | None = None,
    transmittance: np.ndarray | None = None,
    z: np.ndarray | None = None,
    overwrite: bool = False,
    bits: int | None = None,
    encoded: np.ndarray | None = None,
    settings: str | None = None,
    storage: Storage | None = None,
) -> None:
    """Write (H, W, 3) linear pixels as one of OUTPUTS, by the extension; whole or not at all.

    pixels: premultiplied, in the RGB of `like`, Rec. 709 without it; that is kept in EXR and in the input's own float format, else made
    Rec. 709. A format without alpha gets them as they are, over black; where its colours are straight its alpha is raised to hold them.
    like: the input; its encoding, depth, alpha, metadata and further EXR channels are kept where the format can.
    changed: (H, W) bool; where False the input's codes are written as they were (same depth and encoding only).
    alpha: (H, W) 0..1 instead of the input's. layer, transmittance: (H, W, 3), in EXR written as airlight.R/G/B and
    transmittance.R/G/B, halves unless bits is 32. z: (H, W) depths, likewise as Z, float.
    bits: 8, 16 or 32, default the input's. encoded: (H, W, 3) integer codes, sRGB, that the caller has encoded (then `pixels` may be None).
    settings: a text about the run, kept in the metadata of all but HDR, WebP and DPX. storage: how the file is packed.
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
    storage = storage or Storage()
    storage.check([name])
    if format == "dpx" and bits is None:
        depth = 8 if dpx.output_bits(like) == 8 else 16
    shown = pixels if pixels is not None else encoded
    if shown is None or shown.ndim != 3 or shown.shape[2] != 3 or (like is not None and shown.shape[:2] != like.codes.shape[:2]):
        raise AirlightError(f"{name}: the pixels must be (height, width, 3) and as large as the input")
    if max(shown.shape[:2]) > (most := MOST_SIDE.get(format, 1 << 20)):
        raise AirlightError(f"{name}: {shown.shape[1]}x{shown.shape[0]} pixels are more than it holds ({most} on a side); use .png or .exr")
    if format == "avif":
        by_pillow.need_avif(name)
    real = format in ("openexr", "hdr") or (format == "tiff" and depth == 32)
    own = not real and keeps_own(like, format)
    if pixels is None and encoded is not None and encoded.dtype != np.dtype(np.float32 if real else f"uint{depth}"):
        pixels = decode_codes(encoded)  # they are none of the output's
    if like is not None and like.to_709 is not None and pixels is not None and not own and not (real and keeps_rgb(like, format)):
        pixels, changed = like.rec709(pixels), None  # the input's codes are none of this output's
    if pixels is not None and not own and (not real or format == "hdr"):
        warn_of_loss(name, like, pixels)
        if real:  # what is negative would come back as something else
            pixels = np.maximum(pixels, 0)
    channels: list[Any] = []  # arrays (H, W, n), or what gives some rows of one
    kind: Any = np.dtype(np.float32 if real else f"uint{depth}")
    transparency = _alpha(like, alpha, kind, real)
    if transparency is not None and (format in ("jpeg", "hdr") or (format == "dpx" and (like is None or like.format != "dpx"))):
        if is_transparent(transparency):
            warn(f"{name}: this format has no transparency: the picture is put on black; use .png or .exr to keep it")
        transparency = None
    premultiplied = transparency is None or format == "openexr" or (real and like is not None and like.associated)
    if like is not None and like.alpha is not None and changed is not None and like.associated != premultiplied:
        changed = changed | (like.alpha < 1)  # there the input's codes are none of this output's
    straight = encoded is not None and encoded.dtype == kind
    if pixels is not None and transparency is not None and not (premultiplied or straight) and is_transparent(transparency):
        holds = like is not None and (like.codes.dtype == kind or like.codes.dtype.kind == "u")  # its own light, where nothing changes
        kept = ~changed if holds and changed is not None else None
        peak = np.float32(like.coding.peak if own and like is not None and like.coding is not None else 1)  # what codes hold of light
        pixels, transparency = straighten(pixels / peak, transparency, kept)
        pixels *= peak
    if real and like is not None and like.codes.dtype.kind == "f" and like.profile is not None and format == like.format == "tiff":
        pixels, changed = np.array(pixels, np.float32, order="C"), None
        like.profile.encode(pixels)
    keeps_icc = False
    if not real:
        colour, keeps_icc = _integer_colour(pixels, like, depth, changed, encoded, format, own)
    grey = like is not None and like.colour_codes.shape[2] == 1 and format not in COLOUR_ONLY
    if format == "dpx" and like is not None and (transparency is not None or like.format != "dpx"):
        grey = False  # with alpha it has none, and programs read grey of 10 bits in several ways
    if format == "openexr" and like is not None and "Y" in like.extra_names:  # that of X Y Z, which are no colours
        grey = False
    colours = 1 if grey and is_neutral(shown) else 3
    if real and pixels is not None:
        most = _most(like, format, depth, colours)
        channels.append(functools.partial(_real_colour, pixels, like, most, changed, colours))
    else:
        channels.append(colour[..., :colours])
    if format in ("webp", "avif") and not is_transparent(transparency):  # it would be left out, and not read back
        transparency = None
    if transparency is not None:
        channels.append(transparency[..., None])
    further: list[tuple[str, str]] = []  # names and types of channels
    if any(values is not None for values in (layer, transmittance, z)) and format != "openexr":
        raise AirlightError(f"{name}: only .exr holds the layer beside the picture; write it to a file of its own")
    fine = "float" if bits == 32 else "half"
    ours = "airlight" if like is None else views.group_of(like.spec, like.layer, "airlight")
    for group, values in ((ours, layer), ("transmittance", transmittance)):
        if values is not None:
            channels.append(functools.partial(_rows, values, FLOAT_MOST if bits == 32 else HALF_MOST))
            further += [(f"{group}.{name}", fine) for name in "RGB"]
    if z is not None:
        channels.append(z[..., None])
        further.append(("Z", "float"))
    if like is not None and like.extra is not None:
        if format == "openexr":
            channels.append(like.extra)
        elif lost := [one for one in like.extra_names if one not in like.channels]:  # of which the picture is made, where it has no name
            lost = views.told(like.spec, like.layer, lost)
            warn(f"{name}: this format cannot keep {', '.join(lost[:5])}; use .exr to keep all layers", common=True)
    spec = _spec(shown.shape[:2], colours, transparency is not None, further, like, format, depth, keeps_icc)
    describe(spec, like, format, storage)
    codes = _joined(channels, spec) if real else np.ascontiguousarray(np.concatenate(channels, axis=2))
    if format == "dpx":
        dpx.describe(spec, like, bits)
        codes = dpx.rounded(codes, spec.get_int_attribute("oiio:BitsPerSample"))
    if settings is not None:
        _note(spec, format, settings, name)
    with scratch(name, codes.nbytes + (1 << 20)) as memory:
        if storage.repacks or not _copied(memory, like, codes, format):
            if like is not None and like.gain_map:
                warn(f"{name}: is an SDR picture: the gain map of the input, its HDR part, is lost")
            encode_file(memory, format, spec, codes, name)
            finish(memory, spec, like, format, own)
            verify(memory, codes, spec, format, name)
        with open(memory, "rb") as source, replacing(name, overwrite) as file:
            shutil.copyfileobj(source, file, 1 << 20)


def _most(like: Picture | None, format: str, depth: int, colours: int) -> Any:
    """Bound a colour; of an EXR whose channels are half and float, each channel."""
    if format == "openexr" and like is not None and depth == like.bits and len(set(like.formats)) > 1 and len(like.formats) >= colours:
        return np.array([HALF_MOST if kind == "half" else FLOAT_MOST for kind in like.formats[:colours]], np.float32)
    return HALF_MOST if depth == 16 else FLOAT_MOST


def _finite(values: np.ndarray, most: Any) -> np.ndarray:
    """Copy as float32 within +-most, NaN as 0."""
    value = np.array(values, np.float32)
    if not np.isfinite(value).all():
        np.nan_to_num(value, copy=False, nan=0.0, posinf=most, neginf=-most)
    return np.clip(value, -most, most, out=value)


def _rows(values: np.ndarray, most: float, first: int, last: int) -> np.ndarray:
    return _finite(values[first:last], most)


def _real_colour(
    pixels: np.ndarray, like: Picture | None, most: Any, changed: np.ndarray | None, colours: int, first: int, last: int
) -> np.ndarray:
    """Convert rows from first to before last to colours as they are stored, (h, W, 1 or 3) float32 within +-most."""
    colour = _finite(pixels[first:last], most)
    if like is not None and like.codes.dtype.kind == "f" and changed is not None and not changed[first:last].all():
        np.copyto(colour, like.colour_codes[first:last], where=~changed[first:last, :, None])
        np.clip(colour, -most, most, out=colour)
    return colour[..., :colours]


def _joined(channels: list[Any], spec: Any) -> np.ndarray:
    """Join channels, (H, W, C), rounded to what the spec says of each: float16 where all are half, else float32."""
    kinds = [str(kind) for kind in spec.channelformats] or [str(spec.format)] * spec.nchannels
    half = [kind == "half" for kind in kinds]
    codes = np.empty((spec.height, spec.width, spec.nchannels), np.float16 if all(half) else np.float32)

    def rows(first: int, last: int) -> None:
        at = 0
        for channel in channels:
            block = channel(first, last) if callable(channel) else channel[first:last]
            for i in range(block.shape[2]):  # one by one: NumPy is twice as fast at it
                rounds = half[at] and codes.dtype == np.float32
                codes[first:last, :, at] = block[..., i].astype(np.float16) if rounds else block[..., i]
                at += 1

    by_rows(rows, spec.height)
    return codes


def _integer_colour(
    pixels: np.ndarray | None,
    like: Picture | None,
    depth: int,
    changed: np.ndarray | None,
    encoded: np.ndarray | None,
    format: str,
    own: bool,
) -> tuple[np.ndarray, bool]:
    """Encode codes (H, W, 3), and tell whether they are in the input's ICC profile."""
    dtype = np.dtype(f"uint{depth}")
    integer = like is not None and like.codes.dtype.kind == "u"
    is_film = like is not None and like.format in dpx.FORMATS
    profile: Any = like.profile if own and like is not None else None
    flat = integer and like is not None and like.encoding == "linear" and like.format != "raw" and format == "png" and not is_film
    if format == "dpx":
        profile, flat = dpx.output_curve(like)
    encoding = "profile" if profile is not None else "linear" if flat else "srgb"
    keeps_icc = integer and like is not None and like.icc is not None and (encoding == "profile" or like.encoding == "srgb")
    keeps_icc = keeps_icc and format != "dpx"
    same = like is not None and like.codes.dtype == dtype and like.encoding == encoding and is_film == (format == "dpx")
    if encoded is not None and encoded.dtype == dtype:
        colour = encoded.copy()
    elif pixels is None:
        raise AssertionError("codes of another depth are decoded before")
    elif same and changed is not None and not changed.any():
        colour = np.empty(pixels.shape, dtype)
    else:
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
    size: tuple[int, ...],
    colours: int,
    alpha: bool,
    further: list[tuple[str, str]],
    like: Picture | None,
    format: str,
    depth: int,
    keeps_icc: bool,
) -> Any:
    """Make the header of a picture of size (H, W), its metadata included. further: names and types of the
    channels that follow colour and alpha in an EXR."""
    import OpenImageIO as oiio

    height, width = size
    extra = len(like.extra_names) if like is not None and format == "openexr" else 0
    channels = colours + alpha + len(further) + extra
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
        names += [name for name, _ in further]
        kinds += [kind for _, kind in further]
        if like is not None and like.format == "openexr":
            names += [f"input.{one}" if one in names else one for one in like.extra_names]  # R of R G alone, a vector
            kinds += like.extra_formats
            spec.x, spec.y = like.data_window[:2]
            spec.full_x, spec.full_y, spec.full_width, spec.full_height = like.display_window
        spec.channelformats = tuple(oiio.TypeDesc(k) for k in kinds)
    spec.channelnames = tuple(names)
    if alpha:
        spec.alpha_channel = colours
        if format != "openexr" and not (depth == 32 and like is not None and like.associated):
            spec.attribute("oiio:UnassociatedAlpha", 1)
    if like is not None and (depth == 32 or format == "openexr"):
        state_floats(spec, like, format)
    elif depth < 32 and format != "openexr":
        icc = like.icc if like is not None and keeps_icc else None
        state(spec, like, format, keeps_own(like, format), icc if (icc or b"")[16:20] == (b"GRAY" if colours == 1 else b"RGB ") else None)
    # Without it the time of writing would be put in: the same command gives the same bytes.
    if spec.getattribute("DateTime") is None:
        spec.attribute("DateTime", "")
    spec.attribute("Orientation", 1)
    return spec


def _hand_on(spec: Any, like: Picture, format: str) -> None:
    """Give the spec the input's metadata."""
    room, lost = MOST_TEXT, []
    for item in like.spec.extra_attribs:
        with contextlib.suppress(UnicodeError, TypeError, RuntimeError):  # of a kind or with bytes that cannot be handed on
            settings = item.name == SOFTWARE and str(item.value).startswith(MARK)
            if item.name.startswith(_PREFIXES) or item.name in _NAMES or settings or (format != "dpx" and item.name in dpx.STORAGE):
                continue
            if format != "openexr" and item.name.startswith(_OF_CHANNELS):
                continue
            value = legible(item.value) if isinstance(item.value, str) else item.value
            size = len(value.encode()) if isinstance(value, str) else item.type.size()
            if format == "jpeg" and size > room:
                lost.append(item.name)
                continue
            room -= size
            spec.attribute(legible(item.name), item.type, value)
    if lost:
        warn(f"{like.path}: has more metadata than a JPEG can hold; left out: {', '.join(lost[:5])}", 5)


def _note(spec: Any, format: str, settings: str, name: str) -> None:
    """Put the settings of the run into the spec."""
    if format == "jpeg" and len(settings) > MOST_SETTINGS:
        warn(f"{name}: the settings are too long for a JPEG and are left out", 4)
    elif format in ("openexr", "png"):
        spec.attribute(SETTINGS, settings)
    elif format != "dpx":  # which has a hundred characters
        spec.attribute(SOFTWARE, MARK + settings)


def _copied(memory: str, like: Picture | None, codes: np.ndarray, format: str) -> bool:
    """Copy the input's bytes to `memory` where its codes are all as they were, and encoding them again would lose some; else False."""
    if like is None or like.lossless or like.format != format or not np.array_equal(codes, like.codes):
        return False
    if "K" in like.spec.get_string_attribute("jpeg:ColorSpace"):  # CMYK becomes RGB
        return False
    with contextlib.suppress(OSError, AirlightError):  # damaged, or changed since it was read: encoded anew
        path = standard.local(like.path)
        if os.path.getsize(path) <= codes.nbytes and like.spec.get_int_attribute("oiio:subimages", 1) == 1:
            shutil.copyfile(path, memory)
            pixels, spec, _, _ = decode(memory, "error")
            return np.array_equal(upright(pixels, spec.get_int_attribute("Orientation", 1)), codes)
    return False
