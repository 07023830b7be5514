"""Read and append the boxes of JPEG XL and AVIF files (ISO/IEC 14496-12), and the Exif block that they hold."""

import contextlib
import struct
from collections.abc import Iterator
from typing import Any

import numpy as np

from airlight.files.atomic import scratch

_SIGNATURE = b"\0\0\0\x0cJXL \r\n\x87\n"
_JXL_START = _SIGNATURE + b"\0\0\0\x14ftypjxl \0\0\0\0jxl "
_EXIF = b"Exif\0\0"


def _boxes(data: bytes) -> Iterator[tuple[bytes, bytes]]:
    """List the boxes at the top: types and bodies."""
    at = 0
    while at + 8 <= len(data):
        size, head = int.from_bytes(data[at : at + 4], "big"), 8
        if size == 1:
            size, head = int.from_bytes(data[at + 8 : at + 16], "big"), 16
        end = len(data) if size == 0 else at + size
        if end < at + head:
            return
        yield data[at + 4 : at + 8], data[at + head : end]
        at = end


def jxl_exif(path: str) -> bytes:
    """Find the Exif block of a JPEG XL, a TIFF's bytes; empty where there is none."""
    with contextlib.suppress(OSError), open(path, "rb") as file:
        data = file.read()
        for kind, body in _boxes(data) if data.startswith(_SIGNATURE) else ():
            if kind == b"Exif" and len(body) > 4:
                return body[4 + int.from_bytes(body[:4], "big") :]
    return b""


def append_exif(path: str, block: bytes) -> None:
    """Append an Exif block, a TIFF's bytes, to a JPEG XL; a bare code stream gets its container."""
    with open(path, "rb") as file:
        data = file.read()
    if not data.startswith(_SIGNATURE):
        data = _JXL_START + struct.pack(">I", 8 + len(data)) + b"jxlc" + data
    with open(path, "wb") as file:
        file.write(data + struct.pack(">I4sI", 12 + len(block), b"Exif", 0) + block)


def exif_block(spec: Any, name: str) -> bytes:
    """Pack what a spec says of camera and software as an Exif block, a TIFF's bytes; by OpenImageIO, which does it for JPEGs alone."""
    import OpenImageIO as oiio

    small = oiio.ImageSpec(1, 1, 1, "uint8")
    for item in spec.extra_attribs:
        if item.name not in ("ICCProfile", "compression", "Orientation") and not item.name.startswith("oiio:"):
            small.attribute(item.name, item.type, item.value)
    with scratch(name, 1 << 20) as memory:
        out = oiio.ImageOutput.create("jpeg")
        fine = out is not None and out.open(memory, small)
        if out is None or not (fine and out.write_image(np.zeros((1, 1, 1), np.uint8)) and out.close()):
            return b""
        with open(memory, "rb") as file:
            data = file.read()
    at = 2
    while data[at] == 0xFF and data[at + 1] != 0xDA:
        size = int.from_bytes(data[at + 2 : at + 4], "big")
        if data[at + 1] == 0xE1 and data[at + 4 : at + 10] == _EXIF:
            return data[at + 10 : at + 2 + size]
        at += 2 + size
    return b""


def is_deep(head: bytes) -> bool:
    """Tell whether an AVIF's first bytes say that a code has more than 8 bits (AV1 Codec ISO Media File Format Binding, 2.3.3)."""
    at = head.find(b"av1C")
    return 0 <= at < len(head) - 6 and bool(head[at + 6] & 0x40)


def colour_codes(head: bytes) -> tuple[int, int, int] | None:
    """Read the code points of primaries, transfer and matrix (ITU-T H.273) from an AVIF's first bytes; None where there are none."""
    at = head.find(b"colrnclx")
    return struct.unpack_from(">3H", head, at + 8) if 0 <= at <= len(head) - 14 else None
