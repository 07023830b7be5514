"""Read NumPy's files, .npy and .npz, a plane at a time and without pickles. Format: NEP 1, and numpy.lib.format."""

import ast
import math
import re
import struct
import zipfile
import zlib
from dataclasses import dataclass
from typing import IO, BinaryIO

import numpy as np

from airlight.errors import AirlightError
from airlight.files.volumes.means import Means
from airlight.files.volumes.reader import Reader
from airlight.files.volumes.volume import CLAMPED, Findings, Volume, between, coarser, kept_shape, placed, sound_bounds
from airlight.messages import counted, nearest

MAGIC, ZIP_MAGIC = b"\x93NUMPY", b"PK\x03\x04"
MAX_DENSE = 2**31  # voxels of a dense grid that is read
MAX_DENSE_SIDE = 2**12
MAX_HEADER = 10_000  # bytes, as NumPy has it
MAX_MEMBERS = 1000
_SLAB = 2**22  # voxels that are read at once
_TYPE = re.compile(r"[<>|=]?(?:f[248]|[iu][1248]|b1)")
ZIP_ERRORS = (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError, ValueError, OSError, LookupError, struct.error)


@dataclass(frozen=True)
class Header:
    """dtype, shape and order of an array in a file, whose data follow."""

    dtype: np.dtype
    shape: tuple[int, ...]
    columns_first: bool


def read_npy(file: BinaryIO, path: str, bounds: np.ndarray | None, scale: float, up: str, limit: int) -> Volume:
    """Read density[z, y, x] between bounds (2, 3). Raises AirlightError."""
    reader = Reader(file, path)
    header = read_header(file, path)
    shape = volume_shape(header, path)
    if bounds is None:
        reader.refuse("has no place in the world", "give bounds=x0,y0,z0,x1,y1,z1 in metres, or save it as .npz with bounds")
    if reader.size - file.tell() < math.prod(shape) * header.dtype.itemsize:
        reader.refuse("is cut off", "copy or export it again")
    return read_dense(file, path, header, between(bounds, shape), scale, up, limit)


def read_npz(file: BinaryIO, path: str, grid: str | None, bounds: np.ndarray | None, scale: float, up: str, limit: int) -> Volume:
    """Read `density`, or the array that `grid` names, with `bounds` or `matrix` beside it. bounds: instead of the file's.

    Raises AirlightError.
    """
    reader = Reader(file, path)
    try:
        with zipfile.ZipFile(file) as archive:
            members = [info.filename for info in archive.infolist()]
            if len(members) > MAX_MEMBERS:
                reader.refuse(f"holds more than {MAX_MEMBERS} files", "export density and bounds alone")
            names = [name.removesuffix(".npy") for name in members if name.endswith(".npy")]
            name = _density_name(reader, names, grid)
            matrix = _array(archive, "matrix", path) if "matrix" in names else None
            told = _array(archive, "bounds", path) if "bounds" in names and bounds is None else bounds
            with archive.open(f"{name}.npy") as member:
                header = read_header(member, path)
                shape = volume_shape(header, path)
                if told is not None:
                    matrix = between(checked_bounds(told, path), shape)
                elif matrix is None:
                    reader.refuse("has no place in the world", "save bounds (2, 3) in metres beside it, or give bounds=x0,y0,z0,x1,y1,z1")
                return read_dense(member, path, header, _checked_matrix(matrix, path), scale, up, limit, name)
    except AirlightError:
        raise
    except ZIP_ERRORS as error:
        reader.damaged(f"its archive cannot be read ({' '.join(str(error).split())[:100] or type(error).__name__})")


def _density_name(reader: Reader, names: list[str], grid: str | None) -> str:
    there = ", ".join(map(repr, names[:10])) or "none"
    if grid is not None:
        if grid not in names:
            reader.refuse(f"has no array {grid!r}, but {there}{nearest(grid, names, '')}", "name one by grid=")
        return grid
    left = [name for name in names if name not in ("bounds", "matrix")]
    if "density" in left:
        return "density"
    if len(left) != 1:
        reader.refuse(f"has no array 'density', but {there}", "name one by grid=")
    return left[0]


def _array(archive: zipfile.ZipFile, name: str, path: str) -> np.ndarray:
    """Read a small array."""
    with archive.open(f"{name}.npy") as member:
        header = read_header(member, path)
        count = math.prod(header.shape)
        if count > 64:
            raise AirlightError(f"{path}: its {name} has {count} numbers; bounds are (2, 3), a matrix (4, 4)")
        data = member.read(count * header.dtype.itemsize)
        if len(data) != count * header.dtype.itemsize:
            raise EOFError(f"{name} is cut off")
        return np.frombuffer(data, header.dtype).astype(np.float64).reshape(header.shape, order="F" if header.columns_first else "C")


