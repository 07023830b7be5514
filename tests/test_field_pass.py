"""Media that vary, in pygfx's scenes without shadows: mass is kept, steps come nearer by half as they double, and what moves does not
flicker."""

import math
from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

gfx = pytest.importorskip("pygfx")
from pass_stage import PassStage  # noqa: E402
from test_density import volume  # noqa: E402

from airlight.medium.field import Field  # noqa: E402
from airlight.options import March, Medium, Parameters, SceneOptions  # noqa: E402
from airlight.pygfx import LightShafts, SceneLight  # noqa: E402
from airlight.pygfx.punctual import punctual_lights  # noqa: E402
from airlight.reference import tracer  # noqa: E402

SIZE = (64, 36)
PLAIN = SceneOptions(view_transform="none", resolution=1.0)
SIGMA = (0.05, 0.1, 0.2)
BOX = np.array([[-1.5, -1.0, -8.0], [1.7, 1.1, -5.0]])


class Stage(PassStage):
    """One renderer for all tests, of a scene that is empty but for a light."""

    def __init__(self) -> None:
        super().__init__(SIZE)
        self.scene = gfx.Scene()
        self.sun, self.lamp = gfx.DirectionalLight(intensity=3), gfx.PointLight(intensity=20)
        self.sun.local.position, self.lamp.local.position = (3, 5, 4), (0.7, 1.6, -5.5)
        self.scene.add(gfx.Background(None, gfx.BackgroundMaterial("#000")), self.sun, self.lamp)
        self.perspective = gfx.PerspectiveCamera(40, SIZE[0] / SIZE[1], depth_range=(0.1, 50))
        self.flat = gfx.OrthographicCamera(6.4, 3.6, depth_range=(0.1, 50))

    def reset(self) -> None:
        self.camera = self.perspective

    def frame(
        self, *fields: Field, light: Any = None, steps: Any = "exact", time: float = 0.0, jitter: str = "midpoint", **medium: Any
    ) -> SimpleNamespace:
        """The light (H, W, 3) and transmittance (H, W, 3) of a medium."""
        own = Medium(**{"sigma_t": SIGMA, "max_distance": 12.0} | medium)
        parameters, march = Parameters(method="march", quality="final", jitter=jitter), March(steps=steps, shadow_size=2048)
        scene = self.renderer, self.scene, self.camera, SceneLight(light or self.sun)
        shafts = LightShafts(*scene, parameters, in_scene=PLAIN, medium=own, march=march)
        shafts.fields, shafts.time, shafts.radius, shafts.doubts = list(fields), time, 5.0, False
        self.renderer.effect_passes = [shafts]
        self.draw()
        layer = self.texels(shafts.layer)[..., :3].astype(float)
        return SimpleNamespace(light=layer, transmittance=self.texels(shafts.transmittance)[..., :3].astype(float))


def puffs(shape: Any = (12, 9, 14), box: Any = BOX) -> Any:
    """A volume that is 0 at its faces."""
    values = np.zeros(shape)
    values[1:-1, 1:-1, 1:-1] = np.random.default_rng(33).uniform(0.2, 2, tuple(n - 2 for n in shape))
    return volume(values, 0.5, box)


@pytest.mark.parametrize("steps", ["exact", pytest.param(64, marks=pytest.mark.slow)])
def test_the_mass_is_in_the_picture(stage: Stage, steps: Any) -> None:
    """The sum of -ln T times a pixel's area is sigma_t times the integral of density, in a picture without perspective."""
    own, stage.camera = puffs(), stage.flat
    seen = stage.frame(Field(own, factor=0.7), steps=steps, jitter="blue")
    area = 6.4 / SIZE[0] * 3.6 / SIZE[1]
    found = -np.log(seen.transmittance).sum(axis=(0, 1)) * area
    np.testing.assert_allclose(found, 0.7 * own.mass * np.array(SIGMA), rtol=0.01)


@pytest.mark.slow
def test_the_mass_of_noise_is_that_of_even_air(stage: Stage) -> None:
    """The mean of -ln T, since that is what noise keeps; that of T itself is more, as the exponential is convex."""
    stage.camera = stage.flat
    even, noisy = (stage.frame(noise_amount=k, noise_size=0.8, noise_octaves=2, max_distance=40.0) for k in (0.0, 4.0))
    lengths = [-np.log(seen.transmittance[..., 0]) / SIGMA[0] for seen in (even, noisy)]
    assert abs(lengths[1].mean() / lengths[0].mean() - 1) < 4 * lengths[1].std() / lengths[0].mean() / math.sqrt(64 * 36 / 64)
    assert lengths[1].std() > 0.05 * lengths[1].mean()


