"""Two thousand frames of a scene: memory stays."""

import os
from pathlib import Path

import numpy as np
import pytest

from airlight.options import Composite, Parameters, SceneOptions
from airlight.scenes import open_scene
from airlight.scenes.offline import Shot, Studio

SETTINGS = [
    (Parameters(), Composite(), SceneOptions()),
    (Parameters(), Composite(adapt=0.5), SceneOptions(depth_aware=3.0)),
    (Parameters(density=0.8), Composite(), SceneOptions(occluders="contrast")),
    (Parameters(), Composite(), SceneOptions(occluders="prepass", region=1.3)),
    (Parameters(method="radial", samples=40), Composite(), SceneOptions(clear="#101010")),
]


def resident() -> int:
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


@pytest.mark.slow
@pytest.mark.timeout(1500)
@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="memory is read in /proc")
def test_memory_does_not_grow_over_two_thousand_frames(capsys: pytest.CaptureFixture[str]) -> None:
    """The camera turns around the table, its lamp moves, the settings change every fifty frames; frames are read back now and then."""
    stage = open_scene("table")
    studio = Studio(stage, Shot(256, 144, samples=1))
    lamp = stage.movable
    assert lamp is not None and lamp.target is not None
    home = np.array(lamp.target.local.position)
    sizes = {}
    for i in range(2000):
        p, composite, in_scene = SETTINGS[i // 50 % len(SETTINGS)]
        shafts = studio.shafts
        shafts.parameters, shafts.composite, shafts.in_scene = p, composite, in_scene
        shafts.dt = 1 / 30
        lamp.target.local.position = home + 0.3 * np.array([np.sin(i / 17), 0.2 * np.sin(i / 29), 0.3 * np.cos(i / 23)])
        picture = studio.frame(turn=i / 331, layer=i % 10 == 0).pixels()
        if i in (499, 1999):
            sizes[i] = resident()
            assert picture.max() > 0.1
    growth = sizes[1999] / sizes[499] - 1
    with capsys.disabled():
        print(f"\nmemory: {sizes[499] >> 20} MiB after 500 frames, {growth:+.1%} after 1,500 more; ", end="")
    assert growth < 0.05
