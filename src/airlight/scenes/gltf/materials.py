"""Make materials and textures of a checked glTF file as those of pygfx."""

import re
from typing import Any

import numpy as np
import pygfx as gfx

from airlight.scenes.gltf import glass, glossiness, images, opacity, schema
from airlight.scenes.gltf.validate import Gltf

_WRAP = {33071: "clamp", 33648: "mirror", 10497: "repeat"}
_NEAREST, _LINEAR = 9728, 9729
_MIN_NEAREST = (9728, 9984, 9986)
_MIP_NEAREST = (9984, 9985)
MOST_CUTOFF = 0.998  # of an alpha test, or what filters leave of 1 would be cut


def colour(linear: tuple[float, ...]) -> gfx.Color:
    """Make a colour of linear numbers, 0..1, with or without alpha."""
    r, g, b, *alpha = (min(max(value, 0.0), 1.0) for value in linear)
    return gfx.Color.from_physical(r, g, b, *alpha)


class Materials:
    """Makes each texture and material once."""

    def __init__(self, gltf: Gltf) -> None:
        self._gltf = gltf
        self._textures: dict[tuple[int, bool, bool], gfx.Texture] = {}
        self._parts: dict[tuple[int, bool, opacity.Range, bool], list[gfx.Material]] = {}

    def _texture(self, image: int, mips: bool, bled: bool) -> gfx.Texture:
        if (image, mips, bled) not in self._textures:
            data, kind = self._gltf.image(image)
            pixels = images.pixels(data, kind, f"{self._gltf.container.path}: image {image}")
            pixels = opacity.bled(pixels) if bled else pixels
            self._textures[image, mips, bled] = gfx.Texture(pixels, dim=2, generate_mipmaps=mips)
        return self._textures[image, mips, bled]

    def _map(self, info: schema.TextureInfo | None, bled: bool = False) -> gfx.TextureMap | None:
        """Make a map of a texture. bled: of one whose alpha counts, see `opacity.bled`."""
        if info is None:
            return None
        document = self._gltf.document
        texture = document.textures[info.index]
        source = self._gltf.source(info.index)
        if source is None:  # of an extension
            return None
        sampler = schema.Sampler() if texture.sampler is None else document.samplers[texture.sampler]
        found = gfx.TextureMap(
            self._texture(source, sampler.min_filter not in (_NEAREST, _LINEAR), bled),
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
        """Make the material as one, or glTF's default one. flat: of a mesh without normals."""
        return self._made(self._described(index), flat, opacity.SOLID)

    def parts(
        self, index: int | None, flat: bool = False, alphas: opacity.Range = (1.0, 1.0), painted: bool = False
    ) -> list[gfx.Material]:
        """Make the materials that show a mesh, to be drawn one after the other; none for what is cut away whole.

        painted: its vertices have colours; alphas: the range of theirs.
        """
        key = (-1 if index is None else index, flat, alphas, painted)
        if key not in self._parts:
            m = self._described(index)
            found = self._glass(m, flat, painted) if m.extensions.transmission is not None else []
            if not found:
                found = [self._made(m, flat, settings) for settings in self._modes(m, alphas)]
                self._glossy(m, found)
            self._parts[key] = found
        return self._parts[key]

    def blends(self, index: int | None) -> bool:
        """Tell whether a material may be drawn over what is behind."""
        m = self._described(index)
        return m.alpha_mode == "BLEND" or m.extensions.transmission is not None

    def _described(self, index: int | None) -> schema.Material:
        return schema.Material() if index is None else glossiness.with_factors(self._gltf.document.materials[index])

    def _glossy(self, m: schema.Material, made: list[gfx.Material]) -> None:
        """Give materials made of `glossiness.with_factors` the textures that it leaves out."""
        old = m.extensions.specular_glossiness
        if old is None or m.extensions.unlit is not None or not made:
            return
        diffuse, shine = old.diffuse_texture, old.specular_glossiness_texture
        place = diffuse or shine
        if place is None or (shine is not None and not place.same_place(shine)):
            return
        base, surface = (self._map(place) for _ in range(2))
        if base is None or surface is None:
            return
        pixels = glossiness.textures(old, self._codes(diffuse, m.alpha_mode != "OPAQUE"), self._codes(shine))
        for found, codes in zip((base, surface), pixels, strict=True):
            found.texture = gfx.Texture(codes, dim=2, generate_mipmaps=True)
        for material in made:
            material.map, material.metalness_map, material.roughness_map = base, surface, surface
            material.color, material.metalness, material.roughness = (1, 1, 1, material.color.a), 1, 1

    def _codes(self, info: schema.TextureInfo | None, bled: bool = False) -> np.ndarray | None:
        """Read the codes of a texture, (H, W, 4) uint8; None where there is none. bled: as in `_map`."""
        found = self._map(info, bled)
        return None if found is None else np.asarray(found.texture.data)

    def _mean(self, info: schema.TextureInfo | None, channel: int) -> float:
        """Average a channel of a texture, 0..1; 1 where there is none."""
        codes = self._codes(info)
        return 1.0 if codes is None else float(codes[..., channel].mean()) / 255

    def _modes(self, m: schema.Material, alphas: opacity.Range) -> list[dict[str, Any]]:
        """Choose pygfx's settings for the draws of a material that lets no light through."""
        if m.alpha_mode == "MASK":
            return [] if m.alpha_cutoff > 1 else [{**opacity.SOLID, "alpha_test": min(m.alpha_cutoff, MOST_CUTOFF)}]
        if m.alpha_mode == "OPAQUE":
            return [opacity.SOLID]
        pbr = m.pbr_metallic_roughness
        codes = self._codes(pbr.base_color_texture, bled=True)
        alpha = None if codes is None else codes[..., 3]
        return opacity.layers(opacity.alpha_range(alpha, pbr.base_color_factor[3], alphas), opacity.is_cut_out(alpha))

    def _glass(self, m: schema.Material, flat: bool, painted: bool) -> list[gfx.Material]:
        """Make the materials of what light passes; none for what it does not."""
        info = m.pbr_metallic_roughness.base_color_texture
        mask = None if m.extensions.transmission is None else m.extensions.transmission.transmission_texture
        share, codes = glass.transmission(m, self._mean(m.pbr_metallic_roughness.metallic_roughness_texture, 2)), self._codes(mask)
        framed = mask is not None and codes is not None and m.alpha_mode == "OPAQUE" and (info is None or info.same_place(mask))
        if codes is not None and not framed:
            share *= float(codes[..., 0].mean()) / 255
        if not glass.is_glass(m, share):
            return []
        base, least, passed = self._map(info, m.alpha_mode != "OPAQUE"), share, share * glass.tint(m)
        through, alpha = base, min(max(m.pbr_metallic_roughness.base_color_factor[3], 0.0), 1.0)
        if framed and codes is not None and (base := base or self._map(mask)) is not None:
            inside = glass.in_frame(codes, self._codes(info), share)
            clear = inside[..., 3] < 255
            least, passed = 1 - float(inside[..., 3].max(initial=0, where=clear)) / 255, glass.tint(m)
            through = self._map(info or mask)
            assert through is not None
            for found, own in ((base, inside), (through, glass.through_frame(inside))):
                found.texture = gfx.Texture(own, dim=2, generate_mipmaps=True)
        elif m.alpha_mode == "BLEND":
            through, covered = self._map(info, True), self._codes(info, True)
            if through is None or covered is None:
                passed = 1 - alpha * (1 - passed)
            else:
                through.texture = gfx.Texture(glass.through_cover(covered, passed, alpha), dim=2, generate_mipmaps=True)
                passed = np.ones(3)
        tinted = through is not None or painted or float(passed.min()) < 1
        made: list[gfx.Material] = []
        for what, settings in glass.draws(share, least, framed, tinted):
            if m.alpha_mode == "MASK":
                settings = {**settings, "alpha_test": min(m.alpha_cutoff, MOST_CUTOFF) * settings.get("opacity", 1.0)}
            if what == "tint":
                cut = (alpha,) if m.alpha_mode == "MASK" else ()
                made.append(gfx.MeshBasicMaterial(color=colour((*passed, *cut)), map=through, side=_side(m), **settings))
                continue
            made.append(self._made(m, flat, settings))
            if framed:
                made[-1].map = base
            if what == "gloss":
                made[-1].color = (0, 0, 0, made[-1].color.a)
                made[-1].emissive_intensity *= share if share < 1 - glass.BODY else 1
        return made

    def _made(self, m: schema.Material, flat: bool, settings: dict[str, Any]) -> gfx.Material:
        """Make a material with pygfx's settings of alpha and depth."""
        pbr = m.pbr_metallic_roughness
        base = self._map(pbr.base_color_texture, m.alpha_mode != "OPAQUE")
        common = {"color": colour(pbr.base_color_factor), "map": base, "side": _side(m), **settings}
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


def _side(m: schema.Material) -> str:
    return "both" if m.double_sided else "front"


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
