"""What a comparison in a scene shows."""

import numpy as np

from airlight.compare.scenes import EDGE, NEAR, WORST, Comparison, Row
from airlight.compare.shown import Shown, ShownRow, percent

BRIGHT = 0.8  # linear: at which the 99th percentile of the reference is shown


def _ms(value: float | None) -> str:
    return "–" if value is None else f"{value:.1f}"


def line(row: Row) -> str:
    """A row in the terminal."""
    e = row.error
    cost = f"{row.copies:.1f} copies ({row.ms:.1f} ms)" + (f", shadow maps {row.maps:.1f} ms" if row.maps else "")
    scaled = "" if row.scale is None else f"  scaled by {row.scale:.3g}"
    return f"error {percent(e.rmse):>8}  bias {percent(e.bias):>8}  99 % {percent(e.p99):>8}  {cost}{scaled}"


def shown(result: Comparison, amplify: float) -> Shown:
    """amplify: factor of the differences."""
    bright = BRIGHT / max(float(np.percentile(result.rows[0].truth.max(axis=2), 99)), 1e-30)
    rows = []
    for row in result.rows:
        e, all = row.error, row.whole
        rmse, bias, p99, worst = (percent(v) for v in (e.rmse, e.bias, e.p99, e.worst))
        cells = {"error (rmse)": rmse, "bias": bias, "99 %": p99, "max": worst, "error, all pixels": percent(all.rmse)}
        cells |= {"bias, all pixels": percent(all.bias), "copies": f"{row.copies:.1f}", "ms": f"{row.ms:.1f}"}
        cells |= {"shadow maps, ms": _ms(row.maps), "set-up, ms": _ms(row.rest)}
        cells |= {"scaled by": "–" if row.scale is None else f"{row.scale:.3g}, not physical"}
        pictures = [
            ("with light in its medium", row.shown),
            (f"the light alone, × {bright:.3g}", bright * row.layer),
            (f"the reference, × {bright:.3g}", bright * row.truth),
            (f"difference × {amplify:g}: error {rmse}, bias {bias}", amplify * row.difference),
        ]
        cost = f"{row.copies:.1f} copies ({row.ms:.1f} ms); shadow maps {_ms(row.maps)} ms, set-up {_ms(row.rest)} ms"
        lines = [f"error {rmse}, bias {bias}, 99 % {p99}, max {worst}; at all pixels {percent(all.rmse)}", cost]
        faint = "" if row.scale is None else f"not physical: scaled by {row.scale:.3g} first"
        rows.append(ShownRow(row.variant.name, row.variant.text, cells, lines, pictures, faint))
    return Shown(rows, notes(result, amplify), result.before)


def notes(result: Comparison, amplify: float) -> list[str]:
    """How the figures were got, a sentence each."""
    found = [
        f"Reference: {result.reference}.",
        f"Error: rmse of the light that the medium scatters into the pixels over its mean in the reference, linear, RGB, one sample at the "
        f"centre of each of {result.size[0]} × {result.size[1]} pixels; without those within {NEAR} px of an edge of depth "
        f"({percent(EDGE)} between neighbours; {percent(result.measured)} are left), and of the rest without the worst {percent(WORST)}. "
        "Bias: of the means. 99 %: of the values are off by less; max: by no more. All pixels: with nothing left out.",
    ]
    if any(row.scale is not None for row in result.rows):
        found.append(
            "Methods that do not compute a radiance are multiplied by the one factor that makes their error least: it says how well they "
            "have the shape of the light, not its amount."
        )
    return found + [
        f"Cost: the time of the march with its upsampling (of other methods: of source and sum) over that of a one-tap copy of the picture "
        f"({result.copy_ms:.2f} ms), medians of {result.runs} interleaved runs on {result.adapter}; shadow maps by themselves; set-up: "
        "planning, recording and what else is no pass. Noise repeats: its textures are fixed, so that there is no seed.",
        f"Difference: {amplify:g} × |light - reference| over the mean, so that white is {percent(1 / amplify)} of it.",
    ]
