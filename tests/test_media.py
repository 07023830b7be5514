"""What a medium and a march are on the command line and in files: triples, words for numbers, media, and what is refused."""

import re
from typing import Any

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some

from airlight.cli import image, main, render, view
from airlight.cli.options import gather
from airlight.compare.variants import variant
from airlight.errors import AirlightError
from airlight.medium.resolve import EMPTY_DEPTH, HIDING_DEPTH, doubt, resolve
from airlight.options import ALL, OF_PICTURES, OF_SCENES, DaylightScene, March, Medium, SceneOptions, build, declared, presets
from airlight.options.daylight import OF_PICTURE
from airlight.options.declare import as_text
from airlight.scatter.methods import of_medium, of_screen

RENDER = ("render", "-o", "a.png", "--width", "32")
NUMBERS = some.floats(0, 1e6)


def asked(*words: str, command: Any = render.render) -> dict[str, Any]:
    """The values that a command's options give."""
    with command.make_context(command.name, ["table", *(["-o", "a.png"] if command is render.render else []), *words]) as ctx:
        return gather(ctx, None, ctx.params.get("medium"))


# declarations


def test_a_medium_belongs_to_scenes() -> None:
    assert set(ALL) - set(OF_PICTURES) == {SceneOptions, Medium, March, DaylightScene} == set(OF_SCENES)
    method = next(d for d in declared() if d.name == "method")
    assert method.choices == of_screen() and set(of_screen()).isdisjoint(of_medium())
    assert next(d for d in declared(scenes=True) if d.name == "method").choices == (*of_screen(), *of_medium())
    for d in declared(scenes=True):
        assert set(d.methods) <= {*of_screen(), *of_medium()}, d.name
        assert d.group not in ("medium", "march", "article") or (d.methods and not set(d.methods) & set(of_screen())), d.name


def test_what_declarations_say() -> None:
    by_name = {d.name: d for d in declared(scenes=True)}
    sigma_t, steps, snap = by_name["sigma_t"], by_name["steps"], by_name["snap"]
    assert (sigma_t.kind, sigma_t.is_triple, sigma_t.default, sigma_t.low, sigma_t.high) == (float, True, None, 0, 1e6)
    assert (by_name["albedo"].default, by_name["albedo"].high) == ((0.9, 0.9, 0.9), 1)
    assert (steps.kind, steps.words, steps.choices, steps.default, steps.low, steps.high) == (int, ("exact", "table"), (), None, 1, 4096)
    assert (snap.kind, snap.default, by_name["extinction"].default) == (bool, False, True)
    assert (by_name["jitter"].choices, by_name["jitter"].default) == (("fixed", "midpoint", "gradient", "blue"), None)


@pytest.mark.parametrize("given", [0.5, (0.5, 0.5, 0.5), [0.5] * 3, np.array([0.5] * 3), np.float64(0.5)])
def test_one_number_stands_for_three(given: Any) -> None:
    medium = Medium(albedo=given, sigma_t=given)
    assert medium == Medium(albedo=(0.5, 0.5, 0.5), sigma_t=(0.5, 0.5, 0.5)) and isinstance(medium.albedo, tuple)
    assert hash(medium) == hash(Medium(albedo=0.5, sigma_t=0.5))


@pytest.mark.parametrize("bad", [-1, (1, 2), (1, 2, 3, 4), (0.1, "x", 0), float("nan"), (0, 0, float("inf")), "0.5", True, [], {}])
def test_what_is_no_triple(bad: Any) -> None:
    with pytest.raises(AirlightError, match=r"^sigma_t = [^\n]*$"):
        Medium(sigma_t=bad)


# the command line


@given(some.tuples(NUMBERS, NUMBERS, NUMBERS), some.integers(1, 4096) | some.just("exact"), some.booleans())
def test_values_are_written_and_read(sigma_t: Any, steps: Any, snap: bool) -> None:
    text = as_text(sigma_t)
    assert text.count(",") == (0 if len(set(sigma_t)) == 1 else 2)
    words = ("--method", "march", "--sigma-t", text, "--steps", str(steps), "--snap" if snap else "--no-snap")
    wanted = {"method": "march", "sigma_t": sigma_t, "steps": steps, "snap": snap}
    assert asked(*words) == wanted
    written = f"method=march,sigma_t={as_text(sigma_t, '/')},steps={steps},snap={as_text(snap)}"
    assert presets.written(written) == wanted


