"""Pictures from files: checked, upright, and with all that is needed to write them back."""

import contextlib
import os
import stat
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from airlight.errors import AirlightError, AirlightWarning
from airlight.files.colour import LUMINANCE, Profile, alpha_of, decode_codes
from airlight.files.repair import repair

MAX_PIXELS = 2**27
MAX_BYTES = 2**32
MAX_CHANNELS = 256
OnDamage = Literal["error", "warn", "ignore"]
Window = tuple[int, int, int, int]  # x, y, width, height

_MAGIC = (
    (b"\x89PNG\r\n\x1a\n", "png"), (b"\xff\xd8\xff", "jpeg"), (b"II*\0", "tiff"), (b"MM\0*", "tiff"), (b"II+\0", "tiff"), (b"MM\0+", "tiff"),
    (b"v/1\x01", "openexr"), (b"#?RADIANCE", "hdr"), (b"#?RGBE", "hdr"), (b"BM", "bmp"), (b"GIF8", "gif"),
    (b"\xff\x0a", "jpegxl"), (b"\0\0\0\x0cJXL ", "jpegxl"), (b"\0\0\0\x0cjP  ", "jpeg2000"),
    (b"P1", "pnm"), (b"P2", "pnm"), (b"P3", "pnm"), (b"P4", "pnm"), (b"P5", "pnm"), (b"P6", "pnm"), (b"PF", "pnm"), (b"Pf", "pnm"),
)  # fmt: skip


@dataclass
class Picture:
    """A picture as its file holds it, upright.

    codes: (H, W, C) uint8, uint16 or float32, C in 1..4: grey, grey + alpha, RGB, RGBA; alpha is unassociated in integer codes.
    alpha: (H, W) float32 in 0..1, or None. encoding: "srgb", "icc" (see `profile`) or "linear".
    extra: further EXR channels (H, W, len(extra_names)) float32, kept for writing. bits: of the stored colour (16 for half).
    data_window, display_window: (x, y, width, height), `codes` fills the data window. spec: the file's metadata.
    """

    codes: np.ndarray
    channels: tuple[str, ...]
    alpha: np.ndarray | None
    encoding: str
    path: str
    spec: Any
    format: str
    bits: int
    icc: bytes | None = None
    profile: Profile | None = None
    associated: bool = False
    lossless: bool = True
    extra: np.ndarray | None = None
    extra_names: tuple[str, ...] = ()
    extra_formats: tuple[str, ...] = ()
    data_window: Window = (0, 0, 0, 0)
    display_window: Window = (0, 0, 0, 0)

    @property
    def height(self) -> int:
        return int(self.codes.shape[0])

    @property
    def width(self) -> int:
        return int(self.codes.shape[1])

    @property
    def colour_codes(self) -> np.ndarray:
        """The codes without alpha, (H, W, 1 or 3)."""
        return self.codes[..., : 1 if self.codes.shape[2] < 3 else 3]

    def linear(self) -> np.ndarray:
        """(H, W, 3) float32 scene-linear Rec. 709, grey expanded; straight colour for integer formats, as stored for EXR."""
        return decode_codes(self.colour_codes, self.profile, self.encoding == "linear")


def tell(message: str, level: int = 3) -> None:
    warnings.warn(message, AirlightWarning, stacklevel=level)


@contextlib.contextmanager
def _opened(path: str) -> Iterator[tuple[str, bytes]]:
    """A regular file's name for OpenImageIO (any bytes may be in the true name) and its first bytes."""
    try:
        if not stat.S_ISREG(os.stat(path).st_mode):
            kind = "a folder" if os.path.isdir(path) else "not a regular file"
            raise AirlightError(f"{path}: is {kind}; give the name of an image file")
        handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise AirlightError(f"{path!s}: cannot be read ({reason}); check the name and the permissions") from error
    try:
        if not stat.S_ISREG(os.fstat(handle).st_mode):
            raise AirlightError(f"{path}: is not a regular file; give the name of an image file")
        head = os.read(handle, 4096)
        name = f"/proc/self/fd/{handle}"
        yield (name if os.path.exists(name) else path), head
    finally:
        os.close(handle)


