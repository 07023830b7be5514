"""The device's own parts: the quick look-up of C types, and both forms of what differs between CPU adapters and GPUs."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import airlight
from airlight.colour import encode_codes, srgb_decode
from airlight.composite.blend import CompositeSettings, blend
from airlight.gpu import floats
from airlight.gpu.cffi_type_cache import cache_simple_types
from airlight.gpu.device import Device, choose, driver_of, open_device
from airlight.lights import Light
from airlight.options import Parameters
from airlight.scatter.epipolar.epipolar import EpipolarPlan
from airlight.scatter.render import PictureRenderer, render_codes, render_layer
from airlight.scatter.screen import Target

RNG = np.random.default_rng(5)


def test_types_are_looked_up_as_cffi_parses_them() -> None:
    """Names which of cffi's private parts went away: `FFI._parser` with parse_type_and_quals, _declarations, _get_type_pointer."""
    import cffi

    plain, quick = cffi.FFI(), cffi.FFI()
    for ffi in (plain, quick):
        ffi.cdef("typedef struct Foo { int a; struct Foo const *next; } Foo; typedef Foo *Bar; typedef enum Kind { ONE, TWO } Kind;")
    before = quick._parser.parse_type_and_quals
    cache_simple_types(quick)
    assert quick._parser.parse_type_and_quals != before
    parsed = []
    slow = quick._parser._parse
    quick._parser._parse = lambda text: parsed.append(text) or slow(text)
    names = ("Foo", "Foo *", "Foo[]", "Bar", "Bar *", "Kind", "Kind []", "char []", "uint8_t *", "uintptr_t", "void *", "int(*)(Foo *)")
    for name in names:
        assert repr(plain.typeof(name)) == repr(quick.typeof(name)), name
    assert len(parsed) == 2  # only the last two need a parser
    assert quick.new("Foo *").a == 0 and quick.sizeof("Foo") == plain.sizeof("Foo")


def test_wgpu_s_types_are_quickened() -> None:
    open_device()
    from wgpu.backends.wgpu_native._ffi import ffi

    assert ffi._parser.parse_type_and_quals.__module__ == "airlight.gpu.cffi_type_cache"


@pytest.mark.parametrize(
    ("vendor", "description", "driver"),
    [
        ("llvmpipe", "Mesa 22.3.6 (LLVM 15.0.6)", "llvmpipe Mesa 22.3.6 (LLVM 15.0.6)"),
        ("NVIDIA", "550.54.15", "NVIDIA 550.54.15"),
        ("SwiftShader driver", "", "SwiftShader driver, which tells no version"),
        ("", "", "one without a name, which tells no version"),
    ],
)
def test_a_driver_is_named(vendor: str, description: str, driver: str) -> None:
    assert driver_of({"vendor": vendor, "description": description}) == driver


def test_what_names_the_adapter_names_its_driver() -> None:
    device = open_device()
    assert device.driver == driver_of(device.device.adapter.info) and len(device.driver) > 3
    assert all(part in device.described for part in (device.name, device.info["backend_type"], device.driver))


@pytest.fixture(scope="module")
def pretended() -> Device:
    """The software adapter, driven as if it were a GPU."""
    device = Device.on(choose())
    device.is_cpu = not device.is_cpu
    return device


places = st.one_of(
    st.tuples(st.floats(0, 1), st.floats(0, 1)),
    st.tuples(st.integers(0, 149), st.integers(0, 89)).map(lambda p: ((p[0] + 0.5) / 150, (p[1] + 0.5) / 90)),
    st.tuples(st.sampled_from([0.0, 0.5, 1.0]), st.sampled_from([0.0, 0.5, 1.0])),
    st.tuples(st.floats(-2, 3), st.floats(-2, 3)),
    st.tuples(st.floats(-1e5, 1e5), st.floats(-1e5, 1e5)),
)


