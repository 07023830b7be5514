"""DPX and Cineon: film's log codes, video's, and linear ones, as the header's transfer characteristic says."""

import os
from functools import cache
from typing import Any

import numpy as np

from airlight.errors import AirlightError, warn
from airlight.process import standard

FORMATS = ("dpx", "cineon")
# Cineon's printing density: 10-bit codes of black and white, density a code, gamma of the negative.
# Source: Kodak 1995.
BLACK, WHITE, DENSITY, NEGATIVE_GAMMA = 95, 685, 0.002, 0.6
# Transfer characteristics of SMPTE 268M, as OpenImageIO names them.
_LOG = ("Printing density", "Logarithmic")
_LINEAR = ("Linear", "Z (depth), linear", "Z (depth), homogeneous")
_VIDEO: tuple[str, ...] = ("Unspecified video", "SMPTE 274M", "ITU-R 709-4", "ITU-R 601-5 system B or G", "ITU-R 601-5 system M")
_VIDEO += ("NTSC composite video", "PAL composite video")
# Names for --colorspace, and what a header says of them.
SPACES = {"cineon": "Printing density", "rec709": "ITU-R 709-4", "linear": "Linear"}
_SETTLED = "airlight:transfer"  # beside dpx:Transfer, which is handed on as it is
# Of the header, what describes the storage of the codes: nothing for another format.
STORAGE: tuple[str, ...] = ("dpx:Transfer", "dpx:Colorimetric", "dpx:Packing", "dpx:ImageDescriptor", "dpx:DittoKey")
STORAGE += ("dpx:EndOfLinePadding", "dpx:EndOfImagePadding", "dpx:Version", "dpx:Signal")
STORAGE += ("dpx:LowData", "dpx:HighData", "dpx:LowQuantity", "dpx:HighQuantity")


class Curve:
    """Converts by a transfer curve: `decode` and `encode` work in place on contiguous (h, W, 3) float32, codes as 0..1."""

    def __init__(self, transform: Any):
        """Compile an OpenColorIO transform from linear light to codes."""
        import PyOpenColorIO as ocio

        config = ocio.Config.CreateRaw()
        directions = (ocio.TRANSFORM_DIR_INVERSE, ocio.TRANSFORM_DIR_FORWARD)
        ways = [config.getProcessor(transform, way).getOptimizedCPUProcessor(ocio.OPTIMIZATION_LOSSLESS) for way in directions]
        self.decode, self.encode = ways[0].applyRGB, ways[1].applyRGB

    def is_srgb(self) -> bool:
        return False


@cache
def cineon() -> Curve:
    """Make the curve of printing density: white at code 685 is 1.0, code 1023 is 13.5."""
    import PyOpenColorIO as ocio

    black = 10 ** ((BLACK - WHITE) * DENSITY / NEGATIVE_GAMMA)
    slopes, offsets = [NEGATIVE_GAMMA / DENSITY / 1023] * 3, [WHITE / 1023] * 3
    curve = ocio.LogAffineTransform(logSideSlope=slopes, logSideOffset=offsets, linSideSlope=[1 - black] * 3, linSideOffset=[black] * 3)
    curve.setBase(10)
    return Curve(curve)


@cache
def rec709() -> Curve:
    """Make the curve of video cameras (ITU-R BT.709, 1.2)."""
    import PyOpenColorIO as ocio

    curve = ocio.ExponentWithLinearTransform(gamma=[1 / 0.45] * 3 + [1], offset=[0.099] * 3 + [0], negativeStyle=ocio.NEGATIVE_LINEAR)
    curve.setDirection(ocio.TRANSFORM_DIR_INVERSE)
    return Curve(curve)


def settle(spec: Any, format: str, path: str, head: bytes, colorspace: str | None) -> None:
    """Put into the spec what transfer the codes have: as `colorspace` says (one of SPACES), else the header; unsaid, 10 bits are log.
    Floats are linear.

    Raises AirlightError for another colorspace; warns of a header that does not say, or says linear as all of FFmpeg's do.
    """
    spec.attribute("oiio:Endian", "big" if head[:4] in (b"SDPX", b"\x80\x2a\x5f\xd7") else "little")
    spec.erase_attribute("oiio:ColorSpace")
    transfer = spec.get_string_attribute("dpx:Transfer", "Undefined") if format == "dpx" else _LOG[0]
    hint = "; --colorspace cineon, rec709 or linear says otherwise"
    if colorspace is not None:
        if colorspace.lower() not in SPACES:
            raise AirlightError(f"{path}: the codes of a DPX can be cineon, rec709 or linear, not {colorspace!r}")
        transfer = SPACES[colorspace.lower()]
    elif transfer in _LINEAR and str(spec.format) != "float" and spec.get_string_attribute("Software").startswith("Lavc"):
        warn(f"{path}: says linear, as whatever FFmpeg writes does; taken as Rec. 709{hint}", 5)
        transfer = SPACES["rec709"]
    elif str(spec.format) == "float":
        transfer = SPACES["linear"]
    elif transfer not in (*_LOG, *_LINEAR, *_VIDEO):
        is_log = spec.get_int_attribute("oiio:BitsPerSample") == 10
        kind = "10-bit film codes (cineon)" if is_log else "Rec. 709"
        warn(f"{path}: its header does not say what its codes are; taken as {kind}{hint}", 5)
        transfer = SPACES["cineon" if is_log else "rec709"]
    spec.attribute(_SETTLED, transfer)
    if colorspace is not None:
        spec.attribute("dpx:Transfer", transfer)
    if transfer in _LINEAR:
        spec.attribute("oiio:ColorSpace", "lin_rec709_scene")


