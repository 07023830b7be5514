"""Write the command that makes what the viewer shows. Nothing here draws."""

import math
import os
import shlex
from typing import Any

from airlight.files import OUTPUTS
from airlight.jobs.light_text import OF_LAMP, OF_MEDIUM, LightText
from airlight.options.declare import as_text as value_as_text
from airlight.viewer import state as st
from airlight.viewer.state import ViewerState


def light_words(state: ViewerState) -> list[str]:
    """Write the lights as options, those of a scene only where they are not its own. Each is one word: it may begin with a minus."""
    own = not state.is_image and state.lights == state.lights_before
    if (own and not any(control.written for control in state.lights)) or (state.is_smart and state.unplaced):
        return []
    words = []
    for i, control in enumerate(state.lights):
        name, numbers = "--light", control.position
        if control.written is not None:
            before, rest = state.lights_before[i], control.written.partition(";")[1:]
            if control == before or _made(control) == _made(before):
                place = control.written if control == before else ",".join(_number(v) for v in numbers) + "".join(rest)
                words.append(f"{name}={place}")
                continue
        if control.direction:
            x, y, z = control.position
            name, numbers = "--sun", (math.degrees(math.atan2(x, -z)), math.degrees(math.atan2(y, math.hypot(x, z))))
        if state.is_image:
            x, y, width, height = state.frame
            numbers = (x + numbers[0] * width, y + numbers[1] * height)
        kind = control.kind if state.is_smart else None
        cookie = control.cookie if isinstance(control.cookie, str) else None
        text = LightText(",".join(_number(v) for v in numbers), control.color, control.strength, kind=kind, cookie=cookie).text
        factors = "".join(f";{key}={getattr(control, key)!r}" for key in OF_MEDIUM if getattr(control, key) != 1)
        words.append(f"{name}={text}{factors}{_unseen(control.written or '')}")
    return words


def _unseen(written: str) -> str:
    """Take of a light's option what the panel does not show: its own intensity, which has a unit, and its photometry."""
    parts = [tuple(word.strip() for word in part.split("=", 1)) for part in written.split(";")[1:]]
    kept = (part for part in parts if part[0] in OF_LAMP or (part[0] == "strength" and not _plain(part[-1])))
    return "".join(f";{'='.join(part)}" for part in kept)


def _plain(value: str) -> bool:
    try:
        float(value)
    except ValueError:
        return False
    return True


def _made(control: st.LightControl) -> tuple[Any, ...]:
    """Collect what a light is, wherever it stands."""
    return control.color, control.strength, control.density, control.extinction


def _number(v: float) -> str:
    return f"{v:.5f}".rstrip("0").rstrip(".") if abs(v) < 1e4 else repr(float(v))


def written_values(state: ViewerState) -> dict[str, Any]:
    """Collect the parameters that the command writes: those that mean something with what is shown and differ from the defaults."""
    found = {d.name: st.value(state, d.name) for d in st.shown(state) if st.value(state, d.name) != st.default(state, d)}
    if state.is_smart:
        found.pop("look", None)
    if not state.is_image and state.automatic.get("ev"):  # which another camera would change
        found.setdefault("ev", state.automatic["ev"])
    return found


def command_line(state: ViewerState) -> list[str]:
    """Write the command that makes what is shown: `airlight image` or `airlight render` with what differs from the defaults."""
    return ["airlight", "image" if state.is_image else "render", named_source(state), "-o", output(state), *options(state)]


def options(state: ViewerState) -> list[str]:
    """Write the options of `command_line`: lights, the view of a scene, parameters."""
    words = light_words(state)
    if not state.is_image:
        words += [*state.opening, *_view(state)]
    for name, v in written_values(state).items():
        option = name.replace("_", "-")
        words += [f"--{'' if v else 'no-'}{option}"] if isinstance(v, bool) else [f"--{option}", value_as_text(v)]
    return words


def named_source(state: ViewerState) -> str:
    """Name what is shown as the user does: a file that came as bytes has the name that it came with."""
    return state.received.get(state.source, state.source)


def output(state: ViewerState) -> str:
    """Name what the command writes: of a picture's format and beside it, so that nothing unset is decided otherwise."""
    stem, kind = os.path.splitext(named_source(state))
    if not state.is_image:
        return f"{os.path.basename(stem)}-shafts.png"
    return f"{stem}-shafts{kind if kind.lower() in OUTPUTS else '.png'}"


def _view(state: ViewerState) -> list[str]:
    words = ["--width", str(state.size[0]), "--height", str(state.size[1])]
    eye = state.eye
    if eye.moved:
        words += [f"--{name}={','.join(_number(v) for v in at)}" for name, at in (("eye", eye.eye), ("target", eye.target))]
        words.append(f"--fov={eye.fov:.4g}")
    elif eye.names and eye.name != eye.names[0]:
        words += ["--camera", eye.name]
    if state.duration:
        words += ["--time", _number(state.time)]
    return words


def as_text(words: list[str]) -> str:
    return shlex.join(words)
