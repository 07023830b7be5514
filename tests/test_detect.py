"""The light is found where a person would mark it, and not where there is none."""

from pathlib import Path

import numpy as np
import pytest

from airlight.detect import find_light
from airlight.files import read_image

PHOTOS = Path(__file__).parent.parent / "examples" / "photos"
# marked by hand on the pictures: the sun, or the middle of the opening
MARKS = {
    "beacon-street-sunset.jpg": (0.885, 0.47),
    "hill-sunset.jpg": (0.496, 0.421),
    "dandelions.jpg": (0.572, 0.08),
    "casa-mila.jpg": (0.49, 0.38),
}


def sun(width: int, height: int, x: float, y: float, radius: float, sky: float = 0.2) -> np.ndarray:
    j, i = np.indices((height, width)) + 0.5
    image = np.full((height, width, 3), sky, np.float32)
    image[np.hypot(i - x * width, j - y * height) < radius] = 40.0
    return image


@pytest.mark.parametrize("name", sorted(MARKS))
def test_on_photographs_within_two_per_cent_of_the_width(name: str) -> None:
    image = read_image(PHOTOS / name).linear()
    height, width = image.shape[:2]
    found = find_light(image)
    assert found is not None
    off = np.hypot(found.position[0] - MARKS[name][0], (found.position[1] - MARKS[name][1]) * height / width)
    assert off <= 0.02


@pytest.mark.parametrize("factor", [1 / 16, 1, 16])
@pytest.mark.parametrize("place", [(0.5, 0.5), (0.1, 0.8), (0.93, 0.06)])
@pytest.mark.parametrize("radius", [6, 20])
def test_a_sun_at_any_exposure(place: tuple[float, float], radius: float, factor: float) -> None:
    found = find_light(sun(600, 400, *place, radius) * np.float32(factor))
    assert found is not None
    assert np.hypot(found.position[0] - place[0], (found.position[1] - place[1]) * 400 / 600) < 0.01


def test_codes_are_decoded() -> None:
    picture = read_image(PHOTOS / "beacon-street-sunset.jpg")
    found, same = find_light(picture.codes), find_light(picture.linear())
    assert found is not None and same is not None and found.position == same.position
    grey = np.zeros((60, 80), np.uint8)
    grey[20:26, 30:36] = 255
    assert find_light(grey) is not None and find_light(np.dstack([grey] * 4)) is not None


def test_pictures_without_a_source() -> None:
    rng = np.random.default_rng(0)
    ramp = np.linspace(0, 1, 400)[None, :, None] * np.ones((300, 1, 3))
    for image in (
        np.ones((300, 400, 3)),
        rng.random((300, 400, 3)),
        ramp,
        np.zeros((30, 40, 3)),
        np.ones((1, 1, 3)),
        np.full((9, 9, 3), np.nan),
    ):
        assert find_light(image.astype(np.float32)) is None