@settings(max_examples=60)
@given(places, st.sampled_from([0.3, 0.95, 1.0, 1.6]), st.sampled_from(["draft", "normal", "final"]))
def test_every_pixel_is_written_once_and_alike(pretended: Device, place: tuple[float, float], density: float, quality: str) -> None:
    """The triangles of the way back cover each pixel; they and the pixel-by-pixel form agree. Likewise both forms of the scan."""
    width, height = 150, 90
    image = np.repeat(np.random.default_rng(2).random((height // 3, width // 3, 4)), 3, axis=0).repeat(3, axis=1).astype(np.float16)
    out = []
    for device in (open_device(), pretended):
        source, layer = (device.texture(width, height, "rgba16float") for _ in range(2))
        device.write(source, image, width * 8)
        device.write(layer, np.full_like(image, 99.0), width * 8)
        at = (place[0] * width, place[1] * height)
        plan = EpipolarPlan(device, (width, height), at, Target(source, layer), density=density, lam=1.2, border="clamp", quality=quality)
        encoder = device.encoder()
        plan.record(encoder)
        device.submit(encoder)
        out.append(np.frombuffer(device.read(layer, 8), np.float16).reshape(height, width, 4)[..., :3].astype(np.float32))
    assert out[0].max() < 2 and out[1].max() < 2
    # a pixel on a diagonal may take its sum from either side of it
    assert np.abs(out[0] - out[1]).max() < 0.06 and np.abs(out[0] - out[1]).mean() < 1e-3


SETTINGS = [CompositeSettings(*s) for s in (("screen", 1.0, 0.2), ("add", 0.7, 0.0), ("screen", 0.4, 0.0), ("add", 0.0, 0.3))]


@pytest.mark.parametrize("composite", SETTINGS)
def test_codes_are_composited_as_in_numpy(composite: CompositeSettings) -> None:
    codes = RNG.integers(0, 256, (70, 130, 4), dtype=np.uint8)
    codes[:20, :60, :3] = 0
    renderer, light, p = PictureRenderer(), [Light((0.4, 0.3))], Parameters(threshold=0.5)
    done, _ = render_codes(renderer, codes, light, p, composite)
    layer = render_layer(renderer, codes, light, p)
    image = srgb_decode(codes[..., :3] / 255).astype(np.float32)
    pixels, added = blend(image, layer, composite)
    changed = (added != 0).any(axis=-1)
    expected = np.where(changed[..., None], encode_codes(pixels, np.uint8), codes[..., :3])
    off = np.abs(done[..., :3].astype(int) - expected)
    assert off.max() <= 1 and (off > 0).mean() < 2e-3
    assert np.array_equal(done[~changed], codes[~changed]) and np.array_equal(done[..., 3], codes[..., 3])


def test_a_lamp_too_small_to_measure_darkens_nothing() -> None:
    codes = np.full((1000, 1000, 3), 40, np.uint8)
    codes[499:502, 499:502] = 255
    out = airlight.add_light_shafts(codes, (0.5015, 0.5015), density=0.05, threshold=0.5)
    assert (out >= codes).all() and (out > codes).any()


def test_codes_and_floats_make_one_source() -> None:
    """The shader's sRGB curve against the table that floats are made by."""
    codes = np.broadcast_to(np.arange(256, dtype=np.uint8)[None, :, None], (4, 256, 4)).copy()
    p = Parameters(occlusion="none", method="radial", samples=1, exposure=1.0)
    layer = render_layer(PictureRenderer(), codes, [Light((0.5, 0.5))], p)
    np.testing.assert_allclose(layer[1, :, 0], srgb_decode(np.arange(256) / 255), rtol=6e-4, atol=1e-7)


@pytest.mark.parametrize("size", [(1, 1), (5, 3), (67, 9), (130, 4)])
@pytest.mark.parametrize("most", [1, 2000, 1 << 24])
def test_an_image_is_read_as_floats(size, most, monkeypatch):
    monkeypatch.setattr(floats, "MOST_BYTES", most)  # some rows at a time, or all
    device, (width, height) = open_device(), size
    pixels = np.random.default_rng(width).standard_normal((height, width, 4)).astype(np.float16)
    image = device.texture(width, height, "rgba16float")
    device.write(image, pixels, width * 8)
    reader = floats.FloatReader(device, image)
    for factor in (1.0, 2.0**-20):
        assert np.array_equal(reader.read(factor), pixels[..., :3].astype(np.float32) * np.float32(factor))
