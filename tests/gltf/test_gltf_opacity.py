"""Which parts of blended materials are solid, and glass."""

from pathlib import Path
from typing import Any

import gltfs
import numpy as np
import pytest
from gltf_stage import Eye, drawn, flat, frontal
from gltfs import SQUARE, SQUARE_FACES, SQUARE_UV, Writer
from hypothesis import given
from hypothesis import strategies as st

from airlight.gpu.device import shared_device
from airlight.options import Parameters, SceneOptions
from airlight.pygfx.casters import Casters
from airlight.scenes import open_scene
from airlight.scenes.gltf import glass, glossiness, opacity, schema
from airlight.scenes.gltf.meshes import vertices
from airlight.scenes.offline import Shot, Studio

CASES = Path(__file__).parents[1] / "data" / "cases"
Y, X = np.mgrid[-1 : 1 : 64j, -1 : 1 : 64j]
DISC = np.hypot(X, Y) < 0.6


def codes(alpha: Any) -> np.ndarray:
    return np.rint(255 * np.clip(alpha, 0, 1)).astype(np.uint8)


def texels(alpha: Any, colour: tuple[int, int, int] = (255, 255, 255)) -> np.ndarray:
    """(64, 64, 4) of one colour; black where clear."""
    pixels = np.zeros((64, 64, 4), np.uint8)
    pixels[..., 3] = codes(alpha)
    pixels[pixels[..., 3] > 0, :3] = colour
    return pixels


def sheet(w: Writer, material: dict[str, Any], pixels: np.ndarray | None = None, z: float = 0, **more: Any) -> int:
    """A lit square, two wide, at z, of a material with a base colour texture."""
    pbr = {"metallicFactor": 0, **material.pop("pbr", {})}
    if pixels is not None:
        pbr["baseColorTexture"] = {"index": w.texture(pixels)}
    index = w.add("materials", pbrMetallicRoughness=pbr, **material)
    return w.node(
        mesh=w.mesh(SQUARE, SQUARE_FACES, index, NORMAL=[[0, 0, 1]] * 4, TEXCOORD_0=SQUARE_UV, **more), translation=[0, 0, z]
    )


def modes(w: Writer, folder: Path) -> list[tuple[str, bool, bool]]:
    """(alpha mode, writes depth, casts on surfaces) of what is drawn."""
    stage = open_scene(w.save(folder), "none")
    found = drawn(stage)
    casting = [mesh for mesh, _ in Casters(shared_device(), stage.scene).gather()[0]]
    assert casting == [mesh for mesh in found if mesh.cast_shadow]
    return [(mesh.material.alpha_mode, mesh.material.depth_write, mesh.cast_shadow) for mesh in found]


WHOLE, VEIL = ("solid", True, True), ("blend", False, False)


@pytest.mark.parametrize("scale", [1, 20])
def test_cut_outs_are_told_from_what_fades(scale: int) -> None:
    distance = np.hypot(X, Y)
    soft, smoke = np.clip((0.6 - distance) * 16 + 0.5, 0, 1), np.clip(1.2 - distance, 0, 1)
    pane = np.where(DISC, 0.4, 1)
    found = [opacity.is_cut_out(np.kron(codes(alpha), np.ones((scale, scale), np.uint8))) for alpha in (DISC, soft, smoke, pane)]
    assert found == [True, True, False, False] and not opacity.is_cut_out(None)


def test_blended_materials_are_solid_where_they_are_opaque(tmp_path: Path) -> None:
    def found(alpha: Any = None, factor: float = 1.0, **more: Any) -> list[tuple[str, bool, bool]]:
        w = Writer()
        sheet(w, {"alphaMode": "BLEND", "pbr": {"baseColorFactor": [1, 1, 1, factor]}}, None if alpha is None else texels(alpha), **more)
        return modes(w, tmp_path)

    assert found() == found(np.full((64, 64), 0.97)) == [WHOLE]  # a fault of exporters
    assert found(DISC) == [WHOLE, VEIL]
    assert found(np.full((64, 64), 0.9)) == found(factor=0.5) == found(DISC, 0.5) == [VEIL]
    assert found(COLOR_0=[[1, 1, 1, 0.5]] * 4) == [VEIL]
    assert found(COLOR_0=[[1, 1, 1, 0.5]] * 2 + [[1, 1, 1, 1]] * 2) == [WHOLE, VEIL]


