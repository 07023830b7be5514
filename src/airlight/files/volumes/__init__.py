"""Volumes: densities on grids from OpenVDB's .vdb, NumPy's .npy and .npz, and Mitsuba's .vol, with their place in the world; and of
numbered files the one of a frame."""

from collections.abc import Sequence

import numpy as np

from airlight.errors import AirlightError, warn
from airlight.files.decode import opened
from airlight.files.sequence import numbered
from airlight.files.volumes import arrays, mitsuba, vdb
from airlight.files.volumes.volume import MAX_VOXELS, Volume
from airlight.messages import nearest

FORMATS = {".vdb": "OpenVDB", ".npz": "NumPy", ".npy": "NumPy", ".vol": "Mitsuba"}
UP = ("y", "z")

__all__ = ["FORMATS", "MAX_VOXELS", "UP", "Volume", "file_of_frame", "read_volume"]


def read_volume(
    path: str,
    grid: str | None = None,
    bounds: Sequence[float] | np.ndarray | None = None,
    scale: float = 1.0,
    up: str | None = None,
    limit: int = MAX_VOXELS,
    tell: bool = True,
) -> Volume:
    """Read a volume.

    grid: the name of a grid of a .vdb, of an array of an .npz, or the number of a channel of a .vol; unset: `density`, or the only one.
    bounds: the outer faces (2, 3) of a dense grid in its own axes and units, for .npy, or instead of those of an .npz or .vol.
    scale: metres a unit, > 0. up: the file's axis that points up, y unless it is z. limit: voxels; larger grids are coarsened to it.
    Warns of what was mended, with `tell`. Raises AirlightError.
    """
    box = None if bounds is None else arrays.checked_bounds(np.asarray(bounds, np.float64), path)
    if not (np.isfinite(scale) and scale > 0):
        raise AirlightError(f"{path}: scale is {scale:g}; give metres a unit, more than 0")
    up = up or "y"
    if up not in UP:
        raise AirlightError(f"{path}: up is {up!r}{nearest(up, UP)}; use y or z")
    quiet = np.errstate(all="ignore")  # of numbers that are none, which are looked for
    with opened(path, "a volume: .vdb, .npz, .npy or .vol") as (name, head), open(name, "rb") as file, quiet:
        if head.startswith(vdb.MAGIC):
            if box is not None:
                raise AirlightError(f"{path}: lies where the file itself says; leave its bounds away, scale and up are for it")
            volume = vdb.read(file, path, grid, scale, up, limit)
        elif head.startswith(arrays.ZIP_MAGIC):
            volume = arrays.read_npz(file, path, grid, box, scale, up, limit)
        elif head.startswith(arrays.MAGIC):
            volume = arrays.read_npy(file, path, box, scale, up, limit)
        elif head.startswith(mitsuba.MAGIC):
            volume = mitsuba.read(file, path, grid, box, scale, up, limit)
        else:
            raise AirlightError(f"{path}: {'is no volume that Airlight reads' if head else 'is empty'}; give {', '.join(FORMATS)}")
    for line in volume.told if tell else ():
        warn(line)
    return volume


def file_of_frame(path: str, frame: int, there: Sequence[int] | None = None) -> str:
    """Name the file of a frame of `smoke.####.vdb`: its own, before the first that of the first, else the last one before it.

    A name without a place for a number stays. there: the numbers of the files that there are, in order, where they are known already.
    Raises AirlightError where there is none.
    """
    pattern = numbered(path)
    if pattern is None:
        return path
    numbers = pattern.on_disk() if there is None else there
    if not numbers:
        raise AirlightError(f"{path}: there are no files of that pattern{pattern.nearest('; check the name')}")
    return pattern.frame(max((n for n in numbers if n <= frame), default=numbers[0]))
