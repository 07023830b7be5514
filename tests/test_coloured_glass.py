"""Light that passes coloured glass takes its colour: in the air, by the exact walk and in steps, on surfaces, and of files."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from calling import call
from gltfs import SQUARE, SQUARE_FACES, Writer

from airlight.reference import panes

gfx = pytest.importorskip("pygfx")
from test_panes import BEHIND, SIZE, SUN_BESIDE, WALL, Stage, light, lying, mesh, shining, square  # noqa: E402

from airlight.pygfx import LightShafts, SceneLight  # noqa: E402
from airlight.pygfx.punctual import punctual_lights  # noqa: E402
from airlight.scenes import open_scene  # noqa: E402
from airlight.scenes.triangles import world_panes  # noqa: E402

RNG = np.random.default_rng(19)
RED, BLUE, GREEN, AMBER = (0.9, 0.12, 0.05), (0.1, 0.2, 0.85), (0.1, 0.7, 0.25), (0.95, 0.6, 0.08)
BEHIND_GAP = SceneLight(position=(-9.0, 1.0, -5.0), strength=30.0)


def tinted(triangles: np.ndarray, colour: Any) -> Any:
    """Glass of a colour."""
    return mesh(triangles, color=gfx.Color.from_physical(*colour), alpha_mode="multiply", depth_write=False)


def spot() -> SceneLight:
    """A spot behind the gap."""
    lamp = gfx.SpotLight(intensity=60, angle=0.6, penumbra=0.3, decay=2)
    lamp.local.position = BEHIND_GAP.position
    lamp.look_at((0, 0.5, -5))
    return SceneLight(target=lamp)


def of_layer(shafts: LightShafts, camera: Any, solid: np.ndarray, glass: list[panes.Pane], sent: SceneLight) -> np.ndarray:
    """(H, W, 3) the truth."""
    assert shafts.resolved_medium is not None
    view, projection = np.asarray(camera.view_matrix, float), np.asarray(camera.projection_matrix, float)
    return panes.layer(view, projection, SIZE, solid, glass, punctual_lights([sent]), shafts.resolved_medium).radiance


def rms(found: np.ndarray, truth: np.ndarray) -> float:
    return float(np.sqrt(np.mean((found - truth) ** 2)) / truth.mean())


# ---------------------------------------------------------------- known answers


@pytest.mark.parametrize("steps", ["exact", pytest.param(512, marks=pytest.mark.slow)])
def test_colours_of_panes_in_a_row_multiply(stage: Stage, steps: Any) -> None:
    """Above the view, red between 2 and 6 m, blue between 4 and 8 m, and over all of that what is blended, by its opacity alone."""
    for z, colour in (((2, 6), RED), ((4, 8), BLUE)):
        stage.scene.add(tinted(lying(11 + z[0] / 2, *z), colour))
    stage.scene.add(mesh(lying(16, 1, 9), color="#f00", opacity=0.25, alpha_mode="blend"))
    red, blue = np.array(RED), np.array(BLUE)
    parts = [(0, 1, 1.0), (1, 2, 0.75), (2, 4, 0.75 * red), (4, 6, 0.75 * red * blue), (6, 8, 0.75 * blue), (8, 9, 0.75), (9, WALL, 1.0)]
    expected = sum(left * (light(end) - light(begin)) for begin, end, left in parts)
    layer = stage.seen(stage.shafts(steps=steps))[1]
    np.testing.assert_allclose(layer.mean(axis=(0, 1)), expected, rtol=3e-3 if steps == "exact" else 0.015)
    within = 0.02 if steps == "exact" else 0.05  # of texels, and of steps
    np.testing.assert_allclose(layer, np.broadcast_to(expected, layer.shape), rtol=within)
    full = stage.seen(stage.shafts(steps=steps, transparency="none"))[1]
    np.testing.assert_allclose(full, float(light(WALL)), rtol=1e-3)


@pytest.mark.parametrize("mode", ["blend", "multiply"])
@pytest.mark.parametrize("count", [*(pytest.param(n, marks=pytest.mark.slow) for n in (1, 4, 9)), 5])
def test_each_face_counts(stage: Stage, mode: str, count: int) -> None:
    """Behind so many panes of which 0.9 passes, whether as colours, of which one is not white, or as opacities."""
    for k in range(count):
        colours = {"color": gfx.Color.from_physical(0.9, 0.9, 0.9)} if mode == "multiply" else {"color": "#fff", "opacity": 0.1}
        stage.scene.add(mesh(lying(11 + 0.7 * k, -1, WALL + 1), **colours, alpha_mode=mode))
    if mode == "multiply":
        stage.scene.add(tinted(lying(50, 30, 31), RED))
    layer = stage.seen(stage.shafts())[1]
    np.testing.assert_allclose(layer, 0.9**count * float(light(WALL)), atol=1e-3 * float(light(WALL)))


def test_what_is_subtracted_passes_nothing_of_its_colour(stage: Stage) -> None:
    stage.scene.add(mesh(lying(11, -1, WALL + 1), color=gfx.Color.from_physical(0.2, 0.5, 0.9), alpha_mode="subtract"))
    layer = stage.seen(stage.shafts())[1]
    np.testing.assert_allclose(layer.mean(axis=(0, 1)), np.array([0.8, 0.5, 0.1]) * float(light(WALL)), atol=1e-3 * float(light(WALL)))


def test_what_is_seen_through_coloured_glass_is_fogged(stage: Stage) -> None:
    """The air behind is tinted, that before it is not."""
    stage.pane(4, 1.0, 0.0, alpha_mode="multiply").material.color = gfx.Color.from_physical(*RED)
    picture, layer = stage.seen(stage.shafts())
    red = np.array(RED)
    behind = float(light(WALL)) + math.exp(-0.07 * WALL) * BEHIND
    np.testing.assert_allclose(picture.mean(axis=(0, 1)), red * behind + (1 - red) * light(4), rtol=3e-3)
    np.testing.assert_allclose(layer.mean(axis=(0, 1)), red * light(WALL) + (1 - red) * light(4), rtol=3e-3)


# ---------------------------------------------------------------- against the tracer


@pytest.mark.parametrize("kind", ["sun", pytest.param("spot", marks=pytest.mark.slow), pytest.param("point", marks=pytest.mark.slow)])
@pytest.mark.parametrize("steps", ["exact", pytest.param(64, marks=pytest.mark.slow)])
def test_light_is_coloured_by_panes_in_a_gap(stage: Stage, kind: str, steps: Any) -> None:
    """A wall with a gap beside the view, in which panes of three colours hang, one behind another."""
    camera = stage.camera = gfx.PerspectiveCamera(60, SIZE[0] / SIZE[1], depth_range=(0.1, 60))
    solid = np.concatenate([square(40, 20, (0, 0, -9)), *(square(6, 9, (-6.5, 0, z), 90) for z in (-1.5, -8.5))])
    glass = [(square(3, 3, (-6.3, 1.5, -5), 90), RED), (square(0.9, 9, (-6.1, 0, -5), 90), BLUE), (square(3, 3, (-6.2, -1, -5), 90), GREEN)]
    stage.scene = gfx.Scene()
    stage.scene.add(mesh(solid, color="#000"), *(tinted(*one) for one in glass))
    sent = {"sun": SUN_BESIDE, "point": BEHIND_GAP}.get(kind) or spot()
    if sent.target is not None:
        stage.scene.add(sent.target)
    shafts = shining(stage, sent, steps)
    layer = stage.seen(shafts)[1]
    traced, unknown = world_panes(stage.scene)
    assert not unknown
    truth = of_layer(shafts, camera, solid, traced, sent)
    if steps == "exact":
        assert rms(layer, truth) < (0.015 if kind == "sun" else 0.025) < 0.1 < rms(of_layer(shafts, camera, solid, [], sent), truth)
    np.testing.assert_allclose(layer.mean(axis=(0, 1)) / truth.mean(axis=(0, 1)), 1, atol=0.005 if steps == "exact" else 0.03)


# ---------------------------------------------------------------- of files


def window(folder: Path, **material: Any) -> Any:
    """A stage of a file: a wall, and beside the view a window of a material over four squares of a texture, 2 x 2 texels."""
    w = Writer()
    pixels = np.full((2, 2, 4), 255, np.uint8)
    pixels[0, 0, :3], pixels[0, 1, :3], pixels[1, 0, :3] = (240, 60, 30), (40, 90, 230), (60, 220, 90)
    texture = {"index": w.texture(pixels, {"magFilter": 9728, "minFilter": 9728, "wrapS": 33071, "wrapT": 33071})}
    more = {"extensions": {"KHR_materials_transmission": material}, "doubleSided": True}
    glass = w.add("materials", pbrMetallicRoughness={"baseColorTexture": texture, "metallicFactor": 0}, **more)
    black = w.add("materials", pbrMetallicRoughness={"baseColorFactor": [0, 0, 0, 1], "metallicFactor": 0}, doubleSided=True)
    corners = [[x, y, 0] for y in (1, 0, -1) for x in (-1, 0, 1)]
    points, uv, faces = [], [], []
    for row in range(2):
        for column in range(2):
            at = [3 * (row + a) + column + b for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))]
            faces += [len(points) + k for k in SQUARE_FACES]
            points += [corners[k] for k in at]
            uv += [[(column + b) / 2, (row + a) / 2] for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))]
    turned = {"rotation": [0, math.sqrt(0.5), 0, math.sqrt(0.5)]}
    pane = w.mesh(points, faces, glass, NORMAL=[[0, 0, 1]] * len(points), TEXCOORD_0=uv)
    w.node(mesh=pane, translation=[-4, 0.1, -5], scale=[2, 2, 2], **turned)
    wall = w.mesh(SQUARE, SQUARE_FACES, black, NORMAL=[[0, 0, 1]] * 4)
    w.node(mesh=wall, translation=[0, 0, -9], scale=[9, 6, 1])
    for z in (0, -10):
        w.node(mesh=wall, translation=[-4, 0, z], scale=[3, 6, 1], **turned)
    w.node(extensions=w.light(type="directional"))
    return open_scene(w.save(folder), "none")


@pytest.mark.parametrize("factor", [pytest.param(1.0, marks=pytest.mark.slow), 0.3])
def test_the_sun_through_a_file_s_window_is_as_its_texture_says(tmp_path: Path, stage: Stage, factor: float) -> None:
    opened = window(tmp_path, transmissionFactor=factor)
    camera = stage.camera = gfx.PerspectiveCamera(60, SIZE[0] / SIZE[1], depth_range=(0.1, 60))
    stage.scene = opened.scene
    shafts = shining(stage, SUN_BESIDE, "exact")
    layer = stage.seen(shafts)[1]
    traced, unknown = world_panes(stage.scene)
    assert not unknown and len(traced) == (4 if factor < 1 else 3)  # of four squares one is white
    codes = np.array([240, 60, 30]) / 255
    passed = factor * ((codes + 0.055) / 1.055) ** 2.4
    assert min(np.abs(one.passed - passed).max() for one in traced) < 2e-3
    solid = np.concatenate([square(18, 12, (0, 0, -9)), *(square(6, 12, (-4, 0, z), 90) for z in (0, -10))])
    assert rms(layer, of_layer(shafts, camera, solid, traced, SUN_BESIDE)) < 0.02


# ---------------------------------------------------------------- functions of shaders


def test_colours_are_packed_as_their_twin_does() -> None:
    left = (RNG.uniform(0, 1, (300, 3)) ** 3).astype(np.float32)
    left[:3] = [[0, 0, 0], [1, 1, 1], [0.9**5] * 3]
    codes = call("scatter/march/walk.wgsl", "pack_left", [left])
    np.testing.assert_array_equal(codes, panes.pack_left(left))
    found = call("scatter/march/walk.wgsl", "unpack_left", [codes])
    np.testing.assert_allclose(found, panes.unpack_left(codes), rtol=1e-6)
    np.testing.assert_allclose(found, left, atol=1e-3)
    np.testing.assert_array_equal(found[:2], left[:2])


def test_the_colour_behind_surfaces_is_its_twin() -> None:
    surfaces = -np.sort(-RNG.uniform(0, 1, (200, 4)), axis=-1).astype(np.float32)
    codes = RNG.integers(0, 2**32, (200, 4), dtype=np.uint32)
    depth = RNG.uniform(0, 1, 200).astype(np.float32)
    found = call("scatter/march/walk.wgsl", "code_behind", [depth, surfaces, codes])
    np.testing.assert_array_equal(found, panes.code_behind(depth, surfaces, codes))
    assert (found == panes.WHITE).any()


# ---------------------------------------------------------------- on surfaces


def lamp_over(kind: str) -> Any:
    """A light above the middle of the floor."""
    if kind == "sun":
        made = gfx.DirectionalLight(intensity=3, cast_shadow=True)
        made.local.position = (0, 6, 0.1)
        return made
    kinds: Any = {"spot": (gfx.SpotLight, {"angle": 1.2}), "point": (gfx.PointLight, {})}
    make, more = kinds[kind]
    made = make(intensity=60, decay=2, cast_shadow=True, **more)
    made.local.position = (0, 6, 0)
    if kind == "spot":
        made.look_at((0, 0, 0.001))
    return made


def floor_of(colour: Any = "#fff", **more: Any) -> Any:
    made = mesh(np.array([[[-4, 0, 4], [4, 0, 4], [4, 0, -4]], [[-4, 0, 4], [4, 0, -4], [-4, 0, -4]]], float))
    made.geometry.normals = gfx.Buffer(np.tile(np.float32([0, 1, 0]), (6, 1)))
    made.material = gfx.MeshPhongMaterial(color=colour, specular="#000", side="both", **more)
    made.receive_shadow = True
    return made


def level(height: float, half: float, x: float = 0.0) -> np.ndarray:
    a, b, c, d = ((x + i * half, height, j * half) for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1)))
    return np.array([[a, b, c], [a, c, d]], float)


@pytest.mark.parametrize("kind", ["sun", "spot", "point"])
def test_what_coloured_light_falls_on_is_coloured(stage: Stage, kind: str) -> None:
    """Half of a floor below a red pane and a blue one, and some of it below smoked glass; the rest is as it was."""
    lamp, floor = lamp_over(kind), floor_of()
    stage.camera = gfx.OrthographicCamera(8, 4.5, depth_range=(0, 50))
    stage.camera.local.position = (0, 2, 0)  # below the glass
    stage.camera.look_at((0, 0, -0.0001))
    wide = 12.0
    stage.scene = gfx.Scene().add(floor, lamp)
    shafts = LightShafts(stage.renderer, stage.scene, stage.camera, [SceneLight(target=lamp)])
    stage.renderer.effect_passes = []
    stage.draw()
    full = stage.renderer.snapshot()[..., :3].astype(float)
    glass = [tinted(level(3, wide, wide), RED), tinted(level(4, wide, wide), BLUE)]
    smoked = mesh(level(3.5, wide, -wide - 2), color="#fff", opacity=0.7, alpha_mode="blend")
    stage.scene.add(*glass, smoked)
    stage.draw()
    found = stage.renderer.snapshot()[..., :3].astype(float) / full
    edge = {"sun": (0, -2.0)}.get(kind, (0, -4.3))
    x = (np.arange(SIZE[0]) + 0.5) / SIZE[0] * 8 - 4
    right, left = found[:, x > edge[0] + 0.3], found[:, x < edge[1] - 0.3]
    middle = found[:, (x < -0.3) & (x > max(edge[1], -4) + 0.3)]
    np.testing.assert_allclose(right, np.broadcast_to(np.multiply(RED, BLUE), right.shape), atol=4e-3)
    np.testing.assert_allclose(left, 0.3, atol=4e-3)
    np.testing.assert_allclose(middle, 1.0, atol=4e-3)
    shafts.medium = shafts.medium.__class__(transparency="none")
    stage.draw()
    np.testing.assert_array_equal(stage.renderer.snapshot()[..., :3].astype(float), full)


@pytest.mark.parametrize("slope", [0.0, 0.7])
@pytest.mark.parametrize("kind", ["sun", "point"])
def test_glass_does_not_dim_itself(stage: Stage, kind: str, slope: float) -> None:
    """A pane's own colour, where light falls on it aslant, is as without maps."""
    lamp, pane = lamp_over(kind), floor_of(alpha_mode="blend", opacity=0.5)
    pane.local.rotation = (math.sin(slope / 2), 0, 0, math.cos(slope / 2))
    stage.camera = gfx.OrthographicCamera(6, 3.4, depth_range=(0, 50))
    stage.camera.local.position = (0, 9, 0)
    stage.camera.look_at((0, 0, -0.0001))
    stage.scene = gfx.Scene().add(pane, floor_of("#000"), lamp)
    shafts = LightShafts(stage.renderer, stage.scene, stage.camera, [SceneLight(target=lamp)])
    stage.renderer.effect_passes = []
    stage.draw()
    found = stage.renderer.snapshot()[..., :3].astype(float)
    shafts.medium = shafts.medium.__class__(transparency="none")
    stage.draw()
    np.testing.assert_allclose(found, stage.renderer.snapshot()[..., :3].astype(float), rtol=2e-3)
    assert found.min() > 0


