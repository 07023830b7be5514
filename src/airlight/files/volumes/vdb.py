"""Read OpenVDB files, versions 222 to 225: grids of float, double or half values with linear maps.

Format: io/Archive.cc, io/GridDescriptor.cc and math/Maps.h of OpenVDB.
"""

import struct
from dataclasses import dataclass
from typing import BinaryIO

import numpy as np

from airlight.files.volumes.means import Means
from airlight.files.volumes.reader import Reader
from airlight.files.volumes.vdb_tree import ACTIVE, BLOSC, TYPES, ZIP, Tree
from airlight.files.volumes.volume import Findings, Volume, coarser, kept_shape, placed
from airlight.messages import nearest

MAGIC = b" BDV\0\0\0\0"
VERSIONS = range(222, 226)
MAX_ENTRIES = 4096  # of metadata, or of grids
_HALF = "_HalfFloat"  # ends the type of a grid whose values are stored as half floats
_PART = "\x1e"  # parts a name from the number of a grid of the same name
# How many vectors of 3 doubles a map is stored as, and where the scale and the translation are among them.
_MAPS = {
    "ScaleMap": (5, 0, None),
    "UniformScaleMap": (5, 0, None),
    "TranslationMap": (1, None, 0),
    "ScaleTranslateMap": (6, 1, 0),
    "UniformScaleTranslateMap": (6, 1, 0),
}


@dataclass(frozen=True)
class Grid:
    """A grid as the file's list has it. name: with its number, where several have one. type: of its tree."""

    name: str
    number: str
    type: str
    half: bool
    parent: str
    position: int

    @property
    def unique(self) -> str:
        return f"{self.name}{_PART}{self.number}" if self.number else self.name

    @property
    def shown(self) -> str:
        return f"{self.name}[{self.number}]" if self.number else self.name

    @property
    def kind(self) -> str:
        """Tell what its voxels hold: a key of TYPES, or another word; "odd tree" for trees of another shape."""
        part = self.type.split("_")
        if len(part) != 5 or part[0] != "Tree" or part[2:] != ["5", "4", "3"]:
            return "odd tree"
        return "points" if part[1].startswith(("ptdataidx", "ptidx")) else part[1]


def read(file: BinaryIO, path: str, grid: str | None, scale: float, up: str, limit: int) -> Volume:
    """Read a grid. grid: its name, unless it is `density` or the only one of floats. limit: voxels. Raises AirlightError."""
    reader = Reader(file, path)
    grids = _grids(reader)
    chosen = _choose(reader, grids, grid)
    matrix, tree, metadata = _open(reader, chosen, grids)
    findings = Findings(path)
    alike = [g.shown for g in grids if g.name == chosen.name]
    if len(alike) > 1 and grid != chosen.shown:
        findings.note(f"{len(alike)} grids are named {chosen.name!r}, of which {chosen.shown!r} is read; grid= names another")
    tree.topology()
    said, found = metadata.get("file_voxel_count"), tree.active_voxels()
    if said is not None and len(said) == 8 and said != struct.pack("<q", found):
        reader.damaged(f"grid {chosen.shown!r} has {found} active voxels, not as many as it says")
    box = tree.box()
    if box is None:
        findings.note(f"grid {chosen.shown!r} has no active voxels: it adds nothing")
        empty = np.zeros((1, 1, 1), np.float32)
        return findings.finish(empty, placed(matrix, scale, up, path), 0.0, chosen.shown, (1, 1, 1))
    first, last = box
    stored = tuple(int(n) for n in (last - first + 1)[::-1])
    kept = kept_shape(stored, limit)
    matrix = placed(coarser(matrix, stored, kept, first, 1), scale, up, path)
    means = Means(stored, kept)
    tree.densities(means, first, last, findings)
    findings.judge(kept != stored)
    if kept == stored:
        findings.mend(means.grid, first)
    else:
        findings.note_coarser(stored, kept, limit)
    density = np.zeros([n + 2 for n in kept], np.float32)  # a layer of the background, so that it fades to it as OpenVDB's samplers have it
    density[1:-1, 1:-1, 1:-1] = means.grid
    return findings.finish(density, matrix, 0.0, chosen.shown, stored)


