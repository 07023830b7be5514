"""The scenes that come with Airlight: built in time, the same at a time whatever came before, and looking as they did when looked at."""

import logging
from collections.abc import Callable, Iterator
from importlib import resources
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np
import OpenImageIO as oiio
import pygfx as gfx
import pytest
from rendercanvas.offscreen import RenderCanvas

from airlight.gpu.device import open_device
from airlight.pygfx import use_hdr
from airlight.scenes import NAMES, Stage, landscape, open_scene
from airlight.scenes import flying as flying_module
from airlight.scenes import table as table_module

SIZE = (320, 180)
GOLDEN = Path(__file__).parent / "data" / "scenes"
SHOTS = {
    "table": ("table", "front", 0.0),
    "flying": ("flying", "watch", 0.0),
    "flying-later": ("flying", "watch", 0.45),
    "chase": ("flying", "chase", 0.3),
    "valley": ("valley", "hill", 0.0),
}
TOLERANCE = 1.5  # codes of 255: the greatest mean difference of a tile of 20 x 20 pixels
ELSEWHERE = {"table": 4.0}  # on drivers other than Mesa's llvmpipe, which drew the goldens: edges a 32nd of a pixel away
SEA = 25.0  # the same, of scenes with a sea: SwiftShader clips large triangles behind the eye so that shores move by a pixel


class Errors(logging.Handler):
    """What is logged as an error: drawing does not raise."""

    NAMES = ("rendercanvas", "wgpu", "pygfx")

    def __init__(self) -> None:
        super().__init__(logging.ERROR)
        self.records: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        self.records.append(record.getMessage())


@pytest.fixture(autouse=True)
def errors() -> Iterator[Errors]:
    """Fails a test that logs an error which it does not take out of `records`."""
    handler = Errors()
    for name in Errors.NAMES:
        logging.getLogger(name).addHandler(handler)
    yield handler
    for name in Errors.NAMES:
        logging.getLogger(name).removeHandler(handler)
    assert not handler.records


@pytest.fixture(scope="module")
def screen() -> tuple[RenderCanvas, gfx.WgpuRenderer]:
    canvas = RenderCanvas(size=SIZE, pixel_ratio=1)
    renderer = gfx.WgpuRenderer(canvas, pixel_ratio=1, ppaa="none")
    use_hdr(renderer)
    return canvas, renderer


@pytest.fixture(scope="module")
def draw(screen: tuple[RenderCanvas, gfx.WgpuRenderer]) -> Callable[..., Any]:
    """draw(stage, camera) -> (H, W, 3) float32 linear, of one renderer."""
    canvas, renderer = screen

    def drawn(stage: Stage, camera: gfx.PerspectiveCamera) -> Any:
        canvas.request_draw(lambda: renderer.render(stage.scene, camera))
        canvas.draw()
        return renderer.snapshot()[..., :3].astype(np.float32)

    return drawn


@pytest.fixture(scope="module")
def stages() -> dict[str, Stage]:
    """All stages, built within 15 seconds of computing each; some 2 s."""
    built = {}
    for name in NAMES:
        start = process_time()
        built[name] = open_scene(name)
        assert process_time() - start < 15, name
    return built


def codes(linear: Any) -> Any:
    """(H, W, 3) as 8-bit codes of a simple tone curve, so that what is brighter than 1 counts too."""
    return np.rint(255 * (linear / (0.4 + linear)) ** (1 / 2.2))


def shot(stages: dict[str, Stage], draw: Callable[..., Any], name: str) -> Any:
    scene, camera, share = SHOTS[name]
    stage = stages[scene]
    stage.pose(share * stage.duration, stage.cameras[camera])
    return codes(draw(stage, stage.cameras[camera]))


def golden(name: str) -> Any:
    return oiio.ImageBuf(str(GOLDEN / f"{name}.png")).get_pixels(oiio.UINT8)[..., :3].astype(float)


def tolerance(name: str) -> float:
    return TOLERANCE if open_device().info["vendor"] == "llvmpipe" else ELSEWHERE.get(name, SEA)


