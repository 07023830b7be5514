"""The viewer on any canvas of rendercanvas: a window, a browser, a notebook, or none at all."""

import math
import os
import time
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from airlight.errors import AirlightError, MachineError, NotAPicture
from airlight.files import Picture, read_image, write_image
from airlight.gpu.device import shared_device
from airlight.jobs.densities import add_density, put_densities, suit
from airlight.options import chosen_look, refuse_look
from airlight.scatter.methods import FOR_MEDIUM, METHODS, check_picture
from airlight.scenes import is_scene
from airlight.scenes.names import A_FILE
from airlight.viewer import controls
from airlight.viewer import state as st
from airlight.viewer.command import opening_words
from airlight.viewer.errands import Errands
from airlight.viewer.following import Following
from airlight.viewer.frames import AT_ONCE, IN_SLICES, Pace
from airlight.viewer.marks import DOT, EDGE, Held, Marks
from airlight.viewer.saving import Saving
from airlight.viewer.state import LightControl, ViewerState

SIZE = (1280, 720)
TITLE = "Airlight"
EVENTS = ("pointer_down", "pointer_move", "pointer_up", "double_click", "wheel", "key_down", "key_up")
WAKING = (*EVENTS, "char", "pointer_enter", "pointer_leave", "resize")  # by name: those of "*" come after the panel, which stops events
LINGER = 3  # frames after an event, in which the panel follows it
DOUBLE = 0.7  # s within which two clicks may be a double one
SPLIT = 7  # logical px beside the split within which it is taken hold of
MISSING = "pip install airlight[viewer]"


