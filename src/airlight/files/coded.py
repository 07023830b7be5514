"""RGB encodings that numbers tell and no ICC profile: primaries and a transfer curve, converted by OpenColorIO."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, cached_property
from typing import Any

import numpy as np

from airlight.files import icc, spaces
from airlight.files.spaces import D65

DIFFUSE_WHITE = 203.0  # cd/m2, ITU-R BT.2408: the white of paper in PQ and HLG, which is 1 in linear light here
HLG_PEAK, HLG_GAMMA = 1000.0, 1.2  # cd/m2 of the reference display of ITU-R BT.2100, and its system gamma
REC709, REC2020, P3, ADOBE = spaces.CHROMATICITIES[:4]

# Chromaticities by colour primaries of ITU-T H.273, table 2.
PRIMARIES: dict[int, tuple[float, ...]] = {
    1: REC709,
    4: (0.67, 0.33, 0.21, 0.71, 0.14, 0.08, 0.31, 0.316),
    5: (0.64, 0.33, 0.29, 0.60, 0.15, 0.06, *D65),
    6: (0.63, 0.34, 0.31, 0.595, 0.155, 0.07, *D65),
    7: (0.63, 0.34, 0.31, 0.595, 0.155, 0.07, *D65),
    8: (0.681, 0.319, 0.243, 0.692, 0.145, 0.049, 0.31, 0.316),
    9: REC2020,
    10: (1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1 / 3, 1 / 3),
    11: (0.68, 0.32, 0.265, 0.69, 0.15, 0.06, 0.314, 0.351),
    12: P3,
    22: (0.63, 0.34, 0.295, 0.605, 0.155, 0.077, *D65),
}
# Curves and their exponents by transfer characteristics of ITU-T H.273, table 3; those of log and of other sensors are not among them.
TRANSFERS: dict[int, tuple[str, float]] = {
    **dict.fromkeys((1, 6, 11, 14, 15), ("bt709", 1.0)),
    4: ("gamma", 2.2),
    5: ("gamma", 2.8),
    8: ("linear", 1.0),
    13: ("srgb", 1.0),
    16: ("pq", 1.0),
    18: ("hlg", 1.0),
}


@dataclass(frozen=True)
class Coding:
    """Codes 0..1 of an RGB space: chromaticities (x, y of red, green, blue, white) and `curve`, a name of TRANSFERS, with `gamma`.

    narrow: bits of the codes where black and white are 16/255 and 235/255; 0: full range. cicp: H.273's numbers for it, if any.
    chunks: names and data of the PNG chunks that said so.
    """

    chromaticities: tuple[float, ...]
    curve: str
    gamma: float = 1.0
    narrow: int = 0
    cicp: tuple[int, int] | None = None
    chunks: tuple[tuple[bytes, bytes], ...] = ()

    @property
    def is_hdr(self) -> bool:
        """Tell whether codes reach beyond white."""
        return self.curve in ("pq", "hlg")

    @property
    def is_srgb(self) -> bool:
        """Tell whether it is simply sRGB."""
        return (self.curve, self.narrow) == ("srgb", 0) and self.to_709 is None

    @cached_property
    def peak(self) -> float:
        """Give the linear light of the largest codes: 1 but for HDR."""
        code = np.ones((1, 1, 3), np.float32)
        self.profile.decode(code)
        return float(code.max()) if self.is_hdr else 1.0

    def of_grey(self) -> "Coding":
        """Make the coding of a picture without colour, whose primaries say nothing: those of Rec. 709, should it get some."""
        cicp = None if self.cicp is None else (1, self.cicp[1])
        kept = tuple((kind, b"\1" + data[1:] if kind == b"cICP" else data) for kind, data in self.chunks if kind not in (b"cHRM", b"mDCV"))
        return replace(self, chromaticities=REC709, cicp=cicp, chunks=kept)

    @cached_property
    def to_709(self) -> np.ndarray | None:
        """Derive the matrix (3, 3) to linear Rec. 709; None where they are the same. Raises ValueError for impossible chromaticities."""
        return spaces.to_rec709(self.chromaticities)

    @cached_property
    def profile(self) -> "Curve":
        """Compile the curve."""
        return Curve(self)

    @cached_property
    def icc(self) -> bytes | None:
        """Make an ICC profile of it; None for HDR, narrow range, and primaries of Rec. 709, whose codes are simply made sRGB."""
        if self.is_hdr or self.narrow or self.to_709 is None:
            return None
        return icc.matrix_profile(spaces.to_xyz(self.chromaticities, icc.D50), self.curve, self.gamma)


def by_cicp(primaries: int, transfer: int, full: bool = True, bits: int = 8) -> Coding | None:
    """Look up a coding by code points of ITU-T H.273, 2 (unsaid) as sRGB's; None for those that are not known."""
    known, curve = PRIMARIES.get(1 if primaries == 2 else primaries), TRANSFERS.get(13 if transfer == 2 else transfer)
    if known is None or curve is None:
        return None
    return Coding(known, *curve, 0 if full else bits, (primaries, transfer))


