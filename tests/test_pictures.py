"""What the classic look makes of the photographs with nothing else said: light, not a veil."""

import warnings
from pathlib import Path

import numpy as np
import pytest

import airlight
from airlight.detect import find_light
from airlight.files import read_image
from airlight.lights import Light
from airlight.luminance import REC709_F32
from airlight.occlusion.automatic import auto_threshold
from airlight.options import Parameters

PHOTOS = sorted((Path(__file__).parent.parent / "examples" / "photos").glob("*.jpg"))


def before_and_after(path: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(H, W, 3) codes of both, as integers; and the luminance of the layer over its peak."""
    codes = read_image(path).codes
    light = find_light(airlight.files.to_linear(codes)[0]).position
    layer = airlight.light_shafts(codes, light) @ REC709_F32
    return codes.astype(int), airlight.add_light_shafts(codes, light, look="classic").astype(int), layer / np.percentile(layer, 99.9)


@pytest.mark.parametrize("path", PHOTOS, ids=lambda path: path.stem)
def test_pleasant_with_nothing_else_said(path: Path) -> None:
    before, after, layer = before_and_after(path)
    luminance = before @ REC709_F32
    rise = (after - before).mean(axis=-1)
    outside = layer < 0.2
    if outside.any():
        dark = outside & (luminance <= np.percentile(luminance[outside], 5))
        assert rise[dark].mean() <= 2  # no veil
    assert (after == 255).any(axis=-1).mean() <= (before == 255).any(axis=-1).mean() + 0.002  # no clipped sky
    assert (after < before).sum() == 0  # light only adds
    assert (0.3 if path.stem == "sea-sunset" else 0.5) < rise.mean() < 25  # little of it is bright; seen, and not drowned in
    assert rise[layer > 0.5].mean() > 4 * max(rise[outside].mean() if outside.any() else 0, 0.1)  # where the shafts are


def test_no_halo_at_the_border() -> None:
    """An even sky stays even up to its last pixel, whatever the border pixels see."""
    sky = np.full((200, 300, 3), 0.95, np.float32)
    layer = airlight.light_shafts(sky, (0.5, 0.4), samples=100)
    assert np.ptp(layer) < 2e-3 * layer.max()


def test_no_banding() -> None:
    """A slow ramp of light on black: neighbouring codes mix, instead of meeting in lines."""
    ramp = np.zeros((256, 512, 3), np.uint8)
    ramp[:, :8] = 255
    out = airlight.add_light_shafts(ramp, (0.0, 0.5), veil=0.0)[:, 100:280, 1].astype(int)
    rows_agree = (out == out[:1]).all(axis=0).mean()
    assert len(np.unique(out)) > 8 and rows_agree < 0.2
    means = out.mean(axis=0)
    assert np.abs(np.diff(means)).max() < 0.6  # dithered: means move in less than steps of a code


def test_dark_light_settles_the_threshold() -> None:
    """An opening at 70 % grey emits like a white one; a picture of floats, or one with a threshold, is taken as it is."""
    image = np.full((80, 120, 3), 0.02, np.float32)
    image[20:50, 40:70] = 0.7
    light = [Light((0.45, 0.45))]
    p = auto_threshold(Parameters(), image, light)
    assert p.threshold == pytest.approx(0.85 * 0.7) and p.smoothness == pytest.approx(0.2 * 0.7)
    image[20:50, 40:70] = 3.0
    assert auto_threshold(Parameters(), image, light).threshold == 0.85
    assert auto_threshold(Parameters(threshold=0.4), image, light).threshold == 0.4
    assert auto_threshold(Parameters(occlusion="none"), image, light).threshold is None
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert auto_threshold(Parameters(), np.zeros((1, 1, 3), np.float32), light).threshold == pytest.approx(0.85 * 0.05)
