"""Loads pygfx's shaders of surfaces with ours in their place, and binds a storage buffer beside its lights, which a Binding of pygfx does
for its own buffers alone.
"""

from collections.abc import Callable
from typing import Any

import jinja2
import wgpu

from airlight.gpu.shader import load

SHADERS = ("light_shadow.wgsl", "light_punctual.wgsl")  # of pygfx, that files of those names here stand in for
TEXEL = 32  # bytes, as of glass_maps.BYTES[True]


class GlassBinding:
    """Stands in for a Binding of pygfx: a buffer of so many texels of what dims lights, by the name of `u_glass`.

    filled: of the maps in it, what they show.
    """

    name, type = "u_glass", "storage"

    def __init__(self, device: Any, texels: int) -> None:
        self.buffer = device.create_buffer(size=TEXEL * texels, usage=wgpu.BufferUsage.STORAGE)
        self.filled: dict[int, Any] = {}

    def get_bind_group_descriptors(self, slot: int) -> tuple[dict[str, Any], dict[str, Any]]:
        entry = {"binding": slot, "resource": {"buffer": self.buffer, "offset": 0, "size": self.buffer.size}}
        layout = {"binding": slot, "visibility": wgpu.ShaderStage.FRAGMENT, "buffer": {"type": "read-only-storage"}}
        return entry, layout


class Shaders(jinja2.BaseLoader):
    """Loads pygfx's shaders; of SHADERS also ours, for render states that are ours."""

    def __init__(self, loader: Any) -> None:
        self.loader = loader

    def get_source(self, environment: Any, template: str) -> tuple[str, str | None, Callable[[], bool]]:
        source, name, is_current = self.loader.get_source(environment, template)
        if template in SHADERS:
            ours = "$$ if airlight_casts is defined and lighting is defined and lighting"  # what is unlit is told of no lights
            source = "\n".join([ours, load(f"pygfx/{template}"), "$$ else", source, "$$ endif", ""])
        return source, name, is_current
