"""Cookies by the names of lights, and projectors, as commands take them."""

import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from airlight.errors import AirlightError, AirlightWarning
from airlight.jobs.cookies import open_cookie, read_cookie
from airlight.jobs.projector_text import make_projector
from airlight.jobs.shape_text import put_cookies, read_shape_text, shaped

gfx = pytest.importorskip("pygfx")
from PIL import Image  # noqa: E402

from airlight.lights.shape import Cookie  # noqa: E402
from airlight.pygfx import SceneLight  # noqa: E402
from airlight.pygfx.projector import Projector  # noqa: E402
from airlight.pygfx.punctual import punctual_lights  # noqa: E402
from airlight.scenes import open_scene  # noqa: E402


@pytest.fixture
def slide(tmp_path: Path) -> str:
    Image.fromarray(np.arange(60, dtype=np.uint8).reshape(4, 5, 3)).save(tmp_path / "slide.png")
    return str(tmp_path / "slide.png")


def named(stage: Any, lamp: Any, name: str) -> Any:
    lamp.name = name
    stage.scene.add(lamp)
    light = SceneLight(lamp)
    stage.lights.append(light)
    return light


def test_cookies_go_to_the_lights_of_their_names(slide: str) -> None:
    stage = open_scene("slats")
    kinds = {"sun": gfx.DirectionalLight, "lamp": gfx.SpotLight, "bulb": gfx.PointLight}
    sun, spot, point = (named(stage, kind(), name) for name, kind in kinds.items())
    put_cookies(stage, [f"sun={slide};size=2.5", f"lamp={slide}"])
    assert sun.cookie.size == 2.5 and sun.cookie.pixels.shape == (4, 5, 3) and spot.cookie is not None and point.cookie is None
    for text, told in (
        (f"bulb={slide}", "--cookie bulb: shines all around; name a spot, a projector or a sun"),
        (f"lamp={slide};size=2", "is no sun, whose cookies alone have a size"),
        (f"lmp={slide}", "has no light of that name.*did you mean 'lamp'"),
        ("lamp=none.png", "none.png"),
    ):
        with pytest.raises(AirlightError, match=told):
            put_cookies(stage, [text])


def test_projectors_come_beside_the_lights_of_a_scene(slide: str) -> None:
    from airlight.scenes.lamps import lighting

    stage = open_scene("slats")
    requested = shaped(stage, {"projector": [f"1,2,3;target=0,1,0;cookie={slide}"]})
    made = lighting(stage, requested)
    assert isinstance(requested[0], Projector) and requested[0].cookie is not None
    assert [light.target for light in made.lights] == [stage.lights[0].target, requested[0]]


def test_a_projector_of_a_scene_is_changed_by_its_name(slide: str) -> None:
    stage = open_scene("slats")
    lamp = Projector(intensity=5, fov=(20, 10), near=0.3)
    lamp.local.position, lamp.target.local.position = (1, 2, 3), (1, 2, 0)
    named(stage, lamp, "film")
    assert shaped(stage, {"projector": [f"film;position=0,2,3;fov=30,25;far=7;falloff=inverse;intensity=2,4,0;cookie={slide}"]}) == []
    assert tuple(lamp.world.position) == (0, 2, 3) and tuple(lamp.target.world.position) == (1, 2, 0)
    assert (lamp.fov, lamp.near, lamp.far, lamp.falloff, lamp.intensity) == ((30, 25), 0.3, 7, "inverse", 4) and lamp.cookie is not None
    assert np.allclose(lamp.color.to_physical()[:3], (0.5, 1, 0), atol=1e-6) and np.tan(lamp.angle) > np.tan(np.radians(15))
    for text, told in (
        ("flm;near=1", "slats has no projector of that name; there is film.*did you mean 'film'"),
        ("film;near=8", "far=7.*is not beyond near=8"),
        ("film;target=0,2,3", "is its own position"),
        ("film;up=-1,0,3", "lies along its light"),
    ):
        with pytest.raises(AirlightError, match=told):
            shaped(stage, {"projector": [text]})
    assert lamp.near == 0.3
    with pytest.raises(AirlightError, match="two positions"):
        shaped(stage, {"projector": ["1,2,3;position=1,2,3"]})


