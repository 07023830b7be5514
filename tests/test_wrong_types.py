"""Public functions refuse values of wrong types with AirlightError, in one line: no TypeError, no ValueError."""

import contextlib
from typing import Any

import numpy as np
import pytest

import airlight
from airlight.options import declared

WRONG = [3, "x", object(), [1, 2], {"a": 1}, (1,), np.zeros(3), b"x", float("nan"), "a\0b", np.array("x", object)]
OWN = ("alpha", "depth", "mask", "subject", "near_range", "preset", "occlusion")
IMAGE = np.random.default_rng(0).random((24, 32, 3)).astype(np.float32)


@pytest.fixture(scope="module")
def renderer() -> airlight.Renderer:
    return airlight.Renderer()


def refused(function: Any, *arguments: Any, **keywords: Any) -> None:
    with contextlib.suppress(airlight.AirlightError):
        function(*arguments, **keywords)


@pytest.mark.filterwarnings("ignore::airlight.errors.AirlightWarning")
@pytest.mark.parametrize("value", WRONG, ids=[str(n) for n in range(len(WRONG))])
@pytest.mark.parametrize("name", ["add_light_shafts", "light_shafts", "occlusion_fraction"])
def test_keywords_of_wrong_types(name: str, value: Any, renderer: airlight.Renderer) -> None:
    function = getattr(airlight, name)
    for keyword in (*OWN, *(one.name for one in declared())):
        refused(function, IMAGE, (0.5, 0.5), **{"device": renderer, keyword: value})
    refused(function, IMAGE, value, device=renderer)
    refused(function, value, (0.5, 0.5), device=renderer)


@pytest.mark.parametrize("value", WRONG, ids=[str(n) for n in range(len(WRONG))])
def test_other_arguments_of_wrong_types(value: Any) -> None:
    for function in (airlight.find_light, airlight.find_lights):
        refused(function, value)
    for keyword in ("position", "color", "strength", "angle", "kind"):
        refused(airlight.Light, **{"position": (0.5, 0.5)} | {keyword: value})
    if not isinstance(value, int):
        with pytest.raises(airlight.AirlightError, match="number of plans"):
            airlight.Renderer(keep=value)
