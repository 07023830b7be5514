"""Draw scenes of glTF files small, and compare what is seen with where their vertices are."""

import time
from pathlib import Path

import numpy as np
import pygfx as gfx
import pytest
from gltfs import Writer
from rendercanvas.offscreen import OffscreenRenderCanvas

from airlight.errors import AirlightError
from airlight.pygfx import use_hdr
from airlight.scenes import Stage, open_scene
from airlight.scenes.gltf import meshes

HAWK = Path(__file__).parents[1] / "data" / "hawk.glb"
SIZE = 96, 64


class Eye:
    """One renderer for all tests."""

    def __init__(self) -> None:
        self.canvas = OffscreenRenderCanvas(size=SIZE, pixel_ratio=1)
        self.renderer = gfx.WgpuRenderer(self.canvas, pixel_ratio=1, ppaa="none")
        use_hdr(self.renderer)

    def linear(self, scene: gfx.Scene, camera: gfx.Camera) -> np.ndarray:
        """(H, W, 4) float32. What pygfx logs is raised."""
        self.canvas.request_draw(lambda: self.renderer.render(scene, camera))
        self.canvas.draw()
        return np.asarray(self.renderer.snapshot()).astype(np.float32)


def flat(w: Writer, **material: object) -> int:
    """An unlit material."""
    return w.add("materials", extensions={"KHR_materials_unlit": {}}, **material)


def frontal(width: float = 6, height: float = 4) -> gfx.OrthographicCamera:
    """Looks along -z at the origin: pixel (x, y) of SIZE sees (x - 48, 32 - y) / 16."""
    camera = gfx.OrthographicCamera(width, height, depth_range=(-50, 50))
    return camera


def drawn(stage: Stage) -> list[gfx.WorldObject]:
    return [thing for thing in stage.scene.iter() if isinstance(thing, (gfx.Mesh, gfx.Line, gfx.Points))]


def corners(stage: Stage) -> np.ndarray:
    """(N, 3): the vertices of all meshes."""
    return np.concatenate([meshes.vertices(thing) for thing in drawn(stage)])


def seen(eye: Eye, stage: Stage, camera: gfx.Camera | None = None) -> np.ndarray:
    """(H, W) bool: where there is something bright."""
    return eye.linear(stage.scene, camera or frontal())[..., :3].max(axis=-1) > 0.5


def agrees(eye: Eye, stage: Stage) -> None:
    """What is seen fills the box of the vertices' places, to a pixel and a half."""
    mask, places = seen(eye, stage), corners(stage)
    assert mask.any()
    ys, xs = np.nonzero(mask)
    found = [xs.min(), xs.max() + 1, ys.min(), ys.max() + 1]
    x, y = 48 + 16 * places[:, 0], 32 - 16 * places[:, 1]
    assert found == pytest.approx([x.min(), x.max(), y.min(), y.max()], abs=1.5)


def refused(folder: Path, data: bytes, words: str, name: str = "scene.glb") -> None:
    path = folder / name
    path.write_bytes(data)
    start = time.monotonic()
    with pytest.raises(AirlightError, match=words) as error:
        open_scene(path, "none")
    assert time.monotonic() - start < 5
    said = str(error.value)
    assert error.value.exit_code == 2 and said.startswith(str(path)) and "\n" not in said and "; " in said
