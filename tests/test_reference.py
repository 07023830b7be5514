"""The float64 reference against hand loops and closed forms."""

import math

import numpy as np
import pytest

from airlight.errors import AirlightError
from airlight.lights import Light
from airlight.options import Parameters, build, presets
from airlight.reference import radial as ref

RNG = np.random.default_rng(1)
COMMON = {"density": 0.9, "border": "clamp"}


def slow_bilinear(image, x, y, border):
    """One sample as a GPU takes it, texel by texel."""
    h, w, _ = image.shape
    u, v = x * w - 0.5, y * h - 0.5
    i, j = math.floor(u), math.floor(v)
    total = np.zeros(3)
    for b in (0, 1):
        for a in (0, 1):
            factor = (u - i if a else 1 - u + i) * (v - j if b else 1 - v + j)
            ii, jj = i + a, j + b
            inside = 0 <= ii < w and 0 <= jj < h
            if inside or border == "clamp":
                total += factor * image[min(max(jj, 0), h - 1), min(max(ii, 0), w - 1)]
    return total


@pytest.mark.parametrize("border", ["clamp", "black"])
def test_bilinear_is_the_gpu_s(border):
    image = RNG.random((3, 5, 3))
    for x, y in RNG.uniform(-0.5, 1.5, (200, 2)):
        np.testing.assert_allclose(ref.bilinear(image, x, y, border), slow_bilinear(image, x, y, border), atol=1e-12)


def test_black_fades_over_the_last_half_pixel():
    image = np.ones((4, 4, 3))
    values = ref.bilinear(image, [0.125, 0.0, -0.0625, -0.125, -9], [0.5] * 5, "black")[:, 0]
    np.testing.assert_allclose(values, [1, 0.5, 0.25, 0, 0])
    assert np.all(ref.bilinear(image, [-9.0, 9.0], [5.0, -5.0], "clamp") == 1)


@pytest.mark.parametrize("border", ["clamp", "black"])
@pytest.mark.parametrize("normalization", ["mean", "listing"])
@pytest.mark.parametrize("light", [(0.3, 0.4), (-0.7, 1.8)])
def test_direct_sum_is_the_hand_loop(border, normalization, light):
    image = RNG.random((3, 3, 3))
    n, density, decay, weight, exposure = 4, 0.9, 0.8, 0.7, 1.3
    out = ref.direct_sum(
        image, light, samples=n, density=density, decay=decay, weight=weight, exposure=exposure, normalization=normalization, border=border
    )
    for row in range(3):
        for column in range(3):
            x, y = (column + 0.5) / 3, (row + 0.5) / 3
            if normalization == "listing":  # the printed listing, line by line
                dx, dy = (x - light[0]) / n * density, (y - light[1]) / n * density
                color, illumination = image[row, column].copy(), 1.0
                for _ in range(n):
                    x, y = x - dx, y - dy
                    color += slow_bilinear(image, x, y, border) * illumination * weight
                    illumination *= decay
                expected = color * exposure
            else:
                expected = np.zeros(3)
                for i in range(n):
                    at = x - i * (x - light[0]) * density / n, y - i * (y - light[1]) * density / n
                    expected += exposure * decay**i * weight * slow_bilinear(image, *at, border) / n
            np.testing.assert_allclose(out[row, column], expected, atol=1e-12)


@pytest.mark.parametrize("preset", ["vesper", "vesper-scene"])
@pytest.mark.parametrize("light", [(0.3, 0.4), (-0.7, 1.8)])
def test_presets_of_vesper_are_its_loop(preset, light):
    image = np.random.default_rng(2).random((9, 11, 3))
    weight, exposure, decay, density, samples = 0.8, 0.05, 0.99, 0.8, 150
    at = ref.pixel_centres(11, 9)
    delta, illumination, total = (at - light) * density / samples, 1.0, image.copy()
    for _ in range(1, samples):
        at = at - delta
        total += ref.bilinear(image, at[..., 0], at[..., 1]) * illumination * weight
        illumination *= decay
    p = build(presets.load(preset))[Parameters]
    assert (p.method, p.jitter, p.border) == ("radial", None, "clamp")
    names = ("samples", "density", "decay", "weight", "exposure", "normalization")
    out = ref.direct_sum(image, light, **{name: getattr(p, name) for name in names})
    np.testing.assert_allclose(out, total * exposure, rtol=1e-13)


