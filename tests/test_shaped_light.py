"""Light with a shape in scenes: projectors and cookies, against the tracer, which shares nothing with the shaders, and on surfaces."""

import dataclasses
import math
from typing import Any

import numpy as np
import pytest

from airlight.compare import rule
from airlight.errors import AirlightError, AirlightWarning
from airlight.jobs.cookies import MOST, read_cookie
from airlight.jobs.projector_text import make_projector, read_projector
from airlight.lights.shape import Cookie, axes_along
from airlight.options import March, Medium, Parameters, SceneOptions, build
from airlight.projection import eye_rays
from airlight.reference import tracer

gfx = pytest.importorskip("pygfx")
import turned_stage  # noqa: E402

from airlight.pygfx import SceneLight  # noqa: E402
from airlight.pygfx.projector import Projector  # noqa: E402
from airlight.pygfx.punctual import punctual_lights  # noqa: E402
from airlight.scenes import open_scene  # noqa: E402
from airlight.scenes.offline import Shot, Studio  # noqa: E402
from airlight.scenes.triangles import world_triangles  # noqa: E402

RNG = np.random.default_rng(193)
COOKIE = Cookie(RNG.uniform(size=(12, 16, 3)).astype(np.float32) ** 2, size=6.0)  # its pixels are wider than the picture's
SIZE = (64, 36)


def staged(kind: str, cookie: Cookie | None = COOKIE) -> Any:
    """A room with a spot, a sun through a window, or a projector where the spot is."""
    stage = open_scene("window" if kind == "sun" else "slats")
    if kind == "projector":
        spot = stage.lights[0].target
        frustum: Any = {"up": (0.2, 1, 0.1), "fov": (40, 25), "near": 0.2, "far": 7.0, "clip": [(0, 1, 0, -0.3)]}
        lamp = Projector(intensity=300.0, falloff="inverse", cookie=cookie, **frustum)
        lamp.local.position, lamp.target.local.position = spot.world.position, spot.target.world.position
        stage.scene.add(lamp)
        stage.lights = [SceneLight(lamp)]
    else:
        stage.lights = [dataclasses.replace(light, cookie=cookie) for light in stage.lights]
    return stage


def layer(stage: Any, **values: Any) -> tuple[Any, Any, Any]:
    """The layer of a stage, (H, W, 4), what filmed it, and how long the rays are."""
    built = build(stage.settings | {"method": "march", "quality": "final"} | values)
    studio = Studio(stage, Shot(*SIZE, samples=1), built[Parameters], medium=built[Medium], march=built[March])
    found = studio.frame(layer=True).layer
    assert found is not None
    return found[..., :3].astype(float), studio, found[..., 3]


def traced(stage: Any, studio: Any) -> Any:
    view, projection = (np.asarray(m, float) for m in (studio.camera.view_matrix, studio.camera.projection_matrix))
    medium, lights = studio.shafts.resolved_medium, punctual_lights(stage.lights, studio.exposure.pre)
    seen, casting = world_triangles(stage.scene)
    return tracer.layer(view, projection, SIZE, seen, lights, medium, casting).radiance


@pytest.mark.parametrize(
    ("kind", "fog"),
    [("projector", "none")]
    + [pytest.param("spot", "none", marks=pytest.mark.slow)]
    + [pytest.param("sun", fog, marks=pytest.mark.slow) for fog in ("none", "exponential")]
    + [pytest.param("projector", "exponential", marks=pytest.mark.slow)],
)
def test_the_air_has_the_shape_of_its_light(kind: str, fog: str) -> None:
    stage = staged(kind)
    exact, studio, length = layer(stage, fog=fog)
    truth = traced(stage, studio)
    errors = rule.errors(exact, truth, rule.clear(length))
    assert errors.rmse < 0.01 and abs(errors.bias) < 0.005
    few = rule.errors(layer(stage, fog=fog, steps=256)[0], truth, rule.clear(length))
    assert few.rmse < 0.12 and abs(few.bias) < 0.01
    plain, _, _ = layer(staged(kind, None), fog=fog)
    assert rule.errors(plain, truth, rule.clear(length)).rmse > 0.3  # by which the cookie is seen


