"""What is seen through, in a medium: each fragment is fogged at its own distance, whatever the order, the blending and the steps."""

import itertools
import math
from typing import Any

import numpy as np
import pytest
from calling import call

from airlight.files.volumes import Volume
from airlight.gpu.device import shared_device
from airlight.gpu.structs import struct_dtype
from airlight.medium.field import Field
from airlight.medium.resolve import resolve
from airlight.options import March, Medium, Parameters, SceneOptions, build
from airlight.projection import depth_terms, eye_rays
from airlight.reference import panes, profile, tracer

gfx = pytest.importorskip("pygfx")
from pass_stage import PassStage  # noqa: E402

from airlight.pygfx import LightShafts, SceneLight  # noqa: E402
from airlight.pygfx.glass_maps import GlassMaps  # noqa: E402
from airlight.pygfx.punctual import punctual_lights  # noqa: E402
from airlight.scenes import open_scene  # noqa: E402
from airlight.scenes.offline import Shot, Studio  # noqa: E402

SIZE = (48, 27)
SIGMA, ALBEDO, PHASE, LUX, WALL = 0.07, 0.9, 0.1, 3.0, 12.0
BEHIND = 2.0  # radiance of the wall
RNG = np.random.default_rng(18)


def light(t: Any) -> Any:
    """Radiance that is scattered in up to t, of a sun that nothing hides."""
    return ALBEDO * PHASE * LUX * -np.expm1(-SIGMA * np.asarray(t, float))


def left(t: Any) -> Any:
    return np.exp(-SIGMA * np.asarray(t, float))


def grey(radiance: float) -> Any:
    """The colour of pygfx of a radiance."""
    return gfx.Color.from_physical(radiance, radiance, radiance)


class Depths(gfx.renderers.wgpu.EffectPass):
    """Draws nothing, and keeps the depth that it was given."""

    USES_DEPTH = True
    depth: Any = None

    def render(self, command_encoder: Any, color_tex: Any, depth_tex: Any, target_tex: Any) -> None:
        self.depth = depth_tex.texture


class Stage(PassStage):
    """A wall, and panes before it, in front of a camera without perspective, so that all of the picture is alike."""

    def __init__(self) -> None:
        super().__init__(SIZE)

    def reset(self) -> None:
        self.scene = gfx.Scene()
        self.wall = gfx.Mesh(gfx.plane_geometry(200, 200), gfx.MeshBasicMaterial(color=grey(BEHIND)))
        self.wall.local.position = (0, 0, -WALL)
        self.scene.add(gfx.Background(None, gfx.BackgroundMaterial("#000")), self.wall)
        self.camera = gfx.OrthographicCamera(32, 18, depth_range=(0, 50))
        self.panes: list[Any] = []

    def pane(self, t: float, alpha: float, radiance: float, **material: Any) -> Any:
        """Adds a pane that sends out alpha x radiance."""
        settings = {"alpha_mode": "blend", "opacity": alpha, "color": grey(radiance), **material}
        made = gfx.Mesh(gfx.plane_geometry(100, 100), gfx.MeshBasicMaterial(**settings))
        made.local.position = (0, 0, -t)
        self.panes.append(made)
        self.scene.add(made)
        return made

    def shafts(self, resolution: float = 1.0, steps: Any = "exact", **medium: Any) -> LightShafts:
        sun = SceneLight(direction=(0, 1, 0), color=(1, 1, 1), strength=LUX * PHASE * 4 * math.pi)
        shafts = LightShafts(
            self.renderer,
            self.scene,
            self.camera,
            [sun],
            parameters=Parameters(method="march"),
            in_scene=SceneOptions(view_transform="none", resolution=resolution),
            medium=Medium(sigma_t=(SIGMA,) * 3, albedo=(ALBEDO,) * 3, phase="isotropic", max_distance=40.0, **medium),
            march=March(steps=steps),
            exclude=[self.wall, *self.panes],
        )
        self.renderer.effect_passes = [shafts]
        return shafts

    def seen(self, shafts: LightShafts) -> tuple[np.ndarray, np.ndarray]:
        """The picture and its layer, (H, W, 3)."""
        self.draw()
        return self.renderer.snapshot()[..., :3].astype(float), self.texels(shafts.layer)[..., :3].astype(float)


def composite(*given: tuple[float, float, float]) -> tuple[float, float]:
    """What is seen through panes (t, share that passes, what they send), in any order, and the layer of that."""
    ordered = sorted(given, reverse=True)
    source, passed, air, transmittance = ([[v] for v in values] for values in zip(*((s, p, light(t), left(t)) for t, p, s in ordered)))
    picture = profile.seen_through(light(WALL) + left(WALL) * BEHIND, source, passed, air, transmittance)
    layer = profile.seen_through(light(WALL), np.zeros_like(source), passed, air, transmittance)
    return float(picture[0]), float(layer[0])


def check(stage: Stage, shafts: LightShafts, picture: float, layer: float, within: float = 2e-3) -> None:
    """within: of the picture, of which halves hold 1e-3, and which is cut off twice."""
    found = stage.seen(shafts)
    np.testing.assert_allclose(found[0], picture, atol=within)
    np.testing.assert_allclose(found[1], layer, atol=1e-4)


# ---------------------------------------------------------------- known answers


