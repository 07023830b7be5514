"""Runs what concerns the device on each driver at hand, and compares what they draw: `make adapters`.

    python scripts/adapters.py [NAME ...] [--pictures] [--shaped] [--write]

NAME: of drivers, as scripts/drivers.py lists them; without one all. --pictures: compare, without the tests. --shaped: of that, only light
with a shape. --write: put the figures of the comparison into docs/drivers.md. Exit code 1 where a test failed on a driver, or there was no
driver.
"""

import argparse
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from drivers import drivers
from marked import put

ROOT = Path(__file__).parent.parent
TESTS = {
    "shaders": ("function_twins", "ray_twins", "look_twins", "look_maths", "march_functions", "scene_functions", "gpu"),
    "accuracy": (
        *("methods", "reference", "occlusion", "planes", "moving", "history", "look", "adapt", "compositing", "alpha", "exposure"),
        *("march", "march_leaks", "medium_pass", "casters", "punctual", "light_kinds", "article", "surface_shadows"),
    ),
    "scenes": ("validation", "scene_pass", "scene_projection", "prepass", "scenes", "compare_scenes"),
}


def test(environment: dict[str, str]) -> dict[str, str]:
    """Run each group of tests where one driver is seen; pytest's last line of each, which says how many failed."""
    ended = {}
    for group, names in TESTS.items():
        files = [str(ROOT / "tests" / f"test_{name}.py") for name in names]
        command = [sys.executable, "-m", "pytest", "-q", "--no-header", "--timeout", "900", "-n", "2", "--dist", "loadfile", *files]
        with subprocess.Popen(command, cwd=ROOT, env=os.environ | environment, stdout=subprocess.PIPE, text=True) as run:
            assert run.stdout is not None
            last = ""
            for line in run.stdout:
                print(line, end="", flush=True)
                last = line.strip() or last
        ended[group] = f"{last}{'' if run.returncode == 0 else ' <-- FAILED'}"
    return ended


def draw(environments: dict[str, dict[str, str]], shaped: bool) -> dict[str, dict[str, np.ndarray]]:
    """Draw the pictures and scenes on each driver, or only light with a shape; those of a driver that fails are left out."""
    found = {}
    with tempfile.TemporaryDirectory() as folder:
        for name, environment in environments.items():
            out = Path(folder, f"{name}.npz")
            command = [sys.executable, str(ROOT / "scripts" / "driver_pictures.py"), str(out)]
            command += [] if shaped else [str(Path(folder, "truths.npz"))]
            if subprocess.run(command, env=os.environ | environment, check=False).returncode == 0:
                found[name] = dict(np.load(out))
    return found


def table(drawn: dict[str, dict[str, np.ndarray]]) -> str:
    """Write what pictures differ by from the first driver's, in codes, and light from the tracer's and the first driver's."""
    first, *others = drawn
    rows = [*(f"- {name}: {found['driver']}" for name, found in drawn.items()), ""]
    rows += [f"On pictures, 640 x 360: 8-bit codes that differ from those of {first}.", ""]
    rows += ["| | " + " | ".join(f"{o}: rmse | largest | off by more than 1" for o in others) + " |"]
    rows += ["|---" * (1 + 3 * len(others)) + "|"]
    for name in (key.partition(" ")[2] for key in drawn[first] if key.startswith("picture ")):
        cells = []
        for other in others:
            off = np.abs(drawn[other][f"picture {name}"].astype(float) - drawn[first][f"picture {name}"])
            cells += [f"{np.sqrt(np.mean(off**2)):.3f}", f"{off.max():.0f}", f"{100 * np.mean(off > 1):.3f} %"]
        rows.append(f"| {name} | " + " | ".join(cells) + " |")
    rows += ["", f"Light in a medium, the exact walk, 240 x 135, shadow maps of {drawn[first]['map_side']}, over its mean: rmse and"]
    rows += [f"bias against the tracer; and how much pixels differ from those of {first}: half and 99 % of them by less, the worst"]
    rows += ["by, and the share off by more than 1 %.", ""]
    heads = [f"{n}: rmse | bias" for n in drawn] + [f"{o}: half | 99 % | worst | off by more than 1 %" for o in others]
    rows += ["| | " + " | ".join(heads) + " |", "|---" * (1 + 2 * len(drawn) + 4 * len(others)) + "|"]
    for name in (key.partition(" ")[2] for key in drawn[first] if key.startswith("scene ")):
        cells = [f"{100 * value:.2f} %" for found in drawn.values() for value in found[f"error {name}"]]
        for other in others:
            cells += spread(drawn[first][f"scene {name}"], drawn[other][f"scene {name}"])
        rows.append(f"| [`{name}`](validation/{name}.md) | " + " | ".join(cells) + " |")
    return "\n".join(rows) + "\n"


