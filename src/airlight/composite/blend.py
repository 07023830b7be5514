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
SCREEN_LIMIT = 0.9911  # screen's limit: code 254 of 255, so that nothing clips which did not
AUTO_MIX_LUMINANCE = 0.035  # mean luminance of a layer from which the automatic mix takes less of it


@dataclass(frozen=True)
class CompositeSettings:
    """Holds a Composite with its `auto` resolved for an output. mix, peak and ramp None: by layer and picture, see `auto_levels_of`."""

    blend: str
    mix: float | None
    haze_floor: float  # share of the peak
    adapt: float = 0.0
    peak: float | None = None  # of the layer's luminance
    ramp: Ramp | None = None  # of the composited picture, where it is adapted


def resolve(options: Composite, float_output: bool) -> CompositeSettings:
    """Resolve what is unset: for float outputs add, all of the layer, no haze taken away; for 8 and 16 bit screen, `auto_levels`, VEIL."""
    blend = options.blend if options.blend != "auto" else ("add" if float_output or options.adapt else "screen")
    veil = options.veil if options.veil is not None else (0.0 if float_output else VEIL)
    return CompositeSettings(blend, options.mix if options.mix is not None or not float_output else 1.0, veil, options.adapt)


def subtract_haze(layer: FloatArray, luminance: FloatArray, peak: float, veil: float) -> FloatArray:
    """Take the faint even haze from a layer: times t / (t + veil^4), t = (luminance / peak)^4. The shafts stay."""
    if veil == 0 or peak == 0:
        return layer
    t = np.square(np.square(np.minimum(luminance / np.float32(max(peak, 1e-30)), np.float32(1e4))))
    return layer * (t / np.maximum(t + np.float32(veil**4), np.float32(1e-30))).reshape(t.shape + (1,) * (layer.ndim - t.ndim))


def sample_step(width: int, height: int) -> int:
    """Choose a step between rows and columns of a layer such that some 100,000 pixels are `auto_levels`."""
    return max(1, int(np.sqrt(width * height / 1e5)))


def auto_levels(settings: CompositeSettings, luminances: FloatArray, cover: float = AUTO_MIX_LUMINANCE) -> CompositeSettings:
    """Measure what settings leave open by a layer's luminances: peak, their 99.9th percentile (0 where no haze is taken away);
    mix, as much as keeps their mean within cover, at most 1."""
    peak, mix = settings.peak, settings.mix
    if peak is None:
        peak = float(np.percentile(luminances, 99.9)) if settings.haze_floor else 0.0
    if mix is None:
        mean = float(subtract_haze(luminances, luminances, peak, settings.haze_floor).mean())
        mix = min(1.0, cover / mean) if mean > 0 else 1.0
    return dataclasses.replace(settings, peak=peak, mix=mix)


def auto_levels_of(
    image: FloatArray, layer: FloatArray, settings: CompositeSettings, luminance: FloatArray = REC709_F32
) -> CompositeSettings:
    """Measure a layer and its picture, both (H, W, 3), as `auto_levels`, with the ramp that adapts them; luminance: (3,) weights of their
    RGB."""
    step = sample_step(*layer.shape[1::-1])
    few, lit = image[::step, ::step], layer[::step, ::step]
    cover = AUTO_MIX_LUMINANCE  # of a picture at its own level, which adapt finds
    if settings.adapt and settings.mix is None:
        cover *= adapt.MIDDLE_GREY / adapt.measure_ramp(few @ luminance).scale
    settings = auto_levels(settings, lit @ luminance, cover)
    if settings.adapt and settings.ramp is None:
        composited = np.add(few, _put(few, lit, settings, luminance), dtype=np.float32)
        settings = dataclasses.replace(settings, ramp=adapt.measure_ramp(composited @ luminance))
    return settings


def _put(image: FloatArray, layer: FloatArray, settings: CompositeSettings, luminance: FloatArray) -> FloatArray:
    """Compute what measured settings add to the picture."""
    if settings.haze_floor:
        layer = subtract_haze(layer, layer @ luminance, settings.peak or 0.0, settings.haze_floor)
    if settings.mix != 1:
        layer = layer * np.float32(settings.mix)
    return np.maximum(np.float32(SCREEN_LIMIT) - image, 0) * (layer / (1 + layer)) if settings.blend == "screen" else layer


def blend(
    image: FloatArray, layer: FloatArray, settings: CompositeSettings, luminance: FloatArray = REC709_F32
) -> tuple[FloatArray, FloatArray]:
    """Put the layer on the picture: (picture, layer as it was added), both (H, W, 3) float32. The identity where the layer is zero.

    add: a + b. screen: a + max(w - a, 0) b / (1 + b), which never passes w, just below white, and never darkens.
    luminance: (3,) weights of the luminance of their RGB. With adapt the picture is then adapted, all of it; the layer stays as added.
    """
    out, added = np.empty_like(image), np.empty_like(layer)
    settings = auto_levels_of(image, layer, settings, luminance)

    def rows(first: int, last: int) -> None:
        a = image[first:last]
        added[first:last] = _put(a, layer[first:last], settings, luminance)
        np.add(a, added[first:last], out=out[first:last])

    by_rows(rows, image.shape[0])
    if settings.ramp is not None:
        adapt.adapt(out, settings.ramp, settings.adapt, luminance)
    return out, added
