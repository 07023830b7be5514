"""Exposure and view transforms of scenes: lights in lux and candela, `--ev`, views by name, and what outputs hold of it."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from calling import call
from gltfs import SQUARE, SQUARE_FACES, Writer

from airlight.cli import main
from airlight.composite import view
from airlight.errors import AirlightError
from airlight.files import read_image, read_settings
from airlight.jobs.light_text import PLACE, SUN, read_light, read_scene_light
from airlight.reference import tone as twin
from airlight.reference.colour import srgb_decode

pytest.importorskip("pygfx")
from test_daylight_scene import lit_stage

from airlight.scenes import open_scene
from airlight.scenes.environment import SKY_SHARE, Environment, load_environment
from airlight.scenes.exposure import expose, is_physical, lacking, lacking_outdoors, meter
from airlight.scenes.offline import Shot, Studio

RNG = np.random.default_rng(16)
LUX, CANDELA = 68300.0, 54351.0  # what Blender exports of a sun of 100 W/m2, and of a lamp of 1000 W


def room(folder: Path, kind: str = "point", intensity: float = CANDELA, moves: bool = False) -> str:
    """A wall and a post before it, lit from before both, on the side; a camera."""
    w = Writer()
    grey = w.add("materials", pbrMetallicRoughness={"baseColorFactor": [0.5, 0.5, 0.5, 1], "metallicFactor": 0})
    wall = w.mesh(SQUARE, SQUARE_FACES, grey, NORMAL=[(0, 0, 1)] * 4)
    w.node(mesh=wall, scale=[6, 6, 1], translation=[-3, -3, 0])
    post = w.node(mesh=wall, scale=[0.3, 2, 1], translation=[0, -1, 1])
    light = w.node(extensions=w.light(type=kind, intensity=intensity), translation=[1.5, 0.5, 2], rotation=[0, 0.2, 0, math.sqrt(0.96)])
    if moves:
        w.animate(post, "translation", [0, 1], [[-2, -1, 1], [2, -1, 1]])
        w.animate(light, "translation", [0, 1], [[1.5, 0.5, 2], [1.5, 0.5, 0.4]], clip=0)
    w.node(camera=w.add("cameras", type="perspective", perspective={"yfov": 1.0, "znear": 0.1}), translation=[0, 0, 5])
    return w.save(folder)


def render(*args: Any) -> int:
    return main(["render", *map(str, args), "--width", "96", "--height", "64", "--quality", "draft", "-y"])


def codes(path: Path) -> np.ndarray:
    return read_image(str(path)).codes


@pytest.mark.parametrize("method", ["march", "epipolar"])
@pytest.mark.parametrize(("kind", "intensity"), [("point", CANDELA), ("spot", CANDELA), ("directional", LUX)])
def test_lights_in_lux_and_candela_have_tones(kind: str, intensity: float, method: str, tmp_path: Path, capsys: Any) -> None:
    out = tmp_path / "a.png"
    assert render(room(tmp_path, kind, intensity), "-o", out, "--method", method) == 0
    said = capsys.readouterr().err
    first, _, rest = said.partition("\n")
    assert first.startswith("airlight: exposure -") and first.endswith("EV, automatic for lights in lux and candela; --ev N sets it")
    assert not rest or (method == "epipolar" and "behind the camera" in rest and rest.count("\n") == 1)
    seen = codes(out)[..., :3].max(axis=-1)
    assert (seen > 250).mean() < 0.1 and 40 < seen.mean() < 215 and seen.std() > 10


def test_the_exposure_is_kept_and_the_same_when_it_is_asked_for(tmp_path: Path, capsys: Any) -> None:
    scene = room(tmp_path)
    assert render(scene, "-o", tmp_path / "a.png") == 0
    ev = json.loads(read_settings(str(tmp_path / "a.png")))["ev"]
    assert f"{ev:+.2f} EV" in capsys.readouterr().err
    assert render(scene, "-o", tmp_path / "b.png", "--ev", ev) == 0
    assert capsys.readouterr().err == ""
    assert (codes(tmp_path / "a.png") == codes(tmp_path / "b.png")).all()
    assert render(scene, "-o", tmp_path / "c.png", "--ev", ev - 1) == 0
    assert codes(tmp_path / "c.png").mean() < codes(tmp_path / "a.png").mean() - 10
    assert render(scene, "-o", tmp_path / "d.png", "--settings-from", tmp_path / "a.png") == 0
    assert (codes(tmp_path / "a.png") == codes(tmp_path / "d.png")).all()


def test_what_is_far_too_bright_is_white(tmp_path: Path) -> None:
    """Beyond what a half float holds: some drivers write infinity for it, some no number, which would be black."""
    scene = room(tmp_path)
    assert render(scene, "-o", tmp_path / "a.png", "--method", "march", "--ev", 20, "--view-transform", "none") == 0
    assert (codes(tmp_path / "a.png")[..., :3] == 255).mean() > 0.99


def test_lights_of_order_1_keep_their_exposure(tmp_path: Path, capsys: Any) -> None:
    scene = room(tmp_path, intensity=8)
    assert render(scene, "-o", tmp_path / "a.png") == 0 and render(scene, "-o", tmp_path / "b.png", "--ev", 0) == 0
    assert capsys.readouterr().err == ""
    assert (codes(tmp_path / "a.png") == codes(tmp_path / "b.png")).all()
    assert not is_physical(open_scene("table").scene) and not is_physical(open_scene("flying").scene)


def test_lamps_of_a_file_that_would_burn_are_exposed(tmp_path: Path, capsys: Any) -> None:
    """A lamp of 10 W of Blender's, 543 cd, two metres before a wall; of 120 cd, in a room that is not burned, stays as it is."""
    (tmp_path / "far").mkdir()
    assert render(room(tmp_path, intensity=543.5), "-o", tmp_path / "a.png") == 0
    said = capsys.readouterr().err
    assert said.startswith("airlight: exposure -") and 20 < codes(tmp_path / "a.png").mean() < 200
    w = Writer()
    w.node(mesh=w.mesh(SQUARE, SQUARE_FACES, NORMAL=[(0, 0, 1)] * 4), scale=[60, 60, 1], translation=[-30, -30, 0])
    w.node(extensions=w.light(type="point", intensity=120.0), translation=[0, 0, 12])
    w.node(camera=w.add("cameras", type="perspective", perspective={"yfov": 1.0, "znear": 0.1}), translation=[0, 0, 30])
    assert render(w.save(tmp_path / "far"), "-o", tmp_path / "b.png") == 0 and "exposure" not in capsys.readouterr().err


