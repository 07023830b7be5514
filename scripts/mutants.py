"""Runs mutmut over a sample of each module of the numeric core, and prints the share of mutants that tests notice, and the survivors.

`.venv/bin/mutmut show NAME` shows one. What is mutated, and which tests try it: [tool.mutmut] in pyproject.toml. Set aside is what changes
no value: see SAME. With --continue, what the last run did not notice or did not come to is tried, by the tests as they are now.
"""

import argparse
import json
import random
import re
import shutil
import subprocess
import sys
from functools import cache
from pathlib import Path

from mutmut.stats import status_by_exit_code

FOLDER = Path("mutants/src/airlight")
MUTMUT = [sys.executable, "-m", "mutmut"]
NUMBERS = r"(?:float|int|bool|None|image\.dtype|np\.u?(?:float|int)\d+)"
NOTICED = "killed", "timeout"
SAME = [  # two functions that agree after these differ in precision or in checks alone
    (rf"dtype={NUMBERS}", ""), (rf", (?:dtype=)?{NUMBERS}(?=\))", ""), (r", (?=\))", ""),
    (r"\.astype\((?:[\w.]+(?:, copy=\w+)?|copy=\w+)\)", ""),
    (r",? ?strict=\w+", ""), (r"axis=[-+]1", "axis=-1"),  # of arrays (n, 3) the last axis is 1
    (r"indexing=\"\w+\"", "indexing="), (r"cast\([^,]*, ", "cast("),
]  # fmt: skip


def verdicts() -> dict[str, dict[str, int | None]]:
    """Read {module: {mutant: exit code of its tests, None before}}, without what is set aside."""
    found = {}
    for path in sorted(FOLDER.rglob("*.meta")):
        codes = json.loads(path.read_text("utf-8"))["exit_code_by_key"]
        bodies = _bodies(path.with_suffix(""))
        kept = {}
        for name, code in codes.items():
            own = name.rpartition(".")[2]
            original = own.rpartition("__mutmut_")[0] + "__mutmut_orig"
            if own in bodies and bodies[own] != bodies[original]:
                kept[name] = code
        if kept:
            found[path.relative_to(FOLDER).as_posix().removesuffix(".meta")] = kept
    return found


@cache
def _bodies(path: Path) -> dict[str, str]:
    """Map the functions of a mutated file to their texts, with what SAME takes for one made one."""
    parts = re.split(r"^\s*(?:async )?def (\w+__mutmut_\w+)", path.read_text("utf-8"), flags=re.M)
    bodies = dict(zip(parts[1::2], parts[2::2], strict=True))
    for name, text in bodies.items():
        text = re.split(r"\n\s*(?:mutants_x|@_mutmut)|\n(?=[^\s)])", text)[0].rstrip()
        for pattern, instead in SAME:
            text = re.sub(pattern, instead, text)
        bodies[name] = text
    return bodies


def sampled(mutants: dict[str, dict[str, int | None]], each: int, seed: int) -> list[str]:
    """Draw so many mutants of each module, the same ones for a seed; all of them for 0."""
    names = []
    for module, codes in mutants.items():
        order = sorted(codes)
        random.Random(f"{seed} {module}").shuffle(order)
        names += order[: each or None]
    return names


def report(names: list[str]) -> str:
    """Write the table of modules: how many mutants there are, were tried, were noticed; then the names of the others."""
    lines, survivors, whole = ["| module | mutants | tried | noticed |", "|---|--:|--:|--:|"], [], [0, 0, 0]
    for module, codes in verdicts().items():
        tried = {name: status_by_exit_code[codes[name]] for name in names if codes.get(name) is not None}
        left = [name for name, status in tried.items() if status not in NOTICED]
        survivors += left
        counts = len(codes), len(tried), len(tried) - len(left)
        whole = [a + b for a, b in zip(whole, counts, strict=True)]
        lines.append(f"| `{module}` | {counts[0]} | {counts[1]} | {counts[2] / max(counts[1], 1):.0%} |")
    lines.append(f"| all | {whole[0]} | {whole[1]} | {whole[2] / max(whole[1], 1):.1%} |")
    return "\n".join([*lines, "", f"{len(survivors)} not noticed:", *survivors])


def main() -> None:
    """Generate mutants, try the sample, print the report."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--each", type=int, default=30, help="mutants of each module; 0: all")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--continue", dest="go_on", action="store_true", help="keep what the last run noticed, in mutants/")
    options = parser.parse_args()
    if not options.go_on:  # mutmut copies shaders and data once
        shutil.rmtree("mutants", ignore_errors=True)
    run = [*MUTMUT, "run", "--max-children", str(options.processes)]
    subprocess.run([*run, "airlight.luminance*"], check=True)  # generates all, and finds which test runs which function
    mutants = verdicts()
    names = sampled(mutants, options.each, options.seed)
    known = {name for codes in mutants.values() for name, code in codes.items() if status_by_exit_code[code] in NOTICED}
    if rest := [name for name in names if name not in known]:
        subprocess.run([*run, *rest], check=True)
    print(report(names))


if __name__ == "__main__":
    main()
