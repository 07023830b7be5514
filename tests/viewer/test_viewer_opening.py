"""Files that are chosen or dropped, and texts that are copied, in a window and where there is none."""

import os
import stat
import subprocess
import sys
import textwrap
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from imgui_bundle import imgui
from viewer_driver import Driver

from airlight import scenes
from airlight.files import write_image
from airlight.viewer import command, desktop
from airlight.viewer import state as st
from airlight.viewer.desktop import Desktop, FileDialog


@pytest.fixture
def other(folder: Path, codes: np.ndarray) -> str:
    path = str(folder / "other.png")
    write_image(path, None, encoded=codes[:, ::-1].copy(), overwrite=True)
    return path


def desk(hands: Driver) -> Desktop:
    found: Desktop = hands.viewer.errands.desktop
    return found


def test_what_is_dropped_is_shown(hands: Driver, other: str, folder: Path) -> None:
    desk(hands).receive([other])
    hands.frame(2)
    assert hands.state.source == other and other in hands.state.sources and hands.state.message == ""
    desk(hands).receive([hands.state.sources[-2], "b", "c"])
    hands.frame(2)
    assert hands.state.source != other and hands.state.message.endswith("is shown, the first of the files")
    desk(hands).receive([])
    bad = folder / "bad.png"
    bad.write_bytes(b"no picture")
    shown, lights = hands.state.source, hands.state.lights
    for path in (str(bad), str(folder), str(folder / "nothing.glb"), str(folder / "nothing.jpg")):
        desk(hands).receive([path])
        hands.frame(2)
        assert hands.state.is_error and hands.state.message.startswith(path) and "\n" not in hands.state.message
        assert hands.state.source == shown and hands.state.lights is lights


