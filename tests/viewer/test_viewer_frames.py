"""How the viewer answers: the panel over the last picture, coarse pictures while things move, whole ones at rest, a slice at a time."""

import itertools
import time
from collections.abc import Callable, Iterator

import numpy as np
import pytest
from viewer_driver import Driver

from airlight.gpu.slices import Sliced, current, parts, strips
from airlight.viewer import controls
from airlight.viewer import state as st
from airlight.viewer.frames import AT_ONCE, SHARES, Frames, Pace
from airlight.viewer.state import LightControl


class Clock:
    """Goes by hand."""

    now = 100.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock(kept: Driver) -> Iterator[Clock]:
    """Let the shared viewer work in slices, each as short as can be, by a clock that stands still."""
    frames = kept.viewer.following.frames
    own, frames.clock, frames.pace = frames.clock, (made := Clock()), Pace(0.0, 0.04, 0.15)
    yield made
    kept.viewer.following.drop()
    frames.clock, frames.pace = own, AT_ONCE
    frames.forget()


def rest(driver: Driver, clock: Clock) -> int:
    """Let the picture become whole: so many frames it takes."""
    frames = driver.viewer.following.frames
    for count in range(1, 2000):
        clock.now += 1
        driver.frame()
        if frames.work is None and frames.shown is not None and frames.shown[1] == 0:
            return count
    pytest.fail("it does not get whole")


def refining(driver: Driver, clock: Clock) -> int:
    """Let it begin with a whole picture: how many were dropped so far."""
    frames = driver.viewer.following.frames
    for _ in range(500):
        if frames.refines():
            return frames.dropped
        clock.now += 1
        driver.frame()
    pytest.fail("it does not refine")


def test_work_in_slices_runs_only_while_it_is_waited_for() -> None:
    seen: list[int] = []

    def count() -> None:
        for i in range(3):
            seen.append(i)
            work = current()
            assert work is not None
            work.pause()

    work = Sliced(count)
    assert seen == []
    assert [work.go_on(0.0) for _ in range(4)] == [False, False, False, True] and seen == [0, 1, 2]
    work = Sliced(count)
    work.go_on(0.0)
    work.drop()
    assert work.is_done and seen == [0, 1, 2, 0] and current() is None
    assert Sliced(count, at_once=False).go_on(60.0)


def test_what_fails_in_a_slice_is_raised_where_it_is_waited_for() -> None:
    def fail() -> None:
        raise KeyError("here")

    for at_once in (False, True):
        with pytest.raises(KeyError, match="here"):
            Sliced(fail, at_once).go_on(1.0)


def test_a_pass_is_divided_without_a_gap_in_slices_alone() -> None:
    assert list(parts(90)) == [(0, 90)] and list(strips(160)) == [(0, 160)] and list(parts(0)) == []
    found: list[list[tuple[int, int]]] = []
    Sliced(lambda: found.extend([list(parts(90)), list(strips(161))])).go_on(60.0)
    for total, pieces in zip((90, 161), found, strict=True):
        assert len(pieces) > 2 and pieces[0][0] == 0 and sum(count for _, count in pieces) == total
        assert all(first + count == following for (first, count), (following, _) in itertools.pairwise(pieces))


def test_a_pass_begins_with_as_many_rows_as_its_kind_had_last() -> None:
    paces: dict[object, int] = {}
    found: list[list[tuple[int, int]]] = []
    Sliced(lambda: found.append(list(parts(90, kind="rows"))), paces=paces).go_on(60.0)
    assert found[0][0] == (0, 1) and paces["rows"] > 8


    def again() -> None:
        found.extend([list(parts(90, kind="rows")), list(parts(90, kind="others"))])

    assert Sliced(again, paces=paces).go_on(60.0) and found[1][0][1] > 8 and sum(count for _, count in found[1]) == 90
    assert found[2][0] == (0, 1)


