"""Read particles from PLY: the vertices of an ascii or a binary file. Format: Turk 1994, The PLY Polygon File Format."""

import itertools
from dataclasses import dataclass, field
from typing import BinaryIO

import numpy as np

from airlight.errors import AirlightError
from airlight.files.particles.columns import MAX_COLUMNS, Particles, by_name, check_count
from airlight.files.particles.text import lines

MAGIC = b"ply"
MAX_HEADER = 2**16  # bytes
MAX_SKIPPED = 2**24  # rows of text before the vertices
_TYPES = {"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4", "float": "f4", "double": "f8"}
_TYPES |= {"int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4", "float32": "f4", "float64": "f8"}
_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}


@dataclass
class _Element:
    """Describes rows of a file: their number, and names and types of what each holds, "" for a list."""

    name: str
    count: int
    names: list[str] = field(default_factory=list)
    types: list[str] = field(default_factory=list)

    def dtype(self, order: str) -> np.dtype:
        return np.dtype([(name, order + kind) for name, kind in zip(self.names, self.types, strict=True)])


def read(file: BinaryIO, path: str) -> Particles:
    """Read the element `vertex`, or `point`. Raises AirlightError."""
    order, elements = _header(file, path)
    at = next((i for i, one in enumerate(elements) if one.name in ("vertex", "point", "particle")), None)
    if at is None:
        raise AirlightError(f"{path}: has no vertices; export it with its points")
    element = elements[at]
    if "" in element.types or len(set(element.names)) < len(element.names) or len(element.names) > MAX_COLUMNS:
        what = f"lists, a name twice, or more than {MAX_COLUMNS} numbers"
        raise AirlightError(f"{path}: its vertices hold {what}; export x, y, z, radius and density alone")
    check_count(element.count, path)
    columns = by_name(element.names, path)
    if order:
        start = file.tell()
        for before in elements[:at]:
            if "" in before.types:
                raise AirlightError(f"{path}: has lists before its vertices; export the points alone")
            start += before.count * before.dtype(order).itemsize
        kind = element.dtype(order)
        size = element.count * kind.itemsize
        if start + size > file.seek(0, 2):
            raise AirlightError(f"{path}: is cut off; copy or export it again")
        file.seek(start)
        rows = np.frombuffer(file.read(size), kind)
        return columns.particles(lambda column: rows[element.names[column]], path)
    table = _rows(file, sum(before.count for before in elements[:at]), element, columns.used, path)
    return columns.particles(lambda column: table[:, columns.used.index(column)], path)


def _header(file: BinaryIO, path: str) -> tuple[str, list[_Element]]:
    """Read the header: the order of bytes, "" for text, and the elements."""
    order, elements = None, []
    for at, raw in enumerate(itertools.takewhile(bool, iter(lambda: file.readline(MAX_HEADER), b""))):
        words = raw.decode("utf-8", "replace").split()
        if file.tell() > MAX_HEADER or not raw.endswith(b"\n"):
            break
        if at == 0:
            if words != ["ply"]:
                break
        elif words[:1] == ["format"] and len(words) >= 2 and words[1] in _ORDERS:
            order = _ORDERS[words[1]]
        elif words[:1] == ["element"] and len(words) == 3 and words[2].isdecimal() and len(words[2]) < 16:
            elements.append(_Element(words[1], int(words[2])))
        elif words[:1] == ["property"] and elements and len(words) == 3 and words[1] in _TYPES:
            elements[-1].names.append(words[2])
            elements[-1].types.append(_TYPES[words[1]])
        elif words[:2] == ["property", "list"] and elements and len(words) == 5:
            elements[-1].names.append(words[4])
            elements[-1].types.append("")
        elif words == ["end_header"]:
            if order is not None:
                return order, elements
            break
        elif words and words[0] not in ("comment", "obj_info"):
            break
    raise AirlightError(f"{path}: is damaged: its header makes no sense; copy or export it again")


def _rows(file: BinaryIO, skipped: int, element: _Element, used: list[int], path: str) -> np.ndarray:
    """Parse the vertices of a file that is text, after so many rows of others."""
    if skipped > MAX_SKIPPED:
        raise AirlightError(f"{path}: has {skipped} rows before its vertices; export the points alone")
    if element.count == 0:
        return np.zeros((0, len(used)))
    there = (line for _, line in itertools.islice(lines(file, path), skipped, skipped + element.count))
    first = next(there, None)
    if first is None:
        raise AirlightError(f"{path}: is cut off: it has none of its {element.count} vertices; copy or export it again")
    try:
        table = np.loadtxt(itertools.chain([first], there), np.float64, comments=None, usecols=used, ndmin=2)
    except ValueError:
        raise AirlightError(f"{path}: is damaged: a vertex holds what is no number, or too few; copy or export it again") from None
    if len(table) != element.count:
        raise AirlightError(f"{path}: is cut off: it has {len(table)} of its {element.count} vertices; copy or export it again")
    return table
