"""Renders frames and films of 3-D scenes: what `airlight render` asks for."""

import contextlib
import dataclasses
import math
import os
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import TYPE_CHECKING, Any

from airlight.errors import AirlightError, AirlightWarning
from airlight.jobs import tasks
from airlight.jobs.frame_work import OPEN, SET_UP, FrameWork, strict
from airlight.jobs.idle_options import chooser_of, refuse_idle_options, tell_idle_in_daylight
from airlight.jobs.light_text import PLACE, SUN, read_scene_light, triple
from airlight.jobs.profile import Spent
from airlight.jobs.run import run
from airlight.jobs.settings import Settings
from airlight.jobs.tasks import FrameTask
from airlight.jobs.verdict import OfScene
from airlight.messages import say
from airlight.options import (
    NOT_IN_SCENES,
    Composite,
    Daylight,
    DaylightScene,
    March,
    Medium,
    Parameters,
    SceneOptions,
    build,
    refuse_look,
    settled_method,
)
from airlight.options.storage import Storage
from airlight.process import standard
from airlight.progress import SILENT, Work, showing
from airlight.scatter.methods import AUTO, METHODS

if TYPE_CHECKING:
    from airlight.scenes import Stage
    from airlight.scenes.offline import Shot

SAMPLES = {"draft": 1, "normal": 2, "final": 3}  # along each side of a pixel
LARGEST = 2**27  # samples of a frame: 3.8 GB in the renderer
MOST_FRAMES = 1_000_000
# Options beside the declared parameters that shape the result.
SHAPING: tuple[str, ...] = ("scene", "camera", "eye", "target", "fov", "environment", "up", "width", "height", "no_antialias")
LISTS = ("light", "sun", "projector", "ies", "cookie", "volume", "particles", "exclude")  # and those that may be repeated
SHAPING += ("animation", "scene_of_file", "time", "seed", "draw_path", "turn", "turntable", "frames", "fps", "crf", "day_from", "day_to")


