"""Keep all that the viewer shows and the panel changes, and the functions that change it. Nothing here draws."""

import functools
import math
import os
from dataclasses import dataclass, field
from typing import Any

from airlight import scenes
from airlight.composite.view import check as check_view
from airlight.detect import ACT, find_lights
from airlight.errors import AirlightError
from airlight.jobs.cookies import kept_cookie
from airlight.lights import ImageLight
from airlight.medium.resolve import doubt, resolve
from airlight.options import (
    NOT_IN_SCENES,
    OF_LOOK,
    OF_SUM,
    Composite,
    Daylight,
    DaylightPicture,
    DaylightScene,
    Look,
    March,
    Medium,
    Option,
    Parameters,
    SceneOptions,
    build,
    declared,
    presets,
    refuse_look,
)
from airlight.scatter.methods import METHODS

DEBUG = ("occlusion", "source", "lines")
DEBUG_LOOK = ("source",)
LOOK = (OF_LOOK | {"quality"}) - {"wrap"}  # which is for a subject's mask, and the viewer is given none
FIRST_LOOK = ("strength", "warmth", "length")  # what most pictures need
SAME = 0.06  # picture sizes within which a light is the candidate that lies there


@dataclass
class LightControl:
    """A light as the panel shows it. position: x, y of a picture, normalised; or x, y, z of a scene, its world's or a direction."""

    position: tuple[float, ...]
    color: tuple[float, float, float] = (1.0, 1.0, 1.0)
    strength: float = 1.0
    movable: bool = True
    direction: bool = False  # position says towards what, as of a sun
    kind: str | None = None  # of a picture's, as in `lights.ImageLight`
    cookie: Any = None  # of a picture's: a Cookie, or its file
    written: str | None = None  # the option of a scene's light, where a user added it
    density: float = 1.0  # factors of a scene's medium for this light alone
    extinction: float = 1.0
    name: str = ""  # by which an option finds a scene's light
    takes_cookie: bool = False
    gobo: str = ""  # the path of a picture that it sends out; "": the scene's own, if it has one
    gobo_size: float = 1.0  # m, of a sun's
    aim: tuple[float, ...] | None = None  # of a projector: where in the world it shines to
    fov: tuple[float, float] | None = None  # degrees, across and up
    falloff: str = ""
    intensity: float = 0.0  # cd

    def image_light(self) -> ImageLight:
        """Make the light of a picture that this shows."""
        cookie = kept_cookie(self.cookie) if isinstance(self.cookie, str) else self.cookie
        return ImageLight((self.position[0], self.position[1]), self.color, self.strength, kind=self.kind, cookie=cookie)


@dataclass
class Eye:
    """The eye of a scene's view. eye, target: as last drawn. moved: whether the user moved it away from the named camera."""

    name: str = ""
    names: tuple[str, ...] = ()
    eye: tuple[float, float, float] = (0.0, 0.0, 0.0)
    target: tuple[float, float, float] = (0.0, 0.0, 0.0)
    fov: float = 50.0
    moved: bool = False
    fly: bool = False