def test_any_frames_of_an_animation_have_one_exposure(tmp_path: Path) -> None:
    scene = room(tmp_path, moves=True)
    for folder, frames in (("whole", "1-3"), ("last", "3")):
        (tmp_path / folder).mkdir()
        assert render(scene, "-o", tmp_path / folder / "a.####.png", "--frames", frames, "--fps", "3", "--method", "march") == 0
    whole, last = ((tmp_path / folder / "a.0003.png").read_bytes() for folder in ("whole", "last"))
    assert whole == last
    assert render(scene, "-o", tmp_path / "still.png", "--time", 2 / 3, "--method", "march") == 0
    assert (codes(tmp_path / "still.png") == codes(tmp_path / "last" / "a.0003.png")).all()


@pytest.mark.parametrize("method", ["march", "radial"])
def test_files_of_light_hold_the_light_itself(method: str, tmp_path: Path, capsys: Any) -> None:
    """The same scene 1024 times as bright, whatever exposure is asked for: beyond half floats, within floats."""
    for name, intensity, more in (("one", 2000.0, ()), ("many", 2000.0 * 2**10, ()), ("ev", 2000.0 * 2**10, ("--ev", 3))):
        (tmp_path / name).mkdir()
        assert render(room(tmp_path / name, "point", intensity), "-o", tmp_path / f"{name}.exr", "--method", method, *more) == 0
    assert capsys.readouterr().err == ""
    one, many, ev = (read_image(str(tmp_path / f"{name}.exr")) for name in ("one", "many", "ev"))
    assert many.bits == 32 and np.isfinite(many.codes).all() and many.codes[..., :3].max() > 65504
    assert (many.codes == ev.codes).all()
    assert (many.codes[..., :3] == 2**10 * one.codes[..., :3]).all()
    if method == "radial":  # the wall, 2 m from the lamp, and what it mirrors
        assert one.codes[..., :3].max() == pytest.approx(2000 * 0.5 / (4 * math.pi), rel=0.15)


def test_no_light_beyond_half_floats_becomes_infinite(tmp_path: Path) -> None:
    """A lamp a centimetre before the wall."""
    w = Writer()
    w.node(mesh=w.mesh(SQUARE, SQUARE_FACES, NORMAL=[(0, 0, 1)] * 4), scale=[6, 6, 1], translation=[-3, -3, 0])
    w.node(extensions=w.light(type="point", intensity=1e8), translation=[0, 0, 0.01])
    w.node(camera=w.add("cameras", type="perspective", perspective={"yfov": 1.0, "znear": 0.1}), translation=[0, 0, 5])
    assert render(w.save(tmp_path), "-o", tmp_path / "a.exr", "--method", "march") == 0
    seen = read_image(str(tmp_path / "a.exr")).codes
    assert np.isfinite(seen).all() and seen.max() < 1e10


