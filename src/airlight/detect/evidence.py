"""Lights within the frame: bright parts whose surroundings fade away from them, discs in clear air, glows at a skyline."""

from dataclasses import dataclass

import numpy as np

from airlight.detect.ranking import Candidate
from airlight.detect.signals import Signals, smoothstep
from airlight.planes import Array, blur, box, label

DEBUG = False
LEVELS = (0.97, 0.9, 0.8, 0.7, 0.6, 0.5)  # of a signal's white; a part below .68 is only a parent
PARENT = 0.76  # of a part's level: at which it must not melt into a wide plain
PARTS_PER_LEVEL = 6
LEAST_RADIUS = 0.004  # of the long side
DISC_RADIUS = 0.09
OPENING_SHARE = 0.02
OPENING_TOUCH = 0.35
TORN = 0.85


@dataclass(frozen=True)
class Part:
    """A connected bright part. box: (top, left, bottom, right), px. touch: share of a circle's outline that lies on the frame."""

    mask: Array
    centroid: tuple[float, float]  # normalised
    share: float  # of the picture's area
    radius: float  # px, of the disc of its area
    touch: float
    level: float
    signal: Array
    company: float  # its share of what is as bright


def _levels(signal: Array) -> list[float]:
    """The levels to cut a signal at, highest first: shares of its white, and steps above it in a picture of high range."""
    white, peak = float(np.percentile(signal, 99.95)), float(signal.max())
    above = list(np.geomspace(0.7 * peak, 1.3 * white, 5)) if peak > 1.6 * white else []
    return [*above, *(white * level for level in LEVELS)]


def _describe(mask: Array, signal: Array, level: float, company: float) -> Part:
    height, width = mask.shape
    y, x = np.nonzero(mask)
    area = len(x)
    on_frame = (x == 0).sum() + (x == width - 1).sum() + (y == 0).sum() + (y == height - 1).sum()
    centroid = ((x.mean() + 0.5) / width, (y.mean() + 0.5) / height)
    radius = float(np.sqrt(area / np.pi))
    return Part(mask, centroid, area / mask.size, radius, float(on_frame / (2 * np.pi * radius)), level, signal, company)


def _is_opening(part: Part) -> bool:
    return part.share >= OPENING_SHARE and part.touch < OPENING_TOUCH and _is_sharp(part) and _evenness(part, 0.8, 0.55) > 0.55


def _is_sharp(part: Part) -> bool:
    """Tell whether a part ends at an edge rather than fading out."""
    edge = _ring(part.mask, max(2.0, 0.15 * part.radius), max(4.0, 0.4 * part.radius))
    return bool(edge.any() and np.median(part.signal[edge]) < 0.5 * part.signal[part.mask].mean())


def _parts(signals: Signals) -> list[Part]:
    """Cut the bright parts of both signals; those that melt into a wide plain at the frame are left out, as skies are."""
    parts = []
    for signal in (signals.whiteness, signals.value):
        if signal.max() <= 1e-6:
            continue
        cuts = []
        for level in _levels(signal):
            marks, count = label(signal > level)
            cuts.append((level, marks, np.bincount(marks.ravel(), minlength=count + 1)))
        last = cuts[-1][0] / LEVELS[-1] * 0.68
        openings: set[tuple[float, int]] = set()
        for k, (level, marks, areas) in enumerate(cuts):
            if level < last:
                break
            lower = next((c for c in cuts[k:] if c[0] <= PARENT * level), cuts[-1])
            for i in np.argsort(-areas[1:], kind="stable")[:PARTS_PER_LEVEL] + 1:
                if areas[i] < np.pi * (LEAST_RADIUS * signals.long_side) ** 2:
                    break
                mask = marks == i
                number = lower[1].ravel()[int(np.argmax(mask))]
                parent = _describe(lower[1] == number, signal, lower[0], lower[2][number] / lower[2][1:].sum())
                if _plainness(parent) == 1:
                    continue
                if _is_opening(parent) and areas[i] < TORN * lower[2][number]:  # of which shading or noise shows a piece
                    if (lower[0], number) in openings:
                        continue
                    openings.add((lower[0], number))
                    parts.append(parent)
                else:
                    parts.append(_describe(mask, signal, level, areas[i] / areas[1:].sum()))
    return parts


def _plainness(part: Part) -> float:
    """Tell a wide sky, cut by the frame, from a light: 0 a light, 1 a sky."""
    return float(smoothstep(part.touch, 0.35, 0.6) * smoothstep(part.share, 0.06, 0.09))


