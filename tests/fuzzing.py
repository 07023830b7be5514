"""Mutated files through the real command line: seeds, mutations, and the worker process that tries them. Used by test_fuzz.py."""

import io
import json
import os
import queue
import random
import re
import select
import shutil
import struct
import subprocess
import sys
import threading
import time
import zlib
from collections.abc import Iterator
from importlib import resources
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
from colour_files import seeds as colour_seeds
from picture_files import bmp_of_runs
from PIL import Image

WIDTH, HEIGHT = 24, 18
HANG = 20  # seconds
MEMORY = 2 << 20  # KiB beyond what the process has once its device is open
OUTPUTS = (".png", ".exr", ".tif", ".jpg", ".webp", ".hdr", ".dpx", ".jxl", ".avif")
Mutant = tuple[str, bytes, list[str]]  # name of the file, its bytes, further arguments ("FILE" is the file, where it is not the picture)


def picture(channels: int = 3, kind: str = "uint8") -> np.ndarray:
    """(HEIGHT, WIDTH, channels): a bright spot before a gradient, some noise."""
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    spot = np.exp(-((x - 8) ** 2 + (y - 5) ** 2) / 6)
    value = 0.1 + 0.02 * x + 0.6 * spot + 0.05 * np.random.default_rng(2).random((HEIGHT, WIDTH))
    pixels = np.stack([value * (1 - 0.1 * c) for c in range(channels)], axis=-1).clip(0, 1).astype(np.float32)
    return pixels if kind in ("half", "float") else np.rint(pixels * np.iinfo(kind).max).astype(kind)


def store(path: Path, channels: int = 3, kind: str = "uint8", names: str = "", tile: int = 0, **attributes: object) -> None:
    """A picture by OpenImageIO. names: of the channels, parted by blanks; `__` in attributes stands for a colon."""
    spec = oiio.ImageSpec(WIDTH, HEIGHT, channels, kind)
    if names:
        spec.channelnames = tuple(names.split())
    if tile:
        spec.tile_width = spec.tile_height = tile
    for name, value in attributes.items():
        kind_of = (f"string[{len(value)}]",) if isinstance(value, tuple) else ()
        spec.attribute(name.replace("__", ":"), *kind_of, value)
    out = oiio.ImageOutput.create(str(path))
    assert out is not None and out.open(str(path), spec), (path, oiio.geterror(), out and out.geterror())
    assert out.write_image(picture(channels, kind)) and out.close(), (path, out.geterror())
    out.geterror()


def deep_exr(path: Path) -> None:
    """Two samples a pixel."""
    spec = oiio.ImageSpec(WIDTH, HEIGHT, 5, "float")
    spec.channelnames, spec.deep = ("R", "G", "B", "A", "Z"), True
    data = oiio.DeepData()
    data.init(WIDTH * HEIGHT, 5, oiio.TypeDesc("float"), spec.channelnames)
    for pixel in range(WIDTH * HEIGHT):
        data.set_samples(pixel, 2)
        for sample in range(2):
            for channel in range(5):
                data.set_deep_value(pixel, channel, sample, 0.25 + sample)
    out = oiio.ImageOutput.create("openexr")
    assert out.open(str(path), spec) and out.write_deep_image(data) and out.close(), out.geterror()


def parts_exr(path: Path) -> None:
    """Two parts."""
    specs = []
    for name in ("beauty", "second"):
        spec = oiio.ImageSpec(WIDTH, HEIGHT, 3, "half")
        spec.attribute("oiio:subimagename", name)
        specs.append(spec)
    out = oiio.ImageOutput.create("openexr")
    assert out.open(str(path), tuple(specs)) and out.write_image(picture(3, "half")), out.geterror()
    assert out.open(str(path), specs[1], "AppendSubimage") and out.write_image(picture(3, "half")) and out.close(), out.geterror()


def mattes_exr(path: Path) -> None:
    """A stereo picture with a Cryptomatte."""
    names = "R G B right.R right.G right.B crypto00.R crypto00.G crypto00.B crypto00.A"
    held = {"name": "crypto", "hash": "MurmurHash3_32", "manifest": '{"tree": "3f800000", "rock": "12345678"}'}
    attributes = {f"cryptomatte/1234567/{key}": value for key, value in held.items()}
    store(path, 10, "float", names=names, compression="none", multiView=("left", "right"), **attributes)


