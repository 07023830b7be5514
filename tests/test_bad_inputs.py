"""Whatever a user hands to `airlight image`: one line and exit code 2 (1 where the machine is at fault), or the right picture."""

import os
import struct
import subprocess
import sys
import zlib

import fuzzing
import numpy as np
import OpenImageIO as oiio
import pytest
import thumbs
from fuzzing import HEIGHT, WIDTH, mended_png, png_chunk, seeds

from airlight.cli import main
from airlight.errors import AirlightWarning
from airlight.files import read_image, write_image

COMMAND = [sys.executable, "-m", "airlight"]
BLACK = np.zeros((HEIGHT, WIDTH, 3), np.float32)
LIGHT = ["--light", "0.4,0.3", "--rays", "24"]  # in noise and black nothing else stands before the light, which is told


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """A folder with every seed of the fuzzer."""
    folder = tmp_path_factory.mktemp("seeds")
    seeds(folder)
    return folder


def run(capsys, *args):
    """(exit code, lines on stderr but where the light is) of `airlight image`."""
    code = main(["image", *map(os.fsdecode, args)])
    out, error = capsys.readouterr()
    assert out == "" and "Traceback" not in error
    return code, [line for line in error.splitlines() if not line.startswith("light at")]


def refused(capsys, folder, *args):
    """The line with which it is refused; nothing is written."""
    before = sorted(os.listdir(os.fsencode(folder)))
    code, lines = run(capsys, *args)
    assert code == 2 and len(lines) == 1 and lines[0].startswith("airlight: "), (code, lines)
    assert sorted(os.listdir(os.fsencode(folder))) == before
    return lines[0]


def stored(path, pixels, kind="float", **attributes):
    """A picture as it is, by OpenImageIO: (H, W, C)."""
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], kind)
    for name, value in attributes.items():
        setattr(spec, name, value)
    out = oiio.ImageOutput.create(str(path))
    assert out.open(str(path), spec) and out.write_image(pixels) and out.close(), out.geterror()
    return path


def huge_png(path, width=20_000, height=20_000):
    """Some 48 KB that decode to 400 megapixels of black."""
    pack = zlib.compressobj(9)
    rows = b"\0" * (1 + width // 8)
    body = b"".join(pack.compress(rows) for _ in range(height)) + pack.flush()
    header = struct.pack(">IIBBBBB", width, height, 1, 0, 0, 0, 0)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(png_chunk(*c) for c in ((b"IHDR", header), (b"IDAT", body), (b"IEND", b""))))
    return path


EACH = "rgb8.png palette.png plain.jpg zip8.tif tiled.tif exact.webp zip.exr tiled.exr rle.hdr rgb.bmp one.gif rgb.ppm one.jxl one.jp2"


