"""Shader functions that several passes share, each over random arrays against its float64 twin: colours, positions, noise."""

import numpy as np
import pytest
from calling import call

from airlight.gpu.structs import struct_dtype
from airlight.reference import angles, bands, colour, jitter, radial, raster, scene

RNG = np.random.default_rng(15)
# (n, 3) linear: usual ones, from near black to far beyond white, and the ends of what a half float holds
COLORS = np.concatenate([RNG.random((500, 3)), np.exp(RNG.uniform(-12, 11, (500, 3))), [[0, 0, 0], [1, 1, 1], [65504, 0, 1e-8]]])
COLORS = COLORS.astype(np.float32)
FLOAT = 2e-6  # some roundings of float32, relative


def test_luminance() -> None:
    np.testing.assert_allclose(call("wgsl/luminance.wgsl", "luminance", [COLORS]), colour.luminance(COLORS.astype(float)), rtol=FLOAT)


def test_srgb() -> None:
    """Powers of drivers are good to some 1e-5 of the value; around the kink the two branches agree to 1e-7."""
    codes = np.concatenate([np.linspace(0, 1, 1026), [0.04045, 0.040449, 0.040451]]).astype(np.float32)[:, None].repeat(3, 1)
    linear = call("wgsl/srgb.wgsl", "srgb_decode", [codes])
    np.testing.assert_allclose(linear, colour.srgb_decode(codes.astype(float)), rtol=2e-5, atol=1e-7)
    inside = COLORS[:1000].clip(0, 1)
    encoded = call("wgsl/srgb.wgsl", "srgb_encode", [inside])
    np.testing.assert_allclose(encoded, colour.srgb_encode(inside.astype(float)), rtol=2e-5, atol=1e-6)


def test_nearest_half() -> None:
    """Exactly its twin, and of normal halves what NumPy rounds to."""
    values = np.concatenate([COLORS, -COLORS, [[1e9, -1e9, 65520]]]).astype(np.float32)
    found = call("wgsl/half.wgsl", "nearest_half", [values])
    assert np.array_equal(found, colour.nearest_half(values))
    normal = np.abs(values) > 2.0**-14
    assert np.array_equal(found[normal], values.clip(-65504, 65504).astype(np.float16).astype(np.float32)[normal])


def test_unit_at() -> None:
    """Closer than Vulkan has drivers compute sines, which may be off by 2^-11: that is half a pixel at a thousand."""
    values = np.concatenate([RNG.uniform(-7, 7, 5000), RNG.uniform(-1000, 1000, 5000), np.arange(-8, 9) * np.pi / 4]).astype(np.float32)
    found = call("wgsl/unit_at.wgsl", "unit_at", [values])
    np.testing.assert_allclose(found, angles.unit_at(values.astype(float)), atol=2e-7)


def test_tangent() -> None:
    values = np.concatenate([RNG.uniform(-1.57, 1.57, 5000), RNG.uniform(-1e-3, 1e-3, 1000)]).astype(np.float32)
    found = call("scatter/march/steps.wgsl", "tangent", [values])
    expected = angles.tangent(values.astype(float))
    np.testing.assert_allclose(found, expected, rtol=1e-6)
    assert np.abs(expected).max() > 400


def test_smooth_step() -> None:
    x, low = RNG.uniform(-2, 2, (2, 2000))
    high = low + RNG.uniform(-2, 2, 2000)
    x, low, high = (v.astype(np.float32) for v in (x, low, high))
    apart = np.abs(high - low) > 0.01
    found = call("wgsl/smooth_step.wgsl", "smooth_step", [x, low, high])
    expected = colour.smooth_step(x.astype(float), low.astype(float), high.astype(float))
    np.testing.assert_allclose(found[apart], expected[apart], atol=5e-5)
    assert (expected[apart] == 0).any() and (expected[apart] == 1).any()


def test_fullscreen_corner() -> None:
    found = call("wgsl/fullscreen.wgsl", "fullscreen_corner", [np.arange(3), 0.75])
    assert np.array_equal(found, raster.fullscreen_corner(np.arange(3), 0.75))


def test_interleaved_gradient_noise() -> None:
    """Of float32: a place of a few thousand pixels times 52.98 leaves some 1e-2 of a turn."""
    p = RNG.integers(0, 500, (2000, 2))
    found = call("scatter/radial/radial.wgsl", "interleaved_gradient_noise", [p])
    off = np.abs(found - jitter.interleaved_gradient_noise(p))
    assert np.abs((off + 0.5) % 1 - 0.5).max() < 2e-3 and off.max() < 1
    assert 0.45 < found.mean() < 0.55 and found.std() > 0.25


@pytest.mark.parametrize(("peak", "floor"), [(1.0, 0.0), (0.3, 0.2**4), (20.0, 1.0)])
def test_subtract_haze(peak: float, floor: float) -> None:
    found = call("composite/composite.wgsl", "subtract_haze", [COLORS[:1000], peak, floor])
    np.testing.assert_allclose(found, colour.subtract_haze(COLORS[:1000].astype(float), peak, floor), rtol=3e-5, atol=1e-20)