def _ring(mask: Array, inner: float, outer: float) -> Array:
    """The pixels between two distances, px, from a part."""
    grown = mask.astype(np.float32)
    return (box(grown, max(1, round(outer))) > 1e-6) & ~(box(grown, max(1, round(inner))) > 1e-6)


def _roundness(mask: Array, radius: float) -> float:
    """1 for a disc, less for a long or an angular part: by its axes and by the fourth moment of its whitened pixels."""
    y, x = np.nonzero(mask)
    spread = np.cov(np.stack([x, y])) + np.eye(2) / 12
    values, vectors = np.linalg.eigh(spread)
    white = (np.stack([x - x.mean(), y - y.mean()]).T @ vectors) / np.sqrt(values)
    squared = (white**2).sum(axis=1)
    fourth = float((squared**2).mean() / max(squared.mean() ** 2, 1e-9))  # 4/3 for a disc, 1.4 for a square
    slack = 0.12 / max(radius, 1.0)  # of whole pixels
    axes = float(np.sqrt(values[0] / values[1]))
    return float(smoothstep(abs(fourth - 4 / 3), 0.04 + slack, 0.012 + slack) * smoothstep(axes, 0.6, 0.85))


def _crispness(part: Part, signals: Signals) -> float:
    """Judge a part as a disc in clear air: round, even, alone, and its surroundings smooth, neither black nor as bright."""
    radius = part.radius
    if part.touch > 0.4 or radius > 0.14 * signals.long_side:
        return 0.0
    near = _ring(part.mask, max(2.0, 0.3 * radius), max(4.0, 0.9 * radius))
    if near.sum() < 8:
        return 0.0
    inside, around = part.signal[part.mask], part.signal[near]
    peak, level = float(np.median(inside)), float(np.median(around))
    if not 0 < level < peak:
        return 0.0
    even = smoothstep(float(np.percentile(inside, 20)) / peak, 0.7, 0.9)
    surroundings = signals.luminance[near]
    middle = float(np.median(surroundings))
    unevenness = float(np.percentile(surroundings, 80) - np.percentile(surroundings, 20)) / max(middle, 1e-12)
    smooth = smoothstep(unevenness, 0.6, 0.25)
    # a black surrounding shows no air, and no light in it; but a sky far below a float picture's sun is finely graded, black is not
    air = smoothstep(middle / float(np.median(signals.luminance[part.mask])), 0.0008, 0.002)
    grain = float(np.median(np.abs(signals.luminance - box(signals.luminance, 2))[near])) / max(middle, 1e-12)
    air = max(air, smoothstep(grain, 0.04, 0.01) if unevenness > 1e-4 else 0.0)
    step = smoothstep(level / peak, 0.75, 0.5)
    if DEBUG: print(f"     crisp {part.centroid[0]:.2f},{part.centroid[1]:.2f} R {radius:.1f} round {_roundness(part.mask, radius):.2f} even {even:.2f} smooth {smooth:.2f} air {air:.2f} step {step:.2f}")
    return float(_roundness(part.mask, radius) * even * smooth * air * step * smoothstep(part.company, 0.15, 0.4))


def _weighted_middle(part: Part, signals: Signals) -> tuple[float, float]:
    """Shift a window over a part to where most of it, at its brightest, lies: a sun behind a wide glare."""
    height, width = signals.shape
    y, x = np.indices(part.mask.shape) + 0.5
    weight = np.where(part.mask, np.minimum(part.signal / part.level, 1.2) ** 4, 0.0)
    at = np.array([part.centroid[0] * width, part.centroid[1] * height])
    window = 0.06 * signals.long_side
    for _ in range(30):
        near = weight * np.exp(-0.5 * ((x - at[0]) ** 2 + (y - at[1]) ** 2) / window**2)
        total = float(near.sum())
        if total <= 0:
            break
        moved = np.array([(x * near).sum(), (y * near).sum()]) / total
        step, at = float(np.abs(moved - at).max()), moved
        if step < 0.05:
            break
    return float(at[0] / width), float(at[1] / height)


def _evenness(part: Part, high: float, low: float) -> float:
    """The share of the part round this one, above `low` of its brightness, that lies above `high` of it."""
    top = float(np.percentile(part.signal[part.mask], 90))
    marks, _ = label(part.signal > low * top)
    wide = marks == marks.ravel()[int(np.argmax(np.where(part.mask, part.signal, -1)))]
    return float((part.signal[wide] > high * top).mean())


