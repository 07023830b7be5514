"""Writes what the sheet and the page say alike."""

import math
from typing import Any

import msgspec

from airlight.compare.measure import DISC
from airlight.compare.result import Comparison, PictureComparison, Row, SceneComparison, SceneRow
from airlight.compare.rule import EDGE, NEAR, WORST
from airlight.messages import number
from airlight.options import Parameters
from airlight.scatter.methods import METHODS, of_medium


def percent(share: float) -> str:
    """Write two significant digits: 0.17 %, 15 %, -0.03 %."""
    digits = -1 - math.floor(math.log10(abs(share))) if share else 0
    return f"{100 * share:.{min(max(digits, 0), 4)}f} %"


def limit(p: Parameters) -> str:
    """Write what p converges to: D = 0.97, lambda = 2.02, normalization listing."""
    changed = [f"{name} {getattr(p, name)}" for name in ("normalization", "border") if getattr(p, name) != _default(p, name)]
    return ", ".join([f"D = {p.density:g}, lambda = {p.lam:.3g}", *changed])


def _default(p: Parameters, name: str) -> object:
    return next(field.default for field in msgspec.structs.fields(p) if field.name == name)


def cost(row: Row) -> str:
    """Write a cost: `41.2 copies (57.3 ms: shadow maps 12.3, march 45)`."""
    parts = row.parts or [] if isinstance(row, SceneRow) else []
    listed = ", ".join(f"{name} {ms:.{0 if ms >= 100 else 1}f}" for name, ms in parts)
    return f"{row.copies:.1f} copies ({row.ms:.1f} ms{': ' if listed else ''}{listed})"


def figures(row: Row) -> tuple[str, str, str, str]:
    """Write error, 99th percentile, maximum, cost."""
    return percent(row.rmse), percent(row.p99), percent(row.worst), cost(row)


def fitted(row: SceneRow) -> str:
    """Write by what its light was multiplied: × 0.0123, or none where there is none; nothing for methods with units."""
    return "" if row.factor is None else f"× {number(row.factor, 3)}" if row.factor else "none"


def errors(row: Row) -> str:
    error, p99, worst, _ = figures(row)
    bias = f", bias {percent(row.bias)}" if isinstance(row, SceneRow) and row.bias is not None else ""
    factor = f", light {fitted(row)}" if isinstance(row, SceneRow) and row.factor is not None else ""
    return f"error {error}, 99 % {p99}, max {worst}{bias}{factor}"


def beside(result: Comparison) -> list[str]:
    """Write a further line for each row, where they differ: what it converges to."""
    if isinstance(result, PictureComparison):
        texts = [f"limit: {limit(row.parameters)}" for row in result.rows]
        return texts if len(set(texts)) > 1 else []
    return []


def table(result: Comparison) -> tuple[list[str], list[list[str]]]:
    """Write the heads of the columns, and the rows; the first column and the last are text."""
    heads, rows = ["variant", "error (rmse)", "99 %", "max"], []
    heads += ["copies", "ms", "converges to"] if isinstance(result, PictureComparison) else ["bias", "light", "copies", "ms", "of which"]
    for row in result.rows:
        more = [f"{row.copies:.1f}", f"{row.ms:.1f}"]
        if isinstance(row, SceneRow):
            bias = "" if row.bias is None else percent(row.bias)
            more = [bias, fitted(row), *more, ", ".join(f"{name} {ms:.1f}" for name, ms in row.parts or [])]
        else:
            more.append(limit(row.parameters))
        rows.append([row.variant.name, *figures(row)[:3], *more])
    return heads, rows


def notes(result: Comparison, amplify: float) -> list[str]:
    """Say how the figures were got, a sentence each."""
    return _of_scene(result, amplify) if isinstance(result, SceneComparison) else _of_picture(result, amplify)


def _of_picture(result: Any, amplify: float) -> list[str]:
    where, best = f"all {result.points:,} pixels", "the reference"
    if not result.everywhere:
        off = max(row.best_error for row in result.rows)
        where, best = f"{result.points:,} random pixels", f"epipolar final (off by {percent(off)} itself; its own difference is black)"
    own = max(row.reference_error for row in result.rows)
    return [
        f"Error: rmse of the shafts over their mean, against the converged float64 sum, at {where} outside a disc of {100 * DISC:g} % of "
        f"the width around the light; 99 %: of the values are off by less; max: by no more.",
        "Each against its own limit: a variant of other density, decay or normalization is measured against what it converges to itself.",
        f"The reference's own error is at most {percent(own)} (from half as many taps).",
        f"Cost: the time of the scattering over that of a one-tap copy ({result.copy_ms:.2f} ms), medians of interleaved runs on "
        f"{result.adapter}.",
        f"Difference: {amplify:g} × |shafts - best| over the mean, so that white is {percent(1 / amplify)} of it; best is {best}.",
    ]


def _of_scene(result: SceneComparison, amplify: float) -> list[str]:
    width, height = result.size
    pixels = width * height
    several = len(result.truths) > 1
    said: list[str] = []
    kept: dict[str, list[str]] = {}  # which variants' truths, by the share of pixels that are looked at
    for i, truth in enumerate(result.truths):
        of = ", ".join(row.variant.name for row in result.rows if row.truth == i)
        kept.setdefault(f"{100 * truth.kept / pixels:.0f} %", []).append(of)
        said.append(f"Truth{f' of {of}' if several else ''}: the light in the air, in-scattered radiance, {truth.about}.")
    shares = ", ".join(f"{share} ({', '.join(names)})" if len(kept) > 1 else share for share, names in kept.items())
    said.append(
        f"Error: rmse of the light in the air over its mean, at {shares} of the pixels: without those within {NEAR} of an edge of depth "
        f"(neighbours whose distances differ by over {100 * EDGE:g} %), and without the worst {100 * WORST:g} % of the rest. "
        "99 %: of the values are off by less; max: by no more; bias: the mean of what they are off by, with its sign; these with the worst."
    )
    if any(row.factor is not None for row in result.rows):
        unscaled = [m for m in of_medium() if any(row.variant.parameters.method == m and row.factor is not None for row in result.rows)]
        view = any(not METHODS[row.variant.parameters.method].lights_medium for row in result.rows)
        whose = " and ".join(["methods that work on the picture"] * view + unscaled)
        said.append(
            f"The light of {whose} has no units: it is compared times the one factor that fits best, by least squares at those pixels, "
            "which is named; the picture has it as it is."
            + "".join(f" Of {m} it is the light before its composite, {_of_light(m)}." for m in unscaled if METHODS[m].light_of_layer[1])
        )
    if all(row.parts is not None for row in result.rows):
        what = "the passes that make the light: shadow maps, and the march with its upsampling; of methods on the picture source and shafts"
    else:
        what = "the whole pass, since the device has no timestamps"
    said.append(f"Cost: {what}; over a one-tap copy of {width} × {height} ({result.copy_ms:.2f} ms); medians of runs on {result.adapter}.")
    said.append(f"Difference: {amplify:g} × |light - truth| over the mean of the truth, so that white is {percent(1 / amplify)} of it.")
    said.append(f"The light alone is shown with {number(result.white, 3)} as white.")
    return said


def _of_light(method: str) -> str:
    """Write a layer as made of its light: (2 light - 1) / 10 for a light of 5 layer + 0.5."""
    factor, offset = METHODS[method].light_of_layer
    return f"({1 / offset:g} light - 1) / {factor / offset:g}"
