"""Materials and textures of glTF files."""

import warnings
from pathlib import Path

import gltfs
import numpy as np
import pygfx as gfx
import pytest
from gltf_stage import Eye, drawn, flat, frontal
from gltfs import SQUARE, SQUARE_FACES, SQUARE_UV, Writer
from hypothesis import given
from hypothesis import strategies as st

from airlight.scenes import lamps, open_scene
from airlight.scenes.gltf import images, materials, schema


def colour_of(eye: Eye, w: Writer, tmp_path: Path, x: float = 0, y: float = 0) -> np.ndarray:
    stage = open_scene(w.save(tmp_path), "none")
    return eye.linear(stage.scene, frontal())[round(32 - 16 * y), round(48 + 16 * x), :3]


def test_base_colour_is_factor_times_texture_times_vertex_colour(tmp_path: Path, eye: Eye) -> None:
    w = Writer()
    texture = w.texture(np.full((2, 2, 4), (188, 255, 255, 255), np.uint8))  # 188: 0.503 linear
    pbr = {"baseColorFactor": [0.5, 0.25, 1, 1], "baseColorTexture": {"index": texture}}
    colors = w.accessor([[255, 255, 51]] * 4, "uint8", normalized=True)
    w.node(mesh=w.mesh(SQUARE, SQUARE_FACES, flat(w, pbrMetallicRoughness=pbr), TEXCOORD_0=SQUARE_UV, COLOR_0=colors))
    np.testing.assert_allclose(colour_of(eye, w, tmp_path), [0.5 * 0.503, 0.25, 0.2], rtol=0.01)


def test_alpha_modes_and_samplers(tmp_path: Path, eye: Eye) -> None:
    pixels = np.full((1, 32, 4), 255, np.uint8)
    pixels[0, :, 3] = np.repeat([255, 140, 120, 0], 8)
    for mode, expected in (("OPAQUE", [1, 1, 1, 1]), ("MASK", [1, 1, 0, 0]), ("BLEND", [1, 140 / 255, 120 / 255, 0])):
        w = Writer()
        texture = w.texture(pixels, {"magFilter": 9728, "minFilter": 9728, "wrapS": 33071, "wrapT": 33071})
        material = flat(w, pbrMetallicRoughness={"baseColorTexture": {"index": texture}}, alphaMode=mode)
        w.node(mesh=w.mesh(SQUARE, SQUARE_FACES, material, TEXCOORD_0=SQUARE_UV))
        stage = open_scene(w.save(tmp_path), "none")
        row = eye.linear(stage.scene, frontal())[32, [36, 44, 52, 60], 0]
        np.testing.assert_allclose(row, expected, atol=0.02, err_msg=mode)
    w.json["materials"][0].update(alphaMode="MASK", alphaCutoff=0.3)
    stage = open_scene(w.save(tmp_path), "none")
    assert (eye.linear(stage.scene, frontal())[32, [36, 44, 52, 60], 0] > 0.5).tolist() == [True, True, True, False]


def test_emission_and_its_strength(tmp_path: Path, eye: Eye) -> None:
    w = Writer()
    glow = w.add(
        "materials",
        emissiveFactor=[1, 0.5, 0],
        pbrMetallicRoughness={"baseColorFactor": [0, 0, 0, 1], "metallicFactor": 0},
        extensions={"KHR_materials_emissive_strength": {"emissiveStrength": 12}},
    )
    w.node(mesh=w.mesh(SQUARE, SQUARE_FACES, glow, NORMAL=[[0, 0, 1]] * 4))
    w.node(extensions=w.light(type="directional", intensity=1e-6))
    np.testing.assert_allclose(colour_of(eye, w, tmp_path), [12, 6, 0], atol=0.1)


def test_textures_without_coordinates_and_wrong_channels_still_draw(tmp_path: Path, eye: Eye) -> None:
    w = Writer()
    texture = {"index": w.texture(np.full((2, 2, 4), 255, np.uint8)), "texCoord": 3}
    pbr = {"baseColorTexture": texture, "metallicFactor": 0}
    w.node(mesh=w.mesh(SQUARE, SQUARE_FACES, w.add("materials", pbrMetallicRoughness=pbr, normalTexture={"index": 0, "texCoord": 1})))
    assert colour_of(eye, w, tmp_path).min() > 0.1


@given(st.floats(-4, 4), st.tuples(*[st.floats(-3, 3)] * 4), st.tuples(*[st.floats(-2, 2)] * 2))
def test_texture_transform(turn: float, numbers: tuple[float, ...], uv: tuple[float, float]) -> None:
    """Scale, turn, move: counter-clockwise as seen, v being down."""
    transform = schema.TextureTransform(offset=numbers[:2], rotation=turn, scale=numbers[2:])
    found = materials.uv_matrix(transform) @ (*uv, 1)
    u, v = uv[0] * numbers[2], uv[1] * numbers[3]
    z = (u + 1j * v) * np.exp(-1j * turn)
    np.testing.assert_allclose(found, [z.real + numbers[0], z.imag + numbers[1], 1], atol=1e-9)


def test_large_images_are_halved() -> None:
    pixels = np.zeros((3, images.MAX_SIDE * 2, 4), np.uint8)
    pixels[..., 0], pixels[:, ::2, 1], pixels[..., 3] = 200, 100, 255
    found = images.pixels(gltfs.png(pixels), "png", "it")
    assert found.shape == (1, images.MAX_SIDE, 4)
    assert found[0, 5].tolist() == [200, 50, 0, 255]


def test_maps_are_spared_where_the_driver_fails(tmp_path: Path, eye: Eye, monkeypatch: pytest.MonkeyPatch) -> None:
    """Flat maps go first, without a word and without a change; the picture is drawn, and the process lives."""
    w = Writer()
    noise = np.random.default_rng(1).integers(0, 256, (8, 8, 4), np.uint8)
    surface = noise.copy()
    surface[..., 2], noise[..., 3] = 51, 255
    rough, varied = ({"index": w.texture(pixels)} for pixels in (surface, noise))
    pbr = {"baseColorTexture": varied, "metallicRoughnessTexture": rough, "metallicFactor": 0.5}
    w.add("materials", pbrMetallicRoughness=pbr, normalTexture=varied, occlusionTexture=varied, emissiveTexture=varied)
    w.node(mesh=w.mesh(SQUARE, SQUARE_FACES, 0, NORMAL=[[0, 0, 1]] * 4, TEXCOORD_0=SQUARE_UV))
    w.node(extensions=w.light(type="directional"))

    def shown(broken: bool, words: str = "") -> tuple[set[str], gfx.Material]:
        monkeypatch.setattr(lamps, "broken_driver", lambda: broken)
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            stage = open_scene(w.save(tmp_path), "none")
        assert [str(one.message).partition("shown without its ")[2].partition(":")[0] for one in said] == ([words] if words else [])
        (mesh,) = drawn(stage)
        if broken:
            assert np.isfinite(eye.linear(stage.scene, frontal())).all()
        return {name for name in materials.TEXTURE_MAPS if getattr(mesh.material, name) is not None}, mesh.material

    everything = set(materials.TEXTURE_MAPS)
    assert shown(False)[0] == everything
    kept, material = shown(True)
    assert kept == everything - {"metalness_map"} and material.metalness == pytest.approx(0.1)
    w.node(extensions=w.light(type="point"))
    assert shown(True, "ao maps")[0] == everything - {"metalness_map", "ao_map"}
    w.node(extensions=w.light(type="spot"))
    assert shown(True, "ao maps, roughness maps")[0] == {"map", "normal_map", "emissive_map"}
