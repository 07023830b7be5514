"""The panel, driven by events: sliders, lists, groups, presets, files."""

import os
import shlex
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from viewer_driver import CLASSIC, Driver

from airlight.files import write_image
from airlight.options import declared, presets
from airlight.viewer import app
from airlight.viewer import state as st


def test_the_private_event_queue_of_rendercanvas_is_as_known(hands: Driver) -> None:
    """Driver needs BaseRenderCanvas._process_events; nothing in the package does."""
    seen: list[Any] = []
    hands.canvas.add_event_handler(seen.append, "key_down")
    hands.canvas.submit_event({"event_type": "key_down", "key": "F9", "modifiers": ()})
    assert not seen
    hands.canvas._process_events()
    assert [event["key"] for event in seen] == ["F9"]
    hands.canvas.remove_event_handler(seen.append, "key_down")
    for file in Path(app.__file__).parent.glob("*.py"):
        assert "_process_events" not in file.read_text()


def test_each_parameter_of_a_picture_has_a_widget(hands: Driver) -> None:
    groups = ("Method", "Occlusion", "Composite", "Look")
    for group in groups:
        hands.open_group(group)
    assert {d.name for d in declared() if d.group not in ("look", "daylight")} | {"look"} <= set(hands.places)
    for group in reversed(groups):
        hands.open_group(group)


def test_sliders_are_within_the_bounds() -> None:
    for d in declared(scenes=True):
        if d.kind in (int, float):
            assert d.slider is not None, d.name
            low, high = min(d.slider), max(d.slider)
            assert d.low <= low < high <= d.high and (not d.low_open or low > d.low), d.name
            assert d.default is None or all(low <= v <= high for v in (d.default if d.is_triple else (d.default,))), d.name


@pytest.mark.parametrize("name", ["samples", "density", "decay", "weight", "exposure"])
def test_dragging_a_slider(hands: Driver, name: str) -> None:
    d = next(d for d in declared() if d.name == name)
    before = hands.frame()
    hands.drag(hands.where(name, 0.5), hands.where(name, 0.25))
    low, high = d.slider
    assert st.value(hands.state, name) == pytest.approx(low + 0.25 * (high - low), abs=0.03 * (high - low))  # the knob has a width
    after = hands.frame(2)
    assert np.abs(after[:, 360:].astype(int) - before[:, 360:]).max() > 2  # the picture follows
    hands.click("reset shafts")
    assert st.values(hands.state) == CLASSIC
    assert np.array_equal(hands.frame(2)[:, 360:], before[:, 360:])


def test_methods_by_their_list(hands: Driver) -> None:
    hands.open_group("Method")
    for method in ("radial", "bands", "multipass", "additive", "epipolar"):
        hands.choose("method", method)
        assert (hands.state.parameters.method, hands.state.message) == (method, "")
    hands.open_group("Method")


def test_unset_parameters_show_what_they_are(hands: Driver) -> None:
    hands.open_group("Occlusion")
    found = hands.state.automatic["threshold"]
    assert 0.02 < found < 1
    hands.click("threshold auto")
    assert hands.state.parameters.threshold == pytest.approx(found, rel=1e-3)
    hands.click("threshold auto")
    assert hands.state.parameters.threshold is None
    hands.choose("occlusion", "contrast")
    assert hands.state.parameters.occlusion == "contrast"
    hands.click("occlusion")
    assert "occlusion:luminance" in hands.places and "occlusion:alpha" not in hands.places  # it has no transparency
    hands.click("occlusion:luminance", 0.2)
    hands.open_group("Occlusion")


