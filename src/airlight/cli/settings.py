"""Takes up the settings that an output holds: `--settings-from`."""

import json

import click

from airlight.errors import AirlightError
from airlight.jobs import frames, image
from airlight.options import declared

# Options of each command, beside the declared parameters, that shape the result; files by their names as written.
_OPTIONS = {
    "image": image.SHAPING,
    "render": frames.SHAPING,
}
_LISTS = {
    "image": {"light": "written", "angle": "angles"},
    "render": {name: name for name in ("light", "sun", "ies", "volume", "particles", "exclude")},
}
_PRESET = "airlight.preset"  # in ctx.meta


def recalled_preset(ctx: click.Context) -> str | None:
    """Name the preset of the settings that are repeated."""
    found: str | None = ctx.meta.get(_PRESET)
    return found


def recall(ctx: click.Context, _: click.Parameter, path: str | None) -> None:
    """Make what the image or film at `path` records the default of each option: the callback of `--settings-from`."""
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