class Viewer:
    """Draws `state` onto a canvas and changes it by what the user does. Its `canvas` may be any of rendercanvas.

    source: a picture's path, a Picture, a scene's name or path; animation, scene, up: those of `open_scene`; lamps: of a scene, as
    `--light` has them; densities: as `--volume` and `--particles` have them; shapes: as `shape_text.shaped`. Raises AirlightError where it
    cannot be shown; later failures are lines in the panel. Shows itself in notebooks, if the canvas does.
    """

    def __init__(
        self,
        canvas: Any,
        source: str | Picture,
        *,
        values: dict[str, Any] | None = None,
        lights: Sequence[LightControl] = (),
        device: str | None = None,
        folder: str = ".",
        animation: str | None = None,
        scene: str | None = None,
        up: str | None = None,
        lamps: Sequence[str] = (),
        densities: tuple[Sequence[str], Sequence[str]] = ((), ()),
        shapes: dict[str, Sequence[str]] | None = None,
        pace: Pace = IN_SLICES,
    ) -> None:
        from airlight.viewer.panel import Panel

        self.canvas, self.folder = canvas, folder
        self._of_file = {"animation": animation, "scene": scene, "up": up}  # of the source with which it begins
        self._lamps, self._densities, self._shapes = lamps, densities, shapes or {}  # of that too
        self.device = shared_device(device)
        self.scene: Any = None
        self.errands: Any = None
        self.picture: Any = None
        self.read: Any = None  # the picture as it was read
        self.dragging: Held | str | None = None
        self.saving: Saving | None = None
        self.adapter = device
        self.linger = LINGER
        self.following: Any = None
        path = source if isinstance(source, str) else source.path
        self.state = ViewerState(source=path, is_image=not isinstance(source, str) or not is_scene(source))
        if values and self.state.is_image:
            chosen_look(values, values.get("look"))
        elif values:
            refuse_look(values, "a scene")
        if values:
            st.set_values(self.state, values)
        if self.state.is_image:
            check_picture(self.state.parameters.method)
        self.open(source, lights)
        context = canvas.get_wgpu_context()
        self.following = Following(self, context.get_preferred_format(self.device.device.adapter), pace)
        self.panel = Panel(self.device.device, canvas, self.state)
        self.marks = Marks(self)
        self.panel.overlay = self.marks.draw
        self.errands = Errands(self)
        canvas.add_event_handler(self._woken, *WAKING, order=-100)  # before the panel's
        canvas.add_event_handler(self._handle, *EVENTS, order=-50)
        canvas.request_draw(self.draw)

    def _repr_mimebundle_(self, *args: Any, **keywords: Any) -> Any:
        return self.canvas._repr_mimebundle_(*args, **keywords)

    # what is shown

    def add(self, path: str) -> None:
        """Put the volume or the particles of a file into the air of the scene that is shown. Raises AirlightError."""
        state = self.state
        option = add_density(self.scene.stage, path, state.medium.particle_cells)
        state.opening += tuple(word.replace(path, state.received.get(path, path)) for word in option)
        if not METHODS[state.parameters.method].lights_medium:
            st.set_values(state, st.values(state) | {"method": FOR_MEDIUM})
        self.scene.opened += 1

    def open(self, source: str | Picture, lights: Sequence[LightControl] = ()) -> None:
        """Show another picture or scene. Raises AirlightError, and goes on showing the one before."""
        state = self.state
        before = state.parameters.method
        path = source if isinstance(source, str) else source.path
        if self.following is not None:
            self.following.drop()
        if not isinstance(source, str) or not is_scene(path):
            from airlight.jobs.light_text import found_at
            from airlight.viewer.picture import PictureView

            picture = _read(source) if isinstance(source, str) else source
            view = PictureView(self.device, picture)
            self.picture, state.is_image, self.read = view, True, picture
            found = st.find_candidates(state, view.coarse, view.bounded)
            state.lights = [replace(control, movable=True, direction=False) for control in lights] or [found]
            if lights:
                state.ask, state.unplaced = "", False
            (x, y), (right, bottom) = (found_at(picture, corner)[:2] for corner in ((0.0, 0.0), (1.0, 1.0)))
            state.frame = (x, y, right - x, bottom - y)
            state.duration, state.path_drawn = 0.0, None
            unfit = ("method",) if METHODS[before].lights_medium else ()
            st.open_defaults(state, {}, unfit)
        else:
            chosen, lamps, shapes = (self._of_file, self._lamps, self._shapes) if path == state.source else ({}, (), {})
            stage = _open_scene(path, lamps, chosen, shapes)
            if self.scene is None:
                from airlight.viewer.stage import SceneView

                self.scene = SceneView(self.canvas)
            state.automatic = {}
            self.scene.open(stage, state, lamps)
            state.opening = tuple(f"--{name}={value}" for name, value in chosen.items() if value is not None)
            state.opening += opening_words(shapes)
            if path == state.source and any(self._densities):
                state.opening += put_densities(stage, *self._densities, cells=state.medium.particle_cells)
                suit(stage, st.values(state), state.medium.particle_cells)
                st.set_values(state, {"sigma_t": stage.settings.get("sigma_t")} | st.values(state))
            self.picture, state.is_image, state.candidates, state.ask = None, False, (), ""
        state.source, state.debug, state.split, state.passes, state.allowed = path, None, None, [], {}
        state.sources = tuple(dict.fromkeys((*state.sources, path)))
        state.doubt = ""
        if self.errands is not None:
            self.errands.opened()
        st.tell(state, "")
        if state.is_image and METHODS[before].lights_medium:
            st.tell(state, f"method {before} is for scenes: this picture is shown without it")

    def room(self) -> controls.Area:
        """Find the canvas beside the panel, physical px."""
        width, height = self.canvas.get_physical_size()
        left = round(self.panel.width * self.canvas.get_pixel_ratio())
        return (left, 0, max(1, width - left), height) if left < width - 64 else (0, 0, width, height)

    def area(self) -> controls.Area:
        """Find where the picture is, logical px."""
        if self.picture is None:
            return (0.0, 0.0, *self.canvas.get_logical_size())
        x, y, width, height = (v / self.canvas.get_pixel_ratio() for v in controls.fitted(self.picture.size, self.room()))
        return x, y, width, height

    def draw(self) -> None:
        """Draw one frame: called by the canvas."""
        state = self.state
        self.errands.serve()
        self._follow_saving()
        width, height = self.canvas.get_physical_size()
        if width < 2 or height < 2:
            return
        state.size = (width, height)
        try:
            again = self.following.go_on()
        except AirlightError as error:
            st.tell(state, str(error), error=True)
            again = False
        self.following.frames.lay(self.canvas.get_wgpu_context().get_current_texture().create_view())
        self.panel.render()
        self.errands.history.follow(state, self.dragging is not None or self.panel.busy)
        self.linger -= 1
        self.woken = False
        if again or self.hurried or self.linger > 0 or state.requests:
            self.canvas.request_draw()

    @property
    def hurried(self) -> bool:
        """Tell whether something is dragged, or the panel is used."""
        return self.dragging is not None or self.panel.busy

    # what the user does

    def _woken(self, event: dict[str, Any]) -> None:
        if event["event_type"] == "pointer_down" and self.dragging is None:
            self.panel.claim((event["x"], event["y"]))
        self.linger, self.woken = LINGER, True
        self.canvas.request_draw()

    def _handle(self, event: dict[str, Any]) -> None:
        """Take an event that the panel left."""
        kind, state = event["event_type"], self.state
        at = (event.get("x", 0.0), event.get("y", 0.0))
        if kind in ("key_down", "key_up"):
            self._key(event["key"].lower(), kind == "key_down", event["modifiers"])
        elif kind == "pointer_down" and event["button"] == 1:
            state.held = False  # its release may have gone elsewhere
            self.dragging = self._grabbed(at)
        elif kind == "pointer_move" and self.dragging is not None:
            self._drag(at)
        elif kind == "pointer_up" and self.dragging is not None:
            if state.is_image and isinstance(self.dragging, int) and self.moved:
                st.move(state, self.dragging, state.lights[self.dragging].position)  # of what kind it is there
            self.dragging, self.moved = None, False
            return
        if self.picture is None and self.dragging is None and self.scene is not None:
            self.scene.handle(event)
            self.following.stirred |= kind != "pointer_move" or bool(event.get("buttons"))
        beside = at[0] >= self.panel.width  # the panel lets double clicks through
        again = time.perf_counter() - self.taken < DOUBLE
        if kind == "double_click" and beside and state.is_image and len(state.lights) == 1 and not again:
            st.move(state, 0, controls.to_picture(at, self.area()))

    woken = False  # whether an event came since the last frame
    moved = False  # whether the light was since it was taken hold of
    taken = -math.inf  # s: when a dot was clicked

    def _key(self, key: str, is_down: bool, modifiers: Sequence[str]) -> None:
        """Take a key that the panel left."""
        state = self.state
        if key == " " and state.is_image:
            state.held = is_down
        elif is_down and self.errands.key(key, modifiers):
            pass
        elif is_down and key == "h":
            self.panel.visible = not self.panel.visible
        elif is_down and key == "b" and state.is_image:
            state.shafts = not state.shafts

    def _grabbed(self, at: tuple[float, float]) -> Held | str | None:
        area, state = self.area(), self.state
        marks: Sequence[tuple[float, float] | None] = self.marks.lights()
        dots = self.marks.dots()
        if state.is_image:
            room = self.marks.room()
            marks = [None if mark is None else controls.clamped(mark, room, EDGE)[0] for mark in marks]
            number = controls.nearest(at, [controls.clamped(dot, self.area(), EDGE)[0] for _, dot in dots], DOT + 2)
            if number is not None:
                st.take(state, dots[number][0])
                self.taken = time.perf_counter()
                return None
        found = self.marks.nearest(at, marks)
        if found is not None:
            return found
        shown = state.is_image and state.split is not None and state.is_lit and not state.debug
        if shown and abs(at[0] - area[0] - (state.split or 0.0) * area[2]) <= SPLIT and area[1] <= at[1] <= area[1] + area[3]:
            return "split"
        return None

    def _drag(self, at: tuple[float, float]) -> None:
        state, area = self.state, self.area()
        if self.dragging == "split":
            state.split = min(max(controls.to_picture(at, area)[0], 0.0), 1.0)
        elif isinstance(self.dragging, int) and self.picture is not None:
            st.move(state, self.dragging, controls.to_picture(at, area), held=True)
            self.moved = True
        elif not isinstance(self.dragging, str) and self.dragging is not None:
            self.marks.drag(self.dragging, at)

    def save(self) -> None:
        """Begin to write the whole picture with its shafts as a new file."""
        if self.saving is not None:
            st.tell(self.state, f"{self.saving.path} is still being saved")
            return
        self.saving = Saving(self.state, self.read, self.folder, self.adapter, self.canvas.request_draw)
        st.tell(self.state, f"saving {self.saving.path} ...")
        self.saving.start()

    def _follow_saving(self) -> None:
        """Tell what became of a picture that was being saved."""
        if self.saving is not None and self.saving.outcome is not None:
            text, is_error = self.saving.outcome
            self.saving = None
            st.tell(self.state, text, error=is_error)

    def screenshot(self) -> str:
        """Write what is shown, without the panel, as a new numbered PNG, and return its name. Raises AirlightError, MachineError."""
        stem = os.path.splitext(os.path.basename(self.state.source))[0] or "airlight"
        self.following.settle()
        number = 1
        while os.path.lexists(name := os.path.join(self.folder, f"{stem}-{number:04d}.png")):
            number += 1
        if self.picture is not None:
            write_image(name, None, encoded=self.picture.pixels_shown(self.state))
        else:
            write_image(name, self.scene.pixels_shown())
        return os.path.normpath(name)


