"""Runs two dozen commands under the Khronos validation layer on each driver; exit code 1 for a message that is not a known one of upstream.

    python scripts/vulkan_layer.py [NAME ...]      NAME: only these drivers and commands

Silence proves nothing where the layer is not loaded. So a program that uses Vulkan wrongly must be found out first, each command's log must
begin with what the layer looks at, synchronisation among it, and between them the commands must run every entry point of the shaders.
"""

import json
import os
import re
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
from drivers import browser_folders, drivers

ROOT = Path(__file__).resolve().parents[1]
SHADERS = ROOT / "src" / "airlight"
LAYER = "VK_LAYER_KHRONOS_validation"
SYSTEM = ("/usr/lib/x86_64-linux-gnu", "/usr/lib/aarch64-linux-gnu", "/usr/lib64", "/usr/lib")
LIBRARIES = [Path(folder, "libVkLayer_khronos_validation.so") for folder in (*browser_folders(), *SYSTEM)]
WRONG = {"VUID-VkBufferCreateInfo-size-00912", "SYNC-HAZARD-WRITE-AFTER-WRITE"}  # of scripts/wrong_vulkan.py
BANNER = "CURRENT-VALIDATION-ENABLED"
IES = ROOT / "tests" / "data" / "photometry" / "absolute_photometry.ies"

@dataclass(frozen=True)
class Known:
    """A message that is let pass: what its words match, and whose it is."""

    severity: str
    words: str
    why: str


UPSTREAM = {
    "VUID-StandaloneSpirv-None-10684": Known(
        "Error",
        r"Invalid explicit layout decorations on type .* the (Function|Private|Workgroup) storage class",
        "naga, wgpu's translator, writes one type for what lies in a buffer and for a variable of it, with the layout of the buffer: "
        "github.com/gfx-rs/wgpu/issues/7696",
    ),
    "Undefined-Value-ShaderOutputNotConsumed": Known(
        "Warning",
        r"VK_SHADER_STAGE_FRAGMENT_BIT\], it writes to \[Output variable, Location 0\], but there is no .*pColorAttachments\[0\]",
        "pygfx's fragment shaders give a colour; where only depth is kept, for shadow maps, it is dropped, as WebGPU and Vulkan allow",
    ),
}
"""Messages by their id that are let pass."""

