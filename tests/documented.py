"""Running the programs that documents show."""

import re
from pathlib import Path
from typing import Any

import numpy as np

DOCS = Path(__file__).parents[1] / "docs"


def drawn(page: str, caplog: Any) -> np.ndarray:
    """(H, W, 3) codes that the shafts of a page's only program make of its picture."""
    (program,) = re.findall(r"```python\n(.*?)```", DOCS.joinpath(page).read_text(encoding="utf-8"), re.S)
    names: dict[str, Any] = {}
    exec(compile(program, f"docs/{page}", "exec"), names)
    picture, shafts = names["picture"].astype(int), names["shafts"]
    assert picture.shape == (360, 640, 4) and not caplog.records
    shafts.enabled = False
    without = np.asarray(names["canvas"].draw()).astype(int)
    return (picture - without)[..., :3]


def varied(page: str, size: tuple[int, int]) -> dict[str, Any]:
    """Run the program of scenes.md, of a size, with the lines of a page that stand in place of its `shafts = ...`: its names."""
    lines = re.findall(r"in place of `shafts = \.\.\.`[^\n]*:\n\n((?:    .*\n|\n)+)", DOCS.joinpath(page).read_text(encoding="utf-8"))
    program = re.findall(r"```python\n(.*?)```", DOCS.joinpath("scenes.md").read_text(encoding="utf-8"), re.S)[0]
    program = re.sub(r"^shafts = .*$", lambda _: re.sub("^    ", "", lines[0], flags=re.M), program, flags=re.M)
    names: dict[str, Any] = {}
    exec(compile(program.replace("(640, 360)", str(size)), f"docs/{page}", "exec"), names)
    assert len(lines) == 1 and np.asarray(names["picture"]).shape[:2] == size[::-1]
    return names
