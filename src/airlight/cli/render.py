"""`airlight render`: frames and films of 3-D scenes."""

import dataclasses
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import click

from airlight.cli.help import Command
from airlight.cli.options import gather, given, scene_options
from airlight.cli.settings import recalled_preset
from airlight.cli.shared import (
    FILES,
    LIGHT,
    SCENE,
    SHAPES,
    density_options,
    file_option,
    file_scene_options,
    flag_option,
    format_option,
    medium_options,
    option,
    preset_options,
    shape_options,
    storage_options,
    to_stdout,
)
from airlight.cli.types import NameOrFile, Real
from airlight.errors import AirlightError
from airlight.jobs.frames import MOST_FRAMES
from airlight.jobs.light_text import PLACE, SUN, light_numbers, numbers
from airlight.options import declared
from airlight.scatter.methods import FOR_MEDIUM

if TYPE_CHECKING:
    from airlight.jobs.frames import FramesRequest

CAMERA, TIME = "Camera", "Time"  # panels of the help


SURROUNDINGS = NameOrFile(lambda: [("sunrise", "a sky"), ("sky", "a sky"), ("none", "black")])


class _Numbers(click.ParamType):
    """So many finite numbers, kept as they were written."""

    def __init__(self, name: str) -> None:
        self.name = name

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        try:
            numbers(value, self.name)
        except AirlightError as error:
            self.fail(str(error), param, ctx)
        return str(value)


class SceneLightType(click.ParamType):
    """A light of a scene, kept as it was written."""

    def __init__(self, form: str) -> None:
        self.name = form

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        try:
            light_numbers(value, self.name)
        except AirlightError as error:
            self.fail(str(error), param, ctx)
        return str(value)


class _Fps(click.ParamType):
    name = "N[/N]"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Fraction:
        try:
            found = Fraction(str(value)).limit_denominator(10_000)
        except (ValueError, ZeroDivisionError):
            found = Fraction(0)
        if not 0 < found <= 1000:
            self.fail(f"cannot read {value!r}: write frames a second, up to 1000, as in 25, 23.976 or 30000/1001", param, ctx)
        return found