def shaped_table(drawn: dict[str, dict[str, np.ndarray]]) -> str:
    """Write what light with a shape differs by from the first driver's."""
    first, *others = drawn
    rows = ["| | " + " | ".join(f"{o}: mean | half | 99 % | worst | off by more than 1 %" for o in others) + " |"]
    rows += ["|---" * (1 + 5 * len(others)) + "|"]
    for name in (key.partition(" ")[2] for key in drawn[first] if key.startswith("shaped ")):
        cells = []
        for other in others:
            here, there = drawn[first][f"shaped {name}"], drawn[other][f"shaped {name}"]
            cells += [f"{100 * (there.mean() / here.mean() - 1):+.3f} %", *spread(here, there)]
        rows.append(f"| {name} | " + " | ".join(cells) + " |")
    return "\n".join(rows) + "\n"


def spread(here: np.ndarray, there: np.ndarray) -> list[str]:
    """Write by how much of the mean pixels differ: half of them and 99 % by less, the worst by, and the share off by more than 1 %."""
    off = np.abs(there - here).mean(axis=2) / here.mean()
    cells = [f"{100 * np.median(off):.4f} %", f"{100 * np.quantile(off, 0.99):.2f} %", f"{off.max():.1f} times"]
    return [*cells, f"{100 * np.mean(off > 0.01):.2f} %"]


def main() -> int:
    parser = argparse.ArgumentParser(description="Run what concerns the device on each driver at hand, and compare what they draw.")
    parser.add_argument("names", nargs="*", metavar="NAME", help="drivers; without one: all")
    parser.add_argument("--pictures", action="store_true", help="compare alone, without the tests")
    parser.add_argument("--shaped", action="store_true", help="compare light with a shape alone")
    parser.add_argument("--write", action="store_true", help="put the comparison into docs/drivers.md")
    asked = parser.parse_args()
    found = drivers()
    for name in asked.names:
        if name not in found:
            parser.error(f"there is no driver {name}; there is {', '.join(found) or 'none'}")
    chosen = {name: found[name] for name in asked.names or found}
    if not chosen:
        print("no driver: install one (Debian: mesa-vulkan-drivers, and chromium for SwiftShader)", file=sys.stderr)
        return 1
    ended: dict[str, dict[str, str]] = {}
    for name, environment in chosen.items() if not (asked.pictures or asked.shaped) else ():
        print(f"\n== {name}", flush=True)
        ended[name] = test(environment)
    drawn = draw(chosen, asked.shaped)
    if len(drawn) > 1:
        for name, write in {"shaped": shaped_table, **({} if asked.shaped else {"drivers": table})}.items():
            text = write(drawn)
            print(f"\n{text}")
            if asked.write:
                put(ROOT / "docs" / "drivers.md", name, text)
    lines = [f"{name:14}{group:10}{last}" for name, groups in ended.items() for group, last in groups.items()]
    lines += [f"{name:14}pictures  could not be drawn <-- FAILED" for name in chosen if name not in drawn]
    print("\n".join(lines))
    return 1 if any(line.endswith("FAILED") for line in lines) else 0


if __name__ == "__main__":
    sys.exit(main())
