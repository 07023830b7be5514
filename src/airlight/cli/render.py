"""`airlight render`: frames and films of 3-D scenes."""

import contextlib
import dataclasses
import math
import os
from collections.abc import Callable, Iterator, Sequence
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import click
import rich_click

from airlight.cli import batch
from airlight.cli import image as pictures
from airlight.cli.image import FILES, LIGHT, _file, _flag, _option, medium_options, preset_options
from airlight.cli.light import split_light
from airlight.cli.options import check_given, gather, given, scene_options
from airlight.cli.settings import record
from airlight.errors import AirlightError, MachineError
from airlight.options import NOT_IN_SCENES, Composite, March, Medium, Parameters, SceneOptions, build, presets, refuse_look
from airlight.scatter.methods import METHODS

if TYPE_CHECKING:
    from airlight.medium import Settled
    from airlight.pygfx import SceneLight
    from airlight.scenes import Stage
    from airlight.scenes.offline import Frame, Shot

CAMERA, TIME = "Camera", "Time"  # panels of the help
SAMPLES = {"draft": 1, "normal": 2, "final": 3}  # along each side of a pixel
LARGEST = 2**27  # samples of a frame: 3.8 GB in the renderer
SUN_SIZE = 1.0  # degrees: half angle of the disc of a light that no lamp of the scene stands for
MOST_FRAMES = 1_000_000


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


def numbers(text: str, form: str) -> tuple[float, ...]:
    """`1,2,0.5` as numbers, as many as the form (`x,y,z`) has. Raises AirlightError."""
    try:
        found = tuple(float(part) for part in str(text).split(","))
    except ValueError:
        found = ()
    if len(found) != form.count(",") + 1 or not all(math.isfinite(v) and abs(v) <= 1e9 for v in found):
        raise AirlightError(f"cannot read {text!r}: write {form} as numbers, as in {','.join(['0', '1.5', '-2'][: form.count(',') + 1])}")
    return found


def triple(text: str) -> tuple[float, float, float]:
    """`x,y,z` as numbers."""
    x, y, z = numbers(text, PLACE)
    return x, y, z


class SceneLightType(click.ParamType):
    """A light of a scene, kept as it was written."""

    def __init__(self, form: str) -> None:
        self.name = form

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        try:
            _light_numbers(value, self.name)
        except AirlightError as error:
            self.fail(str(error), param, ctx)
        return str(value)


PLACE, SUN = "x,y,z", "azimuth,elevation"


def _light_numbers(text: str, form: str) -> tuple[tuple[float, ...], dict[str, Any]]:
    from airlight.lights import Light

    place, known = split_light(text, form.upper())
    Light((0, 0), **known)  # raises for these
    at = numbers(place, form)
    if form == SUN and abs(at[1]) > 90:
        raise AirlightError(f"the elevation of the sun {text!r} is beyond 90 degrees: write azimuth,elevation, as in 90,20")
    return at, known


def read_scene_light(text: str, form: str) -> "SceneLight":
    """`x,y,z` or `azimuth,elevation` (0 is -Z, clockwise from above: 90 is +X), with `;color=R,G,B;strength=S`."""
    from airlight.pygfx import SceneLight

    at, known = _light_numbers(text, form)
    if form == PLACE:
        return SceneLight(position=(at[0], at[1], at[2]), size=SUN_SIZE, **known)
    turn, up = (math.radians(v) for v in at)
    direction = (math.sin(turn) * math.cos(up), math.sin(up), -math.cos(turn) * math.cos(up))
    return SceneLight(direction=direction, size=SUN_SIZE, **known)


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


@dataclasses.dataclass(frozen=True)
class Task:
    """One frame: its files, and when and from where it is seen. turn: parts of a full turn."""

    number: int
    output: str
    layer: str | None
    buffer: str | None
    time: float
    turn: float

    @property
    def outputs(self) -> list[str]:
        return [path for path in (self.output, self.layer, self.buffer) if path is not None]


