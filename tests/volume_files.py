"""Volume files made by hand: OpenVDB's, with tiles, instances, maps, versions and compressions that few files have, and Mitsuba's.

A tree is told by its leaves, {corner: (values (8, 8, 8), active (8, 8, 8))} by x, y, z, and its tiles, {(corner, edge): (value, active)},
of edges 8, 128 and 4096. What is written between is worked out from them.
"""

import io
import itertools
import struct
import zlib
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from airlight.files.volumes import Volume

ZIP, ACTIVE, BLOSC = 1, 2, 4
BOX = ((0, 0, 0), (1, 1, 1))
DTYPES = {"float": "<f4", "double": "<f8", "half": "<f2", "vec3s": "<f4", "bool": "<f4", "ptdataidx32": "<f4"}  # of what is not read, any
EDGES = (4096, 128, 8, 1)  # of the children of root, upper, lower node, and leaf


def text(words: str | bytes) -> bytes:
    data = words.encode() if isinstance(words, str) else words
    return struct.pack("<I", len(data)) + data


def metadata(entries: dict) -> bytes:
    out = struct.pack("<I", len(entries))
    for name, value in entries.items():
        match value:
            case bool():
                kind, data = "bool", bytes([value])
            case int():
                kind, data = "int64", struct.pack("<q", value)
            case _:
                kind, data = "string", value.encode()
        out += text(name) + text(kind) + text(data)
    return out


# ---------------------------------------------------------------- packing