def test_no_event_waits_for_two_slices(kept: Driver) -> None:
    frames = Frames(kept.viewer.device, "rgba8unorm", Pace(60.0, 60.0, 0.15), Clock())
    for is_woken, count in ((True, 4), (False, 8)):
        drawn: list[int] = []
        for i in range(8):
            assert frames.follow((is_woken, i), True, lambda level: lambda: drawn.append(level), is_woken)  # noqa: B023
        assert len(drawn) == count


def test_pictures_get_coarser_while_they_are_slow_and_finer_again(kept: Driver) -> None:
    clock = Clock()
    frames = Frames(kept.viewer.device, "rgba8unorm", Pace(1.0, 0.0005, 0.15), clock)
    drawn: list[int] = []

    def make(level: int) -> object:
        drawn.append(level)
        return lambda: time.sleep(0.003)

    for i in range(12):
        assert frames.follow(i, True, make)  # type: ignore[arg-type]
    assert frames.level == len(SHARES) - 1 and min(drawn) > 0
    frames.pace = Pace(60.0, 60.0, 0.15)
    for i in range(100):
        frames.follow(-i, True, make)  # type: ignore[arg-type]
    assert frames.level == 1
    clock.now += 1
    frames.follow(-99, False, make)  # type: ignore[arg-type]
    assert drawn[-1] == 0 and not frames.follow(-99, False, make)  # type: ignore[arg-type]
    count = len(drawn)
    frames.follow(5, True, make)  # type: ignore[arg-type]
    assert drawn[count:] == [0]  # which is known to be quick by now


def test_neither_hovering_nor_typing_draws_the_picture(scene: Driver, clock: Clock) -> None:
    rest(scene, clock)
    started, before = scene.viewer.following.frames.started, scene.frame()
    for i in range(6):
        scene.event("pointer_move", (60.0, 200.0 + 30 * i))
        scene.event("pointer_move", (500.0 + 9 * i, 300.0))
    scene.open_group("Presets and settings")
    scene.type("file", "other.toml")
    assert scene.state.file == "other.toml"
    assert scene.viewer.following.frames.started == started
    scene.open_group("Presets and settings")
    assert np.array_equal(scene.frame(2)[:, 360:], before[:, 360:])


def test_a_scene_is_coarse_while_its_light_moves_and_then_what_it_was(scene: Driver, clock: Clock) -> None:
    frames = scene.viewer.following.frames
    st.set_values(scene.state, {"method": "march", "shadow_size": 64, "steps": "exact"})
    assert rest(scene, clock) > 5  # slices
    whole = scene.frame()
    mark = scene.viewer.marks.lights()[0]
    assert mark is not None
    scene.event("pointer_move", mark)
    scene.event("pointer_down", mark, button=1, buttons=(1,))
    for i in range(60):
        scene.event("pointer_move", (mark[0] + 40 + i % 2, mark[1] - 30), buttons=(1,))
    assert frames.shown is not None and frames.shown[1] > 0
    coarse = scene.frame()[:, 360:].astype(int)
    scene.event("pointer_up", (mark[0] + 40, mark[1] - 30), button=1)
    refining(scene, clock)
    dropped = frames.dropped
    st.move(scene.state, 0, scene.state.lights_before[0].position)  # while it is worked on
    scene.frame()
    assert frames.dropped == dropped + 1
    rest(scene, clock)
    assert np.array_equal(scene.frame()[:, 360:], whole[:, 360:])
    assert abs(coarse.mean() - whole[:, 360:].mean()) < 0.15 * whole[:, 360:].mean()  # no flicker
    frames.pace = AT_ONCE
    frames.forget()
    scene.viewer.scene.renderer.kept_for = None
    assert np.array_equal(scene.frame()[:, 360:], whole[:, 360:])
    st.set_values(scene.state, {})


