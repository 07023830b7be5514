"""One line, with its cure, where what was asked for gives nothing to see."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from airlight.jobs.light_text import LightText
from airlight.lights import parse_position

if TYPE_CHECKING:
    from airlight.files import Picture

FAR_AWAY = 20  # pictures: a light beyond was hardly meant to be there
CODES = 2  # of 8 bits: what changes by no more is not seen


def tell_far_away(written: Sequence[LightText], found: Sequence[LightText], say: Callable[[str], object]) -> None:
    """Say where a light lies so far away that pixels were meant. written: as typed; found: the same in numbers."""
    for typed, light in zip(written, found, strict=False):
        if typed.searched is not None or typed.angle is not None:
            continue
        x, y = parse_position(light.position, 1, 1)
        if max(abs(x - 0.5), abs(y - 0.5)) > FAR_AWAY:
            away = max(abs(x), abs(y))
            say(f"the light {typed.position} lies {away:.0f} pictures away: where pixels are meant, write 400px,300px")


def tell_unchanged(
    picture: "Picture", done: Any, look: Any, p: Any, lights: Sequence[LightText], float_output: bool, say: Callable[[str], object]
) -> None:
    """Say why nothing, or hardly anything, is to be seen. done: pictures.Rendered; look: None: classic; p: the sum's parameters."""
    if done.message:
        say(f"{picture.path}: {done.message}")
    elif changes_little(picture, done, float_output):
        say(f"{picture.path}: hardly changed: {_cure(done, look, p, lights)}")


def is_off(look: Any, lights: Sequence[LightText]) -> bool:
    """Tell whether the user asked for no light."""
    return not any(light.strength for light in lights) or (look is not None and look.strength == 0)


def shines(picture: "Picture", done: Any) -> bool:
    """Tell whether shafts change a picture at all, so that other frames may go by what was measured on it."""
    import numpy as np

    changes = getattr(done.held, "changes", None)  # of the smart look
    if changes is not None:
        return bool(changes)
    return bool(done.layer.any() if done.encoded is None else not np.array_equal(done.encoded, picture.codes[..., :3]))


def _cure(done: Any, look: Any, p: Any, lights: Sequence[LightText]) -> str:
    if is_off(look, lights):
        return "the strength is 0"
    if look is not None:
        if done.held is not None and done.held.contrast < 0.5 * done.held.wanted:  # no strength gives it
            return "nothing in it can show shafts: all is too dark, too bright, or near"
        return "--strength 2 shows more"
    if p.exposure * p.weight == 0:
        return "weight or exposure is 0"
    if p.occlusion in ("luminance", "contrast") and sum(p.knee) / 2 >= 1:
        return f"little or nothing is as bright as --threshold {sum(p.knee) / 2:g}; lower it"
    if p.occlusion in ("alpha", "depth"):
        return f"--occlusion {p.occlusion} lets little or no light through; try --occlusion luminance"
    return "raise --exposure, lower --threshold, or leave the options of the sum out for the smart look"


def changes_little(picture: "Picture", done: Any, float_output: bool) -> bool:
    """Tell whether no pixel of a coarse copy changes by more than CODES; in floats above white too, where codes go on."""
    import numpy as np

    from airlight.colour import srgb_encode
    from airlight.files.images import COARSE, every

    step = max(1, max(picture.width, picture.height) // COARSE)
    some = every(picture.height, step), every(picture.width, step)
    if done.encoded is not None:
        return int(np.abs(done.encoded[some].astype(np.int16) - picture.codes[..., :3][some]).max()) <= CODES
    most = 65504 if float_output else 1  # what half holds
    before, after = (srgb_encode(np.clip(v, 0, most)) for v in (picture.linear(coarse=True), done.pixels[some]))
    return float(np.abs(after - before).max()) <= (CODES + 0.5) / 255
