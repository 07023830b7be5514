"""Take back what the user changed, and do it again: parameters and lights, a step for each time that they came to rest."""

from dataclasses import dataclass, replace
from typing import Any

from airlight.options import declared
from airlight.viewer import state as st
from airlight.viewer.state import LightControl, ViewerState

MOST_STEPS = 200
NAMED = 3  # parameters that the panel's line names


@dataclass(frozen=True)
class Snapshot:
    """The part of a state that can be taken back: not how it is looked at, the camera, the time, before and after, debug views."""

    structs: tuple[Any, ...]
    lights: tuple[LightControl, ...]
    preset: str
    current: int
    ask: str
    unplaced: bool

    @classmethod
    def of(cls, state: ViewerState) -> "Snapshot":
        lights = tuple(replace(control) for control in state.lights)
        return cls(state.structs, lights, state.preset, state.current, state.ask, state.unplaced)

    def restore(self, state: ViewerState) -> None:
        """Set a state to what it was."""
        state.parameters, state.composite, state.in_scene, state.medium, state.march, state.look, *day = self.structs
        state.daylight, state.daylight_picture, state.daylight_scene = day
        state.lights = [replace(control) for control in self.lights]
        state.preset, state.current, state.ask, state.unplaced = self.preset, self.current, self.ask, self.unplaced

    def difference(self, other: "Snapshot") -> str:
        """Name what differs: parameters, else lights."""
        mine, theirs = ({name: getattr(one, name) for one in s.structs for name in one.__struct_fields__} for s in (self, other))
        names = [d.name.replace("_", " ") for d in declared(scenes=True) if mine[d.name] != theirs[d.name]]
        if not names and len(self.lights) == len(other.lights):
            names = [f"light {i + 1}" for i, pair in enumerate(zip(self.lights, other.lights)) if pair[0] != pair[1]]
        more = [f"{len(names) - NAMED} more"] if len(names) > NAMED else []
        return ", ".join([*names[:NAMED], *more]) or "lights"


class History:
    """The steps of what is shown. Another picture or scene begins anew."""

    def __init__(self, state: ViewerState) -> None:
        self.restart(state)

    def restart(self, state: ViewerState) -> None:
        """Forget all steps."""
        self.past: list[Snapshot] = []
        self.future: list[Snapshot] = []
        self.now = Snapshot.of(state)

    def follow(self, state: ViewerState, busy: bool) -> None:
        """Take note of a step, once in a frame. busy: something is held or typed in, and what changes belongs to one step."""
        if not busy:
            now = Snapshot.of(state)
            if now != self.now:
                self.past = [*self.past, self.now][-MOST_STEPS:]
                self.future, self.now = [], now
        state.can_undo, state.can_redo = bool(self.past), bool(self.future)

    def undo(self, state: ViewerState) -> None:
        """Take the last step back, and say so."""
        self.follow(state, busy=False)
        self._step(state, self.past, self.future, "undone", "undo")

    def redo(self, state: ViewerState) -> None:
        """Do again what was taken back last, and say so."""
        self.follow(state, busy=False)
        self._step(state, self.future, self.past, "done again", "do again")

    def _step(self, state: ViewerState, source: list[Snapshot], onto: list[Snapshot], done: str, what: str) -> None:
        if not source:
            st.tell(state, f"there is nothing to {what}")
            return
        before, self.now = self.now, source.pop()
        onto.append(before)
        self.now.restore(state)
        state.can_undo, state.can_redo = bool(self.past), bool(self.future)
        st.tell(state, f"{done}: {self.now.difference(before)}")