@pytest.mark.parametrize(("cutoff", "seen"), [(0, 1), (0.25, 1), (0.35, 0), (1, 0), (1.5, 0)])
def test_cutoffs_to_their_ends(tmp_path: Path, eye: Eye, cutoff: float, seen: int) -> None:
    """A texture's 0.6 times a factor's 0.5; at 1 what is opaque stays, beyond nothing does."""
    w = Writer()
    wall = flat(w, pbrMetallicRoughness={"baseColorFactor": [0, 1, 0, 1]})
    w.node(mesh=w.mesh(SQUARE, SQUARE_FACES, wall), translation=[3, 0, 0])
    material = flat(w, alphaMode="MASK", alphaCutoff=cutoff)
    texture = {"index": w.texture(texels(np.full((64, 64), 0.6)))}
    w.json["materials"][material]["pbrMetallicRoughness"] = {"baseColorTexture": texture, "baseColorFactor": [1, 1, 1, 0.5]}
    w.node(mesh=w.mesh(SQUARE, SQUARE_FACES, material, TEXCOORD_0=SQUARE_UV))
    assert eye.linear(open_scene(w.save(tmp_path), "none").scene, frontal())[32, 48, 0] == pytest.approx(seen, abs=0.02)
    w.json["materials"][material]["pbrMetallicRoughness"] = {}
    assert eye.linear(open_scene(w.save(tmp_path), "none").scene, frontal())[32, 48, 0] == pytest.approx(float(cutoff <= 1), abs=0.02)


def test_clear_texels_take_the_colour_beside_them() -> None:
    """And no filter mixes black into the edges."""
    pixels = texels(DISC, (200, 40, 10))
    found = opacity.bled(pixels)
    assert (found[..., :3] == (200, 40, 10)).all() and (found[..., 3] == pixels[..., 3]).all()
    for shape in ((1, 1), (1, 7), (5, 3)):
        odd = np.zeros((*shape, 4), np.uint8)
        assert (opacity.bled(odd) == 0).all()
        odd[0, -1] = 9, 8, 7, 255
        assert (opacity.bled(odd)[..., :3] == (9, 8, 7)).all()
    two = np.zeros((8, 64, 4), np.uint8)
    two[:, 0], two[:, 63] = (250, 0, 0, 255), (0, 250, 0, 255)
    assert (opacity.bled(two)[:, 1:30, 0] > opacity.bled(two)[:, 1:30, 1]).all()


def test_edges_are_smooth_and_leaves_behind_leaves_do_not_shine_through(tmp_path: Path, eye: Eye) -> None:
    """Two discs with soft edges: what is nearer is drawn first, and hides the other all the same."""
    w = Writer()
    soft = np.clip((0.6 - np.hypot(X, Y)) * 8 + 0.5, 0, 1)
    for z, colour in ((1, [1, 0, 0, 1]), (0, [0, 1, 0, 1])):
        material = flat(w, alphaMode="BLEND", pbrMetallicRoughness={"baseColorFactor": colour})
        w.json["materials"][material]["pbrMetallicRoughness"]["baseColorTexture"] = {"index": w.texture(texels(soft))}
        w.node(mesh=w.mesh(SQUARE, SQUARE_FACES, material, TEXCOORD_0=SQUARE_UV), translation=[0, 0, z])
    picture = eye.linear(open_scene(w.save(tmp_path), "none").scene, frontal())
    assert picture[32, 48, :2] == pytest.approx([1, 0], abs=0.01)
    row = picture[32, 48:64, :2]
    assert (np.diff(row[:, 0]) < 0.01).all() and (row[row[:, 0] > 0.5] == [1, 0]).all()
    assert ((row[:, 0] > 0.03) & (row[:, 0] < 0.97)).any()


@pytest.mark.parametrize("nearest", [0, 1])
def test_what_is_blended_is_sorted_by_where_its_vertices_are(tmp_path: Path, eye: Eye, nearest: int) -> None:
    """Panes of one node: red before green, whichever the file has first."""
    w = Writer()
    panes = [(1, [1, 0, 0, 0.5]), (-1, [0, 1, 0, 0.5])]
    for z, colour in panes if nearest == 0 else reversed(panes):
        material = flat(w, alphaMode="BLEND", pbrMetallicRoughness={"baseColorFactor": colour})
        w.node(mesh=w.mesh(np.add(SQUARE, [0, 0, z]), SQUARE_FACES, material))
    picture = eye.linear(open_scene(w.save(tmp_path), "none").scene, frontal())
    assert picture[32, 48, :2] == pytest.approx([0.5, 0.25], abs=0.02)