@click.command(cls=rich_click.RichCommand, context_settings={"show_default": True})
@click.argument("scene", metavar="SCENE")
@_file("--output", "-o", FILES, "What to write: a picture, numbered pictures (shot.####.png), or a film (.mp4).", required=True)
@_option("--camera", panel=CAMERA, metavar="NAME", help="One of the scene's cameras; unset: its first.")
@_option("--eye", panel=CAMERA, type=_Numbers(PLACE), help="Look from here instead, metres.")
@_option("--target", panel=CAMERA, type=_Numbers(PLACE), help="With --eye: look at this; unset: the scene's centre.")
@_option("--fov", panel=CAMERA, type=click.FloatRange(1, 170), default=50.0, help="With --eye: degrees, of the picture's smaller side.")
@_option("--width", panel=CAMERA, type=click.IntRange(1, 16384), default=1280, help="Pixels.")
@_option("--height", panel=CAMERA, type=click.IntRange(1, 16384), help="Pixels; unset: 9/16 of the width.")
@_flag("--no-antialias", None, CAMERA, "One sample at each pixel's centre, whatever the quality: for comparisons.")
@_option("--turn", panel=CAMERA, type=click.FloatRange(-1e6, 1e6), default=0.0, help="Degrees by which the camera goes around the centre.")
@_option("--turntable", panel=TIME, metavar="N", type=click.IntRange(1, MOST_FRAMES), help="A full turn around the centre in N frames.")
@_option("--time", panel=TIME, type=click.FloatRange(0, 1e6), default=0.0, help="Seconds of the scene's animation, at frame 1.")
@_option("--frames", panel=TIME, metavar="1-100x2", help="Frames to render; unset: the turn, or the whole animation.")
@_option("--seed", panel=TIME, type=click.IntRange(0, 2**31 - 1), help="Of flying: another path.")
@_flag("--draw-path", None, TIME, "Draw the path that something of the scene flies along.")
@_option("--fps", panel=TIME, type=_Fps(), default="24", help="Frames a second: frame k is at (k - 1) / fps.")
@_option(
    "--light",
    panel=LIGHT,
    type=SceneLightType(PLACE),
    multiple=True,
    help='Where the light is instead, metres: "0,2,-3;color=1,0.8,0.6;strength=2". It moves a lamp of the scene where one casts shafts.'
    " May be repeated.",
)
@_option(
    "--sun",
    panel=LIGHT,
    type=SceneLightType(SUN),
    multiple=True,
    help="A sun instead: degrees, azimuth 0 at -Z and 90 at +X, elevation above the horizon; colour and strength as --light.",
)
@_option("--environment", panel=LIGHT, metavar="NAME|FILE", help="Surroundings of a file: sunrise, sky, none, or an .exr or .hdr file.")
@_option("--exclude", panel=LIGHT, multiple=True, metavar="NAME", help="An object that hides no light; with --occluders prepass.")
@preset_options
@medium_options
@scene_options
@_file(
    "--layer",
    None,
    FILES,
    "Also write the shafts alone, linear; EXR holds transmittance and Z of a medium too, and an EXR output all of it.",
)
@_file("--occlusion-buffer", None, FILES, "Also write the source of the shafts: what emits light, black where it is hidden.")
@_option("--crf", panel=FILES, type=click.FloatRange(0, 51), default=18.0, help="Of a film: x264's quality, 0 is lossless.")
@_flag("--overwrite", "-y", FILES, "Replace outputs that exist.")
@_flag("--skip-existing", "-n", FILES, "Leave out what exists.")
@_flag("--resume", None, FILES, "Do only the frames that are missing or damaged.")
@_option("--device", metavar="NAME", help="Compute on the adapter whose name holds NAME; `airlight info` lists them.")
@click.pass_context
def render(
    ctx: click.Context,
    scene: str,
    output: str,
    environment: str | None,
    exclude: Sequence[str],
    layer: str | None,
    occlusion_buffer: str | None,
    preset: str | None,
    medium: str | None,
    overwrite: bool,
    skip_existing: bool,
    resume: bool,
    device: str | None,
    **_: Any,
) -> int:
    """Render SCENE (table, flying, or a .glb or .gltf file) with its light shafts: a picture, numbered pictures, or a film.

    The quality is that of the shafts, and of the picture: draft, normal and final take 1, 4 and 9 samples a pixel.
    """
    from airlight.files import video

    if overwrite + skip_existing + resume > 1:
        raise AirlightError("-y/--overwrite, -n/--skip-existing and --resume exclude each other; give one")
    is_film = video.is_film(output)
    if is_film and (layer is not None or occlusion_buffer is not None):
        raise AirlightError("--layer and --occlusion-buffer go with pictures, not with a film; render numbered frames")
    if is_film and resume:
        raise AirlightError("--resume goes with numbered frames: a film is written in one run")
    if given(ctx, "turntable") and given(ctx, "turn"):
        raise AirlightError("--turn and --turntable exclude each other; give one")
    gathered = gather(ctx, preset, medium)
    refuse_look(gathered, "a scene")
    values = {name: value for name, value in gathered.items() if name not in NOT_IN_SCENES}
    quality = build(values)[Parameters].quality
    check_camera(ctx)
    size = _size(ctx, quality)
    if is_film:
        if skip_existing and os.path.lexists(output):
            click.echo(f"{output} exists: skipped", err=True)
            return 0
        video.check_film(output, size[0], size[1], overwrite)

    with needing_scenes():
        from airlight.gpu.device import shared_device
        from airlight.medium import settle
        from airlight.scenes import offline, open_scene
    inputs = [path for path in (scene, preset, medium, environment) if path is not None]
    stage, all = None, _tasks(ctx, 0.0)
    if not all:  # as many as the animation has
        shared_device(device)
        stage = open_scene(scene, environment, ctx.params["seed"])
        all = _tasks(ctx, stage.duration)
        if not all:
            raise AirlightError(f"{stage.name}: has no animation to film; give --turntable N or --frames")
    todo = all if is_film else _left(ctx, all, inputs)
    if not todo:
        return 0
    if stage is None:
        shared_device(device)
        stage = open_scene(scene, environment, ctx.params["seed"])
    if ctx.params["draw_path"]:
        if stage.path is None:
            raise AirlightError(f"{stage.name}: nothing in it flies along a path; leave --draw-path out")
        stage.path.visible = True
    built = build(stage.settings | values)
    parameters = built[Parameters]
    in_world = METHODS[parameters.method].lights_medium
    check_given(ctx, parameters.method, _chooser(ctx, values, stage))
    if exclude and built[SceneOptions].occluders != "prepass" and not in_world:
        raise AirlightError("--exclude goes with --occluders prepass, which draws the occluders by themselves, or with --method march")
    if occlusion_buffer is not None and in_world:
        raise AirlightError(f"--occlusion-buffer goes with methods that work on the picture: with {parameters.method} give --layer")
    shot = asked_shot(ctx, size, parameters.quality == "draft" and not ctx.params["no_antialias"], ctx.params["light"])
    studio = offline.Studio(
        stage,
        shot,
        parameters,
        built[Composite],
        built[SceneOptions],
        medium=built[Medium],
        march=built[March],
        exclude=exclude,
        linear=_is_linear(output),
    )
    if METHODS[parameters.method].has_units:
        _doubt(stage, shot, settle(built[Medium], built[March], parameters.quality, stage.radius))
    work = _Work(ctx, studio, values, overwrite or resume)
    if is_film:
        settings = record(ctx, values, [], preset, None, stage.settings)
        with video.film(output, shot.width, shot.height, ctx.params["fps"], ctx.params["crf"], overwrite, settings) as add:
            work.add = add
            batch.run(todo, work.read, _strict(work.render), _strict(work.write))
        return 0
    if not _is_sequence(ctx):
        work.write(todo[0], None, work.render(todo[0], None))
        return 0
    failed = batch.run(todo, work.read, work.render, work.write)
    click.echo(f"{len(todo) - len(failed)} of {len(todo)} pictures written", err=True)
    return 2 if failed else 0


