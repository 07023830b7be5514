"""Tells how much of long work is left: on a terminal a line that is rewritten, elsewhere a line a minute; always on stderr."""

import contextlib
import sys
import threading
import time
from collections.abc import Iterator
from typing import Any

from airlight.messages import say

SILENT_S = 1.0  # seconds: quicker work says nothing
FORESEEN_S = 0.5  # seconds of a step by which the rest of it is foreseen
EVERY_S = 60.0  # seconds between lines, where stderr is no terminal


class Work:
    """Counts what is done of some work, in any unit. This one tells nobody.

    total: of that unit. is_timed: whether what is left takes as long as it says, so that time can be told; else they are steps.
    """

    def __init__(self, name: str = "", total: float = 1.0, is_timed: bool = True) -> None:
        self.name, self.total, self.is_timed = name, total, is_timed
        self.begun = time.monotonic()
        self.text, self.done = name, 0.0
        self._part: tuple[float, float] = (0.0, 0.0)  # where it begins, and how much it is
        self._first: tuple[float, float] | None = None  # share of a step, and when it was done
        self._last = 0.0  # share that was told last

    def advance(self, amount: float = 1.0) -> None:
        self.done += amount
        self.tell()

    def step(self, text: str) -> None:
        """Begin the next of steps, each 1 of the total where no time can be told."""
        self.text, self._first = text, None
        self.advance(time.monotonic() - self.begun - self.done if self.is_timed else 1.0)

    def part(self, text: str, planned: float) -> None:
        """Begin a part of the work, so much of the total; the one before is done."""
        self._part = sum(self._part), planned
        self.text, self.done = text, self._part[0]
        self.tell()

    def weigh(self, amount: float) -> None:
        """Correct how much the part is that was begun."""
        begins, planned = self._part
        self.total += amount - planned
        self._part = begins, amount

    def share(self, share: float) -> None:
        """Tell how much of the part is done, 0..1."""
        begins, amount = self._part
        self.done = begins + share * amount
        self.tell()

    def foresee(self, share: float, after: float = 0.0) -> None:
        """Tell how much is done, 0..1, of a step whose time is not known ahead. After a while what is left is told, and counted in seconds.

        after: seconds that what follows the step takes.
        """
        now = time.monotonic()
        if self._first is None or share < self._last:  # another pass
            self._first = share, now  # the first part may have compiled
        self._last = share
        done, seconds = share - self._first[0], now - self._first[1]
        if seconds >= FORESEEN_S and done > 0:
            self.is_timed = True
            self.done = now - self.begun
            self.total = self.done + seconds * (1 - share) / done + after
            self.tell()

    def described(self) -> str:
        """Write what is done now, and which step it is where no time can be told."""
        return self.text if self.is_timed else f"{self.text}, step {self.done + 1:.0f} of {self.total:.0f}"

    def left(self) -> str:
        """Write how long the rest takes, by what was done until now; "" where nothing says so."""
        if not self.is_timed or self.done <= 0:
            return ""
        seconds = (time.monotonic() - self.begun) * max(self.total - self.done, 0.0) / self.done
        return f"about {seconds:.0f} s left" if seconds < 100 else f"about {seconds / 60:.0f} min left"

    def tell(self) -> None:
        """Tell nobody."""


SILENT = Work()


class Lines(Work):
    """Says a line a minute."""

    def tell(self) -> None:
        now = time.monotonic()
        if now - getattr(self, "told", self.begun) < EVERY_S:
            return
        self.told = now
        share = f"{100 * min(self.done / self.total, 1):.0f} % done" if self.is_timed else ""
        parts = self.described(), share, self.left()
        say(", ".join(part for part in parts if part))


class Bar(Work):
    """Rewrites a line with a bar, by rich."""

    def __init__(self, console: Any, name: str, total: float, is_timed: bool, counts: bool) -> None:
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

        super().__init__(name, total, is_timed)
        columns: list[Any] = [TextColumn("{task.description}"), BarColumn()]
        columns += [MofNCompleteColumn()] if counts else []
        columns += [TextColumn("{task.fields[left]}")] if is_timed else [TimeElapsedColumn(), TextColumn("{task.fields[left]}")]
        # rich would write on stderr what goes to stdout, even into a file
        options: dict[str, Any] = {"transient": True, "redirect_stdout": sys.stdout is not None and sys.stdout.isatty()}
        self.bar = Progress(*columns, console=console, **options)
        self.task = self.bar.add_task(self.described(), total=total if is_timed else None, left="")

    def tell(self) -> None:
        total = self.total if self.is_timed else None  # nobody knows
        self.bar.update(self.task, description=self.described(), completed=self.done, total=total, left=self.left())


@contextlib.contextmanager
def showing(name: str, total: float = 1.0, *, is_timed: bool = True, counts: bool = False) -> Iterator[Work]:
    """Show how far some work is while the block lasts, see `Work`; nothing stays of it. counts: whether it is of things to be counted."""
    from rich.console import Console

    console = Console(stderr=True)
    if not console.is_terminal:
        yield Lines(name, total, is_timed)
        return
    work = Bar(console, name, total, is_timed, counts)
    start = threading.Timer(SILENT_S, work.bar.start)
    start.daemon = True
    start.start()
    try:
        yield work
    finally:
        start.cancel()
        start.join()
        work.bar.stop()
