"""Putting the layer on the picture, in scene-linear light."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from airlight.files.colour import by_rows
from airlight.parameters import Composite

FloatArray = npt.NDArray[np.float32]
REC709 = np.array([0.2126, 0.7152, 0.0722], np.float32)
VEIL = 0.2  # for 8 and 16 bit: measured on photographs, the darkest pixels outside the shafts stay within 2 codes


@dataclass(frozen=True)
class Rule:
    """A Composite with its `auto` resolved for an output."""

    blend: str
    mix: float
    veil: float


def resolve(options: Composite, float_output: bool) -> Rule:
    """auto: add, and no veil taken away, for float outputs; screen and a veil of 0.2 for 8 and 16 bit."""
    blend = options.blend if options.blend != "auto" else ("add" if float_output else "screen")
    veil = options.veil if options.veil is not None else (0.0 if float_output else VEIL)
    return Rule(blend, options.mix, veil)


def lift_veil(layer: FloatArray, peak: float, veil: float) -> FloatArray:
    """layer t / (t + veil^4) with t = (luminance / peak)^4: the faint even haze far from the light goes, the shafts stay."""
    if veil == 0 or peak == 0:
        return layer
    t = np.square(np.square((layer @ REC709) / np.float32(peak)))
    return layer * (t / (t + np.float32(veil**4)))[..., None]


def peak_step(width: int, height: int) -> int:
    """Every how many-th row and column count for the peak, so that some 100,000 pixels do."""
    return max(1, int(np.sqrt(width * height / 1e5)))


def peak_of(luminances: FloatArray) -> float:
    """The 99.9th percentile."""
    return float(np.percentile(luminances, 99.9))


def blend(image: FloatArray, layer: FloatArray, rule: Rule) -> tuple[FloatArray, FloatArray]:
    """The picture and the layer as it was added, both (H, W, 3) float32. The identity where the layer is zero.

    add: a + b. screen: a + max(1 - a, 0) b / (1 + b), which never passes white and never darkens.
    """
    out, added = np.empty_like(image), np.empty_like(layer)
    step = peak_step(*layer.shape[1::-1])
    peak = peak_of(layer[::step, ::step] @ REC709) if rule.veil else 0.0

    def rows(first: int, last: int) -> None:
        a, b = image[first:last], lift_veil(layer[first:last], peak, rule.veil)
        if rule.mix != 1:
            b = b * np.float32(rule.mix)
        if rule.blend == "screen":
            b = np.maximum(1 - a, 0) * (b / (1 + b))
        added[first:last] = b
        np.add(a, b, out=out[first:last])

    by_rows(rows, image.shape[0])
    return out, added
