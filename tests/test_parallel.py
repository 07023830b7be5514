"""Parallel light, the limit of a far one: the methods against the sum along parallel rays, in float64."""

import numpy as np
import pytest

import airlight
from airlight.errors import AirlightError
from airlight.jobs.light_text import place, read_light
from airlight.lights import Light
from airlight.reference import radial as reference
from airlight.reference.scenes import foliage

SIZE = (640, 360)
IMAGE = foliage(*SIZE).astype(np.float16).astype(np.float32)


def parallel_sum(angle: float, density: float, lam: float, border: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """x, y of some pixels, and S = int_0^1 e^(-lam s) I(x + s density width towards the light) ds there."""
    width, height = SIZE
    rng = np.random.default_rng(1)
    x, y = rng.integers(0, width, 700), rng.integers(0, height, 700)
    s = (np.arange(4000) + 0.5) / 4000
    turn = np.deg2rad(angle)
    at = (x[:, None] + 0.5 + s * density * width * np.cos(turn)) / width, (y[:, None] + 0.5 - s * density * width * np.sin(turn)) / height
    return x, y, np.einsum("ptc,t->pc", reference.bilinear(IMAGE, *at, border), np.exp(-lam * s) / len(s))


@pytest.mark.parametrize("border", ["clamp", "black"])
@pytest.mark.parametrize("angle", [0, 20, 45, 90, 225])
def test_parallel_rays(angle: float, border: str) -> None:
    density, lam = 0.7, 2.0
    x, y, truth = parallel_sum(angle, density, lam, border)
    keywords = {"occlusion": "none", "density": density, "exposure": 1.0, "border": border}
    for method, samples, most in (("epipolar", 1000, 0.02), ("radial", 600, 0.02)):
        decay = float(np.exp(-lam / samples))
        more = {"method": method, "samples": samples, "decay": decay, "jitter": "midpoint"}
        out = airlight.light_shafts(IMAGE, Light.parallel(angle), **keywords, **more)[y, x]
        assert np.sqrt(((out - truth) ** 2).mean()) <= most * truth.mean(), method
    p = airlight.Parameters(samples=1000, decay=float(np.exp(-lam / 1000)), **keywords)
    points = np.stack([(x + 0.5) / SIZE[0], (y + 0.5) / SIZE[1]], axis=1)
    own = reference.layer(IMAGE, [Light.parallel(angle)], p, points=points[:100])
    np.testing.assert_allclose(own, truth[:100], rtol=0.01, atol=2e-3 * truth.max())


def test_epipolar_lines_from_far_at_full_hd() -> None:
    """Images so large that lines are used: no direct sum. Even rows keep their light to themselves; the level does not drift."""
    rows = np.zeros((1080, 1920, 3), np.float32)
    rows[::2] = np.random.default_rng(5).random((540, 1, 3)) + 0.5
    keywords = {"occlusion": "none", "density": 0.5, "decay": 1.0, "exposure": 1.0}
    out = airlight.light_shafts(rows, Light.parallel(0), **keywords)
    np.testing.assert_allclose(out, rows, atol=0.05)
    for angle in (33, 90, 135, 315):
        flat = airlight.light_shafts(np.ones((1080, 1920, 3), np.float32), Light.parallel(angle), **keywords)
        np.testing.assert_allclose(flat, 1, atol=3e-3)


@pytest.mark.parametrize(("where", "x", "y"), [((-0.5, 1.9), (1917, 1920), (0, 200)), ((4.0, -6.0), (0, 180), (0, 280))])
def test_quadrants_keep_to_their_rows(where: tuple[float, float], x: tuple[int, int], y: tuple[int, int]) -> None:
    """Two quadrants see the image, and the first nodes of the second are not stored: they must not land among the first's, which are
    those of pixels in the ranges x and y."""
    image = foliage(1920, 1080)
    out = airlight.light_shafts(image, where, occlusion="none", samples=100, density=0.8, decay=0.99, exposure=1.0)
    rng = np.random.default_rng(7)
    column, row = rng.integers(*x, 300), rng.integers(*y, 300)
    points = np.stack([(column + 0.5) / 1920, (row + 0.5) / 1080], axis=1)
    truth = reference.converged(image, where, density=0.8, lam=-100 * np.log(0.99), points=points)
    np.testing.assert_allclose(out[row, column], truth, atol=2e-3)


def test_which_way_and_how_far() -> None:
    """A bright column at the right border: light from the right reaches density widths to its left."""
    image = np.zeros((40, 100, 3), np.float32)
    image[:, 60:62] = 1
    out = airlight.light_shafts(image, Light.parallel(0), occlusion="none", density=0.3, decay=1.0)[20, :, 0]
    lit = np.flatnonzero(out > 0.02)
    assert 29 <= lit.min() <= 31 and 60 <= lit.max() <= 62
    turned = airlight.light_shafts(image.swapaxes(0, 1), Light.parallel(90), occlusion="none", density=0.75, decay=1.0)
    assert turned[70:].max() > 0.02 and turned[:59].max() < 1e-3  # from above: the light falls downwards
    fraction = airlight.occlusion_fraction(image, Light.parallel(0), occlusion="luminance", threshold=0.5, density=0.3)
    assert fraction[20, 45] < 0.98 and fraction[20, 80] == 1


def test_any_shape_of_image() -> None:
    for shape in ((1, 400, 3), (400, 1, 3), (1, 1, 3)):
        out = airlight.light_shafts(np.ones(shape, np.float32), Light.parallel(77), occlusion="none", decay=1.0, exposure=1.0)
        np.testing.assert_allclose(out, 1, atol=3e-3)


def test_how_angles_are_written() -> None:
    light = place(read_light("30;color=1,.5,0;strength=2", parallel=True), None, "bottom")  # type: ignore[arg-type]
    assert light == Light.parallel(30, (1, 0.5, 0), 2.0) and light.rgb == (2, 1, 0)
    for bad in ("up", "nan", "inf", "30;strength=-1", "30,40", "30;colour=1"):
        with pytest.raises(AirlightError) as caught:
            read_light(bad, parallel=True)
        assert "\n" not in str(caught.value) and (bad not in ("nan", "inf") or "angle" in str(caught.value))
