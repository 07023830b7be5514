"""Airlight: volumetric light scattering (god rays, light shafts) on any GPU, each method measured against a reference."""

from airlight.api import add_light_shafts, light_shafts, occlusion_fraction
from airlight.detect import find_light
from airlight.errors import AirlightError, AirlightWarning, MachineError
from airlight.lights import Light
from airlight.parameters import Composite, Parameters

__all__ = [
    "AirlightError",
    "AirlightWarning",
    "Composite",
    "Light",
    "MachineError",
    "Parameters",
    "add_light_shafts",
    "find_light",
    "light_shafts",
    "occlusion_fraction",
]
__version__ = "0.1.0"