def test_a_file_that_came_as_bytes_has_its_own_name(hands: Driver, other: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In the panel, in the command, in errors; what is saved of it lies in the viewer's folder, and goes to the page."""
    delivered: list[str] = []
    monkeypatch.setattr(desk(hands), "deliver", delivered.append, raising=False)
    monkeypatch.setitem(desk(hands).names, other, "from my laptop.png")
    desk(hands).receive([other])
    hands.frame(2)
    assert command.command_line(hands.state)[2:5] == ["from my laptop.png", "-o", "from my laptop-shafts.png"]
    hands.state.requests.append(("save", ""))
    hands.frame()
    assert Path(hands.viewer.saving.path) == folder / "from my laptop-shafts.png"
    hands.viewer.saving.join()
    hands.frame(2)
    ours = str(folder / "from my laptop-shafts.png")
    assert hands.state.message == f"{ours} saved, where the viewer runs; the browser downloads a copy"
    assert delivered == [ours]
    hands.state.requests += [("screenshot", ""), ("copy", "")]
    hands.frame()
    assert [Path(path).name for path in delivered[1:]] == [f"{Path(other).stem}-0001.png"] and Path(delivered[1]).exists()
    assert "it is for the folder where you have from my laptop.png" in hands.state.message
    scene = folder / "3.gltf"
    scene.write_text('{"asset": {"version": "2.0"}, "buffers": [{"uri": "room.bin", "byteLength": 4}]}')
    monkeypatch.setitem(desk(hands).names, str(scene), "room.gltf")
    desk(hands).receive([str(scene)])
    hands.frame(2)
    assert hands.state.message.startswith("room.gltf:") and str(folder) not in hands.state.message
    assert "do not come with it: send a .glb" in hands.state.message


def test_without_a_dialog_the_field_is_shown(smart: Driver) -> None:
    assert "path" not in smart.places
    smart.click("choose")
    smart.frame(2)
    assert smart.state.message == "there is no file dialog here: type a path below" and "path" in smart.places
    for letter in "a b":
        smart.canvas.submit_event({"event_type": "char", "data": letter, "is_composing": False, "modifiers": ()})
    smart.frame(3)
    assert smart.state.path == "a b"  # it has the keys
    smart.drag((900.0, 700.0), (900.0, 700.0), 1)  # which leaves the field
    smart.state.path = ""
    smart.state.has_paths = False  # as in a browser
    smart.frame(2)
    assert "path" not in smart.places and "source" in smart.places
    smart.state.has_paths = True
    smart.open_group("Picture")


def test_the_command_is_copied_by_its_key_and_pasted_into_fields(hands: Driver) -> None:
    hands.canvas.submit_event({"event_type": "key_down", "key": "c", "modifiers": ("Control",)})
    hands.frame(2)
    assert hands.state.message == "the command stands below its button" and "command" in hands.places
    assert desk(hands).paste() == hands.state.command == command.as_text(command.command_line(hands.state))
    assert imgui.get_clipboard_text() == desk(hands).paste()
    imgui.set_clipboard_text("from a field")
    assert desk(hands).paste() == "from a field"


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_each_scene_is_shown_by_its_name(folder: Path) -> None:
    hands = Driver("table", folder)
    assert hands.state.sources == (*scenes.NAMES, *scenes.VALIDATION)
    for name in hands.state.sources:
        hands.state.requests.append(("open", name))
        hands.frame(2)
        assert (hands.state.source, hands.state.message) == (name, ""), name


def fake_zenity(folder: Path, script: str) -> str:
    program = folder / "zenity"
    program.write_text(f"#!/bin/sh\n{script}\n")
    program.chmod(program.stat().st_mode | stat.S_IXUSR)
    return f"{folder}{os.pathsep}{os.environ['PATH']}"


@pytest.mark.skipif(sys.platform in ("win32", "darwin"), reason="the system's own dialog would open")
@pytest.mark.parametrize(("script", "chosen"), [("echo '/a folder/é.png'", ["/a folder/é.png"]), ("exit 1", [])])
def test_the_systems_dialog(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, script: str, chosen: list[str]) -> None:
    """A program of zenity's name answers; without any of its kind portable-file-dialogs would say nothing."""
    monkeypatch.setenv("PATH", fake_zenity(tmp_path, script))
    found: list[Any] = []
    dialog = FileDialog(str(tmp_path), found.append)
    dialog.start()
    dialog.join(20)
    assert found == [chosen]
    monkeypatch.setenv("PATH", str(tmp_path / "nowhere"))
    assert not any(map(desktop.shutil.which, desktop.PROGRAMS))


WINDOW = """
    import ctypes
    import glfw
    glfw.init_hint(glfw.PLATFORM, glfw.PLATFORM_NULL)  # GLFW's own stand-in for a display
    from rendercanvas.glfw import RenderCanvas
    from airlight.viewer.desktop import WindowDesktop, desktop_of
    canvas = RenderCanvas(size=(64, 48))
    desktop = desktop_of(canvas)
    assert type(desktop) is WindowDesktop
    woken = []
    desktop.wake = lambda: woken.append(1)
    dropped = glfw.set_drop_callback(canvas._window, None)  # gives what was set
    dropped(canvas._window, 2, (ctypes.c_char_p * 2)(b"/a/b.png", b"c.png"))
    assert list(desktop.arrived) == [["/a/b.png", "c.png"]] and woken == [1]
    assert desktop.copy("é") == "is in the clipboard" and desktop.paste() == "é", desktop.paste()
    print(desktop.choose("."))
"""


def test_a_window_takes_drops_and_has_the_clipboard() -> None:
    """Also: rendercanvas' window is still named `_window`, and has no drop callback of its own."""
    alone = {**os.environ, "PATH": "/nowhere"}
    code = textwrap.dedent(WINDOW)
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, env=alone)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("no file dialog is installed (zenity or kdialog would be one)")


def test_requests_from_other_threads_are_not_lost(hands: Driver, other: str) -> None:
    import threading

    threads = [threading.Thread(target=desk(hands).receive, args=([other],)) for _ in range(8)]
    for thread in threads:
        thread.start()
    end = time.monotonic() + 10
    while any(thread.is_alive() for thread in threads) and time.monotonic() < end:
        hands.frame()
    hands.frame(2)
    assert hands.state.source == other and not desk(hands).arrived
    assert not st.values(hands.state).get("strength")
