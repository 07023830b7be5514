"""Parse files of meshes by trimesh, after a look at what they ask for: counts that the bytes cannot hold, more parts than can be drawn."""

import io
import logging
import re
import struct
import warnings
from typing import Any, NoReturn

import numpy as np
import trimesh

from airlight.errors import AirlightError, warn
from airlight.scenes.gltf import MAX_DRAWS
from airlight.scenes.gltf.container import Container
from airlight.scenes.meshfiles import MAX_MASKED, MAX_POLYGONS, MAX_TEXT
from airlight.scenes.meshfiles.materials import Library

MAX_HEADER = 2**16  # bytes of a PLY's header
_TYPES = {"char": "b", "uchar": "B", "short": "h", "ushort": "H", "int": "i", "uint": "I", "float": "f", "double": "d"}
_TYPES |= {"int8": "b", "uint8": "B", "int16": "h", "uint16": "H", "int32": "i", "uint32": "I", "float32": "f", "float64": "d"}
_PARTS = re.compile(r"^(o|g|usemtl|mtllib)[ \t]+(.*)$", re.MULTILINE)
_RELATIVE = re.compile(r"^f[^\n]*[ \t/]-\d", re.MULTILINE)


def read(path: str) -> tuple[Any, Library]:
    """Parse a file: a trimesh.Scene, and the materials of an .obj. Raises AirlightError for what it cannot be."""
    file, kind = Container(path), path.lower()[-3:]
    data = file.read(path, "the file")
    library = Library(file)
    more: dict[str, Any] = {}
    if kind == "obj":
        data, more = _obj(file, data, library)
    elif kind == "ply":
        data = _ply(file, data)
    else:
        _check_stl(file, data)
    logging.getLogger("trimesh").setLevel(logging.CRITICAL)  # or its warnings are lines on stderr
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        warnings.filterwarnings("error", "string or file could not be read")  # NumPy, of numbers that are none
        try:
            scene = trimesh.load_scene(io.BytesIO(data), file_type=kind, resolver=library, process=False, **more)
        except Exception as error:  # of many kinds, since it trusts its input
            _damaged(file, error)
    for line in library.lost:
        warn(line, 5)
    return scene, library


def _damaged(file: Container, error: Exception) -> NoReturn:
    reason = "a face has a vertex that is not there" if isinstance(error, IndexError) else " ".join(str(error).split())[:120]
    what = f"is damaged, or no {file.path[-3:].lower()} file"
    if isinstance(error, MemoryError):
        raise AirlightError(f"{file.path}: asks for more memory than there is; make it smaller") from error
    raise AirlightError(f"{file.path}: {what}{f' ({reason})' if reason else ''}; export it again") from error


def _check_text(file: Container, data: bytes) -> None:
    if len(data) > MAX_TEXT:
        file.refuse(f"is text of more than {MAX_TEXT >> 20} MiB", "export it as .glb or as a binary .ply")


def _check_stl(file: Container, data: bytes) -> None:
    if len(data) >= 84 and len(data) == 84 + 50 * int.from_bytes(data[80:84], "little"):
        return  # binary
    if b"solid" not in data[:4096].lower():
        size = 84 + 50 * int.from_bytes(data[80:84], "little") if len(data) >= 84 else 84
        file.refuse(f"is cut off, or no stl file: {len(data)} bytes, where its header asks for {size}", "copy or export it again")
    _check_text(file, data)
    lowered = data.lower()
    solids, vertices, facets = (lowered.count(word) for word in (b"endsolid", b"vertex", b"endfacet"))
    if solids > MAX_DRAWS:
        file.refuse(f"holds {solids} solids, more than {MAX_DRAWS}", "join them")
    if not solids or vertices != 3 * facets:
        file.refuse("is cut off, or no stl file", "copy or export it again")


def _obj(file: Container, data: bytes, library: Library) -> tuple[bytes, dict[str, Any]]:
    """Make what trimesh takes of an .obj, and how it has to take it."""
    _check_text(file, data)
    text = data.decode("utf-8", "replace").replace("\r\n", "\n").replace("\r", "\n").replace("\\\n", " ")
    materials, objects, now = set(), set(), ("", "")
    for word, name in _PARTS.findall(text):
        if word == "mtllib":
            library.files.append(name.strip())
        elif word != "g":
            now = (name, now[1]) if word == "usemtl" else (now[0], name)
            materials.add(now[0])
            objects.add(now)
    vertices = text.count("\nv ")
    if len(materials) > MAX_DRAWS or len(materials) * vertices > MAX_MASKED:
        file.refuse(f"has {len(materials)} materials over {vertices} vertices, too many to be told apart", "join some")
    split = len(objects) <= MAX_DRAWS and len(objects) * vertices <= MAX_MASKED
    if not split:
        warn(f"{file.path}: its {len(objects)} objects are shown as one for each material", 5)
    if _RELATIVE.search(text):
        text = _absolute(text)
    if re.search(r"^l[ \t]", text, re.MULTILINE):
        warn(f"{file.path}: its lines are not shown", 5)
        if not re.search(r"^f[ \t]", text, re.MULTILINE):
            file.refuse("holds no faces", "export it with its meshes")
    library.split = split
    return text.encode(), {"split_objects": split, "group_material": True}


def _absolute(text: str) -> str:
    """Count the relative indices of an .obj's faces from its start: trimesh counts them from the end of the file."""
    counts, lines = {"v": 0, "vt": 0, "vn": 0}, text.split("\n")
    for i, line in enumerate(lines):
        word, _, rest = line.partition(" ")
        if word in counts:
            counts[word] += 1
        elif word == "f":
            corners = (zip(corner.split("/"), counts.values()) for corner in rest.split())
            lines[i] = "f " + " ".join("/".join(_index(part, count) for part, count in corner) for corner in corners)
    return "\n".join(lines)


