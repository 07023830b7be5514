"""`airlight compare`: methods or settings side by side."""

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import click
import rich_click

from airlight import presets
from airlight.cli import image
from airlight.cli.light import place
from airlight.cli.options import declared
from airlight.errors import AirlightError

if TYPE_CHECKING:
    from airlight.compare.measure import Row

_OWN = {"written", "angles", "origin", "preset", "list_presets", "mask", "mask_invert", "depth", "depth_near"}
_OWN |= {"input_layer", "colorspace", "overwrite", "on_damage", "device"} | {p.name for p in declared()}
_SHARED = [option for option in image.image.params if option.name in _OWN]  # they mean what they mean in `airlight image`
_option = image._option


@click.command(cls=rich_click.RichCommand, context_settings={"show_default": True}, params=_SHARED)
@click.argument("source", metavar="IN", type=click.Path())
@_option("--output", "-o", panel="Files", required=True, type=click.Path(), metavar="FILE", help="A picture, or a page: .html.")
@_option(
    "--variant",
    "texts",
    panel="Comparison",
    multiple=True,
    metavar="KEY=VALUE,...",
    help="What to compare, repeatedly: parameters and presets that go before the others, as in method=radial,samples=32,jitter=blue "
    "or vesper; samples without decay keep the length of the shafts. Without this option: a list of the methods.",
)
@_option("--runs", panel="Comparison", type=click.IntRange(1, 99), default=5, help="Timed runs of each, interleaved.")
@_option("--amplify", panel="Comparison", type=click.FloatRange(0.001, 1e6), default=10.0, help="Factor of the difference over the mean.")
@click.pass_context
def compare(
    ctx: click.Context,
    source: str,
    output: str,
    origin: str,
    mask: str | None,
    depth: str | None,
    preset: str | None,
    overwrite: bool,
    on_damage: str,
    device: str | None,
    texts: Sequence[str],
    runs: int,
    amplify: float,
    **_: Any,
) -> None:
    """Compare methods or settings on the picture IN: error against the converged sum, cost, difference."""
    base = image.asked(ctx)
    presets.build(base)
    from airlight.compare.variants import usual, variant

    variants = [variant(text, base) for text in texts]
    if not variants:
        variants, lacking = usual(base)
        for reason in lacking:
            click.echo(f"left out: {reason}", err=True)
    if not variants:
        raise AirlightError("no method goes with these options; name what to compare with --variant")

    from airlight import files
    from airlight.compare import measure, page, words
    from airlight.compare.sheet import sheet

    is_page = output.lower().endswith((".html", ".htm"))
    files.check_output(output, [p for p in (source, mask, depth, preset) if p is not None], overwrite, image=not is_page)
    picture = files.read_image(source, on_damage, ctx.params["input_layer"], ctx.params["colorspace"])
    emits, far = image.read_planes(mask, depth, ctx.params)
    found = image.resolve_lights(image.asked_lights(ctx), picture, origin, picture.rec709(picture.linear(coarse=True)))
    lights = [place(light, picture) for light in found]
    wide = max(len(v.name) for v in variants)

    def say(row: "Row") -> None:
        error, p99, worst, cost = words.figures(row)
        click.echo(f"{row.variant.name:{wide}}  error {error:>8}  99 % {p99:>8}  max {worst:>8}  {cost}")

    from rich.console import Console

    with Console(stderr=True).status("measuring"):  # shows on a terminal only
        result = measure.compare(picture, lights, variants, mask=emits, depth=far, device=device, runs=runs, say=say)
    name = "".join(c if c.isprintable() else "?" for c in os.path.basename(source))
    title = f"{name}, {result.size[0]} × {result.size[1]}: light shafts compared"
    if is_page:
        with files.replacing(output, overwrite) as file:
            file.write(page.page(result, title, amplify).encode())
    else:
        codes = sheet(result, title, amplify)
        files.write_image(output, files.to_linear(codes)[0], encoded=codes, overwrite=overwrite)
