"""Decode KHR_draco_mesh_compression by DracoPy, after its header has said that the result is no larger than the file's accessors."""

from typing import Any

import numpy as np

_METADATA = 0x8000  # of the header's flags
_SEQUENTIAL, _EDGEBREAKER = 0, 1


class _Bytes:
    """Reads numbers of Draco's bit stream (its specification 2.2, sections 2 to 4). Raises ValueError at its end."""

    def __init__(self, data: bytes) -> None:
        self.data, self.at = data, 0

    def number(self, size: int) -> int:
        found = self.data[self.at : self.at + size]
        if len(found) < size:
            raise ValueError("it is cut off")
        self.at += size
        return int.from_bytes(found, "little")

    def varint(self) -> int:
        found = 0
        for shift in range(0, 70, 7):
            byte = self.number(1)
            found |= (byte & 127) << shift
            if byte < 128:
                return found
        raise ValueError("its header is damaged")

    def skip_metadata(self) -> None:
        """Skip the names of attributes and all that hangs on them."""
        for _ in range(self.varint()):
            self.varint()
            self._skip_entries()
        self._skip_entries()

    def _skip_entries(self) -> None:
        left = 1
        while left:
            left -= 1
            for _ in range(self.varint()):
                self._skip(self.number(1))
                self._skip(self.varint())
            below = self.varint()
            for _ in range(below):
                self._skip(self.number(1))
            left += below

    def _skip(self, size: int) -> None:
        self.at += size
        if self.at > len(self.data):
            raise ValueError("it is cut off")


def counts(data: bytes) -> tuple[int, int]:
    """Read how many triangles and how many points a header declares. Raises ValueError for what is no mesh of Draco's."""
    source = _Bytes(data)
    if data[:5] != b"DRACO":
        raise ValueError("it does not begin as Draco does")
    source.at = 5
    major, minor, kind, method, flags = (source.number(size) for size in (1, 1, 1, 1, 2))
    if (major, minor) < (2, 2) or kind != 1 or method not in (_SEQUENTIAL, _EDGEBREAKER):
        raise ValueError(f"it is of version {major}.{minor} and kind {kind}")
    if flags & _METADATA:
        source.skip_metadata()
    if method == _SEQUENTIAL:
        faces, points = source.varint(), source.varint()
    else:
        source.number(1)
        points, faces = source.varint(), source.varint()
    return faces, points


def decode(data: bytes, corners: int, limit: int) -> tuple[np.ndarray, dict[int, np.ndarray]]:
    """Decode (F, 3) triangles, and of each attribute's number (N, components). Raises ValueError.

    corners: three times the triangles, as the file has it; limit: bytes of a decoded array.
    """
    import DracoPy

    faces, points = counts(data)
    if faces * 3 > corners or max(faces, points) * 12 > limit:
        raise ValueError(f"its header says {faces} triangles and {points} points, more than the file does")
    try:
        mesh: Any = DracoPy.decode(data)
        triangles = np.asarray(mesh.faces, np.uint32).reshape(-1, 3)
        attributes = {int(one["unique_id"]): np.asarray(one["data"]) for one in mesh.attributes}
    except (DracoPy.FileTypeException, ValueError, MemoryError, KeyError, TypeError, AttributeError, RuntimeError) as error:
        raise ValueError("it is damaged") from error
    return triangles, attributes


def typed(attributes: dict[int, np.ndarray], number: int, kind: np.dtype[Any]) -> np.ndarray:
    """Choose an attribute by its number, or the triangles by -1: (N, components), of the accessor's type. Raises ValueError."""
    if number not in attributes:
        raise ValueError(f"it has no attribute {number}")
    found, name = attributes[number], "list of triangles" if number < 0 else f"attribute {number}"
    if (found.dtype.kind == "f") != (kind.kind == "f"):
        raise ValueError(f"its {name} is {found.dtype} instead of {kind}")
    if kind.kind != "f" and found.size and int(found.max()) > np.iinfo(kind).max:
        raise ValueError(f"its {name} does not fit into {kind}")
    return found.reshape(len(found), -1).astype(kind)