def test_screened() -> None:
    before, added = COLORS[:1000], COLORS[::-1][:1000]
    found = call("composite/mix.wgsl", "screened", [before, added])
    np.testing.assert_allclose(found, colour.screened(before.astype(float), added.astype(float)), rtol=1e-5, atol=1e-7)
    assert (np.where(before < colour.WHITE, before, 0) + found < colour.WHITE + 1e-6).all()


@pytest.mark.parametrize("strength", [0.0, 0.4, 1.0])
def test_adapted(strength: float) -> None:
    show = np.zeros((), struct_dtype("viewer/show.wgsl", "Show"))
    show["scale"], show["white"], show["strength"] = 0.8, 3.0, strength
    found = call("viewer/show.wgsl", "adapted", [COLORS], bindings={"show": show})
    np.testing.assert_allclose(found, colour.adapted(COLORS.astype(float), 0.8, 3.0, strength), rtol=3e-5)


def test_log_luminance() -> None:
    found = call("pygfx/look.wgsl", "log_luminance", [COLORS])
    np.testing.assert_allclose(found, colour.log_luminance(COLORS.astype(float)), atol=1e-5)


def test_sound() -> None:
    colors = np.concatenate([COLORS, -COLORS])
    rgba = np.concatenate([colors, colors[::-1, :1]], axis=1)
    rgba[::5, :3] = (1e9, 66000, 65600)
    rgba[::7, 0], rgba[::11, 1], rgba[::13, 2], rgba[::17, 3] = np.nan, np.inf, -np.inf, np.nan
    assert np.array_equal(call("pygfx/drawn.wgsl", "sound", [rgba]), colour.sound(rgba))


@pytest.mark.parametrize("knee", [(0.2, 0.9), (0.5, 0.5), (0.7, 0.1)])
def test_soft_threshold(knee: tuple[float, float]) -> None:
    record = np.zeros((), struct_dtype("occlusion/mask.wgsl", "Knee"))
    record["low"], record["high"] = knee
    x = np.append(RNG.random(500), knee[0]).astype(np.float32)
    found = call("occlusion/mask.wgsl", "soft_threshold", [x], bindings={"knee": record})
    low, high = (float(np.float32(v)) for v in knee)
    np.testing.assert_allclose(found, radial.soft_threshold(low, high, x.astype(float)), atol=2e-6)


def test_picture_luminance() -> None:
    record = np.zeros((), struct_dtype("occlusion/mask.wgsl", "Knee"))
    record["luminance"] = weights = np.float32([0.27, 0.67, 0.06])
    found = call("occlusion/mask.wgsl", "picture_luminance", [COLORS], bindings={"knee": record})
    np.testing.assert_allclose(found, radial.picture_luminance(COLORS.astype(float), weights.astype(float)), rtol=FLOAT)


@pytest.mark.parametrize("taps", [1, 2, 3, 4])
def test_sample_pixel(taps: int) -> None:
    view = np.zeros((), struct_dtype("pygfx/mask.wgsl", "SceneUniforms"))
    view["pixels"], view["ratio"] = (301, 200), (301 / 150, 2)
    texel, k = RNG.integers(0, (150, 100), (3000, 2)), RNG.integers(0, taps**2, 3000)
    found = call("pygfx/mask.wgsl", "sample_pixel", [texel, k], constants={"TAPS": taps}, bindings={"view": view})
    expected = scene.sample_pixel(texel, k, taps, np.array([301 / 150, 2]), (301, 200))
    assert (found == expected).mean() > 0.999 and np.abs(found - expected).max() <= 1  # on a border a float may fall to either side
    assert (found < (301, 200)).all()
    outside = np.array([[160, 20], [20, 104]])
    beyond = call("pygfx/mask.wgsl", "sample_pixel", [outside, 0], constants={"TAPS": taps}, bindings={"view": view})
    assert beyond[0, 0] == 300 and beyond[1, 1] == 199


@pytest.mark.parametrize(("lanes", "powers"), [(7, 1), (300, 3)])
def test_state_index(lanes: int, powers: int) -> None:
    frame = np.zeros((), struct_dtype("scatter/bands/bands.wgsl", "Frame"))
    frame["lanes"] = lanes
    odd, side, lane, k = (RNG.integers(0, n, 500) for n in (2, 4, lanes, powers))
    found = call("scatter/bands/bands.wgsl", "state_index", [odd, side, lane, k], constants={"POWERS": powers}, bindings={"frame": frame})
    assert np.array_equal(found, bands.state_index(odd, side, lane, k, lanes, powers))


def test_clip_position() -> None:
    frame = np.zeros((), struct_dtype("scatter/epipolar/gather.wgsl", "Frame"))
    frame["size"] = 640, 427
    position = RNG.uniform(-50, 700, (500, 2)).astype(np.float32)
    found = call("scatter/epipolar/gather_raster.wgsl", "clip_position", [position], bindings={"frame": frame})
    np.testing.assert_allclose(found, raster.clip_position(position, (640, 427)), atol=1e-6)
