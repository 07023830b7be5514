"""What the sheet and the page show: figures already words, pictures linear."""

import math
from dataclasses import dataclass
from typing import Any

import numpy.typing as npt


@dataclass
class ShownRow:
    """A variant. cells: its figures by column, as words; lines: the same for the sheet; pictures: (caption, linear), the first with shafts."""

    name: str
    text: str  # as written
    cells: dict[str, str]
    lines: list[str]
    pictures: list[tuple[str, npt.NDArray[Any]]]
    faint: str = ""  # one more line


@dataclass
class Shown:
    """A comparison. notes: how the figures were got, a sentence each."""

    rows: list[ShownRow]
    notes: list[str]
    before: npt.NDArray[Any]  # (h, w, 3) the picture without shafts


def percent(share: float) -> str:
    """Two significant digits: 0.17 %, 15 %."""
    digits = -1 - math.floor(math.log10(abs(share))) if share else 0
    return f"{100 * share:.{min(max(digits, 0), 4)}f} %"
