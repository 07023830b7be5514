"""Find which parts of a blended material are solid: exporters write BLEND for leaves, fences and decals, and even for what has no alpha.

Nothing of Airlight but casters and depth needs to know: what is solid is drawn so, and hides light; the rest is blended over it.
"""

from typing import Any

import numpy as np

OPAQUE = 0.95  # alpha from which a texel is solid; below 1 for what compression and filters leave of it
OUTLINE = 0.5  # alpha from which the soft edge of an outline is solid: as with glTF's MASK
CLEAR = 0.05  # alpha up to which a texel is not there
LOOKED_AT = 256  # texels of a texture's larger side that are looked at for outlines
EDGE = 1 / 32  # of the larger side: how far a soft edge reaches to both of its sides
EDGE_SHARE = 0.7  # of the intermediate alphas that lie in edges, from which a texture is a cut-out

Range = tuple[float, float]
SOLID: dict[str, Any] = {"alpha_mode": "solid"}
BLENDED: dict[str, Any] = {"alpha_mode": "blend", "depth_write": False}


def alpha_range(codes: np.ndarray | None, factor: float = 1.0, vertices: Range = (1.0, 1.0)) -> Range:
    """Bound a material's alpha, 0..1: that of its texture, (H, W) uint8, times a factor and the range of its vertices' alphas."""
    low, high = (1.0, 1.0) if codes is None else (int(codes.min()) / 255, int(codes.max()) / 255)
    return low * factor * vertices[0], high * factor * vertices[1]


def is_cut_out(codes: np.ndarray | None) -> bool:
    """Tell whether the alphas of a texture, (H, W) uint8, that lie between clear and opaque are the edges of outlines, or none.

    At a distance a texture's filter takes leaves down to such alphas, and they must not vanish from depth and shadow.
    """
    if codes is None:
        return False
    step = -(-max(codes.shape) // LOOKED_AT)
    codes = codes[::step, ::step]
    reach = max(3, round(EDGE * max(codes.shape)))
    between = (codes > CLEAR * 255) & (codes < OPAQUE * 255)
    edges = between & _near(codes >= OPAQUE * 255, reach) & _near(codes <= CLEAR * 255, reach)
    return int(edges.sum()) >= EDGE_SHARE * int(between.sum())


def _near(mask: np.ndarray, reach: int) -> np.ndarray:
    """Widen a mask (H, W) by so many texels; around its borders too, since textures repeat."""
    for axis in (0, 1):
        mask = np.logical_or.reduce([np.roll(mask, shift, axis) for shift in range(-reach, reach + 1)])
    return mask


def split(solid: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Choose pygfx's settings for what has at least the alpha `solid`, and for the rest: they share out the fragments."""
    return {**SOLID, "alpha_test": solid}, {**BLENDED, "alpha_test": solid, "alpha_compare": ">="}


def layers(alphas: Range, cut_out: bool) -> list[dict[str, Any]]:
    """Choose pygfx's settings for the draws that show a blended material: as solid, as blended, or one over the other.

    alphas: its range; cut_out: see `is_cut_out`. The outer half of an outline's edge is blended; the inner one is solid, since a medium
    would light what shines through it as if it were as near as the leaf.
    """
    low, high = alphas
    if low >= OPAQUE:
        return [SOLID]
    return [BLENDED] if high < OPAQUE else list(split(OUTLINE if cut_out else OPAQUE))


def bled(pixels: np.ndarray) -> np.ndarray:
    """Give clear texels of (H, W, 4) uint8 the colour of those nearby that are there, which filters would else mix with black or white."""
    clear = pixels[..., 3] == 0
    if not clear.any() or clear.all():
        return pixels
    out = pixels.copy()
    rows, columns = np.nonzero(clear)
    out[rows, columns, :3] = _filled(pixels)[rows // 2, columns // 2]
    return out


def _filled(pixels: np.ndarray) -> np.ndarray:
    """Halve (H, W, 4) to (h, w, 3) float32, by alpha; where that is 0, as what is nearest in the next half has it."""
    height, width = pixels.shape[:2]
    total = np.zeros(((height + 1) // 2, (width + 1) // 2, 4), np.float32)
    for y in range(2):
        for x in range(2):
            part = pixels[y::2, x::2].astype(np.float32)
            total[: part.shape[0], : part.shape[1], :3] += part[..., :3] * part[..., 3:]
            total[: part.shape[0], : part.shape[1], 3] += part[..., 3]
    alpha = total[..., 3]
    colour: np.ndarray = total[..., :3] / np.maximum(alpha, 1e-9)[..., None]
    if (alpha == 0).any():
        rows, columns = np.nonzero(alpha == 0)
        colour[rows, columns] = _filled(np.dstack([colour, alpha]))[rows // 2, columns // 2]
    return colour
