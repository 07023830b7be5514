"""Airlight: volumetric light scattering (god rays, light shafts) on any GPU, each method measured against a reference."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from airlight.api import Renderer as Renderer
    from airlight.api import add_light_shafts as add_light_shafts
    from airlight.api import density as density
    from airlight.api import light_shafts as light_shafts
    from airlight.api import occlusion_fraction as occlusion_fraction
    from airlight.baked import basin as basin
    from airlight.baked import particles as particles
    from airlight.detect import Candidate as Candidate
    from airlight.detect import find_light as find_light
    from airlight.detect import find_lights as find_lights
    from airlight.errors import AirlightError as AirlightError
    from airlight.errors import AirlightWarning as AirlightWarning
    from airlight.errors import MachineError as MachineError
    from airlight.files.photometry import read_photometry as read_photometry
    from airlight.files.volumes import read_volume as read_volume
    from airlight.jobs.cookies import read_cookie as read_cookie
    from airlight.lights import Light as Light
    from airlight.options import Composite as Composite
    from airlight.options import Parameters as Parameters
    from airlight.viewer.app import view as view

__version__ = "0.1.0"
_HOME = {
    "api": ("Renderer", "add_light_shafts", "density", "light_shafts", "occlusion_fraction"),
    "baked": ("basin", "particles"),
    "detect": ("Candidate", "find_light", "find_lights"),
    "errors": ("AirlightError", "AirlightWarning", "MachineError"),
    "files.photometry": ("read_photometry",),
    "files.volumes": ("read_volume",),
    "jobs.cookies": ("read_cookie",),
    "lights": ("Light",),
    "options": ("Composite", "Parameters"),
    "viewer.app": ("view",),
}
_MODULE = {name: module for module, names in _HOME.items() for name in names}
__all__ = sorted(_MODULE)


def __dir__() -> list[str]:
    """List the public names, for completion: those too that no one has asked for yet."""
    return sorted({*globals(), *__all__})


def __getattr__(name: str) -> Any:
    """Import a name on first use: `airlight --help` needs neither NumPy nor a GPU library."""
    if name not in _MODULE:
        raise AttributeError(f"module 'airlight' has no attribute {name!r}")
    from airlight.errors import needing

    with needing(f"airlight.{name}", "notebook"):
        return getattr(import_module(f"airlight.{_MODULE[name]}"), name)