@pytest.mark.parametrize("kind", ["sun", "point"])
def test_no_white_light_passes_the_edges_of_a_pane_that_fills_its_frame(stage: Stage, kind: str) -> None:
    """A roof with a hole, which a pane fills to its edges: nothing on the floor is brighter, or of another colour, than behind the pane."""
    lamp, floor, half = lamp_over(kind), floor_of(), 0.61
    sides = [(-9, -9, 9, -half), (-9, half, 9, 9), (-9, -half, -half, half), (half, -half, 9, half)]
    corners = [[(x0, 3, z0), (x1, 3, z0), (x1, 3, z1), (x0, 3, z1)] for x0, z0, x1, z1 in sides]
    roof = mesh(np.array([[c[i] for i in pair] for c in corners for pair in ((0, 1, 2), (0, 2, 3))], float), color="#000")
    roof.cast_shadow = True
    pane = tinted(level(3, half), (1.0, 0.2, 0.2))
    stage.camera = gfx.OrthographicCamera(4, 2.25, depth_range=(0, 50))
    stage.camera.local.position = (0, 2, 0)
    stage.camera.look_at((0, 0, -0.0001))
    stage.scene = gfx.Scene().add(floor, lamp, roof, pane)
    shafts = LightShafts(stage.renderer, stage.scene, stage.camera, [SceneLight(target=lamp)])
    stage.renderer.effect_passes = []
    stage.draw()
    found = stage.renderer.snapshot()[..., :3].astype(float)
    lit = found[..., 0] > 0.02 * found[..., 0].max()
    assert 0.1 < lit.mean() < 0.9 and shafts is not None
    np.testing.assert_allclose(found[lit][:, 1] / found[lit][:, 0], 0.2, atol=0.01)
