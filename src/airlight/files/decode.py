"""Decode, with what OpenImageIO does not do by itself: limits, regular files only, damage noticed."""

import contextlib
import os
import re
import stat
import threading
from collections.abc import Iterator
from typing import Any

import numpy as np

from airlight.errors import AirlightError, NotAPicture, warn
from airlight.files import boxes, by_pillow, channels, dpx, extras, views
from airlight.messages import nearest, nearest_file
from airlight.process import standard

MAX_PIXELS = 2**27
MAX_BYTES = 2**32
MAX_CHANNELS = 256
DAMAGE = ("error", "warn", "ignore")  # what is done with a damaged file
# The settings of a run in an output's metadata: an attribute of EXR and PNG; in JPEG and TIFF, after MARK, the name of the software.
SETTINGS, SOFTWARE, MARK = "airlight:settings", "Software", "Airlight "

_MAGIC = (
    (b"\x89PNG\r\n\x1a\n", "png"),
    (b"\xff\xd8\xff", "jpeg"),
    (b"II*\0", "tiff"),
    (b"MM\0*", "tiff"),
    (b"II+\0", "tiff"),
    (b"MM\0+", "tiff"),
    (b"v/1\x01", "openexr"),
    (b"#?RADIANCE", "hdr"),
    (b"#?RGBE", "hdr"),
    (b"BM", "bmp"),
    (b"GIF8", "gif"),
    (b"\xff\x0a", "jpegxl"),
    (b"\0\0\0\x0cJXL ", "jpegxl"),
    (b"\0\0\0\x0cjP  ", "jpeg2000"),
    (b"P1", "pnm"),
    (b"P2", "pnm"),
    (b"P3", "pnm"),
    (b"P4", "pnm"),
    (b"P5", "pnm"),
    (b"P6", "pnm"),
    (b"PF", "pnm"),
    (b"Pf", "pnm"),
    (b"SDPX", "dpx"),
    (b"XPDS", "dpx"),
    (b"\x80\x2a\x5f\xd7", "cineon"),
    (b"\xd7\x5f\x2a\x80", "cineon"),
)
_OF_SEVERAL = ("tiff", "gif", "webp", "png")
_FOREIGN = {"raw": extras.decode_raw, "heic": extras.decode_heic, "avif": by_pillow.decode_avif}


