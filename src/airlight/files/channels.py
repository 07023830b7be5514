"""Layers of an EXR by their channels' names, in the spellings of renderers; luminance and chroma made R, G, B."""

import contextlib
import re
from collections.abc import Sequence

import numpy as np

from airlight.errors import AirlightError, warn
from airlight.files import spaces
from airlight.messages import nearest

COLOURS = {"r": "R", "red": "R", "g": "G", "green": "G", "b": "B", "blue": "B", "a": "A", "alpha": "A", "y": "Y"}
# Last parts of the names that renderers give to the picture itself: Blender, Arnold, V-Ray, RenderMan, Houdini, Unreal, LuxCore, Modo.
BEAUTY = (
    *("combined", "beauty", "rgba", "rgb", "rgb_color", "ci", "c", "finalimage", "final color", "final_color", "finalcolor"),
    *("rgb_imagepipeline", "rgba_imagepipeline", "color", "colour", "main", "composite", "effectsresult", "<root>", "root"),
)
_UNDOTTED = re.compile(r"(.+)[_:/](r|g|b|a|red|green|blue|alpha)", re.IGNORECASE)


def split(name: str) -> tuple[str, str]:
    """Split a channel's name into its layer, "" for none, and R, G, B, A, Y where it is one of these, else its last part in capitals.

    Blender's ViewLayer.Combined.R is red of ViewLayer.Combined.
    """
    layer, _, last = name.rpartition(".")
    undotted = _UNDOTTED.fullmatch(name) if not layer else None
    if undotted:
        layer, last = undotted.groups()
    return layer, COLOURS.get(last.lower(), last.upper())


def legible(text: str) -> str:
    """Read text as Latin-1 that is not UTF-8, as older programs write it: OpenImageIO gives its bytes as lone surrogates, and takes none
    back."""
    return text.encode(errors="surrogateescape").decode("latin-1") if re.search("[\ud800-\udfff]", text) else text


def layers(names: Sequence[str], alpha_channel: int, usable: Sequence[bool]) -> dict[str, list[int]]:
    """Find the layers that hold a picture, "" the one without a name: the indices of their R G B (A), or Y (A); those of colour first.

    alpha_channel: index of the alpha of the layer without a name, as the file says; less than 0 for none.
    """
    if not 0 <= alpha_channel < len(names) or not usable[alpha_channel]:  # OpenImageIO counts one too far in GIFs
        alpha_channel = -1
    if alpha_channel >= 0 and split(names[alpha_channel])[0]:  # that of a Cryptomatte or another layer, OpenImageIO's guess
        alpha_channel = -1
    places: dict[str, dict[str, int]] = {}
    for i, name in enumerate(names):
        layer, kind = split(name)
        if usable[i] and layer.partition(".")[0] != "airlight":
            places.setdefault(layer, {}).setdefault(kind, i)
    found: dict[str, list[int]] = {}
    for colours in ("RGB", "Y"):
        for layer, place in places.items():
            vector = colours == "Y" and "X" in place  # such as a normal's y
            if layer not in found and not vector and all(c in place for c in colours):
                alpha = place.get("A", alpha_channel if layer == "" else -1)
                found[layer] = [place[c] for c in colours] + ([alpha] if alpha >= 0 else [])
    return found


def named(layer: str, found: dict[str, list[int]], path: str) -> str:
    """Find the layer that is meant by what the user wrote; `rgba` is the one without a name."""
    if layer in found:
        return layer
    if layer.lower() == "rgba" and "" in found:
        return ""
    names = [name or "rgba" for name in found]
    same = [name for name in found if layer.lower() in (name.lower(), name.lower().rpartition(".")[2])]
    if len(same) == 1:
        return same[0]
    raise AirlightError(f"{path}: has no layer {layer!r}{nearest(layer, names)} (it has {', '.join(names) or 'none with R, G, B'})")


def stands_in(found: dict[str, list[int]], path: str) -> str | None:
    """Choose a layer where the user named none: the one without a name, else the beauty by its usual names, else the first; a choice
    between several is told."""
    if "" in found or not found:
        return "" if "" in found else None
    last = {layer: layer.rpartition(".")[2].lower() for layer in found}
    beauty = next((same for name in BEAUTY if (same := [layer for layer in found if last[layer] == name])), list(found))
    composite = [layer for layer in beauty if layer.lower().startswith("composite.")]  # Blender's own sum of all
    chosen = (composite or beauty)[0]
    if len(beauty) > 1 and not composite:
        others = ", ".join(layer for layer in found if layer != chosen)
        warn(f"{path}: has no channels R, G, B without a layer; {chosen} is used, --input-layer chooses another ({others[:100]})", 6)
    return chosen


def without_chroma(pixels: np.ndarray, names: Sequence[str], chromaticities: Sequence[float] | None) -> tuple[np.ndarray, list[str]]:
    """Make R, G, B of Y, RY, BY in all layers: (H, W, C) and names (C,), the same where there are none.

    Source: Technical Introduction to OpenEXR, "Luminance/Chroma Images": RY = (R - Y) / Y, BY = (B - Y) / Y.
    """
    names = list(names)
    for y in [name for name in names if name.rpartition(".")[2] == "Y"]:
        three = [y, *(f"{y[:-1]}{chroma}" for chroma in ("RY", "BY"))]
        if not all(name in names for name in three):
            continue
        luminance, red, blue = (pixels[..., names.index(name)].astype(np.float32) for name in three)
        weights = _luminance(chromaticities)
        with np.errstate(all="ignore"):  # what is not finite is mended later
            red, blue = (red + 1) * luminance, (blue + 1) * luminance
            green = (luminance - weights[0] * red - weights[2] * blue) / weights[1]
        pixels = pixels.astype(np.float32)
        for name, letter, values in zip(three, "RGB", (red, green, blue), strict=True):
            pixels[..., names.index(name)] = values
            names[names.index(name)] = y[:-1] + letter
    return pixels, names


def _luminance(chromaticities: Sequence[float] | None) -> np.ndarray:
    """Derive the weights of luminance (3,) of a linear RGB, Rec. 709 where its numbers are none or make no sense."""
    for numbers in (chromaticities or (), spaces.CHROMATICITIES[0]):
        with contextlib.suppress(ValueError, IndexError, ZeroDivisionError):
            x, y = numbers[6:8]
            return np.asarray(spaces.to_xyz(numbers, np.array([x / y, 1, (1 - x - y) / y]))[1])
    raise AssertionError("Rec. 709 has a luminance")
