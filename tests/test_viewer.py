"""The viewer: its panel driven offscreen by events, its pictures and scenes, its settings; no window is opened."""

import logging
import os
import shlex
import shutil
import subprocess
import sys
import time
import tracemalloc
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some

from airlight.cli import image as image_command
from airlight.cli import main
from airlight.cli import render as render_command
from airlight.cli.options import gather
from airlight.colour import srgb_decode, srgb_encode
from airlight.composite.blend import CompositeSettings, blend
from airlight.composite.mix import LinearComposite
from airlight.errors import AirlightError
from airlight.files import read_image, write_image
from airlight.gpu.device import open_device
from airlight.lights import Light
from airlight.look.apply import apply
from airlight.look.measure import oklab
from airlight.options import Look, Medium, Parameters, declared, presets
from airlight.scatter.methods import of_screen
from airlight.viewer import app, controls
from airlight.viewer import state as st
from airlight.viewer.state import Lamp, ViewerState

SIZE, SCENE_SIZE = (1280, 720), (800, 560)
CLASSIC = {"look": "classic"}


class Driver:
    """A viewer on an offscreen canvas, and hands: the one place that touches the canvas's private `_process_events`."""

    def __init__(self, source: Any, folder: Path, **options: Any) -> None:
        from rendercanvas.offscreen import RenderCanvas

        self.canvas = RenderCanvas(size=SIZE)
        self.viewer = app.Viewer(self.canvas, source, folder=str(folder), **options)
        self.state = self.viewer.state
        self.frame(3)

    @property
    def places(self) -> Any:
        return self.viewer.panel.places

    def frame(self, count: int = 1) -> np.ndarray:
        for _ in range(count):
            self.canvas._process_events()
            pixels = self.canvas.draw()
        return np.asarray(pixels)[..., :3]

    def event(self, kind: str, at: tuple[float, float], **more: Any) -> None:
        buttons = {"button": 0, "buttons": (), "modifiers": (), "ntouches": 0, "touches": {}}
        self.canvas.submit_event({"event_type": kind, "x": at[0], "y": at[1], **buttons, **more})
        self.frame()

    def drag(self, start: tuple[float, float], end: tuple[float, float], steps: int = 3) -> None:
        self.event("pointer_move", start)
        self.event("pointer_down", start, button=1, buttons=(1,))
        for i in range(1, steps + 1):
            at = (start[0] + (end[0] - start[0]) * i / steps, start[1] + (end[1] - start[1]) * i / steps)
            self.event("pointer_move", at, buttons=(1,))
        self.event("pointer_up", end, button=1)
        self.frame()

    def where(self, name: str, along: float = 0.5) -> tuple[float, float]:
        """A place in a widget, which is scrolled to."""
        for _ in range(40):
            bottom = self.places["message"][1] - 12 if "message" in self.places else self.canvas.get_logical_size()[1] - 8
            x0, y0, x1, y1 = self.places[name]
            if (y0 >= 0 and y1 <= bottom) or ":" in name or name == "message":
                break
            self.event("pointer_move", (60.0, 300.0))
            self.event("wheel", (60.0, 300.0), dx=0, dy=-60 if y0 < 0 else 60)
            self.frame(2)
        x0, y0, x1, y1 = self.places[name]
        return x0 + along * (x1 - x0), (y0 + y1) / 2

    def click(self, name: str, along: float = 0.5) -> None:
        at = self.where(name, along)
        self.drag(at, at, 1)

    def choose(self, name: str, choice: str) -> None:
        self.click(name)
        self.frame()
        self.click(f"{name}:{choice}", 0.2)
        self.frame(2)

    def open_group(self, name: str) -> None:
        self.click(f"group {name}", 0.2)
        self.frame()

    def type(self, name: str, text: str) -> None:
        self.click(name)
        held = ("Control",)
        for kind, key in (("key_down", "Control"), ("key_down", "a"), ("key_up", "a")):
            self.canvas.submit_event({"event_type": kind, "key": key, "modifiers": held})
            self.frame()
        self.canvas.submit_event({"event_type": "key_up", "key": "Control", "modifiers": ()})
        self.frame()
        for letter in text:
            self.canvas.submit_event({"event_type": "char", "data": letter, "is_composing": False, "modifiers": ()})
        self.frame(2)


@pytest.fixture(autouse=True)
def drawn_without_errors(caplog: pytest.LogCaptureFixture) -> Iterator[None]:
    """rendercanvas logs what fails in a frame or in a handler, and goes on."""
    with caplog.at_level(logging.WARNING):
        yield
    records = [*caplog.get_records("setup"), *caplog.get_records("call")]
    bad = [r.getMessage() + str(r.exc_text or "") for r in records if r.name.startswith(("rendercanvas", "pygfx", "wgpu"))]
    assert not bad


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("viewer")


@pytest.fixture(scope="module")
def codes() -> np.ndarray:
    """(H, W, 3) uint8: a sun at 0.3, 0.4 behind bars."""
    y, x = np.mgrid[:180, :280]
    sun = np.exp(-((x - 84) ** 2 + (y - 72) ** 2) / 300)
    picture = 0.1 + 0.15 * (y / 180) + sun
    picture[:, 150:160] *= 0.2
    return np.rint(255 * np.clip(picture[..., None] * (1, 0.85, 0.6), 0, 1)).astype(np.uint8)


@pytest.fixture(scope="module")
def photo(folder: Path, codes: np.ndarray) -> str:
    path = str(folder / "sun.png")
    write_image(path, None, encoded=codes)
    return path


@pytest.fixture(scope="module")
def kept(photo: str, folder: Path) -> Driver:
    """One viewer for many tests: each one made leaves some MiB behind."""
    return Driver(photo, folder)


@pytest.fixture
def hands(kept: Driver, photo: str) -> Driver:
    kept.viewer.open(photo, [Lamp((0.3, 0.4))])
    kept.state.shafts, kept.state.timing = True, False
    kept.state.sources = (*st.SCENES, photo)
    kept.state.command = kept.state.path = ""
    st.set_values(kept.state, CLASSIC)
    kept.frame(2)
    for name in [n.removeprefix("group ") for n in kept.places if n.startswith("group ")]:
        inside = {"Method": "method", "Occlusion": "occlusion", "Composite": "mix", "Shafts in the scene": "region", "Times": "passes"}
        if {**inside, "Presets and settings": "preset", "Look": "look"}.get(name) in kept.places:
            kept.open_group(name)
    kept.frame(2)
    return kept


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


