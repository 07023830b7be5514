"""Options of scenes in daylight: refused before a scene is built, told where they do nothing; the scene's own sun where none is given."""

from typing import Any

import pygfx as gfx
import pytest
from test_daylight_scene import lit_stage, options

from airlight import scenes
from airlight.cli import main
from airlight.errors import AirlightError, AirlightWarning
from airlight.jobs.idle_options import tell_idle_in_daylight
from airlight.jobs.sun_of_scene import SunRequest, foresee_daylight, own_sun, put_daylight, with_daylight
from airlight.options import Daylight, DaylightScene, build
from airlight.scenes.names import SUNLESS

SUN = ("--sun", "60,20")


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ((), "needs a sun"),
        ((*SUN, "--samples", "40"), "--samples means nothing with method march, which --daylight air asks for"),
        ((*SUN, "--method", "march", "--decay", "0.9"), "--decay means nothing with method march: leave it out"),
        ((*SUN, "--method", "epipolar", "--soften", "2"), "--soften means nothing with method epipolar"),
        ((*SUN, "--occlusion-buffer", "b.png"), "with march give --layer"),
        ((*SUN, "--method", "epipolar", "--exclude", "door"), "--exclude goes with --occluders prepass"),
        ((*SUN, "--method", "slices", "--volume", "a.vdb"), "--volume means nothing with method slices"),
        (("--sun", "60,-19"), "below -18 no daylight is left"),
        (("--when", "2026-06-21T12:00Z"), "needs the place too"),
        (("--day", "2026-06-21", "--where", "47,11"), "several frames"),
        ((*SUN, "--from", "08:00Z"), "--from and --to go with --day"),
        ((*SUN, "--multiple", "none", "--visibility", "0.05"), "--visibility 0.05: of daylight next to nothing comes down"),
        ((*SUN, "--where", "91,0"), "the latitude 91 is beyond"),
    ],
)
def test_what_is_known_from_options_is_refused_before_the_scene_is_built(
    words: tuple[str, ...], told: str, capsys: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    def build_nothing(*_: Any, **__: Any) -> None:
        raise AssertionError("the scene was built")

    monkeypatch.setattr(scenes, "open_scene", build_nothing)
    assert main(["render", "table", "-o", "a.png", "--daylight", "air", *words]) == 2
    said = capsys.readouterr().err
    assert told in said and said.count("\n") == 1


def test_a_sequence_of_unknown_length_is_refused_before_the_scene_is_built_too() -> None:
    day, of_scene = options(day="2026-02-30", where="47,11")
    with pytest.raises(AirlightError, match="no such date"):
        foresee_daylight(day, of_scene, SunRequest(seconds=(0.0, 1.0)), "room.glb")
    assert foresee_daylight(*options(), SunRequest(), "room.glb") is None  # which may have a sun
    with pytest.raises(AirlightError, match="go with --day"):
        foresee_daylight(*options(), SunRequest(begin="08:00Z"), "room.glb")


def test_the_scenes_own_sun_stands_where_none_is_given(capsys: Any) -> None:
    stage = lit_stage()
    stage.lights[0].target.local.position = (0, 1, 1)  # from which it shines on the origin
    assert own_sun(stage) == pytest.approx((180, 45))
    day, of_scene = options(multiple="none", north=30.0)
    put_daylight(stage, {Daylight: day, DaylightScene: of_scene}, SunRequest())
    assert (stage.daylight.azimuth, stage.daylight.elevation) == pytest.approx((180, 45))
    said = capsys.readouterr().err
    assert said == "sun at azimuth 180.0, 45.0 degrees high, as the scene's own; --sun AZ,EL sets it\n"
    stage = lit_stage()
    stage.lights = stage.lights[1:]
    with pytest.raises(AirlightError, match="needs a sun"):
        put_daylight(stage, {Daylight: day, DaylightScene: of_scene}, SunRequest())


@pytest.mark.slow
def test_scenes_without_a_sun_are_known_by_name() -> None:
    assert tuple(name for name in scenes.NAMES if own_sun(scenes.open_scene(name)) is None) == SUNLESS


def test_dense_haze_is_refused_where_it_is_dark_alone() -> None:
    sun = SunRequest(("60,20",))
    with pytest.raises(AirlightError, match=r"give --visibility 0\.2 or more, or fog near the ground, as by --sigma-t 0\.078"):
        foresee_daylight(*options(visibility=0.05, multiple="none"), sun, "room.glb")
    for visibility, altitude in ((0.3, 2.0), (0.05, 9000.0)):
        day = options(visibility=visibility, altitude=altitude, multiple="none")
        assert foresee_daylight(*day, sun, "room.glb") is not None


def test_how_far_one_sees_and_what_shows_of_glass_put_no_fog_into_the_air() -> None:
    clear = {"daylight": "air", "method": "march", "sigma_t": (0.0, 0.0, 0.0)}
    more = {"max_distance": 5000.0, "transparency": "none"}
    assert with_daylight({"daylight": "air"} | more, False) == clear | more
    assert "sigma_t" not in with_daylight({"daylight": "air", "anisotropy": 0.5} | more, False)


def test_options_of_a_mediums_light_are_told_in_air_alone(recwarn: pytest.WarningsRecorder) -> None:
    stage = lit_stage()
    alone = build({"method": "march", "sigma_t": (0.0, 0.0, 0.0)})
    tell_idle_in_daylight(frozenset({"soften"}), alone, stage)  # without daylight
    stage.daylight = gfx.Group()
    tell_idle_in_daylight(frozenset({"steps", "shadow_filter"}), alone, stage)
    tell_idle_in_daylight(frozenset({"soften"}), build({"method": "march", "sigma_t": (0.1, 0.1, 0.1)}), stage)
    assert not recwarn.list
    with pytest.warns(AirlightWarning, match="--soften does nothing in air alone: it is of the light in a medium"):
        tell_idle_in_daylight(frozenset({"soften"}), alone, stage)
    with pytest.warns(AirlightWarning, match="--soften, --refine do nothing in air alone"):
        tell_idle_in_daylight(frozenset({"soften", "refine"}), alone, stage)
    with pytest.warns(AirlightWarning, match="--environment does nothing with --daylight air"):
        tell_idle_in_daylight(frozenset({"environment"}), alone, stage)
