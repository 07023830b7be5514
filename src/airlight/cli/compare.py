"""`airlight compare`: methods or settings side by side, on a picture or in a scene."""

import copy
import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import click
import rich_click

from airlight import presets
from airlight.cli import image, render
from airlight.cli.light import LightType, place
from airlight.cli.options import NOT_IN_SCENES, declared, gather, given
from airlight.errors import AirlightError

if TYPE_CHECKING:
    from airlight.compare.shown import Shown, ShownRow
    from airlight.compare.variants import Variant

WIDTH = 480  # pixels of a scene's picture, where none is given
RUN = "Comparison"  # a panel of the help
_option = image._option

_BOTH = {"preset", "list_presets", "overwrite", "device"} | {p.name for p in declared()}
_PICTURES = {"angles", "origin", "mask", "mask_invert", "depth", "depth_near", "input_layer", "colorspace", "on_damage"}
_NOT_COMPARED = {"scene", "output", "no_antialias", "turntable", "frames", "fps", "crf", "draw_path", "layer", "occlusion_buffer"}
_NOT_COMPARED |= {"skip_existing", "resume", "settings_from", "light"}


def _again(option: Any, **changed: Any) -> Any:
    """An option of another command, where it means the same."""
    again = copy.copy(option)
    for name, value in changed.items():
        setattr(again, name, value)
    return again


_SHARED = [option for option in image.image.params if option.name in _BOTH | _PICTURES]
_SCENES = [
    _again(option, **{"default": WIDTH} if option.name == "width" else {})
    for option in render.render.params
    if option.name not in _NOT_COMPARED | _BOTH
]
_IN_PICTURES = _PICTURES | NOT_IN_SCENES
_IN_SCENES = {option.name for option in _SCENES} | {"reference"}


@click.command(cls=rich_click.RichCommand, context_settings={"show_default": True}, params=_SHARED + _SCENES)
@click.argument("source", metavar="IN", type=click.Path())
@_option("--output", "-o", panel="Files", type=click.Path(), metavar="FILE", help="A picture, or a page: .html.")
@_option("--html", "pages", panel="Files", type=click.Path(), metavar="FILE", help="A page, whatever its name.")
@_option(
    "--light",
    "written",
    panel=image.LIGHT,
    multiple=True,
    metavar="X,Y|auto|X,Y,Z",
    help="Where the light is: as in `airlight image` for a picture, where auto is the default; as in `airlight render` for a scene.",
)
@_option(
    "--variant",
    "texts",
    panel=RUN,
    multiple=True,
    metavar="KEY=VALUE,...",
    help="What to compare, repeatedly: parameters and presets that go before the others, as in method=radial,samples=32,jitter=blue, "
    "method=march,steps=64,resolution=0.5 or vesper; samples without decay keep the length of the shafts. Without this option: a list of "
    "the methods.",
)
@_option(
    "--reference",
    panel=RUN,
    metavar="tracer|mitsuba|exact|FILE.exr",
    default="tracer",
    help="Of a scene, what the light in its medium is measured against: the float64 ray tracer; Mitsuba (pip install airlight[truth]); "
    "the exact walk through larger shadow maps; or an EXR of the same size, whose R, G, B are that light.",
)
@_option("--runs", panel=RUN, type=click.IntRange(1, 99), default=5, help="Timed runs of each, interleaved.")
@_option("--amplify", panel=RUN, type=click.FloatRange(0.001, 1e6), default=10.0, help="Factor of the difference over the mean.")
@click.pass_context
def compare(
    ctx: click.Context,
    source: str,
    output: str | None,
    pages: str | None,
    mask: str | None,
    depth: str | None,
    preset: str | None,
    overwrite: bool,
    environment: str | None,
    texts: Sequence[str],
    reference: str,
    amplify: float,
    **_: Any,
) -> None:
    """Compare methods or settings on the picture or scene IN: error, cost, difference.

    A picture's shafts are measured against the converged sum; the light in a scene's medium against a ray tracer, one sample at the
    pixels' centres.
    """
    from airlight import files
    from airlight.scenes import is_scene

    scene = is_scene(source)
    _check_options(ctx, source, scene)
    outputs = [path for path in (output, pages) if path is not None]
    if not outputs:
        raise AirlightError("nothing to write: give -o FILE, a picture or an .html page, or --html FILE")
    inputs = [path for path in (source, mask, depth, preset, environment, reference) if path is not None]
    for path in outputs:
        files.check_output(path, inputs, overwrite, image=not _is_page(path, pages))
    shown, title = (_scene if scene else _picture)(ctx, source, _variants(ctx, texts, scene))

    from airlight.compare.page import page
    from airlight.compare.sheet import sheet

    for path in outputs:
        if _is_page(path, pages):
            with files.replacing(path, overwrite) as file:
                file.write(page(shown, title).encode())
        else:
            codes = sheet(shown, title)
            files.write_image(path, files.to_linear(codes)[0], encoded=codes, overwrite=overwrite)


