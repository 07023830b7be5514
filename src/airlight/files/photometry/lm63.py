"""Read photometric files of IES LM-63, 1986 to 2019 (.ies)."""

import re
from collections.abc import Iterator

import numpy as np

from airlight.errors import AirlightError
from airlight.files.photometry.distribution import MAX_VALUES, IntensityDistribution, distribution
from airlight.files.photometry.numbers import NUMBER, as_numbers, next_pieces

KINDS = {1: "C", 2: "B", 3: "A"}
MAX_TILTS = 10_000
_TILT = re.compile(r"^[ \t]*TILT[ \t]*=[ \t]*([^\n]*)$", re.IGNORECASE | re.MULTILINE)
_TOKEN = re.compile(r"[^\s,]+")
_OLD = re.compile(r"(?!IES)|IESNA(86|91)|IESNA:LM-63-(1986|1991)", re.IGNORECASE)  # first lines of versions with a ballast-lamp factor


def is_lm63(text: str) -> bool:
    """Tell whether a text has the line that such files cannot lack."""
    return _TILT.search(text) is not None


def parse(text: str, path: str) -> IntensityDistribution:
    """Read the text of a file, with \\n at the ends of lines. Raises AirlightError."""
    tilt = _TILT.search(text)
    assert tilt is not None
    told: list[str] = []
    numbers = _Numbers(text, tilt.end(), path)
    tilted, source = None, tilt[1].strip().strip("\"'")
    if source.upper() == "INCLUDE":
        tilted = _tilt(numbers, path)
    elif source.upper() not in ("NONE", ""):
        told.append(f"{path}: the file {source[:60]!r} of its TILT section is not read: a tilted lamp is as bright as a level one")
    _, _, multiplier = numbers.take(3, "lamps, lumens and multiplier")
    rows, columns = numbers.counts(2, "vertical and horizontal angles")
    code = numbers.take(1, "type of photometry")[0]
    if code not in KINDS:
        raise AirlightError(f"{path}: its type of photometry is {code:g}; it must be 1 (C), 2 (B) or 3 (A)")
    numbers.take(4, "units and size")  # of the luminous opening: a lamp is a point here
    ballast, lamp, _ = numbers.take(3, "ballast factors and watts")
    scale = _factor(multiplier, "multiplier", path, told) * _factor(ballast, "ballast factor", path, told)
    if _OLD.match(text.lstrip()):
        scale *= _factor(lamp, "ballast-lamp factor", path, told)
    if rows * columns > MAX_VALUES:
        raise AirlightError(f"{path}: claims {rows:g} times {columns:g} intensities, more than {MAX_VALUES}; export it with fewer")
    vertical, horizontal = numbers.take(rows, "vertical angles"), numbers.take(columns, "horizontal angles")
    candela = np.array(numbers.take(rows * columns, "intensities")).reshape(columns, rows) * scale
    if numbers.more():
        told.append(f"{path}: holds more numbers than the {rows} times {columns} intensities that it says; they are left out")
    return distribution(KINDS[int(code)], (vertical, horizontal), candela, path, tilt=tilted, told=told)


def _tilt(numbers: "_Numbers", path: str) -> np.ndarray:
    """Read the section of TILT=INCLUDE: (2, N) degrees and factors."""
    numbers.take(1, "lamp's geometry")
    count = numbers.counts(1, "tilt angles")[0]
    if count > MAX_TILTS:
        raise AirlightError(f"{path}: claims {count:g} tilt angles, more than {MAX_TILTS}; export it with fewer")
    tilt = np.array([numbers.take(count, "tilt angles"), numbers.take(count, "tilt factors")])
    if not (np.diff(tilt[0]) > 0).all() or tilt[1].min() < 0:
        raise AirlightError(f"{path}: its tilt angles do not rise, or their factors are below 0; correct them, or write TILT=NONE")
    return tilt


def _factor(value: float, word: str, path: str, told: list[str]) -> float:
    if value < 0:
        raise AirlightError(f"{path}: its {word} is {value:g}; it must be more than 0")
    if value == 0:
        told.append(f"{path}: its {word} is 0, taken for 1")
    return value or 1.0


class _Numbers:
    """Takes numbers one after the other, parted by blanks, commas or ends of lines."""

    def __init__(self, text: str, start: int, path: str) -> None:
        self._tokens: Iterator[str] = (found[0] for found in _TOKEN.finditer(text, start))
        self._path = path

    def take(self, count: int, word: str) -> list[float]:
        """Take so many; word: what they are. Raises AirlightError."""
        return as_numbers(next_pieces(self._tokens, count, f"its {word}", self._path), word, self._path)

    def counts(self, count: int, word: str) -> list[int]:
        """Take so many whole numbers from 1 on, of how many of something there are. Raises AirlightError."""
        found = self.take(count, f"numbers of {word}")
        wrong = next((value for value in found if value < 1 or value != int(value)), None)
        if wrong is not None:
            raise AirlightError(f"{self._path}: {wrong:g} stands among its numbers of {word}; they must be whole, 1 or more")
        return [int(value) for value in found]

    def more(self) -> bool:
        """Tell whether a number follows."""
        token = next(self._tokens, None)
        return token is not None and NUMBER.fullmatch(token) is not None
