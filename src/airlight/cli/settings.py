"""The settings of a run: what is kept in its outputs, and how `--settings-from` takes it up again."""

import json
from collections.abc import Sequence
from typing import Any

import click

from airlight.cli.light import LightText
from airlight.errors import AirlightError
from airlight.options import declared
from airlight.options.declare import as_text

# Options of each command, beside the declared parameters, that shape the result; files by their names as written.
_OPTIONS = {
    "image": ("mask", "mask_invert", "depth", "depth_near", "depth_layer", "near_range", "depth_hides", "subject", "subject_layer")
    + ("input_layer", "colorspace"),
    "render": ("scene", "camera", "eye", "target", "fov", "environment", "width", "height", "no_antialias")
    + ("time", "seed", "draw_path", "turn", "turntable", "frames", "fps", "crf"),
}
_LISTS = {"image": {"light": "written", "angle": "angles"}, "render": {"light": "light", "sun": "sun", "exclude": "exclude"}}
_PRESET = "airlight.preset"  # in ctx.meta


def record(
    ctx: click.Context,
    values: dict[str, Any],
    lights: Sequence[LightText],
    preset: str | None,
    instead: dict[str, Any] | None = None,
    standing: dict[str, Any] | None = None,
    look: str | None = None,
) -> str:
    """One line of JSON: the values that are not the defaults, the lights as they were resolved, the preset's name.

    instead: values of options that go before those of the command line. standing: the defaults that a scene has of its own.
    look: of a picture.
    """
    names, given = _OPTIONS[str(ctx.command.name)], ctx.params | (instead or {})
    defaults = {p.name: p.default for p in declared(scenes=True)} | (standing or {})
    options = {p.name: p.default for p in ctx.command.params if p.name in names}
    said = {name: as_text(v) if isinstance(v, tuple) else v for name, v in values.items() if v != defaults[name]}
    options |= {name: False for name in names if options[name] is not True and given[name] is False}  # a flag that is not set
    said |= {name: given[name] for name in names if given[name] not in (None, options[name])}
    if ctx.command.name == "render":
        said |= {name: list(given[name]) for name in _LISTS["render"] if given[name]}
    for name, parallel in (("light", False), ("angle", True)):
        texts = [light.text for light in lights if (light.angle is not None) == parallel]
        said |= {name: texts} if texts else {}
    if look is not None:
        said["look"] = look
    preset = preset or ctx.meta.get(_PRESET)
    return json.dumps(said | ({"preset": preset} if preset else {}), sort_keys=True, default=str)


def recall(ctx: click.Context, _: click.Parameter, path: str | None) -> None:
    """Callback of `--settings-from`: what the image or film at `path` records becomes the default of each option."""
    if path is None or ctx.resilient_parsing:
        return
    from airlight.files import read_settings, video

    try:
        said = json.loads(video.read_settings(path) if video.is_film(path) else read_settings(path))
    except (ValueError, RecursionError):
        said = None
    if not isinstance(said, dict):
        raise AirlightError(f"{path}: its settings are damaged; give them on the command line or as a preset")
    command, wrote = str(ctx.command.name), "render" if "scene" in said else "image"
    if command != wrote:
        raise AirlightError(f"{path}: its settings are those of `airlight {wrote}`, which `airlight {command}` cannot use")
    lists = _LISTS[command]
    known = {p.name for p in declared(scenes=command == "render")} | {*_OPTIONS[command], *lists, "preset"}
    for name, value in said.items():
        many = name in lists and isinstance(value, list) and value != []
        if name not in known or not all(isinstance(one, str if many else (str, int, float)) for one in (value if many else [value])):
            raise AirlightError(f"{path}: its settings hold {name!r}, unknown to this version of Airlight; use the one that wrote it")
    if command == "image":
        said.setdefault("look", "classic")  # as it was before there were looks
    # numbers as they would be typed, so that each option refuses what it cannot be
    said = {name: value if isinstance(value, (bool, list)) else str(value) for name, value in said.items()}
    ctx.meta[_PRESET] = said.pop("preset", None)
    for name, parameter in lists.items():
        if name in said:
            said[parameter] = said.pop(name)
    ctx.default_map = {**(ctx.default_map or {}), **said}