@pytest.mark.parametrize("lam", [0.0, 0.5, 3.0])
def test_constant_image(lam):
    image = np.full((5, 7, 3), 2.0)
    expected = 2 * (1 - math.exp(-lam)) / lam if lam else 2.0
    np.testing.assert_allclose(ref.converged(image, (0.2, 0.9), lam=lam, taps=3000, **COMMON), expected, rtol=1e-6)


def test_left_sum_bias():
    """On a constant, Eq. 4 exceeds its limit by lam / (n (1 - e^(-lam/n))) - 1, about lam / 2n; midpoints do not."""
    n, lam = 16, 6.3
    decay = math.exp(-lam / n)
    image = np.ones((2, 2, 3))
    limit = (1 - math.exp(-lam)) / lam
    left = ref.direct_sum(image, (0.5, 0.5), samples=n, decay=decay, **COMMON)
    middle = ref.direct_sum(image, (0.5, 0.5), samples=n, decay=decay, jitter="midpoint", **COMMON)
    np.testing.assert_allclose(left / limit, lam / (n * (1 - decay)), rtol=1e-12)
    assert left[0, 0, 0] / limit > 1.2
    np.testing.assert_allclose(middle / limit, 1, rtol=(lam / n) ** 2 / 20)


def test_one_pixel_analytic():
    """A column of light in a row of pixels is a tent of half width 1 px: its integral over q is 1 px."""
    w, lit = 64, 8
    image = np.zeros((1, w, 3))
    image[0, lit] = 1
    light = (0.5 / w, 0.5)  # at the centre of pixel 0
    s = ref.converged(image, light, density=1.0, lam=0.0, taps=20000)[0, :, 0]
    r = np.arange(w)
    np.testing.assert_allclose(s[lit + 1 :], 1 / r[lit + 1 :], rtol=1e-3)
    assert np.all(s[:lit] == 0)
    lam = 2.0  # e^(-lam s) at s = 1 - q/r hardly varies over the tent
    decayed = ref.converged(image, light, density=1.0, lam=lam, taps=20000)[0, 40, 0]
    assert decayed == pytest.approx(math.exp(-lam * (1 - lit / 40)) / 40, rel=2e-3)


def test_linear_and_additive():
    a, b = RNG.random((2, 6, 9, 3))
    arguments = {"light": (0.7, -0.2), "lam": 1.0, "taps": 200, **COMMON}
    both = ref.converged(2 * a + 3 * b, **arguments)
    np.testing.assert_allclose(both, 2 * ref.converged(a, **arguments) + 3 * ref.converged(b, **arguments), rtol=1e-12)


def test_midpoints_converge_to_the_integral():
    image = RNG.random((12, 16, 3))
    lam, light = 1.5, (0.4, 0.3)
    truth = ref.converged(image, light, lam=lam, **COMMON)
    errors = [
        np.abs(ref.direct_sum(image, light, samples=n, decay=math.exp(-lam / n), jitter="midpoint", **COMMON) - truth).max()
        for n in (20, 80, 320)
    ]
    assert errors[0] > 3 * errors[1] > 9 * errors[2]
    assert ref.convergence_error(image, light, lam=lam, **COMMON) < 1e-5


def test_points_offsets_and_float32():
    image = RNG.random((10, 14, 3))
    light = (0.5, 0.1)
    grid = ref.pixel_centres(14, 10)
    full = ref.converged(image, light, lam=1.0, taps=100, **COMMON)
    some = RNG.integers(0, 140, 20)
    points = grid.reshape(-1, 2)[some]
    np.testing.assert_allclose(ref.converged(image, light, lam=1.0, taps=100, points=points, **COMMON), full.reshape(-1, 3)[some])
    np.testing.assert_allclose(ref.converged(image, light, lam=1.0, taps=100, dtype=np.float32, **COMMON), full, rtol=1e-4)
    offsets = np.full((10, 14), 0.5)
    arguments = {"samples": 9, "decay": 0.9, **COMMON}
    np.testing.assert_allclose(
        ref.direct_sum(image, light, jitter=offsets, **arguments), ref.direct_sum(image, light, jitter="midpoint", **arguments)
    )


