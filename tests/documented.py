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
