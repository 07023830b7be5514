"""Light shafts in 3-D scenes of pygfx: a pass for `renderer.effect_passes`. docs/scenes.md is its guide."""

from airlight.errors import needing

with needing("airlight.pygfx", "scenes"):
    from airlight.pygfx.effect import LightShafts, add_light_shafts, enable_timing
    from airlight.pygfx.lights import SceneLight
    from airlight.pygfx.origin import near_origin
    from airlight.pygfx.particles import ParticleField, undrawn
    from airlight.pygfx.private import use_hdr
    from airlight.pygfx.projector import Projector

__all__ = [
    "LightShafts",
    "ParticleField",
    "Projector",
    "SceneLight",
    "add_light_shafts",
    "enable_timing",
    "near_origin",
    "undrawn",
    "use_hdr",
]