def test_occlusion_of_a_half_plane():
    """A screen covers the left half; the light is at the right: the covered part of a ray is its part left of the middle."""
    w = 200
    m = np.zeros((4, w))
    m[:, w // 2 :] = 1
    d = ref.occlusion_fraction(m, (1.0, 0.5), density=1.0)[2]
    x = (np.arange(w) + 0.5) / w
    np.testing.assert_allclose(d, np.clip((0.5 - x) / (1 - x), 0, 1), atol=5e-3)
    one = ref.occlusion_fraction(m, (1.0, 0.5), density=1.0, samples=1)  # one sample: the pixel itself
    np.testing.assert_allclose(one, 1 - m, atol=1e-12)
    outside = ref.occlusion_fraction(np.ones((4, 4)), (0.5, -50.0), density=1.0, border="black")
    assert outside.min() > 0.95


def test_mask_and_source():
    grey = np.array([0.0, 0.6, 0.8, 1.0, np.nan, np.inf, -1.0, 1e9])
    image = np.repeat(grey[None, :, None], 3, axis=2)
    p = Parameters(threshold=0.8, smoothness=0.2)
    np.testing.assert_allclose(ref.mask(image, None, None, p)[0], [0, 0, 0.5, 1, 0, 0, 0, 1], atol=1e-12)
    hard = Parameters(threshold=0.8, smoothness=0.0)
    np.testing.assert_allclose(ref.source(image, hard)[0, :, 0], [0, 0, 0.8, 1, 0, 0, 0, 65504])
    alpha = np.linspace(0, 1, 8)[None]
    np.testing.assert_allclose(ref.source(image, Parameters(occlusion="alpha"), alpha=alpha)[0, :, 1], 1 - alpha[0])
    far = Parameters(occlusion="depth", threshold=0.5, smoothness=0.0)
    assert ref.mask(image, None, alpha, far).sum() == 4
    assert np.all(ref.source(image, Parameters(occlusion="none"), user_mask=np.zeros((1, 8))) == 0)
    for name in ("alpha", "depth"):
        with pytest.raises(AirlightError, match=name):
            ref.mask(image, None, None, Parameters(occlusion=name))


def test_layer():
    image = RNG.random((6, 8, 3)) * 2
    sun, lamp = Light((0.2, 0.3), color=(1, 0.5, 0.25), strength=2), Light((0.9, 1.4))
    p = Parameters(samples=40, decay=0.95, exposure=0.7, weight=0.6)
    emitted = ref.source(image, p)
    s = [ref.converged(emitted, x.position, density=p.density, lam=p.lam, taps=300) for x in (sun, lamp)]
    expected = 0.42 * (s[0] * [2, 1, 0.5] + s[1])
    np.testing.assert_allclose(ref.layer(image, [sun, lamp], p, taps=300), expected, rtol=1e-12)

    # the listing's limit: many samples of the listing at the same lam, its sum scaled by their number
    many = Parameters(method="radial", samples=2000, decay=0.95 ** (40 / 2000), normalization="listing", exposure=0.7, weight=0.6)
    limit = Parameters(samples=2000, decay=many.decay, normalization="listing", exposure=0.7, weight=0.6)
    np.testing.assert_allclose(ref.layer(image, [lamp], limit, taps=3000), ref.layer(image, [lamp], many), rtol=2e-3)
    flat = Parameters(decay=1.0, samples=7, normalization="listing", occlusion="none", exposure=1.0)
    np.testing.assert_allclose(ref.layer(np.ones((2, 2, 3)), [lamp], flat, taps=10), 8)
    with pytest.raises(AirlightError, match="offsets"):
        ref.layer(image, [sun], Parameters(method="radial", jitter="blue"))
