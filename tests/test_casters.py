"""Shadow maps over scenes: depths against triangles that the tests draw themselves, who casts, and what is kept."""

import logging
import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

gfx = pytest.importorskip("pygfx")
import pylinalg as la  # noqa: E402
from prepass_scene import exhibition, leaf_map, morphed_ball, skinned_bar  # noqa: E402
from rasterising import edge_error  # noqa: E402

from airlight.errors import AirlightError  # noqa: E402
from airlight.gpu.device import Device, shared_device  # noqa: E402
from airlight.gpu.timing import Timer  # noqa: E402
from airlight.lights.directional import DirectionalLight  # noqa: E402
from airlight.lights.point import PointLight  # noqa: E402
from airlight.lights.punctual import PunctualLight  # noqa: E402
from airlight.lights.spot import SpotLight  # noqa: E402
from airlight.medium.resolve import resolve  # noqa: E402
from airlight.options import March, Medium  # noqa: E402
from airlight.pygfx import SceneLight  # noqa: E402
from airlight.pygfx.bounds import Bounds  # noqa: E402
from airlight.pygfx.casters import Casters  # noqa: E402
from airlight.scenes.gltf.load import model  # noqa: E402
from airlight.scenes.gltf.meshes import vertices  # noqa: E402
from airlight.shadows import Shadow, ShadowView, fit  # noqa: E402

HAWK = str(Path(__file__).parent / "data" / "hawk.glb")
SIZE = 48
SLANT = tuple(np.array([0.3, 0.8, 0.5]) / math.sqrt(0.98))
SUN = DirectionalLight((1, 1, 1), direction=SLANT)
LAMPS = {
    "sun": SUN,
    "spot": SpotLight((1, 1, 1), (0.6, 3.0, 2.2), tuple(np.array([-0.2, -0.8, -0.57]) / 1.0024), outer=0.8),
    "point": PointLight((1, 1, 1), (0.1, 0.2, -0.1)),
}
SOLID: dict[str, Any] = {"color": "#888", "alpha_mode": "solid"}


@pytest.fixture(scope="module")
def device() -> Device:
    return shared_device()


@pytest.fixture(autouse=True)
def _no_errors(caplog: pytest.LogCaptureFixture) -> Iterator[None]:
    yield
    assert not [record for record in caplog.records if record.levelno >= logging.WARNING]


def eye(z: float = 9.0) -> Any:
    camera = gfx.PerspectiveCamera(50, 2, depth_range=(0.1, 100))
    camera.local.position = (0, 0, z)
    camera.set_view_size(200, 100)
    return camera


def read(device: Device, shadow: Shadow) -> np.ndarray:
    """(views, size, size)"""
    size = shadow.size
    out = []
    for layer in range(len(shadow.views)):
        source, layout = {"texture": shadow.texture, "origin": (0, 0, layer)}, {"bytes_per_row": 4 * size, "rows_per_image": size}
        out.append(np.frombuffer(device.queue.read_texture(source, layout, (size, size, 1)), np.float32).reshape(size, size))
    return np.stack(out)


def cast(
    device: Device, casters: Casters, lamp: PunctualLight = SUN, size: int = SIZE, camera: Any = None, **march: Any
) -> tuple[np.ndarray, list[ShadowView]]:
    camera = camera or eye()
    air = resolve(Medium(max_distance=60.0), March(shadow_size=size, **march), "final", 1.0)
    (shadow,) = casters.draw(camera.view_matrix, camera.projection_matrix, [lamp], air)
    return read(device, shadow), shadow.views


def scene(*things: Any) -> Any:
    return gfx.Scene().add(*things)


def corners(mesh: Any) -> np.ndarray:
    """(T, 3, 3) a mesh's triangles in the world."""
    return np.asarray(vertices(mesh)[np.asarray(mesh.geometry.indices.data)])


