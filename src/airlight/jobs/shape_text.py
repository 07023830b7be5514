"""Reads what shapes lights of a scene as a user writes it, `NAME=FILE;key=value;...`; and gives it to them."""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from airlight.errors import AirlightError
from airlight.files.photometry import read_photometry
from airlight.jobs.density_text import Grammar
from airlight.messages import nearest

if TYPE_CHECKING:
    from airlight.pygfx import SceneLight
    from airlight.scenes.lamps import NamedLight
    from airlight.scenes.stage import Stage

IES = Grammar("photometry", "NAME=FILE, then ;absolute=1", (), {"absolute": ("0", "1")}, {})
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


def refuse_without_units(ies: Sequence[str], method: str) -> None:
    """Raise AirlightError for shapes of lights with a method that takes its light from the picture."""
    if ies:
        raise AirlightError(f"--ies means nothing with method {method}: leave it out, or use --method march")


def put_photometry(stage: "Stage", texts: Sequence[str], requested: "Sequence[SceneLight | NamedLight]" = ()) -> list[Any]:
    """Give lights of a stage, and those of `requested` that go by a name, the photometry of files, as `--ies` has it; return the requested
    ones with it. Raises AirlightError for a name that no light has."""
    lights: list[Any] = list(requested)
    for text in texts:
        written = read_shape_text(text)
        photometry, absolute = read_photometry(written.path), written.known.get("absolute") == "1"
        own = [light for light in stage.lights if written.name in _names(light)]
        asked = [i for i, one in enumerate(lights) if getattr(one, "name", None) == written.name]
        if not own and not asked:
            there = [name for light in stage.lights for name in _names(light)] + [getattr(one, "name", "") for one in lights]
            raise _unknown(stage, written.name, list(dict.fromkeys(filter(None, there))))
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


def _names(light: "SceneLight") -> list[str]:
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


def _unknown(stage: "Stage", name: str, there: list[str]) -> AirlightError:
    known = f"there is {', '.join(there[:NAMES_TOLD])}" if there else "none has a name: give --light 'x,y,z;ies=FILE'"
    return AirlightError(f"--ies {name}: {stage.name} has no light of that name; {known}{nearest(name, there)}")
