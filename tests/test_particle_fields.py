"""Points of pygfx scenes, and arrays, as a density that follows them."""

from pathlib import Path

import numpy as np
import pygfx as gfx
import pytest
from gltfs import Writer

import airlight
from airlight.errors import AirlightError, AirlightWarning
from airlight.medium.particles import particle_mass
from airlight.pygfx import ParticleField, near_origin, undrawn
from airlight.scenes import open_scene

pytestmark = pytest.mark.filterwarnings("error")
POINTS = np.random.default_rng(4).uniform(-1, 1, (40, 3)).astype(np.float32)


def points(size=0.6, space="world", colors=None, material: type = gfx.PointsMaterial, **more) -> gfx.Points:
    arrays = {} if colors is None else {"colors": colors}
    return gfx.Points(gfx.Geometry(positions=POINTS.copy(), **arrays), material(size=size, size_space=space, **more))


def volume(thing: object, **more) -> airlight.baked.Volume:
    return ParticleField(thing, cells=48, **more).field().volume


def assert_alike(one, other) -> None:
    np.testing.assert_allclose(one.matrix, other.matrix, atol=1e-9)
    np.testing.assert_allclose(one.density, other.density, atol=1e-5 * float(other.density.max()))


def test_points_are_particles_of_half_their_size() -> None:
    expected = airlight.particles(POINTS, 0.3, 1.0, cells=48)
    assert_alike(volume(points()), expected)
    assert_alike(volume(POINTS, radius=0.3, density=1.0), expected)
    assert_alike(volume([points()], radius=0.3, density=1.0), expected)
    sizes = np.linspace(0.2, 0.9, 40).astype(np.float32)
    thing = gfx.Points(gfx.Geometry(positions=POINTS, sizes=sizes), gfx.PointsMaterial(size_mode="vertex", size_space="world"))
    assert_alike(volume(thing), airlight.particles(POINTS, sizes / 2, 1.0, cells=48))


def test_their_transform_places_and_in_model_space_scales_them() -> None:
    for space, radius in (("world", 0.3), ("model", 0.6)):
        group, thing = gfx.Group(), points(space=space)
        group.local.scale, thing.local.position = 2, (10, 0, -3)
        group.add(thing)
        found = volume(group)
        assert_alike(found, airlight.particles(2 * POINTS + (20, 0, -6), radius, 1.0, cells=48))
        assert found.mass == pytest.approx(40 * particle_mass(radius, 1.0), rel=1e-6)


def test_their_alpha_is_a_weight() -> None:
    alphas = np.linspace(0, 1, 40).astype(np.float32)
    colors = np.column_stack([np.ones((40, 3), np.float32), alphas])
    assert_alike(volume(points(colors=colors)), airlight.particles(POINTS, 0.3, alphas, cells=48))
    assert_alike(volume(points(colors=colors), density=3.0), airlight.particles(POINTS, 0.3, 3 * alphas, cells=48))
    codes = np.rint(colors * 255).astype(np.uint8)
    assert_alike(volume(points(colors=codes)), airlight.particles(POINTS, 0.3, codes[:, 3] / 255, cells=48))
    plain = airlight.particles(POINTS, 0.3, 0.5, cells=48)
    assert_alike(volume(points(colors=colors[:, :3], opacity=0.5)), plain)
    assert_alike(volume(points(color=(1, 0, 0, 0.5))), plain)
    assert_alike(volume(points(colors=colors, color_mode="uniform", color=(1, 1, 1, 0.5))), plain)


def test_sizes_in_pixels_are_no_radii() -> None:
    with pytest.warns(AirlightWarning, match="smoke: has no radius: .*twice the mean spacing; no density: 0.13"):
        found = volume(points(size=2, space="screen", opacity=0.5), name="smoke")
    with pytest.warns(AirlightWarning):
        assert found.mass == pytest.approx(airlight.particles(POINTS, cells=48).mass / 2, rel=1e-5)
    assert_alike(volume(points(size=2, space="screen"), radius=0.3), airlight.particles(POINTS, 0.3, 1.0, cells=48))


def test_a_sprite_is_their_kernel(tmp_path: Path) -> None:
    sprite = np.zeros((16, 16, 4), np.uint8)
    sprite[4:12, 4:12] = 255
    texture = gfx.Texture(sprite, dim=2)
    expected = airlight.particles(POINTS, 0.3, 1.0, cells=48, sprite=sprite)
    thing = points(material=gfx.PointsSpriteMaterial, sprite=texture)
    assert_alike(volume(thing), expected)
    assert_alike(volume(POINTS, radius=0.3, density=1.0, sprite=sprite), expected)
    assert np.abs(expected.density - volume(points()).density).max() > 0.1


