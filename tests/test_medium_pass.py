"""A medium in pygfx's scenes: how the pass puts it on the picture, its units beside those of surfaces, and scenes from end to end."""

import dataclasses
import gc
from types import SimpleNamespace
from typing import Any

import msgspec
import numpy as np
import pytest
import wgpu

from airlight.composite.scene import measured_step
from airlight.options import Composite, Medium, Parameters, SceneOptions
from airlight.reference import scene as twin
from airlight.reference import tone as tone_twin
from airlight.scatter.methods import METHODS, of_medium

gfx = pytest.importorskip("pygfx")
from pass_stage import PassStage  # noqa: E402

from airlight.projection import pixel_rays  # noqa: E402
from airlight.pygfx import LightShafts, SceneLight  # noqa: E402
from airlight.pygfx.casters import Casters  # noqa: E402
from airlight.pygfx.punctual import punctual_lights  # noqa: E402

SIZE = (96, 54)
HALF = 1.0 / 1024  # a half float's rounding, and what the driver cuts off
MARCH, PLAIN = Parameters(method="march"), SceneOptions(view_transform="none", resolution=1.0)


class Stage(PassStage):
    """One renderer for all tests."""

    def __init__(self) -> None:
        super().__init__(SIZE)

    def reset(self) -> None:
        self.scene = gfx.Scene()
        self.scene.add(gfx.Background(None, gfx.BackgroundMaterial("#223355", "#557799")))
        box = gfx.Mesh(gfx.box_geometry(2, 1, 1), gfx.MeshBasicMaterial(color="#c86"))
        box.local.position = (0.3, -0.4, 0)
        self.sun = gfx.DirectionalLight(intensity=2)
        self.sun.local.position = (3, 5, 4)
        self.scene.add(box, self.sun)
        self.camera = gfx.PerspectiveCamera(50, SIZE[0] / SIZE[1], depth_range=(0.1, 50))
        self.camera.local.position = (0, 0, 5)

    def shafts(self, lights: Any = None, **keywords: Any) -> LightShafts:
        """A pass for the scene, the only one."""
        keywords = {"parameters": MARCH, "in_scene": PLAIN, **keywords}
        made = LightShafts(self.renderer, self.scene, self.camera, lights or SceneLight(self.sun), **keywords)
        self.renderer.effect_passes = [made]
        return made

    def frame(self, shafts: LightShafts) -> SimpleNamespace:
        """A frame: color and depth as the pass was given them, out as it wrote, layer; light and way of that."""
        self.draw()
        textures = self.renderer._blender._textures
        found = {name: self.read(textures[key]) for name, key in (("color", "color"), ("out", "altcolor"), ("depth", "depth"))}
        layer, transmittance = (self.read(texture).astype(np.float64) for texture in (shafts.layer, shafts.transmittance or shafts.layer))
        return SimpleNamespace(**found, light=layer[..., :3], way=layer[..., 3], transmittance=transmittance[..., :3])

    def read(self, texture: Any) -> np.ndarray:
        return self.texels(texture).squeeze()


class Known:
    """A method whose layer is known."""

    def __init__(self, device: Any, size: tuple[int, int]) -> None:
        rng = np.random.default_rng(5)
        layer = np.concatenate([rng.uniform(0, 2, (size[1], size[0], 3)), rng.uniform(1, 60, (size[1], size[0], 1))], axis=2)
        self.layer, self.transmittance = (device.texture(*size, "rgba32float") for _ in range(2))
        device.write(self.layer, layer.astype(np.float32), size[0] * 16)
        device.write(self.transmittance, rng.uniform(0, 1, layer.shape).astype(np.float32), size[0] * 16)
        self.update = self.record = lambda *_, **__: None
        self.resolve = lambda medium: medium


@pytest.fixture
def known(stage: Stage, monkeypatch: Any) -> Stage:
    monkeypatch.setitem(METHODS, "march", dataclasses.replace(METHODS["march"], plan_by=Known))
    return stage


@pytest.mark.parametrize("extinction", [True, False])
@pytest.mark.parametrize("mix", [None, 0.4])
@pytest.mark.parametrize("tone", ["none", "filmic"])
def test_the_merge_is_its_twin(known: Stage, extinction: bool, mix: float | None, tone: str) -> None:
    medium = Medium(extinction=extinction)
    seen = known.frame(known.shafts(medium=medium, composite=Composite(mix=mix), in_scene=SceneOptions(view_transform=tone)))
    transmittance = seen.transmittance if extinction else 1.0
    expected = twin.through_medium(seen.color[..., :3].astype(float), seen.light, transmittance, 1 if mix is None else mix)
    expected = tone_twin.filmic(expected) if tone == "filmic" else expected
    np.testing.assert_allclose(seen.out[..., :3], expected, rtol=4 * HALF, atol=1e-3)


