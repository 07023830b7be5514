"""Convert KHR_materials_pbrSpecularGlossiness, which old exporters write, to metalness and roughness."""

from typing import Any

import msgspec
import numpy as np

from airlight.colour import srgb_decode, srgb_encode
from airlight.luminance import REC709_F32
from airlight.scenes.gltf import schema

DIELECTRIC = 0.04  # reflectance along the normal of what is no metal
MAX_SIDE = 2048  # texels of a converted texture
LINEAR = srgb_decode(np.arange(256) / 255).astype(np.float32)


def with_factors(m: schema.Material) -> schema.Material:
    """Convert a material by its factors, if it is of that kind and has none of the other; of its textures only the diffuse one is kept."""
    old = m.extensions.specular_glossiness
    if old is None or m.pbr_metallic_roughness != schema.MetallicRoughness():
        return m
    colour, metal = converted(np.clip(old.diffuse_factor[:3], 0, 1), np.clip(old.specular_factor, 0, 1))
    r, g, b = (float(value) for value in colour)
    pbr = schema.MetallicRoughness(
        base_color_factor=(r, g, b, old.diffuse_factor[3]),
        base_color_texture=old.diffuse_texture,
        metallic_factor=float(metal),
        roughness_factor=1 - min(max(old.glossiness_factor, 0.0), 1.0),
    )
    return msgspec.structs.replace(m, pbr_metallic_roughness=pbr)


def converted(diffuse: Any, specular: Any) -> tuple[np.ndarray, np.ndarray]:
    """Find base colours (..., 3) and metalness (...) that keep albedo and reflectance, linear (..., 3), 0..1.

    As Khronos' convert-between-workflows, but for its luminance.
    """
    diffuse, specular = np.asarray(diffuse, np.float32), np.asarray(specular, np.float32)
    kept = (1 - specular.max(axis=-1)) / np.float32(1 - DIELECTRIC)
    metal = metalness(diffuse @ REC709_F32 * kept, specular @ REC709_F32)[..., None]
    of_diffuse = diffuse * kept[..., None] / np.maximum(1 - metal, 1e-6)
    of_specular = (specular - DIELECTRIC * (1 - metal)) / np.maximum(metal, 1e-6)
    return np.clip(of_diffuse + (of_specular - of_diffuse) * metal**2, 0, 1), metal[..., 0]


def metalness(diffuse: np.ndarray, specular: np.ndarray) -> np.ndarray:
    """Solve for the metalness, 0..1, that gives these luminances of what is scattered and reflected."""
    b, c = diffuse + specular - 2 * DIELECTRIC, DIELECTRIC - specular
    root = (-b + np.sqrt(np.maximum(b * b - 4 * DIELECTRIC * c, 0))) / (2 * DIELECTRIC)
    found: np.ndarray = np.where(specular <= DIELECTRIC, 0, np.clip(root, 0, 1)).astype(np.float32)
    return found


def textures(old: schema.SpecularGlossiness, diffuse: np.ndarray | None, shine: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
    """Convert textures, (H, W, 4) uint8, times their factors: base colour with alpha, and roughness in G with metalness in B.

    diffuse, shine: of diffuse colour, and of specular colour with glossiness; one may be None.
    """
    shapes = [codes.shape[:2] for codes in (diffuse, shine) if codes is not None]
    height, width = (min(max(sides), MAX_SIDE) for sides in zip(*shapes, strict=True))
    one, other = (_resized(codes, height, width) for codes in (diffuse, shine))
    colour, metal = converted(
        LINEAR[one[..., :3]] * np.clip(old.diffuse_factor[:3], 0, 1).astype(np.float32),
        LINEAR[other[..., :3]] * np.clip(old.specular_factor, 0, 1).astype(np.float32),
    )
    gloss = other[..., 3] / np.float32(255) * np.float32(min(max(old.glossiness_factor, 0.0), 1.0))
    base, surface = one.copy(), np.full_like(one, 255)
    base[..., :3] = np.rint(255 * srgb_encode(colour))
    surface[..., 1], surface[..., 2] = np.rint(255 * (1 - gloss)), np.rint(255 * metal)
    return base, surface


def _resized(codes: np.ndarray | None, height: int, width: int) -> np.ndarray:
    """Take the nearest texels for another size; white for none."""
    if codes is None:
        return np.full((height, width, 4), 255, np.uint8)
    rows, columns = (np.arange(n) * m // n for n, m in zip((height, width), codes.shape[:2]))
    found: np.ndarray = codes[rows[:, None], columns]
    return found
