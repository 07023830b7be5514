"""The guide's program runs, and draws shafts; its two lines for a medium light the air."""

import re
from typing import Any

import msgspec
import numpy as np
import pytest
from documented import DOCS, drawn

import airlight
from airlight.options import Medium

pytest.importorskip("pygfx")


def test_the_guides_program(caplog: Any) -> None:
    assert np.abs(drawn("scenes.md", caplog)).mean() > 5


def test_the_guides_lines_for_a_medium_that_varies() -> None:
    """In its program, with the volume that ships where the posts are: fog and volume are each seen."""
    text = (DOCS / "scenes.md").read_text(encoding="utf-8")
    (program,) = re.findall(r"```python\n(.*?)```", text, re.S)
    (lines,) = re.findall(r"^    (medium = .*)\n    (shafts = .*)$", text, re.M)
    smoke = airlight.read_volume(str(DOCS.parent / "examples/volumes/smoke.npz"), bounds=(-1, -1, -3, 1, 2, 1))
    program = re.sub(r"^shafts = .*$", "\n".join(lines).replace('airlight.read_volume("smoke.npz")', "smoke"), program, flags=re.M)
    names: dict[str, Any] = {"airlight": airlight, "Medium": Medium, "smoke": smoke}
    exec(compile(program.replace("(640, 360)", "(96, 54)"), "docs/scenes.md", "exec"), names)
    shafts = names["shafts"]
    whole = names["picture"].astype(int)
    for medium, fields in ((msgspec.structs.replace(shafts.medium, air=0.0), [smoke]), (shafts.medium, [])):
        shafts.medium, shafts.fields = medium, fields
        assert np.abs(np.asarray(names["canvas"].draw()).astype(int) - whole)[..., :3].max() > 5
