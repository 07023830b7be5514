"""The light in a scene's medium by each variant: its error against a reference that rasters nothing, and its cost by parts."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import msgspec
import numpy as np
import numpy.typing as npt

from airlight.bench.again import Again
from airlight.bench.measure import Passes
from airlight.compare.measure import fit
from airlight.compare.truth import Truth
from airlight.compare.variants import Variant
from airlight.errors import AirlightError
from airlight.gpu.timing import run_ms
from airlight.medium import Settled, settle
from airlight.parameters import Composite, Parameters

Array = npt.NDArray[Any]
EDGE = 0.05  # of the nearer distance: neighbours farther apart are an edge of depth
NEAR = 2  # pixels: nearer to such an edge nothing is measured
WORST = 0.01  # of the remaining pixels are left out, too


@dataclass
class Errors:
    """Of found - truth over the mean of truth, RGB values each by itself. bias: of the means, with its sign."""

    rmse: float
    bias: float
    p99: float
    worst: float


@dataclass
class Row:
    """A variant's figures. ms: of the march with its upsampling, of a method that works on the picture its source and sum; maps: of its
    shadow maps; rest: of planning and recording, and all else that is no pass. maps, rest: None where the device has no timestamps."""

    variant: Variant
    error: Errors  # by the measure, see `measured`
    whole: Errors  # at all pixels
    scale: float | None  # by which the layer was multiplied first; None: it is radiance as it is
    ms: float
    copies: float
    maps: float | None
    rest: float | None
    shown: Array  # (h, w, 3) the picture, linear
    layer: Array  # (h, w, 3) radiance
    truth: Array  # (h, w, 3) what it is measured against
    difference: Array  # (h, w) |layer - truth|, mean of RGB, over the mean


@dataclass
class Comparison:
    rows: list[Row]
    adapter: str
    copy_ms: float
    size: tuple[int, int]
    measured: float  # the part of the pixels that is not near an edge of depth
    reference: str  # what it is, in words
    before: Array  # (h, w, 3) the picture without light in its medium, linear
    runs: int


def measured(distance: Array) -> npt.NDArray[np.bool_]:
    """(H, W): the pixels farther than 2 px, in rows or columns, from an edge of the distance (H, W)."""
    edge = np.zeros(distance.shape, bool)
    for axis in (0, 1):
        a, b = (np.take(distance, np.arange(distance.shape[axis] - 1) + k, axis) for k in (0, 1))
        jump = np.abs(a - b) > EDGE * np.minimum(a, b)
        for k in (0, 1):
            index = [slice(None)] * 2
            index[axis] = slice(k, k - 1 or None)
            edge[tuple(index)] |= jump
    for axis in (0, 1):
        padded = np.pad(edge, [(NEAR, NEAR) if i == axis else (0, 0) for i in (0, 1)])
        edge = np.any([np.take(padded, np.arange(edge.shape[axis]) + k, axis) for k in range(2 * NEAR + 1)], axis=0)
    return ~edge


def errors(found: Array, truth: Array, keep: npt.NDArray[np.bool_] | None = None) -> Errors:
    """found, truth: (H, W, 3). keep: (H, W) pixels that count, and of these not the worst 1 %; None: all count."""
    off, true = (found - truth).reshape(-1, 3), truth.reshape(-1, 3)
    if keep is not None:
        off, true = off[keep.ravel()], true[keep.ravel()]
        size = (off**2).sum(axis=1)
        rank = np.argsort(size, kind="stable")[: len(size) - int(WORST * len(size))]
        off, true = off[rank], true[rank]
    mean = true.mean()
    gone = np.abs(off) / mean
    return Errors(float(np.sqrt(np.mean(gone**2))), float(off.mean() / mean), float(np.percentile(gone, 99)), float(gone.max()))


def best_scale(found: Array, truth: Array, keep: npt.NDArray[np.bool_]) -> float:
    """The factor of found (H, W, 3) with the least rmse at the pixels that count."""
    a, b = found[keep], truth[keep]
    return float((a * b).sum() / max((a * a).sum(), 1e-300))


def air(studio: Any, v: Variant) -> Settled:
    return settle(v.medium, v.march, v.parameters.quality, studio.shafts.radius)


def compare(
    studio: Any,
    variants: Sequence[Variant],
    reference: str = "tracer",
    *,
    time: float = 0.0,
    turn: float = 0.0,
    runs: int = 5,
    box: int = 960,
    say: Callable[[Row], None] = lambda row: None,
    left_out: Callable[[str], None] = lambda reason: None,
) -> Comparison:
    """Measure the variants in what a `scenes.offline.Studio` films with one sample a pixel; say gets each row when it is complete.

    reference: see `Truth`; a variant of another medium is measured against that medium's light. What a scene does not allow is left out,
    and left_out told why. Pictures fit into box x box pixels. Raises AirlightError where nothing is left, or the reference cannot be had.
    """
    shafts, shot, name = studio.shafts, studio.shot, studio.stage.name
    shafts.parameters, shafts.composite = Parameters(), Composite(mix=0.0)
    again = Again(studio, time, turn)
    bare = studio.frame(time, turn, depth=True)
    able, frames = [], []
    for v in variants:
        _take(shafts, v)
        try:
            frames.append(studio.frame(time, turn, depth=v.in_scene.depth_aware > 0, layer=True))
            able.append(v)
        except AirlightError as error:
            left_out(f"{v.name}: {error}")
    if not able:
        raise AirlightError(f"{name}: none of the variants goes with this scene; name others with --variant")
    truth = Truth(studio, reference, time, turn)
    lights = {v.medium: truth.layer(v, air(studio, v)) for v in able}
    if not all(light.mean() > 0 for light in lights.values()):
        raise AirlightError(f"{name}: no light reaches the medium that is seen, so there is nothing to compare")

    device = again.device
    copy = Passes(device, *(device.texture(shot.width, shot.height, "rgba16float") for _ in range(2))).copy()
    copy_ms, costs = _costs(again, copy, able, runs)
    rows, parts = [], []
    for v, frame, (ms, maps, rest) in zip(able, frames, costs, strict=True):
        true, layer = lights[v.medium], frame.shafts().astype(np.float64)
        keep = measured(np.minimum(bare.distance(), air(studio, v).max_distance))
        if not keep.any():
            raise AirlightError(f"{name}: every pixel lies near an edge of depth; compare a larger picture")
        parts.append(keep.mean())
        scale = None if v.parameters.method == "march" else best_scale(layer, true, keep)
        layer *= 1.0 if scale is None else scale
        off = np.abs(layer - true).mean(axis=2) / true.mean()
        pictures = [fit(np.asarray(picture, np.float32), box) for picture in (frame.pixels(), layer, true, off)]
        rows.append(Row(v, errors(layer, true, keep), errors(layer, true), scale, ms, ms / copy_ms, maps, rest, *pictures))
        say(rows[-1])
    adapter = f"{device.name} ({device.info.get('backend_type')})"
    return Comparison(
        rows, adapter, copy_ms, (shot.width, shot.height), min(parts), truth.words, fit(bare.pixels(), box), runs
    )


def _take(shafts: Any, v: Variant) -> None:
    """Set what the variant says."""
    mixed = msgspec.structs.replace(v.composite, mix=1.0)
    shafts.parameters, shafts.composite, shafts.medium, shafts.march = v.parameters, mixed, v.medium, v.march
    shafts.in_scene = v.in_scene


def _costs(again: Again, copy: Any, variants: Sequence[Variant], runs: int) -> tuple[float, list[tuple[float, float | None, float | None]]]:
    """Median ms of a copy, and (march, shadow maps, rest) of each variant, interleaved."""
    copies: list[float] = []
    times: list[list[tuple[float, float, float]]] = [[] for _ in variants]
    timed = again.device.timestamps
    for turn in range(runs + 1):
        ms = run_ms(again.device, copy)
        copies += [ms] if turn else []
        for v, own in zip(variants, times, strict=True):
            _take(again.shafts, v)
            run_ms(again.device, again.record)  # what a change of variants makes anew
            wall, parts = again.once()
            maps = sum(ms for label, ms in parts.items() if label.startswith("shadow"))
            march = sum(ms for label, ms in parts.items() if label != "merge") - maps if timed else wall
            if turn:
                own.append((march, maps, wall - sum(parts.values())))
    found = []
    for own in times:
        march, maps, rest = (float(v) for v in np.median(own, axis=0))
        found.append((march, maps, max(rest, 0.0)) if timed else (march, None, None))
    return float(np.median(copies)), found