def test_skins_and_morph_targets_move_both_parts(tmp_path: Path) -> None:
    w = Writer()
    bone = w.node()
    joints = w.accessor([[0, 0, 0, 0]] * 4, "uint8")
    skinned = sheet(w, {"alphaMode": "BLEND"}, texels(DISC), JOINTS_0=joints, WEIGHTS_0=[[1, 0, 0, 0]] * 4)
    w.json["nodes"][skinned]["skin"] = w.add("skins", joints=[bone])
    target = {"POSITION": w.accessor([[0, 0, 1]] * 4)}
    morphed = sheet(w, {"alphaMode": "BLEND"}, texels(DISC), targets=[target])
    w.animate(bone, "translation", [0, 1], [[0, 0, 0], [0, 3, 0]])
    w.animate(morphed, "weights", [0, 1], [[0], [1]], clip=0)
    stage = open_scene(w.save(tmp_path), "none")
    still = [vertices(mesh) for mesh in drawn(stage)]
    assert len(still) == 4
    stage.pose(0.5, None)
    moved = [vertices(mesh) - before for mesh, before in zip(drawn(stage), still, strict=True)]
    assert all(np.ptp(found, axis=0).max() < 1e-6 for found in moved)
    assert sorted(tuple(found[0].round(6).tolist()) for found in moved) == 2 * [(0, 0, 0.5)] + 2 * [(0, 1.5, 0)]


# ---------------------------------------------------------------- glass


def through(w: Writer, folder: Path, eye: Eye, x: float = 0, y: float = 0) -> np.ndarray:
    """The colour of what is before a white wall."""
    wall = w.mesh(np.multiply(SQUARE, 3), SQUARE_FACES, flat(w))
    w.node(mesh=wall, translation=[0, 0, -2])
    w.node(extensions=w.light(type="directional", intensity=1e-6))
    return eye.linear(open_scene(w.save(folder), "none").scene, frontal())[round(32 - 16 * y), round(48 + 16 * x), :3]


def pane(w: Writer, factor: float, colour: Any = (1, 1, 1), pixels: Any = None, texture: Any = None, **more: Any) -> None:
    info = {} if texture is None else {"transmissionTexture": {"index": w.texture(texture)}}
    extensions = {"KHR_materials_transmission": {"transmissionFactor": factor, **info}, **more.pop("extensions", {})}
    sheet(w, {"extensions": extensions, "pbr": {"baseColorFactor": [*colour, 1], "roughnessFactor": 1}, **more}, pixels)


def test_light_passes_glass_tinted(tmp_path: Path, eye: Eye) -> None:
    cases: list[tuple[tuple[Any, ...], dict[str, Any], Any]] = [
        ((1.0,), {}, [1, 1, 1]),
        ((1.0, (1, 0.5, 0.25)), {}, [1, 0.5, 0.25]),
        ((0.6, (1, 0.5, 1)), {}, [0.6, 0.3, 0.6]),
        ((1.0, (0.5, 1, 1), texels(np.ones((64, 64)), (255, 255, 0))), {}, [0.5, 1, 0]),
        ((1.0,), {"emissiveFactor": [0, 0.5, 0]}, [1, 1.5, 1]),
        ((0.6,), {"emissiveFactor": [0, 0.5, 0]}, [0.6, 1.1, 0.6]),
        ((0.4,), {}, [0.4, 0.4, 0.4]),
        ((0.04,), {}, [0, 0, 0]),  # solid, and it is dark
        ((1.0, (0.01, 0.01, 0.01)), {}, [0, 0, 0]),
        ((1.0, (1, 0.5, 0.25)), {"alphaMode": "BLEND"}, [1, 0.5, 0.25]),
        ((1.0, (0.5, 0.5, 1), texels(np.full((64, 64), 0.5), (0, 255, 255))), {"alphaMode": "BLEND"}, [0.5, 0.75, 1]),  # half of it is open
        ((1.0,), {"extensions": {"KHR_materials_unlit": {}}, "emissiveFactor": [0, 0, 0]}, [1, 1, 1]),
    ]
    for values, more, expected in cases:
        w = Writer()
        pane(w, *values, **more)
        np.testing.assert_allclose(through(w, tmp_path, eye), expected, atol=0.1, err_msg=str((values[0], more)))


def test_glass_neither_casts_nor_writes_depth_and_what_lets_little_through_does(tmp_path: Path) -> None:
    def found(factor: float, **more: Any) -> list[tuple[str, bool, bool]]:
        w = Writer()
        pane(w, factor, **more)
        return modes(w, tmp_path)

    assert found(1.0) == [("add", False, False)]
    assert found(1.0, colour=(1, 0.5, 0.5)) == [("multiply", False, False), ("add", False, False)]
    assert found(0.7) == found(0.2) == [("multiply", False, False), ("add", False, False), ("add", False, False)]
    assert found(0.04) == found(1.0, colour=(0.02, 0.01, 0)) == [WHOLE]
    assert found(1.0, alphaMode="BLEND", colour=(1, 0.5, 0.5)) == [("multiply", False, False), ("add", False, False)]


