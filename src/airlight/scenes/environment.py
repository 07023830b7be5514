"""An equirectangular picture of the surroundings as pygfx's background and light, and where its sun stands.

The picture's middle column looks along -z, u grows to the right, y is up. Radiance is linear Rec. 709.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from importlib import resources
from typing import TYPE_CHECKING

import numpy as np

from airlight.colour import srgb_encode
from airlight.errors import AirlightError
from airlight.luminance import REC709
from airlight.messages import nearest
from airlight.planes import block_means

if TYPE_CHECKING:
    import pygfx as gfx

SHIPPED = ("sunrise", "sky")
MAX_WIDTH = 4096  # pixels that are kept of the picture's width
LIGHT_FACE = 64  # pixels of a face of the cube that lights
LIGHT_LIMIT = 8.0  # radiance, relative to the mean, beyond which a pixel counts as a sun and lights as a lamp of its own
SUN_RADIUS = math.radians(4)  # around the brightest place
MAX_MENDED = 50_000  # values
SKY_SHARE = 0.3  # a clear sky's illuminance of the ground, by its sun's of a plane that faces that, at most: above it the sun is clipped
AUREOLE = math.radians(20)  # around a light: what shines into its shafts


def equirectangular(directions: np.ndarray, yaw: float = 0.0) -> np.ndarray:
    """Project (..., 3) directions to (..., 2) u, v in 0..1 of the picture, v down. yaw: radians of its turn about y, + to +x."""
    x, y, z = np.moveaxis(np.asarray(directions, float), -1, 0)
    length = np.sqrt(x * x + y * y + z * z)
    u = (np.arctan2(x, -z) - yaw) / (2 * np.pi) + 0.5
    return np.stack([u % 1.0, np.arccos(np.clip(y / length, -1, 1)) / np.pi], axis=-1)


def direction(u: float, v: float, yaw: float = 0.0) -> np.ndarray:
    """Find the unit direction (3,) of a position in the picture, as `equirectangular` has it."""
    turn, down = (u - 0.5) * 2 * np.pi + yaw, v * np.pi
    return np.array([np.sin(turn) * np.sin(down), np.cos(down), -np.cos(turn) * np.sin(down)])


def cube_directions(size: int) -> np.ndarray:
    """Give each texel of a cube texture its world direction, (6, size, size, 3), as pygfx samples it: by (-x, y, z) of the direction.

    Faces and their axes as WebGPU has them: +x, -x, +y, -y, +z, -z.
    """
    s = (np.arange(size) + 0.5) / size * 2 - 1
    a, b = np.meshgrid(s, s)
    one = np.ones_like(a)
    faces = [(one, -b, -a), (-one, -b, a), (a, one, b), (a, -one, -b), (a, -b, one), (-a, -b, -one)]
    cube = np.stack([np.stack(face, axis=-1) for face in faces])
    return cube * (-1, 1, 1)


def sample(picture: np.ndarray, uv: np.ndarray) -> np.ndarray:
    """Sample (H, W, 3) at (..., 2) u, v, bilinear, wrapping around in u: (..., 3)."""
    height, width = picture.shape[:2]
    x, y = uv[..., 0] * width - 0.5, np.clip(uv[..., 1] * height - 0.5, 0, height - 1)
    left, top = np.floor(x).astype(int), np.floor(y).astype(int)
    fx, fy = (x - left)[..., None], (y - top)[..., None]
    right, below = (left + 1) % width, np.minimum(top + 1, height - 1)
    left %= width
    upper = picture[top, left] * (1 - fx) + picture[top, right] * fx
    lower = picture[below, left] * (1 - fx) + picture[below, right] * fx
    return upper * (1 - fy) + lower * fy


def solid_angles(height: int, width: int) -> np.ndarray:
    """Compute the solid angle of a pixel in each row, (H, 1) steradians."""
    edges = np.cos(np.linspace(0, np.pi, height + 1))
    return ((edges[:-1] - edges[1:]) * 2 * np.pi / width)[:, None]


def _directions(height: int, width: int) -> np.ndarray:
    """Find the `direction` of each pixel, (H, W, 3)."""
    u, v = np.meshgrid((np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height)
    turn, down = (u - 0.5) * 2 * np.pi, v * np.pi
    return np.stack([np.sin(turn) * np.sin(down), np.cos(down), -np.cos(turn) * np.sin(down)], axis=-1)


@dataclass
class Environment:
    """Surroundings. picture: (H, W, 3) float32, finite, >= 0. yaw: see `equirectangular`."""

    picture: np.ndarray
    yaw: float = 0.0

    @property
    def sun(self) -> np.ndarray:
        """Find the unit direction (3,) to the brightest position."""
        return self.sun_and_light()[0]

    def sun_and_light(self) -> tuple[np.ndarray, np.ndarray]:
        """Measure the direction (3,) to the sun, and the irradiance (3,) (linear RGB) of what is within SUN_RADIUS around it."""
        height, width = self.picture.shape[:2]
        luminance = self.picture @ REC709
        weight = luminance * solid_angles(height, width)
        y, x = np.unravel_index(int(np.argmax(_blurred(luminance))), luminance.shape)
        rough = direction((x + 0.5) / width, (y + 0.5) / height)
        towards = _directions(height, width)
        near = (towards @ rough > math.cos(SUN_RADIUS)) & (luminance > luminance[y, x] / 4)
        centre = (towards[near] * weight[near][:, None]).sum(axis=0)
        centre = centre / np.linalg.norm(centre) if np.linalg.norm(centre) > 0 else rough
        irradiance = (self.picture[near] * np.broadcast_to(solid_angles(height, width), weight.shape)[near][:, None]).sum(axis=0)
        cos, sin = math.cos(self.yaw), math.sin(self.yaw)
        return np.array([cos * centre[0] - sin * centre[2], centre[1], sin * centre[0] + cos * centre[2]]), irradiance

    def sun_illuminance(self) -> float:
        """Estimate the illuminance that goes with these surroundings of a plane that faces their sun: what their sun gives, but where it is
        clipped, or hidden, what their sky gives the ground over SKY_SHARE."""
        height, width = self.picture.shape[:2]
        luminance, weight = self.picture @ REC709, solid_angles(height, width)
        sky = np.minimum(luminance, LIGHT_LIMIT * float((luminance * weight).sum() / (4 * np.pi)))
        up = np.cos((np.arange(height) + 0.5) / height * np.pi).clip(0)[:, None]
        return max(float(self.sun_and_light()[1] @ REC709), float((sky * up * weight).sum()) / SKY_SHARE)

    def aureole(self, towards: np.ndarray | None, limit: float) -> float:
        """Average luminance, none beyond `limit`, within AUREOLE of a direction (3,), or over all."""
        height, width = self.picture.shape[:2]
        weight = np.broadcast_to(solid_angles(height, width), (height, width))
        if towards is not None:
            cos, sin = math.cos(-self.yaw), math.sin(-self.yaw)
            x, y, z = np.asarray(towards, float) / np.linalg.norm(towards)
            unturned = np.array([cos * x - sin * z, y, sin * x + cos * z])
            weight = weight * (_directions(height, width) @ unturned > math.cos(AUREOLE))
        return float((np.minimum(self.picture @ REC709, limit) * weight).sum() / weight.sum())

    def turned_to(self, towards: np.ndarray) -> Environment:
        """Turn the surroundings about y so that their sun stands below or above a direction (3,)."""
        if math.hypot(towards[0], towards[2]) < 1e-6:
            return self
        sun = self.sun
        return Environment(self.picture, self.yaw + math.atan2(towards[0], -towards[2]) - math.atan2(sun[0], -sun[2]))

    def cube(self, size: int, limit: float | None = None) -> gfx.Texture:
        """Make a cube texture with mip levels, coded as pygfx expects it. limit: the greatest radiance that is kept."""
        import pygfx as gfx

        reduced = self.picture if limit is None else np.minimum(self.picture, limit)
        while reduced.shape[1] >= 8 * size:  # or texels between samples would be missed
            reduced = block_means(reduced, 2)
        pixels = np.ones((6, size, size, 4), np.float32)
        pixels[..., :3] = sample(reduced, equirectangular(cube_directions(size), self.yaw))
        # pygfx decodes every such texture from sRGB: its curve, continued beyond 1.
        pixels[..., :3] = srgb_encode(pixels[..., :3])
        return gfx.Texture(pixels.astype(np.float16), dim=2, size=(size, size, 6), generate_mipmaps=True)

    def surround(self, scene: gfx.Scene, background: bool = True, limit: float | None = None) -> None:
        """Make these the surroundings of a scene: they light it (without their sun: that is a lamp's part) and fill the background.

        limit: the greatest radiance of the background, whose sun would else outshine all shafts.
        """
        import pygfx as gfx

        mean = float(((self.picture @ REC709) * solid_angles(*self.picture.shape[:2])).sum() / (4 * np.pi))
        scene.environment = self.cube(LIGHT_FACE, LIGHT_LIMIT * mean)
        if background:
            size = min(1024, max(16, 2 ** round(math.log2(self.picture.shape[1] / 3))))
            scene.add(gfx.Background(None, gfx.BackgroundSkyboxMaterial(map=self.cube(size, limit))))


def _blurred(luminance: np.ndarray) -> np.ndarray:
    """Average (H, W) over 3 x 3, around the seam too: one hot pixel is no sun."""
    rows = np.pad(luminance, ((1, 1), (0, 0)), mode="edge")
    rows = rows[:-2] + rows[1:-1] + rows[2:]
    return np.asarray(rows + np.roll(rows, 1, axis=1) + np.roll(rows, -1, axis=1)) / 9


def _mended(picture: np.ndarray) -> np.ndarray:
    """Fill holes beside a sun, which compression leaves there, and values below 0 by the median of those above 0 in the 7 x 7 around."""
    reach, height, width = 3, *picture.shape[:2]
    suspects = np.maximum(picture, 0).max(axis=-1) > 200 * max(float(np.maximum(picture, 0).mean()), 1e-6)
    for axis in (0, 1):
        suspects = np.logical_or.reduce([np.roll(suspects, shift, axis) for shift in range(-reach, reach + 1)])
    y, x, channel = np.nonzero((picture < 0) | suspects[..., None])
    if 0 < len(y) <= MAX_MENDED:
        steps = np.arange(-reach, reach + 1)
        rows = np.clip(y[:, None] + np.repeat(steps, len(steps)), 0, height - 1)
        around = picture[rows, (x[:, None] + np.tile(steps, len(steps))) % width, channel[:, None]]
        around = np.sort(np.where(around > 0, around, np.inf), axis=1)
        middle = around[np.arange(len(y)), (around < np.inf).sum(axis=1) // 2]
        picture[y, x, channel] = np.maximum(picture[y, x, channel], np.where(np.isfinite(middle), middle, 0))
    return picture


def load_environment(name_or_path: str) -> Environment:
    """Load "sunrise", "sky", or an equirectangular .exr or .hdr file; what is not finite or below 0 is mended. Raises AirlightError."""
    from airlight.files import read_image

    path = name_or_path
    if path in SHIPPED:
        path = str(resources.files("airlight") / "data" / "scenes" / f"{path}.exr")
    elif not path.lower().endswith((".exr", ".hdr")):
        known = (*SHIPPED, "none")
        hint = nearest(path, known, f"; give {', '.join(known)}, or an .exr or .hdr file")
        raise AirlightError(f"{path}: is not an environment{hint}")
    picture = read_image(path)
    if not 1.9 <= picture.width / picture.height <= 2.1 or picture.width < 16:
        raise AirlightError(f"{path}: {picture.width}x{picture.height} is not equirectangular; give a picture twice as wide as high")
    pixels = picture.rec709(picture.linear())
    with np.errstate(invalid="ignore"):
        pixels = _mended(np.where(np.isfinite(pixels), pixels, -1)).clip(0, 65504).astype(np.float32)
    while pixels.shape[1] > MAX_WIDTH:
        pixels = block_means(pixels, 2)
    if not pixels.any():
        raise AirlightError(f"{path}: is black; give an environment with light in it")
    return Environment(pixels)
