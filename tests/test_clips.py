"""Any subset of a clip's frames has the bytes of the whole run: what its frames keep is settled by the same frames of all on disk."""

from pathlib import Path

import numpy as np
import pytest
import thumbs

from airlight.cli import main
from airlight.files import read_image, write_image
from airlight.jobs.clips import MOST_LOOKED_AT, looked_at


def frame(shift: int, level: float = 1.0) -> np.ndarray:
    """Give a photograph of a sun, linear, of some level, as a camera that turns sees it."""
    return np.asarray(np.roll(thumbs.linear(thumbs.SUN), 2 * shift, axis=1) * np.float32(level))


def clip(folder: Path, extension: str, levels: list[float]) -> Path:
    for i, level in enumerate(levels):
        write_image(folder / f"shot.{i + 1:04d}.{extension}", frame(i, level))
    return folder / f"shot.####.{extension}"


def rendered(source: Path, to: Path, *more: object) -> dict[str, bytes]:
    to.mkdir(exist_ok=True)
    extension = source.suffix
    assert main(["image", str(source), "-o", str(to / f"out.####{extension}"), "-y", *(str(one) for one in more)]) == 0
    return {path.name: path.read_bytes() for path in to.iterdir()}


@pytest.mark.parametrize("look", ["smart", "classic"])
@pytest.mark.parametrize("extension", ["png", "exr"])
@pytest.mark.parametrize("levels", [[1.0, 0.7, 1.0, 0.5, 0.9, 0.3], [0.0, 0.0, 0.6, 1.0, 0.8, 0.0]], ids=["lit", "black-first"])
def test_a_subset_has_the_bytes_of_the_whole(
    tmp_path: Path, look: str, extension: str, levels: list[float], capsys: pytest.CaptureFixture[str]
) -> None:
    source = clip(tmp_path, extension, levels)
    whole = rendered(source, tmp_path / "whole", "--look", look)
    light = [line for line in capsys.readouterr().err.splitlines() if "light at" in line]
    assert len(light) == 1
    assert len(whole) == len(levels)
    for i, text in enumerate(("4-5", "2", "6,1", "3-1")):
        some = rendered(source, tmp_path / f"some{i}", "--look", look, "--frames", text)
        assert light[0] in capsys.readouterr().err.splitlines()
        assert some and all(whole[name] == data for name, data in some.items())
    change = 0.0
    for i in range(2, 7):
        before, after = (read_image(tmp_path / name).linear() for name in (f"shot.{i:04d}.{extension}", f"whole/out.{i:04d}.{extension}"))
        change = max(change, float(np.abs(after - before).max()))
    assert change > 0.02  # it shines


@pytest.mark.parametrize("look", ["smart", "classic"])
def test_a_black_first_frame_with_a_light_that_is_given(tmp_path: Path, look: str) -> None:
    source = clip(tmp_path, "png", [0.0, 1.0, 0.8])
    light = ["--light", "0.34,0.33", "--look", look, "--adapt", "0.5"] if look == "classic" else ["--light", "0.34,0.33"]
    whole = rendered(source, tmp_path / "whole", *light)
    lit = clip(tmp_path / "whole", "png", []).parent / "lit"
    lit.mkdir()
    for i in (2, 3):
        (lit / f"shot.{i:04d}.png").write_bytes((tmp_path / f"shot.{i:04d}.png").read_bytes())
    later = rendered(lit / "shot.####.png", tmp_path / "later", *light)
    assert all(whole[name] == data for name, data in later.items()) and len(later) == 2


def test_a_clip_in_which_nothing_shines(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for i in range(1, 13):
        write_image(tmp_path / f"shot.{i:04d}.png", np.full((54, 96, 3), 0.002 * i, np.float32))
    rendered(tmp_path / "shot.####.png", tmp_path / "out", "--frames", "5-6")
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 3 and "no light found" in lines[0] and f"no frame that was looked at ({MOST_LOOKED_AT})" in lines[1]
    assert (tmp_path / "out" / "out.0005.png").exists()


def test_the_frames_that_are_looked_at() -> None:
    assert looked_at(range(5)) == [0, 1, 2, 3, 4] and looked_at([7]) == [7] and looked_at([]) == []
    order = looked_at(range(101))
    assert order[:MOST_LOOKED_AT] == [0, 12, 25, 38, 50, 62, 75, 88, 100] and sorted(order) == list(range(101))


def test_frames_that_cannot_be_read_are_passed_through(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    source = clip(tmp_path, "png", [1.0, 1.0, 1.0, 1.0, 0.8])
    (tmp_path / "shot.0001.png").write_bytes(b"no picture")
    some = rendered(source, tmp_path / "some", "--frames", "3")
    lines = capsys.readouterr().err.splitlines()
    assert len(some) == 1 and "light at" in lines[0] and len(lines) == 2


def test_scenes_render_a_frame_alike_in_any_run(tmp_path: Path) -> None:
    """Light adaptation, jittered steps and shadow maps of a scene know nothing of the frames before."""

    def frames(text: str, name: str, *more: str) -> dict[str, bytes]:
        (tmp_path / name).mkdir()
        args = ["render", "table", "-o", str(tmp_path / name / "f.####.png"), "--turntable", "6", "--frames", text, *more]
        assert main([*args, "--width", "96", "--height", "54", "--quality", "draft"]) == 0
        return {path.name: path.read_bytes() for path in (tmp_path / name).iterdir()}

    for i, more in enumerate((["--adapt", "1"], ["--method", "march", "--steps", "12", "--adapt", "0.5"])):
        whole, some = frames("1-4", f"whole{i}", *more), frames("4,3", f"some{i}", *more)
        assert len(some) == 2 and all(whole[name] == data for name, data in some.items())
