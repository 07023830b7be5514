"""Carry out long work in slices, between which whoever waits for it does something else, such as answering its user."""

import contextlib
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any

PART = 0.015  # s that a part of a pass takes, about
WATCHED_PART = 0.1  # the same where it is only watched: an interrupt is answered in between
STRIPS = 4  # side by side
SHORT = 4  # rows to a part, from which no row takes too long
BLOCKS = 16  # of rows that are carried out in any order, a power of 2
FASTER = 2  # times as large a part may be than the one before it


class Dropped(BaseException):
    """Ends work that is not wanted any more; nothing else may catch it for good."""


_own = threading.local()


class Sliced:
    """Carries out work on a thread of its own, which runs only while `go_on` waits for it: never both at the same time.

    spent: seconds that it has run. Work lets go by `pause`, which all submits of a `gpu.device.Device` call. paces: how many rows, or what
    else is divided, suit a part, by the kind of a pass; kept by whoever carries out one piece of work after the other.
    """

    part, strips = PART, STRIPS

    def __init__(self, work: Callable[[], None], at_once: bool = False, paces: dict[Any, int] | None = None) -> None:
        """at_once: the first `go_on` does all of it, on its own thread; it should end by waiting for what it submits."""
        self.paces: dict[Any, int] = {} if paces is None else paces
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

    def tell(self, share: float) -> None:
        """Tell nobody."""

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


class Watched:
    """Tells how much of a long pass is done while this thread carries it out, part by part, each of which is waited for.

    told: is called with the share, 0..1, of all that are done one after the other, see `among`. drawing: whether that of a scene is told
    before them, by itself.
    """

    part, strips = WATCHED_PART, 1

    def __init__(self, told: Callable[[float], None], drawing: bool = False) -> None:
        self._told, self.drawing = told, drawing
        self.number, self.count = 0, 1  # of the pass
        self.paces: dict[Any, int] = {}

    def worked(self) -> float:
        """Measure time, seconds."""
        return time.perf_counter()

    def pause(self) -> None:
        """Go on."""

    def tell(self, share: float) -> None:
        """Tell how much of the pass is done."""
        self._told((self.number + share) / self.count)


def current() -> Sliced | Watched | None:
    """Find the work in slices that this thread carries out, or that is watched; None elsewhere."""
    return getattr(_own, "work", None)


@contextlib.contextmanager
def watching(told: Callable[[float], None], drawing: bool = False) -> Iterator[None]:
    """Let long passes that this thread submits in a block tell which share of them is done, 0..1, see `Watched`."""
    before, _own.work = current(), Watched(told, drawing)
    try:
        yield
    finally:
        _own.work = before


def among(number: int, count: int) -> None:
    """Say that the pass which follows is one of several as long ones, counted from 0."""
    if isinstance(work := current(), Watched):
        work.number, work.count = number, count


def tell(share: float) -> None:
    """Tell whoever watches how much of the pass is done, 0..1."""
    if work := current():
        work.tell(share)


def let_go() -> None:
    """Pause the work that this thread carries out, see `Sliced.pause`; elsewhere do nothing."""
    if work := current():
        work.pause()


def parts(total: int, spread: bool = False, kind: Any = None) -> Iterator[tuple[int, int]]:
    """Divide the rows of a pass into (first, count), each of some milliseconds where the work is sliced, else into one.

    Whoever takes them has to submit each, and to wait for it. spread: the pass may be long, and its rows come in any order: it is divided
    where work is watched too, the first parts from all over it, so that they tell how long the others take. kind: names passes whose rows
    take about as long: the first part is half as large as the last of them suggests, instead of a row.
    """
    work = current()
    is_watched = isinstance(work, Watched)
    if is_watched and not spread:
        work = None
    blocks = _spread(total) if is_watched and spread else [(0, total)]
    count = max(1, work.paces.get(kind, 1) // FASTER) if work else total
    for first, last in blocks:
        while first < last:
            now = min(count, last - first)
            start = work.worked() if work else 0.0
            yield first, now
            first += now
            if work:
                count = max(1, int(min(FASTER * count, now * work.part / max(work.worked() - start, 1e-6))))
                if kind is not None:
                    work.paces[kind] = count


def _spread(total: int) -> list[tuple[int, int]]:
    """List BLOCKS (first, last) of so many rows: the middle one, then those halfway between others."""
    edges = [total * i // BLOCKS for i in range(BLOCKS + 1)]
    bits = BLOCKS.bit_length() - 1
    order = [int(f"{i:0{bits}b}"[::-1], 2) ^ (BLOCKS // 2) for i in range(BLOCKS)]
    return [(edges[i], edges[i + 1]) for i in order]


def strips(total: int, kind: Any = None) -> Iterator[tuple[int, int]]:
    """Divide the columns of a pass into (first, count): STRIPS where the work is sliced, lest a row alone takes too long, else one.

    kind: that of `parts` for its rows: where it is known that many of them suit a part, there is one.
    """
    work = current()
    count = 1 if work is None or work.paces.get(kind, 1) >= SHORT else work.strips
    wide = -(-total // count)
    for first in range(0, total, wide):
        yield first, min(wide, total - first)