def test_surfaces_are_dimmed_by_the_share_that_is_asked(known: Stage) -> None:
    seen = known.frame(known.shafts(medium=Medium(extinction_share=0.3)))
    transmittance = twin.share_of_dimming(seen.transmittance, 0.3)
    expected = twin.through_medium(seen.color[..., :3].astype(float), seen.light, transmittance)
    np.testing.assert_allclose(seen.out[..., :3], expected, rtol=4 * HALF, atol=1e-3)


def test_what_a_medium_lets_through_and_its_light_can_be_seen(known: Stage) -> None:
    shafts = known.shafts(in_scene=SceneOptions())
    shafts.debug = "occlusion"
    seen = known.frame(shafts)
    np.testing.assert_allclose(seen.out[..., :3], seen.transmittance, rtol=2 * HALF, atol=1e-3)
    shafts.debug = "source"
    np.testing.assert_allclose(known.frame(shafts).out[..., :3], seen.light, rtol=2 * HALF, atol=1e-6)
    shafts.debug = "lines"
    assert known.frame(shafts).out.shape[0] == SIZE[1]


def test_adaptation_measures_the_picture_with_its_medium(known: Stage) -> None:
    shafts = known.shafts(composite=Composite(adapt=1.0))
    seen = known.frame(shafts)
    y = twin.through_medium(seen.color[..., :3].astype(float), seen.light, seen.transmittance) @ np.array(twin.REC709)
    ramp, _ = twin.balance(y[:: measured_step(SIZE), :: measured_step(SIZE)])
    found = np.frombuffer(shafts.device.queue.read_buffer(shafts.levels), np.float32)[:2]
    np.testing.assert_allclose(found, [ramp.scale, ramp.white], rtol=1e-2)