@pytest.mark.parametrize("resolution", [1.0, 0.5])
@pytest.mark.parametrize("steps", ["exact", 64])
def test_a_plate_before_a_wall(stage: Stage, steps: Any, resolution: float) -> None:
    """All of the fog before the plate would give 0.9305, all of it behind 1.1610."""
    stage.pane(4, 0.35, 0.5 / 0.35)
    assert composite((4, 0.65, 0.5))[0] == pytest.approx(1.06193, abs=1e-5)
    check(stage, stage.shafts(resolution, steps), *composite((4, 0.65, 0.5)), within=1e-3)


def test_without_layers_the_plate_is_behind_all_of_the_fog(stage: Stage) -> None:
    stage.pane(4, 0.35, 0.5 / 0.35)
    check(stage, stage.shafts(transparency="none"), float(light(WALL) + left(WALL) * (0.65 * BEHIND + 0.5)), float(light(WALL)))


@pytest.mark.parametrize("order", [(0, 1, 2), (2, 0, 1)])
def test_several_panes_in_any_order(stage: Stage, order: tuple[int, ...]) -> None:
    each = [(2.0, 0.5, 0.2), (5.0, 0.35, 0.3), (9.0, 0.6, 0.1)]
    for i in order:
        t, alpha, sent = each[i]
        stage.pane(t, alpha, sent / alpha)
    check(stage, stage.shafts(), *composite(*((t, 1 - alpha, sent) for t, alpha, sent in each)))


def test_sixteen_panes_have_fewer_knots_and_are_right(stage: Stage) -> None:
    each = [(1 + 0.6 * i, 0.1, 0.02) for i in range(16)]
    for t, alpha, sent in each:
        stage.pane(t, alpha, sent / alpha)
    check(stage, stage.shafts(0.5, 64), *composite(*((t, 1 - alpha, sent) for t, alpha, sent in each)))


@pytest.mark.parametrize("resolution", [1.0, 0.5])
@pytest.mark.parametrize("steps", ["exact", pytest.param(512, marks=pytest.mark.slow)])
def test_a_plate_in_a_slab_of_smoke(stage: Stage, steps: Any, resolution: float) -> None:
    """The air is empty but between 2 and 6 m; the plate is in the middle of that."""
    stage.pane(4, 0.35, 0.5 / 0.35)
    shafts = stage.shafts(resolution, steps, sun_extinction="none", ambient=(0.2,) * 3)
    matrix = np.diag([100.0, 100.0, 4.0, 1.0])
    matrix[2, 3] = -4.0
    shafts.fields = [Field(Volume(np.ones((1, 1, 1), np.float32), matrix, 0.5, "slab"))]
    of_ambient = 1 + 0.2 / (PHASE * LUX)
    air, transmittance = light(2) * of_ambient, left(2)
    picture = 0.65 * (light(4) * of_ambient + left(4) * BEHIND) + 0.35 * air + transmittance * 0.5
    layer = 0.65 * light(4) * of_ambient + 0.35 * air
    if steps == "exact":
        check(stage, shafts, float(picture), float(layer))
    else:  # which know the smoke by samples, here and there too much or too little of it
        np.testing.assert_allclose([found.mean() for found in stage.seen(shafts)], [picture, layer], rtol=0.01)


BLENDINGS = {  # of a material, and what passes and is sent of a colour of 0.3
    "add": ({"alpha_mode": "add"}, 1.0, 0.4 * 0.3),
    "premultiplied": (
        {
            "alpha_config": {
                "method": "blended",
                "color_src": "one",
                "color_dst": "one-minus-src-alpha",
                "alpha_src": "one",
                "alpha_dst": "one-minus-src-alpha",
            }
        },
        0.6,
        0.3,
    ),
    "multiply": ({"alpha_mode": "multiply"}, 0.3, 0.0),
    "subtract": ({"alpha_mode": "subtract"}, 0.7, 0.0),
    "auto": ({"alpha_mode": "auto"}, 0.6, 0.4 * 0.3),
}


@pytest.mark.parametrize("name", BLENDINGS)
def test_other_ways_to_blend(stage: Stage, name: str) -> None:
    material, passed, sent = BLENDINGS[name]
    stage.pane(4, 0.4, 0.3, **material)
    check(stage, stage.shafts(), *composite((4, passed, sent)))


PLACES = np.column_stack([np.linspace(-12, 12, 24), RNG.uniform(-7, 7, 24), RNG.uniform(-10, -2, 24)]).astype(np.float32)
THINGS = {  # of pygfx, that are no plain mesh
    "points": lambda: gfx.Points(gfx.Geometry(positions=PLACES), gfx.PointsMaterial(size=9, opacity=0.5, alpha_mode="blend")),
    "smoke": lambda: gfx.Points(gfx.Geometry(positions=PLACES), gfx.PointsGaussianBlobMaterial(size=7, alpha_mode="blend")),
    "line": lambda: gfx.Line(gfx.Geometry(positions=PLACES), gfx.LineMaterial(thickness=4, opacity=0.5, alpha_mode="blend")),
    "text": lambda: gfx.Text(text="mist", font_size=9, material=gfx.TextMaterial(opacity=0.5, alpha_mode="blend")),
    "many": lambda: gfx.InstancedMesh(gfx.box_geometry(5, 5, 5), gfx.MeshPhongMaterial(opacity=0.5, alpha_mode="blend"), 2),
}


