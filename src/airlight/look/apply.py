"""The look on a picture in memory: on the GPU, or by the NumPy reference where there is none."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from airlight.arrays import to_linear
from airlight.colour import srgb_decode
from airlight.lights import ImageLight
from airlight.look import measure
from airlight.look.grid import Array, RayGrid, points
from airlight.look.plan import FIELDS
from airlight.look.resolve import ResolvedLook, resolve
from airlight.luminance import luminance
from airlight.options import Look
from airlight.planes import by_rows, shrink, shrink_to, shrunk_size
from airlight.reference import look as twin
from airlight.reference.around import around_light
from airlight.reference.look import Tones

HALF_MAX = 65504.0  # what the passes' textures hold at most


@dataclass
class Applied:
    """Holds a picture's look. codes: (H, W, 3) uint8, where codes were given and a GPU is there; else added (H, W, 3) float32 and taken (H,
    W) float32: the picture becomes picture (1 - taken) + added. Neither where nothing changes."""

    resolved: ResolvedLook
    codes: npt.NDArray[np.uint8] | None = None
    added: npt.NDArray[np.float32] | None = None
    taken: npt.NDArray[np.float32] | None = None


def apply(
    renderer: Any,
    pixels: Array,
    coarse: Array,
    lights: Sequence[ImageLight],
    look: Look,
    *,
    float_output: bool,
    near: Array | None = None,
    masked: Array | None = None,
    held: ResolvedLook | None = None,
    grey: bool = False,
    quality: str = "normal",
    profile: Any = None,
) -> Applied:
    """Put the look on a picture.

    renderer: scatter.render.Renderer, or None; pixels: (H, W, 3 or 4) uint8 sRGB codes, or float32 linear Rec. 709; coarse: the same
    picture as float32 linear Rec. 709 (h, w, 3), perhaps fewer of its pixels; near: (H, W), 1 for what shafts pass behind; masked: (H, W),
    what may emit; held: what was resolved for a frame before; grey: the picture has no colours;
    quality: how fine the copy is on which rays are found, see `plan.FIELDS`.
    """
    height, width = pixels.shape[:2]
    is_codes = pixels.dtype == np.uint8
    white = measure.white_of(coarse) if float_output and not is_codes else 1.0
    small = measure.small_copy(coarse, white, near, (width, height))
    may_emit = None if masked is None else shrink_to(masked, *small.size)
    hidden = near
    if near is None and measure.wants_haze(lights):
        small.near = hidden = measure.haze_nearness(small)
    options: dict[str, Any] = {"additive": float_output, "grey": grey, "masked": may_emit, "held": held}
    if renderer is None:
        linear = twin_pixels(pixels)
        if is_codes:
            side = shrunk_size(width, height, FIELDS[quality])
            copy = srgb_decode(twin.mean_codes(pixels[..., :3].astype(np.float64) / 255, *side))
        else:
            copy = np.clip(np.nan_to_num(shrink(linear, FIELDS[quality]) / white), 0, HALF_MAX).astype(np.float64)
        planes = _Reference(copy)
        resolved = resolve(small, (width, height), lights, look, planes.bands, **options)
        if not resolved.changes:
            return Applied(resolved)
        return Applied(resolved, None, *planes.layer(linear, small, resolved, hidden, white))
    plan = renderer.look_plan((width, height), is_codes, near is not None, quality)
    given = pixels
    if pixels.shape[2] == 3:
        given = np.empty((height, width, 4), pixels.dtype)
        given[..., :3] = pixels
        given[..., 3] = 255 if is_codes else 1
    plan.upload(given, small.guide, hidden, white)

    def bands(number: int, grid: RayGrid, tones: Tones, parts: Array, fineness: float, pattern: Array | None) -> tuple[Array, Array]:
        seen: tuple[Array, Array] = plan.see(number, grid, tones, parts, fineness, pattern, profile)
        return seen

    resolved = resolve(small, (width, height), lights, look, bands, **options)
    if not resolved.changes:
        return Applied(resolved)
    plan.set_lights([one.settings for one in resolved.lights], resolved.strength, resolved.shade, resolved.dark)
    found = plan.read(profile)
    if is_codes:
        return Applied(resolved, np.ascontiguousarray(found[..., :3]))
    added, taken = np.empty((height, width, 3), np.float32), np.empty((height, width), np.float32)

    def rows(first: int, last: int) -> None:
        added[first:last] = found[first:last, :, :3]
        added[first:last] *= np.float32(white)
        taken[first:last] = found[first:last, :, 3]

    by_rows(rows, height)
    return Applied(resolved, None, added, taken)


def twin_pixels(pixels: Array) -> Array:
    """Convert pixels as `apply` takes them to (H, W, 3) float32 linear."""
    return to_linear(pixels[..., :3])[0] if pixels.dtype == np.uint8 else pixels[..., :3]


class _Reference:
    """Runs the passes in NumPy, over a copy of the picture with white at 1."""

    def __init__(self, copy: Array) -> None:
        self.y = luminance(copy)
        self.found: dict[int, tuple[Array, Array]] = {}  # by light, its bands, and what emits

    def bands(
        self, number: int, grid: RayGrid, tones: Tones, parts: Array, fineness: float, pattern: Array | None
    ) -> tuple[Array, Array]:
        height, width = self.y.shape
        weighted, emits = twin.matte(self.y, tones, twin.resized(parts, width, height), grid)
        rays = twin.bands(*twin.scan(weighted, emits, grid), grid, fineness, pattern)
        self.found[number] = rays, emits
        return twin.at_points(rays, grid, *map(measure.few, points(parts.shape[1], parts.shape[0])))

    def layer(self, linear: Array, small: measure.Small, resolved: ResolvedLook, near: Array | None, white: float) -> tuple[Array, Array]:
        height, width = self.y.shape
        added_light, missing = np.zeros((height, width, 3)), np.zeros((height, width))
        for (rays, emits), one in zip(self.found.values(), resolved.lights, strict=True):
            s = one.settings
            amount = twin.amounts_at(rays, s, *points(width, height)) * (1 - twin.EMITTER * emits)
            color, share = np.array(s.color), np.ones(())
            if s.around is not None:
                diagonal = math.hypot(width, height)
                color = color * around_light(s.around, (width, height), (diagonal * s.grid.light[0], diagonal * s.grid.light[1]))
                share = color @ twin.REC709
            added_light += np.maximum(amount, 0)[..., None] * color
            missing += np.maximum(-amount, 0) * share
        guide = twin.resized(small.guide, width, height)
        base = guide[..., 0] * twin.lightness(self.y) + guide[..., 1]
        add, take = twin.change(base, added_light, missing, resolved.strength, resolved.shade, resolved.dark)
        field = np.concatenate([add, take[..., None]], axis=-1)
        added, taken = np.empty(linear.shape, np.float32), np.empty(linear.shape[:2], np.float32)
        full = linear.shape[1], linear.shape[0]
        x = (np.arange(full[0]) + 0.5) / full[0]

        def at_rows(plane: Array, first: int, last: int) -> Array:
            rows = (np.arange(first, last) + 0.5) / full[1]
            px, py = np.meshgrid(x * plane.shape[1] - 0.5, rows * plane.shape[0] - 0.5)
            return twin.bilinear(plane, px, py)

        def rows(first: int, last: int) -> None:
            color = np.clip(np.nan_to_num(linear[first:last].astype(np.float64) / white), 0, HALF_MAX)
            found = at_rows(field, first, last)
            hidden = np.zeros(color.shape[:2]) if near is None else at_rows(near, first, last)
            light, taken[first:last] = twin.put(color, found[..., :3], found[..., 3], hidden)
            added[first:last] = white * light

        by_rows(rows, full[1])
        return added, taken
