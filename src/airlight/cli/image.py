"""`airlight image`: light shafts on a picture."""

import contextlib
import dataclasses
import functools
import os
import threading
import time
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import click
import rich_click

from airlight import presets
from airlight.cli.light import AngleType, LightText, LightType, place
from airlight.cli.options import gather, given, parameter_options
from airlight.errors import AirlightError

if TYPE_CHECKING:
    import numpy as np

    from airlight.files import Picture
    from airlight.lights import Light


def _list_presets(ctx: click.Context, _: click.Parameter, wanted: bool) -> None:
    if wanted and not ctx.resilient_parsing:
        for name in presets.names():
            click.echo(f"{name:10} {presets.description(name)}")
        ctx.exit()


LIGHT, OCCLUSION, FILES = "Light", "Occlusion", "Files"  # panels of the help
_option = functools.partial(click.option, cls=rich_click.RichOption)


def _file(name: str, short: str | None, panel: str, help: str, required: bool = False) -> Any:
    names = [name] if short is None else [short, name]
    return _option(*names, panel=panel, help=help, required=required, type=click.Path(), metavar="FILE")


def _choice(name: str, panel: str, values: Sequence[str], help: str) -> Any:
    return _option(name, panel=panel, help=help, type=click.Choice(values), default=values[0])


def _flag(name: str, short: str | None, panel: str | None, help: str) -> Any:
    names = [name] if short is None else [short, name]
    return _option(*names, panel=panel, help=help, is_flag=True)


@click.command(cls=rich_click.RichCommand, context_settings={"show_default": True})
@click.argument("source", metavar="IN", type=click.Path())
@_file("--output", "-o", FILES, "The picture to write; the extension says the format.", required=True)
@_option(
    "--light",
    "written",
    panel=LIGHT,
    type=LightType(),
    multiple=True,
    default=("auto",),
    help="Where the light is: 0.4,0.3 or 960px,540px or 50%,20%, also outside the picture; auto finds the brightest place. "
    'May be repeated, with colour and strength: "0.4,0.2;color=1,0.8,0.6;strength=2".',
)
@_option(
    "--angle",
    "angles",
    panel=LIGHT,
    type=AngleType(),
    multiple=True,
    help="A parallel light, as of a sun far away: degrees, where it comes from, 0 right, 90 above, counter-clockwise. "
    "Density is then in image widths. May be repeated, with colour and strength as --light.",
)
@_choice("--origin", LIGHT, ["top", "bottom"], "Where y of the light counts from (Nuke, Blender: bottom).")
@_option("--preset", panel="Presets", metavar="NAME|FILE.toml", help="Values to start from; options given here go before them.")
@_option(
    "--list-presets", panel="Presets", is_flag=True, is_eager=True, expose_value=False, callback=_list_presets, help="Show the presets."
)
@parameter_options
@_file("--mask", None, OCCLUSION, "An image of the same size; white emits.")
@_flag("--mask-invert", None, OCCLUSION, "Black emits instead.")
@_file("--depth", None, OCCLUSION, "An image of the same size; what is far emits.")
@_choice("--depth-near", OCCLUSION, ["black", "white"], "Which end of the depth image is near.")
@_file("--layer", None, FILES, "Also write the shafts alone.")
@_file("--occlusion-fraction", None, FILES, "Also write how much of each ray is occluded: D of GPU Gems 3, ch. 13, Eq. 2 (white: all).")
@_flag("--overwrite", "-y", FILES, "Replace outputs that exist.")
@_flag("--skip-existing", "-n", FILES, "Do nothing if the output exists.")
@_choice("--on-damage", FILES, ["error", "warn", "ignore"], "What to do with a damaged input.")
@_option("--device", metavar="NAME", help="Compute on the adapter whose name holds NAME; `airlight info` lists them.")
@_flag("--profile", None, None, "Show where the time goes.")
@click.pass_context
def image(
    ctx: click.Context,
    source: str,
    output: str,
    written: Sequence[LightText],
    angles: Sequence[LightText],
    origin: str,
    preset: str | None,
    mask: str | None,
    mask_invert: bool,
    depth: str | None,
    depth_near: str,
    layer: str | None,
    occlusion_fraction: str | None,
    overwrite: bool,
    skip_existing: bool,
    on_damage: str,
    device: str | None,
    profile: bool,
    **_: Any,
) -> None:
    """Add light shafts to the picture IN."""
    if overwrite and skip_existing:
        raise AirlightError("-y/--overwrite and -n/--skip-existing exclude each other; give one")
    if skip_existing and os.path.lexists(output):
        click.echo(f"{output} exists: skipped", err=True)
        return
    written = [*(written if given(ctx, "written") or not angles else ()), *angles]
    if mask_invert and mask is None:
        raise AirlightError("--mask-invert inverts the image of --mask; give both")
    if occlusion_fraction is not None and len(written) > 1:
        raise AirlightError("--occlusion-fraction belongs to one light; give one --light or --angle")
    values = gather(ctx, preset)
    if depth is not None:
        values.setdefault("occlusion", "depth")  # what else would it be given for?
    elif values.get("occlusion") == "depth":
        raise AirlightError("the occlusion 'depth' needs an image of depths; add --depth FILE")
    if given(ctx, "depth_near") and depth is None:
        raise AirlightError("--depth-near describes the image of --depth; give both")
    parameters, *others = presets.build(values).values()
    composite = others[0] if others else None

    from airlight import api, files
    from airlight.occlusion.automatic import settled

    _check_outputs([output, layer, occlusion_fraction], [source, mask, depth, preset], overwrite)
    spent = _Spent()
    start = threading.Thread(target=_open_device, args=(device,), daemon=True)
    start.start()  # while the picture is read
    picture = files.read_image(source, on_damage)
    start.join()
    emits = None if mask is None else files.read_mask(mask, on_damage)
    if emits is not None and mask_invert:
        emits = 1 - emits
    far = None if depth is None else files.read_mask(depth, on_damage, depth=True)
    if far is not None and depth_near == "white":
        far = (far.max() if far.max() > 1 else 1) - far
    spent.lap("read")
    codes = picture.codes.dtype.kind == "u"
    settles = codes or (composite is not None and composite.adapt > 0)
    coarse = picture.linear(coarse=True) if settles or any(w.position == "auto" for w in written) else None
    lights = _lights(written, picture, origin, coarse)
    if coarse is not None and settles:
        parameters = settled(parameters, coarse, lights, bounded=codes)
    spent.lap("find the light" if any(w.position == "auto" for w in written) else "")

    passes: list[tuple[str, float]] = []
    done = api.render_picture(
        picture,
        lights,
        parameters,
        composite,
        mask=emits,
        depth=far,
        device=device,
        profile=passes if profile else None,
        float_output=_is_float(output),
        codes_only=layer is None and picture.bits == 8 and not _is_float(output),
    )
    fraction = None
    if occlusion_fraction is not None:
        keys = {name: getattr(parameters, name) for name in parameters.__struct_fields__}
        fraction = api.occlusion_fraction(picture.linear(), lights[0], alpha=picture.alpha, depth=far, mask=emits, device=device, **keys)
    spent.lap("render")

    beside = done.layer if output.lower().endswith(".exr") else None
    files.write_image(
        output, done.pixels, picture, changed=done.changed, alpha=picture.alpha, layer=beside, overwrite=overwrite, encoded=done.encoded
    )
    if layer is not None:
        bare = dataclasses.replace(
            picture, codes=picture.colour_codes, alpha=None, associated=False, extra=None, extra_names=(), extra_formats=()
        )
        files.write_image(layer, done.layer, bare, overwrite=overwrite)
    if occlusion_fraction is not None and fraction is not None:
        _write_data(occlusion_fraction, fraction, overwrite)
    spent.lap("write")
    if profile:
        _show_profile(spent, passes)