def _chooser(ctx: click.Context, values: dict[str, Any], stage: "Stage") -> str:
    """What chose the method, in words; nothing where the user did, or nobody."""
    preset, medium = ctx.params["preset"], ctx.params["medium"]
    if given(ctx, "method"):
        return ""
    if medium is not None:
        return f"--medium {medium}"
    if "method" in values:
        return f"--preset {preset}" if preset is not None and "method" in presets.load(preset) else "--settings-from"
    return f"the scene {stage.name}" if "method" in stage.settings else ""


@contextlib.contextmanager
def needing_scenes() -> Iterator[None]:
    """An import that fails within says what to install."""
    try:
        yield
    except ImportError as error:
        raise AirlightError(f"3-D scenes need an extra ({error.name} is missing): pip install airlight[scenes]") from None


def check_camera(ctx: click.Context) -> None:
    """Raise AirlightError for options of the camera that exclude each other."""
    if ctx.params["eye"] is None and (given(ctx, "target") or given(ctx, "fov")):
        raise AirlightError("--target and --fov go with --eye x,y,z; give it too")
    if ctx.params["eye"] is not None and ctx.params["camera"] is not None:
        raise AirlightError("--camera and --eye exclude each other; give one")


def _is_linear(path: str) -> bool:
    """Whether a file holds light, not what a display shows of it."""
    return path.lower().endswith((".exr", ".hdr"))


