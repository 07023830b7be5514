"""Reads pictures, finds their lights, renders and writes them, and counts the time."""

import contextlib
import dataclasses
import functools
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from airlight.errors import MachineError
from airlight.jobs import doubts, outputs
from airlight.jobs.clips import Clips, Settled
from airlight.jobs.finding import resolve_lights
from airlight.jobs.light_text import LightText, place
from airlight.jobs.planes import read_range
from airlight.jobs.profile import Spent
from airlight.jobs.tasks import PictureTask
from airlight.messages import say
from airlight.options import Look

if TYPE_CHECKING:
    import numpy as np

    from airlight.files import Picture
    from airlight.jobs.image import ImageRequest


@dataclass
class Loaded:
    """Holds a picture with the planes beside it."""

    picture: "Picture"
    emits: "np.ndarray | None"
    far: Any  # of daylight, with whether they are whole numbers
    subject: "np.ndarray | None"


@dataclass
class ImageWork:
    """Reads, renders, writes each picture, each step perhaps by another thread.

    Frames of one sequence take their light, threshold, mix and adaptation from one of them, lest they flicker: see `Clips`.
    """

    request: "ImageRequest"
    parameters: Any
    composite: Any
    look: Any  # None: classic
    many: bool  # pictures
    clips: Clips

    def __post_init__(self) -> None:
        self.passes: list[tuple[str, float]] | None = [] if self.request.profile else None
        self.overwrite = self.request.overwrite or self.request.resume
        self.spent = Spent()
        self._start = threading.Thread(target=_open_device, args=(self.request.device,), daemon=True)
        self._start.start()  # while the first picture is read
        self._where: Any = None

    def read(self, task: PictureTask) -> Loaded:
        """Read the picture and its planes."""
        begun = time.perf_counter()
        picture = self.request.reading.picture(task.source)
        loaded = Loaded(picture, *self.planes(task, picture))
        self.spent.add("read", begun)
        return loaded

    def planes(self, task: PictureTask, picture: "Picture") -> tuple[Any, ...]:
        """Read the mask, the depths and the subject of a picture."""
        reading = self.request.reading
        return reading.mask(task.mask, picture), reading.depth(task.depth, picture), reading.subject(task.subject, picture)

    def open_device(self) -> None:
        """Open the renderer, once."""
        self._start.join()
        if self._where is None:
            self._where = _renderer(self.request.device)

    def render(self, task: PictureTask, loaded: Loaded) -> Any:
        """Give (pictures.Rendered, the occlusion fraction or None, the settings), or the view that --debug asks for."""
        self.open_device()
        picture = loaded.picture
        settled = self.clips.settled(task, loaded, self.read, self._settled)
        lights = [place(light, picture, cookie=task.cookie) for light in settled.lights]
        if self.request.debug is not None:
            from airlight.debug import view

            tell = functools.partial(say, prefix="")
            return view(self.request.debug, picture, lights, settled.parameters, loaded.emits, loaded.far, self._where, tell)
        begun = time.perf_counter()
        done = settled.done
        if done is None:
            from airlight.occlusion.automatic import check

            check(self.parameters, picture.alpha is not None, loaded.far is not None)
            done = self._shone(task, loaded, lights, settled.parameters, settled.held)
        fraction = self._fraction(loaded, lights, settled.parameters) if task.fraction is not None and lights else None
        self.spent.add("render", begun)
        chosen = "classic" if self.look is None else "smart"
        return done, fraction, self.request.settings.text(settled.lights, chosen)

    def _settled(self, task: PictureTask, loaded: Loaded, tell: Callable[[str], object]) -> Settled:
        """Settle a picture by itself: find its lights, resolve what is unset, render it. tell: is called with lines for the user."""
        from airlight.occlusion.automatic import check

        picture, r = loaded.picture, self.request
        check(self.parameters, picture.alpha is not None, loaded.far is not None)
        begun = time.perf_counter()
        written, parameters = self._resolved(picture, tell)
        doubts.tell_far_away(r.lights, written, tell)
        begun = self.spent.add("find the light", begun)
        if r.debug is not None:
            return Settled(written, parameters, None, None, bool(written))
        done = self._shone(task, loaded, [place(light, picture, cookie=task.cookie) for light in written], parameters, None)
        self.spent.add("render", begun)
        real = outputs.is_float(task.output, picture)
        if written:
            shaped = [dataclasses.replace(light, cookie=light.cookie or task.cookie) for light in r.lights]
            doubts.tell_unchanged(picture, done, self.look, parameters, shaped, real, tell, self.composite.mix)
        doubts.tell_white(picture, task.output, real, tell)
        shines = bool(written) and (doubts.is_off(self.look, r.lights) or doubts.shines(picture, done))
        return Settled(written, parameters, done.held, done, shines)

    def _shone(self, task: PictureTask, loaded: Loaded, lights: list[Any], parameters: Any, held: Any) -> Any:
        """Render one picture, pictures.Rendered."""
        from airlight import pictures

        picture, r = loaded.picture, self.request
        real = outputs.is_float(task.output, picture)
        options: dict[str, Any] = {
            "mask": loaded.emits,
            "device": self._where,
            "profile": self.passes,
            "float_output": real,
            "codes_only": task.layer is None and picture.bits == 8 and not real and not task.output.lower().endswith(".dpx"),  # not sRGB
        }
        if self.look is None and lights:
            return pictures.render_picture(picture, lights, parameters, held or self.composite, depth=loaded.far, **options)
        options |= {"subject": loaded.subject, "depth": loaded.far if r.depth_hides else None, "held": held}
        options |= {"near_range": read_range(r.near_range), "quality": self.parameters.quality}
        return pictures.render_look(picture, lights, self.look or Look(), **options)

    def _fraction(self, loaded: Loaded, lights: list[Any], parameters: Any) -> "np.ndarray":
        from airlight import api

        picture, keys = loaded.picture, {name: getattr(parameters, name) for name in parameters.__struct_fields__}
        image, planes = picture.rec709(picture.linear()), {"alpha": picture.alpha, "depth": loaded.far, "mask": loaded.emits}
        return api.occlusion_fraction(image, lights[0], device=self._where, **planes, **keys)

    def _resolved(self, picture: "Picture", tell: Callable[[str], object]) -> tuple[list[LightText], Any]:
        """Resolve a picture: lights in the display window, and parameters with nothing unset."""
        from airlight.occlusion.automatic import auto_threshold

        r, integer = self.request, picture.codes.dtype.kind == "u"
        settles = self.look is None and (integer or self.composite.adapt > 0)
        searched = any(w.searched for w in r.lights)
        coarse = picture.rec709(picture.linear(coarse=True)) if settles or searched else None
        written = resolve_lights(r.lights, picture, r.origin, coarse, self.many, tell)
        if not settles or coarse is None:
            return written, self.parameters
        return written, auto_threshold(self.parameters, coarse, [place(light, picture) for light in written], bounded=integer)

    def write(self, task: PictureTask, loaded: Loaded, rendered: Any) -> None:
        """Write the picture, and what goes beside it."""
        from airlight import files

        begun, picture = time.perf_counter(), loaded.picture
        bare = dataclasses.replace(
            picture, codes=picture.colour_codes, alpha=None, associated=False, extra=None, extra_names=(), extra_formats=(), layer=""
        )
        if self.request.debug is not None:
            if rendered.ndim == 2:
                outputs.write_data(task.output, rendered, self.overwrite, "")
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
            transmittance=done.transmittance if beside is not None else None,
            z=done.z if beside is not None else None,
            overwrite=self.overwrite,
            encoded=done.encoded,
            settings=settings,
            storage=self.request.storage.of(task.output),
        )
        if task.layer is not None:
            storage = self.request.storage.of(task.layer)
            files.write_image(task.layer, done.layer, bare, overwrite=self.overwrite, settings=settings, storage=storage)
        if task.fraction is not None and fraction is not None:
            outputs.write_data(task.fraction, fraction, self.overwrite, settings)
        self.spent.add("write", begun)


def _renderer(device: str | None) -> Any:
    """Open a renderer to keep; without an adapter, what makes the API say so and go on without."""
    from airlight.scatter.render import PictureRenderer

    try:
        return PictureRenderer(device, keep=1)
    except MachineError:
        return device


def _open_device(name: str | None) -> None:
    """Open the device ahead; whatever is wrong is told when it is used."""
    from airlight.gpu.device import open_device

    with contextlib.suppress(Exception):
        open_device(name)
