"""Media that vary, as Mitsuba has them, against the tracer; and what it is not asked for. What needs it installed is slow."""

from typing import Any

import numpy as np
import pytest
from test_density import volume
from test_paths import LIGHTS, made
from test_tracer import look, square

from airlight.errors import AirlightError
from airlight.lights.directional import DirectionalLight
from airlight.medium.field import Field
from airlight.reference import mitsuba, mitsuba_fields, tracer

RNG = np.random.default_rng(32)
SUN = DirectionalLight((3.0, 2.0, 1.0), direction=(0.48, 0.6, 0.64))
LAMPS = LIGHTS | {"sun": SUN}
CAMERA = look(np.array([0.0, 0.5, 0.0]))
SMOKE = Field(volume(RNG.uniform(0, 2, (6, 5, 7)), 0.5, ((-2, -1, -9), (2, 3, -5))))
AROUND = Field(volume(RNG.uniform(0, 2, (6, 5, 7)), 0.5, ((-4, -3, -9), (4, 4, 3))))
EVEN_SIGMA = (0.2, 0.2, 0.2)
MEDIA = {
    "smoke": lambda: made(SMOKE, sigma_t=EVEN_SIGMA),
    "inside": lambda: made(AROUND, sigma_t=EVEN_SIGMA),
    "exponential": lambda: made(fog="exponential", fog_depth=1.0, sigma_t=EVEN_SIGMA),
    "linear": lambda: made(fog="linear", fog_depth=2.0, sigma_t=EVEN_SIGMA),
}


@pytest.mark.slow
@pytest.mark.parametrize("kind", LAMPS)
@pytest.mark.parametrize("name", MEDIA)
def test_a_medium_that_varies_is_the_tracers(name: str, kind: str) -> None:
    """Within the noise, and the means within 1 %; the brightest pixels by a lamp, which few samples find, left out."""
    medium, light, wall = MEDIA[name](), LAMPS[kind], square(-8.0, 12.0)
    truth = tracer.layer(*CAMERA, (12, 8), wall, [light], medium)
    found, halves = mitsuba.layer(*CAMERA, (12, 8), wall, [light], medium, spp=8000 if light.directional else 24_000)
    np.testing.assert_allclose(found.transmittance, truth.transmittance, atol=1e-5)
    kept = truth.radiance.mean(axis=2) <= np.quantile(truth.radiance.mean(axis=2), 0.9)
    off, mean = (found.radiance - truth.radiance)[kept], truth.radiance[kept].mean()
    noise = np.sqrt(np.mean(halves[kept] ** 2))
    assert 0 < noise < 0.12 * mean
    assert np.sqrt(np.mean(off**2)) < 1.5 * noise
    assert abs(off.mean()) < 0.003 * mean + 4 * halves[kept].mean(axis=1).std() / np.sqrt(kept.sum())


def test_a_grid_for_mitsuba_has_the_density() -> None:
    """A volume's own voxels at their centres; fog by its height."""
    eye = np.array([0.0, 0.5, 0.0])
    for name in MEDIA:
        medium = MEDIA[name]()
        values, into = mitsuba_fields.grid(medium, eye, SUN)
        z, y, x = (np.arange(0, n, max(n // 7, 1)) for n in values.shape)
        index = np.stack(np.meshgrid(x, y, z, indexing="ij"), axis=-1).reshape(-1, 3)
        at = ((index + 0.5) / values.shape[::-1]) @ into[:3, :3].T + into[:3, 3]
        truth = mitsuba_fields.paths.density(at, medium)
        assert truth.max() > 0.5
        np.testing.assert_allclose(values[index[:, 2], index[:, 1], index[:, 0]], truth, rtol=1e-5, atol=1e-9)
        assert mitsuba_fields.holds(into, eye) == (name in ("inside", "exponential", "linear"))


@pytest.mark.parametrize(("fields", "values", "says"), [
    ((), {"noise_amount": 1.0}, "not for noise"),
    ((SMOKE,), {"air": 1.0}, "in no air"),
    ((SMOKE, AROUND), {}, "one volume"),
    ((SMOKE,), {"sun_extinction": "none"}, "set sun_extinction to all"),
    ((), {"fog": "linear", "fog_above": 0.1, "sun_extinction": "all"}, "set fog_above to 0"),
])
def test_what_mitsuba_is_not_asked_for(fields: Any, values: dict[str, Any], says: str) -> None:
    with pytest.raises(AirlightError, match=says):
        mitsuba.layer(*CAMERA, (4, 3), square(-8.0), [SUN], made(*fields, **values), spp=2)
