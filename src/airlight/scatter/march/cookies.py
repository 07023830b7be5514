"""Keeps on the device the shapes of lights: cookies with smaller copies of themselves, and photometry as tables of directions."""

import weakref
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
        self._samplers: dict[str, Any] = {}

    def of(self, light: PunctualLight) -> tuple[Any, Any]:
        """Gives the texture and the sampler of a light's shape."""
        shape = light.cookie if light.photometry is None else light.photometry
        shape = None if shape_of(light) == "none" else shape
        if shape is None:
            return self.none, self._sampler("none")
        held, revision = self._held.get(shape), _revision(shape)
        if held is None or held[0] != revision:
            levels = halved(shape.pixels) if isinstance(shape, Cookie) else [grey(shape.table)]
            fits = held is not None and held[1].size[:2] == levels[0].shape[1::-1]
            self._held[shape] = held = revision, self._texture(levels, held[1] if fits else None)
        return held[1], self._sampler(shape_of(light))

    def _sampler(self, kind: str) -> Any:
        if kind not in self._samplers:
            across, down = {"parallel": ("repeat", "repeat"), "sphere": ("repeat", "clamp-to-edge")}.get(kind, ("clamp-to-edge",) * 2)
            linear: Any = {"mag_filter": "linear", "min_filter": "linear", "mipmap_filter": "linear"}
            self._samplers[kind] = self.device.device.create_sampler(address_mode_u=across, address_mode_v=down, **linear)
        return self._samplers[kind]

    def _texture(self, levels: list[Array], texture: Any = None) -> Any:
        """Uploads a picture (H, W, 3) and its smaller copies, to a texture where one is given."""
        usage = self.device.wgpu.TextureUsage
        rows, columns = levels[0].shape[:2]
        known = {"format": FORMAT, "usage": usage.TEXTURE_BINDING | usage.COPY_DST, "mip_level_count": len(levels)}
        texture = texture or self.device.device.create_texture(size=(columns, rows, 1), **known)
        for level, one in enumerate(levels):
            height, width = one.shape[:2]
            texels = np.ones((height, width, 4), np.float16)
            texels[..., :3] = np.clip(one, 0, LARGEST)
            layout = {"bytes_per_row": TEXEL * width, "rows_per_image": height}
            self.device.queue.write_texture({"texture": texture, "mip_level": level}, texels, layout, (width, height, 1))
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
    """Averages a picture (H, W, 3) over 2 x 2 pixels again and again, down to one. As WebGPU counts levels, the last of odd rows
    or columns with the one before."""
    levels = [np.asarray(pixels, np.float32)]
    while max(levels[-1].shape[:2]) > 1:
        levels.append(_halved(_halved(levels[-1]).swapaxes(0, 1)).swapaxes(0, 1))
    return levels


def _halved(a: Array) -> Array:
    """Averages pairs of rows; the last row of an odd number joins the last pair."""
    n = len(a) // 2
    if n == 0:
        return a
    starts = 2 * np.arange(n)
    counts = np.diff([*starts, len(a)])
    sums: Array = np.add.reduceat(a, starts, axis=0) / counts[:, None, None]
    return sums


def shape_record(out: Any, light: PunctualLight, into: Array) -> None:
    """Fills what a LIGHT says of its light's shape. into: (4, 4) view space to the world."""
    planes = light.planes()
    out["plane_count"], out["falloff"] = len(planes), light.falloff_terms()
    out["planes"][: len(planes)] = planes @ into
    kind = shape_of(light)
    if kind == "none":
        return
    axes, origin = light.axes(), light.origin()
    rows = np.column_stack([axes, -axes @ origin]) @ into
    if kind == "sphere":
        assert light.photometry is not None
        out["shape_size"] = light.photometry.table.shape[::-1]
    else:
        assert light.cookie is not None
        height, width = light.cookie.pixels.shape[:2]
        out["shape_size"] = width, height
        if kind == "parallel":
            wide = np.array([light.cookie.size, light.cookie.size * height / width])
            out["shape_scale"] = 1 / wide
            rows[:2, 3] = np.mod(rows[:2, 3], wide)  # far from the origin digits would be lost
        else:
            out["shape_scale"] = 0.5 / np.array(light.tangents())
    out["shape_rows"] = rows