@pytest.mark.parametrize("name", THINGS)
def test_whatever_is_seen_through_is_fogged(stage: Stage, name: str) -> None:
    """What is behind them is seen through them, so that the layer is darker there."""
    thing = THINGS[name]()
    thing.local.position = (0, 0, -4) if name in ("text", "many") else (0, 0, 0)
    stage.scene.add(thing, gfx.AmbientLight())
    shafts = stage.shafts(0.5, 64)
    layer, held = stage.seen(shafts)[1], len(shafts.panes.held)
    without = stage.seen(stage.shafts(0.5, 64, transparency="none"))[1]
    seen = np.ptp(layer - without, axis=-1) + np.abs(layer - without)[..., 0] > 1e-5
    assert held == 1 and 0.01 < seen.mean() < 0.9
    assert (layer[seen] <= without[seen] + 1e-5).all() and layer.min() > 0


def test_a_pane_behind_the_wall_is_not_seen(stage: Stage) -> None:
    stage.pane(14, 0.4, 3.0)
    check(stage, stage.shafts(), float(light(WALL) + left(WALL) * BEHIND), float(light(WALL)))


def test_surfaces_that_are_not_dimmed_get_only_light(stage: Stage) -> None:
    stage.pane(4, 0.35, 0.5 / 0.35)
    picture = 0.65 * (light(WALL) + BEHIND) + 0.35 * light(4) + 0.5
    check(stage, stage.shafts(extinction=False), float(picture), composite((4, 0.65, 0.5))[1])


def test_dithering_is_right_on_the_mean(stage: Stage) -> None:
    stage.pane(4, 0.35, 0.5 / 0.35)
    picture, layer = composite((4, 0.65, 0.5))
    found = stage.seen(stage.shafts(transparency="dither"))
    assert np.ptp(found[0]) > 0.1
    np.testing.assert_allclose([found[0].mean(), found[1].mean()], [picture, layer], rtol=0.02)


# ---------------------------------------------------------------- the scene is the user's


def test_a_texture_is_solid_where_it_is_opaque(stage: Stage) -> None:
    """Its left half is opaque, and so in the depth; the right half is seen through."""
    texels = np.full((2, 64, 4), 255, np.uint8)
    texels[:, 32:, 3] = 102
    texture = gfx.Texture(texels, dim=2, colorspace="srgb")
    pane = stage.pane(4, 1.0, 1.0)
    pane.material.map = gfx.TextureMap(texture, filter="nearest")
    shafts = stage.shafts()
    picture, layer = stage.seen(shafts)
    keeps = Depths()
    stage.renderer.effect_passes = [shafts, keeps]
    stage.draw()
    depth = stage.texels(keeps.depth)[..., 0] * 50
    np.testing.assert_allclose(depth[:, [2, -3]], [[4, 12]] * SIZE[1], rtol=1e-5)
    np.testing.assert_allclose(picture[:, 2], light(4) + left(4), atol=1e-3)
    np.testing.assert_allclose(layer[:, 2], light(4), atol=2e-4)
    right = composite((4, 0.6, 0.4))
    np.testing.assert_allclose(picture[:, -3], right[0], atol=1e-3)
    np.testing.assert_allclose(layer[:, -3], right[1], atol=2e-4)


@pytest.mark.parametrize("mode", ["blend", "auto"])
def test_a_texture_whose_alpha_says_nothing_is_solid(stage: Stage, mode: str) -> None:
    pane = stage.pane(4, 1.0, 1.0, alpha_mode=mode)
    pane.material.map = gfx.TextureMap(gfx.Texture(np.full((2, 2, 4), 255, np.uint8), dim=2, colorspace="srgb"))
    shafts = stage.shafts()
    check(stage, shafts, float(light(4) + left(4)), float(light(4)))
    assert not shafts.panes.held


def test_effects_alone_may_be_drawn_again(stage: Stage) -> None:
    stage.pane(4, 0.35, 0.5 / 0.35)
    shafts = stage.shafts()
    first = stage.seen(shafts)[0]
    stage.draw(lambda: stage.renderer.render(stage.scene, stage.camera, flush=False) or stage.renderer.flush() or stage.renderer.flush())
    np.testing.assert_array_equal(stage.seen(shafts)[0], first)


def test_another_scene_may_be_drawn_over_it(stage: Stage) -> None:
    stage.pane(4, 0.35, 0.5 / 0.35)
    shafts, other = stage.shafts(), gfx.Scene()
    other.add(gfx.Mesh(gfx.plane_geometry(1, 1), gfx.MeshBasicMaterial(color="#f00", opacity=0.5, alpha_mode="blend")))
    other.children[0].local.position = (-12, 5, -1)
    first = stage.seen(shafts)[0]
    stage.draw(lambda: stage.renderer.render(stage.scene, stage.camera, flush=False) or stage.renderer.render(other, stage.camera))
    both = stage.renderer.snapshot()[..., :3].astype(float)
    assert len(shafts.panes.held) == 1 and 0 < (both != first).any(axis=-1).mean() < 0.02


def test_without_the_pass_pygfx_draws_as_ever(stage: Stage) -> None:
    stage.pane(4, 0.35, 0.5 / 0.35)
    for passes in ([], [stage.shafts()]):
        stage.renderer.effect_passes = passes
        for one in passes:
            one.enabled = False
        stage.draw()
        np.testing.assert_allclose(stage.renderer.snapshot()[..., 0], 0.65 * BEHIND + 0.5, atol=2e-3)


def test_panes_can_be_picked(stage: Stage) -> None:
    pane = stage.pane(4, 0.35, 1.0, pick_write=True)
    stage.shafts()
    stage.draw()
    assert stage.renderer.get_pick_info((20, 10))["world_object"] is pane


