"""glTF files as scenes: what they show, checked in numbers and in small pictures; and which files are refused."""

import json
import math
import os
import struct
import time
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path

import gltfs
import numpy as np
import OpenImageIO as oiio
import pygfx as gfx
import pylinalg as la
import pytest
from gltfs import SQUARE, SQUARE_FACES, SQUARE_UV, TRIANGLE, Writer, glb
from hypothesis import given
from hypothesis import strategies as st
from rendercanvas.offscreen import OffscreenRenderCanvas

from airlight.errors import AirlightError, AirlightWarning
from airlight.pygfx import SceneLight, use_hdr
from airlight.scenes import Stage, environment, open_scene
from airlight.scenes.gltf import animate, images, materials, meshes, schema
from airlight.scenes.gltf.load import model

HAWK = Path(__file__).parent / "data" / "hawk.glb"
SIZE = 96, 64


class Eye:
    """One renderer for all tests."""

    def __init__(self) -> None:
        self.canvas = OffscreenRenderCanvas(size=SIZE, pixel_ratio=1)
        self.renderer = gfx.WgpuRenderer(self.canvas, pixel_ratio=1, ppaa="none")
        use_hdr(self.renderer)

    def linear(self, scene: gfx.Scene, camera: gfx.Camera) -> np.ndarray:
        """(H, W, 4) float32. What pygfx logs is raised."""
        self.canvas.request_draw(lambda: self.renderer.render(scene, camera))
        self.canvas.draw()
        return np.asarray(self.renderer.snapshot()).astype(np.float32)


@pytest.fixture(scope="module")
def eye() -> Eye:
    return Eye()


@pytest.fixture(autouse=True)
def no_errors_in_the_log(caplog: pytest.LogCaptureFixture) -> Iterator[None]:
    yield
    assert not [record.getMessage() for record in caplog.get_records("call") if record.levelname in ("ERROR", "CRITICAL")]


def flat(w: Writer, **material: object) -> int:
    """An unlit material."""
    return w.add("materials", extensions={"KHR_materials_unlit": {}}, **material)


def frontal(width: float = 6, height: float = 4) -> gfx.OrthographicCamera:
    """Looks along -z at the origin: pixel (x, y) of SIZE sees (x - 48, 32 - y) / 16."""
    camera = gfx.OrthographicCamera(width, height, depth_range=(-50, 50))
    return camera


def drawn(stage: Stage) -> list[gfx.WorldObject]:
    return [thing for thing in stage.scene.iter() if isinstance(thing, (gfx.Mesh, gfx.Line, gfx.Points))]


def corners(stage: Stage) -> np.ndarray:
    """(N, 3): the vertices of all meshes."""
    return np.concatenate([meshes.vertices(thing) for thing in drawn(stage)])


def seen(eye: Eye, stage: Stage, camera: gfx.Camera | None = None) -> np.ndarray:
    """(H, W) bool: where there is something bright."""
    return eye.linear(stage.scene, camera or frontal())[..., :3].max(axis=-1) > 0.5


def agrees(eye: Eye, stage: Stage) -> None:
    """What is seen fills the box of the vertices' places, to a pixel and a half."""
    mask, places = seen(eye, stage), corners(stage)
    assert mask.any()
    ys, xs = np.nonzero(mask)
    found = [xs.min(), xs.max() + 1, ys.min(), ys.max() + 1]
    x, y = 48 + 16 * places[:, 0], 32 - 16 * places[:, 1]
    assert found == pytest.approx([x.min(), x.max(), y.min(), y.max()], abs=1.5)


# ---------------------------------------------------------------- what is shown


def test_mirrored_and_nested_scales_and_sheared_matrices(tmp_path: Path, eye: Eye) -> None:
    w = Writer()
    mesh = w.mesh(TRIANGLE, [0, 1, 2], flat(w))
    a = w.node(scale=[-1, 0.5, 1], rotation=[0, 0, math.sin(0.3), math.cos(0.3)], translation=[0.5, 0, 0])
    shear = np.array([[1, 0.5, 0, 0.2], [0, 1, 0, -0.3], [0, 0, 1, 0], [0, 0, 0, 1]])
    b = w.node(a, matrix=shear.T.ravel().tolist())
    w.node(b, scale=[0.8, 1, 1], mesh=mesh)
    stage = open_scene(w.save(tmp_path), "none")
    c, s = math.cos(0.6), math.sin(0.6)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    local = np.array(TRIANGLE) * (0.8, 1, 1)
    local = local @ shear[:3, :3].T + shear[:3, 3]
    expected = (local * (-1, 0.5, 1)) @ turn.T + (0.5, 0, 0)
    np.testing.assert_allclose(corners(stage), expected, atol=1e-6)
    agrees(eye, stage)  # single-sided, mirrored once
    for scale, front in (([0.8, -1, 1], True), ([0.8, 1, -1], False), ([0.8, -1, -1], False)):
        w.json["nodes"][2]["scale"] = scale
        assert seen(eye, open_scene(w.save(tmp_path), "none")).any() == front, scale


