"""PNG chunks that tell colours: read, and written where OpenImageIO tells something else.

Source: Portable Network Graphics (PNG) Specification (Third Edition), W3C 2025, 4.3 and 11.3.2.
"""

import struct
import zlib
from collections.abc import Iterable

from airlight.errors import warn
from airlight.files.coded import REC709, Coding, by_cicp
from airlight.files.decode import opened
from airlight.files.spaces import to_rec709

# What tells colours, the first before the others; cHRM goes with gAMA, and the last two with cICP.
STATEMENTS = (b"cICP", b"iCCP", b"sRGB", b"gAMA", b"cHRM", b"mDCV", b"cLLI")
MOST_CHUNKS = 1000  # before the pixels
_SRGB_GAMMA, _NEAR = 1 / 2.2, 0.05  # libpng takes as sRGB's a gamma that differs by no more


def read(path: str) -> dict[bytes, bytes]:
    """Read the data of the chunks that tell colours, an iCCP's as nothing; damaged ones are left out."""
    found: dict[bytes, bytes] = {}
    with opened(path) as (name, _), open(name, "rb") as file:
        file.seek(8)
        for _ in range(MOST_CHUNKS):
            head = file.read(8)
            if len(head) < 8 or head[4:] in (b"IDAT", b"IEND"):
                break
            length, kind = struct.unpack(">I4s", head)
            if kind == b"iCCP" or kind not in STATEMENTS or length > 64:
                if kind == b"iCCP":
                    found.setdefault(kind, b"")
                file.seek(length + 4, 1)
                continue
            data, crc = file.read(length), file.read(4)
            if crc == struct.pack(">I", zlib.crc32(kind + data)):
                found.setdefault(kind, data)
    return found


def coding(path: str, bits: int) -> Coding | None:
    """Tell the coding of a PNG of so many bits by its chunks; None where an ICC profile tells it, or it is sRGB."""
    chunks = read(path)
    cicp, chrm = chunks.get(b"cICP", b""), chunks.get(b"cHRM", b"")
    if len(cicp) == 4:
        known = by_cicp(cicp[0], cicp[1], bool(cicp[3]), bits) if cicp[2] == 0 else None
        if known is not None:
            return _with(known, chunks, b"cICP", b"mDCV")
        warn(f"{path}: its colours have code points that are not known (cICP {'-'.join(map(str, cicp))}), which are left aside", 7)
    if b"iCCP" in chunks or b"sRGB" in chunks:
        return None
    primaries = REC709
    if len(chrm) == 32:
        white, red, green, blue = (tuple(v / 100_000 for v in struct.unpack_from(">2i", chrm, at)) for at in (0, 8, 16, 24))
        primaries = (*red, *green, *blue, *white)
    try:
        plain = to_rec709(primaries) is None
    except ValueError as error:
        warn(f"{path}: has {error} (cHRM); taken as sRGB's", 7)
        primaries, plain = REC709, True
    gamma = struct.unpack(">I", chunks[b"gAMA"])[0] / 100_000 if len(chunks.get(b"gAMA", b"")) == 4 else 0.0
    if not 0.05 <= gamma <= 20 or (plain and abs(gamma / _SRGB_GAMMA - 1) <= _NEAR):
        return None if plain else _with(Coding(primaries, "srgb"), chunks, b"gAMA", b"cHRM")
    return _with(Coding(primaries, *(("linear", 1.0) if gamma == 1 else ("gamma", 1 / gamma))), chunks, b"gAMA", b"cHRM")


def _with(known: Coding, chunks: dict[bytes, bytes], *kept: bytes) -> Coding:
    verbatim = tuple((kind, chunks[kind]) for kind in kept if kind in chunks)
    return Coding(known.chromaticities, known.curve, known.gamma, known.narrow, known.cicp, verbatim)


def restate(path: str, chunks: Iterable[tuple[bytes, bytes]], kept: bytes = b"") -> None:
    """Put chunks in the place of all in a PNG file that tell colours, but for the one that is kept."""
    with open(path, "rb") as file:
        data = file.read()
    at, parts = 33, [data[:33]]  # signature and IHDR
    parts += [struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body)) for kind, body in chunks]
    while data[at + 4 : at + 8] != b"IDAT":
        end = at + 12 + int(struct.unpack_from(">I", data, at)[0])
        if data[at + 4 : at + 8] == kept or data[at + 4 : at + 8] not in STATEMENTS:
            parts.append(data[at:end])
        at = end
    with open(path, "wb") as file:
        file.writelines([*parts, data[at:]])