def _sniff(head: bytes, path: str) -> str:
    if not head:
        raise AirlightError(f"{path}: is empty; copy or export it again")
    if head[:4] == b"RIFF" and head[8:12] == b"WEBP":
        return "webp"
    for magic, name in _MAGIC:
        if head.startswith(magic):
            return name
    raise AirlightError(f"{path}: is not an image that Airlight reads; convert it to PNG, JPEG, TIFF, WebP, EXR or HDR")


def _one_line(text: str, name: str) -> str:
    return " ".join(text.replace(name, "the file").split())[:200].rstrip(". ") or "no reason given"


def _check_header(spec: Any, path: str) -> None:
    if spec.deep:
        raise AirlightError(f"{path}: is a deep EXR; flatten it first (Nuke: DeepToImage)")
    if spec.width < 1 or spec.height < 1 or spec.depth > 1 or not 1 <= spec.nchannels <= MAX_CHANNELS:
        raise AirlightError(f"{path}: {spec.width}x{spec.height} pixels with {spec.nchannels} channels cannot be used; export a flat picture")
    if spec.width * spec.height > MAX_PIXELS or spec.width * spec.height * spec.nchannels * 4 > MAX_BYTES:
        raise AirlightError(
            f"{path}: {spec.width}x{spec.height} pixels with {spec.nchannels} channels is more than the limit of"
            f" {MAX_PIXELS // 10**6} megapixels (4 GiB decoded); make it smaller first"
        )


def _code_type(spec: Any) -> str:
    import OpenImageIO as oiio

    kind = spec.format.basetype
    if kind in (oiio.HALF, oiio.FLOAT, oiio.DOUBLE):
        return "float"
    return "uint8" if kind in (oiio.UINT8, oiio.INT8) else "uint16"


def _salvage(inp: Any, spec: Any, kind: str) -> np.ndarray | None:
    """What can be had of a damaged file, missing rows black."""
    step = max(1, spec.get_int_attribute("oiio:RowsPerChunk", 1))
    result, found = None, False
    for y in range(spec.y, spec.y + spec.height, step):
        end = min(y + step, spec.y + spec.height)
        rows = inp.read_scanlines(0, 0, y, end, 0, 0, spec.nchannels, kind)
        if rows is None:
            continue
        if result is None:
            result = np.zeros((spec.height, spec.width, spec.nchannels), rows.dtype)
        result[y - spec.y : end - spec.y] = np.reshape(rows, (end - y, spec.width, spec.nchannels))
        found = True
    return result if found else None