def test_skin(tmp_path: Path, eye: Eye) -> None:
    """The joints alone place a skin; inverse bind matrices and weights that do not add up to 1."""
    w = Writer()
    root = w.node(translation=[0, -1, 0])
    tip = w.node(root, translation=[0, 1, 0])
    inverse = [np.eye(4), np.eye(4)]
    inverse[0][1, 3], inverse[1][1, 3] = 1, 0
    skin = w.add("skins", joints=[root, tip], inverseBindMatrices=w.accessor(np.stack([m.T for m in inverse]).reshape(2, 16)))
    strip = [[-0.3, -1, 0], [0.3, -1, 0], [-0.3, 0, 0], [0.3, 0, 0], [-0.3, 1, 0], [0.3, 1, 0]]
    weights = [[2, 0, 0, 0], [2, 0, 0, 0], [1, 1, 0, 0], [1, 1, 0, 0], [0, 0.5, 0, 0], [0, 0.5, 0, 0]]
    joints = w.accessor([[0, 1, 0, 0]] * 6, "uint8")
    mesh = w.mesh(strip, None, flat(w, doubleSided=True), mode=5, JOINTS_0=joints, WEIGHTS_0=weights)
    w.node(mesh=mesh, skin=skin, translation=[50, 50, 50], scale=[3, 3, 3])  # to be ignored
    half = math.sqrt(0.5)
    w.animate(tip, "rotation", [0, 1], [[0, 0, 0, 1], [0, 0, half, half]])
    stage = open_scene(w.save(tmp_path), "none")
    np.testing.assert_allclose(corners(stage), strip, atol=1e-6)
    agrees(eye, stage)
    w.animate(root, "translation", [0, 1], [[0, -1, 0], [0.5, -1, 0]], clip=0)
    stage = open_scene(w.save(tmp_path), "none")
    stage.pose(0.5, None)
    turn = np.array([[half, -half, 0], [half, half, 0], [0, 0, 1]])
    points = np.array(strip)
    still, turned = points + (0.25, 0, 0), points @ turn.T + (0.25, 0, 0)
    np.testing.assert_allclose(corners(stage), np.concatenate([still[:2], (still[2:4] + turned[2:4]) / 2, turned[4:]]), atol=1e-6)
    agrees(eye, stage)


def test_skin_without_matrices(tmp_path: Path) -> None:
    w = Writer()
    joint = w.node(translation=[1, 2, 3])
    joints = w.accessor([[0, 0, 0, 0]] * 3, "uint8")
    w.node(mesh=w.mesh(TRIANGLE, JOINTS_0=joints, WEIGHTS_0=[[1, 0, 0, 0]] * 3), skin=w.add("skins", joints=[joint]))
    np.testing.assert_allclose(corners(open_scene(w.save(tmp_path), "none")), np.array(TRIANGLE) + (1, 2, 3))


def test_morph_targets(tmp_path: Path, eye: Eye) -> None:
    w = Writer()
    up, right = ({"POSITION": w.accessor([move] * 3)} for move in ([0, 1, 0], [1.5, 0, 0]))
    mesh = w.mesh(np.array(TRIANGLE) * 0.5, [0, 1, 2], flat(w), targets=[up, right])
    w.json["meshes"][mesh]["weights"] = [0.5, 0]
    node = w.node(mesh=mesh)
    stage = open_scene(w.save(tmp_path), "none")
    np.testing.assert_allclose(corners(stage), np.array(TRIANGLE) * 0.5 + (0, 0.5, 0))
    agrees(eye, stage)
    w.animate(node, "weights", [0, 2], [[0], [0], [1], [1]])
    stage = open_scene(w.save(tmp_path), "none")
    stage.pose(1.0, None)
    np.testing.assert_allclose(corners(stage), np.array(TRIANGLE) * 0.5 + (0.75, 0.5, 0))
    agrees(eye, stage)


@given(st.integers(0, 6), st.integers(0, 9))
def test_strips_and_fans(mode: int, count: int) -> None:
    faces = meshes.triangles(np.arange(count), mode) if mode >= 4 else None
    if faces is None:
        return
    if mode == 4:
        expected = [(i, i + 1, i + 2) for i in range(0, count - 2, 3)]
    elif mode == 5:
        expected = [(i, i + 1 + i % 2, i + 2 - i % 2) for i in range(count - 2)]
    else:
        expected = [(i + 1, i + 2, 0) for i in range(count - 2)]
    assert [tuple(face) for face in faces.tolist()] == expected


def test_points_and_lines(tmp_path: Path, eye: Eye) -> None:
    for mode in (0, 1, 2, 3):
        w = Writer()
        w.node(mesh=w.mesh(SQUARE, None, flat(w), mode=mode))
        assert seen(eye, open_scene(w.save(tmp_path), "none")).sum() >= (4 if mode == 0 else 32), mode


def test_sparse_accessors_and_quantised_positions(tmp_path: Path) -> None:
    w = Writer()
    indices, values = w.view(np.array([1, 3], "<u2").tobytes()), w.view(np.array([[5, 6, 7], [8, 9, 10]], "<f4").tobytes())
    sparse = {"count": 2, "indices": {"bufferView": indices, "componentType": 5123}, "values": {"bufferView": values}}
    mesh = w.mesh(SQUARE, SQUARE_FACES)
    w.json["accessors"][0]["sparse"] = sparse
    w.node(mesh=mesh)
    expected = np.array(SQUARE, float)
    expected[[1, 3]] = [[5, 6, 7], [8, 9, 10]]
    np.testing.assert_allclose(corners(open_scene(w.save(tmp_path), "none")), expected)
    del w.json["accessors"][0]["bufferView"]  # zeros, then
    expected[[0, 2]] = 0
    np.testing.assert_allclose(corners(open_scene(w.save(tmp_path), "none")), expected)

    w = Writer()
    mesh = w.mesh(SQUARE, SQUARE_FACES)
    packed = np.zeros((4, 8), np.int8)  # of 3 bytes every 8
    packed[:, :3] = np.array(SQUARE) * 127
    view = w.view(packed.tobytes(), byteStride=8)
    w.json["accessors"][0] = {"bufferView": view, "componentType": 5120, "normalized": True, "count": 4, "type": "VEC3"}
    w.node(mesh=mesh, scale=[2, 2, 2])
    np.testing.assert_allclose(corners(open_scene(w.save(tmp_path), "none")), np.array(SQUARE) * 2.0)