def _open_device(name: str | None) -> None:
    """Whatever is wrong is told when the device is used."""
    from airlight.gpu.device import open_device

    with contextlib.suppress(Exception):
        open_device(name)


def _is_float(path: str) -> bool:
    return path.lower().endswith((".exr", ".hdr"))


def _check_outputs(outputs: Sequence[str | None], inputs: Sequence[str | None], overwrite: bool) -> None:
    """Refuse outputs that cannot be written before the work begins."""
    from airlight import files

    seen: set[str] = set()
    for path in outputs:
        if path is not None:
            files.check_output(path, [p for p in inputs if p is not None], overwrite)
            if os.path.realpath(path) in seen:
                raise AirlightError(f"{path}: is named for two outputs; give each a name of its own")
            seen.add(os.path.realpath(path))


def _lights(written: Sequence[LightText], picture: "Picture", origin: str, coarse: "np.ndarray | None") -> "list[Light]":
    found = None
    if coarse is not None and any(w.position == "auto" for w in written):
        from airlight.detect import find_light

        found = find_light(coarse)
        if found is None:
            raise AirlightError(f"{picture.path}: no light found in the picture; give its place with --light X,Y")
        x, y = found.position
        click.echo(f"light at {x:.3f},{y:.3f} ({x * picture.width:.0f}px,{y * picture.height:.0f}px)", err=True)
    return [w.light(*found.position) if found and w.position == "auto" else place(w, picture, origin) for w in written]


def _write_data(path: str, values: "np.ndarray", overwrite: bool) -> None:
    """Numbers 0..1 as grey, code = value, with no transfer curve: as --mask reads them."""
    import numpy as np

    from airlight import files

    grey = np.repeat(np.clip(values, 0, 1)[..., None], 3, axis=2).astype(np.float32)
    files.write_image(path, grey, encoded=np.rint(grey * 255).astype(np.uint8), overwrite=overwrite)


class _Spent:
    """Wall time by step."""

    def __init__(self) -> None:
        self.steps: list[tuple[str, float]] = []
        self._last = time.perf_counter()

    def lap(self, name: str) -> None:
        now = time.perf_counter()
        if name:
            self.steps.append((name, (now - self._last) * 1e3))
        self._last = now


def _show_profile(spent: _Spent, passes: Sequence[tuple[str, float]]) -> None:
    for name, ms in spent.steps:
        click.echo(f"{name:24} {ms:9.2f} ms", err=True)
        if name == "render":
            for label, part in passes:
                click.echo(f"  {label:22} {part:9.2f} ms", err=True)
