"""Steps back and forth, by keys and buttons."""

import copy
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as some
from viewer_driver import CLASSIC, Driver, some_values

from airlight.errors import AirlightError
from airlight.viewer import app, controls
from airlight.viewer import state as st
from airlight.viewer.state import LightControl, ViewerState
from airlight.viewer.undo import MOST_STEPS, History


def press(hands: Driver, key: str, *modifiers: str) -> None:
    hands.canvas.submit_event({"event_type": "key_down", "key": key, "modifiers": ("Control", *modifiers)})
    hands.frame()
    hands.canvas.submit_event({"event_type": "key_up", "key": key, "modifiers": ()})
    hands.frame(2)


def test_a_pull_at_a_slider_is_one_step(hands: Driver) -> None:
    before = hands.state.parameters
    hands.drag(hands.where("density", 0.5), hands.where("density", 0.25), steps=8)
    pulled = hands.state.parameters
    hands.drag(hands.where("weight", 0.5), hands.where("weight", 0.75), steps=8)
    last = hands.state.parameters
    assert len({before.density, pulled.density}) == 2 and pulled.weight != last.weight
    press(hands, "z")
    assert hands.state.parameters == pulled and hands.state.message == "undone: weight"
    press(hands, "z")
    assert hands.state.parameters == before and hands.state.message == "undone: density"
    press(hands, "z")
    assert hands.state.parameters == before and hands.state.message == "there is nothing to undo"
    press(hands, "y")
    assert hands.state.parameters == pulled and hands.state.message == "done again: density"
    press(hands, "Z", "Shift")
    assert hands.state.parameters == last
    press(hands, "y")
    assert hands.state.message == "there is nothing to do again"


def test_a_dragged_light_is_one_step(smart: Driver) -> None:
    area, kind = smart.viewer.area(), smart.state.lights[0].kind
    smart.drag(controls.to_canvas((0.3, 0.4), area), controls.to_canvas((0.7, 0.2), area), steps=6)
    assert smart.state.lights[0].position == pytest.approx((0.7, 0.2), abs=0.02)
    smart.click("undo")
    smart.frame(2)
    assert (smart.state.lights[0].position, smart.state.lights[0].kind) == ((0.3, 0.4), kind) and smart.state.message == "undone: light 1"
    smart.click("redo")
    smart.frame(2)
    assert smart.state.lights[0].position == pytest.approx((0.7, 0.2), abs=0.02)


def test_typing_is_one_step(hands: Driver) -> None:
    at = hands.where("density")
    hands.canvas.submit_event({"event_type": "key_down", "key": "Control", "modifiers": ("Control",)})
    hands.frame()
    hands.drag(at, at, 1)
    hands.canvas.submit_event({"event_type": "key_up", "key": "Control", "modifiers": ()})
    hands.frame()
    for letter in "0.37":
        hands.canvas.submit_event({"event_type": "char", "data": letter, "is_composing": False, "modifiers": ()})
        hands.frame()
    for kind in ("key_down", "key_up"):
        hands.canvas.submit_event({"event_type": kind, "key": "Enter", "modifiers": ()})
        hands.frame(2)
    assert hands.state.parameters.density == pytest.approx(0.37)
    press(hands, "z")
    assert st.values(hands.state) == CLASSIC and not hands.state.can_undo


def test_presets_methods_and_resets_are_steps(hands: Driver) -> None:
    st.load(hands.state, "vesper")
    hands.frame()
    vesper = st.values(hands.state)
    st.change(hands.state, "method", "bands")
    hands.frame()
    st.reset(hands.state)
    hands.frame()
    press(hands, "z")
    assert hands.state.parameters.method == "bands"
    press(hands, "z")
    assert st.values(hands.state) == vesper and hands.state.preset == "vesper"


def test_another_picture_begins_anew(hands: Driver, photo: str, forest: str) -> None:
    st.change(hands.state, "density", 0.3)
    hands.frame(2)
    assert hands.state.can_undo
    hands.viewer.open(forest)
    hands.frame(2)
    assert not hands.state.can_undo
    press(hands, "z")
    assert hands.state.source == forest and hands.state.parameters.density == 0.3


def test_a_light_of_a_scene_goes_back(scene: Driver) -> None:
    first = copy.deepcopy(scene.state.lights)
    before = scene.frame(2)
    st.move(scene.state, 0, (1.0, 1.5, -2.0))
    assert abs(scene.frame(2).astype(int) - before).max() > 20
    press(scene, "z")
    assert scene.state.lights == first
    assert abs(scene.frame(2)[:, 360:].astype(int) - before[:, 360:]).max() <= 1


@given(some.lists(some_values(scenes=False), min_size=1, max_size=6), some.data())
def test_steps_go_back_and_forth_to_the_same(changes: list[dict[str, Any]], data: Any) -> None:
    state = ViewerState("a.png", True)
    state.lights = [LightControl((0.5, 0.5))]
    history = History(state)
    seen = [(state.structs, copy.deepcopy(state.lights))]
    for wanted in changes:
        try:
            st.set_values(state, wanted)
        except AirlightError:
            continue
        st.move(state, 0, (data.draw(some.floats(-1, 2)), 0.5))
        history.follow(state, busy=True)
        history.follow(state, busy=False)
        if (state.structs, state.lights) != seen[-1]:
            seen.append((state.structs, copy.deepcopy(state.lights)))
    for step in (*range(len(seen) - 2, -1, -1), 0):
        history.undo(state)
        assert (state.structs, state.lights) == seen[step]
    for step in (*range(1, len(seen)), len(seen) - 1):
        history.redo(state)
        assert (state.structs, state.lights) == seen[step]


def test_steps_are_bounded_and_a_new_one_forgets_what_was_undone() -> None:
    state = ViewerState("a.png", True)
    history = History(state)
    for i in range(MOST_STEPS + 50):
        st.change(state, "samples", 10 + i)
        history.follow(state, busy=False)
    for _ in range(MOST_STEPS + 50):
        history.undo(state)
    assert state.parameters.samples == 10 + 49
    history.redo(state)
    st.change(state, "samples", 5)
    history.redo(state)
    assert state.parameters.samples == 5 and state.message == "there is nothing to do again"


def test_a_key_without_control_is_no_step(hands: Driver) -> None:
    st.change(hands.state, "density", 0.3)
    hands.frame(app.LINGER)
    hands.canvas.submit_event({"event_type": "key_down", "key": "z", "modifiers": ()})
    hands.frame(2)
    assert hands.state.parameters.density == 0.3