def depths(triangles: np.ndarray, view: ShadowView, size: int, slack: float, most: bool) -> np.ndarray:
    """(size, size) what a map holds of triangles (T, 3, 3), each wider by `slack` texels, and nearer by what its depth changes over
    as many: homogeneous rasterisation (Olano, Greer 1997).

    Each is nearer by half its slope, which is the greater of those along x and y, or, at most, its gradient, as Vulkan leaves to drivers.
    """
    y, x = np.mgrid[:size, :size] + 0.5
    out = np.zeros((size, size))
    for at in triangles @ view.matrix[:, :3].T + view.matrix[:, 3]:
        basis = at[:, [0, 1, 3]].T
        if abs(np.linalg.det(basis)) < 1e-12:
            continue
        inverse = np.linalg.inv(basis)
        shares = np.einsum("ij,jyx->iyx", inverse, np.stack([x, y, np.ones_like(x)]))  # over w
        held = (shares >= -slack * np.abs(inverse[:, :2]).sum(axis=1)[:, None, None]).all(axis=0)
        depth = np.einsum("i,iyx->yx", at[:, 2], shares)
        gradient = at[:, 2] @ inverse[:, :2]
        steeper = max(1 + 2 * slack * (np.linalg.norm(inverse[:, :2], axis=1) * at[:, 3]).max(), 0)  # a sliver, its corners moved
        nearer = 0.5 * steeper * np.linalg.norm(gradient, 2 if most else np.inf) + slack * np.abs(gradient).sum()
        out = np.where(held & (depth <= 1), np.maximum(out, np.minimum(depth + nearer, 1)), out)
    return out


def check(device: Device, casters: Casters, triangles: np.ndarray, lamp: PunctualLight, **march: Any) -> None:
    """A map holds the triangles, nearer to the light by half the slope of a texel: within .018 texels, and what edges are drawn off by,
    across, 0.1 mm along a sun's light, 1e-5 of the distance along a lamp's."""
    maps, views = cast(device, casters, lamp, **march)
    seen, across = 0, 0.018 + edge_error()
    for held, view in zip(maps, views):
        within, around = (depths(triangles, view, held.shape[0], slack, slack > 0) for slack in (-across, across))
        error = 1e-4 / view.depth_scale if lamp.directional else 1e-5 * around
        assert (held >= within - error).all() and (held <= around + error).all()
        seen += np.count_nonzero(within)
    assert seen > 20


def box(**material: Any) -> Any:
    thing = gfx.Mesh(gfx.box_geometry(1.0, 0.7, 1.3), gfx.MeshStandardMaterial(**SOLID, **material))
    thing.local.rotation = la.quat_from_euler((0.4, 0.6, 0.2))
    return thing


@pytest.mark.parametrize("kind", ["sun", "spot"])
def test_a_box_is_where_it_should_be(device: Device, kind: str) -> None:
    thing = box()
    check(device, Casters(device, scene(thing)), corners(thing), LAMPS[kind])


def test_boxes_around_a_lamp_are_on_all_six_faces(device: Device) -> None:
    around = [box() for _ in range(7)]
    for thing, place in zip(around, [*(2.5 * np.eye(3)), *(-2.5 * np.eye(3)), (2, 2, 2.2)]):
        thing.local.position = place
    casters, triangles = Casters(device, scene(*around)), np.concatenate([corners(thing) for thing in around])
    check(device, casters, triangles, LAMPS["point"])
    maps, _ = cast(device, casters, LAMPS["point"])
    assert all(np.count_nonzero(face) > 100 for face in maps)


@pytest.mark.parametrize("side", ["front", "back", "both"])
@pytest.mark.parametrize("flip", [1, -1])
def test_both_sides_cast_and_mirrored_ones(device: Device, side: str, flip: int) -> None:
    sheet = gfx.Mesh(gfx.plane_geometry(2, 1.2), gfx.MeshStandardMaterial(**SOLID, side=side))
    sheet.local.scale = (flip, 1, 1)
    sheet.local.rotation = la.quat_from_euler((-1.2, 0.3, 0))
    for turn in (0, math.pi):
        sheet.local.rotation = la.quat_mul(sheet.local.rotation, la.quat_from_euler((0, turn, 0)))
        check(device, Casters(device, scene(sheet)), corners(sheet), SUN)


def test_instances_cast(device: Device) -> None:
    many = gfx.InstancedMesh(gfx.box_geometry(0.3, 0.3, 0.3), gfx.MeshToonMaterial(**SOLID), 5)
    many.local.scale = (1, 1.2, -1)
    many.local.rotation = la.quat_from_euler((0.1, 0.4, 0))
    casters = Casters(device, scene(many))
    one = np.asarray(many.geometry.positions.data[many.geometry.indices.data], float)
    for shift in (0.0, 0.5):
        triangles = []
        for i in range(5):
            many.set_matrix_at(
                i, la.mat_compose((-1.2 + 0.6 * i + shift, 0, shift * i), la.quat_from_euler((0, 0.2 * i, 0)), (1, 1, 1 + 0.2 * i))
            )
            matrix = many.world.matrix @ many.get_matrix_at(i)
            triangles.append(one @ matrix[:3, :3].T + matrix[:3, 3])
        check(device, casters, np.concatenate(triangles), SUN)


