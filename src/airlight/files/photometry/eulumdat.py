"""Read photometric files of EULUMDAT (.ldt): a line a value."""

import re
from collections.abc import Iterator

import numpy as np

from airlight.errors import AirlightError
from airlight.files.photometry.distribution import MAX_VALUES, IntensityDistribution, distribution
from airlight.files.photometry.numbers import NUMBER, as_numbers, next_pieces

_COUNTS = range(2, 6)  # lines, from 1, that are numbers in every file: kind, symmetry, planes and their distance
MAX_SETS = 20  # of lamps


def is_eulumdat(text: str) -> bool:
    """Tell whether the lines that say how many planes there are hold numbers."""
    head = text.split("\n", _COUNTS.stop)[_COUNTS.start - 1 : _COUNTS.stop - 1]
    return len(head) == len(_COUNTS) and all(NUMBER.fullmatch(_plain(line)) for line in head)


def parse(text: str, path: str) -> IntensityDistribution:
    """Read the text of a file, with \\n at the ends of lines. Raises AirlightError."""
    lines = _Lines(text, path)
    lines.skip(2, "its head")
    symmetry, planes = (int(value) for value in lines.counts(2, "symmetry and number of planes"))
    lines.skip(1, "its head")
    rows = int(lines.counts(1, "number of angles")[0])
    if symmetry > 4:
        raise AirlightError(f"{path}: its symmetry, line 3, is {symmetry:g}; it must be 0 to 4")
    first, stored = {
        0: (0, planes),
        1: (0, 1),
        2: (0, planes // 2 + 1),
        3: (planes - planes // 4, planes // 2 + 1),
        4: (0, planes // 4 + 1),
    }[symmetry]
    if not planes >= 1 or rows < 1 or max(planes, stored) * rows > MAX_VALUES:
        raise AirlightError(f"{path}: claims {planes:g} planes of {rows:g} angles, none or too many ({MAX_VALUES}); export it again")
    lines.skip(17, "its head")
    conversion = lines.amount("conversion factor")
    lines.skip(1, "its head")
    sets = max(1, int(abs(lines.amount("number of lamp sets"))))
    if sets > MAX_SETS:
        raise AirlightError(f"{path}: claims {sets:g} sets of lamps, more than {MAX_SETS}; export it again")
    told: list[str] = []
    flux = _flux(lines, sets, path, told)
    lines.skip(10, "its direct ratios")
    listed, vertical = lines.take(planes, "planes' angles"), lines.take(rows, "angles")
    horizontal = [listed[i % planes] + 360 * (i // planes) for i in range(first, first + stored)]
    candela = np.array(lines.take(stored * rows, "intensities")).reshape(stored, rows)
    scale = flux / 1000 * (conversion if conversion > 0 else 1.0)
    return distribution("C", (vertical, horizontal[:1] if stored == 1 else horizontal), candela * scale, path, told=told)


def _flux(lines: "_Lines", sets: int, path: str, told: list[str]) -> float:
    """Read the luminous flux, lumens, of the first set of lamps, by which the intensities count; 1000 where it is not said."""
    flux = 0.0
    for i in range(sets):
        lines.skip(2, "its lamps")
        found = lines.amount("lamps' flux")
        flux = found if i == 0 else flux
        lines.skip(3, "its lamps")
    if flux <= 0:
        told.append(f"{path}: says no luminous flux; its candela are those of 1000 lumens")
    return flux if flux > 0 else 1000.0


def _plain(line: str) -> str:
    """Write a number with a point, as some files have a comma."""
    return line.strip().replace(",", ".")


class _Lines:
    """Takes lines one after the other."""

    def __init__(self, text: str, path: str) -> None:
        self._lines: Iterator[str] = (found[0] for found in re.finditer(r"[^\n]*\n|[^\n]+\Z", text))
        self._path = path

    def skip(self, count: int, word: str) -> None:
        """Leave lines out. word: what they are. Raises AirlightError."""
        next_pieces(self._lines, count, word, self._path)

    def take(self, count: int, word: str) -> list[float]:
        """Take so many numbers; word: what they are. Raises AirlightError."""
        return as_numbers([_plain(line) for line in next_pieces(self._lines, count, f"its {word}", self._path)], word, self._path)

    def amount(self, word: str) -> float:
        """Take a number that may be left out, as an empty line: 0 then. Raises AirlightError."""
        (line,) = next_pieces(self._lines, 1, f"its {word}", self._path)
        return as_numbers([_plain(line) or "0"], word, self._path)[0]

    def counts(self, count: int, word: str) -> list[float]:
        """Take so many whole numbers from 0 on. Raises AirlightError."""
        found = self.take(count, word)
        wrong = next((value for value in found if value < 0 or value != int(value)), None)
        if wrong is not None:
            raise AirlightError(f"{self._path}: {wrong:g} stands for its {word}; it must be whole, 0 or more")
        return found