def avif() -> bytes:
    held = io.BytesIO()
    Image.fromarray(picture(4, "uint8")).save(held, "AVIF", quality=80)
    return held.getvalue()


def jpeg_of_a_camera() -> bytes:
    """A photograph that says when, where and by which lens it was taken."""
    said, held = Image.Exif(), io.BytesIO()
    said.get_ifd(0x8769).update({0x9003: "2026:06:21 19:30:05", 0x9011: "+02:00", 0xA405: 24})
    place = {1: "N", 2: (47.0, 25.0, 12.0), 3: "E", 4: (10.0, 58.0, 48.0), 5: b"\0", 6: 2962.0, 7: (17.0, 30.0, 5.0), 29: "2026:06:21"}
    said.get_ifd(0x8825).update(place)
    Image.fromarray(picture(3, "uint8")).save(held, "JPEG", quality=90, exif=said)
    return held.getvalue()


def png_chunk(name: bytes, body: bytes) -> bytes:
    return struct.pack(">I", len(body)) + name + body + struct.pack(">I", zlib.crc32(name + body))


def palette_png() -> bytes:
    header = struct.pack(">IIBBBBB", WIDTH, HEIGHT, 4, 3, 0, 0, 0)
    rows = np.random.default_rng(3).integers(0, 256, (HEIGHT, WIDTH // 2), dtype=np.uint8)
    body = zlib.compress(b"".join(b"\0" + row.tobytes() for row in rows))
    colours = bytes(range(0, 240, 5))
    chunks = ((b"IHDR", header), (b"PLTE", colours), (b"tRNS", bytes(range(0, 160, 10))), (b"IDAT", body), (b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(png_chunk(*chunk) for chunk in chunks)


def seeds(folder: Path) -> dict[str, bytes]:
    """Small files of every format that is read, by name; all of the size WIDTH x HEIGHT. What OpenImageIO cannot write is made by hand."""
    store(folder / "rgb8.png")
    store(folder / "rgba16.png", 4, "uint16", ImageDescription="a seed", XResolution=300.0)
    store(folder / "grey.png", 1)
    (folder / "palette.png").write_bytes(palette_png())
    store(folder / "plain.jpg", Orientation=6, Make="seed", Exif__FNumber=2.0)
    store(folder / "progressive.jpg", jpeg__progressive=1, jpeg__subsampling="4:2:0")
    store(folder / "zip8.tif", compression="zip", tiff__RowsPerStrip=4)
    store(folder / "lzw16.tif", 4, "uint16", compression="lzw")
    store(folder / "none8.tif", compression="none")
    store(folder / "float.tif", 3, "float", compression="zip")
    store(folder / "tiled.tif", 3, "uint8", tile=16, compression="packbits")
    store(folder / "planes.tif", 3, "uint8", planarconfig="separate")
    store(folder / "jpeg.tif", 3, "uint8", compression="jpeg")
    store(folder / "cmyk.tif", 4, "uint8", names="C M Y K", tiff__ColorSpace="CMYK", tiff__PhotometricInterpretation=5)
    store(folder / "lossy.webp", compression="webp:80")
    store(folder / "exact.webp", 4, compression="lossless")
    for compression in ("none", "rle", "zip", "piz", "pxr24", "b44", "dwaa"):
        store(folder / f"{compression}.exr", 3, "half", compression=compression)
    store(folder / "float.exr", 4, "float", compression="zips")
    store(folder / "layers.exr", 6, "half", names="R G B A Z spec.R")
    store(folder / "tiled.exr", 3, "half", tile=16, compression="zip")
    deep_exr(folder / "deep.exr")
    parts_exr(folder / "parts.exr")
    store(folder / "rle.hdr", 3, "float")
    for name in ("rgb.bmp", "one.gif", "rgb.ppm", "one.jxl", "one.jp2"):
        store(folder / name)
    store(folder / "grey.bmp", 1)
    store(folder / "grey.pgm", 1)
    store(folder / "text.ppm", pnm__binary=0)
    store(folder / "float.pfm", 3, "float")
    store(folder / "one.jxl")
    store(folder / "film.dpx", 3, "uint16", dpx__Transfer="Printing density", oiio__BitsPerSample=10)
    store(folder / "alpha.dpx", 4, "uint8", dpx__Transfer="ITU-R 709-4")
    (folder / "runs.bmp").write_bytes(bmp_of_runs(picture(1, "uint8")[..., 0]))
    (folder / "one.avif").write_bytes(avif())
    (folder / "camera.jpg").write_bytes(jpeg_of_a_camera())
    mattes_exr(folder / "mattes.exr")
    store(folder / "one.jp2")
    colour_seeds(folder, picture)
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir()) if path.is_file()}


def preset_seeds() -> dict[str, bytes]:
    folder = Path(str(resources.files("airlight"))) / "data" / "presets"
    return {path.name: path.read_bytes() for path in sorted(folder.glob("*.toml"))}


NUMBERS = (0, 1, 2, 3, 0x7F, 0x80, 0xFF, 0x100, 0x7FFF, 0x8000, 0xFFFF, 0x10000, 0x7FFFFFFF, 0x80000000, 0xFFFFFFF0, 0xFFFFFFFF)
# Values and pieces that a preset may hold by mistake.
WORDS = [b'"mean"', b'"""', b"9" * 30, b"9" * 5000, b"[" * 3000, b"[table]\n", b"a.b.c = 1\n", b"'\\u0000'", b"\xff\xfe"]
WORDS += b'nan inf -inf -1 0 0.5 2 1e999 1e-320 0x7fffffffffffffff true "x" [] {} [[[[]]]] 1979-05-27'.split()


# As `airlight image` stores them.
LIGHT = {b"light": b'["0.4,0.3;color=1,0.8,0.6"]', b"mask_invert": b"false", b"preset": b'"soft"'}
SETTINGS = (  # from before there were looks; of each
    {b"decay": b"0.9", b"samples": b"60", **LIGHT},
    {b"look": b'"classic"', b"decay": b"0.9", b"samples": b"60", **LIGHT},
    {b"look": b'"smart"', b"strength": b"1.5", b"rays": b"7", b"near_range": b'"0.1,0.9"', b"depth_hides": b"false", **LIGHT},
)


def mutated_settings(random: random.Random) -> bytes:
    held = dict(random.choice(SETTINGS))
    for name in random.sample(list(held), random.choice((1, 1, 2))):
        held[name] = random.choice((*WORDS, b"NaN", b"-Infinity", b"null", b'["nan,nan"]', b'"/dev/zero"', b'"0.5"'))
    text = b"{" + b", ".join(b'"' + name + b'": ' + value for name, value in held.items()) + b"}"
    return (mutate(random, text, text) if random.random() < 0.2 else text).translate(None, b"\n\0")


def mutate(random: random.Random, data: bytes, other: bytes, header: int = 96) -> bytes:
    """One to four changes: bits, bytes, length fields, cuts, pieces doubled, moved or taken from `other`; half of them near the start."""
    out = bytearray(data)
    for _ in range(random.choice((1, 1, 1, 2, 3, 4))):
        end = len(out) if random.random() < 0.5 else min(header, len(out))
        at = random.randrange(max(1, end))
        length = random.choice((1, 2, 4, 8, 16, 64, 256))
        match random.randrange(9):
            case 0:
                for _ in range(random.choice((1, 1, 2, 8))):
                    place = random.randrange(max(1, end))
                    out[place : place + 1] = bytes([(out[place] if place < len(out) else 0) ^ (1 << random.randrange(8))])
            case 1:
                out[at : at + 1] = bytes([random.choice((0, 1, 0x7F, 0x80, 0xFF, random.randrange(256)))])
            case 2:
                del out[at:]
            case 3:
                del out[at : at + length]
            case 4:
                out[at:at] = random.randbytes(length)
            case 5:
                out[at:at] = out[at : at + length] * random.choice((1, 1, 4, 64))
            case 6:
                place = random.randrange(max(1, len(other)))
                out[at : at + length] = other[place : place + length]
            case 7:  # a number of 16 or 32 bits, either way round
                size, order = random.choice((2, 4)), random.choice("<>")
                number = random.choice(NUMBERS) if random.random() < 0.7 else random.randrange(1 << 32)
                out[at : at + size] = struct.pack(order + {2: "H", 4: "I"}[size], number % (1 << 8 * size))
            case 8:
                out[at:] = other[random.randrange(max(1, len(other))) :]
    return bytes(out)


def mended_png(data: bytes) -> bytes:
    """With right checksums, so that a decoder looks further than those."""
    out, at = bytearray(data), 8
    while at + 12 <= len(out):
        length = int.from_bytes(out[at : at + 4], "big")
        if at + 12 + length > len(out):
            break
        out[at + 8 + length : at + 12 + length] = struct.pack(">I", zlib.crc32(out[at + 4 : at + 8 + length]))
        at += 12 + length
    return bytes(out)


def mutated_toml(random: random.Random, data: bytes, other: bytes) -> bytes:
    if random.random() < 0.4:
        return mutate(random, data, other)
    lines = data.splitlines()
    for _ in range(random.choice((1, 1, 2))):
        i = random.randrange(len(lines))
        key, _, value = lines[i].partition(b"=")
        word = random.choice(WORDS)
        lines[i] = random.choice((key + b"= " + word, word + b" =" + value, key + b"= " + word + value, lines[i] + b"\n" + lines[i]))
    return b"\n".join(lines)


DAYLIGHT_SUNS = (
    "--light auto --sun-elevation 4", "--light 0.4,0.3 --sun-elevation -5", "--light 1.2,-0.5 --sun-elevation 40",
    "--sun 200,20 --heading 190", "--sun 20,20 --heading 190", "--when exif --where exif --heading 300",
    "--when 2026-06-21T19:30+02:00 --where 47.4,11 --light auto:1",
)  # fmt: skip
DAYLIGHT_AIRS = (
    "air --visibility 0.05", "air --turbidity 8 --wavelengths rgb", "air --ozone 0 --aerosol-anisotropy -0.99", "hoffman-preetham",
    "hoffman-preetham --attenuate source --beta-mie 1,0,1",
)  # fmt: skip
DAYLIGHT_DEPTHS = ("", "--depth-range 2,5000", "--depth-range 3,inf --depth-kind inverse", "--depth-kind ray")
DAYLIGHT_FAR = ("--depth FILE", "--distance 3000 --mask FILE", "--distance 1e-3", "--distance 3000", "--distance 1e7")


def daylight(random: random.Random) -> list[str]:
    """Options of daylight, on a mutated picture, or with a mutated map of depths or mask of the sky; scattered once, which is quick."""
    air, far = random.choice(DAYLIGHT_AIRS), random.choice(DAYLIGHT_FAR)
    words = ["--daylight", air, random.choice(DAYLIGHT_SUNS), far, "--fov", random.choice(("50", "50", "170", "exif"))]
    words += [random.choice(("", "--sky air", "--sky replace")), "--multiple none" if air.startswith("air") else ""]
    return " ".join([*words, random.choice(DAYLIGHT_DEPTHS) if "--depth" in far else ""]).split()


def mutants(number: int, pictures: dict[str, bytes], presets: dict[str, bytes], seed: int) -> Iterator[Mutant]:
    """`number` mutants, the same for the same seed: of eight one is a preset, one a mask, depth map or settings, six are pictures.

    Of 32 one has daylight on it.
    """
    for i in range(number):
        chance = random.Random(f"{seed}:{i}")
        if i % 8 == 7:
            one, other = (presets[chance.choice(list(presets))] for _ in range(2))
            yield "mutant.toml", mutated_toml(chance, one, other), ["--preset", "FILE", "--light", "0.4,0.3"]
            continue
        if i % 16 == 14:
            data = pictures["rgb8.png"]
            data = data[:33] + png_chunk(b"tEXt", b"Software\0Airlight " + mutated_settings(chance)) + data[33:]  # behind IHDR
            yield "mutant.png", data, ["--settings-from", "FILE"]
            continue
        name = list(pictures)[(i - i // 8) % len(pictures)]
        alike = [n for n in pictures if Path(n).suffix == Path(name).suffix]
        other = pictures[chance.choice(alike if chance.random() < 0.7 else list(pictures))]
        data = mutate(chance, pictures[name], other)
        if name.endswith(".png") and chance.random() < 0.7:
            data = mended_png(data)
        more = ["--light", chance.choice(("auto", "0.4,0.3", "1.2,-0.5"))]
        more += chance.choice(([], [], ["--rays", "24", "--shade", "0.5"], ["--look", "classic"], ["--quality", "draft", "--mist", "1"]))
        if i % 32 == 5:
            more = daylight(chance)
        elif i % 8 == 6:
            more += [chance.choice(("--mask", "--depth", *(() if "classic" in more else ("--subject",)))), "FILE"]
        if name == "mattes.exr":
            layers = ["--mask-layer", "tree"], ["--mask-layer", "crypto/*"], ["--depth-layer", "right.R"]
            more += chance.choice(([], ["--view", "right"], *layers))
        yield "mutant" + Path(name).suffix, data, [*more, "--on-damage", chance.choice(("error", "error", "warn", "ignore"))]


# ---------------------------------------------------------------- the worker process


def _status(field: str) -> int:
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith(field):
            return int(line.split()[1])
    raise LookupError(field)


# Lines of a run that did what it was asked: where the light is, and why nothing, or not what one might think, is to be seen.
TOLD = "light at |beyond the picture, by a guess: |.*: (no light found|unsure), left as it is: |.*: hardly changed: "
TOLD += "|.*: (no gaps for light|nothing stands before the light).*; --rays \\d+ |.*: what lies round the light is black.*; brighten "
TOLD += "|.*: hardly changed, \\d+ % of it not at all: |.*: \\d+ % of the result is (white|black): |.*: as no frame that was looked at "
TOLD += (
    "|(.*; )?camera looks |sun at azimuth |angle of view |the sun is behind the camera|.* of it is taken as sky|.*: the air is .* times "
)
TOLD += "|.*: nothing of the scene is seen: |.*: \\d+ % of it is (white|black): "
TOLD += "|.*: the mask lets nothing shine: make |the light is that of the settings; --light auto |(.*: )?light at "
TOLD += "|.*: it is dark, nearly all of it below |.* lies? (behind the camera|beside the view): method "
OF_NUMPY = re.compile("airlight: warning: .*(encountered in|degrees of freedom|empty slice|poorly conditioned)", re.IGNORECASE)


def _faults(code: int, error: str, folder: Path, source: str, out: str) -> str:
    """What is wrong with a run, or nothing."""
    lines = error.splitlines()
    said = [line for line in lines if not line.startswith("airlight: warning: ") and not re.match(TOLD, line)]
    if any(OF_NUMPY.match(line) for line in lines) or sum(bool(re.match(TOLD, line)) for line in lines) > 3:
        return f"on stderr: {error}"
    if code not in (0, 2):
        return f"exit code {code}: {error}"
    if len(said) != (code != 0) or not all(line.startswith("airlight: ") for line in said):
        return f"{len(said)} lines on stderr: {error}"
    if "Traceback" in error or "airlight: unexpected" in error:
        return f"on stderr: {error}"
    left = sorted(os.listdir(folder))
    if left != sorted({source} | ({out} if code == 0 else set())):
        return f"the folder holds {left} after exit code {code}"
    if code == 0:
        if out.endswith(".avif"):
            with Image.open(folder / out) as made:
                return "" if made.size[0] * made.size[1] == np.asarray(made)[..., 0].size else "the output cannot be read"
        inp = oiio.ImageInput.open(str(folder / out))
        pixels = None if inp is None else inp.read_image("float")
        if pixels is None or inp.geterror():
            return "the output cannot be read"
        made = [i for i, name in enumerate(inp.spec().channelnames) if name[-1] in "RGBAY" and name.rpartition(".")[0] in ("", "airlight")]
        if not np.isfinite(pixels[..., made]).all():  # an EXR's other channels are kept as they are
            return "the output holds NaN or infinities"
    return ""


def worker(plain: str) -> None:
    """Read jobs (JSON: folder, source, args, out) from stdin; run each by `main`, catching nothing; answer on what was stdout."""
    from airlight.cli import main

    answers = os.fdopen(os.dup(1), "w")
    log = os.open(os.path.join(os.path.dirname(plain), f"stderr-{os.getpid()}"), os.O_RDWR | os.O_CREAT)
    os.dup2(log, 2)
    os.dup2(2, 1)
    assert main(["image", plain, "-o", plain + ".exr", "-y"]) == 0  # opens the device
    base = _status("VmRSS")
    for line in sys.stdin:
        job = json.loads(line)
        os.ftruncate(log, 0)
        os.lseek(log, 0, os.SEEK_SET)
        Path("/proc/self/clear_refs").write_text("5")  # the peak begins anew
        code = main(job["args"])
        sys.stderr.flush()
        error = os.pread(log, 1 << 20, 0).decode(errors="replace")
        fault = _faults(code, error, Path(job["folder"]), job["source"], job["out"])
        print(json.dumps({"code": code, "fault": fault, "peak": _status("VmHWM") - base}), file=answers, flush=True)


class Worker:
    """A child process that tries mutants; a new one takes the place of one that died."""

    def __init__(self, plain: Path) -> None:
        self.plain = plain
        self.process: subprocess.Popen[bytes] | None = None

    def _start(self) -> subprocess.Popen[bytes]:
        if self.process is None:
            command = [sys.executable, __file__, str(self.plain)]
            self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, bufsize=0)
        return self.process

    def attempt(self, folder: Path, mutant: Mutant, out: str) -> tuple[int | None, str, int]:
        """(exit code, what is wrong or "", KiB of memory) of one mutant, in a folder that is made for it and removed."""
        name, data, more = mutant
        folder.mkdir()
        (folder / name).write_bytes(data)
        source = str(self.plain) if "FILE" in more else str(folder / name)
        args = ["image", source, "-o", str(folder / out), *(str(folder / name) if a == "FILE" else a for a in more)]
        started = self.process is not None
        process = self._start()
        assert process.stdin and process.stdout
        job = {"folder": str(folder), "source": name, "out": out, "args": args}
        process.stdin.write(json.dumps(job).encode() + b"\n")
        answer, end = b"", time.monotonic() + HANG + (0 if started else 40)
        while not answer.endswith(b"\n") and time.monotonic() < end:
            if select.select([process.stdout], [], [], 0.5)[0]:
                part = process.stdout.read(65536)
                if not part:
                    break
                answer += part
        shutil.rmtree(folder)
        if not answer.endswith(b"\n"):
            hangs = process.poll() is None and time.monotonic() >= end
            process.kill()
            status = process.wait()
            self.stop()
            return None, "hangs" if hangs else f"the process ended with {status}", 0
        said = json.loads(answer)
        heavy = f"needs {said['peak'] >> 10} MiB" if said["peak"] > MEMORY else ""
        return said["code"], said["fault"] or heavy, said["peak"]

    def stop(self) -> None:
        if self.process is not None:
            assert self.process.stdin and self.process.stdout
            self.process.stdin.close()
            self.process.wait(30)
            self.process.stdout.close()
            self.process = None


def campaign(number: int, seed: int, folder: Path, workers: int) -> tuple[dict[int | None, int], list[str], int]:
    """Try `number` mutants: (how many gave each exit code, what went wrong, peak KiB). Mutants that did harm are kept in `folder`."""
    (folder / "seeds").mkdir()
    pictures = seeds(folder / "seeds")
    plain = folder / "plain.png"
    plain.write_bytes(pictures["rgb8.png"])
    jobs: queue.Queue[tuple[int, Mutant]] = queue.Queue()
    for job in enumerate(mutants(number, pictures, preset_seeds(), seed)):
        jobs.put(job)
    codes: dict[int | None, int] = {}
    faults: list[str] = []
    peaks = [0]

    def work() -> None:
        one = Worker(plain)
        while True:
            try:
                i, mutant = jobs.get_nowait()
            except queue.Empty:
                break
            code, fault, peak = one.attempt(folder / f"mutant-{i}", mutant, "out" + OUTPUTS[i % len(OUTPUTS)])
            codes[code] = codes.get(code, 0) + 1
            peaks.append(peak)
            if fault:
                kept = folder / f"harmful-{i}{Path(mutant[0]).suffix}"
                kept.write_bytes(mutant[1])
                faults.append(f"{kept} {' '.join(mutant[2])}: {fault}")
        one.stop()

    threads = [threading.Thread(target=work) for _ in range(workers)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return codes, faults, max(peaks)


if __name__ == "__main__":
    worker(sys.argv[1])
