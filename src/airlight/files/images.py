"""Pictures from files: checked, upright, and with all that is needed to write them back."""

import functools
import os
from dataclasses import dataclass
from typing import Any

import numpy as np

from airlight.alpha import is_transparent, premultiply, straight_codes
from airlight.arrays import bounded, repair
from airlight.colour import Profile, alpha_of, decode_codes
from airlight.errors import AirlightError, warn
from airlight.files import channels, dpx, told, views
from airlight.files.coded import Coding
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
    alpha: (H, W) float32 in 0..1, or None. associated: codes are premultiplied by it. encoding: "srgb", "linear", or "profile" (see there).
    extra: further EXR channels (H, W, len(extra_names)) float32, kept for writing. bits: of the stored colour (16 for half).
    formats, extra_formats: how an EXR stores the picture's channels and the further ones, half or float.
    data_window, display_window: (x, y, width, height), `codes` fills the data window. spec: the file's metadata.
    layer: the EXR layer that was asked for, whose channels are replaced when written; "": R G B A are.
    to_709: (3, 3), the picture's linear RGB to linear Rec. 709; None where it is that. chromaticities: of the RGB, for writing.
    profile: codes to the picture's linear RGB, by its ICC profile `icc` or by its `coding`. gain_map: the file has an HDR part beside it.
    Floats are linear when read: then `profile` is the curve that a file of their kind is written with.
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
    coding: Coding | None = None
    gain_map: bool = False
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


def of_codes(codes: np.ndarray, name: str) -> Picture:
    """Wrap an array (H, W, C) as a picture of no file: sRGB codes, or floats of premultiplied light; of 2 and 4 alpha is last."""
    real = codes.dtype.kind == "f"
    return Picture(
        codes=codes,
        channels=("R", "G", "B", "A")[: codes.shape[2]],
        alpha=alpha_of(codes[..., -1]) if codes.shape[2] in (2, 4) else None,
        encoding="linear" if real else "srgb",
        path=name,
        spec=None,
        format="png",
        bits=codes.dtype.itemsize * 8,
        associated=real,
    )


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


def _load(path: str | os.PathLike[str], on_damage: str, layer: str | None, colorspace: str | None, view: str | None) -> Picture:
    name = os.fsdecode(path)
    pixels, spec, format, head = decode(name, on_damage)
    orientation = spec.get_int_attribute("Orientation", 1)
    orientation = orientation if 1 <= orientation <= 8 else 1
    data_window, display_window = _turn_header(spec, orientation)
    pixels = upright(pixels, orientation)

    space = spec.get_string_attribute("jpeg:ColorSpace") + spec.get_string_attribute("tiff:ColorSpace")
    kind = "CMYK" if "CMYK" in space or "YCbCrK" in space else "Lab" if "LAB" in space.upper() else ""
    if kind:
        warn(f"{name}: is {kind} and was converted to RGB plainly; convert it to RGB yourself for true colours", 4)

    names = list(spec.channelnames)
    if format == "openexr":
        pixels, names = channels.without_chroma(pixels, names, told.numbers(spec))
    kinds = [str(kind) for kind in spec.channelformats] or [str(spec.format)] * len(names)
    usable = [format != "openexr" or kind != "uint" for kind in kinds]
    if not any(usable):
        raise AirlightError(f"{name}: holds only identifiers, no colours; choose a picture with R, G, B")
    found = channels.layers(names, spec.alpha_channel, usable)
    if layer is not None and format != "openexr":
        raise AirlightError(f"{name}: --input-layer chooses among the layers of an EXR, which this is not; leave it out")
    if format == "openexr" or view is not None:
        layer = views.layer_of(spec, view, layer, name)
    own = channels.named(layer, found, name) if layer is not None else ""
    stand_in = channels.stands_in(found, name) if layer is None else own
    chosen = found[stand_in] if stand_in is not None else [next(i for i, fine in enumerate(usable) if fine)]
    codes = pixels if chosen == list(range(len(names))) else np.ascontiguousarray(pixels[..., chosen])
    real = codes.dtype.kind == "f"
    has_alpha = len(chosen) in (2, 4)

    # R G B A (or Y A), or the layer that was asked for, are replaced when written; a layer that stood in for them is kept as well.
    replaced = stand_in == own
    view_of = functools.partial(views.of_name, spec)
    made = [name.startswith("airlight.") and view_of(name) == view_of(layer or "") for name in names]  # by an earlier run
    rest = [i for i in range(len(names)) if usable[i] and not (replaced and i in chosen) and not made[i]]
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
    if format in dpx.FORMATS:
        dpx.settle(spec, format, name, head, colorspace)
        colours = told.Told(profile=None if real else dpx.curve_of(spec))
        colours.linear = colours.profile is None
    else:
        colours = told.read(spec, format, name, codes, head, colorspace)
    return Picture(
        codes=codes,
        channels=tuple(names[i] for i in chosen),
        alpha=alpha_of(codes[..., -1]) if has_alpha else None,
        encoding="linear" if colours.linear else "profile" if colours.profile is not None else "srgb",
        path=name,
        spec=spec,
        format=format,
        bits=codes.dtype.itemsize * 8 if not real else 16 if kinds[chosen[0]] == "half" else 32,
        icc=colours.icc,
        profile=colours.profile,
        coding=colours.coding,
        gain_map=colours.gain_map,
        associated=associated,
        lossless=format not in ("jpeg", "heic", "avif") and (format != "webp" or b"VP8 " not in head),
        formats=tuple(kinds[i] for i in chosen) if format == "openexr" else (),
        extra=extra,
        extra_names=tuple(names[i] for i in rest) if extra is not None else (),
        extra_formats=tuple(kinds[i] for i in rest) if extra is not None else (),
        data_window=data_window,
        display_window=display_window,
        layer=own,
        to_709=colours.to_709,
        chromaticities=colours.chromaticities,
    )