@dataclass(frozen=True)
class FramesRequest:
    """Says what is wanted of a scene; the names are those of the options of `airlight render`.

    values: declared parameters that are set, those of pictures among them. explicit: names of options that the user wrote.
    recalled_preset: of the settings that are repeated. animation, scene_of_file: those of `open_scene`. eye, target: `x,y,z`; lights,
    suns: as `read_scene_light`; projectors: as `read_projector`.
    """

    scene: str
    output: str = ""
    values: dict[str, Any] = field(default_factory=dict)
    explicit: frozenset[str] = frozenset()
    recalled_preset: str | None = None
    camera: str | None = None
    eye: str | None = None
    target: str | None = None
    fov: float = 50.0
    width: int = 1280
    height: int | None = None
    no_antialias: bool = False
    turn: float = 0.0
    turntable: int | None = None
    time: float = 0.0
    frames: str | None = None
    day_from: str | None = None
    day_to: str | None = None
    seed: int | None = None
    draw_path: bool = False
    fps: Fraction = Fraction(24)
    light: Sequence[str] = ()
    sun: Sequence[str] = ()
    projector: Sequence[str] = ()
    ies: Sequence[str] = ()
    cookie: Sequence[str] = ()
    volume: Sequence[str] = ()
    particles: Sequence[str] = ()
    environment: str | None = None
    animation: str | None = None
    scene_of_file: str | None = None
    up: str | None = None
    exclude: Sequence[str] = ()
    preset: str | None = None
    medium: str | None = None
    layer: str | None = None
    occlusion_buffer: str | None = None
    crf: float = 18.0
    compression: str | None = None
    file_quality: int | None = None
    subsampling: str | None = None
    overwrite: bool = False
    skip_existing: bool = False
    resume: bool = False
    device: str | None = None
    profile: bool = False

    @property
    def shapes(self) -> dict[str, Sequence[str]]:
        """Collect what shapes lights, by its options, as `shape_text.shaped` takes it."""
        return {"ies": self.ies, "cookie": self.cookie, "projector": self.projector}

    @property
    def size(self) -> tuple[int, int]:
        """Give width and height, pixels."""
        return self.width, self.height or max(2, 2 * round(self.width * 9 / 32))

    @property
    def storage(self) -> Storage:
        """Collect how outputs are packed."""
        return Storage(self.compression, self.file_quality, self.subsampling)

    @property
    def adds_lamps(self) -> bool:
        """Tell whether lamps light the scene, and no sun is asked for."""
        return bool(self.light) and not self.sun

    @property
    def is_film(self) -> bool:
        from airlight.files import video

        return video.is_film(self.output)

    @property
    def is_sequence(self) -> bool:
        from airlight.files.sequence import numbered

        return numbered(self.output) is not None

    def settings(self, standing: dict[str, Any], values: dict[str, Any]) -> Settings:
        """Collect what is kept in the outputs. standing: the defaults that the scene has of its own."""
        defaults = {one.name: one.default for one in dataclasses.fields(self) if one.name in SHAPING} | {"scene": None, "fps": "24"}
        others = {name: getattr(self, name) for name in SHAPING}
        lists = {name: getattr(self, name) for name in LISTS}
        return Settings(values, others, defaults, self.preset or self.recalled_preset, standing, lists)

    def check(self) -> None:
        """Raise AirlightError for options that exclude each other."""
        from airlight.files.sequence import numbered

        if self.overwrite + self.skip_existing + self.resume > 1:
            raise AirlightError("-y/--overwrite, -n/--skip-existing and --resume exclude each other; give one")
        if self.is_film and (self.layer is not None or self.occlusion_buffer is not None):
            raise AirlightError("--layer and --occlusion-buffer go with pictures, not with a film; render numbered frames")
        if self.is_film and self.resume:
            raise AirlightError("--resume goes with numbered frames: a film is written in one run")
        paths = [path for path in (self.output, self.layer, self.occlusion_buffer) if path is not None]
        self.storage.check(paths)
        for path in filter(numbered, paths):
            standard.refuse_frames(path)
        if {"turntable", "turn"} <= self.explicit:
            raise AirlightError("--turn and --turntable exclude each other; give one")

    def scene_values(self) -> dict[str, Any]:
        """Give the values that mean something in scenes. Raises AirlightError for those of a look."""
        refuse_look(self.values, "a scene")
        return {name: value for name, value in self.values.items() if name not in NOT_IN_SCENES}

    def check_camera(self) -> None:
        """Raise AirlightError for options of the camera that exclude each other."""
        if self.eye is None and {"target", "fov"} & self.explicit:
            raise AirlightError("--target and --fov go with --eye x,y,z; give it too")
        if self.eye is not None and self.camera is not None:
            raise AirlightError("--camera and --eye exclude each other; give one")

    def shot(self, samples: int, smooth: bool, stage: "Stage") -> "Shot":
        """Describe the camera and the lights, and give the stage's their shapes. samples: along a side of a pixel."""
        from airlight.jobs.shape_text import shaped
        from airlight.scenes.offline import Shot

        eye, target = (None if text is None else triple(text) for text in (self.eye, self.target))
        suns = () if stage.daylight is not None else self.sun
        lights = [read_scene_light(text, PLACE) for text in self.light] + [read_scene_light(text, SUN) for text in suns]
        lights = shaped(stage, self.shapes, lights, float(self.fps))
        return Shot(*self.size, samples, smooth, self.camera, eye, target, self.fov, tuple(lights))


@contextlib.contextmanager
def needing_scenes() -> Iterator[None]:
    """Say what to install where an import within fails."""
    try:
        yield
    except ImportError as error:
        raise AirlightError(f"3-D scenes need an extra ({error.name} is missing): pip install airlight[scenes]") from None


def say_offer(stage: "Stage", asked: Sequence[str]) -> None:
    """Tell which meshes may be the light of a scene that has none, unless a light is asked for."""
    from airlight.scenes.lamps import offer

    text = None if asked else offer(stage)
    if text is not None:
        say(text, prefix="")


def _open(r: FramesRequest) -> "Stage":
    """Open the scene."""
    from airlight.scenes import open_scene

    return open_scene(r.scene, r.environment, r.seed, r.animation, r.scene_of_file, lamps=r.adds_lamps, up=r.up)


