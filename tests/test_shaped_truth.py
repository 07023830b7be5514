"""What a cookie is made of where a pixel holds many of its texels: their mean, as of many rays of the tracer."""

from typing import Any

import numpy as np
import pytest

pytest.importorskip("pygfx")
import validating

from airlight.reference import panes
from airlight.scenes import open_scene

LEFT, TOP, WIDE, HIGH = 0, 0, 64, 48  # pixels, before one of the lamps
RAYS = 4  # of a pixel, along each side


def part(drawn: validating.Drawn, rays: int) -> np.ndarray:
    """(HIGH, WIDE, 3) the true light of a part of a picture, the mean of rays x rays a pixel."""
    (width, height), crop = validating.SIZE, np.eye(4)
    crop[0, 0], crop[1, 1] = width / WIDE, height / HIGH
    crop[0, 3], crop[1, 3] = -crop[0, 0] * ((2 * LEFT + WIDE) / width - 1), -crop[1, 1] * (1 - (2 * TOP + HIGH) / height)
    size = WIDE * rays, HIGH * rays
    found = panes.layer(drawn.view, crop @ drawn.projection, size, drawn.seen, [], drawn.lamps, drawn.air, drawn.casting).radiance
    return np.asarray(found.reshape(HIGH, rays, WIDE, rays, 3).mean(axis=(1, 3)))


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_before_a_lamp_a_pixel_holds_the_mean_of_its_texels(monkeypatch: pytest.MonkeyPatch) -> None:
    """`gobo` from where its lamps are in view: as bright as many rays a pixel, and nearer to them than one ray, which sparkles."""

    def from_afar(name: str) -> Any:
        stage = open_scene(name)
        stage.cameras["front"].local.position = 0.0, 1.7, 6.6
        return stage

    monkeypatch.setattr(validating, "open_scene", from_afar)
    drawn = validating.draw("gobo", *validating.SIZE)
    found = drawn.layer[TOP : TOP + HIGH, LEFT : LEFT + WIDE]
    truth, one = part(drawn, RAYS), part(drawn, 1)
    off, alias = (np.sqrt(np.mean((each - truth) ** 2)) / truth.mean() for each in (found, one))
    assert abs(found.mean() / truth.mean() - 1) < 0.01
    assert off < 0.3 and off < 0.75 * alias