@contextlib.contextmanager
def opened(path: str, wanted: str = "an image file") -> Iterator[tuple[str, bytes]]:
    """Open a regular file: its name for OpenImageIO (any bytes may be in the true name) and its first bytes. wanted: for messages."""
    there = standard.local(path)
    try:
        if not stat.S_ISREG(os.stat(there).st_mode):
            kind = "a folder" if os.path.isdir(path) else "not a regular file"
            raise AirlightError(f"{path}: is {kind}; give the name of {wanted}")
        handle = os.open(there, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        hint = nearest_file(path) if isinstance(error, FileNotFoundError) else ""
        raise AirlightError(f"{path!s}: cannot be read ({reason}){hint or '; check the name and the permissions'}") from error
    try:
        if not stat.S_ISREG(os.fstat(handle).st_mode):
            raise AirlightError(f"{path}: is not a regular file; give the name of {wanted}")
        head = os.read(handle, 4096)
        name = f"/proc/self/fd/{handle}"
        yield (name if os.path.exists(name) else there), head
    finally:
        os.close(handle)


def problem(source: Any) -> str:
    """Take OpenImageIO's error text; it may quote bytes of the file."""
    try:
        return str(source.geterror())
    except UnicodeDecodeError:
        return "its contents make no sense"


class _Quiet:
    """Silences libpng, which prints errors that OpenImageIO hands on too. Threads share the silence; the last gives stderr back."""

    def __init__(self) -> None:
        self.lock, self.users, self.kept = threading.Lock(), 0, -1

    def __enter__(self) -> None:
        with self.lock:
            self.users += 1
            if self.users == 1:
                with contextlib.suppress(OSError):  # stderr is closed
                    self.kept = os.dup(2)
                    nowhere = os.open(os.devnull, os.O_WRONLY)
                    os.dup2(nowhere, 2)
                    os.close(nowhere)

    def __exit__(self, *_: object) -> None:
        with self.lock:
            self.users -= 1
            if self.users == 0 and self.kept >= 0:
                os.dup2(self.kept, 2)
                os.close(self.kept)
                self.kept = -1


_QUIET = _Quiet()


def _sniff(head: bytes, path: str) -> str:
    if not head:
        raise AirlightError(f"{path}: is empty; copy or export it again")
    if head[:4] == b"RIFF" and head[8:12] == b"WEBP":
        return "webp"
    for magic, name in _MAGIC:
        if head.startswith(magic):
            return name
    if head.startswith(b"glTF"):
        raise AirlightError(f"{path}: is a 3-D scene, which airlight render draws")
    raise NotAPicture(f"{path}: is not an image that Airlight reads; convert it to PNG, JPEG, TIFF, WebP, EXR, HDR or DPX")


def format_of(path: str) -> str:
    """Tell the format of a picture, damaged or not, by its first bytes. Raises AirlightError for what is none."""
    with opened(path) as (_, head):
        return extras.kind(path, head) or _sniff(head, path)


def _is_animated(png: str) -> bool:
    """Tell whether a PNG says, before its pixels, that more pictures follow."""
    with open(png, "rb") as file:
        return b"acTL" in file.read(1 << 20).partition(b"IDAT")[0]


def read_settings(path: str) -> str:
    """Read the settings of the run that wrote an image. Raises AirlightError where there are none."""
    import OpenImageIO as oiio

    spec = oiio.ImageSpec()
    with opened(path) as (name, head):
        foreign = extras.kind(path, head)
        format = foreign or _sniff(head, path)
        if format in ("avif", "jpegxl"):
            extras.copy_exif(spec, by_pillow.avif_exif(name) if format == "avif" else boxes.jxl_exif(name), path)
        elif foreign is None:
            with _QUIET:
                inp = oiio.ImageInput.open(name)
            problem(oiio)
            if inp is not None:
                spec = oiio.ImageSpec(inp.spec())
                inp.close()
                problem(inp)
    text = ""
    with contextlib.suppress(UnicodeDecodeError):
        software = spec.get_string_attribute(SOFTWARE)
        text = spec.get_string_attribute(SETTINGS) or (software[len(MARK) :] if software.startswith(MARK) else "")
    if not text:
        raise AirlightError(f"{path}: holds no settings of Airlight; EXR, PNG, TIFF, JPEG, JPEG XL and AVIF files that Airlight wrote do")
    return text


def _one_line(text: str, name: str) -> str:
    return " ".join(text.replace(name, "the file").split())[:200].rstrip(". ") or "no reason given"


def _check_header(spec: Any, path: str) -> None:
    if spec.deep:
        raise AirlightError(f"{path}: is a deep EXR; flatten it first (Nuke: DeepToImage)")
    if spec.width < 1 or spec.height < 1 or spec.depth > 1 or not 1 <= spec.nchannels <= MAX_CHANNELS:
        raise AirlightError(f"{path}: {spec.width}x{spec.height} pixels with {spec.nchannels} channels cannot be used; export it flat")
    if spec.width * spec.height > MAX_PIXELS or spec.width * spec.height * spec.nchannels * 4 > MAX_BYTES:
        raise _too_large(path, spec.width, spec.height, spec.nchannels)


def _too_large(path: str, width: int | str, height: int | str, channels: int | str) -> AirlightError:
    size, limit = f"{width}x{height} pixels with {channels} channels", f"{MAX_PIXELS // 10**6} megapixels (4 GiB decoded)"
    return AirlightError(f"{path}: {size} is more than the limit of {limit}; make it smaller first")


def _code_type(spec: Any) -> str:
    import OpenImageIO as oiio

    kind = spec.format.basetype
    if kind in (oiio.HALF, oiio.FLOAT, oiio.DOUBLE):
        return "float"
    return "uint8" if kind in (oiio.UINT8, oiio.INT8) else "uint16"


def _salvage(inp: Any, spec: Any, kind: str) -> np.ndarray | None:
    """Salvage what can be had of a damaged file, missing rows black."""
    step = max(1, spec.get_int_attribute("oiio:RowsPerChunk", 1))
    result, found = None, False
    for y in range(spec.y, spec.y + spec.height, step):
        end = min(y + step, spec.y + spec.height)
        rows = inp.read_scanlines(0, 0, y, end, 0, 0, spec.nchannels, kind)
        if rows is None:
            problem(inp)  # or the texts pile up, and each costs as much as all before it
            continue
        if result is None:
            result = np.zeros((spec.height, spec.width, spec.nchannels), rows.dtype)
        result[y - spec.y : end - spec.y] = np.reshape(rows, (end - y, spec.width, spec.nchannels))
        found = True
    return result if found else None


def _with_parts(inp: Any, spec: Any, pixels: np.ndarray, parts: int, path: str) -> np.ndarray:
    """Append the channels of an EXR's further parts, in `spec` too; a name that is taken gets the part's before it, and then its other
    colours and alpha too; of another view the view's."""
    import OpenImageIO as oiio

    names = list(spec.channelnames)
    kinds = [str(kind) for kind in spec.channelformats] or [str(spec.format)] * len(names)
    found, lost, specs = [pixels], [], [oiio.ImageSpec(spec)]
    default = spec.get_string_attribute("view")
    for part in range(1, parts):
        if not inp.seek_subimage(part, 0):
            lost.append(str(part))
            break
        further = inp.spec()
        name = further.get_string_attribute("oiio:subimagename", str(part))
        view = further.get_string_attribute("view")
        box = [(s.x, s.y, s.width, s.height) for s in (spec, further)]
        fresh = [channels.legible(one) for one in further.channelnames]
        if view and default and view != default:
            fresh = [channel if view in channel.split(".") else views.in_view(channel, view) for channel in fresh]
        layered = bool(set(fresh) & set(names))  # then its colours stay together: its alpha is none of the first part's
        fresh = [f"{name}.{one}" if one in names or (layered and one.lower() in channels.COLOURS) else one for one in fresh]
        if further.deep or box[0] != box[1] or set(fresh) & set(names) or len(names) + len(fresh) > MAX_CHANNELS:
            lost.append(name)
            continue
        if spec.width * spec.height * (len(names) + len(fresh)) * 4 > MAX_BYTES:
            raise AirlightError(f"{path}: its {parts} parts are more than the limit of 4 GiB decoded; make it smaller first")
        values = inp.read_image(part, 0, 0, further.nchannels, "float")
        if values is None:
            lost.append(name)
            continue
        specs.append(oiio.ImageSpec(further))
        found.append(np.reshape(values, (*pixels.shape[:2], len(fresh))))
        names += fresh
        kinds += [str(kind) for kind in further.channelformats] or [str(further.format)] * len(fresh)
    if lost:
        warn(f"{path}: parts that are deep, damaged or of another size are not kept: {', '.join(lost[:5])}", 6)
    views.join(spec, specs)
    for item in [one for other in specs[1:] for one in other.extra_attribs if one.name.startswith("cryptomatte/")]:
        spec.attribute(item.name, item.type, item.value)
    spec.nchannels, spec.channelnames, spec.channelformats = len(names), tuple(names), tuple(_types(kinds))
    return np.concatenate(found, axis=2, dtype=np.float32)


def _types(kinds: list[str]) -> list[Any]:
    import OpenImageIO as oiio

    return [oiio.TypeDesc(kind) for kind in kinds]


def _refusal(path: str) -> str:
    """Ask why a file is not opened: by a name with an extension OpenImageIO gives the answer of that format's reader, else of no one's."""
    import OpenImageIO as oiio

    with contextlib.suppress(UnicodeError, TypeError), _QUIET:  # a name that is not UTF-8
        if oiio.ImageInput.open(standard.local(path)) is None:
            return problem(oiio)
    return ""


def decode(path: str, on_damage: str) -> tuple[np.ndarray, Any, str, bytes]:
    """Decode all channels of the picture, those of an EXR's further parts included, with spec, format name and the file's first bytes."""
    import OpenImageIO as oiio

    if on_damage not in DAMAGE:
        raise AirlightError(f"on-damage is {on_damage!r}{nearest(on_damage, DAMAGE)}; use error, warn or ignore")
    oiio.attribute("limits:imagesize_MB", MAX_BYTES >> 20)
    oiio.attribute("limits:resolution", 1 << 20)
    oiio.attribute("limits:channels", MAX_CHANNELS)
    hints = oiio.ImageSpec()
    hints.attribute("oiio:UnassociatedAlpha", 1)
    problem(oiio)  # of a file that the caller's own program opened before
    with opened(path) as (name, head), contextlib.ExitStack() as quiet:
        foreign = extras.kind(path, head)
        if foreign is not None:
            with open(name, "rb") as file:
                codes, spec = _FOREIGN[foreign](file, path, _check_header)
            return np.reshape(codes, (spec.height, spec.width, spec.nchannels)), spec, foreign, head
        format = _sniff(head, path)
        if format == "png":
            quiet.enter_context(_QUIET)
        inp = oiio.ImageInput.open(name, hints)
        text = problem(oiio)
        if inp is None and format == "bmp" and head[30:31] in (b"\1", b"\2"):  # RLE8, RLE4
            with open(name, "rb") as file:
                codes, spec = by_pillow.decode_bmp(file, path, _check_header)
            return codes, spec, format, head
        if inp is None:
            text = (_refusal(path) or text).replace(path, "the file")
            if claimed := re.search(r"claimed to be (\d+)x(\d+), (\d+)-channel", text):
                raise _too_large(path, *claimed.groups())
            if "Subsampled" in text:
                raise AirlightError(f"{path}: has subsampled channels, as chroma beside luminance; save it with R, G, B of full size")
            raise AirlightError(f"{path}: is damaged or of an unusual kind ({_one_line(text, name)}); copy or export it again")
        spec = oiio.ImageSpec(inp.spec())
        spec.channelnames = tuple(channels.legible(one) for one in spec.channelnames)
        text += problem(inp)
        pixels = None
        try:
            if inp.format_name() != format:
                raise AirlightError(f"{path}: is damaged (begins as {format}, reads as {inp.format_name()}); export it again")
            _check_header(spec, path)
            kind = _code_type(spec)
            pixels = inp.read_image(0, 0, 0, spec.nchannels, kind)
            text += problem(inp)
            if pixels is None and on_damage != "error" and spec.tile_width == 0:
                pixels = _salvage(inp, spec, kind)
                problem(inp)
                text = text or "rows are missing"
            parts = spec.get_int_attribute("oiio:subimages", 1)
            several = format in _OF_SEVERAL and pixels is not None and (_is_animated(name) if format == "png" else inp.seek_subimage(1, 0))
            problem(inp)
            if format == "dpx" and pixels is not None and pixels.dtype == np.uint16:
                dpx.mend_row_ends(name, pixels, spec)
            if format == "jpegxl" and pixels is not None:
                extras.copy_exif(spec, boxes.jxl_exif(name), path)
            if pixels is not None and format == "openexr" and parts > 1:
                pixels = _with_parts(inp, spec, np.reshape(pixels, (spec.height, spec.width, spec.nchannels)), parts, path)
                text += problem(inp)
        finally:
            inp.close()
            text += problem(inp) + problem(oiio)
    if pixels is None or (text and on_damage == "error"):
        hint = "copy or export it again" if pixels is None else "copy or export it again, or pass --on-damage warn to use what is there"
        raise AirlightError(f"{path}: is damaged ({_one_line(text, name)}); {hint}")
    if text and on_damage == "warn":
        warn(f"{path}: is damaged ({_one_line(text, name)}); used as far as it goes", 5)
    if several:
        spec.attribute("oiio:subimages", 2)  # at least
        warn(f"{path}: holds several pictures (pages or an animation); only the first is used", 5)
    return np.ascontiguousarray(np.reshape(pixels, (spec.height, spec.width, spec.nchannels))), spec, format, head