def test_inside_out_meshes_are_turned(tmp_path: Path, eye: Eye) -> None:
    w = Writer()
    w.node(mesh=w.mesh(SQUARE, SQUARE_FACES[::-1], flat(w), NORMAL=[[0, 0, 1]] * 4))
    assert seen(eye, open_scene(w.save(tmp_path), "none")).sum() == 32 * 32
    w = Writer()
    w.node(mesh=w.mesh(SQUARE, SQUARE_FACES[::-1], flat(w)))  # nothing says which side is meant
    assert not seen(eye, open_scene(w.save(tmp_path), "none")).any()


# ---------------------------------------------------------------- materials


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
    pixels = np.full((1, 4, 4), 255, np.uint8)
    pixels[0, :, 3] = 255, 140, 120, 0
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
        monkeypatch.setattr("airlight.scenes.gltf.load.broken_driver", lambda: broken)
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            stage = open_scene(w.save(tmp_path), "none")
        assert [str(one.message).partition("shown without its ")[2].partition(":")[0] for one in said] == ([words] if words else [])
        (mesh,) = drawn(stage)
        if broken:
            assert np.isfinite(eye.linear(stage.scene, frontal())).all()
        return {name for name in materials._MAPS if getattr(mesh.material, name) is not None}, mesh.material

    everything = set(materials._MAPS)
    assert shown(False)[0] == everything
    kept, material = shown(True)
    assert kept == everything - {"metalness_map"} and material.metalness == pytest.approx(0.1)
    w.node(extensions=w.light(type="point"))
    assert shown(True, "ao maps")[0] == everything - {"metalness_map", "ao_map"}
    w.node(extensions=w.light(type="spot"))
    assert shown(True, "ao maps, roughness maps")[0] == {"map", "normal_map", "emissive_map"}


# ---------------------------------------------------------------- animation


def test_interpolation() -> None:
    times, values = np.array([1, 3, 4], np.float32), np.array([[0, 2], [4, 0], [8, 8]], np.float32)
    linear, step = (animate.Track(0, "translation", kind, times, values) for kind in ("LINEAR", "STEP"))
    for t, soft, hard in ((0, [0, 2], [0, 2]), (2, [2, 1], [0, 2]), (3, [4, 0], [4, 0]), (3.75, [7, 6], [4, 0]), (9, [8, 8], [8, 8])):
        np.testing.assert_allclose(linear.at(t), soft)
        np.testing.assert_allclose(step.at(t), hard)


@given(st.floats(0, 1), st.lists(st.floats(-3, 3), min_size=4, max_size=4))
def test_cubic_spline_is_the_cubic(share: float, c: list[float]) -> None:
    """Values and slopes of a cubic at two times give that cubic in between, whatever the step."""
    start, step = 2.0, 4.0
    f = np.polynomial.Polynomial(c)
    slope = f.deriv()
    end = start + step
    values = np.array([[[9], [f(start)], [slope(start)]], [[slope(end)], [f(end)], [9]]], np.float32)
    track = animate.Track(0, "scale", "CUBICSPLINE", np.array([start, end], np.float32), values)
    assert track.at(start + share * step)[0] == pytest.approx(f(start + share * step), rel=1e-4, abs=1e-3)


@given(st.floats(0, 1), st.floats(-1.5, 1.5), st.floats(-1.5, 1.5), st.sampled_from((1, -1)))
def test_rotations_go_the_short_way(share: float, a: float, b: float, sign: int) -> None:
    start, end = (np.array([0, math.sin(x / 2), 0, math.cos(x / 2)]) for x in (a, b))
    found = animate.slerp(start, sign * end, share)
    angle = a + (b - a) * share
    assert abs(found @ [0, math.sin(angle / 2), 0, math.cos(angle / 2)]) == pytest.approx(1, abs=1e-9)
    matrix = animate.compose(np.array([1, 2, 3]), found, np.array([1, -2, 3]))
    np.testing.assert_allclose(matrix, la.mat_compose([1, 2, 3], found, [1, -2, 3]), atol=1e-12)


def test_pose_knows_no_past_and_loops() -> None:
    one, other = open_scene(HAWK, "none"), open_scene(HAWK, "none")
    assert one.duration == pytest.approx(0.9333, abs=1e-3)
    for t in (0.3, 5.0, 0.1, 0.7):
        one.pose(t, None)
    other.pose(0.7, None)
    assert np.array_equal(corners(one), corners(other))
    one.pose(0.7 + one.duration, None)
    np.testing.assert_allclose(corners(one), corners(other), atol=1e-5)
    one.pose(0.2, None)
    assert np.abs(corners(one) - corners(other)).max() > 0.5


def test_clips_that_move_other_things_run_together(tmp_path: Path) -> None:
    w = Writer()
    mesh = w.mesh(TRIANGLE)
    a, b = w.node(mesh=mesh), w.node(mesh=mesh)
    w.animate(a, "translation", [0, 1], [[0, 0, 0], [1, 0, 0]])
    w.animate(b, "translation", [0, 2], [[0, 0, 0], [0, 2, 0]])
    w.animate(a, "translation", [0, 9], [[0, 0, 0], [0, 0, 9]])  # would move what the first moves
    stage = open_scene(w.save(tmp_path), "none")
    assert stage.duration == 2
    stage.pose(0.5, None)
    np.testing.assert_allclose(corners(stage)[[0, 3]], [[-0.5, -1, 0], [-1, -0.5, 0]])


def test_a_scale_of_zero_and_a_turn_of_nothing(tmp_path: Path, eye: Eye) -> None:
    w = Writer()
    node = w.node(mesh=w.mesh(TRIANGLE, NORMAL=[[0, 0, 1]] * 3), rotation=[0, 0, 0, 0])
    w.animate(node, "scale", [0, 1], [[1, 1, 1], [0, 0, 0]])
    w.node(node, extensions=w.light(type="spot"))
    w.node(node, camera=w.add("cameras", type="perspective", perspective={"yfov": 1, "znear": 0.1}))
    stage = open_scene(w.save(tmp_path), "none")
    stage.pose(0.9999999, stage.cameras["camera 1"])
    assert np.isfinite(eye.linear(stage.scene, frontal())).all()


