"""The command line: what it accepts, how it refuses, and what it hands to the library (whose work is stubbed here)."""

import os
import re
import subprocess
import sys
import types
import warnings
from pathlib import Path

import msgspec
import numpy as np
import pytest
from click.testing import CliRunner

import airlight
from airlight.cli import cli, docs, main
from airlight.errors import AirlightError, AirlightWarning, MachineError
from airlight.jobs.light_text import place, read_light
from airlight.options import Look, Parameters, declared, presets
from airlight.scatter.methods import of_screen

ROOT = Path(__file__).parents[1]
COMMAND = [sys.executable, "-m", "airlight"]


def candidate(position, kind="disc", confidence=0.9, guess=False, lamps=()):
    """As airlight.detect finds them."""
    return types.SimpleNamespace(position=position, kind=kind, confidence=confidence, guess=guess, lamps=lamps)


class Stub(types.SimpleNamespace):
    """Stands for airlight.api, airlight.pictures and airlight.detect; remembers what it was asked."""

    def __init__(self) -> None:
        super().__init__(__name__="stub", lights=[], parameters=None, look=None, more={}, raises=None, message="")
        self.found = [candidate((0.25, 0.5)), candidate((0.75, 0.5), "lamps", 0.4)]
        self.ACT, self.ASK = 0.5, 0.2

    def find_lights(self, image, bounded=False):
        return self.found

    def render_picture(self, picture, lights, parameters, composite, **more):
        self.parameters, self.look = parameters, None
        return self.rendered(picture, lights, more)

    def render_look(self, picture, lights, look, **more):
        self.parameters, self.look = None, look
        return self.rendered(picture, lights, more)

    def rendered(self, picture, lights, more):
        if self.raises is not None:
            raise self.raises
        self.lights, self.more = lights, more
        if more["profile"] is not None:
            more["profile"].append(("a pass", 1.5))
        layer = np.full((picture.height, picture.width, 3), 0.25, np.float32)
        changed = np.ones(layer.shape[:2], bool)
        pixels = picture.linear() + layer
        return types.SimpleNamespace(pixels=pixels, layer=layer, changed=changed, encoded=None, held=None, message=self.message)

    def occlusion_fraction(self, image, light, **more):
        return np.full(image.shape[:2], 0.5, np.float32)


@pytest.fixture
def api(monkeypatch):
    stub = Stub()
    for name in ("api", "pictures", "detect"):
        monkeypatch.setitem(sys.modules, f"airlight.{name}", stub)
        monkeypatch.setattr(airlight, name, stub, raising=False)
    return stub


@pytest.fixture
def photo(tmp_path):
    from airlight.files import write_image

    path = tmp_path / "in.png"
    pixels = np.linspace(0, 0.5, 8 * 4 * 3, dtype=np.float32).reshape(4, 8, 3)
    pixels[0, 0] = 0
    write_image(path, pixels)
    return path


def refused(capsys, *args, code=2):
    """The one line with which a command is refused."""
    assert main([str(a) for a in args]) == code
    out, err = capsys.readouterr()
    assert out == "" and err.startswith("airlight: ") and err.count("\n") == 1 and "Traceback" not in err
    return err


def test_every_parameter_is_an_option_with_its_default_and_source():
    known = {option for p in cli.commands["image"].params for option in p.opts}
    assert {p.flag for p in declared()} <= known
    assert {p.name for p in declared(scenes=True)} == set(presets.keys())
    assert len(declared()) >= len(msgspec.structs.fields(Parameters))
    for p in declared():
        assert p.description and p.group != "other", p.name
    text = " ".join(CliRunner().invoke(cli, ["image", "--help-all"], env={"COLUMNS": "300", "TERMINAL_WIDTH": "300"}).output.split())
    assert "[default: 0.97]" in text and "GPU Gems 3, ch. 13, Eq. 4" in text and f"[{'|'.join(of_screen())}]" in text


def test_help_comes_without_the_heavy_imports():
    heavy = "numpy wgpu OpenImageIO PyOpenColorIO"
    code = "import sys; from airlight.cli import main; main(['image', '--help']); "
    code += f"print([m for m in '{heavy}'.split() if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert done.stdout.splitlines()[-1] == "[]", done.stderr