def _is_sequence(ctx: click.Context) -> bool:
    from airlight.files.sequence import numbered

    return numbered(ctx.params["output"]) is not None


def picture_size(ctx: click.Context) -> tuple[int, int]:
    """Width and height, pixels."""
    width: int = ctx.params["width"]
    return width, ctx.params["height"] or max(2, 2 * round(width * 9 / 32))


def _size(ctx: click.Context, quality: str) -> tuple[int, int, int]:
    """Width, height, and samples along a side of a pixel."""
    o = ctx.params
    width, height = picture_size(ctx)
    samples = 1 if o["no_antialias"] else SAMPLES[quality]
    if width * height * samples**2 > LARGEST:
        raise AirlightError(f"{width}x{height} with {samples**2} samples a pixel is too large; make it smaller, or use --quality draft")
    return width, height, samples


def asked_shot(ctx: click.Context, size: tuple[int, int, int], smooth: bool, places: Sequence[str]) -> "Shot":
    """size: width, height, samples along a side of a pixel; places: of lights, as written."""
    from airlight.scenes.offline import Shot

    o = ctx.params
    eye, target = (None if o[name] is None else triple(o[name]) for name in ("eye", "target"))
    lights = [read_scene_light(text, PLACE) for text in places] + [read_scene_light(text, SUN) for text in o["sun"]]
    return Shot(*size, smooth, o["camera"], eye, target, o["fov"], tuple(lights))


def _doubt(stage: "Stage", shot: "Shot", air: "Settled") -> None:
    """Warn of a medium that hides the scene or cannot be seen."""
    import numpy as np

    from airlight.files.decode import tell
    from airlight.medium import doubt

    camera = stage.cameras.get(shot.camera or "", next(iter(stage.cameras.values())))
    eye = camera.world.position if shot.eye is None else shot.eye
    said = doubt(air, float(np.linalg.norm(np.asarray(eye) - stage.center)), stage.radius)
    if said is not None:
        tell(said)