@pytest.mark.parametrize("name", EACH.split())
def test_truncated_and_corrupt(files, tmp_path, capsys, name):
    whole = (files / name).read_bytes()
    random = np.random.default_rng(1)
    for what, data in {
        "cut": whole[: len(whole) // 2],
        "head": whole[:16],
        "noise": whole[:9] + random.bytes(len(whole)),
    }.items():
        path = tmp_path / f"{what}-{name}"
        path.write_bytes(data)
        assert str(path) in refused(capsys, tmp_path, path, "-o", tmp_path / "out.png")


def test_no_pictures(tmp_path, capsys):
    out = tmp_path / "out.png"
    (tmp_path / "empty.png").touch()
    (tmp_path / "folder.png").mkdir()
    if hasattr(os, "mkfifo"):
        os.mkfifo(tmp_path / "pipe.png")
        assert "regular file" in refused(capsys, tmp_path, tmp_path / "pipe.png", "-o", out)
    assert "is empty" in refused(capsys, tmp_path, tmp_path / "empty.png", "-o", out)
    assert "folder" in refused(capsys, tmp_path, tmp_path / "folder.png", "-o", out)
    assert huge_png(tmp_path / "huge.png").stat().st_size < 60_000
    assert "20000x20000" in refused(capsys, tmp_path, tmp_path / "huge.png", "-o", out)
    for option in ("--mask", "--depth", "--preset"):
        assert "huge.png" in refused(capsys, tmp_path, tmp_path / "huge.png", "-o", out, option, tmp_path / "huge.png")


@pytest.mark.timeout(40)
def test_rows_that_are_missing(files, tmp_path, capsys):
    """A header that claims 300,000 rows: what is there is looked for in seconds, and the size is refused by the adapter."""
    data = (files / "rgba16.png").read_bytes()
    (tmp_path / "a.png").write_bytes(mended_png(data[:20] + struct.pack(">I", 300_000) + data[24:]))
    line = refused(capsys, tmp_path, tmp_path / "a.png", "-o", tmp_path / "b.png", "--light", "0.4,0.3", "--on-damage", "ignore")
    assert "300000" in line


def test_a_wrong_extension_does_not_matter(files, tmp_path, capsys):
    """What a file is stands in its first bytes."""
    right, wrong = tmp_path / "right.png", tmp_path / "wrong.png"
    (tmp_path / "a.jpg").write_bytes((files / "rgb8.png").read_bytes())
    assert run(capsys, files / "rgb8.png", "-o", right, *LIGHT) == (0, [])
    assert run(capsys, tmp_path / "a.jpg", "-o", wrong, *LIGHT) == (0, [])
    assert right.read_bytes() == wrong.read_bytes()


@pytest.mark.skipif(os.name == "nt", reason="permissions of POSIX")
def test_permissions(files, tmp_path):
    """A file that may not be read, a folder that may not be written to: as a user without privileges, in a process of its own."""
    secret, closed = tmp_path / "secret.png", tmp_path / "closed"
    secret.write_bytes((files / "rgb8.png").read_bytes())
    secret.chmod(0)
    closed.mkdir()
    closed.chmod(0o555)
    tmp_path.chmod(0o777)
    for folder in {files, *files.parents, *tmp_path.parents}:  # pytest's are its own alone
        if not folder.stat().st_mode & 0o001:
            folder.chmod(folder.stat().st_mode | 0o001)
    # root may do everything, so it becomes somebody else, once all modules that lie in its own folders are loaded
    nobody = "import os, sys; from airlight.cli import main; main(['image', sys.argv[1], '-o', sys.argv[2]]); "
    nobody += "os.getuid() or (os.setgroups([]), os.setgid(65534), os.setuid(65534)); sys.exit(main(sys.argv[3:]))"
    warm = (files / "rgb8.png", tmp_path / "warm.png")
    for args, says in (
        ((secret, "-o", tmp_path / "a.png"), "not readable"),
        ((files / "rgb8.png", "-o", closed / "a.png"), "cannot be written to"),
    ):
        (tmp_path / "warm.png").unlink(missing_ok=True)
        done = subprocess.run([sys.executable, "-c", nobody, *warm, "image", *args], capture_output=True, text=True, timeout=60)
        light, *said = done.stderr.splitlines()
        assert light.startswith(f"{files / 'rgb8.png'}: no light found"), done.stderr
        assert done.returncode == 2 and len(said) == 1 and says in said[0], done.stderr
    assert not list(closed.iterdir()) and not (tmp_path / "a.png").exists()


# ---------------------------------------------------------------- odd pixels


def lit():
    """(H, W, 3): dark, with a bright block around the light at 0.4,0.3."""
    pixels = np.full((60, 80, 3), 0.05, np.float32)
    pixels[14:22, 28:36] = 4
    return pixels


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("place", [(40, 60), (0, 0), (18, 32)])
@pytest.mark.parametrize("kind", ["half", "float"])
def test_one_bad_pixel_spoils_nothing_outside_its_neighbourhood(tmp_path, capsys, bad, place, kind):
    """Of the sum, against the picture in which the pixel is what it is mended to."""
    y, x = place
    pixels = lit()
    pixels[y, x] = 0.05 if y != 18 else 4  # the mean of its neighbours
    stored(tmp_path / "good.exr", pixels, kind)
    pixels[y, x, 1:] = bad
    stored(tmp_path / "bad.exr", pixels, kind)
    classic = ["--light", "0.4,0.3", "--look", "classic"]
    assert run(capsys, tmp_path / "good.exr", "-o", tmp_path / "a.exr", "--layer", tmp_path / "la.exr", *classic) == (0, [])
    code, lines = run(capsys, tmp_path / "bad.exr", "-o", tmp_path / "b.exr", "--layer", tmp_path / "lb.exr", *classic)
    assert code == 0 and len(lines) == 1 and f"x={x}, y={y}" in lines[0]
    for one, other in (("a", "b"), ("la", "lb")):
        good, mended = (read_image(tmp_path / f"{name}.exr").codes for name in (one, other))
        assert np.isfinite(mended).all() and good.max() > 0.1
        outside = np.ones(good.shape[:2], bool)
        outside[max(y - 1, 0) : y + 2, max(x - 1, 0) : x + 2] = False
        np.testing.assert_array_equal(good[outside], mended[outside])


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("place", [(40, 60), (0, 0), (27, 50)])
@pytest.mark.parametrize("kind", ["half", "float"])
def test_one_bad_pixel_is_mended_before_the_default_looks(tmp_path, capsys, bad, place, kind):
    """All is finite, and as if the pixel had been what it is mended to."""
    y, x = place
    pixels = thumbs.linear().copy()
    pixels[y, x, 1:] = bad
    stored(tmp_path / "bad.exr", pixels, kind)
    with pytest.warns(AirlightWarning, match="mended"):
        stored(tmp_path / "good.exr", read_image(tmp_path / "bad.exr").linear(), kind)
    assert run(capsys, tmp_path / "good.exr", "-o", tmp_path / "a.exr", "--layer", tmp_path / "la.exr") == (0, [])
    code, lines = run(capsys, tmp_path / "bad.exr", "-o", tmp_path / "b.exr", "--layer", tmp_path / "lb.exr")
    assert code == 0 and len(lines) == 1 and f"x={x}, y={y}" in lines[0]
    layer = read_image(tmp_path / "la.exr").codes
    for one, other in (("a", "b"), ("la", "lb")):
        good, mended = (read_image(tmp_path / f"{name}.exr").codes for name in (one, other))
        assert np.isfinite(mended).all() and layer.max() > 0.1
        np.testing.assert_allclose(good, mended, atol=0.005 * layer.max())  # but for the half that it was written as


def test_too_many_bad_pixels(tmp_path, capsys):
    pixels = lit()
    pixels[:2] = np.nan
    stored(tmp_path / "a.exr", pixels, "half")
    assert "1 %" in refused(capsys, tmp_path, tmp_path / "a.exr", "-o", tmp_path / "b.exr")


@pytest.mark.parametrize("extension", ["exr", "hdr", "png", "tif"])
def test_pixels_beyond_half_and_below_nothing(tmp_path, capsys, extension):
    """65504 is the most that emits and that a half holds; negative pixels stay where the format can, and do not emit."""
    shafts = []
    for most in (65504.0, 1e9, 3e38):
        pixels = lit()
        pixels[18, 32] = most
        pixels[50, 70] = (-3.0, -1e9, 0.0)
        stored(tmp_path / "a.tif", pixels)
        out = tmp_path / f"out.{extension}"
        assert run(capsys, tmp_path / "a.tif", "-o", out, "-y", "--light", "0.4,0.3", "--layer", tmp_path / "l.exr", "--mix", "1")[0] == 0
        written = read_image(out)
        assert np.isfinite(written.codes).all()
        shafts.append(read_image(tmp_path / "l.exr").codes)
        if extension == "exr":
            assert written.codes.max() == 65504 and written.codes.min() == -65504
            assert written.codes[50, 70, 0] == pytest.approx(shafts[-1][50, 70, 0] - 3, rel=1e-3)
    np.testing.assert_array_equal(shafts[0], shafts[1])
    np.testing.assert_array_equal(shafts[0], shafts[2])
    assert shafts[0].min() >= 0 and shafts[0].max() > 0.1


@pytest.mark.parametrize("shape", [(1, 1), (2, 3), (1, 37), (37, 1), (3, 2)])
@pytest.mark.parametrize("more", [[], ["--rays", "24"], ["--quality", "draft", "--mist", "1", "--shade", "1"]])
def test_tiny_pictures_of_every_kind_by_default(tmp_path, capsys, shape, more):
    """Grey, colour, transparent; 8 bits, 16, half, float: a picture of the same size, and at most a line of what is not to be seen."""
    random = np.random.default_rng(1)
    for extension, kind, channels in (
        (".png", "uint8", 1),
        (".png", "uint8", 4),
        (".tif", "uint16", 3),
        (".exr", "half", 3),
        (".exr", "float", 4),
        (".hdr", "float", 3),
    ):
        most = {"uint8": 255, "uint16": 65535}.get(kind, 4.0)
        pixels = (random.random((*shape, channels)) * most).astype(kind.replace("half", "float32"))
        source, out = stored(tmp_path / f"in{extension}", pixels, kind), tmp_path / f"out{extension}"
        for light in ("0.5,0.5", "-3,0.2", "0,0", "auto", "auto:1+"):
            code, lines = run(capsys, source, "-o", out, "-y", "--light", light, *more)
            assert code == 0 and len(lines) <= 1 and all(line.startswith((f"{source}: ", "beyond the picture")) for line in lines), lines
            made, before = read_image(out), read_image(source)
            assert made.codes.shape == before.codes.shape and made.codes.dtype == before.codes.dtype
            assert np.isfinite(made.codes).all()
            if any("left as it is" in line for line in lines):
                np.testing.assert_array_equal(made.codes, before.codes)


@pytest.mark.parametrize("shape", [(1, 1), (1, 37), (37, 1), (2, 2)])
@pytest.mark.parametrize("method", ["epipolar", "radial"])
def test_tiny_pictures(tmp_path, capsys, shape, method):
    for extension, kind in ((".png", "uint8"), (".exr", "half")):
        pixels = np.full((*shape, 3), 200 if kind == "uint8" else 2.0, kind.replace("half", "float32"))
        source, out = stored(tmp_path / f"in{extension}", pixels, kind), tmp_path / f"out{extension}"
        for light in ("0.5,0.5", "-3,0.2", "0,0"):
            more = ["--method", method, "--occlusion", "none", "--blend", "add"]
            code, lines = run(capsys, source, "-o", out, "-y", "--light", light, *more)
            assert (code, lines) == (0, [])
            made = read_image(out).linear()
            assert made.shape == (*shape, 3) and np.isfinite(made).all()
            assert (made >= read_image(source).linear() - 1e-3).all() and made.max() > read_image(source).linear().max()


def test_channels(files, tmp_path, capsys):
    """Grey, two and five channels, palette, CMYK, several parts."""
    out = tmp_path / "out.png"
    five = fuzzing.picture(5, "float")
    stored(tmp_path / "five.exr", five, "half", channelnames=("R", "G", "B", "A", "Z"))
    stored(tmp_path / "two.png", fuzzing.picture(2, "uint8"), "uint8", alpha_channel=1)
    stored(tmp_path / "five.tif", fuzzing.picture(5, "uint8"), "uint8")
    for source, channels, warns in (
        (files / "grey.png", 1, ""),
        (tmp_path / "two.png", 2, ""),
        (tmp_path / "five.exr", 4, "Z"),
        (tmp_path / "five.tif", 4, "cannot be kept"),
        (files / "palette.png", 4, ""),
        (files / "cmyk.tif", 3, "CMYK"),
        (files / "parts.exr", 3, "second.R"),
    ):
        for target in (out, tmp_path / "out.webp", tmp_path / "out.hdr", tmp_path / "out.exr", tmp_path / "out.jpg"):
            code, lines = run(capsys, source, "-o", target, "-y", *LIGHT)
            assert code == 0, lines
            assert all("warning" in line for line in lines), lines
            assert read_image(target).codes.shape[:2] == (HEIGHT, WIDTH)
            if target == out:
                assert read_image(target).codes.shape[2] == channels, (source, read_image(target).codes.shape)
                assert any(warns in line for line in lines) if warns else not lines, lines
    assert "deep" in refused(capsys, tmp_path, files / "deep.exr", "-o", tmp_path / "deep.png")


def test_a_gif_with_transparency(tmp_path, capsys):
    """OpenImageIO says of it that its alpha is the fifth of four channels."""
    stored(tmp_path / "a.gif", fuzzing.picture(4, "uint8"), "uint8")
    assert run(capsys, tmp_path / "a.gif", "-o", tmp_path / "a.png", "--light", "0.4,0.3")[0] == 0


def test_exr_text_that_is_not_utf_8(tmp_path, capsys):
    pixels = fuzzing.picture(3, "half")
    spec = oiio.ImageSpec(WIDTH, HEIGHT, 3, "half")
    spec.attribute("Copyright", "someone")
    spec.attribute("Software!", "something")
    out = oiio.ImageOutput.create("openexr")
    assert out.open(str(tmp_path / "a.exr"), spec) and out.write_image(pixels) and out.close()
    data = (tmp_path / "a.exr").read_bytes()
    assert b"someone" in data and b"Software!" in data
    (tmp_path / "a.exr").write_bytes(data.replace(b"someone", b"s\xf6meone").replace(b"Software!", b"Softw\xe4re!"))
    assert run(capsys, tmp_path / "a.exr", "-o", tmp_path / "b.exr", *LIGHT) == (0, [])


def test_16k_wide(tmp_path, capsys):
    """As wide as software Vulkan can, and wider: a picture, or a line that says the limit."""
    from airlight.gpu.device import open_device

    side = open_device().max_side
    for width in (16_000, side + 1):
        source = stored(tmp_path / f"{width}.png", np.full((4, width, 3), 90, np.uint8), "uint8")
        out = tmp_path / f"out{width}.png"
        if width + 2 > side:
            assert str(side - 2) in refused(capsys, tmp_path, source, "-o", out, "--light", "0.5,0.5")
        else:
            for look in (["--occlusion", "none"], ["--rays", "24"]):
                assert run(capsys, source, "-o", out, "-y", "--light", "0.5,0.5", *look)[0] == 0
                assert read_image(out).codes.shape == (4, width, 3)


# ---------------------------------------------------------------- names, numbers, files beside


@pytest.mark.skipif(os.name == "nt", reason="names of POSIX")
@pytest.mark.parametrize(
    "name",
    [b"with spaces \t and\nlines.png", b"\xff\xfe\x80.png", "λ—日本.png".encode(), b"n" * 251 + b".png", b"-dash.png", b";'\"$&.png"],
)
def test_odd_names(files, tmp_path, capsys, name):
    source, out = os.fsencode(tmp_path) + b"/" + name, os.fsencode(tmp_path) + b"/out/" + name
    (tmp_path / "out").mkdir()
    with open(source, "wb") as file:
        file.write((files / "rgb8.png").read_bytes())
    assert run(capsys, source, "-o", out, *LIGHT) == (0, [])
    assert os.listdir(os.fsencode(tmp_path / "out")) == [name]
    assert read_image(out).codes.shape == (HEIGHT, WIDTH, 3)
    assert "exists already" in refused(capsys, tmp_path / "out", source, "-o", out)  # and says so in one line


@pytest.mark.parametrize(
    ("args", "says"),
    [
        (["--light", ""], "light position"),
        (["--light", "inf,0"], "light position"),
        (["--light", "0.1,0.2,0.3"], "light position"),
        (["--light", "1e7,0"], "too far"),
        (["--light", "1e999,0"], "finite"),
        (["--light", "0,0;strength=nan"], "finite"),
        (["--light", "0,0;color=1,nan,1"], "finite"),
        (["--light", "0,0;color=a,b,c"], "numbers"),
        (["--light", "0,0;strength=1e39"], "light"),
        (["--samples", "-5"], "--samples"),
        (["--samples", "1000000"], "--samples"),
        (["--samples", "9" * 400], "--samples"),
        (["--decay", "0"], "--decay"),
        (["--decay", "1.01"], "--decay"),
        (["--decay", "-1"], "--decay"),
        (["--density", "0"], "--density"),
        (["--density", "inf"], "--density"),
        (["--exposure", "inf"], "--exposure"),
        (["--weight", "nan"], "'--weight': 'nan' is no number: give one ≥ 0, ≤ 1e+06"),
        (["--threshold", "nan"], "'--threshold': 'nan' is no number: give one ≥ 0, ≤ 65504"),
        (["--device", "nosuch"], "nosuch"),
        (["--occlusion", "alpha"], "alpha"),
        (["--output", "out.xyz"], ".xyz"),
        (["--output", "out"], "extension"),
        (["--output", "nosuch/out.png"], "nosuch"),
        (["--output", ""], "file name"),
        (["--mask", "none.png"], "none.png"),
        (["--mask", "small.png"], "mask"),
        (["--depth", "small.png"], "depth"),
        (["--preset", "unknown.toml"], "'samplez'"),
        (["--preset", "typed.toml"], "samples"),
        (["--preset", "list.toml"], "decay"),
        (["--preset", "nan.toml"], "decay"),
        (["--preset", "torn.toml"], "TOML"),
        (["--preset", "folder.toml"], "folder.toml"),
        (["--preset", "none.toml"], "none.toml"),
    ],
)
def test_bad_numbers_and_files(files, tmp_path, capsys, monkeypatch, args, says):
    monkeypatch.chdir(tmp_path)
    write_image("small.png", BLACK[:5])
    for name, text in {
        "unknown": "samplez = 3",
        "typed": 'samples = "many"',
        "list": "decay = [0.9]",
        "nan": "decay = nan",
        "torn": "decay = ",
    }.items():
        (tmp_path / f"{name}.toml").write_text(text)
    (tmp_path / "folder.toml").mkdir()
    light = [] if "--light" in args else ["--light", "0.4,0.3"]
    assert says in refused(capsys, tmp_path, files / "rgb8.png", "-o", "out.png", *light, *args)


def test_the_input_is_never_the_output(files, tmp_path, capsys):
    source = tmp_path / "in.png"
    source.write_bytes((files / "rgb8.png").read_bytes())
    os.link(source, tmp_path / "hard.png")
    os.symlink(source, tmp_path / "soft.png")
    (tmp_path / "folder").mkdir()
    for name in ("in.png", "hard.png", "soft.png", "folder/../in.png"):
        assert "input" in refused(capsys, tmp_path, source, "-o", tmp_path / name, "-y")
        assert "input" in refused(capsys, tmp_path, source, "-o", tmp_path / "out.png", "-y", "--layer", tmp_path / name)
        assert "input" in refused(capsys, tmp_path, files / "rgb8.png", "-o", tmp_path / name, "-y", "--mask", source)
    assert source.read_bytes() == (files / "rgb8.png").read_bytes()


def test_two_runs_to_one_output(files, tmp_path):
    """Both at once: one writes its picture, the other says that it exists; with -y both, and the file is whole."""
    source, out = files / "rgb8.png", tmp_path / "out.png"
    command = [*COMMAND, "image", str(source), "-o", str(out), *LIGHT]
    for more, codes in (([], [0, 2]), (["-y"], [0, 0])):
        both = [subprocess.Popen([*command, *more], stderr=subprocess.PIPE, text=True) for _ in range(2)]
        said = [process.communicate(timeout=100)[1] for process in both]
        assert sorted(process.returncode for process in both) == codes, said
        assert "".join(said).count("exists already") == codes.count(2) and "".join(said).count("\n") == codes.count(2)
        assert [p.name for p in tmp_path.iterdir()] == ["out.png"] and read_image(out).codes.shape == (HEIGHT, WIDTH, 3)


@pytest.mark.skipif(os.name == "nt", reason="a shell's redirections")
def test_a_plain_environment(files, tmp_path):
    """LC_ALL=C, stdin, stdout and stderr closed or read-only: the same picture."""
    made = []
    name = os.fsencode(tmp_path) + "/grün.png".encode()
    for redirection in ("", "<&- >&- 2>&-", ">/dev/full 2>/dev/full"):
        shell = f'"$@" {redirection}'
        environment = {**os.environ, "LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
        command = ["sh", "-c", shell, "sh", *COMMAND, "image", str(files / "rgb8.png"), "-o", name, "-y", *LIGHT]
        done = subprocess.run(command, capture_output=True, env=environment, timeout=60)
        assert (done.returncode, done.stdout, done.stderr) == (0, b"", b""), redirection
        with open(name, "rb") as file:
            made.append(file.read())
    assert len(set(made)) == 1


@pytest.mark.skipif(os.name == "nt", reason="a pipe's reader that goes")
def test_help_into_a_closed_pipe_and_completion():
    """click ends both by SystemExit, which is no failure of a library."""
    reader, writer = os.pipe()
    os.close(reader)
    done = subprocess.run([*COMMAND, "image", "--help"], stdout=writer, stderr=subprocess.PIPE, timeout=60)
    os.close(writer)
    assert (done.returncode, done.stderr) == (1, b"")
    environment = {**os.environ, "COMP_WORDS": "airlight image --me", "COMP_CWORD": "2", "_AIRLIGHT_COMPLETE": "bash_complete"}
    done = subprocess.run(COMMAND, capture_output=True, env=environment, timeout=60)
    assert (done.returncode, done.stdout, done.stderr) == (0, b"plain,--method\n", b"")
