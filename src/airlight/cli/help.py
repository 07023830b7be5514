"""Shows a command's help on one screen: the options that most people need, and examples. `--help-all` shows everything, by rich-click.

Which options, and in which words, SCREENS says of each command.
"""

import os
import re
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import click
import rich_click

WIDTH = 80  # columns of a screen


@dataclass(frozen=True)
class Screen:
    """Describes a screen of help.

    about: what the command does. options: short words for each of the options that are shown, by the parameter's name. examples: what
    each does, and its command line, which `tests/test_help.py` runs.
    """

    about: str
    options: Mapping[str, str] = field(default_factory=dict)
    examples: Sequence[tuple[str, str]] = ()


SCREENS = {
    "airlight": Screen(
        "Light shafts for photographs and renders.",
        examples=(("add light shafts to a photograph", "airlight image photo.jpg -o out.jpg"),),
    ),
    "image": Screen(
        "Add light shafts to a picture, or to many: files, a folder, frames\n"
        "(shot.####.exr); -: from stdin. The light is found, or placed with --light.",
        {
            "output": "out.png, .jpg, .exr ...; of many: a folder; -: stdout",
            "written": "where the light is, as in 0.4,0.3; unset: found",
            "candidates": "show where the light may be, numbered",
            "preset": "a look: subtle, natural, dramatic, long, soft ...",
            "strength": "how much one sees of the shafts; usual: 1",
            "warmth": "from cool, -1, to golden, 1; unset: by the light",
            "length": "how far they reach, in diagonals of the picture",
            "depth": "a depth map: shafts pass behind what is near",
            "quality": "draft, normal or final; unset: normal",
            "overwrite": "replace outputs that exist",
        },
        (
            ("find the light and add shafts", "airlight image photo.jpg -o out.jpg"),
            ("a light of your own, above the frame", "airlight image photo.jpg -o out.png --light 0.4,-0.1 --preset long"),
            ("all pictures of a folder", "airlight image photos -o shafts --preset dramatic"),
        ),
    ),
    "render": Screen(
        "Render a 3-D scene with light shafts: a picture, numbered frames, a film.\n"
        "SCENE: table, flying, valley, slats ... or a .glb, .gltf, .obj, .ply, .stl file.\n-: as SCENE a .glb from stdin; as FILE stdout.\n"
        "Lights with a shape: --projector, --cookie, --ies; see --help-all.",
        {
            "output": "out.png, .exr ...; shot.####.png: frames; .mp4: film",
            "medium": "what fills the air: haze, mist, smoke ...",
            "fog": "air that thins out with height: exponential, linear",
            "volume": "smoke or clouds of a file: .vdb, .npz, .npy, .vol",
            "light": "where the light is, in metres, or an object's name",
            "sun": "a sun instead, in degrees, as in 90,20",
            "width": "pixels; unset: 1280",
            "frames": "which frames; unset: the turn, or the animation",
            "quality": "draft, normal or final; unset: normal",
            "overwrite": "replace outputs that exist",
        },
        (
            ("a scene that comes with Airlight, in fog", "airlight render flying -o fog.png --fog exponential"),
            ("smoke in a room of your own, under a low sun", "airlight render room.glb -o room.png --medium smoke --sun 90,20"),
            ("a film that goes once around", "airlight render table -o turn.mp4 --turntable 96"),
        ),
    ),
    "view": Screen(
        "Show a picture or a 3-D scene live, with a panel of all settings.\n"
        "Unset: the scene table. Drag the light; save from the panel.",
        {
            "browser": "show it in a web browser; the address is printed",
            "port": "with --browser: the port; unset: any that is free",
            "screenshot": "open no window: write what it would show",
            "written": "where the light is at first; unset: found",
            "preset": "values to start from, as subtle or vesper-scene",
            "medium": "of a scene: what fills the air: haze, mist ...",
            "method": "how light is computed: epipolar, march ...",
            "quality": "draft, normal or final; unset: normal",
            "overwrite": "replace the screenshot if it exists",
            "device": "the graphics adapter, see airlight info",
        },
        (
            ("a photograph", "airlight view photo.jpg"),
            ("a landscape in mist", "airlight view flying --medium mist"),
            ("in a browser, without a display", "airlight view flying --browser"),
        ),
    ),
    "compare": Screen(
        "Compare methods or settings: error against the truth, cost, difference.\n"
        "On a picture, or in a scene: table, flying, one of validation, or a file.",
        {
            "output": "the sheet to write; .html: a page",
            "texts": "what to compare, repeatedly; unset: the methods",
            "written": "where the light is; unset: found, or the scene's",
            "against": "the truth of a scene: tracer, walk or mitsuba",
            "preset": "values that all start from",
            "medium": "of a scene: what fills the air",
            "camera": "of a scene: one of its cameras",
            "width": "of a scene, pixels; unset: 480",
            "runs": "timed runs of each; unset: 5",
            "overwrite": "replace the output if it exists",
        },
        (
            ("the methods, on a photograph", "airlight compare photo.jpg -o methods.html"),
            ("two settings", "airlight compare photo.jpg -o two.png --variant decay=0.9 --variant vesper"),
            ("in a scene, against a ray tracer", "airlight compare slats -o slats.html --against tracer"),
        ),
    ),
    "bench": Screen(
        "Time the methods on this graphics adapter.",
        {
            "quick": "a part of it: less than a minute, not a quarter hour",
            "json_path": "also write the records as JSON; -: to stdout",
            "overwrite": "replace the file if it exists",
        },
        (
            ("a first impression", "airlight bench --quick"),
            ("all of it, kept in a file too", "airlight bench --json times.json"),
        ),
    ),
    "info": Screen(
        "Show adapters and what is missing, or where a scene's things lie.",
        examples=(("what is here", "airlight info"), ("where a scene's things lie, in metres", "airlight info slats")),
    ),
}


