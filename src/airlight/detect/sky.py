"""Finds the sky of a photograph: what is smooth and reaches the picture's top, down to a skyline, with an edge as fine as the picture's."""

import numpy as np

from airlight.detect.sky_edge import mixture
from airlight.luminance import REC709_F32
from airlight.planes import blur, box, label, shrink

SMALLEST = 8  # px of the copy: in less nothing is told apart
SIDE = 640  # px of the copy on which it is looked for
FLAT = 0.06  # change of the logarithm of luminance over a pixel of that, up to which it is smooth
DARK = 0.02  # linear: what is darker differs by noise
LEAST = 0.01  # of the picture, of a part that is taken for sky
BRIGHTER = 0.9  # of the sky's mean to what is below it, at least; snow may be as bright
ASIDE = 40  # px of the copy to each side, whose skyline counts where there is none
WHITE = 0.95  # linear: as bright pixels tell no colour
MOST_GLARE = 0.05  # of the picture, that is white since the sun dazzles; more is a sky
GLARE = 0.5  # of the radius of what is white: how far beyond it hides what it lies on
STEEP = 0.2  # rise of a skyline, on average over a gap, up to which it is none of a wall
BINS, RANGE = (24, 14, 14), ((-4.0, 0.2), (-1.6, 1.6), (-2.4, 1.6))  # of luminance, red to green, blue to green; natural logarithms
FLOOR = 1e-3  # of a bin's share, as if any colour may be anywhere
MOST_SURE = 3.0  # natural logarithm of odds, by one pixel
BEND = 3.0  # what a skyline costs that falls or rises a pixel, in such
STEP = 12.0  # what it gains by a step of colour, of 1 in logarithms
STEP_PX = 1, 5  # of the copy: half the ways over which steps are measured
BELOW = 0.05  # of the picture's height: how far below a skyline that is not sure land is looked at
LOOKS = 4  # at the colours of sky and land, from the last skyline
EDGE_PX, WIDEST_PX = 2, 16  # of the copy: half the width of an edge, at least and at most
INNER = 0.5  # of an edge's width: where colours alone tell its shares; farther out these go evenly to what is sure
FALL = 0.2  # of an edge's steepest slope, up to which it goes on
EVEN = 20  # columns to each side, over which the width of an edge is alike
Plane = np.ndarray


def find_sky(image: Plane) -> Plane:
    """Find the sky in an image (H, W, 3), linear: (H, W) float32, the share of each pixel that is sky; 0 where there is none."""
    height, width = image.shape[:2]
    copy = np.maximum(shrink(image, SIDE), 0)
    small = np.log(copy @ REC709_F32 + DARK)
    if min(small.shape) < SMALLEST:
        return np.zeros((height, width), np.float32)
    sky = _smooth_part(small)
    if sky is None:
        return np.zeros((height, width), np.float32)
    rows = np.count_nonzero(sky, axis=0)
    hidden = np.zeros(len(rows), bool)
    if not sky.all():
        rows, hidden = _skyline(copy, small, rows)
    above, below = (np.where(hidden, EDGE_PX, one) for one in _edge_widths(small, rows))
    y = np.arange(len(small))[:, None]
    planes = y < rows - above, y >= rows + below, y < rows
    sky, land, otherwise = (_enlarged(one.astype(np.float32), height, width) for one in planes)
    share = mixture(image, sky > 0.999, land > 0.999, otherwise)
    ends = (rows - above * INNER - y) / (above * (1 - INNER)), (y + 1 - rows - below * INNER) / (below * (1 - INNER))
    least, most = (_enlarged(np.clip(one, 0, 1).astype(np.float32), height, width) for one in ends)
    return np.asarray(np.clip(share, least, 1 - most), np.float32)