@pytest.mark.parametrize(
    ("known", "told"),
    [
        ({"fov": (0, 30)}, "0.001 to 179 degrees"),
        ({"fov": (40, 180)}, "0.001 to 179 degrees"),
        ({"fov": 40}, "two angles"),
        ({"fov": (10**400, 1)}, "two angles"),
        ({"near": 10**400}, "near must be 1e-06 to 1e.09 m"),
        ({"near": 10**5000}, "not a number of thousands of digits"),
        ({"far": 1e300}, "far must be 1e-06 to 1e.09 m"),
        ({"intensity": float("nan")}, "intensity must be 0 to 1e.09 candela"),
        ({"intensity": 10**400}, "intensity must be 0 to 1e.09 candela"),
        ({"near": True}, "near must be .* not True"),
        ({"up": (True, False, False)}, "up must be three finite numbers"),
        ({"clip": 3}, "clip must be a list of planes"),
        ({"clip": ((1e-300, 0, 0, 1),)}, "is more than 1e.09 m away"),
        ({"near": 3, "far": 2}, "near must be above 0 and its far beyond it"),
        ({"near": 2, "far": 2}, "near must be above 0 and its far beyond it"),
        ({"up": (0, 0, 0)}, "up must be three finite numbers, not all 0"),
        ({"up": (0, 1)}, "up must be three finite numbers"),
        ({"ambient": -1}, "ambient must be 0 to 1e.09"),
        ({"cookie": "slide.png"}, "cookie must be a Cookie, as read_cookie gives it"),
    ],
)
def test_what_no_projector_can_be_is_told(known: dict[str, Any], told: str) -> None:
    with pytest.raises(AirlightError, match=told):
        Projector(**known)


@pytest.mark.parametrize("size", [1e-300, 1e300])
def test_vectors_of_any_length_give_their_directions(size: float) -> None:
    lamp = Projector(up=(size, size, 0), clip=((0, size, size, 2 * size), (1e300, 1e300, 0, 1)))
    (light,) = punctual_lights([SceneLight(lamp)])
    root = 0.5**0.5
    assert light.axes()[1] == pytest.approx((root, root, 0))
    assert light.planes()[-2:] == pytest.approx(np.array([(0, root, root, 2 * root), (root, root, 0, 0)]))
    (sun,) = punctual_lights([SceneLight(direction=(0, size, 0))])
    assert np.isfinite(sun.in_view(np.eye(4))).all()


def test_lights_take_no_integer_beyond_floats() -> None:
    from airlight.lights import ImageLight

    for make in (lambda: SceneLight(position=(0, 10**400, 0)), lambda: SceneLight(position=(0, 0, 0), intensity=10**400)):
        with pytest.raises(AirlightError, match="not"):
            make()
    with pytest.raises(AirlightError, match="finite number"):
        ImageLight((0.5, 0.5), strength=10**400)


def test_up_along_its_light_is_told_where_somebody_gave_it() -> None:
    lamp = Projector()
    lamp.target.local.position = (0, -1, 0)
    (light,) = punctual_lights([SceneLight(lamp)])
    assert light.axes()[1] == pytest.approx((0, 0, -1))  # up unset
    lamp.upwards = (0, -2, 0)
    with pytest.raises(AirlightError, match="lies along its light"):
        punctual_lights([SceneLight(lamp)])


def test_a_cookie_is_written_in_a_line(tmp_path: Path) -> None:
    Image.new("RGB", (3, 2)).save(tmp_path / "film.0001.png")
    assert repr(Cookie(np.ones((400, 300, 3)), size=2.5)) == "Cookie(300 x 400 pixels, size=2.5)"
    assert repr(open_cookie(str(tmp_path / "film.####.png"))) == f"FilmCookie({str(tmp_path / 'film.####.png')!r}, frame=1, size=1)"


