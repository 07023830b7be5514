"""Saving a picture from the viewer."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from viewer_driver import CLASSIC, Driver, saved

from airlight.cli import main
from airlight.files import read_image, write_image
from airlight.viewer import app, command
from airlight.viewer import state as st
from airlight.viewer.state import LightControl


@pytest.mark.parametrize("look", ["smart", pytest.param("classic", marks=pytest.mark.slow)])
def test_saving_writes_what_the_command_writes(smart: Driver, folder: Path, codes: np.ndarray, look: str) -> None:
    """A JPEG with a title and a colour profile, and 16 bits with transparency."""
    jpeg, deep = folder / f"{look}.jpg", folder / f"{look}16.png"
    shutil.copy(Path(__file__).parents[2] / "examples/photos/sea-sunset.jpg", jpeg)
    alpha = np.linspace(0.2, 1, codes.shape[0] * codes.shape[1], dtype=np.float32).reshape(codes.shape[:2])
    write_image(deep, None, encoded=codes.astype(np.uint16) * 257, alpha=alpha, bits=16)
    for source in (jpeg, deep):
        smart.viewer.open(str(source), [LightControl((0.31, 0.42))])
        st.change(smart.state, "look", look)
        for kind in ("key_down", "key_up"):
            smart.canvas.submit_event({"event_type": kind, "key": "s", "modifiers": ("Control",)})
        smart.frame()
        assert "saving" in smart.state.message
        ours = source.with_name(f"{source.stem}-shafts{source.suffix}")
        assert saved(smart) == f"{ours} saved" and not smart.state.is_error
        words = command.command_line(smart.state)[1:]
        theirs = source.with_name(f"theirs{source.suffix}")
        words[words.index("-o") + 1] = str(theirs)
        assert main([*words, "-y"]) == 0
        assert ours.read_bytes() == theirs.read_bytes()
    assert read_image(ours).bits == 16 and read_image(ours).alpha is not None
    smart.state.requests.append(("save", ""))
    assert saved(smart) == f"{folder / look}16-shafts-2.png saved"
    deep.unlink()
    smart.state.requests.append(("save", ""))
    assert "not saved" in saved(smart) and smart.state.is_error


def test_saving_an_array(folder: Path, codes: np.ndarray) -> None:
    other = Driver(app.from_array(codes), folder, lights=[LightControl((0.3, 0.4))], values=CLASSIC)
    other.state.requests.append(("save", ""))
    assert saved(other) == f"{folder / 'array-shafts.png'} saved"
    assert np.array_equal(read_image(folder / "array-shafts.png").codes, read_image(other.viewer.screenshot()).codes)