def test_they_are_baked_again_only_when_something_changed() -> None:
    thing = points()
    field = ParticleField(thing, cells=32)
    first = field.field()
    assert field.field() is first and field.field(64) is first  # its own cells count
    shared = ParticleField(thing)
    assert shared.field(32) is shared.field(32)
    assert max(shared.field(64).volume.density.shape) > 50 > max(shared.field(32).volume.density.shape)
    for change in (
        lambda: setattr(thing.local, "x", 0.25),
        lambda: setattr(thing.material, "size", 0.8),
        lambda: setattr(thing.material, "opacity", 0.5),
        lambda: setattr(field, "cells", 48),
        lambda: setattr(field, "factor", 2.0),
        lambda: thing.geometry.positions.data.__setitem__((0, 0), 3),
    ):
        before = field.field()
        change()
        after = field.field()
        assert after is not before and field.field() is after
    positions = POINTS.astype(float)
    field = ParticleField(positions, radius=0.3, cells=32)
    before = field.field()
    assert field.field() is before
    positions[0] += 0.5  # in place
    after = field.field()
    assert after is not before and field.field() is after
    for nothing in (np.zeros((0, 3)), np.full((5, 3), np.nan)):
        field.positions = nothing
        assert field.field().volume.mass == 0 and field.field() is field.field()


def test_where_a_scene_is_drawn_near_the_origin_they_stay_in_the_world() -> None:
    scene, camera, thing = gfx.Scene(), gfx.PerspectiveCamera(), points()
    thing.local.position = (1e6 + 0.1, 3, -2e6)
    scene.add(thing)
    field = ParticleField(thing, cells=32)
    before = field.field()
    with near_origin(scene, camera, (1e6, 0, -2e6)):
        assert field.field() is before
    np.testing.assert_allclose(before.volume.bounds.mean(axis=0), (1e6, 3, -2e6), atol=0.5)


def test_points_that_only_count_are_not_drawn() -> None:
    drawn, counted, hidden = points(), points(), points()
    hidden.visible = False
    fields = [ParticleField(drawn), ParticleField([counted, hidden], draw=False), object()]
    with undrawn(fields):
        assert drawn.visible and not counted.visible and fields[1].field().volume.mass > 0
    assert counted.visible and not hidden.visible


def test_what_changes_is_told_once_of_each_kind() -> None:
    positions = np.concatenate([POINTS, [[50, 0, 0]]]).astype(float)
    field = ParticleField(positions, radius=0.01, density=1.0, cells=32, name="dust")
    with pytest.warns(AirlightWarning, match=r"dust: radii of 0.01 m are drawn as .*raise particle_cells"):
        field.field()
    positions[0] += 1
    field.field()
    positions[1] = np.nan
    with pytest.warns(AirlightWarning, match=r"dust: 1 particle that is not finite, the first number 1, is left out"):
        field.field()


def test_what_cannot_be() -> None:
    with pytest.raises(AirlightError, match="mist: has no points; give a"):
        ParticleField(gfx.Group(name="mist"))
    with pytest.raises(AirlightError, match="blend 'ad'; did you mean 'add'"):
        ParticleField(POINTS, blend="ad")
    with pytest.raises(AirlightError, match=r"positions have the shape \(3,\)"):
        ParticleField([1.0, 2.0, 3.0], radius=1.0).field()
    with pytest.raises(AirlightError, match="particle 0 has the radius -1"):
        ParticleField(POINTS, radius=-1.0).field()


def test_points_of_a_gltf_file_are_loaded_by_name(tmp_path: Path) -> None:
    made = Writer()
    colors = np.column_stack([np.ones((40, 3)), np.linspace(0, 1, 40)]).astype(np.float32)
    mesh = made.mesh(POINTS, mode=0, COLOR_0=made.accessor(colors))
    made.json["meshes"][mesh]["name"] = "smoke"
    made.node(mesh=mesh, name="chimney", translation=[0, 2, 0])
    stage = open_scene(made.save(tmp_path))
    (found,) = [thing for thing in stage.scene.iter() if isinstance(thing, gfx.Points)]
    assert found.name == "smoke" and found.parent.name == "chimney"
    for thing in (found, found.parent):
        assert_alike(
            volume(thing, radius=0.3), airlight.particles(POINTS + np.array([0, 2, 0]), 0.3, np.linspace(0, 1, 40), cells=48)
        )


def test_points_of_a_gltf_file_may_have_radii_and_densities(tmp_path: Path) -> None:
    made, radii, densities = Writer(), np.linspace(0.1, 0.4, 40).astype(np.float32), np.linspace(2, 0, 40).astype(np.float32)
    more = {"_RADIUS": made.accessor(radii[:, None]), "_DENSITY": made.accessor(densities[:, None])}
    made.node(mesh=made.mesh(POINTS, mode=0, **more), scale=[2, 2, 2])
    made.node(mesh=made.mesh(POINTS, _RADIUS=made.accessor(POINTS)))  # of triangles it is something else
    stage = open_scene(made.save(tmp_path))
    (found,) = [thing for thing in stage.scene.iter() if isinstance(thing, gfx.Points)]
    assert_alike(volume(found), airlight.particles(2 * POINTS, 2 * radii, densities, cells=48))
    made.node(mesh=made.mesh(POINTS, mode=0, _RADIUS=made.accessor(POINTS)))
    with pytest.raises(AirlightError, match="_RADIUS of "):
        open_scene(made.save(tmp_path))