def test_cookies_without_pixels_and_of_many(tmp_path: Path) -> None:
    for shape in ((0, 4, 3), (4, 0, 3), (4, 4), (4, 4, 4)):
        with pytest.raises(AirlightError, match="with a pixel at least"):
            Cookie(np.ones(shape))
    with pytest.raises(AirlightError, match="size must be above 0"):
        Cookie(np.ones((2, 2, 3)), size=0.0)
    Image.new("1", (10_000, 1)).save(tmp_path / "long.png")
    with pytest.warns(AirlightWarning, match="10,000 pixels along a side; as a cookie it is averaged to 3,333"):
        assert read_cookie(str(tmp_path / "long.png")).pixels.shape == (1, 3333, 3)
    huge = struct.pack(">IIBBBBB", 100_000, 100_000, 1, 0, 0, 0, 0)
    parts = ((b"IHDR", huge), (b"IDAT", zlib.compress(bytes(100))), (b"IEND", b""))
    chunks = (struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body)) for kind, body in parts)
    (tmp_path / "huge.png").write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(chunks))
    with pytest.raises(AirlightError, match="100000x100000 pixels with 1 channels is more than the limit"):
        read_cookie(str(tmp_path / "huge.png"))


def test_what_shapes_a_light_is_read_without_its_file() -> None:
    from airlight.jobs.shape_text import COOKIE

    assert read_shape_text("a light=a=b.png;size=3", COOKIE).path == "a=b.png"
    with pytest.raises(AirlightError, match="write NAME=FILE"):
        read_shape_text("gobo.png", COOKIE)
    with pytest.raises(AirlightError, match="size is 0"):
        read_shape_text("sun=gobo.png;size=0", COOKIE)


def test_a_file_that_is_no_cookie_is_told_with_its_option(tmp_path: Path) -> None:
    from airlight.jobs.light_text import SUN, read_scene_light

    path = tmp_path / "junk.png"
    path.write_bytes(b"junk")
    for option, read in (
        ("--projector", lambda: make_projector(f"0,1,2;cookie={path}")),
        ("--cookie", lambda: shaped(open_scene("slats"), {"cookie": [f"spot={path}"]})),
        ("--ies", lambda: shaped(open_scene("slats"), {"ies": [f"spot={path}"]})),
        ("--sun", lambda: read_scene_light(f"60,30;cookie={path}", SUN)),
    ):
        with pytest.raises(AirlightError, match=f"^{option}: .*junk.png: is no"):
            read()


def test_lights_and_suns_of_texts_take_cookies(slide: str) -> None:
    from airlight.jobs.light_text import PLACE, SUN, read_scene_light
    from airlight.scenes.lamps import lighting

    sun = read_scene_light(f"60,30;cookie={slide};size=2.5;strength=3", SUN)
    assert sun.cookie is not None and (sun.cookie.size, sun.cookie.pixels.shape, sun.strength) == (2.5, (4, 5, 3), 3)
    stage = open_scene("slats")  # its light is a spot
    spot = named(stage, gfx.SpotLight(), "lamp")
    by_place, by_name = (read_scene_light(f"{place};cookie={slide}", PLACE) for place in ("0,2,0", "lamp"))
    made = lighting(stage, [by_place, by_name, sun]).lights
    assert [light.cookie for light in made] == [by_place.cookie, by_name.cookie, sun.cookie] and made[1].target is spot.target
    stage.lights = []
    with pytest.raises(AirlightError, match="a light that shines all around; give --light the name of a spot"):
        lighting(stage, [by_place])


@pytest.mark.parametrize(
    ("text", "form", "told"),
    [
        ("60,30;size=2", "azimuth,elevation", "goes with cookie.*write cookie=FILE;size=2"),
        ("60,30;cookie=a.png;size=0", "azimuth,elevation", "size is 0.001 to 1e.06 m"),
        ("60,30;ies=a.ies", "azimuth,elevation", "cannot read 'ies=a.ies'"),
        ("lamp;cookie=", "x,y,z", "cookie has no value .*: give a file"),
        ("lamp;size=2;cookie=a.png", "x,y,z", "cannot read 'size=2'"),
        ("lamp;cookie=a.png;ies=a.ies", "x,y,z", "has two shapes"),
    ],
)
def test_what_shapes_of_lights_texts_cannot_be_is_told(text: str, form: str, told: str) -> None:
    from airlight.jobs.light_text import light_numbers

    with pytest.raises(AirlightError, match=told):
        light_numbers(text, form)