@dataclass
class ViewerState:
    """All that is shown. source: a picture's path, or a scene's name or path. size: of the view in px."""

    source: str
    is_image: bool
    parameters: Parameters = field(default_factory=Parameters)
    composite: Composite = field(default_factory=Composite)
    in_scene: SceneOptions = field(default_factory=SceneOptions)
    medium: Medium = field(default_factory=Medium)
    march: March = field(default_factory=March)
    look: Look = field(default_factory=Look)
    daylight: Daylight = field(default_factory=Daylight)
    daylight_picture: DaylightPicture = field(default_factory=DaylightPicture)
    daylight_scene: DaylightScene = field(default_factory=DaylightScene)
    candidates: tuple[Any, ...] = ()  # `detect.Candidate`s: where the light of a picture may be, likeliest first
    candidates_shown: bool = True
    current: int = 0  # the light that was moved last
    ask: str = ""  # what is not sure about the light, until the user moves it
    unplaced: bool = False  # no light was found, and none put anywhere: the picture stays as it is
    frame: tuple[float, float, float, float] = (0.0, 0.0, 1.0, 1.0)  # x, y, width, height of the picture in its display window
    held: bool = False  # a key is held that shows the picture without shafts
    lights: list[LightControl] = field(default_factory=list)
    opening: tuple[str, ...] = ()  # options with which a scene's file was opened
    lights_before: list[LightControl] = field(default_factory=list)  # as the scene has them
    eye: Eye = field(default_factory=Eye)
    sources: tuple[str, ...] = (*scenes.NAMES, *scenes.VALIDATION)  # to choose from
    size: tuple[int, int] = (0, 0)
    shafts: bool = True  # whether they are drawn
    debug: str | None = None
    split: float | None = None  # left of it, as a part of the width, the picture without shafts; None: nowhere
    playing: bool = True
    time: float = 0.0  # s
    duration: float = 0.0  # s; 0: nothing moves
    path_drawn: bool | None = None  # of a scene in which something flies along one, else None
    timing: bool = False
    passes: list[tuple[str, float]] = field(default_factory=list)  # (label, ms) of the last frame, if timing
    automatic: dict[str, Any] = field(default_factory=dict)  # what unset parameters are for this picture
    scene_defaults: dict[str, Any] = field(default_factory=dict)  # defaults that a scene has of its own
    allowed: dict[str, tuple[str, ...]] = field(default_factory=dict)  # choices that this picture has, where not all
    preset: str = ""
    file: str = "settings.toml"
    command: str = ""
    message: str = ""
    is_error: bool = False
    doubt: str = ""  # about the medium, the light, or the picture, told while there is no message
    path: str = ""  # as typed, to be opened
    cookie_paths: dict[int, str] = field(default_factory=dict)  # as typed, of lights' cookies
    has_paths: bool = True  # paths may be typed: not in a browser, whose files are elsewhere
    path_wanted: bool = False  # there is no file dialog, so the field for a path is shown
    command_wanted: bool = False  # whether the panel opens where the command is shown
    can_undo: bool = False
    can_redo: bool = False
    received: dict[str, str] = field(default_factory=dict)  # files that came as bytes: where they are kept, the name that they came with
    # what the app has to do: ("open", path), ("choose", ""), ("choose cookie", number of a light), ("cookie", its number:path),
    # ("undo", ""), ("redo", ""), ("screenshot", ""), ("save", ""), ("copy", "")
    requests: list[tuple[str, str]] = field(default_factory=list)

    @property
    def structs(self) -> tuple[Any, ...]:
        shafts = self.parameters, self.composite, self.in_scene, self.medium, self.march, self.look
        return *shafts, self.daylight, self.daylight_picture, self.daylight_scene

    @property
    def is_smart(self) -> bool:
        """Tell whether a picture has the smart look; else its shafts are the sum's."""
        return self.is_image and self.look.look != "classic"

    @property
    def is_lit(self) -> bool:
        """Tell whether shafts are shown."""
        return self.shafts and not self.held


def shown(state: ViewerState) -> tuple[Option, ...]:
    """List the parameters that have a meaning for what is shown, with the look or the method that is set."""
    if state.is_smart:
        return tuple(d for d in declared() if d.name in LOOK)
    if state.is_image:
        found = tuple(d for d in declared() if d.name == "look" or d.group != "look")
    else:
        found = tuple(d for d in declared(scenes=True) if d.name not in NOT_IN_SCENES)
    return tuple(d for d in found if d.group != "daylight" and (not d.methods or state.parameters.method in d.methods))


def value(state: ViewerState, name: str) -> Any:
    """Read the value of a declared parameter."""
    return next(getattr(struct, name) for struct in state.structs if name in struct.__struct_fields__)