@pytest.mark.parametrize("kind", ["standard", "phong"])
@pytest.mark.parametrize("lamp", ["sun", "point", "spot"])
def test_a_white_plate_reflects_what_the_conventions_say(known: Stage, kind: str, lamp: str) -> None:
    """Radiance irradiance / pi: lux of a sun, candela / d^2 of a lamp, for pygfx's own surfaces."""
    material = gfx.MeshStandardMaterial(roughness=1, metalness=0) if kind == "standard" else gfx.MeshPhongMaterial(specular="#000")
    plate = gfx.Mesh(gfx.plane_geometry(40, 40), material)
    made = {
        "sun": lambda: gfx.DirectionalLight(intensity=3),
        "point": lambda: gfx.PointLight(intensity=30, decay=2),
        "spot": lambda: gfx.SpotLight(intensity=30, decay=2, angle=0.8),
    }
    light = made[lamp]()
    light.local.position = (0, 0, 4)
    known.scene = gfx.Scene()
    known.scene.add(plate, light)
    seen = known.frame(known.shafts(SceneLight(light), medium=Medium(extinction=False), composite=Composite(mix=0)))
    (shining,) = punctual_lights([SceneLight(light)])
    centre = seen.color[SIZE[1] // 2, SIZE[0] // 2, :3]
    irradiance = shining.intensity[0] if lamp == "sun" else shining.intensity[0] / 4**2
    # the standard material also mirrors a little of a rough dielectric's 4 %
    assert centre == pytest.approx(irradiance / np.pi, rel=0.03 if kind == "standard" else 2e-3)
    assert np.array_equal(seen.out, seen.color), "no medium: bit for bit the picture"


def slab(stage: Stage) -> Any:
    """A white wall that a sun behind the camera faces, which fills the lower part of the picture; the sun."""
    wall = gfx.Mesh(gfx.plane_geometry(40, 20), gfx.MeshPhongMaterial(specular="#000"))
    wall.local.position = (0, -10, 0)
    sun = gfx.DirectionalLight(intensity=3)
    sun.local.position = (0, 0, 4)
    stage.scene = gfx.Scene()
    stage.scene.add(gfx.Background(None, gfx.BackgroundMaterial("#557799")), wall, sun)
    return sun


THIN = Medium(sigma_t=(0.05, 0.1, 0.2), albedo=(0.8, 0.8, 0.8), phase="isotropic", max_distance=12.0)


def test_wall_and_air_keep_the_ratio_of_the_equations(stage: Stage) -> None:
    sun = slab(stage)
    seen = stage.frame(stage.shafts(SceneLight(sun), medium=THIN))
    sigma_t, wall = np.array(THIN.sigma_t), seen.depth < 1
    assert 0.3 < wall.mean() < 0.7
    x, y = np.meshgrid((np.arange(SIZE[0]) + 0.5) / SIZE[0], (np.arange(SIZE[1]) + 0.5) / SIZE[1])
    ray = twin.view_ray(np.stack([x, y], axis=-1), pixel_rays(stage.camera.projection_matrix))
    length = np.linalg.norm(ray, axis=2)
    np.testing.assert_allclose(seen.way, np.where(wall, 5 * length, 12.0), rtol=1e-4)
    air = 0.8 * 3 / (4 * np.pi) * -np.expm1(-sigma_t * seen.way[..., None])
    np.testing.assert_allclose(seen.light, air, rtol=1e-4)
    np.testing.assert_allclose(seen.transmittance, np.exp(-sigma_t * seen.way[..., None]), rtol=1e-5)
    np.testing.assert_allclose(seen.color[wall][:, :3], 3 / np.pi, rtol=2e-3)
    out = np.exp(-sigma_t * seen.way[..., None]) * seen.color[..., :3] + air
    np.testing.assert_allclose(seen.out[..., :3], out, rtol=4 * HALF)


def test_the_surface_behind_is_dimmed_only_if_asked(stage: Stage) -> None:
    sun = slab(stage)
    shafts = stage.shafts(SceneLight(sun), medium=msgspec.structs.replace(THIN, extinction=False))
    seen = stage.frame(shafts)
    np.testing.assert_allclose(seen.out[..., :3], seen.color[..., :3] + seen.light, rtol=4 * HALF)
    shafts.medium = msgspec.structs.replace(THIN, albedo=(0, 0, 0))
    seen = stage.frame(shafts)
    assert not seen.light.any()
    left = np.exp(-np.array(THIN.sigma_t) * seen.way[..., None])
    np.testing.assert_allclose(seen.out[..., :3], left * seen.color[..., :3], rtol=4 * HALF)


@pytest.mark.parametrize("lights", [0, 1])
def test_an_empty_medium_is_bit_for_bit_the_picture(stage: Stage, lights: int) -> None:
    shafts = stage.shafts(medium=Medium(sigma_t=(0, 0, 0)), in_scene=PLAIN)
    shafts.lights = shafts.lights[:lights]
    seen = stage.frame(shafts)
    assert np.array_equal(seen.out, seen.color) and not seen.light.any() and np.ptp(seen.color) > 0.1


def test_lights_add_up(stage: Stage) -> None:
    lamp = gfx.PointLight(color="#48f", intensity=20, decay=2)
    lamp.local.position = (-1, 1, 1)
    stage.scene.add(lamp)
    both = [SceneLight(stage.sun, strength=0.5), SceneLight(lamp, anisotropy=-0.4)]
    found = [stage.frame(stage.shafts(lights, medium=THIN)).light for lights in (both[0], both[1], both)]
    assert all(one.max() > 0.01 for one in found)
    np.testing.assert_allclose(found[0] + found[1], found[2], rtol=1e-5, atol=1e-7)


def test_what_is_unset_follows_the_casters_which_are_gathered_once(stage: Stage, monkeypatch: Any) -> None:
    shafts, calls = stage.shafts(medium=Medium()), []
    stage.frame(shafts)
    gather = Casters.gather
    monkeypatch.setattr(Casters, "gather", lambda casters: calls.append(1) or gather(casters))
    stage.frame(shafts)
    assert len(calls) == 1
    assert shafts.resolved_medium.max_distance == pytest.approx(4 * np.sqrt(1 + 0.25 + 0.25))
    assert np.allclose(shafts.resolved_medium.sigma_t, 0.25 / np.sqrt(1.5))
    shafts.radius = 7.0
    stage.frame(shafts)
    assert len(calls) == 2 and shafts.resolved_medium.max_distance == 28


def test_methods_are_switched_live(stage: Stage) -> None:
    """Each shows again what it showed, and leaves nothing behind."""
    counts = wgpu.diagnostics.object_counts
    shafts = stage.shafts(medium=THIN)
    methods = [Parameters(method=name) for name in ("march", "epipolar", "article", "article-prose", "radial")]
    first: dict[str, np.ndarray] = {}
    held = []
    gc.collect()
    for _ in range(4):
        for shafts.parameters in methods:
            found = stage.frame(shafts).out
            assert np.array_equal(first.setdefault(shafts.parameters.method, found), found)
            assert (shafts.source is None) == (shafts.resolved_medium is not None) == (shafts.parameters.method in of_medium())
        gc.collect()
        held.append({name: counts.get_dict()[name]["count"] for name in ("Texture", "Buffer", "BindGroup")})
    assert all(held[3][name] <= held[1][name] for name in held[1])
    assert not np.array_equal(first["march"], first["epipolar"])


def test_the_passes_are_profiled(stage: Stage) -> None:
    shafts = stage.shafts(medium=THIN)
    shafts.timing = True
    stage.frame(shafts)
    stage.frame(shafts)
    times = dict(shafts.profile())
    assert {"shadows", "merge"} <= set(times) and any(label.startswith("march") for label in times)
    assert all(ms >= 0 for ms in times.values())
