"""The guide's program runs, and draws shafts; its two lines for a medium light the air."""

import re
import warnings
from typing import Any

import msgspec
import numpy as np
import pytest
from documented import DOCS, drawn, varied

import airlight
from airlight.errors import AirlightWarning
from airlight.medium.field import Field

pytest.importorskip("pygfx")


def test_the_guides_program(caplog: Any) -> None:
    assert np.abs(drawn("scenes.md", caplog)).mean() > 5


@pytest.mark.parametrize("page", ["scenes.md", "fog.md"])
def test_the_guides_lines_for_a_medium_that_varies(page: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """As they stand, in a checkout: fog and volume are each seen, nothing is doubtful, and the picture is no dark one."""
    monkeypatch.chdir(DOCS.parent)
    with warnings.catch_warnings():
        warnings.simplefilter("error", AirlightWarning)
        names = varied(page, (96, 54))
    shafts, whole = names["shafts"], names["picture"].astype(int)
    assert shafts.parameters.method == "march" and whole[..., :3].mean() > 25
    (smoke,) = shafts.fields
    for medium, fields in ((msgspec.structs.replace(shafts.medium, air=0.0), [smoke]), (shafts.medium, [])):
        shafts.medium, shafts.fields = medium, fields
        assert np.abs(np.asarray(names["canvas"].draw()).astype(int) - whole)[..., :3].max() > 20


def test_what_is_hardly_seen_in_a_program_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of the same lines: a factor too small, and the one that is advised; a volume of millimetres."""
    monkeypatch.chdir(DOCS.parent)
    names = varied("fog.md", (96, 54))
    shafts, smoke = names["shafts"], names["smoke"]
    shafts.fields, shafts.doubts = [Field(smoke)], True
    with pytest.warns(AirlightWarning, match="the volumes and particles are hardly seen: .* give them a factor of ") as told:
        names["canvas"].draw()
    factor = float(re.findall(r"a factor of (\d+),", str(told[0].message))[0])
    small = airlight.read_volume("examples/volumes/smoke.npz", bounds=(0, 0, 0, 0.01, 0.01, 0.01))
    for field, line in ((Field(smoke, factor=factor), ""), (Field(small, factor=1e4), "is too small to be seen, 0.017 m around 0.005, ")):
        shafts.fields, shafts.doubts = [field], True
        with warnings.catch_warnings(record=True) as found:
            warnings.simplefilter("always")
            names["canvas"].draw()
        assert [line in str(one.message) for one in found] == [True] * bool(line)
