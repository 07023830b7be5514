"""Keeps on the device the shapes of lights: cookies with smaller copies of themselves, and photometry as tables of directions."""

import math
import weakref
from collections.abc import Callable
from typing import Any

import numpy as np

from airlight.gpu.device import Device
from airlight.lights.punctual import PunctualLight
from airlight.lights.shape import Cookie

Array = np.ndarray
SHAPES = ("none", "perspective", "parallel", "sphere")  # numbered as in shape.wgsl
FORMAT = "rgba16float"
LARGEST = 65504.0  # of a half float
TEXEL = 8  # bytes


class Cookies:
    """Holds a texture for each cookie and photometry, for as long as they live: one for all frames of a film that are of one size."""

    def __init__(self, device: Device) -> None:
        self.device = device
        self.none = device.texture(1, 1, FORMAT, target=False)
        self._held: Any = weakref.WeakKeyDictionary()
        linear: Any = {"mag_filter": "linear", "min_filter": "linear"}
        self._sampler = device.device.create_sampler(**linear)
        self._turning = device.device.create_sampler(address_mode_u="repeat", **linear)

    def of(self, light: PunctualLight) -> tuple[Any, Any]:
        """Gives the texture and the sampler of a light's shape."""
        kind = shape_of(light)
        if kind == "none":
            return self.none, self._sampler
        if light.photometry is not None:
            table = light.photometry.table
            return self._texture(light.photometry, kind, lambda: grey(table)), self._turning
        assert light.cookie is not None
        pixels = light.cookie.pixels
        return self._texture(light.cookie, kind, lambda: laid_out(pixels, repeats=kind == "parallel")), self._sampler

    def _texture(self, shape: Any, kind: str, picture: Callable[[], Array]) -> Any:
        """Gives the texture of a shape of a kind: made, or filled anew, of a picture (H, W, 3) when the shape has changed."""
        held = self._held.setdefault(shape, {})
        revision, texture = held.get(kind, (None, None))
        if revision == _revision(shape):
            return texture
        made = picture()
        rows, columns = made.shape[:2]
        texels = np.ones((rows, columns, 4), np.float16)
        texels[..., :3] = np.clip(made, 0, LARGEST)
        usage = self.device.wgpu.TextureUsage
        if texture is None or texture.size[:2] != (columns, rows):
            known = {"format": FORMAT, "usage": usage.TEXTURE_BINDING | usage.COPY_DST}
            texture = self.device.device.create_texture(size=(columns, rows, 1), **known)
        layout = {"bytes_per_row": TEXEL * columns, "rows_per_image": rows}
        self.device.queue.write_texture({"texture": texture}, texels, layout, (columns, rows, 1))
        held[kind] = _revision(shape), texture
        return texture


def grey(table: Array) -> Array:
    """Makes a picture (H, W, 3) of a table."""
    return np.repeat(np.asarray(table)[..., None], 3, axis=2)


def shape_of(light: PunctualLight) -> str:
    """Names the kind of a light's shape: one of SHAPES; none where it is alike everywhere, see `even_colour`."""
    if even_colour(light) is not None:
        return "none"
    if light.photometry is not None:
        return "sphere"
    return "parallel" if light.directional else "perspective"


def even_colour(light: PunctualLight) -> Array | None:
    """Finds (3,) what a light's shape multiplies its intensity by, where that is the same everywhere; else None."""
    shape = light.cookie if light.photometry is None else light.photometry
    if shape is None:
        return np.ones(3)
    if _evens.get(shape, (None,))[0] != _revision(shape):  # once for each: pictures are large, and frames many
        values = shape.pixels if isinstance(shape, Cookie) else grey(shape.table)
        _evens[shape] = _revision(shape), np.asarray(values[0, 0], float) if (values == values[0, 0]).all() else None
    found: Array | None = _evens[shape][1]
    return found


def _revision(shape: Any) -> int:
    return shape.revision if isinstance(shape, Cookie) else 0


