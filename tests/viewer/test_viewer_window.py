"""The viewer's window: sizes, the command line, notebooks, memory."""

import os
import subprocess
import sys
import tracemalloc
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from viewer_driver import SIZE, Driver, resident

from airlight.cli import main
from airlight.errors import AirlightError
from airlight.files import read_image
from airlight.viewer import app
from airlight.viewer import state as st


def test_resizes(hands: Driver) -> None:
    before = hands.frame(2)
    for size in ((700, 500), (200, 100), (1, 1), (1920, 1080), SIZE):
        hands.canvas.set_logical_size(*size)
        frame = hands.frame(2)
        if size != (1, 1):
            assert frame.shape[:2] == size[::-1]
    assert np.array_equal(hands.frame(2), before)


def test_no_window_without_a_display(photo: str) -> None:
    blind = {key: v for key, v in os.environ.items() if key not in ("DISPLAY", "WAYLAND_DISPLAY")}
    done = subprocess.run([sys.executable, "-m", "airlight", "view", photo], capture_output=True, text=True, env=blind, timeout=120)
    lines = done.stderr.strip().splitlines()
    assert done.returncode == 1 and len(lines) == 1 and "display" in lines[0] and "--browser" in lines[0]


def test_command_line(photo: str, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = folder / "panel.png"
    assert main(["view", photo, "--screenshot", str(out), "--light", "0.6,0.5", "--density", "0.4"]) == 0
    assert main(["view", photo, "--screenshot", str(out), "-y", "--light", "auto:1;strength=2", "--light", "0.6,0.5;kind=glow"]) == 0
    assert read_image(out).codes.shape == (720, 1280, 3)
    assert main(["view", photo, "--screenshot", str(out)]) == 2
    assert main(["view", str(folder / "none.png"), "--screenshot", str(out), "-y"]) == 2
    assert main(["view", photo, "--screenshot", str(out), "-y", "--preset", "nonsense"]) == 2
    assert main(["view", "slats", "--screenshot", str(out), "-y", "--light", "0.5,0.5"]) == 2  # a scene
    assert len([line for line in capsys.readouterr().err.strip().splitlines() if not line.startswith("light at")]) == 4


def test_an_array_in_a_notebook(codes: np.ndarray, monkeypatch: pytest.MonkeyPatch) -> None:
    """The canvas is a stand-in for rendercanvas.anywidget's, which needs a notebook's packages."""
    import types

    import rendercanvas.offscreen

    import airlight

    class Canvas(rendercanvas.offscreen.RenderCanvas):
        def _repr_mimebundle_(self, **_: Any) -> dict[str, str]:
            return {"text/plain": "shown"}

    monkeypatch.setitem(sys.modules, "rendercanvas.anywidget", types.SimpleNamespace(RenderCanvas=Canvas))
    shown = airlight.view(codes, (0.2, 0.3), size=(640, 400), density=0.5)
    assert shown._repr_mimebundle_() == {"text/plain": "shown"}
    assert shown.state.lights[0].position == (0.2, 0.3) and shown.state.parameters.density == 0.5
    assert shown.canvas.draw().shape == (400, 640, 4)
    monkeypatch.setitem(sys.modules, "rendercanvas.anywidget", None)
    with pytest.raises(AirlightError, match=r"airlight\[notebook\]"):
        airlight.view(codes)
    with pytest.raises(AirlightError):
        app.from_array(np.zeros((3, 3, 7)))


@pytest.mark.slow
@pytest.mark.parametrize("look", ["classic", "smart"])
def test_memory_does_not_grow(hands: Driver, look: str, capsys: pytest.CaptureFixture[str]) -> None:
    """300 frames of lights, sliders, methods, presets and sizes, over and over."""

    def turn(i: int) -> None:
        state = hands.state
        state.lights[0].position = (0.1 + 0.8 * (i % 10) / 10, 0.4)
        if look == "smart":
            st.change(state, "look", "smart")
            st.change(state, "strength", 0.5 + 0.1 * (i % 10))
            hands.viewer.dragging = 0 if i % 20 < 10 else None
        st.change(state, "density", 0.5 + 0.04 * (i % 10))
        if i % 15 == 0:
            st.change(state, "method", ("radial", "epipolar", "bands")[i // 15 % 3])
        if i % 15 == 7:
            hands.canvas.set_logical_size(*((640, 400), (560, 360))[i // 15 % 2])
        state.debug = ("occlusion", None, "source")[i // 20 % 3]
        hands.frame()

    hands.canvas.set_logical_size(640, 400)
    for i in range(90):
        turn(i)
    tracemalloc.start()
    first, python = resident(), tracemalloc.get_traced_memory()[0]
    for i in range(300):
        turn(i)
    grown, objects = resident() - first, tracemalloc.get_traced_memory()[0] - python
    tracemalloc.stop()
    hands.viewer.dragging = None
    hands.canvas.set_logical_size(*SIZE)
    with capsys.disabled():
        print(f"\nmemory, {look}: {first >> 20} MiB after 90 frames, {grown / first:+.1%} after 300 more; ", end="")
    assert grown < 0.05 * first, f"{grown / 2**20:.1f} MiB more than {first / 2**20:.0f}"
    assert objects < 8 << 20
