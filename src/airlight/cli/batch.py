"""Many pictures: which files become which, and reading, rendering and writing them at the same time."""

import contextlib
import os
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar

from airlight.errors import AirlightError, MachineError
from airlight.supervisor import say

T = TypeVar("T")
AHEAD = 2  # pictures that are read, and that are written (at once) or wait for it, beyond the one that is rendered


class Writes(Protocol):
    """A task and the files that it writes, the first being its picture."""

    @property
    def output(self) -> str: ...
    @property
    def outputs(self) -> list[str]: ...


W = TypeVar("W", bound=Writes)


@dataclass(frozen=True)
class Task:
    """The files of one picture."""

    source: str
    output: str
    layer: str | None = None
    fraction: str | None = None
    mask: str | None = None
    depth: str | None = None
    subject: str | None = None
    clip: int | None = None  # of the sequence whose frame it is, the place of its first frame among all
    number: int = 0  # its place among all
    wanted: bool = True  # False: written already, and only looked at for what the frames after it keep

    @property
    def outputs(self) -> list[str]:
        return [path for path in (self.output, self.layer, self.fraction) if path is not None]


def tasks(
    sources: Sequence[str],
    output: str,
    layer: str | None,
    fraction: str | None,
    mask: str | None,
    depth: str | None,
    subject: str | None,
    frames: str | None,
) -> tuple[list[Task], bool]:
    """What is to be done, and whether it is a sequence of frames. Patterns stand for the files that there are, or for `frames`."""
    from airlight.files.sequence import deliberate, numbered
    from airlight.files.sequence import frames as read_frames

    given: list[tuple[int | None, str, int | None]] = []
    for source in sources:
        pattern = numbered(source)
        if pattern is None:
            given.append((None, source, None))
            continue
        numbers = read_frames(frames) if frames is not None else pattern.on_disk()
        if not numbers:
            raise AirlightError(f"{source}: there are no such files; check the pattern, or give --frames")
        given += [(number, pattern.frame(number), clip) for clip in [len(given)] for number in numbers]
    sequence = any(clip is not None for _, _, clip in given)
    if frames is not None and not sequence:
        raise AirlightError("--frames needs a pattern for the input, as in shot.####.exr")

    def place(target: str | None, number: int | None, source: str) -> str | None:
        if target is None:
            return None
        pattern = numbered(target)
        if pattern is not None and number is not None:
            return pattern.frame(number)
        if pattern is not None and deliberate(target):
            raise AirlightError(f"{target}: the inputs have no numbers; name a folder, or a file without {pattern.written}")
        if os.path.isdir(target) or target.endswith(("/", os.sep)):
            return os.path.join(target, os.path.basename(source))
        if len(given) > 1:
            raise AirlightError(f"{target}: {len(given)} pictures do not go into one file; name a folder or a pattern such as out.####.exr")
        return target

    def beside(path: str | None, number: int | None) -> str | None:
        pattern = None if path is None or number is None else numbered(path)
        return path if pattern is None or number is None else pattern.frame(number)

    found: list[Task] = []
    for number, source, clip in given:
        outputs = [place(target, number, source) for target in (output, layer, fraction)]
        planes = beside(mask, number), beside(depth, number), beside(subject, number)
        found.append(Task(source, outputs[0] or output, outputs[1], outputs[2], *planes, clip, len(found)))
    _refuse_collisions(found)
    return found, sequence


def _refuse_collisions(found: Sequence[Task]) -> None:
    seen: dict[str, str] = {}
    inputs = {os.path.realpath(task.source) for task in found}
    for task in found:
        for path in task.outputs:
            key = os.path.realpath(path)
            if key in inputs:
                raise AirlightError(f"{path}: is also an input; choose another output name")
            if key in seen and seen[key] != task.source:
                raise AirlightError(f"{path}: both {seen[key]} and {task.source} would go there; name a pattern or do them apart")
            if key in seen:
                raise AirlightError(f"{path}: is named for two outputs; give each a name of its own")
            seen[key] = task.source


def run(
    todo: Sequence[T],
    read: Callable[[T], Any],
    render: Callable[[T, Any], Any],
    write: Callable[[T, Any, Any], None],
) -> list[tuple[T, AirlightError]]:
    """Do all tasks, reading ahead and writing behind; the pictures that failed, each told at once.

    A MachineError, or Ctrl-C, ends the run: what is being written is finished, nothing else begun.
    """
    failed: list[tuple[T, AirlightError]] = []
    reading: deque[tuple[T, Future[Any]]] = deque()
    writing: deque[tuple[T, Future[Any]]] = deque()
    waiting = iter(todo)
    with ThreadPoolExecutor(1) as reader, ThreadPoolExecutor(AHEAD) as writer, _progress(len(todo)) as advance:

        @contextlib.contextmanager
        def told(task: T) -> Iterator[None]:
            try:
                yield
            except MachineError:
                raise
            except AirlightError as error:
                failed.append((task, error))
                say(str(error))
                advance()

        def finish() -> None:
            task, future = writing.popleft()
            with told(task):
                future.result()
                advance()

        try:
            for _ in range(AHEAD):
                reading.extend((task, reader.submit(read, task)) for task in [next(waiting, None)] if task is not None)
            while reading:
                task, future = reading.popleft()
                reading.extend((following, reader.submit(read, following)) for following in [next(waiting, None)] if following is not None)
                with told(task):
                    loaded = future.result()
                    done = render(task, loaded)
                    while len(writing) >= AHEAD:
                        finish()
                    writing.append((task, writer.submit(write, task, loaded, done)))
            while writing:
                finish()
        finally:
            for pool in (reader, writer):
                pool.shutdown(wait=False, cancel_futures=True)
    return failed


@contextlib.contextmanager
def _progress(total: int) -> Iterator[Callable[[], None]]:
    """A bar on a terminal, nothing elsewhere."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    console = Console(stderr=True)
    if not console.is_terminal:
        yield lambda: None
        return
    columns = TextColumn("airlight"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn(elapsed_when_finished=True)
    with Progress(*columns, console=console) as bar:
        task = bar.add_task("pictures", total=total)
        yield lambda: bar.advance(task)
