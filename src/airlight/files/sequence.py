"""Numbered files: `shot.####.exr`, `shot.%04d.exr`, `shot.#.exr` (all four digits), and frames as `1-100x2,150`."""

import contextlib
import itertools
import os
import re
from dataclasses import dataclass

from airlight.errors import AirlightError
from airlight.messages import MOST_NAMES, close, nearest_file

MOST = 1_000_000
_PATTERN = re.compile(r"#+|%0?(\d*)d")
_FRAME = re.compile(r"(.*?)(\d{2,})(\D*)")  # a file's name with the number before its ending
_RANGE = re.compile(r"\s*(-?\d+)(?:-(-?\d+)(?:x(\d+))?)?\s*")


@dataclass(frozen=True)
class Numbered:
    """A file name with a place for the number of a frame."""

    before: str
    digits: int
    after: str
    written: str = ""  # the place

    def frame(self, number: int) -> str:
        return f"{self.before}{'-' if number < 0 else ''}{abs(number):0{self.digits}d}{self.after}"

    def on_disk(self) -> list[int]:
        """List the numbers of the files that there are, in order. Raises AirlightError where the folder cannot be read."""
        folder, start = os.path.split(self.before)
        name = re.compile(rf"{re.escape(start)}(-?)(\d{{{self.digits},}}){re.escape(self.after)}")
        try:
            found = [m for entry in os.listdir(folder or ".") if (m := name.fullmatch(entry))]
        except OSError as error:
            hint = nearest_file(folder, "; check the name of the folder")
            raise AirlightError(f"{folder}: cannot be read ({error.strerror}){hint}") from None
        return sorted(int(m[1] + m[2]) for m in found if len(m[2]) == self.digits or not m[2].startswith("0"))

    def nearest(self, otherwise: str) -> str:
        """Ask whether the pattern of frames in the folder that is most like this one is meant. otherwise: where none is."""
        folder, start = os.path.split(self.before)
        with contextlib.suppress(OSError, ValueError):
            names = itertools.islice(os.listdir(folder or "."), MOST_NAMES)
            there = {f"{m[1]}{'#' * len(m[2])}{m[3]}" for name in names if (m := _FRAME.fullmatch(name))}
            if found := close(f"{start}{'#' * self.digits}{self.after}", sorted(there)):
                return f"; did you mean {os.path.join(folder, found[0])!r}?"
        return otherwise


def numbered(path: str) -> Numbered | None:
    """Find the pattern in a file's name (the last one), None for a plain name."""
    folder, name = os.path.split(path)
    places = list(_PATTERN.finditer(name))
    if not places or os.path.isfile(path):
        return None
    place = places[-1]
    digits = (len(place[0]) if len(place[0]) > 1 else 4) if place[1] is None else int(place[1] or 1)
    return Numbered(os.path.join(folder, name[: place.start()]), digits, name[place.end() :], place[0])


def is_explicit_pattern(path: str) -> bool:
    """Tell whether a name can hardly be meant but as a pattern: `##` or `%04d`; one `#` is common in plain names."""
    return re.search(r"##|%0\d+d", os.path.basename(path)) is not None


def frames(text: str) -> list[int]:
    """Parse `1-100x2,150`: the numbers, in the order written, each once. Raises AirlightError."""
    out: dict[int, None] = {}
    for part in text.split(","):
        found = _RANGE.fullmatch(part)
        if found is None or (found[3] and int(found[3]) == 0):
            raise AirlightError(f"cannot read the frames {text!r}: write first-last or first-lastxstep, as in 1-100x2,150")
        first = int(found[1])
        last = int(found[2]) if found[2] else first
        step = int(found[3] or 1)
        if abs(last - first) // step >= MOST:
            raise AirlightError(f"the frames {text!r} are more than {MOST}: give fewer")
        out |= dict.fromkeys(range(first, last + 1, step) if last >= first else range(first, last - 1, -step))
    return list(out)
