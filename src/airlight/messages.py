"""Tells the user: lines on stderr, and warnings that a caller may catch."""

import contextlib
import sys
import warnings

from airlight.errors import AirlightWarning


def say(text: str, prefix: str = "airlight: ") -> None:
    """Print a line on stderr, whatever the text holds; above a progress bar, which what click writes would be glued to."""
    line = "".join(c if c.isprintable() else "?" for c in " ".join(text.split()))
    with contextlib.suppress(OSError, ValueError):
        if sys.stderr is not None:
            print(f"{prefix}{line}", file=sys.stderr, flush=True)


def tell(message: str, level: int = 3) -> None:
    """Warn of what was changed or is not kept. level: of the stack, as warnings.warn."""
    warnings.warn(message, AirlightWarning, stacklevel=level)
