"""Read particles from NumPy's .npz: arrays by name, without pickles."""

import math
import zipfile
from typing import BinaryIO

import numpy as np

from airlight.errors import AirlightError
from airlight.files.particles.columns import DENSITY, RADIUS, Particles, check_count
from airlight.files.volumes.arrays import MAX_MEMBERS, ZIP_ERRORS, ZIP_MAGIC, read_header
from airlight.messages import counted, nearest

MAGIC = ZIP_MAGIC
POSITIONS = ("positions", "position", "points", "vertices", "xyz", "P")


def kind_of(path: str) -> str | None:
    """Tell by the shape of its density, or of its positions, of what an .npz is: "particles" or "volume"; None where they do not say."""
    try:
        with zipfile.ZipFile(path) as archive:
            names = [info.filename.removesuffix(".npy") for info in archive.infolist()]
            points = next((name for name in POSITIONS if name in names), None)
            told = next((name for name in ("density", points) if name in names), None)
            if told is None:
                return None
            with archive.open(f"{told}.npy") as member:
                axes = len(read_header(member, path).shape)
    except (AirlightError, *ZIP_ERRORS):
        return None
    if told == "density" and axes > 2:
        return "volume"
    return "particles" if points is not None and axes == (1 if told == "density" else 2) else None


def read(file: BinaryIO, path: str) -> Particles:
    """Read `positions` (N, 3), or x, y and z (N,), with `radius` and `density` (N,), or one for all, beside them. Raises AirlightError."""
    try:
        with zipfile.ZipFile(file) as archive:
            members = [info.filename for info in archive.infolist()]
            if len(members) > MAX_MEMBERS:
                raise AirlightError(f"{path}: holds more than {MAX_MEMBERS} files; save positions, radius and density alone")
            names = [name.removesuffix(".npy") for name in members if name.endswith(".npy")]
            whole = next((name for name in POSITIONS if name in names), None)
            if whole is not None:
                points = _array(archive, whole, path, 2)
            elif {"x", "y", "z"} <= set(names):
                points = np.stack(np.broadcast_arrays(*(_array(archive, axis, path, 1) for axis in "xyz")), axis=-1)
            else:
                there = ", ".join(repr(name[:30]) for name in names[:10]) or "none"
                hint = nearest(POSITIONS[0], names, "")
                raise AirlightError(f"{path}: has no array 'positions', but {there}{hint}; save positions (N, 3), radius and density")
            columns = [next((name for name in known if name in names), None) for known in (RADIUS, DENSITY)]
            radii, densities = (None if name is None else _of_each(archive, name, len(points), path) for name in columns)
            told = []
            for wanted, one in zip(("radius", "density"), columns, strict=True):
                meant = next((name for name in names if name != whole and nearest(name, (wanted,))), None)
                if one is None and meant is not None:
                    told.append(f"{path}: its array {meant[:30]!r} is not read; name it {wanted!r} if it is that")
            return Particles(points, radii, densities, path, tuple(told))
    except AirlightError:
        raise
    except ZIP_ERRORS as error:
        reason = " ".join(str(error).split())[:100] or type(error).__name__
        raise AirlightError(f"{path}: is damaged: its archive cannot be read ({reason}); copy or export it again") from None


def _array(archive: zipfile.ZipFile, name: str, path: str, axes: int) -> np.ndarray:
    """Read (N, 3) or (N,) numbers, float64."""
    with archive.open(f"{name}.npy") as member:
        header = read_header(member, path)
        fits = len(header.shape) == 2 and header.shape[1] == 3 if axes == 2 else len(header.shape) <= 1 or header.shape[1:] == (1,)
        if not fits:
            raise AirlightError(f"{path}: its array {name!r} has the shape {header.shape}; give {'(N, 3)' if axes == 2 else '(N,)'}")
        check_count(header.shape[0] if header.shape else 1, path)
        size = math.prod(header.shape) * header.dtype.itemsize
        data = member.read(size)
        if len(data) != size:
            raise EOFError(f"{name} is cut off")
        found = np.frombuffer(data, header.dtype).astype(np.float64)
        return found.reshape(header.shape, order="F" if header.columns_first else "C") if axes == 2 else found


def _of_each(archive: zipfile.ZipFile, name: str, count: int, path: str) -> np.ndarray:
    values = _array(archive, name, path, 1)
    if len(values) not in (1, count):
        there = f"{counted(count, 'position')}, but {counted(len(values), 'value')} of {name!r}"
        raise AirlightError(f"{path}: has {there}; save one for each, or one for all")
    return np.array(np.broadcast_to(values, (count,)))
