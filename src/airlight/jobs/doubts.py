"""One line, with its cure, where what was asked for gives nothing to see."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from airlight.jobs import verdict
from airlight.jobs.light_text import LightText
from airlight.lights import ImageLight, parse_position

if TYPE_CHECKING:
    from airlight.files import Picture

FAR_AWAY = 20  # pictures: a light beyond was hardly meant to be there


def tell_far_away(written: Sequence[LightText], found: Sequence[LightText], say: Callable[[str], object]) -> None:
    """Say where a light lies so far away that pixels were meant. written: as typed; found: the same in numbers."""
    for typed, light in zip(written, found, strict=False):
        if typed.searched is not None or typed.angle is not None:
            continue
        x, y = parse_position(light.position, 1, 1)
        if max(abs(x - 0.5), abs(y - 0.5)) > FAR_AWAY:
            away = max(abs(x), abs(y))
            say(f"the light {typed.position} lies {away:.0f} pictures away: {_nearer(typed.position)}")


def _nearer(position: str) -> str:
    """Say how a far place that was typed is written where other units are meant."""
    parts = [part.strip() for part in position.split(",")]
    if any(part.endswith(("px", "%")) for part in parts):
        return "is it meant to be there?"
    return f"where pixels are meant, write {','.join(f'{part}px' for part in parts)}"


def tell_unchanged(
    picture: "Picture",
    done: Any,
    look: Any,
    p: Any,
    lights: Sequence[LightText | ImageLight],
    float_output: bool,
    say: Callable[[str], object],
    mix: float | None = None,
) -> None:
    """Say why nothing, or hardly anything, is to be seen. done: pictures.Rendered; look: None: classic; p: the sum's parameters; mix: of
    its composite."""
    if done.message:
        say(f"{picture.path}: {done.message}")
        return
    share, made = measured(picture, done, float_output)
    if share < 1 - verdict.NEARLY_ALL and white_share(picture, float_output):  # no strength mends that: tell_white
        return
    if share == 0:
        say(f"{picture.path}: hardly changed: {_cure(done, look, p, lights, mix)}")
    elif share < 1 - verdict.NEARLY_ALL:
        cure = "--strength 2 or --length 2 shows more" if look is not None else "raise --exposure or --density, or lower --threshold"
        say(f"{picture.path}: hardly changed, {verdict.percent(1 - share)} of it not at all: {cure}")
    elif (flat := verdict.flat_share(made, float_output)) is not None:
        name, share = flat
        cures = ("--strength 0.3", "--shade 0") if look is not None else ("a lower --exposure", "--adapt 0")
        say(f"{picture.path}: {verdict.percent(share)} of the result is {name}: {cures[name == 'black']} changes less")


def white_share(picture: "Picture", float_output: bool) -> float:
    """Measure how much of a picture of floats is beyond white, where that is nearly all and the output ends at white; else 0."""
    if float_output or picture.codes.dtype.kind != "f":
        return 0.0
    name, share = verdict.flat_share(picture.linear(coarse=True)) or ("", 0.0)
    return share if name == "white" else 0.0


def tell_white(picture: "Picture", output: str, float_output: bool, say: Callable[[str], object]) -> None:
    """Say that an output is white since its input is, as a render in lux or nits."""
    if share := white_share(picture, float_output):
        cure = f"{output} would show nothing: write .exr, or scale the picture for a display first"
        say(f"{picture.path}: {verdict.percent(share)} of it is brighter than white, as light in lux or nits is; {cure}")


def is_off(look: Any, lights: Sequence[LightText | ImageLight]) -> bool:
    """Tell whether the user asked for no light."""
    return not any(light.strength for light in lights) or (look is not None and look.strength == 0)


def shines(picture: "Picture", done: Any) -> bool:
    """Tell whether shafts change a picture at all, so that other frames may go by what was measured on it."""
    import numpy as np

    changes = getattr(done.held, "changes", None)  # of the smart look
    if changes is not None:
        return bool(changes)
    return bool(done.layer.any() if done.encoded is None else not np.array_equal(done.encoded, picture.codes[..., :3]))


def _cure(done: Any, look: Any, p: Any, lights: Sequence[LightText | ImageLight], mix: float | None) -> str:
    if look is None and mix == 0:
        return "--mix 0 adds nothing of the shafts; leave it out"
    if is_off(look, lights):
        return "the strength is 0"
    if all(max(light.color) == 0 for light in lights if light.strength):
        return "the light's colour is black, 0,0,0"
    if any(light.cookie for light in lights):
        return "it may be the cookie, which lets no light through there; try it without"
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


def measured(picture: "Picture", done: Any, float_output: bool) -> tuple[float, Any]:
    """Measure the share of a coarse copy's pixels that change to be seen, in floats above white too, where codes go on; and give the
    result's: (h, w, 3) uint8 codes, or linear."""
    from airlight.files.images import COARSE, every

    step = max(1, max(picture.width, picture.height) // COARSE)
    some = every(picture.height, step), every(picture.width, step)
    if done.encoded is not None:
        made = done.encoded[some]
        return verdict.changed_share(picture.codes[..., :3][some], made), made
    made = done.pixels[some]
    return verdict.changed_share(picture.linear(coarse=True), made, 65504 if float_output else 1), made  # what half holds