def _read(path: str) -> Picture:
    """Read a picture; what is none might have been a scene."""
    try:
        return read_image(path)
    except NotAPicture as error:
        raise AirlightError(f"{error}; a scene is {A_FILE}") from None


def _open_scene(name: str, lamps: Sequence[str], chosen: dict[str, Any], shapes: dict[str, Sequence[str]]) -> Any:
    """Open a scene with the lamps of `--light`, and shapes as `shape_text.shaped` has them. chosen: options of its file."""
    try:
        from airlight.jobs.light_text import PLACE, read_scene_light
        from airlight.jobs.shape_text import shaped
        from airlight.scenes import open_scene
        from airlight.scenes.lamps import relight

        stage = open_scene(name, lamps=bool(lamps), **chosen)
        requested = shaped(stage, shapes, [read_scene_light(text, PLACE) for text in lamps])
        if requested:
            relight(stage, requested)
        return stage
    except ImportError as error:
        raise AirlightError(f"{name}: scenes need more packages ({error}): pip install airlight[scenes]") from None


def in_window(make: Any) -> None:
    """Show make(canvas) in a window until it is closed. Raises MachineError where there is no display."""
    import warnings

    try:
        import glfw
        from rendercanvas.glfw import RenderCanvas, loop
    except ImportError as error:
        raise AirlightError(f"the viewer needs more packages ({error}): {MISSING}") from None
    except Exception as error:  # what a broken display raises while the back end is imported
        raise MachineError(f"no window can be opened ({error}); use --browser, or --screenshot FILE") from None
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        if not glfw.init():
            raise MachineError("no display to open a window on; use --browser, or --screenshot FILE")
        canvas = RenderCanvas(size=SIZE, title=TITLE, max_fps=60)
    make(canvas)
    loop.run()