def test_events_on_the_panel_ask_for_a_frame(hands: Driver, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nobody else does while nothing moves; the panel lets no event through that lies on it."""
    at = hands.where("density")
    hands.event("pointer_move", at)
    hands.frame(app.LINGER + 1)
    asked: list[bool] = []
    monkeypatch.setattr(hands.canvas, "request_draw", lambda *_: asked.append(True))
    hands.frame()
    assert not asked
    for kind, more in (("pointer_move", {}), ("pointer_down", {"button": 1}), ("pointer_up", {"button": 1}), ("wheel", {"dx": 0, "dy": 1})):
        asked.clear()
        hands.canvas.submit_event({"event_type": kind, "x": at[0], "y": at[1], "modifiers": (), **more})
        hands.canvas._process_events()
        assert asked, kind


def test_a_press_is_whose_it_lies_on_however_late_the_frame(hands: Driver) -> None:
    """Events gather while a frame is drawn; the panel knows the pointer only as of the last one."""
    seen: list[Any] = []
    heard = seen.append
    hands.canvas.add_event_handler(heard, "pointer_down")
    panel, picture = hands.where("density"), (900.0, 600.0)
    try:
        for before, at, passed in ((panel, picture, True), (picture, panel, False), (picture, picture, True), (panel, panel, False)):
            hands.event("pointer_move", before)
            hands.frame(2)
            for kind, button in (("pointer_move", 0), ("pointer_down", 1), ("pointer_up", 1)):
                hands.canvas.submit_event({"event_type": kind, "x": at[0], "y": at[1], "button": button, "modifiers": ()})
            hands.frame(3)
            assert len(seen) == passed, (before, at)
            seen.clear()
    finally:
        hands.canvas.remove_event_handler(heard, "pointer_down")


def test_presets_in_the_panel(hands: Driver) -> None:
    hands.open_group("Presets and settings")
    hands.choose("preset", "vesper")
    assert hands.state.preset == "vesper" and st.values(hands.state) == CLASSIC | {
        key: v for key, v in presets.load("vesper").items() if v != next(d.default for d in declared(scenes=True) if d.name == key)
    }
    hands.choose("preset", "none")
    assert st.values(hands.state) == {}
    hands.open_group("Presets and settings")


def test_bad_files_are_a_line_in_the_panel(hands: Driver, folder: Path, photo: str) -> None:
    before = hands.frame(2)[:, 360:]
    bad = folder / "bad.toml"
    bad.write_text("densitty = 1\n")
    st.load(hands.state, str(bad))
    hands.frame()
    assert hands.state.is_error and "densitty" in hands.state.message and "message" in hands.places
    for missing in (str(folder / "none.png"), str(folder / "none.glb"), str(bad)):
        hands.state.requests.append(("open", missing))
        hands.frame(2)
        assert hands.state.is_error and os.path.basename(missing) in hands.state.message
        assert hands.state.source == photo
    assert np.array_equal(hands.frame(2)[:, 360:], before)


def test_open_by_its_field(hands: Driver, folder: Path, codes: np.ndarray) -> None:
    other = folder / "b.png"
    write_image(other, None, encoded=codes[:, ::-1].copy(), overwrite=True)
    hands.type("path", str(other))
    hands.click("open")
    hands.frame(2)
    assert hands.state.source == str(other) and str(other) in hands.state.sources
    assert hands.state.lights[0].position == pytest.approx((0.7, 0.4), abs=0.03)  # found


def test_save_and_load(hands: Driver, folder: Path) -> None:
    path = folder / "mine.toml"
    hands.open_group("Presets and settings")
    st.set_values(hands.state, {"density": 0.5, "method": "radial", "scale": 0.5, "threshold": 0.25})
    said = st.values(hands.state)
    hands.type("file", str(path))
    hands.click("save")
    assert not hands.state.is_error and presets.load(path) == said
    hands.click("save")
    assert hands.state.is_error and "exists" in hands.state.message
    st.reset(hands.state)
    hands.frame(2)
    hands.click("load")
    assert st.values(hands.state) == said
    hands.open_group("Presets and settings")


def test_copy_and_screenshot_by_their_buttons(hands: Driver, folder: Path, photo: str) -> None:
    hands.click("copy")
    hands.frame()
    assert shlex.split(hands.state.command)[2] == photo and "command" in hands.places
    there = set(folder.glob("sun-*.png"))
    hands.click("screenshot")
    hands.frame()
    hands.click("screenshot")
    hands.frame()
    assert len(set(folder.glob("sun-*.png")) - there) == 2 and not hands.state.is_error


def test_the_panel_can_be_hidden(hands: Driver) -> None:
    for width in (0, 344):
        for kind in ("key_down", "key_up"):
            hands.canvas.submit_event({"event_type": kind, "key": "h", "modifiers": ()})
        hands.frame(2)
        assert hands.viewer.panel.width == width and ("samples" in hands.places) == (width > 0)