def short(name: str) -> str:
    """Say what a command does in a few words, for lists of commands."""
    return re.split(r"[:.\n]", SCREENS[name].about)[0]


class Command(rich_click.RichCommand):
    """Is a command with a screen of help, and the rest behind --help-all."""

    def __init__(self, *args: Any, **more: Any) -> None:
        super().__init__(*args, **more | {"context_settings": {"help_option_names": ["-h", "--help"], "show_default": True}})
        more = {"is_flag": True, "is_eager": True, "expose_value": False, "callback": self._show_all}
        option: Any = rich_click.RichOption
        self.params.append(option(["--help-all"], help="Show every option and exit.", **more))
        for param in self.params:
            if isinstance(param.type, (click.types.IntParamType, click.types.FloatParamType)):
                param.metavar = param.metavar or "N"  # not INTEGER RANGE

    def get_help(self, ctx: click.Context) -> str:
        return screen(ctx)

    def get_short_help_str(self, limit: int = 45) -> str:
        return short(str(self.name))

    def _show_all(self, ctx: click.Context, _: click.Parameter, wanted: bool) -> None:
        if wanted and not ctx.resilient_parsing:
            click.echo(super().get_help(ctx), color=ctx.color)
            ctx.exit()


def screen(ctx: click.Context) -> str:
    """Write the screen of a command, or of the group of all."""
    found = SCREENS[str(ctx.command.name)]
    usage = ctx.command.collect_usage_pieces(ctx)
    lines = [" ".join((strong("Usage:"), ctx.command_path, *usage)), "", *found.about.splitlines()]
    if isinstance(ctx.command, click.Group):
        lines += _table("Commands", [(name, short(name)) for name in ctx.command.commands])
    by_name = {param.name: param for param in ctx.command.params}
    rows = [(_left(by_name[name], ctx), about) for name, about in found.options.items()]
    options = sum(isinstance(one, click.Option) and one.expose_value for one in ctx.command.params)
    if options > len(rows):
        rows.append(("--help-all", f"show all {options} options"))
    if "version" in by_name:
        rows.append(("--version", "show the version"))
    lines += _table("Options", [*rows, ("-h, --help", "show this")])
    lines += ["", strong("Examples:" if len(found.examples) > 1 else "Example:")]
    for about, line in found.examples:
        lines += [f"  {line}", f"      {about}"]
    if isinstance(ctx.command, click.Group):
        lines += ["", "`airlight COMMAND --help` shows a command's options, --help-all every one."]
    return "\n".join(lines)


def strong(text: str) -> str:
    return click.style(text, bold=True) if sys.stdout is not None and sys.stdout.isatty() and not os.environ.get("NO_COLOR") else text


def _table(title: str, rows: Sequence[tuple[str, str]]) -> list[str]:
    wide = max(len(left) for left, _ in rows)
    return ["", strong(f"{title}:"), *(f"  {left:{wide}}  {right}" for left, right in rows)]


def _left(param: click.Parameter, ctx: click.Context) -> str:
    """Write the names of an option and what it takes: `-o, --output FILE`."""
    names = ", ".join(sorted(param.opts, key=len))
    if getattr(param, "is_flag", False):
        return names
    takes = "NAME" if isinstance(param.type, click.Choice) else param.make_metavar(ctx)
    return f"{names} {takes}"
