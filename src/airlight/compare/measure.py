"""On a picture, each variant's layer, its error against what it converges to, and its cost."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from airlight.bench.measure import Passes, _times
from airlight.compare.result import PictureComparison, PictureRow
from airlight.compare.variants import Variant, limit, limit_key, source_key
from airlight.composite.blend import blend, resolve
from airlight.errors import AirlightError
from airlight.files import Picture
from airlight.gpu.device import open_device
from airlight.gpu.timing import run_ms
from airlight.layers import gpu_inputs
from airlight.lights import ImageLight
from airlight.occlusion.automatic import auto_threshold
from airlight.options import Parameters
from airlight.progress import SILENT, Work
from airlight.reference import radial as reference
from airlight.scatter.render import PictureRenderer, emitted, plan

Array = npt.NDArray[Any]
POINTS = 4000  # random pixels at which the error is measured
DISC = 0.02  # of the width: nearer to a light, where shafts are a small part of what is seen, nothing is measured
LIMIT_DRAWINGS = 5.0  # variants that the converged sum takes as long as, for what is left
FEW = 1e7  # taps of the reference up to which it is evaluated at all pixels, some 10 s


@dataclass
class _Limit:
    """A target: the reference at the points, its mean and own error; the best layer (H, W, 3) there is, and its rmse."""

    truth: Array
    mean: float
    error: float
    best: Array
    best_error: float


def errors(found: Array, truth: Array) -> tuple[float, float, float]:
    """Measure rmse, 99th percentile and maximum of |found - truth|, over the mean of truth."""
    off = np.abs(found - truth) / truth.mean()
    return float(np.sqrt(np.mean(off**2))), float(np.percentile(off, 99)), float(off.max())


def fit(image: Array, box: int) -> Array:
    """Scale (H, W) or (H, W, C) float32 down, filtered, until both sides are at most `box`."""
    import OpenImageIO as oiio

    height, width = image.shape[:2]
    scale = min(1.0, box / max(height, width))
    if scale == 1.0:
        return image
    roi = oiio.ROI(0, max(1, round(width * scale)), 0, max(1, round(height * scale)))
    flat = np.ascontiguousarray(image.reshape(height, width, -1), np.float32)
    small = oiio.ImageBufAlgo.resize(oiio.ImageBuf(flat), filtername="box", roi=roi).get_pixels(oiio.FLOAT)
    return np.asarray(small).reshape(roi.height, roi.width, *image.shape[2:])


def _away(width: int, height: int, lights: Sequence[ImageLight]) -> Array:
    """List (n,) indices of the pixels outside the disc around each light."""
    y, x = np.ogrid[:height, :width]
    away = np.ones((height, width), bool)
    for light in lights:
        away &= np.hypot(x + 0.5 - light.position[0] * width, y + 0.5 - light.position[1] * height) > DISC * width
    return np.flatnonzero(away)


def compare(
    picture: Picture,
    lights: list[ImageLight],
    variants: Sequence[Variant],
    *,
    mask: Any = None,
    depth: Any = None,
    device: str | None = None,
    runs: int = 5,
    box: int = 960,
    say: Callable[[PictureRow], None] = lambda row: None,
    work: Work = SILENT,
) -> PictureComparison:
    """Measure the variants on a picture; say gets each row when it is complete, work what is done. Pictures fit into box x box pixels.

    Error: outside a disc of 2 % of the width around each light, at random pixels or, where that takes not too long, at all. Cost: the
    wall time of the scattering passes (without the source's, which is the same for all) over that of a one-tap copy, medians of
    interleaved runs. Raises AirlightError where there is nothing to compare, MachineError where there is no adapter.
    """
    gpu = open_device(device)
    integers = picture.codes.dtype.kind == "u"
    coarse = picture.linear(coarse=True) if integers else None
    parameters = [auto_threshold(v.parameters, coarse, lights) if integers else v.parameters for v in variants]
    pixels, planes = gpu_inputs(picture, parameters, mask, depth)
    height, width = pixels.shape[:2]
    at = _away(width, height, lights)
    if not at.size:
        raise AirlightError(f"{picture.path}: is too small, no pixel lies outside the disc around the light; compare on a larger picture")
    taps = max(reference.enough_taps(pixels.shape, light.position, p.density) for light in lights for p in parameters)
    everywhere = width * height * taps * len(lights) <= FEW
    if not everywhere and at.size > POINTS:
        at = np.sort(np.random.default_rng(7).choice(at, POINTS, replace=False))
    points = np.stack([(at % width + 0.5) / width, (at // width + 0.5) / height], axis=1)

    layer = gpu.texture(width, height, "rgba16float")
    sources: dict[Any, tuple[Any, float]] = {}

    def recorded(p: Parameters) -> tuple[Callable[[Any], None], float]:
        """Give what records the passes of p into the layer, and the factor in it."""
        if source_key(p) not in sources:
            sources[source_key(p)] = emitted(PictureRenderer(gpu, keep=0), pixels, p, **planes)
        source, scale = sources[source_key(p)]
        plans, _ = plan(gpu, (width, height), lights, p, source, layer)

        def record(encoder: Any) -> None:
            for step in plans:
                step.record(encoder)

        return record, scale

    def rendered(record: Callable[[Any], None], scale: float) -> Array:
        run_ms(gpu, record)
        half = np.frombuffer(gpu.read(layer, 8), np.float16).reshape(height, width, 4)
        return half[..., :3].astype(np.float32) / np.float32(scale)

    rgb = picture.linear()
    given: dict[str, Any] = {"alpha": picture.alpha, "depth": planes["depth"], "user_mask": planes["mask"], "luminance": picture.luminance}

    def limit_of(p: Parameters) -> _Limit:
        p = limit(p)
        taps = max(reference.enough_taps(rgb.shape, light.position, p.density) for light in lights)
        whole = reference.layer(rgb, lights, p, taps=taps, points=None if everywhere else points, **given)
        truth = whole.reshape(-1, 3)[at] if everywhere else whole
        mean = float(truth.mean())
        if not mean > 0:
            raise AirlightError(f"{picture.path}: nothing emits light, so there are no shafts to compare; lower --threshold")
        some = slice(None, None, max(1, len(points) // 1000))
        rough = reference.layer(rgb, lights, p, taps=taps // 2, points=points[some], **given)
        best = whole.astype(np.float32) if everywhere else rendered(*recorded(p))
        own = float(np.sqrt(np.mean((rough - truth[some]) ** 2))) / mean
        return _Limit(truth, mean, own, best, errors(best.reshape(-1, 3)[at], truth)[0])

    targets = len({limit_key(p) for p in parameters})
    work.total = len(variants) * 2 + targets * LIMIT_DRAWINGS
    work.part("timing", len(variants))
    records = [recorded(p) for p in parameters]
    copy = Passes(gpu, next(iter(sources.values()))[0], layer).copy()
    copy_times, *times = _times(gpu, [copy, *(record for record, _ in records)], runs)
    copy_ms = float(np.median(copy_times))

    limits: dict[Any, _Limit] = {}
    rows = []
    for v, p, record, spent in zip(variants, parameters, records, times, strict=True):
        key = limit_key(p)
        if key not in limits:
            work.part(f"the converged sum, {len(limits) + 1} of {targets}", LIMIT_DRAWINGS)
            limits[key] = limit_of(p)
        work.part(v.name, 1)
        target = limits[key]
        own = rendered(*record)
        ms = float(np.median(spent))
        off = np.abs(own - target.best).mean(axis=2) / np.float32(target.mean)
        shown = blend(rgb, own, resolve(v.composite, not integers))[0]
        wrong = errors(own.reshape(-1, 3)[at], target.truth)
        figures = (*wrong, ms, ms / copy_ms, fit(shown, box), fit(off, box))
        rows.append(PictureRow(v, *figures, p, target.error, target.best_error))
        say(rows[-1])
    return PictureComparison(rows, gpu.described, copy_ms, (width, height), len(at), everywhere, fit(rgb, box))