def curve_of(spec: Any) -> Curve | None:
    """Choose the curve of a spec that is settled; None where its codes are linear."""
    return _curve(spec.get_string_attribute(_SETTLED))


def _curve(transfer: str) -> Curve | None:
    return cineon() if transfer in _LOG else None if transfer in _LINEAR else rec709()


def is_log_output(path: str, like: Any) -> bool:
    """Tell whether codes of a DPX hold more light than white: those of an input with such codes, or of one with floats."""
    if os.path.splitext(path)[1].lower() != ".dpx" or like is None:
        return False
    return like.codes.dtype.kind == "f" or (like.format in FORMATS and like.spec.get_string_attribute(_SETTLED) in _LOG)


def output_transfer(like: Any) -> str:
    """Choose the transfer of an output: the input's where that is a DPX or Cineon; else log for floats, and Rec. 709."""
    if like is not None and like.codes.dtype.kind == "f":
        return SPACES["cineon"]
    return str(like.spec.get_string_attribute(_SETTLED)) if like is not None and like.format in FORMATS else SPACES["rec709"]


def output_bits(like: Any) -> int:
    """Choose the bits of a code: those of an input that is DPX or Cineon, 8 to 16, else 10."""
    bits = int(like.spec.get_int_attribute("oiio:BitsPerSample", 10)) if like is not None and like.format in FORMATS else 10
    return bits if bits in (8, 10, 12, 16) else 16


def rounded(codes: np.ndarray, bits: int) -> np.ndarray:
    """Round 16-bit codes to so many bits, spread over 16 as OpenImageIO spreads them: what a file gives back."""
    if bits in (8, 16):
        return codes
    few = np.rint(codes * np.float32(((1 << bits) - 1) / 65535)).astype(np.uint16)
    return (few << (16 - bits)) | (few >> (2 * bits - 16))


def output_curve(like: Any) -> tuple[Curve | None, bool]:
    """Choose the curve of an output, and tell whether its codes are linear."""
    transfer = output_transfer(like)
    return _curve(transfer), transfer in _LINEAR


def describe(spec: Any, like: Any, bits: int | None) -> None:
    """Put into the spec of an output what its codes are. bits: of a code, None those of `output_bits`."""
    spec.erase_attribute("oiio:ColorSpace")  # it would choose the transfer
    own = like is not None and like.format == "dpx" and like.codes.dtype.kind == "u"
    for name in ("dpx:Transfer", "dpx:Colorimetric"):
        spec.attribute(name, (like.spec.get_string_attribute(name) if own else "") or output_transfer(like))
    spec.attribute("oiio:BitsPerSample", bits or output_bits(like))
    if (bits or output_bits(like)) == 10 and spec.width * spec.nchannels % 3:  # else OpenImageIO garbles the last pixels of rows
        spec.attribute("dpx:Packing", "Packed")
    spec.attribute("oiio:Endian", like.spec.get_string_attribute("oiio:Endian") if like is not None and like.format in FORMATS else "big")


def put_name(path: str, name: str) -> None:
    """Name the output in the header of a DPX, where OpenImageIO has put where it was encoded; standard output has none.

    Source: SMPTE 268M, 100 bytes from 36.
    """
    name = "" if standard.is_output(name) else name
    with open(path, "r+b") as file:
        file.seek(36)
        file.write(os.path.basename(name).encode(errors="replace")[:99].ljust(100, b"\0"))


def mend_row_ends(path: str, pixels: np.ndarray, spec: Any) -> None:
    """Read the last code of rows of R G B A of 10 bits anew, in place: where it has a word of its own OpenImageIO 3.2 gives another.

    pixels: (H, W, C) uint16 of the first picture. Source: SMPTE 268M, three codes in 32 bits, the first highest.
    """
    packing = spec.get_string_attribute("dpx:Packing")
    if spec.nchannels != 4 or spec.get_int_attribute("oiio:BitsPerSample") != 10 or spec.width % 3 != 1 or packing[:6] != "Filled":
        return
    words = -(-spec.width * 4 // 3)
    with open(path, "rb") as file:
        order = ">" if file.read(4) == b"SDPX" else "<"
        start = int(np.frombuffer(file.read(4), f"{order}u4")[0])
        file.seek(start)
        data = np.frombuffer(file.read(4 * words * spec.height), f"{order}u4")
    if data.size == words * spec.height and not spec.get_int_attribute("dpx:EndOfLinePadding"):
        few = (data.reshape(spec.height, words)[:, -1] >> (22 if packing.endswith("A") else 20)) & 1023
        pixels[:, -1, 3] = (few << 6) | (few >> 4)