def test_a_scene_is_scaled_and_back() -> None:
    stage = open_scene("table")
    lamp = next(thing for thing in stage.scene.iter() if type(thing).__name__ == "PointLight")
    before = lamp.intensity
    lamp.intensity = 2000.0
    expose(stage, 2.0**-9)
    assert lamp.intensity == 2000 / 512 and stage.pre_exposure == 2.0**-9
    expose(stage, 2.0**-3)
    assert lamp.intensity == 250
    expose(stage, 1.0)
    lamp.intensity = before
    assert meter(stage, lambda time, pre: (np.zeros(1), np.zeros(1, bool))).automatic is None


def test_the_sky_is_in_proportion_to_the_sun(tmp_path: Path) -> None:
    """Twice the sun is twice the sky; the sky of a sun as strong as its own is itself."""
    maps = {}
    for lux in (LUX, 2 * LUX, 3.0):
        stage = open_scene(room(tmp_path, "directional", lux), "sky")
        studio = Studio(stage, Shot(64, 48, 1))
        material = next(thing.material for thing in stage.scene.iter() if type(thing).__name__ == "Background")
        lit = next(thing.material for thing in stage.scene.iter() if hasattr(getattr(thing, "material", None), "env_map_intensity"))
        top = srgb_decode(material.map.texture.data[2, 32, 32, :3].astype(float)).mean()
        maps[lux] = top / studio.exposure.pre, float(lit.env_map_intensity) / studio.exposure.pre
    own = load_environment("sky").sun_illuminance()
    np.testing.assert_allclose(maps[2 * LUX], np.multiply(2, maps[LUX]), rtol=2e-3)
    np.testing.assert_allclose(np.divide(maps[LUX], maps[3.0]), LUX / own, rtol=2e-3)


def test_a_clipped_sun_is_measured_by_its_sky() -> None:
    picture = np.full((64, 128, 3), 1.0, np.float32)
    assert Environment(picture).sun_illuminance() == pytest.approx(math.pi / SKY_SHARE, rel=1e-3)
    picture[20, 60:63] = 4000.0
    direct = float(Environment(picture).sun_and_light()[1][0])
    assert direct > math.pi / SKY_SHARE
    assert Environment(picture).sun_illuminance() == pytest.approx(direct, rel=1e-3)


# ---------------------------------------------------------------- units


@pytest.mark.parametrize(
    ("text", "form", "intensity"),
    [
        ("0,2,-3;strength=800cd", PLACE, 800),
        ("0,2,-3;strength=1000W", PLACE, CANDELA),
        ("0,2,-3;strength=8.0e2 lm", PLACE, 800 / (4 * math.pi)),
        ("30,40;strength=68300lx", SUN, LUX),
        ("30,40;strength=68300 lux", SUN, LUX),
        ("30,40;strength=100W/m2", SUN, LUX),
        ("0,2,-3;strength=1e2", PLACE, None),
    ],
)
def test_units_of_lights(text: str, form: str, intensity: float | None) -> None:
    light = read_scene_light(text, form)
    assert light.intensity == (None if intensity is None else pytest.approx(intensity, rel=1e-4))
    assert light.strength == (100 if intensity is None else 1)


@pytest.mark.parametrize(
    ("text", "form", "says"),
    [
        ("0,2,-3;strength=800lx", PLACE, "a lamp has no lx"),
        ("30,40;strength=800cd", SUN, "a sun has no cd"),
        ("0,2,-3;strength=8nits", PLACE, "write cd, lm or W, as in strength=800cd"),
        ("0,2,-3;strength=-8cd", PLACE, "beyond 0 to 1e9"),
        ("0,2,-3;strength=1..2cd", PLACE, "write numbers"),
    ],
)
def test_units_that_are_none(text: str, form: str, says: str) -> None:
    with pytest.raises(AirlightError, match=says):
        read_scene_light(text, form)


def test_a_picture_has_no_units() -> None:
    with pytest.raises(AirlightError, match="a picture's lights have none"):
        read_light("0.5,0.5;strength=3cd")