WIDTH, HEIGHT = 480, 320  # of pictures, px; in smaller ones the epipolar method takes the direct sum
SMALL = ["--width", "96", "--quality", "draft"]
AT = ["--light", "0.6,0.6"]
COMMANDS = {
    "epipolar": ["image", "photo.png", "-o", "epipolar.png", "--method", "epipolar", *AT],
    "radial": ["image", "photo.png", "-o", "radial.png", "--method", "radial", "--jitter", "blue", "--scale", "0.5", *AT],
    "bands": ["image", "photo.png", "-o", "bands.png", "--method", "bands", *AT],
    "multipass": ["image", "photo.png", "-o", "multipass.png", "--method", "multipass", "--occlusion", "contrast", *AT],
    "additive": ["image", "photo.png", "-o", "additive.png", "--method", "additive", *AT, "--light", "0.8,0.1"],
    "smart": ["image", "photo.png", "-o", "smart.png", "--subject", "mask.png", "--wrap", "0.5", "--rays", "12"],
    "smart-linear": ["image", "linear.exr", "-o", "smart.exr", "--look", "smart", "--layer", "smart-layer.exr", *AT, "--depth", "mask.png"],
    "classic-linear": ["image", "linear.exr", "-o", "sum.exr", "--look", "classic", "--layer", "layer.exr", *AT, "--light",
                       "1.3,-0.2;color=1,.8,.6", "--normalization", "listing"],
    "alpha-adapt": ["image", "alpha.png", "-o", "adapt.png", "--look", "classic", "--adapt", "0.5", "--angle", "60", "--border", "black",
                    "--occlusion-fraction", "fraction.png"],
    "film": ["image", "frame.####.png", "-o", "film.####.png", *AT],
    "table": ["render", "table", "-o", "table.png", *SMALL, "--width", "480", "--method", "epipolar", "--adapt", "0.5"],
    "prepass": ["render", "table", "-o", "prepass.exr", *SMALL, "--preset", "vesper-scene", "--occlusion-buffer", "source.exr",
                "--depth-aware", "3", "--sun", "0,10"],
    "flying": ["render", "flying", "-o", "flying.####.png", *SMALL, "--frames", "1-2", "--method", "radial"],
    "march": ["render", "table", "-o", "march.exr", *SMALL, "--medium", "haze", "--cascades", "3", "--shadow-filter", "soft", "--steps",
              "32", "--layer", "march-layer.exr"],
    "exact": ["render", "models/oak.glb", "-o", "exact.png", *SMALL, "--method", "march", "--steps", "exact", "--resolution", "1",
              "--sun", "120,30", "--light", "1,2,1;color=1,.8,.6"],
    "lamps": ["compare", "two-spots", "-o", "lamps.html", "--width", "96", "--variant", "method=march,steps=32", "--variant",
              "method=march,steps=exact"],
    "tables": ["compare", "two-spots", "-o", "tables.html", "--width", "96", "--variant", "method=march,steps=table", "--variant",
               "method=auto"],
    "table-of-a-sun": ["render", "flying", "-o", "sun.png", *SMALL, "--method", "march", "--steps", "table"],
    "auto": ["render", "flying", "-o", "auto.png", *SMALL, "--method", "auto", "--medium", "haze"],
    "daylight": ["render", "flying", "-o", "daylight.exr", *SMALL, "--daylight", "air", "--sun", "30,10", "--sigma-t", "0.01"],
    "daylight-photo": ["image", "photo.png", "-o", "day.png", "--daylight", "air", "--fov", "50", "--distance", "3000", *AT,
                       "--sun-elevation", "20"],
    "article": ["compare", "foliage-view", "-o", "article.html", "--width", "96", "--variant", "method=article", "--variant",
                "method=article-prose"],
    "varying": ["render", "slats", "-o", "varying.png", *SMALL, "--method", "march", "--steps", "16", "--noise-amount", "1", "--noise-size",
                "1", "--shadow-filter", "variance", "--soften", "2"],
    "projector": ["render", "slats", "-o", "projector.png", *SMALL, "--method", "march", "--steps", "32", "--projector",
                  "-1.2,2.4,1.4;target=0.6,0.6,-1;fov=50,40;cookie=photo.png;clip=0,1,0,-0.3"],
    "photometry": ["render", "cage", "-o", "photometry.png", *SMALL, "--method", "march", "--steps", "exact", "--ies", f"light 1={IES}"],
    "stained": ["render", "stained", "-o", "stained.exr", *SMALL, "--method", "march", "--steps", "32", "--layer", "stained-layer.exr"],
    "panes": ["render", "panes", "-o", "panes.png", *SMALL, "--method", "march", "--steps", "exact", "--resolution", "1"],
    "slices": ["render", "stained", "-o", "slices.png", *SMALL, "--method", "slices", "--plane-cell", "3", "--resolution", "1"],
    "printed": ["compare", "slats", "-o", "printed.html", "--width", "96", "--variant",
                "method=slices-printed,plane-noise=true,plane-blur=4", "--variant", "method=slices-extruded",
                "--variant", "method=slices-diced", "--variant", "method=slices-thickness"],
    "compare": ["compare", "photo.png", "-o", "compare.html", *AT, "--variant", "method=radial", "--variant",
                "method=epipolar,quality=draft"],
    "view-table": ["view", "table", "--screenshot", "view-table.png", "--method", "march"],
    "view-picture": ["view", "photo.png", "--screenshot", "view-picture.png"],
    "view-linear": ["view", "linear.exr", "--screenshot", "view-linear.png"],
    "view-classic": ["view", "linear.exr", "--screenshot", "view-classic.png", "--look", "classic"],
}
"""What is run, in order, in a folder of small inputs: each way of a picture and of a scene through the shaders."""

ELSEWHERE = {
    "gpu/copy.wgsl": "of the benchmark",
    "gpu/copy_raster.wgsl": "of the benchmark",
    "scatter/epipolar/gather_compute.wgsl": "on GPUs",
    "scatter/epipolar/gather_raster.wgsl": "on processors",
    "composite/behind_panes.wgsl": "one of two entry points, by what the device blends",
}
"""Shaders that may stay unused, and where they are used."""