@pytest.mark.parametrize("kind", [*(pytest.param(one, marks=pytest.mark.slow) for one in ("spot", "sun")), "projector"])
@pytest.mark.parametrize("steps", [pytest.param("exact", marks=pytest.mark.slow), 16])
def test_a_white_cookie_is_none(kind: str, steps: Any) -> None:
    white = Cookie(np.ones((5, 7, 3), np.float32))
    np.testing.assert_array_equal(layer(staged(kind, white), steps=steps)[0], layer(staged(kind, None), steps=steps)[0])


def test_surfaces_have_the_shape_of_the_light_that_falls_on_them() -> None:
    """A white wall before a projector: its picture is there, upright and as seen from the lamp, as bright as cosine and falloff say."""
    wall = gfx.Mesh(gfx.plane_geometry(20, 20), gfx.MeshStandardMaterial(color="#fff", roughness=1, metalness=0))
    lamp = Projector(intensity=40.0, fov=(60, 40), near=0.1, falloff="constant", ambient=0.5, cookie=COOKIE)
    stage = open_scene("slats")
    stage.scene = gfx.Scene()
    lamp.local.position, lamp.target.local.position, wall.local.position = (0, 0, 0), (0, 0, -4), (0, 0, -4)
    wall.cast_shadow = True  # what is of no lamp here, which has a shape and casts none
    stage.scene.add(wall, lamp, gfx.Background(None, gfx.BackgroundMaterial("#000")))
    camera = gfx.PerspectiveCamera(60, 16 / 9, depth_range=(0.1, 50))
    stage.lights, stage.cameras, stage.pose = [SceneLight(lamp)], {"front": camera}, lambda t, c: None
    built = build({"method": "march", "quality": "draft", "sigma_t": (1e-6, 1e-6, 1e-6), "view_transform": "none"})
    more: Any = {"in_scene": built[SceneOptions], "medium": built[Medium], "march": built[March]}
    studio = Studio(stage, Shot(96, 54, samples=1), built[Parameters], **more)
    seen = studio.frame().picture[..., :3].astype(float)
    # Each pixel's place on the wall
    (a, b, c, d), _ = eye_rays(np.asarray(studio.camera.projection_matrix, float))
    u, v = np.meshgrid((np.arange(96) + 0.5) / 96, (np.arange(54) + 0.5) / 54)
    points = 4 * np.stack([a * u + c, b * v + d, np.full_like(u, -1.0)], axis=-1)
    (light,) = punctual_lights(stage.lights)
    toward, _, irradiance = light.incident(points)
    truth = (np.array(light.intensity) * irradiance[..., None] * light.colour(points) * toward[..., 2:]) / math.pi
    scale = (seen * truth).sum() / (truth * truth).sum()
    inside = (irradiance > 0) & (np.roll(irradiance, 1, 0) > 0) & (np.roll(irradiance, -1, 0) > 0) & (np.roll(irradiance, 1, 1) > 0)
    inside &= np.roll(irradiance, -1, 1) > 0
    assert 0.3 < inside.mean() < 0.9
    np.testing.assert_allclose(seen[inside], scale * truth[inside], atol=0.04 * scale * truth.max())
    dark = (irradiance == 0) & (np.roll(irradiance, 1, 0) == 0) & (np.roll(irradiance, -1, 0) == 0) & (np.roll(irradiance, 1, 1) == 0)
    assert np.abs(seen[dark & (np.roll(irradiance, -1, 1) == 0)]).max() < 1e-3 * seen.max()


@pytest.mark.parametrize(
    ("kind", "steps"),
    [("projector", 16)]
    + [pytest.param(kind, steps, marks=pytest.mark.slow) for steps in ("exact", 16) for kind in ("spot", "point", "projector")][:5],
)
def test_turning_all_together_changes_nothing(kind: str, steps: Any) -> None:
    """Projector, spot or lamp, scene and camera, about an axis of no importance, and moved."""
    shape = turned_stage.SHAPES[kind]
    here, there = (
        layer(turned_stage.turned_stage(kind, *where, shape=shape), steps=steps, shadow_size=512)[0]
        for where in (turned_stage.STILL, turned_stage.MOVED)
    )
    off = np.abs(there - here).max(axis=2) / here.mean()
    # Photometry is looked up in a texture, whose filter has 8 bits; an edge of the bar's shadow may pass the border of a texel
    assert here.mean() > 0.002 and np.quantile(off, 0.99) < (1e-3 if kind == "point" else 2e-5)
    assert off.max() < (0.05 if kind == "projector" else 5e-3)


