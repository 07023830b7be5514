"""The two kinds of failure that a user meets; each message is one line that says what is wrong and how to mend it."""

import contextlib
import sys
import warnings
from collections.abc import Iterator


class AirlightError(Exception):
    """Wrong usage or bad input (exit code 2)."""

    exit_code = 2


class NotAPicture(AirlightError):
    """A file that is no picture of any kind that is read."""


class MachineError(AirlightError):
    """A failure of the program or the machine: no adapter, memory, disk full (exit code 1)."""

    exit_code = 1


class AirlightWarning(UserWarning):
    """Something in an input was mended or could not be kept; the work goes on."""


class CommonWarning(AirlightWarning):
    """Says, after a picture's name, what holds for each of a sequence alike: a command tells it of the first, and how many more."""


OURS = ("airlight", "pygfx", "contextlib")  # of which no line is the caller's


def warn(message: str, level: int | None = None, common: bool = False) -> None:
    """Issue an AirlightWarning. level: how many calls above this one stands the line that it names; None: that of the first caller outside
    of Airlight. common: as a CommonWarning."""
    if level is None:
        level, frame = 2, sys._getframe(1)
        while frame.f_back is not None and str(frame.f_globals.get("__name__")).partition(".")[0] in OURS:
            level, frame = level + 1, frame.f_back
    warnings.warn(message, CommonWarning if common else AirlightWarning, stacklevel=level)


@contextlib.contextmanager
def needing(what: str, extra: str) -> Iterator[None]:
    """Say what to install where a package that an extra brings is missing: an ImportError of one line. what: needs it."""
    try:
        yield
    except ImportError as error:
        if error.name is None or error.name.partition(".")[0] == "airlight":
            raise
        raise ImportError(f'{what} needs an extra ({error.name} is missing): pip install "airlight[{extra}]"', name=error.name) from None