def offscreen(make: Any, frames: int = 8) -> Any:
    """Draw some frames of make(canvas) without a window, panel and all: (H, W, 4) uint8."""
    from rendercanvas.offscreen import RenderCanvas

    canvas = RenderCanvas(size=SIZE)
    viewer = make(canvas)
    viewer.state.playing, viewer.following.frames.pace = False, AT_ONCE  # the same picture each time
    for _ in range(frames):
        pixels = canvas.draw()
    return np.asarray(pixels)


def view(source: Any, light: Any = None, *, device: str | None = None, size: tuple[int, int] = (1000, 600), **parameters: Any) -> Viewer:
    """Open the live viewer in a notebook cell, which shows it.

    source: an array as airlight.light_shafts takes, a picture's path, or a scene: "table", "flying", a .glb, .gltf, .obj, .ply, .stl file.
    light: as there; a picture's is found where it is not given. parameters: the declared ones. Raises AirlightError.
    """
    missing = "a notebook's view needs more packages ({}): pip install airlight[notebook]"
    try:
        from rendercanvas.anywidget import RenderCanvas
    except ImportError as error:
        raise AirlightError(missing.format(error)) from None
    from airlight.lights import as_lights

    placed = [] if light is None else as_lights(light)
    lights = [LightControl(one.position, one.color, one.strength, kind=one.kind, cookie=one.cookie) for one in placed]
    shown = os.fspath(source) if isinstance(source, (str, os.PathLike)) else from_array(source)
    try:
        return Viewer(RenderCanvas(size=size), shown, values=parameters, lights=lights, device=device)
    except ImportError as error:
        raise AirlightError(missing.format(error)) from None


def from_array(array: Any) -> Picture:
    """Wrap an array as airlight.light_shafts takes it, (H, W), (H, W, 3) or (H, W, 4), as a picture."""
    from airlight.files import to_linear
    from airlight.files.images import of_codes

    pixels = np.asarray(array)
    to_linear(pixels)  # refuses what is no picture
    codes = pixels if pixels.ndim == 3 else pixels[..., None]
    if codes.dtype.kind == "f":
        codes = np.nan_to_num(codes.astype(np.float32), posinf=65504.0, neginf=0.0)
    return of_codes(np.ascontiguousarray(codes), "array")
