"""Finding the light of a picture: its sun, an opening, a glow, lamps at night, or a light beyond the frame."""

from airlight.detect.candidate import Candidate
from airlight.detect.ranking import ACT, ASK, find_light, find_lights

__all__ = ["ACT", "ASK", "Candidate", "find_light", "find_lights"]
