"""What docs/fog.md says: its particles and its program do what they are for, its files are there, its commands thicken the air."""

import re
import shlex
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from documented import DOCS

import airlight
from airlight.options import Medium

pytest.importorskip("pygfx")

from airlight.scenes import NAMES, VALIDATION, open_scene, valley

PAGE = (DOCS / "fog.md").read_text(encoding="utf-8")
COMMANDS = [shlex.split(line.replace("\\\n", " "), comments=True) for line in re.findall(r"^    airlight ((?:.*\\\n)*.*)$", PAGE, re.M)]


def test_the_scenes_and_files_of_its_commands_are_there() -> None:
    written = set(re.findall(r"`python scripts/glass_room.py (\S+)`", PAGE))
    assert len(COMMANDS) > 9 and len(written) == 1 and {words[1] for words in COMMANDS} <= {*NAMES, *VALIDATION, *written}
    named = [words[k + 1] for words in COMMANDS for k, word in enumerate(words) if word == "--volume"]
    assert named and all((DOCS.parent / text.split(";")[0]).exists() for text in named)


def test_the_smoke_lies_where_the_slats_throw_light() -> None:
    smoke = airlight.read_volume(str(DOCS.parent / "examples/volumes/smoke.npz"), bounds=(-1.75, 0, -1.8, 0.05, 2.9, 0))
    room = open_scene("slats")
    assert np.abs(smoke.bounds - room.center).max() < room.radius and 0.02 < smoke.mass < 0.5
    for axis in range(3):  # no face cuts it, but the floor
        ends = np.take(smoke.density, (0, -1) if axis != 1 else (-1,), axis=axis)
        assert ends.max() < 0.02 < smoke.density.max()


def test_the_fire_burns_on_the_ground(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (program,) = re.findall(r"```python\n(.*?)```", PAGE, re.S)
    monkeypatch.chdir(tmp_path)
    exec(compile(program, "docs/fog.md", "exec"), {})
    found: Any = np.load("fire.npz")
    lowest = found["positions"][found["positions"][:, 1].argmin()]
    assert len(found["positions"]) == 600 and abs(lowest[1] - valley.height_at(lowest[0], lowest[2])) < 1


def test_the_model_is_that_of_the_conventions() -> None:
    """fog(y), and the blends, as docs/conventions.md writes them."""
    text = (DOCS / "conventions.md").read_text(encoding="utf-8")
    assert "rho(x, time) = air fog(y) noise(x - wind time)" in text
    points = np.stack([np.zeros(50), np.linspace(-3, 12, 50), np.zeros(50)], axis=1)
    h = np.maximum(0, points[:, 1] - 1)
    expected = {"exponential": np.exp(-h / 4), "linear": 1 + (0.2 - 1) * np.minimum(1, h / 4)}
    for fog, rho in expected.items():
        medium = Medium(fog=fog, fog_base=1.0, fog_depth=4.0, fog_above=0.2, air=0.7)
        np.testing.assert_allclose(airlight.density(points, medium=medium), 0.7 * rho, rtol=1e-6)
    still = Medium(noise_amount=3.0, noise_size=5.0)
    moving = Medium(noise_amount=3.0, noise_size=5.0, wind=(2.0, 0.0, 0.5))
    moved = airlight.density(points + np.multiply(4.0, (2.0, 0.0, 0.5)), 4.0, moving)
    np.testing.assert_allclose(moved, airlight.density(points, 0.0, still), rtol=1e-4)


def test_it_names_all_that_varies() -> None:
    """Each option of the medium from fog to transparency, in this guide for users of the command."""
    names = [name for name in Medium.__struct_fields__ if name.startswith(("fog", "noise", "wind", "basin", "air", "particle", "transp"))]
    assert len(names) > 10 and [name for name in names if f"--{name.replace('_', '-')}" not in PAGE] == []
