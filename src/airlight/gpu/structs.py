"""NumPy dtypes made from the structs of shaders, so that a record's names, types and offsets are declared once, in WGSL.

Offsets and sizes follow the WGSL specification, "Memory Layout": a member lies at the next multiple of its alignment.
"""

import re
from functools import cache
from typing import Any

import numpy as np

from airlight.gpu.shader import load

_COMMENT = re.compile(r"//[^\n]*")
_STRUCT = re.compile(r"\bstruct\s+(\w+)\s*\{([^}]*)\}")
_CONSTANT = re.compile(r"\bconst (\w+)(?:: \w+)? = (\d+)u?;")
_MEMBER = re.compile(r"(?:@\w+(?:\([^)]*\))?\s+)*(\w+)\s*:\s*(\w+(?:<[^,]*(?:<[^>]*>)?(?:,\s*\w+)?\s*>)?)\s*(?:,|$)")
_SCALARS = {"f": "f4", "i": "i4", "u": "u4", "f32": "f4", "i32": "i4", "u32": "u4"}
_VECTOR_ALIGNMENTS = {2: 8, 3: 16, 4: 16}  # bytes, by the number of components


@cache
def struct_dtype(path: str, name: str) -> np.dtype[Any]:
    """Make the dtype of a struct of a .wgsl file of the package, or of a file that it includes. Raises KeyError for an unknown one."""
    return dtype_of(load(path), name)


def dtype_of(code: str, kind: str) -> np.dtype[Any]:
    """Make the dtype of a host-shareable WGSL type: f32, i32, u32, vectors and matrices of them, arrays of a fixed size, structs of `code`.

    vecN is (N,); matCxR is (C, 4 or 2), a column a row, with the padding of three rows; array<T, N> is (N, ...). Raises KeyError.
    """
    return _layout(_COMMENT.sub("", code), kind.replace(" ", ""))[0]


def _layout(code: str, kind: str) -> tuple[np.dtype[Any], int]:
    """Find (dtype, alignment in bytes) of a type of code without comments."""
    if kind in _SCALARS:
        return np.dtype(_SCALARS[kind]), 4
    if vector := re.fullmatch(r"vec([234])(?:([fiu])|<(\w+)>)", kind):
        count = int(vector[1])
        return np.dtype((_SCALARS[vector[2] or vector[3]], (count,))), _VECTOR_ALIGNMENTS[count]
    if matrix := re.fullmatch(r"mat([234])x([234])(?:f|<f32>)", kind):
        columns, rows = int(matrix[1]), int(matrix[2])
        return np.dtype(("f4", (columns, 2 if rows == 2 else 4))), _VECTOR_ALIGNMENTS[rows]
    if array := re.fullmatch(r"array<(.+),(\w+?)u?>", kind):
        element, alignment = _layout(code, array[1])
        constants = dict(_CONSTANT.findall(code))
        count = int(constants.get(array[2]) or array[2])
        if element.itemsize % alignment:
            stride = _rounded(element.itemsize, alignment)
            element = np.dtype({"names": ["value"], "formats": [element], "offsets": [0], "itemsize": stride})
        if element.subdtype:
            return np.dtype((element.subdtype[0], (count, *element.shape))), alignment
        return np.dtype((element, (count,))), alignment
    members = dict(_STRUCT.findall(code))[kind]
    if "@size" in members or "@align" in members:
        raise ValueError(f"struct {kind}: @size and @align are not read here")
    names, formats, offsets = [], [], []
    end, largest = 0, 4
    for name, member in _MEMBER.findall(members):
        dtype, alignment = _layout(code, member.replace(" ", ""))
        names.append(name)
        formats.append(dtype)
        offsets.append(_rounded(end, alignment))
        end, largest = offsets[-1] + dtype.itemsize, max(largest, alignment)
    return np.dtype({"names": names, "formats": formats, "offsets": offsets, "itemsize": _rounded(end, largest)}), largest


def _rounded(size: int, alignment: int) -> int:
    return -(-size // alignment) * alignment