@pytest.mark.parametrize("text", ["0.25", "0.25,0.25,0.25", " 0.25, .25 ,2.5e-1"])
def test_one_number_for_all_three(text: str) -> None:
    assert asked("--albedo", text) == {"method": "march", "albedo": (0.25, 0.25, 0.25)}


def test_defaults_are_what_is_declared() -> None:
    assert asked() == asked(command=view.view) == {}
    with render.render.make_context("render", ["table", "-o", "a.png"]) as ctx:
        assert {d.name: d.default for d in declared(scenes=True) if d.name in ctx.params.keys() - OF_PICTURE} == {
            d.name: ctx.params[d.name] for d in declared(scenes=True) if d.name in ctx.params.keys() - OF_PICTURE
        }
        assert {f.name for s in (Medium, March) for f in msgspec.structs.fields(s)} <= set(ctx.params)


def refused(capsys: pytest.CaptureFixture[str], *words: str) -> str:
    assert main(words) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.startswith("airlight: ") and err.count("\n") == 1
    return err


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ("--sigma-t 0.1,0.2", "three numbers, as in 0.1,0.2,0.3, or one for all three"),
        ("--sigma-t 0.1/0.2/0.3", "--sigma-t"),
        ("--sigma-t -1", "--sigma-t"),
        ("--albedo 0,0,1.5", "--albedo"),
        ("--albedo nan", "albedo"),
        ("--steps 0", "or write exact"),
        ("--steps exacd", "did you mean 'exact'"),
        ("--steps 1.5", "or write exact"),
        ("--sigma-d 1", "--sigma-t"),
        ("--medium hase", "did you mean 'haze'"),
        ("--medium vesper", "clear-air, haze, mist, smoke, underwater"),
        ("--medium no.toml", "no.toml"),
        ("--medium haze --samples 20", "--samples means nothing with method march, which --medium haze asks for: leave one of the two out"),
        ("--medium haze --method radial", "--medium means nothing with method radial"),
        ("--medium haze --preset vesper", "--method march"),
        ("--sigma-t 1 --method epipolar", "--sigma-t means nothing with method epipolar: leave it out, or use --method march"),
        ("--method march --samples 20", "--samples means nothing with method march"),
        ("--method article --steps 20", "--steps means nothing with method article"),
        ("--method march --article-cap 1", "--article-cap means nothing with method march: leave it out, or use --method article-prose"),
        ("--method article --article-cap 1", "--article-cap means nothing with method article"),
        ("--method article --cascades 4", "--cascades means nothing with method article: leave it out, or use --method march or art"),
        ("--method article --jitter blue", "--jitter means nothing with method article"),
    ],
)
def test_bad_values_are_refused_in_one_line(capsys: pytest.CaptureFixture[str], words: str, says: str) -> None:
    assert says in refused(capsys, "render", "table", "-o", "a.png", *words.split())


def test_a_scene_or_preset_that_asks_for_a_method_is_said(capsys: pytest.CaptureFixture[str], tmp_path: Any) -> None:
    assert "which the scene slats asks for: leave it out, or use --method epi" in refused(capsys, *RENDER, "slats", "--samples", "9")
    assert "--sigma-t means nothing with method radial: leave" in refused(capsys, *RENDER, "slats", "--method", "radial", "--sigma-t", "1")
    preset = tmp_path / "mine.toml"
    preset.write_text('method = "radial"\n')
    assert f"radial, which --preset {preset} asks for" in refused(capsys, *RENDER, "slats", "--preset", str(preset), "--sigma-t", "1")


def test_pictures_have_no_medium(capsys: pytest.CaptureFixture[str], tmp_path: Any) -> None:
    for command in ("image", "compare"):
        for method in of_medium():
            said = refused(capsys, command, "in.png", "-o", "a.png", "--method", method)
            assert f"method {method} lights the air" in said and "airlight render SCENE" in said
        assert "--sigma-t" in refused(capsys, command, "in.png", "-o", "a.png", "--sigma-t", "1")
    preset = tmp_path / "lit.toml"
    preset.write_text('method = "march"\n')
    assert "airlight render SCENE" in refused(capsys, "image", "in.png", "-o", "a.png", "--preset", str(preset))
    known = {name for p in image.image.params for name in (p.name, *p.opts)}
    assert not known & {"sigma_t", "steps", "--medium", "--list-media"}
    from airlight import light_shafts

    with pytest.raises(AirlightError, match="airlight render SCENE"):
        light_shafts(np.ones((8, 8, 3), np.float32), (0.5, 0.5), method="march", occlusion="none")


