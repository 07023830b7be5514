"""What a comparison on a picture shows."""

import msgspec

from airlight.compare.measure import DISC, Comparison, Row
from airlight.compare.shown import Shown, ShownRow, percent
from airlight.parameters import Parameters


def limit(p: Parameters) -> str:
    """What p converges to: D = 0.97, lambda = 2.02, normalization listing."""
    changed = [f"{name} {getattr(p, name)}" for name in ("normalization", "border") if getattr(p, name) != _default(p, name)]
    return ", ".join([f"D = {p.density:g}, lambda = {p.lam:.3g}", *changed])


def _default(p: Parameters, name: str) -> object:
    return next(field.default for field in msgspec.structs.fields(p) if field.name == name)


def figures(row: Row) -> tuple[str, str, str, str]:
    """Error, 99th percentile, maximum, cost."""
    return percent(row.rmse), percent(row.p99), percent(row.worst), f"{row.copies:.1f} copies ({row.ms:.1f} ms)"


def notes(result: Comparison, amplify: float) -> list[str]:
    """How the figures were got, a sentence each."""
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


def shown(result: Comparison, amplify: float) -> Shown:
    """amplify: factor of the differences."""
    differ = len({limit(row.parameters) for row in result.rows}) > 1
    rows = []
    for row in result.rows:
        error, p99, worst, cost = figures(row)
        cells = {"error (rmse)": error, "99 %": p99, "max": worst, "copies": f"{row.copies:.1f}", "ms": f"{row.ms:.1f}"}
        pictures = [("with shafts", row.shown), (f"difference × {amplify:g}: error {error}, max {worst}", amplify * row.difference)]
        lines = [f"error {error}, 99 % {p99}, max {worst}", cost]
        faint = f"limit: {limit(row.parameters)}" if differ else ""
        rows.append(
            ShownRow(row.variant.name, row.variant.text, cells | {"converges to": limit(row.parameters)}, lines, pictures, faint)
        )
    return Shown(rows, notes(result, amplify), result.before)
