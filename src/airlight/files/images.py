"""Pictures from files: checked, upright, and with all that is needed to write them back."""

import os
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from airlight.errors import AirlightError
from airlight.files.colour import LUMINANCE, Profile, alpha_of, decode_codes
from airlight.files.decode import decode, tell
from airlight.files.repair import repair

OnDamage = Literal["error", "warn", "ignore"]
Window = tuple[int, int, int, int]  # x, y, width, height


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

    def linear(self, coarse: bool = False) -> np.ndarray:
        """(H, W, 3) float32 scene-linear Rec. 709, grey expanded; straight colour for integer formats, as stored for EXR.

        coarse: only every n-th row and column, some 1,500 of the longer.
        """
        step = max(1, max(self.width, self.height) // 1500) if coarse else 1
        return decode_codes(self.colour_codes[step // 2 :: step, step // 2 :: step], self.profile, self.encoding == "linear")


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
    if not 0 <= alpha_channel < len(names) or not usable[alpha_channel]:  # OpenImageIO counts one too far in GIFs
        alpha_channel = -1
    layers = {name.rpartition(".")[0]: None for name in names}
    for layer in sorted(layers, key=lambda layer: layer != ""):
        place = {name.rpartition(".")[2].upper(): i for i, name in enumerate(names) if name.rpartition(".")[0] == layer and usable[i]}
        for colour in (("R", "G", "B"), ("Y",)):
            if all(c in place for c in colour):
                alpha = place.get("A", alpha_channel if layer == "" else -1)
                return [place[c] for c in colour] + ([alpha] if alpha >= 0 else [])
    return [next(i for i, fine in enumerate(usable) if fine)]


def _straight(codes: np.ndarray) -> np.ndarray:
    """Integer codes that were multiplied by alpha, divided again."""
    most = np.iinfo(codes.dtype).max
    value = codes.astype(np.float64)
    value[..., :-1] *= most / np.maximum(value[..., -1:], 1)
    return np.rint(np.minimum(value, most)).astype(codes.dtype)


def _profile(spec: Any, path: str) -> tuple[bytes | None, Profile | None]:
    """The embedded ICC profile, and its transform where it is not simply sRGB."""
    value = spec.getattribute("ICCProfile")
    if value is None:
        return None, None
    icc = bytes(bytearray(value))
    if icc[16:20] == b"CMYK":  # OpenImageIO has made RGB of the pixels already
        return None, None
    try:
        profile = Profile(icc)
        return icc, None if profile.is_srgb() else profile
    except ValueError as error:
        tell(f"{path}: its colour profile is not understood ({' '.join(str(error).split())[:100].rstrip('.')}); taken as sRGB", 5)
        return icc, None


def _load(path: str | os.PathLike[str], on_damage: str) -> Picture:
    name = os.fsdecode(path)
    pixels, spec, format, head = decode(name, on_damage)
    orientation = spec.get_int_attribute("Orientation", 1)
    orientation = orientation if 1 <= orientation <= 8 else 1
    data_window, display_window = _turn_header(spec, orientation)
    pixels = upright(pixels, orientation)

    space = spec.get_string_attribute("jpeg:ColorSpace") + spec.get_string_attribute("tiff:ColorSpace")
    if "CMYK" in space or "YCbCrK" in space:
        tell(f"{name}: is CMYK and was converted to RGB plainly; convert it to RGB yourself for true colours", 4)

    names = list(spec.channelnames)
    kinds = [str(kind) for kind in spec.channelformats] or [str(spec.format)] * len(names)
    usable = [format != "openexr" or kind != "uint" for kind in kinds]
    if not any(usable):
        raise AirlightError(f"{name}: holds only identifiers, no colours; choose a picture with R, G, B")
    chosen = _pick(names, spec.alpha_channel, usable)
    codes = np.ascontiguousarray(pixels[..., chosen])
    real = codes.dtype.kind == "f"
    has_alpha = len(chosen) in (2, 4)

    # The picture's own R G B A (or Y A) are replaced when written; a layer that stood in for them is kept as well.
    top = all("." not in names[i] for i in chosen) and (len(chosen) > 1 or names[chosen[0]].upper() == "Y")
    rest = [i for i in range(len(names)) if usable[i] and not (top and i in chosen) and not names[i].startswith("airlight.")]
    lost = [names[i] for i in range(len(names)) if not usable[i]] if format == "openexr" else [names[i] for i in rest if i not in chosen]
    if lost:
        tell(f"{name}: channels that cannot be kept: {', '.join(lost[:5])}", 4)
    extra = np.ascontiguousarray(pixels[..., rest]) if format == "openexr" and rest else None

    associated = format == "openexr"
    if format == "tiff" and has_alpha and not spec.get_int_attribute("oiio:UnassociatedAlpha", 0):
        associated = real
        codes = codes if real else _straight(codes)
    icc, profile = _profile(spec, name) if not real else (None, None)
    flat = spec.get_string_attribute("oiio:ColorSpace").startswith("lin") and icc is None
    return Picture(
        codes=codes,
        channels=tuple(names[i] for i in chosen),
        alpha=alpha_of(codes[..., -1]) if has_alpha else None,
        encoding="linear" if real or flat else "icc" if profile is not None else "srgb",
        path=name,
        spec=spec,
        format=format,
        bits=codes.dtype.itemsize * 8 if not real else 16 if kinds[chosen[0]] == "half" else 32,
        icc=icc,
        profile=profile,
        associated=associated,
        lossless=format != "jpeg" and (format != "webp" or b"VP8 " not in head),
        extra=extra,
        extra_names=tuple(names[i] for i in rest) if extra is not None else (),
        extra_formats=tuple(kinds[i] for i in rest) if extra is not None else (),
        data_window=data_window,
        display_window=display_window,
    )


def _checked(path: str | os.PathLike[str], on_damage: str) -> Picture:
    try:
        return _load(path, on_damage)
    except UnicodeDecodeError as error:  # from names within the file
        raise AirlightError(f"{os.fsdecode(path)}: is damaged (names that are not UTF-8); copy or export it again") from error


def read_image(path: str | os.PathLike[str], on_damage: str = "error") -> Picture:
    """Read a picture: PNG, JPEG, TIFF, WebP, EXR, HDR (and BMP, GIF, PNM, JPEG XL, JPEG 2000), upright.

    `on_damage` says what to do with a damaged file: "error", "warn" (use what there is, with a warning) or "ignore".
    NaN and Inf are mended (`repair`). Raises AirlightError for anything that is no usable picture; warns with AirlightWarning.
    """
    picture = _checked(path, on_damage)
    if picture.codes.dtype.kind == "f":
        picture.codes = repair(picture.codes, picture.path)
        if picture.alpha is not None:
            picture.alpha = alpha_of(picture.codes[..., -1])
    return picture


def read_mask(path: str | os.PathLike[str], on_damage: str = "error", depth: bool = False) -> np.ndarray:
    """Read an image as data: (H, W) float32, the luminance of the code values (0..1 for integer files, EXR as it is).

    With `depth` an EXR's channel Z (or depth.Z) is taken where there is one; infinite depths become the largest finite one.
    """
    picture = _checked(path, on_damage)
    if depth and picture.extra is not None:
        for i, name in enumerate(picture.extra_names):
            if name.upper() in ("Z", "DEPTH.Z", "DEPTH"):
                return _finite(picture.extra[..., i : i + 1], picture.path)[..., 0]
    codes = picture.colour_codes
    value = codes.astype(np.float32)
    if codes.dtype.kind == "f":
        value = _finite(value, picture.path)
    else:
        value /= np.float32(np.iinfo(codes.dtype).max)
    return np.ascontiguousarray(value[..., 0] if value.shape[2] == 1 else value @ LUMINANCE)


def _finite(value: np.ndarray, name: str) -> np.ndarray:
    infinite = np.isinf(value)
    if infinite.any():
        fine = value[np.isfinite(value)]
        if fine.size:
            value = np.where(infinite, np.where(value > 0, fine.max(), fine.min()), value)
    return repair(value, name)