def default(state: ViewerState, d: Option) -> Any:
    """Find the value of a parameter that the user leaves alone: the scene's own, else the declared one."""
    return state.scene_defaults.get(d.name, d.default)


def values(state: ViewerState) -> dict[str, Any]:
    """Collect the parameters that differ from these defaults."""
    return {d.name: value(state, d.name) for d in declared(scenes=True) if value(state, d.name) != default(state, d)}


def open_defaults(state: ViewerState, settings: dict[str, Any], dropped: tuple[str, ...] = ()) -> None:
    """Show another scene, or a picture: `settings` are what it is meant for, and hold for what the user left alone. dropped: parameters
    that it cannot have."""
    changed = {name: v for name, v in values(state).items() if name not in dropped}
    state.scene_defaults = settings
    set_values(state, changed)


def set_values(state: ViewerState, new: dict[str, Any]) -> None:
    """Set all declared parameters: those of `new`, else the defaults. Raises AirlightError and changes nothing if they do not go together.

    A picture for which `new` names what only the sum has gets the classic look, unless it names a look too.
    """
    if state.is_image and new.get("look") is None and not OF_SUM.isdisjoint(new):
        new = {**new, "look": "classic"}
    built = build(state.scene_defaults | {name: v for name, v in new.items() if v is not None or name not in state.scene_defaults})
    check_view(built[SceneOptions].view_transform)
    if state.is_image and built[Daylight].daylight != "none":
        raise AirlightError("`airlight image` puts daylight on pictures; the viewer shows it in scenes: leave out --daylight or the preset")
    state.parameters, state.composite, state.in_scene = built[Parameters], built[Composite], built[SceneOptions]
    state.medium, state.march, state.look = built[Medium], built[March], built[Look]
    state.daylight, state.daylight_picture, state.daylight_scene = built[Daylight], built[DaylightPicture], built[DaylightScene]


def change(state: ViewerState, name: str, new: Any) -> None:
    """Set one parameter. What does not go with another method is given its default. What is refused is told, and nothing changes."""
    wanted = {**values(state), name: new}
    attempts = [wanted]
    if name == "method":
        attempts.append({k: v for k, v in wanted.items() if k not in ("scale", "normalization")})
    for attempt in attempts:
        try:
            set_values(state, attempt)
        except AirlightError as error:
            tell(state, str(error), error=True)
        else:
            tell(state, "")
            return


def reset(state: ViewerState, group: str | None = None) -> None:
    """Set the defaults again, of one group or of all."""
    groups = {d.name: d.group for d in declared(scenes=True)}
    kept = {} if group is None else {name: v for name, v in values(state).items() if groups[name] != group}
    if group == "look":
        kept["look"] = state.look.look
    try:
        set_values(state, kept)
    except AirlightError:  # what is left of the other groups needs what was reset
        set_values(state, {})
    state.preset = ""
    tell(state, "")


def tell(state: ViewerState, text: str, error: bool = False) -> None:
    """Show one line in the panel."""
    state.message, state.is_error = text, error


def load(state: ViewerState, preset: str) -> None:
    """Load a preset by its name or a file of settings, over the defaults; a bad one is told."""
    try:
        found = presets.load(preset)
        if not state.is_image:
            refuse_look(found, "a scene")
        set_values(state, found)
    except AirlightError as error:
        tell(state, str(error), error=True)
    else:
        state.preset = preset if preset in presets.names() else ""
        tell(state, f"{preset} loaded")


@functools.cache
def media() -> dict[str, dict[str, Any]]:
    """Load what the media that come with Airlight say, by their names."""
    return {name: presets.load(name, presets.MEDIA) for name in presets.names(presets.MEDIA)}


def medium(state: ViewerState) -> str:
    """Name the one of these that is set, or ""."""
    return next((name for name, settings in media().items() if all(value(state, key) == v for key, v in settings.items())), "")