def difference(a: Any, b: Any) -> float:
    """The greatest mean absolute difference of a tile of 20 x 20 pixels."""
    tiles = np.abs(a - b).reshape(SIZE[1] // 20, 20, SIZE[0] // 20, 20, 3)
    return float(tiles.mean(axis=(1, 3, 4)).max())


def meshes(stage: Stage) -> list[gfx.Mesh]:
    return [thing for thing in stage.scene.iter() if isinstance(thing, gfx.Mesh)]


@pytest.mark.parametrize("name", SHOTS)
def test_golden(name: str, stages: dict[str, Stage], draw: Callable[..., Any], tmp_path: Path) -> None:
    """Software Vulkan; after a wanted change look at the picture that the message names, then copy it to tests/data/scenes."""
    now = shot(stages, draw, name)
    seen = tmp_path / f"{name}.png"
    oiio.ImageBuf(np.ascontiguousarray(now / 255, np.float32)).write(str(seen), oiio.UINT8)
    assert (GOLDEN / seen.name).exists(), seen
    assert difference(now, golden(name)) <= tolerance(name), seen


def plain(pixel: tuple[int, ...], cube: bool = False) -> gfx.Texture:
    """One colour, in place of a texture: no other shader is needed, which would take software Vulkan seconds."""
    pixels = np.full((6, 1, 1, 4) if cube else (1, 1, 4), pixel, np.float16 if cube else np.uint8)
    size = (1, 1, 6) if cube else (1, 1, 1)
    return gfx.Texture(pixels, dim=2, size=size, generate_mipmaps=True, colorspace="srgb" if pixel != FLAT else "physical")


FLAT = (128, 128, 255, 255)


def broken(stage: Stage) -> Iterator[tuple[str, Any, str, Any]]:
    """(what, owner, attribute, what it is when lost) for each texture, light, shadow, the environment and the emitter."""
    for material in {id(m.material): m.material for m in meshes(stage)}.values():
        for name, pixel in (("map", (128, 128, 128, 255)), ("normal_map", FLAT)):
            if getattr(material, name, None) is not None:
                yield f"{name} of {material}", material, name, plain(pixel)
    for light in [thing for thing in stage.scene.iter() if isinstance(thing, gfx.Light)]:
        yield f"shine of {light}", light, "intensity", 0.0
        yield f"shadows of {light}", light, "cast_shadow", False
    yield "environment", stage.scene, "environment", plain((0, 0, 0, 1), cube=True)
    yield "emitter", stage.lights[0].target, "visible", False


@pytest.mark.parametrize("scene", ["table", pytest.param("flying", marks=pytest.mark.slow)])
def test_goldens_see_what_is_lost(scene: str, stages: dict[str, Stage], draw: Callable[..., Any]) -> None:
    """Each texture, light, shadow, the environment taken away: some picture of the scene then differs from what it was."""
    stage = stages[scene]
    names = [name for name, (of, _, _) in SHOTS.items() if of == scene]
    whole, missed = {name: shot(stages, draw, name) for name in names}, []
    for what, owner, name, lost in broken(stage):
        before = getattr(owner, name)
        setattr(owner, name, lost)
        seen = max(difference(shot(stages, draw, picture), whole[picture]) for picture in names)
        setattr(owner, name, before)
        print(f"{seen:6.1f}  {what}")
        if seen <= TOLERANCE:
            missed.append((what, seen))
    assert not missed
    assert max(difference(shot(stages, draw, name), whole[name]) for name in names) <= TOLERANCE  # all is mended


def test_errors_in_drawing_are_seen(screen: tuple[RenderCanvas, gfx.WgpuRenderer], errors: Errors) -> None:
    """The guard of these tests: a drawing function that raises is only logged by the canvas."""
    canvas, _ = screen
    canvas.request_draw(lambda: 1 / 0)
    canvas.draw()
    assert errors.records == ["Draw error"]
    errors.records.clear()


def state(stage: Stage, camera: gfx.PerspectiveCamera) -> Any:
    """All that a pose sets: places of all things, of the camera, and morph weights. (Lights are turned by pygfx when it draws.)"""
    things = [thing for thing in stage.scene.iter() if not isinstance(thing, gfx.Light)]
    parts = [np.ravel(thing.world.matrix) for thing in (*things, camera)]
    parts += [np.ravel(m.morph_target_influences) for m in meshes(stage) if getattr(m.geometry, "morph_positions", None)]
    return np.concatenate(parts)


def test_a_pose_depends_on_its_time_alone(stages: dict[str, Stage], draw: Callable[..., Any]) -> None:
    stage = stages["flying"]
    for camera in stage.cameras.values():
        stage.pose(5.0, camera)
        first, picture = state(stage, camera), draw(stage, camera)
        for t in (19.0, 0.3, 5.0 + 2 * stage.duration, 4.99, 11.0):
            stage.pose(t, camera)
        assert np.abs(state(stage, camera) - first).max() > 1
        stage.pose(5.0, camera)
        np.testing.assert_array_equal(state(stage, camera), first)
        np.testing.assert_array_equal(draw(stage, camera), picture)
    another = flying_module.flying()
    another.pose(5.0, another.cameras["chase"])
    np.testing.assert_array_equal(state(another, another.cameras["chase"]), first)


def test_a_camera_moves_only_when_it_is_given(stages: dict[str, Stage]) -> None:
    stage = stages["flying"]
    before = {name: np.array(camera.world.matrix) for name, camera in stage.cameras.items()}
    stage.pose(8.0, None)
    stage.pose(9.0, gfx.PerspectiveCamera())
    for name, camera in stage.cameras.items():
        np.testing.assert_array_equal(camera.world.matrix, before[name])


def test_the_loop_closes(stages: dict[str, Stage]) -> None:
    """After a lap each thing is within 2 mm of where it was, and the wings are at the same beat."""
    stage = stages["flying"]
    camera = stage.cameras["watch"]
    stage.pose(0.0, camera)
    start = state(stage, camera)
    stage.pose(stage.duration * (1 - 1e-9), camera)
    assert np.abs(state(stage, camera) - start).max() < 2e-3
    assert 15 < stage.duration < 30


def test_the_craft_touch_nothing() -> None:
    _, run = flying_module.flight(4)
    for k in range(60 * 56, 60 * 82, 4):
        first, second = run.step(k)
        assert np.linalg.norm(first.position - second.position) > 15  # each is some 9 long
        for craft in (first, second):
            x, y, z = craft.position
            assert y > 15 and (np.hypot(x + 28, z) > 23 or y > 22.6 + 3.2)  # over the temple's roof
            assert all(
                np.linalg.norm(craft.position - np.add(place, (0, 13 * size, 0))) > 10 * size + 6 for place, size, _ in flying_module.TREES
            )


def test_the_sun_is_often_in_view(stages: dict[str, Stage], draw: Callable[..., Any]) -> None:
    """From `watch` the sun is inside the picture all the time, half of it or more unhidden; from `chase` inside a tenth."""
    stage = stages["flying"]
    inside = {}
    for name, camera in stage.cameras.items():
        camera.set_view_size(*SIZE)
        count = 0
        for t in np.linspace(0, stage.duration, 48, endpoint=False):
            stage.pose(t, camera)
            x, y, _, w = camera.camera_matrix @ np.append(stage.lights[0].target.world.position, 1.0)
            count += bool(w > 0 and abs(x) < w and abs(y) < w)
        inside[name] = count / 48
    watch, seen = stage.cameras["watch"], 0
    for t in np.linspace(0, stage.duration, 12, endpoint=False):
        stage.pose(t, watch)
        x, y, _, w = watch.camera_matrix @ np.append(stage.lights[0].target.world.position, 1.0)
        column, row = int((x / w + 1) / 2 * SIZE[0]), int((1 - y / w) / 2 * SIZE[1])
        around = draw(stage, watch)[row - 6 : row + 7, column - 6 : column + 7, 0]
        seen += bool((around > landscape.SUN_RADIANCE[0] * 0.9).sum() >= 10)
    print(inside, seen / 12)
    assert inside["watch"] == 1.0 and inside["chase"] >= 0.1
    assert seen >= 6


def test_light_is_of_high_dynamic_range(stages: dict[str, Stage], draw: Callable[..., Any]) -> None:
    for name in ("table", "flying", "valley"):  # whose lights are not exposed
        stage = stages[name]
        camera = next(iter(stage.cameras.values()))
        stage.pose(0.0, camera)
        picture = draw(stage, camera)
        assert np.isfinite(picture).all()
        assert picture.max() > 10 and 0.01 < np.median(picture) < 0.5


def test_the_lamp_moves_with_its_light(stages: dict[str, Stage], draw: Callable[..., Any]) -> None:
    stage = stages["table"]
    assert stage.movable is stage.lights[0] and stage.duration == 0
    camera = stage.cameras["front"]
    before, place = draw(stage, camera), tuple(stage.movable.target.local.position)
    stage.movable.target.local.position = (1.9, 3.1, -1.6)
    after = draw(stage, camera)
    (glow,) = [thing for thing in stage.scene.iter() if isinstance(thing, gfx.PointLight)]
    np.testing.assert_allclose(glow.world.position, (1.9, 3.1, -1.6), atol=1e-6)
    stage.movable.target.local.position = place
    floor = np.s_[150:, 100:220]
    assert np.abs(after[floor] - before[floor]).mean() > 0.1 * before[floor].mean()  # its shadows too, not only the ball
    np.testing.assert_array_equal(draw(stage, camera), before)


def test_the_path_is_drawn_on_request(stages: dict[str, Stage], draw: Callable[..., Any]) -> None:
    stage = stages["flying"]
    camera = stage.cameras["watch"]
    stage.pose(0.0, camera)
    assert stage.path is not None and not stage.path.visible
    before = draw(stage, camera)
    stage.path.visible = True
    after = draw(stage, camera)
    stage.path.visible = False
    changed = (np.abs(after - before).max(axis=2) > 0.02).mean()
    assert 0.002 < changed < 0.1
    assert stages["table"].path is None


def test_turned_shapes_become_round() -> None:
    """A hexagonal prism's side in four, thrice: all corners on the circle, normals outward, none lost."""
    turns = np.arange(6) * np.pi / 3
    ring = np.stack([np.cos(turns), 0 * turns, np.sin(turns)], axis=1)
    positions = np.concatenate([ring, ring + (0, 1, 0)]).astype(np.float32)
    i = np.arange(6)
    j = (i + 1) % 6
    faces = np.concatenate([np.stack([i, i + 6, j], axis=1), np.stack([j, i + 6, j + 6], axis=1)]).astype(np.int32)
    normals = np.concatenate([ring, ring]).astype(np.float32)
    shape = gfx.Geometry(positions=positions, normals=normals, texcoords=positions[:, :2].copy(), indices=faces)
    for _ in range(3):
        shape = table_module.tessellate(shape)
    assert len(shape.indices.data) == 12 * 64
    points = shape.positions.data
    np.testing.assert_allclose(np.hypot(points[:, 0], points[:, 2]), 1, atol=1e-5)
    np.testing.assert_allclose(shape.normals.data[:, [0, 2]], points[:, [0, 2]], atol=1e-5)
    a, b, c = (points[shape.indices.data[:, k]] for k in range(3))
    assert (np.cross(b - a, c - a) * (a * (1, 0, 1))).sum(axis=1).min() > 0


def test_each_model_has_its_licence_and_all_are_small() -> None:
    folder = resources.files("airlight") / "data" / "scenes" / "models"
    words = (folder / "MODELS.md").read_text(encoding="utf-8")
    models = [entry for entry in folder.iterdir() if entry.name.endswith(".glb")]
    assert {entry.name for entry in models} == {name for name in words.replace(",", " ").replace("|", " ").split() if name.endswith(".glb")}
    assert sum(len(entry.read_bytes()) for entry in models) < 2_750_000
