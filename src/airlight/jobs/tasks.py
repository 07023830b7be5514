"""Tasks, a picture each: which files become which, and which of them are left to do."""

import dataclasses
import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeVar

from airlight.errors import AirlightError, warn
from airlight.jobs import outputs
from airlight.messages import say
from airlight.process import standard

if TYPE_CHECKING:
    from airlight.files.sequence import Numbered


@dataclass(frozen=True)
class Task:
    """Names what one picture or frame is written to.

    number: its place among all, or its frame. layer: the light alone.
    """

    number: int
    output: str
    layer: str | None = None

    @property
    def outputs(self) -> list[str]:
        """List the files that are written, the first being the picture."""
        return [path for path in (self.output, self.layer) if path is not None]


@dataclass(frozen=True)
class PictureTask(Task):
    """Adds what is read, and what else is written, of a picture.

    clip: of the sequence whose frame it is, the place of its first frame among all.
    """

    source: str = ""
    fraction: str | None = None
    mask: str | None = None
    depth: str | None = None
    subject: str | None = None
    cookie: str | None = None
    clip: int | None = None

    @property
    def outputs(self) -> list[str]:
        return [*super().outputs, *([] if self.fraction is None else [self.fraction])]

    @property
    def inputs(self) -> list[str]:
        """List the files that are read."""
        return [path for path in (self.source, self.mask, self.depth, self.subject, self.cookie) if path is not None]


@dataclass(frozen=True)
class FrameTask(Task):
    """Adds the moment of a scene: time, seconds; turn of the camera, parts of a full turn; and where the source of the shafts goes."""

    buffer: str | None = None
    time: float = 0.0
    turn: float = 0.0

    @property
    def outputs(self) -> list[str]:
        return [*super().outputs, *([] if self.buffer is None else [self.buffer])]


T = TypeVar("T", bound=Task)


def _others(pattern: "Numbered") -> str:
    """Say that frames are there whose numbers have other digits than a pattern asks for; nothing where there are none."""
    for digits in range(1, 9):
        other = dataclasses.replace(pattern, digits=digits)
        if found := other.on_disk():
            written = "%d" if digits == 1 else f"%0{digits}d"
            return f" of {pattern.digits} digits; for {other.frame(found[0])} write {written}, or give --frames"
    return ""


def picture_tasks(
    sources: Sequence[str],
    output: str,
    layer: str | None,
    fraction: str | None,
    mask: str | None,
    depth: str | None,
    subject: str | None,
    frames: str | None,
    format: str | None = None,
    cookie: str | None = None,
) -> tuple[list[PictureTask], dict[int, list[PictureTask]]]:
    """List what is to be done, and by clip all its frames that there are, in order; none where no sequence is named. Patterns stand for
    the files that there are, or for `frames`; folders for the pictures in them. format: the ending of outputs in a folder."""
    from airlight.files.sequence import frames as read_frames
    from airlight.files.sequence import is_explicit_pattern, numbered
    from airlight.files.volumes import file_of_frame

    given: list[tuple[int | None, str, int | None]] = []
    clips: dict[int, list[tuple[int, str]]] = {}
    of_folder = any(standard.is_folder(source) for source in sources)
    for source in outputs.expanded(sources):
        pattern = numbered(source)
        if pattern is None:
            given.append((None, source, None))
            continue
        numbers = read_frames(frames) if frames is not None else pattern.on_disk()
        if not numbers:
            hint = _others(pattern) or pattern.nearest("; check the pattern, or give --frames")
            raise AirlightError(f"{source}: there are no such files{hint}")
        clips[len(given)] = [(number, pattern.frame(number)) for number in pattern.on_disk() or numbers]
        given += [(number, pattern.frame(number), clip) for clip in [len(given)] for number in numbers]
    if frames is not None and not clips:
        raise AirlightError("--frames needs a pattern for the input, as in shot.####.exr")

    def place(target: str | None, number: int | None, source: str) -> str | None:
        if target is None:
            return None
        pattern = numbered(target)
        if pattern is not None and number is not None:
            standard.refuse_frames(target)
            return pattern.frame(number)
        if pattern is not None and is_explicit_pattern(target):
            named = "frames are numbered by an input that is a pattern, as 'frame.####.jpg'"
            raise AirlightError(f"{target}: {named}; name it so, or a folder, or a file without {pattern.written}")
        if target == standard.NAME and len(given) == 1:
            return outputs.to_stdout(source, format)
        if outputs.is_folder(target, of_folder):
            return outputs.named_in(target, source, format)
        if format is not None and target != standard.NAME:
            raise AirlightError(f"--format says how outputs in a folder, or to -, are written: {target} says so itself, leave --format out")
        if len(given) > 1:
            raise AirlightError(f"{target}: {len(given)} pictures do not go into one file; name a folder or a pattern such as out.####.exr")
        return target

    def beside(path: str | None, number: int | None, source: str) -> str | None:
        if path is not None and standard.is_folder(path):
            return outputs.beside(path, source)
        pattern = None if path is None or number is None else numbered(path)
        return path if pattern is None or number is None else pattern.frame(number)

    film = None if cookie is None else numbered(cookie)
    drawn = [] if film is None else film.on_disk()

    def task(at: int, number: int | None, source: str, clip: int | None) -> PictureTask:
        places = [place(target, number, source) for target in (output, layer, fraction)]
        planes = beside(mask, number, source), beside(depth, number, source), beside(subject, number, source)
        shown = beside(cookie, None, source)
        if shown is not None and film is not None and number is not None:
            shown = file_of_frame(shown, number, drawn)
        return PictureTask(at, places[0] or output, places[1], source, places[2], *planes, cookie=shown, clip=clip)

    found = [task(at, *one) for at, one in enumerate(given)]
    missing = next((number for number, _, _ in given if film is not None and number is not None and number not in drawn), None)
    if missing is not None:
        warn(f"{cookie}: has no frame {missing}; frames that are missing look as those before them")
    refuse_collisions(found, [task.source for task in found])
    return found, {clip: [task(at, *frame, clip) for at, frame in enumerate(there)] for clip, there in clips.items()}


