"""Settles what all frames of a clip keep, by the same few of its frames, whichever of them a run renders."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

from airlight.errors import AirlightError, MachineError
from airlight.jobs.light_text import LightText
from airlight.jobs.tasks import PictureTask
from airlight.messages import say

T = TypeVar("T")
MOST_LOOKED_AT = 9  # frames of a clip: the first, the last, and between them at even steps


@dataclass
class Settled:
    """Holds what was settled on one picture.

    lights: by numbers in the display window. held: what was measured, for other frames to keep. done: the picture's pictures.Rendered.
    shines: its shafts are to be seen, so that others may take them as their measure.
    """

    lights: list[LightText]
    parameters: Any
    held: Any
    done: Any
    shines: bool


def looked_at(frames: Sequence[T]) -> list[T]:
    """Order the frames of a clip by how soon they are looked at: MOST_LOOKED_AT evenly spread ones, in order, then the rest."""
    few = min(MOST_LOOKED_AT, len(frames))
    first = [round(i * (len(frames) - 1) / max(few - 1, 1)) for i in range(few)]
    return [frames[i] for i in [*first, *sorted(set(range(len(frames))) - set(first))]]


Settle = Callable[[PictureTask, Any, Callable[[str], object]], Settled]  # of a task, what was read for it, and what lines are told to


class Clips:
    """Remembers what each clip keeps: settled on the first of the frames looked at that shines, so that dark ones are passed through.

    references: by clip, its frames as `looked_at` orders them, all that are on disk. Where none shines the clip is left as it is.
    """

    def __init__(self, references: dict[int, list[PictureTask]]) -> None:
        self.references = references
        self._kept: dict[int, Settled | AirlightError] = {}

    def settled(self, task: PictureTask, loaded: Any, read: Callable[[PictureTask], Any], settle: Settle) -> Settled:
        """Give what a picture goes by: what is settled on itself, or what its clip keeps; `done` only where that is of this very picture.

        read, settle: do so for any task. Raises AirlightError.
        """
        if task.clip is None:
            return settle(task, loaded, _say)
        if task.clip not in self._kept:
            try:
                one, of = self._search(task, loaded, read, settle)
            except AirlightError as error:
                self._kept[task.clip] = error
                raise
            self._kept[task.clip] = Settled(one.lights, one.parameters, one.held, None, one.shines)
            if of.source == task.source:
                return one
        kept = self._kept[task.clip]
        if isinstance(kept, AirlightError):
            raise kept
        return kept

    def _search(self, task: PictureTask, loaded: Any, read: Callable[[PictureTask], Any], settle: Settle) -> tuple[Settled, PictureTask]:
        """Look for the frame that the clip goes by, and say what is to be said of it."""
        found: list[tuple[Settled, PictureTask, list[str]]] = []
        failure: AirlightError | None = None
        looked = 0
        for reference in self.references[task.clip or 0]:
            try:
                one = loaded if reference.source == task.source else read(reference)
                looked += 1
                lines = list[str]()  # told where the clip goes by this frame
                found.append((settle(reference, one, lines.append), reference, lines))
            except MachineError:
                raise
            except AirlightError as error:  # told when that frame is rendered itself
                failure = failure or error
            if looked == MOST_LOOKED_AT or (found and found[-1][0].shines):
                break
        if not found:
            assert failure is not None
            raise failure
        settled, of, lines = next((one for one in (found[-1:] if found[-1][0].shines else found) if one[0].lights), found[0])
        for line in lines:
            _say(line)
        if not settled.shines and not (settled.lights and getattr(settled.held, "changes", True)):
            _say(f"{of.source}: as no frame that was looked at ({len(found)}) gives shafts, its clip is left as it is")
        return settled, of


def _say(line: str) -> None:
    say(line, prefix="")