def test_a_skinned_mesh_casts_in_its_pose(device: Device) -> None:
    root, pose = model(HAWK)
    meshes = [thing for thing in root.iter() if isinstance(thing, gfx.SkinnedMesh)]
    casters = Casters(device, scene(root))
    for t in (0.0, 0.31):
        pose(t)
        for mesh in meshes:
            mesh.material.alpha_test = 0
        check(device, casters, np.concatenate([corners(mesh) for mesh in meshes]), SUN)
        whole, _ = cast(device, casters, size=200)
        for mesh in meshes:
            mesh.material.alpha_test = 0.5
        feathered, _ = cast(device, casters, size=200)
        assert (feathered <= whole).all() and 0.8 < np.count_nonzero(feathered) / np.count_nonzero(whole) < 0.99


def test_morph_targets_cast(device: Device) -> None:
    ball = morphed_ball()
    casters = Casters(device, scene(ball))
    for share in (0.0, 1.0):
        ball.morph_target_influences = [share]
        check(device, casters, corners(ball), SUN)


def square(**material: Any) -> Any:
    """Two metres wide, across SUN's light."""
    sheet = gfx.Mesh(gfx.plane_geometry(2, 2), gfx.MeshStandardMaterial(side="both", **material))
    sheet.local.rotation = la.quat_from_vecs((0, 0, 1), SLANT)
    return sheet


def held(device: Device, sheet: Any) -> Callable[..., np.ndarray]:
    """Whether the map holds a sheet's places (x, y), -1..1."""
    maps, views = cast(device, Casters(device, scene(sheet)), size=96)

    def at(*places: tuple[float, float]) -> np.ndarray:
        points = np.array([(x, y, 0, 1) for x, y in places]) @ np.asarray(sheet.world.matrix).T
        x, y = (points @ views[0].matrix.T)[:, :2].T.astype(int)
        return np.asarray(maps[0][y, x] > 0)

    return at


def window(alpha: int = 0) -> Any:
    """A map whose middle has an alpha of its own."""
    pixels = np.full((64, 64, 4), 255, np.uint8)
    pixels[16:48, 16:48, 3] = alpha
    return gfx.Texture(pixels, dim=2)


FRAME = [(0.55, 0), (-0.55, 0), (0, 0.55), (0, -0.55), (0.95, 0.95), (-0.95, 0.95)]
PANE = [(0, 0), (0.45, 0), (-0.45, 0), (0, 0.45), (0, -0.45), (0.4, -0.4)]


def test_a_hole_that_an_alpha_test_cuts_is_lit(device: Device) -> None:
    at = held(device, square(map=window(), alpha_test=0.5, alpha_mode="solid"))
    assert at(*FRAME).all() and not at(*PANE).any()
    sheet = square(map=window(120), alpha_test=0.5, alpha_mode="solid")
    assert not held(device, sheet)(*PANE).any()
    sheet.material.alpha_test = 0.4
    assert held(device, sheet)(*PANE, *FRAME).all()
    sheet.material.alpha_test, sheet.material.alpha_compare = 0.6, ">"
    at = held(device, sheet)
    assert at(*PANE).all() and not at(*FRAME).any()


def test_vertices_and_colour_have_a_say_in_an_alpha_test(device: Device) -> None:
    sheet = square(alpha_test=0.5, alpha_mode="solid")
    colors = np.ones((4, 4), np.float32)
    colors[sheet.geometry.positions.data[:, 0] < 0, 3] = 0
    sheet.geometry.colors = gfx.Buffer(colors)
    at = held(device, sheet)
    assert at((0.1, 0), (0.9, 0.8)).all() and not at((-0.1, 0), (-0.9, 0.8)).any()
    assert not held(device, square(color=(1, 1, 1, 0.4), alpha_test=0.5, alpha_mode="solid"))(*PANE, *FRAME).any()


def test_what_is_blended_by_default_casts_where_it_is_more_than_half_there(device: Device) -> None:
    at = held(device, square(map=window(100)))
    assert at(*FRAME).all() and not at(*PANE).any()
    assert held(device, square(map=window(140)))(*FRAME, *PANE).all()
    assert held(device, square(map=window(0), alpha_mode="solid"))(*FRAME, *PANE).all()  # opaque: its alpha is not looked at
    at = held(device, square(map=window(140), alpha_test=0.6))
    assert at(*FRAME).all() and not at(*PANE).any()