def refuse_collisions(todo: Sequence[Task], inputs: Sequence[str]) -> None:
    """Raise AirlightError where two outputs, or an output and an input, are one file."""
    seen: dict[str, str] = {}
    read = {os.path.realpath(path) for path in inputs if not standard.is_input(path)}
    for task in todo:
        for path in task.outputs:
            name = standard.shown(path)
            key = name if name == standard.NAME else os.path.realpath(path)
            if key in read:
                raise AirlightError(f"{path}: is also an input; choose another output name")
            source = task.source if isinstance(task, PictureTask) else ""
            if seen.get(key, source) != source:
                raise AirlightError(f"{name}: both {seen[key]} and {source} would go there; name a pattern or do them apart")
            if key in seen:
                raise AirlightError(f"{name}: is named for two outputs; give each a name of its own")
            seen[key] = source


def left_to_do(todo: Sequence[T], skip_existing: bool, resume: bool) -> tuple[list[T], list[T]]:
    """Divide tasks: what is to be done, and those whose outputs exist (skip_existing), or exist and can be read (resume)."""
    if not skip_existing and not resume:
        return list(todo), []
    from airlight import files

    def fine(path: str) -> bool:
        if skip_existing or not os.path.lexists(path):
            return os.path.lexists(path)
        try:
            files.read_image(path, "error")
        except AirlightError:
            return False
        return True

    left: list[T] = []
    done: list[T] = []
    for task in todo:
        (done if all(fine(path) for path in task.outputs) else left).append(task)
    if done:
        say(f"{todo[0].output} exists: skipped" if len(todo) == 1 else f"{len(done)} of {len(todo)} exist: skipped", prefix="")
    return left, done


def check_outputs(todo: Sequence[Task], inputs: Sequence[str], many: bool, overwrite: bool) -> None:
    """Raise AirlightError for outputs that cannot be written, before the work begins. many: also where some exist, all at once."""
    from airlight import files

    for task in todo:
        read = [*inputs, *(task.inputs if isinstance(task, PictureTask) else ())]
        for path in task.outputs:
            files.check_output(path, read, many or overwrite)
    refuse_collisions(todo, ())
    there = [path for task in todo for path in task.outputs if os.path.lexists(path)] if many and not overwrite else []
    if there:
        more = f", as do {len(there) - 1} more" if len(there) > 1 else ""
        raise AirlightError(
            f"{there[0]}: exists already{more}; pass -y/--overwrite to replace them, -n to leave them out,"
            " or --resume to do what is missing or damaged"
        )
