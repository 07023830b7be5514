"""Every private attribute of pygfx that Airlight touches, each behind a function; tests/test_scene_private.py names those that go away."""

from typing import Any

HDR = "rgba16float"


def is_hdr(renderer: Any) -> bool:
    """Whether a gfx.WgpuRenderer keeps its picture in half floats. Touches renderer._blender."""
    return bool(renderer._blender.texture_info["color"]["format"] == HDR)


def use_hdr(renderer: Any) -> None:
    """Let a gfx.WgpuRenderer keep its picture in half floats, linear and beyond 1, from its next frame on.

    Touches renderer._blender, and its _texture_info and _textures: formats are those of the info, textures are made where missing.
    """
    if not is_hdr(renderer):
        for name in ("color", "altcolor"):
            renderer._blender._texture_info[name]["format"] = HDR
            renderer._blender._textures.pop(name, None)
