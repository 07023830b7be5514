"""The private attributes of pygfx that Airlight touches: a new version that takes one away fails here, by its name."""

import pytest

pytest.importorskip("pygfx")
from pygfx.renderers.wgpu.engine.blender import Blender


@pytest.mark.parametrize("name", ["_texture_info", "_textures", "texture_info"])
def test_the_blender_has(name: str) -> None:
    assert hasattr(Blender(), name), f"pygfx's Blender has no {name} any more: see airlight/pygfx/private.py"


def test_the_formats_are_said_in_the_info() -> None:
    info = Blender()._texture_info
    for name in ("color", "altcolor"):
        assert info[name]["format"] == "rgba8unorm-srgb", f"pygfx's Blender._texture_info[{name!r}]['format'] means something else now"


def test_the_renderer_has_a_blender() -> None:
    import inspect

    from pygfx.renderers.wgpu.engine.renderer import WgpuRenderer

    assert "self._blender = Blender()" in inspect.getsource(WgpuRenderer.__init__), "WgpuRenderer._blender: see airlight/pygfx/private.py"