# media


def test_our_media_load_and_say_their_sources(capsys: pytest.CaptureFixture[str]) -> None:
    assert presets.names(presets.MEDIA) == ("clear-air", "haze", "mist", "smoke", "underwater")
    for name in presets.names(presets.MEDIA):
        said = presets.load(name, presets.MEDIA)
        shaped = {"rayleigh": set(), "henyey-greenstein": {"anisotropy"}}[said["phase"]]
        assert set(said) == {"sigma_t", "albedo", "phase"} | shaped  # whatever the defaults are
        assert re.search(r"\((.* (19|20)\d\d.*)\)", presets.description(name, presets.MEDIA)), name
        assert build(said)[Medium] != Medium()
    for command in ("render", "view"):
        assert main([command, "--list-media"]) == 0
        assert [line.split()[0] for line in capsys.readouterr().out.splitlines()] == list(presets.names(presets.MEDIA))


def test_media_have_the_coefficients_of_their_sources() -> None:
    media = {name: Medium(**presets.load(name, presets.MEDIA)) for name in presets.names(presets.MEDIA)}
    nm = np.array([650.0, 570.0, 475.0])
    scattered = {name: np.multiply(m.sigma_t, m.albedo) for name, m in media.items()}
    rayleigh = 8 * np.pi**3 * (1.0003**2 - 1) ** 2 / (3 * 2.545e25 * (nm * 1e-9) ** 4) * (6 + 3 * 0.035) / (6 - 7 * 0.035)
    np.testing.assert_allclose(media["clear-air"].sigma_t, rayleigh + 4e-6 / 0.9, rtol=1e-3)
    np.testing.assert_allclose(scattered["clear-air"], rayleigh + 4e-6, rtol=2e-3)
    np.testing.assert_allclose(media["haze"].sigma_t, 3.912 / 3000 * (nm / 550) ** (-0.585 * 3 ** (1 / 3)), rtol=1e-3)
    np.testing.assert_allclose(media["mist"].sigma_t, 3.912 / 1500, rtol=1e-3)
    np.testing.assert_allclose(media["smoke"].sigma_t, 8.7 * 0.010 * 633 / nm, rtol=1e-3)
    np.testing.assert_allclose(scattered["underwater"], 0.037 * 514 / nm, rtol=1e-2)
    np.testing.assert_allclose(media["underwater"].sigma_t - scattered["underwater"], [0.340, 0.0695, 0.0114], rtol=1e-2)


def test_the_command_line_goes_over_the_medium_and_that_over_the_preset(tmp_path: Any) -> None:
    haze = presets.load("haze", presets.MEDIA)
    assert asked("--medium", "haze") == {"method": "march", **haze}
    assert asked("--medium", "haze", "--anisotropy", "0", command=view.view) == {"method": "march", **haze, "anisotropy": 0}
    preset, medium = tmp_path / "mine.toml", tmp_path / "stuff.toml"
    preset.write_text('method = "march"\nsigma_t = 3\nsteps = "exact"\nmax_distance = 9\nsnap = true\n')
    medium.write_text('description = "stuff"\nsigma_t = [1, 2.5, 3]\nmax_distance = 5\n')
    with render.render.make_context("render", ["table", "-o", "a.png", "--max-distance", "7"]) as ctx:
        found = gather(ctx, str(preset), str(medium))
    assert found == {"method": "march", "sigma_t": (1, 2.5, 3), "steps": "exact", "max_distance": 7, "snap": True}


def test_a_medium_s_file_holds_a_medium_alone(tmp_path: Any) -> None:
    path = tmp_path / "a.toml"
    bad = {"samples = 3": "it is none of a medium's", "sigmat = 3": "did you mean 'sigma_t'", "albedo = [1, 2, 3]": "albedo"}
    for text, says in bad.items():
        path.write_text(text)
        with pytest.raises(AirlightError, match=says):
            presets.load(path, presets.MEDIA)