# sliders and declarations


def test_each_parameter_of_a_picture_has_a_widget(hands: Driver) -> None:
    groups = ("Method", "Occlusion", "Composite", "Look")
    for group in groups:
        hands.open_group(group)
    assert {d.name for d in declared() if d.group != "look"} | {"look"} <= set(hands.places)
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


def test_what_does_not_go_with_a_method_is_reset_or_told() -> None:
    state = ViewerState("x.png", True)
    st.set_values(state, {"method": "radial", "scale": 0.5, "normalization": "listing"})
    st.change(state, "method", "bands")
    assert st.values(state) == {"method": "bands", **CLASSIC}
    st.change(state, "scale", 0.5)
    assert state.is_error and "scale" in state.message and st.values(state) == {"method": "bands", **CLASSIC}


def test_unset_parameters_show_what_they_are(hands: Driver) -> None:
    hands.open_group("Occlusion")
    found = hands.state.resolved["threshold"]
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


# the smart look


@pytest.fixture(scope="module")
def trees() -> np.ndarray:
    """(H, W, 3) uint8: a low sun at 0.3, 0.4 behind trunks."""
    y, x = np.mgrid[:180, :280]
    sky = 0.3 + 0.6 * np.exp(-((x - 84) ** 2 + (y - 72) ** 2) / 5000)
    sky[x % 36 < 10] = 0.12
    sky[np.hypot(x - 84, y - 72) < 9] = 1
    sky[130:] *= 0.5
    return np.rint(255 * np.clip(sky[..., None] * (1, 0.9, 0.75), 0, 1)).astype(np.uint8)


@pytest.fixture(scope="module")
def forest(folder: Path, trees: np.ndarray) -> str:
    path = str(folder / "forest.png")
    write_image(path, None, encoded=trees)
    return path


@pytest.fixture
def smart(hands: Driver, forest: str) -> Driver:
    """A picture as it is shown unless the sum is asked for, its light where the sun is."""
    st.reset(hands.state)
    hands.viewer.open(forest, [Lamp((0.3, 0.4), kind="disc")])
    hands.state.held = False
    hands.state.candidates_shown = True
    hands.frame(2)
    for group, inside in (("Light", "light 0"), ("More of the look", "fineness"), ("View", "debug")):
        if inside in hands.places:
            hands.open_group(group)
    return hands


def applied(driver: Driver, pixels: np.ndarray, **look: Any) -> Any:
    """What the look makes of these pixels with the driver's lights."""
    from airlight import Renderer
    from airlight.files import to_linear

    lights = [Light(lamp.place, lamp.color, lamp.strength, kind=lamp.kind) for lamp in driver.state.lamps]
    linear = to_linear(pixels)[0] if pixels.dtype == np.uint8 else pixels
    return apply(Renderer(), pixels, linear, lights, Look(**look), float_output=pixels.dtype != np.uint8)


def seen_change(after: np.ndarray, before: np.ndarray) -> float:
    """The 95th percentile of what 8-bit codes change by, in hundredths of OKLab."""
    first, second = (oklab(srgb_decode(codes / 255)) for codes in (before, after))
    return float(np.percentile(100 * np.sqrt(np.square(second - first).sum(axis=-1)), 95))


def test_a_picture_has_the_smart_look_at_once(smart: Driver, forest: str, trees: np.ndarray) -> None:
    smart.viewer.open(forest)
    smart.frame(2)
    state = smart.state
    assert state.is_smart and st.values(state) == {} and state.lamps[0].place == pytest.approx((0.3, 0.4), abs=0.06)
    seen = read_image(smart.viewer.screenshot()).codes
    assert np.array_equal(seen, applied(smart, trees).codes)
    words = st.command_line(state)[1:]
    words[words.index("-o") + 1] = out = str(Path(forest).with_name("forest-out.png"))
    assert main([*words, "-y"]) == 0 and np.array_equal(read_image(out).codes, seen)
    assert {"strength", "warmth", "length", "save picture", "split", "candidates"} <= set(smart.places)
    assert not {"fineness", "samples", "light 0", "path", "debug"} & set(smart.places)  # folded


def test_sliders_of_the_look(smart: Driver, trees: np.ndarray) -> None:
    state = smart.state
    smart.drag(smart.where("strength", 0.5), smart.where("strength", 0.25))
    assert state.look.strength == pytest.approx(0.5, abs=0.06)
    assert state.resolved["warmth"] == pytest.approx(0.6 * 0.35, abs=0.15)
    shown = state.resolved["warmth"]
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
    assert smart.state.is_smart and "--density" not in st.command_line(smart.state)
    assert np.array_equal(smart.frame(2)[:, 360:], first)
    assert not st.change(smart.state, "strength", 0.0) and np.abs(smart.frame(2)[:, 360:].astype(int) - first).max() > 10


@pytest.mark.parametrize("values", [{"density": 0.97}, presets.load("vesper"), {"blend": "add"}])
def test_what_names_the_sum_shows_the_sum(values: dict[str, Any]) -> None:
    state = ViewerState("a.png", True)
    st.set_values(state, values)
    assert not state.is_smart and "--look" in st.command_line(state)
    st.set_values(state, {**values, "look": "smart"})
    assert state.is_smart and st.command_line(state) == ["airlight", "image", "a.png", "-o", "a-shafts.png"]


def test_floats_and_sixteen_bits_have_the_smart_look(smart: Driver, folder: Path, trees: np.ndarray) -> None:
    linear = ((trees / 255.0) ** 2.2 * 3).astype(np.float32)
    write_image(folder / "look.exr", linear, overwrite=True, bits=32)
    smart.viewer.open(str(folder / "look.exr"), [Lamp((0.3, 0.4), kind="disc")])
    smart.frame(2)
    found = applied(smart, linear)
    wanted = srgb_encode(np.clip(linear * (1 - found.taken[..., None]) + found.added, 0, 1))
    assert found.taken.max() == 0 and found.added.max() > 0.01
    assert np.abs(read_image(smart.viewer.screenshot()).codes / 255 - wanted).max() <= 1.5 / 255  # half floats
    light = controls.to_canvas((0.3, 0.4), smart.viewer.area())
    smart.drag(light, (light[0] + 20, light[1]))
    deep = trees.astype(np.uint16) * 257
    write_image(folder / "look16.png", None, encoded=deep, overwrite=True, bits=16)
    smart.viewer.open(str(folder / "look16.png"), [Lamp((0.3, 0.4), kind="disc")])
    smart.frame(2)
    assert np.abs(read_image(smart.viewer.screenshot()).codes.astype(int) - applied(smart, trees).codes).max() <= 1


