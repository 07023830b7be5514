"""Messages name what the reader has: an option, a keyword, a row of the panel; and warnings name the line of the caller."""

import warnings
from collections.abc import Iterator

import numpy as np
import pytest

import airlight
from airlight.errors import AirlightWarning
from airlight.options import declared
from airlight.options.words import in_panel, in_python

BLACK = np.zeros((40, 60, 3), np.uint8)


@pytest.mark.parametrize(
    ("option", "python", "panel"),
    [
        ("or --look classic draws on black", 'or look="classic" draws on black', "or Look at classic draws on black"),
        ("no shafts; --rays 24 draws some", "no shafts; rays=24 draws some", "no shafts; Rays at 24 draws some"),
        ("as --threshold 0.7; lower it", "as threshold=0.7; lower it", "as Threshold at 0.7; lower it"),
        ("lower --sigma-t or add --light x,y", "lower sigma_t or add --light x,y", "lower Sigma t or add --light x,y"),
    ],
)
def test_options_are_named_as_the_reader_has_them(option: str, python: str, panel: str) -> None:
    assert in_python(option) == python and in_panel(option) == panel


def test_every_parameter_is_known() -> None:
    for one in declared(scenes=True):
        assert in_python(f"--{one.name.replace('_', '-')}") == one.name


@pytest.fixture(scope="module")
def renderer() -> Iterator[airlight.Renderer]:
    yield airlight.Renderer()


@pytest.mark.parametrize("broken", [False, True])
def test_a_warning_names_the_callers_line_and_no_option(broken: bool, renderer: airlight.Renderer) -> None:
    image = BLACK
    if broken:
        image = np.full((40, 60, 3), 0.3, np.float32)
        image[3, 3] = np.nan
    for where in (None, renderer):
        with warnings.catch_warnings(record=True) as found:
            warnings.simplefilter("always")
            (where or airlight).add_light_shafts(image, (0.5, 0.5))
        told = [one for one in found if one.category is AirlightWarning]
        assert told and all(one.filename == __file__ for one in told)
        assert not any("--" in str(one.message) for one in told)