def run_frames(request: FramesRequest) -> bool:
    """Render what is wanted: a picture, numbered pictures, or a film. False where one of many failed.

    Raises AirlightError, MachineError.
    """
    several = request.is_film or request.is_sequence
    with contextlib.nullcontext(SILENT) if several else showing("opening the scene", 4, is_timed=False) as told:
        work, asked, written = _rendered(request, told)
    if work is not None:
        work.tell(written, request.profile)
        if request.is_sequence:
            say(f"{written} of {asked} pictures written", prefix="")
    return written == asked


def _rendered(r: FramesRequest, told: Work) -> tuple[FrameWork | None, int, int]:
    """Render and write; give the work, None where nothing is to be done, and how many frames were to be written and were."""
    from airlight.files import video

    spent = Spent()
    r.check()
    from airlight.composite.view import check as check_view
    from airlight.jobs.sun_of_scene import SunRequest, foresee_daylight, put_daylight, with_daylight

    values = with_daylight(r.scene_values(), bool(r.volume or r.particles))
    asked = build(values)
    quality = asked[Parameters].quality
    check_view(asked[SceneOptions].view_transform)
    r.check_camera()
    if "method" in values:  # else the scene may have one of its own
        refuse_idle_options(r, asked, chooser_of(r, values))
    samples = _samples(r, quality)
    if r.is_film:
        if r.skip_existing and os.path.lexists(r.output):
            say(f"{r.output} exists: skipped", prefix="")
            return None, 0, 0
        video.check_film(r.output, *r.size, r.overwrite)
    with needing_scenes():
        from airlight.gpu.device import shared_device
        from airlight.scenes import offline
    stage, frames, daylight = None, _tasks(r, 0.0), None
    sun = SunRequest(r.sun, r.day_from, r.day_to)
    if frames:
        sun = dataclasses.replace(sun, seconds=(frames[0].time, frames[-1].time))
        daylight = foresee_daylight(asked[Daylight], asked[DaylightScene], sun, r.scene)
    else:  # as many as the animation has
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", AirlightWarning)  # which is told when they are known
            foresee_daylight(asked[Daylight], asked[DaylightScene], dataclasses.replace(sun, seconds=(0.0, 1.0)), r.scene)
        shared_device(r.device)
        stage = _open(r)
        frames = _tasks(r, stage.duration)
        if not frames:
            raise AirlightError(f"{stage.name}: has no animation to film; give --turntable N or --frames")
        sun = dataclasses.replace(sun, seconds=(frames[0].time, frames[-1].time))
    todo = frames if r.is_film else _left(r, frames)
    if not todo:
        return None, 0, 0
    if stage is None:
        shared_device(r.device)
        stage = _open(r)
    if r.draw_path:
        if stage.path is None:
            raise AirlightError(f"{stage.name}: nothing in it flies along a path; leave --draw-path out")
        stage.path.visible = True
    from airlight.jobs.densities import put_densities, suit, tell_idle

    cells = build(stage.settings | values)[Medium].particle_cells
    if METHODS[(stage.settings | values).get("method", Parameters().method)].follows_fields:
        put_densities(stage, r.volume, r.particles, float(r.fps), cells)
        if r.volume or r.particles:
            suit(stage, values, cells)
    whole = stage.settings | values
    if (settled := settled_method(whole, bool(stage.fields))) != whole.get("method", settled):
        say(f"method {AUTO}: no medium is given, so it is {settled}; --medium or --sigma-t makes one")
        values |= {"method": settled}
    built = build(stage.settings | values)
    put_daylight(stage, built, sun, daylight)
    parameters, method = built[Parameters], METHODS[built[Parameters].method]
    refuse_idle_options(r, built, chooser_of(r, values, stage))
    tell_idle_in_daylight(r.explicit, built, stage)
    if method.has_units:
        tell_idle(r.explicit, built[Medium], any("#" in text for text in (*r.volume, *r.particles)), not stage.fields)
    say_offer(stage, (*r.light, *r.sun))
    opened = spent.add(OPEN, spent.begun)
    told.step("setting up")
    shot = r.shot(samples, parameters.quality == "draft" and not r.no_antialias, stage)
    studio = offline.Studio(
        stage,
        shot,
        parameters,
        built[Composite],
        built[SceneOptions],
        medium=built[Medium],
        march=built[March],
        exclude=r.exclude,
        linear=r.output.lower().endswith(offline.LINEAR_FILES),
        turns=(0.0, 0.25, 0.5, 0.75) if r.turntable is not None else (r.turn / 360,),  # for any of the frames
    )
    exposure = studio.exposure
    if exposure.automatic is not None and built[SceneOptions].ev is None and not studio.linear:
        say(exposure.line())
        values |= {} if studio.follows else {"ev": exposure.ev}
    spent.add(SET_UP, opened)
    studio.shafts.timing = r.profile
    settings = r.settings(stage.settings, values)
    work = FrameWork(spent, studio, settings, r.overwrite or r.resume, r.storage, OfScene(r.output))
    if r.is_film:
        with video.film(r.output, shot.width, shot.height, r.fps, r.crf, r.overwrite, settings.text()) as add:
            work.add = add
            run(todo, work.read, strict(work.render), strict(work.write), writers=1)
        return work, len(todo), len(todo)
    if not r.is_sequence:
        work.alone(todo[0], told)
        return work, 1, 1
    failed = run(todo, work.read, work.render, work.write)
    return work, len(todo), len(todo) - len(failed)


