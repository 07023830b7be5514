"""The viewer's tests share one viewer, offscreen: each one made leaves some MiB behind."""

import logging
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from viewer_driver import CLASSIC, SCENE_SIZE, SIZE, Driver, stage

from airlight import scenes
from airlight.files import write_image
from airlight.viewer import state as st
from airlight.viewer.state import LightControl


@pytest.fixture(autouse=True)
def drawn_without_errors(caplog: pytest.LogCaptureFixture) -> Iterator[None]:
    """rendercanvas logs what fails in a frame or in a handler, and goes on."""
    with caplog.at_level(logging.WARNING):
        yield
    records = [*caplog.get_records("setup"), *caplog.get_records("call")]
    bad = [r.getMessage() + str(r.exc_text or "") for r in records if r.name.startswith(("rendercanvas", "pygfx", "wgpu"))]
    assert not bad


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("viewer")


@pytest.fixture(scope="session")
def codes() -> np.ndarray:
    """(H, W, 3) uint8: a sun at 0.3, 0.4 behind bars."""
    y, x = np.mgrid[:180, :280]
    sun = np.exp(-((x - 84) ** 2 + (y - 72) ** 2) / 300)
    picture = 0.1 + 0.15 * (y / 180) + sun
    picture[:, 150:160] *= 0.2
    return np.rint(255 * np.clip(picture[..., None] * (1, 0.85, 0.6), 0, 1)).astype(np.uint8)


@pytest.fixture(scope="session")
def photo(folder: Path, codes: np.ndarray) -> str:
    path = str(folder / "sun.png")
    write_image(path, None, encoded=codes)
    return path


@pytest.fixture(scope="session")
def kept(photo: str, folder: Path) -> Driver:
    """One viewer for many tests: each one made leaves some MiB behind."""
    return Driver(photo, folder)


@pytest.fixture
def hands(kept: Driver, photo: str) -> Driver:
    kept.viewer.open(photo, [LightControl((0.3, 0.4))])
    kept.state.shafts, kept.state.timing = True, False
    kept.state.sources = (*scenes.NAMES, photo)
    kept.state.command = kept.state.path = ""
    st.set_values(kept.state, CLASSIC)
    kept.frame(2)
    for name in [n.removeprefix("group ") for n in kept.places if n.startswith("group ")]:
        inside = {"Method": "method", "Occlusion": "occlusion", "Composite": "mix", "Shafts in the scene": "region", "Times": "passes"}
        if {**inside, "Presets and settings": "preset", "Look": "look"}.get(name) in kept.places:
            kept.open_group(name)
    kept.viewer.errands.history.restart(kept.state)
    kept.frame(2)
    return kept


@pytest.fixture(scope="session")
def trees() -> np.ndarray:
    """(H, W, 3) uint8: a low sun at 0.3, 0.4 behind trunks."""
    y, x = np.mgrid[:180, :280]
    sky = 0.3 + 0.6 * np.exp(-((x - 84) ** 2 + (y - 72) ** 2) / 5000)
    sky[x % 36 < 10] = 0.12
    sky[np.hypot(x - 84, y - 72) < 9] = 1
    sky[130:] *= 0.5
    return np.rint(255 * np.clip(sky[..., None] * (1, 0.9, 0.75), 0, 1)).astype(np.uint8)


@pytest.fixture(scope="session")
def forest(folder: Path, trees: np.ndarray) -> str:
    path = str(folder / "forest.png")
    write_image(path, None, encoded=trees)
    return path


@pytest.fixture
def smart(hands: Driver, forest: str) -> Driver:
    """A picture as it is shown unless the sum is asked for, its light where the sun is."""
    st.reset(hands.state)
    hands.viewer.open(forest, [LightControl((0.3, 0.4), kind="disc")])
    hands.state.held = False
    hands.state.candidates_shown = True
    hands.frame(2)
    for group, inside in (("Light", "light 0"), ("More of the look", "fineness"), ("View", "debug")):
        if inside in hands.places:
            hands.open_group(group)
    return hands


@pytest.fixture
def scene(hands: Driver, monkeypatch: pytest.MonkeyPatch) -> Iterator[Driver]:
    monkeypatch.setattr(scenes, "open_scene", stage)
    hands.viewer.open("table")
    hands.state.playing = False
    hands.canvas.set_logical_size(*SCENE_SIZE)
    hands.frame(3)
    yield hands
    hands.canvas.set_logical_size(*SIZE)