def test_holes_in_glass_are_holes(tmp_path: Path, eye: Eye) -> None:
    for factor, expected in ((1.0, [1, 0.5, 1]), (0.6, [0.6, 0.3, 0.6])):
        w = Writer()
        pane(w, factor, (1, 0.5, 1), texels(DISC), alphaMode="MASK")
        assert through(w, tmp_path, eye) == pytest.approx(expected, abs=0.1)
        assert through(w, tmp_path, eye, 0.9, 0.9) == pytest.approx([1, 1, 1], abs=0.02)


def test_metal_lets_nothing_through_and_volumes_colour() -> None:
    base = {"transmission": schema.Transmission(transmission_factor=1.0)}
    extensions = schema.MaterialExtensions(**base)
    metal = schema.Material(extensions=extensions)
    assert glass.transmission(metal) == 0 and glass.transmission(metal, 0.25) == 0.75
    volume = schema.Volume(thickness_factor=0.5, attenuation_distance=0.25, attenuation_color=(1, 0.5, 0.1))
    thick = schema.Material(extensions=schema.MaterialExtensions(**base, volume=volume))
    np.testing.assert_allclose(glass.tint(thick), [1, 0.25, 0.01])


def test_a_texture_tells_panes_from_their_frame(tmp_path: Path, eye: Eye) -> None:
    mask = texels(np.ones((64, 64)), (0, 0, 0))
    mask[DISC, 0] = 255
    w = Writer()
    pane(w, 1.0, (1, 0.5, 1), texture=mask)
    assert through(w, tmp_path, eye) == pytest.approx([1, 0.5, 1], abs=0.1)
    assert through(w, tmp_path, eye, 0.9, 0.9) == pytest.approx([0, 0, 0], abs=0.3)  # no light, but ambient
    w = Writer()
    pane(w, 1.0, texture=mask)
    assert modes(w, tmp_path)[0] == WHOLE and [cast for *_, cast in modes(w, tmp_path)] == [True, False, False]
    for value in (0.7, 0.2):  # as much as the texture says, texel by texel
        mask[DISC, 0] = round(255 * value)
        w = Writer()
        pane(w, 1.0, (1, 0.5, 1), texture=mask)
        assert through(w, tmp_path, eye) == pytest.approx([value, value / 2, value], abs=0.1)


# ---------------------------------------------------------------- specular-glossiness


def test_glossiness_is_converted() -> None:
    def of(diffuse: Any, specular: Any, gloss: float = 1.0) -> schema.MetallicRoughness:
        old = schema.SpecularGlossiness(diffuse_factor=(*diffuse, 1), specular_factor=specular, glossiness_factor=gloss)
        material = schema.Material(extensions=schema.MaterialExtensions(specular_glossiness=old))
        return glossiness.with_factors(material).pbr_metallic_roughness

    plain, gold = of((0.8, 0.2, 0.1), (0.04,) * 3, 0.3), of((0, 0, 0), (1.0, 0.77, 0.34), 0.5)
    assert plain.metallic_factor == 0 and plain.roughness_factor == pytest.approx(0.7)
    assert plain.base_color_factor == pytest.approx((0.8, 0.2, 0.1, 1), abs=1e-3)
    assert gold.metallic_factor == pytest.approx(1, abs=0.01) and gold.roughness_factor == 0.5
    assert gold.base_color_factor == pytest.approx((1.0, 0.77, 0.34, 1), abs=0.01)


@given(st.floats(0, 1), st.floats(0, 1), st.tuples(*[st.floats(0, 1)] * 6))
def test_what_surfaces_scatter_and_reflect_stays(diffuse: float, specular: float, numbers: tuple[float, ...]) -> None:
    """Of greys: 0.04 is reflected by what is no metal, and the base colour by what is. Of colours nothing is beyond its range."""
    (colour, *_), metal = glossiness.converted([diffuse] * 3, [specular] * 3)
    assert 0.04 * (1 - metal) + colour * metal == pytest.approx(max(specular, 0.04), abs=1e-3)
    assert 0.96 * (1 - metal) * colour == pytest.approx(diffuse * (1 - specular), abs=0.041)
    colours, metal = glossiness.converted(numbers[:3], numbers[3:])
    assert colours.shape == (3,) and ((colours >= 0) & (colours <= 1)).all() and 0 <= metal <= 1


