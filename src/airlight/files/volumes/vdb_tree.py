"""Read the tree of an OpenVDB grid: root, nodes of 32^3 and of 16^3 children, leaves of 8^3 voxels, which are handed on leaf by leaf.

A node holds a value, a tile, where it has no child; an active tile of 0.5 is a cube of 0.5. Format: tree/RootNode.h, InternalNode.h,
LeafNode.h and io/Compression.h of OpenVDB, file versions 222 to 225.
"""

from dataclasses import dataclass, field

import numpy as np

from airlight.files.volumes import blosc
from airlight.files.volumes.means import Means
from airlight.files.volumes.reader import Reader
from airlight.files.volumes.volume import Findings
from airlight.messages import counted

ZIP, ACTIVE, BLOSC = 1, 2, 4  # flags of a grid's compression
TYPES = {"float": "<f4", "double": "<f8", "half": "<f2"}
# Limits, far above what a renderer could use.
MAX_LEAVES = 2**21  # 10^9 voxels
MAX_TILED = {32: 2**8, 16: 2**13}  # nodes whose tiles are kept, by their children along an axis
MAX_TILES = 2**12  # of the root
_BATCH = 1024  # leaves
_MINUS, _ONE, _MASK, _MASK_ONE, _MASK_TWO, _ALL = 1, 2, 3, 4, 5, 6  # how a node's inactive values are stored
_X, _Y, _Z = np.unravel_index(np.arange(512), (8, 8, 8))


@dataclass
class Tiles:
    """The tiles of a node: corner, its first voxel (x, y, z); values and active (D, D, D), by x, y, z; edge: voxels of a tile's side."""

    corner: tuple[int, ...]
    values: np.ndarray
    active: np.ndarray
    edge: int