def test_image_passes_on_what_was_asked(api, photo, tmp_path, capsys):
    out, layer, fraction = (tmp_path / name for name in ("out.png", "layer.exr", "fraction.png"))
    args = ["image", photo, "-o", out, "--light", "-0.5,0.4", "--light", "4px,50%;color=1,.5,0;strength=2"]
    args += ["--decay", "0.9", "--method", "radial", "--layer", layer, "--mask", photo, "--mask-invert", "--profile"]
    assert main([str(a) for a in args]) == 0
    assert [light.position for light in api.lights] == [(-0.5, 0.4), (0.5, 0.5)]
    assert api.lights[1].rgb == (2, 1, 0)
    assert api.parameters.threshold < 0.85  # of a dim picture
    assert msgspec.structs.replace(api.parameters, threshold=None, smoothness=None) == Parameters(decay=0.9, method="radial")
    assert api.more["mask"].shape == (4, 8) and api.more["mask"].flat[0] == 1
    assert out.exists() and layer.exists()
    assert "a pass" in capsys.readouterr().err

    assert main(["image", str(photo), "-o", str(fraction), "--light", "0,0", "-y", "--occlusion-fraction", str(tmp_path / "d.png")]) == 0
    assert api.parameters is not None  # that fraction is of the sum
    from airlight.files import read_mask

    assert np.allclose(read_mask(tmp_path / "d.png"), 0.5, atol=1 / 255)


@pytest.mark.parametrize("size", [(3000, 1), (1, 3000), (6000, 2)])
def test_thin_pictures(tmp_path, size):
    from airlight.files import write_image

    write_image(tmp_path / "in.png", np.full((size[1], size[0], 3), 0.5, np.float32))
    assert main(["image", str(tmp_path / "in.png"), "-o", str(tmp_path / "out.png"), "--light", "0.5,0.5"]) == 0


def test_auto_is_the_default_and_tells_where(api, photo, tmp_path, capsys):
    assert main(["image", str(photo), "-o", str(tmp_path / "a.png")]) == 0
    assert capsys.readouterr().err == "light at 0.250,0.500 (2px,2px)\n"
    assert (api.lights[0].position, api.lights[0].kind) == ((0.25, 0.5), "disc") and api.look == Look()


@pytest.mark.parametrize("look", ["smart", "classic"])
def test_no_light_and_no_sure_one_leave_the_picture_as_it_is(api, photo, tmp_path, capsys, look):
    """The line names the cure; nothing failed, so that many pictures in one run are all written."""
    for number, (found, says) in enumerate(
        (
            ([], "no light found, left as it is: give --light X,Y"),
            ([candidate((0.25, 0.5), "opening", 0.19)], "no light found, left as it is: give --light X,Y"),
            (
                [candidate((0.25, 0.5), "opening", 0.3)],
                "unsure, left as it is: perhaps at 0.25,0.50 (opening, 0.30); --light auto:1 takes it",
            ),
        )
    ):
        api.found, out = found, tmp_path / f"{number}.png"
        assert main(["image", str(photo), "-o", str(out), "--look", look]) == 0
        assert capsys.readouterr().err == f"{photo}: {says}\n"
        assert api.lights == [] and out.exists()
    assert main(["image", str(photo), "-o", str(out), "-y", "--look", look, "--light", "auto:1"]) == 0  # the cure that was named
    assert api.lights[0].position == (0.25, 0.5) and (api.look is None) == (look == "classic")


def test_the_next_places_and_several(api, photo, tmp_path, capsys):
    command = ["image", str(photo), "-o", str(tmp_path / "a.png"), "-y", "--light"]
    assert main([*command, "auto:2;strength=2"]) == 0
    assert [(one.position, one.kind, one.strength) for one in api.lights] == [((0.75, 0.5), "lamps", 2)]
    assert main([*command, "auto:5+"]) == 0 and [one.position for one in api.lights] == [(0.25, 0.5), (0.75, 0.5)]
    assert main([*command, "auto:1+"]) == 0 and [one.position for one in api.lights] == [(0.25, 0.5)]
    api.found[0].lamps = ((0.25, 0.5), (0.3, 0.5), (0.35, 0.5))  # they are meant together
    assert main([*command, "auto:2+"]) == 0 and [one.position for one in api.lights] == [(0.25, 0.5), (0.3, 0.5)]
    assert main([*command, "auto;kind=glow"]) == 0 and api.lights[0].kind == "glow"
    capsys.readouterr()
    assert "only 2 places look like a light; --candidates FILE shows them" in refused(capsys, *command, "auto:3")
    api.found[1].guess = True
    assert main([*command, "auto:2"]) == 0
    assert "by a guess: --light X,Y puts it elsewhere" in capsys.readouterr().err


