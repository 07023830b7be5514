"""Unpack Blosc frames of format version 2 (Blosc 1.x), as OpenVDB writes them: shuffled bytes, packed by LZ4, zlib or not at all.

Sources: README_HEADER.rst of c-blosc, lz4_Block_format.md of LZ4. Raises ValueError for what cannot be.
"""

import struct
import zlib

import numpy as np

_HEADER = struct.Struct("<BBBBIII")
_CODECS = {0: "BloscLZ", 1: "LZ4", 2: "Snappy", 3: "zlib", 4: "Zstandard"}
_SHUFFLED, _STORED, _BITS, _WHOLE = 1, 2, 4, 16  # flags
MAX_SPLIT, MIN_SPLIT = 16, 128  # bytes of an element, and elements of a block, up to and from which a block is split by bytes


def unpack(data: bytes, size: int) -> bytes:
    """Unpack a frame that must hold `size` bytes."""
    if len(data) < _HEADER.size:
        raise ValueError("a Blosc frame is cut off")
    version, _, flags, element, total, block, packed = _HEADER.unpack_from(data)
    if version != 2 or total != size or packed != len(data) or element == 0:
        raise ValueError("a Blosc frame is damaged")
    if flags & _STORED:
        if len(data) != _HEADER.size + size:
            raise ValueError("a Blosc frame is damaged")
        return data[_HEADER.size :]
    codec = flags >> 5
    if codec not in (1, 3):
        raise ValueError(f"a Blosc frame is packed by {_CODECS.get(codec, 'an unknown method')}, not LZ4")
    if flags & _BITS:
        raise ValueError("a Blosc frame has its bits shuffled, not its bytes")
    if not 0 < block <= max(size, 1):
        raise ValueError("a Blosc frame is damaged")
    count = -(-size // block)
    if _HEADER.size + 4 * count > len(data):
        raise ValueError("a Blosc frame is cut off")
    out = []
    for i, start in enumerate(struct.unpack_from(f"<{count}I", data, _HEADER.size)):
        length = min(block, size - i * block)
        split = not flags & _WHOLE and element <= MAX_SPLIT and block // element >= MIN_SPLIT and length == block
        plain = _block(data, start, length, element if split else 1, codec)
        out.append(_unshuffled(plain, element) if flags & _SHUFFLED and element > 1 else plain)
    return b"".join(out)


def _block(data: bytes, at: int, length: int, parts: int, codec: int) -> bytes:
    """Unpack the parts of a block, whose lengths are before them; what could not be made shorter is as it was."""
    if length % parts:
        raise ValueError("a Blosc frame is damaged")
    each, out = length // parts, []
    for _ in range(parts):
        if at + 4 > len(data):
            raise ValueError("a Blosc frame is cut off")
        packed = int.from_bytes(data[at : at + 4], "little")
        at += 4
        if packed > each or at + packed > len(data):
            raise ValueError("a Blosc frame is damaged")
        part = data[at : at + packed]
        out.append(part if packed == each else lz4(part, each) if codec == 1 else inflate(part, each))
        at += packed
    return b"".join(out)


def _unshuffled(data: bytes, element: int) -> bytes:
    """Put the bytes of each element together again; those behind the last whole one stayed where they were."""
    whole = len(data) // element * element
    return np.frombuffer(data[:whole], np.uint8).reshape(element, -1).T.tobytes() + data[whole:]


def lz4(data: bytes, size: int) -> bytes:
    """Unpack a block of LZ4 that must hold `size` bytes."""
    out, at, end = bytearray(), 0, len(data)
    try:
        while at < end:
            token = data[at]
            at += 1
            length = token >> 4
            if length == 15:
                length, at = _longer(data, at, length)
            if at + length > end or len(out) + length > size:
                raise ValueError("an LZ4 block is damaged")
            out += data[at : at + length]
            at += length
            if at == end:
                break
            offset = data[at] | data[at + 1] << 8
            at += 2
            length = token & 15
            if length == 15:
                length, at = _longer(data, at, length)
            length += 4
            start = len(out) - offset
            if offset == 0 or start < 0 or len(out) + length > size:
                raise ValueError("an LZ4 block is damaged")
            if offset >= length:
                out += out[start : start + length]
            else:
                out += (out[start:] * (length // offset + 1))[:length]
    except IndexError:
        raise ValueError("an LZ4 block is cut off") from None
    if len(out) != size:
        raise ValueError("an LZ4 block is cut off")
    return bytes(out)


def _longer(data: bytes, at: int, length: int) -> tuple[int, int]:
    """Add the bytes that go on with a length, up to one that is not 255."""
    while True:
        more = data[at]
        at += 1
        length += more
        if more != 255:
            return length, at


def inflate(data: bytes, size: int) -> bytes:
    """Unpack a zlib stream that must hold `size` bytes; no more than that is ever made of it."""
    unpacker = zlib.decompressobj()
    try:
        out = unpacker.decompress(data, size + 1)
    except zlib.error:
        raise ValueError("a zlib stream is damaged") from None
    if len(out) != size or not unpacker.eof:
        raise ValueError("a zlib stream is cut off")
    return out
