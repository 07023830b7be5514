"""Adds light shafts to pictures: what `airlight image`, and the viewer's Save, ask for."""

import contextlib
import dataclasses
import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from airlight.errors import AirlightError
from airlight.jobs import outputs, tasks
from airlight.jobs.clips import Clips, looked_at
from airlight.jobs.daylight_sun import is_daylight
from airlight.jobs.finding import show_candidates
from airlight.jobs.foreseen import PICTURE_S, foreseen
from airlight.jobs.image_work import ImageWork
from airlight.jobs.light_text import LightText
from airlight.jobs.planes import Reading, read_range
from airlight.jobs.profile import show
from airlight.jobs.run import run
from airlight.jobs.settings import Settings
from airlight.jobs.tasks import PictureTask
from airlight.messages import say
from airlight.options import OF_SUM, Composite, Daylight, DaylightPicture, Look, Parameters, build, chosen_look, declared
from airlight.options.storage import Storage
from airlight.process import standard
from airlight.progress import showing
from airlight.scatter.methods import check_picture

AUTO = (LightText("auto"),)
# Options beside the declared parameters that shape the result; files by their names as written.
SHAPING: tuple[str, ...] = ("view", "mask", "mask_layer", "mask_invert")
SHAPING += ("depth", "depth_near", "depth_layer", "near_range", "depth_hides", "subject", "subject_layer", "input_layer", "colorspace")
SHAPING += ("cookie",)


@dataclass(frozen=True)
class ImageRequest:
    """Says what is wanted of pictures; the names are those of the options of `airlight image`.

    values: declared parameters that are set. explicit: names of options that the user wrote. recalled: whether the lights are those of
    settings. recalled_preset: the preset of these.
    """

    sources: Sequence[str]
    output: str | None = None
    lights: Sequence[LightText] = AUTO
    values: dict[str, Any] = field(default_factory=dict)
    explicit: frozenset[str] = frozenset()
    recalled: bool = False
    recalled_preset: str | None = None
    candidates: str | None = None
    frames: str | None = None
    origin: str = "top"
    preset: str | None = None
    view: str | None = None
    mask: str | None = None
    mask_layer: str | None = None
    mask_invert: bool = False
    depth: str | None = None
    depth_layer: str | None = None
    depth_near: str = "black"
    near_range: str = "0.05,0.6"
    depth_hides: bool = True
    subject: str | None = None
    subject_layer: str | None = None
    cookie: str | None = None
    input_layer: str | None = None
    colorspace: str | None = None
    layer: str | None = None
    occlusion_fraction: str | None = None
    debug: str | None = None
    compression: str | None = None
    file_quality: int | None = None
    subsampling: str | None = None
    format: str | None = None
    overwrite: bool = False
    skip_existing: bool = False
    resume: bool = False
    on_damage: str = "error"
    device: str | None = None
    profile: bool = False

    @property
    def reading(self) -> Reading:
        """Collect how the files are read."""
        return Reading(**{one.name: getattr(self, one.name) for one in dataclasses.fields(Reading)})

    @property
    def storage(self) -> Storage:
        """Collect how outputs are packed."""
        return Storage(self.compression, self.file_quality, self.subsampling)

    @property
    def settings(self) -> Settings:
        """Collect what is kept in the outputs."""
        defaults = {one.name: one.default for one in dataclasses.fields(self) if one.name in SHAPING}
        of_pictures = {one.name for one in declared()}  # a preset of scenes may have set others
        values = {name: value for name, value in self.values.items() if name in of_pictures}
        return Settings(values, {name: getattr(self, name) for name in SHAPING}, defaults, self.preset or self.recalled_preset)

    @property
    def has_depth(self) -> bool:
        return self.depth is not None or self.depth_layer is not None

    @property
    def has_subject(self) -> bool:
        return self.subject is not None or self.subject_layer is not None

    def with_occlusion(self, is_sum: bool = False) -> "ImageRequest":
        """Take depths to say what emits, where the sum is asked for; refuse options that need others. is_sum: there are no looks."""
        if self.mask_invert and self.mask is None and self.mask_layer is None:
            raise AirlightError("--mask-invert inverts the image of --mask; give both")
        values = dict(self.values)
        check_picture(values.get("method", ""))
        if self.has_depth and (
            is_sum or values.get("look") == "classic" or (values.get("look") is None and OF_SUM & values.keys())
        ):
            values.setdefault("occlusion", "depth")  # what else would the sum be given it for?
        elif values.get("occlusion") == "depth" and not self.has_depth:
            raise AirlightError("the occlusion 'depth' needs an image of depths; add --depth FILE")
        if "depth_near" in self.explicit and not self.has_depth:
            raise AirlightError("--depth-near describes the image of --depth; give both")
        return dataclasses.replace(self, values=values)

    def look(self) -> str:
        """Choose the look, smart or classic. Raises AirlightError where options exclude each other, or would have no effect."""
        wants = (("--debug", self.debug), ("--occlusion-fraction", self.occlusion_fraction))
        is_parallel = any(light.angle is not None for light in self.lights)
        sum_by = "--angle" if is_parallel else next((name for name, value in wants if value is not None), "")
        chosen = chosen_look(self.values, self.values.get("look"), sum_by)
        self._check_depths(chosen)
        return chosen

    def _check_depths(self, look: str) -> None:
        """Refuse options of depths and subjects that would have no effect."""
        for name, option in (("near_range", "near-range"), ("depth_hides", "depth-aware")):
            if name in self.explicit and (not self.has_depth or look == "classic"):
                raise AirlightError(f"--{option} goes with depths that hide shafts: add --depth FILE, and leave the classic look")
        if self.has_subject and look == "classic":
            raise AirlightError("--subject is for the smart look: leave out what asks for the classic one")
        if self.values.get("wrap") and not self.has_subject:
            raise AirlightError("--wrap goes with the mask of a subject: add --subject FILE")
        read_range(self.near_range)

    def check(self) -> None:
        """Raise AirlightError for options that exclude each other."""
        if self.overwrite + self.skip_existing + self.resume > 1:
            raise AirlightError("-y/--overwrite, -n/--skip-existing and --resume exclude each other; give one")
        if self.output is None:
            wants = (("--layer", self.layer), ("--occlusion-fraction", self.occlusion_fraction), ("--debug", self.debug))
            for option, value in wants if self.candidates is not None else ():
                if value is not None:
                    raise AirlightError(f"{option} goes with a picture that is written: add -o FILE")
            if self.candidates is None:
                raise AirlightError("no output is named: add -o FILE, or --candidates FILE to see where the light may be")
            return
        if self.cookie is not None and any(light.angle is not None for light in self.lights):
            raise AirlightError("--cookie lies around a light, and a parallel one of --angle has no place; give --light X,Y instead")
        if self.occlusion_fraction is not None and len(self.lights) > 1:
            raise AirlightError("--occlusion-fraction belongs to one light; give one --light or --angle")
        if self.debug is not None and (self.layer is not None or self.occlusion_fraction is not None):
            raise AirlightError("--debug writes its view to -o and nothing else; leave --layer and --occlusion-fraction out")


