"""Does many tasks: reads ahead, renders, and writes behind at the same time."""

import contextlib
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, TypeVar

from airlight.errors import AirlightError, MachineError
from airlight.messages import say
from airlight.progress import showing

T = TypeVar("T")
AHEAD = 2  # pictures that are read, and that are written (at once) or wait for it, beyond the one that is rendered


def run(
    todo: Sequence[T],
    read: Callable[[T], Any],
    render: Callable[[T, Any], Any],
    write: Callable[[T, Any, Any], None],
    writers: int = AHEAD,
) -> list[tuple[T, AirlightError]]:
    """Do all tasks, reading ahead and writing behind; the pictures that failed, each told at once.

    writers: how many may be written at a time; with 1 they are written in order, as a film needs.
    A MachineError, or Ctrl-C, ends the run: what is being written is finished, nothing else begun.
    """
    failed: list[tuple[T, AirlightError]] = []
    reading: deque[tuple[T, Future[Any]]] = deque()
    writing: deque[tuple[T, Future[Any]]] = deque()
    waiting = iter(todo)
    with ThreadPoolExecutor(1) as reader, ThreadPoolExecutor(writers) as writer, showing("airlight", len(todo), counts=True) as work:

        @contextlib.contextmanager
        def told(task: T) -> Iterator[None]:
            try:
                yield
            except MachineError:
                raise
            except AirlightError as error:
                failed.append((task, error))
                say(str(error))
                work.advance()

        def finish() -> None:
            task, future = writing.popleft()
            with told(task):
                future.result()
                work.advance()

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
