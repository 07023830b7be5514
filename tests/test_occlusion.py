"""Contrast occlusion (13.5.3) on the GPU: what it promises, and its float64 twin."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import airlight
from airlight.files import to_linear
from airlight.lights import Light
from airlight.options import Parameters
from airlight.reference import radial as reference
from airlight.scatter.render import PictureRenderer, render_codes, render_layer

LIGHT = (0.5, 0.1)


def hillside() -> np.ndarray:
    """(270, 480, 3): sky above a wooded hill, rough from pixel to pixel and in patches."""
    rng = np.random.default_rng(2)
    rough = rng.random((270, 480)) + np.kron(rng.random((27, 48)), np.ones((10, 10)))
    image = np.float32([0.5, 0.55, 0.4]) * (0.3 * rough[..., None])
    image[:80] = [1.2, 1.3, 1.5]
    return image.astype(np.float32)


def streaks(layer: np.ndarray) -> tuple[float, float]:
    """Variance over angle on an arc around the light at the bottom, where rays have passed the texture; and the layer's mean."""
    angle = np.deg2rad(np.linspace(55, 125, 600))
    rings = []
    for radius in (180, 200, 220, 240):
        x, y = LIGHT[0] * 480 + radius * np.cos(angle), LIGHT[1] * 270 + radius * np.sin(angle)
        on = reference.bilinear(layer.astype(float), x / 480, y / 270)[:, 1]
        rings.append(np.var(on - np.polyval(np.polyfit(angle, on, 4), angle)))  # the arc's own slow course is no streak
    return float(np.mean(rings)), float(layer.mean())


@pytest.mark.parametrize("codes", [False, True])
def test_streaks_vanish_and_the_level_stays(codes: bool) -> None:
    image = hillside()
    if codes:
        image = np.rint(255 * np.minimum(image, 1) ** (1 / 2.2)).astype(np.uint8)
    keywords = {"density": 0.6, "samples": 100, "decay": 0.99, "threshold": 0.8, "smoothness": 0.1}
    before = streaks(airlight.light_shafts(image, LIGHT, occlusion="none", **keywords))
    after = streaks(airlight.light_shafts(image, LIGHT, occlusion="contrast", **keywords))
    assert before[0] >= 4 * after[0]
    assert abs(after[1] / before[1] - 1) <= 0.05


@settings(max_examples=15)
@given(st.integers(1, 150), st.integers(1, 150), st.integers(0, 2**31), st.booleans(), st.sampled_from(["clamp", "black"]))
def test_contrast_is_its_twin(width: int, height: int, seed: int, masked: bool, border: str) -> None:
    rng = np.random.default_rng(seed)
    image = (2 * rng.random((height, width, 3)) ** 2).astype(np.float32)
    mask = rng.random((height, width)).astype(np.float32) if masked else None
    p = Parameters(method="radial", samples=12, occlusion="contrast", threshold=0.8, smoothness=0.3, border=border)
    truth = reference.layer(image, [Light((0.4, 0.7))], p, user_mask=mask)
    keywords = {name: getattr(p, name) for name in p.__struct_fields__}
    out = airlight.light_shafts(image, (0.4, 0.7), mask=mask, **keywords)
    np.testing.assert_allclose(out, truth, atol=3e-3 * max(truth.max(), 1e-3))
    fraction = airlight.occlusion_fraction(image, (0.4, 0.7), mask=mask, **keywords)
    m = reference.mask(image, None, None, p) * (1 if mask is None else mask)
    np.testing.assert_allclose(
        fraction, reference.occlusion_fraction(m, (0.4, 0.7), density=p.density, samples=12, border=border), atol=3e-3
    )


def test_contrast_of_codes_is_that_of_their_light() -> None:
    """8-bit pictures are decoded on the GPU; the same bytes come out each time."""
    codes = np.random.default_rng(4).integers(0, 256, (130, 200, 4), np.uint8)
    codes[..., 3] = 255
    p = Parameters(occlusion="contrast", density=0.9)
    floats = np.ones((130, 200, 4), np.float32)
    floats[..., :3] = to_linear(codes)[0]
    renderer = PictureRenderer()
    one = render_layer(renderer, codes, [Light(LIGHT)], p)
    np.testing.assert_allclose(one, render_layer(renderer, floats, [Light(LIGHT)], p), atol=2e-3 * one.max())
    rule = airlight.api.resolve(airlight.Composite(), False)
    pictures = [render_codes(renderer, codes, [Light(LIGHT)], p, rule)[0].tobytes() for _ in range(2)]
    assert pictures[0] == pictures[1] != codes.tobytes()
