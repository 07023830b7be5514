"""ICC profiles of primaries and a curve, for formats that tell colours by a profile alone."""

import struct

import numpy as np

from airlight.colour import srgb_encode

D50 = np.array([0.9642, 1.0, 0.8249])  # XYZ of the white of the profile connection space
# Parameters of ICC.1:2022, 10.18: g; or g, a, b, c, d of ((a x + b)^g, c x below d).
_CURVES = {
    "srgb": (3, (2.4, 1 / 1.055, 0.055 / 1.055, 1 / 12.92, 0.04045)),
    "bt709": (3, (1 / 0.45, 1 / 1.09929682680944, 0.09929682680944 / 1.09929682680944, 1 / 4.5, 0.0812428582986315)),
    "linear": (0, (1.0,)),
}


def _fixed(*values: float) -> bytes:
    return struct.pack(f">{len(values)}i", *(round(value * 65536) for value in values))


def _text(words: str) -> bytes:
    data = words.encode("utf-16-be")
    return b"mluc" + struct.pack(">5I", 0, 1, 12, 0x656E5553, len(data)) + struct.pack(">I", 28) + data  # enUS


def matrix_profile(to_xyz: np.ndarray, curve: str, gamma: float = 1.0, words: str = "RGB of the picture that Airlight read") -> bytes:
    """Make a profile of (3, 3), linear RGB to XYZ (D50), and a curve: srgb, bt709, linear, or gamma with its exponent.

    Source: ICC.1:2022 (profile version 4.4), a three-component matrix-based display profile.
    """
    kind, numbers = _CURVES.get(curve, (0, (gamma,)))
    para = b"para" + struct.pack(">IHH", 0, kind, 0) + _fixed(*numbers)
    tags = {b"desc": _text(words), b"cprt": _text("CC0"), b"wtpt": b"XYZ \0\0\0\0" + _fixed(*D50)}
    for name, column in zip((b"r", b"g", b"b"), to_xyz.T, strict=True):
        tags |= {name + b"XYZ": b"XYZ \0\0\0\0" + _fixed(*column), name + b"TRC": para}
    index, body = struct.pack(">I", len(tags)), b""
    for name, data in tags.items():
        index += name + struct.pack(">II", 132 + 12 * len(tags) + len(body), len(data))
        body += data + b"\0" * (-len(data) % 4)
    head = struct.pack(">I4s4s4s4s4s", 128 + len(index) + len(body), b"", b"\x04\x40\0\0", b"mntr", b"RGB ", b"XYZ ")
    head += struct.pack(">6H", 2026, 1, 1, 0, 0, 0) + b"acsp" + bytes(28) + _fixed(*D50)
    return head.ljust(128, b"\0") + index + body


def is_grey_srgb(profile: bytes) -> bool:
    """Compare the curve of a grey profile with sRGB's, to within half an 8-bit code; False where it has none of a kind that is known.

    Source: ICC.1:2022, 8.4.2 (monochrome display profiles), 10.6 (tables), 10.18 (parameters).
    """
    try:
        if profile[16:20] != b"GRAY":
            return False
        tags = (struct.unpack_from(">4sI", profile, 132 + 12 * i) for i in range(min(struct.unpack_from(">I", profile, 128)[0], 100)))
        at = next((offset for name, offset in tags if name == b"kTRC"), len(profile))
        codes = np.linspace(0, 1, 65)
        if profile[at : at + 4] == b"para" and struct.unpack_from(">H", profile, at + 8)[0] == 3:
            g, a, b, c, d = (value / 65536 for value in struct.unpack_from(">5i", profile, at + 12))
            light = np.where(codes >= d, np.maximum(a * codes + b, 0) ** g, c * codes)
        elif profile[at : at + 4] == b"curv" and (count := struct.unpack_from(">I", profile, at + 8)[0]) > 1:
            table = np.frombuffer(profile, ">u2", count, at + 12) / 65535
            light = np.interp(codes, np.linspace(0, 1, count), table)
        else:
            return False
        return bool(np.abs(srgb_encode(np.clip(light, 0, 1)) - codes).max() <= 1 / 512)
    except (struct.error, ValueError):
        return False
