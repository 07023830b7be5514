"""Carry out long work in slices, between which whoever waits for it does something else, such as answering its user."""

import threading
import time
from collections.abc import Callable, Iterator

PART = 0.015  # s that a part of a pass takes, about
STRIPS = 4  # side by side
FASTER = 2  # times as large a part may be than the one before it


class Dropped(BaseException):
    """Ends work that is not wanted any more; nothing else may catch it for good."""


_own = threading.local()


class Sliced:
    """Carries out work on a thread of its own, which runs only while `go_on` waits for it: never both at the same time.

    spent: seconds that it has run. Work lets go by `pause`, which all submits of a `gpu.device.Device` call.
    """

    def __init__(self, work: Callable[[], None], at_once: bool = False) -> None:
        """at_once: the first `go_on` does all of it, on its own thread; it should end by waiting for what it submits."""
        self._work, self._at_once = work, at_once
        self._mine, self._yours = threading.Semaphore(0), threading.Semaphore(0)
        self._begun = self._until = 0.0
        self._is_dropped = False
        self._error: BaseException | None = None
        self.spent, self.is_done = 0.0, False
        if not at_once:
            threading.Thread(target=self._run, name="slices", daemon=True).start()

    def go_on(self, seconds: float) -> bool:
        """Run for so long, and to the next pause. True: it is done. Raises what the work raises."""
        if self._at_once:
            self.is_done, start = True, time.perf_counter()
            self._work()
            self.spent = time.perf_counter() - start
            return True
        self._begun = time.perf_counter()
        self._until = self._begun + seconds
        self._mine.release()
        self._yours.acquire()
        self.spent += time.perf_counter() - self._begun
        if self._error is not None and not isinstance(self._error, Dropped):
            raise self._error
        return self.is_done

    def drop(self) -> None:
        """End the work where it is."""
        self._is_dropped = True
        while not self.is_done:
            self.go_on(0.0)

    def worked(self) -> float:
        """Measure how long the work has run, seconds, from within."""
        return self.spent + time.perf_counter() - self._begun

    def pause(self) -> None:
        """Let go, if the slice is over, until it goes on. Raises Dropped."""
        if not self._is_dropped and time.perf_counter() < self._until:
            return
        if not self._is_dropped:
            self._yours.release()
            self._mine.acquire()
        if self._is_dropped:
            raise Dropped

    def _run(self) -> None:
        self._mine.acquire()
        _own.work = self
        try:
            if not self._is_dropped:
                self._work()
        except BaseException as error:  # for whoever waits
            self._error = error
        finally:
            self.is_done = True
            self._yours.release()


def current() -> Sliced | None:
    """Find the work in slices that this thread carries out; None elsewhere."""
    return getattr(_own, "work", None)


def let_go() -> None:
    """Pause the work that this thread carries out, see `Sliced.pause`; elsewhere do nothing."""
    if work := current():
        work.pause()


def parts(total: int) -> Iterator[tuple[int, int]]:
    """Divide the rows of a pass into (first, count), each of some milliseconds where the work is sliced, else into one.

    Whoever takes them has to submit each, and to wait for it.
    """
    work = current()
    first, count = 0, 1 if work else total
    while first < total:
        count = min(count, total - first)
        start = work.worked() if work else 0.0
        yield first, count
        first += count
        if work:
            count = max(1, int(count * min(FASTER, PART / max(work.worked() - start, 1e-6))))


def strips(total: int) -> Iterator[tuple[int, int]]:
    """Divide the columns of a pass into (first, count): STRIPS where the work is sliced, lest a row alone takes too long, else one."""
    wide = -(-total // STRIPS) if current() else total
    for first in range(0, total, wide):
        yield first, min(wide, total - first)