def test_a_grey_picture_stays_grey(smart: Driver, folder: Path, trees: np.ndarray) -> None:
    import OpenImageIO as oiio

    source, out = str(folder / "grey-trees.png"), str(folder / "grey-out.png")
    oiio.ImageBuf(np.ascontiguousarray(trees[..., 1:2])).write(source)
    smart.viewer.open(source, [Lamp((0.3, 0.4), kind="disc")])
    smart.frame(2)
    seen = read_image(smart.viewer.screenshot()).codes
    words = st.command_line(smart.state)[1:]
    words[words.index("-o") + 1] = out
    assert main(words) == 0
    off = np.abs(seen.astype(int) - read_image(out).codes)  # by another dither
    assert np.ptp(seen, axis=2).max() <= 1 and off.max() <= 2 and off.mean() < 0.6
    assert np.abs(seen.astype(int) - trees[..., 1:2]).max() > 10 and smart.state.resolved["warmth"] == 0


def test_a_drag_is_followed_by_a_draft_that_allocates_nothing(smart: Driver, monkeypatch: pytest.MonkeyPatch) -> None:
    """A photograph larger than the canvas; the machine is a GPU or none."""
    source = str(Path(__file__).parents[1] / "examples/photos/beacon-street-sunset.jpg")
    smart.viewer.open(source, [Lamp((0.872, 0.459), kind="disc")])
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
        assert view.view is view.draft and smart.viewer.dots() == []
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
    monkeypatch.setattr(st, "find_lights", lambda _: Places.unsure)
    smart.viewer.open(forest)
    smart.frame(2)
    state, viewer = smart.state, smart.viewer
    assert "unsure: perhaps at 0.30,0.40 (0.38)" in state.doubt and "message" in smart.places and state.lamps[0].kind == "glow"
    assert [number for number, _ in viewer.dots()] == [1, 2]
    dots = smart.frame()
    smart.click("candidates")
    assert viewer.dots() == [] and np.abs(smart.frame(2)[:, 360:].astype(int) - dots[:, 360:]).max() > 50
    smart.click("candidates")
    beyond, away = controls.clamped(viewer.dots()[1][1], viewer.area(), app.EDGE)
    assert beyond[1] == viewer.area()[1] + app.EDGE and away == pytest.approx((0, -1))
    smart.drag(beyond, beyond, 1)
    smart.event("double_click", beyond, button=1)  # the same click, perhaps
    assert (state.lamps[0].place, state.lamps[0].kind, state.ask) == ((0.5, -0.4), "beyond", "")
    smart.frame(2)
    smart.drag(viewer.dots()[1][1], viewer.dots()[1][1], 1)
    assert (state.lamps[0].place, state.lamps[0].kind) == ((0.7, 0.2), "opening")
    light = controls.to_canvas((0.7, 0.2), viewer.area())
    smart.drag(light, (light[0] + 8, light[1]))
    assert state.lamps[0].kind == "opening"  # still at it
    light = controls.to_canvas(state.lamps[0].place, viewer.area())
    smart.drag(light, (light[0] - 120, light[1] + 60))
    assert state.lamps[0].kind is None


def test_a_picture_without_a_light_asks_for_it(smart: Driver, folder: Path, codes: np.ndarray) -> None:
    grey = np.full_like(codes, 90)
    write_image(folder / "grey.png", None, encoded=grey, overwrite=True)
    smart.viewer.open(str(folder / "grey.png"))
    smart.frame(2)
    assert "no light found" in smart.state.doubt and smart.state.lamps[0].place == (0.5, 0.25) and "message" in smart.places
    smart.event("double_click", controls.to_canvas((0.6, 0.7), smart.viewer.area()), button=1)
    smart.frame(2)
    assert "no light" not in smart.state.doubt and "nothing stands before the light" in smart.state.doubt  # it declines
    assert np.array_equal(read_image(smart.viewer.screenshot()).codes, grey)


