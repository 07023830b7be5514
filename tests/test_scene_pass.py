"""Light shafts in pygfx's scenes: the pass beside its float64 twins, the image path, and what it promises."""

import gc
import weakref
from typing import Any

import numpy as np
import pytest

from airlight.composite.adapt import measure_ramp
from airlight.errors import AirlightError
from airlight.lights import Light
from airlight.options import Composite, Parameters, SceneOptions
from airlight.reference import scene as twin
from airlight.reference import tone as tone_twin
from airlight.scatter.render import PictureRenderer, plan, render_layer

gfx = pytest.importorskip("pygfx")
from pass_stage import PassStage  # noqa: E402

from airlight.projection import depth_terms, pixel_rays, project  # noqa: E402
from airlight.pygfx import LightShafts, SceneLight, add_light_shafts  # noqa: E402
from airlight.pygfx.private import is_hdr  # noqa: E402

SIZE = (192, 108)
PLAIN = SceneOptions(view_transform="none")
HALF = 1.0 / 1024  # a half float's rounding, and what the driver cuts off


def blocks(seed: int = 3) -> tuple[Any, Any, Any]:
    """A scene of boxes before a gradient, a camera, and a bright sphere that writes no depth."""
    rng = np.random.default_rng(seed)
    scene = gfx.Scene()
    scene.add(gfx.Background(None, gfx.BackgroundMaterial("#223355", "#557799")))
    for _ in range(12):
        box = gfx.Mesh(gfx.box_geometry(0.6, rng.uniform(0.5, 2.5), 0.6), gfx.MeshPhongMaterial(color=tuple(rng.uniform(0.2, 0.8, 3))))
        box.local.position = (rng.uniform(-4, 4), rng.uniform(-1.5, 1), rng.uniform(-3, 1))
        scene.add(box)
    sun = gfx.Mesh(gfx.sphere_geometry(0.6), gfx.MeshBasicMaterial(color=(4, 3.4, 2.4), depth_write=False))
    sun.local.position = (0.8, 1.3, -6)
    lamp = gfx.DirectionalLight(intensity=2)
    lamp.local.position = (3, 5, 4)
    scene.add(sun, gfx.AmbientLight(intensity=0.4), lamp)
    camera = gfx.PerspectiveCamera(50, SIZE[0] / SIZE[1], depth_range=(0.1, 200))
    camera.local.position = (0, 0.3, 8)
    camera.look_at((0, 0.2, 0))
    return scene, camera, sun


class Stage(PassStage):
    """One renderer for all tests; what each frame's pass was given and made, as arrays."""

    def __init__(self) -> None:
        super().__init__(SIZE)
        self.reset()

    def reset(self) -> None:
        self.scene, self.camera, self.sun = blocks()
        self.renderer.effect_passes = []
        self.canvas.set_logical_size(*SIZE)

    def shafts(self, lights: Any = None, **keywords: Any) -> LightShafts:
        """A pass for the scene, the only one."""
        made = LightShafts(self.renderer, self.scene, self.camera, lights or SceneLight(target=self.sun), **{"in_scene": PLAIN, **keywords})
        self.renderer.effect_passes = [made]
        return made

    def frame(self, shafts: LightShafts) -> dict[str, np.ndarray]:
        """A frame of a single pass: color and depth as it was given, out as it wrote; source, layer (H, W, 3)."""
        shafts.camera, shafts.scene = self.camera, self.scene
        self.draw()
        textures = self.renderer._blender._textures
        found = {name: self.read(textures[key]) for name, key in (("color", "color"), ("out", "altcolor"), ("depth", "depth"))}
        return {**found, "source": self.read(shafts.source), "layer": self.read(shafts.layer)}

    def read(self, texture: Any) -> np.ndarray:
        found = self.texels(texture)
        return found if found.dtype == np.uint8 else found[..., :3].squeeze().astype(np.float64)


def close(found: np.ndarray, expected: np.ndarray, relative: float = 2 * HALF, absolute: float = 1e-4) -> None:
    np.testing.assert_allclose(found, expected, rtol=relative, atol=absolute)