KINDS = {
    "volume": lambda: ((Field(puffs()),), {}),
    "volume in air": lambda: ((Field(puffs((5, 4, 6))),), {"air": 0.3}),
    "fog": lambda: ((), {"fog": "exponential", "fog_depth": 0.8}),
    "noise": lambda: ((), {"noise_amount": 2.0, "noise_size": 8.0, "noise_octaves": 1}),
}
FLOOR = 4e-3  # of the mean: the error of the exact walk itself, up to 3.5e-3 in a volume of few voxels, which steps come nearer to


QUICK = ("volume in air", "sun"), ("noise", "sun")
OTHERS = [(kind, lit) for kind in KINDS for lit in ("sun", "lamp") if (kind, lit) not in QUICK]


@pytest.mark.parametrize(("kind", "lit"), [*QUICK, *(pytest.param(*other, marks=pytest.mark.slow) for other in OTHERS)])
def test_steps_come_nearer_by_half_as_they_double(stage: Stage, kind: str, lit: str) -> None:
    """From 16 to 128, thrice, though their groups grow at 64. Without shadows, whose edges are met by chance."""
    fields, values = KINDS[kind]()
    light = stage.sun if lit == "sun" else stage.lamp
    exact = stage.frame(*fields, light=light, **values).light
    errors = []
    for steps in (16, 32, 64, 128):
        off = stage.frame(*fields, light=light, steps=steps, **values).light - exact
        errors.append(np.sqrt(np.mean(off**2)) / exact.mean())
    assert errors[0] < 0.25 and errors[3] <= max(errors[0] / 8, FLOOR)
    assert all(finer <= max(coarser, FLOOR) for coarser, finer in pairwise(errors))


def moved(own: Any, by: float) -> Field:
    matrix = own.matrix.copy()
    matrix[0, 3] += by
    return Field(replace(own, matrix=matrix))


@pytest.mark.parametrize("kind", ["volume", pytest.param("noise", marks=pytest.mark.slow)])
def test_what_moves_does_not_flicker(stage: Stage, kind: str) -> None:
    """From frame to frame steps change as much as the exact walk does, in which there is nothing but what the field itself changes; and how
    they change changes as little."""
    own = puffs((5, 4, 6))
    found: dict[Any, list[Any]] = {"exact": [], 64: []}
    for k in range(4):
        fields = [moved(own, 0.05 * k)] if kind == "volume" else []
        values = {"air": 0.3} if kind == "volume" else {"noise_amount": 2.0, "noise_size": 8.0, "noise_octaves": 1, "wind": (1.5, 0, 0)}
        for steps, frames in found.items():
            frames.append(stage.frame(*fields, steps=steps, time=k / 30, jitter="blue", **values).light)
    first, second = ({steps: np.abs(np.diff(frames, n=n, axis=0)).mean() for steps, frames in found.items()} for n in (1, 2))
    assert first["exact"] > 1e-4 * found["exact"][0].mean()
    assert first[64] < 1.5 * first["exact"]
    assert second[64] < first["exact"]


@pytest.mark.parametrize(("amount", "octaves"), [(8.0, 1), (2.0, 1), (8.0, 3)])
def test_strong_noise_has_the_light_of_the_tracer(stage: Stage, amount: float, octaves: int) -> None:
    values = {"noise_amount": amount, "noise_size": 3.0, "noise_octaves": octaves}
    found = stage.frame(**values)
    own = stage.renderer.effect_passes[0].resolved_medium
    sun = punctual_lights([SceneLight(stage.sun)])
    truth = tracer.layer(stage.camera.view_matrix, stage.camera.projection_matrix, SIZE, np.zeros((0, 3, 3)), sun, own)
    assert np.sqrt(np.mean((found.light - truth.radiance) ** 2)) < 2e-3 * truth.radiance.mean()
    np.testing.assert_allclose(found.transmittance, truth.transmittance, atol=3e-3)


def test_steps_show_the_noise_that_is_there(stage: Stage) -> None:
    """Of an eighth of the ray's length, as the default is of a scene's radius; pixels side by side look at other places along the ray."""
    values = {"noise_amount": 3.0, "noise_size": 1.5, "noise_octaves": 1}
    seen = [stage.frame(steps=steps, jitter="blue", **values).light[..., 1] for steps in ("exact", 64)]
    exact, steps = (one.reshape(9, 4, 16, 4).mean(axis=(1, 3)).ravel() for one in seen)
    even = stage.frame(steps=64, jitter="blue").light[..., 1].reshape(9, 4, 16, 4).mean(axis=(1, 3)).ravel()
    assert (exact / even).std() > 0.05
    assert np.corrcoef(exact / even, steps / even)[0, 1] > 0.8
    assert (steps / even).std() > 0.8 * (exact / even).std()
