"""Method auto: lights in the view with shadows from the picture, all others by march, and what passes between as the camera turns."""

import warnings
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from airlight.cli import main
from airlight.errors import AirlightWarning
from airlight.files import read_image
from airlight.options import March, Medium, Parameters, SceneOptions, settled_method

gfx = pytest.importorskip("pygfx")
from pass_stage import PassStage  # noqa: E402

from airlight.pygfx import LightShafts, SceneLight, seen_lights  # noqa: E402
from airlight.pygfx.seen_lights import share_of  # noqa: E402

SIZE, FULL = (192, 108), SceneOptions(view_transform="none", resolution=1.0)
AIR = {"sigma_t": (0.04, 0.04, 0.04), "albedo": (0.9, 0.9, 0.9), "max_distance": 40.0}
HEIGHT = np.radians(9)  # of the sun
SLATS = Path(__file__).parents[1] / "src/airlight/data/scenes/validation/slats.glb"


def box(place: Sequence[float], *size: float) -> Any:
    made = gfx.Mesh(gfx.box_geometry(*size), gfx.MeshBasicMaterial(color="#333"))
    made.local.position = place
    return made


class Stage(PassStage):
    """A ring of pillars on the ground around the camera, and a sun between two of them, ahead."""

    def __init__(self) -> None:
        super().__init__(SIZE)

    def reset(self) -> None:
        self.scene = gfx.Scene().add(gfx.Background(None, gfx.BackgroundMaterial("#223355")), box((0, -1.2, 0), 60, 0.1, 60))
        for turn in np.radians(np.arange(7.5, 360, 15)):
            self.scene.add(box((8 * np.sin(turn), 2, -8 * np.cos(turn)), 0.8, 6, 0.8))
        self.sun = gfx.DirectionalLight(intensity=3)
        self.sun.local.position = (0, np.sin(HEIGHT), -np.cos(HEIGHT))
        self.scene.add(self.sun)
        self.camera = gfx.PerspectiveCamera(30, SIZE[0] / SIZE[1], depth_range=(0.1, 200))
        self.look(0)

    def look(self, degrees: float) -> None:
        self.camera.look_at((np.sin(np.radians(degrees)), 0.1, -np.cos(np.radians(degrees))))

    def shafts(self, method: str = "auto", lights: Any = None, march: March | None = None, **medium: Any) -> LightShafts:
        own: dict[str, Any] = {"medium": Medium(**AIR | medium), "march": march or March(shadow_size=1024)}
        made = LightShafts(
            self.renderer, self.scene, self.camera, lights or SceneLight(self.sun), Parameters(method=method), in_scene=FULL, **own
        )
        self.renderer.effect_passes = [made]
        made.timing = True
        return made

    def layer(self, shafts: LightShafts) -> np.ndarray:
        self.draw()
        return np.array(self.texels(shafts.layer)[..., :3], float)

    def exact(self, lights: Any = None, **medium: Any) -> np.ndarray:
        return self.layer(self.shafts("march", lights, March(steps="exact", shadow_size=1024), **medium))


def passes(shafts: LightShafts) -> set[str]:
    return {label for label, _ in shafts.profile()}


def rmse(found: np.ndarray, truth: np.ndarray) -> float:
    return float(np.sqrt(((found - truth) ** 2).mean()) / truth.mean())


# ---------------------------------------------------------------- in the view, beyond it, and between


@pytest.mark.parametrize(("degrees", "medium"), [(0, {}), (9, {"fog": "exponential", "fog_base": -1.0, "fog_depth": 2.0})])
def test_a_sun_in_the_view_has_the_shadows_of_the_march_without_its_passes(stage: Stage, degrees: float, medium: Any) -> None:
    stage.look(degrees)
    shafts = stage.shafts(**medium)
    found = stage.layer(shafts)
    assert passes(shafts) == {"picture shadows", "picture sun", "merge"}
    through = stage.texels(shafts.transmittance)[..., :3].copy()
    truth = stage.layer(stage.shafts("march", **medium))
    whole = truth.max(axis=(0, 1))
    assert rmse(found, truth) < 0.04 and abs(found.mean() / truth.mean() - 1) < 0.02
    assert (truth.min(axis=(0, 1)) < 0.3 * whole).all()  # there are shadows
    np.testing.assert_allclose(through, stage.texels(stage.renderer.effect_passes[0].transmittance)[..., :3], atol=2e-6)