@pytest.mark.slow
@pytest.mark.parametrize("steps", ["exact", 16])
def test_a_photometry_that_is_even_is_a_point(steps: Any) -> None:
    even, none = (layer(turned_stage.turned_stage("point", shape=shape), steps=steps)[0] for shape in (turned_stage.EVEN, None))
    np.testing.assert_array_equal(even, none)


def test_a_shape_is_turned_in_the_axes_that_its_light_will_have() -> None:
    """pygfx turns a spot to its target as it draws: before that and after it the shape is the same."""
    stage = turned_stage.turned_stage("spot", shape=COOKIE)
    (before,) = punctual_lights(stage.lights)
    stage.lights[0].target.look_at(turned_stage.TARGET)
    (after,) = punctual_lights(stage.lights)
    np.testing.assert_allclose(before.axes(), axes_along(turned_stage.TARGET - turned_stage.AT, turned_stage.UP), atol=1e-6)
    np.testing.assert_allclose(after.axes(), before.axes(), atol=1e-6)


# ---------------------------------------------------------------- as written


def test_a_projector_is_read_as_written() -> None:
    at, known = read_projector("1,2,3;target=1,2,0;fov=40,30;near=0.5;far=9;falloff=inverse;clip=0,1,0,-1;clip=1,0,0,2;intensity=10,20,5")
    assert at == (1, 2, 3) and known["clip"] == ((0, 1, 0, -1), (1, 0, 0, 2)) and known["fov"] == (40, 30)
    lamp = make_projector("1,2,3;target=1,2,0;intensity=10,20,5")
    (light,) = punctual_lights([SceneLight(lamp)])
    np.testing.assert_allclose(light.intensity, (10, 20, 5), rtol=1e-5)
    np.testing.assert_allclose(light.axes(), [[1, 0, 0], [0, 1, 0], [0, 0, -1]], atol=1e-9)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("1,2", "write x,y,z"),
        ("1,2,3;fov=0,30", "fov is 0,30"),
        ("1,2,3;fov=40,180", "give numbers of 0.001 to 179, h,v"),
        ("1,2,3;near=2;far=1", "far=1 .* is not beyond near=2"),
        ("1,2,3;target=1,2,3", "its own position"),
        ("1,2,3;target=1,0,3;up=0,1,0", "lies along its light"),
        ("1,2,3;up=0,0,0", "lies along its light, or is 0"),
        ("1,2,3;falloff=cubic", "use inverse-square, inverse, constant"),
        ("1,2,3;clip=0,0,0,1", "has no direction"),
        ("1,2,3" + ";clip=0,1,0,1" * 7, "more than 6 clip planes"),
        ("1,2,3;clip=1e-300,0,0,1", "is more than 1e.09 m away"),
        ("1,2,3;target=1e300,0,0", "target is 1e300,0,0"),
        ("1,2,3;cookie=", "cookie has no value .*: give a file, cookie=FILE"),
        ("1,2,3;fov", "fov has no value .*: give fov=h,v, numbers"),
        ("1,2,3;falloff=", "give one of inverse-square, inverse"),
        ("1,2,3;foo=1", "cannot read 'foo=1'"),
        ("1,2,3;intensity=-1,0,0", "intensity is -1,0,0"),
    ],
)
def test_what_a_projector_cannot_be_is_told(text: str, told: str) -> None:
    with pytest.raises(AirlightError, match=told):
        read_projector(text)


def test_an_up_of_any_length_is_one() -> None:
    for up in ("1e300,1e300,0", "0,1e-300,0"):
        assert read_projector(f"1,2,3;up={up}")[1]["up"] == tuple(float(v) for v in up.split(","))


def test_cookies_of_files(tmp_path: Any) -> None:
    from PIL import Image

    from airlight.colour import srgb_decode

    codes = RNG.integers(0, 256, (3, 4, 4), dtype=np.uint8)
    Image.fromarray(codes).save(tmp_path / "gobo.png")
    found = read_cookie(str(tmp_path / "gobo.png")).pixels
    np.testing.assert_allclose(found, srgb_decode(codes[..., :3] / 255) * codes[..., 3:] / 255, atol=1e-5)
    Image.new("RGB", (MOST + 1000, 2), "white").save(tmp_path / "wide.png")
    with pytest.warns(AirlightWarning, match="averaged to"):
        assert read_cookie(str(tmp_path / "wide.png")).pixels.shape == (1, (MOST + 1000) // 2, 3)
    with pytest.raises(AirlightError, match="none"):
        read_cookie(str(tmp_path / "none.png"))