@click.command(cls=Command)
@click.argument("scene", metavar="SCENE", type=SCENE)
@file_option("--output", "-o", FILES, "What to write: a picture, numbered ones (shot.####.png), a film (.mp4). -: stdout.", required=True)
@file_scene_options
@option("--camera", panel=CAMERA, metavar="NAME", help="One of the scene's cameras; unset: its first.")
@option("--eye", panel=CAMERA, type=_Numbers(PLACE), help="Look from here instead, metres.")
@option("--target", panel=CAMERA, type=_Numbers(PLACE), help="With --eye: look at this; unset: the scene's centre.")
@option("--fov", panel=CAMERA, type=Real(1, 170), default=50.0, help="With --eye: degrees, of the picture's smaller side.")
@option("--width", panel=CAMERA, type=click.IntRange(1, 16384), default=1280, help="Pixels.")
@option("--height", panel=CAMERA, type=click.IntRange(1, 16384), help="Pixels; unset: 9/16 of the width.")
@flag_option("--no-antialias", None, CAMERA, "One sample at each pixel's centre, whatever the quality: for comparisons.")
@option("--turn", panel=CAMERA, type=Real(-1e6, 1e6), default=0.0, help="Degrees by which the camera goes around the centre.")
@option("--turntable", panel=TIME, metavar="N", type=click.IntRange(1, MOST_FRAMES), help="A full turn around the centre in N frames.")
@option("--time", panel=TIME, type=Real(0, 1e6), default=0.0, help="Seconds of the scene's animation, at frame 1.")
@option("--frames", panel=TIME, metavar="1-100x2", help="Frames to render; unset: the turn, or the whole animation.")
@option("--from", "day_from", panel=TIME, metavar="HH:MM+ZONE", help="With --day: when frames begin, as 05:30+02:00; unset: at sunrise.")
@option("--to", "day_to", panel=TIME, metavar="HH:MM+ZONE", help="With --day: when they end; unset: at sunset.")
@option("--seed", panel=TIME, type=click.IntRange(0, 2**31 - 1), help="Of flying: another path.")
@flag_option("--draw-path", None, TIME, "Draw the path that something of the scene flies along.")
@option("--fps", panel=TIME, type=_Fps(), default="24", help="Frames a second: frame k is at (k - 1) / fps.")
@option(
    "--light",
    panel=LIGHT,
    type=SceneLightType(PLACE),
    metavar="x,y,z|NAME",
    multiple=True,
    help='Where the light is instead, metres: "0,2,-3;color=1,0.8,0.6;strength=2"; or a lamp or a mesh by name. Strength may have '
    "a unit: 800cd, 800lm, 60W. It moves a lamp of the scene where one casts shafts, else it is added. May be repeated. "
    "density=2 and extinction=0.5 are factors of a medium's, for this light alone (artistic); ies=FILE shapes a lamp as --ies does, and "
    "cookie=FILE a spot of the scene as --cookie does.",
)
@option(
    "--sun",
    panel=LIGHT,
    type=SceneLightType(SUN),
    metavar="AZ,EL",
    multiple=True,
    help="A sun instead: degrees, azimuth 0 at -Z and 90 at +X, elevation above the horizon; colour and strength as --light, "
    "in units 68300lx or 100W/m2; cookie=leaves.png;size=2 as --cookie. With --daylight the azimuth is from --north, and the air makes the "
    "rest.",
)
@option(
    "--environment",
    panel=LIGHT,
    type=SURROUNDINGS,
    metavar="NAME|FILE",
    help="Surroundings of a file: sunrise, sky, none, or an .exr or .hdr file.",
)
@shape_options
@option("--exclude", panel=LIGHT, multiple=True, metavar="NAME", help="An object that hides no light; with --occluders prepass.")
@preset_options
@medium_options
@density_options
@scene_options
@file_option(
    "--layer",
    None,
    FILES,
    "Also write the shafts alone, linear; EXR holds transmittance and Z of a medium too, and an EXR output all of it.",
)
@file_option("--occlusion-buffer", None, FILES, "Also write the source of the shafts: what emits light, black where it is hidden.")
@option("--crf", panel=FILES, type=Real(0, 51), default=18.0, help="Of a film: x264's quality, 0 is lossless.")
@format_option
@storage_options
@flag_option("--overwrite", "-y", FILES, "Replace outputs that exist.")
@flag_option("--skip-existing", "-n", FILES, "Leave out what exists.")
@flag_option("--resume", None, FILES, "Do only the frames that are missing or damaged.")
@option("--device", metavar="NAME", help="Compute on the adapter whose name holds NAME; `airlight info` lists them.")
@flag_option("--profile", None, None, "Show where the time goes.")
@click.pass_context
def render(ctx: click.Context, **_: Any) -> int:
    """Render SCENE with its light shafts: a picture, numbered pictures, or a film. SCENE is table, valley, matinee ..., the name of a
    scene of validation (docs/world.md), or a .glb, .gltf, .obj, .ply or .stl file.

    The quality is that of the shafts, and of the picture: draft, normal and final take 1, 4 and 9 samples a pixel.
    """
    from airlight.jobs.frames import run_frames

    return 0 if run_frames(frames_request(ctx, ctx.params["scene"])) else 2


def frames_request(ctx: click.Context, scene: str) -> "FramesRequest":
    """Make of the command line what is wanted of a scene, for this command and for comparisons."""
    from airlight.jobs.frames import FramesRequest

    ctx.params["output"] = to_stdout(ctx.params["output"], ctx.params.get("format"))
    values = gather(ctx, ctx.params["preset"], ctx.params["medium"])
    if any(ctx.params.get(name) for name in ("volume", "particles", *SHAPES)):
        values = {"method": FOR_MEDIUM} | values
    names = {one.name for one in dataclasses.fields(FramesRequest)} & ctx.params.keys() - {"scene"}
    explicit = names | {one.name for one in declared(scenes=True)} & ctx.params.keys()
    return FramesRequest(
        scene,
        values=values,
        explicit=frozenset(name for name in explicit if given(ctx, name)),
        recalled_preset=recalled_preset(ctx),
        **{name: ctx.params[name] for name in names},
    )
