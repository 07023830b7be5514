"""Pictures from files: checked, upright, and with all that is needed to write them back."""

import difflib
import os
from dataclasses import dataclass
from typing import Any

import numpy as np

from airlight.alpha import is_transparent, premultiply, straight_codes
from airlight.arrays import repair
from airlight.colour import alpha_of, decode_codes
from airlight.errors import AirlightError, warn
from airlight.files import spaces
from airlight.files.colour import Profile
from airlight.files.decode import decode
from airlight.luminance import REC709_F32

COARSE = 1500  # px of the longer side of a coarse copy, about
Window = tuple[int, int, int, int]  # x, y, width, height


def every(size: int, step: int) -> slice:
    """Index every step-th of size, from the middle of the first step; at least one."""
    return slice(min(step // 2, size - 1), None, step)


@dataclass
class Picture:
    """A picture as its file holds it, upright.

    codes: (H, W, C) uint8, uint16 or float32, C in 1..4: grey, grey + alpha, RGB, RGBA; alpha is unassociated in integer codes.
    alpha: (H, W) float32 in 0..1, or None. associated: codes are premultiplied by it. encoding: "srgb", "icc" (see `profile`), "linear".
    extra: further EXR channels (H, W, len(extra_names)) float32, kept for writing. bits: of the stored colour (16 for half).
    formats, extra_formats: how an EXR stores the picture's channels and the further ones, half or float.
    data_window, display_window: (x, y, width, height), `codes` fills the data window. spec: the file's metadata.
    layer: the EXR layer that was asked for, whose channels are replaced when written; "": R G B A are.
    to_709: (3, 3), the picture's linear RGB to linear Rec. 709; None where it is that. chromaticities: of the RGB, for writing.
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
    formats: tuple[str, ...] = ()
    extra: np.ndarray | None = None
    extra_names: tuple[str, ...] = ()
    extra_formats: tuple[str, ...] = ()
    data_window: Window = (0, 0, 0, 0)
    display_window: Window = (0, 0, 0, 0)
    layer: str = ""
    to_709: np.ndarray | None = None
    chromaticities: tuple[float, ...] | None = None

    @property
    def height(self) -> int:
        return int(self.codes.shape[0])

    @property
    def width(self) -> int:
        return int(self.codes.shape[1])

    @property
    def colour_codes(self) -> np.ndarray:
        """Leave out alpha: the codes (H, W, 1 or 3)."""
        return self.codes[..., : 1 if self.codes.shape[2] < 3 else 3]

    @property
    def is_transparent(self) -> bool:
        """Tell whether alpha hides less than all anywhere."""
        return is_transparent(self.alpha)

    @property
    def luminance(self) -> np.ndarray:
        """Give the weights of the luminance of the picture's linear RGB: (3,) float32."""
        return REC709_F32 if self.to_709 is None else (REC709_F32 @ self.to_709).astype(np.float32)

    def rec709(self, pixels: np.ndarray) -> np.ndarray:
        """Convert (..., 3) from the picture's linear RGB to linear Rec. 709."""
        return pixels if self.to_709 is None else pixels @ self.to_709.T.astype(np.float32)

    def channel(self, name: str) -> np.ndarray:
        """Find a further channel of an EXR, by its name in any case: (H, W) float32. Raises AirlightError where there is none."""
        names = [one.lower() for one in self.extra_names]
        if self.extra is None or name.lower() not in names:
            there = ", ".join(self.extra_names[:8]) or "none"
            close = difflib.get_close_matches(name, self.extra_names, 1)
            hint = f"; did you mean {close[0]!r}?" if close else ""
            raise AirlightError(f"{self.path}: has no channel {name!r} beside its colours{hint} (there is {there})")
        return _finite(np.ascontiguousarray(self.extra[..., names.index(name.lower())][..., None]), self.path)[..., 0]

    def from_rec709(self, pixels: np.ndarray) -> np.ndarray:
        """Convert by the inverse of `rec709`."""
        return pixels if self.to_709 is None else pixels @ np.linalg.inv(self.to_709).T.astype(np.float32)

    def linear(self, coarse: bool = False) -> np.ndarray:
        """Decode to scene-linear light, (H, W, 3) float32, in the picture's own RGB; grey expanded; premultiplied: what is seen over black.

        coarse: only every n-th row and column, some COARSE of the longer.
        """
        step = max(1, max(self.width, self.height) // COARSE) if coarse else 1
        some = every(self.height, step), every(self.width, step)
        rgb = decode_codes(self.colour_codes[some], self.profile, self.encoding == "linear")
        if self.is_transparent and not self.associated and self.alpha is not None:
            premultiply(rgb, self.alpha[some])
        return rgb


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
    """Orient data and display window; the spec's attributes are turned with them."""
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


def _layers(names: list[str], alpha_channel: int, usable: list[bool]) -> dict[str, list[int]]:
    """Find the layers that hold a picture, "" the one without a name: the indices of their R G B (A), or Y (A)."""
    if not 0 <= alpha_channel < len(names) or not usable[alpha_channel]:  # OpenImageIO counts one too far in GIFs
        alpha_channel = -1
    found: dict[str, list[int]] = {}
    for layer in {name.rpartition(".")[0]: None for name in names if not name.startswith("airlight.")}:
        place = {name.rpartition(".")[2].upper(): i for i, name in enumerate(names) if name.rpartition(".")[0] == layer and usable[i]}
        for colour in (("R", "G", "B"), ("Y",)):
            if layer not in found and all(c in place for c in colour):
                alpha = place.get("A", alpha_channel if layer == "" else -1)
                found[layer] = [place[c] for c in colour] + ([alpha] if alpha >= 0 else [])
    return found


def _named(layer: str, found: dict[str, list[int]], path: str) -> str:
    """Find the layer that is meant by what the user wrote; `rgba` is the one without a name."""
    if layer in found:
        return layer
    if layer.lower() == "rgba" and "" in found:
        return ""
    names = [name or "rgba" for name in found]
    near = difflib.get_close_matches(layer, names, 1)
    hint = f" (did you mean {near[0]!r}?)" if near else ""
    raise AirlightError(f"{path}: has no layer {layer!r}{hint}; it has {', '.join(names) or 'none with R, G, B'}")


def _stands_in(found: dict[str, list[int]]) -> str | None:
    """Choose a layer where the user named none: the one without a name, else the beauty by its usual names, else the first."""
    beauty = [name for name in found if name.rpartition(".")[2].lower() in ("combined", "beauty", "rgba")]
    return "" if "" in found else next(iter(beauty + list(found)), None)


def _profile(spec: Any, path: str) -> tuple[bytes | None, Profile | None]:
    """Read the embedded ICC profile, and its transform where it is not simply sRGB."""
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
        warn(f"{path}: its colour profile is not understood ({' '.join(str(error).split())[:100].rstrip('.')}); taken as sRGB", 5)
        return icc, None


def _space(spec: Any, real: bool, name: str, colorspace: str | None) -> tuple[np.ndarray | None, tuple[float, ...] | None]:
    """Find the matrix to Rec. 709 and the chromaticities of a picture: those of `colorspace`, else what its file says."""
    if colorspace is not None:
        if not real:
            raise AirlightError(f"{name}: holds integers, whose colours its ICC profile tells; --colorspace is for EXR, HDR, float TIFF")
        spec.erase_attribute("colorInteropID")
        return spaces.by_name(colorspace)
    value = spec.getattribute("chromaticities")
    if not isinstance(value, tuple) or len(value) != 8:
        return None, None
    try:
        return spaces.to_rec709(value), value
    except ValueError as error:
        warn(f"{name}: has {error}; taken as Rec. 709 (--colorspace names another)", 5)
        return None, None


def _load(path: str | os.PathLike[str], on_damage: str, layer: str | None = None, colorspace: str | None = None) -> Picture:
    name = os.fsdecode(path)
    pixels, spec, format, head = decode(name, on_damage)
    orientation = spec.get_int_attribute("Orientation", 1)
    orientation = orientation if 1 <= orientation <= 8 else 1
    data_window, display_window = _turn_header(spec, orientation)
    pixels = upright(pixels, orientation)

    space = spec.get_string_attribute("jpeg:ColorSpace") + spec.get_string_attribute("tiff:ColorSpace")
    if "CMYK" in space or "YCbCrK" in space:
        warn(f"{name}: is CMYK and was converted to RGB plainly; convert it to RGB yourself for true colours", 4)

    names = list(spec.channelnames)
    kinds = [str(kind) for kind in spec.channelformats] or [str(spec.format)] * len(names)
    usable = [format != "openexr" or kind != "uint" for kind in kinds]
    if not any(usable):
        raise AirlightError(f"{name}: holds only identifiers, no colours; choose a picture with R, G, B")
    found = _layers(names, spec.alpha_channel, usable)
    if layer is not None and format != "openexr":
        raise AirlightError(f"{name}: --input-layer chooses among the layers of an EXR, which this is not; leave it out")
    own = _named(layer, found, name) if layer is not None else ""
    stand_in = _stands_in(found) if layer is None else own
    chosen = found[stand_in] if stand_in is not None else [next(i for i, fine in enumerate(usable) if fine)]
    codes = pixels if chosen == list(range(len(names))) else np.ascontiguousarray(pixels[..., chosen])
    real = codes.dtype.kind == "f"
    has_alpha = len(chosen) in (2, 4)

    # R G B A (or Y A), or the layer that was asked for, are replaced when written; a layer that stood in for them is kept as well.
    replaced = stand_in == own
    rest = [i for i in range(len(names)) if usable[i] and not (replaced and i in chosen) and not names[i].startswith("airlight.")]
    lost = [names[i] for i in range(len(names)) if not usable[i]] if format == "openexr" else [names[i] for i in rest if i not in chosen]
    if lost:
        warn(f"{name}: channels that cannot be kept: {', '.join(lost[:5])}", 4)
    extra = np.ascontiguousarray(pixels[..., rest]) if format == "openexr" and rest else None

    associated = format == "openexr"
    if format == "tiff" and has_alpha and not spec.get_int_attribute("oiio:UnassociatedAlpha", 0):
        associated = real
        codes = codes if real else straight_codes(codes)
    if has_alpha and not associated and not codes[..., -1].any():
        warn(f"{name}: is transparent all over, which would show nothing; its colours are taken as opaque", 4)
        codes, chosen, has_alpha = np.ascontiguousarray(codes[..., :-1]), chosen[:-1], False
    icc, profile = _profile(spec, name) if not real else (None, None)
    to_709, chromaticities = _space(spec, real, name, colorspace)
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
        lossless=format not in ("jpeg", "heic") and (format != "webp" or b"VP8 " not in head),
        formats=tuple(kinds[i] for i in chosen) if format == "openexr" else (),
        extra=extra,
        extra_names=tuple(names[i] for i in rest) if extra is not None else (),
        extra_formats=tuple(kinds[i] for i in rest) if extra is not None else (),
        data_window=data_window,
        display_window=display_window,
        layer=own,
        to_709=to_709,
        chromaticities=chromaticities,
    )


def _checked(path: str | os.PathLike[str], on_damage: str, layer: str | None = None, colorspace: str | None = None) -> Picture:
    try:
        return _load(path, on_damage, layer, colorspace)
    except UnicodeDecodeError as error:  # from names within the file
        raise AirlightError(f"{os.fsdecode(path)}: is damaged (names that are not UTF-8); copy or export it again") from error


def read_image(path: str | os.PathLike[str], on_damage: str = "error", layer: str | None = None, colorspace: str | None = None) -> Picture:
    """Read a picture: PNG, JPEG, TIFF, WebP, EXR, HDR (and BMP, GIF, PNM, JPEG XL, JPEG 2000), upright.

    `on_damage` says what to do with a damaged file: "error", "warn" (use what there is, with a warning) or "ignore".
    layer: of an EXR, instead of its R G B A. colorspace: what the floats are in, instead of what the file says (see `spaces.by_name`).
    NaN and Inf are mended (`repair`). Raises AirlightError for anything that is no usable picture; warns with AirlightWarning.
    """
    picture = _checked(path, on_damage, layer, colorspace)
    if picture.codes.dtype.kind == "f":
        picture.codes = repair(picture.codes, picture.path)
        if picture.alpha is not None:
            picture.alpha = alpha_of(picture.codes[..., -1])
    return picture


def read_mask(path: str | os.PathLike[str], on_damage: str = "error", depth: bool = False) -> np.ndarray:
    """Read an image as data: (H, W) float32, the luminance of the code values (0..1 for integer files, EXR as it is), over black; depths
    are not multiplied by alpha.

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
    if picture.is_transparent and picture.alpha is not None and not picture.associated and not depth:
        value *= picture.alpha[..., None]
    return np.ascontiguousarray(value[..., 0] if value.shape[2] == 1 else value @ REC709_F32)


def _finite(value: np.ndarray, name: str) -> np.ndarray:
    infinite = np.isinf(value)
    if infinite.any():
        fine = value[np.isfinite(value)]
        if fine.size:
            value = np.where(infinite, np.where(value > 0, fine.max(), fine.min()), value)
    return repair(value, name)