class Curve:
    """Convert by a coding's curve: `decode` and `encode` work in place on contiguous (h, W, 3) float32, codes as 0..1, white as 1."""

    def __init__(self, coding: Coding):
        """Compile."""
        self.decode, self.encode = _processors(coding.curve, coding.gamma, coding.narrow)


@cache
def _processors(curve: str, gamma: float, narrow: int) -> tuple[Callable[[np.ndarray], None], Callable[[np.ndarray], None]]:
    import PyOpenColorIO as ocio

    steps = ocio.GroupTransform()
    if narrow:
        most, step = 2**narrow - 1, 2 ** (narrow - 8)
        steps.appendTransform(_scaled(most / (219 * step), -16 / 219))
    if curve == "srgb":
        steps.appendTransform(_exponent(2.4, 0.055))
    elif curve == "bt709":
        steps.appendTransform(_exponent(1 / 0.45, 0.099))
    elif curve == "gamma":
        steps.appendTransform(ocio.ExponentTransform([gamma] * 3 + [1.0], negativeStyle=ocio.NEGATIVE_MIRROR))
    elif curve == "pq":
        steps.appendTransform(ocio.BuiltinTransform("CURVE - ST-2084_to_LINEAR"))  # of 100 cd/m2
        steps.appendTransform(_scaled(100 / DIFFUSE_WHITE))
    elif curve == "hlg":
        steps.appendTransform(ocio.BuiltinTransform("CURVE - HLG-OETF-INVERSE"))  # whose most is 3
        steps.appendTransform(_scaled(1 / 3))
        steps.appendTransform(ocio.FixedFunctionTransform(ocio.FIXED_FUNCTION_REC2100_SURROUND, [HLG_GAMMA]))
        steps.appendTransform(_scaled(HLG_PEAK / DIFFUSE_WHITE))
    config = ocio.Config.CreateRaw()
    ways = (ocio.TRANSFORM_DIR_FORWARD, ocio.TRANSFORM_DIR_INVERSE)
    forward, back = (config.getProcessor(steps, way).getOptimizedCPUProcessor(ocio.OPTIMIZATION_LOSSLESS).applyRGB for way in ways)
    return forward, back


def _scaled(factor: float, offset: float = 0.0) -> Any:
    import PyOpenColorIO as ocio

    return ocio.MatrixTransform(matrix=np.diag([factor] * 3 + [1.0]).ravel().tolist(), offset=[offset] * 3 + [0.0])


def _exponent(gamma: float, offset: float) -> Any:
    import PyOpenColorIO as ocio

    return ocio.ExponentWithLinearTransform(gamma=[gamma] * 3 + [1.0], offset=[offset] * 3 + [0.0], negativeStyle=ocio.NEGATIVE_LINEAR)
