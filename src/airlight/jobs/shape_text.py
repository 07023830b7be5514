"""Reads what shapes lights of a scene as a user writes it, `NAME=FILE;key=value;...`; and gives it to them."""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from airlight.errors import AirlightError
from airlight.files.photometry import read_photometry
from airlight.jobs.cookies import of_option, open_cookie
from airlight.jobs.density_text import Grammar
from airlight.jobs.projector_text import change_projector, make_projector, name_of
from airlight.messages import nearest
from airlight.scatter.methods import METHODS, ONE_SUN

if TYPE_CHECKING:
    from airlight.pygfx import SceneLight
    from airlight.scenes.lamps import NamedLight
    from airlight.scenes.stage import Stage

IES = Grammar("photometry", "NAME=FILE, then ;absolute=1", {}, {"absolute": ("0", "1")}, {})
COOKIE = Grammar("cookie", "NAME=FILE, then ;size=M", {}, {}, {"size": (1e-3, 1e6)})
NAMES_TOLD = 12
DOWN = (0.0, -1.0, 0.0)


@dataclass(frozen=True)
class ShapeText:
    """Holds a file for the lights of a name. known: values of the keys that are given."""

    name: str
    path: str
    known: dict[str, Any]


def read_shape_text(text: str, grammar: Grammar = IES) -> ShapeText:
    """Read what was written, without a look at any file. Raises AirlightError."""
    both, known = grammar.read(text)
    name, _, path = (part.strip() for part in both.partition("="))
    if not (name and path):
        raise AirlightError(f"cannot read the {grammar.what} {text!r}: write {grammar.form}")
    return ShapeText(name, path, known)


def refuse_idle(shapes: dict[str, Sequence[str]], method: str) -> None:
    """Raise AirlightError for shapes of lights, by their options, that a method does not follow: methods of the screen follow cookies, by
    the angle around a light, those of one sun follow nothing."""
    known = METHODS[method]
    follows = {"cookie"} if not known.lights_medium else () if known.lights == ONE_SUN else shapes.keys()
    for name in (name for name, texts in shapes.items() if texts and name not in follows):
        raise AirlightError(f"--{name} means nothing with method {method}: leave it out, or use --method march")


def shaped(
    stage: "Stage", shapes: dict[str, Sequence[str]], requested: "Sequence[SceneLight | NamedLight]" = (), fps: float = 24.0
) -> list[Any]:
    """Give lights of a stage, and those of `requested` that go by a name, the shapes of --ies and --cookie; return the requested ones with
    theirs, and the projectors of --projector; those that go by a name are the stage's, and changed. fps: of the numbers of numbered
    cookies. Raises AirlightError."""
    stage.fps = fps
    lights = put_photometry(stage, shapes.get("ies", ()), requested)
    lights = put_cookies(stage, shapes.get("cookie", ()), lights)
    texts = shapes.get("projector", ())
    for text in texts:
        if name := name_of(text):
            _change(stage, name, text)
    lights += [make_projector(text) for text in texts if not name_of(text)]
    shaped = [*stage.lights, *lights, *(light.target for light in stage.lights)]
    stage.cookies = [one.cookie for one in shaped if hasattr(getattr(one, "cookie", None), "frame")]
    return lights


def _change(stage: "Stage", name: str, text: str) -> None:
    """Change the projectors of a stage that go by a name."""
    from airlight.pygfx.projector import Projector
    from airlight.scenes.lamps import cast_shadow

    known = [(light, light.target) for light in stage.lights if isinstance(light.target, Projector)]
    if not (found := [projector for light, projector in known if name in names(light)]):
        there = list(dict.fromkeys(name for light, _ in known for name in names(light)))
        has = f"there is {', '.join(there[:NAMES_TOLD])}" if there else "it has none; write x,y,z for the name to add one"
        raise AirlightError(f"--projector {name}: {stage.name} has no projector of that name; {has}{nearest(name, there)}")
    for projector in found:
        change_projector(projector, text)
        cast_shadow(projector, stage.center, stage.radius)