@pytest.mark.parametrize("resolution", [1.0, 0.5, 0.25])
@pytest.mark.parametrize("clear", [None, "#101010"])
def test_the_mask_is_its_twin(stage: Stage, resolution: float, clear: str | None) -> None:
    options = SceneOptions(view_transform="none", resolution=resolution, clear=clear)
    shafts = stage.shafts(SceneLight(target=stage.sun, emitter=False), in_scene=options)
    seen = stage.frame(shafts)
    linear = None if clear is None else np.full(3, ((0x10 / 255 + 0.055) / 1.055) ** 2.4)
    close(seen["source"], twin.source(seen["color"], seen["depth"], round(1 / resolution), linear))
    assert (seen["depth"] < 1).any() and seen["source"].max() > (2 if clear is None else 0.005)


def test_contrast_is_its_twin(stage: Stage) -> None:
    """Source, what was looked at, and the fog in the picture."""
    shafts = stage.shafts(in_scene=SceneOptions(view_transform="none", occluders="contrast"))
    seen = stage.frame(shafts)
    rays, terms = pixel_rays(stage.camera.projection_matrix), depth_terms(stage.camera.projection_matrix)
    x, y = np.meshgrid((np.arange(SIZE[0]) + 0.5) / SIZE[0], (np.arange(SIZE[1]) + 0.5) / SIZE[1])
    ray = twin.view_ray(np.stack([x, y], axis=-1), rays)
    distance = twin.axial(seen["depth"], terms) * np.linalg.norm(ray, axis=-1)
    mean, level, reach = twin.look(seen["color"], seen["depth"], distance)  # its step is 1 at this size
    looked = np.frombuffer(shafts.device.queue.read_buffer(shafts.statistics), np.float32)[:5]
    np.testing.assert_allclose(looked, [*mean, level, reach], rtol=2e-3)
    close(seen["source"], twin.source(seen["color"], seen["depth"], 2, mean=mean), absolute=1e-3)
    at = project(np.append(stage.sun.world.position, 1), stage.camera.view_matrix, stage.camera.projection_matrix)
    haze, cover = twin.fog(ray, distance, [(at.direction, at.fade, (1, 1, 1))], level, reach)
    veiled = np.where((seen["depth"] < 1)[..., None], seen["color"] + cover[..., None] * (haze - seen["color"]), seen["color"])
    assert cover[seen["depth"] < 1].max() > 0.5
    close(seen["out"], veiled + bilinear(seen["layer"]), relative=3e-3, absolute=3e-3)


def bilinear(layer: np.ndarray) -> np.ndarray:
    """A layer at the size of the picture."""
    from airlight.reference.radial import bilinear as sample
    from airlight.reference.radial import pixel_centres

    places = pixel_centres(*SIZE)
    return sample(layer, places[..., 0], places[..., 1])


@pytest.mark.parametrize("reach", [0.0, 5.0])
@pytest.mark.parametrize("tone", ["none", "filmic"])
def test_the_merge_is_its_twin(stage: Stage, reach: float, tone: str) -> None:
    seen = stage.frame(stage.shafts(in_scene=SceneOptions(view_transform=tone, depth_aware=reach), composite=Composite(mix=0.6)))
    added = 0.6 * bilinear(seen["layer"])
    if reach:
        rays, terms = pixel_rays(stage.camera.projection_matrix), depth_terms(stage.camera.projection_matrix)
        x, y = np.meshgrid((np.arange(SIZE[0]) + 0.5) / SIZE[0], (np.arange(SIZE[1]) + 0.5) / SIZE[1])
        distance = twin.axial(seen["depth"], terms) * np.linalg.norm(twin.view_ray(np.stack([x, y], -1), rays), axis=-1)
        added = np.where((seen["depth"] < 1)[..., None], twin.gathered(added, distance, reach), added)
    expected = seen["color"] + added
    # the driver filters with weights of 8 bits
    close(seen["out"], tone_twin.filmic(expected) if tone == "filmic" else expected, relative=4e-3, absolute=3e-3)
    assert np.ptp(added) > 0.1


def test_a_background_shaft_does_not_cover_what_is_near(stage: Stage) -> None:
    near = gfx.Mesh(gfx.box_geometry(0.4, 0.4, 0.1), gfx.MeshBasicMaterial(color="#222222"))
    near.local.position = (-0.3, 0.4, 6.5)
    stage.scene.add(near)
    plain = stage.frame(stage.shafts())
    cured = stage.frame(stage.shafts(in_scene=SceneOptions(view_transform="none", depth_aware=10.0)))
    terms = depth_terms(stage.camera.projection_matrix)
    at = twin.axial(plain["depth"], terms) < 2  # the box, 1.5 away
    over = [(seen["out"] - seen["color"])[at].mean() for seen in (plain, cured)]
    assert over[0] > 0.02 and over[1] < 0.2 * over[0]
    away = plain["depth"] == 1
    assert np.array_equal(plain["out"][away], cured["out"][away])


