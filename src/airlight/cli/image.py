"""`airlight image`: light shafts on a picture."""

import dataclasses
from typing import TYPE_CHECKING, Any

import click

from airlight.cli.help import Command
from airlight.cli.light import AngleType, LightType
from airlight.cli.options import gather, given, parameter_options
from airlight.cli.settings import recalled_preset
from airlight.cli.shared import (
    DEPTH,
    FILES,
    LIGHT,
    OCCLUSION,
    choice_option,
    file_option,
    flag_option,
    format_option,
    option,
    preset_options,
    storage_options,
)
from airlight.cli.types import Choice

if TYPE_CHECKING:
    from airlight.jobs.image import ImageRequest


@click.command(cls=Command)
@click.argument("sources", metavar="IN...", type=click.Path(), nargs=-1, required=True)
@file_option("--output", "-o", FILES, "The picture to write; the extension says the format. For many: a folder, or a pattern. -: stdout.")
@option("--frames", panel=FILES, metavar="1-100x2", help="Frames of the pattern IN (shot.####.exr, shot.%04d.exr); else all there are.")
@option(
    "--light",
    "written",
    panel=LIGHT,
    type=LightType(),
    metavar="X,Y|auto",
    multiple=True,
    default=("auto",),
    help="Where the light is: 0.4,0.3 or 960px,540px or 50%,20%, also outside the picture; auto finds it, auto:2 the next likely place, "
    'auto:3+ the best three together. May be repeated, with colour and strength: "0.4,0.2;color=1,0.8,0.6;strength=2".',
)
@file_option(
    "--cookie",
    None,
    LIGHT,
    "A picture held upon the lights of --light, its middle on each: shafts have the mean colour of what lies in their direction, white "
    'changes nothing; of gobo.####.png each frame its own. Of one light: "0.4,0.2;cookie=gobo.png". docs/lights.md',
)
@file_option("--candidates", None, LIGHT, "Show the places where the light may be, numbered on the picture; or write them to a .json file.")
@option(
    "--angle",
    "angles",
    panel=LIGHT,
    type=AngleType(),
    multiple=True,
    help="A parallel light, as of a sun far away: degrees, where it comes from, 0 right, 90 above, counter-clockwise. "
    "Density is then in image widths. May be repeated, with colour and strength as --light.",
)
@choice_option("--origin", LIGHT, ["top", "bottom"], "Where y of the light counts from (Nuke, Blender: bottom).")
@preset_options
@parameter_options
@file_option("--mask", None, OCCLUSION, "An image of the same size; white emits.")
@option(
    "--mask-layer",
    panel=OCCLUSION,
    metavar="NAME",
    help="Of the EXR of --mask, or of IN without it: a channel (matte.A), a layer, or an object of its Cryptomatte "
    "(crypto_object/Tree, or Tree; Tree* for all that begin so).",
)
@flag_option("--mask-invert", None, OCCLUSION, "Black emits instead.")
@file_option(
    "--depth",
    None,
    DEPTH,
    "An image of the same size, larger is farther: shafts pass behind what is near. With --occlusion depth what is far emits.",
)
@option("--depth-layer", panel=DEPTH, metavar="NAME", help="The channel that holds depths, as Z: of the EXR of --depth, or of IN.")
@choice_option("--depth-near", DEPTH, ["black", "white"], "Which end of the depths is near: white for maps that hold inverse depths.")
@option(
    "--near-range",
    panel=DEPTH,
    metavar="A,B",
    default="0.05,0.6",
    help="Of the depths, 0 the nearest and 1 the farthest: what is nearer than A hides shafts, nothing beyond B does.",
)
@option("--depth-aware/--no-depth-aware", "depth_hides", panel=DEPTH, default=True, help="Whether depths hide shafts at all.")
@file_option("--subject", None, DEPTH, "An image of the same size: shafts pass behind what is white; --wrap lets light round its edge.")
@option("--subject-layer", panel=DEPTH, metavar="NAME", help="The channel, layer or object that is such a mask, as --mask-layer.")
@option(
    "--input-layer",
    panel=FILES,
    metavar="NAME",
    help="The layer of an EXR to work on, rgba being R G B A. In an EXR output its own "
    "channels are replaced and R G B A stay; the shafts alone are in airlight.R/G/B, to be added where you like.",
)
@option("--view", panel=FILES, metavar="NAME", help="Of a stereo EXR, the view to work on, as right; unset: its first.")
@option(
    "--colorspace",
    panel=FILES,
    metavar="NAME",
    help="The linear space that the floats of IN are in, kept in an EXR output: ACEScg, "
    "lin_rec709_scene, ACES2065-1 or another of $OCIO's or OpenColorIO's studio config. Unset: by the EXR's chromaticities, else Rec. 709.",
)
@file_option("--layer", None, FILES, "Also write the shafts alone.")
@file_option(
    "--occlusion-fraction", None, FILES, "Also write how much of each ray is occluded: D of GPU Gems 3, ch. 13, Eq. 2 (white: all)."
)
@option(
    "--debug",
    panel=FILES,
    type=Choice(["source", "mask", "fraction", "lines", "moments"]),
    help="Write a view instead of the picture: what emits; its mask; the occluded fraction; the epipolar lines; their steps and powers.",
)
@format_option
@storage_options
@flag_option("--overwrite", "-y", FILES, "Replace outputs that exist.")
@flag_option("--skip-existing", "-n", FILES, "Leave out what exists.")
@flag_option("--resume", None, FILES, "Do only what is missing or damaged.")
@choice_option("--on-damage", FILES, ["error", "warn", "ignore"], "What to do with a damaged input.")
@option("--device", metavar="NAME", help="Compute on the adapter whose name holds NAME; `airlight info` lists them.")
@flag_option("--profile", None, None, "Show where the time goes.")
@click.pass_context
def image(ctx: click.Context, **_: Any) -> int:
    """Add light shafts to the picture IN, or to many: files, a folder, or a numbered sequence such as shot.####.exr. -: stdin."""
    from airlight.jobs.image import run_image

    return 0 if run_image(image_request(ctx)) else 2


def image_request(ctx: click.Context) -> "ImageRequest":
    """Make of the command line what is wanted of pictures, for this command and for comparisons."""
    from airlight.jobs.image import ImageRequest

    o, default = ctx.params, click.core.ParameterSource
    written, angles = o["written"], o["angles"]
    alone = angles and ctx.get_parameter_source("written") is default.DEFAULT  # an angle stands alone
    names = {one.name for one in dataclasses.fields(ImageRequest)} & o.keys()
    names -= set() if isinstance(o.get("cookie"), str) else {"cookie"}  # comparisons' are of scenes
    return ImageRequest(
        **{name: o[name] for name in names - {"origin", "sources"}},
        sources=o.get("sources", ()),
        origin=o["origin"] if given(ctx, "written") else "top",
        lights=[*(() if alone else written), *angles],
        values=gather(ctx, o["preset"]),
        explicit=frozenset(name for name in names if given(ctx, name)),
        recalled=ctx.get_parameter_source("written") is default.DEFAULT_MAP,
        recalled_preset=recalled_preset(ctx),
    )
