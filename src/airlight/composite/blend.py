"""Putting the layer on the picture, in scene-linear light."""

import dataclasses
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from airlight.composite import adapt
from airlight.composite.adapt import Ramp
from airlight.luminance import REC709_F32
from airlight.options import Composite
from airlight.options.composite import VEIL
from airlight.planes import by_rows

FloatArray = npt.NDArray[np.float32]
WHITE = 0.9911  # screen's limit: code 254 of 255, so that nothing clips which did not
COVER = 0.035  # mean luminance of a layer from which the automatic mix takes less of it


@dataclass(frozen=True)
class Rule:
    """Holds a Composite with its `auto` resolved for an output. mix, peak and ramp None: by layer and picture, see `measured_on`."""

    blend: str
    mix: float | None
    veil: float
    adapt: float = 0.0
    peak: float | None = None  # of the layer's luminance
    ramp: Ramp | None = None  # of the composited picture, where it is adapted


def resolve(options: Composite, float_output: bool) -> Rule:
    """Resolve what is unset: for float outputs add, all of the layer, no haze taken away; for 8 and 16 bit screen, `measured`, VEIL."""
    blend = options.blend if options.blend != "auto" else ("add" if float_output or options.adapt else "screen")
    veil = options.veil if options.veil is not None else (0.0 if float_output else VEIL)
    return Rule(blend, options.mix if options.mix is not None or not float_output else 1.0, veil, options.adapt)


def lift_veil(layer: FloatArray, luminance: FloatArray, peak: float, veil: float) -> FloatArray:
    """Take the faint even haze from a layer: times t / (t + veil^4), t = (luminance / peak)^4. The shafts stay."""
    if veil == 0 or peak == 0:
        return layer
    t = np.square(np.square(np.minimum(luminance / np.float32(max(peak, 1e-30)), np.float32(1e4))))
    return layer * (t / np.maximum(t + np.float32(veil**4), np.float32(1e-30))).reshape(t.shape + (1,) * (layer.ndim - t.ndim))


def sample_step(width: int, height: int) -> int:
    """Choose a step between rows and columns of a layer such that some 100,000 pixels are `measured`."""
    return max(1, int(np.sqrt(width * height / 1e5)))


def measured(rule: Rule, luminances: FloatArray, cover: float = COVER) -> Rule:
    """Measure what a rule leaves open by a layer's luminances: peak, their 99.9th percentile (0 where no haze is taken away);
    mix, as much as keeps their mean within cover, at most 1."""
    peak, mix = rule.peak, rule.mix
    if peak is None:
        peak = float(np.percentile(luminances, 99.9)) if rule.veil else 0.0
    if mix is None:
        mean = float(lift_veil(luminances, luminances, peak, rule.veil).mean())
        mix = min(1.0, cover / mean) if mean > 0 else 1.0
    return dataclasses.replace(rule, peak=peak, mix=mix)


def measured_on(image: FloatArray, layer: FloatArray, rule: Rule, luminance: FloatArray = REC709_F32) -> Rule:
    """Measure a layer and its picture, both (H, W, 3), as `measured`, with the ramp that adapts them; luminance: (3,) weights of their
    RGB."""
    step = sample_step(*layer.shape[1::-1])
    few, lit = image[::step, ::step], layer[::step, ::step]
    cover = COVER  # of a picture at its own level, which adapt finds
    if rule.adapt and rule.mix is None:
        cover *= adapt.MIDDLE / adapt.measured(few @ luminance).scale
    rule = measured(rule, lit @ luminance, cover)
    if rule.adapt and rule.ramp is None:
        rule = dataclasses.replace(rule, ramp=adapt.measured(np.add(few, _put(few, lit, rule, luminance), dtype=np.float32) @ luminance))
    return rule


def _put(image: FloatArray, layer: FloatArray, rule: Rule, luminance: FloatArray) -> FloatArray:
    """Compute what a measured rule adds to the picture."""
    if rule.veil:
        layer = lift_veil(layer, layer @ luminance, rule.peak or 0.0, rule.veil)
    if rule.mix != 1:
        layer = layer * np.float32(rule.mix)
    return np.maximum(np.float32(WHITE) - image, 0) * (layer / (1 + layer)) if rule.blend == "screen" else layer


def blend(image: FloatArray, layer: FloatArray, rule: Rule, luminance: FloatArray = REC709_F32) -> tuple[FloatArray, FloatArray]:
    """Put the layer on the picture: (picture, layer as it was added), both (H, W, 3) float32. The identity where the layer is zero.

    add: a + b. screen: a + max(w - a, 0) b / (1 + b), which never passes w, just below white, and never darkens.
    luminance: (3,) weights of the luminance of their RGB. With adapt the picture is then adapted, all of it; the layer stays as added.
    """
    out, added = np.empty_like(image), np.empty_like(layer)
    rule = measured_on(image, layer, rule, luminance)

    def rows(first: int, last: int) -> None:
        a = image[first:last]
        added[first:last] = _put(a, layer[first:last], rule, luminance)
        np.add(a, added[first:last], out=out[first:last])

    by_rows(rows, image.shape[0])
    if rule.ramp is not None:
        adapt.adapt(out, rule.ramp, rule.adapt, luminance)
    return out, added
