"""Image files whose colours are told by numbers: PNG with chunks, EXR with any channels, JPEG with segments; and readings of both kinds."""

import struct
import zlib

import numpy as np
from picture_files import P3, store

from airlight.files import spaces

PQ_M, PQ_C = (2610 / 16384, 2523 / 32), (3424 / 4096, 2413 / 128, 2392 / 128)


def pq(light):
    """Codes 0..1 of SMPTE ST 2084 for light in cd/m2."""
    y = (np.asarray(light, float) / 10_000) ** PQ_M[0]
    return ((PQ_C[0] + PQ_C[1] * y) / (1 + PQ_C[2] * y)) ** PQ_M[1]


def hlg(scene):
    """Codes 0..1 of ITU-R BT.2100 HLG for scene light 0..1."""
    scene = np.asarray(scene, float)
    return np.where(scene <= 1 / 12, np.sqrt(3 * scene), 0.17883277 * np.log(np.maximum(12 * scene - 0.28466892, 1e-9)) + 0.55991073)


def png(path, codes, *chunks):
    """Store uint8 or uint16 codes (H, W, 1, 3 or 4) with chunks (name, data) before the pixels."""
    height, width, channels = codes.shape
    rows = b"".join(b"\0" + row.tobytes() for row in codes.astype(codes.dtype.newbyteorder(">")))
    head = struct.pack(">2I5B", width, height, 8 * codes.dtype.itemsize, {1: 0, 3: 2, 4: 6}[channels], 0, 0, 0)
    parts = [(b"IHDR", head), *chunks, (b"IDAT", zlib.compress(rows)), (b"IEND", b"")]
    whole = b"".join(struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data)) for kind, data in parts)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + whole)
    return path


def png_statements(path):
    """The chunks of a PNG that tell colours: names and data."""
    data, at, found = path.read_bytes(), 8, {}
    while at < len(data):
        length, kind = struct.unpack_from(">I4s", data, at)
        assert data[at + 8 + length : at + 12 + length] == struct.pack(">I", zlib.crc32(data[at + 4 : at + 8 + length]))
        if kind in (b"cICP", b"iCCP", b"sRGB", b"gAMA", b"cHRM", b"mDCV", b"cLLI"):
            assert kind not in found
            found[kind] = data[at + 8 : at + 8 + length]
        at += 12 + length
    return found


def chrm(chromaticities):
    """The data of a cHRM chunk of x, y of red, green, blue, white."""
    return struct.pack(">8i", *(round(v * 100_000) for v in (*chromaticities[6:], *chromaticities[:6])))


def exr(path, channels, height, width):
    """Store halves, uncompressed: channels {name: (array, step)}, a value every `step` pixels and rows."""

    def attribute(name, kind, value):
        return name + b"\0" + kind + b"\0" + struct.pack("<i", len(value)) + value

    names = sorted(channels)
    listed = b"".join(name.encode() + b"\0" + struct.pack("<iB3x2i", 1, 0, *[channels[name][1]] * 2) for name in names) + b"\0"
    box = struct.pack("<4i", 0, 0, width - 1, height - 1)
    head = b"v/1\x01" + struct.pack("<i", 2) + attribute(b"channels", b"chlist", listed) + attribute(b"compression", b"compression", b"\0")
    head += attribute(b"dataWindow", b"box2i", box) + attribute(b"displayWindow", b"box2i", box)
    head += attribute(b"lineOrder", b"lineOrder", b"\0")
    head += attribute(b"pixelAspectRatio", b"float", struct.pack("<f", 1)) + attribute(b"screenWindowCenter", b"v2f", bytes(8))
    head += attribute(b"screenWindowWidth", b"float", struct.pack("<f", 1)) + b"\0"
    rows = []
    for y in range(height):
        data = b"".join(a[y // step].astype("<f2").tobytes() for a, step in (channels[name] for name in names) if y % step == 0)
        rows.append(struct.pack("<2i", y, len(data)) + data)
    starts = len(head) + 8 * height + np.concatenate([[0], np.cumsum([len(row) for row in rows])[:-1]])
    path.write_bytes(head + starts.astype("<u8").tobytes() + b"".join(rows))
    return path


def with_segment(path, data, marker=0xE1):
    """Put an application segment into a JPEG after its start."""
    whole = path.read_bytes()
    path.write_bytes(whole[:2] + struct.pack(">BBH", 0xFF, marker, len(data) + 2) + data + whole[2:])
    return path


def camera_exif(space, index):
    """An Exif block of ColorSpace and interoperability index (4 bytes)."""
    first = struct.pack("<HHHIII", 1, 0x8769, 4, 1, 26, 0)
    second = struct.pack("<HHHIIHHIII", 2, 0xA001, 3, 1, space, 0xA005, 4, 1, 56, 0)
    return b"Exif\0\0II*\0\x08\0\0\0" + first + second + struct.pack("<HHHI4sI", 1, 1, 2, 4, index, 0)


def seeds(folder, picture):
    """Small files whose colours are told by numbers, for mutation. picture: gives pixels by channels and type, as fuzzing.picture."""
    codes = picture(3, "uint16")
    png(folder / "gama.png", picture(3, "uint8"), (b"gAMA", struct.pack(">I", 55556)), (b"cHRM", chrm(spaces.CHROMATICITIES[2])))
    png(folder / "pq.png", codes, (b"cICP", bytes((9, 16, 0, 1))), (b"mDCV", bytes(24)))
    png(folder / "hlg.png", codes, (b"cICP", bytes((9, 18, 0, 0))))
    y = picture(1, "half")[..., 0]
    exr(folder / "chroma.exr", {"Y": (y, 1), "RY": (y - 0.5, 1), "BY": (0.5 - y, 1)}, *y.shape)
    exr(folder / "subsampled.exr", {"Y": (y, 1), "RY": (y[::2, ::2], 2), "BY": (y[::2, ::2], 2)}, *y.shape)
    exr(folder / "names.exr", {f"beauty.{name}": (y, 1) for name in ("red", "green", "blue")}, *y.shape)
    store(folder / "adobe.jpg", picture(3, "uint8"))
    with_segment(folder / "adobe.jpg", camera_exif(65535, b"R03\0"))
    with_segment(folder / "adobe.jpg", b"http://ns.adobe.com/xap/1.0/\0<x xmlns:hdrgm='http://ns.adobe.com/hdr-gain-map/1.0/'/>")
    store(folder / "profile.tif", picture(3, "float"), ICCProfile=P3)
