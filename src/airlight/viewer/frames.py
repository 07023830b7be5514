"""Choose what of the picture is drawn when: the panel lies over the last picture, which is coarse while things move, and refines at rest.

In a frame the picture is worked on for no longer than a slice, `gpu.slices`, whatever it costs; then the panel is drawn over what is there.
While events come, every other frame is the panel's alone: no event waits for two slices.
"""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from airlight.gpu.device import Device
from airlight.gpu.slices import Sliced

LAY = "viewer/kept.wgsl"
SHARES = (1.0, 0.7, 0.5, 0.35, 0.25)  # of width and height, by how coarse a picture is; below, one does not know what one sees
BEGIN = 3  # how coarse the first is on a software adapter
EASY = 0.4  # share of the time allowed below which a finer picture is tried
LONG = 0.045  # s; coarse pictures that take longer in one go are carried out in slices, which takes about twice as long in all
CALM = 4  # coarse pictures in a row that were as easy


@dataclass(frozen=True)
class Pace:
    """Says how long things may take, seconds: a slice of work in a frame, a picture while things move; the rest before it refines; and a
    slice in a frame that answers what leaves the picture as it is."""

    slice: float = 0.035
    moving: float = 0.04
    rest: float = 0.15
    brief: float = 0.02


IN_SLICES = Pace()
AT_ONCE = Pace(math.inf, math.inf, 0.0, math.inf)  # for pictures that nobody waits for: each frame is whole


