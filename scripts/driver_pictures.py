"""Draws the pictures that `scripts/adapters.py` compares between drivers, on the one that this process sees:
python scripts/driver_pictures.py FILE.npz [TRUTHS.npz]     without truths only light with a shape is drawn

One of each method on a picture, in codes; the exact walk of each scene of validation, in radiance; its error against the tracer, whose
light is traced once and kept in TRUTHS.npz, where the next driver finds it; and light that has a shape, or passes glass, by the exact walk
and by slices.
"""

import sys
import tempfile
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parent.parent
sys.path.insert(0, str(ROOT / "tests"))
import validating  # noqa: E402

import airlight  # noqa: E402
from airlight.cli import main as command  # noqa: E402
from airlight.files import read_image  # noqa: E402
from airlight.gpu.device import shared_device  # noqa: E402
from airlight.reference.scenes import foliage  # noqa: E402
from airlight.scatter.methods import of_screen  # noqa: E402
from airlight.scenes import VALIDATION  # noqa: E402

SIZE = 640, 360
SCENE_SIZE = 240, 135
LIGHT = 0.6, 0.35
MAP_SIDE = 2048  # of shadow maps, texels
BEAM = f"-1.2,2.4,1.4;target=0.6,0.6,-1;fov=50,40;intensity=300,280,240;cookie={ROOT / 'examples/cookies/window.png'}"
SHAPED = {
    "a projector's cookie": ["slats", "--projector", BEAM],
    "a lamp's photometry": ["cage", "--ies", f"light 1={ROOT / 'tests/data/photometry/absolute_photometry.ies'}"],
    "coloured glass": ["stained"],
    "panes": ["panes"],
}


def pictures() -> dict[str, np.ndarray]:
    """Put the light of each method on one picture, and the look: (H, W, 3) codes."""
    before = np.rint(255 * np.clip(foliage(*SIZE), 0, 1) ** (1 / 2.2)).astype(np.uint8)
    found = {"look": airlight.add_light_shafts(before, LIGHT)}
    for method in of_screen():
        found[method] = airlight.add_light_shafts(before, LIGHT, method=method)
    return found


def shaped() -> dict[str, np.ndarray]:
    """Draw light that has a shape, or passes glass, by the exact walk and by slices: (H, W, 3) layers."""
    found = {}
    with tempfile.TemporaryDirectory() as folder:
        out, layer = (str(Path(folder, name)) for name in ("out.exr", "layer.exr"))
        size = ["--width", str(SCENE_SIZE[0]), "--height", str(SCENE_SIZE[1]), "--shadow-size", str(MAP_SIDE), "--resolution", "1"]
        for name, scene in SHAPED.items():
            for method in (["march", "--steps", "exact"], ["slices", "--planes", "64"]):
                if command(["render", *scene, *size, "-y", "-o", out, "--layer", layer, "--method", *method]) != 0:
                    raise SystemExit(1)
                found[f"{name}, {method[0]}"] = read_image(layer).codes[..., :3]
    return found


def main() -> None:
    device = shared_device()
    out, kept = Path(sys.argv[1]), Path(sys.argv[2]) if len(sys.argv) > 2 else None
    found = {f"shaped {name}": layer for name, layer in shaped().items()}
    if kept is None:
        np.savez(out, driver=device.driver, map_side=MAP_SIDE, **found)
        return
    found |= {f"picture {name}": codes for name, codes in pictures().items()}
    truths = dict(np.load(kept)) if kept.exists() else {}
    for name in VALIDATION:
        drawn = validating.draw(name, *SCENE_SIZE, shadow_size=MAP_SIDE)
        if f"light {name}" not in truths:
            truths[f"light {name}"], truths[f"way {name}"] = drawn.traced()
        found[f"scene {name}"] = drawn.layer
        found[f"error {name}"] = np.array(validating.error(drawn.layer, truths[f"light {name}"], truths[f"way {name}"]))
    np.savez(kept, **truths)
    np.savez(out, driver=device.driver, map_side=MAP_SIDE, **found)


if __name__ == "__main__":
    main()
