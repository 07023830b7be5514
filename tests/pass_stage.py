"""What tests of a pass of pygfx share: one renderer, drawing that raises, and reading textures back."""

from typing import Any

import numpy as np
import pygfx as gfx
from rendercanvas.offscreen import OffscreenRenderCanvas

from airlight.pygfx import enable_timing, use_hdr

KINDS = {"rgba16float": (np.float16, 4), "rgba32float": (np.float32, 4), "rgba8unorm-srgb": (np.uint8, 4), "depth32float": (np.float32, 1)}


class PassStage:
    """Whoever derives from it sets scene and camera, anew with each `reset`. One that a module of tests calls Stage is what its tests
    get by `stage`, of conftest.py."""

    scene: Any
    camera: Any

    def __init__(self, size: tuple[int, int]) -> None:
        enable_timing()
        self.canvas = OffscreenRenderCanvas(size=size, pixel_ratio=1)
        self.renderer = gfx.WgpuRenderer(self.canvas, pixel_ratio=1, ppaa="none")
        use_hdr(self.renderer)

    def reset(self) -> None:
        raise NotImplementedError

    def draw(self, render: Any = None) -> np.ndarray:
        """A frame; raises what is raised in it. (H, W, 4) uint8."""
        errors: list[Exception] = []

        def draw() -> None:
            try:
                (render or (lambda: self.renderer.render(self.scene, self.camera)))()
            except Exception as error:
                errors.append(error)

        self.canvas.request_draw(draw)
        image = np.asarray(self.canvas.draw())
        if errors:
            raise errors[0]
        return image

    def texels(self, texture: Any) -> np.ndarray:
        """(H, W, channels) as the texture holds them."""
        width, height, _ = texture.size
        kind, channels = KINDS[texture.format]
        layout = {"bytes_per_row": width * channels * np.dtype(kind).itemsize, "rows_per_image": height}
        data = self.renderer.device.queue.read_texture({"texture": texture}, layout, (width, height, 1))
        return np.frombuffer(data, kind).reshape(height, width, channels)
