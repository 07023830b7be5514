"""The smart look in the viewer: its sliders, drafts and candidates."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from viewer_driver import SIZE, Driver, applied

from airlight.cli import main
from airlight.colour import srgb_decode, srgb_encode
from airlight.errors import AirlightError
from airlight.files import read_image, write_image
from airlight.look.measure import oklab
from airlight.options import presets
from airlight.viewer import app, command, controls, marks
from airlight.viewer import state as st
from airlight.viewer.state import LightControl, ViewerState


def seen_change(after: np.ndarray, before: np.ndarray) -> float:
    """The 95th percentile of what 8-bit codes change by, in hundredths of OKLab."""
    first, second = (oklab(srgb_decode(codes / 255)) for codes in (before, after))
    return float(np.percentile(100 * np.sqrt(np.square(second - first).sum(axis=-1)), 95))


def test_a_picture_has_the_smart_look_at_once(smart: Driver, forest: str, trees: np.ndarray) -> None:
    smart.viewer.open(forest)
    smart.frame(2)
    state = smart.state
    assert state.is_smart and st.values(state) == {} and state.lights[0].position == pytest.approx((0.3, 0.4), abs=0.06)
    seen = read_image(smart.viewer.screenshot()).codes
    assert np.array_equal(seen, applied(smart, trees).codes)
    words = command.command_line(state)[1:]
    words[words.index("-o") + 1] = out = str(Path(forest).with_name("forest-out.png"))
    assert main([*words, "-y"]) == 0 and np.array_equal(read_image(out).codes, seen)
    assert {"strength", "warmth", "length", "save picture", "split", "candidates"} <= set(smart.places)
    assert not {"fineness", "samples", "light 0", "path", "debug"} & set(smart.places)  # folded


def test_a_command_that_is_copied_by_its_key_is_shown(smart: Driver) -> None:
    """Its group is folded: it opens, and comes into view."""
    assert "command" not in smart.places
    smart.canvas.submit_event({"event_type": "key_down", "key": "c", "modifiers": ("Control",)})
    smart.frame(4)
    assert 0 < smart.places["command"][1] < smart.canvas.get_logical_size()[1] and not smart.state.command_wanted
    smart.open_group("View")  # folds it


def test_sliders_of_the_look(smart: Driver, trees: np.ndarray) -> None:
    state = smart.state
    smart.drag(smart.where("strength", 0.5), smart.where("strength", 0.25))
    assert state.look.strength == pytest.approx(1, abs=0.12)  # of 4
    assert state.automatic["warmth"] == pytest.approx(0.6 * 0.35, abs=0.15)
    shown = state.automatic["warmth"]
    smart.click("warmth auto")
    assert state.look.warmth == pytest.approx(shown, abs=1e-3)
    smart.frame(2)
    now = {"strength": state.look.strength, "warmth": state.look.warmth}
    assert np.array_equal(read_image(smart.viewer.screenshot()).codes, applied(smart, trees, **now).codes)
    smart.open_group("More of the look")
    assert set(smart.places) >= st.LOOK
    smart.drag(smart.where("mist", 0.0), smart.where("mist", 0.5))
    assert 0.3 < state.look.mist < 0.7
    for fineness in (1.2, None, 0.8):
        st.change(state, "fineness", fineness)
        smart.frame(2)
    st.change(state, "mist", 0.25)
    now |= {"mist": 0.25, "fineness": 0.8}
    assert np.array_equal(read_image(smart.viewer.screenshot()).codes, applied(smart, trees, **now).codes)
    smart.click("reset look")
    assert st.values(state) == {}
    smart.open_group("More of the look")


def test_smart_classic_smart(smart: Driver) -> None:
    first = smart.frame(2)[:, 360:]
    smart.open_group("More of the look")
    smart.choose("look", "classic")
    assert not smart.state.is_smart and "samples" in smart.places
    classic = smart.frame(2)[:, 360:]
    assert np.abs(classic.astype(int) - first).max() > 10
    st.change(smart.state, "density", 0.5)
    assert np.abs(smart.frame(2)[:, 360:].astype(int) - classic).max() > 2
    smart.open_group("Look")
    smart.choose("look", "smart")
    assert smart.state.is_smart and "--density" not in command.command_line(smart.state)
    assert np.array_equal(smart.frame(2)[:, 360:], first)
    assert not st.change(smart.state, "strength", 0.0) and np.abs(smart.frame(2)[:, 360:].astype(int) - first).max() > 10


@pytest.mark.parametrize("values", [{"density": 0.97}, presets.load("vesper"), {"blend": "add"}])
def test_what_names_the_sum_shows_the_sum(values: dict[str, Any]) -> None:
    state = ViewerState("a.png", True)
    st.set_values(state, values)
    assert not state.is_smart and "--look" in command.command_line(state)
    st.set_values(state, {**values, "look": "smart"})
    assert state.is_smart and command.command_line(state) == ["airlight", "image", "a.png", "-o", "a-shafts.png"]


def test_floats_and_sixteen_bits_have_the_smart_look(smart: Driver, folder: Path, trees: np.ndarray) -> None:
    linear = ((trees / 255.0) ** 2.2 * 3).astype(np.float32)
    write_image(folder / "look.exr", linear, overwrite=True, bits=32)
    smart.viewer.open(str(folder / "look.exr"), [LightControl((0.3, 0.4), kind="disc")])
    smart.frame(2)
    found = applied(smart, linear)
    wanted = srgb_encode(np.clip(linear * (1 - found.taken[..., None]) + found.added, 0, 1))
    assert found.taken.max() == 0 and found.added.max() > 0.01
    assert np.abs(read_image(smart.viewer.screenshot()).codes / 255 - wanted).max() <= 1.5 / 255  # half floats
    light = controls.to_canvas((0.3, 0.4), smart.viewer.area())
    smart.drag(light, (light[0] + 20, light[1]))
    deep = trees.astype(np.uint16) * 257
    write_image(folder / "look16.png", None, encoded=deep, overwrite=True, bits=16)
    smart.viewer.open(str(folder / "look16.png"), [LightControl((0.3, 0.4), kind="disc")])
    smart.frame(2)
    assert np.abs(read_image(smart.viewer.screenshot()).codes.astype(int) - applied(smart, trees).codes).max() <= 1


def test_a_grey_picture_stays_grey(smart: Driver, folder: Path, trees: np.ndarray) -> None:
    import OpenImageIO as oiio

    source, out = str(folder / "grey-trees.png"), str(folder / "grey-out.png")
    oiio.ImageBuf(np.ascontiguousarray(trees[..., 1:2])).write(source)
    smart.viewer.open(source, [LightControl((0.3, 0.4), kind="disc")])
    smart.frame(2)
    seen = read_image(smart.viewer.screenshot()).codes
    words = command.command_line(smart.state)[1:]
    words[words.index("-o") + 1] = out
    assert main(words) == 0
    off = np.abs(seen.astype(int) - read_image(out).codes)  # by another dither
    assert np.ptp(seen, axis=2).max() <= 1 and off.max() <= 2 and off.mean() < 0.6
    assert np.abs(seen.astype(int) - trees[..., 1:2]).max() > 10 and smart.state.automatic["warmth"] == 0


def test_a_drag_is_followed_by_a_draft_that_allocates_nothing(smart: Driver, monkeypatch: pytest.MonkeyPatch) -> None:
    """A photograph larger than the canvas; the machine is a GPU or none."""
    source = str(Path(__file__).parents[2] / "examples/photos/beacon-street-sunset.jpg")
    smart.viewer.open(source, [LightControl((0.872, 0.459), kind="disc")])
    smart.frame(3)
    view, device = smart.viewer.picture, smart.viewer.device
    assert view.view is view.whole and max(view.draft.size) < 1000  # it waits
    at = controls.to_canvas((0.872, 0.459), smart.viewer.area())
    smart.event("pointer_move", at)
    smart.event("pointer_down", at, button=1, buttons=(1,))
    smart.event("pointer_move", (at[0] - 5, at[1]), buttons=(1,))
    for name in ("texture", "buffer", "bind", "pipeline"):
        if name != "pipeline":
            monkeypatch.setattr(device, name, lambda *_, **__: pytest.fail("something is made for a frame"))
    for i in range(2, 5):
        smart.event("pointer_move", (at[0] - 5 * i, at[1]), buttons=(1,))
        assert view.view is view.draft and smart.viewer.marks.dots() == []
    monkeypatch.undo()
    draft, (x, y, width, height) = smart.frame(), (int(v) for v in smart.viewer.area())
    smart.event("pointer_up", (at[0] - 20, at[1]), button=1)
    rest = smart.frame(3)
    assert view.view is view.whole
    smart.canvas.submit_event({"event_type": "key_down", "key": " ", "modifiers": ()})
    before = smart.frame(2)
    smart.canvas.submit_event({"event_type": "key_up", "key": " ", "modifiers": ()})
    inside = np.s_[y : y + height, x : x + width]
    assert seen_change(draft[inside], before[inside]) == pytest.approx(seen_change(rest[inside], before[inside]), rel=0.1)
    assert np.abs(draft[inside].astype(int) - rest[inside]).mean() < 1.5
    assert view.whole.resolved.contrast == pytest.approx(8, rel=0.02)


class Places:
    """Candidates as detect finds them."""

    class One:
        guess = False
        lamps = ()

        def __init__(self, position: tuple[float, float], kind: str, confidence: float) -> None:
            self.position, self.kind, self.confidence = position, kind, confidence

    unsure = (One((0.3, 0.4), "glow", 0.38), One((0.7, 0.2), "opening", 0.3), One((0.5, -0.4), "beyond", 0.2))


def test_candidates_are_dots_to_click(smart: Driver, forest: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(st, "find_lights", lambda *_: Places.unsure)
    smart.viewer.open(forest)
    smart.frame(2)
    state, viewer = smart.state, smart.viewer
    assert "unsure: perhaps at 0.30,0.40 (0.38)" in state.doubt and "message" in smart.places and state.lights[0].kind == "glow"
    assert [number for number, _ in viewer.marks.dots()] == [1, 2]
    dots = smart.frame()
    smart.click("candidates")
    assert viewer.marks.dots() == [] and np.abs(smart.frame(2)[:, 360:].astype(int) - dots[:, 360:]).max() > 50
    smart.click("candidates")
    beyond, away = controls.clamped(viewer.marks.dots()[1][1], viewer.area(), marks.EDGE)
    assert beyond[1] == viewer.area()[1] + marks.EDGE and away == pytest.approx((0, -1))
    smart.drag(beyond, beyond, 1)
    smart.event("double_click", beyond, button=1)  # the same click, perhaps
    assert (state.lights[0].position, state.lights[0].kind, state.ask) == ((0.5, -0.4), "beyond", "")
    smart.frame(2)
    smart.drag(viewer.marks.dots()[1][1], viewer.marks.dots()[1][1], 1)
    assert (state.lights[0].position, state.lights[0].kind) == ((0.7, 0.2), "opening")
    light = controls.to_canvas((0.7, 0.2), viewer.area())
    smart.drag(light, (light[0] + 8, light[1]))
    assert state.lights[0].kind == "opening"  # still at it
    light = controls.to_canvas(state.lights[0].position, viewer.area())
    smart.drag(light, (light[0] - 120, light[1] + 60))
    assert state.lights[0].kind is None


def test_a_picture_without_a_light_asks_for_it(smart: Driver, folder: Path, codes: np.ndarray) -> None:
    grey = np.full_like(codes, 90)
    write_image(folder / "grey.png", None, encoded=grey, overwrite=True)
    smart.viewer.open(str(folder / "grey.png"))
    smart.frame(2)
    assert "no light found" in smart.state.doubt and smart.state.lights[0].position == (0.5, 0.25) and "message" in smart.places
    smart.event("double_click", controls.to_canvas((0.6, 0.7), smart.viewer.area()), button=1)
    smart.frame(2)
    assert "no light" not in smart.state.doubt and "nothing stands before the light" in smart.state.doubt  # it declines
    assert np.array_equal(read_image(smart.viewer.screenshot()).codes, grey)


def test_a_picture_stays_as_it_is_until_its_light_is_put_somewhere(
    smart: Driver, forest: str, trees: np.ndarray, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(st, "find_lights", lambda *_: [])
    smart.viewer.open(forest)
    smart.frame(2)
    assert np.array_equal(read_image(smart.viewer.screenshot()).codes, trees)
    assert not [word for word in command.command_line(smart.state) if word.startswith("--light")]
    at = controls.to_canvas((0.5, 0.25), smart.viewer.area())
    smart.drag(at, controls.to_canvas((0.3, 0.4), smart.viewer.area()))
    assert smart.state.doubt == "" and "--light=0.3,0.4" in command.command_line(smart.state)
    assert np.array_equal(read_image(smart.viewer.screenshot()).codes, applied(smart, trees).codes)


def test_what_belongs_to_the_other_look_is_refused(smart: Driver, photo: str) -> None:
    with pytest.raises(AirlightError, match="belongs to the classic look"):
        app.Viewer(smart.canvas, photo, values={"density": 0.5, "strength": 2.0})
    with pytest.raises(AirlightError, match="a scene"):
        app.Viewer(smart.canvas, "table", values={"strength": 2.0})


def test_keys_show_the_picture_without_shafts(smart: Driver, trees: np.ndarray) -> None:
    def press(key: str, kind: str = "key_down") -> np.ndarray:
        smart.canvas.submit_event({"event_type": kind, "key": key, "modifiers": ()})
        smart.frame(2)
        return read_image(smart.viewer.screenshot()).codes

    lit = read_image(smart.viewer.screenshot()).codes
    assert np.array_equal(press(" "), trees) and np.array_equal(press(" "), trees)  # keys repeat
    assert np.array_equal(press(" ", "key_up"), lit) and not np.array_equal(lit, trees)
    assert np.array_equal(press("b"), trees) and np.array_equal(press("b"), lit)
    smart.click("split")
    seen = read_image(smart.viewer.screenshot()).codes
    assert np.array_equal(seen[:, :138], trees[:, :138]) and np.array_equal(seen[:, 142:], lit[:, 142:])
    smart.click("split")


def test_the_source_of_the_look_and_two_lights(smart: Driver, trees: np.ndarray) -> None:
    smart.open_group("View")
    assert "debug" in smart.places
    smart.choose("debug", "source")
    emits = read_image(smart.viewer.screenshot()).codes
    assert np.ptp(emits, axis=2).max() == 0 and emits[72, 84, 0] > 200 and emits[150, 250, 0] < 60
    smart.choose("debug", "none")
    smart.open_group("View")
    smart.state.lights.append(LightControl((0.8, 0.2), (1.0, 0.5, 0.2)))
    smart.frame(2)
    assert np.array_equal(read_image(smart.viewer.screenshot()).codes, applied(smart, trees).codes)
    at = controls.to_canvas((0.8, 0.2), smart.viewer.area())
    smart.drag(at, (at[0] - 30, at[1] + 30))
    assert smart.state.current == 1 and smart.state.message == ""
    for size in ((500, 300), (60, 40), SIZE):
        smart.canvas.set_logical_size(*size)
        smart.frame(2)
    assert np.array_equal(read_image(smart.viewer.screenshot()).codes, applied(smart, trees).codes)
