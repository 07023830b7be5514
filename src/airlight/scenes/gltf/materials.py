"""Make materials and textures of a checked glTF file as those of pygfx."""

import re

import numpy as np
import pygfx as gfx

from airlight.scenes.gltf import images, schema
from airlight.scenes.gltf.validate import Gltf

_WRAP = {33071: "clamp", 33648: "mirror", 10497: "repeat"}
_NEAREST, _LINEAR = 9728, 9729
_MIN_NEAREST = (9728, 9984, 9986)
_MIP_NEAREST = (9984, 9985)


def colour(linear: tuple[float, ...]) -> gfx.Color:
    """Make a colour of linear numbers, 0..1, with or without alpha."""
    r, g, b, *alpha = (min(max(value, 0.0), 1.0) for value in linear)
    return gfx.Color.from_physical(r, g, b, *alpha)


class Materials:
    """Makes each texture and material once."""

    def __init__(self, gltf: Gltf) -> None:
        self._gltf = gltf
        self._textures: dict[tuple[int, bool], gfx.Texture] = {}
        self._materials: dict[tuple[int, bool], gfx.Material] = {}

    def _texture(self, image: int, mips: bool) -> gfx.Texture:
        if (image, mips) not in self._textures:
            data, kind = self._gltf.image(image)
            pixels = images.pixels(data, kind, f"{self._gltf.container.path}: image {image}")
            self._textures[image, mips] = gfx.Texture(pixels, dim=2, generate_mipmaps=mips)
        return self._textures[image, mips]

    def _map(self, info: schema.TextureInfo | None) -> gfx.TextureMap | None:
        if info is None:
            return None
        document = self._gltf.document
        texture = document.textures[info.index]
        source = self._gltf.source(info.index)
        if source is None:  # of an extension
            return None
        sampler = schema.Sampler() if texture.sampler is None else document.samplers[texture.sampler]
        found = gfx.TextureMap(
            self._texture(source, sampler.min_filter not in (_NEAREST, _LINEAR)),
            uv_channel=info.tex_coord,
            mag_filter="nearest" if sampler.mag_filter == _NEAREST else "linear",
            min_filter="nearest" if sampler.min_filter in _MIN_NEAREST else "linear",
            mipmap_filter="nearest" if sampler.min_filter in _MIP_NEAREST else "linear",
            wrap_s=_WRAP[sampler.wrap_s],
            wrap_t=_WRAP[sampler.wrap_t],
        )
        transform = info.extensions.transform
        if transform is not None:
            if transform.tex_coord is not None:
                found.uv_channel = transform.tex_coord
            found.uniform_buffer.data["transform"][:, :3] = uv_matrix(transform).T
            found.uniform_buffer.update_full()
        return found

    def material(self, index: int | None, flat: bool = False) -> gfx.Material:
        """Make the material, or glTF's default one. flat: of a mesh without normals."""
        key = (-1 if index is None else index, flat)
        if key not in self._materials:
            self._materials[key] = self._made(schema.Material() if index is None else self._gltf.document.materials[index], flat)
        return self._materials[key]

    def _made(self, m: schema.Material, flat: bool) -> gfx.Material:
        pbr = m.pbr_metallic_roughness
        mode = {"BLEND": {"alpha_mode": "blend", "depth_write": False}, "MASK": {"alpha_mode": "solid", "alpha_test": m.alpha_cutoff}}
        common = {
            "color": colour(pbr.base_color_factor),
            "map": self._map(pbr.base_color_texture),
            "side": "both" if m.double_sided else "front",
            **mode.get(m.alpha_mode, {"alpha_mode": "solid"}),
        }
        if m.extensions.unlit is not None:
            return gfx.MeshBasicMaterial(**common)
        surface = self._map(pbr.metallic_roughness_texture)
        strength = m.extensions.emissive_strength
        material = gfx.MeshStandardMaterial(
            **common,
            flat_shading=flat,
            metalness=min(max(pbr.metallic_factor, 0.0), 1.0),
            roughness=min(max(pbr.roughness_factor, 0.0), 1.0),
            metalness_map=surface,
            roughness_map=surface,
            emissive=colour(m.emissive_factor),
            emissive_intensity=1.0 if strength is None else min(strength.emissive_strength, 60000.0),
            emissive_map=self._map(m.emissive_texture),
            normal_map=self._map(m.normal_texture),
            ao_map=self._map(m.occlusion_texture),
        )
        if m.normal_texture is not None:
            material.normal_scale = (m.normal_texture.scale, m.normal_texture.scale)
        if m.occlusion_texture is not None:
            material.ao_map_intensity = min(max(m.occlusion_texture.strength, 0.0), 1.0)
        return material


def uv_matrix(transform: schema.TextureTransform) -> np.ndarray:
    """Compose KHR_texture_transform, (3, 3): first scaled, then turned (counter-clockwise as seen, v being down), then moved."""
    c, s = np.cos(transform.rotation), np.sin(transform.rotation)
    (x, y), (u, v) = transform.scale, transform.offset
    return np.array([[c * x, s * y, u], [-s * x, c * y, v], [0, 0, 1]])


TEXTURE_MAPS = ("map", "emissive_map", "normal_map", "ao_map", "metalness_map", "roughness_map")
_LEAST = ("ao_map", "metalness_map", "roughness_map", "normal_map", "emissive_map")  # which to leave out first


def broken_driver() -> bool:
    """Tell whether pygfx draws by Mesa's llvmpipe of a version before 24, see `spare_maps`."""
    info = gfx.renderers.wgpu.get_shared().adapter.info
    version = re.search(r"Mesa (\d+)\.", info["description"])
    return "llvmpipe" in info["device"] and (version is None or int(version[1]) < 24)


def spare_maps(material: gfx.Material, others: int) -> list[str]:
    """Leave out maps, the least needed first, until they and `others` (an environment, each kind of light) are 6; returns their names.

    For the driver above: beyond that the lights' uniform buffers have indices from 11 on, which its search for uniforms that steer
    branches writes over its pipeline (seen with 22.3.6); sooner or later that ends the process.
    """
    if not isinstance(material, gfx.MeshStandardMaterial):
        return []
    lost: list[str] = []
    order = [name for name in _LEAST[1:3] if _spread(material, name) < 2] + list(_LEAST)  # what is flat is no loss
    for name in order:
        if others + sum(getattr(material, each) is not None for each in TEXTURE_MAPS) <= 6:
            break
        found = getattr(material, name)
        if found is None:
            continue
        if name in _CHANNEL:
            factor, channel = _CHANNEL[name]
            setattr(material, factor, getattr(material, factor) * float(found.texture.data[..., channel].mean()) / 255)
        if _spread(material, name) >= 2:
            lost.append(name)
        setattr(material, name, None)
    return lost


_CHANNEL = {"metalness_map": ("metalness", 2), "roughness_map": ("roughness", 1)}


def _spread(material: gfx.Material, name: str) -> int:
    """Measure how far the codes of a map differ, in the channel that counts."""
    found = getattr(material, name)
    if found is None:
        return 0
    codes = found.texture.data[..., _CHANNEL[name][1]] if name in _CHANNEL else found.texture.data[..., :3]
    return int(np.ptp(codes, axis=(0, 1)).max())


def channels(material: gfx.Material) -> set[int]:
    """Collect the sets of texture coordinates that a material needs."""
    return {found.uv_channel for name in TEXTURE_MAPS if (found := getattr(material, name, None)) is not None}
