"""Read the accessors of a glTF file, each length and index checked before anything is decoded. Unaligned ones are read as they are."""

from functools import cached_property
from typing import Any, NoReturn

import msgspec
import numpy as np

from airlight.scenes.gltf import MAX_ACCESSOR, MAX_BYTES, MAX_EXTENT, draco, meshopt, schema
from airlight.scenes.gltf.container import Container, open_container

KINDS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
COMPONENTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}


class Accessors:
    """Holds a file's bytes and JSON, `document`; gives the arrays that its accessors describe, decoded once."""

    def __init__(self, path: str) -> None:
        self.container: Container = open_container(path)
        self.document = self.container.document
        self._decoded = 0
        self._views: dict[int, memoryview] = {}  # decompressed
        self._unpacked: dict[int, np.ndarray] = {}  # accessors of compressed primitives
        self._floats: dict[int, np.ndarray] = {}
        self._integers: dict[int, np.ndarray] = {}
        self._seen: set[tuple[str, int]] = set()  # checks that were made: many may name one large accessor
        self._highest: dict[int, int] = {}

    def refuse(self, what: str, cure: str = "export it again") -> NoReturn:
        self.container.refuse(what, cure)

    def within(self, index: int | None, things: list[Any], what: str) -> Any:
        """Take things[index], or refuse and say what asks for it."""
        if index is None or not 0 <= index < len(things):
            self.refuse(f"{what} names number {index} of {len(things)}")
        return things[index]

    # ---------------------------------------------------------------- bytes

    @cached_property
    def buffers(self) -> list[memoryview]:
        found = []
        for i, buffer in enumerate(self.document.buffers):
            if buffer.extensions.meshopt.fallback or buffer.extensions.meshopt_1.fallback:
                found.append(memoryview(b""))  # of what else is compressed: nobody need have it
                continue
            if buffer.uri is not None:
                data = memoryview(self.container.resource(buffer.uri, f"buffer {i}"))
            elif i == 0 and self.container.binary is not None:
                data = self.container.binary
            else:
                self.refuse(f"buffer {i} has no contents")
            if buffer.byte_length > len(data):
                self.refuse(f"buffer {i} has {len(data)} bytes instead of {buffer.byte_length}", "copy or export it again")
            found.append(data[: buffer.byte_length])
        return found

    def view(self, index: int | None, what: str) -> tuple[memoryview, int | None]:
        """Read the bytes of a buffer view, and its stride."""
        view = self.within(index, self.document.buffer_views, f"the buffer view of {what}")
        packed = view.extensions.meshopt or view.extensions.meshopt_1
        if packed is not None:
            assert index is not None
            return self._decompressed(index, packed), packed.byte_stride
        data = self.within(view.buffer, self.buffers, f"buffer view {index}")
        if view.byte_offset + view.byte_length > len(data):
            self.refuse(f"buffer view {index} ends behind the end of its buffer")
        return data[view.byte_offset : view.byte_offset + view.byte_length], view.byte_stride

    def _decompressed(self, index: int, packed: schema.Compressed) -> memoryview:
        """Decompress a buffer view of meshoptimizer's, up to the limits of accessors."""
        if index not in self._views:
            what = f"buffer view {index}"
            self._spend(packed.count * packed.byte_stride, what)
            data = self.within(packed.buffer, self.buffers, what)
            if packed.byte_offset + packed.byte_length > len(data):
                self.refuse(f"{what} ends behind the end of its buffer")
            source = bytes(data[packed.byte_offset : packed.byte_offset + packed.byte_length])
            try:
                found = meshopt.decode(source, packed.count, packed.byte_stride, packed.mode, packed.filter)
            except ValueError as error:
                self.refuse(f"{what} is not what meshoptimizer writes ({error})")
            self._views[index] = memoryview(found)
        return self._views[index]

    def _unpack(self, primitive: schema.Primitive, what: str) -> None:
        """Decompress the vertices and triangles of a primitive of Draco's, up to the limits of accessors."""
        packed = primitive.extensions.draco
        if packed is None:
            return
        if primitive.mode != 4 or primitive.indices is None:
            self.refuse(f"{what} is compressed by Draco, but not made of indexed triangles", "export it as triangles")
        accessors = self.document.accessors
        wanted = {number: name for name, number in packed.attributes.items() if name in primitive.attributes}
        indices = [*(primitive.attributes[name] for name in wanted.values()), primitive.indices]
        if all(index in self._unpacked for index in indices):
            return
        for index in indices:
            accessor = self.within(index, accessors, what)
            self._spend(accessor.count * COMPONENTS[accessor.type] * 4, f"accessor {index}")
        data = bytes(self.view(packed.buffer_view, what)[0])
        try:
            faces, attributes = draco.decode(data, accessors[primitive.indices].count, MAX_ACCESSOR)
            attributes[-1] = faces.reshape(-1, 1)
            for number, index in zip([*wanted, -1], indices):
                found = draco.typed(attributes, number, np.dtype(KINDS[accessors[index].component_type]))
                self._unpacked[index] = found
                if 0 < len(found) != accessors[index].count:  # encoders drop and merge; many a program goes by what is there
                    accessors[index] = msgspec.structs.replace(accessors[index], count=len(found))
        except ValueError as error:
            self.refuse(f"{what} is not what Draco writes ({error})")

    def _spend(self, size: int, what: str) -> None:
        """Count bytes that are about to be decoded; refuse more than the limits."""
        self._decoded += size
        if size > MAX_ACCESSOR or self._decoded > MAX_BYTES:
            limits = f"{MAX_ACCESSOR >> 20} MiB for one and {MAX_BYTES >> 20} MiB for all"
            self.refuse(f"{what} is more than the limits of {limits}", "make it smaller first")

    def _elements(self, view: int, offset: int, count: int, kind: np.dtype, components: int, what: str) -> np.ndarray:
        data, stride = self.view(view, what)
        size = kind.itemsize * components
        stride = stride or size
        if stride < size:
            self.refuse(f"{what} has elements of {size} bytes every {stride} bytes")
        if offset + (count - 1) * stride + size > len(data):
            self.refuse(f"{what} ends behind the end of its buffer view")
        array = np.ndarray((count, components), kind, buffer=data, offset=offset, strides=(stride, kind.itemsize))
        return np.array(array)  # contiguous, and not the file's own bytes

    def _accessor(self, index: int) -> np.ndarray:
        """Read an accessor in the file's own type: (count, components)."""
        what = f"accessor {index}"
        accessor = self.document.accessors[index]
        self._spend(accessor.count * COMPONENTS[accessor.type] * 4, what)
        kind, components = np.dtype(KINDS[accessor.component_type]), COMPONENTS[accessor.type]
        if index in self._unpacked:
            array = self._unpacked[index].copy()
            if array.shape != (accessor.count, components):
                self.refuse(f"{what} holds {' x '.join(map(str, array.shape))} values instead of {accessor.count} x {components}")
        elif accessor.buffer_view is not None:
            array = self._elements(accessor.buffer_view, accessor.byte_offset, accessor.count, kind, components, what)
        else:
            if accessor.count > 65536 + sum(len(buffer) for buffer in self.buffers):
                self.refuse(f"{what} asks for {accessor.count} elements, more than the file has bytes")
            array = np.zeros((accessor.count, components), kind)
        sparse = accessor.sparse
        if sparse is not None:
            what = f"the sparse part of {what}"
            if sparse.count > accessor.count:
                self.refuse(f"{what} has more elements than the whole")
            indices, values = sparse.indices, sparse.values
            at = self._elements(indices.buffer_view, indices.byte_offset, sparse.count, np.dtype(KINDS[indices.component_type]), 1, what)[
                :, 0
            ]
            if int(at.max()) >= accessor.count:
                self.refuse(f"{what} names element {int(at.max())} of {accessor.count}")
            array[at] = self._elements(values.buffer_view, values.byte_offset, sparse.count, kind, components, what)
        return array

    def floats(self, index: int) -> np.ndarray:
        """Read a checked accessor as (count, components) float32; normalised integers are in 0..1 or -1..1."""
        if index not in self._floats:
            array = self._accessor(index)
            accessor = self.document.accessors[index]
            if array.dtype.kind == "f" or not accessor.normalized:
                array = array.astype(np.float32)
            else:
                array = np.maximum(array.astype(np.float32) / np.float32(np.iinfo(array.dtype).max), -1)
            self._floats[index] = array
        return self._floats[index]

    def integers(self, index: int) -> np.ndarray:
        """Read a checked accessor as (count, components) uint32."""
        if index not in self._integers:
            self._integers[index] = self._accessor(index).astype(np.uint32)
        return self._integers[index]

    def _typed(self, index: int, what: str, type: str | tuple[str, ...], kinds: tuple[int, ...] | None = None) -> schema.Accessor:
        accessor: schema.Accessor = self.within(index, self.document.accessors, what)
        if accessor.type not in type or (kinds is not None and accessor.component_type not in kinds):
            self.refuse(f"{what} is of a wrong type ({accessor.type}, {accessor.component_type})")
        return accessor

    def _once(self, check: str, index: int) -> bool:
        """Tell whether this check of an accessor is still to be made; it then counts as made."""
        fresh = (check, index) not in self._seen
        self._seen.add((check, index))
        return fresh

    def highest(self, index: int) -> int:
        """Find the greatest of an accessor's integers."""
        if index not in self._highest:
            self._highest[index] = int(self.integers(index).max())
        return self._highest[index]

    def _finite(self, index: int, what: str) -> np.ndarray:
        """Read `floats`, and refuse any that is no number within MAX_EXTENT."""
        array = self.floats(index)
        if self._once("finite", index) and not (np.abs(array) <= MAX_EXTENT).all():  # false for NaN
            self.refuse(f"{what} holds values that are not numbers, or beyond {MAX_EXTENT:g}")
        return array

    def _mended(self, index: int) -> None:
        """Replace what is not a number by 0."""
        array = self.floats(index)
        if not self._once("mended", index):
            return
        bad = ~(np.abs(array) <= MAX_EXTENT)
        if bad.any():
            array[bad] = 0
