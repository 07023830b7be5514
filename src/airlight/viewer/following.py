"""Follow what a viewer's state says with its picture: what it is worked on for, when it is dropped, and what a piece of work draws."""

import time
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from airlight.errors import AirlightError
from airlight.viewer import controls
from airlight.viewer import state as st
from airlight.viewer.frames import AT_ONCE, SHARES, Frames, Pace

if TYPE_CHECKING:
    from airlight.viewer.app import Viewer

LONGEST_STEP = 0.25  # s that time goes on between two frames at most
ADAPTED = 5  # times `adapt_seconds` after which the eye is used to what it sees


class Following:
    """Goes on with the picture of a viewer, `frames`, in each of its frames.

    stirred: whether a scene's controller was given something to do.
    """

    def __init__(self, viewer: "Viewer", format: str, pace: Pace) -> None:
        self.viewer, self.frames = viewer, Frames(viewer.device, format, pace)
        self.told: Any = None  # what the state said of the picture that is worked on
        self.key: Any = None  # and all that it shows
        self.moving = False  # whether more follow
        self.stirred = False
        self.adapting = False  # whether the last picture was one on the way of light adaptation
        self.settling = False
        self.last: float | None = None

    def go_on(self) -> bool:
        """Go on with the picture for a slice. True: another frame has to follow. Raises AirlightError."""
        frames, viewer, told = self.frames, self.viewer, self._told()
        state = viewer.state
        if frames.refines() and (self.stirred or told != self.told):
            self.drop()
        if frames.work is not None:
            brief = viewer.woken and told == self.told and not self.stirred
            return frames.follow(self.key, self.moving, self._picture_work, viewer.woken, brief)  # which is made already
        self.stirred = False
        if state.timing and viewer.linger > 0:
            frames.forget()
        now = time.perf_counter()
        step = 0.0 if self.last is None else min(now - self.last, LONGEST_STEP)
        self.last = now
        if viewer.picture is not None:
            self.told = self.key = told
            self.moving = False
            return frames.follow(self.key, False, self._picture_work, viewer.woken)
        if state.playing and state.duration:
            state.time = (state.time + step) % state.duration
        self.moving = bool(viewer.scene.update(state, step)) or (state.playing and state.duration > 0)
        self.told = self._told()
        self.key = self.told + viewer.scene.key(state)
        adapts = state.composite.adapt > 0 and not self.settling and frames.adapts(self.key, ADAPTED * state.in_scene.adapt_seconds)
        if adapts or self.adapting:  # the eye gets used to it, and at the end it is
            frames.forget()
        self.adapting = adapts
        self.moving |= adapts
        return frames.follow(self.key, self.moving, self._scene_work, viewer.woken)

    def _told(self) -> tuple[Any, ...]:
        """Collect what the state says of the picture."""
        viewer, state = self.viewer, self.viewer.state
        lights = tuple(replace(control) for control in state.lights)
        seen = state.is_lit, state.debug, state.timing, viewer.canvas.get_physical_size()
        if viewer.picture is None:
            eye = state.eye
            return lights, state.structs, seen, state.time, state.path_drawn, eye.name, eye.moved, eye.fly
        hurried = viewer.hurried if self.frames.pace is AT_ONCE else None
        return id(viewer.picture), lights, state.structs, seen, state.split, state.unplaced, state.ask, viewer.room(), hurried

    def drop(self) -> None:
        """Drop the picture that is worked on."""
        if self.frames.work is not None:
            self.frames.drop()
            if self.viewer.picture is not None:
                self.viewer.picture.forget()

    def settle(self) -> None:
        """Draw the picture whole and at once, if it is not there. Raises AirlightError."""
        still = self.frames.work is None and not (self.stirred or self.adapting) and self._told() == self.told
        if still and self.frames.shown == (self.key, 0):
            return
        self.drop()
        self.frames.forget()
        pace, self.frames.pace, self.settling = self.frames.pace, AT_ONCE, True
        try:
            self.go_on()
        finally:
            self.frames.pace, self.settling = pace, False

    def _picture_work(self, level: int) -> Callable[[], None]:
        """Make the work for a picture, of the state as it is now; level above 0: a draft."""
        state, frames, picture, room = self.viewer.state, self.frames, self.viewer.picture, self.viewer.room()
        seen = replace(state, lights=[replace(control) for control in state.lights])
        hurried = self.viewer.hurried if frames.pace is AT_ONCE else level > 0
        size = self.viewer.canvas.get_physical_size()

        def show() -> None:
            picture.show(seen, frames.view(size).create_view(), frames.format, controls.fitted(picture.size, room))

        def work() -> None:
            try:
                if picture.update(seen, hurried, controls.fitted(picture.size, room)[2:]):
                    frames.forget()
            except AirlightError:
                if picture.pair is not None:
                    show()
                raise
            debug = seen.debug
            show()
            for name in ("doubt", "automatic", "passes", "allowed"):
                setattr(state, name, getattr(seen, name))
            if debug != seen.debug:
                state.debug = None
                st.tell(state, seen.message, error=True)

        return work

    def _scene_work(self, level: int) -> Callable[[], None]:
        """Make the work for a scene as it is posed now."""
        seen, settles = replace(self.viewer.state), not self.moving and (self.settling or self.frames.pace is not AT_ONCE)

        def work() -> None:
            self.viewer.scene.show(seen, self.frames.view(seen.size), SHARES[level], settles)
            self.viewer.state.passes = seen.passes

        return work
