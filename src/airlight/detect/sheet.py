"""Draw the candidates into a picture: numbered rings, each with its kind and confidence."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from airlight.colour import encode_codes
from airlight.detect.candidate import Candidate
from airlight.detect.ranking import ACT, ASK
from airlight.errors import MachineError
from airlight.planes import Array, shrink

Codes = npt.NDArray[np.uint8]
SIDE_PX = 1600
RING = 0.022  # radius, of the long side
LINE = 0.0022  # half the width of a line
TEXT = 0.019  # height
PAPER = 0.25  # of the picture that shows through below a text
DARK = np.array([16, 16, 16], np.float32)
SURE, ASKED, UNLIKELY = (255, 214, 64), (255, 255, 255), (176, 184, 192)  # by confidence: acted on, asked about, neither


def draw_candidates(image: Array, candidates: Sequence[Candidate]) -> Codes:
    """Draw (H, W, 3) linear as (h, w, 3) sRGB codes of at most 1600 px with a numbered ring round each candidate.

    One beyond the frame stands at the border, with an arrow towards it. The lamps of a candidate are small rings.
    """
    import OpenImageIO as oiio

    codes = encode_codes(shrink(image, SIDE_PX), np.uint8, dither=False).astype(np.float32)
    height, width = codes.shape[:2]
    long_side, frame = max(height, width), np.array([width, height], np.float64)
    ring, line, size = RING * long_side, max(1.0, LINE * long_side), max(12, round(TEXT * long_side))
    y, x = np.indices((height, width)) + 0.5
    texts = []
    taken: list[tuple[float, float, float, float]] = []
    for one in reversed(candidates):  # the best on top
        real = np.array(one.position) * frame
        at = np.clip(real, ring + 2 * line, np.maximum(frame - ring - 2 * line, ring))
        shape = np.abs(np.hypot(x - at[0], y - at[1]) - ring)
        for lamp in one.lamps:
            shape = np.minimum(shape, np.abs(np.hypot(x - lamp[0] * width, y - lamp[1] * height) - 0.35 * ring))
        inside = 0 <= one.position[0] <= 1 and 0 <= one.position[1] <= 1
        if inside:
            shape = np.minimum(shape, np.hypot(x - real[0], y - real[1]) - line)
        else:
            shape = np.minimum(shape, _arrow(x, y, at, real, ring))
        _stroke(codes, shape, line, np.array(_ink(one), np.float32))
    for number, one in enumerate(candidates, 1):
        text = f"{number}  {one.kind}{' (a guess)' if one.guess else ''}  {one.confidence:.2f}"
        roi = oiio.ImageBufAlgo.text_size(text, size)
        wide = int(roi.xend - roi.xbegin) if roi.defined else 0
        real = np.array(one.position) * frame
        at = np.clip(real, ring, np.maximum(frame - ring, ring))
        box = _free_box(at, ring, (wide + size, 1.7 * size), (width, height), taken)
        taken.append(box)
        left, top, right, bottom = (round(v) for v in box)
        under = codes[max(0, top) : bottom, max(0, left) : right]
        under[:] = PAPER * under + (1 - PAPER) * DARK
        texts.append((left + size // 2, top + round(1.25 * size), text, tuple(c / 255 for c in _ink(one))))
    sheet = oiio.ImageBuf(np.ascontiguousarray(np.clip(np.rint(codes), 0, 255).astype(np.uint8)))
    for left, base, text, ink in texts:
        if not oiio.ImageBufAlgo.render_text(sheet, left, base, text, size, "", ink):
            reason = " ".join(sheet.geterror().split())
            raise MachineError(f"this OpenImageIO cannot draw text ({reason})")
    return np.asarray(sheet.get_pixels(oiio.UINT8))


def _ink(one: Candidate) -> tuple[int, int, int]:
    return SURE if one.confidence >= ACT else ASKED if one.confidence >= ASK else UNLIKELY


def _stroke(codes: Array, distance: Array, half_width: float, color: Array) -> None:
    """Draw, in place, what lies within half_width px of a shape, dark to both sides so that it shows on any picture."""
    for reach, ink in ((2.2 * half_width, DARK), (half_width, color)):
        cover = np.clip(reach - distance + 0.5, 0, 1)[..., None]
        codes[:] = codes * (1 - cover) + ink * cover


def _arrow(x: Array, y: Array, at: Array, towards: Array, ring: float) -> Array:
    """Measure the distances, px, to an arrow within a ring that points from its middle towards a position."""
    direction = (towards - at) / max(float(np.hypot(*(towards - at))), 1e-6)
    along, across = (x - at[0]) * direction[0] + (y - at[1]) * direction[1], np.abs((y - at[1]) * direction[0] - (x - at[0]) * direction[1])
    tip = 0.8 * ring
    shaft = np.hypot(along - np.clip(along, -0.6 * ring, tip), across)
    back = np.clip((tip - along + across) / 2, 0, 0.5 * ring)  # along a barb, which leaves the tip at 45 degrees
    return np.minimum(shaft, np.hypot(along - tip + back, across - back))


def _free_box(
    at: Array, ring: float, size: tuple[float, float], frame: tuple[int, int], taken: Sequence[tuple[float, float, float, float]]
) -> tuple[float, float, float, float]:
    """Choose a place for a text beside a ring: within the frame, on no other text."""
    wide, high = size
    offsets = [(1.4 * ring, -high / 2), (-1.4 * ring - wide, -high / 2), (-wide / 2, 1.4 * ring), (-wide / 2, -1.4 * ring - high)]
    offsets += [(dx, dy + k * high) for k in (1.2, -1.2, 2.4, -2.4) for dx, dy in offsets[:2]]
    fallback = None
    for dx, dy in offsets:
        left = float(np.clip(at[0] + dx, 0, max(0.0, frame[0] - wide)))
        top = float(np.clip(at[1] + dy, 0, max(0.0, frame[1] - high)))
        box = (left, top, left + wide, top + high)
        clear = all(left >= r or left + wide <= a or top >= b or top + high <= t for a, t, r, b in taken)
        off_ring = not (left < at[0] + ring and left + wide > at[0] - ring and top < at[1] + ring and top + high > at[1] - ring)
        if clear and off_ring:
            return box
        if clear or fallback is None:
            fallback = box
    assert fallback is not None
    return fallback
