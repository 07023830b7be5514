"""Print a hash of what each of some thirty commands writes: run it before and after a change that must not change a pixel, and compare.

    python scripts/output_hashes.py FOLDER > before.txt

Pictures are hashed by their pixels and channel names, since files also hold the commands that made them; other outputs by their figures.
"""

import hashlib
import os
import re
import subprocess
import sys
from pathlib import Path

import OpenImageIO as oiio

PHOTO = "examples/photos/beacon-street-sunset.jpg"
SMALL = ["--width", "160", "--quality", "draft"]
COMMANDS: dict[str, list[str]] = {
    "smart": ["image", PHOTO, "-o", "smart.png"],
    "smart-exr": ["image", PHOTO, "-o", "smart.exr", "--layer", "smart-layer.exr", "--light", "0.4,0.2"],
    **{f"image-{m}": ["image", PHOTO, "-o", f"{m}.png", "--light", "0.4,0.2", "--method", m] for m in
       ("epipolar", "radial", "bands", "multipass", "additive")},
    "image-exr": ["image", PHOTO, "-o", "sum.exr", "--light", "0.4,0.2;color=1,0.8,0.6", "--method", "epipolar", "--layer", "sum-layer.exr",
                  "--occlusion-fraction", "fraction.png"],
    "image-border": ["image", PHOTO, "-o", "border.png", "--light", "1.3,-0.2", "--border", "black", "--normalization", "listing"],
    "image-half": ["image", PHOTO, "-o", "half.png", "--light", "0.4,0.2", "--method", "radial", "--scale", "0.5", "--jitter", "blue"],
    "image-adapt": ["image", PHOTO, "-o", "adapt.png", "--angle", "60", "--adapt", "0.5"],
    "image-debug": ["image", PHOTO, "-o", "debug.png", "--light", "0.4,0.2", "--debug", "lines"],
    "image-preset": ["image", PHOTO, "-o", "preset.png", "--light", "0.4,0.2", "--preset", "classic-long"],
    "batch": ["image", PHOTO, "smart.png", "-o", "batch", "--light", "auto:1"],
    **{f"{scene}-{m}": ["render", scene, "-o", f"{scene}-{m}.png", *SMALL, "--method", m] for scene in ("table", "flying") for m in
       ("epipolar", "radial", "march")},
    "article": ["render", "foliage-view", "-o", "article.exr", *SMALL, "--method", "article"],
    "prepass": ["render", "table", "-o", "prepass.exr", *SMALL, "--preset", "vesper-scene", "--occlusion-buffer", "prepass-source.exr"],
    "film": ["render", "flying", "-o", "film.####.png", *SMALL, "--frames", "1-3"],
    **{scene: ["render", scene, "-o", f"{scene}.exr", "--width", "160", "--layer", f"{scene}-layer.exr"] for scene in
       ("slats", "foliage-view", "cage", "two-spots", "headlamp", "window")},
    "medium": ["render", "table", "-o", "medium.exr", *SMALL, "--medium", "haze", "--cascades", "3", "--shadow-filter", "soft",
               "--steps", "32"],
    "compare": ["compare", "half.png", "-o", "compare.html", "--light", "0.4,0.2", "--variant", "method=radial",
                "--variant", "method=epipolar,quality=draft"],
    "compare-scene": ["compare", "cage", "-o", "scene.html", "--width", "120", "--variant", "method=march,steps=32",
                      "--variant", "method=march,steps=exact"],
}


def pixels(path: Path) -> bytes:
    """Hash a picture's pixels and the names of its channels."""
    image = oiio.ImageBuf(str(path))
    values = image.get_pixels(image.spec().format)
    return hashlib.sha256(repr(image.spec().channelnames).encode() + values.tobytes()).digest()


def main(folder: str) -> None:
    """Run every command in a folder, in order, and print what each wrote."""
    root = Path(__file__).resolve().parents[1]
    out = Path(folder)
    (out / "examples").mkdir(parents=True, exist_ok=True)
    if not (out / "examples/photos").exists():
        os.symlink(root / "examples/photos", out / "examples/photos")
    (out / "batch").mkdir(exist_ok=True)
    for name, command in COMMANDS.items():
        before = {path: path.stat().st_mtime_ns for path in out.rglob("*") if path.is_file()}
        done = subprocess.run([sys.executable, "-m", "airlight", *command, "--overwrite"], cwd=out, capture_output=True, text=True)
        written = [p for p in sorted(out.rglob("*")) if p.is_file() and before.get(p) != p.stat().st_mtime_ns]
        digest = hashlib.sha256()
        for path in written if command[0] != "compare" else []:
            digest.update(path.name.encode() + pixels(path))
        if command[0] == "compare":
            digest.update("".join(re.findall(r"error .*?max\s+\S+ %", done.stdout)).encode())
        print(f"{name:20} {done.returncode} {digest.hexdigest()[:16]} {len(written)} files", flush=True)
        if done.returncode:
            print("   ", done.stderr.strip().splitlines()[-1:], flush=True)


if __name__ == "__main__":
    main(sys.argv[1])
