"""Long work tells on stderr how much is left, quick work nothing; a profile says where the time went."""

import io
import re
import sys
from pathlib import Path

import numpy as np
import pytest

from airlight import bench, progress
from airlight.cli import main
from airlight.gpu import slices
from airlight.jobs.profile import Spent, lines
from airlight.reference import tracer


def test_what_is_left_of_work_in_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [100.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: now[0])
    work = progress.Work("all", 20)
    assert work.left() == ""
    work.part("truth", 10)
    work.weigh(30)  # it is more than was thought: 40 in all
    now[0] += 15
    work.share(0.5)
    assert (work.done, work.total, work.left()) == (15, 40, "about 25 s left")
    work.part("timing", 10)
    now[0] += 45
    assert (work.done, work.left()) == (30, "about 20 s left")
    assert progress.Work("all", 2, is_timed=False).left() == ""
    work.total = 1000
    assert work.left() == "about 32 min left"


def test_time_is_foreseen_by_the_share_of_a_step(monkeypatch: pytest.MonkeyPatch) -> None:
    """Steps are counted until a share says how fast a step is; its first part, which compiles, says nothing."""
    now = [0.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: now[0])
    work = progress.Work("opening", 3, is_timed=False)
    assert (work.described(), work.left()) == ("opening, step 1 of 3", "")
    now[0] = 10
    work.step("drawing")
    assert (work.described(), work.left()) == ("drawing, step 2 of 3", "")
    for at, share, left in ((15, 0.1, ""), (15.2, 0.11, ""), (17, 0.3, "about 11 s left"), (21, 0.7, "about 7 s left")):
        now[0] = at
        work.foresee(share, 4.0)
        assert work.left() == left
    assert work.described() == "drawing" and work.done == 21 and work.total == pytest.approx(28)
    now[0] = 24
    work.step("writing")
    assert (work.described(), work.left()) == ("writing", "about 4 s left")


def test_a_pass_that_follows_is_foreseen_by_its_own_pace(monkeypatch: pytest.MonkeyPatch) -> None:
    """A scene is drawn in large bands, then its light is summed in more parts: by shares that begin anew, even above the first band's."""
    now = [0.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: now[0])
    work = progress.Work("drawing", 3, is_timed=False)
    for at, share in ((1, 0.125), (2, 0.5), (3, 1.0)):
        now[0] = at
        work.foresee(share, 4.0)
    assert work.left() == "about 4 s left"
    for at, share, left in ((5, 0.25, 7), (7, 0.5, 8), (11, 1.0, 4)):
        now[0] = at
        work.foresee(share, 4.0)
        assert work.left() == f"about {left} s left"


