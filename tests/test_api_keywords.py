"""Keywords that no function of the package takes: the like one is named, an argument of its own too."""

import numpy as np
import pytest

import airlight

IMAGE = np.zeros((8, 8, 3), np.float32)


@pytest.mark.parametrize(
    ("wrong", "meant"),
    [("presets", "preset"), ("devise", "device"), ("depths", "depth"), ("masks_", "mask"), ("near_rang", "near_range")],
)
def test_an_argument_is_named(wrong: str, meant: str) -> None:
    with pytest.raises(airlight.AirlightError, match=f"unknown parameter '{wrong}'; did you mean '{meant}'"):
        airlight.add_light_shafts(IMAGE, **{wrong: 1})


def test_an_argument_of_the_sum_is_named() -> None:
    with pytest.raises(airlight.AirlightError, match="did you mean 'alpha'"):
        airlight.Renderer().light_shafts(IMAGE, (0.5, 0.5), Alpha=1)
    with pytest.raises(airlight.AirlightError, match="did you mean 'density'"):
        airlight.light_shafts(IMAGE, (0.5, 0.5), densty=1)
    with pytest.raises(airlight.AirlightError, match="there is image, light, alpha"):
        airlight.light_shafts(IMAGE, (0.5, 0.5), qwertz=1)
