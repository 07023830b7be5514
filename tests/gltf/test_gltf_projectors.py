"""Spot lights of glTF files whose extras make them projectors."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gltfs import Writer

from airlight.colour import srgb_decode
from airlight.errors import AirlightWarning
from airlight.pygfx import Projector
from airlight.pygfx.punctual import punctual_lights
from airlight.scenes import open_scene

CODES = np.random.default_rng(4).integers(0, 256, (2, 3, 4), dtype=np.uint8)


def written(path: Path, projector: Any, cookie: bool = False) -> str:
    w = Writer()
    w.node(mesh=w.mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [0, 1, 2]))
    if cookie:
        w.texture(CODES)
    light = w.light(type="spot", name="slides", intensity=40, color=[1, 0.5, 0], extras={"projector": projector})
    w.node(extensions=light, translation=[1, 2, 3], rotation=[0, 0, np.sin(np.pi / 4), np.cos(np.pi / 4)])  # up is -X
    (path / "room.glb").write_bytes(w.glb())
    return str(path / "room.glb")


def test_extras_make_a_projector(tmp_path: Path) -> None:
    extras = {"fov": [50, 20], "near": 0.3, "far": 8, "falloff": "inverse", "ambient": 0.1, "clip": [[0, 1, 0, 2]], "cookie": 0}
    stage = open_scene(written(tmp_path, extras, cookie=True))
    stage.pose(0.0, None)
    (light,) = punctual_lights(stage.lights)
    np.testing.assert_allclose(light.axes(), [[0, 1, 0], [-1, 0, 0], [0, 0, -1]], atol=1e-6)
    np.testing.assert_allclose(light.intensity, (40, 20, 0), rtol=1e-5)
    assert light.falloff_terms() == (0.0, 1.0, 0.1) and len(light.planes()) == 7
    assert light.cookie is not None
    np.testing.assert_allclose(light.cookie.pixels, srgb_decode(CODES[..., :3] / 255) * CODES[..., 3:] / 255, atol=1e-5)


@pytest.mark.parametrize(
    ("extras", "told"),
    [
        ({"fov": [0, 20]}, "fov must be 0.001 to 179 degrees"),
        ({"fov": 5}, "is shown as a spot"),
        ({"fov": ["a", 2]}, "its numbers are none"),
        ({"angle": 5}, "it has no angle; there is fov, near"),
        ({"near": 2, "far": 1}, "near must be above 0 and its far beyond it"),
        ({"cookie": 3}, "its cookie is image 3, which the file has not"),
        ({"cookie": "slide.png"}, "which the file has not"),
        ([1], "its extras are no object"),
        ({"clip": [[0, 0, 0, 1]]}, "planes of four finite numbers"),
        ({"near": 10**400}, "its numbers are none"),
        ({"fov": [True, True]}, "its numbers are none"),
        ({"cookie": True}, "its cookie is image True"),
        ({"near": 1e-300}, "near must be 1e-06 to 1e.09 m"),
        ({"near": 1e300}, "near must be 1e-06 to 1e.09 m"),
        ({"far": 1e300}, "far must be 1e-06 to 1e.09 m"),
        ({"ambient": 1e300}, "ambient must be 0 to 1e.09 1/m.2"),
        ({"fov": [1e-300, 20]}, "fov must be 0.001 to 179"),
        ({"clip": 3}, "a list of planes a, b, c, d, not 3"),
        ({"clip": [[1e-300, 0, 0, 1]]}, "more than 1e.09 m away"),
        ({"falloff": "cubic"}, "falloff must be inverse-square"),
    ],
)
def test_what_is_no_projector_is_a_spot_and_told(tmp_path: Path, extras: Any, told: str) -> None:
    with pytest.warns(AirlightWarning, match=told):
        stage = open_scene(written(tmp_path, extras))
    assert not isinstance(stage.lights[0].target, Projector)
