"""A position where the light of a picture may be."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Candidate:
    """Holds a position where the picture's light may be.

    position: (x, y) normalised, (0, 0) the top left corner; outside 0..1 beyond the frame. kind: "disc", "opening", "glow",
    "lamps" or "beyond". confidence: 0..1. guess: beyond the frame by no evidence that points there. lamps: of kind lamps the
    single ones, brightest first.
    """

    position: tuple[float, float]
    kind: str
    confidence: float
    guess: bool = False
    lamps: tuple[tuple[float, float], ...] = ()
