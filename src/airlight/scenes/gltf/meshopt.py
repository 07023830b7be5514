"""Decode buffer views of EXT_meshopt_compression and KHR_meshopt_compression, from the bit streams that these extensions specify.

Attributes: positions of groups are found one after the other, what is in them all at once. Triangles are a chain, made one of another.
"""

from collections.abc import Callable

import numpy as np

_GROUP = 16  # elements whose bytes share a number of bits
_LOOKAHEAD = 24  # bytes that must follow a group's beginning
_BITS_0 = (0, 2, 4, 8)  # of a group's header, in version 0
_BITS_1 = ((0, 1, 2, 4), (1, 2, 4, 8))  # in version 1, by the control of a byte's column
_LITERAL, _ZERO = 3, 2  # such controls
# How many of the values that a byte packs say that their own byte follows the group: those with all bits set.
_ESCAPES = {
    bits: bytes(sum(byte >> at & most == most for at in range(0, 8, bits)) for byte in range(256))
    for bits, most in ((1, 1), (2, 3), (4, 15))
}
_WORD = 0xFFFFFFFF


def decode(data: bytes, count: int, stride: int, mode: str, filter: str = "NONE") -> bytes:
    """Decode `count` elements of `stride` bytes. Raises ValueError for what no encoder writes."""
    try:
        if mode == "ATTRIBUTES":
            if stride % 4:
                raise ValueError(f"attributes of {stride} bytes")
            found = _attributes(data, count, stride)
            return (_FILTERS[filter](found) if filter != "NONE" else found).tobytes()
        if stride not in (2, 4) or filter != "NONE":
            raise ValueError(f"indices of {stride} bytes with filter {filter}")
        made = _triangles(data, count) if mode == "TRIANGLES" else _sequence(data, count)
    except IndexError:
        raise ValueError("it is cut off") from None
    return (np.array(made, np.uint64) & (256**stride - 1)).astype(f"<u{stride}").tobytes()


# ---------------------------------------------------------------- attributes