def put_cookies(stage: "Stage", texts: Sequence[str], requested: "Sequence[SceneLight | NamedLight]" = ()) -> list[Any]:
    """Give lights of a stage, and those of `requested` that go by a name, cookies of files, as `put_photometry` does."""
    import pygfx as gfx

    from airlight.scenes.lamps import shines_around

    lights: list[Any] = list(requested)
    for text in texts:
        written = read_shape_text(text, COOKIE)
        cookie = open_cookie(written.path, written.known.get("size", 1.0), "--cookie")
        own, asked = _of_name(stage, lights, written.name, "--cookie")
        for light in own:
            lamps = [] if light.target is None else [thing for thing in light.target.iter() if isinstance(thing, gfx.Light)]
            if shines_around(light):
                raise AirlightError(f"--cookie {written.name}: shines all around; name a spot, a projector or a sun")
            if "size" in written.known and not any(isinstance(lamp, gfx.DirectionalLight) for lamp in lamps):
                raise AirlightError(f"--cookie {written.name}: is no sun, whose cookies alone have a size; leave it out")
            light.cookie = cookie
        for i in asked:
            lights[i] = dataclasses.replace(lights[i], cookie=cookie)
    return lights


def _of_name(stage: "Stage", lights: Sequence[Any], name: str, option: str) -> tuple[list[Any], list[int]]:
    """Find the lights of a stage that go by a name, and the numbers of the requested ones that do. Raises AirlightError where none does."""
    own = [light for light in stage.lights if name in names(light)]
    asked = [i for i, one in enumerate(lights) if getattr(one, "name", None) == name]
    if not own and not asked:
        there = [name for light in stage.lights for name in names(light)] + [getattr(one, "name", "") for one in lights]
        raise _unknown(stage, name, list(dict.fromkeys(filter(None, there))), option)
    return own, asked


def put_photometry(stage: "Stage", texts: Sequence[str], requested: "Sequence[SceneLight | NamedLight]" = ()) -> list[Any]:
    """Give lights of a stage, and those of `requested` that go by a name, the photometry of files, as `--ies` has it; return the requested
    ones with it. Raises AirlightError for a name that no light has."""
    lights: list[Any] = list(requested)
    for text in texts:
        written = read_shape_text(text)
        with of_option("--ies"):
            photometry = read_photometry(written.path)
        absolute = written.known.get("absolute") == "1"
        own, asked = _of_name(stage, lights, written.name, "--ies")
        for light in own:
            _shape(light, photometry, absolute, written.name)
        for i in asked:
            more: dict[str, Any] = {"intensity": photometry.own_candela(DOWN)} if absolute else {}
            lights[i] = dataclasses.replace(lights[i], photometry=photometry, **more)
        stage.measured = stage.measured or absolute
    return lights


def _shape(light: "SceneLight", photometry: Any, absolute: bool, name: str) -> None:
    """Give a light a photometry, and the candela of that where they are absolute."""
    import pygfx as gfx

    from airlight.pygfx.lights import beam

    lamps = [] if light.target is None else [thing for thing in light.target.iter() if isinstance(thing, gfx.Light)]
    if light.direction is not None or any(isinstance(lamp, gfx.DirectionalLight) for lamp in lamps):
        raise AirlightError(f"--ies {name}: is a sun, which has no photometry; name a point or a spot light")
    light.photometry = photometry
    for lamp in lamps if absolute else ():
        lamp.intensity = photometry.own_candela(beam(lamp) if isinstance(lamp, gfx.SpotLight) else DOWN)
    if absolute and not lamps:
        light.intensity = photometry.own_candela(DOWN)


def names(light: "SceneLight") -> list[str]:
    """List the names by which a light goes: of its target, of the lamps in it, else of what these hang on."""
    import pygfx as gfx

    if light.target is None:
        return []
    own = [light.target, *(thing for thing in light.target.iter() if isinstance(thing, gfx.Light))]
    found = [str(thing.name) for thing in own if thing.name]
    above = light.target.parent
    while not found and above is not None:
        found, above = [str(above.name)] if above.name else [], above.parent
    return found


def _unknown(stage: "Stage", name: str, there: list[str], option: str) -> AirlightError:
    unnamed = "none has a name" + (": give --light 'x,y,z;ies=FILE'" if option == "--ies" else ": give --projector 'x,y,z;cookie=FILE'")
    known = f"there is {', '.join(there[:NAMES_TOLD])}" if there else unnamed
    return AirlightError(f"{option} {name}: {stage.name} has no light of that name; {known}{nearest(name, there)}")
