"""Draws the cookies that come as examples, a tall window of coloured glass and lead, and leaves: python scripts/cookie.py"""

from pathlib import Path

import numpy as np
from PIL import Image

WIDTH, HEIGHT = 192, 320
SIDE = 384  # of the leaves
LEAD = 0.012  # half the width of a bar, of the window's width
COLOURS = np.array([[196, 44, 38], [28, 74, 168], [232, 176, 52], [38, 122, 72], [128, 44, 132], [222, 226, 214], [214, 110, 36]])  # sRGB


def window() -> np.ndarray:
    """Make the picture (HEIGHT, WIDTH, 3) uint8: lozenges around a rose, below a pointed arch."""
    y, x = (np.mgrid[:HEIGHT, :WIDTH] + 0.5) / WIDTH
    x = x - 0.5
    spring = 0.62  # where the arch begins
    arch = np.where(y < spring, np.maximum(np.hypot(x - 0.42, y - spring), np.hypot(x + 0.42, y - spring)) < 0.86, np.abs(x) < 0.44)
    inside = arch & (y < HEIGHT / WIDTH - 0.06)
    u, v = (x + 0.55 * y) / 0.19, (x - 0.55 * y) / 0.19
    near = np.minimum(np.abs(u - np.round(u)), np.abs(v - np.round(v))) * 0.19
    number = (np.round(u - 0.5).astype(int) * 5 + np.round(v - 0.5).astype(int) * 3) % len(COLOURS)
    # A rose of eight leaves
    r, turn = np.hypot(x, y - 0.66), np.arctan2(y - 0.66, x)
    leaf = turn * 8 / (2 * np.pi)
    rose = r < 0.27
    bars = np.minimum(np.abs(r - 0.27), np.abs(r - 0.1))
    bars = np.where(rose & (r > 0.1), np.minimum(bars, np.abs(leaf - np.round(leaf)) * r * 2 * np.pi / 8), bars)
    number = np.where(rose, np.where(r < 0.1, 2, np.floor(leaf).astype(int) % 2 * 4), number)
    lead = np.where(rose, bars, np.minimum(near, np.abs(r - 0.27))) < LEAD
    grain = 0.85 + 0.15 * np.random.default_rng(7).uniform(size=len(COLOURS) * 40)[number * 40 + (np.abs(u).astype(int) % 40)]
    return np.where((inside & ~lead)[..., None], COLOURS[number] * grain[..., None], 0).round().astype(np.uint8)


def leaves() -> np.ndarray:
    """Make the picture (SIDE, SIDE) uint8: pointed leaves of all directions, black, before white."""
    y, x = np.mgrid[:SIDE, :SIDE] + 0.5
    light, random = np.ones((SIDE, SIDE), bool), np.random.default_rng(3)
    for _ in range(260):
        (a, b), half, turn = random.uniform(0, SIDE, 2), random.uniform(0.03, 0.065) * SIDE, random.uniform(0, np.pi)
        along, across = (x - a) * np.cos(turn) + (y - b) * np.sin(turn), (y - b) * np.cos(turn) - (x - a) * np.sin(turn)
        light &= np.abs(across) > 0.38 * half * (1 - (along / half) ** 2)
    return np.where(light, 255, 0).astype(np.uint8)


if __name__ == "__main__":
    to = Path(__file__).parent.parent / "examples" / "cookies"
    Image.fromarray(window()).save(to / "window.png", optimize=True)
    Image.fromarray(leaves()).convert("1").save(to / "leaves.png", optimize=True)
