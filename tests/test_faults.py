"""What ends a run early: a full disk, a kill at any point, an abort in a library, Ctrl-C. The old output or the new one, one line."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from airlight.errors import MachineError
from airlight.files import read_image, write_image
from airlight.lights import Light
from airlight.options import Parameters
from airlight.scatter.radial import radial

FAULTING = Path(__file__).with_name("faulting.py")
FORMATS = ("png", "jpg", "tif", "webp", "exr", "hdr", "dpx", "jxl", "avif")
OUTPUTS = (*FORMATS, "mp4")
COMMAND = [sys.executable, "-m", "airlight"]
linux = pytest.mark.skipif(sys.platform != "linux", reason="elsewhere the command has no process of its own")


def interruptible():
    """What a test runner in the background passes on is undone: a child there ignores Ctrl-C."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def faults(tmp_path, capsys, kind, formats):
    done = subprocess.run([sys.executable, FAULTING, tmp_path, kind, *formats], capture_output=True, text=True, timeout=280)
    said = json.loads(done.stdout)
    with capsys.disabled():
        print(f"\n{kind} at each of {said['calls']} calls; ", end="")
    assert not said["wrong"], "\n".join(said["wrong"])
    assert said["calls"] >= (2 if kind == "kill" else 6) * 8 * len(formats), said  # some eight calls, onto nothing and onto an old file


def test_an_error_at_every_call_leaves_the_old_file_or_the_new_one(tmp_path, capsys):
    faults(tmp_path, capsys, "error", OUTPUTS)


@linux
def test_a_kill_at_every_call_leaves_the_old_file_or_the_new_one(tmp_path, capsys):
    faults(tmp_path, capsys, "kill", ("png",))


@linux
@pytest.mark.slow
def test_a_kill_at_every_call_of_every_format(tmp_path, capsys):
    faults(tmp_path, capsys, "kill", OUTPUTS)


@pytest.mark.skipif(os.name == "nt", reason="no such limit")
@pytest.mark.parametrize("extension", FORMATS)
def test_a_limit_on_files_is_told_before_a_codec_meets_it(tmp_path, monkeypatch, extension):
    """Libjpeg would end the process, and OpenImageIO's WebP writer would never end."""
    import resource

    monkeypatch.setattr(resource, "getrlimit", lambda _: (1000, 1000))
    with pytest.raises(MachineError, match="ulimit"):
        write_image(tmp_path / f"a.{extension}", np.zeros((9, 9, 3), np.float32))
    assert not list(tmp_path.iterdir())


DEATHS = """
import os, signal, sys
from airlight.process.supervisor import prepare_process, supervised
def work():
    from airlight.files import replacing
    with replacing({target!r}, True) as file:
        file.write(b"half")
        file.flush()
        assert len(os.listdir({folder!r})) == 2
        print("ready", flush=True)
        {death}
    return 0
prepare_process()
sys.exit(supervised(work))
"""
SUBMIT = (
    "from airlight.gpu.device import open_device; d = open_device(); a, b = d.buffer(size=64), d.buffer(size=64); e = d.encoder(); "
    "e.copy_buffer_to_buffer(a, 0, b, 0, 64); a.destroy(); d.submit(e)"
)


@linux
@pytest.mark.parametrize(
    ("death", "code", "says"),
    [
        ("os.write(2, b'lines of a\\nlibrary\\n'); os.abort()", 1, "SIGABRT"),
        ("os.kill(os.getpid(), signal.SIGSEGV)", 1, "SIGSEGV"),
        ("os.kill(os.getpid(), signal.SIGKILL)", 1, "memory"),
        ("import ctypes; ctypes.CDLL(None).exit(1)", 1, "exit 1"),  # as libjpeg does
        (SUBMIT, 1, "destroyed"),
        ("os.kill(os.getppid(), signal.SIGTERM); import time; time.sleep(9)", 143, ""),
        ("os.kill(os.getppid(), signal.SIGINT); signal.pause()", 130, ""),
        ("os.kill(0, signal.SIGINT); import time; time.sleep(9)", 130, ""),  # as a terminal does: both processes
        ("signal.signal(2, signal.SIG_IGN); os.kill(os.getppid(), 2); import time; time.sleep(9)", 130, "stopped"),  # deaf
    ],
)
def test_the_death_of_the_worker_is_one_line(tmp_path, death, code, says):
    target = tmp_path / "out.png"
    target.write_bytes(b"old")
    script = DEATHS.format(target=str(target), folder=str(tmp_path), death=death)
    start = time.monotonic()
    done = subprocess.run(
        [sys.executable, "-c", script],
        capture_output=True,
        text=True,
        timeout=60,
        preexec_fn=interruptible,
        start_new_session=True,
        env={**os.environ, "AIRLIGHT_TRACEBACK": ""},
    )
    assert done.returncode == code and time.monotonic() - start < 8
    assert done.stdout == "ready\n"
    if not says:  # told to stop, it goes by itself, unless the machine is too slow for that
        assert done.stderr in ("", "airlight: stopped; nothing half-written is left\n")
    else:
        assert done.stderr.count("\n") == 1 and says in done.stderr and done.stderr.startswith("airlight: ")
    assert [p.name for p in tmp_path.iterdir()] == ["out.png"] and target.read_bytes() == b"old"


