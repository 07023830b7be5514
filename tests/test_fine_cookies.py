"""A line where a cookie is finer than the pixels of a comparison, and projectors that several studios film."""

import dataclasses
import math

import numpy as np
import pygfx as gfx

from airlight.compare.fine_cookies import doubt_of_cookies, texels_a_pixel
from airlight.lights.directional import DirectionalLight
from airlight.lights.projector import ProjectorLight
from airlight.lights.shape import Cookie
from airlight.pygfx.projector import Projector
from airlight.scenes import open_scene
from airlight.scenes.exposure import expose
from airlight.scenes.lamps import lighting


def test_texels_of_a_cookie_are_counted_in_pixels() -> None:
    camera = gfx.PerspectiveCamera(90, 2)
    camera.local.position = (0, 0, 10)
    view, projection, lengths = np.asarray(camera.view_matrix), np.asarray(camera.projection_matrix), np.full((80, 160), 20.0)
    rays = 2 / projection[0, 0]  # m that the picture is wide, a metre ahead
    cookie = Cookie(np.random.default_rng(3).uniform(size=(50, 100, 3)), size=3.0)
    sun = DirectionalLight((1.0, 1.0, 1.0), cookie=cookie)
    even = texels_a_pixel(sun, view, projection, lengths, 20.0)
    np.testing.assert_allclose(even, 100 / 3 * rays / 160 * 16, rtol=0.1)  # at four fifths of 20 m, more or less by the angle
    assert texels_a_pixel(sun, view, projection, lengths, 2.0) < 0.11 * even
    beside = ProjectorLight((1.0, 1.0, 1.0), (0.0, 0.0, 10.0), (0.0, 0.0, -1.0), fov=(math.radians(60), math.radians(40)), cookie=cookie)
    at_eye = texels_a_pixel(beside, view, projection, lengths, 20.0)
    np.testing.assert_allclose(at_eye, 100 / (2 * math.tan(math.radians(30))) * rays / 160, rtol=0.2)
    assert doubt_of_cookies([dataclasses.replace(sun, cookie=None)], view, projection, lengths, 20.0) is None
    line = doubt_of_cookies([sun, beside], view, projection, lengths, 20.0)
    assert line is not None and f"{even:.1f} texels" in line


def test_a_projector_that_several_shots_film_is_exposed_by_each() -> None:
    stage = open_scene("slats")
    stage.measured = True
    projector = Projector("#fff", 100.0)
    for pre in (0.25, 0.5):
        made = lighting(stage, [projector])
        with made.shining():
            expose(stage, pre)
            assert projector.intensity == 100 * pre
        with made.shining():
            assert projector.intensity == 100 * pre
        assert projector.intensity == 100