def test_where_nothing_is_seen_through_all_is_as_before(stage: Stage) -> None:
    pane = stage.pane(4, 0.35, 1.0)
    pane.local.scale = (0.1, 1, 1)  # a third of the picture
    shafts = stage.shafts(steps=64)
    with_pane = stage.seen(shafts)
    pane.visible = False
    without = stage.seen(shafts)
    for one, other in zip(with_pane, without, strict=True):
        np.testing.assert_array_equal(one[:, :8], other[:, :8])
        assert np.ptp(one[:, 20:28] - other[:, 20:28]) >= 0 and (one[:, 20:28] != other[:, 20:28]).all()


# ---------------------------------------------------------------- against the tracer


def square(width: float, height: float, position: Any, turn: float = 0.0) -> np.ndarray:
    """Two triangles upright around a position, turned about the vertical, degrees."""
    across = np.array([math.cos(math.radians(turn)), 0, -math.sin(math.radians(turn))]) * width / 2
    up = np.array([0, height / 2, 0])
    a, b, c, d = (np.asarray(position) + i * across + j * up for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1)))
    return np.array([[a, b, c], [a, c, d]])


def mesh(triangles: np.ndarray, **material: Any) -> Any:
    """A mesh whose position is its middle, since pygfx sorts by that."""
    middle = triangles.mean(axis=(0, 1))
    geometry = gfx.Geometry(
        positions=(triangles - middle).reshape(-1, 3).astype(np.float32),
        normals=np.tile(np.float32([0, 0, 1]), (len(triangles) * 3, 1)),
        indices=np.arange(len(triangles) * 3, dtype=np.uint32).reshape(-1, 3),
    )
    made = gfx.Mesh(geometry, gfx.MeshBasicMaterial(side="both", **material))
    made.local.position = middle
    return made


def shining(stage: Stage, sent: SceneLight, steps: Any, resolution: float = 1.0) -> LightShafts:
    """A pass over the scene, with a light and a medium that is no grey."""
    shafts = LightShafts(
        stage.renderer,
        stage.scene,
        stage.camera,
        [sent],
        parameters=Parameters(method="march"),
        in_scene=SceneOptions(view_transform="none", resolution=resolution),
        medium=Medium(sigma_t=(0.1, 0.07, 0.05), albedo=(0.9, 0.8, 0.7), anisotropy=0.3, max_distance=30.0),
        march=March(steps=steps, shadow_size=2048),
    )
    stage.renderer.effect_passes = [shafts]
    return shafts


SUN_BESIDE = SceneLight(direction=(-0.8, 0.5, 0.1), strength=3.0)
LAMP = SceneLight(position=(-6.0, 1.0, -5.0), strength=30.0)


@pytest.mark.parametrize("sent", [pytest.param(SUN_BESIDE, id="sun"), pytest.param(LAMP, id="lamp", marks=pytest.mark.slow)])
@pytest.mark.parametrize(("steps", "resolution", "least"), [("exact", 1.0, 0.01), (64, 0.5, 0.1)])
def test_panes_before_a_shaft_of_light(stage: Stage, sent: SceneLight, steps: Any, resolution: float, least: float) -> None:
    """A wall with a gap beside, through which light falls between two panes that are turned, in view from an edge to the other."""
    camera = stage.camera = gfx.PerspectiveCamera(60, SIZE[0] / SIZE[1], depth_range=(0.1, 60))
    back, leaf = square(40, 20, (0, 0, -9)), [square(6, 9, (-3.5, 0, z), 90) for z in (-1.5, -8.5)]
    glass = [square(5, 2, (0.4, 0.2, -4.5), 55), square(3, 4, (0.8, 0, -6.5), -20), square(1, 1, (0, 0, -2.5))]
    alphas = (0.35, 0.5, 0.2)
    stage.scene = gfx.Scene()
    solid = np.concatenate([back, *leaf])
    stage.scene.add(mesh(solid, color="#000"))
    for one, alpha in zip(glass, alphas, strict=True):
        stage.scene.add(mesh(one, color="#000", opacity=alpha, alpha_mode="blend"))
    shafts = shining(stage, sent, steps, resolution)
    picture, layer = stage.seen(shafts)
    view, projection = np.asarray(camera.view_matrix, float), np.asarray(camera.projection_matrix, float)
    resolved = shafts.resolved_medium
    assert resolved is not None
    traced = [panes.Pane(one, 1 - a) for one, a in zip(glass, alphas, strict=True)]
    truth = panes.layer(view, projection, SIZE, solid, traced, punctual_lights([sent]), resolved)
    near = np.zeros(SIZE[::-1], bool)  # pixels that meet a pane, beside no edge of what is seen
    for one in glass:
        near |= tracer.layer(view, projection, SIZE, one, [], resolved).path_length < 30
    for one in (solid, *glass):
        met = tracer.layer(view, projection, SIZE, one, [], resolved).path_length
        edge = np.abs(np.diff(met, axis=0, prepend=met[:1])) + np.abs(np.diff(met, axis=1, prepend=met[:, :1])) > 0.4
        near &= ~(edge | np.roll(edge, -1, 0) | np.roll(edge, -1, 1))
    wrong = np.sqrt(np.mean((layer - truth.radiance)[near] ** 2)) / truth.radiance[near].mean()
    assert wrong < least
    np.testing.assert_allclose(picture[near], layer[near], rtol=2e-3, atol=1e-4)  # all is black
    alone = tracer.layer(view, projection, SIZE, solid, punctual_lights([sent]), resolved).radiance
    assert np.sqrt(np.mean((alone - truth.radiance)[near] ** 2)) > 5 * least * truth.radiance[near].mean() * (1 if resolution == 1 else 0.2)


