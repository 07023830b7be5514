"""Judges results by what is written: nearly all of it white, black, or as it was; a scene of which nothing is seen."""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from airlight.errors import warn
from airlight.jobs.seen import BLACK_LINEAR, Lamps, doubt_of_frame
from airlight.messages import say

if TYPE_CHECKING:
    import numpy as np

    from airlight.scenes.offline import Frame, Studio

NEARLY_ALL = 0.95  # of the pixels
CODES = 2  # of 8 bits: what changes by no more is not seen, nor what lies no farther from black
WHITE = 250  # of 255, the least code, where no difference is seen: the shoulders of view transforms end below 255
WHITE_LINEAR = 0.956  # the same
DIM_LINEAR = 0.05  # of white, code 63: where all but a thousandth is darker, a display shows a dark room at most
FAR_STOPS = 2  # from the measured exposure: the user's own is amiss
LOOKED_AT = 50_000  # pixels, about


def percent(share: float) -> str:
    """Write a share, never as all where it is not."""
    return f"{min(int(100 * share), 99) if share < 1 else 100} %"


def flat_share(pixels: "np.ndarray", is_float: bool = False) -> tuple[str, float] | None:
    """Tell what nearly all of a picture is, "white" or "black", and its share; None where it is neither.

    pixels: (h, w, 3 or more), uint8 codes, or linear. is_float: written as floats, which have no white, and black at 0 alone.
    """
    import numpy as np

    step = max(1, int((pixels.shape[0] * pixels.shape[1] / LOOKED_AT) ** 0.5))
    some = pixels[step // 2 :: step, step // 2 :: step, :3]
    white, black = (WHITE, CODES) if some.dtype == np.uint8 else (WHITE_LINEAR, 0.0 if is_float else BLACK_LINEAR)
    if not some.size:
        return None
    for name, marks in (("black", some <= black), ("white", (some >= white) & (not is_float))):
        share = float(marks.all(axis=2).mean())
        if share > NEARLY_ALL:
            return name, share
    return None


def brightest(pixels: "np.ndarray") -> float:
    """Find the light that a thousandth of a picture exceeds. pixels: (h, w, 3 or more), linear."""
    import numpy as np

    step = max(1, int((pixels.shape[0] * pixels.shape[1] / LOOKED_AT) ** 0.5))
    some = pixels[step // 2 :: step, step // 2 :: step, :3].max(axis=2)
    return float(np.quantile(some.astype(np.float32), 0.999)) if some.size else 0.0


def changed_share(before: "np.ndarray", after: "np.ndarray", most: float = 1.0) -> float:
    """Measure the share of pixels that change by more than CODES; both (h, w, 3), uint8 codes or linear up to most, which is written."""
    import numpy as np

    from airlight.colour import srgb_encode

    if before.dtype == np.uint8:
        off, limit = np.abs(after.astype(np.int16) - before), float(CODES)
    else:
        old, new = (srgb_encode(np.clip(v, 0, most)) for v in (before, after))
        off, limit = np.abs(new - old), (CODES + 0.5) / 255
    return float((off.max(axis=2) > limit).mean())


def tell_compared(rows: Sequence[Any], before: "np.ndarray | None") -> None:
    """Say which of the compared pictures, compare.result.Row, show nothing. before: (h, w, 3) linear, the picture; None for a scene."""
    lights = "lights" if before is None else "exposure"
    for row in rows:
        found = flat_share(row.shown)
        if found is not None:
            cure = f"lower its {lights}" if found[0] == "white" else f"raise its {lights}"
            say(f"{row.variant.name}: {percent(found[1])} of it is {found[0]}: {cure}", prefix="")
        elif before is not None and (share := changed_share(before, row.shown)) < 1 - NEARLY_ALL:
            say(f"{row.variant.name}: {percent(1 - share)} of it is as it was: raise its exposure, or lower --threshold", prefix="")


@dataclass
class OfScene:
    """Judges the frames of a scene: `look` at each, `tell` at the end, once, what holds for all of them.

    output: as the user named it.
    """

    output: str
    frames: int = 0
    flat: Counter[str] = field(default_factory=Counter)
    least: float = 1.0
    ev: float = 0.0  # with which they are shown
    measured: float | None = None  # the automatic one of physical lights
    brightest: float = 0.0  # of any frame, see above
    doubtful: bool = False  # whether its medium was
    seen: bool = False  # something of the scene, in any frame
    lamps: Lamps = field(default_factory=Lamps)

    @property
    def _is_light(self) -> bool:
        """Tell whether the output holds light, which knows no exposure."""
        return self.output.lower().endswith((".exr", ".hdr"))

    def look(self, studio: "Studio", frame: "Frame") -> None:
        self.frames += 1
        self.ev, self.measured = studio.ev, studio.exposure.automatic
        found = flat_share(frame.picture, self._is_light)
        if found is not None:
            self.flat[found[0]] += 1
            self.least = min(self.least, found[1])
        if self.brightest < DIM_LINEAR:
            self.brightest = max(self.brightest, brightest(frame.picture))
        if self.frames == 1 and studio.shafts.lacks is not None:
            warn(studio.shafts.lacks)
        self.lamps.look(studio)
        if self.seen:
            return
        depth = frame.depth if frame.depth is not None else studio.depth()
        self.seen = sees(studio, depth)
        if self.frames == 1 and (doubt := doubt_of_frame(studio, frame, depth)) is not None:  # at once: a film may take hours
            warn(doubt)
            self.doubtful = True

    def tell(self) -> None:
        """Say what all frames have in common that nobody wants, with its cure."""
        of = f"{self.output}: " if self.frames == 1 else f"{self.output}, all {self.frames} frames: "
        if self.frames and not self.seen:
            say(f"{of}nothing of the scene is seen: place the camera by --eye x,y,z and --target x,y,z, or name one by --camera", prefix="")
            return
        self.lamps.tell()
        darker, brighter = f"--ev {self.ev - 4:g} darkens it", f"--ev {self.ev + 4:g} brightens it, "
        if self.measured is not None and abs(self.ev - self.measured) > FAR_STOPS:  # four stops would not do
            darker = f"its lights want --ev {self.measured:g}, which it gets without --ev"
            brighter = f"{darker}; "
        brighter = "" if self._is_light else brighter
        for name, cure in (("white", darker), ("black", f"{brighter}--light or --sun adds a light")):
            if self.frames and self.flat[name] == self.frames:
                say(f"{of}{percent(self.least)} of it is {name}: {cure}", prefix="")
        told = self.doubtful or self._is_light or self.flat["black"] == self.frames
        if self.frames and self.brightest < DIM_LINEAR and not told:
            ev = self.ev + max(1, int(math.log2(0.5 / max(self.brightest, BLACK_LINEAR))))
            cure = darker if self.measured is not None and abs(self.ev - self.measured) > FAR_STOPS else f"--ev {ev:g} brightens it"
            say(f"{of}it is dark, nearly all of it below {percent(DIM_LINEAR)} of white: {cure}", prefix="")


def sees(studio: "Studio", depth: "np.ndarray") -> bool:
    """Tell whether anything of the stage was drawn in the last frame; what is seen through leaves no depth, and is taken to be seen.

    depth: (H, W) of 0..1.
    """
    def shows_through(thing: Any) -> bool:
        material = getattr(thing, "material", None)
        return material is not None and thing.visible and not material.depth_write

    if (depth < 1).any():
        return True
    background = {id(thing) for thing in studio.stage.scene.iter() if type(thing).__name__ == "Background"}
    return any(shows_through(thing) for thing in studio.stage.scene.iter() if id(thing) not in background)
