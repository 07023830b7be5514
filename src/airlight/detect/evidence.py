"""Lights within the frame: bright parts that the rest of the picture fades away from, discs in clear air, glows at a skyline."""

import numpy as np

from airlight.detect.candidate import Candidate
from airlight.detect.parts import Part, bright_parts
from airlight.detect.signals import Signals
from airlight.planes import blur, box, label, smoothstep

DISC_RADIUS = 0.09  # of the long side
LARGEST_DISC_RADIUS = 0.14  # of one in clear air
GLOW_CONFIDENCE = 0.75  # at most, of a light that is not seen itself
GLOWS = 4
GAP = 0.02  # of the long side: half of what may cross a disc
OUTSHINES = (15.0, 40.0)  # times the 99th percentile of all else
AIR = (0.0003, 0.001)  # of a light: what lies round it is no black background


def sources(signals: Signals) -> list[Candidate]:
    """Rate bright parts as suns, openings and glares: a light lights what lies round it, a lit thing does not."""
    found = []
    for part in bright_parts(signals):
        fade = signals.falloff(part.centroid, part.hidden)
        lit = _lighting(part, fade)
        confidence = lit + (0.95 - lit) * _crispness(part)
        confidence *= (1 - part.plainness) * float(smoothstep(part.share, 0.4, 0.3))
        if confidence < 0.02:
            continue
        if part.is_opening:
            kind, position = "opening", part.centroid
        elif part.touch < 0.12 and part.radius < DISC_RADIUS * signals.long_side:
            kind, position = "disc", part.centroid
        else:
            kind, position = "glow", _brightest_middle(part)
        found.append(Candidate(position, kind, float(confidence)))
    return found


def _lighting(part: Part, fade: float) -> float:
    """Judge by how the picture fades away from a part whether that part lights it."""
    signals = part.signals
    score = float(smoothstep(fade, 0.28, 0.48) * smoothstep(part.brightness / max(part.typical, 1e-4), 1.6, 2.8))
    score *= float(smoothstep(part.company, 0.2, 0.55)) * (0.7 + 0.2 * max(fade, 0.0))
    if score < 0.02:
        return 0.0
    # not as a lens's vignette does, which is flat near the middle
    score *= float(smoothstep(fade - signals.falloff(part.centroid, part.hidden, logarithmic=False), -0.03, 0.04))
    # something must be there to be lit
    shown = (signals.field**3 > 0.005 * min(1.0, part.brightness)) & (part.hidden < 0.5)
    score *= float(smoothstep(shown.sum() / max(1, (part.hidden < 0.5).sum()), 0.04, 0.12))
    if part.is_opening:
        return score * float(smoothstep(part.spill() - 1, 0.06, 0.25))
    return score * float(smoothstep(part.evenness(0.95, 0.85), 0.44, 0.62))


def _crispness(part: Part) -> float:
    """Judge a part as a disc in clear air: round, even, alone, its surroundings smooth, and neither black nor as bright."""
    radius = part.radius
    if part.touch > 0.4 or radius > LARGEST_DISC_RADIUS * part.signals.long_side or part.company < 0.15:
        return 0.0
    round_ = part.roundness()
    near = part.ring(max(2.0, 0.3 * radius), max(4.0, 0.9 * radius)) if round_ > 0 else part.mask[:0]
    if near.sum() < 8:
        return 0.0
    inside, around = part.signal[part.mask], part.signal[near]
    peak, level = float(np.median(inside)), float(np.median(around))
    if not 0 < level < peak:
        return 0.0
    even = smoothstep(float(np.percentile(inside, 20)) / peak, 0.7, 0.9)
    step = smoothstep(level / peak, 0.75, 0.5)
    surroundings = part.luminance[near]
    middle = float(np.median(surroundings))
    unevenness = float(np.percentile(surroundings, 80) - np.percentile(surroundings, 20)) / max(middle, 1e-12)
    smooth = smoothstep(unevenness, 0.6, 0.25)
    # a black surrounding shows no air, and no light in it; but a sky far below a float picture's sun is finely graded, black is not
    air = smoothstep(middle / float(np.median(part.luminance[part.mask])), 0.0008, 0.002)
    if air < 1 and unevenness > 1e-4:
        grain = float(np.median(np.abs(part.luminance - box(part.luminance, 2))[near])) / max(middle, 1e-12)
        air = max(air, smoothstep(grain, 0.04, 0.01))
    return float(round_ * even * smooth * air * step * smoothstep(part.company, 0.15, 0.4))