@dataclass(frozen=True)
class Message:
    """What the layer said: the id of the rule, as VUID-… or SYNC-HAZARD-…, how bad it is, and its words."""

    id: str
    severity: str
    text: str


@dataclass
class Report:
    """What the layer said of one command, and what else went wrong with it."""

    messages: list[Message] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)

    def ours(self) -> list[Message]:
        return [m for m in self.messages if not is_upstream(m)]


def is_upstream(message: Message) -> bool:
    """Tell whether a message is one of those that are let pass, by its id, its severity and its words."""
    known = UPSTREAM.get(message.id)
    return known is not None and message.severity == known.severity and re.search(known.words, message.text) is not None


def parse(log: str) -> Iterator[Message]:
    """Take apart the layer's log: one JSON object after the other. Raises ValueError for one that is cut off."""
    decoder, at = json.JSONDecoder(), 0
    while match := re.compile(r"\S").search(log, at):
        said, at = decoder.raw_decode(log, match.start())
        yield Message(said["VUID"], said["Severity"], said["MainMessage"])


def judged(log: str, code: int, stderr: str = "") -> Report:
    """Judge one command by the layer's log, its exit code and its last words."""
    report = Report()
    if code:
        report.problems.append(f"exit code {code}: {stderr.strip()[-300:]}")
    try:
        said = list(parse(log))
    except ValueError as error:
        report.problems.append(f"the layer's log is cut off: {error}")
        return report
    if not any(m.id == BANNER and "Synchronization" in m.text for m in said):
        report.problems.append("the layer was not there, or did not look at synchronisation")
    report.messages = [m for m in said if m.severity != "Information"]
    return report


def environment(folder: Path, log: Path, library: Path) -> dict[str, str]:
    """Make the environment in which Vulkan's loader puts the layer under every program."""
    manifest = {"name": LAYER, "type": "GLOBAL", "library_path": str(library), "api_version": "1.3.0", "implementation_version": "1",
                "description": "Khronos validation layer"}
    (folder / f"{LAYER}.json").write_text(json.dumps({"file_format_version": "1.2.0", "layer": manifest}))
    return {
        "VK_LAYER_PATH": str(folder),
        "VK_INSTANCE_LAYERS": LAYER,
        "VK_LAYER_VALIDATE_SYNC": "1",
        "VK_LAYER_DEBUG_ACTION": "VK_DBG_LAYER_ACTION_LOG_MSG",
        "VK_LAYER_REPORT_FLAGS": "error,warn,info",
        "VK_LAYER_LOG_FILENAME": str(log),
        "VK_LAYER_MESSAGE_FORMAT_JSON": "1",
        "VK_LAYER_ENABLE_MESSAGE_LIMIT": "0",
    }


def inputs(folder: Path) -> None:
    """Write what the commands read: a small photograph, also linear, with alpha, and as frames; the models."""
    photo = oiio.ImageBuf(str(ROOT / "examples" / "photos" / "beacon-street-sunset.jpg"))
    small = oiio.ImageBufAlgo.resize(photo, roi=oiio.ROI(0, WIDTH, 0, HEIGHT, 0, 1, 0, 3))
    small.write(str(folder / "photo.png"), "uint8")
    for frame in (1, 2, 3):
        small.write(str(folder / f"frame.{frame:04d}.png"), "uint8")
    codes = small.get_pixels(oiio.FLOAT)
    ramp = np.linspace(0, 1, WIDTH, dtype=np.float32)[None, :, None].repeat(HEIGHT, 0)
    for name, pixels, kind in (
        ("linear.exr", codes**2.2, "half"),
        ("alpha.png", np.dstack([codes, ramp]), "uint8"),
        ("mask.png", ramp, "uint8"),
    ):
        image = oiio.ImageBuf(oiio.ImageSpec(WIDTH, HEIGHT, pixels.shape[2], "float"))
        image.set_pixels(image.roi, pixels)
        image.write(str(folder / name), kind)
    (folder / "models").symlink_to(SHADERS / "data" / "scenes" / "models")


