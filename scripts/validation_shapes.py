"""Makes the pictures and photometric files of the scenes that shaped light is validated on, into the package's
data/scenes/validation/: python scripts/validation_shapes.py

Everything is made here, by numbers. Candela of the files count as shares of their peak.
"""

import math
import sys
from pathlib import Path
from typing import Any

import cookie
import numpy as np
from PIL import Image

ROOT = Path(__file__).parent.parent
sys.path.insert(0, str(ROOT / "tests"))
from photometric_files import ies, ldt  # noqa: E402

FOLDER = ROOT / "src" / "airlight" / "data" / "scenes" / "validation"
SLIDE, GOBO, LEAVES = (48, 80), 80, 96  # pixels across and up
GOBO_COLOURS = np.array([[255, 255, 240], [255, 96, 40], [40, 140, 255], [255, 200, 60], [90, 220, 110]])  # sRGB


def slide() -> np.ndarray:
    """Shrinks the window of the example cookie to SLIDE, (H, W, 3) uint8."""
    return np.asarray(Image.fromarray(cookie.window()).resize(SLIDE, Image.Resampling.BOX))


def gobo() -> np.ndarray:
    """Draws rings of coloured dashes around a star, (GOBO, GOBO, 3) uint8; no two quarters are alike."""
    y, x = ((np.mgrid[:GOBO, :GOBO] + 0.5) / GOBO - 0.5) * 2
    r, turn = np.hypot(x, y), np.arctan2(y, x) / (2 * np.pi) + 0.5
    ring = np.floor(r * 7).astype(int)
    dashes = 5 + 3 * ring
    dash = turn * dashes + 0.37 * ring
    gap = np.minimum(dash % 1, 1 - dash % 1) / dashes * 2 * np.pi * r < 0.045
    lit = (r * 7 % 1 > 0.28) & ~gap & (ring > 0) & (ring < 7) | (r < 0.1)
    colour = (np.floor(dash).astype(int) * 2 + ring + (turn > 0.25)) % len(GOBO_COLOURS)
    return np.where(lit[..., None], GOBO_COLOURS[colour], 0).astype(np.uint8)


def leaves() -> np.ndarray:
    """Draws leaves that let a little green through, (LEAVES, LEAVES, 3) uint8; it repeats without a seam."""
    rng = np.random.default_rng(19)
    y, x = (np.mgrid[:LEAVES, :LEAVES] + 0.5) / LEAVES
    light = np.ones((LEAVES, LEAVES, 3))
    for _ in range(34):
        centre, angle, long = rng.uniform(size=2), rng.uniform(0, 2 * np.pi), rng.uniform(0.07, 0.13)
        dx, dy = ((v - c + 0.5) % 1 - 0.5 for v, c in zip((x, y), centre))
        along, across = (dx * math.cos(angle) + dy * math.sin(angle)) / long, (dy * math.cos(angle) - dx * math.sin(angle)) / long
        blade = np.clip((0.42 * (1 - along**2) - np.abs(across)) * long * LEAVES + 0.5, 0, 1)[..., None]
        light *= 1 - blade * (1 - np.array([0.05, 0.14, 0.03]))
    return (np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055) * 255).round().astype(np.uint8)


def street() -> bytes:
    """Writes a street lamp of type C, whole: two lobes along the street, forward of the lamp, and a little light behind it."""
    down, around = np.arange(0, 91, 5), np.arange(0, 361, 15)
    theta, phi = np.meshgrid(np.radians(down), np.radians(around))
    candela = 260 * np.cos(theta)
    for middle, strength in ((25, 1500), (160, 1150), (270, 220)):
        beside = np.cos(phi - math.radians(middle)) * np.sin(theta)
        candela += strength * np.exp(-(((theta - math.radians(58)) / 0.3) ** 2)) * np.exp(3.2 * (beside - 1))
    candela *= np.clip((90 - down) / 20, 0, 1)
    candela[:, down == 0] = candela[:, down == 0].mean()
    candela[-1] = candela[0]
    return ies("C", down, around, candela.round(1), version=named("street lamp, forward throw"))


def flood() -> bytes:
    """Writes a floodlight of type B, whole: wide across, with a sharp upper edge."""
    up, across = np.arange(-35, 36, 5), np.arange(-50, 51, 10)
    v, h = np.meshgrid(up, across)
    candela = 9000 * np.exp(-((h + 6) ** 2) / 700) * np.exp(-np.where(v > 8, (v - 8) ** 2 / 60, (v - 8) ** 2 / 500))
    candela *= np.clip((35 - np.abs(v)) / 10, 0, 1) * np.clip((50 - np.abs(h)) / 20, 0, 1)
    return ies("B", up, across, candela.round(0), version=named("asymmetric floodlight"))


def pendant() -> bytes:
    """Writes a lamp that hangs, EULUMDAT without symmetry: a cone down, some light up, less to one side; candela per 1000 lumens."""
    theta, phi = np.meshgrid(np.radians(np.arange(0, 181, 5)), np.radians(np.arange(0, 360, 30)))
    candela = 420 * np.exp(-((theta / 0.55) ** 2)) + 110 * np.exp(-(((math.pi - theta) / 0.8) ** 2)) + 25 * np.sin(theta) ** 2
    candela *= 1 - 0.45 * np.sin(theta) * np.cos(phi - 0.6)
    return ldt(0, candela.round(1), flux=1800.0)


def named(what: str) -> str:
    return f"IESNA:LM-63-2002\n[TEST] made by scripts/validation_shapes.py\n[MANUFAC] Airlight\n[LUMINAIRE] {what}\n"


MADE: dict[str, Any] = {"slide.png": slide, "gobo.png": gobo, "leaves.png": leaves}
WRITTEN: dict[str, Any] = {"street.ies": street, "flood.ies": flood, "pendant.ldt": pendant}

if __name__ == "__main__":
    for name, draw in MADE.items():
        Image.fromarray(draw()).quantize(64, dither=Image.Dither.NONE).save(FOLDER / name, optimize=True)
    for name, write in WRITTEN.items():
        (FOLDER / name).write_bytes(write())
    for name in (*MADE, *WRITTEN):
        print(f"{name}: {(FOLDER / name).stat().st_size / 1000:.1f} kB")