def _samples(r: FramesRequest, quality: str) -> int:
    """Give the samples along a side of a pixel. Raises AirlightError for frames that are too large."""
    width, height = r.size
    samples = 1 if r.no_antialias else SAMPLES[quality]
    if width * height * samples**2 > LARGEST:
        raise AirlightError(f"{width}x{height} with {samples**2} samples a pixel is too large; make it smaller, or use --quality draft")
    return samples


def _tasks(r: FramesRequest, duration: float) -> list[FrameTask]:
    """List the frames. duration: seconds of the scene's animation; for a whole animation of 0 there are none."""
    from airlight.files.sequence import frames as read_frames
    from airlight.files.sequence import numbered

    several = r.is_film or r.is_sequence
    if r.frames is not None:
        chosen = read_frames(r.frames)
    elif r.turntable is not None:
        chosen = list(range(1, r.turntable + 1))
    elif several:
        last = math.ceil(min(duration, MOST_FRAMES / float(r.fps)) * float(r.fps) - 1e-6)
        chosen = list(range(1, last + 1))
    else:
        chosen = [1]
    if len(chosen) > 1 and not several:
        name = standard.shown(r.output)
        raise AirlightError(f"{name}: {len(chosen)} frames do not go into one picture; name a pattern, as in shot.####.png, or a .mp4")

    def place(path: str | None, number: int) -> str | None:
        pattern = None if path is None else numbered(path)
        if path is not None and pattern is None and several:
            name = standard.shown(path)
            raise AirlightError(f"{name}: {len(chosen)} pictures do not go into one file; name a pattern such as layer.####.exr")
        return path if pattern is None else pattern.frame(number)

    found = []
    for number in chosen:
        ahead = 0.0 if r.turntable is not None else float((number - 1) / r.fps)
        if r.time + ahead < 0:
            raise AirlightError(f"frame {number} lies before the animation's start: frame 1 is at --time; give later --frames")
        turn = (number - 1) % r.turntable / r.turntable if r.turntable is not None else r.turn / 360
        name = r.output if r.is_film else place(r.output, number) or r.output
        found.append(FrameTask(number, name, place(r.layer, number), place(r.occlusion_buffer, number), r.time + ahead, turn))
    return found


def _left(r: FramesRequest, frames: Sequence[FrameTask]) -> list[FrameTask]:
    """List the pictures that are not done yet. Raises AirlightError for outputs that cannot be written."""
    todo, _ = tasks.left_to_do(frames, r.skip_existing, r.resume)
    inputs = [path for path in (r.scene, r.preset, r.medium, r.environment) if path is not None]
    tasks.check_outputs(todo, inputs, len(frames) > 1, r.overwrite or r.resume)
    return todo