def _attributes(data: bytes, count: int, stride: int) -> np.ndarray:
    """Decode (count, stride) uint8."""
    if not data or data[0] & 0xF0 != 0xA0 or data[0] & 15 > 1:
        raise ValueError("attributes of another version")
    version = data[0] & 15
    tail = stride + (stride // 4 if version else 0)
    padded = max(tail, 24 if version else 32)
    end = len(data) - padded
    if end < 1:
        raise ValueError("it is cut off")
    last = np.frombuffer(data, np.uint8, stride, len(data) - tail)
    channels = data[len(data) - stride // 4 :] if version else bytes(stride // 4)
    width = -(-count // _GROUP) * _GROUP
    columns = np.zeros(stride * width, np.uint8)
    groups: dict[int, tuple[list[int], list[int]]] = {bits: ([], []) for bits in (1, 2, 4, 8)}
    at = _scan(data, count, stride, version, width, groups, columns)
    if at != end:
        raise ValueError("it is longer than its elements")
    source = np.frombuffer(data, np.uint8)
    for bits, (begins, goals) in groups.items():
        for start in range(0, len(begins), 65536):
            part = slice(start, start + 65536)
            values = _unpacked(source, np.array(begins[part], np.int64), bits)
            columns[np.array(goals[part], np.int64)[:, None] + np.arange(_GROUP)] = values
    return _summed(columns.reshape(stride, width)[:, :count], last, channels)


def _scan(
    data: bytes, count: int, stride: int, version: int, width: int, groups: dict[int, tuple[list[int], list[int]]], columns: np.ndarray
) -> int:
    """Find where each group begins, and where its values go; copies literal columns. Returns the place behind the last."""
    block = min(8192 // stride & ~15, 256)
    safe = len(data) - _LOOKAHEAD
    at = 1
    for first in range(0, count, block):
        size = min(block, count - first)
        here = -(-size // _GROUP)
        controls = data[at : at + stride // 4] if version else b""
        at += len(controls)
        for k in range(stride):
            goal = k * width + first
            control = controls[k // 4] >> k % 4 * 2 & 3 if version else 0
            if control == _ZERO:
                continue
            if control == _LITERAL:
                if at + size > len(data):
                    raise ValueError("it is cut off")
                columns[goal : goal + size] = np.frombuffer(data, np.uint8, size, at)
                at += size
                continue
            bits_of = _BITS_1[control] if version else _BITS_0
            header, at = at, at + (here + 3) // 4
            if at > safe:
                raise ValueError("it is cut off")
            for g in range(here):
                if at > safe:
                    raise ValueError("it is cut off")
                bits = bits_of[data[header + (g >> 2)] >> (g & 3) * 2 & 3]
                if not bits:
                    continue
                begins, goals = groups[bits]
                begins.append(at)
                goals.append(goal + _GROUP * g)
                at += 2 * bits
                if bits < 8:
                    at += sum(data[at - 2 * bits : at].translate(_ESCAPES[bits]))
    return at


def _unpacked(source: np.ndarray, begins: np.ndarray, bits: int) -> np.ndarray:
    """Unpack (M, 16) uint8 of groups."""
    packed = source[begins[:, None] + np.arange(2 * bits)]
    if bits == 8:
        return packed
    shifts = np.arange(8) if bits == 1 else np.arange(8 - bits, -1, -bits)  # single bits begin with the lowest
    most = (1 << bits) - 1
    values = (packed[:, :, None] >> shifts.astype(np.uint8) & most).reshape(len(begins), _GROUP)
    escaped = values == most
    behind = begins[:, None] + 2 * bits + np.cumsum(escaped, axis=1) - 1
    values[escaped] = source[behind[escaped]]
    return values


def _summed(columns: np.ndarray, last: np.ndarray, channels: bytes) -> np.ndarray:
    """Sum the differences of (stride, N) columns from `last` on: (N, stride)."""
    found = np.empty(columns.shape[::-1], np.uint8)
    for k in range(0, len(columns), 4):
        four, start = columns[k : k + 4], last[k : k + 4]
        channel = channels[k // 4]
        if channel & 3 == 3:
            raise ValueError("attributes of an unknown kind")
        kind = np.dtype(("<u1", "<u2", "<u4")[channel & 3])
        words = np.ascontiguousarray(four.T).view(kind).T
        first = np.ascontiguousarray(start).view(kind)
        for row, begin, goal in zip(words, first, range(k, k + 4, kind.itemsize)):
            if kind.itemsize == 4:
                turn = (32 - (channel >> 4)) & 31
                turned = row << np.uint32(turn) | row >> np.uint32((32 - turn) & 31) if turn else row
                value = np.bitwise_xor.accumulate(turned) ^ begin
            else:
                value = np.cumsum(row >> 1 ^ (0 - (row & 1)).astype(kind), dtype=kind) + begin
            found[:, goal : goal + kind.itemsize] = value.astype(kind)[:, None].view(np.uint8)
    return found


# ---------------------------------------------------------------- indices


def _varint(data: bytes, at: int) -> tuple[int, int]:
    """Read a number of up to five groups of seven bits; returns it and the place behind it."""
    found = 0
    for shift in range(0, 35, 7):
        byte = data[at]
        at += 1
        found |= (byte & 127) << shift
        if byte < 128:
            break
    return found & _WORD, at


def _signed(value: int) -> int:
    return value >> 1 ^ -(value & 1)


def _sequence(data: bytes, count: int) -> list[int]:
    """Decode indices one by one, each a difference from one of two before it."""
    end = len(data) - 4
    if end < 1 + count or data[0] & 0xF0 != 0xD0 or data[0] & 15 > 1:
        raise ValueError("indices of another version, or cut off")
    last, found, at = [0, 0], [], 1
    for _ in range(count):
        if at >= end:
            raise ValueError("it is cut off")
        value, at = _varint(data, at)
        which = value & 1
        last[which] = (last[which] + _signed(value >> 1)) & _WORD
        found.append(last[which])
    if at != end:
        raise ValueError("it is longer than its indices")
    return found


def _triangles(data: bytes, count: int) -> list[int]:
    """Decode triangles, most of which share an edge and a vertex with the 16 of each that came before."""
    end = len(data) - 16
    if count % 3 or end < 1 + count // 3 or data[0] & 0xF0 != 0xE0 or data[0] & 15 > 1:
        raise ValueError("triangles of another version, or cut off")
    table, limit = data[end:], 13 if data[0] & 15 else 15
    edges, vertices = [(_WORD, _WORD)] * 16, [_WORD] * 16
    found: list[int] = []
    at, following, last = 1 + count // 3, 0, 0
    for code in data[1:at]:
        if at > end:
            raise ValueError("it is cut off")
        if code < 0xF0:
            a, b = edges[-1 - (code >> 4)]
            third = code & 15
            if 0 < third < limit:
                c = vertices[-1 - third]
            else:
                if third == 0:
                    c = following
                    following += 1
                elif third == 15:
                    step, at = _varint(data, at)
                    last = c = (last + _signed(step)) & _WORD
                else:  # 13 and 14: the index before the last free one, and behind it
                    last = c = (last + third - (third ^ 3)) & _WORD
                vertices.append(c)
            edges += (c, b), (a, c)
        else:
            if code < 0xFE:
                both, is_free = table[code & 15], False
            else:
                both, is_free = data[at], code == 0xFF
                at += 1
                if both == 0:
                    following = 0
            second, third = both >> 4, both & 15
            a = following
            following += not is_free
            b = following if second == 0 else vertices[-second]
            following += second == 0
            c = following if third == 0 else vertices[-third]
            following += third == 0
            if is_free:
                step, at = _varint(data, at)
                last = a = (last + _signed(step)) & _WORD
            if second == 15 and code >= 0xFE:
                step, at = _varint(data, at)
                last = b = (last + _signed(step)) & _WORD
            if third == 15 and code >= 0xFE:
                step, at = _varint(data, at)
                last = c = (last + _signed(step)) & _WORD
            vertices.append(a)
            if second in (0, 15):
                vertices.append(b)
            if third in (0, 15):
                vertices.append(c)
            edges += (b, a), (c, b), (a, c)
        found += a, b, c
        if len(edges) > 4096:
            del edges[:-16], vertices[:-16]
    if at != end:
        raise ValueError("it is longer than its triangles")
    return found


# ---------------------------------------------------------------- filters


def _rounded(values: np.ndarray, kind: np.dtype) -> np.ndarray:
    return np.trunc(values + np.copysign(np.float32(0.5), values)).astype(np.int32).astype(kind)


def _four(bytes_: np.ndarray, strides: tuple[int, ...], letter: str) -> np.ndarray:
    """View elements as (N, 4) numbers of one or two bytes. Raises ValueError for other strides."""
    stride = bytes_.shape[1]
    if stride not in strides:
        raise ValueError(f"a filter over elements of {stride} bytes")
    return bytes_.view(f"<{letter}{stride // 4}")


def _octahedral(bytes_: np.ndarray) -> np.ndarray:
    """Unfold unit vectors from the octahedron; the fourth number stays."""
    codes = _four(bytes_, (4, 8), "i")
    x, y, one = (codes[:, i].astype(np.float32) for i in range(3))
    z = one - np.abs(x) - np.abs(y)
    below = np.minimum(z, 0)
    x, y = x + np.where(x >= 0, below, -below), y + np.where(y >= 0, below, -below)
    length = np.sqrt(x * x + y * y + z * z)
    scale = np.float32(np.iinfo(codes.dtype).max) / np.where(length > 0, length, 1)
    for i, value in enumerate((x, y, z)):
        codes[:, i] = _rounded(value * scale, codes.dtype)
    return bytes_


def _quaternion(bytes_: np.ndarray) -> np.ndarray:
    """Complete unit quaternions by the greatest of their numbers, which was left out."""
    codes = _four(bytes_, (8,), "i")
    which = codes[:, 3] & 3
    scale = np.float32(np.sqrt(0.5)) / (codes[:, 3] | 3).astype(np.float32)
    small = codes[:, :3].astype(np.float32) * scale[:, None]
    large = np.sqrt(np.maximum(1 - (small * small).sum(axis=1), 0))
    rows = np.arange(len(codes))
    for i, value in enumerate((large, small[:, 0], small[:, 1], small[:, 2])):
        codes[rows, (which + i) & 3] = _rounded(np.clip(value * np.float32(32767), -32767, 32767), codes.dtype)
    return bytes_


def _exponential(bytes_: np.ndarray) -> np.ndarray:
    """Make floats of 24 bits of mantissa and 8 of exponent."""
    words = bytes_.view("<i4")
    mantissa, exponent = (words << 8) >> 8, words >> 24
    with np.errstate(over="ignore", under="ignore"):
        return np.ldexp(mantissa.astype(np.float32), exponent).astype("<f4")


def _colour(bytes_: np.ndarray) -> np.ndarray:
    """Make RGBA of luma, two differences, and alpha, whose highest bit says how many bits there are."""
    codes = _four(bytes_, (4, 8), "u")
    alpha = codes[:, 3].astype(np.int32)
    most = alpha.copy()
    for shift in (1, 2, 4, 8):
        most |= most >> shift
    luma = codes[:, 0].astype(np.int32)
    orange, green = (codes[:, i].view(f"<i{codes.itemsize}").astype(np.int32) for i in (1, 2))
    full = np.iinfo(codes.dtype).max
    scale = np.float32(full) / np.maximum(most, 1).astype(np.float32)
    parts = (luma + orange - green, luma + green, luma - orange - green, (alpha << 1 & most) | (alpha & 1))
    for i, value in enumerate(parts):
        codes[:, i] = np.clip(np.trunc(value.astype(np.float32) * scale + np.float32(0.5)), 0, full).astype(codes.dtype)
    return bytes_


_FILTERS: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "OCTAHEDRAL": _octahedral,
    "QUATERNION": _quaternion,
    "EXPONENTIAL": _exponential,
    "COLOR": _colour,
}
