"""Read particles from tables of text: .csv, with commas, semicolons, tabs or blanks between columns, with or without a line of names."""

import itertools
import re
from collections.abc import Iterator, Sequence
from typing import BinaryIO

import numpy as np

from airlight.errors import AirlightError
from airlight.files.particles.columns import MAX_COLUMNS, MAX_PARTICLES, Columns, Particles, by_name, by_place, check_count
from airlight.messages import counted

MAX_TEXT = 2**28  # bytes
MAX_LINE = 2**14  # bytes
_AT = re.compile(r"at row (\d+)")


def read(file: BinaryIO, path: str) -> Particles:
    """Read a table. Raises AirlightError."""
    if file.seek(0, 2) > MAX_TEXT:
        raise AirlightError(f"{path}: is text of more than {MAX_TEXT >> 20} MiB; save it as .npz")
    file.seek(0)
    numbered = lines(file, path)
    names: list[str] | None = None
    for at, line in numbered:
        if line.startswith("#"):  # many programs begin the line of names so
            names = names or _names(line[1:], path)
            continue
        divider = _divider(line)
        fields = divided(line, divider)
        if all(_is_number(field, divider) for field in fields):
            numbered = itertools.chain([(at, line)], numbered)
        else:
            names, fields = fields, []
        break
    else:
        raise AirlightError(f"{path}: holds no numbers; give x, y, z, radius and density in each line")
    if not fields:  # what divides the names need not divide the numbers
        first = next(((at, line) for at, line in numbered if not line.startswith("#")), None)
        if first is None:
            return _columns(names, 0, path).particles(lambda _: np.zeros(0), path)
        divider = _divider(first[1])
        fields, numbered = divided(first[1], divider), itertools.chain([first], numbered)
    columns = _columns(names, len(fields), path)
    table = _table(numbered, divider, columns.used, len(fields), path)
    return columns.particles(lambda column: table[:, columns.used.index(column)], path)


def lines(file: BinaryIO, path: str) -> Iterator[tuple[int, str]]:
    """Give the lines that hold something, with their numbers from 1. Raises AirlightError for what is no text."""
    for at in itertools.count(1):
        raw = file.readline(MAX_LINE + 1)
        if not raw:
            return
        if len(raw) > MAX_LINE:
            raise AirlightError(f"{path}: its line {at} is longer than {MAX_LINE} bytes: it is no table; give x, y, z in each line")
        if b"\0" in raw:
            raise AirlightError(f"{path}: holds bytes that are no text; save it as plain text, UTF-8")
        line = raw.decode("utf-8", "replace").removeprefix("\ufeff").strip()
        if line:
            yield at, line


def divided(line: str, divider: str | None) -> list[str]:
    """Divide a line into its fields, without what ends it."""
    fields = [field.strip().strip("\"'") for field in line.split(divider)]
    while len(fields) > 1 and not fields[-1]:
        fields.pop()
    return fields


def _divider(line: str) -> str | None:
    """Choose what stands between columns; None: blanks."""
    return next((one for one in ";\t," if one in line), None)


def _is_number(field: str, divider: str | None) -> bool:
    try:
        float(field if divider in (",", None) else field.replace(",", "."))
    except ValueError:
        return False
    return True


def _names(line: str, path: str) -> list[str] | None:
    """Take the names of columns from a comment; None where it has none."""
    fields = divided(line.strip(), _divider(line.strip()))
    try:
        by_name(fields, path)
    except AirlightError:
        return None
    return fields


def _columns(names: Sequence[str] | None, count: int, path: str) -> Columns:
    if max(count, len(names or ())) > MAX_COLUMNS:
        raise AirlightError(f"{path}: has more than {MAX_COLUMNS} columns; leave x, y, z, radius and density")
    return by_place(count, path) if names is None else by_name(names, path)


def _table(numbered: Iterator[tuple[int, str]], divider: str | None, used: Sequence[int], count: int, path: str) -> np.ndarray:
    """Parse the numbers of the used columns, (N, len(used)) float64. count: of columns in the first line, which others must have."""
    if max(used) >= count:
        there = f"{counted(count, 'number')} in a line, but names for {counted(max(used) + 1, 'column')}"
        raise AirlightError(f"{path}: has {there}; export it again")
    places: list[int] = []

    def texts() -> Iterator[str]:
        for at, line in numbered:
            if not line.startswith("#"):
                places.append(at)
                yield line if divider in (",", None) else line.replace(",", ".")

    try:
        table = np.loadtxt(
            texts(), np.float64, comments=None, delimiter=divider, usecols=used, ndmin=2, quotechar='"', max_rows=MAX_PARTICLES + 1
        )
    except ValueError as error:
        row = _AT.search(str(error))
        at = places[min(int(row[1]), len(places) - 1)] if row is not None and places else 0
        what = "has fewer columns than the first" if "column index" in str(error) else "holds what is no number"
        raise AirlightError(f"{path}: its line {at} {what}; export it again") from None
    check_count(len(table), path)
    return table