METHODS: list[dict[str, Any]] = [
    {"method": "epipolar"},
    {"method": "epipolar", "normalization": "listing", "weight": 0.8, "exposure": 0.05},
    {"method": "epipolar", "quality": "draft", "border": "black"},
    {"method": "radial", "samples": 40, "scale": 0.5},
    {"method": "bands"},
    {"method": "multipass"},
    {"method": "additive", "samples": 20},
]


@pytest.mark.parametrize("settings", METHODS)
def test_the_shafts_are_those_of_the_image_path(stage: Stage, settings: dict[str, Any]) -> None:
    """The same occlusion buffer, as a picture, at the same position of the light."""
    p = Parameters(**settings)
    shafts = stage.shafts(SceneLight(target=stage.sun, color=(1, 0.8, 0.5), strength=1.3), parameters=p)
    seen = stage.frame(shafts)
    at = project(np.append(stage.sun.world.position, 1), stage.camera.view_matrix, stage.camera.projection_matrix)
    source = seen["source"]
    if p.border == "black":
        assert not source[0].any() and not source[:, -1].any()
        source = source[1:-1, 1:-1]
    picture = np.ones((*source.shape[:2], 4), np.float32)
    picture[..., :3] = source
    flat = Parameters(**{**settings, "occlusion": "none", "scale": 1.0})
    layer = render_layer(PictureRenderer(shafts.device), picture, [Light(at.position, (1, 0.8, 0.5), 1.3)], flat)
    assert layer.max() > 0.1
    close(seen["layer"], layer)


def test_lights_add(stage: Stage) -> None:
    one, two = SceneLight(position=(-3, 1, -5), color=(1, 0.2, 0)), SceneLight(target=stage.sun, strength=0.5)
    layers = [stage.frame(stage.shafts(lights))["layer"] for lights in ([one], [two], [one, two])]
    close(layers[2], layers[0] + layers[1], absolute=2e-3)
    assert min(layer.max() for layer in layers) > 0.1


def test_a_turning_camera_takes_nothing_new_and_follows(stage: Stage, monkeypatch: Any) -> None:
    """20 frames after a first turn create nothing; each frame's layer is that of a plan made for it; out of view, none is left."""
    shafts = stage.shafts([SceneLight(target=stage.sun), SceneLight(direction=(0.3, 0.6, -1), color=(0.2, 0.3, 1))])
    made: list[str] = []
    inside = False
    device = stage.renderer.device

    def counted(name: str, original: Any) -> Any:
        def call(*args: Any, **keywords: Any) -> Any:
            if inside:
                made.append(name)
            return original(*args, **keywords)

        return call

    for name in [n for n in dir(device) if n.startswith("create_")]:
        monkeypatch.setattr(device, name, counted(name, getattr(device, name)), raising=False)
    record = shafts.render

    def watched(*args: Any) -> None:
        nonlocal inside
        inside = True
        record(*args)
        inside = False

    monkeypatch.setattr(shafts, "render", watched)

    def turned(i: int) -> dict[str, np.ndarray]:
        stage.camera.local.euler_y = np.deg2rad(i * 9.0)
        return stage.frame(shafts)

    layers = [turned(i)["layer"] for i in range(20)]
    assert made
    made.clear()
    again = [turned(i) for i in range(20)]
    assert made == []
    assert all(np.array_equal(a, b["layer"]) for a, b in zip(layers, again, strict=True))
    assert layers[0].max() > 0.1 and layers[4].max() > 0.01 and not layers[15].any()
    for i in (1, 4):
        turned(i)
        lights = []
        for light in shafts.lights:
            at = project(light.homogeneous(), stage.camera.view_matrix, stage.camera.projection_matrix)
            lights.append(Light(at.position, light.color, light.strength * at.fade))
        size = shafts.layer.size[:2]
        plans, layer = plan(shafts.device, size, lights, shafts.parameters, shafts.source)
        encoder = shafts.device.encoder()
        for step in plans:
            step.record(encoder)
        shafts.device.submit(encoder)
        close(stage.read(layer), layers[i])