def test_surfaces_are_drawn_anew_only_where_they_look_otherwise(scene: Driver, monkeypatch: pytest.MonkeyPatch) -> None:
    renderer, state = scene.viewer.scene.renderer, scene.state
    drawn: list[bool] = []

    def render(*those: object, **more: object) -> None:
        drawn.append(True)
        type(renderer).render(renderer, *those, **more)

    def anew(change: Callable[[], object]) -> int:
        """Count how often surfaces are drawn after a change that is seen; whether they are or not gives the same picture."""
        before, count = scene.frame(), len(drawn)
        change()
        after = scene.frame()
        count = len(drawn) - count
        assert not np.array_equal(after[:, 360:], before[:, 360:])
        renderer.kept_for = None
        scene.viewer.following.frames.forget()
        assert np.array_equal(scene.frame()[:, 360:], after[:, 360:])
        return count

    scene.frame(2)
    monkeypatch.setattr(renderer, "render", render)
    assert anew(lambda: st.set_values(state, {"mix": 0.5})) == 0
    assert anew(lambda: st.set_values(state, {"density": 0.3, "quality": "draft"})) == 0
    assert anew(lambda: setattr(state, "shafts", False)) == 0
    assert anew(lambda: setattr(state, "shafts", True)) == 0
    assert anew(lambda: st.move(state, 0, (1.0, 2.0, 0.5))) == 1
    assert anew(lambda: setattr(state.lights[0], "color", (0.2, 0.4, 1.0))) == 1
    moved = scene.viewer.scene.camera.world.position + (0.1, 0.0, 0.0)
    assert anew(lambda: setattr(scene.viewer.scene.camera.world, "position", moved)) == 1
    assert anew(lambda: st.set_values(state, {"method": "march", "steps": 16})) == 1  # what is seen through waits for the medium
    assert anew(lambda: st.set_values(state, {"method": "march", "steps": 16, "sigma_t": (0.3, 0.3, 0.3)})) == 0


@pytest.mark.parametrize("look", ["smart", pytest.param("classic", marks=pytest.mark.slow)])
def test_a_picture_in_slices_is_that_of_one_go(hands: Driver, clock: Clock, forest: str, look: str) -> None:
    st.set_values(hands.state, {"look": look})
    hands.viewer.open(forest, [LightControl((0.3, 0.4), kind="disc" if look == "smart" else None)])
    rest(hands, clock)
    whole = hands.frame()
    at = controls.to_canvas((0.3, 0.4), hands.viewer.area())
    hands.event("pointer_move", at)
    hands.event("pointer_down", at, button=1, buttons=(1,))
    for i in range(1, 40):
        hands.event("pointer_move", (at[0] + i, at[1]), buttons=(1,))
    hands.event("pointer_up", (at[0] + 39, at[1]), button=1)
    assert not np.array_equal(hands.frame(9)[:, 360:], whole[:, 360:])
    hands.state.lights = [LightControl((0.3, 0.4), kind="disc" if look == "smart" else None)]
    dropped = refining(hands, clock)
    hands.state.lights[0].strength = 0.5  # while it is worked on
    hands.frame()
    assert hands.viewer.following.frames.dropped > dropped
    hands.state.lights[0].strength = 1.0
    rest(hands, clock)
    assert np.array_equal(hands.frame()[:, 360:], whole[:, 360:])
    hands.viewer.following.frames.pace = AT_ONCE
    hands.viewer.picture.forget()
    hands.viewer.following.frames.forget()
    assert np.array_equal(hands.frame()[:, 360:], whole[:, 360:])


def test_all_events_are_taken_before_a_frame_and_none_queues(scene: Driver, clock: Clock) -> None:
    rest(scene, clock)
    frames = scene.viewer.following.frames
    mark = scene.viewer.marks.lights()[0]
    assert mark is not None
    scene.event("pointer_move", mark)
    scene.event("pointer_down", mark, button=1, buttons=(1,))
    started = frames.started
    for i in range(1, 21):
        event = {"event_type": "pointer_move", "x": mark[0] + 3 * i, "y": mark[1], "button": 0, "buttons": (1,)}
        scene.canvas.submit_event({**event, "modifiers": (), "ntouches": 0, "touches": {}})
    scene.frame()
    now = scene.viewer.marks.lights()[0]
    assert now is not None and now[0] == pytest.approx(mark[0] + 60, abs=2)
    assert frames.started <= started + 1
    scene.event("pointer_up", (mark[0] + 60, mark[1]), button=1)