def load_medium(state: ViewerState, name: str) -> None:
    """Set one of these, with the defaults of what only others of them say; "": the defaults alone."""
    stuff = {key for settings in media().values() for key in settings}
    set_values(state, {key: v for key, v in values(state).items() if key not in stuff} | media().get(name, {}))
    tell(state, "")


def resolve_medium(state: ViewerState, distance: float, radius: float) -> None:
    """Say what is unset of a medium, and what is doubtful about it. distance: from the eye to the scene's centre, metres; radius: its."""
    if not METHODS[state.parameters.method].lights_medium or radius <= 0:
        state.doubt = ""
        return
    medium = resolve(state.medium, state.march, state.parameters.quality, radius)
    state.automatic |= {
        "sigma_t": tuple(float(f"{v:.3g}") for v in medium.sigma_t),
        "max_distance": medium.max_distance,
        "lamp_distance": medium.max_distance,
        "sun_distance": medium.max_distance,
        "steps": medium.steps or "exact",
        "sun_steps": medium.steps or 64,
        "shadow_size": medium.shadow_size,
        "sun_extinction": medium.sun_extinction,
        "noise_size": medium.noise_size,
        "air": 1.0,
    }
    state.automatic.setdefault("fog_depth", medium.fog_depth)
    state.doubt = (doubt(medium, distance, radius) or "") if METHODS[state.parameters.method].has_units else ""


def save(state: ViewerState, path: str) -> None:
    """Save the parameters that differ from the defaults as a preset, a new file; a failure is told."""
    try:
        if not path.lower().endswith(".toml"):
            raise AirlightError(f"{path or 'no name'}: settings are kept in a .toml file; name one")
        if os.path.lexists(path):
            raise AirlightError(f"{path}: exists already; choose another name")
        presets.save(path, values(state), f"Settings of {os.path.basename(state.source)}")
    except AirlightError as error:
        tell(state, str(error), error=True)
    else:
        tell(state, f"{path} saved")


def move(state: ViewerState, number: int, position: tuple[float, ...], held: bool = False) -> None:
    """Put a light elsewhere. held: it is on its way, and stays of its kind."""
    state.lights[number].position = tuple(round(float(v), 5) for v in position)
    state.ask, state.current, state.unplaced = "", number, False
    if state.is_image and not held:
        near = (c for c in state.candidates if math.dist(c.position, position) < SAME)
        state.lights[number].kind = next((c.kind for c in near), None)


def aim(state: ViewerState, number: int, place: tuple[float, ...]) -> None:
    """Let a projector shine to another place; not to its own."""
    found = tuple(round(float(v), 5) for v in place)
    if found != state.lights[number].position:
        state.lights[number].aim, state.current = found, number


def take(state: ViewerState, number: int) -> None:
    """Put the light that was moved last at a candidate."""
    candidate = state.candidates[number]
    move(state, min(state.current, len(state.lights) - 1), candidate.position)
    state.lights[state.current].kind = candidate.kind


def find_candidates(state: ViewerState, coarse: Any, bounded: bool = False) -> LightControl:
    """Look for the light of a picture, and say what is not sure. Returns the likeliest, or one near the top where nothing speaks for any.

    coarse: (h, w, 3) linear Rec. 709; bounded: as `detect.find_lights`.
    """
    state.candidates, state.ask, state.current = tuple(find_lights(coarse, bounded)), "", 0
    state.unplaced = not state.candidates
    if state.unplaced:
        state.ask = "no light found: drag the ring to where it is, or click there twice"
        return LightControl((0.5, 0.25))
    best = state.candidates[0]
    x, y = best.position
    if best.confidence < ACT:
        state.ask = f"unsure: perhaps at {x:.2f},{y:.2f} ({best.confidence:.2f}): click a dot or drag the light"
    elif best.guess:
        state.ask = f"light by a guess above the frame: {x:.2f},{y:.2f}"
    return LightControl((round(x, 5), round(y, 5)), kind=best.kind)