def recorded(stage: Stage, shafts: LightShafts) -> list[str]:
    """The passes that a frame records."""
    begun: list[str] = []

    class Watched:
        def __init__(self, encoder: Any) -> None:
            self.encoder = encoder

        def __getattr__(self, name: str) -> Any:
            if name.startswith("begin_"):
                begun.append(name)
            return getattr(self.encoder, name)

    render = shafts.render
    shafts.render = lambda encoder, *views: render(Watched(encoder), *views)
    stage.draw()
    del shafts.render
    return begun


@pytest.mark.parametrize("hdr", [True, False])
def test_a_light_behind_leaves_the_picture(stage: Stage, hdr: bool) -> None:
    """Bit for bit, also where the picture is kept in 8 bits; and the layer does not go on holding shafts."""
    infos = stage.renderer._blender._texture_info
    before = {name: infos[name]["format"] for name in ("color", "altcolor")}
    if not hdr:
        for name in before:
            infos[name]["format"] = "rgba8unorm-srgb"
        stage.renderer._blender._textures.clear()
    try:
        assert is_hdr(stage.renderer) == hdr
        shafts = stage.shafts()
        lit = stage.frame(shafts)
        assert np.abs(lit["out"].astype(float) - lit["color"]).max() > (0.1 if hdr else 20)
        stage.camera.local.euler_y = np.pi
        seen = stage.frame(shafts)
        assert np.array_equal(seen["out"], seen["color"]) and not seen["layer"].any()
        assert recorded(stage, shafts) == ["begin_render_pass"]  # the merge
        stage.camera.local.euler_y = 0
        assert len(recorded(stage, shafts)) >= 3  # source, sum, merge
    finally:
        for name, format in before.items():
            infos[name]["format"] = format
        stage.renderer._blender._textures.clear()


def test_disabled_costs_nothing(stage: Stage, monkeypatch: Any) -> None:
    stage.renderer.effect_passes = []
    without = stage.draw()
    shafts = stage.shafts()
    assert not np.array_equal(stage.draw(), without)
    recorded = []
    monkeypatch.setattr(shafts, "render", lambda *args: recorded.append(args))
    shafts.enabled = False
    assert np.array_equal(stage.draw(), without) and not recorded


def test_it_follows_the_size(stage: Stage) -> None:
    shafts = stage.shafts()
    stage.draw()
    old = [weakref.ref(texture) for texture in (shafts.source, shafts.layer)]
    stage.canvas.set_logical_size(130, 90)
    seen = stage.frame(shafts)
    assert seen["source"].shape == (45, 65, 3) and seen["layer"].max() > 0.1
    shafts.in_scene = SceneOptions(resolution=1.0)
    assert stage.frame(shafts)["layer"].shape == (90, 130, 3)
    gc.collect()
    assert [texture() for texture in old] == [None, None]


def test_other_passes_keep_working(stage: Stage) -> None:
    """The user's own, before and after; added as a user does, it stands before the anti-aliasing."""
    passes = gfx.renderers.wgpu
    noise, fog, bloom, smooth = passes.NoisePass(), passes.FogPass("#88aaff", 40), passes.PhysicalBasedBloomPass(), passes.DDAAPass()
    stage.renderer.effect_passes = [bloom, fog, smooth]
    shafts = add_light_shafts(stage.renderer, stage.scene, stage.camera, SceneLight(target=stage.sun))
    assert list(stage.renderer.effect_passes) == [bloom, fog, shafts, smooth]
    stage.renderer.effect_passes = [*stage.renderer.effect_passes, noise]
    noise.noise = 0.0
    whole = stage.draw().astype(int)
    for step, least in ((shafts, 3.0), (bloom, 0.05), (fog, 0.05)):
        step.enabled = False
        assert np.abs(stage.draw().astype(int) - whole).mean() > least
        step.enabled = True


def test_an_instance_for_each_place(stage: Stage) -> None:
    shafts = stage.shafts()
    stage.renderer.effect_passes = [shafts, shafts]
    with pytest.raises(AirlightError, match="twice"):
        stage.draw()
    stage.renderer.effect_passes = [shafts]
    stage.draw()


