"""Put the figures of `airlight bench --json FILE` into docs/benchmarks.md, between its comments bench and end."""

import json
import sys
from pathlib import Path

from marked import put

ORDER = [("epipolar", q, None) for q in ("draft", "normal", "final")] + [("radial", None, None), ("radial", None, 0.5)]
LAMBDA = 3.24
SCENES = ("table", "flying")
WAYS = ("exact", "2000 steps", "64 steps, half")  # of light in a medium


def table(records: list[dict]) -> str:
    """A row a method: copies and error of each case at D 0.926, lambda 3.24; then the rival and whole processes in words."""
    rows = ["| method | inside: copies | error | edge: copies | error | outside: copies | error |", "|---|---|---|---|---|---|---|"]
    for method, quality, scale in ORDER:
        cells = []
        for case in ("inside", "edge", "outside"):
            here = [r for r in records if r["case"] == case and abs(r["lambda"] - LAMBDA) < 1e-6 and r["height"] == 1080]
            copy = next(r["ms"] for r in here if r["method"] == "copy")
            one = next(r for r in here if (r["method"], r.get("quality"), r.get("scale")) == (method, quality, scale))
            cells += [f"{one['ms'] / copy:.1f}", f"{one['error']:.2%}"]
            samples = one["samples"]
        name = f"{method} {quality}" if quality else f"{method}, n = {samples}" + (", half resolution" if scale else "")
        rows.append(f"| {name} | " + " | ".join(cells) + " |")
    return "\n".join(rows + ["", *_words(records)])


def _words(records: list[dict]) -> list[str]:
    words = []
    rivals = [r for r in records if r["case"] == "rival" and r["lambda"] == 0]
    if rivals:
        ours = next(r for r in rivals if r["method"] == "epipolar")
        compared = [f"{r['ms'] / ours['ms']:.1f} times as long at {r['error']:.2%}" for r in rivals if r is not ours]
        words.append(
            f"OpenCV's polar warp with prefix moments, the strongest rival on a CPU (D = 1, lambda = 0), takes {' or '.join(compared)}"
            f" error, against {ours['error']:.2%}."
        )
    whole = {r["method"]: r["ms"] for r in records if r["case"] == "whole process"}
    if whole:
        ratio = whole["airlight image"] / whole["read and write alone"]
        words.append(f"`airlight image` on a 12-megapixel JPEG, the whole process, takes {ratio:.1f} times reading and writing it alone.")
    frames = "airlight image, frames"
    if frames in whole:
        alone, same = (whole[frames] / whole[name] for name in ("read and write alone, frames", "read and write alone, layer too"))
        words.append(
            f"A hundred EXR frames of 1080p take {alone:.1f} times reading and writing them alone, {same:.1f} times where that too writes"
            " the layer's three channels."
        )
    return words + _scenes(records) + _world(records)


def _scenes(records: list[dict]) -> list[str]:
    """A row a way of finding occluders: copies of mask, shafts and merge in each scene, with the share of each pass."""
    copies = {r["case"]: r["ms"] for r in records if r["case"] in SCENES and r["method"] == "copy"}
    if not copies:
        return []
    rows = ["", "3-D scenes, 1280 x 720, shafts at half resolution, the light aimed anew: copies of 1280 x 720 in all, and of each pass."]
    rows += ["", "| occluders | " + " | ".join(copies) + " |", "|---" * (len(copies) + 1) + "|"]
    for way in dict.fromkeys(r["method"] for r in records if r["case"] in copies and r["method"] != "copy"):
        cells = []
        for case, copy in copies.items():
            one = next(r for r in records if (r["case"], r["method"]) == (case, way))
            parts = ", ".join(f"{label} {ms / copy:.1f}" for label, ms in one["passes"].items())
            cells.append(f"{one['ms'] / copy:.1f} ({parts})")
        rows.append(f"| {way} | " + " | ".join(cells) + " |")
    return rows


def _world(records: list[dict]) -> list[str]:
    """A row a case: copies of summing the light, and of what comes before it; how many times as fast as 2,000 steps; and the error."""
    cases = [r["case"] for r in records if r["method"] == WAYS[0]]
    if not cases:
        return []
    rows = [
        "",
        "Light in a medium, 1280 x 720, shadow maps of 2048: copies of summing the light alone, in brackets how many times as fast as",
        "2,000 steps, and the rmse of the light over its mean against the exact walk, of the whole picture. Maps and set-up come first.",
        "",
        "| | exact | 2,000 steps | 64 steps, half resolution | shadow maps | set-up |",
        "|---|---|---|---|---|---|",
    ]
    for case in cases:
        one = {r["method"]: r for r in records if r["case"] == case}
        copy, long = one["copy"]["ms"], one[WAYS[1]]["ms"]
        cells = [f"{one[WAYS[0]]['ms'] / copy:.0f} ({long / one[WAYS[0]]['ms']:.1f})"]
        cells += [f"{one[way]['ms'] / copy:.0f} ({long / one[way]['ms']:.0f}, {one[way]['error']:.2%})" for way in WAYS[1:]]
        cells += [f"{one[WAYS[0]]['passes'].get(label, 0) / copy:.1f}" for label in ("shadows", "set-up")]
        rows.append(f"| {case} | " + " | ".join(cells) + " |")
    return rows


def main() -> None:
    page = Path(__file__).parent.parent / "docs" / "benchmarks.md"
    put(page, "bench", table(json.loads(Path(sys.argv[1]).read_text())["records"]) + "\n")


main()
