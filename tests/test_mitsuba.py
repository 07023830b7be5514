"""What Mitsuba makes of Airlight's numbers for a medium and its lights, and what is refused. What needs it installed is slow."""

import dataclasses
import sys
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from test_tracer import EYE, LAMPS, air, look, square

from airlight.errors import AirlightError
from airlight.files.photometry import read_photometry
from airlight.lights.point import PointLight
from airlight.lights.projector import ProjectorLight
from airlight.lights.punctual import PunctualLight
from airlight.lights.shape import Cookie, axes_along
from airlight.lights.spot import SpotLight
from airlight.reference import medium, mitsuba, tracer

FOLDER = Path(str(resources.files("airlight"))) / "data" / "scenes" / "validation"

SIZE = (8, 5)
WALL = square(-3.0)
SPOT, POINT = LAMPS["spot"], dataclasses.replace(LAMPS["point"], range=0.0)
assert isinstance(SPOT, SpotLight)
PICTURE = Cookie(np.random.default_rng(19).uniform(size=(3, 4, 3)) ** 3)
GOBO = dataclasses.replace(SPOT, cookie=PICTURE, turned=axes_along(SPOT.direction, (0.8, 0.3, 0.2)))
FLOOD = dataclasses.replace(SPOT, photometry=read_photometry(str(FOLDER / "flood.ies")), inner=0.6, outer=0.9)
SLIDE = ProjectorLight(SPOT.intensity, SPOT.position, SPOT.direction, up=tuple(axes_along(SPOT.direction, (0.3, 1, 0))[1]), fov=(0.9, 0.6))
SLIDE = dataclasses.replace(SLIDE, cookie=PICTURE, near=1e-3)
FAR = PointLight((900.0, 800.0, 700.0), (12.0, 3.0, 3.0))  # outside the medium that the eye looks through


@pytest.mark.slow
@pytest.mark.parametrize("phase", ["henyey-greenstein", "two-lobe", "isotropic", "rayleigh"])
def test_a_sun_on_a_slab_has_its_closed_form(phase: str) -> None:
    sun, thin = LAMPS["sun"], air(phase=phase, anisotropy=0.4, back_anisotropy=-0.3, back_share=0.4, albedo=(0.9, 0.5, 0.0))
    (found, _, way), halves = mitsuba.layer(*look(), SIZE, WALL, [sun], thin, spp=4000)
    np.testing.assert_allclose(way[2, 3:5], 9.0, rtol=0.02)
    truth = tracer.layer(*look(), SIZE, WALL, [sun], thin)[0]
    middle = found[2, 3:5].mean(axis=0)  # rays almost along -z
    kind, *lobes = thin.lobes(sun.anisotropy)
    there = medium.phase(-0.64, lobes, kind)
    np.testing.assert_allclose(middle, thin.sigma_s * sun.intensity * there * (1 - np.exp(-9 * thin.sigma_t)) / thin.sigma_t, rtol=0.2)
    np.testing.assert_allclose(found, truth, rtol=0.01)
    assert np.abs(halves).max() < 0.005 * truth.max()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("lamp", "reach"),
    [(SPOT, 20.0), (POINT, 20.0), (FAR, 8.0), (GOBO, 20.0), (FLOOD, 20.0), (SLIDE, 20.0)],
    ids=["spot", "point", "far", "gobo", "flood", "slide"],
)
def test_a_lamp_is_the_tracers(lamp: PunctualLight, reach: float) -> None:
    thin = air(sigma_t=(0.05, 0.1, 0.1), max_distance=reach, anisotropy=0.3)
    (found, _, _), halves = mitsuba.layer(*look(), SIZE, square(-30.0), [lamp], thin, spp=20000)
    truth = tracer.layer(*look(), SIZE, square(-30.0), [lamp], thin)[0]
    noise = np.sqrt(np.mean(halves**2))
    assert noise < 0.03 * truth.mean()
    assert np.sqrt(np.mean((found - truth) ** 2)) < 2 * noise
    np.testing.assert_allclose(found.mean(axis=(0, 1)), truth.mean(axis=(0, 1)), rtol=0.01)


@pytest.mark.slow
def test_what_stands_in_the_light_hides_it() -> None:
    roof = square(0.0)[:, :, [0, 2, 1]] + [0.0, 4.0, 100.0]  # over the half in front of z = 0, at y = 4
    found = mitsuba.layer(*look(), SIZE, np.concatenate([WALL, roof]), [LAMPS["sun"]], air(), spp=4000)[0].radiance
    truth = tracer.layer(*look(), SIZE, np.concatenate([WALL, roof]), [LAMPS["sun"]], air())[0]
    bare = tracer.layer(*look(), SIZE, WALL, [LAMPS["sun"]], air())[0]
    assert truth.mean() < 0.7 * bare.mean()
    np.testing.assert_allclose(found, truth, atol=0.03 * truth.mean())


@pytest.mark.parametrize(
    ("lamp", "more", "says"),
    [
        (SPOT, {"phase": "cornette-shanks"}, "no phase function cornette-shanks"),
        (SPOT, {"ambient": (0.0, 0.1, 0.0)}, "no ambient light"),
        (LAMPS["point"], {}, "no range"),
        (dataclasses.replace(SPOT, outer=1.5), {}, "too wide"),
        (dataclasses.replace(LAMPS["sun"], cookie=PICTURE), {}, "no sun with a shape"),
        (dataclasses.replace(POINT, photometry=FLOOD.photometry), {}, "no point with a shape"),
        (dataclasses.replace(SLIDE, falloff="inverse"), {}, "one falloff"),
        (dataclasses.replace(SLIDE, clip=((0, 1, 0, 0),)), {}, "no clip planes"),
    ],
)
def test_what_mitsuba_has_not_is_refused(lamp: PunctualLight, more: dict[str, Any], says: str) -> None:
    with pytest.raises(AirlightError, match=says):
        mitsuba.layer(*look(), SIZE, WALL, [lamp], air(**more), spp=2)


def test_triangles_that_cast_no_shadow_and_flat_cameras_are_refused() -> None:
    with pytest.raises(AirlightError, match="cast no shadow"):
        mitsuba.layer(*look(), SIZE, WALL, [SPOT], air(), WALL[:1], spp=2)
    with pytest.raises(AirlightError, match="perspective"):
        mitsuba.layer(*look(EYE, flat=True), SIZE, WALL, [SPOT], air(), spp=2)


def test_that_mitsuba_is_missing_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mitsuba", None)
    with pytest.raises(AirlightError, match=r"airlight\[validate\]"):
        mitsuba.layer(*look(), SIZE, WALL, [SPOT], air())
