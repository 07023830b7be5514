"""Measures the scenes of validation and puts the figures into docs/world.md, between its comments validation and end. Twenty minutes;
needs requirements-validate.lock: python scripts/validation_table.py [SCENE ...], the others' rows stay."""

import sys
from pathlib import Path

ROOT = Path(__file__).parent.parent
sys.path.insert(0, str(ROOT / "tests"))
import validating  # noqa: E402
from marked import parts, put  # noqa: E402

WHAT = {
    "slats": "a spot through slats",
    "foliage-view": "the sun through foliage, in view",
    "foliage-beside": "beside the view",
    "foliage-behind": "behind the eye",
    "cage": "a point light in a cage",
    "two-spots": "two coloured spots",
    "window": "windows of a room, coloured medium, g = -0.5",
    "headlamp": "a lamp beside the eye, g = 0.9",
    "dense": "an optical depth of several",
    "mirrored": "nested nodes with mirrored scale",
    "slide": "a projector with a slide, through slats",
    "gobo": "two spots with gobos",
    "flood": "photometry of type B in a spot",
}
STEPS = 2000, 500
HEAD = """\
| | | exact walk: rmse | bias | 64 steps: rmse | bias | 32 steps: rmse | bias | 16 steps: rmse | bias |
|---|---|---|---|---|---|---|---|---|---|
"""
HEAD = """\
| | | exact walk: rmse | bias | 2,000 steps: rmse | bias | 500 steps: rmse | bias | Mitsuba: rmse at most | bias | its noise |
|---|---|---|---|---|---|---|---|---|---|---|
"""


def row(name: str) -> str:
    drawn, truth, way = validating.exact(name)
    figures = [*validating.error(drawn.layer, truth, way)]
    for steps in STEPS:
        figures += validating.error(validating.draw(name, *validating.SIZE, steps=steps, jitter="midpoint").layer, truth, way)
    cells = [f"{value:.3%}" for value in figures]
    noisy = validating.error_by_mitsuba(name)
    cells += [f"{noisy.rmse:.2%}", f"{noisy.bias:.2%} ± {noisy.unsure:.2%}", f"{noisy.noise:.1%}"]
    return f"| `{name}` | {WHAT[name]} | {' | '.join(cells)} |".replace("%", " %")


def main() -> None:
    page = ROOT / "docs" / "world.md"
    for name in sys.argv[1:] or WHAT:
        new = row(name)
        print(new, flush=True)
        old = {line.split("`")[1]: line for line in parts(page, "validation")[1].splitlines() if line.startswith("| `")}
        rows = old | {name: new}
        put(page, "validation", HEAD + "".join(rows[each] + "\n" for each in WHAT if each in rows))


if __name__ == "__main__":
    main()
