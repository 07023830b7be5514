"""Daylight in float64: sun, sky and aerial perspective of a round atmosphere, with shafts that are missing light."""

from airlight.daylight.atmosphere import Atmosphere, Parts
from airlight.daylight.hoffman_preetham import hoffman_preetham
from airlight.daylight.sun import sun_position

__all__ = ["Atmosphere", "Parts", "hoffman_preetham", "sun_position"]
