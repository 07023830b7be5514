"""Read Mitsuba's grids, .vol: a header of 48 bytes, then float32 by z, y, x and channel. Format: Mitsuba's `gridvolume` plugin."""

import math
from typing import BinaryIO

import numpy as np

from airlight.files.volumes.arrays import Header, check_size, checked_bounds, read_dense
from airlight.files.volumes.reader import Reader
from airlight.files.volumes.volume import Volume, between, sound_bounds

MAGIC = b"VOL"
VERSION, FLOATS = 3, 1
MAX_CHANNELS = 16


def read(file: BinaryIO, path: str, grid: str | None, bounds: np.ndarray | None, scale: float, up: str, limit: int) -> Volume:
    """Read a grid. grid: the number of the channel, from 0, of several. bounds: instead of the file's. Raises AirlightError."""
    reader = Reader(file, path)
    if reader.bytes(3) != MAGIC:
        reader.damaged("it does not begin as Mitsuba's volumes do")
    version, kind, *sides, channels = (int(n) for n in reader.numbers("B5i"))
    told = np.array(reader.numbers("6f"), np.float64).reshape(2, 3)
    if version != VERSION:
        reader.refuse(f"is of version {version} of Mitsuba's volumes", f"save it as version {VERSION}")
    if kind != FLOATS:
        reader.refuse(f"holds values of kind {kind}, not float32", "save it as float32")
    shape = tuple(sides[::-1])
    if min(shape) < 1 or not 1 <= channels <= MAX_CHANNELS:
        reader.damaged(f"{'x'.join(map(str, sides))} voxels of {channels} channels")
    check_size((*shape[:2], shape[2] * channels), path)
    if reader.size - file.tell() < 4 * channels * math.prod(shape):
        reader.refuse("is cut off", "copy or export it again")
    channel = _channel(reader, grid, channels)
    if bounds is None and not sound_bounds(told):
        where = ", ".join(f"{v:g}" for v in told.ravel())
        reader.refuse(f"its bounds are no box: {where}", "give bounds=x0,y0,z0,x1,y1,z1 in metres")
    place = between(told if bounds is None else checked_bounds(bounds, path), shape)
    header = Header(np.dtype("<f4"), shape, False)
    return read_dense(file, path, header, place, scale, up, limit, grid or "", channels, channel)


def _channel(reader: Reader, grid: str | None, channels: int) -> int:
    numbers = [str(n) for n in range(channels)]
    if grid is None and channels > 1:
        reader.refuse(f"has {channels} channels, as a colour has, not one density", f"choose one by grid=0 to {channels - 1}")
    if grid is not None and grid not in numbers:
        reader.refuse(f"has no channel {grid!r}, but {', '.join(numbers)}", "name one by grid=")
    return int(grid or 0)