# ---------------------------------------------------------------- lights and cameras


def test_lights(tmp_path: Path) -> None:
    w = Writer()
    w.node(mesh=w.mesh(TRIANGLE))
    mirrored = w.node(scale=[-2, 1, 1], rotation=[0, math.sqrt(0.5), 0, math.sqrt(0.5)], translation=[1, 2, 3])
    spot = {"innerConeAngle": 0, "outerConeAngle": 0.5}
    w.node(mirrored, extensions=w.light(type="spot", color=[0.5, 1, 0], intensity=30, spot=spot))
    w.node(extensions=w.light(type="spot", intensity=60, spot={"innerConeAngle": 0.2, "outerConeAngle": 0.4}))
    w.node(extensions=w.light(type="point", intensity=15, range=7), translation=[0, 5, 0])
    w.node(extensions=w.light(type="directional", intensity=3), rotation=[-math.sqrt(0.5), 0, 0, math.sqrt(0.5)])
    stage = open_scene(w.save(tmp_path))
    first, second, point, sun = (light.target for light in stage.lights)
    assert isinstance(first, gfx.SpotLight) and first.decay == 2 and first.cast_shadow
    assert (first.angle, first.penumbra, first.intensity) == pytest.approx((0.5, 1, 30))
    np.testing.assert_allclose(first.color.to_physical(), (0.5, 1, 0), atol=1e-6)
    np.testing.assert_allclose(first.world.position, (1, 2, 3))
    ahead = first.target.world.position - first.world.position
    np.testing.assert_allclose(ahead / np.linalg.norm(ahead), (-1, 0, 0), atol=1e-6)
    assert (second.angle, second.penumbra) == pytest.approx((0.4, 0.5))
    assert (point.intensity, point.decay, point.distance) == pytest.approx((15, 2, 7)) and isinstance(point, gfx.PointLight)
    assert sun.intensity == 3 and isinstance(sun, gfx.DirectionalLight)
    down = sun.target.world.position - sun.world.position
    np.testing.assert_allclose(down / np.linalg.norm(down), (0, -1, 0), atol=1e-6)
    looks = np.array([max(light.look) for light in stage.lights])
    np.testing.assert_allclose(looks[:3] / looks[1], [0.5, 1, 0.25])
    assert (looks > 0).all() and (looks <= 1).all()
    assert [(light.color, light.strength) for light in stage.lights] == [((1, 1, 1), 1)] * 4  # a medium has them as they are
    plain = open_scene(tmp_path / "scene.glb", "none")
    assert [max(light.look) for light in plain.lights] == [0.5, 1, 0.25, 1]
    assert all(isinstance(light, SceneLight) and light.size > 0 for light in stage.lights)
    assert stage.movable is stage.lights[0]


def test_near_planes_of_shadows_survive(tmp_path: Path, eye: Eye) -> None:
    """pygfx would put a spot's near plane at a millionth of its far one."""
    w = Writer()
    w.node(mesh=w.mesh(TRIANGLE))
    for angle in (0.4, math.pi / 2):
        w.node(extensions=w.light(type="spot", range=20, spot={"outerConeAngle": angle}), translation=[0, 0, 3])
    w.node(extensions=w.light(type="point", range=20), translation=[0, 0, 3])
    stage = open_scene(w.save(tmp_path), "none")
    eye.linear(stage.scene, frontal())
    for light in stage.lights:
        assert light.target.shadow.camera.near == pytest.approx(stage.radius / 100)


def test_a_spot_lights_its_cone_and_an_occluder_its_shadow(tmp_path: Path, eye: Eye) -> None:
    w = Writer()
    white = w.add("materials", pbrMetallicRoughness={"metallicFactor": 0, "roughnessFactor": 1})
    w.node(mesh=w.mesh(np.array(SQUARE) * 4, SQUARE_FACES, white, NORMAL=[[0, 0, 1]] * 4))
    w.node(extensions=w.light(type="spot", intensity=100, spot={"outerConeAngle": 0.3}), translation=[0, 0, 5])
    stage = open_scene(w.save(tmp_path), "none")
    lit = eye.linear(stage.scene, frontal())[..., 0]
    ambient = lit[32, 90]
    assert lit[32, 48] - ambient == pytest.approx(100 / 25 / math.pi, rel=0.05)  # I / d^2 times albedo / pi
    assert (lit[32] > 1.2 * ambient).sum() == pytest.approx(2 * 5 * math.tan(0.3) * 16, abs=8)
    w.node(mesh=w.mesh(np.array(SQUARE) * 0.2, SQUARE_FACES, white, NORMAL=[[0, 0, 1]] * 4), translation=[0, 0, 2.5])
    behind = frontal()
    behind.depth_range = (-1, 50)  # does not see the occluder
    stage = open_scene(w.save(tmp_path), "none")
    assert eye.linear(stage.scene, behind)[32, 48, 0] == pytest.approx(ambient, rel=0.05)


def test_many_lights_are_cut_with_a_word(tmp_path: Path) -> None:
    w = Writer()
    w.node(mesh=w.mesh(TRIANGLE))
    for i in range(12):
        w.node(extensions=w.light(type="point", intensity=i))
    with pytest.warns(AirlightWarning, match="11 lights; the 8 brightest"):
        stage = open_scene(w.save(tmp_path), "none")
    assert sorted(light.target.intensity for light in stage.lights) == list(range(4, 12))


