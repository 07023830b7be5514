"""Mutants of glTF files: each becomes a stage that can be posed and drawn, or is refused in one line, soon and in little memory."""

import logging
from pathlib import Path

import numpy as np
import pygfx as gfx
import pytest
from gltf_fuzzing import campaign
from rendercanvas.offscreen import OffscreenRenderCanvas

from airlight.pygfx import use_hdr
from airlight.scenes import Stage

GROWTH = 1 << 20  # KiB


class Drawing(logging.Handler):
    """Draws stages; what rendercanvas logs as an error becomes one."""

    def __init__(self) -> None:
        super().__init__(logging.ERROR)
        self.canvas = OffscreenRenderCanvas(size=(64, 36), pixel_ratio=1)
        self.renderer = gfx.WgpuRenderer(self.canvas, pixel_ratio=1, ppaa="none")
        use_hdr(self.renderer)
        self.said: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        self.said.append(self.format(record))

    def __call__(self, stage: Stage) -> None:
        self.said.clear()
        logging.getLogger("rendercanvas").addHandler(self)
        try:
            for camera in stage.cameras.values():
                self.canvas.request_draw(lambda camera=camera: self.renderer.render(stage.scene, camera))
                self.canvas.draw()
                if self.said:
                    raise RuntimeError("\n".join(self.said))
        finally:
            logging.getLogger("rendercanvas").removeHandler(self)
        assert np.asarray(self.renderer.snapshot()).shape == (36, 64, 4)


@pytest.mark.parametrize("number, seed", [(300, 1), pytest.param(6000, 2, marks=[pytest.mark.slow, pytest.mark.timeout(1800)])])
def test_mutants(number: int, seed: int, tmp_path: Path) -> None:
    stages, faults, longest, growth = campaign(tmp_path, number, seed, Drawing())
    assert not faults, f"{len(faults)} faults:\n" + "\n".join(faults[:5])
    assert stages > number // 20, "nearly all were refused: the mutations are too coarse"
    assert longest < 10 and growth < GROWTH
