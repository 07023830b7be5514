"""Write the command that makes what the viewer shows. Nothing here draws."""

import math
import os
import shlex
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from airlight.files import OUTPUTS
from airlight.jobs.light_text import OF_LAMP, OF_MEDIUM, LightText
from airlight.jobs.projector_text import name_of
from airlight.options.declare import as_text as value_as_text
from airlight.options.presets import is_number
from airlight.viewer import state as st
from airlight.viewer.daylight import words as daylight_words
from airlight.viewer.state import ViewerState


def light_words(state: ViewerState) -> list[str]:
    """Write the lights as options, those of a scene only where they are not its own. Each is one word: it may begin with a minus."""
    plain = [pair for pair in zip(state.lights, state.lights_before) if pair[0].aim is None] if not state.is_image else []
    own = not state.is_image and len(state.lights) == len(state.lights_before)
    own = own and all(unshaped(control) == unshaped(before) for control, before in plain)
    if (own and not any(control.written for control, _ in plain)) or (state.is_smart and state.unplaced):
        return []
    words = []
    for i, control in enumerate(state.lights):
        name, numbers = "--light", control.position
        if control.aim is not None:  # the rest of it: shape_words
            words += [] if control.written else [f"--light={','.join(_number(v) for v in numbers)}"]
            continue
        if control.written is not None:
            before, rest = state.lights_before[i], control.written.partition(";")[1:]
            if unshaped(control) == unshaped(before) or _made(control) == _made(before):
                place = control.written if unshaped(control) == unshaped(before) else ",".join(_number(v) for v in numbers) + "".join(rest)
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


def unshaped(control: st.LightControl) -> st.LightControl:
    """Leave out what `shape_words` write."""
    return replace(control, gobo="", gobo_size=1.0)


def opening_words(shapes: dict[str, Sequence[str]]) -> tuple[str, ...]:
    """Write the options of shapes with which a scene was opened, but for projectors that they brought, which are lights now."""
    return tuple(f"--{name}={text}" for name, texts in shapes.items() for text in texts if name != "projector" or name_of(text))


def shape_words(state: ViewerState) -> list[str]:
    """Write projectors as options, those of a scene only where they are not as before, and cookies that were chosen."""
    words = []
    for control, before in zip(state.lights, state.lights_before) if not state.is_image else ():
        path = state.received.get(control.gobo, control.gobo)
        if control.aim is not None and control.written:
            words.append(f"--projector={_rewritten(control, before, path)}")
            continue
        if control.aim is not None and (changes := _changes(control, before)):
            place = [f"position={','.join(_number(v) for v in control.position)}"] if control.position != before.position else []
            words.append(f"--projector={';'.join([control.name, *place, *changes])}")
        if path:
            words.append(f"--cookie={control.name}={path}{f';size={control.gobo_size!r}' if control.direction else ''}")
    return words


def _changes(control: st.LightControl, before: st.LightControl) -> list[str]:
    """Write what of a projector's light is not as before, `key=value`, its target with its position."""
    assert control.aim is not None and control.fov is not None
    found = []
    if (control.aim, control.position) != (before.aim, before.position):
        found.append(f"target={','.join(_number(v) for v in control.aim)}")
    if control.fov != before.fov:
        found.append(f"fov={','.join(f'{v:g}' for v in control.fov)}")
    if control.falloff != before.falloff:
        found.append(f"falloff={control.falloff}")
    if (control.intensity, control.color) != (before.intensity, before.color):
        found.append(f"intensity={','.join(f'{v * control.intensity:.5g}' for v in control.color)}")
    return found


def _rewritten(control: st.LightControl, before: st.LightControl, path: str) -> str:
    """Write the option of a projector that a user brought, with what is not as before in it."""
    changes = _changes(control, before) + ([f"cookie={path}"] if path else [])
    place, *rest = (control.written or "").split(";")
    if control.position != before.position:
        place = ",".join(_number(v) for v in control.position)
    new = {change.partition("=")[0] for change in changes}
    return ";".join([place, *(part for part in rest if part.partition("=")[0].strip() not in new), *changes])


def _unseen(written: str) -> str:
    """Take of a light's option what the panel does not show: its own intensity, which has a unit, and its photometry."""
    parts = [tuple(word.strip() for word in part.split("=", 1)) for part in written.split(";")[1:]]
    kept = (part for part in parts if part[0] in OF_LAMP or (part[0] == "strength" and not is_number(part[-1])))
    return "".join(f";{'='.join(part)}" for part in kept)


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
        words += [*state.opening, *daylight_words(state), *shape_words(state), *_view(state)]
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