def _smooth_part(small: Plane) -> Plane | None:
    """Find what is smooth down from the top, of a copy's logarithms of luminance: (H, W) bool, in each column down to a row; or None."""
    smooth = blur(small, 1.0)
    across, down = np.gradient(smooth, axis=1), np.gradient(smooth, axis=0)
    marks, count = label(np.hypot(across, down) < FLAT)
    sizes = np.bincount(marks.ravel(), minlength=count + 1)
    top = [one for one in np.unique(marks[0]) if one and sizes[one] >= LEAST * marks.size]
    sky = np.isin(marks, top)
    if not sky.any() or (not sky.all() and small[sky].mean() < np.log(BRIGHTER) + small[~sky].mean()):
        return None
    holes, _ = label(~sky)  # clouds, the sun: islands that do not reach the picture's sides or bottom
    border = np.unique(np.concatenate([holes[-1], holes[:, 0], holes[:, -1]]))
    island = (holes > 0) & ~np.isin(holes, border)
    sky |= island & (small >= small[sky].mean() - 1)
    ends = np.where(sky.all(axis=0), len(sky), np.argmin(sky, axis=0))  # of each column's sky: what lies below something is none
    beside = np.lib.stride_tricks.sliding_window_view(np.pad(ends, ASIDE, mode="edge"), 2 * ASIDE + 1)
    found: Plane = np.arange(len(sky))[:, None] < np.minimum(ends, np.median(beside, axis=1))  # where an edge has a gap, as beside it
    return found if found.any() else None


def _skyline(copy: Plane, small: Plane, rows: Plane) -> tuple[Plane, Plane]:
    """Find the skyline, (W,) the first row of each column that is no sky, by what colours sky and land have, and where the sun dazzles
    it; rows: a first guess.

    Of all skylines the one with the least sum of: odds against the colours above and below it, steps that it lacks, and how far it rises
    and falls. There it goes straight on.
    """
    height, width = small.shape
    glare = _glare(copy @ REC709_F32)
    bins = _bins(copy, small)
    step = _steps(copy, small) * np.pad(~(glare[1:] | glare[:-1]), ((1, 1), (0, 0)))
    y = np.arange(height)[:, None]
    for _ in range(LOOKS):
        odds = np.where(glare, 0, _odds(bins, (y < 0.9 * rows) & ~glare, (y >= np.minimum(rows + BELOW * height, height - 1)) & ~glare))
        cost = np.zeros((height + 1, width))
        cost[1:] = -np.cumsum(odds, axis=0)
        found = _least(cost - STEP * step, BEND)
        if np.array_equal(found, rows):
            break
        rows = found
    lowest = np.where(glare.any(axis=0), height - np.argmax(glare[::-1], axis=0), -height)
    hidden = np.abs(rows - lowest) <= np.count_nonzero(glare, axis=0)
    return _straight_on(rows, hidden), hidden


def _steps(copy: Plane, small: Plane) -> Plane:
    """Measure how much colours change between two rows, (H + 1, W), 0 to 1: next to each other, and some px apart, as out of focus."""
    logs = np.log(copy + DARK)
    planes = np.stack([small, logs[..., 0] - logs[..., 1], logs[..., 2] - logs[..., 1]])
    out = np.zeros((small.shape[0] + 1, small.shape[1]))
    for reach in STEP_PX:
        wide = np.pad(planes, ((0, 0), (reach, reach), (0, 0)), mode="edge")
        apart = wide[:, 2 * reach - 1 :] - wide[:, : 1 - 2 * reach or None]
        out += np.minimum(np.sqrt((apart**2).sum(axis=0)), 1) / len(STEP_PX)
    out[[0, -1]] = 0
    return out


def _straight_on(rows: Plane, hidden: Plane) -> Plane:
    """Let a skyline (W,) dip below a straight line neither where it is hidden nor in half as many columns to each side, where it is drawn
    to the glare. Between walls of a street it may."""
    out, ends = rows.copy(), np.flatnonzero(np.diff(np.concatenate([[0], hidden, [0]]).astype(int)))
    for first, last in zip(ends[::2], ends[1::2]):
        more = (last - first) // 2 + 1
        first, last = max(first - more, 0), min(last + more, len(rows))
        known = [rows[one] for one in (first - 1, last) if 0 <= one < len(rows)]
        if not known:
            continue
        low, high = known[0], known[-1]
        wall = abs(low - high) > STEEP * (last - first)
        if not wall:
            line = np.linspace(low, high, last - first + 2)[1:-1].round()
            out[first:last] = np.minimum(rows[first:last], line)
    return out


