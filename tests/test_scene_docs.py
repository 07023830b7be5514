"""The guide's program runs, and draws shafts."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("pygfx")


def test_the_guides_program(caplog: Any) -> None:
    text = Path(__file__).parents[1].joinpath("docs", "scenes.md").read_text(encoding="utf-8")
    (program,) = re.findall(r"```python\n(.*?)```", text, re.S)
    names: dict[str, Any] = {}
    exec(compile(program, "docs/scenes.md", "exec"), names)
    picture, shafts = names["picture"].astype(int), names["shafts"]
    assert picture.shape == (360, 640, 4) and not caplog.records
    shafts.enabled = False
    without = np.asarray(names["canvas"].draw()).astype(int)
    assert np.abs(picture - without)[..., :3].mean() > 5