LOST = """
import signal, sys, time
from airlight.process.supervisor import prepare_process, supervised
class Held:
    def __del__(self):
        signal.raise_signal(signal.SIGINT)
def work():
    Held()
    time.sleep(20)
    return 0
prepare_process()
sys.exit(supervised(work))
"""


@linux
def test_a_stop_that_falls_into_a_destructor_is_not_lost():
    began = time.monotonic()
    done = subprocess.run([sys.executable, "-c", LOST], capture_output=True, text=True, timeout=60)
    assert done.returncode == 130 and done.stderr == "airlight: stopped; nothing half-written is left\n" and time.monotonic() - began < 10


def test_the_supervisor_is_there_before_anything_is_imported():
    code = "import sys, airlight.__main__; print(sorted({'click', 'numpy', 'wgpu', 'OpenImageIO'} & set(sys.modules)))"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60).stdout == "[]\n"


@linux
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_long_job_stops_within_a_second(tmp_path, capsys, number):
    source, out = tmp_path / "in.png", tmp_path / "out.png"
    pixels = np.repeat(np.linspace(0.1, 0.3, 1080, dtype=np.float32)[:, None, None], 1920, axis=1).repeat(3, axis=2)
    y, x = np.indices(pixels.shape[:2])
    pixels[np.hypot(x - 730, y - 320) < 30] = 1
    write_image(source, pixels)
    command = [*COMMAND, "image", str(source), "-o", str(out), "--method", "radial", "--samples", "16384", "--layer", f"{out}.exr"]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, preexec_fn=interruptible, cwd=tmp_path)
    assert process.stderr is not None
    assert process.stderr.readline().startswith("light at")  # and now it renders
    time.sleep(1)
    assert process.poll() is None
    start = time.monotonic()
    process.send_signal(number)
    code = process.wait(20)
    spent = time.monotonic() - start
    said = process.stderr.read()
    process.stderr.close()
    with capsys.disabled():
        print(f"\nstopped after {spent:.2f} s; ", end="")
    assert code == 128 + number and spent < 2
    assert said == ("airlight: stopped; nothing half-written is left\n" if number == signal.SIGINT else "")
    assert [p.name for p in tmp_path.iterdir()] == ["in.png"]


INTERRUPT = """
import os, signal, threading, time
import numpy as np, airlight
image = np.random.default_rng(0).random((600, 1600, 3), np.float32)
airlight.light_shafts(image[:50, :50], (0.4, 0.3))
def interrupt():
    global start
    start = time.monotonic()
    os.kill(os.getpid(), signal.SIGINT)
threading.Timer(1, interrupt).start()
try:
    airlight.light_shafts(image, (0.4, 0.3), method="radial", samples=16384)
except KeyboardInterrupt:
    print(time.monotonic() - start, flush=True)
os._exit(0)
"""


@pytest.mark.skipif(os.name == "nt", reason="no signals")
def test_a_library_call_is_interrupted_too(capsys):
    done = subprocess.run([sys.executable, "-c", INTERRUPT], capture_output=True, text=True, timeout=100, preexec_fn=interruptible)
    with capsys.disabled():
        print(f"\ninterrupted after {float(done.stdout):.2f} s; ", end="")
    assert float(done.stdout) < 2


def test_a_sum_in_slices_is_the_same(monkeypatch):
    from airlight.scatter.render import PictureRenderer, render_layer

    picture = np.random.default_rng(6).random((40, 150, 4), np.float32)
    lights, p = [Light((0.4, 0.3)), Light((1.2, 0.3))], Parameters(method="radial", occlusion="none", samples=50)
    whole = render_layer(PictureRenderer(keep=0), picture, lights, p)
    monkeypatch.setattr(radial, "TAPS_A_DISPATCH", 2 * 50 * 150)  # two rows
    profile: list[tuple[str, float]] = []
    sliced_by = PictureRenderer(keep=0)
    sliced = render_layer(sliced_by, picture, lights, p, profile=profile)
    assert np.array_equal(whole, sliced) and whole.max() > 0
    if sliced_by.device.timestamps:
        assert [label for label, _ in profile].count("radial sum") == 40


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_memory_does_not_grow(tmp_path, capsys):
    """300 pictures through the API in one process, of several sizes, methods and types."""
    import airlight

    def resident() -> int:
        return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")

    random = np.random.default_rng(8)
    pictures = [random.integers(0, 256, (300, 400, 3), np.uint8)]
    pictures += [random.random(shape, np.float32) for shape in ((200, 500, 3), (300, 300))]
    start = 0
    for i in range(360):
        image = pictures[i % 3]
        out = airlight.add_light_shafts(image, (0.3 + 0.04 * (i % 10), 0.4), method="radial" if i % 2 else "epipolar", samples=30)
        write_image(tmp_path / "a.png", np.zeros((20, 20, 3), np.float32), overwrite=True)
        read_image(tmp_path / "a.png")
        assert out.shape == image.shape
        if i == 59:
            start = resident()
    grown = resident() / start - 1
    with capsys.disabled():
        print(f"\nmemory: {start >> 20} MiB after 60 pictures, {100 * grown:+.1f} % after 300 more; ", end="")
    assert grown < 0.05
