"""Volumes and wind in the viewer."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from viewer_driver import Driver

from airlight.jobs.cookies import FilmCookie
from airlight.viewer import command
from airlight.viewer import state as st
from airlight.viewer.desktop import kinds


def test_a_volume_that_is_opened_lies_in_the_air(scene: Driver, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    state = scene.state
    plain = scene.frame(2)[:, 360:].astype(int)
    path = tmp_path / "smoke.npz"
    np.savez(path, density=np.full((4, 4, 4), 3, np.float32), bounds=np.array([[-1.5, 0.5, -1.5], [1.5, 3, 1.5]]))
    state.requests.append(("open", str(path)))
    smoky = scene.frame(3)[:, 360:].astype(int)
    assert "lies in the air now" in state.message and state.parameters.method == "march"
    assert np.abs(smoky - plain).max() > 10
    assert f"--volume={path}" in command.options(state)
    assert not state.doubt
    st.set_values(state, st.values(state) | {"fog": "linear"})
    scene.frame(2)
    assert "give it a density, air = 1" in state.doubt
    state.requests.append(("open", str(tmp_path / "none.vdb")))
    scene.frame(2)
    assert "none.vdb" in state.message and command.options(state).count(f"--volume={path}") == 1
    sent = tmp_path / "sent.npz"
    sent.write_bytes(path.read_bytes())
    monkeypatch.setattr(state, "received", {str(sent): "mine.npz"})
    state.requests.append(("open", str(sent)))
    scene.frame(2)
    assert "--volume=mine.npz" in command.options(state) and str(sent) not in " ".join(command.options(state))


def test_a_file_dialog_offers_what_can_be_opened() -> None:
    endings = kinds()[1].split()
    assert {"*.jpg", "*.glb", "*.vdb", "*.NPZ", "*.vol", "*.csv"} <= set(endings)


def test_wind_moves_a_still_scene(scene: Driver, monkeypatch: pytest.MonkeyPatch) -> None:
    state = scene.state
    monkeypatch.setattr(scene.viewer.scene.stage, "duration", 0.0)
    scene.frame()
    assert state.duration == 0
    st.set_values(state, {"method": "march", "steps": 16, "shadow_size": 64, "resolution": 0.5, "noise_amount": 4.0, "noise_size": 0.7})
    still = scene.frame(2)[:, 360:].astype(int)
    assert state.duration == 0 and "noise_amount" in st.values(state)
    st.set_values(state, st.values(state) | {"wind": (1.0, 0.0, 0.0)})
    scene.frame(2)
    assert state.duration > 0 and state.playing
    state.playing, state.time = False, 5.0
    moved = scene.frame(2)[:, 360:].astype(int)
    assert np.abs(moved - still).max() > 3
    st.set_values(state, {key: value for key, value in st.values(state).items() if key != "wind"})
    scene.frame(2)
    assert state.duration == 0


def test_a_film_of_a_cookie_runs_in_a_still_scene(scene: Driver, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for number in (1, 2, 30):
        Image.new("L", (2, 2), number).save(tmp_path / f"film.{number:04d}.png")
    state, stage, cookie = scene.state, scene.viewer.scene.stage, FilmCookie(str(tmp_path / "film.####.png"))
    monkeypatch.setattr(stage, "duration", 0.0)
    monkeypatch.setattr(stage, "cookies", [cookie])
    scene.frame()
    assert state.duration > 0 and state.playing
    state.playing, seen = False, []
    for state.time in (0.0, 1 / 24, 29 / 24):
        scene.frame(2)
        seen.append((cookie.frame, cookie.pixels.max() > 0.002))
    assert seen == [(1, False), (2, False), (30, True)]
