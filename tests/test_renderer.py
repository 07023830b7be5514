"""The reusable renderer: one device, one plan, many pictures; the caller's textures; threads."""

import threading
from pathlib import Path

import numpy as np
import pytest

import airlight
from airlight.colour import encode_codes
from airlight.files import read_image
from airlight.gpu.device import Device, choose
from airlight.lights import Light

RNG = np.random.default_rng(9)
CODES = RNG.integers(0, 256, (5, 90, 130, 3), dtype=np.uint8)
KEYWORDS = {"threshold": 0.6, "density": 0.9}


def test_a_second_picture_makes_nothing_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    renderer = airlight.Renderer()
    first = [renderer.add_light_shafts(codes, (0.4, 0.3), **KEYWORDS) for codes in CODES[:1]]
    for name in ("texture", "buffer", "bind", "pipeline", "raster"):
        monkeypatch.setattr(Device, name, lambda *_, name=name, **__: pytest.fail(f"{name} is called for a picture like the last"))
    again = [renderer.add_light_shafts(codes, (0.4, 0.3), **KEYWORDS) for codes in CODES]
    monkeypatch.undo()
    assert np.array_equal(first[0], again[0])
    for codes, one in zip(CODES, again, strict=True):
        assert np.array_equal(one, airlight.add_light_shafts(codes, (0.4, 0.3), **KEYWORDS))


def test_kept_plans_do_not_mix_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    renderer = airlight.Renderer(keep=2)
    images = [CODES[0], CODES[1, :50], CODES[2].astype(np.float32) / 7, CODES[3], (CODES[4] / 1e6).astype(np.float32)]
    masks = [None, None, RNG.random((90, 130)).astype(np.float32), None, RNG.random((90, 130)).astype(np.float32)]
    for turn in range(3):
        for image, mask in zip(images, masks, strict=True):
            out = renderer.light_shafts(image, (0.2, 0.3 + 0.1 * turn), mask=mask, **KEYWORDS)
            assert np.array_equal(out, airlight.light_shafts(image, (0.2, 0.3 + 0.1 * turn), mask=mask, **KEYWORDS))
    made: list[int] = []
    texture = Device.texture
    monkeypatch.setattr(Device, "texture", lambda *args, **keywords: made.append(1) or texture(*args, **keywords))
    for i, is_kept in ((4, True), (3, True), (1, False), (3, True), (4, False)):  # those of the last two pictures
        made.clear()
        renderer.light_shafts(images[i], (0.2, 0.5), mask=masks[i], **KEYWORDS)
        assert (not made) == is_kept, i


def test_one_light_twice_counts_twice() -> None:
    light = Light((0.3, 0.6))
    image = CODES[0].astype(np.float32) / 255
    one = airlight.light_shafts(image, light, occlusion="none")
    np.testing.assert_allclose(airlight.light_shafts(image, [light, light, light], occlusion="none"), 3 * one, rtol=3e-3)


def test_textures_of_the_caller() -> None:
    """On the caller's own wgpu device, from a texture to a texture, again after the picture has changed."""
    renderer = airlight.Renderer(Device.on(choose()).device)
    usage = renderer.device.wgpu.TextureUsage
    size = (130, 90, 1)
    make = renderer.device.device.create_texture
    picture = make(size=size, format="rgba32float", usage=usage.TEXTURE_BINDING | usage.COPY_DST)
    flags = usage.TEXTURE_BINDING | usage.STORAGE_BINDING | usage.RENDER_ATTACHMENT | usage.COPY_SRC
    layer = make(size=size, format="rgba16float", usage=flags)
    plan = renderer.texture_plan(picture, layer, [(0.4, 0.3), (1.4, 0.3)], occlusion="none")
    for codes in CODES[:2]:
        image = np.ones((90, 130, 4), np.float32)
        image[..., :3] = codes / np.float32(255)
        renderer.device.write(picture, image, 130 * 16)
        encoder = renderer.device.encoder()
        plan.record(encoder)
        renderer.device.submit(encoder)
        out = np.frombuffer(renderer.device.read(layer, 8), np.float16).reshape(90, 130, 4)[..., :3]
        assert np.array_equal(out, airlight.light_shafts(image[..., :3], [(0.4, 0.3), (1.4, 0.3)], occlusion="none").astype(np.float16))


@pytest.mark.parametrize("shared", [True, False])
def test_two_renderers_in_two_threads_give_the_bytes_of_one(shared: bool) -> None:
    expected = [airlight.add_light_shafts(codes, (0.4, 0.3), **KEYWORDS).tobytes() for codes in CODES]
    found: list[list[bytes]] = [[], []]

    def work(own: list[bytes], device: Device | None) -> None:
        renderer = airlight.Renderer(device)
        for _ in range(3):
            own += [renderer.add_light_shafts(codes, (0.4, 0.3), **KEYWORDS).tobytes() for codes in CODES]

    devices = [None, None] if shared else [Device.on(choose()), Device.on(choose())]
    threads = [threading.Thread(target=work, args=pair) for pair in zip(found, devices, strict=True)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert found == [expected * 3, expected * 3]


def test_results_show_themselves_in_notebooks(tmp_path: Path) -> None:
    codes = airlight.add_light_shafts(CODES[0], (0.4, 0.3), **KEYWORDS)
    layer = airlight.light_shafts(CODES[0], (0.4, 0.3), **KEYWORDS)
    grey = airlight.occlusion_fraction(CODES[0], (0.4, 0.3), **KEYWORDS)
    read = []
    for result in (codes, layer, grey):
        assert isinstance(result, np.ndarray)
        (tmp_path / "shown.png").write_bytes(result._repr_png_())
        read.append(read_image(tmp_path / "shown.png").codes)
    assert np.array_equal(read[0], codes)
    assert np.abs(read[1].astype(int) - encode_codes(layer, np.uint8)).max() == 0
    assert read[2].shape[:2] == (90, 130)
    assert layer.sum().ndim == 0 and layer[0, 0]._repr_png_() is None  # what is no picture shows none


def test_what_is_no_light_or_no_device_is_told() -> None:
    for strength in ("2", None, [1], float("nan"), -1.0):
        with pytest.raises(airlight.AirlightError, match="strength"):
            airlight.Light((0.5, 0.5), strength=strength)
    assert airlight.Light((0.5, 0.5), strength=np.float32(2)).strength == 2.0
    for device in (3, object(), ["llvmpipe"]):
        with pytest.raises(airlight.AirlightError, match="adapter"):
            airlight.add_light_shafts(CODES[0], (0.5, 0.5), device=device)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
@pytest.mark.parametrize("shape", [(90, 130), (90, 130, 1)])
def test_a_grey_image_stays_grey(dtype: type, shape: tuple[int, ...]) -> None:
    most = 1.0 if dtype == np.float32 else np.iinfo(dtype).max
    image = (np.random.default_rng(2).random(shape) * most).astype(dtype)
    light = [airlight.Light((0.4, 0.3), color=(1.0, 0.5, 0.2))]
    out = airlight.add_light_shafts(image, light, threshold=0.6)
    assert out.shape == shape and out.dtype == dtype and (out > image).any()
    colour = airlight.add_light_shafts(np.repeat(image.reshape(90, 130, 1), 3, axis=2), light, threshold=0.6)
    values = [airlight.files.to_linear(a)[0] @ np.float32([0.2126, 0.7152, 0.0722]) for a in (out, colour)]
    assert np.abs(values[0] - values[1]).mean() < 2e-3