def _decode(path: str, on_damage: str) -> tuple[np.ndarray, Any, str, bytes]:
    """All channels of the first picture, with spec, format name and the file's first bytes."""
    import OpenImageIO as oiio

    if on_damage not in ("error", "warn", "ignore"):
        raise AirlightError(f"on-damage is {on_damage!r}; use error, warn or ignore")
    oiio.attribute("limits:imagesize_MB", MAX_BYTES >> 20)
    oiio.attribute("limits:resolution", 1 << 20)
    oiio.attribute("limits:channels", MAX_CHANNELS)
    hints = oiio.ImageSpec()
    hints.attribute("oiio:UnassociatedAlpha", 1)
    with _opened(path) as (name, head):
        format = _sniff(head, path)
        inp = oiio.ImageInput.open(name, hints)
        text = oiio.geterror()
        if inp is None:
            raise AirlightError(f"{path}: is damaged or of an unusual kind ({_one_line(text, name)}); copy or export it again")
        spec = oiio.ImageSpec(inp.spec())
        text += inp.geterror()
        pixels = None
        try:
            if inp.format_name() != format:
                raise AirlightError(f"{path}: is damaged (begins as {format}, reads as {inp.format_name()}); export it again")
            _check_header(spec, path)
            kind = _code_type(spec)
            pixels = inp.read_image(0, 0, 0, spec.nchannels, kind)
            text += inp.geterror()
            if pixels is None and on_damage != "error" and spec.tile_width == 0:
                pixels = _salvage(inp, spec, kind)
                inp.geterror()
                text = text or "rows are missing"
            parts = spec.get_int_attribute("oiio:subimages", 1)
        finally:
            inp.close()
            text += inp.geterror() + oiio.geterror()
    if pixels is None or (text and on_damage == "error"):
        hint = "copy or export it again" if pixels is None else "copy or export it again, or pass --on-damage warn to use what is there"
        raise AirlightError(f"{path}: is damaged ({_one_line(text, name)}); {hint}")
    if text and on_damage == "warn":
        tell(f"{path}: is damaged ({_one_line(text, name)}); used as far as it goes", 5)
    if parts > 1:
        tell(f"{path}: holds {parts} pictures; only the first is used", 5)
    return np.ascontiguousarray(np.reshape(pixels, (spec.height, spec.width, spec.nchannels))), spec, format, head


def upright(array: np.ndarray, orientation: int) -> np.ndarray:
    """Apply an EXIF orientation (1..8) to (H, W, ...)."""
    if orientation in (5, 6, 7, 8):
        array = array.swapaxes(0, 1)
    if orientation in (3, 4, 7, 8):
        array = array[::-1]
    if orientation in (2, 3, 6, 7):
        array = array[:, ::-1]
    return np.ascontiguousarray(array)


def _turn_header(spec: Any, orientation: int) -> tuple[Window, Window]:
    """Data and display window after the orientation; the spec's attributes are turned with them."""
    x, y = spec.x - spec.full_x, spec.y - spec.full_y
    width, height = spec.width, spec.height
    whole = [spec.full_width, spec.full_height]
    corner = [spec.full_x, spec.full_y]
    if orientation in (5, 6, 7, 8):
        x, y, width, height = y, x, height, width
        whole.reverse()
        corner.reverse()
        across, down = (spec.getattribute(name) for name in ("XResolution", "YResolution"))
        if across is not None and down is not None:
            spec.attribute("XResolution", float(down))
            spec.attribute("YResolution", float(across))
        aspect = spec.get_float_attribute("PixelAspectRatio", 1.0)
        if aspect not in (0.0, 1.0):
            spec.attribute("PixelAspectRatio", 1 / aspect)
    if orientation in (3, 4, 7, 8):
        y = whole[1] - y - height
    if orientation in (2, 3, 6, 7):
        x = whole[0] - x - width
    for name, size in (("Exif:PixelXDimension", width), ("Exif:PixelYDimension", height)):
        if spec.getattribute(name) is not None:
            spec.attribute(name, size)
    spec.attribute("Orientation", 1)
    return (corner[0] + x, corner[1] + y, width, height), (corner[0], corner[1], whole[0], whole[1])


def _pick(names: list[str], alpha_channel: int, usable: list[bool]) -> list[int]:
    """The indices of the picture's channels: R G B (A), or Y (A), else those of the first layer, else the first channel."""
    layers = {name.rpartition(".")[0]: None for name in names}
    for layer in sorted(layers, key=lambda layer: layer != ""):
        place = {name.rpartition(".")[2].upper(): i for i, name in enumerate(names) if name.rpartition(".")[0] == layer and usable[i]}
        for colour in (("R", "G", "B"), ("Y",)):
            if all(c in place for c in colour):
                alpha = place.get("A", alpha_channel if layer == "" and alpha_channel >= 0 and usable[alpha_channel] else -1)
                return [place[c] for c in colour] + ([alpha] if alpha >= 0 else [])
    return [next(i for i, fine in enumerate(usable) if fine)]
