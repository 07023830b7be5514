"""Air of a room that is as thin as that of a landscape is told where it hides a lamp's light."""

from typing import Any

import numpy as np
import pytest

from airlight.jobs.thin_air import doubt_of_lamps
from airlight.medium import resolve
from airlight.options import March, Medium

PICTURE = np.full((1000, 3), 0.2)


def told(light: float, share: float = 1.0, height: float = 3.0, radius: float = 6.0, **medium: Any) -> str | None:
    made = resolve.resolve(Medium(**medium), March(), "normal", radius, height=4.0)
    shown = np.where(np.arange(1000)[:, None] < 1000 * share, light, 0.0) * np.ones(3)
    return doubt_of_lamps(made, radius, {"the light spot": height}, shown, PICTURE)


def test_thin_air_that_hides_a_beam_is_told_with_its_cure() -> None:
    line = told(0.001, sigma_t=(0.0013,) * 3)
    assert line is not None and "the light spot is so thin" in line and "depth of 0.016 over the 12 m" in line
    assert "--sigma-t 0.042 shows it, or --medium smoke" in line


@pytest.mark.parametrize("fog", ["exponential", "linear"])
def test_fog_below_a_lamp_is_told_with_its_depth(fog: str) -> None:
    line = told(0.001, fog=fog)
    assert line is not None and "--fog-depth 6 lets the fog reach it" in line
    assert told(0.001, fog=fog, height=0.0) is None


def test_air_that_shows_a_beam_is_not_told() -> None:
    assert told(0.05, sigma_t=(0.0013,) * 3) is None  # a strong lamp's
    assert told(0.001, sigma_t=(0.05,) * 3) is None  # dense, and the lamp weak
    assert told(0.001, sigma_t=(0.0,) * 3) is None  # meant so
    assert told(0.05, share=0.01, sigma_t=(0.0013,) * 3) is not None  # a glow around the lamp