def _checked(
    path: str | os.PathLike[str], on_damage: str, layer: str | None = None, colorspace: str | None = None, view: str | None = None
) -> Picture:
    try:
        return _load(path, on_damage, layer, colorspace, view)
    except UnicodeDecodeError as error:  # from names within the file
        raise AirlightError(f"{os.fsdecode(path)}: is damaged (names that are not UTF-8); copy or export it again") from error


def read_image(
    path: str | os.PathLike[str],
    on_damage: str = "error",
    layer: str | None = None,
    colorspace: str | None = None,
    view: str | None = None,
) -> Picture:
    """Read a picture: PNG, JPEG, TIFF, WebP, EXR, HDR, DPX, JPEG XL, AVIF (and Cineon, BMP, GIF, PNM, JPEG 2000), upright.

    `on_damage` says what to do with a damaged file: "error", "warn" (use what there is, with a warning) or "ignore".
    layer: of an EXR, instead of its R G B A. colorspace: what the floats are in, instead of what the file says (see `spaces.by_name`).
    view: of a stereo EXR, instead of its first.
    NaN and Inf are mended (`repair`). Raises AirlightError for anything that is no usable picture; warns with AirlightWarning.
    """
    picture = _checked(path, on_damage, layer, colorspace, view)
    if picture.codes.dtype.kind == "f":
        picture.codes = bounded(repair(picture.codes, picture.path), picture.path)
        if picture.profile is not None and picture.codes.shape[2] >= 3:
            colour = np.ascontiguousarray(picture.codes[..., :3])
            picture.profile.decode(colour)
            picture.codes[..., :3] = colour
        if picture.alpha is not None:
            picture.alpha = alpha_of(picture.codes[..., -1])
    return picture


def read_mask(path: str | os.PathLike[str], on_damage: str = "error", depth: bool = False, view: str | None = None) -> np.ndarray:
    """Read an image as data: (H, W) float32, the luminance of the code values (0..1 for integer files, EXR as it is), over black; depths
    are not multiplied by alpha.

    With `depth` an EXR's channel Z (or depth.Z) is taken where there is one; infinite depths become the largest finite one.
    view: of a stereo EXR that has it, instead of its first.
    """
    try:
        picture = _checked(path, on_damage, view=view)
    except AirlightError:
        if view is None:
            raise
        picture, view = _checked(path, on_damage), None
    if depth and picture.extra is not None:
        plain = ("Z", "DEPTH.Z", "DEPTH")
        wanted = [name for name in plain if view is None or view == views.views_of(picture.spec)[0]]
        wanted = wanted or [views.in_view(name, str(view)).upper() for name in plain]
        for i, name in enumerate(picture.extra_names):
            if name.upper() in wanted:
                return finite(picture.extra[..., i : i + 1], picture.path)[..., 0]
    codes = picture.colour_codes
    value = codes.astype(np.float32)
    if codes.dtype.kind == "f":
        value = finite(value, picture.path)
    else:
        value /= np.float32(np.iinfo(codes.dtype).max)
    if picture.is_transparent and picture.alpha is not None and not picture.associated and not depth:
        value *= picture.alpha[..., None]
    return np.ascontiguousarray(value[..., 0] if value.shape[2] == 1 else value @ REC709_F32)


def finite(value: np.ndarray, name: str) -> np.ndarray:
    """Mend values: infinite ones become the largest, or the least, that are finite; NaN as `repair`. name: of the file, for messages."""
    infinite = np.isinf(value)
    if infinite.any():
        fine = value[np.isfinite(value)]
        if fine.size:
            value = np.where(infinite, np.where(value > 0, fine.max(), fine.min()), value)
    return bounded(repair(value, name), name)