def outshining(signals: Signals) -> list[Candidate]:
    """Find the round thing of an unclipped picture that outshines all else many times: a sun or lamp, whole or crossed by posts."""
    value, radius = signals.value, max(1, round(GAP * signals.long_side))
    bright = value > 0.5 * float(value.max())
    grown = box(np.pad(bright, 2 * radius).astype(np.float32), radius) > 1e-6
    closed = ~(box((~grown).astype(np.float32), radius) > 1e-6)[2 * radius : -2 * radius, 2 * radius : -2 * radius]
    marks, count = label(closed)
    if not count:
        return []
    areas = np.bincount(marks[bright], minlength=count + 1)
    mask = marks == int(np.argmax(areas[1:])) + 1
    company = float(areas[1:].max() / max(bright.sum(), 1))
    part = Part.of(signals, mask, value, float(np.median(value)), 0.5, company)
    if part.touch > 0.12 or part.radius > LARGEST_DISC_RADIUS * signals.long_side or part.radius < 2 or company < 0.8:
        return []
    inside = value[mask & bright]
    rest = signals.luminance[~(box(mask.astype(np.float32), max(2, round(0.35 * part.radius))) > 1e-6)]
    if not rest.size:
        return []
    peak, around = float(np.median(inside)), float(np.percentile(rest, 99))
    score = part.roundness() * smoothstep(float(np.percentile(inside, 20)) / peak, 0.6, 0.85)
    score *= smoothstep(inside.size / np.count_nonzero(mask), 0.45, 0.6) * smoothstep(peak / max(around, 1e-12), *OUTSHINES)
    score *= smoothstep(float(np.median(rest)) / peak, *AIR)
    return [Candidate(part.centroid, "disc", float(0.9 * score))]


def _brightest_middle(part: Part) -> tuple[float, float]:
    """Shift a window over a part to where most of it, at its brightest, lies: a sun within a wide glare."""
    height, width = part.signals.shape
    x, y = part.pixels
    weight = np.minimum(part.signal[part.mask] / part.level, 1.2) ** 4
    at = np.array([part.centroid[0] * width, part.centroid[1] * height]) - 0.5
    reach = 0.06 * part.signals.long_side
    for _ in range(30):
        near = weight * np.exp(-0.5 * ((x - at[0]) ** 2 + (y - at[1]) ** 2) / reach**2)
        if near.sum() <= 0:
            break
        moved = np.array([(x * near).sum(), (y * near).sum()]) / near.sum()
        step, at = float(np.abs(moved - at).max()), moved
        if step < 0.05:
            break
    return float((at[0] + 0.5) / width), float((at[1] + 0.5) / height)


def skyline_glows(signals: Signals) -> list[Candidate]:
    """Find a low sun behind clouds or hills: where the picture is both bright and red, right above a wide dark ground."""
    spread = float(smoothstep(signals.redness_spread, 0.08, 0.16))
    if spread <= 0:
        return []
    warmth = signals.warmth / max(float(np.percentile(signals.warmth, 99.95)), 1e-6)
    height, width = signals.shape
    far = blur(warmth, 0.1 * signals.long_side)
    left = warmth.copy()
    rows, columns = np.indices(left.shape)
    found = []
    for _ in range(GLOWS):
        y, x = (int(i) for i in np.unravel_index(int(np.argmax(left)), left.shape))
        peak = float(warmth[y, x])
        if peak < 0.5:
            break
        left[np.hypot(rows - y, columns - x) < 0.06 * width] = 0
        inner = slice(max(0, x - round(0.2 * width)), x + round(0.2 * width) + 1)
        below = warmth[y + round(0.03 * width) : y + round(0.18 * width), inner]
        above = warmth[max(0, y - round(0.12 * width)) : max(0, y - round(0.01 * width)), inner]
        if below.size < 20 or above.size < 20:
            continue
        split = float(np.median(signals.value[:y]) / max(float(np.median(signals.value[y + 1 :])), 1e-6))
        score = smoothstep(split, 2.5, 5)  # sky above, ground below
        score *= smoothstep(float((below < 0.12 * peak).mean()), 0.65, 0.9)
        score *= smoothstep(float(np.median(above) / max(np.median(below), 1e-3)), 1.5, 3)
        score *= smoothstep(peak / max(float(far[y, x]), 1e-3), 1.5, 3) * smoothstep(peak, 0.55, 0.85)
        found.append(Candidate(((x + 0.5) / width, (y + 0.5) / height), "glow", float(GLOW_CONFIDENCE * score * spread)))
    return found
