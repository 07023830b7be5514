"""The chapter's other methods (bands, multipass, additive): the GPU against their float64 twins, and the twins against the truth."""

import time
import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import airlight
from airlight.errors import AirlightError
from airlight.gpu.device import Recording, open_device
from airlight.gpu.timing import run_ms
from airlight.lights import Light
from airlight.options import Parameters
from airlight.reference import additive, bands, fallback, multipass
from airlight.reference import radial as reference
from airlight.reference.scenes import foliage
from airlight.scatter.render import plan

METHODS = ("bands", "multipass", "additive")

lights = st.one_of(
    st.tuples(st.floats(0, 1), st.floats(0, 1)).map(Light),
    st.tuples(st.sampled_from([0.0, 0.5, 1.0]), st.sampled_from([0.0, 0.5, 1.0])).map(Light),
    st.tuples(st.floats(-2, 3), st.floats(-2, 3)).map(Light),
    st.tuples(st.floats(-300, 300), st.floats(-300, 300)).map(Light),
    st.integers(-180, 180).map(Light.parallel),
)


@st.composite
def cases(draw: st.DrawFn) -> tuple[np.ndarray, Light, dict[str, object]]:
    width, height = draw(st.integers(1, 50)), draw(st.integers(1, 50))
    image = np.random.default_rng(draw(st.integers(0, 2**31))).random((height, width, 3)).astype(np.float16).astype(np.float32)
    keywords = {
        "samples": draw(st.integers(1, 60)),
        "density": draw(st.sampled_from([0.05, 0.3, 0.8, 0.995, 1.0])),
        "decay": draw(st.sampled_from([1.0, 0.99, 0.97, 0.9])),
        "weight": draw(st.floats(0.1, 2)),
        "exposure": draw(st.floats(0.01, 2)),
        "border": draw(st.sampled_from(["clamp", "black"])),
    }
    return image, draw(lights), keywords


@pytest.mark.parametrize("method", METHODS)
@settings(max_examples=25)
@given(cases())
def test_the_gpu_is_its_twin(method: str, case: tuple) -> None:
    image, light, keywords = case
    p = Parameters(method=method, occlusion="none", **keywords)
    truth = reference.layer(image, [light], p)
    out = airlight.light_shafts(image, light, method=method, occlusion="none", **keywords)
    off = np.abs(out - truth)
    if method == "additive":  # a product that lies by a half may round either way in f32, to the next code
        code = p.exposure / 255
        assert off.max() <= (1 + 0.1 * p.samples) * code + 1e-3 * truth.max() and off.mean() <= 0.5 * code + 1e-3 * truth.max()
    else:
        assert off.max() <= 4e-3 * max(truth.max(), 1e-3)


@pytest.mark.parametrize("density, lam", [(0.6, 0.0), (0.926, 3.24), (1.0, 0.0), (1.0, 2.0)])
@pytest.mark.parametrize("at", [(0.6, 0.35), (0.02, 0.3), (1.2, -0.25)])
def test_bands_and_multipass_near_the_truth(at: tuple[float, float], density: float, lam: float) -> None:
    """On a smooth image the methods' own errors are small; an even image is exact."""
    x, y = np.meshgrid((np.arange(96) + 0.5) / 96, (np.arange(54) + 0.5) / 54)
    image = np.repeat((1 + 0.8 * np.sin(9 * x + 3) * np.cos(7 * y))[..., None], 3, axis=2)
    truth = reference.converged(image, at, density=density, lam=lam, border="clamp", taps=600)
    for method, most in ((bands.bands, 0.025), (multipass.multipass, 0.02)):
        out = method(image, at, density=density, lam=lam)
        assert np.sqrt(((out - truth) ** 2).mean()) <= most * truth.mean(), method
        even = method(np.ones((9, 16, 1)), at, density=density, lam=lam)
        np.testing.assert_allclose(even, -np.expm1(-lam) / lam if lam else 1.0, rtol=3e-3)


def test_geometric_steps_and_not_arithmetic_ones() -> None:
    """Passes of equal steps do not multiply to a sum along the ray: beside a small bright sun the difference is large."""
    image = foliage(192, 108).astype(float)
    truth = reference.converged(image, (0.6, 0.35), density=1.0, lam=0.0, taps=800)
    forms = (multipass.multipass, multipass.arithmetic)
    off = [np.sqrt(((form(image, (0.6, 0.35), density=1.0, lam=0.0) - truth) ** 2).mean()) for form in forms]
    assert off[1] > 5 * off[0]


def test_bands_are_the_chapter_s_recurrence() -> None:
    """Along a row through the light: S_c = ((c - 1) S_{c-1} + I) / c at the bands' borders, half a pixel on."""
    row = np.random.default_rng(8).random(30)
    image = np.repeat(row[None, :, None], 3, axis=2)
    out = bands.bands(image, (0.5 / 30, 0.5), density=1.0, lam=0.0)[0, :, 0]
    s = row[0]
    for i in range(1, 30):  # the light's pixel counts for the half that lies on this side
        c = i + 0.5
        own = ((c - 1) * s + 0.5 * row[i]) / (c - 0.5)
        assert out[i] == pytest.approx(own, rel=1e-12)
        s = ((c - 1) * s + row[i]) / c