def lz4(data: bytes) -> bytes:
    """Pack by matches of four bytes that were seen before, the nearest ones; the last twelve bytes stay literal."""
    out, seen, at, start = bytearray(), {}, 0, 0

    def length(n: int) -> bytes:
        return b"" if n < 15 else b"\xff" * ((n - 15) // 255) + bytes([(n - 15) % 255])

    while at < len(data) - 12:
        key = data[at : at + 4]
        before = seen.get(key)
        seen[key] = at
        if before is None or at - before > 65535:
            at += 1
            continue
        match = 4
        while at + match < len(data) - 5 and data[before + match] == data[at + match]:
            match += 1
        literal = at - start
        out += bytes([min(literal, 15) << 4 | min(match - 4, 15)]) + length(literal) + data[start:at]
        out += struct.pack("<H", at - before) + length(match - 4)
        at += match
        start = at
    literal = len(data) - start
    return bytes(out + bytes([min(literal, 15) << 4]) + length(literal) + data[start:])


def blosc(
    data: bytes, element: int, block: int = 0, codec: int = 1, whole: bool = False, stored: bool = False, shuffled: bool = True
) -> bytes:
    """Pack a frame of Blosc 1. block: bytes, all unless said. codec: 1 LZ4, 3 zlib. whole: blocks are not split by bytes."""
    block = block or len(data)
    flags = codec << 5 | (1 if shuffled else 0) | (2 if stored else 0) | (16 if whole else 0)
    if stored:
        return struct.pack("<BBBBIII", 2, 1, flags, element, len(data), block, 16 + len(data)) + data
    starts, body = [], b""
    count = -(-len(data) // block)
    for i in range(count):
        part = data[i * block : (i + 1) * block]
        if shuffled:
            full = len(part) // element * element
            part = np.frombuffer(part[:full], np.uint8).reshape(-1, element).T.tobytes() + part[full:]
        split = element if not whole and element <= 16 and block // element >= 128 and len(part) == block else 1
        starts.append(16 + 4 * count + len(body))
        for piece in (part[j * len(part) // split : (j + 1) * len(part) // split] for j in range(split)):
            packed = lz4(piece) if codec == 1 else zlib.compress(piece)
            packed = packed if len(packed) < len(piece) else piece
            body += struct.pack("<I", len(packed)) + packed
    head = struct.pack("<BBBBIII", 2, 1, flags, element, len(data), block, 16 + 4 * count + len(body))
    return head + struct.pack(f"<{count}I", *starts) + body


# ---------------------------------------------------------------- OpenVDB


@dataclass
class Grid:
    """A grid to be written. parent: name of the grid whose tree it shares. map: kind and doubles. count: told as file_voxel_count, the true
    one unless said, none for False. blosc: arguments of `blosc`. suffix: whether the tree's type says that it is half. more: metadata."""

    name: str = "density"
    leaves: dict = field(default_factory=dict)
    tiles: dict = field(default_factory=dict)
    type: str = "float"
    half: bool = False
    flags: int = ACTIVE
    background: float = 0.0
    map: tuple = ("UniformScaleMap", (0.5,))
    grid_class: str = "fog volume"
    parent: str = ""
    count: int | bool | None = None
    tree: str = "5_4_3"
    more: dict = field(default_factory=dict)
    blosc: dict = field(default_factory=dict)
    suffix: bool = True

    def active(self) -> int:
        tiles = sum(edge**3 for (_, edge), (_, on) in self.tiles.items() if on)
        return tiles + sum(int(np.count_nonzero(on)) for _, on in self.leaves.values())


def leaves_of(corner: tuple, values: np.ndarray, active: np.ndarray | None = None) -> dict:
    """Cut an array (X, Y, Z), whose first voxel lies at `corner`, into leaves. active: where it is not 0, unless said."""
    active = values != 0 if active is None else active
    first = np.array(corner)
    low, high = first // 8 * 8, -(-(first + values.shape) // 8) * 8
    held, on = np.zeros(high - low, values.dtype), np.zeros(high - low, bool)
    inside = tuple(slice(a, a + n) for a, n in zip(first - low, values.shape, strict=True))
    held[inside], on[inside] = values, active
    out = {}
    for place in itertools.product(*(range(0, n, 8) for n in held.shape)):
        part = tuple(slice(p, p + 8) for p in place)
        if on[part].any() or held[part].any():
            out[tuple(int(n) for n in low + place)] = held[part], on[part]
    return out


def dense_of(grid: Grid, low: tuple, high: tuple) -> tuple[np.ndarray, np.ndarray]:
    """The values and the active voxels (X, Y, Z) of a grid between two voxels, the second one not among them."""
    shape = np.subtract(high, low)
    values, active = np.full(shape, grid.background, DTYPES[grid.type]), np.zeros(shape, bool)
    pieces = [(corner, edge, value, on) for (corner, edge), (value, on) in grid.tiles.items()]
    for corner, edge, value, on in sorted(pieces, key=lambda piece: -piece[1]):
        part = tuple(slice(max(0, c - a), max(0, c - a + edge)) for c, a in zip(corner, low, strict=True))
        values[part], active[part] = value, on
    for corner, (held, on) in grid.leaves.items():
        start = np.subtract(corner, low)
        inside = tuple(slice(max(0, s), max(0, s + 8)) for s in start)
        part = tuple(slice(max(0, -s), 8 - max(0, s + 8 - n)) for s, n in zip(start, shape, strict=True))
        if all(p.stop > p.start for p in part):
            values[inside], active[inside] = held[part], on[part]
    return values.astype(np.float16).astype(values.dtype) if grid.half else values, active


def _mask(on: np.ndarray) -> bytes:
    return np.packbits(np.asarray(on, bool).ravel(), bitorder="little").tobytes()


def _payload(grid: Grid, values: np.ndarray) -> bytes:
    dtype = "<f2" if grid.half else DTYPES[grid.type]
    if grid.half and not len(values):
        return b""
    data = np.ascontiguousarray(values, dtype).tobytes()
    if not grid.flags & (ZIP | BLOSC):
        return data
    packed = data
    if data and grid.flags & BLOSC:
        packed = blosc(data, np.dtype(dtype).itemsize, **grid.blosc)
    elif data:
        packed = zlib.compress(data)
    if len(packed) < len(data) or (grid.blosc and data):
        return struct.pack("<q", len(packed)) + packed
    return struct.pack("<q", -len(data)) + data


def _values(grid: Grid, values: np.ndarray, active: np.ndarray, child: np.ndarray) -> bytes:
    """Write a node's values as OpenVDB chooses to."""
    values, active, child = np.ravel(values).astype(DTYPES[grid.type]), np.ravel(active), np.ravel(child)
    background = np.float64(grid.background)
    inactive = list(dict.fromkeys(values[~active & ~child].tolist()))
    if not grid.flags & ACTIVE or len(inactive) > 2:
        return b"\6" + _payload(grid, values)
    one = lambda value: np.array(value, DTYPES[grid.type]).tobytes()  # noqa: E731
    others = [v for v in inactive if v != background]
    second = lambda value: _mask((values == value) & ~active & ~child)  # noqa: E731
    if not others:
        kind = b"\0"
    elif len(inactive) == 1:
        kind = b"\1" if others[0] == -background else b"\2" + one(others[0])
    elif len(others) == 1:
        kind = b"\3" + second(background) if others[0] == -background else b"\4" + one(others[0]) + second(background)
    else:
        kind = b"\5" + one(others[0]) + one(others[1]) + second(others[1])
    return kind + _payload(grid, values[active])


def _children(grid: Grid, corner: tuple, level: int) -> tuple[dict, dict]:
    """The corners of a node's children, and its tiles, by place. level: 1 for the nodes below the root, 2 for those below these."""
    size, edge = EDGES[level - 1], EDGES[level]
    inside = lambda at: all(c <= a < c + size for a, c in zip(at, corner, strict=True))  # noqa: E731
    place = lambda at: tuple((a - c) // edge for a, c in zip(at, corner, strict=True))  # noqa: E731
    below = [at for at in grid.leaves if inside(at)] + [at for at, e in grid.tiles if e < edge and inside(at)]
    corners = {place(at): tuple(a // edge * edge for a in at) for at in below}
    return corners, {place(at): told for (at, e), told in grid.tiles.items() if e == edge and inside(at)}


def _node(grid: Grid, corner: tuple, level: int) -> tuple[bytes, list]:
    """The topology of a node and of what is below it, and the corners of its leaves in order."""
    side = (32, 16)[level - 1]
    corners, tiles = _children(grid, corner, level)
    child, active = np.zeros((side,) * 3, bool), np.zeros((side,) * 3, bool)
    values = np.full((side,) * 3, grid.background)
    for at, (value, on) in tiles.items():
        values[at], active[at] = value, on
    for at in corners:
        child[at], active[at], values[at] = True, False, 99  # which nobody reads
    out, leaves = _mask(child) + _mask(active) + _values(grid, values, active, child), []
    for at in sorted(corners):
        if level == 2:
            out += _mask(grid.leaves[corners[at]][1])
            leaves.append(corners[at])
        else:
            more, below = _node(grid, corners[at], 2)
            out, leaves = out + more, leaves + below
    return out, leaves


def tree(grid: Grid) -> tuple[bytes, bytes]:
    """Topology and buffers."""
    roots = sorted({tuple(a // 4096 * 4096 for a in at) for at in [*grid.leaves, *(at for at, edge in grid.tiles if edge < 4096)]})
    tiles = {at: told for (at, edge), told in grid.tiles.items() if edge == 4096}
    value = lambda v: np.array(v, DTYPES[grid.type]).tobytes()  # noqa: E731
    out = struct.pack("<I", 1) + value(grid.background) + struct.pack("<II", len(tiles), len(roots))
    for at, (held, on) in tiles.items():
        out += struct.pack("<3i", *at) + value(held) + bytes([on])
    order = []
    for at in roots:
        more, leaves = _node(grid, at, 1)
        out, order = out + struct.pack("<3i", *at) + more, order + leaves
    buffers = b""
    for at in order:
        values, on = grid.leaves[at]
        buffers += _mask(on) + _values(grid, values, on, np.zeros(512, bool))
    return out, buffers


def transform(kind: str, told: tuple) -> bytes:
    """A map: of one number or three of scale, and three of translation, or 16 of a matrix for rows."""
    if kind in ("AffineMap", "UnitaryMap"):
        numbers = np.ravel(told)
    elif kind == "TranslationMap":
        numbers = np.array(told)
    elif kind == "NonlinearFrustumMap":
        numbers = np.zeros(30)
    else:
        scale = np.broadcast_to(told[0], 3).astype(float)
        rest = np.concatenate([scale, np.abs(scale), 1 / scale, 1 / scale**2, 0.5 / scale])
        numbers = np.concatenate([told[1], rest]) if "Translate" in kind else rest
    return text(kind) + np.asarray(numbers, "<f8").tobytes()


def vdb(*grids: Grid, version: int = 224, stream: bool = False, more: dict | None = None) -> bytes:
    """A file."""
    head = b" BDV\0\0\0\0" + struct.pack("<III", version, 10, 0) + bytes([not stream])
    out = head + b"01234567-89ab-cdef-0123-456789abcdef" + metadata(more or {"creator": "a test"}) + struct.pack("<I", len(grids))
    for grid in grids:
        told = {"class": grid.grid_class, "name": grid.name.partition("\x1e")[0], "is_saved_as_half_float": grid.half, **grid.more}
        told = {key: value for key, value in told.items() if value is not None}
        if grid.count is not False:
            told["file_voxel_count"] = grid.active() if grid.count is None else grid.count
        listed = text(grid.name) + text(f"Tree_{grid.type}_{grid.tree}" + "_HalfFloat" * (grid.half and grid.suffix)) + text(grid.parent)
        body = struct.pack("<I", grid.flags) + metadata(told) + transform(*grid.map)
        topology, buffers = (b"", b"") if grid.parent else tree(grid)
        start = len(out) + len(listed) + 24
        block = start + len(body) + len(topology)
        out += listed + struct.pack("<3q", start, block, block + len(buffers)) + body + topology + buffers
    return out


# ---------------------------------------------------------------- others


def vol(density: np.ndarray, bounds: tuple = (0, 0, 0, 1, 1, 1), kind: int = 1, version: int = 3) -> bytes:
    """Mitsuba's grid of density[z, y, x], or [z, y, x, channel]."""
    density = np.asarray(density, "<f4")
    density = density[..., None] if density.ndim == 3 else density
    z, y, x, channels = density.shape
    return b"VOL" + struct.pack("<B5i6f", version, kind, x, y, z, channels, *bounds) + density.tobytes()


def npz(**arrays: np.ndarray) -> bytes:
    held = io.BytesIO()
    np.savez_compressed(held, **arrays)
    return held.getvalue()


def npy(array: np.ndarray) -> bytes:
    held = io.BytesIO()
    np.save(held, array)
    return held.getvalue()


def seeds() -> list[bytes]:
    """Small files of every kind that is read, to be mutated."""
    values = np.random.default_rng(1).random((11, 9, 7)).astype(np.float32)
    values[values < 0.3] = 0
    leaves = leaves_of((-3, 60, 4), values)
    tiles = {((16, 64, 0), 8): (0.5, True), ((128, 0, 0), 128): (0.75, True), ((4096, 0, 0), 4096): (0.25, True)}
    grids = [Grid(leaves=leaves, flags=flags, tiles=tiles if flags % 2 else {}, half=flags == 3) for flags in (0, 1, 2, 3, 4, 6)]
    few = [Grid("other", leaves={corner: leaves[corner]}, type="double") for corner in list(leaves)[:1]]
    shared = Grid("density", parent="other", type="double", map=("AffineMap", np.eye(4)))
    files = [vdb(grid) for grid in grids] + [vdb(*few, shared)]
    files += [npz(density=values, bounds=np.array(BOX)), npz(density=values.astype(np.float16), matrix=np.eye(4)), npy(values)]
    files += [npy(np.asfortranarray(values.astype(np.uint8))), vol(values), vol(np.stack([values] * 3, axis=-1))]
    return files


# ---------------------------------------------------------------- in tests


def kept(folder: Path, data: bytes, name: str = "a.vdb") -> str:
    """Write a file: its path."""
    path = folder / name
    path.write_bytes(data)
    return str(path)


def world(volume: Volume, *index: float) -> np.ndarray:
    """The world position of an index."""
    return volume.matrix[:3] @ (*index, 1)


def sampled(volume: Volume, points: np.ndarray) -> np.ndarray:
    """The density at points (N, 3), from what Volume says of itself alone."""
    index = (points - volume.matrix[:3, 3]) @ np.linalg.inv(volume.matrix[:3, :3]).T
    sides = np.array(volume.density.shape[::-1])
    inside = ((index >= -volume.edge) & (index <= sides - 1 + volume.edge)).all(axis=1)
    index = np.clip(index, 0, sides - 1)
    low = np.minimum(index.astype(int), np.maximum(sides - 2, 0))
    share, total = index - low, np.zeros(len(points))
    for step in itertools.product((0, 1), repeat=3):
        x, y, z = np.minimum(low + step, sides - 1).T
        total += np.prod(np.where(step, share, 1 - share), axis=1) * volume.density[z, y, x]
    return np.where(inside, total, 0)
