"""`airlight compare`: methods or settings side by side, on a picture or in a scene."""

import copy
import dataclasses
import os
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import click

from airlight.cli import image, render
from airlight.cli.help import Command
from airlight.cli.light import LightType
from airlight.cli.options import given
from airlight.cli.shared import LIGHT, SCENE, check_source, flag_option, option, to_stdout
from airlight.cli.types import Choice, Real
from airlight.errors import AirlightError
from airlight.jobs.finding import resolve_lights
from airlight.jobs.frames import LARGEST, needing_scenes, say_offer
from airlight.jobs.light_text import PLACE, place, read_light
from airlight.jobs.verdict import tell_compared
from airlight.options import NOT_IN_SCENES, OF_LOOK, Medium, build, declared, refuse_look
from airlight.progress import showing
from airlight.scenes.names import A_FILE, is_scene

if TYPE_CHECKING:
    from airlight.compare.result import Comparison, Row
    from airlight.compare.variants import Variant
    from airlight.progress import Work

WIDTH = 480  # of a scene
_PICTURES = {"angles", "origin", "mask", "mask_layer", "mask_invert", "depth", "depth_near", "input_layer", "view", "colorspace"}
_PICTURES |= {"on_damage"}
_DAYLIGHT = {p.name for p in declared(scenes=True) if p.group == "daylight"}  # what is compared is shafts
_PICTURES |= NOT_IN_SCENES - OF_LOOK - _DAYLIGHT
_SCENES = {"camera", "eye", "target", "fov", "width", "height", "turn", "time", "seed", "sun", "environment", "up", "exclude"}
_SCENES |= {"animation", "scene_of_file", "volume", "particles", "ies", "cookie", "projector"}
_SCENES |= {"medium", "list_media"} | ({p.name for p in declared(scenes=True)} - {p.name for p in declared()} - _DAYLIGHT)
_BOTH = {"preset", "list_presets", "overwrite", "device"} | ({p.name for p in declared()} - NOT_IN_SCENES - _DAYLIGHT)


def _shared() -> list[click.Parameter]:
    """Collect options that mean what they mean in `airlight image`, and in `airlight render`."""
    found: dict[str | None, click.Parameter] = {}
    for command, names in ((image.image, _PICTURES), (render.render, _SCENES | _BOTH)):
        found |= {one.name: one for one in command.params if one.name in names}
    found["width"] = copy.copy(found["width"])
    found["width"].default = WIDTH
    return list(found.values())


class SourceLightType(click.ParamType):
    """A light of a picture, or of a scene, as that of `airlight image` or `airlight render`."""

    name = "X,Y|auto|x,y,z"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        scene = ctx is not None and is_scene(ctx.params.get("source") or "")
        return (render.SceneLightType(PLACE) if scene else LightType()).convert(value, param, ctx)


@click.command(cls=Command, params=_shared())
@click.argument("source", metavar="IN|SCENE", type=SCENE, is_eager=True)  # before --light, which depends on it
@option("--output", "-o", panel="Files", required=True, type=click.Path(), metavar="FILE", help="A picture, or a page: .html.")
@flag_option("--html", None, "Files", "Write a page, whatever the output's name ends with.")
@option(
    "--light",
    "written",
    panel=LIGHT,
    type=SourceLightType(),
    metavar="X,Y|x,y,z",
    multiple=True,
    help="Where the light of a picture is, 0.4,0.3 or 50%,20% or auto (unset: auto); or in a scene instead of its own, metres: 0,2,-3, "
    "or an object's name. May be repeated, with colour and strength: '0.4,0.2;color=1,0.8,0.6;strength=2'.",
)
@option(
    "--variant",
    "texts",
    panel="Comparison",
    multiple=True,
    metavar="KEY=VALUE,...",
    help="What to compare, repeatedly: parameters and presets that go before the others, as in method=radial,samples=32,jitter=blue, "
    "vesper, or in a scene steps=64 or fog=exponential; samples without decay keep the length of the shafts. Without this option: a list "
    "of the methods.",
)
@option(
    "--against",
    panel="Comparison",
    type=Choice(["tracer", "walk", "mitsuba"]),
    help="In a scene, the truth: a ray tracer over its triangles; the exact walk with the finest shadow maps; Mitsuba. Unset: the tracer "
    "where it can and is quick enough, else the walk.",
)
@option("--runs", panel="Comparison", type=click.IntRange(1, 99), default=5, help="Timed runs of each, interleaved.")
@option("--amplify", panel="Comparison", type=Real(0.001, 1e6), default=10.0, help="Factor of the difference over the mean.")
@click.pass_context
def compare(
    ctx: click.Context,
    source: str,
    output: str,
    texts: Sequence[str],
    amplify: float,
    **_: Any,
) -> None:
    """Compare methods or settings: error against the truth, cost, difference.

    On the picture IN, whose truth is the converged sum; or in SCENE (table, flying, a scene of validation, a .glb, .gltf, .obj, .ply or
    .stl file), whose truth is the light that its medium scatters.
    """
    ctx.params["output"] = output = to_stdout(output, "html" if ctx.params["html"] and output == "-" else None)
    scene = is_scene(source)
    if not scene:
        check_source(source)
    for one in ctx.command.params:
        name = str(one.name)
        if name in (_PICTURES if scene else _SCENES | {"against"}) and given(ctx, name):
            other = "a picture" if scene else f"a scene (table, flying, {A_FILE})"
            raise AirlightError(f"{one.opts[0]} goes with {other}, which {source} is not: leave it out")
    result, title = (_in_scene if scene else _on_picture)(ctx, source, output, texts)
    tell_compared(result.rows, getattr(result, "before", None))

    from airlight import files
    from airlight.compare import page
    from airlight.compare.sheet import sheet

    overwrite = ctx.params["overwrite"]
    if _is_page(ctx):
        with files.replacing(output, overwrite) as file:
            file.write(page.page(result, title, amplify).encode())
    else:
        codes = sheet(result, title, amplify)
        files.write_image(output, files.to_linear(codes)[0], encoded=codes, overwrite=overwrite)


