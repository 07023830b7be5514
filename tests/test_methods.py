"""Every method on the GPU against the float64 reference."""

import warnings
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import airlight
from airlight.errors import AirlightError, AirlightWarning
from airlight.files import read_image
from airlight.gpu import device as gpu_device
from airlight.lights import Light
from airlight.reference import radial as reference
from airlight.reference.jitter import offsets
from airlight.reference.scenes import foliage
from airlight.scatter.epipolar import epipolar
from airlight.scatter.epipolar.moments import mixture
from airlight.scatter.methods import METHODS

PHOTOS = Path(__file__).parent.parent / "examples" / "photos"
SIZE = (1920, 1080)
LIGHTS = {"sun": (0.60016, 0.35019), "edge": (0.02, 0.3), "outside": (1.2, -0.25)}
LENGTHS = ((0.8, 1.5), (0.926, 3.24), (0.96, 6.3), (1.0, 0.0))


@lru_cache
def picture(name: str) -> np.ndarray:
    """(1080, 1920, 3), as the half floats that the GPU sees."""
    if name == "foliage":
        image = foliage(*SIZE)
    else:
        photo = read_image(PHOTOS / name).linear()
        y, x = (
            (np.indices((SIZE[1], SIZE[0])) + 0.5) * np.array([photo.shape[0] / SIZE[1], photo.shape[1] / SIZE[0]])[:, None, None]
        ).astype(int)
        image = photo[y, x]
    return image.astype(np.float16).astype(np.float32)


