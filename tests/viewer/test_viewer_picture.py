"""Pictures in the viewer: what is shown, how lights are dragged, debug views and times."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from viewer_driver import CLASSIC, Driver

from airlight.cli import main
from airlight.colour import srgb_encode
from airlight.composite.blend import CompositeSettings, blend
from airlight.composite.mix import LinearComposite
from airlight.files import read_image, write_image
from airlight.gpu.device import open_device
from airlight.viewer import controls
from airlight.viewer import state as st
from airlight.viewer.state import LightControl


def test_marks_beyond_the_canvas_are_drawn_at_its_border() -> None:
    area = (344.0, 0.0, 900.0, 700.0)
    assert controls.clamped((500.0, 300.0), area, 14) == ((500.0, 300.0), None)
    mark, away = controls.clamped((500.0, -86.0), area, 14)
    assert mark == (500.0, 14.0) and away == (0.0, -1.0)


@pytest.mark.parametrize("level", [0, 119, 255])
def test_the_mark_of_a_light_is_seen_on_any_picture(smart: Driver, folder: Path, level: int) -> None:
    """Around its middle some are much darker or much lighter than the picture, in all directions."""
    path = str(folder / f"level{level}.png")
    write_image(path, None, encoded=np.full((60, 90, 3), level, np.uint8), overwrite=True)
    smart.viewer.open(path, [LightControl((0.6, 0.4))])
    seen = smart.frame(3)[..., 0].astype(int)
    (x, y), *_ = smart.viewer.marks.lights()
    assert seen[round(y) + 40, round(x) + 40] == level
    around = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    rays = [[seen[round(y + r * np.sin(a)), round(x + r * np.cos(a))] for r in np.arange(3, 14, 0.5)] for a in around]
    assert np.abs(np.array(rays) - level).max(axis=1).min() > 80


def test_the_picture_is_that_of_airlight_image(hands: Driver, photo: str, folder: Path) -> None:
    out = folder / "out.png"
    assert main(["image", photo, "-o", str(out), "--light", "0.3,0.4", "-y", "--look", "classic"]) == 0
    name = hands.viewer.screenshot()
    assert np.array_equal(read_image(name).codes, read_image(out).codes)


@pytest.mark.parametrize("options", [{}, {"blend": "screen", "veil": 0.4}, {"adapt": 0.7}])
def test_a_float_picture_is_that_of_airlight_image(folder: Path, hands: Driver, codes: np.ndarray, options: dict[str, Any]) -> None:
    source, out = folder / "sun.exr", folder / "sun-out.exr"
    write_image(source, (codes / 255.0).astype(np.float32) ** 2 * 3, overwrite=True, bits=32)
    options = options | CLASSIC
    args = [word for key, v in options.items() for word in (f"--{key}", str(v))]
    assert main(["image", str(source), "-o", str(out), "--light", "0.3,0.4", "-y", *args]) == 0
    hands.viewer.open(str(source), [LightControl((0.3, 0.4))])
    st.set_values(hands.state, options)
    hands.frame(3)
    seen = read_image(hands.viewer.screenshot()).codes / 255
    wanted = srgb_encode(np.clip(read_image(out).codes[..., :3], 0, 1))
    assert np.abs(seen - wanted).max() <= 1.5 / 255  # half floats


def test_linear_composite_equals_its_twin() -> None:
    rng = np.random.default_rng(3)
    device = open_device()
    image, layer = rng.gamma(0.5, 1, (2, 40, 60, 3)).astype(np.float32)
    textures = []
    for pixels, format, kind in ((image, "rgba32float", np.float32), (layer, "rgba16float", np.float16)):
        rgba = np.ones((40, 60, 4), kind)
        rgba[..., :3] = pixels
        textures.append(device.texture(60, 40, format))
        device.write(textures[-1], rgba, 60 * rgba[0, 0].nbytes)
    for rule in (CompositeSettings("add", 0.6, 0.0), CompositeSettings("screen", 1.0, 0.3), CompositeSettings("add", None, 0.5)):
        composite = LinearComposite(device, *textures, rule, 1.0)
        composite.measure(rule)
        encoder = device.encoder()
        composite.record(encoder)
        device.submit(encoder)
        got = np.frombuffer(device.read(composite.result, 8), np.float16).reshape(40, 60, 4)[..., :3].astype(np.float32)
        want, _ = blend(image, layer.astype(np.float16).astype(np.float32), rule)
        np.testing.assert_allclose(got, want, rtol=2e-3, atol=1e-4)


def test_dragging_the_light(hands: Driver) -> None:
    area = hands.viewer.area()
    start = controls.to_canvas((0.3, 0.4), area)
    before = hands.frame()
    hands.drag(start, controls.to_canvas((0.7, 0.2), area))
    assert hands.state.lights[0].position == pytest.approx((0.7, 0.2), abs=0.01)
    assert np.abs(hands.frame().astype(int) - before).max() > 20
    hands.drag(controls.to_canvas((0.5, 0.9), area), controls.to_canvas((0.1, 0.9), area))  # not at the light
    assert hands.state.lights[0].position == pytest.approx((0.7, 0.2), abs=0.01)


def test_a_light_below_the_panel_is_not_dragged(hands: Driver) -> None:
    hands.state.lights[0].position = controls.to_picture(hands.where("samples"), hands.viewer.area())
    place = hands.state.lights[0].position
    hands.drag(hands.where("samples"), hands.where("samples", 0.8))
    assert hands.state.lights[0].position == place
    assert hands.state.parameters.samples > 200


def test_a_double_click_puts_the_light_there(hands: Driver) -> None:
    hands.event("double_click", controls.to_canvas((0.6, 0.7), hands.viewer.area()), button=1)
    assert hands.state.lights[0].position == pytest.approx((0.6, 0.7), abs=0.01)
    hands.event("double_click", hands.where("samples"), button=1)  # of the panel
    assert hands.state.lights[0].position == pytest.approx((0.6, 0.7), abs=0.01)


def test_light_colour_and_strength(hands: Driver) -> None:
    bright = hands.frame(2)[:, 400:].astype(int)
    hands.drag(hands.where("strength 0", 0.25), hands.where("strength 0", 0.0))
    assert hands.state.lights[0].strength == 0
    dark = hands.frame(2)[:, 400:].astype(int)
    assert (dark <= bright + 1).all() and (bright - dark).max() > 5


def test_split(hands: Driver, codes: np.ndarray) -> None:
    lit = hands.frame()
    hands.click("split")
    assert hands.state.split == 0.5
    area = hands.viewer.area()
    hands.drag(controls.to_canvas((0.5, 0.3), area), controls.to_canvas((0.2, 0.3), area))
    assert hands.state.split == pytest.approx(0.2, abs=0.01)
    seen = read_image(hands.viewer.screenshot()).codes
    edge = round(0.2 * codes.shape[1])
    assert np.array_equal(seen[:, : edge - 2], codes[:, : edge - 2])
    assert not np.array_equal(seen[:, edge + 2 :], codes[:, edge + 2 :])
    hands.click("split")
    assert hands.state.split is None and np.array_equal(hands.frame()[:, 400:], lit[:, 400:])


def test_without_shafts_the_picture_as_it_was(hands: Driver, codes: np.ndarray) -> None:
    hands.click("shafts")
    assert not hands.state.shafts
    assert np.array_equal(read_image(hands.viewer.screenshot()).codes, codes)


def test_debug_views(hands: Driver, codes: np.ndarray) -> None:
    from airlight import Renderer
    from airlight.occlusion.automatic import auto_threshold
    from airlight.options import Parameters
    from airlight.scatter.render import emitted, source_pixels

    hands.choose("debug", "occlusion")
    seen = read_image(hands.viewer.screenshot()).codes
    rgba = np.dstack([codes, np.full(codes.shape[:2], 255, np.uint8)])
    p = auto_threshold(Parameters(), hands.viewer.picture.coarse, [hands.state.lights[0].image_light()])
    gpu = Renderer()
    mask = source_pixels(gpu, *emitted(gpu, rgba, p, fraction=True), rgba.shape[1])[..., 0]
    assert np.abs(seen[..., 0] / 255.0 - mask).max() < 0.01 and mask.max() > 0.9 > 0.1 > mask.min()
    hands.choose("debug", "source")
    assert not np.array_equal(read_image(hands.viewer.screenshot()).codes, seen)
    hands.choose("debug", "lines")  # a small picture is summed directly
    assert hands.state.is_error == (hands.state.debug is None)
    hands.choose("debug", "none") if hands.state.debug else None


def test_times(hands: Driver) -> None:
    hands.open_group("Times")
    hands.frame(2)
    names = [label for label, ms in hands.state.passes if ms > 0]
    assert "source" in names and "composite" in names and len(names) >= 3
    hands.open_group("Times")
    assert not hands.state.timing


def test_nothing_is_computed_while_nothing_changes(hands: Driver, monkeypatch: pytest.MonkeyPatch) -> None:
    hands.frame(3)
    monkeypatch.setattr(type(hands.viewer.picture.plan), "submit", lambda *_, **__: pytest.fail("computed again"))
    hands.frame(3)
