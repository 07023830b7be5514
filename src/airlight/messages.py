"""Tells the user, in lines on stderr; and what to say of a word that is not known."""

import contextlib
import itertools
import os
import sys
from collections.abc import Iterable

LIKE_NAMES = 0.7  # how alike names of files are, without their endings, that one is taken for a slip of
MOST_NAMES = 5000  # of a folder's files, that are looked through for one like a name


def say(text: str, prefix: str = "airlight: ") -> None:
    """Print a line on stderr, whatever the text holds; above a progress bar, which what click writes would be glued to."""
    line = "".join(c if c.isprintable() else "?" for c in " ".join(text.split()))
    with contextlib.suppress(OSError, ValueError):
        if sys.stderr is not None:
            print(f"{prefix}{line}", file=sys.stderr, flush=True)


def number(value: float, figures: int) -> str:
    """Write a number rounded to so many figures, up to a million without an exponent: 110, not 1.1e+02."""
    return f"{float(f'{value:.{figures}g}'):g}"


def counted(count: int, one: str, many: str = "") -> str:
    """Write a number of things: 1 folder, 2 folders. many: how several are called, where an s at the end is not all."""
    return f"{count} {one if count == 1 else many or one + 's'}"


def close(word: str, known: Iterable[str], most: int = 1, least: float = 0.6) -> list[str]:
    """List those of some words that are like another, whatever their case, the most alike first. least: how alike, 0..1."""
    import difflib  # takes as long as all else of this module

    by_case: dict[str, list[str]] = {}
    for one in known:
        by_case.setdefault(one.lower(), []).append(one)
    found = difflib.get_close_matches(word.lower(), by_case, most, least)
    return [one for lower in found for one in by_case[lower]][:most]


def nearest(word: str, known: Iterable[str], otherwise: str = "") -> str:
    """Ask whether the word most like another is meant, to end a message: `; did you mean 'density'?`. otherwise: where none is like it."""
    found = close(word, known)
    return f"; did you mean {found[0]!r}?" if found else otherwise


def nearest_file(path: str, otherwise: str = "") -> str:
    """Ask as `nearest`, of a file that is not there: its folder's files, or where that is not there either, folders beside it."""
    folder, name = os.path.split(path.rstrip("/" + os.sep) if len(path) > 1 else path)
    rest = ""
    while folder and not os.path.isdir(folder) and os.path.split(folder)[0] != folder:
        rest = os.path.join(name, rest) if rest else name
        folder, name = os.path.split(folder)
    try:
        there = sorted(itertools.islice(os.listdir(folder or "."), MOST_NAMES))
    except (OSError, ValueError):
        return otherwise
    stem = os.path.splitext(name)[0]  # an ending that many have makes no two names alike
    alike = (one for one in close(name, there, 5) if len(stem) < 3 or close(stem, [os.path.splitext(one)[0]], least=LIKE_NAMES))
    found = (os.path.join(folder, one, rest) if rest else os.path.join(folder, one) for one in alike)
    real = next((one for one in found if os.path.exists(one)), None)
    return f"; did you mean {real!r}?" if real is not None else otherwise