def test_who_casts(device: Device) -> None:
    e = exhibition()
    casters = Casters(device, e.scene)
    for name in ("glass", "pane"):
        assert np.count_nonzero(cast(device, Casters(device, scene(getattr(e, name))))[0]) == 0, name
    e.box.cast_shadow = False
    names = {id(getattr(e, name)): name for name in ("lamp", "box", "glass", "pane", "leaf", "frond", "bar", "ball", "many", "hidden")}
    assert {names[id(mesh)] for mesh, _ in casters.gather()[0]} == {"lamp", "box", "leaf", "frond", "bar", "ball", "many"}
    casters.exclude, casters.lights = [e.leaf], [SceneLight(target=e.lamp)]
    assert {names[id(mesh)] for mesh, _ in casters.gather()[0]} == {"box", "frond", "bar", "ball", "many"}
    e.box.add(e.ball)
    casters.exclude = [e.box]
    assert {names[id(mesh)] for mesh, _ in casters.gather()[0]} == {"leaf", "frond", "bar", "many"}
    casters.lights = [SceneLight(target=e.lamp, emitter=False)]
    assert id(e.lamp) in {id(mesh) for mesh, _ in casters.gather()[0]}
    dome = gfx.Mesh(gfx.sphere_geometry(50), gfx.MeshBasicMaterial(color="#abc", alpha_mode="solid", depth_write=False))
    assert fit.ball(Casters(device, scene(dome)).gather()[1])[1] == 0


def test_the_bodies_of_lights_do_not_cast_but_what_is_around_them_does(device: Device) -> None:
    def bulb(**material: Any) -> Any:
        return gfx.Mesh(gfx.sphere_geometry(0.2), gfx.MeshStandardMaterial(**SOLID, **material))

    def count(*things: Any) -> int:
        return len(Casters(device, scene(*things)).gather()[0])

    glowing = {"emissive": "#fff"}
    plain, lit, holder, above = gfx.Mesh(gfx.sphere_geometry(0.2), gfx.MeshBasicMaterial()), bulb(**glowing), gfx.Group(), gfx.PointLight()
    plain.add(gfx.PointLight(), box())
    assert count(plain) == 1  # the box
    lit.add(holder.add(gfx.SpotLight()))
    assert count(lit) == 0
    assert count(above.add(bulb(**glowing))) == 0
    dark = bulb()
    assert count(dark.add(gfx.PointLight())) == 1  # it hides its light
    apart = bulb(**glowing)
    lamp = gfx.PointLight()
    lamp.local.position = (0, 3, 0)
    assert count(apart.add(lamp)) == 1


def test_an_object_behind_the_camera_casts_into_the_view_and_one_that_moves_is_followed(device: Device) -> None:
    camera, thing, floor = eye(0.0), box(), gfx.Mesh(gfx.plane_geometry(300, 300), gfx.MeshStandardMaterial(**SOLID))
    floor.local.position = (0, -5, 0)
    floor.local.rotation = la.quat_from_axis_angle((1, 0, 0), -math.pi / 2)
    thing.local.position = (0, 8, 6)
    casters = Casters(device, scene(thing, floor))
    low = DirectionalLight((1, 1, 1), direction=(0, 0.6, 0.8))
    for x in (0.0, 2.5):
        thing.local.x = x
        maps, views = cast(device, casters, low, 256, camera, cascades=3)
        shade = np.array([x, -1.0, -6.0, 1.0])  # 15 m along the light from the box, before the camera
        for held, view in zip(maps, views):
            i, j, depth, _ = view.matrix @ shade
            if 0 <= i < 256 and 0 <= j < 256:
                assert held[int(j), int(i)] > depth + 10 / view.depth_scale
                break
        else:
            pytest.fail("no cascade holds it")


