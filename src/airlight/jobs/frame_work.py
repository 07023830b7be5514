"""Renders and writes frames of a scene, and counts the time."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from airlight.errors import AirlightError, MachineError
from airlight.jobs.foreseen import MERGE_S, QUICK_SAMPLES, SOURCE_S, WRITE_S, foreseen
from airlight.jobs.profile import Spent, show
from airlight.jobs.settings import Settings
from airlight.jobs.tasks import FrameTask
from airlight.jobs.verdict import OfScene
from airlight.options.storage import Storage
from airlight.progress import Work
from airlight.scatter.methods import METHODS

if TYPE_CHECKING:
    from airlight.scenes.offline import Frame

OPEN, SET_UP, DRAW, WRITE = "open the scene", "set up, expose", "draw, read back", "encode, write"  # steps of a profile


@dataclass
class FrameWork:
    """Renders and writes a frame, the second perhaps by another thread."""

    spent: Spent
    studio: Any
    settings: Settings
    overwrite: bool
    storage: Storage
    verdict: OfScene
    add: Callable[[Any], None] | None = None  # to a film

    def tell(self, frames: int, profile: bool) -> None:
        """Say what holds for all frames, and where the time went if asked to."""
        self.verdict.tell()
        if profile:
            show(self.spent, (OPEN, SET_UP, DRAW, WRITE), DRAW, frames)

    def alone(self, task: FrameTask, told: Work) -> None:
        """Render and write the only frame, and tell how much is left of it."""
        told.step("drawing")
        shot, shafts = self.studio.shot, self.studio.shafts
        method, samples = METHODS[shafts.parameters.method], shot.width * shot.height * shot.samples**2
        after = (MERGE_S + SOURCE_S * (not method.lights_medium)) * samples + WRITE_S * shot.width * shot.height
        is_quick = method.is_converged and not method.lights_medium and samples <= QUICK_SAMPLES
        with foreseen(told, after, shafts.timing or is_quick, drawing=not method.lights_medium):
            frame = self.render(task, None)
        told.step("writing")
        self.write(task, None, frame)

    def read(self, task: FrameTask) -> None:
        """Do nothing: a scene is read once."""

    def render(self, task: FrameTask, _: None) -> "Frame":
        """Render a frame, and what goes beside it."""
        begun, is_first = time.perf_counter(), DRAW not in self.spent.steps
        exr = any(path is not None and path.lower().endswith(".exr") for path in (task.output, task.layer))
        found: Frame = self.studio.frame(
            task.time, task.turn, depth=exr, layer=exr or task.layer is not None, source=task.buffer is not None
        )
        if self.studio.shafts.timing:
            self.spent.passes += self.studio.shafts.profile()
        self.spent.add(DRAW, begun)
        if is_first:
            self.spent.passes.insert(0, ("the first, and compiling", self.spent.steps[DRAW]))
        self.verdict.look(self.studio, found)
        return found

    def write(self, task: FrameTask, _: None, frame: "Frame") -> None:
        """Write a frame, and what goes beside it."""
        import numpy as np

        from airlight import files
        from airlight.colour import encode_codes

        begun = time.perf_counter()
        pixels = frame.pixels()
        if self.add is not None:
            self.add(encode_codes(pixels, np.uint8))
            self.spent.add(WRITE, begun)
            return
        settings = self.settings.text(time=task.time, turn=task.turn * 360, turntable=None, frames=None, fps=None, crf=None)
        layer = frame.shafts() if frame.layer is not None else None
        exr, layer_exr = (path is not None and path.lower().endswith(".exr") for path in (task.output, task.layer))
        medium: dict[str, Any] = {"transmittance": frame.transmittance(), "z": frame.distance()} if exr or layer_exr else {}
        beside: dict[str, Any] = {}
        if exr:
            beside = {"alpha": np.ones(pixels.shape[:2], np.float32), "layer": layer, **medium}
            if frame.scale != 1:  # of physical lights: halves end at 65504
                beside["bits"] = 32
        kept: dict[str, Any] = {"overwrite": self.overwrite, "settings": settings}
        files.write_image(task.output, pixels, storage=self.storage.of(task.output), **kept, **beside)
        if task.layer is not None and layer is not None:
            fine = frame.layer_transmittance is not None or frame.layer_scale != 1
            more = {"bits": 32, **medium} if fine and layer_exr else {}
            files.write_image(task.layer, frame.shown(layer, task.layer), storage=self.storage.of(task.layer), **kept, **more)
        if task.buffer is not None and frame.source is not None:
            source = frame.source[..., :3].astype(np.float32) * np.float32(frame.layer_scale)
            more = {"bits": 32} if frame.layer_scale != 1 and task.buffer.lower().endswith(".exr") else {}
            files.write_image(task.buffer, frame.shown(source, task.buffer), storage=self.storage.of(task.buffer), **kept, **more)
        self.spent.add(WRITE, begun)


def strict(work: Callable[..., Any]) -> Callable[..., Any]:
    """Make any failure of some work end the run: a film lacks no frame."""

    def done(*arguments: Any) -> Any:
        try:
            return work(*arguments)
        except MachineError:
            raise
        except AirlightError as error:
            raise MachineError(str(error)) from error

    return done