def _tasks(ctx: click.Context, duration: float) -> list[Task]:
    """The frames. duration: seconds of the scene's animation; for a whole animation of 0 there are none."""
    from airlight.files import video
    from airlight.files.sequence import frames, numbered

    o = ctx.params
    output, fps, turntable = o["output"], o["fps"], o["turntable"]
    several = video.is_film(output) or _is_sequence(ctx)
    if o["frames"] is not None:
        chosen = frames(o["frames"])
    elif turntable is not None:
        chosen = list(range(1, turntable + 1))
    elif several:
        last = math.ceil(min(duration, MOST_FRAMES / float(fps)) * float(fps) - 1e-6)
        chosen = list(range(1, last + 1))
    else:
        chosen = [1]
    if len(chosen) > 1 and not several:
        raise AirlightError(f"{output}: {len(chosen)} frames do not go into one picture; name a pattern, as in shot.####.png, or a .mp4")

    def place(path: str | None, number: int) -> str | None:
        pattern = None if path is None else numbered(path)
        if path is not None and pattern is None and several:
            raise AirlightError(f"{path}: {len(chosen)} pictures do not go into one file; name a pattern such as layer.####.exr")
        return path if pattern is None else pattern.frame(number)

    found = []
    for number in chosen:
        ahead = 0.0 if turntable is not None else float((number - 1) / fps)
        if o["time"] + ahead < 0:
            raise AirlightError(f"frame {number} lies before the animation's start: frame 1 is at --time; give later --frames")
        turn = (number - 1) % turntable / turntable if turntable is not None else o["turn"] / 360
        name = output if video.is_film(output) else place(output, number) or output
        layer, buffer = place(o["layer"], number), place(o["occlusion_buffer"], number)
        found.append(Task(number, name, layer, buffer, o["time"] + ahead, turn))
    return found


def _left(ctx: click.Context, all: Sequence[Task], inputs: Sequence[str]) -> list[Task]:
    """The pictures that are not done yet. Raises AirlightError for outputs that cannot be written."""
    o = ctx.params
    overwrite = o["overwrite"] or o["resume"]
    todo, _ = pictures._left(all, o["skip_existing"], o["resume"])
    for task in todo:
        pictures._check_outputs(task.outputs, inputs, len(all) > 1 or overwrite)
    if len(all) > 1:
        pictures._refuse_existing(todo, overwrite)
    return todo


@dataclasses.dataclass
class _Work:
    """Rendering and writing a frame, the second perhaps by another thread."""

    ctx: click.Context
    studio: Any
    values: dict[str, Any]
    overwrite: bool
    add: Callable[[Any], None] | None = None  # to a film

    def read(self, task: Task) -> None:
        """Nothing: a scene is read once."""

    def render(self, task: Task, _: None) -> "Frame":
        exr = any(path is not None and path.lower().endswith(".exr") for path in (task.output, task.layer))
        found: Frame = self.studio.frame(
            task.time, task.turn, depth=exr, layer=exr or task.layer is not None, source=task.buffer is not None
        )
        return found

    def write(self, task: Task, _: None, frame: "Frame") -> None:
        import numpy as np

        from airlight import files
        from airlight.colour import encode_codes

        pixels = frame.pixels()
        if self.add is not None:
            self.add(encode_codes(pixels, np.uint8))
            return
        once = {"time": task.time, "turn": task.turn * 360, "turntable": None, "frames": None, "fps": None, "crf": None}
        settings = record(self.ctx, self.values, [], self.ctx.params["preset"], once, self.studio.stage.settings)
        layer = frame.shafts() if frame.layer is not None else None
        exr, layer_exr = (path is not None and path.lower().endswith(".exr") for path in (task.output, task.layer))
        air: dict[str, Any] = {"transmittance": frame.transmittance(), "z": frame.distance()} if exr or layer_exr else {}
        beside: dict[str, Any] = {}
        if exr:
            beside = {"alpha": np.ones(pixels.shape[:2], np.float32), "layer": layer, **air}
        files.write_image(task.output, pixels, overwrite=self.overwrite, settings=settings, **beside)
        if task.layer is not None:
            more = {"bits": 32, **air} if frame.layer_transmittance is not None and layer_exr else {}
            files.write_image(task.layer, layer, overwrite=self.overwrite, settings=settings, **more)
        if task.buffer is not None and frame.source is not None:
            files.write_image(task.buffer, frame.source[..., :3].astype(np.float32), overwrite=self.overwrite, settings=settings)


def _strict(work: Callable[..., Any]) -> Callable[..., Any]:
    """Work of which any failure ends the run: a film lacks no frame."""

    def done(*arguments: Any) -> Any:
        try:
            return work(*arguments)
        except MachineError:
            raise
        except AirlightError as error:
            raise MachineError(str(error)) from error

    return done