def test_bounds_hold_every_vertex_and_are_tight(device: Device) -> None:
    root, pose = model(HAWK)
    bar, bone = skinned_bar()
    ball = morphed_ball()
    root.local.scale = (1, -1, 1)
    bar.local.position = (3, 1, 0)
    meshes = [thing for thing in root.iter() if isinstance(thing, gfx.Mesh)] + [bar, ball]
    world, bounds = scene(root, bar, ball), Bounds()
    casters = Casters(device, world)
    for k in range(3):
        pose(0.2 * k)
        bone.local.rotation = la.quat_from_euler((0, 0, 0.8 * k))
        ball.morph_target_influences = [1.4 * k - 0.5]
        ball.local.position = (k, 0, 2)
        for mesh, hull in zip(meshes, bounds.hulls(meshes)):
            points = vertices(mesh)
            low, high = hull.min(axis=0), hull.max(axis=0)
            slack = 1e-5 * (high - low).max()
            assert (points >= low - slack).all() and (points <= high + slack).all()
            assert mesh is ball or (np.ptp(points, axis=0) > 0.4 * (high - low)).all()
        centre, radius = fit.ball(casters.gather()[1])
        everything = np.concatenate([vertices(mesh) for mesh in meshes])
        assert radius >= np.linalg.norm(everything - centre, axis=1).max() * (1 - 1e-6)
    cast(device, casters)
    before = bounds.hulls([ball])
    ball.geometry.positions.data[:] *= 2
    ball.geometry.positions.update_full()
    assert np.ptp(bounds.hulls([ball]), axis=1).max() > np.ptp(before, axis=1).max()


def test_textures_stay_while_their_size_and_number_do(device: Device) -> None:
    casters, camera = Casters(device, scene(box())), eye()

    def draw(lamps: list[PunctualLight], size: int, **march: Any) -> list[Shadow]:
        air = resolve(Medium(max_distance=60.0), March(shadow_size=size, **march), "final", 1.0)
        return casters.draw(camera.view_matrix, camera.projection_matrix, lamps, air)

    first = draw([SUN, LAMPS["point"]], 32)
    assert [shadow.texture.size for shadow in first] == [(32, 32, 1), (32, 32, 6)]
    again = draw([SUN, LAMPS["point"]], 32)
    assert all(a.texture is b.texture for a, b in zip(first, again))
    more = draw([SUN, LAMPS["spot"], SUN], 32)
    assert more[0].texture is first[0].texture and [shadow.texture.size[2] for shadow in more] == [1, 1, 1]
    assert draw([SUN], 64, cascades=4)[0].texture.size == (64, 64, 4)
    assert draw([], 64) == []
    with pytest.raises(AirlightError, match=f"shadow_size .*{device.max_side}"):
        draw([SUN], device.max_side + 1)


def test_layers_are_timed_and_the_scene_is_left_alone(device: Device) -> None:
    e = exhibition()
    casters, camera, timer = Casters(device, e.scene), eye(), Timer(device)
    before = [(thing.cast_shadow, getattr(thing.material, "side", None)) for thing in e.scene.iter()]
    air = resolve(Medium(max_distance=60.0), March(shadow_size=32), "final", 1.0)
    casters.draw(camera.view_matrix, camera.projection_matrix, [LAMPS["point"]], air, timer)
    encoder = device.encoder()
    timer.resolve(encoder)
    device.submit(encoder)
    if device.timestamps:
        assert [label for label, ms in timer.milliseconds() if ms >= 0] == ["shadows"] * 6
    assert before == [(thing.cast_shadow, getattr(thing.material, "side", None)) for thing in e.scene.iter()]


def test_an_empty_scene_has_empty_maps(device: Device) -> None:
    casters = Casters(device, scene())
    for lamp in LAMPS.values():
        maps, _ = cast(device, casters, lamp)
        assert (maps == 0).all()


@pytest.mark.parametrize("gap", [np.nan, np.inf])
def test_what_is_nowhere_does_not_cast_and_a_mesh_with_gaps_does(device: Device, gap: float) -> None:
    lost, gaps, none, empty, point = box(), box(), gfx.Mesh(gfx.Geometry(), gfx.MeshBasicMaterial()), box(), box()
    kept = corners(gaps)[(np.asarray(gaps.geometry.indices.data) != gaps.geometry.positions.nitems - 1).all(axis=1)]
    lost.geometry.positions.data[:] = gap
    gaps.geometry.positions.data[-1] = gap
    empty.geometry = gfx.Geometry(positions=gfx.Buffer(nbytes=36, nitems=3, format="3xf4"))  # which only the GPU may fill
    point.local.scale, point.local.position = 0, (100, 0, 0)
    casters = Casters(device, scene(lost, gaps, none, empty, point))
    found, hulls = casters.gather()
    assert [mesh for mesh, _ in found] == [gaps] and np.isfinite(hulls).all() and np.abs(hulls).max() < 2
    check(device, casters, kept, SUN)
    assert Casters(device, scene(lost, none, empty, point)).gather()[0] == []