def _is_page(ctx: click.Context) -> bool:
    return ctx.params["html"] or ctx.params["output"].lower().endswith((".html", ".htm"))


def _check_output(ctx: click.Context, inputs: Sequence[str | None]) -> None:
    from airlight import files

    given_inputs = [p for p in inputs if p is not None]
    files.check_output(ctx.params["output"], given_inputs, ctx.params["overwrite"], image=not _is_page(ctx))


def _chosen(texts: Sequence[str], base: dict[str, Any], in_scene: bool = False, lacks: Any = lambda variant: None) -> "list[Variant]":
    from airlight.compare.variants import usual, variant

    variants = [variant(text, base, in_scene) for text in texts]
    if not variants:
        variants, lacking = usual(base, in_scene, lacks)
        for reason in lacking:
            click.echo(f"left out: {reason}", err=True)
    if not variants:
        raise AirlightError("no method goes with these options; name what to compare with --variant")
    return variants


def _measured(variants: "Sequence[Variant]", measure: "Callable[[Callable[[Row], None], Work], Comparison]") -> "Comparison":
    """Measure, and print each row as it is complete."""
    from airlight.compare import words

    wide = max(len(v.name) for v in variants)

    def say(row: "Row") -> None:
        error, p99, worst, cost = words.figures(row)
        click.echo(f"{row.variant.name:{wide}}  error {error:>8}  99 % {p99:>8}  max {worst:>8}  {cost}")

    with showing("measuring") as work:
        return measure(say, work)


def _named(source: str, size: tuple[int, int], what: str) -> str:
    name = "".join(c if c.isprintable() else "?" for c in os.path.basename(source))
    return f"{name}, {size[0]} × {size[1]}: {what}"


def _on_picture(ctx: click.Context, source: str, output: str, texts: Sequence[str]) -> "tuple[Comparison, str]":
    o = ctx.params
    o["written"] = o["written"] or (read_light("auto"),)
    request = image.image_request(ctx).with_occlusion(is_sum=True)
    base = request.values
    refuse_look(base, "a comparison of methods")
    build(base)
    variants = _chosen(texts, base)

    from airlight.compare import measure

    _check_output(ctx, [source, o["mask"], o["depth"], o["preset"]])
    picture = request.reading.picture(source)
    emits, far = request.reading.mask(request.mask, picture), request.reading.depth(request.depth, picture)
    found = resolve_lights(request.lights, picture, o["origin"], picture.rec709(picture.linear(coarse=True)))
    lights = [place(light, picture) for light in found]
    if not lights:
        raise AirlightError(f"{source}: without a light there is nothing to compare; give --light X,Y")

    def measured(say: Any, work: Any) -> "Comparison":
        return measure.compare(picture, lights, variants, mask=emits, depth=far, device=o["device"], runs=o["runs"], say=say, work=work)

    result = _measured(variants, measured)
    return result, _named(source, result.size, "light shafts compared")


def _in_scene(ctx: click.Context, source: str, output: str, texts: Sequence[str]) -> "tuple[Comparison, str]":
    o = ctx.params
    request = dataclasses.replace(render.frames_request(ctx, source), light=o["written"])
    values = request.scene_values()
    build(values)
    request.check_camera()
    size = request.size
    if size[0] * size[1] > LARGEST:
        raise AirlightError(f"{size[0]}x{size[1]} is too large; make it smaller")
    _check_output(ctx, [source, o["preset"], o["medium"], o["environment"]])
    with needing_scenes():
        from airlight.compare import scenes
        from airlight.gpu.device import shared_device
        from airlight.reference import mitsuba
        from airlight.scenes import open_scene
    if o["against"] == "mitsuba":
        mitsuba.ready()
    shared_device(o["device"])
    more = {"lamps": request.adds_lamps, "up": o["up"]}
    stage = open_scene(source, o["environment"], o["seed"], o["animation"], o["scene_of_file"], **more)
    base = stage.settings | values
    from airlight.jobs.densities import put_densities, suit

    cells = build(base)[Medium].particle_cells
    put_densities(stage, request.volume, request.particles, float(request.fps), cells)
    if request.volume or request.particles:
        suit(stage, values, cells)
    base = stage.settings | values
    say_offer(stage, o["written"])
    for text in texts:  # before anything is drawn
        _chosen([text], base, True)
    view = scenes.ComparedView(stage, request.shot(1, False, stage), o["time"], o["turn"] / 360, o["exclude"])
    variants = _chosen(texts, base, True, view.lacks)
    options = {"against": o["against"], "runs": o["runs"]}
    result = _measured(variants, lambda say, work: scenes.compare(view, variants, **options, say=say, work=work))
    return result, _named(source, result.size, "light in the air compared")