def _index(part: str, count: int) -> str:
    return str(count + 1 + int(part)) if re.fullmatch(r"-\d{1,9}", part) else part


def _ply(file: Container, data: bytes) -> bytes:
    """Check a PLY's header against its size; make triangles of faces with unlike numbers of corners, which trimesh does not take."""
    head, end, body = data[:MAX_HEADER].partition(b"end_header")
    if not data.startswith(b"ply") or not end:
        file.refuse("does not begin as PLY does", "export it again")
    start = data.index(b"\n", len(head) + len(end)) + 1 if b"\n" in body else len(data)
    elements: list[tuple[str, int, list[list[str]]]] = []
    for line in head.decode("utf-8", "replace").splitlines():
        words = line.split()
        if words[:1] == ["element"] and len(words) == 3 and words[2].isdigit():
            elements.append((words[1], int(words[2]), []))
        elif words[:1] == ["property"] and elements:
            elements[-1][2].append(words[1:])
    if sum(count for _, count, _ in elements) > len(data) - start:
        file.refuse(
            f"says that it has {sum(count for _, count, _ in elements)} elements, but has {len(data)} bytes", "copy or export it again"
        )
    if re.search(rb"^format\s+ascii", head, re.MULTILINE):
        _check_text(file, data)
        return data
    order = ">" if b"big_endian" in head else "<"
    lists = [(name, at) for at, (name, _, kept) in enumerate(elements) if any(words[0] == "list" for words in kept)]
    if [name for name, _ in lists] == ["face"] and all(
        word in _TYPES or word == "list" for _, _, kept in elements for words in kept for word in words[:-1]
    ):
        try:
            return _triangles(file.path, data, head, start, elements, order)
        except (struct.error, ValueError, LookupError, OverflowError):
            file.refuse("is cut off, or damaged in its faces", "copy or export it again")
    return data


def _triangles(path: str, data: bytes, head: bytes, start: int, elements: list[tuple[str, int, list[list[str]]]], order: str) -> bytes:
    """Make fans of a binary PLY's faces, where they have unlike numbers of corners, with the values that each face has."""
    at, face = start, next(i for i, (name, _, _) in enumerate(elements) if name == "face")
    for _, count, kept in elements[:face]:
        at += count * struct.calcsize(order + "".join(_TYPES[words[0]] for words in kept))
    _, count, kept = elements[face]
    before = at
    if sum(words[0] == "list" for words in kept) != 1:
        return data
    place = next(i for i, words in enumerate(kept) if words[0] == "list")
    lead, tail = ("".join(_TYPES[words[0]] for words in part) for part in (kept[:place], kept[place + 1 :]))
    ahead, behind = struct.calcsize(order + lead), struct.calcsize(order + tail)
    number, corner = struct.Struct(order + _TYPES[kept[place][1]]), _TYPES[kept[place][2]]
    size = struct.calcsize(corner)
    if count == 0 or _alike(data[before:], count, ahead, number, size, behind):
        return data
    if count > MAX_POLYGONS:
        raise AirlightError(f"{path}: has more than {MAX_POLYGONS} faces with unlike numbers of corners; export it with triangles alone")
    rows, lengths = [], set()
    for _ in range(count):
        (length,) = number.unpack_from(data, at + ahead)
        if not 0 <= length <= (len(data) - at) // size:
            raise ValueError(length)
        stop = at + ahead + number.size + length * size + behind
        if stop > len(data):
            raise ValueError(length)
        rows.append((at, int(length), stop))
        lengths.add(length)
        at = stop
    if len(lengths) <= 1:
        return data
    out, faces = [], 0
    for begin, length, stop in rows:
        if length < 3:
            continue
        inner = begin + ahead + number.size
        corners = [data[inner + i * size : inner + (i + 1) * size] for i in range(length)]
        first, last = data[begin : begin + ahead] + number.pack(3), data[stop - behind : stop]
        out += [first + corners[0] + corners[i] + corners[i + 1] + last for i in range(1, length - 1)]
        faces += length - 2
    text = re.sub(rb"element(\s+)face(\s+)\d+", lambda found: b"element" + found[1] + b"face" + found[2] + str(faces).encode(), head)
    return text + data[len(head) : before] + b"".join(out) + data[at:]


def _alike(data: bytes, count: int, ahead: int, number: struct.Struct, size: int, behind: int) -> bool:
    """Tell whether all of a binary PLY's faces have as many corners as the first."""
    (first,) = number.unpack_from(data, ahead)
    row = ahead + number.size + int(first) * size + behind
    if first < 0 or len(data) < count * row:
        return False
    table = np.frombuffer(data, np.uint8, count * row).reshape(count, row)[:, ahead : ahead + number.size]
    return bool((table == table[0]).all())


def finite_faces(file: str, points: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Leave out (T, 3) faces with corners that are no numbers, with a line. Raises AirlightError for corners that are not there."""
    if len(faces) and not (faces.min() >= 0 and faces.max() < len(points)):
        raise AirlightError(f"{file}: has faces whose corners are not among its {len(points)} vertices; export it again")
    good = np.isfinite(points).all(axis=1)[faces].all(axis=1)
    if not good.all():
        warn(f"{file}: {int((~good).sum())} faces with corners that are no numbers are left out", 5)
    return np.asarray(faces[good])