def _grids(reader: Reader) -> list[Grid]:
    """Read the header and the list of grids."""
    if reader.bytes(8) != MAGIC:
        reader.damaged("it does not begin as OpenVDB's files do")
    version = reader.u32()
    if version not in VERSIONS:
        age = "older" if version < VERSIONS[0] else "newer"
        reader.refuse(f"has OpenVDB's file version {version}, {age} than {VERSIONS[0]} to {VERSIONS[-1]}", "save it by another OpenVDB")
    reader.skip(8)  # the library's version
    has_offsets = reader.u8()
    reader.skip(36)  # an identifier
    _metadata(reader)
    count = reader.u32()
    if not has_offsets:
        reader.refuse("was written as a stream, without a list of its grids", "write it as a file")
    if count > MAX_ENTRIES:
        reader.damaged(f"{count} grids")
    grids = []
    for _ in range(count):
        name, _, number = reader.text().partition(_PART)
        type, parent = reader.text(), reader.text()
        position, _, end = (reader.i64() for _ in range(3))
        if not reader.file.tell() <= position <= end:
            reader.damaged("a grid that lies before what lists it")
        grids.append(Grid(name, number, type.removesuffix(_HALF), type.endswith(_HALF), parent, position))
        reader.seek(end)
    return grids


def _choose(reader: Reader, grids: list[Grid], name: str | None) -> Grid:
    there = ", ".join(f"{g.shown!r} ({g.kind})" for g in grids[:10]) or "none"
    fits = [g for g in grids if g.kind in TYPES]
    if name is not None:
        found = [g for g in (*fits, *grids) if name in (g.name, g.shown)]
        if not found:
            reader.refuse(f"has no grid {name!r}, but {there}{nearest(name, [g.shown for g in grids], '')}", "name one by grid=")
        if found[0].kind not in TYPES:
            reader.refuse(f"grid {name!r} holds no float values: {found[0].kind}", f"name one that does; there are {there}")
        return found[0]
    if named := [g for g in fits if g.name == "density"]:
        return named[0]
    if len(fits) == 1:
        return fits[0]
    if not fits:
        reader.refuse(f"has no grid of float, double or half values, but {there}", "export its density")
    reader.refuse(f"has no grid 'density', but {there}", "name one by grid=")


def _open(reader: Reader, grid: Grid, grids: list[Grid]) -> tuple[np.ndarray, Tree, dict[str, bytes]]:
    """Read what lies before a grid's tree: matrix from indices to the file's space, the tree to be read, its metadata."""
    owner, matrix = grid, None
    if grid.parent:
        reader.seek(grid.position)
        reader.u32()
        _refuse_class(reader, grid, _metadata(reader))
        matrix = _map(reader, grid)
        found = [g for g in grids if g.unique == grid.parent]
        if not found or found[0].parent or found[0].type != grid.type:
            reader.damaged(f"grid {grid.shown!r} shares the tree of one that is not there")
        owner = found[0]
    reader.seek(owner.position)
    flags = reader.u32()
    if flags & ~(ZIP | ACTIVE | BLOSC):
        reader.refuse(f"grid {grid.shown!r} is packed in an unknown way ({flags})", "save it by another OpenVDB")
    metadata = _metadata(reader)
    _refuse_class(reader, grid, metadata)
    own = _map(reader, owner)
    half = any(metadata.get("is_saved_as_half_float", b"\1" if owner.half else b"")) and owner.kind != "half"
    return own if matrix is None else matrix, Tree(reader, owner.kind, half, flags), metadata


def _refuse_class(reader: Reader, grid: Grid, metadata: dict[str, bytes]) -> None:
    name = metadata.get("class", b"")
    if name in (b"level set", b"staggered"):
        what = "a level set, distances to a surface" if name == b"level set" else "a staggered grid"
        reader.refuse(f"grid {grid.shown!r} is {what}, no density", "export it as a fog volume")


def _metadata(reader: Reader) -> dict[str, bytes]:
    """Read names and bytes of metadata; of the large ones the first few."""
    count = reader.u32()
    if count > MAX_ENTRIES:
        reader.damaged(f"{count} entries of metadata")
    found = {}
    for _ in range(count):
        name, _, size = reader.text(), reader.text(), reader.u32()
        found[name] = reader.bytes(min(size, 64))
        reader.skip(max(0, size - 64))
    return found


def _map(reader: Reader, grid: Grid) -> np.ndarray:
    """Read a linear map: the matrix (4, 4) from indices, as columns."""
    kind = reader.text()
    matrix = np.eye(4)
    if kind in ("AffineMap", "UnitaryMap"):
        matrix = np.reshape(reader.numbers("16d"), (4, 4)).T  # stored for rows
        if (matrix[3] != (0, 0, 0, 1)).any():
            reader.damaged("a map that is not affine")
    elif kind in _MAPS:
        count, scale, shift = _MAPS[kind]
        vectors = np.reshape(reader.numbers(f"{3 * count}d"), (count, 3))
        if scale is not None:
            matrix[[0, 1, 2], [0, 1, 2]] = vectors[scale]
        if shift is not None:
            matrix[:3, 3] = vectors[shift]
    else:
        what = "widens with the distance, as a camera's view" if "Frustum" in kind else f"is placed by an unknown map, {kind[:40]!r}"
        reader.refuse(f"grid {grid.shown!r} {what}", "resample it to a linear map")
    return matrix