_evens: Any = weakref.WeakKeyDictionary()


def halved(pixels: Array) -> list[Array]:
    """Averages a picture (H, W, 3) over 2 x 2 pixels again and again, down to one; the last of odd rows or columns stands alone."""
    levels = [np.asarray(pixels, np.float32)]
    while max(levels[-1].shape[:2]) > 1:
        levels.append(_halved(_halved(levels[-1]).swapaxes(0, 1)).swapaxes(0, 1))
    return levels


def _halved(a: Array) -> Array:
    """Averages pairs of rows."""
    starts = np.arange(0, len(a), 2)
    means: Array = np.add.reduceat(a, starts, axis=0) / np.diff([*starts, len(a)]).astype(np.float32)[:, None, None]
    return means


def laid_out(pixels: Array, repeats: bool) -> Array:
    """Lays a cookie (H, W, 3) and its smaller copies out in one picture, as shape.wgsl's level_corner has it: a look-up whose level
    is fixed costs software Vulkan a third of one that chooses levels.

    Around each copy lies a line of what is next to it: its own edge, or where it repeats its other side.
    """
    levels = halved(pixels)
    rows, columns = levels[0].shape[:2]
    places = [level_corner(level, rows, columns) for level in range(len(levels))]
    ends = [(x + one.shape[1], y + len(one)) for (x, y), one in zip(places, levels, strict=True)]
    out = np.zeros((max(y for _, y in ends) + 1, max(x for x, _ in ends) + 1, 3), np.float32)
    for (x, y), (right, down), one in zip(places, ends, levels, strict=True):
        out[y - 1 : down + 1, x - 1 : right + 1] = np.pad(one, ((1, 1), (1, 1), (0, 0)), mode="wrap" if repeats else "edge")
    return out


def level_corner(level: int, rows: int, columns: int) -> tuple[int, int]:
    """Finds (x, y) where a level of a cookie of so many texels begins in its texture."""
    return (1, 1) if level == 0 else (columns + 3, math.floor(rows - 2 * rows / 2**level) + 4 * level - 3)


def shape_record(out: Any, light: PunctualLight, into: Array) -> None:
    """Fills what a LIGHT says of its light's shape. into: (4, 4) view space to the world."""
    planes = light.planes()
    out["plane_count"], out["falloff"] = len(planes), light.falloff_terms()
    out["planes"][: len(planes)] = planes @ into
    kind = shape_of(light)
    if kind == "none":
        return
    rows, scale, size = shape_rows(light, into)
    out["shape_size"] = size
    if kind != "sphere":
        texels = size * scale
        middle = rows[2] if kind == "perspective" else np.array([0.0, 0.0, 0.0, 1.0])
        rows[0] = texels[0] * rows[0] + size[0] / 2 * middle
        rows[1] = size[1] / 2 * middle - texels[1] * rows[1]
        out["shape_most"], out["shape_last"] = texels.max(), (int(size.max()) - 1).bit_length()
    out["shape_rows"] = rows


def shape_rows(light: PunctualLight, into: Array) -> tuple[Array, Array, Array]:
    """Finds how a light's shape lies: (3, 4) rows to its axes, right, up and ahead, m; (2,) 1 / m of a cookie's width and height, a metre
    ahead where it has perspective; (2,) its texels. into: (4, 4) from where places are to the world."""
    axes, origin = light.axes(), light.origin()
    rows = np.column_stack([axes, -axes @ origin]) @ into
    if light.photometry is not None:
        return rows, np.zeros(2), np.array(light.photometry.table.shape[::-1])
    assert light.cookie is not None
    height, width = light.cookie.pixels.shape[:2]
    wide = 2 * np.array(light.tangents()) if not light.directional else light.cookie.size * np.array([1.0, height / width])
    if light.directional:
        rows[:2, 3] = np.mod(rows[:2, 3], wide)  # far from the origin digits would be lost
    return rows, 1 / wide, np.array([width, height])