@given(some.fixed_dictionaries({"sigma_t": some.tuples(NUMBERS, NUMBERS, NUMBERS), "steps": some.just("exact") | some.integers(1, 4096)}))
def test_presets_keep_a_medium(tmp_path_factory: pytest.TempPathFactory, values: dict[str, Any]) -> None:
    path = tmp_path_factory.mktemp("media") / "a.toml"
    values |= {"extinction": False, "ambient": (0.0, 0.0, 1e-5)}
    presets.save(path, values | {"max_distance": None})
    assert presets.load(path) == values


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("sigma_t=1/2", "0.1/0.2/0.3, or one"),
        ("sigma_t=a", "0.1/0.2/0.3, or one"),
        ("sigma_t=1,2", "0.1/0.2/0.3, or one"),
        ("sigma_t=1,2,3,4", "no preset '4'"),
        ("samples=1,2", "no preset '2'"),
        ("preset=hx", "a preset is named alone: write hx in place of preset=hx"),
        ("steps=exacd", "did you mean 'exact'"),
        ("steps=0", "steps"),
        ("snap=perhaps", "snap"),
        ("phase=raleigh", "did you mean 'rayleigh'"),
    ],
)
def test_bad_texts_of_variants(text: str, says: str) -> None:
    with pytest.raises(AirlightError, match=re.escape(says)):
        presets.written(text)


def test_a_triple_of_a_variant_may_have_commas_and_a_key_dashes() -> None:
    one = variant("hx,noise-amount=3,wind=1, 0,0,fog=exponential", {}, in_scene=True)
    assert (one.medium.noise_amount, one.medium.wind, one.medium.fog) == (3, (1, 0, 0), "exponential")
    assert one.name == "hx, noise amount 3, wind 1/0/0, fog exponential"
    assert presets.written("wind=-1,0,0.5,samples=4") == presets.written("wind=-1/0/0.5,samples=4")


# what is doubtful


@pytest.mark.parametrize("color", [(1, 1, 1), (1, 0.5, 2)])
@pytest.mark.parametrize("distance", [0.0, 50.0])
@given(depth=some.floats(1e-5, 100))
def test_a_medium_that_is_too_thin_or_too_dense_is_told(distance: float, color: Any, depth: float) -> None:
    near, far = max(distance, 10.0), max(distance, 20.0)
    sigma_t = tuple(depth / near * c for c in color)
    said = doubt(resolve(Medium(sigma_t=sigma_t, max_distance=1e6), March(), "normal", 10.0), distance, 10.0)
    least, most = depth * min(color), depth * max(color) * far / near
    if least > HIDING_DEPTH * (1 + 1e-9):
        assert said is not None and "hides" in said
    elif most < EMPTY_DEPTH * (1 - 1e-9):
        assert said is not None and "too thin to be seen but by a very strong light: an optical depth" in said
    elif most > EMPTY_DEPTH * (1 + 1e-9) and least < HIDING_DEPTH * (1 - 1e-9):
        assert said is None
    if said is not None:
        assert "\n" not in said
        suits = [float(v) for v in said.rpartition("about ")[2].split()[0].split(",")]
        good = Medium(sigma_t=suits if len(suits) == 3 else suits[0], max_distance=1e6)
        assert doubt(resolve(good, March(), "normal", 10.0), distance, 10.0) is None
        np.testing.assert_allclose(np.divide(good.sigma_t, good.sigma_t[0]), np.divide(color, color[0]), rtol=0.1)


def test_where_there_is_no_doubt() -> None:
    def said(distance: float = 20.0, **keywords: Any) -> str | None:
        return doubt(resolve(Medium(**keywords), March(), "normal", 10.0), distance, 10.0)

    assert said() is None  # unset
    assert said(sigma_t=0) is None  # it is meant to be empty
    assert said(sigma_t=10) and said(sigma_t=10, extinction=False) is None  # surfaces are seen
    assert said(sigma_t=10, max_distance=0.3) is None  # it ends before
    assert said(sigma_t=(10, 10, 0.01)) is None  # blue is seen
