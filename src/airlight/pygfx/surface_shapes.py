"""Gives surfaces the shapes of lights, as the air has them: cookies, photometry, what bounds a projector, and its falloff."""

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from airlight.lights.punctual import PunctualLight
from airlight.lights.shape import Cookie
from airlight.pygfx import private
from airlight.pygfx.lights import SceneLight
from airlight.pygfx.punctual import shaped_lights
from airlight.scatter.march.cookies import SHAPES, even_colour, grey, shape_of, shape_record, shape_rows
from airlight.scatter.march.records import LIGHT

SIDE = private.SHAPE_SIDE
Array = np.ndarray


class SurfaceShapes:
    """Finds the shapes of a scene's lights, and resamples each once."""

    def __init__(self) -> None:
        self._texels: list[tuple[Any, int, Array]] = []  # shape, its revision

    def of(self, lights: Any, described: Sequence[SceneLight]) -> dict[str, list[PunctualLight | None]]:
        """Finds the shapes of pygfx's lights, by kind, in their order; None of one that has none."""
        known = shaped_lights(described)
        return {kind: [known.get(id(light)) for light in lights[f"{kind}_lights"]] for kind in private.KINDS}

    def write(self, state: private.SurfaceState, shapes: Sequence[PunctualLight]) -> None:
        """Writes the shapes of a state's lights."""
        records, layers = [], []
        for light in shapes:
            record, even = np.zeros((), LIGHT), even_colour(light)
            shape_record(record, light, np.eye(4))
            kind, count = SHAPES.index(shape_of(light)), int(record["plane_count"])
            rows, scale, size = shape_rows(light, np.eye(4)) if kind else (record["shape_rows"], np.zeros(2), np.zeros(2))
            records.append((rows, [*scale, kind, size.max()], [*record["falloff"], count], record["planes"]))
            layers.append(_even(*even.tolist()) if even is not None else self._sampled(light))
        state.write_shapes(records, layers)
        held = [light.cookie or light.photometry for light in shapes]
        self._texels = [one for one in self._texels if any(one[0] is shape for shape in held)]

    def _sampled(self, light: PunctualLight) -> Array:
        """Resamples a light's shape to SIDE x SIDE texels."""
        shape = light.photometry or light.cookie
        revision = shape.revision if isinstance(shape, Cookie) else 0
        for had, known, texels in self._texels:
            if had is shape and known == revision:
                return texels
        if isinstance(shape, Cookie):
            pixels = shape.pixels
        else:
            assert shape is not None
            pixels = grey(shape.table)
        texels = resampled(pixels, SIDE, not isinstance(shape, Cookie)).astype(np.float16)
        self._texels = [*(one for one in self._texels if one[0] is not shape), (shape, revision, texels)]
        return texels


@lru_cache(64)
def _even(r: float, g: float, b: float) -> Array:
    """Makes the texels of a shape that is alike everywhere, the very same ones each time, which are not uploaded again."""
    return np.full((1, 1, 3), (r, g, b), np.float16)


def resampled(pixels: Array, side: int, sphere: bool) -> Array:
    """Resamples a picture (H, W, 3) to side x side: averages what is finer, and interpolates. sphere: its first and last rows are the ends
    of a table of directions, and columns go round."""
    for axis in (0, 1):
        factor = pixels.shape[axis] // side
        if factor > 1:
            count = pixels.shape[axis] // factor
            pixels = np.stack([pixels.take(np.arange(count) * factor + i, axis) for i in range(factor)]).mean(axis=0)
    at = (np.arange(side) + 0.5) / side
    if sphere:
        rows, columns = np.arange(side) / (side - 1) * (len(pixels) - 1), np.arange(side) / side * pixels.shape[1]
        grid = np.stack(np.meshgrid((columns + 0.5) / pixels.shape[1], (rows + 0.5) / len(pixels)), axis=-1)
        grid[..., 1] = np.clip(grid[..., 1], 0.5 / len(pixels), 1 - 0.5 / len(pixels))
        return Cookie(pixels).at(grid, True)
    return Cookie(pixels).at(np.stack(np.meshgrid(at, at), axis=-1))
