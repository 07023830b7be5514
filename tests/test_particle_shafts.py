"""Particles and lowlands in pictures of a pygfx program: their mass is seen, they move, they are counted and not drawn."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

gfx = pytest.importorskip("pygfx")
from pass_stage import PassStage  # noqa: E402

from airlight.medium.particles import particle_mass  # noqa: E402
from airlight.options import March, Medium, Parameters, SceneOptions  # noqa: E402
from airlight.pygfx import LightShafts, ParticleField, SceneLight, private, undrawn  # noqa: E402

SIZE, WIDTH = (64, 48), 8.0  # pixels, metres
SIGMA = 0.4
POINTS = np.random.default_rng(4).uniform((-2, -1, -2), (2, 1.5, 2), (60, 3)).astype(np.float32)


class Stage(PassStage):
    """One renderer for all tests: seen without perspective, from in front."""

    def __init__(self) -> None:
        super().__init__(SIZE)

    def reset(self) -> None:
        self.scene = gfx.Scene()
        self.sun = gfx.DirectionalLight(intensity=2)
        self.sun.local.position = (3, 5, 4)
        wall = gfx.Mesh(gfx.box_geometry(30, 30, 1), gfx.MeshBasicMaterial(color="#555"))
        wall.local.position = (0, 0, -9)
        self.scene.add(self.sun, wall)
        self.camera = gfx.OrthographicCamera(WIDTH, WIDTH * SIZE[1] / SIZE[0], depth_range=(0.1, 40))
        self.camera.local.position = (0, 0, 12)

    def shafts(self, fields: list[Any], **medium: Any) -> LightShafts:
        given = {"sigma_t": (SIGMA,) * 3, "max_distance": 60.0, **medium}
        parameters = Parameters(method="march", quality="final")
        more = {"medium": Medium(**given), "march": March(), "in_scene": SceneOptions(view_transform="none", resolution=1.0)}
        made = LightShafts(self.renderer, self.scene, self.camera, SceneLight(self.sun), parameters, **more)
        made.fields, made.radius, made.doubts = fields, 10.0, False
        self.renderer.effect_passes = [made]
        return made

    def frame(self, shafts: LightShafts) -> SimpleNamespace:
        with undrawn(shafts.fields):
            self.draw()
        light, clear = (self.texels(texture).astype(np.float64)[..., :3] for texture in (shafts.layer, shafts.transmittance))
        return SimpleNamespace(light=light, depth=-np.log(clear[..., 0]), picture=self.picture())

    def picture(self) -> np.ndarray:
        """Give what is drawn before any effect."""
        return self.texels(private.drawn(self.renderer))

    def mass(self, frame: SimpleNamespace) -> float:
        """Sum the optical depths over the picture's area: the mass of what lies in it."""
        return float(frame.depth.sum() * (WIDTH / SIZE[0]) ** 2 / SIGMA)


def smoke() -> Any:
    return gfx.Points(gfx.Geometry(positions=POINTS.copy()), gfx.PointsMaterial(size=1.2, size_space="world", color="#f00"))


def test_the_mass_of_particles_is_what_an_orthographic_picture_shows(stage: Stage) -> None:
    field = ParticleField(POINTS, radius=0.6, density=1.5, cells=64)
    seen = stage.frame(stage.shafts([field]))
    assert stage.mass(seen) == pytest.approx(60 * particle_mass(0.6, 1.5), rel=2e-3)
    assert seen.light.max() > 0.01


def test_points_that_move_take_their_density_along(stage: Stage) -> None:
    points = smoke()
    stage.scene.add(points)
    shafts = stage.shafts([ParticleField(points, draw=False, cells=48)])
    first = stage.frame(shafts)
    assert (first.picture[..., 0] < 0.2).all() and points.visible, "points that only count are drawn"
    again = stage.frame(shafts)
    np.testing.assert_array_equal(first.depth, again.depth)
    points.local.position = (1, 0.5, 0)  # 8 and 4 pixels
    moved = stage.frame(shafts)
    np.testing.assert_allclose(moved.depth[:-4, 8:], first.depth[4:, :-8], atol=0.06 * first.depth.max())
    assert stage.mass(moved) == pytest.approx(stage.mass(first), rel=5e-3)
    shafts.fields = [ParticleField(points, cells=48)]
    assert stage.frame(shafts).picture[..., 0].max() > 0.5, "points that are drawn too are not"
    points.geometry.positions.data[:] = np.nan  # none are left
    assert stage.mass(stage.frame(shafts)) == pytest.approx(0, abs=1e-6)


def test_lowlands_fill_with_air_up_to_the_level(stage: Stage) -> None:
    """A floor at 1 m over half of the picture, seen from beside: 2 m of denser air over it, in air that stays what it is."""
    floor = gfx.Mesh(gfx.box_geometry(4, 0.5, 6), gfx.MeshBasicMaterial(color="#333"))
    floor.local.position = (-2, -1.25, 0)
    stage.scene.add(floor)
    stage.scene.children[1].local.position = (0, 20, -9)  # the wall, but for a bit above
    shafts = stage.shafts([], basin_level=1.0, basin_density=1.5, sigma_t=(0.1,) * 3, max_distance=30.0)
    seen = stage.frame(shafts)
    plain = stage.frame(stage.shafts([], sigma_t=(0.1,) * 3, max_distance=30.0))
    more = (seen.depth - plain.depth) / 0.1
    assert plain.depth[5, 5] == pytest.approx(3.0, rel=0.02)  # air of density 1
    np.testing.assert_allclose(more[20:30, 4:28], 1.5 * 6, rtol=0.03)
    np.testing.assert_allclose(more[:16], 0, atol=0.01)  # above the level
    np.testing.assert_allclose(more[:, 36:], 0, atol=0.01)  # beside the ground


def test_a_method_of_even_air_knows_no_particles(stage: Stage) -> None:
    layers = []
    for fields, noise in (([], 0.0), ([ParticleField(POINTS, radius=0.6, density=1.5, cells=32)], 2.0)):
        shafts = stage.shafts(fields, noise_amount=noise)
        shafts.parameters = Parameters(method="article-prose")
        stage.draw()
        layers.append(stage.texels(shafts.layer))
    np.testing.assert_array_equal(*layers)
    assert layers[0].any()


@pytest.mark.slow
def test_a_density_of_almost_nothing_changes_nothing(stage: Stage) -> None:
    """At the picture's corners too, in the last of several cascades, which ends nowhere."""
    stage.camera = gfx.PerspectiveCamera(90, SIZE[0] / SIZE[1], depth_range=(0.1, 100))
    stage.camera.local.position = (0, 0, 12)
    lights = []
    for fields in ([], [ParticleField([[0, 0, 0]], radius=1.0, density=1e-6, cells=16)]):
        shafts = stage.shafts(fields, air=1.0, sigma_t=(0.02,) * 3)
        shafts.parameters, shafts.march = Parameters(method="march", quality="normal"), March(steps=32, cascades=2)
        lights.append(stage.frame(shafts).light)
    np.testing.assert_allclose(lights[1], lights[0], rtol=0.05, atol=0.02 * lights[0].max())