def _is_page(path: str, pages: str | None) -> bool:
    return path is pages or path.lower().endswith((".html", ".htm"))


def _check_options(ctx: click.Context, source: str, scene: bool) -> None:
    """Refuse options that mean nothing for such an IN."""
    for option in ctx.command.params:
        if option.name in (_IN_PICTURES if scene else _IN_SCENES) and given(ctx, option.name):
            other, kind = ("pictures", "a scene") if scene else ("scenes", "a picture")
            raise AirlightError(f"{option.opts[0]} goes with {other}: {source} is {kind}; leave it out")


def _variants(ctx: click.Context, texts: Sequence[str], scene: bool) -> "list[Variant]":
    from airlight.compare.variants import usual, variant

    base = gather(ctx, ctx.params["preset"]) if scene else image.asked(ctx)
    presets.build(base)
    found, lacking = [variant(text, base) for text in texts], []
    if not texts:
        found, lacking = usual(base, scene)
    for reason in lacking:
        click.echo(f"left out: {reason}", err=True)
    if not found:
        raise AirlightError("no method goes with these options; name what to compare with --variant")
    return found


def _converted(ctx: click.Context, kind: click.ParamType, texts: Sequence[str]) -> tuple[Any, ...]:
    """Lights as the kind reads them."""
    param = next(p for p in ctx.command.params if p.name == "written")
    return tuple(kind.convert(text, param, ctx) for text in texts)


def _title(source: str, size: tuple[int, int], what: str) -> str:
    name = "".join(c if c.isprintable() else "?" for c in os.path.basename(source))
    return f"{name}, {size[0]} × {size[1]}: {what} compared"


def _said(variants: "Sequence[Variant]") -> Any:
    """What tells a row as it comes."""
    wide = max(len(v.name) for v in variants)

    def say(row: "ShownRow") -> None:
        click.echo(f"{row.name:{wide}}  {'  '.join(row.lines)}")

    return say


def _picture(ctx: click.Context, source: str, variants: "Sequence[Variant]") -> "tuple[Shown, str]":
    from rich.console import Console

    from airlight import files
    from airlight.compare import measure, words

    o = ctx.params
    o["written"] = _converted(ctx, LightType(), o["written"] or ("auto",))
    picture = files.read_image(source, o["on_damage"], o["input_layer"], o["colorspace"])
    emits, far = image.read_planes(o["mask"], o["depth"], o)
    found = image.resolve_lights(image.asked_lights(ctx), picture, o["origin"], picture.rec709(picture.linear(coarse=True)))
    lights = [place(light, picture) for light in found]
    wide = max(len(v.name) for v in variants)

    def say(row: measure.Row) -> None:
        error, p99, worst, cost = words.figures(row)
        click.echo(f"{row.variant.name:{wide}}  error {error:>8}  99 % {p99:>8}  max {worst:>8}  {cost}")

    with Console(stderr=True).status("measuring"):  # shows on a terminal only
        result = measure.compare(picture, lights, variants, mask=emits, depth=far, device=o["device"], runs=o["runs"], say=say)
    return words.shown(result, o["amplify"]), _title(source, result.size, "light shafts")


def _scene(ctx: click.Context, source: str, variants: "Sequence[Variant]") -> "tuple[Shown, str]":
    from rich.console import Console

    o = ctx.params
    o["light"] = tuple(light for light in o["written"])
    _converted(ctx, render._Light(render.PLACE), o["light"])
    studio = render.open_studio(ctx, source, samples=1)

    from airlight.compare import light, scenes

    wide = max(len(v.name) for v in variants)

    def say(row: scenes.Row) -> None:
        click.echo(f"{row.variant.name:{wide}}  {light.line(row)}")

    def left_out(reason: str) -> None:
        click.echo(f"left out: {reason}", err=True)

    with Console(stderr=True).status("measuring"):
        result = scenes.compare(
            studio, variants, o["reference"], time=o["time"], turn=o["turn"] / 360, runs=o["runs"], say=say, left_out=left_out
        )
    return light.shown(result, o["amplify"]), _title(source, result.size, "light in a medium")