@dataclass
class Tree:
    """Reads a tree in two passes, as it is stored: `topology`, then `densities`.

    type: a key of TYPES. half: whether values are stored as half floats. flags: of compression.
    """

    reader: Reader
    type: str
    half: bool
    flags: int
    corners: np.ndarray = field(default_factory=lambda: np.zeros((0, 3), np.int64))  # (L, 3), of leaves
    masks: np.ndarray = field(default_factory=lambda: np.zeros((0, 64), np.uint8))  # (L, 64), of active voxels
    tiles: list[Tiles] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._dtype = np.dtype(TYPES[self.type])
        self._stored = np.dtype("<f2") if self.half else self._dtype
        self._nodes: dict[int, int] = dict.fromkeys(MAX_TILED, 0)

    # ------------------------------------------------------------ topology

    def topology(self) -> None:
        """Read nodes, tiles, and which voxels of leaves are active."""
        reader = self.reader
        if reader.u32() != 1:
            reader.damaged("several buffers to a tree")
        background = self._value()
        if background != 0:
            what = f"its grid has {background:.4g} wherever no voxel is, without end, as level sets have"
            reader.refuse(what, "export it as a fog volume, or set its background to 0 and give that density to the air")
        tiles, children = reader.u32(), reader.u32()
        if tiles > MAX_TILES:
            reader.refuse(f"its tree has {tiles} tiles of 4096 voxels a side, more than {MAX_TILES}", "make it smaller first")
        seen: set[tuple[int, ...]] = set()
        for _ in range(tiles):
            corner = self._corner(seen)
            value, active = self._value(), reader.u8() != 0
            if value != 0 or active:
                self.tiles.append(Tiles(corner, np.full((1, 1, 1), value), np.full((1, 1, 1), active), 4096))
        corners: list[np.ndarray] = []
        masks: list[np.ndarray] = []
        leaves = 0
        for _ in range(children):
            corner = self._corner(seen)
            for upper in self._node(corner, 32, 128):
                lower = self._node(tuple(int(n) for n in upper), 16, 8)
                corners.append(lower)
                masks.append(np.frombuffer(reader.bytes(64 * len(lower)), np.uint8).reshape(-1, 64))
                leaves += len(lower)
                if leaves > MAX_LEAVES:
                    reader.refuse(f"its grid has more than {MAX_LEAVES} leaves of 512 voxels", "make it smaller first")
        if corners:
            self.corners, self.masks = np.concatenate(corners), np.concatenate(masks)

    def _corner(self, seen: set[tuple[int, ...]]) -> tuple[int, ...]:
        corner = tuple(int(n) for n in self.reader.numbers("3i"))
        if corner in seen or any(n % 4096 for n in corner):
            self.reader.damaged("a node where none can be")
        seen.add(corner)
        return corner

    def _value(self) -> float:
        return float(np.frombuffer(self.reader.bytes(self._dtype.itemsize), self._dtype)[0])

    def _node(self, corner: tuple[int, ...], side: int, edge: int) -> np.ndarray:
        """Read a node of side^3 children of `edge` voxels: the corners of those that it has, (N, 3). Keeps its tiles."""
        count = side**3
        child, active = (self.reader.bytes(count // 8) for _ in range(2))
        values = self._values(active, count)
        is_child = _bits(child)
        on = _bits(active)
        if (on & is_child).any():
            self.reader.damaged("a node that has both a child and a tile at one place")
        values = np.where(is_child, 0, values)
        if values.any() or on.any():
            self._nodes[side] += 1
            if self._nodes[side] > MAX_TILED[side]:
                self.reader.refuse("its tree has more tiles than can be held", "make it smaller first")
            self.tiles.append(Tiles(corner, values.reshape(side, side, side), on.reshape(side, side, side), edge))
        places = np.stack(np.unravel_index(np.flatnonzero(is_child), (side, side, side)), axis=-1)
        return np.asarray(places * edge + np.array(corner), np.int64)

    def active_voxels(self) -> int:
        """Count the active voxels, those of active tiles included."""
        return int(np.bitwise_count(self.masks).sum(dtype=np.int64)) + sum(int(t.active.sum()) * t.edge**3 for t in self.tiles)

    def box(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Find the first and the last active voxel, (x, y, z) each; None where there is none."""
        found = []
        for tiles in self.tiles:
            if len(places := np.argwhere(tiles.active)):
                found.append((places.min(axis=0) * tiles.edge + tiles.corner, (places.max(axis=0) + 1) * tiles.edge - 1 + tiles.corner))
        lit = self.masks.any(axis=1)
        if lit.any():
            rows, corners = self.masks[lit].reshape(-1, 8, 8), self.corners[lit]  # bytes of 8 voxels along z, by x and y
            in_z = np.unpackbits(np.bitwise_or.reduce(rows, axis=(1, 2))[:, None], axis=1, bitorder="little")
            by_axis = list(enumerate((np.any(rows, axis=2), np.any(rows, axis=1), in_z)))
            low = np.array([(corners[:, axis] + on.argmax(axis=1)).min() for axis, on in by_axis])
            high = np.array([(corners[:, axis] + 7 - on[:, ::-1].argmax(axis=1)).max() for axis, on in by_axis])
            found.append((low, high))
        if not found:
            return None
        return np.min([low for low, _ in found], axis=0), np.max([high for _, high in found], axis=0)

    # ------------------------------------------------------------ values

    def densities(self, means: Means, first: np.ndarray, last: np.ndarray, findings: Findings) -> None:
        """Read the values of the leaves, and add them and the tiles to `means`, whose box has those first and last voxels (x, y, z)."""
        self._lost = 0
        for tiles in self.tiles:
            self._add_tiles(tiles, means, first, last, findings)
        held = np.empty((_BATCH, 512))
        for start in range(0, len(self.corners), _BATCH):
            corners = self.corners[start : start + _BATCH]
            for i in range(len(corners)):
                mask = self.reader.bytes(64)
                held[i] = self._values(mask, 512)
                if mask != self.masks[start + i].tobytes():
                    self.reader.damaged("a leaf whose active voxels are told in two ways")
            self._add_leaves(corners, held[: len(corners)], means, first, last, findings)
        if self._lost:
            which = counted(self._lost, "inactive voxel that is not 0", "inactive voxels that are not 0")
            findings.note(f"{which}, outside the box of the active ones, {'is' if self._lost == 1 else 'are'} left out")

    def _add_leaves(
        self, corners: np.ndarray, values: np.ndarray, means: Means, first: np.ndarray, last: np.ndarray, findings: Findings
    ) -> None:
        x, y, z = (corners[:, axis, None] + steps for axis, steps in enumerate((_X, _Y, _Z)))
        if (corners < first).any() or (corners + 7 > last).any():
            outside = (x < first[0]) | (x > last[0]) | (y < first[1]) | (y > last[1]) | (z < first[2]) | (z > last[2])
            self._lost += int(np.count_nonzero(values[outside]))
            values[outside] = 0.0
        values = findings.clean(values, (x, y, z))
        some = values.any(axis=1)
        if some.any():
            means.add(corners[some] - first, values[some].reshape(-1, 8, 8, 8))

    def _add_tiles(self, tiles: Tiles, means: Means, first: np.ndarray, last: np.ndarray, findings: Findings) -> None:
        place = [tiles.corner[axis] + tiles.edge * np.arange(len(tiles.values)) for axis in range(3)]
        parts = np.meshgrid(*[(p <= last[a]) & (p + tiles.edge > first[a]) for a, p in enumerate(place)], indexing="ij", sparse=True)
        inside = parts[0] & parts[1] & parts[2]
        self._lost += int(np.count_nonzero(tiles.values[~inside])) * tiles.edge**3
        values = np.where(inside, tiles.values, 0)
        indices = np.meshgrid(*place, indexing="ij", sparse=True)
        before = findings.broken
        values = findings.clean(values, indices)
        if findings.broken > before:
            findings.refuse(f"a tile of {tiles.edge} voxels a side is no finite number")
        if values.any():
            means.add(np.array([tiles.corner]) - first, values[None], tiles.edge)

    def _values(self, mask: bytes, count: int) -> np.ndarray:
        """Read the values of a node, (count,). mask: of the active ones, bits."""
        reader = self.reader
        kind = reader.u8()
        if kind > _ALL:
            reader.damaged("a node's values are stored in an unknown way")
        low = self._value() if kind in (_ONE, _MASK_ONE, _MASK_TWO) else 0.0  # the background is 0, and so is what it is times -1
        high = self._value() if kind == _MASK_TWO else 0.0
        chosen = reader.bytes(count // 8) if kind in (_MASK, _MASK_ONE, _MASK_TWO) else b""
        if not self.flags & ACTIVE or kind == _ALL:
            return self._payload(count)
        stored = int.from_bytes(mask, "little").bit_count()
        values = self._payload(stored)
        if stored == count:
            return values
        out = np.full(count, low, self._dtype)
        if chosen and high != low:
            out[_bits(chosen)] = high
        if stored:
            out[_bits(mask)] = values
        return out

    def _payload(self, count: int) -> np.ndarray:
        size = count * self._stored.itemsize
        if self.half and count == 0:
            return np.zeros(0, self._stored)
        if not self.flags & (ZIP | BLOSC):
            return np.frombuffer(self.reader.bytes(size), self._stored)
        packed = self.reader.i64()
        if packed <= 0:
            if packed != -size:
                self.reader.damaged("a node with another number of values than it says")
            return np.frombuffer(self.reader.bytes(size), self._stored)
        if packed > 2 * size + 4096:
            self.reader.damaged("packed values that are larger than the values")
        data = self.reader.bytes(packed)
        try:
            return np.frombuffer(blosc.unpack(data, size) if self.flags & BLOSC else blosc.inflate(data, size), self._stored)
        except ValueError as error:
            self.reader.damaged(str(error))


def _bits(mask: bytes) -> np.ndarray:
    return np.unpackbits(np.frombuffer(mask, np.uint8), bitorder="little").view(bool)