FEW = 24, 14  # pixels


def by_subsets(view: Any, projection: Any, solid: np.ndarray, glass: list[panes.Pane], lights: Any, medium: Any) -> np.ndarray:
    """The light seen through panes that a ray meets once at most, by a tracer that knows none. Of panes that let p_i pass, v_i being 0
    where one would hide the light if it were opaque, else 1, the product of p_i + (1 - p_i) v_i is left: a sum over subsets."""

    def lit(seen: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        total: Any = 0.0
        for opaque in itertools.product((False, True), repeat=len(glass)):
            share = math.prod(1 - pane.passed if hides else pane.passed for pane, hides in zip(glass, opaque, strict=True))
            hiding = [pane.triangles for pane, hides in zip(glass, opaque, strict=True) if hides]
            one = tracer.layer(view, projection, FEW, seen, lights, medium, np.concatenate([solid, *hiding]))
            total = total + share * one.radiance
        return total, one.path_length

    behind, way = lit(solid)
    before = [lit(np.concatenate([solid, pane.triangles])) for pane in glass]
    order = np.argsort([-t for _, t in before], axis=0)[..., None]
    passed = np.array([np.where(t < way, pane.passed, 1.0) for (_, t), pane in zip(before, glass, strict=True)])[..., None]
    air = np.take_along_axis(np.array([light for light, _ in before]), order, axis=0)
    return profile.seen_through(behind, np.zeros_like(air), np.take_along_axis(passed, order, axis=0), air, np.ones_like(air))


@pytest.mark.parametrize("more", [{}, {"fog": "exponential", "fog_base": -1.0, "fog_depth": 2.0}])
def test_the_tracer_of_panes_is_the_sum_over_subsets_of_opaque_ones(more: Any) -> None:
    camera = gfx.PerspectiveCamera(60, SIZE[0] / SIZE[1], depth_range=(0.1, 60))
    solid = np.concatenate([square(40, 20, (0, 0, -9)), square(6, 9, (-3.5, 0, -8.5), 90)])
    traced = [panes.Pane(square(5, 2, (0.4, 0.2, -4.5), 55), 0.65), panes.Pane(square(3, 4, (0.8, 0, -6.5), -20), 0.5)]
    air = Medium(sigma_t=(0.1, 0.07, 0.05), anisotropy=0.3, max_distance=30.0, ambient=(0.1, 0.2, 0.3), **more)
    medium = resolve(air, March(), "final", 8.0)
    matrices = np.asarray(camera.view_matrix, float), np.asarray(camera.projection_matrix, float)
    lights = punctual_lights([SUN_BESIDE, LAMP])
    found = panes.layer(*matrices, FEW, solid, traced, lights, medium).radiance
    np.testing.assert_allclose(found, by_subsets(*matrices, solid, traced, lights, medium), rtol=1e-6)


def test_a_pane_has_sides_and_faces() -> None:
    """Twice through two triangles, whose common edge the middle ray meets; only its front is seen, but it dims from both."""
    medium = resolve(Medium(sigma_t=(SIGMA,) * 3, albedo=(ALBEDO,) * 3, phase="isotropic", max_distance=WALL), March(), "final", 8.0)
    camera = gfx.OrthographicCamera(32, 18, depth_range=(0, 50))
    matrices = np.asarray(camera.view_matrix, float), np.asarray(camera.projection_matrix, float)
    above = punctual_lights([SceneLight(direction=(0, 1, 0), strength=LUX * PHASE * 4 * math.pi)])
    faces = np.concatenate([square(100, 100, (0, 0, -t)) for t in (3, 6)])
    for side, panes_seen in (("both", 2), ("front", 2), ("back", 0)):
        found = panes.layer(*matrices, (3, 3), np.zeros((0, 3, 3)), [panes.Pane(faces, 0.5, side=side)], above, medium).radiance
        parts = [(0, 3, 1.0), (3, 6, 0.5), (6, WALL, 0.25)] if panes_seen else [(0, WALL, 1.0)]
        np.testing.assert_allclose(found, sum(left * (light(end) - light(begin)) for begin, end, left in parts))
    roof = panes.Pane(lying(12, 3, 6), 0.5, side="back")
    found = panes.layer(*matrices, (3, 3), np.zeros((0, 3, 3)), [roof], above, medium).radiance
    np.testing.assert_allclose(found, light(WALL) - 0.5 * (light(6) - light(3)))


# ---------------------------------------------------------------- light through panes


def lying(height: float, near: float, far: float) -> np.ndarray:
    """Two triangles that lie level at a height, across all of the view, between two distances before the eye."""
    a, b, c, d = ((x, height, -z) for x, z in ((-60, near), (60, near), (60, far), (-60, far)))
    return np.array([[a, b, c], [a, c, d]], float)


@pytest.mark.parametrize("steps", ["exact", pytest.param(512, marks=pytest.mark.slow)])
def test_panes_dim_the_sun_beside_them(stage: Stage, steps: Any) -> None:
    """Above the view, one lets 0.65 pass down to all between 2 and 6 m, the other 0.5 between 4 and 8 m."""
    for z, alpha in (((2, 6), 0.35), ((4, 8), 0.5)):
        stage.scene.add(mesh(lying(11 + z[0] / 2, *z), color="#fff", opacity=alpha, alpha_mode="blend"))
    shafts = stage.shafts(steps=steps)
    parts = [(0, 2, 1.0), (2, 4, 0.65), (4, 6, 0.65 * 0.5), (6, 8, 0.5), (8, WALL, 1.0)]
    expected = sum(left * (light(end) - light(begin)) for begin, end, left in parts)
    layer = stage.seen(shafts)[1]
    np.testing.assert_allclose(layer.mean(), expected, rtol=2e-3)
    np.testing.assert_allclose(layer, expected, rtol=0.02)  # of texels, and of steps
    full = stage.seen(stage.shafts(steps=steps, transparency="none"))[1]
    np.testing.assert_allclose(full, float(light(WALL)), rtol=1e-3)


@pytest.mark.parametrize("sent", [pytest.param(SUN_BESIDE, id="sun"), pytest.param(LAMP, id="lamp", marks=pytest.mark.slow)])
@pytest.mark.parametrize("steps", ["exact", pytest.param(512, marks=pytest.mark.slow)])
def test_light_falls_through_panes_in_a_gap(stage: Stage, sent: SceneLight, steps: Any) -> None:
    """A wall with a gap beside the view, in which two panes hang: what they dim, and what they do not."""
    camera = stage.camera = gfx.PerspectiveCamera(60, SIZE[0] / SIZE[1], depth_range=(0.1, 60))
    solid = np.concatenate([square(40, 20, (0, 0, -9)), *(square(6, 9, (-6.5, 0, z), 90) for z in (-1.5, -8.5))])
    glass = [square(3, 3, (-6.3, 1.5, -5), 90), square(0.6, 9, (-6.1, 0, -5), 90)]
    alphas = (0.6, 0.35)
    stage.scene = gfx.Scene()
    stage.scene.add(mesh(solid, color="#000"))
    for one, alpha in zip(glass, alphas, strict=True):
        stage.scene.add(mesh(one, color="#000", opacity=alpha, alpha_mode="blend"))
    moved = SceneLight(position=(-9.0, 1.0, -5.0), strength=30.0) if sent is LAMP else sent
    shafts = shining(stage, moved, steps)
    layer = stage.seen(shafts)[1]
    resolved = shafts.resolved_medium
    assert resolved is not None
    view, projection = np.asarray(camera.view_matrix, float), np.asarray(camera.projection_matrix, float)
    traced = [panes.Pane(one, 1 - a) for one, a in zip(glass, alphas, strict=True)]
    truth = panes.layer(view, projection, SIZE, solid, traced, punctual_lights([moved]), resolved).radiance
    clear = [panes.Pane(one.triangles, one.passed, dims=False) for one in traced]
    bright = panes.layer(view, projection, SIZE, solid, clear, punctual_lights([moved]), resolved).radiance
    wrong = np.sqrt(np.mean((layer - truth) ** 2)) / truth.mean()
    assert wrong < 0.015 < 0.1 < np.sqrt(np.mean((bright - truth) ** 2)) / truth.mean()


@pytest.mark.parametrize("sent", [pytest.param(SUN_BESIDE, id="sun"), pytest.param(LAMP, id="lamp", marks=pytest.mark.slow)])
def test_few_steps_are_as_dim_as_many_behind_windows(stage: Stage, sent: SceneLight) -> None:
    """Narrow windows with a pane each: of steps that share a look-up many a one lies in the dark, where nothing dims."""
    stage.camera = gfx.PerspectiveCamera(60, SIZE[0] / SIZE[1], depth_range=(0.1, 60))
    stage.scene = gfx.Scene()
    stage.scene.add(mesh(np.concatenate([square(40, 20, (0, 0, -9)), *(square(0.8, 9, (-4, 0, -k), 90) for k in range(10))]), color="#000"))
    for k in range(9):
        stage.scene.add(mesh(square(0.2, 9, (-4, 0, -k - 0.5), 90), color="#000", opacity=0.8, alpha_mode="blend"))
    beside = SceneLight(position=(-6.0, 0.5, -4.0), strength=30.0) if sent is LAMP else sent
    few, many = (stage.seen(shining(stage, beside, steps))[1].mean() for steps in (64, "exact"))
    assert few == pytest.approx(many, rel=0.08)  # of a look-up anywhere in a group: half as much again, and twice as much


def test_maps_of_what_dims_light_are_kept_until_it_changes(stage: Stage, monkeypatch: pytest.MonkeyPatch) -> None:
    stage.camera = gfx.PerspectiveCamera(60, SIZE[0] / SIZE[1], depth_range=(0.1, 60))
    stage.scene = gfx.Scene()
    stage.scene.add(mesh(square(40, 20, (0, 0, -9)), color="#000"))
    pane = mesh(square(3, 3, (-2.3, 1.5, -5), 90), color="#000", opacity=0.6, alpha_mode="blend")
    stage.scene.add(pane)
    drawn: list[int] = []
    draw = GlassMaps.draw_view
    monkeypatch.setattr(GlassMaps, "draw_view", lambda self, *args: (drawn.append(1), draw(self, *args))[1])
    shafts = shining(stage, SUN_BESIDE, 64)
    before = stage.seen(shafts)[1]
    drawn.clear()
    np.testing.assert_array_equal(stage.seen(shafts)[1], before)
    assert not drawn
    texture = gfx.Texture(np.full((4, 4, 4), 255, np.uint8), dim=2)

    def fade() -> None:
        pane.material.opacity = 0.2

    def move() -> None:
        pane.local.x = 0.4

    def bend() -> None:
        pane.geometry.positions.data[:, 1] -= 0.5
        pane.geometry.positions.update_range()

    def cover() -> None:
        pane.geometry.texcoords = gfx.Buffer(np.zeros((len(pane.geometry.positions.data), 2), np.float32))
        pane.material.map = gfx.TextureMap(texture)

    def repaint() -> None:
        texture.data[..., 3] = 100
        texture.update_full()

    def hide() -> None:
        pane.visible = False

    def tint() -> None:
        pane.geometry.colors = gfx.Buffer(np.tile(np.float32([[1, 1, 1, 0.3], [1, 1, 1, 1.0], [1, 1, 1, 0.7]]), (2, 1)))
        pane.material.map, pane.material.color_mode = None, "vertex"

    def of_faces() -> None:
        pane.material.color_mode = "face"

    for change in (fade, move, bend, cover, repaint, tint, of_faces, hide):
        change()
        stage.renderer.effect_passes = [shafts]
        found = stage.seen(shafts)[1]
        truth = stage.seen(shining(stage, SUN_BESIDE, 64))[1]
        np.testing.assert_array_equal(found, truth, change.__name__)
        assert change is cover or np.abs(found - before).max() > 1e-3 * before.max(), change.__name__
        before = found


def test_a_texture_that_is_drawn_into_is_never_taken_for_the_same(stage: Stage) -> None:
    pane = mesh(square(3, 3, (0, 0, -5)), color="#000", opacity=0.6, alpha_mode="blend")
    pane.geometry.texcoords = gfx.Buffer(np.zeros((len(pane.geometry.positions.data), 2), np.float32))
    maps = GlassMaps(shared_device())
    held, drawn = gfx.Texture(np.zeros((4, 4, 4), np.uint8), dim=2), gfx.Texture(dim=2, size=(4, 4, 1), format="rgba8unorm")
    for texture, same in ((held, True), (drawn, False)):
        pane.material.map = gfx.TextureMap(texture)
        first, second = (maps.contents([pane]) for _ in range(2))
        assert (first == second) == same


@pytest.mark.slow
def test_the_exact_walk_comes_to_an_end_on_short_segments() -> None:
    """Of foliage many lit segments are shorter than the digits of t tell apart; light that a pane dims is the same in steps."""
    stage = open_scene("foliage-beside")
    built = build(stage.settings)
    above = mesh(np.array([[[-30, 30, -30], [30, 30, -30], [30, 30, 30]], [[-30, 30, -30], [30, 30, 30], [-30, 30, 30]]], float))
    above.material.opacity, above.material.alpha_mode = 0.3, "blend"
    stage.scene.add(above)
    found = []
    for steps in ("exact", 512):
        more: Any = {"medium": built[Medium], "march": March(steps=steps, shadow_size=4096), "in_scene": SceneOptions(resolution=1.0)}
        layer = Studio(stage, Shot(240, 135, samples=1), built[Parameters], **more).frame(layer=True).layer
        assert layer is not None
        found.append(layer[..., :3].mean(axis=-1))
    np.testing.assert_allclose(found[0], found[1], rtol=0.06)


def test_what_is_left_behind_is_its_twin() -> None:
    surfaces = -np.sort(-RNG.uniform(0, 1, (200, 4)), axis=-1).astype(np.float32)
    passed = -np.sort(-RNG.uniform(0, 1, (200, 4)), axis=-1).astype(np.float32)
    depth = RNG.uniform(0, 1, 200).astype(np.float32)
    found = call("scatter/march/walk.wgsl", "left_behind", [depth, surfaces, passed])
    np.testing.assert_array_equal(found, panes.left_behind(depth, surfaces, passed))


def test_the_step_that_stands_for_the_lit_ones_is_its_twin() -> None:
    lit = RNG.uniform(size=(2048, 8)) < 0.5
    lit[:, 3] |= ~lit.any(axis=1)
    list = np.zeros(len(lit), np.uint32)
    for k in range(8):
        given = [list, np.full(len(lit), k, np.uint32)]
        found = call("scatter/march/steps.wgsl", "with_lit", given)
        np.testing.assert_array_equal(found, panes.with_lit(*given))
        list = np.where(lit[:, k], found, list).astype(np.uint32)
    count, part = lit.sum(axis=1).astype(np.float32), RNG.uniform(0, 0.999, len(lit)).astype(np.float32)
    chosen = call("scatter/march/steps.wgsl", "lit_step", [list, count, part])
    np.testing.assert_array_equal(chosen, panes.lit_step(list, count, part))
    assert lit[np.arange(len(lit)), chosen.astype(int)].all()
    as_often = [np.bincount(panes.lit_step(list[i], count[i], (np.arange(840) + 0.5) / 840).astype(int), minlength=8) for i in range(20)]
    np.testing.assert_allclose(as_often, lit[:20] * 840 / count[:20, None], atol=1)


@pytest.mark.parametrize("coloured", [True, False])
@pytest.mark.parametrize("sun", [True, False])
def test_few_steps_share_a_look_up(sun: bool, coloured: bool) -> None:
    n = np.arange(1, 129, dtype=np.float32)
    found = call("scatter/march/steps.wgsl", "dimmed_steps", [n], constants={"DIRECTIONAL": sun, "COLOURED": coloured})
    np.testing.assert_array_equal(found, panes.dimmed_steps(n, sun, coloured))


# ---------------------------------------------------------------- functions of shaders

SPAN = struct_dtype("scatter/march/profile.wgsl", "Span")


def spans(count: int = 200) -> np.ndarray:
    out = np.zeros(count, SPAN)
    ends = np.sort(RNG.uniform(0, 20, (count, 5)), axis=-1)
    out["knots"], out["reach"], out["count"] = ends[:, :4], ends[:, 4], RNG.integers(0, 9, count)
    return out


def test_knots_are_their_twins() -> None:
    span = spans()
    k, t = RNG.integers(0, 9, 200).astype(np.float32), RNG.uniform(0, 20, 200).astype(np.float32)
    own = span["knots"], span["count"]
    found = call("scatter/march/profile.wgsl", "knot_place", [span, k])
    np.testing.assert_allclose(found, profile.knot_place(*own, span["reach"], k), rtol=1e-5)
    before = profile.knot_before(*own, t)
    np.testing.assert_array_equal(call("scatter/march/profile.wgsl", "knot_before", [span, t]), before)
    assert set(before) >= {-1.0, 0.0, 3.0, 5.0}
    some = before >= 0
    assert (profile.knot_place(*own, span["reach"], np.maximum(before, 0)) <= t)[some].all()


def test_spans_are_unpacked_as_their_twin_does() -> None:
    span, packed = spans(), np.zeros(200, struct_dtype("scatter/march/profile.wgsl", "PackedSpan"))
    packed["knots"] = span["knots"].astype(np.float16).view(np.uint32)
    packed["count"], packed["reach"] = span["count"], span["reach"]
    found = call("scatter/march/profile.wgsl", "unpack_span", [packed])
    knots, count, reach = profile.unpack_span(packed)
    np.testing.assert_allclose(knots, span["knots"], rtol=1e-3)
    for one, name in ((knots, "knots"), (count, "count"), (reach, "reach")):
        np.testing.assert_array_equal(found[name], one)


@pytest.mark.parametrize("count", [1, 2, 3, 4])
def test_knots_lie_where_panes_do(count: int) -> None:
    t = np.sort(RNG.uniform(1, 20, (200, count)), axis=-1).astype(np.float32)
    ends, sums = t[:, [0, -1]], np.stack([t.sum(axis=-1), (t**2).sum(axis=-1)], axis=-1)
    found = profile.listed_knots(ends.astype(float), sums.astype(float), count)
    np.testing.assert_allclose(found[:, :count], t, atol=2e-2)  # of two that are close a root is ill conditioned
    assert np.median(np.abs(found[:, :count] - t)) < 1e-5
    shader = call("scatter/march/spans.wgsl", "listed_knots", [ends, sums, np.full(200, count, np.float32)])
    np.testing.assert_allclose(shader, found, atol=2e-2)


def test_what_lies_between_knots_is_its_twin() -> None:
    a, more = RNG.uniform(0, 1, (2, 200, 4)).astype(np.float32)
    b, share, sigma = a + more, RNG.uniform(0, 1, 200).astype(np.float32), np.array([0.5, 2.0, 0.0], np.float32)
    found = call("scatter/march/profile.wgsl", "between_knots", [a, b, share, sigma])
    np.testing.assert_allclose(found, profile.between_knots(a, b, share, sigma), rtol=2e-3)  # exactly even is as good as that


def test_knots_are_packed_as_their_twin_does() -> None:
    value = (RNG.uniform(0, 1, (200, 4)) * 10.0 ** RNG.uniform(-4, 5.5, (200, 1))).astype(np.float32)
    packed = call("scatter/march/profile.wgsl", "pack_knot", [value])
    held = profile.unpack_knot(profile.pack_knot(value))
    np.testing.assert_allclose(call("scatter/march/profile.wgsl", "unpack_knot", [packed]), held, rtol=1e-3)
    np.testing.assert_allclose(held, np.minimum(value, 65504), rtol=1e-3, atol=1e-7)


def test_it_is_exact_in_an_even_medium() -> None:
    ends = [np.append(light(np.full(3, t)), t) for t in (3.0, 9.0)]
    found = profile.between_knots(*ends, np.array([1 / 3]), np.full(3, SIGMA))
    np.testing.assert_allclose(found[0], np.append(light(np.full(3, 5.0)), 5.0))


CAMERAS = [gfx.PerspectiveCamera(50, 1.5, depth_range=(0.1, 90)), gfx.OrthographicCamera(9, 6, depth_range=(0, 90))]


@pytest.mark.parametrize("camera", CAMERAS)
def test_the_distance_of_a_depth_is_its_twin(camera: Any) -> None:
    uv, depth = RNG.uniform(0, 1, (200, 2)).astype(np.float32), RNG.uniform(0.1, 0.95, 200).astype(np.float32)
    (rays, is_flat), terms = eye_rays(camera.projection_matrix), depth_terms(camera.projection_matrix)
    found = call("scatter/march/profile.wgsl", "ray_distance", [uv, depth, rays, terms, is_flat])
    np.testing.assert_allclose(found, profile.ray_distance(uv, depth, rays, terms, is_flat), rtol=1e-3)
    ndc = np.column_stack([2 * uv[:, 0] - 1, 1 - 2 * uv[:, 1], depth, np.ones(200)])
    at = ndc @ np.linalg.inv(camera.projection_matrix).T
    at = at[:, :3] / at[:, 3:]
    np.testing.assert_allclose(profile.ray_distance(uv, depth, rays, terms, is_flat), -at[:, 2] if is_flat else np.linalg.norm(at, axis=1))