def test_old_materials_have_their_colours(tmp_path: Path) -> None:
    """Of gold on the left and paint on the right, as two textures of two sizes say."""
    w = Writer()
    paint, shine = texels(np.ones((64, 64)), (10, 200, 10)), np.full((32, 32, 4), 56, np.uint8)
    paint[:, :32, :3], shine[:, :16] = 0, (255, 220, 120, 204)
    old = {"diffuseTexture": {"index": w.texture(paint)}, "glossinessFactor": 0.5, "diffuseFactor": [1, 1, 1, 0.5]}
    old["specularGlossinessTexture"] = {"index": w.texture(shine)}
    material = w.add("materials", extensions={"KHR_materials_pbrSpecularGlossiness": old}, alphaMode="BLEND")
    w.node(mesh=w.mesh(SQUARE, SQUARE_FACES, material, NORMAL=[[0, 0, 1]] * 4, TEXCOORD_0=SQUARE_UV))
    w.json["extensionsRequired"] = ["KHR_materials_pbrSpecularGlossiness"]
    (mesh,) = drawn(open_scene(w.save(tmp_path), "none"))
    found = mesh.material
    assert (found.metalness, found.roughness, found.alpha_mode, found.color.a) == (1, 1, "blend", 0.5)
    base, surface = found.map.texture.data, found.metalness_map.texture.data
    np.testing.assert_allclose(base[[5, 60], [5, 60]], [[255, 220, 120, 255], [10, 200, 10, 255]], atol=5)
    np.testing.assert_allclose(surface[[5, 60], [5, 60], 1:3], [[153, 255], [227, 0]], atol=3)


# ---------------------------------------------------------------- whole pictures


def picture(data: bytes, folder: Path, method: str, occluders: str = "stencil") -> np.ndarray:
    """(90, 160, 3), 0..255: what a display shows."""
    path = folder / "case.glb"
    path.write_bytes(data)
    options = SceneOptions(occluders=occluders)  # type: ignore[arg-type]
    pixels = Studio(open_scene(path), Shot(160, 90), Parameters(method=method), None, options).frame().pixels()  # type: ignore[arg-type]
    return 255 * np.clip(pixels, 0, 1)


def changed(name: str, change: Any) -> bytes:
    document, binary = gltfs.parts((CASES / name).read_bytes())
    change(document)
    return gltfs.glb(gltfs.json.dumps(document).encode(), binary)


@pytest.mark.parametrize("way", [pytest.param(("epipolar",), marks=pytest.mark.slow), ("epipolar", "prepass"), ("march",)])
def test_blended_leaves_look_like_masked_ones(tmp_path: Path, way: tuple[str, ...]) -> None:
    def alpha(mode: str) -> Any:
        return lambda document: document["materials"][1].update(alphaMode=mode)

    def without(document: Any) -> None:
        for node in document["nodes"][2:6]:
            del node["mesh"]

    blend, mask = (picture(changed("leaves_blend.glb", alpha(mode)), tmp_path, *way) for mode in ("BLEND", "MASK"))
    bare = picture(changed("leaves_blend.glb", without), tmp_path, *way)
    assert np.abs(blend - mask).mean() < (1.0 if "prepass" in way else 0.5)  # where soft edges hide in part
    leaves, shadow = (slice(18, 52), slice(64, 96)), (slice(80, 90), slice(35, 85))
    assert (bare - blend)[leaves].mean() > 40 and (bare - blend)[shadow].mean() > 8


def test_unlit_things_and_tints_are_drawn_where_surfaces_have_our_shadows(tmp_path: Path) -> None:
    """Neither needs lights, of which their shaders know nothing."""
    w = Writer()
    w.node(mesh=w.mesh(SQUARE, SQUARE_FACES, flat(w), NORMAL=[[0, 0, 1]] * 4))
    pane(w, 1.0, (1, 0.5, 0.5))
    w.node(extensions=w.light(type="directional"))
    assert picture(w.glb(), tmp_path, "epipolar")[40:50, 75:85, 0].min() > 150


@pytest.mark.parametrize("way", [pytest.param(("epipolar",), marks=pytest.mark.slow), ("epipolar", "prepass"), ("march",)])
def test_a_bulb_of_glass_lets_its_lamp_shine(tmp_path: Path, way: tuple[str, ...]) -> None:
    def bare(document: Any) -> None:
        del document["nodes"][1]["mesh"]

    def painted(document: Any) -> None:
        del document["materials"][1]["extensions"]

    changes = (lambda document: None, bare, painted)
    glass_, none, solid = (picture(changed("lamp_glassbulb.glb", change), tmp_path, *way) for change in changes)
    assert np.abs(glass_ - none).max() < 3
    assert none.mean() - solid.mean() > 30