def test_what_the_default_is_given(api, photo, tmp_path, capsys):
    command = ["image", str(photo), "-o", str(tmp_path / "a.png"), "-y", "--light", "0,0"]
    more = ["--strength", "1.5", "--warmth", "-0.5", "--rays", "7", "--quality", "draft", "--mask", str(photo), "--mask-invert"]
    assert main([*command, *more, "--depth", str(photo), "--near-range", "0.1,0.9", "--subject", str(photo), "--wrap", "0.5"]) == 0
    assert api.look == Look(strength=1.5, warmth=-0.5, rays=7, wrap=0.5) and api.more["quality"] == "draft"
    assert api.more["mask"].flat[0] == 1 and api.more["depth"].flat[0] == api.more["subject"].flat[0] == 0
    assert api.more["near_range"] == (0.1, 0.9)
    assert main([*command, "--depth", str(photo), "--no-depth-aware"]) == 0 and api.more["depth"] is None
    api.message = "nothing stands before the light"
    capsys.readouterr()
    assert main(command) == 0 and capsys.readouterr().err == f"{photo}: nothing stands before the light\n"


@pytest.mark.parametrize(
    "more", [["--look", "classic"], ["--samples", "100"], ["--exposure", "1.5"], ["--preset", "classic-soft"], ["--angle", "30"]]
)
def test_options_of_the_sum_ask_for_the_classic_look(api, photo, tmp_path, more):
    assert main(["image", str(photo), "-o", str(tmp_path / "a.png"), "--light", "0,0", *more]) == 0
    assert api.parameters is not None and api.look is None


def test_options_go_before_the_preset(api, photo, tmp_path):
    command = ["image", str(photo), "-o", str(tmp_path / "a.png"), "--preset", "pmndrs", "--decay", "0.97"]
    assert main(command) == 0  # 0.97 is the default: given is given
    assert (api.parameters.decay, api.parameters.samples) == (0.97, 60)


def test_depth_implies_its_occlusion_and_its_near_end(api, photo, tmp_path):
    for near, first in (("black", 0), ("white", 1)):
        command = ["image", str(photo), "-o", str(tmp_path / "a.png"), "-y", "--depth", str(photo), "--depth-near", near]
        assert main([*command, "--look", "classic"]) == 0
        assert api.parameters.occlusion == "depth" and api.more["depth"].flat[0] == first
        assert main(command) == 0  # of the default depths hide shafts
        assert api.look == Look() and api.more["depth"].flat[0] == first


@pytest.mark.parametrize(
    ("args", "says"),
    [
        (["--light", "0.4"], "light position"),
        (["--light", "nan,0"], "light position"),
        (["--light", "0,0;colour=1,1,1"], "colour=1,1,1"),
        (["--light", "0,0;color=1,1"], "3 finite numbers"),
        (["--light", "0,0;strength=-1"], "not negative"),
        (["--light", "0,0;kind=moon"], "there is"),
        (["--light", "auto:0"], "auto:2"),
        (["--light", "auto:x"], "auto:2"),
        (["--light", "automatic"], "auto:2"),
        (["--samples", "0"], "--samples"),
        (["--samples", "ten"], "--samples"),
        (["--decay", "nan"], "decay"),
        (["--scale", "0.3"], "scale"),
        (["--method", "magic"], "--method"),
        (["--sampels", "3"], "--samples"),
        (["--preset", "nosuch"], "nosuch"),
        (["--mask-invert"], "--mask"),
        (["--depth-near", "white"], "--depth"),
        (["--occlusion", "depth"], "--depth"),
        (["-y", "-n"], "exclude"),
        (["--layer", "OUT"], "two outputs"),
        (["--mask", "OUT.nosuch"], "OUT.nosuch"),
        (["--layer", "layer.xyz"], ".xyz"),
    ],
)
def test_bad_values_are_refused_in_one_line(api, photo, tmp_path, capsys, args, says):
    out = tmp_path / "out.png"
    assert says in refused(capsys, "image", photo, "-o", out, *[str(out) if a == "OUT" else a for a in args])
    assert not out.exists()


def test_missing_and_unknown_things(api, photo, tmp_path, capsys):
    line = refused(capsys, "image", photo)
    assert "-o FILE" in line and "--candidates FILE" in line
    assert "IN" in refused(capsys, "image", "-o", tmp_path / "a.png")
    assert "nosuch.png" in refused(capsys, "image", tmp_path / "nosuch.png", "-o", tmp_path / "a.png")
    assert "nosuch" in refused(capsys, "nosuch")


def test_an_existing_output_is_kept(api, photo, tmp_path, capsys):
    out = tmp_path / "out.png"
    out.write_bytes(b"mine")
    command = ["image", str(photo), "-o", str(out), "--light", "0,0"]
    assert "--overwrite" in refused(capsys, *command)
    assert main([*command, "-n"]) == 0 and out.read_bytes() == b"mine"
    assert "skipped" in capsys.readouterr().err
    assert main([*command, "-y"]) == 0 and out.read_bytes() != b"mine"
    assert "input" in refused(capsys, "image", photo, "-o", photo, "-y")