def read_header(file: IO[bytes], path: str) -> Header:
    """Read what precedes the data of an array. Raises AirlightError for what is no plain array of numbers."""
    start = file.read(8)
    if start[:6] != MAGIC or len(start) < 8 or start[6] not in (1, 2, 3):
        raise AirlightError(f"{path}: is damaged: an array that does not begin as NumPy's do; copy or export it again")
    length = int.from_bytes(file.read(2 if start[6] == 1 else 4), "little")
    text = file.read(min(length, MAX_HEADER))
    try:
        if length > MAX_HEADER or len(text) < length:
            raise ValueError
        told = ast.literal_eval(text.decode("utf-8" if start[6] == 3 else "latin-1").strip())
        type_name, columns_first, shape = told["descr"], told["fortran_order"], told["shape"]
        if not (isinstance(shape, tuple) and all(type(n) is int and n >= 0 for n in shape) and isinstance(columns_first, bool)):
            raise ValueError
    except (ValueError, SyntaxError, TypeError, KeyError, MemoryError, RecursionError):
        raise AirlightError(f"{path}: is damaged: an array whose header makes no sense; copy or export it again") from None
    if not isinstance(type_name, str) or _TYPE.fullmatch(type_name) is None:
        what = "Python objects, which are not read" if type_name == "|O" else f"values of type {str(type_name)[:40]}"
        raise AirlightError(f"{path}: holds {what}; save it as float32")
    return Header(np.dtype(type_name), shape, columns_first)


def volume_shape(header: Header, path: str) -> tuple[int, ...]:
    """Check the shape of a grid: (Z, Y, X), without axes of 1 behind. Raises AirlightError."""
    shape = header.shape
    if len(shape) == 4 and shape[3] == 1:
        shape = shape[:3]
    if len(shape) != 3:
        told = f"has {counted(len(shape), 'dimension')}, not three: its shape is {header.shape}"
        raise AirlightError(f"{path}: {told}; a volume is density[z, y, x]")
    if min(shape) < 1:
        raise AirlightError(f"{path}: has no voxels: its shape is {header.shape}; a volume is density[z, y, x]")
    check_size(shape, path)
    return shape


def check_size(shape: tuple[int, ...], path: str) -> None:
    """Raise AirlightError for dense grids that are too large to be read."""
    if max(shape) > MAX_DENSE_SIDE or math.prod(shape) > MAX_DENSE:
        sides = "x".join(map(str, shape[::-1]))
        most = f"{MAX_DENSE}, and {MAX_DENSE_SIDE} a side"
        raise AirlightError(f"{path}: {sides} voxels are more than the limit of {most}; make it smaller first")


def checked_bounds(bounds: np.ndarray, path: str) -> np.ndarray:
    """Check outer faces (2, 3). Raises AirlightError."""
    if bounds.shape == (6,):
        bounds = bounds.reshape(2, 3)
    if bounds.shape != (2, 3) or not sound_bounds(bounds):
        told = ", ".join(f"{v:g}" for v in bounds.ravel()[:6])
        raise AirlightError(f"{path}: bounds {told} are no box; give the least x, y, z, then the greatest, in metres")
    return bounds


def _checked_matrix(matrix: np.ndarray, path: str) -> np.ndarray:
    if matrix.shape != (4, 4) or not np.isfinite(matrix).all() or (matrix[3] != (0, 0, 0, 1)).any():
        raise AirlightError(f"{path}: its matrix is not (4, 4) with 0, 0, 0, 1 as last row, from x, y, z indices to metres; transpose it?")
    return matrix


def read_dense(
    file: IO[bytes], path: str, header: Header, matrix: np.ndarray, scale: float, up: str, limit: int, name: str = "",
    channels: int = 1, channel: int = 0,
) -> Volume:  # fmt: skip
    """Read the data of a dense grid. matrix: from indices to the file's space. channels: of each voxel, of which one is taken."""
    stored = header.shape[:3]
    kept = kept_shape(stored, limit)
    world = placed(coarser(matrix, stored, kept, np.zeros(3), 0), scale, up, path)
    findings = Findings(path)
    order = slice(None, None, -1) if header.columns_first else slice(None)
    planes = stored[order]
    means = Means(planes, kept[order])
    across = planes[1] * planes[2]
    many = max(1, _SLAB // (across * channels))
    for first in range(0, planes[0], many):
        count = min(many, planes[0] - first)
        size = count * across * channels * header.dtype.itemsize
        data = file.read(size)
        if len(data) != size:
            raise AirlightError(f"{path}: is cut off; copy or export it again")
        values = np.frombuffer(data, header.dtype).reshape(count, planes[1], planes[2], channels)[..., channel]
        index = [np.arange(first, first + count)[:, None, None], np.arange(planes[1])[:, None], np.arange(planes[2])]
        means.add_planes(findings.clean(values, index if header.columns_first else index[::-1]), first)
    findings.judge(kept != stored)
    grid = means.grid.T if header.columns_first else means.grid
    if kept == stored:
        findings.mend(grid, np.zeros(3, np.int64))
    else:
        findings.note_coarser(stored, kept, limit)
    return findings.finish(grid, world, CLAMPED, name, stored)
