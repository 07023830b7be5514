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

from airlight.cli import batch, doubts
from airlight.cli.finding import resolve_lights, show_candidates
from airlight.cli.light import AngleType, LightText, LightType, place
from airlight.cli.options import F, gather, given, parameter_options
from airlight.cli.settings import recall, record
from airlight.errors import AirlightError
from airlight.options import OF_SUM, Composite, Look, Parameters, build, chosen_look, presets
from airlight.scatter.methods import check_picture
from airlight.supervisor import say

if TYPE_CHECKING:
    import numpy as np

    from airlight.files import Picture


def _list(kind: str, ctx: click.Context, _: click.Parameter, wanted: bool) -> None:
    if wanted and not ctx.resilient_parsing:
        for name in presets.names(kind):
            click.echo(f"{name:16} {presets.description(name, kind)}")
        ctx.exit()


LIGHT, OCCLUSION, DEPTH, FILES = "Light", "Occlusion", "Depth", "Files"  # panels of the help
_option = functools.partial(click.option, cls=rich_click.RichOption)


def _file(name: str, short: str | None, panel: str, help: str, required: bool = False) -> Any:
    names = [name] if short is None else [short, name]
    return _option(*names, panel=panel, help=help, required=required, type=click.Path(), metavar="FILE")


def _choice(name: str, panel: str, values: Sequence[str], help: str) -> Any:
    return _option(name, panel=panel, help=help, type=click.Choice(values), default=values[0])


def _flag(name: str, short: str | None, panel: str | None, help: str) -> Any:
    names = [name] if short is None else [short, name]
    return _option(*names, panel=panel, help=help, is_flag=True)


