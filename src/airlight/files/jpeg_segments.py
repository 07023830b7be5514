"""JPEG segments that OpenImageIO does not tell of: gain maps, and the colour space of cameras.

Sources: CIPA DC-007 (MPF), Ultra HDR Image Format v1.1, ISO 21496-1 (gain maps); CIPA DC-008 (Exif), DCF 2.0 (option R03: Adobe RGB).
"""

import contextlib
import mmap
import struct
from collections.abc import Iterator

from airlight.files.coded import ADOBE, Coding
from airlight.files.decode import opened

ADOBE_GAMMA = 563 / 256  # Adobe RGB Color Image Encoding, 4.3.4.2
MOST_SEGMENTS = 1000
_EXIF, _XMP, _ISO = b"Exif\0\0", b"http://ns.adobe.com/", b"urn:iso:std:iso:ts:21496:-1\0"
_MPF = b"MPF\0"
_GAIN = (b"http://ns.adobe.com/hdr-gain-map/", b"http://ns.apple.com/HDRGainMap/")


def _applications(path: str) -> Iterator[bytes]:
    """Yield the data of APP1 and APP2 segments."""
    with opened(path) as (name, _), open(name, "rb") as file:
        file.seek(2)
        for _ in range(MOST_SEGMENTS):
            head = file.read(4)
            if len(head) < 4 or head[0] != 0xFF or head[1] in (0xDA, 0xD9):
                return
            length = int.from_bytes(head[2:], "big") - 2
            data = file.read(max(length, 0))
            if head[1] in (0xE1, 0xE2):
                yield data


def read(path: str) -> tuple[Coding | None, bool]:
    """Tell a JPEG's coding where its Exif data say Adobe RGB, else None, and whether it holds a gain map."""
    index, gain, several = None, False, False
    for data in _applications(path):
        if data.startswith(_EXIF) and index is None:
            index = b""
            with contextlib.suppress(struct.error):
                index = _index(data[len(_EXIF) :])
        gain = gain or data.startswith(_ISO) or (data.startswith(_XMP) and any(name in data for name in _GAIN))
        several = several or data.startswith(_MPF)
    if several and not gain:  # Apple's say so in the second picture alone
        with opened(path) as (name, _), open(name, "rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as whole:
            gain = any(whole.find(words) >= 0 for words in (*_GAIN, _ISO))
    return Coding(ADOBE, "gamma", ADOBE_GAMMA) if index == b"R03" else None, gain


def _index(tiff: bytes) -> bytes:
    """Find the interoperability index of an Exif block. Raises struct.error where it ends early."""
    order = ">" if tiff[:2] == b"MM" else "<"
    (at,) = struct.unpack_from(order + "I", tiff, 4)
    for wanted in (0x8769, 0xA005, 1):  # the Exif directory, in it that of interoperability, in it the index
        (count,) = struct.unpack_from(order + "H", tiff, at)
        for entry in range(at + 2, at + 2 + 12 * count, 12):
            tag, _, _, value = struct.unpack_from(order + "HHI4s", tiff, entry)
            if tag == wanted:
                if wanted == 1:
                    return bytes(value[:3])
                (at,) = struct.unpack(order + "I", value)
                break
        else:
            return b""
    return b""