def test_a_picture_stays_as_it_is_until_its_light_is_put_somewhere(
    smart: Driver, forest: str, trees: np.ndarray, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(st, "find_lights", lambda _: [])
    smart.viewer.open(forest)
    smart.frame(2)
    assert np.array_equal(read_image(smart.viewer.screenshot()).codes, trees)
    assert not [word for word in st.command_line(smart.state) if word.startswith("--light")]
    at = controls.to_canvas((0.5, 0.25), smart.viewer.area())
    smart.drag(at, controls.to_canvas((0.3, 0.4), smart.viewer.area()))
    assert smart.state.doubt == "" and "--light=0.3,0.4" in st.command_line(smart.state)
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


def saved(driver: Driver) -> str:
    """The line that says what became of saving."""
    for _ in range(2000):
        driver.frame()
        if driver.viewer.saving is None and not driver.state.asked:
            return driver.state.message
        time.sleep(0.02)
    pytest.fail("it does not end")


@pytest.mark.parametrize("look", ["smart", "classic"])
def test_saving_writes_what_the_command_writes(smart: Driver, folder: Path, codes: np.ndarray, look: str) -> None:
    """A JPEG with a title and a colour profile, and 16 bits with transparency."""
    jpeg, deep = folder / f"{look}.jpg", folder / f"{look}16.png"
    shutil.copy(Path(__file__).parents[1] / "examples/photos/sea-sunset.jpg", jpeg)
    alpha = np.linspace(0.2, 1, codes.shape[0] * codes.shape[1], dtype=np.float32).reshape(codes.shape[:2])
    write_image(deep, None, encoded=codes.astype(np.uint16) * 257, alpha=alpha, bits=16)
    for source in (jpeg, deep):
        smart.viewer.open(str(source), [Lamp((0.31, 0.42))])
        st.change(smart.state, "look", look)
        smart.canvas.submit_event({"event_type": "key_down", "key": "s", "modifiers": ("Control",)})
        smart.frame()
        assert "saving" in smart.state.message
        ours = source.with_name(f"{source.stem}-shafts{source.suffix}")
        assert saved(smart) == f"{ours} saved" and not smart.state.is_error
        words = st.command_line(smart.state)[1:]
        theirs = source.with_name(f"theirs{source.suffix}")
        words[words.index("-o") + 1] = str(theirs)
        assert main([*words, "-y"]) == 0
        assert ours.read_bytes() == theirs.read_bytes()
    assert read_image(ours).bits == 16 and read_image(ours).alpha is not None
    smart.state.asked.append(("save", ""))
    assert saved(smart) == f"{folder / look}16-shafts-2.png saved"
    deep.unlink()
    smart.state.asked.append(("save", ""))
    assert "not saved" in saved(smart) and smart.state.is_error


def test_saving_an_array(folder: Path, codes: np.ndarray) -> None:
    other = Driver(app.from_array(codes), folder, lamps=[Lamp((0.3, 0.4))], values=CLASSIC)
    other.state.asked.append(("save", ""))
    assert saved(other) == f"{folder / 'array-shafts.png'} saved"
    assert np.array_equal(read_image(folder / "array-shafts.png").codes, read_image(other.viewer.screenshot()).codes)


def test_the_source_of_the_look_and_two_lights(smart: Driver, trees: np.ndarray) -> None:
    smart.open_group("View")
    assert "debug" in smart.places
    smart.choose("debug", "source")
    emits = read_image(smart.viewer.screenshot()).codes
    assert np.ptp(emits, axis=2).max() == 0 and emits[72, 84, 0] > 200 and emits[150, 250, 0] < 60
    smart.choose("debug", "none")
    smart.open_group("View")
    smart.state.lamps.append(Lamp((0.8, 0.2), (1.0, 0.5, 0.2)))
    smart.frame(2)
    assert np.array_equal(read_image(smart.viewer.screenshot()).codes, applied(smart, trees).codes)
    at = controls.to_canvas((0.8, 0.2), smart.viewer.area())
    smart.drag(at, (at[0] - 30, at[1] + 30))
    assert smart.state.current == 1 and smart.state.message == ""
    for size in ((500, 300), (60, 40), SIZE):
        smart.canvas.set_logical_size(*size)
        smart.frame(2)
    assert np.array_equal(read_image(smart.viewer.screenshot()).codes, applied(smart, trees).codes)


def test_marks_beyond_the_canvas_are_drawn_at_its_border() -> None:
    area = (344.0, 0.0, 900.0, 700.0)
    assert controls.clamped((500.0, 300.0), area, 14) == ((500.0, 300.0), None)
    mark, away = controls.clamped((500.0, -86.0), area, 14)
    assert mark == (500.0, 14.0) and away == (0.0, -1.0)


# the picture


def test_the_picture_is_that_of_airlight_image(hands: Driver, photo: str, folder: Path) -> None:
    out = folder / "out.png"
    assert main(["image", photo, "-o", str(out), "--light", "0.3,0.4", "-y", "--look", "classic"]) == 0
    name = hands.viewer.screenshot()
    assert np.array_equal(read_image(name).codes, read_image(out).codes)


@pytest.mark.parametrize("options", [{}, {"blend": "screen", "veil": 0.4}, {"adapt": 0.7}])
def test_a_float_picture_is_that_of_airlight_image(folder: Path, hands: Driver, codes: np.ndarray, options: dict[str, Any]) -> None:
    source, out = folder / "sun.exr", folder / "sun-out.exr"
    write_image(source, (codes / 255.0).astype(np.float32) ** 2 * 3, overwrite=True, bits=32)
    options = options | CLASSIC
    args = [word for key, v in options.items() for word in (f"--{key}", str(v))]
    assert main(["image", str(source), "-o", str(out), "--light", "0.3,0.4", "-y", *args]) == 0
    hands.viewer.open(str(source), [Lamp((0.3, 0.4))])
    st.set_values(hands.state, options)
    hands.frame(3)
    seen = read_image(hands.viewer.screenshot()).codes / 255
    wanted = srgb_encode(np.clip(read_image(out).codes[..., :3], 0, 1))
    assert np.abs(seen - wanted).max() <= 1.5 / 255  # half floats


def test_linear_composite_equals_its_twin() -> None:
    rng = np.random.default_rng(3)
    device = open_device()
    image, layer = rng.gamma(0.5, 1, (2, 40, 60, 3)).astype(np.float32)
    textures = []
    for pixels, format, kind in ((image, "rgba32float", np.float32), (layer, "rgba16float", np.float16)):
        rgba = np.ones((40, 60, 4), kind)
        rgba[..., :3] = pixels
        textures.append(device.texture(60, 40, format))
        device.write(textures[-1], rgba, 60 * rgba[0, 0].nbytes)
    for rule in (CompositeSettings("add", 0.6, 0.0), CompositeSettings("screen", 1.0, 0.3), CompositeSettings("add", None, 0.5)):
        composite = LinearComposite(device, *textures, rule, 1.0)
        composite.measure(rule)
        encoder = device.encoder()
        composite.record(encoder)
        device.submit(encoder)
        got = np.frombuffer(device.read(composite.result, 8), np.float16).reshape(40, 60, 4)[..., :3].astype(np.float32)
        want, _ = blend(image, layer.astype(np.float16).astype(np.float32), rule)
        np.testing.assert_allclose(got, want, rtol=2e-3, atol=1e-4)


def test_dragging_the_light(hands: Driver) -> None:
    area = hands.viewer.area()
    start = controls.to_canvas((0.3, 0.4), area)
    before = hands.frame()
    hands.drag(start, controls.to_canvas((0.7, 0.2), area))
    assert hands.state.lamps[0].place == pytest.approx((0.7, 0.2), abs=0.01)
    assert np.abs(hands.frame().astype(int) - before).max() > 20
    hands.drag(controls.to_canvas((0.5, 0.9), area), controls.to_canvas((0.1, 0.9), area))  # not at the light
    assert hands.state.lamps[0].place == pytest.approx((0.7, 0.2), abs=0.01)


def test_a_light_below_the_panel_is_not_dragged(hands: Driver) -> None:
    hands.state.lamps[0].place = controls.to_picture(hands.where("samples"), hands.viewer.area())
    place = hands.state.lamps[0].place
    hands.drag(hands.where("samples"), hands.where("samples", 0.8))
    assert hands.state.lamps[0].place == place
    assert hands.state.parameters.samples > 200


def test_a_double_click_puts_the_light_there(hands: Driver) -> None:
    hands.event("double_click", controls.to_canvas((0.6, 0.7), hands.viewer.area()), button=1)
    assert hands.state.lamps[0].place == pytest.approx((0.6, 0.7), abs=0.01)
    hands.event("double_click", hands.where("samples"), button=1)  # of the panel
    assert hands.state.lamps[0].place == pytest.approx((0.6, 0.7), abs=0.01)


def test_light_colour_and_strength(hands: Driver) -> None:
    bright = hands.frame(2)[:, 400:].astype(int)
    hands.drag(hands.where("strength 0", 0.25), hands.where("strength 0", 0.0))
    assert hands.state.lamps[0].strength == 0
    dark = hands.frame(2)[:, 400:].astype(int)
    assert (dark <= bright + 1).all() and (bright - dark).max() > 5


def test_split(hands: Driver, codes: np.ndarray) -> None:
    lit = hands.frame()
    hands.click("split")
    assert hands.state.split == 0.5
    area = hands.viewer.area()
    hands.drag(controls.to_canvas((0.5, 0.3), area), controls.to_canvas((0.2, 0.3), area))
    assert hands.state.split == pytest.approx(0.2, abs=0.01)
    seen = read_image(hands.viewer.screenshot()).codes
    edge = round(0.2 * codes.shape[1])
    assert np.array_equal(seen[:, : edge - 2], codes[:, : edge - 2])
    assert not np.array_equal(seen[:, edge + 2 :], codes[:, edge + 2 :])
    hands.click("split")
    assert hands.state.split is None and np.array_equal(hands.frame()[:, 400:], lit[:, 400:])


def test_without_shafts_the_picture_as_it_was(hands: Driver, codes: np.ndarray) -> None:
    hands.click("shafts")
    assert not hands.state.shafts
    assert np.array_equal(read_image(hands.viewer.screenshot()).codes, codes)


def test_debug_views(hands: Driver, codes: np.ndarray) -> None:
    from airlight import Renderer
    from airlight.occlusion.automatic import settled
    from airlight.scatter.render import render_source

    hands.choose("debug", "occlusion")
    seen = read_image(hands.viewer.screenshot()).codes
    rgba = np.dstack([codes, np.full(codes.shape[:2], 255, np.uint8)])
    p = settled(Parameters(), hands.viewer.picture.coarse, [app_light(hands)])
    mask = render_source(Renderer(), rgba, p, fraction=True)[..., 0]
    assert np.abs(seen[..., 0] / 255.0 - mask).max() < 0.01 and mask.max() > 0.9 > 0.1 > mask.min()
    hands.choose("debug", "source")
    assert not np.array_equal(read_image(hands.viewer.screenshot()).codes, seen)
    hands.choose("debug", "lines")  # a small picture is summed directly
    assert hands.state.is_error == (hands.state.debug is None)
    hands.choose("debug", "none") if hands.state.debug else None


def app_light(hands: Driver) -> Any:
    from airlight.lights import Light

    lamp = hands.state.lamps[0]
    return Light(lamp.place, lamp.color, lamp.strength)


def test_times(hands: Driver) -> None:
    hands.open_group("Times")
    hands.frame(2)
    names = [label for label, ms in hands.state.passes if ms > 0]
    assert "source" in names and "composite" in names and len(names) >= 3
    hands.open_group("Times")
    assert not hands.state.timing


def test_nothing_is_computed_while_nothing_changes(hands: Driver, monkeypatch: pytest.MonkeyPatch) -> None:
    hands.frame(3)
    monkeypatch.setattr(type(hands.viewer.picture.plan), "submit", lambda *_, **__: pytest.fail("computed again"))
    hands.frame(3)


# settings


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
        hands.state.asked.append(("open", missing))
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
    assert hands.state.lamps[0].place == pytest.approx((0.7, 0.4), abs=0.03)  # found


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


def some_values(scenes: bool = True) -> Any:
    """Values of declared parameters, in their bounds; few at a time. scenes: also choices that only scenes have."""
    kinds: dict[str, Any] = {}
    own = {} if scenes else {d.name: d for d in declared()}
    for d in (own.get(d.name, d) for d in declared(scenes=True)):
        if d.choices:
            kinds[d.name] = some.sampled_from(d.choices)
        elif d.kind is bool:
            kinds[d.name] = some.booleans()
        elif d.kind is int:
            kinds[d.name] = some.integers(int(d.low), int(d.high)) | some.sampled_from(d.words or (int(d.low),))
        elif d.kind is float:
            kinds[d.name] = some.floats(d.low, d.high, exclude_min=d.low_open)
            kinds[d.name] = some.tuples(*[kinds[d.name]] * 3) | kinds[d.name] if d.is_triple else kinds[d.name]
        else:
            kinds[d.name] = some.from_regex("#[0-9a-f]{6}", fullmatch=True)
    return some.fixed_dictionaries({}, optional=kinds)


@given(some_values())
def test_settings_survive_a_file(tmp_path_factory: pytest.TempPathFactory, wanted: dict[str, Any]) -> None:
    state = ViewerState("a.png", True)
    try:
        st.set_values(state, wanted)
    except AirlightError:
        return
    path = tmp_path_factory.mktemp("settings") / "a.toml"
    st.save(state, str(path))
    assert presets.load(path) == st.values(state)


@given(some_values(scenes=False), some.lists(some.tuples(some.floats(-3, 3), some.floats(-3, 3)), min_size=1, max_size=3))
def test_the_command_says_what_is_shown(wanted: dict[str, Any], places: list[tuple[float, float]]) -> None:
    state = ViewerState("a picture.png", True)
    try:
        st.set_values(state, wanted)
    except AirlightError:
        return
    state.lamps = [Lamp(place, (1.0, 0.5, 0.25), 2.0) for place in places]
    words = shlex.split(st.as_text(st.command_line(state)))
    assert words[:2] == ["airlight", "image"]
    with image_command.image.make_context("image", words[2:]) as ctx:
        values = gather(ctx, None)
        lights = image_command.image_request(ctx).lights
    said = {d.name: st.value(state, d.name) for d in st.shown(state) if st.value(state, d.name) != d.default}
    assert values == {name: v for name, v in said.items() if (name, v) != ("look", "smart")}  # which is the default
    assert ctx.params["sources"] == ("a picture.png",)
    for light, place in zip(lights, places, strict=True):
        assert [float(v) for v in light.position.split(",")] == pytest.approx(place, abs=1e-5)
        assert (light.color, light.strength) == ((1.0, 0.5, 0.25), 2.0)


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


# the window


def test_resizes(hands: Driver) -> None:
    before = hands.frame(2)
    for size in ((700, 500), (200, 100), (1, 1), (1920, 1080), SIZE):
        hands.canvas.set_logical_size(*size)
        frame = hands.frame(2)
        if size != (1, 1):
            assert frame.shape[:2] == size[::-1]
    assert np.array_equal(hands.frame(2), before)


def test_the_panel_can_be_hidden(hands: Driver) -> None:
    for width in (0, 344):
        for kind in ("key_down", "key_up"):
            hands.canvas.submit_event({"event_type": kind, "key": "h", "modifiers": ()})
        hands.frame(2)
        assert hands.viewer.panel.width == width and ("samples" in hands.places) == (width > 0)


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
    assert len([line for line in capsys.readouterr().err.strip().splitlines() if not line.startswith("light at")]) == 3


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
    assert shown.state.lamps[0].place == (0.2, 0.3) and shown.state.parameters.density == 0.5
    assert shown.canvas.draw().shape == (400, 640, 4)
    monkeypatch.setitem(sys.modules, "rendercanvas.anywidget", None)
    with pytest.raises(AirlightError, match=r"airlight\[notebook\]"):
        airlight.view(codes)
    with pytest.raises(AirlightError):
        app.from_array(np.zeros((3, 3, 7)))


@pytest.mark.slow
@pytest.mark.parametrize("look", ["classic", "smart"])
def test_memory_does_not_grow(hands: Driver, look: str) -> None:
    """300 frames of lights, sliders, methods, presets and sizes, over and over."""

    def turn(i: int) -> None:
        state = hands.state
        state.lamps[0].place = (0.1 + 0.8 * (i % 10) / 10, 0.4)
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
    assert grown < 0.05 * first, f"{grown / 2**20:.1f} MiB more than {first / 2**20:.0f}"
    assert objects < 8 << 20


def resident() -> int:
    """Bytes."""
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


# scenes


def stage(name: str = "two boxes") -> Any:
    """A lamp that can be moved behind two boxes, one of which turns."""
    import pygfx as gfx

    from airlight.pygfx import SceneLight
    from airlight.scenes import Stage

    scene = gfx.Scene()
    scene.add(gfx.Background.from_color("#203040"), gfx.AmbientLight(intensity=0.5))
    boxes = [gfx.Mesh(gfx.box_geometry(1, 1, 1), gfx.MeshPhongMaterial(color="#a05030")) for _ in range(2)]
    boxes[0].local.position, boxes[1].local.position = (-1, 0, 0), (1.2, 0.3, 0)
    lamp = gfx.Mesh(gfx.sphere_geometry(0.4), gfx.MeshBasicMaterial(color="#ffffff"))
    lamp.local.position = (0, 0.5, -3)
    scene.add(*boxes, lamp)
    cameras = {}
    for key, x in (("front", 0.0), ("side", 4.0)):
        cameras[key] = gfx.PerspectiveCamera(50, depth_range=(0.1, 100))
        cameras[key].local.position = (x, 0.5, 6)
        cameras[key].look_at((0, 0, 0))
    light = SceneLight(target=lamp)

    def pose(t: float, camera: Any) -> None:
        boxes[0].local.euler_y = t
        if camera is cameras["side"]:
            camera.local.position = (4, 0.5 + 0.1 * t, 6)

    path = gfx.Line(gfx.Geometry(positions=np.array([[-2, -1, 0], [2, -1, 0]], np.float32)), gfx.LineMaterial(thickness=9, color="#ff0000"))
    path.visible = False
    scene.add(path)
    return Stage(name, scene, cameras, [light], 4.0, pose, np.zeros(3), 3.0, light, path)


@pytest.fixture
def scene(hands: Driver, monkeypatch: pytest.MonkeyPatch) -> Iterator[Driver]:
    monkeypatch.setattr(app, "_open_scene", lambda name: stage(name))
    hands.viewer.open("table")
    hands.state.playing = False
    hands.canvas.set_logical_size(*SCENE_SIZE)
    hands.frame(3)
    yield hands
    hands.canvas.set_logical_size(*SIZE)


def test_a_scene(scene: Driver) -> None:
    state = scene.state
    assert not state.is_image and state.duration == 4.0
    seen = scene.frame()
    scene.click("shafts")
    dark = scene.frame(2)
    assert (seen[:, 360:].astype(int) - dark[:, 360:]).max() > 10
    scene.click("shafts")
    assert np.array_equal(scene.frame(2)[:, 360:], seen[:, 360:])


def test_the_path_is_drawn_on_request(scene: Driver) -> None:
    plain = scene.frame(2)
    scene.click("path drawn")
    assert scene.state.path_drawn and np.abs(scene.frame(2)[:, 360:].astype(int) - plain[:, 360:]).max() > 50
    scene.click("path drawn")
    assert np.array_equal(scene.frame(2)[:, 360:], plain[:, 360:])


def test_each_parameter_of_a_scene_has_a_widget(scene: Driver) -> None:
    groups = ("Shafts in the scene", "Composite", "Method")
    for group in groups:
        scene.open_group(group)
    assert {d.name for d in st.shown(scene.state)} <= set(scene.places)
    for group in groups:
        scene.open_group(group)


@pytest.fixture
def lit(scene: Driver, monkeypatch: pytest.MonkeyPatch) -> Driver:
    """A scene whose medium is lit, once; then only the panel is looked at."""
    st.set_values(scene.state, {"method": "march", "steps": "exact", "shadow_size": 64, "resolution": 0.25})
    scene.frame(2)
    monkeypatch.setattr(scene.viewer.scene, "show", lambda state: None)
    scene.canvas.set_logical_size(400, 1400)  # where nothing has to be scrolled to
    scene.frame(2)
    return scene


def test_each_parameter_of_a_medium_has_a_widget_only_where_it_means_something(lit: Driver) -> None:
    of_medium, of_view = ({d.name for d in declared(scenes=True) if d.methods == methods} for methods in (("march",), of_screen()))
    groups = ("Method", "Composite", "Shafts in the scene", "March")
    for group in groups:
        lit.open_group(group)
    seen = set(lit.places)
    assert {d.name for d in st.shown(lit.state)} <= seen and of_medium <= seen and not of_view & seen
    assert {"group Medium", "group March"} <= seen and "group Shafts" not in seen
    lit.choose("method", "epipolar")
    seen = set(lit.places)
    assert not of_medium & seen and {"samples", "group Shafts"} <= seen and not {"group Medium", "group March"} & seen
    lit.choose("method", "march")
    assert lit.state.march.steps == "exact"  # kept
    lit.choose("jitter", "gradient")
    assert lit.state.parameters.jitter == "gradient"
    lit.choose("jitter", "auto (gradient)")
    lit.frame()
    assert lit.state.parameters.jitter is None and lit.state.resolved["jitter"] == "blue"
    for group in groups:
        lit.open_group(group)


def test_three_numbers_a_word_and_a_truth(lit: Driver) -> None:
    state = lit.state
    lit.open_group("March")
    assert state.medium.sigma_t is None and state.resolved["sigma_t"] == pytest.approx([0.5 / 6] * 3, rel=1e-2)  # of a radius of 3 m
    lit.click("sigma_t auto")
    assert state.medium.sigma_t == state.resolved["sigma_t"]
    lit.drag(lit.where("sigma_t", 0.5), lit.where("sigma_t", 0.42))
    red, green, blue = state.medium.sigma_t
    assert red == blue == state.resolved["sigma_t"][0] and 0 < green < red
    lit.drag(lit.where("albedo", 0.9), lit.where("albedo", 0.83))
    assert state.medium.albedo[:2] == (0.9, 0.9) and 0.2 < state.medium.albedo[2] < 0.8
    lit.click("extinction", 0.1)
    lit.click("snap", 0.1)
    assert (state.medium.extinction, state.march.snap) == (False, True)
    lit.click("steps exact", 0.1)
    assert isinstance(state.march.steps, int)
    lit.click("steps auto", 0.1)
    assert state.march.steps is None and state.resolved["steps"] == 64
    lit.click("steps auto", 0.1)
    lit.click("steps exact", 0.1)
    assert state.march.steps == "exact"
    lit.choose("shadow_size", "512")
    values, _ = read_by_render(state)
    assert values == {d.name: st.value(state, d.name) for d in st.shown(state) if st.value(state, d.name) != d.default}
    assert values.items() >= {"method": "march", "extinction": False, "snap": True, "steps": "exact", "shadow_size": 512}.items()
    lit.click("reset medium")
    assert state.medium == Medium() and state.march.snap and state.message == ""
    lit.open_group("March")


def test_media_in_the_panel(lit: Driver) -> None:
    lit.choose("medium", "underwater")
    assert st.medium(lit.state) == "underwater" and lit.state.medium.anisotropy == 0.924
    st.change(lit.state, "max_distance", 50.0)
    lit.choose("medium", "smoke")
    assert lit.state.medium == Medium(**presets.load("smoke", presets.MEDIA), max_distance=50.0)
    st.change(lit.state, "albedo", 0.5)
    assert lit.state.medium.albedo == (0.5, 0.5, 0.5) and st.medium(lit.state) == ""
    lit.choose("medium", "clear-air")  # of which there is too little in six metres
    lit.frame(2)
    assert lit.state.message == "" and "too thin" in lit.state.doubt and "message" in lit.places
    lit.choose("medium", "own")
    lit.frame(2)
    assert lit.state.medium == Medium(max_distance=50.0) and lit.state.doubt == "" and "message" not in lit.places


def test_what_a_scene_is_meant_for_stands_where_the_user_says_nothing(scene: Driver, photo: str, monkeypatch: pytest.MonkeyPatch) -> None:
    meant = stage("dense")
    meant.settings = {"sigma_t": (0.1, 0.2, 0.3), "snap": True}
    st.set_values(scene.state, {"albedo": 0.5, "method": "march", "steps": "exact", "shadow_size": 64})
    monkeypatch.setattr(app, "_open_scene", lambda name: meant)
    scene.viewer.open("table")
    state = scene.state
    assert (state.medium.sigma_t, state.medium.albedo, state.march.snap) == ((0.1, 0.2, 0.3), (0.5, 0.5, 0.5), True)
    assert not {"--sigma-t", "--snap"} & set(st.command_line(state))
    st.change(state, "snap", False)
    assert "--no-snap" in st.command_line(state)
    st.change(state, "sigma_t", 0.4)
    st.change(state, "sigma_t", None)
    assert state.medium.sigma_t == (0.1, 0.2, 0.3)
    st.reset(state)
    assert state.march.snap and state.medium.albedo == (0.9, 0.9, 0.9)
    st.change(state, "method", "march")
    scene.viewer.open(photo)
    assert (state.parameters.method, state.medium) == ("epipolar", Medium()) and "march is for scenes" in state.message
    with pytest.raises(AirlightError, match="airlight render SCENE"):
        app.Viewer(scene.canvas, photo, values={"method": "march"})


def test_time_runs_pauses_and_is_scrubbed(scene: Driver) -> None:
    assert scene.state.time == 0
    scene.click("play")
    scene.frame(3)
    assert scene.state.playing and scene.state.time > 0
    scene.click("play")
    stood = scene.state.time
    scene.frame(3)
    assert not scene.state.playing and scene.state.time == stood
    scene.drag(scene.where("time", 0.5), scene.where("time", 0.75))
    assert scene.state.time == pytest.approx(3.0, abs=0.15)


def test_the_light_of_a_scene_is_dragged(scene: Driver) -> None:
    mark = scene.viewer.marks()[0]
    assert mark is not None
    scene.drag(mark, (mark[0] + 60, mark[1] - 40))
    now = scene.viewer.marks()[0]
    assert now == pytest.approx((mark[0] + 60, mark[1] - 40), abs=2)
    x, y, z = scene.state.lamps[0].place
    assert x > 0.1 and y > 0.55 and not scene.state.eye.moved
    assert np.allclose(scene.viewer.scene.stage.lights[0].target.world.position, (x, y, z), atol=1e-4)


def test_orbit_fly_and_cameras(scene: Driver) -> None:
    eye = scene.state.eye
    first = eye.eye
    scene.drag((500, 450), (600, 450))
    for _ in range(30):
        scene.frame()
    assert eye.moved and np.linalg.norm(eye.eye) == pytest.approx(np.linalg.norm(first), rel=0.02)
    assert np.linalg.norm(np.subtract(eye.eye, first)) > 0.5
    scene.choose("camera", "side")
    scene.frame(2)
    assert not eye.moved and eye.eye == pytest.approx((4, 0.5, 6))
    scene.state.time = 2.0
    scene.frame()
    assert eye.eye == pytest.approx((4, 0.7, 6))  # it follows
    scene.choose("steer", "fly")
    before = eye.eye
    scene.canvas.submit_event({"event_type": "key_down", "key": "w", "modifiers": ()})
    scene.frame(5)
    scene.canvas.submit_event({"event_type": "key_up", "key": "w", "modifiers": ()})
    scene.frame(5)
    assert eye.moved and eye.eye[2] < before[2] - 0.01
    scene.choose("camera", "front")
    scene.frame(2)
    assert not eye.moved and eye.eye == pytest.approx(first)


def read_by_render(state: ViewerState) -> tuple[dict[str, Any], Any]:
    words = shlex.split(st.as_text(st.command_line(state)))
    assert words[:2] == ["airlight", "render"]
    with render_command.render.make_context("render", words[2:]) as ctx:
        return gather(ctx, None), ctx.params


def test_the_command_of_a_scene(scene: Driver) -> None:
    values, said = read_by_render(scene.state)
    assert values == {} and (said["scene"], said["width"], said["height"]) == ("table", *SCENE_SIZE)
    assert said["eye"] is None and said["camera"] is None and said["light"] == said["sun"] == ()
    scene.choose("camera", "side")
    scene.state.time = 1.25
    scene.frame(2)
    _, said = read_by_render(scene.state)
    assert (said["camera"], said["time"]) == ("side", 1.25)
    scene.state.lamps[0].place = (-1.0, 2.0, -3.0)
    scene.state.lamps[0].color = (1.0, 0.5, 0.25)
    scene.state.eye.moved = True
    scene.frame(2)
    _, said = read_by_render(scene.state)
    assert said["camera"] is None and said["light"] == ("-1,2,-3;color=1.0,0.5,0.25",)
    assert [float(v) for v in said["eye"].split(",")] == pytest.approx(scene.state.eye.eye, abs=1e-4)
    assert said["fov"] == pytest.approx(scene.state.eye.fov, rel=1e-3)


@given(some_values(), some.floats(-179, 179), some.floats(-80, 80))
def test_the_command_of_a_scene_says_all(wanted: dict[str, Any], azimuth: float, elevation: float) -> None:
    state = ViewerState("flying", False, size=(640, 360))
    try:
        st.set_values(state, wanted)
    except AirlightError:
        return
    turn, up = np.radians([azimuth, elevation])
    state.lamps = [Lamp((np.sin(turn) * np.cos(up), np.sin(up), -np.cos(turn) * np.cos(up)), direction=True)]
    values, said = read_by_render(state)
    assert values == {d.name: st.value(state, d.name) for d in st.shown(state) if st.value(state, d.name) != d.default}
    assert [float(v) for v in said["sun"][0].split(",")] == pytest.approx((azimuth, elevation), abs=1e-3)


def test_debug_views_and_times_of_a_scene(scene: Driver) -> None:
    seen = [scene.frame()]
    for debug in ("occlusion", "source"):
        scene.state.debug = debug
        seen.append(scene.frame(2))
        assert all(np.abs(seen[-1][:, 400:].astype(int) - other[:, 400:]).max() > 20 for other in seen[:-1])
    scene.state.debug, scene.state.timing = None, True
    scene.viewer.scene.show(scene.state)
    scene.viewer.scene.show(scene.state)
    assert sum(ms for _, ms in scene.state.passes) > 0
    scene.state.timing = False
    name = scene.viewer.screenshot()
    assert read_image(name).codes.shape == (*SCENE_SIZE[::-1], 3)


def test_scene_picture_scene(scene: Driver, photo: str) -> None:
    seen = scene.frame(2)
    scene.state.asked.append(("open", photo))
    scene.frame(3)
    assert scene.state.is_image
    scene.choose("source", "flying")
    scene.state.playing, scene.state.time = False, 0.0
    scene.frame(3)
    assert not scene.state.is_image and scene.state.source == "flying"
    assert np.abs(scene.frame(2)[:, 360:].astype(int) - seen[:, 360:]).max() <= 1


@pytest.mark.slow
def test_memory_does_not_grow_in_scenes(scene: Driver, photo: str) -> None:
    """300 frames of flying, sizes, ways of occlusion, presets, other scenes and pictures."""

    def turn(i: int) -> None:
        state = scene.state
        if i % 30 == 29:
            scene.viewer.open(("table", photo, "flying")[i // 30 % 3])
        if i % 30 == 15:
            scene.canvas.set_logical_size(*((640, 400), (560, 360))[i // 30 % 2])
        if i % 30 == 20:
            st.load(state, ("vesper", "soft", "long")[i // 30 % 3])
        if i % 30 == 5:
            st.change(state, "occluders", ("stencil", "prepass", "contrast")[i // 30 % 3])
        state.time, state.playing = i % 40 / 10, False
        state.debug = ("occlusion", None, "source")[i // 20 % 3]
        scene.frame()

    scene.canvas.set_logical_size(640, 400)
    for i in range(180):  # two rounds
        turn(i)
    first = resident()
    for i in range(300):
        turn(i)
    grown = resident() - first
    assert grown < 0.05 * first, f"{grown / 2**20:.1f} MiB more than {first / 2**20:.0f}"


@given(some.tuples(*[some.floats(-2, 2)] * 3), some.tuples(some.floats(350, 1200), some.floats(10, 700)))
def test_dragging_in_space_keeps_the_distance(point: tuple[float, float, float], to: tuple[float, float]) -> None:
    f = 1 / np.tan(np.radians(25))
    projection = np.array([[f / 1.5, 0, 0, 0], [0, f, 0, 0], [0, 0, -1.001, -0.1001], [0, 0, -1, 0]])
    turn = np.array([[0.8, 0, 0.6, 0], [0, 1, 0, 0], [-0.6, 0, 0.8, -7], [0, 0, 0, 1]])
    clip, area = projection @ turn, (0.0, 0.0, 1280.0, 720.0)
    moved = controls.drag_in_view(point, to, clip, area)
    assert controls.project(moved, clip, area) == pytest.approx(to, abs=1e-3)
    assert (clip @ [*moved, 1])[3] == pytest.approx((clip @ [*point, 1])[3])
