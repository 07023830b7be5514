"""Tells the user, in lines on stderr."""

import contextlib
import sys


def say(text: str, prefix: str = "airlight: ") -> None:
    """Print a line on stderr, whatever the text holds; above a progress bar, which what click writes would be glued to."""
    line = "".join(c if c.isprintable() else "?" for c in " ".join(text.split()))
    with contextlib.suppress(OSError, ValueError):
        if sys.stderr is not None:
            print(f"{prefix}{line}", file=sys.stderr, flush=True)