def test_additive_is_blending() -> None:
    """Buffers of integers, blended by hand: rounding, saturation, what is too faint for a code is lost."""
    image = np.full((1, 4, 3), 1.0)
    p = Parameters(method="additive", samples=100, decay=1.0, exposure=1.0, weight=1.0)
    buffer = 0
    for _ in range(100):
        buffer = min(255, buffer + int(255 / 100 + 0.5))
    assert buffer == 255  # where 250 would be the sum of what should have been added
    np.testing.assert_allclose(additive.additive(image, (0.5, 0.5), p), buffer / 255)
    faint = additive.additive(0.19 * image, (0.5, 0.5), p)
    assert np.all(faint == 0) and np.all(additive.additive(0.2 * image, (0.5, 0.5), p) == 100 / 255)
    hdr = additive.additive(200 * image, (0.5, 0.5), p)
    assert np.all(hdr == 1)


def test_the_stencil_draws_all_of_a_pixel_or_nothing() -> None:
    rng = np.random.default_rng(9)
    image, mask = rng.random((40, 60, 3)).astype(np.float32), rng.random((40, 60)).astype(np.float32)
    keywords = {"method": "additive", "samples": 20, "occlusion": "none"}
    soft = airlight.light_shafts(image, (0.4, 0.4), mask=mask, **keywords)
    hard = airlight.light_shafts(image, (0.4, 0.4), mask=(mask >= 0.5).astype(np.float32), **keywords)
    assert np.array_equal(soft, hard) and soft.any()
    p = Parameters(threshold=0.5, smoothness=0.3, **{**keywords, "occlusion": "luminance"})
    drawn = reference.source(image, p)
    assert np.all((drawn == 0) | (drawn == image)) and (drawn == 0).any() and drawn.any()


@pytest.mark.parametrize("method", METHODS)
def test_lights_add_up_and_runs_repeat(method: str) -> None:
    image = foliage(96, 64)
    keywords = {"method": method, "occlusion": "none", "density": 0.9, "samples": 60, "decay": 0.97}
    ones = [Light((0.6, 0.35)), Light((1.4, 0.2), (1, 0.5, 0.25), 2.0), Light.parallel(120)]
    both = airlight.light_shafts(image, ones, **keywords)
    np.testing.assert_allclose(both, sum(airlight.light_shafts(image, one, **keywords) for one in ones), atol=3e-3 * both.max())
    assert airlight.light_shafts(image, ones, **keywords).tobytes() == both.tobytes()
    codes = np.rint(255 * np.minimum(image, 1)).astype(np.uint8)
    assert airlight.add_light_shafts(codes, (0.6, 0.35), method=method).shape == codes.shape
    m = airlight.occlusion_fraction(image, (0.6, 0.35), method=method, density=0.9)
    truth = airlight.occlusion_fraction(image, (0.6, 0.35), density=0.9)
    assert np.abs(m - truth).mean() < 0.05


@pytest.mark.parametrize("method", METHODS)
def test_without_an_adapter_the_twin_does_it(method: str) -> None:
    image = foliage(80, 60)
    p = Parameters(method=method, samples=40, density=0.9, occlusion="none")
    out = fallback.layer(image, [Light((0.6, 0.35))], p)
    truth = reference.layer(image, [Light((0.6, 0.35))], p)
    np.testing.assert_allclose(out, truth, atol=1e-5 * truth.max())


def test_what_makes_no_sense_is_refused() -> None:
    image = np.ones((8, 8, 3), np.float32)
    for method in METHODS:
        for bad in ({"normalization": "listing"}, {"scale": 0.5}):
            with pytest.raises(AirlightError, match=method):
                Parameters(method=method, **bad)
    for method in ("bands", "multipass"):
        p = Parameters(method=method, density=1.5, occlusion="none")
        for call in (
            lambda p=p: airlight.light_shafts(image, (0.5, 0.5), method=p.method, density=1.5),
            lambda p=p: reference.layer(image, [Light((0.5, 0.5))], p),
        ):
            with pytest.raises(AirlightError, match="at most 1"):
                call()
        long = airlight.light_shafts(image, Light.parallel(40), method=method, density=1.5, occlusion="none", decay=1.0, exposure=1.0)
        np.testing.assert_allclose(long, 1, rtol=4e-3)  # in image widths it may be longer


def test_an_interrupt_need_not_wait_for_bands(monkeypatch: pytest.MonkeyPatch) -> None:
    """Some 1,200 dispatches, submitted 256 at a time: none takes long."""
    device = open_device()
    source, layer = (device.texture(1920, 1080, "rgba16float") for _ in range(2))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        (step,), _ = plan(device, (1920, 1080), [Light((0.4, 0.4))], Parameters(method="bands", density=0.926), source, layer)
    assert step.count > 1000
    run_ms(device, step.record)
    waits: list[float] = []
    pause = Recording.pause

    def timed(encoder: Recording) -> None:
        start = time.perf_counter()
        pause(encoder)
        waits.append(time.perf_counter() - start)

    monkeypatch.setattr(Recording, "pause", timed)
    run_ms(device, step.record)
    assert len(waits) == -(-step.count // 256) and np.median(waits) < 0.5