def _spill(part: Part, signals: Signals) -> float:
    """How much brighter, in perceptual steps, the surroundings are near a part than farther away."""
    near = _ring(part.mask, max(2.0, 0.1 * part.radius), max(4.0, 0.35 * part.radius))
    far = _ring(part.mask, max(5.0, 0.7 * part.radius), max(9.0, 1.2 * part.radius))
    if not near.any() or not far.any():
        return 1.0
    steps = np.cbrt(signals.luminance)
    return float(steps[near].mean() / max(float(steps[far].mean()), 1e-3))


def sources(signals: Signals) -> list[Candidate]:
    """Rate bright parts as suns, openings and glares, by how the rest of the picture fades away from them."""
    found = []
    for part in _parts(signals):
        hidden = box(part.mask.astype(np.float32), max(2, round(0.15 * part.radius))) > 1e-6
        fade = signals.falloff(part.centroid, hidden)
        inside = float(part.signal[part.mask].mean())
        contrast = smoothstep(inside / max(float(np.median(part.signal)), 1e-4), 1.6, 2.8)
        lit = float(smoothstep(fade, 0.28, 0.48) * contrast)
        crisp = _crispness(part, signals)
        opening = _is_opening(part)
        if opening:
            lit *= float(smoothstep(_spill(part, signals), 1.05, 1.25))
        else:
            lit *= float(smoothstep(_evenness(part, 0.95, 0.85), 0.42, 0.62))  # a light is clipped, or ends; a lit thing is shaded
        lit *= float(smoothstep(fade - signals.falloff(part.centroid, hidden, logarithmic=False), -0.03, 0.04))  # not a lens's vignette
        shown = signals.luminance[~hidden] > 0.005 * np.median(signals.luminance[part.mask])
        lit *= float(smoothstep(shown.mean() if shown.size else 0.0, 0.04, 0.12))
        lit *= float(smoothstep(part.company, 0.2, 0.55)) * (0.7 + 0.2 * max(fade, 0.0))
        confidence = lit + (0.95 - lit) * crisp
        confidence *= (1 - _plainness(part)) * float(smoothstep(part.share, 0.4, 0.3))
        if DEBUG and confidence > .02: print(f"  {'N' if part.signal is signals.whiteness else 'V'} {part.level:.2f} {part.centroid[0]:.2f},{part.centroid[1]:.2f} share {part.share:.4f} touch {part.touch:.2f} comp {part.company:.2f} fade {fade:.2f} contrast {contrast:.2f} lit {lit:.2f} crisp {crisp:.2f} conf {confidence:.2f}")
        if confidence < 0.02:
            continue
        if opening:
            kind, position = "opening", part.centroid
        elif part.touch < 0.12 and part.radius < DISC_RADIUS * signals.long_side:
            kind, position = "disc", part.centroid
        else:
            kind, position = "glow", _weighted_middle(part, signals)
        found.append(Candidate(position, kind, float(confidence)))
    return found


def skyline_glows(signals: Signals) -> list[Candidate]:
    """Find a low sun behind clouds or hills: where the picture is both bright and red, right above a wide dark ground."""
    if signals.redness_spread < 0.06:
        return []
    warmth = signals.warmth / max(float(np.percentile(signals.warmth, 99.95)), 1e-6)
    height, width = signals.shape
    far = blur(warmth, 0.1 * signals.long_side)
    spread = float(smoothstep(signals.redness_spread, 0.08, 0.16))
    left = warmth.copy()
    found = []
    for _ in range(4):
        y, x = np.unravel_index(int(np.argmax(left)), left.shape)
        peak = float(warmth[y, x])
        if peak < 0.5:
            break
        inner = slice(max(0, x - round(0.2 * width)), x + round(0.2 * width) + 1)
        below = warmth[y + round(0.03 * width) : y + round(0.18 * width), inner]
        above = warmth[max(0, y - round(0.12 * width)) : max(0, y - round(0.01 * width)), inner]
        if below.size > 20 and above.size > 20:
            split = float(np.median(signals.value[:y]) / max(float(np.median(signals.value[y + 1 :])), 1e-6)) if 0 < y < height - 1 else 0.0
            dark = float((below < 0.12 * peak).mean())
            over = float(np.median(above) / max(np.median(below), 1e-3))
            local = peak / max(float(far[y, x]), 1e-3)
            score = smoothstep(split, 2, 4) * smoothstep(dark, 0.6, 0.9) * smoothstep(over, 1.5, 3) * smoothstep(local, 1.5, 3) * smoothstep(peak, 0.55, 0.85)
            found.append(Candidate(((x + 0.5) / width, (y + 0.5) / height), "glow", float(0.75 * score * spread)))
        rows, columns = np.indices(left.shape)
        left[np.hypot(rows - y, columns - x) < 0.06 * width] = 0
    return found