@lru_cache
def points(sun: tuple[float, float]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Random pixels (x, y) and the share of the image that each stands for; many around the sun, where large errors are rare but large."""
    width, height = SIZE
    rng = np.random.default_rng(11)
    y, x = np.indices((height, width)).reshape(2, -1)
    near = np.hypot(x - sun[0] * width, y - sun[1] * height) < 0.015 * width
    chosen = [rng.choice(np.flatnonzero(part), n, replace=False) for part, n in ((near, 250), (~near, 900))]
    share = np.concatenate([np.full(len(c), part.mean() / len(c)) for c, part in zip(chosen, (near, ~near), strict=True)])
    at = np.concatenate(chosen)
    return x[at], y[at], share


def errors(name: str, light: tuple[float, float], density: float, lam: float, quality: str) -> tuple[float, float, float]:
    """rmse and max over the reference's maximum; rmse over its mean outside a disc of 2 % of the width around the light."""
    width, height = SIZE
    image = picture(name)
    x, y, share = points(LIGHTS["sun"])
    at = np.stack([(x + 0.5) / width, (y + 0.5) / height], axis=1)
    truth = reference.converged(image, light, density=density, lam=lam, points=at, dtype=np.float32)
    out = airlight.light_shafts(image, light, occlusion="none", density=density, samples=1000, decay=float(np.exp(-lam / 1000)),
                                weight=1, exposure=1, quality=quality)[y, x]  # fmt: skip
    square = ((out - truth) ** 2).mean(axis=1)
    away = np.hypot((at[:, 0] - light[0]) * width, (at[:, 1] - light[1]) * height) > 0.02 * width
    part = np.where(away, share, 0)
    local = np.sqrt(square @ part * part.sum()) / (truth.mean(axis=1) @ part)
    return float(np.sqrt(square @ share) / truth.max()), float(np.abs(out - truth).max() / truth.max()), float(local)


BOUNDS = {"normal": (0.0012, 0.03, 0.008), "final": (0.0004, 0.015, 0.005)}


@pytest.mark.parametrize("density, lam", LENGTHS)
@pytest.mark.parametrize("where", sorted(LIGHTS))
@pytest.mark.parametrize("quality", sorted(BOUNDS))
def test_epipolar_at_full_hd_on_foliage(quality: str, where: str, density: float, lam: float) -> None:
    found = errors("foliage", LIGHTS[where], density, lam, quality)
    assert all(f <= b for f, b in zip(found, BOUNDS[quality], strict=True)), found


@pytest.mark.slow
@pytest.mark.parametrize("density, lam", LENGTHS)
@pytest.mark.parametrize(
    "name, sun", [("beacon-street-sunset.jpg", (0.882, 0.466)), ("casa-mila.jpg", (0.484, 0.403)), ("hill-sunset.jpg", (0.498, 0.412))]
)
@pytest.mark.parametrize("quality", sorted(BOUNDS))
def test_epipolar_at_full_hd_on_photographs(quality: str, name: str, sun: tuple[float, float], density: float, lam: float) -> None:
    for light in (sun, LIGHTS["edge"], LIGHTS["outside"]):
        found = errors(name, light, density, lam, quality)
        assert all(f <= b for f, b in zip(found, BOUNDS[quality], strict=True)), (light, found)


@pytest.mark.slow
@pytest.mark.parametrize("lam", [0, 1.5, 6.3, 30, 74])
@pytest.mark.parametrize("density", [0.05, 0.3, 0.8, 1, 1.5])
def test_final_for_every_window(density: float, lam: float) -> None:
    assert errors("foliage", LIGHTS["sun"], density, lam, "final")[0] <= 0.001


positions = st.one_of(
    st.tuples(st.floats(0, 1), st.floats(0, 1)),
    st.tuples(st.sampled_from([0.0, 1.0]), st.floats(0, 1)),
    st.tuples(st.floats(1, 3), st.floats(-2, 0)),
    st.tuples(st.floats(-300, 300), st.floats(-300, 300)),
)


@st.composite
def cases(draw: st.DrawFn) -> tuple[np.ndarray, tuple[float, float], dict[str, object]]:
    width, height = draw(st.integers(1, 60)), draw(st.integers(1, 60))
    image = np.random.default_rng(draw(st.integers(0, 2**31))).random((height, width, 3)).astype(np.float32) ** 3
    place = draw(positions)
    if draw(st.booleans()):
        place = ((draw(st.integers(0, width - 1)) + 0.5) / width, (draw(st.integers(0, height - 1)) + 0.5) / height)
    keywords = {
        "samples": draw(st.integers(1, 80)),
        "density": draw(st.sampled_from([0.05, 0.3, 0.8, 1.0, 1.5, 4.0])),
        "decay": draw(st.sampled_from([1.0, 0.99, 0.97, 0.9, 0.5])),
        "weight": draw(st.floats(0.01, 2)),
        "exposure": draw(st.floats(0.01, 2)),
        "border": draw(st.sampled_from(["clamp", "black"])),
        "normalization": draw(st.sampled_from(["mean", "listing"])),
    }
    return image, place, keywords


@given(cases(), st.sampled_from(["fixed", "midpoint", "gradient", "blue"]))
def test_radial_is_the_equation(case: tuple, jitter: str) -> None:
    image, place, keywords = case
    p = airlight.Parameters(method="radial", occlusion="none", jitter=jitter, **keywords)
    truth = reference.layer(image, [Light(place)], p, offsets=offsets(image.shape[1], image.shape[0], jitter))
    out = airlight.light_shafts(image, place, method="radial", occlusion="none", jitter=jitter, **keywords)
    assert np.abs(out - truth).max() <= 4e-3 * max(truth.max(), 1e-3)


@settings(max_examples=20)
@given(cases())
def test_epipolar_is_the_limit(case: tuple) -> None:
    image, place, keywords = case
    p = airlight.Parameters(method="epipolar", occlusion="none", **keywords)
    truth = reference.layer(image, [Light(place)], p)
    out = airlight.light_shafts(image, place, quality="final", occlusion="none", **keywords)
    assert out.min() >= 0
    assert np.sqrt(((out - truth) ** 2).mean()) <= 0.01 * max(truth.max(), 1e-3)


def test_epipolar_is_linear_and_adds_lights() -> None:
    image = foliage(320, 200)
    keywords = {"occlusion": "none", "density": 0.9, "samples": 100, "decay": 0.97}
    one = airlight.light_shafts(image, (0.6, 0.35), **keywords)
    for factor in (2.0**-20, 1 / 3, 64.0):
        scaled = airlight.light_shafts(image * np.float32(factor), (0.6, 0.35), **keywords)
        np.testing.assert_allclose(scaled, factor * one, rtol=4e-3, atol=1e-3 * factor * one.max())
    two = airlight.light_shafts(image, [Light((0.6, 0.35)), Light((1.4, 0.2), (1, 0.5, 0.25), 2.0)], **keywords)
    other = airlight.light_shafts(image, (1.4, 0.2), **keywords) * np.array([2.0, 1.0, 0.5])
    np.testing.assert_allclose(two, one + other, rtol=4e-3, atol=1e-3 * two.max())
    again = airlight.light_shafts(image, (0.6, 0.35), **keywords)
    assert again.tobytes() == one.tobytes()


def test_far_light() -> None:
    """A hundred widths away: nearly all of a ray is the border's pixels."""
    image = np.zeros((300, 400, 3), np.float32)
    image[:, 0] = np.random.default_rng(3).random((300, 1)).astype(np.float32)
    y = np.arange(5, 295, 7)
    at = np.stack([np.full(len(y), 300.5 / 400), (y + 0.5) / 300], axis=1)
    truth = reference.converged(image, (-100, 0.5), density=0.1, lam=0.0, points=at, taps=20000)
    out = airlight.light_shafts(image, (-100, 0.5), occlusion="none", density=0.1, decay=1.0, exposure=1, quality="final")
    np.testing.assert_allclose(out[y, 300], truth, atol=6e-3)


@pytest.mark.parametrize("scale", [0.5, 0.25])
def test_lower_resolutions_resemble_the_full_one(scale: float) -> None:
    image = foliage(640, 360)
    keywords = {"method": "radial", "occlusion": "none", "samples": 200, "jitter": "midpoint", "density": 0.9}
    full = airlight.light_shafts(image, (0.6, 0.35), **keywords)
    low = airlight.light_shafts(image, (0.6, 0.35), scale=scale, **keywords)
    away = np.hypot(*(np.indices(full.shape[:2]) + 0.5 - np.array([126, 384])[:, None, None])) > 40
    assert np.sqrt(((full - low)[away] ** 2).mean()) < 0.12 * full[away].mean()


def test_sources_and_occlusion_fraction() -> None:
    rng = np.random.default_rng(0)
    rgba = rng.random((40, 50, 4)).astype(np.float32)
    depth, mask = rng.random((2, 40, 50)).astype(np.float32)
    for occlusion, extra in (("luminance", {}), ("alpha", {}), ("depth", {"depth": depth}), ("none", {"mask": mask}), ("none", {})):
        keywords = {"method": "radial", "samples": 30, "threshold": 0.4, "smoothness": 0.1, "occlusion": occlusion}
        p = airlight.Parameters(**keywords)
        user = extra.get("mask")
        truth = reference.layer(rgba[..., :3], [Light((0.3, 0.3))], p, alpha=rgba[..., 3], depth=depth, user_mask=user)
        out = airlight.light_shafts(rgba, (0.3, 0.3), **keywords, **extra)
        np.testing.assert_allclose(out, truth, atol=4e-3 * truth.max())
        m = reference.mask(rgba[..., :3], rgba[..., 3], depth, p) * (1 if user is None else user)
        fraction = airlight.occlusion_fraction(rgba, (0.3, 0.3), **keywords, **extra)
        np.testing.assert_allclose(fraction, reference.occlusion_fraction(m, (0.3, 0.3), density=p.density, samples=30), atol=3e-3)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
def test_no_light_gives_the_input_back(dtype: type) -> None:
    rng = np.random.default_rng(1)
    image = rng.random((30, 40, 3)).astype(dtype) if dtype is np.float32 else rng.integers(0, np.iinfo(dtype).max, (30, 40, 3), dtype)
    out = airlight.add_light_shafts(image, Light((0.5, 0.5), strength=0.0))
    assert out.dtype == dtype and np.array_equal(out, image)


def test_mixture_meets_its_tolerance() -> None:
    for density in (0.05, 0.3, 0.8, 1.0):
        for lam in (0.0, 0.3, 1.5, 3.24, 6.3, 10, 30, 74):
            mix = mixture(density, lam)
            x = np.linspace(max(1 - density, 1e-3), 1, 2001)
            weight = np.exp(-lam / density * (1 - x))
            fit = (x[:, None] ** mix.p) @ (mix.c * density)
            assert np.sqrt(((fit - weight) ** 2).mean()) <= 6e-3 * np.sqrt((weight**2).mean())
            assert (mix.p >= 0).all()


def test_bad_input_is_refused_in_one_line() -> None:
    image = np.ones((4, 5, 3), np.float32)
    for call in (
        lambda: airlight.light_shafts(image, (np.nan, 0)),
        lambda: airlight.light_shafts(image, (0.5, 0.5), samples=0),
        lambda: airlight.light_shafts(image, (0.5, 0.5), decay=1.5),
        lambda: airlight.light_shafts(image, (0.5, 0.5), nonsense=1),
        lambda: airlight.light_shafts(image, (0.5, 0.5), occlusion="depth"),
        lambda: airlight.light_shafts(image, (0.5, 0.5), mask=np.ones((3, 3))),
        lambda: airlight.light_shafts(np.ones((2, 3, 7)), (0.5, 0.5)),
        lambda: airlight.light_shafts(np.ones((1, 20000, 3), np.float32), (0.5, 0.5)),
    ):
        with pytest.raises(AirlightError) as caught:
            call()
        assert "\n" not in str(caught.value)


def test_without_an_adapter_the_reference_does_the_job(monkeypatch: pytest.MonkeyPatch) -> None:
    image = foliage(240, 160)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        truth = airlight.light_shafts(image, (0.6, 0.35), occlusion="none", density=0.9)
    monkeypatch.setattr(gpu_device, "adapters", list)
    gpu_device.open_device.cache_clear()
    try:
        with pytest.warns(AirlightWarning, match="no graphics adapter found.*install"):
            out = airlight.light_shafts(image, (0.6, 0.35), occlusion="none", density=0.9)
    finally:
        gpu_device.open_device.cache_clear()
    assert np.sqrt(((out - truth) ** 2).mean()) < 0.01 * truth.max()


@pytest.mark.parametrize("scale", [1.0, 0.5, 0.25])
def test_lights_add_at_every_resolution(scale: float) -> None:
    image = foliage(321, 203)
    keywords = {"method": "radial", "scale": scale, "occlusion": "none", "samples": 40, "density": 0.9}
    a, b = (airlight.light_shafts(image, place, **keywords) for place in ((0.6, 0.35), (0.2, 0.7)))
    both = airlight.light_shafts(image, [(0.6, 0.35), (0.2, 0.7)], **keywords)
    np.testing.assert_allclose(both, a + b, rtol=4e-3, atol=1e-3 * both.max())
    dark = airlight.light_shafts(image, [(0.6, 0.35), Light((0.2, 0.7), strength=0.0)], **keywords)
    np.testing.assert_allclose(dark, a, rtol=2e-3, atol=1e-4 * a.max())


@pytest.mark.parametrize("scale", [0.5, 0.25])
def test_black_is_black_at_lower_resolution(scale: float) -> None:
    image = np.ones((121, 203, 3), np.float32)
    keywords = {"method": "radial", "occlusion": "none", "border": "black", "jitter": "midpoint"}
    keywords |= {"samples": 400, "decay": 1.0, "density": 1.0}
    for place in ((2.0, 0.5), (0.5, -1.0), (0.4, 0.5)):
        full = airlight.light_shafts(image, place, **keywords)
        low = airlight.light_shafts(image, place, scale=scale, **keywords)
        assert np.abs(full - low).max() < 0.05 and np.abs(full - low).mean() < 0.005


@pytest.mark.parametrize("decay", [0.9, 0.4, 1e-6])
def test_any_lambda_is_finite_and_right_around_the_light(decay: float) -> None:
    """Up to 226,000: then a pixel sees itself alone, at 1 / lambda."""
    image = foliage(400, 300)
    lam = -16384 * np.log(decay)
    out = airlight.light_shafts(image, (0.6, 0.35), occlusion="none", samples=16384, decay=decay, exposure=lam, quality="final")
    assert np.isfinite(out).all()
    y, x = (np.indices(image.shape[:2]) + 0.5) / np.array([300, 400])[:, None, None]
    near = np.hypot((x - 0.6) * 400, (y - 0.35) * 300) < 18
    assert np.sqrt(((out - image)[near] ** 2).mean()) < 0.05 * image[near].mean()


def test_windows_around_the_light() -> None:
    """The pixels around the light, by the direct sum: also for rays beyond it, and for those that decay at once."""
    image = foliage(640, 400).astype(np.float16).astype(np.float32)
    y, x = np.mgrid[128:153:2, 372:397:2]
    at = np.stack([(x.ravel() + 0.5) / 640, (y.ravel() + 0.5) / 400], axis=1)
    for density, lam in ((1.0, 300.0), (4.0, 30.0), (16.0, 30.0), (0.9, 2.0)):
        truth = reference.converged(image, (0.6, 0.35), density=density, lam=lam, points=at, taps=30000).reshape(*x.shape, 3)
        keywords = {"density": density, "samples": 3000, "decay": float(np.exp(-lam / 3000)), "exposure": 1.0}
        out = airlight.light_shafts(image, (0.6, 0.35), occlusion="none", **keywords)[y, x]
        assert np.abs(out - truth).max() < 0.02 * truth.max(), (density, lam)


def test_a_sum_that_passes_a_texture_s_side_is_made_coarser() -> None:
    image = np.ones((64, gpu_device.open_device().max_side - 2, 3), np.float32)
    out = airlight.light_shafts(image, (0.0, 0.5), occlusion="none", quality="final", density=0.05, samples=100, decay=0.48, exposure=1.0)
    lam = -100 * np.log(0.48)
    np.testing.assert_allclose(out, (1 - np.exp(-lam)) / lam, rtol=2e-3)


def test_masks_lie_in_0_to_1() -> None:
    image = foliage(64, 40)
    full = airlight.light_shafts(image, (0.5, 0.5), occlusion="none")
    assert np.array_equal(airlight.light_shafts(image, (0.5, 0.5), occlusion=np.full((40, 64), 2.0)), full)
    assert airlight.light_shafts(image, (0.5, 0.5), occlusion=np.full((40, 64), -1.0)).max() == 0
    assert np.array_equal(airlight.light_shafts(image, (0.5, 0.5), occlusion=np.ones((40, 64), bool)), full)
    with pytest.raises(AirlightError, match="int64"):
        airlight.light_shafts(image, (0.5, 0.5), occlusion=np.ones((40, 64), int))


def test_numpy_numbers_are_numbers() -> None:
    p = airlight.Parameters(density=np.float32(0.5), samples=np.int64(50), decay=np.exp(-0.03))
    assert p == airlight.Parameters(density=0.5, samples=50, decay=float(np.exp(-0.03))) and type(p.samples) is int
    with pytest.raises(AirlightError):
        airlight.Parameters(samples=np.float64(50.5))


def check_lines(case: tuple) -> None:
    image, place, keywords = case
    image = np.repeat(np.repeat(image, 4, axis=0), 4, axis=1)[:90]
    p = airlight.Parameters(method="epipolar", occlusion="none", **keywords)
    truth = reference.layer(image, [Light(place)], p)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(epipolar, "direct_taps", lambda *_: 0)
        out = airlight.light_shafts(image, place, quality="final", occlusion="none", **keywords)
    assert out.min() >= 0
    assert np.sqrt(((out - truth) ** 2).mean()) <= 0.02 * max(truth.max(), 1e-3)


@pytest.mark.slow
@settings(max_examples=3)
@given(cases())
def test_lines_are_the_limit_where_no_ray_is_summed_directly(case: tuple) -> None:
    """Small images would take the direct sum: here they take the lines, but around the light."""
    check_lines(case)


@pytest.mark.slow
@settings(max_examples=60)
@given(cases())
def test_lines_are_the_limit_in_many_cases(case: tuple) -> None:
    check_lines(case)


@pytest.mark.parametrize("dtype", [np.float16, np.float32, np.float64])
def test_floats_stay_finite(dtype: type) -> None:
    image = np.full((40, 50, 3), 0.02, dtype)
    image[10:14, 20:24] = 60000
    image[30, 30] = np.nan
    with pytest.warns(AirlightWarning, match="mended"):
        out = airlight.add_light_shafts(image, (0.45, 0.3), exposure=50.0)
    assert out.dtype == dtype and np.isfinite(out).all()


@pytest.mark.parametrize("name", METHODS)
def test_the_code_that_the_table_of_methods_names_is_there(name):
    assert callable(METHODS[name].plan) and callable(METHODS[name].reference)
