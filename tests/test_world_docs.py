"""What docs/world.md and docs/conventions.md say: the program runs, the commands are understood, the formulas hold."""

import re
import shlex
import sys
from typing import Any

import numpy as np
import pytest
from documented import DOCS, drawn

from airlight.cli import cli
from airlight.medium.resolve import resolve
from airlight.options import March, Medium, build
from airlight.scenes import VALIDATION, open_scene

pytest.importorskip("pygfx")
from airlight.pygfx.punctual import punctual_lights

sys.path.insert(0, str(DOCS.parent / "scripts"))
import validation_pages


def test_the_program(caplog: Any) -> None:
    assert drawn("world.md", caplog).mean() > 5  # the air is bright: a medium that only dims would darken


@pytest.mark.parametrize(("page", "least"), [("world.md", 9), *((f"validation/{name}.md", 2) for name in VALIDATION)])
def test_the_commands_are_understood(page: str, least: int) -> None:
    lines = re.findall(r"^    airlight (.*)$", DOCS.joinpath(page).read_text(encoding="utf-8"), re.M)
    assert len(lines) >= least
    for line in lines:
        name, *words = shlex.split(line, comments=True)
        command = cli.commands.get(name)
        assert command is not None
        command.make_context(name, words)  # raises for what it does not know


@pytest.mark.parametrize("name", VALIDATION)
def test_a_scenes_page_has_its_numbers(name: str) -> None:
    """As they are in the scene's files: a page is to be made anew when these change."""
    stage, text = open_scene(name), DOCS.joinpath("validation", f"{name}.md").read_text(encoding="utf-8")
    built = build(stage.settings)
    air = resolve(built[Medium], built[March], "final", stage.radius, fields=stage.fields)
    numbers = [validation_pages.medium(air), *(validation_pages.light(lamp) for lamp in punctual_lights(stage.lights))]
    assert len(numbers) > 1 and all(f" | {line} |\n" in text for line in numbers)
    assert DOCS.joinpath("pictures", f"validation-{name}.jpg").exists() and "| exact walk |" in text
    assert f"(validation/{name}.md)" in DOCS.joinpath("validation.md").read_text(encoding="utf-8")


def test_phase_functions_are_normalised() -> None:
    """The table's formulas, as Python reads them: integral 1 over the sphere, and the mean cosines that it says."""
    text = DOCS.joinpath("conventions.md").read_text(encoding="utf-8")
    table = dict(re.findall(r"^\| `([\w-]+)` \| (.*?)(?:; its mean.*)? \|$", text.split("| `phase` |")[1].split("## Lights")[0], re.M))
    x, weight = np.polynomial.legendre.leggauss(200)

    def p(formula: str, g: float) -> np.ndarray:
        python = re.sub(r"(?<=[\w)]) (?=[\w(])", " * ", formula).replace("^", "**")
        return np.asarray(eval(python, {"g": g, "cos": x, "pi": np.pi})) + 0 * x

    for g in (-0.7, 0.0, 0.3, 0.8):
        means = {"henyey-greenstein": g, "isotropic": 0, "rayleigh": 0, "cornette-shanks": 0.6 * g * (4 + g * g) / (2 + g * g)}
        for name, mean in means.items():
            values = 2 * np.pi * weight * p(table[name], g)
            np.testing.assert_allclose([values.sum(), (values * x).sum()], [1, mean], atol=1e-9)
    assert set(table) == {*means, "two-lobe"}