def preset_options(command: F) -> F:
    """Decorator: the options that give others their values."""
    recalling = _option(
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
    preset = _option("--preset", panel="Presets", metavar="NAME|FILE.toml", help="Values to start from; options given here go before them.")
    return recalling(preset(_listing("--list-presets", presets.PRESETS, "Show the presets.")(command)))


def medium_options(command: F) -> F:
    """Decorator: the options that give a medium its values."""
    medium = _option(
        "--medium",
        panel="Presets",
        metavar="NAME|FILE.toml",
        help="What fills the air, over the preset's values; options given here go before them. Without --method it is lit by march.",
    )
    return medium(_listing("--list-media", presets.MEDIA, "Show the media.")(command))


def _listing(name: str, kind: str, help: str) -> Any:
    show = functools.partial(_list, kind)
    return _option(name, panel="Presets", is_flag=True, is_eager=True, expose_value=False, callback=show, help=help)


@click.command(cls=rich_click.RichCommand, context_settings={"show_default": True})
@click.argument("sources", metavar="IN...", type=click.Path(), nargs=-1, required=True)
@_file("--output", "-o", FILES, "The picture to write; the extension says the format. For many: a folder, or a pattern.")
@_option("--frames", panel=FILES, metavar="1-100x2", help="Frames of the pattern IN (shot.####.exr, shot.%04d.exr); else all there are.")
@_option(
    "--light",
    "written",
    panel=LIGHT,
    type=LightType(),
    multiple=True,
    default=("auto",),
    help="Where the light is: 0.4,0.3 or 960px,540px or 50%,20%, also outside the picture; auto finds it, auto:2 the next likely place, "
    'auto:3+ the best three together. May be repeated, with colour and strength: "0.4,0.2;color=1,0.8,0.6;strength=2".',
)
@_file("--candidates", None, LIGHT, "Show the places where the light may be, numbered on the picture; or write them to a .json file.")
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
@preset_options
@parameter_options
@_file("--mask", None, OCCLUSION, "An image of the same size; white emits.")
@_flag("--mask-invert", None, OCCLUSION, "Black emits instead.")
@_file("--depth", None, DEPTH, "An image of the same size, larger is farther: shafts pass behind what is near. With --occlusion depth what"
    " is far emits.")
@_option("--depth-layer", panel=DEPTH, metavar="NAME", help="The channel of the EXR IN that holds depths, as Z: instead of --depth.")
@_choice("--depth-near", DEPTH, ["black", "white"], "Which end of the depths is near: white for maps that hold inverse depths.")
@_option(
    "--near-range",
    panel=DEPTH,
    metavar="A,B",
    default="0.05,0.6",
    help="Of the depths, 0 the nearest and 1 the farthest: what is nearer than A hides shafts, nothing beyond B does.",
)
@_option("--depth-aware/--no-depth-aware", "depth_hides", panel=DEPTH, default=True, help="Whether depths hide shafts at all.")
@_file("--subject", None, DEPTH, "An image of the same size: shafts pass behind what is white; --wrap lets light round its edge.")
@_option("--subject-layer", panel=DEPTH, metavar="NAME", help="The channel of the EXR IN that holds such a mask: instead of --subject.")
@_option(
    "--input-layer",
    panel=FILES,
    metavar="NAME",
    help="The layer of an EXR to work on, rgba being R G B A. In an EXR output its own "
    "channels are replaced and R G B A stay; the shafts alone are in airlight.R/G/B, to be added where you like.",
)
@_option(
    "--colorspace",
    panel=FILES,
    metavar="NAME",
    help="The linear space that the floats of IN are in, kept in an EXR output: ACEScg, "
    "lin_rec709_scene, ACES2065-1 or another of $OCIO's or OpenColorIO's studio config. Unset: by the EXR's chromaticities, else Rec. 709.",
)
@_file("--layer", None, FILES, "Also write the shafts alone.")
@_file("--occlusion-fraction", None, FILES, "Also write how much of each ray is occluded: D of GPU Gems 3, ch. 13, Eq. 2 (white: all).")
@_option(
    "--debug",
    panel=FILES,
    type=click.Choice(["source", "mask", "fraction", "lines", "moments"]),
    help="Write a view instead of the picture: what emits; its mask; the occluded fraction; the epipolar lines; their steps and powers.",
)
@_flag("--overwrite", "-y", FILES, "Replace outputs that exist.")
@_flag("--skip-existing", "-n", FILES, "Leave out what exists.")
@_flag("--resume", None, FILES, "Do only what is missing or damaged.")
@_choice("--on-damage", FILES, ["error", "warn", "ignore"], "What to do with a damaged input.")
@_option("--device", metavar="NAME", help="Compute on the adapter whose name holds NAME; `airlight info` lists them.")
@_flag("--profile", None, None, "Show where the time goes.")
@click.pass_context
def image(
    ctx: click.Context,
    sources: Sequence[str],
    output: str | None,
    candidates: str | None,
    frames: str | None,
    origin: str,
    preset: str | None,
    mask: str | None,
    depth: str | None,
    subject: str | None,
    layer: str | None,
    occlusion_fraction: str | None,
    debug: str | None,
    overwrite: bool,
    skip_existing: bool,
    resume: bool,
    device: str | None,
    profile: bool,
    **_: Any,
) -> int:
    """Add light shafts to the picture IN, or to many: files, or a numbered sequence such as shot.####.exr."""
    if overwrite + skip_existing + resume > 1:
        raise AirlightError("-y/--overwrite, -n/--skip-existing and --resume exclude each other; give one")
    lights = asked_lights(ctx)
    if candidates is not None and output is None:
        for option, value in (("--layer", layer), ("--occlusion-fraction", occlusion_fraction), ("--debug", debug)):
            if value is not None:
                raise AirlightError(f"{option} goes with a picture that is written: add -o FILE")
        show_candidates(sources, candidates, ctx.params)
        return 0
    if output is None:
        raise AirlightError("no output is named: add -o FILE, or --candidates FILE to see where the light may be")
    if occlusion_fraction is not None and len(lights) > 1:
        raise AirlightError("--occlusion-fraction belongs to one light; give one --light or --angle")
    if debug is not None and (layer is not None or occlusion_fraction is not None):
        raise AirlightError("--debug writes its view to -o and nothing else; leave --layer and --occlusion-fraction out")
    values = asked(ctx)
    built = build(values)
    sum_by = next((name for name, value in (("--debug", debug), ("--occlusion-fraction", occlusion_fraction)) if value is not None), "")
    chosen = chosen_look(values, values.get("look"), "--angle" if any(light.angle is not None for light in lights) else sum_by)
    _check_depths(ctx, chosen, values)

    todo, sequence = batch.tasks(sources, output, layer, occlusion_fraction, mask, depth, subject, frames)
    many = len(todo) > 1 or sequence
    todo, done = _left(todo, skip_existing, resume)
    for task in todo:
        _check_outputs(task.outputs, [task.source, task.mask, task.depth, task.subject, preset], many or overwrite or resume)
    if many:
        _refuse_existing(todo, overwrite or resume)
    if candidates is not None:
        if os.path.realpath(candidates) in {os.path.realpath(path) for task in todo for path in task.outputs}:
            raise AirlightError(f"{candidates}: is named for two outputs; give each a name of its own")
        show_candidates(sources, candidates, ctx.params)
    if not todo:
        return 0
    if ctx.get_parameter_source("written") is click.core.ParameterSource.DEFAULT_MAP:
        say("the light is that of the settings; --light auto finds each picture's own", prefix="")
    work = _Work(
        written=lights,
        origin=origin,
        parameters=built[Parameters],
        composite=built[Composite],
        look=built[Look] if chosen == "smart" else None,
        many=many,
        ctx=ctx,
        values=values,
        debug=debug,
        overwrite=overwrite or resume,
        device=device,
        passes=[] if profile else None,
    )
    if many:
        failed = batch.run(_with_first(todo, done), work.read, work.render, work.write)
        click.echo(f"{len(todo) - sum(task.wanted for task, _ in failed)} of {len(todo)} pictures written", err=True)
    else:
        failed = []
        loaded = work.read(todo[0])
        work.write(todo[0], loaded, work.render(todo[0], loaded))
    if profile:
        _show_profile(work.spent, work.passes or [])
    return 2 if failed else 0


def _left(todo: Sequence[batch.W], skip_existing: bool, resume: bool) -> tuple[list[batch.W], list[batch.W]]:
    """The tasks in two: what is to be done, and those whose outputs exist (skip_existing), or exist and can be read (resume)."""
    if not skip_existing and not resume:
        return list(todo), []
    from airlight import files

    def fine(path: str) -> bool:
        if skip_existing or not os.path.lexists(path):
            return os.path.lexists(path)
        try:
            files.read_image(path, "error")
        except AirlightError:
            return False
        return True

    left: list[batch.W] = []
    done: list[batch.W] = []
    for task in todo:
        (done if all(fine(path) for path in task.outputs) else left).append(task)
    if done:
        what = f"{todo[0].output} exists" if len(todo) == 1 else f"{len(done)} of {len(todo)} exist"
        click.echo(f"{what}: skipped", err=True)
    return left, done


def _with_first(todo: list[batch.Task], done: list[batch.Task]) -> list[batch.Task]:
    """What is to be done, with the first of each sequence's frames that are done in its place: what it settled holds for the rest."""
    going = {task.clip for task in todo} - {None}
    firsts = {task.clip: dataclasses.replace(task, wanted=False) for task in reversed(done) if task.clip in going}
    return sorted([*todo, *firsts.values()], key=lambda task: task.number)


def _refuse_existing(todo: Sequence[batch.Writes], overwrite: bool) -> None:
    there = [] if overwrite else [path for task in todo for path in task.outputs if os.path.lexists(path)]
    if there:
        more = f", as do {len(there) - 1} more" if len(there) > 1 else ""
        raise AirlightError(
            f"{there[0]}: exists already{more}; pass -y/--overwrite to replace them, -n to leave them out,"
            " or --resume to do what is missing or damaged"
        )


@dataclasses.dataclass
class _Loaded:
    picture: "Picture"
    emits: "np.ndarray | None"
    far: "np.ndarray | None"
    subject: "np.ndarray | None"


@dataclasses.dataclass
class _Work:
    """What the options ask for of every picture: to be read, rendered, written, each perhaps by another thread.

    Frames of one sequence take their light, threshold, mix and adaptation from its first, lest they flicker.
    """

    written: Sequence[LightText]
    origin: str
    parameters: Any
    composite: Any
    look: Any  # None: classic
    many: bool  # pictures
    ctx: click.Context
    values: dict[str, Any]  # what the options and the preset say
    debug: str | None
    overwrite: bool
    device: str | None
    passes: list[tuple[str, float]] | None = None

    def __post_init__(self) -> None:
        self.spent = _Spent()
        self._start = threading.Thread(target=_open_device, args=(self.device,), daemon=True)
        self._start.start()  # while the first picture is read
        self._where: Any = None
        # By clip, (lights, parameters, what was measured) of the first frame, the lights in the display window.
        self._kept: dict[int, tuple[list[LightText], Any, Any]] = {}

    def read(self, task: batch.Task) -> _Loaded:
        from airlight import files

        begun = time.perf_counter()
        o = self.ctx.params
        picture = files.read_image(task.source, o["on_damage"], o["input_layer"], o["colorspace"])
        emits, far = read_planes(task.mask, task.depth, o, picture)
        subject = read_subject(task.subject, o, picture)
        self.spent.add("read", begun)
        return _Loaded(picture, emits, far, subject)

    def render(self, task: batch.Task, loaded: _Loaded) -> Any:
        """(what `api.render_picture` gives, the occlusion fraction or None, the settings), or the view that --debug asks for; None
        where nothing is wanted."""
        from airlight import api
        from airlight.occlusion.automatic import check

        kept = None if task.clip is None else self._kept.get(task.clip)
        if not task.wanted and kept is not None:
            return None
        self._start.join()
        if self._where is None:
            self._where = _renderer(self.device)
        picture = loaded.picture
        check(self.parameters, picture.alpha is not None, loaded.far is not None)
        begun = time.perf_counter()
        written, parameters, held = kept or self._settled(picture)
        lights = [place(light, picture) for light in written]
        doubts.tell_far_away(self.written, written)
        begun = self.spent.add("find the light", begun)
        if self.debug is not None:
            from airlight.debug import view

            if task.clip is not None:
                self._kept[task.clip] = written, parameters, None
            tell = functools.partial(say, prefix="")
            return view(self.debug, picture, lights, parameters, loaded.emits, loaded.far, self._where, tell)
        real = _is_float(task.output, picture)
        options: dict[str, Any] = {
            "mask": loaded.emits,
            "device": self._where,
            "profile": self.passes,
            "float_output": real,
            "codes_only": task.layer is None and picture.bits == 8 and not real,
        }
        if self.look is not None or not lights:
            options |= {"subject": loaded.subject, "depth": loaded.far if self.ctx.params["depth_hides"] else None, "held": held}
            options |= {"near_range": _near_range(self.ctx.params["near_range"]), "quality": self.parameters.quality}
            done = api.render_look(picture, lights, self.look or Look(), **options)
        else:
            done = api.render_picture(picture, lights, parameters, held or self.composite, depth=loaded.far, **options)
        if lights and kept is None:
            doubts.tell_unchanged(picture, done, self.look, parameters, self.written, real)
        alone = not lights or not getattr(done.held, "changes", True)
        if task.clip is not None and kept is None and alone:
            say(f"{picture.path}: its clip follows it, and is left as it is too; begin --frames later to change that", prefix="")
        if task.clip is not None:
            self._kept[task.clip] = written, parameters, done.held
        fraction = None
        if task.fraction is not None and lights:
            keys = {name: getattr(parameters, name) for name in parameters.__struct_fields__}
            image, alpha = picture.rec709(picture.linear()), picture.alpha
            fraction = api.occlusion_fraction(
                image, lights[0], alpha=alpha, depth=loaded.far, mask=loaded.emits, device=self._where, **keys
            )
        self.spent.add("render", begun)
        chosen = "classic" if self.look is None else "smart"
        return done, fraction, record(self.ctx, self.values, written, self.ctx.params["preset"], look=chosen)

    def _settled(self, picture: "Picture") -> Any:
        from airlight.occlusion.automatic import settled

        integer = picture.codes.dtype.kind == "u"
        settles = self.look is None and (integer or self.composite.adapt > 0)
        searched = any(w.searched for w in self.written)
        coarse = picture.rec709(picture.linear(coarse=True)) if settles or searched else None
        written = resolve_lights(self.written, picture, self.origin if given(self.ctx, "written") else "top", coarse, self.many)
        if not settles or coarse is None:
            return written, self.parameters, None
        return written, settled(self.parameters, coarse, [place(light, picture) for light in written], bounded=integer), None

    def write(self, task: batch.Task, loaded: _Loaded, rendered: Any) -> None:
        from airlight import files

        if not task.wanted:
            return
        begun, picture = time.perf_counter(), loaded.picture
        bare = dataclasses.replace(
            picture, codes=picture.colour_codes, alpha=None, associated=False, extra=None, extra_names=(), extra_formats=(), layer=""
        )
        if self.debug is not None:
            if rendered.ndim == 2:
                _write_data(task.output, rendered, self.overwrite, "")
            else:
                files.write_image(task.output, rendered, bare, overwrite=self.overwrite)
            return
        done, fraction, settings = rendered
        beside = done.layer if task.output.lower().endswith(".exr") else None
        files.write_image(
            task.output,
            done.pixels,
            picture,
            changed=done.changed,
            layer=beside,
            overwrite=self.overwrite,
            encoded=done.encoded,
            settings=settings,
        )
        if task.layer is not None:
            files.write_image(task.layer, done.layer, bare, overwrite=self.overwrite, settings=settings)
        if task.fraction is not None and fraction is not None:
            _write_data(task.fraction, fraction, self.overwrite, settings)
        self.spent.add("write", begun)


def _renderer(device: str | None) -> Any:
    """A renderer to keep; without an adapter what makes the API say so and go on without."""
    from airlight import MachineError, Renderer

    try:
        return Renderer(device, keep=1)
    except MachineError:
        return device


def asked(ctx: click.Context, sums: bool = False) -> dict[str, Any]:
    """The values that differ from the defaults, by preset and options; refuses options that need others. sums: there are no looks."""
    o = ctx.params
    if o["mask_invert"] and o["mask"] is None:
        raise AirlightError("--mask-invert inverts the image of --mask; give both")
    values = gather(ctx, o["preset"])
    check_picture(values.get("method", ""))
    has_depth = o["depth"] is not None or o.get("depth_layer") is not None
    if has_depth and (sums or values.get("look") == "classic" or (values.get("look") is None and OF_SUM & values.keys())):
        values.setdefault("occlusion", "depth")  # what else would the sum be given it for?
    elif values.get("occlusion") == "depth" and not has_depth:
        raise AirlightError("the occlusion 'depth' needs an image of depths; add --depth FILE")
    if given(ctx, "depth_near") and not has_depth:
        raise AirlightError("--depth-near describes the image of --depth; give both")
    return values


def _check_depths(ctx: click.Context, look: str, values: dict[str, Any]) -> None:
    """Refuse options of depths and subjects that would have no effect."""
    o = ctx.params
    for file, layer in (("depth", "depth_layer"), ("subject", "subject_layer")):
        if o[file] is not None and o[layer] is not None:
            raise AirlightError(f"--{file} and --{layer.replace('_', '-')} say the same thing; give one")
    has_depth = o["depth"] is not None or o["depth_layer"] is not None
    has_subject = o["subject"] is not None or o["subject_layer"] is not None
    for name, option in (("near_range", "near-range"), ("depth_hides", "depth-aware")):
        if given(ctx, name) and (not has_depth or look == "classic"):
            raise AirlightError(f"--{option} goes with depths that hide shafts: add --depth FILE, and leave the classic look")
    if has_subject and look == "classic":
        raise AirlightError("--subject is for the smart look: leave out what asks for the classic one")
    if values.get("wrap") and not has_subject:
        raise AirlightError("--wrap goes with the mask of a subject: add --subject FILE")
    _near_range(o["near_range"])


def _near_range(text: str) -> tuple[float, float]:
    from airlight.look.near import check_range

    try:
        return check_range(text.split(","))
    except AirlightError:
        raise AirlightError(f"--near-range {text}: write two numbers, the first the smaller, as in 0.05,0.6") from None


def asked_lights(ctx: click.Context) -> list[LightText]:
    """What --light and --angle say; without --light an angle stands alone."""
    written, angles = ctx.params["written"], ctx.params["angles"]
    alone = angles and ctx.get_parameter_source("written") is click.core.ParameterSource.DEFAULT
    return [*(() if alone else written), *angles]


def read_planes(
    mask: str | None, depth: str | None, options: dict[str, Any], picture: "Picture"
) -> "tuple[np.ndarray | None, np.ndarray | None]":
    """The images of --mask (white emits) and --depth (larger is farther), this perhaps of a channel of the picture."""
    from airlight import files

    emits = None if mask is None else files.read_mask(mask, options["on_damage"])
    if emits is not None and options["mask_invert"]:
        emits = 1 - emits
    far = None if depth is None else files.read_mask(depth, options["on_damage"], depth=True)
    if options.get("depth_layer") is not None:
        far = picture.channel(options["depth_layer"])
    if far is not None and options["depth_near"] == "white":
        far = (far.max() if far.max() > 1 else 1) - far
    return emits, far


def read_subject(subject: str | None, options: dict[str, Any], picture: "Picture") -> "np.ndarray | None":
    """The image of --subject, or the picture's channel of --subject-layer: white hides shafts."""
    from airlight import files

    if options["subject_layer"] is not None:
        return picture.channel(options["subject_layer"])
    return None if subject is None else files.read_mask(subject, options["on_damage"])


def _open_device(name: str | None) -> None:
    """Whatever is wrong is told when the device is used."""
    from airlight.gpu.device import open_device

    with contextlib.suppress(Exception):
        open_device(name)


def _is_float(path: str, picture: "Picture") -> bool:
    """Whether the output holds floats: EXR, HDR, and a TIFF made from floats."""
    return path.lower().endswith((".exr", ".hdr")) or (path.lower().endswith((".tif", ".tiff")) and picture.bits == 32)


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


def _write_data(path: str, values: "np.ndarray", overwrite: bool, settings: str) -> None:
    """Numbers 0..1 as grey, code = value, with no transfer curve: as --mask reads them."""
    import numpy as np

    from airlight import files

    grey = np.repeat(np.clip(values, 0, 1)[..., None], 3, axis=2).astype(np.float32)
    files.write_image(path, grey, encoded=np.rint(grey * 255).astype(np.uint8), overwrite=overwrite, settings=settings)


class _Spent:
    """Wall time by step, summed over the pictures."""

    def __init__(self) -> None:
        self.steps: dict[str, float] = {}

    def add(self, name: str, begun: float) -> float:
        """Count the time since `begun`; returns now."""
        now = time.perf_counter()
        self.steps[name] = self.steps.get(name, 0.0) + (now - begun) * 1e3
        return now


def _show_profile(spent: _Spent, passes: Sequence[tuple[str, float]]) -> None:
    """Wall time of each step, and of each pass on the GPU, summed over the pictures."""
    by_label: dict[str, float] = {}
    for label, ms in passes:
        by_label[label] = by_label.get(label, 0.0) + ms
    for name in ("read", "find the light", "render", "write"):
        click.echo(f"{name:24} {spent.steps.get(name, 0.0):9.2f} ms", err=True)
        if name == "render":
            for label, ms in by_label.items():
                click.echo(f"  {label:22} {ms:9.2f} ms", err=True)
