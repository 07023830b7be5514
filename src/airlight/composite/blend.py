"""Putting the layer on the picture, in scene-linear light."""

import dataclasses
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from airlight.files.colour import by_rows
from airlight.parameters import VEIL, Composite

FloatArray = npt.NDArray[np.float32]
REC709 = np.array([0.2126, 0.7152, 0.0722], np.float32)
WHITE = 0.9911  # screen's limit: code 254 of 255, so that nothing clips which did not
COVER = 0.045  # mean luminance of a layer from which the automatic mix takes less of it


@dataclass(frozen=True)
class Rule:
    """A Composite with its `auto` resolved for an output. mix and peak None: by the layer, see `measured`."""

    blend: str
    mix: float | None
    veil: float
    peak: float | None = None  # of the layer's luminance


def resolve(options: Composite, float_output: bool) -> Rule:
    """What is unset, for float outputs: add, all of the layer, no veil taken away; for 8 and 16 bit: screen, `measured`, VEIL."""
    blend = options.blend if options.blend != "auto" else ("add" if float_output else "screen")
    veil = options.veil if options.veil is not None else (0.0 if float_output else VEIL)
    return Rule(blend, options.mix if options.mix is not None or not float_output else 1.0, veil)


def lift_veil(layer: FloatArray, luminance: FloatArray, peak: float, veil: float) -> FloatArray:
    """layer t / (t + veil^4) with t = (luminance / peak)^4: the faint even haze far from the light goes, the shafts stay."""
    if veil == 0 or peak == 0:
        return layer
    t = np.square(np.square(luminance / np.float32(peak)))
    return layer * (t / (t + np.float32(veil**4))).reshape(t.shape + (1,) * (layer.ndim - t.ndim))


def sample_step(width: int, height: int) -> int:
    """Every how many-th row and column of a layer is `measured`, so that some 100,000 pixels are."""
    return max(1, int(np.sqrt(width * height / 1e5)))


def measured(rule: Rule, luminances: FloatArray) -> Rule:
    """The rule for a layer of these luminances, with nothing left open: peak, their 99.9th percentile (0 where no veil is taken away);
    mix, as much as keeps their mean within COVER, at most 1."""
    peak, mix = rule.peak, rule.mix
    if peak is None:
        peak = float(np.percentile(luminances, 99.9)) if rule.veil else 0.0
    if mix is None:
        mean = float(lift_veil(luminances, luminances, peak, rule.veil).mean())
        mix = min(1.0, COVER / mean) if mean > 0 else 1.0
    return dataclasses.replace(rule, peak=peak, mix=mix)


def measured_on(layer: FloatArray, rule: Rule, luminance: FloatArray = REC709) -> Rule:
    """`measured` for a layer (H, W, 3); luminance: (3,) weights of its RGB."""
    step = sample_step(*layer.shape[1::-1])
    return measured(rule, layer[::step, ::step] @ luminance)


def blend(image: FloatArray, layer: FloatArray, rule: Rule, luminance: FloatArray = REC709) -> tuple[FloatArray, FloatArray]:
    """The picture and the layer as it was added, both (H, W, 3) float32. The identity where the layer is zero.

    add: a + b. screen: a + max(w - a, 0) b / (1 + b), which never passes w, just below white, and never darkens.
    luminance: (3,) weights of the luminance of their RGB.
    """
    out, added = np.empty_like(image), np.empty_like(layer)
    rule = measured_on(layer, rule, luminance)
    peak, mix = rule.peak or 0.0, rule.mix

    def rows(first: int, last: int) -> None:
        a, b = image[first:last], layer[first:last]
        b = lift_veil(b, b @ luminance, peak, rule.veil)
        if mix != 1:
            b = b * np.float32(mix)
        if rule.blend == "screen":
            b = np.maximum(np.float32(WHITE) - a, 0) * (b / (1 + b))
        added[first:last] = b
        np.add(a, b, out=out[first:last])

    by_rows(rows, image.shape[0])
    return out, added
