"""Draws the pictures that `scripts/adapters.py` compares between drivers, on the one that this process sees:
python scripts/driver_pictures.py FILE.npz [TRUTHS.npz]

One of each method on a picture, in codes; the exact walk of each scene of validation, in radiance; its error against the tracer, whose
light is traced once and kept in TRUTHS.npz, where the next driver finds it.
"""

import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parent.parent
sys.path.insert(0, str(ROOT / "tests"))
import validating  # noqa: E402

import airlight  # noqa: E402
from airlight.gpu.device import shared_device  # noqa: E402
from airlight.reference.scenes import foliage  # noqa: E402
from airlight.scatter.methods import of_screen  # noqa: E402
from airlight.scenes import VALIDATION  # noqa: E402

SIZE = 640, 360
SCENE_SIZE = 240, 135
LIGHT = 0.6, 0.35
MAP_SIDE = 2048  # of shadow maps, texels


def pictures() -> dict[str, np.ndarray]:
    """Put the light of each method on one picture, and the look: (H, W, 3) codes."""
    before = np.rint(255 * np.clip(foliage(*SIZE), 0, 1) ** (1 / 2.2)).astype(np.uint8)
    found = {"look": airlight.add_light_shafts(before, LIGHT)}
    for method in of_screen():
        found[method] = airlight.add_light_shafts(before, LIGHT, method=method)
    return found


def main() -> None:
    device = shared_device()
    out, kept = Path(sys.argv[1]), Path(sys.argv[2]) if len(sys.argv) > 2 else None
    found = {f"picture {name}": codes for name, codes in pictures().items()}
    truths = dict(np.load(kept)) if kept and kept.exists() else {}
    for name in VALIDATION:
        drawn = validating.draw(name, *SCENE_SIZE, shadow_size=MAP_SIDE)
        if f"light {name}" not in truths:
            truths[f"light {name}"], truths[f"way {name}"] = drawn.traced()
        found[f"scene {name}"] = drawn.layer
        found[f"error {name}"] = np.array(validating.error(drawn.layer, truths[f"light {name}"], truths[f"way {name}"]))
    if kept:
        np.savez(kept, **truths)
    np.savez(out, driver=device.driver, map_side=MAP_SIDE, **found)


if __name__ == "__main__":
    main()
