"""Finds the sky of a photograph: what is smooth and reaches the picture's top, with an edge as fine as the picture's."""

import numpy as np

from airlight.luminance import REC709_F32
from airlight.planes import blur, box, label, shrink

SMALLEST = 8  # px of the copy: in less nothing is told apart
SIDE = 640  # px of the copy on which it is looked for
FLAT = 0.06  # change of the logarithm of luminance over a pixel of that, up to which it is smooth
DARK = 0.02  # linear: what is darker differs by noise
LEAST = 0.01  # of the picture, of a part that is taken for sky
BRIGHTER = 0.9  # of the sky's mean to what is below it, at least; snow may be as bright
ASIDE = 40  # px of the copy to each side, whose skyline counts where there is none
REACH = 9  # px of the copy around an edge, over which sky and land are averaged
Plane = np.ndarray


def find_sky(image: Plane) -> Plane:
    """Find the sky in an image (H, W, 3), linear: (H, W) float32, the share of each pixel that is sky; 0 where there is none."""
    height, width = image.shape[:2]
    small = np.log(np.maximum(shrink(image, SIDE) @ REC709_F32, 0) + DARK)
    if min(small.shape) < SMALLEST:
        return np.zeros((height, width), np.float32)
    smooth = blur(small, 1.0)
    across, down = np.gradient(smooth, axis=1), np.gradient(smooth, axis=0)
    marks, count = label(np.hypot(across, down) < FLAT)
    sizes = np.bincount(marks.ravel(), minlength=count + 1)
    top = [one for one in np.unique(marks[0]) if one and sizes[one] >= LEAST * marks.size]
    sky = np.isin(marks, top)
    if not sky.any() or (not sky.all() and small[sky].mean() < np.log(BRIGHTER) + small[~sky].mean()):
        return np.zeros((height, width), np.float32)
    holes, count = label(~sky)  # clouds, the sun: islands that do not reach the picture's sides or bottom
    border = np.unique(np.concatenate([holes[-1], holes[:, 0], holes[:, -1]]))
    island = (holes > 0) & ~np.isin(holes, border)
    sky |= island & (small >= small[sky].mean() - 1)
    ends = np.where(sky.all(axis=0), len(sky), np.argmin(sky, axis=0))  # of each column's sky: what lies below something is none
    beside = np.lib.stride_tricks.sliding_window_view(np.pad(ends, ASIDE, mode="edge"), 2 * ASIDE + 1)
    sky = np.arange(len(sky))[:, None] < np.minimum(ends, np.median(beside, axis=1))  # where an edge has a gap, it is as beside it
    return _fine(image, small, sky)


def _fine(image: Plane, small: Plane, sky: Plane) -> Plane:
    """Refine a mask of the copy: near its edge a pixel's share is where its luminance lies between those of sky and land beside it."""
    height, width = image.shape[:2]
    inside, outside = _core(sky), _core(~sky)
    share = [np.clip(box(one.astype(float), REACH), 1e-6, None) for one in (inside, outside)]
    means = [box(small * one, REACH) / each for one, each in zip((inside, outside), share)]
    known = (share[0] > 1e-3) & (share[1] > 1e-3) & (means[0] - means[1] > 0.2)
    own = np.log(np.maximum(image @ REC709_F32, 0) + DARK)
    light, dark, near, coarse = (_enlarged(one.astype(np.float32), height, width) for one in (*means, known & ~inside & ~outside, sky))
    between = np.clip((own - dark) / np.maximum(light - dark, 0.2) * 1.25 - 0.125, 0, 1)
    return np.asarray(coarse + near * (between - coarse), np.float32)


def _core(mask: Plane) -> Plane:
    """Leave out what is within some pixels of a mask's edge."""
    return box(mask.astype(float), 3) > 0.999


def _enlarged(plane: Plane, height: int, width: int) -> Plane:
    """Enlarge a plane, evenly between its pixels."""
    for axis, size in ((0, height), (1, width)):
        at = np.clip((np.arange(size) + 0.5) * plane.shape[axis] / size - 0.5, 0, plane.shape[axis] - 1)
        low = np.minimum(at.astype(int), plane.shape[axis] - 1)
        high = np.minimum(low + 1, plane.shape[axis] - 1)
        part = (at - low).astype(np.float32)
        part = part[:, None] if axis == 0 else part
        plane = np.take(plane, low, axis=axis) * (1 - part) + np.take(plane, high, axis=axis) * part
    return plane