def run(command: list[str], folder: Path, library: Path, driver: dict[str, str]) -> Report:
    """Run a Python program with its arguments under the layer, in a folder, on a driver of such an environment."""
    log = folder / "layer.log"
    log.unlink(missing_ok=True)
    env = os.environ | {"AIRLIGHT_PIPELINES": str(folder / "pipelines.txt")} | driver | environment(folder, log, library)
    done = subprocess.run([sys.executable, *command], cwd=folder, env=env, capture_output=True, text=True, timeout=600)
    return judged(log.read_text(encoding="utf-8") if log.exists() else "", done.returncode, done.stderr)


def traced(arguments: list[str]) -> int:
    """Be the `airlight` command, and write down the entry points of which it makes pipelines."""
    from airlight.__main__ import main
    from airlight.gpu.device import Device

    def noting(make, entries):
        def noted(self, path, *args, **kwargs):
            with open(os.environ["AIRLIGHT_PIPELINES"], "a", encoding="utf-8") as file:
                file.writelines(f"{path}:{entry}\n" for entry in args[:entries])
            return make(self, path, *args, **kwargs)

        return noted

    Device.pipeline, Device.raster = noting(Device.pipeline, 1), noting(Device.raster, 2)
    sys.argv = ["airlight", *arguments]
    return main()


def entry_points() -> set[str]:
    """Name the entry points in all shaders of the package, as path:name."""
    entry = re.compile(r"@(?:compute|fragment|vertex)\b[^{;]*?\bfn\s+(\w+)")
    return {f"{path}:{name}" for path, text in shaders().items() for name in entry.findall(text)}


def shaders() -> dict[str, str]:
    return {path.relative_to(SHADERS).as_posix(): path.read_text(encoding="utf-8") for path in SHADERS.rglob("*.wgsl")}


def unused(made: set[str]) -> set[str]:
    """List the entry points of which no pipeline was made, by the files that were compiled and those they include."""
    texts = shaders()

    def files(path: str) -> set[str]:
        return {path}.union(*(files(name) for name in re.findall(r'^//! include "(.+)"$', texts[path], re.M)))

    used = {f"{file}:{entry}" for path, entry in (one.split(":") for one in made) for file in files(path)}
    return {one for one in entry_points() - used if one.split(":")[0] not in ELSEWHERE}


def checked(driver: str, env: dict[str, str], names: list[str], library: Path) -> int:
    """Run the commands on one driver, print what is wrong, and count those of which something is."""
    wrong, seen = 0, Counter()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        inputs(folder)
        found = run([str(ROOT / "scripts" / "wrong_vulkan.py")], folder, library, env)
        if missed := WRONG - {m.id for m in found.messages}:
            print(f"{driver}: wrong use of Vulkan is not found out, {', '.join(sorted(missed))}; {'; '.join(found.problems)}")
            return 1
        for command in names or COMMANDS:
            report = run([__file__, "--traced", *COMMANDS[command]], folder, library, env)
            seen.update(m.id for m in report.messages if is_upstream(m))
            said = report.problems + [f"{m.severity} {m.id}: {' '.join(m.text.split())}" for m in {m.id: m for m in report.ours()}.values()]
            wrong += bool(said)
            print(f"{driver:14}{command:16}{'; '.join(said) or 'clean'}", flush=True)
        rest = unused(set((folder / "pipelines.txt").read_text(encoding="utf-8").split()))
    print(f"{driver}: let pass: {', '.join(f'{id} {n} times' for id, n in seen.items()) or 'nothing'}")
    if rest and not names:
        print(f"{driver}: no command runs {', '.join(sorted(rest))}")
    return wrong + (bool(rest) and not names)


def main(names: list[str]) -> int:
    library = next((p for p in LIBRARIES if p.exists()), None)
    if library is None:
        print("no validation layer: 'apt-get install chromium' brings one")
        return 1
    found = drivers()
    if unknown := [name for name in names if name not in found and name not in COMMANDS]:
        print(f"{unknown[0]}: no such driver or command; there is {', '.join((*found, *COMMANDS))}")
        return 2
    chosen = [name for name in names if name in found] or list(found)
    commands = [name for name in names if name in COMMANDS]
    if not chosen:
        print("no driver: install one (Debian: mesa-vulkan-drivers, and chromium for SwiftShader)")
        return 1
    return int(sum(checked(driver, found[driver], commands, library) for driver in chosen) > 0)


if __name__ == "__main__":
    sys.exit(traced(sys.argv[2:]) if sys.argv[1:2] == ["--traced"] else main(sys.argv[1:]))
