"""Convert KHR_materials_pbrSpecularGlossiness, which old exporters write, to metalness and roughness."""

import math

import msgspec
import numpy as np

from airlight.luminance import REC709
from airlight.scenes.gltf import schema

DIELECTRIC = 0.04  # reflectance along the normal of what is no metal


def metallic_roughness(old: schema.SpecularGlossiness, gloss: float = 1.0) -> schema.MetallicRoughness:
    """Convert to the model that glTF has now. gloss: mean of the texture's glossiness, 0..1; of its colours nothing is kept.

    By the factors, that reflectance and albedo stay (Khronos' convert-between-workflows); a textured material is no metal.
    """
    roughness = 1 - min(max(old.glossiness_factor, 0.0), 1.0) * gloss
    diffuse, specular = np.clip(old.diffuse_factor[:3], 0, 1), np.clip(old.specular_factor, 0, 1)
    colour, metal = diffuse, 0.0
    if old.diffuse_texture is None and old.specular_glossiness_texture is None:
        kept = (1 - float(specular.max())) / (1 - DIELECTRIC)
        metal = metalness(float(diffuse @ REC709) * kept, float(specular @ REC709))
        of_diffuse = diffuse * kept / max(1 - metal, 1e-6)
        of_specular = (specular - DIELECTRIC * (1 - metal)) / max(metal, 1e-6)
        colour = np.clip(of_diffuse + (of_specular - of_diffuse) * metal**2, 0, 1)
    r, g, b = (float(value) for value in colour)
    return schema.MetallicRoughness(
        base_color_factor=(r, g, b, old.diffuse_factor[3]),
        base_color_texture=old.diffuse_texture,
        metallic_factor=metal,
        roughness_factor=roughness,
    )


def metalness(diffuse: float, specular: float) -> float:
    """Solve for the metalness, 0..1, that gives these luminances of what is scattered and reflected."""
    if specular <= DIELECTRIC:
        return 0.0
    b, c = diffuse + specular - 2 * DIELECTRIC, DIELECTRIC - specular
    root = (-b + math.sqrt(max(b * b - 4 * DIELECTRIC * c, 0.0))) / (2 * DIELECTRIC)
    return min(max(root, 0.0), 1.0)


def converted(m: schema.Material, gloss: float = 1.0) -> schema.Material:
    """Give a material its `metallic_roughness`, if it is of that kind and has none of its own."""
    old = m.extensions.specular_glossiness
    if old is None or m.pbr_metallic_roughness != schema.MetallicRoughness():
        return m
    return msgspec.structs.replace(m, pbr_metallic_roughness=metallic_roughness(old, gloss))
