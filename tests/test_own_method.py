"""A method of one's own: an entry in the table is all that image, compare and the panel need."""

import dataclasses
from typing import Any

import numpy as np
import pytest

import airlight
from airlight import options
from airlight.cli import main
from airlight.files import read_image, write_image
from airlight.scatter.methods import METHODS, Method
from airlight.viewer import state as st

SIZE = (96, 54)


def third(device: Any, size: Any, light: Any, p: Any, target: Any) -> Any:
    """Plan the direct sum with a third of its exposure."""
    return METHODS["radial"].plan(device, size, dataclasses.replace(light, strength=light.strength / 3), p, target)


@pytest.fixture
def own(monkeypatch: pytest.MonkeyPatch) -> None:
    radial = METHODS["radial"]
    one = Method("a third of the direct sum", third, lambda *a, **k: radial.reference(*a, **k) / 3, radial.options, per_sample=True)
    monkeypatch.setitem(METHODS, "third", one)


@pytest.fixture
def photo(tmp_path: Any) -> str:
    x, y = np.meshgrid(np.linspace(0, 1, SIZE[0]), np.linspace(0, 1, SIZE[1]))
    sun = np.hypot((x - 0.6) * 16 / 9, y - 0.3) < 0.12
    path = str(tmp_path / "photo.exr")
    write_image(path, np.repeat((0.05 + 3.0 * sun * (np.sin(60 * x) > 0))[..., None], 3, axis=2).astype(np.float32))
    return path


def test_image_makes_pictures_by_it(own: None, photo: str, tmp_path: Any) -> None:
    layers = []
    for method in ("radial", "third"):
        path = str(tmp_path / f"{method}.exr")
        words = ["--light", "0.6,0.3", "--method", method, "--samples", "20", "--veil", "0"]
        assert main(["image", photo, "-o", str(tmp_path / f"out-{method}.exr"), "--layer", path, *words]) == 0
        layers.append(read_image(path).linear())
    assert layers[0].max() > 0.1
    np.testing.assert_allclose(layers[1], layers[0] / 3, rtol=2e-3, atol=1e-4)


def test_compare_measures_it(own: None, photo: str, tmp_path: Any, capsys: pytest.CaptureFixture[str]) -> None:
    page = str(tmp_path / "page.html")
    variants = [word for name in ("radial", "third") for word in ("--variant", f"method={name}")]
    assert main(["compare", photo, "-o", page, "--light", "0.6,0.3", "--samples", "300", *variants, "--runs", "1"]) == 0
    radial, own_line = capsys.readouterr().out.splitlines()
    errors = [float(line.split("error")[1].split("%")[0]) for line in (radial, own_line)]
    assert own_line.startswith("third") and errors[0] < 10 and errors[1] > 60  # a third of the limit is two thirds off


def test_it_is_of_the_list_that_compare_takes_by_itself(own: None) -> None:
    from airlight.compare.variants import usual

    assert "third" in {one.parameters.method for one in usual({})[0]}


def test_the_panel_offers_it(own: None) -> None:
    state = st.ViewerState("photo.exr", True)
    st.set_values(state, {"look": "classic", "method": "third"})
    shown = {one.name: one for one in st.shown(state)}
    assert "third" in shown["method"].choices and "decay" in shown


def test_it_is_declared_only_while_it_is_there() -> None:
    assert "third" not in next(one for one in options.declared() if one.name == "method").choices
    with pytest.raises(airlight.AirlightError, match="third"):
        airlight.Parameters(method="third")