@pytest.mark.parametrize("degrees", [120, 180])
def test_a_light_behind_is_the_march_bit_for_bit(stage: Stage, degrees: float) -> None:
    stage.look(degrees)
    shafts = stage.shafts()
    found = stage.layer(shafts)
    assert not {label for label in passes(shafts) if "picture" in label}
    assert np.array_equal(found, stage.layer(stage.shafts("march")))


def test_between_both_are_mixed_by_how_far_the_light_is_out(stage: Stage, monkeypatch: pytest.MonkeyPatch) -> None:
    stage.look(45)
    shafts = stage.shafts(ambient=(0.1, 0.2, 0.3))
    mixed = stage.layer(shafts)
    assert {"picture shadows", "picture sun", "shadows", "march transmittance"} < passes(shafts)
    march = stage.layer(stage.shafts("march", ambient=(0.1, 0.2, 0.3)))
    project = seen_lights.project
    share = share_of(project((*stage.sun.local.position, 0.0), stage.camera.view_matrix, stage.camera.projection_matrix).fade)
    monkeypatch.setattr(seen_lights, "project", lambda *own: replace(project(*own), fade=1.0))
    picture = stage.layer(stage.shafts(ambient=(0.1, 0.2, 0.3)))
    assert 0.1 < share < 0.9 and rmse(picture, march) > 0.01
    np.testing.assert_allclose(mixed, share * picture + (1 - share) * march, rtol=2e-5)


def test_the_picture_has_all_of_a_light_in_the_view_and_hands_it_over_evenly() -> None:
    share = np.array([share_of(fade) for fade in np.linspace(0, 1, 101)])
    assert share[0] == share[30] == 0 and share[-1] == 1 and (np.diff(share) >= 0).all() and np.diff(share).max() < 0.05


def test_several_lights_are_divided_each_by_itself(stage: Stage) -> None:
    """Two are seen, one is behind: their sum is that of each alone."""
    lamp, behind = gfx.PointLight(intensity=40, decay=2), gfx.PointLight(intensity=40, decay=2)
    lamp.local.position, behind.local.position = (0.7, 0.5, -5), (0, 1, 3)
    stage.scene.add(lamp, behind)
    lights = [SceneLight(stage.sun), SceneLight(lamp), SceneLight(behind)]
    alone = [stage.layer(stage.shafts(lights=[light])) for light in lights]
    shafts = stage.shafts(lights=lights)
    np.testing.assert_allclose(stage.layer(shafts), sum(alone), rtol=1e-4, atol=1e-5)
    assert {"picture sun", "picture point", "march point"} <= passes(shafts) and "march sun" not in passes(shafts)


@pytest.mark.parametrize("kind", ["point", "spot"])
def test_lamps_in_the_view(stage: Stage, kind: str) -> None:
    """Before a wall, with bars before them: their body hides nothing, and light is right near them."""
    bulb = gfx.Mesh(gfx.sphere_geometry(0.15), gfx.MeshBasicMaterial(color="#fff"))
    lamp = gfx.PointLight(intensity=20, decay=2) if kind == "point" else gfx.SpotLight(intensity=20, decay=2, angle=0.9, penumbra=0.4)
    stage.scene.add(bulb.add(lamp), box((0, 0, -9), 30, 30, 0.1))
    stage.scene.add(box((0.9, 0.6, -5.6), 0.15, 1.0, 0.1), box((-0.7, 0.1, -5.5), 1.2, 0.1, 0.1))
    bulb.local.position = (0, 0.6, -6)
    if kind == "spot":
        lamp.target.local.position = (0.2, -1, 0.6)
        bulb.add(lamp.target)
    light = SceneLight(bulb)
    found, truth = stage.layer(stage.shafts(lights=light)), stage.exact(light)
    assert rmse(found, truth) < 0.08 and abs(found.mean() / truth.mean() - 1) < 0.03
    assert abs(found.max() / truth.max() - 1) < 0.03