@pytest.mark.parametrize(
    ("error", "code", "says"),
    [
        (AirlightError("bad\nthing"), 2, "bad thing"),
        (MachineError("no adapter"), 1, "no adapter"),
        (RuntimeError("odd"), 1, "unexpected RuntimeError: odd (please report; AIRLIGHT_TRACEBACK=1 shows the trace)"),
        (MemoryError(), 1, "not enough memory"),
        (KeyboardInterrupt(), 130, "stopped"),
    ],
)
def test_failures_are_one_line(api, photo, tmp_path, capsys, error, code, says):
    api.raises = error
    assert says in refused(capsys, "image", photo, "-o", tmp_path / "a.png", "--light", "0,0", code=code)


def test_warnings_are_one_line(api, photo, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(api, "find_lights", lambda *image: warnings.warn("mended\n3 pixels", AirlightWarning, stacklevel=1), raising=False)
    main(["image", str(photo), "-o", str(tmp_path / "a.png")])
    assert capsys.readouterr().err.splitlines()[0] == "airlight: warning: mended 3 pixels"


def test_positions_count_in_the_display_window():
    picture = types.SimpleNamespace(width=50, height=50, data_window=(20, 10, 50, 50), display_window=(10, 10, 100, 100))
    assert place(read_light("0.1,0"), picture, "top").position == (0, 0)
    assert place(read_light("60px,50px"), picture, "top").position == (1, 1)
    assert place(read_light("10%,100%"), picture, "bottom").position == (0, 0)


def test_info_without_an_adapter_says_how_to_get_one(monkeypatch, capsys):
    from airlight.gpu import device

    monkeypatch.setattr(device, "adapters", lambda: [])
    assert main(["info"]) == 0
    out = capsys.readouterr().out
    assert device.cure() in out and "numpy:" in out


def test_info_of_a_scene_says_where_its_things_lie(capsys):
    pytest.importorskip("pygfx")
    assert main(["info", "slats"]) == 0
    lines = dict(line.split(":", 1) for line in capsys.readouterr().out.splitlines())
    assert re.fullmatch(r" +5.98 m around [-\d.,]+; \d+ things?", lines["scene"])
    low, high = ([float(v) for v in place.split(",")] for place in lines["bounds"].split(" to "))
    assert all(a < b for a, b in zip(low, high, strict=True)) and lines["light"].strip() == "a spot, at -5.4,4,-0.9"
    assert main(["info", "slat"]) == 2 and "did you mean 'slats'" in capsys.readouterr().err


def test_no_command_shows_the_help_and_list_presets_needs_no_picture(capsys):
    assert main([]) == 0 and "image" in capsys.readouterr().out
    assert main(["image", "--list-presets"]) == 0 and "pmndrs" in capsys.readouterr().out


@pytest.mark.skipif(os.name == "nt", reason="a shell's redirections")
@pytest.mark.parametrize(("redirection", "code"), [("2>&1 >&-", 0), (">/dev/full", 1), ("| true", None)])
def test_odd_outputs(redirection, code):
    """Closed, full and broken stdout: no traceback, no noise at exit; ASCII as the only encoding throughout."""
    if "/dev/full" in redirection and not os.path.exists("/dev/full"):
        pytest.skip("no /dev/full")
    environment = {**os.environ, "LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
    command = ["sh", "-c", f'"$@" image --list-presets {redirection}', "sh", *COMMAND]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, env=environment)
    assert code is None or done.returncode == code
    assert done.stderr.count("\n") <= 1 and "Traceback" not in done.stderr and "Exception ignored" not in done.stderr


def test_a_stop_before_the_command_begins(monkeypatch, capsys):
    from airlight import __main__ as program

    def stop(*_: object) -> None:
        raise KeyboardInterrupt

    for name in ("prepare_process", "supervised"):
        monkeypatch.setattr(program, name, stop)
        assert program.main() == 130 and capsys.readouterr().err == f"airlight: {program.STOPPED}\n"
        monkeypatch.setattr(program, name, lambda *_: None)
    if sys.platform != "linux":  # there is no child elsewhere
        return
    text = "from airlight.process.supervisor import supervised\ndef stop(): raise KeyboardInterrupt\nraise SystemExit(supervised(stop))"
    done = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stderr) == (130, f"airlight: {program.STOPPED}\n")


def test_the_page_of_parameters_is_up_to_date():
    page = (ROOT / "docs" / "parameters.md").read_text(encoding="utf-8")
    assert page == docs.page(), "run `python -m airlight.cli.docs`"
