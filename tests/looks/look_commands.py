"""Run `airlight image` in its looks, and read what it wrote."""

from pathlib import Path

import numpy as np
import pytest
import thumbs
from test_compositing import load

from airlight.cli import main
from airlight.files import read_image

LIGHT = ["--light", "0.52,0.42"]
SHAPE = thumbs.linear().shape[:2]


def plane_of_subject() -> np.ndarray:
    plane = np.zeros(SHAPE, bool)
    plane[SHAPE[0] // 2 :, SHAPE[1] // 4 : 3 * SHAPE[1] // 4] = True
    return plane


def call(*args: object) -> int:
    return main(["image", *map(str, args)])


def run(capsys: pytest.CaptureFixture[str], *args: object) -> str:
    """What a run that does its work says on stderr."""
    assert call(*args) == 0
    out, said = capsys.readouterr()
    assert out == ""
    return said


def refused(capsys: pytest.CaptureFixture[str], *args: object) -> str:
    assert main([str(a) for a in args]) == 2
    out, said = capsys.readouterr()
    assert out == "" and said.startswith("airlight: ") and said.count("\n") == 1, said
    return said


def codes(path: Path) -> np.ndarray:
    return read_image(path).codes


def layer_of(path: Path) -> np.ndarray:
    _, channels = load(path)
    return np.stack([channels[f"airlight.{name}"] for name in "RGB"], axis=2)