@pytest.mark.slow
def test_a_camera_that_turns_half_around_sees_no_jump(stage: Stage) -> None:
    """By .1 degrees a frame, a light that is in the view at first, and at last behind; its light is as strong on all sides, so that frames
    compare, and what is seen moves by a pixel from one to the next."""
    shafts = stage.shafts(anisotropy=0.0)
    stage.camera.fov = 20
    stage.layer(shafts)
    assert passes(shafts) == {"picture shadows", "picture sun", "merge"}
    shafts.timing, shafts.still = False, 1
    changes, last = [], None
    for degrees in np.arange(0, 180.05, 0.1):
        stage.look(degrees)
        layer = stage.layer(shafts)
        changes += [] if last is None else [np.abs(layer - last).mean()]
        last = layer
    assert len(changes) == 1800 and max(changes) <= 1.5 * np.median(changes)


# ---------------------------------------------------------------- what is chosen


def told(stage: Stage) -> list[str]:
    with warnings.catch_warnings(record=True) as seen:
        warnings.simplefilter("always")
        stage.draw()
        stage.draw()
    return [str(one.message) for one in seen if issubclass(one.category, AirlightWarning)]


REFUSED: dict[str, tuple[dict[str, Any], str]] = {
    "exact": ({"march": March(steps="exact", shadow_size=64)}, "where the medium's are not asked for exactly"),
    "soft": ({"march": March(shadow_filter="soft", shadow_size=64)}, "without soft shadows"),
    "noise": ({"noise_amount": 0.5, "noise_size": 2.0}, "in even air and in fog by height"),
    "own": ({"density": 2.0}, "without a density or extinction of their own"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_the_picture_cannot_do_is_left_to_the_march_and_told_once(stage: Stage, name: str) -> None:
    more, why = REFUSED[name]
    more = dict(more)
    light = SceneLight(stage.sun, density=more.pop("density", 1.0))
    shafts = stage.shafts(lights=light, **more)
    assert told(stage) == [f"method auto: lights are summed on the picture {why}; here they go by march alone"]
    found = stage.layer(shafts)
    assert np.array_equal(found, stage.layer(stage.shafts("march", light, **more)))
    stage.look(180)  # where none is seen nothing is refused
    stage.shafts(lights=light, **more)
    assert told(stage) == []


def test_without_a_medium_it_is_epipolar(stage: Stage) -> None:
    shafts = LightShafts(stage.renderer, stage.scene, stage.camera, SceneLight(stage.sun), Parameters(method="auto"))
    assert shafts.parameters.method == "epipolar"
    shafts.medium = Medium(**AIR)
    assert shafts.parameters.method == "auto"
    assert LightShafts(stage.renderer, stage.scene, stage.camera, [], Parameters(method="auto"), march=March()).parameters.method == "auto"


def test_values_of_a_scene_settle_it() -> None:
    assert settled_method({}) == "epipolar" and settled_method({"method": "radial"}) == "radial"
    assert settled_method({"method": "auto", "resolution": 0.5}) == "epipolar"
    assert settled_method({"method": "auto", "sigma_t": (0.1, 0.1, 0.1)}) == settled_method({"method": "auto"}, True) == "auto"


def test_commands_tell_what_is_chosen(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run = ["render", str(SLATS), "--width", "32", "--height", "18", "--quality", "draft", "-y"]
    for name, more in (("auto", "auto"), ("same", "epipolar"), ("air", "auto --sigma-t 0.2")):
        assert main([*run, "--method", *more.split(), "-o", str(tmp_path / f"{name}.exr")]) == 0
        line = "method auto: no medium is given, so it is epipolar"
        assert (line in capsys.readouterr().err) == (name == "auto")
    auto, same, air = (np.asarray(read_image(str(tmp_path / f"{name}.exr")).linear()) for name in ("auto", "same", "air"))
    assert np.array_equal(auto, same) and not np.array_equal(auto, air)