class Frames:
    """Keeps the last picture, and goes on with the next one in each frame.

    level: how coarse pictures are while things move, an index of SHARES. started, finished, dropped: pictures so far.
    """

    def __init__(self, device: Device, format: str, pace: Pace, clock: Callable[[], float] = time.perf_counter) -> None:
        self.device, self.format, self.pace, self.clock = device, format, pace, clock
        self.kept: Any = None  # the texture
        self.next: Any = None  # and the one that is drawn on, mostly the same
        self.level = BEGIN if device.is_cpu else 0
        self.started = self.finished = self.dropped = 0
        self.shown: Any = None  # what the picture shows, and how coarse it is
        self.work: Sliced | None = None
        self.again = False  # whether the picture that is worked on is to be drawn once more
        self.working: tuple[Any, int] = (None, 0)  # what it will show
        self._key: Any = None
        self._changed = -math.inf  # s
        self._whole = math.inf  # s that a picture took that is not coarse
        self._coarse = 0.0  # s that a coarse one takes, or would, in one go
        self._in_one = False  # whether the one that is worked on is
        self._worked = False  # whether the last frame was
        self._calm = 0
        self._paces: dict[Any, int] = {}  # of coarse pictures in slices; in whole ones a row by itself may take long
        self._ratio = device.buffer(size=16, uniform=True)
        self._bound: tuple[Any, Any] = (None, None)  # a texture that was laid, and its bind group

    def view(self, size: tuple[int, int]) -> Any:
        """Give the texture that pictures of a size are drawn on; what was there stays until then."""
        if self.kept is None or self.kept.size[:2] != size:
            usage = self.device.wgpu.TextureUsage
            flags = usage.TEXTURE_BINDING | usage.RENDER_ATTACHMENT | usage.COPY_SRC
            self.next = self.device.device.create_texture(size=(*size, 1), format=self.format, usage=flags)
        else:
            self.next = self.kept
        return self.next

    def refines(self) -> bool:
        """Tell whether a picture is worked on that is not coarse, and so may be dropped."""
        return self.work is not None and self.working[1] == 0

    def drop(self) -> None:
        """Drop the picture that is worked on."""
        if self.work is not None:
            self.work.drop()
            if self.refines():  # lest one that is too slow is begun again and again
                self._whole = max(self._whole, self.work.spent)
            if self.next is self.kept:  # which may be drawn already
                self.shown = None
            self.work, self.dropped = None, self.dropped + 1

    def forget(self) -> None:
        """Let the next picture be drawn whatever the last one shows; in work: the next one too."""
        self.shown, self.again = None, True

    def adapts(self, key: Any, seconds: float) -> bool:
        """Tell whether what is seen has changed so many seconds ago at most; always, where each frame is whole."""
        return self.pace is AT_ONCE or key != self._key or self.clock() - self._changed < seconds

    def follow(
        self, key: Any, moving: bool, make: Callable[[int], Callable[[], None]], is_woken: bool = False, brief: bool = False
    ) -> bool:
        """Go on with the picture of what `key` says, for a slice. moving: more will follow; make: makes the work for a level; is_woken: an
        event came, that the panel answers; brief: the picture does not.

        True: another frame has to follow. Raises what the work raises, which is not tried again.
        """
        now = self.clock()
        if key != self._key:
            self._key, self._changed = key, now
        moving = moving or now - self._changed < self.pace.rest
        if is_woken and self._worked and self.pace is not AT_ONCE:
            self._worked = False
            return True
        if self.work is None:
            level = self._level() if moving else 0
            if self.shown is not None and self.shown[0] == key and self.shown[1] <= level:
                return moving
            self.working = key, level
            self.started, self.again = self.started + 1, False
            self.work = self._begin(make(level), level)
        self._worked = True
        return not self._go_on(self.pace.brief if brief else self.pace.slice) or moving or self.shown != (key, 0)

    def _begin(self, draw: Callable[[], None], level: int) -> Sliced:
        """Make the work: a coarse picture in one go, where that is not known to be long, as each division costs time."""
        if math.isinf(self.pace.slice):
            return Sliced(draw, at_once=True)

        def drawn() -> None:
            draw()
            self.device.wait()

        self._in_one = level > 0 and self._coarse <= LONG
        return Sliced(drawn, self._in_one, self._paces if level > 0 else None)

    def _go_on(self, seconds: float) -> bool:
        """Work for a slice of so many seconds. True: the picture is done."""
        work = self.work
        assert work is not None
        try:
            if not work.go_on(seconds):
                return False
            self.finished += 1
        except BaseException:
            self.work, self.shown = None, self.working  # it is not tried again
            self.kept = self.next
            raise
        self.work = None
        self.shown, self.kept = None if self.again else self.working, self.next
        self._learn(self.working[1], work.spent)
        return True

    def _level(self) -> int:
        """Choose how coarse the next picture is: not at all, where that is known to be quick."""
        return 0 if self._whole <= self.pace.moving else max(self.level, 1)

    def _learn(self, level: int, spent: float) -> None:
        """Let the next picture be coarser if this one took too long, and finer if several were easy."""
        if level == 0:
            self._whole = spent
            return
        self._coarse = spent if self._in_one else spent / 2
        share = spent / self.pace.moving
        self._calm = self._calm + 1 if share < EASY else 0
        if share > 1:
            self.level = min(level + (2 if share > 3 else 1), len(SHARES) - 1)
        elif self._calm >= CALM:
            self.level, self._calm = max(level - 1, 1), 0

    def lay(self, target: Any) -> None:
        """Draw the last picture onto a texture view, such as the canvas's."""
        kept = self.kept
        if kept is None:
            return
        width, height = target.texture.size[:2]
        ratio = np.array([kept.width / width, kept.height / height, 0, 0], np.float32)
        self.device.queue.write_buffer(self._ratio, 0, ratio.tobytes())
        pipeline = self.device.raster(LAY, "cover", "lay", self.format)
        encoder = self.device.encoder()
        onto = {"view": target, "load_op": "clear", "store_op": "store"}
        run = encoder.begin_render_pass(color_attachments=[onto])
        run.set_pipeline(pipeline)
        if self._bound[0] is not kept:
            self._bound = kept, self.device.bind(LAY, kept, self._ratio)
        run.set_bind_group(0, self._bound[1])
        run.draw(3)
        run.end()
        self.device.submit(encoder)
