"""Codes, image files and colour profiles for tests."""

import struct

import numpy as np
import OpenImageIO as oiio

from airlight.colour import srgb_decode

NOTHING = np.zeros((40, 48), bool)


def codes_like(dtype="uint8", channels=3, height=40, width=48):
    random = np.random.default_rng(1)
    if np.dtype(dtype).kind == "f":
        return (random.random((height, width, channels)) * 4 - 0.25).astype(np.float16).astype(np.float32)
    codes = random.integers(0, np.iinfo(dtype).max + 1, (height, width, channels), dtype=dtype)
    if channels in (2, 4):
        codes[..., -1] |= 1  # WebP forgets the colour of what cannot be seen
    return codes


def store(path, codes, kind=None, names=None, **attributes):
    height, width, channels = codes.shape
    spec = oiio.ImageSpec(width, height, channels, kind or codes.dtype.name.replace("float32", "float"))
    if names:
        spec.channelnames = names
    if channels in (2, 4):
        spec.alpha_channel = channels - 1
        spec.attribute("oiio:UnassociatedAlpha", 1)
    for name, value in attributes.items():
        if isinstance(value, bytes):
            spec.attribute(name, f"uint8[{len(value)}]", np.frombuffer(value, np.uint8))
        else:
            spec.attribute(name.replace("__", ":"), value)
    out = oiio.ImageOutput.create(str(path))
    assert out.open(str(path), spec), out.geterror()
    assert out.write_image(codes)
    out.close()
    out.geterror()
    return path


def xyz(values):
    return b"XYZ \0\0\0\0" + b"".join(struct.pack(">i", round(v * 65536)) for v in values)


def icc_profile(primaries, gamma=None):
    """A small matrix profile; sRGB's own curve as a table where no gamma is given."""
    if gamma:
        curve = b"curv\0\0\0\0" + struct.pack(">IH", 1, round(gamma * 256)) + b"\0\0"
    else:
        table = np.rint(srgb_decode(np.linspace(0, 1, 1024)) * 65535).astype(">u2").tobytes()
        curve = b"curv\0\0\0\0" + struct.pack(">I", 1024) + table
    tags = {b"wtpt": xyz((0.9642, 1, 0.8249)), b"desc": b"desc\0\0\0\0\0\0\0\x05test\0" + b"\0" * 79, b"cprt": b"text\0\0\0\0CC0\0"}
    for name, column in zip((b"r", b"g", b"b"), primaries):
        tags[name + b"XYZ"] = xyz(column)
        tags[name + b"TRC"] = curve
    body, index = b"", b""
    for name, data in tags.items():
        index += name + struct.pack(">II", 128 + 4 + 12 * len(tags) + len(body), len(data))
        body += data + b"\0" * (-len(data) % 4)
    whole = struct.pack(">I", len(tags)) + index + body
    head = struct.pack(">I", 128 + len(whole)) + b"\0\0\0\0\x02\x10\0\0mntrRGB XYZ " + b"\0" * 12 + b"acsp" + b"\0" * 28
    head += b"".join(struct.pack(">i", round(v * 65536)) for v in (0.9642, 1, 0.8249))
    return head.ljust(128, b"\0") + whole


P3 = icc_profile(((0.51512, 0.24120, -0.00105), (0.29198, 0.69225, 0.04189), (0.15710, 0.06657, 0.78407)))
SRGB = icc_profile(((0.43607, 0.22249, 0.01392), (0.38515, 0.71687, 0.09708), (0.14307, 0.06061, 0.71410)))


def bmp_of_runs(codes):
    """A BMP of run lengths, whose last row ends before the bitmap does: OpenImageIO takes that for one row too many."""
    rows = b"".join(b"".join(bytes([1, code]) for code in row) + b"\0\0" for row in codes[::-1]) + b"\0\1"
    palette = b"".join(bytes([i, i, i, 0]) for i in range(256))
    height, width = codes.shape
    header = struct.pack("<IiiHHIIiiII", 40, width, height, 1, 8, 1, len(rows), 2835, 2835, 256, 0)
    start = 14 + len(header) + len(palette)
    return b"BM" + struct.pack("<IHHI", start + len(rows), 0, 0, start) + header + palette + rows