def _glare(luminance: Plane) -> Plane:
    """Find what the sun dazzles, (H, W) bool: small white parts, and around them."""
    white = luminance >= WHITE
    out = np.zeros(white.shape, bool)
    marks, count = label(white)
    sizes = np.bincount(marks.ravel(), minlength=count + 1)
    for one in np.flatnonzero(sizes[1:] < MOST_GLARE * white.size) + 1:
        radius = GLARE * (sizes[one] / np.pi) ** 0.5
        if radius >= 1:
            out |= box((marks == one).astype(np.float32), round(radius)) > 1e-6
    return out


def _bins(copy: Plane, small: Plane) -> Plane:
    """Number the bin of each pixel's colour, (H, W)."""
    logs = np.log(copy + DARK)
    planes = small, logs[..., 0] - logs[..., 1], logs[..., 2] - logs[..., 1]
    found = np.zeros(small.shape, int)
    for plane, count, (low, high) in zip(planes, BINS, RANGE):
        found = found * count + np.clip((plane - low) / (high - low) * count, 0, count - 1).astype(int)
    return found


def _odds(bins: Plane, sky: Plane, land: Plane) -> Plane:
    """Estimate the logarithm of the odds that a pixel's colour is the sky's, (H, W), from pixels that are taken as such."""
    shares = []
    for which in (sky, land):
        counts = np.bincount(bins[which], minlength=int(np.prod(BINS))).reshape(BINS).astype(float)
        for axis in range(3):
            ends = [(1, 1) if one == axis else (0, 0) for one in range(3)]
            before, own, after = (np.take(np.pad(counts, ends), range(i, i + BINS[axis]), axis=axis) for i in range(3))
            counts = 0.25 * before + 0.5 * own + 0.25 * after
        shares.append(counts.ravel() / max(counts.sum(), 1) + FLOOR)
    return np.asarray(np.clip(np.log(shares[0] / shares[1]), -MOST_SURE, MOST_SURE)[bins])


def _least(cost: Plane, bend: float) -> Plane:
    """Choose a row of each column, (W,), with the least sum of their costs (H, W) and of bend for each row that neighbours are apart."""
    height, width = cost.shape
    y = np.arange(height)
    total = np.empty((width, height))
    total[0] = cost[:, 0]
    for x in range(1, width):
        down = np.minimum.accumulate(total[x - 1] - bend * y) + bend * y
        up = (np.minimum.accumulate((total[x - 1] + bend * y)[::-1]))[::-1] - bend * y
        total[x] = cost[:, x] + np.minimum(down, up)
    rows = np.empty(width, int)
    rows[-1] = np.argmin(total[-1])
    for x in range(width - 2, -1, -1):
        rows[x] = np.argmin(total[x] + bend * np.abs(y - rows[x + 1]))
    return rows


def _edge_widths(small: Plane, rows: Plane) -> tuple[Plane, Plane]:
    """Measure how far above and below the skyline its edge reaches, (W,) each in px of the copy: more where it is out of focus."""
    height, width = small.shape
    reach = np.arange(-WIDEST_PX, WIDEST_PX + 1)
    profile = small[np.clip(rows + reach[:, None], 0, height - 1), np.arange(width)]
    slope = np.abs(np.gradient(profile, axis=0))
    middle = slope[WIDEST_PX - 2 : WIDEST_PX + 3].max(axis=0)
    found = []
    for side in (slope[WIDEST_PX::-1], slope[WIDEST_PX:]):
        flat = side < FALL * middle
        flat[:2], flat[-1] = False, True
        ends = np.argmax(flat, axis=0)
        beside = np.lib.stride_tricks.sliding_window_view(np.pad(ends, EVEN, mode="edge"), 2 * EVEN + 1)
        wide = np.pad(np.maximum(np.quantile(beside, 0.75, axis=1), EDGE_PX), EVEN, mode="edge")
        found.append(np.convolve(wide, np.full(2 * EVEN + 1, 1 / (2 * EVEN + 1)), mode="valid"))
    return found[0], found[1]


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