def plain(level: float) -> Any:
    """A scene of flat colours, all times a level, and its sun."""

    def color(*rgb: float) -> Any:
        return gfx.Color.from_physical(*(level * c for c in rgb))

    scene = gfx.Scene()
    scene.add(gfx.Background(None, gfx.BackgroundMaterial(color(0.2, 0.3, 0.5))))
    rng = np.random.default_rng(8)
    for _ in range(20):
        box = gfx.Mesh(gfx.box_geometry(0.7, 0.9, 0.6), gfx.MeshBasicMaterial(color=color(*rng.uniform(0.02, 0.5, 3))))
        box.local.position = (rng.uniform(-5, 5), rng.uniform(-3, 3), rng.uniform(-3, 1))
        scene.add(box)
    sun = gfx.Mesh(gfx.sphere_geometry(0.5), gfx.MeshBasicMaterial(color=color(4, 3.5, 3), depth_write=False))
    sun.local.position = (0.8, 1.3, -6)
    scene.add(sun)
    return scene, sun


def test_adaptation_keeps_the_level(stage: Stage) -> None:
    means, plain_means, clipped = [], [], []
    for level in (1 / 16, 1 / 4, 1, 4, 16):
        stage.scene, sun = plain(level)
        shafts = stage.shafts(SceneLight(target=sun), composite=Composite(adapt=1.0), in_scene=SceneOptions())
        seen = stage.frame(shafts)
        means.append(seen["out"].mean())
        lit = (seen["color"] + bilinear(seen["layer"])) @ np.array([0.2126, 0.7152, 0.0722])
        ramp, _ = twin.balance(lit)
        found = np.frombuffer(shafts.device.queue.read_buffer(shafts.levels), np.float32)[:2]
        np.testing.assert_allclose(found, [ramp.scale, ramp.white], rtol=0.02)
        exact = measure_ramp(lit.astype(np.float32))
        np.testing.assert_allclose([ramp.scale, ramp.white], [exact.scale, exact.white], rtol=0.1)
        gain = ramp.gain(lit.astype(np.float32))[..., None]
        clipped.append(np.abs(seen["out"] - tone_twin.filmic((seen["color"] + bilinear(seen["layer"])) * gain)).mean())
        shafts.composite = Composite()
        plain_means.append(stage.frame(shafts)["out"].mean())
    assert max(means) <= 1.1 * min(means) and 0.05 < min(means) < 0.6
    assert max(plain_means) > 3 * min(plain_means) and max(clipped) < 0.01


def test_adaptation_follows_in_time(stage: Stage) -> None:
    shafts = stage.shafts(composite=Composite(adapt=1.0), in_scene=SceneOptions(adapt_seconds=0.5))
    luminances, states = [], []
    for level, dt in ((1.0, 0.1), (8.0, 0.1), (8.0, 0.2), (8.0, 0.0)):
        stage.scene, shafts.lights[0].target = plain(level)
        shafts.dt = dt
        seen = stage.frame(shafts)
        luminances.append((seen["color"] + bilinear(seen["layer"])) @ np.array([0.2126, 0.7152, 0.0722]))
        states.append(np.frombuffer(shafts.device.queue.read_buffer(shafts.levels), np.float32)[2:5].astype(float))
    expected = None
    for values, share, state in zip(luminances, (1.0, 1 - np.exp(-0.2), 1 - np.exp(-0.4), 1.0), states, strict=True):
        _, expected = twin.balance(values, expected, share)
        np.testing.assert_allclose(state, expected, atol=0.03)
    assert states[1][0] - states[0][0] == pytest.approx(3 * (1 - np.exp(-0.2)), abs=0.1)  # eight times as bright: three stops


def test_the_profile_names_each_pass(stage: Stage) -> None:
    """On a device that measures times; the tests' own may have been made without, by an earlier test."""
    shafts = stage.shafts(composite=Composite(adapt=0.5), in_scene=SceneOptions(occluders="contrast"))
    assert shafts.profile() == []
    shafts.timing = True
    for _ in range(40):  # without asking: nothing piles up
        stage.draw()
    names = [label for label, ms in shafts.profile() if ms >= 0]
    if shafts.device.timestamps:
        assert names[:2] == ["look", "mask"] and names[3:] == ["adapt", "merge"]  # between them the sum, of one pass at this size
    else:
        assert names == []