def test_cameras(tmp_path: Path) -> None:
    w = Writer()
    w.node(mesh=w.mesh(TRIANGLE))
    carrier = w.node(scale=[-3, 2, 2])
    lens = w.add("cameras", type="perspective", perspective={"yfov": 0.7, "znear": 0.25, "aspectRatio": 3})
    w.node(carrier, camera=lens, translation=[0, 0, 4], name="main")
    w.node(carrier, camera=lens, translation=[0, 0, 5], name="main")
    w.node(camera=w.add("cameras", type="orthographic", orthographic={"xmag": 3, "ymag": 2, "znear": 1, "zfar": 9}))
    stage = open_scene(w.save(tmp_path), "none")
    assert list(stage.cameras) == ["main", "main 2", "camera 3"]
    main, _, flat = stage.cameras.values()
    np.testing.assert_allclose(main.world.position, (0, 0, 8))
    np.testing.assert_allclose(main.world.forward, (0, 0, -1), atol=1e-9)
    assert np.linalg.det(main.world.matrix) == pytest.approx(1)
    main.set_view_size(1600, 900)
    assert 2 * math.atan(1 / main.projection_matrix[1, 1]) == pytest.approx(0.7)
    assert main.near == 0.25 and main.far > 8
    flat.set_view_size(1500, 1000)
    np.testing.assert_allclose(np.diag(flat.projection_matrix)[:2], (1 / 3, 1 / 2))
    w.animate(carrier, "translation", [0, 1], [[0, 0, 0], [1, 0, 0]])
    stage = open_scene(w.save(tmp_path), "none")
    stage.pose(0.5, None)
    assert stage.cameras["main"].world.position[0] == 0  # only the camera in use moves
    stage.pose(0.5, stage.cameras["main"])
    assert stage.cameras["main"].world.position[0] == pytest.approx(0.5)


def test_a_file_without_camera_and_lights_gets_them(tmp_path: Path) -> None:
    w = Writer()
    w.node(mesh=w.mesh(np.array(TRIANGLE) * 100), translation=[1000, 0, 0])
    stage = open_scene(w.save(tmp_path))
    (camera,) = stage.cameras.values()
    camera.set_view_size(1600, 900)
    ndc = la.vec_transform(corners(stage), camera.camera_matrix)
    assert np.abs(ndc[:, :2]).max() == pytest.approx(0.8, abs=0.05)
    assert (ndc[:, 2] > 0).all() and (ndc[:, 2] < 1).all()
    (sun,) = stage.lights
    assert isinstance(sun.target, gfx.DirectionalLight) and np.linalg.norm(sun.homogeneous()[:3]) == pytest.approx(1.5 * stage.radius)
    at = la.vec_transform(camera.world.position + sun.homogeneous()[:3] * 1000, camera.camera_matrix)
    assert np.abs(at[:2]).max() < 1, "the sun is in the picture"
    assert stage.scene.environment is not None
    assert [light for light in stage.scene.iter() if isinstance(light, gfx.DirectionalLight)] == [sun.target]


def test_model_gives_a_group_and_its_pose() -> None:
    group, pose = model(str(HAWK))
    group.local.position = (10, 0, 0)
    group.local.scale = (2, 2, 2)
    (mesh,) = (thing for thing in group.iter() if isinstance(thing, gfx.Mesh))
    stage = open_scene(HAWK, "none")
    for t in (0.2, 0.6):
        pose(t)
        stage.pose(t, None)
        np.testing.assert_allclose(meshes.vertices(mesh), 2 * corners(stage) + (10, 0, 0), atol=1e-5)


def test_hawk_is_seen_where_its_vertices_are(eye: Eye) -> None:
    """On the screen, skinned by the GPU, against the NumPy twin."""
    stage = open_scene(HAWK, "none")
    camera = next(iter(stage.cameras.values()))
    for thing in stage.scene.iter():
        if isinstance(thing, gfx.Mesh):
            thing.material = gfx.MeshBasicMaterial(color="#fff", side="both")
    for t in (0.0, 0.3, 0.6):
        stage.pose(t, camera)
        mask = seen(eye, stage, camera)
        places = la.vec_transform(corners(stage), camera.camera_matrix)[:, :2] * (1, -1) * 0.5 + 0.5
        low, high = places.min(axis=0) * SIZE, places.max(axis=0) * SIZE
        ys, xs = np.nonzero(mask)
        assert [xs.min(), ys.min(), xs.max() + 1, ys.max() + 1] == pytest.approx([*low, *high], abs=2), t


# ---------------------------------------------------------------- what is refused


def document(change: Callable[[dict], object]) -> bytes:
    text, binary = gltfs.parts(gltfs.everything().glb())
    change(text)
    return glb(json.dumps(text).encode(), binary)


def put(*path: object) -> Callable[[dict], object]:
    """put("nodes", 0, "mesh", 7) sets json["nodes"][0]["mesh"] = 7."""

    def change(json: dict) -> None:
        *way, last, value = path
        for key in way:
            json = json[key]
        json[last] = value

    return change


def circle(json: dict) -> None:
    json["nodes"] += [{"children": [len(json["nodes"]) + 1]}, {"children": [len(json["nodes"])]}]


def chain(json: dict) -> None:
    first = len(json["nodes"])
    json["nodes"] += [{"children": [first + i + 1]} for i in range(300)] + [{}]