@pytest.mark.parametrize("gap", [np.nan, np.inf])
def test_gaps_leave_the_bounds_of_what_moves(gap: float) -> None:
    """Of bones, morph targets and instances: those of the vertices that are somewhere."""
    bar, _ = skinned_bar()
    ball, flat = morphed_ball(), box()
    flat.local.scale = (0, 1, 1)
    many = gfx.InstancedMesh(gfx.box_geometry(1, 1, 1), gfx.MeshBasicMaterial(), 3)
    for i in range(3):
        many.set_matrix_at(i, la.mat_from_translation((i, 0, 0)) if i else np.full((4, 4), np.nan))
    whole, meshes = Bounds().hulls([bar, ball, flat]), [bar, ball, flat, many]
    for mesh in (bar, ball, flat):
        mesh.geometry.positions.data[:2] = gap
    ball.geometry.morph_positions[0][-2:] = gap
    found = Bounds().hulls(meshes)
    assert np.isfinite(found).all()
    for part, all_ in zip(found, whole, strict=False):
        assert (part.min(axis=0) >= all_.min(axis=0) - 1e-6).all() and (part.max(axis=0) <= all_.max(axis=0) + 1e-6).all()
    assert np.allclose(np.ptp(found[:3], axis=1), np.ptp(whole, axis=1), atol=0.3)
    assert np.allclose([found[3].min(axis=0), found[3].max(axis=0)], [[0.5, -0.5, -0.5], [2.5, 0.5, 0.5]])


def test_a_body_of_light_with_gaps_is_where_the_rest_is() -> None:
    whole, ball, lost = (gfx.Mesh(gfx.sphere_geometry(0.5), gfx.MeshBasicMaterial()) for _ in range(3))
    ball.geometry.positions.data[3] = np.nan
    lost.geometry.positions.data[:] = np.nan
    centre, radius, _ = SceneLight(ball).body()
    assert np.allclose(centre, SceneLight(whole).body()[0]) and radius == pytest.approx(SceneLight(whole).body()[1])
    assert SceneLight(lost).body() is None


def test_a_leaf_casts_a_leaf(device: Device) -> None:
    texture = leaf_map()
    sheet = square(map=texture, alpha_test=0.5, alpha_mode="solid")
    places = [((k + 0.5) / 10 - 1, (j + 0.5) / 10 - 1) for k in range(20) for j in range(20)]
    alpha = np.asarray(texture.data)[..., 3] > 127
    wide = [alpha[max(0, y - 3) : y + 4, max(0, x - 3) : x + 4] for x, y in ((int(32 * (u + 1)), int(32 * (1 - v))) for u, v in places)]
    sure = np.array([part.all() == part.any() for part in wide])
    assert sure.sum() > 150
    np.testing.assert_array_equal(held(device, sheet)(*places)[sure], np.array([part.all() for part in wide])[sure])


def test_views_are_numbered_as_layers(device: Device) -> None:
    """shadow_layers is as many as there can be."""
    air = resolve(Medium(), March(cascades=3), "final", 1.0)
    assert [lamp.shadow_layers(air) for lamp in LAMPS.values()] == [3, 1, 6]


@pytest.mark.parametrize("mode", ["blend", "weighted_blend", "dither"])
def test_what_is_blended_on_purpose_casts_where_it_is_opaque(device: Device, mode: str) -> None:
    """As leaves with soft edges are; not what is told to write no depth, nor what only adds or multiplies."""
    at = held(device, square(map=window(140), alpha_mode=mode))
    assert at(*FRAME).all() and not at(*PANE).any()
    assert held(device, square(map=window(250), alpha_mode=mode))(*FRAME, *PANE).all()
    assert held(device, square(alpha_mode=mode))(*FRAME, *PANE).all()
    for material in ({"opacity": 0.9}, {"color": (1, 1, 1, 0.9)}, {"depth_write": False}):
        sheet = square(**{"map": window(255), "alpha_mode": mode, **material})
        assert Casters(device, scene(sheet)).gather()[0] == [], material
    for other in ("add", "multiply"):
        assert Casters(device, scene(square(map=window(255), alpha_mode=other))).gather()[0] == []


def test_the_blended_rest_of_what_is_drawn_in_two_does_not_cast(device: Device) -> None:
    sheet = square(map=window(255), alpha_mode="blend", depth_write=False, alpha_test=0.5, alpha_compare=">=")
    assert Casters(device, scene(sheet)).gather()[0] == []