def test_a_lamp_that_writes_depth_or_hangs_before_a_wall_emits(stage: Stage) -> None:
    wall = gfx.Mesh(gfx.plane_geometry(60, 60), gfx.MeshBasicMaterial(color="#446644"))
    wall.local.position = (0, 0, -12)
    stage.scene.add(wall)
    totals = {}
    for writes, emitter in ((True, True), (False, True), (True, False)):
        stage.sun.material.depth_write = writes
        stage.sun.render_order = 1  # after the wall
        totals[writes, emitter] = stage.frame(stage.shafts(SceneLight(target=stage.sun, emitter=emitter)))["source"].sum()
    assert totals[True, False] == 0
    assert totals[True, True] > 100 and totals[False, True] == pytest.approx(totals[True, True], rel=0.1)


def test_a_disc_where_nothing_hides_it(stage: Stage) -> None:
    stage.scene.remove(stage.sun)
    size, direction = 4.0, (0.05, 0.12, -1)
    options = SceneOptions(view_transform="none", clear="#000000")
    shafts = stage.shafts(SceneLight(direction=direction, disc_half_angle=size), in_scene=options)
    seen = stage.frame(shafts)["source"]
    rays = pixel_rays(stage.camera.projection_matrix)
    x, y = np.meshgrid((np.arange(96) + 0.5) / 96, (np.arange(54) + 0.5) / 54)
    ray = twin.view_ray(np.stack([x, y], -1), rays)
    to = project((*direction, 0), stage.camera.view_matrix, stage.camera.projection_matrix).direction
    angle = np.rad2deg(np.arccos(np.clip(ray @ to / np.linalg.norm(ray, axis=-1), -1, 1)))
    assert not seen[angle > size + 1].any() and seen.max() == 1.0
    inside = seen[angle < size - 1]
    assert ((inside == 1) | (inside < 1)).all() and 0 < (inside == 1).mean() < 1  # a box hides a part of it


def test_bad_pixels_spoil_nothing_else(stage: Stage) -> None:
    """A scene's NaN and infinity reach neither source nor layer."""
    bad = gfx.Mesh(gfx.plane_geometry(0.5, 0.5), gfx.MeshBasicMaterial(color=gfx.Color(np.inf, 0.3, 0.2), depth_write=False))
    bad.local.position = (-1, 2.2, -1)
    stage.scene.add(bad)
    seen = stage.frame(stage.shafts())
    assert not np.isfinite(seen["color"]).all()
    assert np.isfinite(seen["source"]).all() and np.isfinite(seen["layer"]).all()


def test_a_light_is_said_once(stage: Stage) -> None:
    for bad in ({}, {"position": (0, 0, 0), "direction": (0, 1, 0)}, {"direction": (0, 0, 0)}, {"position": (0, np.nan, 0)}):
        with pytest.raises(AirlightError, match="SceneLight"):
            SceneLight(**bad)
    for bad in ({"disc_half_angle": 90}, {"color": (1, -1, 0)}, {"strength": np.inf}, {"target": "sun"}):
        with pytest.raises(AirlightError):
            SceneLight(**{"position": (0, 0, 0), **bad} if "target" not in bad else bad)
    shafts = stage.shafts([SceneLight(direction=(0, 0, -1))] * 9)
    with pytest.raises(AirlightError, match="at most 8"):
        stage.draw()
    with pytest.raises(AirlightError, match="density"):
        shafts.parameters = Parameters(method="bands", density=2.0)
    sun = gfx.DirectionalLight()
    sun.local.position = (1, 2, 3)
    sun.target.local.position = (0, 1, 0)
    assert SceneLight(target=sun).homogeneous().tolist() == [1, 1, 3, 0]


def test_a_view_transform_that_is_none_is_refused_when_it_is_set(stage: Stage) -> None:
    """Not in each frame, where pygfx would log it and go on."""
    with pytest.raises(AirlightError, match=r"'filmik' is no view transform; did you mean 'filmic.\?; there is none, filmic, agx"):
        stage.shafts(in_scene=SceneOptions(view_transform="filmik"))
    shafts = stage.shafts(in_scene=PLAIN)
    with pytest.raises(AirlightError, match="view transform"):
        shafts.in_scene = SceneOptions(view_transform="filmik")
    assert shafts.in_scene is PLAIN
    shafts.in_scene = SceneOptions(view_transform="un-tone-mapped")  # a view of OpenColorIO's own config
