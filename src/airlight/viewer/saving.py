"""Write the whole picture with its shafts by the command that the viewer shows, in a process of its own, while the viewer goes on."""

import functools
import itertools
import os
import subprocess
import sys
import threading
from collections.abc import Callable
from typing import Any

from airlight.errors import AirlightError
from airlight.files import Picture, write_image
from airlight.messages import say
from airlight.viewer import command
from airlight.viewer.state import ViewerState

BEHIND = 10  # of niceness
SENT = ", where the viewer runs; the browser downloads a copy"


class Saving(threading.Thread):
    """Writes one picture. `path` is its file; `outcome` becomes (text, whether it is an error) at the end, then `then` is called.

    state: as it is now; picture: as it was read; folder: where to write if the picture's own cannot be written to; device: of its name.
    """

    def __init__(self, state: ViewerState, picture: Picture, folder: str, device: str | None, then: Callable[[], Any]) -> None:
        super().__init__(name="saving")
        self.outcome: tuple[str, bool] | None = None
        self.then = then
        is_array = picture.spec is None  # there is no file that the command could read
        self.is_received = state.source in state.received
        is_homeless = is_array or self.is_received
        self.path = free_name(os.path.join(folder, command.output(state)) if is_homeless else command.output(state), folder)
        if is_array:
            self.write: Callable[[], object] = _array_writer(state, picture, self.path, device)
            return
        words = ["image", state.source, "-o", self.path, *command.options(state)]
        self.write = functools.partial(_run, [*words, *(["--device", device] if device else [])])

    def run(self) -> None:
        try:
            self.write()
            self.outcome = f"{self.path} saved{SENT if self.is_received else ''}", False
        except Exception as error:  # whatever it is, the viewer goes on and says so
            self.outcome = f"not saved: {error or type(error).__name__}", True
        finally:
            self.then()


def _run(words: list[str]) -> None:
    """Run a command by itself, behind what else there is to do: coding a large file would hold up frames. Raises AirlightError."""
    more: Any = {"start_new_session": True}
    if sys.platform == "win32":
        more = {"creationflags": subprocess.BELOW_NORMAL_PRIORITY_CLASS}
    words = [sys.executable, "-m", "airlight", *words]
    with subprocess.Popen(words, stdin=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, **more) as process:
        if sys.platform != "win32":
            os.setpriority(os.PRIO_PROCESS, process.pid, BEHIND)
        _, said = process.communicate()
    lines = [line for line in said.splitlines() if line.strip()]
    if process.returncode:
        raise AirlightError(lines[-1].removeprefix("airlight: ") if lines else f"the command ended with {process.returncode}")
    for line in lines:
        say(line, prefix="")


def free_name(path: str, folder: str) -> str:
    """Find a name that no file has yet: the path, numbered if it is taken, in the folder if its own cannot be written to."""
    home = os.path.dirname(path)
    if not os.access(home or ".", os.W_OK):
        path = os.path.join(folder, os.path.basename(path))
    stem, ending = os.path.splitext(path)
    names = itertools.chain([path], (f"{stem}-{number}{ending}" for number in itertools.count(2)))
    return os.path.normpath(next(name for name in names if not os.path.lexists(name)))


def _array_writer(state: ViewerState, picture: Picture, path: str, device: str | None) -> Callable[[], None]:
    """Make what writes an array with the lights and parameters of the state as it is now."""
    from airlight.jobs.doubts import tell_unchanged
    from airlight.occlusion.automatic import auto_threshold
    from airlight.pictures import render_look, render_picture

    lights = [control.image_light() for control in state.lights]
    p, composite, look = state.parameters, state.composite, state.look if state.is_smart else None
    bounded = picture.codes.dtype.kind == "u"
    options: dict[str, Any] = {"device": device, "codes_only": picture.bits == 8}

    def write() -> None:
        if look is not None:
            fit = p
            done = render_look(picture, lights, look, quality=p.quality, float_output=not bounded, **options)
        else:
            coarse = picture.rec709(picture.linear(coarse=True))
            fit = auto_threshold(p, coarse, lights, bounded=bounded) if bounded or composite.adapt > 0 else p
            done = render_picture(picture, lights, fit, composite, **options)
        tell_unchanged(picture, done, look, fit, lights, False, functools.partial(say, prefix=""))
        write_image(path, done.pixels, alpha=picture.alpha, encoded=done.encoded, bits=8 if picture.bits == 8 else 16)

    return write