def run_image(request: ImageRequest) -> bool:
    """Do what is wanted: read, find the light, render, write, of many pictures at the same time. False where one of many failed.

    Raises AirlightError, MachineError.
    """
    request.check()
    if request.output is None:
        show_candidates(request.sources, str(request.candidates), request.reading, request.overwrite)
        return True
    built = build(request.values)
    is_day = is_daylight(request.values)
    if is_day:
        from airlight.jobs.daylight_picture import DaylightWork
        from airlight.jobs.daylight_request import check_request

        check_request(request, built[Daylight], built[DaylightPicture])
    else:
        request = request.with_occlusion()
    built, chosen = build(request.values), "daylight" if is_day else request.look()
    with contextlib.ExitStack() as folders:
        todo, references, many = _tasks(request, folders)
        if not todo:
            return True
        if request.recalled:
            say("the light is that of the settings; --light auto finds each picture's own", prefix="")
        clips = Clips({clip: looked_at(frames) for clip, frames in references.items()})
        shared = request, built[Parameters], built[Composite], built[Look] if chosen == "smart" else None, many, clips
        work = DaylightWork(*shared, built[Daylight], built[DaylightPicture]) if is_day else ImageWork(*shared)
        failed: list[tuple[PictureTask, AirlightError]] = []
        if many:
            failed = run(todo, work.read, work.render, work.write)
            say(f"{len(todo) - len(failed)} of {len(todo)} pictures written", prefix="")
        else:
            with showing("reading", 3, is_timed=False) as told:
                loaded = work.read(todo[0])
                told.step("rendering")
                with foreseen(told, PICTURE_S * loaded.picture.width * loaded.picture.height, request.profile):
                    rendered = work.render(todo[0], loaded)
                told.step("writing")
                work.write(todo[0], loaded, rendered)
        if request.profile:
            work.spent.passes = work.passes or []
            show(work.spent, ("read", "find the light", "render", "write"), "render", len(todo) - len(failed))
        return not failed


def _tasks(request: ImageRequest, folders: contextlib.ExitStack) -> tuple[list[PictureTask], dict[int, list[PictureTask]], bool]:
    """List what is to be done, and the frames of each clip; tell whether pictures are many; show candidates if they are asked for."""
    r, output = request, str(request.output)
    named = r.layer, r.occlusion_fraction
    todo, clips = tasks.picture_tasks(r.sources, output, *named, r.mask, r.depth, r.subject, r.frames, r.format, r.cookie)
    of_folder = any(standard.is_folder(source) for source in r.sources)
    many = len(todo) > 1 or bool(clips) or of_folder
    todo, _ = tasks.left_to_do(todo, r.skip_existing, r.resume)
    r.storage.check(path for task in todo for path in task.outputs)
    folders.enter_context(outputs.making((output, *named), of_folder and bool(todo)))
    tasks.check_outputs(todo, [] if r.preset is None else [r.preset], many, r.overwrite or r.resume)
    if r.candidates is not None:
        if os.path.realpath(r.candidates) in {os.path.realpath(path) for task in todo for path in task.outputs}:
            raise AirlightError(f"{r.candidates}: is named for two outputs; give each a name of its own")
        show_candidates(r.sources, r.candidates, r.reading, r.overwrite)
    return todo, clips, many