@pytest.mark.parametrize(("method", "size", "passes"), [("epipolar", 64, 0), ("epipolar", 4096, 2), ("radial", 64, 2), ("march", 64, 1)])
def test_a_single_frame_tells_its_drawing_and_its_sum_unless_it_is_quick(
    method: str, size: int, passes: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    from types import SimpleNamespace

    from airlight.jobs.frame_work import FrameWork

    told: list[float] = []
    shafts = SimpleNamespace(timing=False, parameters=SimpleNamespace(method=method))
    studio = SimpleNamespace(shot=SimpleNamespace(width=size, height=size, samples=1), shafts=shafts)
    work = FrameWork(Spent(), studio, None, False, None, None)  # type: ignore[arg-type]

    def render(*_: object) -> None:
        if isinstance(watched := slices.current(), slices.Watched):
            if watched.drawing:
                watched.tell(1.0)
            slices.tell(1.0)

    monkeypatch.setattr(work, "render", render)
    monkeypatch.setattr(work, "write", lambda *_: None)
    monkeypatch.setattr(progress.Work, "foresee", lambda self, share, after: told.append(after))
    work.alone(None, progress.Work())  # type: ignore[arg-type]
    assert len(told) == passes and all(after == told[0] > size * size * 5e-7 for after in told)


def test_a_watched_pass_comes_from_all_over_and_tells() -> None:
    shares: list[float] = []
    with slices.watching(shares.append):
        assert list(slices.parts(90)) == [(0, 90)] and list(slices.strips(90)) == [(0, 90)]
        found = list(slices.parts(90, spread=True))
        for i in range(2):
            slices.among(i, 2)
            slices.tell(0.5)
    assert shares == [0.25, 0.75] and slices.current() is None
    assert sorted(row for first, count in found for row in range(first, first + count)) == list(range(90))
    assert [first // 15 for first, _ in found[:1] + found[-1:]] != [0, 5]
    assert list(slices.parts(90, spread=True)) == [(0, 90)]


@pytest.mark.parametrize(("scene", "method"), [("headlamp", "march"), ("table", "radial")])
def test_a_first_frame_that_is_watched_is_the_same(scene: str, method: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A part a row: each tells its share, and no pixel differs."""
    from airlight.options import Parameters
    from airlight.scenes import open_scene
    from airlight.scenes.offline import Shot, Studio

    monkeypatch.setattr(slices.Watched, "part", 0.0)
    stage, shares = open_scene(scene), []
    studios = [Studio(stage, Shot(64, 48, samples=1), Parameters(method=method, quality="draft")) for _ in range(2)]  # type: ignore[arg-type]
    with slices.watching(shares.append):
        parts = studios[0].frame(layer=True, depth=True)
    whole = studios[1].frame(layer=True, depth=True)
    assert shares == sorted(shares) and shares[-1] == 1 and (method == "radial" or len(shares) >= 3)
    assert whole.layer is not None and whole.layer[..., :3].max() > 0
    for name in ("picture", "layer", "depth"):
        assert np.array_equal(getattr(whole, name), getattr(parts, name)), name


def test_a_line_a_minute_where_there_is_no_terminal(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    now = [0.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: now[0])
    with progress.showing("frames", 100) as work:
        for _ in range(100):
            now[0] += 1.5
            work.advance()
    out, err = capsys.readouterr()
    assert out == "" and err.splitlines() == [
        "airlight: frames, 40 % done, about 90 s left",
        "airlight: frames, 80 % done, about 30 s left",
    ]


class _Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.mark.parametrize("is_quick", [True, False])
def test_a_terminal_gets_one_line_that_is_taken_away(is_quick: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing before a second is over; what goes to stdout stays there; a stop leaves a clean line."""
    err, out = _Terminal(), io.StringIO()
    monkeypatch.setattr(sys, "stderr", err)
    monkeypatch.setattr(sys, "stdout", out)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "100")
    monkeypatch.setattr(progress, "SILENT_S", 60.0 if is_quick else 0.0)
    with pytest.raises(KeyboardInterrupt), progress.showing("measuring", 4) as work:
        if not is_quick:
            assert isinstance(work, progress.Bar)
            while not work.bar.live.is_started:
                pass
        work.part("truth 1 of 2", 1)
        print("a row")
        raise KeyboardInterrupt
    assert out.getvalue() == "a row\n"
    told = err.getvalue()
    assert ("truth 1 of 2" in told) is not is_quick
    assert is_quick or told.endswith("\x1b[2K")  # the line is erased


def test_the_tracer_tells_its_rows() -> None:
    from airlight.medium.resolve import resolve
    from airlight.options import March, Medium

    shares: list[float] = []
    projection = np.array([[1.0, 0, 0, 0], [0, 1, 0, 0], [0, 0, -1, -0.2], [0, 0, -1, 0]])
    tracer.layer(np.eye(4), projection, (4, 40), np.zeros((0, 3, 3)), [], resolve(Medium(), March(), "normal", 1.0), told=shares.append)
    assert shares == [0.0, 0.4, 0.8]


def test_a_profile_of_frames() -> None:
    spent = Spent()
    spent.steps, spent.passes = {"draw": 30.0, "write": 10.0}, [("march", 4.0), ("merge", 1.0), ("march", 6.0)]
    assert [re.split(r" {2,}|(?<=ms) ", line.strip()) for line in lines(spent, ("draw", "write"), "draw", 2)][1:] == [
        ["draw", "30.00 ms", "75.0 %", "15.00"],
        ["march", "10.00 ms", "25.0 %", "5.00"],
        ["merge", "1.00 ms", "2.5 %", "0.50"],
        ["write", "10.00 ms", "25.0 %", "5.00"],
        ["sum", "40.00 ms", "100.0 %", "20.00"],
    ]


def test_the_profile_of_a_scene(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = f"render headlamp --method march --width 64 --quality draft --no-antialias --profile -o {tmp_path / 'a.png'}"
    assert main(words.split()) == 0
    out, err = capsys.readouterr()
    found = {line.strip()[:25].strip(): float(line[27:37]) for line in err.splitlines()[1:]}
    steps = ("open the scene", "set up, expose", "draw, read back", "encode, write")
    assert out == "" and {*steps, "shadows", "march spot", "merge", "sum"} <= found.keys()
    assert found["sum"] == pytest.approx(sum(found[name] for name in steps), abs=0.1)
    assert 0 < found["march spot"] < found["draw, read back"]


def test_the_quick_bench_is_a_part_that_says_what_it_leaves_out(monkeypatch: pytest.MonkeyPatch) -> None:
    def part(device: object, say: object) -> list[dict[str, object]]:
        say("a line")  # type: ignore[operator]
        return [{"ms": 1.0}]

    monkeypatch.setattr(bench, "QUICK", ((part, 10.0, 1),))
    monkeypatch.setattr(bench, "WHOLE", ((part, 10.0, 1), (part, 10.0, 1)))
    monkeypatch.setattr(bench, "processes", lambda device, say, is_quick: [])
    for is_quick in (True, False):
        said: list[str] = []
        result = bench.run(say=said.append, is_quick=is_quick)
        assert (result["quick"], len(result["records"])) == (is_quick, 2 - is_quick)
        assert any(line.startswith("--quick: ") and "left out" in line for line in said) is is_quick