def tall(json: dict) -> None:
    json["accessors"] += [{"componentType": 5126, "type": "VEC3", "count": 2**30}]
    json["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = len(json["accessors"]) - 1


REFUSED = [
    (put("asset", "version", "1.0"), "glTF of version '1.0'"),
    (put("asset", "minVersion", "2.1"), "glTF of version '2.1'"),
    (put("extensionsRequired", ["KHR_draco_mesh_compression"]), "needs 'KHR_draco_mesh_compression'"),
    (put("nodes", 0, "children", [99]), "a child of node 0 names number 99"),
    (put("nodes", 0, "children", [1, 1]), "two parents"),
    (put("nodes", 1, "children", [0]), "circle|has a parent"),
    (circle, "in a circle"),
    (chain, "deeper than 256"),
    (put("scenes", 0, "nodes", [1]), "has a parent"),
    (put("scene", 3), "names number 3 of 1"),
    (put("nodes", 1, "mesh", 44), "names number 44"),
    (put("nodes", 4, "skin", 44), "names number 44"),
    (put("nodes", 1, "weights", [1]), "1 weights for 2 morph targets"),
    (put("meshes", 0, "primitives", []), "mesh 0 is empty"),
    (put("meshes", 0, "primitives", 0, "attributes", {}), "has no positions"),
    (put("meshes", 0, "primitives", 0, "material", 9), "names number 9 of 3"),
    (put("accessors", 0, "count", 10**6), "ends behind the end|another number of vertices"),
    (put("accessors", 0, "count", 0), "not that of glTF 2.0"),
    (put("accessors", 0, "componentType", 5124), "not that of glTF 2.0"),
    (put("accessors", 0, "type", "MAT2"), "wrong type|ends behind"),
    (put("accessors", 0, "byteOffset", 2**40), "ends behind"),
    (put("bufferViews", 2, "byteLength", 2**39), "ends behind"),
    (put("bufferViews", 2, "byteStride", 2), "every 2 bytes"),
    (put("bufferViews", 2, "buffer", 5), "names number 5 of 1"),
    (put("buffers", 0, "byteLength", 2**33), "instead of 8589934592"),
    (put("buffers", 0, "uri", "http://localhost/x.bin"), "not a place in its folder"),
    (tall, "more than the limits|another number"),
    (put("materials", 0, "normalTexture", "index", 8), "names number 8"),
    (put("textures", 0, "source", 8), "names number 8"),
    (put("textures", 0, "sampler", 8), "names number 8"),
    (put("images", 0, "bufferView", 1), "neither PNG nor JPEG"),
    (put("images", 0, {"bufferView": 0, "uri": "x.png"}), "either a URI or a buffer view"),
    (put("skins", 0, "joints", []), "has 0 joints"),
    (put("skins", 0, "joints", [0, 0, 0]), "fewer than its joints"),
    (put("skins", 0, "joints", [0]), "names joint 1 of 1"),
    (put("animations", 0, "channels", 0, "sampler", 8), "names number 8"),
    (put("animations", 0, "samplers", 0, "input", 0), "wrong type"),
    (put("animations", 0, "samplers", 0, "interpolation", "CUBICSPLINE"), "values for 2 times"),
    (put("cameras", 0, "perspective", "yfov", 4), "not that of glTF 2.0"),
    (put("cameras", 0, "perspective", "zfar", 0.05), "camera 0 sees from 0.1 to 0.05"),
    (put("cameras", 0, "type", "orthographic"), "camera 0 is orthographic, but does not say how"),
    (put("extensions", "KHR_lights_punctual", "lights", 0, "intensity", -1), "not that of glTF 2.0"),
    (put("extensions", "KHR_lights_punctual", "lights", 0, "spot", "innerConeAngle", 0.6), "a cone from 0.6 to 0.5"),
    (put("nodes", 0, "scale", [1e9, 1e9, 1e9]), "reaches farther"),
    (put("nodes", 0, "translation", [1e300, 0, 0]), "not that of glTF 2.0"),
    (put("nodes", [{} for _ in range(20001)]), "20001 nodes"),
    (put("scenes", 0, "nodes", []), "shows nothing"),
]


@pytest.mark.parametrize("change, words", REFUSED, ids=[words[:30] for _, words in REFUSED])
def test_refused(change: Callable[[dict], object], words: str, tmp_path: Path) -> None:
    refused(tmp_path, document(change), words)


def refused(folder: Path, data: bytes, words: str, name: str = "scene.glb") -> None:
    path = folder / name
    path.write_bytes(data)
    start = time.monotonic()
    with pytest.raises(AirlightError, match=words) as error:
        open_scene(path, "none")
    assert time.monotonic() - start < 5
    said = str(error.value)
    assert error.value.exit_code == 2 and said.startswith(str(path)) and "\n" not in said and "; " in said


def test_values_that_are_no_numbers(tmp_path: Path) -> None:
    w = Writer()
    w.node(mesh=w.mesh([[0, 0, np.nan], [1, 0, 0], [0, 1, 0]]))
    refused(tmp_path, w.glb(), "POSITION of mesh 0 holds values that are not numbers")
    w = Writer()
    node = w.node(mesh=w.mesh(TRIANGLE, NORMAL=[[0, np.inf, 1]] * 3))
    (mesh,) = drawn(open_scene(w.save(tmp_path), "none"))
    assert mesh.geometry.normals.data.tolist() == [[0, 0, 1]] * 3  # mended
    w.animate(node, "translation", [0, 0], [[0, 0, 0]] * 2)
    refused(tmp_path, w.glb(), "times of animation 0 do not grow")
    for bad in (b'{"asset": {"version": "2.0"}, "scene": NaN}', b'{"asset": {"version": "2.0"}, "nodes": [{"scale": [1e999, 1, 1]}]}'):
        refused(tmp_path, bad, "not that of glTF 2.0", "scene.gltf")


def test_vertices_and_sparse_elements_out_of_range(tmp_path: Path) -> None:
    w = Writer()
    w.node(mesh=w.mesh(TRIANGLE, [0, 1, 3]))
    refused(tmp_path, w.glb(), "names vertex 3 of 3")
    w = Writer()
    w.node(mesh=w.mesh(TRIANGLE))
    indices, values = {"bufferView": w.view(b"\x03"), "componentType": 5121}, {"bufferView": w.view(bytes(12))}
    w.json["accessors"][0]["sparse"] = {"count": 1, "indices": indices, "values": values}
    refused(tmp_path, w.glb(), "names element 3 of 3")
    w.json["accessors"][0].pop("bufferView")
    w.json["accessors"][0]["count"] = 10**6
    refused(tmp_path, w.glb(), "more than the file has bytes")


def test_json_that_nests_or_swells(tmp_path: Path) -> None:
    refused(tmp_path, b'{"asset": {"version": "2.0"}, "extras": ' + b"[" * 10**6, "nested too deeply", "scene.gltf")
    refused(tmp_path, b"[" * 5 * 10**6, "more than 4194304 JSON values", "scene.gltf")
    refused(tmp_path, b'{"asset": {"version": "2.0"}, "scene": ' + b"9" * 6000 + b"}", "not that of glTF 2.0", "scene.gltf")
    refused(tmp_path, b"", "not that of glTF 2.0", "scene.gltf")
    refused(tmp_path, b'{"asset": {"version": "\xff"}}', "not that of glTF 2.0", "scene.gltf")


def test_chunks(tmp_path: Path) -> None:
    good = gltfs.everything().glb()
    refused(tmp_path, good[:10], "cut off")
    refused(tmp_path, good[:-40], "says that it has")
    refused(tmp_path, b"glTF" + struct.pack("<I", 1) + good[8:], "GLB of version 1")
    refused(tmp_path, good[:12] + struct.pack("<I", 2**31) + good[16:], "chunk that ends behind")
    refused(tmp_path, good[:16] + b"BIN\0" + good[20:], "does not begin with JSON")
    refused(tmp_path, b"{}", "does not begin as GLB does")
    refused(tmp_path, glb(gltfs.everything().text()), "buffer 0 has no contents")


def test_depth_at_the_limit(tmp_path: Path, eye: Eye) -> None:
    w = Writer()
    node = None
    for _ in range(256):
        node = w.node(node, translation=[0, 0, 0.001])
    w.node(node, mesh=w.mesh(TRIANGLE, [0, 1, 2], flat(w)))
    w.animate(0, "translation", [0, 1], [[0, 0, 0], [1, 0, 0]])
    stage = open_scene(w.save(tmp_path), "none")
    stage.pose(0.5, None)
    agrees(eye, stage)


# ---------------------------------------------------------------- where files may lie


def scene_with(uri: str) -> bytes:
    w = Writer()
    w.node(mesh=w.mesh(TRIANGLE))
    return w.gltf(uri)


def test_buffers_beside_within_and_below(tmp_path: Path) -> None:
    w = Writer()
    w.node(mesh=w.mesh(TRIANGLE))
    below = tmp_path / "a b"
    below.mkdir()
    (below / "it.bin").write_bytes(w.binary)
    os.symlink(below / "it.bin", tmp_path / "link.bin")
    for uri in ("a%20b/it.bin", "./a b/it.bin", "a b/../link.bin", None):
        (tmp_path / "scene.gltf").write_bytes(w.gltf(uri))
        np.testing.assert_allclose(corners(open_scene(tmp_path / "scene.gltf", "none")), TRIANGLE)


@pytest.mark.parametrize(
    "uri",
    ["../it.bin", "%2e%2e/it.bin", "/etc/passwd", "file:///etc/passwd", "http://127.0.0.1:9/x", "a/../../it.bin", "..\\it", "C:it", "a\0b"],
)
def test_places_outside(uri: str, tmp_path: Path) -> None:
    (tmp_path / "it.bin").write_bytes(bytes(100))
    inner = tmp_path / "inner"
    inner.mkdir()
    refused(inner, scene_with(uri), "not a place in its folder|outside its folder", "scene.gltf")


def test_links_out_and_things_that_are_no_files(tmp_path: Path) -> None:
    (tmp_path / "it.bin").write_bytes(bytes(100))
    inner = tmp_path / "inner"
    inner.mkdir()
    os.symlink(tmp_path / "it.bin", inner / "link.bin")
    refused(inner, scene_with("link.bin"), "outside its folder", "scene.gltf")
    os.symlink("/dev/zero", inner / "zero.bin")
    refused(inner, scene_with("zero.bin"), "outside its folder", "scene.gltf")
    os.mkfifo(inner / "pipe.bin")
    refused(inner, scene_with("pipe.bin"), "not a regular file", "scene.gltf")
    (inner / "folder.bin").mkdir()
    refused(inner, scene_with("folder.bin"), "not a regular file", "scene.gltf")
    refused(inner, scene_with("missing.bin"), "No such file", "scene.gltf")
    refused(inner, scene_with("data:,abc"), "not in base64", "scene.gltf")
    refused(inner, scene_with("data:;base64,@@@"), "damaged base64", "scene.gltf")
    os.mkfifo(inner / "pipe.glb")
    with pytest.raises(AirlightError, match="not a regular file"):
        open_scene(inner / "pipe.glb")
    with pytest.raises(AirlightError, match="No such file"):
        open_scene(tmp_path / "none.glb")
    with pytest.raises(AirlightError, match="give table, flying, or a"):
        open_scene("sofa")


def test_files_larger_than_the_limit(tmp_path: Path) -> None:
    with open(tmp_path / "big.bin", "wb") as file:
        file.truncate(2**29 + 1)  # sparse
    refused(tmp_path, scene_with("big.bin"), "larger than the limit of 512 MiB", "scene.gltf")


def test_images_that_are_bombs_or_damaged(tmp_path: Path) -> None:
    good = gltfs.png(np.random.default_rng(1).integers(0, 256, (16, 16, 4), np.uint8))
    huge = good[:16] + struct.pack(">II", 30000, 30000) + good[24:]
    for data, words in ((huge, "megapixels"), (good[:600], "image 0: is damaged"), (b"RIFF" + bytes(40), "neither PNG nor JPEG")):
        w = Writer()
        w.add("images", bufferView=w.view(data))
        material = w.add("materials", pbrMetallicRoughness={"baseColorTexture": {"index": w.add("textures", source=0)}})
        w.node(mesh=w.mesh(SQUARE, SQUARE_FACES, material, TEXCOORD_0=SQUARE_UV))
        refused(tmp_path, w.glb(), words)


# ---------------------------------------------------------------- environments


def lat_long(width: int = 64) -> np.ndarray:
    """A sky that says where one looks: red to +x, green up, blue to +z."""
    v, u = np.mgrid[: width // 2, :width]
    places = np.stack([(u + 0.5) / width, (v + 0.5) / (width // 2)], axis=-1).reshape(-1, 2)
    towards = np.array([environment.direction(*place) for place in places]).reshape(width // 2, width, 3)
    return (towards * 0.5 + 0.5).astype(np.float32)


@given(st.floats(0, 0.999), st.floats(0.01, 0.99), st.floats(-7, 7))
def test_directions_of_the_picture(u: float, v: float, yaw: float) -> None:
    found = environment.equirectangular(environment.direction(u, v, yaw), yaw)
    assert (found[0] - u + 0.5) % 1 == pytest.approx(0.5, abs=1e-9) and found[1] == pytest.approx(v, abs=1e-9)


@pytest.mark.parametrize("yaw", [0.0, 1.1])
def test_the_background_is_the_picture(eye: Eye, yaw: float) -> None:
    """Each pixel shows the colour that says where it looks."""
    scene = gfx.Scene()
    environment.Environment(lat_long(256), yaw).surround(scene)
    c, s = math.cos(-yaw), math.sin(-yaw)
    for towards in ((0, 0, -1), (1, 0.3, 0.2), (-1, -0.4, 0.1), (0.2, 0.1, 1)):
        camera = gfx.PerspectiveCamera(50, depth_range=(0.1, 10))
        camera.look_at(towards)
        found = eye.linear(scene, camera)[::16, ::16, :3]
        y, x = np.mgrid[0:64:16, 0:96:16]
        ndc = np.stack([(x + 0.5) / 48 - 1, 1 - (y + 0.5) / 32, np.full(x.shape, 0.9)], axis=-1)
        rays = la.vec_transform(ndc.reshape(-1, 3), np.linalg.inv(camera.camera_matrix)).reshape(*x.shape, 3)
        rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
        turned = np.stack([c * rays[..., 0] - s * rays[..., 2], rays[..., 1], s * rays[..., 0] + c * rays[..., 2]], axis=-1)
        np.testing.assert_allclose(found, turned * 0.5 + 0.5, atol=0.02)


def test_holes_beside_a_sun_are_filled(tmp_path: Path) -> None:
    picture = np.full((64, 128, 3), 0.5, np.float32)
    picture[30, 60], picture[30, 61], picture[31, 60], picture[10, 10] = 5000, -40, 1e-4, -1
    out = oiio.ImageOutput.create(str(tmp_path / "it.exr"))
    assert out.open(str(tmp_path / "it.exr"), oiio.ImageSpec(128, 64, 3, "float")) and out.write_image(picture) and out.close()
    expected = np.maximum(picture, 0.5)
    np.testing.assert_allclose(environment.load_environment(str(tmp_path / "it.exr")).picture, expected)


def test_shafts_are_made_for_what_is_around_their_light() -> None:
    surroundings = environment.Environment(np.full((64, 128, 3), 2, np.float32), 0.4)
    surroundings.picture[:32] = 4
    assert surroundings.aureole(np.array([0.3, 1, 0]), 8) == pytest.approx(4)
    assert surroundings.aureole(np.array([0.3, -1, 0]), 8) == pytest.approx(2)
    assert surroundings.aureole(None, 8) == pytest.approx(3)
    assert surroundings.aureole(None, 3) == pytest.approx(2.5)


def test_the_sun_is_found_and_turned_to() -> None:
    picture = np.full((64, 128, 3), 0.2, np.float32)
    picture[20:22, 30:32] = 500, 400, 300
    surroundings = environment.Environment(picture)
    sun, irradiance = surroundings.sun_and_light()
    np.testing.assert_allclose(sun, environment.direction(31 / 128, 21 / 64), atol=1e-3)
    solid = 4 * (math.pi / 64) ** 2 * math.sin(math.pi * 21 / 64)
    np.testing.assert_allclose(irradiance, np.array([500, 400, 300]) * solid, rtol=0.01)
    for towards in ((1, 0, 0), (0.3, 0.5, -1), (-0.2, 0, 1)):
        turned = surroundings.turned_to(np.array(towards)).sun
        assert math.atan2(turned[0], turned[2]) == pytest.approx(math.atan2(towards[0], towards[2]))
        assert turned[1] == pytest.approx(sun[1])


def test_shipped_environments() -> None:
    for name, place in (("sunrise", (0.60, 0.46)), ("sky", (0.595, 0.234))):
        surroundings = environment.load_environment(name)
        assert surroundings.picture.min() >= 0 and np.isfinite(surroundings.picture).all()
        np.testing.assert_allclose(environment.equirectangular(surroundings.sun), place, atol=0.01)


def test_the_environment_lights(eye: Eye) -> None:
    """A white, rough square, under a sky of radiance 1, is white."""
    scene = gfx.Scene()
    environment.Environment(np.ones((32, 64, 3), np.float32)).surround(scene, background=False)
    normals, faces = np.array([[0, 0, 1]] * 4, np.float32), np.array([[0, 1, 2], [0, 2, 3]], np.int32)
    geometry = gfx.Geometry(positions=np.array(SQUARE, np.float32), normals=normals, indices=faces)
    scene.add(gfx.Mesh(geometry, gfx.MeshStandardMaterial(roughness=1, metalness=0)))
    np.testing.assert_allclose(eye.linear(scene, frontal())[32, 48, :3], 1, atol=0.05)


def test_environments_that_are_refused(tmp_path: Path) -> None:
    for name, words in (("x.png", "is not an environment"), (str(tmp_path / "no.exr"), "No such file")):
        with pytest.raises(AirlightError, match=words):
            environment.load_environment(name)
    with pytest.raises(AirlightError, match="has its own environment"):
        open_scene("table", "sky")


def test_nothing_warns() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        open_scene(HAWK).pose(0.5, None)
