"""Light adaptation (13.8): off by default; a picture's output keeps its level however the input is scaled."""

import numpy as np
import pytest

import airlight
from airlight.composite import adapt
from airlight.composite.blend import CompositeSettings, blend
from airlight.files import write_image
from airlight.files.images import read_image
from airlight.reference.scenes import foliage

SCALES = [1 / 16, 1 / 4, 1.0, 4.0, 16.0]


@pytest.mark.parametrize("occlusion", ["luminance", "contrast", "none"])
def test_the_mean_stays_however_the_input_is_scaled(occlusion: str) -> None:
    image = foliage(320, 180)
    means, peaks = [], []
    for scale in SCALES:
        out = airlight.add_light_shafts(image * np.float32(scale), (0.6, 0.35), adapt=1.0, occlusion=occlusion)
        means.append(out.mean())
        peaks.append(np.percentile(out, 99))
    assert max(means) <= 1.1 * min(means) and 0.05 < min(means) < 0.6
    plain = [airlight.add_light_shafts(image * np.float32(s), (0.6, 0.35), occlusion=occlusion).mean() for s in SCALES]
    assert max(plain) > 100 * min(plain)  # without it the output follows the input
    half = [airlight.add_light_shafts(image * np.float32(s), (0.6, 0.35), adapt=0.5, occlusion=occlusion).mean() for s in SCALES]
    assert 10 < max(half) / min(half) < 30  # half of it, of logarithms


def test_through_files(tmp_path) -> None:
    """EXR to PNG by the command line: 8-bit codes whose mean stays."""
    from airlight.cli import main

    means = []
    for i, scale in enumerate(SCALES):
        write_image(tmp_path / f"{i}.exr", foliage(320, 180) * np.float32(scale))
        command = ["image", str(tmp_path / f"{i}.exr"), "-o", str(tmp_path / f"{i}.png"), "--light", "0.6,0.35", "--adapt", "1"]
        assert main(command) == 0
        means.append(read_image(tmp_path / f"{i}.png").linear().mean())
    assert max(means) <= 1.1 * min(means)


def test_off_is_the_identity() -> None:
    rng = np.random.default_rng(3)
    for image in (rng.random((60, 80, 3)).astype(np.float32), rng.integers(0, 256, (60, 80, 3), np.uint8)):
        plain = airlight.add_light_shafts(image, (0.5, 0.5), look="classic")
        assert airlight.add_light_shafts(image, (0.5, 0.5), adapt=0.0).tobytes() == plain.tobytes()
        assert airlight.add_light_shafts(image, (0.5, 0.5), adapt=1.0).tobytes() != plain.tobytes()
    image, layer = rng.random((2, 30, 40, 3)).astype(np.float32)
    out, added = blend(image, layer, CompositeSettings("add", 1.0, 0.0))
    assert np.array_equal(out, image + layer) and np.array_equal(added, layer)


def test_the_ramp() -> None:
    """Scaling goes into the scale alone; the curve rises; the greatest luminance is white; flat and black pictures stay sane."""
    y = np.exp(np.random.default_rng(6).normal(-2, 1.5, 20000)).astype(np.float32)
    ramp, brighter = adapt.measure_ramp(y), adapt.measure_ramp(8 * y)
    assert brighter.scale == pytest.approx(ramp.scale / 8, rel=1e-5) and brighter.white == pytest.approx(ramp.white, rel=1e-5)
    levels = np.geomspace(1e-4, 1e3, 200).astype(np.float32)
    assert (np.diff(levels * ramp.gain(levels)) > 0).all()
    greatest = np.float32([np.percentile(y, 99.9)])
    assert (greatest * ramp.gain(greatest))[0] == pytest.approx(1, rel=1e-3)
    flat = np.full(100, 7.0, np.float32)
    assert (flat * adapt.measure_ramp(flat).gain(flat))[0] == pytest.approx(0.18, rel=1e-3)
    assert adapt.measure_ramp(np.zeros(10, np.float32)) == adapt.Ramp(1.0, 1.0)
    # dark pictures are kept darker than bright ones: by where the average lies between the least and the greatest
    u = np.linspace(0, 1, 5000)
    averages = []
    for skew in (0.5, 1.0, 2.0):
        logs = -7 * u**skew
        averages.append(float(np.exp(logs.mean()) * adapt.measure_ramp(np.exp(logs).astype(np.float32)).scale))
    assert averages[0] < 0.15 and averages[1] == pytest.approx(0.18, rel=0.01) and averages[2] > 0.21
