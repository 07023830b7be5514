"""What the sheet and the page say alike."""

import math

import msgspec

from airlight.compare.measure import DISC, Comparison, Row
from airlight.parameters import Parameters


def percent(share: float) -> str:
    """Two significant digits: 0.17 %, 15 %."""
    digits = -1 - math.floor(math.log10(share)) if share > 0 else 0
    return f"{100 * share:.{min(max(digits, 0), 4)}f} %"


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