def test_a_lamp_that_is_moved_takes_the_unit(tmp_path: Path, capsys: Any) -> None:
    """The picture of a file whose lamp has these candela, there."""
    (tmp_path / "weak").mkdir()
    strong, weak = room(tmp_path), room(tmp_path / "weak", intensity=3)
    assert render(strong, "-o", tmp_path / "a.png", "--method", "march") == 0
    light = f"1.5,0.5,2;strength={CANDELA}cd"
    assert render(weak, "-o", tmp_path / "b.png", "--method", "march", "--light", light) == 0
    first, second = capsys.readouterr().err.splitlines()
    assert first == second
    assert np.abs(codes(tmp_path / "a.png").astype(int) - codes(tmp_path / "b.png")).max() <= 1


# ---------------------------------------------------------------- view transforms


def test_agx() -> None:
    """Against the polynomial of sixth order that Wrensch fitted to the same curve, whose mean square error he gives as 3.7e-6."""
    x = np.linspace(0, 1, 1001)
    fit = ((((15.5 * x - 40.14) * x + 31.96) * x - 6.868) * x + 0.4298) * x + 0.1191
    assert np.abs(twin.agx_curve(x) - (fit * x - 0.00232)).max() < 0.006
    assert twin.agx_curve(np.array([0.0, 10 / 16.5, 1.0])) == pytest.approx([0, 0.5, 1], abs=1e-12)
    grey = twin.agx(np.repeat(2.0 ** np.arange(-14, 9)[:, None], 3, axis=1))
    assert (np.diff(grey, axis=0) >= 0).all() and np.ptp(grey, axis=1).max() < 2e-3
    assert twin.agx(np.full((1, 3), 0.18))[0] == pytest.approx(0.5**2.2, rel=1e-3)


def test_view_functions() -> None:
    color = 10.0 ** RNG.uniform(-4, 4, (500, 3))
    np.testing.assert_allclose(call("composite/tone.wgsl", "agx", [color]), twin.agx(color), rtol=2e-3, atol=2e-5)
    x = RNG.random(500)
    np.testing.assert_allclose(call("composite/tone.wgsl", "agx_curve", [x]), twin.agx_curve(x), rtol=1e-4, atol=1e-5)
    found = call("composite/tone.wgsl", "view_coordinate", [color])
    np.testing.assert_allclose(found, twin.view_coordinate(color), rtol=1e-4, atol=1e-6)
    assert twin.view_coordinate(np.array([0.0, view.FAR])) == pytest.approx([0, 1])


@pytest.mark.parametrize("name", ["filmic", "agx", "none", "aces", "Un-tone-mapped"])
def test_a_view_is_that_of_its_twin_and_of_opencolorio(name: str, tmp_path: Path) -> None:
    """The table of a view is within 1.5 codes of OpenColorIO's own transform, with what the driver's filter of 8 bits adds."""
    scene = room(tmp_path, intensity=20)
    assert render(scene, "-o", tmp_path / "a.png", "--view-transform", name, "--method", "march", "--ev", "1", "--no-antialias") == 0
    assert render(scene, "-o", tmp_path / "a.exr", "--method", "march", "--no-antialias") == 0
    light = read_image(str(tmp_path / "a.exr")).codes[..., :3].astype(np.float64)
    expected = twin.displayed(2 * light, name).clip(0, 1)
    seen = srgb_decode(codes(tmp_path / "a.png")[..., :3] / 255)
    encoded = np.where(expected <= 0.0031308, 12.92 * expected, 1.055 * expected ** (1 / 2.4) - 0.055)
    off = np.abs(codes(tmp_path / "a.png")[..., :3] - 255 * encoded)
    assert off.max() < 2.0 and seen.std() > 0.01  # dithered by half a code


