"""The candidates of a picture, gathered from every kind of evidence, merged and ranked."""

import dataclasses
from typing import Any

import numpy as np

from airlight.arrays import as_array
from airlight.detect import beyond, evidence, night
from airlight.detect.candidate import Candidate
from airlight.detect.signals import Signals, linear_copy

ACT = 0.45  # confidence from which a light is taken without asking
ASK = 0.22  # from here it is worth a question; below, there is none
LEAST_CONFIDENCE = 0.05
MOST_CANDIDATES = 8
SPACING_WIDTHS = 0.08  # widths between candidates
AGREEING_WIDTHS = 0.06  # widths within which another kind of evidence supports a candidate
SUPPORT = 0.5
SEEN_COUNTS = 0.6  # a light that is itself seen leaves a glow at a skyline this much less to explain


def find_lights(image: Any, bounded: bool = False) -> list[Candidate]:
    """Rank the places where the light of an image, as in airlight.light_shafts (floats are linear), may be, best first.

    At most 8, at least .08 widths apart, none where nothing speaks for a light. Scaling a float image changes nothing.
    bounded: its floats are decoded from the codes of a photograph, which end at white.
    """
    image = as_array(image)
    bounded = bounded or image.dtype.kind != "f"
    signals = Signals.of(linear_copy(image, bounded))
    if signals is None:
        return []
    seen = evidence.sources(signals) + ([] if bounded else evidence.outshining(signals))
    unseen = 1 - SEEN_COUNTS * max((one.confidence for one in seen), default=0.0)
    glows = [dataclasses.replace(one, confidence=one.confidence * unseen) for one in evidence.skyline_glows(signals)]
    found = [*seen, *glows, *night.lamps(signals), *beyond.lights(signals)]
    return _distinct(found, signals.aspect)


def find_light(image: Any) -> Candidate | None:
    """Find the most likely light of an image as in `find_lights`; None where none reaches ASK."""
    ranked = find_lights(image)
    return ranked[0] if ranked and ranked[0].confidence >= ASK else None


def _distance(a: Candidate, b: Candidate, aspect: float) -> float:
    return float(np.hypot(a.position[0] - b.position[0], (a.position[1] - b.position[1]) * aspect))


def _distinct(found: list[Candidate], aspect: float) -> list[Candidate]:
    """Sort candidates, raise those that another kind of evidence agrees with, and drop the lesser of two at one place."""
    raised = []
    for one in found:
        others = [o.confidence for o in found if o.kind != one.kind != "lamps" and _distance(one, o, aspect) < AGREEING_WIDTHS]
        support = max(others, default=0.0) * SUPPORT
        raised.append(dataclasses.replace(one, confidence=one.confidence + (1 - one.confidence) * support * one.confidence))
    ranked: list[Candidate] = []
    for one in sorted(raised, key=lambda c: -c.confidence):
        if one.confidence < LEAST_CONFIDENCE or len(ranked) == MOST_CANDIDATES:
            break
        if all(_distance(one, kept, aspect) >= SPACING_WIDTHS for kept in ranked):
            ranked.append(one)
    return ranked
