"""Makes the options that several commands have, and the forms in which options are written."""

import functools
import os
from collections.abc import Sequence
from typing import Any

import click
import rich_click

from airlight.cli.options import F
from airlight.cli.settings import recall
from airlight.cli.types import Choice, NameOrFile
from airlight.errors import AirlightError
from airlight.messages import nearest, nearest_file
from airlight.options import presets
from airlight.options.storage import OUTPUTS, SUBSAMPLING
from airlight.process import standard
from airlight.scenes import names


def _list(kind: str, ctx: click.Context, _: click.Parameter, wanted: bool) -> None:
    if wanted and not ctx.resilient_parsing:
        for name in presets.names(kind):
            click.echo(f"{name:16} {presets.description(name, kind)}")
        ctx.exit()


LIGHT, OCCLUSION, DEPTH, FILES = "Light", "Occlusion", "Depth", "Files"  # panels of the help
option = functools.partial(click.option, cls=rich_click.RichOption)


def file_option(name: str, short: str | None, panel: str, help: str, required: bool = False) -> Any:
    names = [name] if short is None else [short, name]
    return option(*names, panel=panel, help=help, required=required, type=click.Path(), metavar="FILE")


def choice_option(name: str, panel: str, values: Sequence[str], help: str) -> Any:
    return option(name, panel=panel, help=help, type=Choice(values), default=values[0])


def flag_option(name: str, short: str | None, panel: str | None, help: str) -> Any:
    names = [name] if short is None else [short, name]
    return option(*names, panel=panel, help=help, is_flag=True)


def check_source(source: str) -> None:
    """Raise AirlightError for what is neither a scene, nor a file, nor named like one."""
    if not (names.is_scene(source) or standard.is_input(source)) and not os.path.lexists(source) and not os.path.splitext(source)[1]:
        known = (*names.NAMES, *names.VALIDATION)
        hint = nearest(source, known) or nearest_file(source, f"; scenes are {', '.join(known)}, {', '.join(names.FILES)} files")
        raise AirlightError(f"{source}: there is no such picture or scene{hint}")


def to_stdout(output: str, format: str | None, usual: str = "png") -> str:
    """Write `-` with the ending of its format, by which a format is told everywhere; other outputs as they are.

    usual: the format that is meant if none is given. Raises AirlightError for a format beside a name.
    """
    if output == standard.NAME:
        return f"{output}.{format or usual}"
    if format is not None:
        raise AirlightError(f"--format says how what goes to - is written: {output} says so itself, leave --format out")
    return output


def format_option(command: F) -> F:
    """Decorator: the option that says the format of outputs whose names do not."""
    told = "Of outputs to - or in a folder; unset: the input's own, else png."
    return option("--format", panel=FILES, type=Choice([extension[1:] for extension in OUTPUTS]), help=told)(command)


def storage_options(command: F) -> F:
    """Decorator: the options that say how outputs are packed."""
    compression = option(
        "--compression",
        panel=FILES,
        metavar="NAME",
        help="Of EXR: none, rle, zip, zips, piz, pxr24, b44, b44a, dwaa, dwab (dwaa:45 with its level), htj2k32, htj2k256; "
        "of TIFF: none, lzw, zip, packbits. Unset: that of an EXR that is read, else zips; TIFF zip.",
    )
    quality = option(
        "--file-quality",
        panel=FILES,
        type=click.IntRange(1, 100),
        help="Of JPEG, WebP, AVIF, JPEG XL (100: lossless). Unset: that of a JPEG that is read; else 95, AVIF 90.",
    )
    subsampling = option(
        "--subsampling",
        panel=FILES,
        type=Choice(SUBSAMPLING),
        help="Of the colours of JPEG and AVIF. Unset: that of a JPEG that is read; else 4:4:4.",
    )
    return compression(quality(subsampling(command)))


def _described(kind: str) -> list[tuple[str, str]]:
    return [(name, presets.description(name, kind)) for name in presets.names(kind)]


PRESET, MEDIUM = (NameOrFile(functools.partial(_described, kind)) for kind in (presets.PRESETS, presets.MEDIA))
SCENE = NameOrFile(lambda: [(name, "a scene that comes with Airlight") for name in (*names.NAMES, *names.VALIDATION)])
preset_option = option(
    "--preset", panel="Presets", type=PRESET, metavar="NAME|FILE.toml", help="Values to start from; options given here go before them."
)


def preset_options(command: F) -> F:
    """Decorator: the options that give others their values."""
    recalling = option(
        "--settings-from",
        panel="Presets",
        metavar="FILE",
        type=click.Path(),
        is_eager=True,
        expose_value=False,
        callback=recall,
        help="Repeat the settings, lights included, that a picture or film written by this command holds; "
        "options and presets given here go before them.",
    )
    return recalling(preset_option(_listing("--list-presets", presets.PRESETS, "Show the presets.")(command)))