def test_views_that_are_none(tmp_path: Path, capsys: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = room(tmp_path)
    for name, says in (("cinema", "is no view transform; there is none, filmic, agx, 'ACES"), ("a", "may be one of several views")):
        assert render(scene, "-o", tmp_path / "a.png", "--view-transform", name) == 2
        err = capsys.readouterr().err
        assert says in err and err.count("\n") == 1
    monkeypatch.setenv("OCIO", str(tmp_path / "missing.ocio"))
    assert render(scene, "-o", tmp_path / "a.png", "--view-transform", "aces") == 2
    assert "$OCIO names cannot be used" in capsys.readouterr().err
    assert render(scene, "-o", tmp_path / "a.png", "--view-transform", "agx") == 0


# ---------------------------------------------------------------- the measure


def test_the_measure_of_luminances() -> None:
    even = np.full(1000, 0.0675)
    assert lacking(even) == pytest.approx(2.0)  # to 0.27
    lamp = np.concatenate([even, np.full(10, 20.0)])  # 1 % of highlights count for nothing, nor do 90 % of black
    assert lacking(lamp) == pytest.approx(2.0)
    assert lacking(np.concatenate([even, np.zeros(9000)])) == pytest.approx(2.0)
    assert lacking(np.concatenate([even, np.full(100, 32.0)])) == pytest.approx(-4.0)  # a tenth are kept from burning out
    assert lacking(8 * even) == pytest.approx(-1.0)
    assert lacking(np.zeros(100)) == 0


def outdoors(ground: np.ndarray, sky: np.ndarray) -> float:
    return lacking_outdoors(np.concatenate([ground, sky]), np.arange(ground.size + sky.size) < ground.size)


def test_neither_the_suns_disc_nor_its_glint_leads_the_exposure_outdoors() -> None:
    ground, sky = 0.05 * 2.0 ** RNG.uniform(-2, 2, 7000), 2.0 ** RNG.uniform(-0.5, 0.5, 3000)
    plain = outdoors(ground, sky)
    assert -1 < plain < 2
    disc = np.concatenate([sky, np.full(5, 2.0**15)])
    assert outdoors(ground, disc) == pytest.approx(plain, abs=0.02)
    for share in (0.01, 0.02, 0.03):
        glint = ground.copy()
        glint[: int(share * ground.size)] *= 2.0**12
        assert plain - 1.6 < outdoors(glint, sky) <= plain + 0.05
    assert outdoors(ground, sky / 1000) == pytest.approx(lacking(ground))  # of which a dark sky asks no more
    assert outdoors(np.concatenate([ground, np.zeros(500)]), sky) == pytest.approx(plain, abs=0.1)


def test_slopes_against_the_light_are_not_black_nor_their_sky_white() -> None:
    """As `valley` has them: a sky 5 stops above what lies in its own shadow."""
    ground, sky = 2.0 ** RNG.uniform(5, 8.5, 7700), 2.0 ** RNG.uniform(11.7, 12.8, 2300)
    shown = 2.0 ** outdoors(ground, sky)
    assert np.median(ground) * shown > 0.02 and np.median(sky) * shown < 1.3  # which keeps the colours of a sunset
    assert outdoors(ground / 1024, sky / 1024) == pytest.approx(math.log2(shown) + 10)
    assert outdoors(ground, np.zeros(0)) == pytest.approx(lacking(ground)) and outdoors(np.zeros(0), np.zeros(3)) == 0
    assert np.median(sky) * 2.0 ** outdoors(np.zeros(0), sky) == pytest.approx(0.7, rel=0.02)


def test_a_day_is_exposed_so_that_none_of_its_times_burns() -> None:
    class Sun:
        """A sun that moves, whose sky stays the same."""

        span = (0.0, 4.0)

        def move(self, *_: Any, **__: Any) -> None: ...

        def stops(self) -> float:
            return 0.0

    def exposed(glare: float) -> float:
        def seen(time: float, pre: float) -> tuple[np.ndarray, np.ndarray]:
            return np.full(1000, pre * 4000.0 * (glare if time > 3.5 else 1.0)), np.ones(1000, bool)

        stage = lit_stage()
        stage.measured, stage.daylight = True, Sun()
        found = meter(stage, seen).automatic
        assert found is not None
        return found

    even = exposed(1.0)
    assert 4000 * 2.0**even == pytest.approx(0.27, rel=0.02)
    assert exposed(8.0) == pytest.approx(even - 3 + 0.5, abs=0.02) and exposed(1 / 8) == pytest.approx(even, abs=0.02)


def test_what_stands_for_a_display_is_not_metered(tmp_path: Path) -> None:
    """A background that does not scale with the light moves the exposure by nothing."""
    found = []
    for environment in ("none", "sky"):
        stage = open_scene(room(tmp_path), environment)
        found.append(Studio(stage, Shot(96, 64, 1, eye=(0, 0, 25), target=(0, 0, 0))).exposure.ev)
    assert found[0] == pytest.approx(found[1], abs=0.02)


def test_a_picture_that_is_asked_too_bright_says_what_is_darker(tmp_path: Path, capsys: Any) -> None:
    near = ("--eye", "-1.5,1.5,1.5", "--target", "-1.5,1.5,0")
    assert render(room(tmp_path), "-o", tmp_path / "a.png", "--ev", 0, *near) == 0
    assert "of it is white: its lights want --ev -1" in capsys.readouterr().err