def test_a_screenshot_is_whole_whatever_is_worked_on(hands: Driver, clock: Clock, forest: str) -> None:
    from airlight.files import read_image

    hands.viewer.open(forest, [LightControl((0.3, 0.4))])
    first = read_image(hands.viewer.screenshot()).codes  # at once
    rest(hands, clock)
    assert np.array_equal(read_image(hands.viewer.screenshot()).codes, first)


def test_steering_and_marks_go_by_where_the_camera_is_while_a_picture_is_drawn_near_the_origin(
    scene: Driver, clock: Clock, monkeypatch: pytest.MonkeyPatch
) -> None:
    view, frames = scene.viewer.scene, scene.viewer.following.frames
    rest(scene, clock)
    start, ends, marks = view.camera.get_state(), [], []
    for away in ((0.0, 0.0, 0.0), (1000.0, 0.0, 0.0)):
        monkeypatch.setattr("airlight.viewer.stage.origin", lambda *_, away=away: np.array(away))
        view.camera.set_state(start)
        view.renderer.kept_for = None
        frames.forget()
        for _ in range(60 if away[0] else 1):
            clock.now += 1
            scene.frame()
            if abs(view.camera.world.position[0] - start["position"][0]) > 500:
                break
        assert abs(view.camera.world.position[0] - start["position"][0]) == pytest.approx(away[0])  # paused
        marks.append(scene.viewer.marks.lights()[0])
        scene.event("wheel", (600.0, 300.0), dx=0, dy=-100)
        rest(scene, clock)
        rest(scene, clock)
        ends.append(view.camera.world.position)
    assert np.linalg.norm(ends[0] - start["position"]) > 1e-3
    assert np.allclose(ends[0], ends[1], atol=1e-6) and np.allclose(marks[0], marks[1])
    view.camera.set_state(start)


def test_a_picture_that_was_dropped_is_not_taken_for_the_one_before(kept: Driver) -> None:
    """It may be drawn already, onto the same texture."""
    frames, drawn = Frames(kept.viewer.device, "rgba8unorm", Pace(0.0, 60.0, 0.0), Clock()), []

    def make(key: str) -> Callable[[int], Callable[[], None]]:
        def work() -> None:
            frames.view((8, 8))
            drawn.append(key)
            current().pause()  # type: ignore[union-attr]

        return lambda level: work

    while frames.follow("first", False, make("first")):
        pass
    frames.follow("other", False, make("other"))
    assert frames.refines() and drawn == ["first", "other"]
    frames.drop()
    while frames.follow("first", False, make("first")):
        pass
    assert drawn == ["first", "other", "first"]


def test_the_eye_is_used_to_a_screenshot_and_to_a_picture_at_rest(scene: Driver, clock: Clock, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever time passes without a frame."""
    st.set_values(scene.state, {"adapt": 1.0, "exposure": 0.3})
    rest(scene, clock)
    following = scene.viewer.following
    settled: list[bool] = []
    show = scene.viewer.scene.show
    monkeypatch.setattr(scene.viewer.scene, "show", lambda *those: (settled.append(those[3]), show(*those)))
    st.set_values(scene.state, {"adapt": 1.0, "exposure": 3.0})
    scene.frame(3)
    scene.viewer.screenshot()
    assert settled[-1]
    st.set_values(scene.state, {"adapt": 1.0, "exposure": 0.5})
    scene.frame(3)
    clock.now += 1000  # as in a window that is hidden
    rest(scene, clock)  # of the picture that was worked on
    scene.frame()
    rest(scene, clock)
    assert settled[-1] and not following.adapting, (settled, following.adapting, following.moving)
    st.set_values(scene.state, {})