def file_scene_options(command: F) -> F:
    """Decorator: the options that choose of what a scene's file holds."""
    told = "A clip of a .glb or .gltf file, N from 0; unset: its first, and those that move other things."
    clip = option("--animation", panel="Scene", metavar="NAME|N", help=told)
    scene = option(
        "--scene", "scene_of_file", panel="Scene", metavar="NAME|N", help="A scene of a .glb or .gltf file, N from 0; unset: its default."
    )
    up = option("--up", panel="Scene", type=Choice(["y", "z"]), help="Of an .obj, .ply or .stl file: what points up; unset: z of .stl.")
    return clip(scene(up(command)))


def medium_options(command: F) -> F:
    """Decorator: the options that give a medium its values."""
    medium = option(
        "--medium",
        panel="Presets",
        type=MEDIUM,
        metavar="NAME|FILE.toml",
        help="What fills the air, over the preset's values; options given here go before them. Without --method it is lit by march.",
    )
    return medium(_listing("--list-media", presets.MEDIA, "Show the media.")(command))


class DensityType(click.ParamType):
    """A volume, or particles, kept as they were written."""

    def __init__(self, is_volume: bool) -> None:
        self.name, self._is_volume = "density", is_volume

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        from airlight.jobs.particle_text import read_particle_text
        from airlight.jobs.volume_text import read_volume_text

        try:
            (read_volume_text if self._is_volume else read_particle_text)(value)
        except AirlightError as error:
            self.fail(str(error), param, ctx)
        return str(value)


SHAPES = {
    "ies": (
        "NAME=FILE",
        "How strong a point or spot light of the scene, by name, is in which direction: a photometric file, .ies or .ldt, as in "
        '"lamp=street.ies". Its peak is as strong as the light is; or ";absolute=1", as the file says. May be repeated. docs/lights.md',
    ),
    "cookie": (
        "NAME=FILE",
        'A picture that a spot, a projector or a sun of the scene, by name, sends out: "spot=leaves.png". A sun repeats it, every '
        '";size=2" metres. May be repeated. docs/lights.md',
    ),
    "projector": (
        "x,y,z;...",
        'Light in a frustum, beside the scene\'s lights: "0,2,4;target=0,1,0;fov=40,30;intensity=300,300,300;cookie=slide.png". '
        "Also up=x,y,z, near and far in metres, falloff=inverse-square, inverse or constant, ambient=A, clip=a,b,c,d. "
        '"NAME;position=x,y,z;..." changes one of the scene. May be repeated. docs/lights.md',
    ),
}  # options that shape lights of a scene, or bring some that have a shape: what they take, and their help


class ShapeType(click.ParamType):
    """Keeps what shapes lights as it was written: of one of SHAPES."""

    def __init__(self, kind: str) -> None:
        self.name = kind

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        from airlight.jobs.projector_text import read_projector
        from airlight.jobs.shape_text import COOKIE, IES, read_shape_text

        try:
            if self.name == "projector":
                read_projector(value)
            else:
                read_shape_text(value, COOKIE if self.name == "cookie" else IES)
        except AirlightError as error:
            self.fail(str(error), param, ctx)
        return str(value)


def shape_options(command: F) -> F:
    """Decorator: the options that shape lights of a scene."""
    for name, (metavar, text) in SHAPES.items():
        command = option(f"--{name}", panel=LIGHT, type=ShapeType(name), metavar=metavar, multiple=True, help=text)(command)
    return command


def density_options(command: F) -> F:
    """Decorator: the options that put volumes and particles into the air of a scene."""
    volume = option(
        "--volume",
        panel="Medium",
        type=DensityType(True),
        metavar="FILE",
        multiple=True,
        help='Density on a grid, a .vdb, .npz, .npy or .vol: "smoke.vdb;factor=2;blend=add;grid=density;scale=0.01;up=z"; of '
        "smoke.####.vdb the file of each frame. May be repeated. docs/volumes.md",
    )
    particles = option(
        "--particles",
        panel="Medium",
        type=DensityType(False),
        metavar="FILE|NAME",
        multiple=True,
        help='Particles that thicken the air, a .csv, .npz or .ply, or points of the scene by name: "dust.csv;radius=0.2;density=1", '
        '"sparks;draw=0". May be repeated. docs/volumes.md',
    )
    return volume(particles(command))


def _listing(name: str, kind: str, help: str) -> Any:
    show = functools.partial(_list, kind)
    return option(name, panel="Presets", is_flag=True, is_eager=True, expose_value=False, callback=show, help=help)
