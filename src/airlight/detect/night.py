"""Lamps at night: several small lights in a dark picture that yet shows what they light."""

import numpy as np

from airlight.detect.candidate import Candidate
from airlight.detect.signals import Signals
from airlight.planes import Array, blur, label, smoothstep

MOST_CONFIDENCE = 0.75  # several lights are never as sure as one
MOST_LAMPS = 6
LAMP_SPACING = 0.05  # widths within which lamps are one
LAMP_BLUR = 0.02  # of the long side: a lamp is smaller
CLUSTER_BLUR = 0.03
CAP = 0.12  # of white: a lamp counts by being there, not by its power
DIM = 0.02  # of white: darker is black


def lamps(signals: Signals) -> list[Candidate]:
    """Find the densest place of several lamps, and the lamps."""
    white = float(np.percentile(signals.value, 99.95))
    plane = np.minimum((signals.luminance + signals.rgb.max(axis=2)) / (2 * max(white, 1e-6)), 1.5)
    around = blur(plane, LAMP_BLUR * signals.long_side)
    lit = plane > 0.5
    if not lit.any() or lit.all():
        return []
    count = label(signals.value > 0.5 * white)[1]
    standing_out = float(np.maximum(plane[lit] - around[lit], 0).mean() / plane[lit].mean())
    in_strip = float(np.maximum(plane - 0.3, 0)[: max(1, round(0.12 * plane.shape[0]))].sum() / np.maximum(plane - 0.3, 0).sum())
    texture = float(np.median(np.abs(plane - around)[~lit] / (around[~lit] + 1e-3)))
    score = (
        smoothstep(float(np.median(plane)), 0.25, 0.16)
        * smoothstep(standing_out, 0.42, 0.6)
        * smoothstep(count, 1.5, 3.5)
        * smoothstep(count, 100, 60)  # more is a texture
        * smoothstep(float(lit.mean()), 0.08, 0.05)
        * smoothstep(float((plane > DIM).mean()), 0.15, 0.35)  # a starry sky lights nothing
        * smoothstep(texture, 0.3, 0.18)  # leaves in the sun
        * smoothstep(in_strip, 0.55, 0.35)  # gaps under the sky
    )
    if score <= 0:
        return []
    single = _single_lamps(plane)
    density = _blur_in_black(np.clip(plane - around, 0, CAP), CLUSTER_BLUR * signals.long_side)
    score *= smoothstep(len(single), 1, 3)
    return [Candidate(_place(density), "lamps", float(MOST_CONFIDENCE * score), lamps=single)]


def _blur_in_black(plane: Array, sigma: float) -> Array:
    """Blur as if black lay beyond the frame: a repeated border would count a lamp at it twice."""
    margin = round(3 * sigma) + 1
    return blur(np.pad(plane, margin), sigma)[margin:-margin, margin:-margin]


def _place(plane: Array) -> tuple[float, float]:
    """Find the position of the largest value, normalised."""
    y, x = np.unravel_index(int(np.argmax(plane)), plane.shape)
    return (float((x + 0.5) / plane.shape[1]), float((y + 0.5) / plane.shape[0]))


def _single_lamps(plane: Array) -> tuple[tuple[float, float], ...]:
    """List the brightest lamps, each the middle of its surroundings, none nearer than LAMP_SPACING to another."""
    height, width = plane.shape
    power = _blur_in_black(plane, 0.008 * max(plane.shape))
    y, x = np.indices(plane.shape) + 0.5
    found: list[tuple[float, float]] = []
    most = float(power.max())
    for _ in range(MOST_LAMPS):
        at = _place(power)
        if float(power.max()) < 0.35 * most:
            break
        found.append(at)
        power[np.hypot(x - at[0] * width, y - at[1] * height) < LAMP_SPACING * width] = 0
    return tuple(found)
