"""Scenes whose look is known, and what tests of the look measure on its pictures. Linear Rec. 709, white at 1."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from airlight.arrays import to_linear
from airlight.colour import srgb_encode
from airlight.lights import Light
from airlight.look.apply import Applied, apply
from airlight.look.grid import points
from airlight.look.measure import oklab
from airlight.options import Look
from airlight.reference.look import REC709, bilinear
from airlight.reference.look import across as blur_lines  # a Gaussian over lines

WIDTH, HEIGHT = 480, 320
LIGHT = (0.5, 0.3)
GLOW = 0.22  # diagonals over which it fades
WARM, BLUE, GREY = (1.0, 0.62, 0.3), (0.35, 0.6, 1.0), (1.0, 1.0, 1.0)


def sky(colour: tuple[float, ...] = WARM, size: tuple[int, int] = (WIDTH, HEIGHT), light: tuple[float, float] = LIGHT) -> np.ndarray:
    """(H, W, 3) float32: a clipped disc and its glow in a clear sky, grey away from it. colour: of the glow."""
    x, y = points(*size)
    diagonal = np.hypot(*size)
    distance = np.hypot(x - light[0] * size[0] / diagonal, y - light[1] * size[1] / diagonal)[..., None]
    glow = 0.75 * np.exp(-distance / GLOW) * np.array(colour)
    disc = np.clip((0.02 - distance) * diagonal + 0.5, 0, 1)
    return np.minimum(np.maximum(0.06 + glow, disc), 1).astype(np.float32)


def bar_columns(width: int) -> np.ndarray:
    """(W,): 1 where one of some 25 bars stands, as wide as the gaps between them, the disc in the middle one; soft over a pixel."""
    at = (np.arange(width) + 0.5) / width * 25
    return np.clip((np.abs(at - np.round(at)) * -2 + 0.5) * width / 50 + 0.5, 0, 1)


def barred(colour: tuple[float, ...] = WARM, size: tuple[int, int] = (WIDTH, HEIGHT), light: tuple[float, float] = LIGHT) -> np.ndarray:
    """The sky behind dark bars, in a band about the light, above a grey ground."""
    width, height = size
    scene = sky(colour, size, light)
    rows = (np.arange(height) + 0.5) / height
    within = (np.clip((rows - 0.02) * height + 0.5, 0, 1) * np.clip((0.48 - rows) * height + 0.5, 0, 1))[:, None]
    bars = (bar_columns(width) * within)[..., None]
    scene = scene * (1 - bars) + 0.015 * bars
    ground = np.clip((rows - 0.6) * height + 0.5, 0, 1)[:, None, None]
    return (scene * (1 - ground) + 0.08 * ground).astype(np.float32)


@dataclass
class Change:
    """A picture, what the look makes of it, linear, and how. Not dithered, but for codes."""

    before: np.ndarray
    after: np.ndarray
    applied: Applied

    @property
    def codes(self) -> np.ndarray:
        """(H, W, 3): what changes, in codes."""
        return 255 * (srgb_encode(np.clip(self.after, 0, 1)) - srgb_encode(np.clip(self.before, 0, 1)))

    @property
    def contrast(self) -> float:
        """The 95th percentile of 100 times the OKLab distance."""
        return float(np.percentile(100 * np.linalg.norm(oklab(self.after) - oklab(self.before), axis=-1), 95))

    @property
    def brightening(self) -> float:
        """The growth of the mean luminance, of 1."""
        return float((self.after @ REC709).mean() / (self.before @ REC709).mean() - 1)

    @property
    def added(self) -> np.ndarray:
        assert self.applied.added is not None
        return self.applied.added.astype(float)


def shone(renderer: Any, picture: np.ndarray, light: Light, look: Look | None = None, **options: Any) -> Change:
    """The look on linear floats that are shown as they are, or on codes."""
    look = look or Look()
    if picture.dtype == np.uint8:
        linear = to_linear(picture)[0]
        applied = apply(renderer, picture, linear, [light], look, float_output=False, **options)
        after = linear if applied.codes is None else to_linear(applied.codes)[0]
        return Change(linear.astype(float), after.astype(float), applied)
    applied = apply(renderer, picture, picture, [light], look, float_output=False, **options)
    before = after = picture.astype(float)
    if applied.added is not None and applied.taken is not None:
        after = before * (1 - applied.taken[..., None].astype(float)) + applied.added
    return Change(before, after, applied)


def rays_share(change: Change, light: tuple[float, float], degrees: float = 12.0) -> float:
    """The part of the change of L that varies within some degrees about the light: the rms of its angular high-pass over its own.

    On 1,440 lines and 256 distances from .03 diagonals, each sample by the area that it stands for, only what lies in the picture.
    """
    level = np.cbrt(change.after @ REC709) - np.cbrt(change.before @ REC709)
    height, width = level.shape
    diagonal = np.hypot(width, height)
    angle = np.arange(1440) * (2 * np.pi / 1440)
    distance = np.linspace(0.03, 1.2, 256)[:, None]
    x = light[0] * width + diagonal * distance * np.cos(angle)
    y = light[1] * height + diagonal * distance * np.sin(angle)
    within = ((x >= 0) & (x <= width) & (y >= 0) & (y <= height)).astype(float)
    lines = bilinear(level, x - 0.5, y - 0.5) * within
    sigma = degrees * 4
    smooth = blur_lines(lines, sigma, True) / np.maximum(blur_lines(within, sigma, True), 1e-9)
    weight = within * distance
    return float(np.sqrt((weight * (lines - smooth) ** 2).sum() / (weight * lines**2).sum()))
