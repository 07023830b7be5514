"""Make what the scenes do not load from files: noise, sky, land, water and their textures, from seeds, as arrays and as textures.

Lengths in scene units, y up; radiance and albedo linear Rec. 709.
"""

import numpy as np
import numpy.typing as npt
import pygfx as gfx

from airlight.colour import srgb_encode
from airlight.planes import smoothstep

Array = npt.NDArray[np.floating]


def noise(size: int, seed: int, slope: float, lowest: float = 1.0) -> Array:
    """Make tileable noise, (size, size), mean 0, deviation 1: random phases, amplitude spectrum f^−slope from `lowest` cycles a tile on.

    slope 2 is land, 1.5 clouds, 1 rough stone, 0.5 sand.
    """
    fx, fy = np.fft.rfftfreq(size, 1 / size), np.fft.fftfreq(size, 1 / size)
    f = np.hypot(fx[None, :], fy[:, None])
    white = np.fft.rfft2(np.random.default_rng(seed).standard_normal((size, size)))
    field = np.fft.irfft2(white * np.where(f >= lowest, np.maximum(f, 1) ** -slope, 0), (size, size))
    return np.asarray(field / field.std())


def tiled(field: Array, x: Array, y: Array) -> Array:
    """Sample a tileable (n, n) field at x, y in tiles, bilinear."""
    n = len(field)
    i, j = np.floor(x * n).astype(int), np.floor(y * n).astype(int)
    fx, fy = x * n - i, y * n - j
    rows = [field[k % n, i % n] * (1 - fx) + field[k % n, (i + 1) % n] * fx for k in (j, j + 1)]
    return np.asarray(rows[0] * (1 - fy) + rows[1] * fy)


def mix(a: npt.ArrayLike, b: npt.ArrayLike, weight: Array) -> Array:
    """Mix a where the weight (...,) is 0 with b where it is 1; a, b: (3,) or (..., 3)."""
    return np.asarray(np.asarray(a) * (1 - weight[..., None]) + np.asarray(b) * weight[..., None])


def sky(sun: npt.NDArray[np.float64], height: int, seed: int) -> npt.NDArray[np.float32]:
    """Paint the radiance of a morning, (height, 2 height, 3): gradient, glow about the sun (unit direction), thin clouds; no disc."""
    v, u = (np.arange(height) + 0.5) / height * np.pi, ((np.arange(2 * height) + 0.5) / height - 1) * np.pi
    up = np.broadcast_to(np.cos(v)[:, None], (height, 2 * height))
    right, back = np.sin(v)[:, None] * np.sin(u), -np.sin(v)[:, None] * np.cos(u)
    angle = np.arccos(np.clip(up * sun[1] + right * sun[0] + back * sun[2], -1, 1))
    towards = np.exp(-angle / 0.55)
    low = np.exp(-np.maximum(up, 0) / 0.13)
    colour = mix((0.028, 0.075, 0.19), mix((0.10, 0.12, 0.19), (0.62, 0.27, 0.11), towards), low)
    colour += (0.16 * towards)[..., None] * (1.0, 0.5, 0.25) + (2.2 * np.exp(-angle / 0.06))[..., None] * (1.0, 0.6, 0.26)
    # A layer of cloud seen from below: its plane's coordinates, thinner towards the zenith and in the haze.
    field, away = noise(1024, seed, 1.45, 3), np.maximum(up, 0.01) + 0.06
    cover = smoothstep(tiled(field, 0.06 * right / away, 0.11 * back / away), 0.1, 1.9) * smoothstep(up, 0.02, 0.12)
    lit = mix((0.13, 0.10, 0.14), (1.3, 0.62, 0.28), np.exp(-angle / 0.38))
    colour = mix(colour, lit, 0.75 * cover)
    below = smoothstep(up, 0.0, -0.1)
    return np.asarray(mix(colour, (0.02, 0.035, 0.045), below), np.float32)


def waves(size: int, seed: int, steepness: float) -> npt.NDArray[np.uint8]:
    """Make a tileable normal map of small waves, (size, size, 4); steepness: the deviation of their slope."""
    h = noise(size, seed, 1.6, 4) + 0.35 * noise(size, seed + 1, 1.2, 24)
    return normals(h, steepness)


def normals(h: Array, steepness: float) -> npt.NDArray[np.uint8]:
    """Turn heights (H, W), tileable, into a normal map (H, W, 4); u to the right, v down as glTF has it."""
    dx, dy = np.roll(h, -1, 1) - np.roll(h, 1, 1), np.roll(h, -1, 0) - np.roll(h, 1, 0)
    scale = steepness / np.sqrt((dx**2 + dy**2).mean() / 2)
    n = np.stack([-dx * scale, -dy * scale, np.ones_like(h)], axis=-1)
    n /= np.linalg.norm(n, axis=-1, keepdims=True)
    out = np.full((*h.shape, 4), 255, np.uint8)
    out[..., :3] = np.rint((n * 0.5 + 0.5) * 255)
    return out


def codes(linear: Array) -> npt.NDArray[np.uint8]:
    """Encode (H, W, 3) albedo as (H, W, 4) sRGB codes."""
    x = np.clip(linear, 0, 1)
    out = np.full((*x.shape[:2], 4), 255, np.uint8)
    out[..., :3] = np.rint(255 * srgb_encode(x))
    return out


def texture(pixels: npt.NDArray[np.uint8], srgb: bool = True) -> gfx.TextureMap:
    """Make a tiled texture with mip levels; not srgb: numbers, as a normal map's."""
    plain = gfx.Texture(pixels, dim=2, generate_mipmaps=True, colorspace="srgb" if srgb else "physical")
    return gfx.TextureMap(plain, wrap="repeat", filter="linear")
