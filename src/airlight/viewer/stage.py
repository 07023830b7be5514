"""A 3-D scene with its shafts on the canvas: pygfx draws it, `airlight.pygfx.LightShafts` adds them, a controller steers the camera."""

from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import msgspec
import numpy as np
import pygfx as gfx
from pygfx.utils.viewport import Viewport

from airlight.jobs.seen import doubt_of_pass
from airlight.lights.punctual import Triple, triple
from airlight.medium.resolve import without_air
from airlight.options import March, Parameters, SceneOptions
from airlight.options.scene import RESOLUTION
from airlight.pygfx import LightShafts, SceneLight, use_hdr
from airlight.pygfx.divided import DividedRenderer
from airlight.pygfx.origin import near_origin
from airlight.pygfx.particles import follow, undrawn
from airlight.pygfx.private import extent
from airlight.scatter.methods import METHODS
from airlight.scenes.exposure import METERED_WIDTH, Exposure, may_need
from airlight.scenes.offline import Shot, Studio
from airlight.scenes.origin import origin
from airlight.viewer import controls
from airlight.viewer.aimed import Shapes, describe, shape_of
from airlight.viewer.daylight import DaylightOfView
from airlight.viewer.state import Eye, LightControl, ViewerState, open_defaults, resolve_medium


def numbered(density: Any) -> bool:
    """Tell whether a density follows the number of the frame."""
    return hasattr(density, "written") and "#" in getattr(density.written, "path", getattr(density.written, "source", ""))


Area = tuple[float, float, float, float]
DRAFT_STEPS, DRAFT_MAP = 32, 1024  # of a march: no more steps, and no larger shadow maps; half as large where pixels are few
AIR_SECONDS = 600.0  # of a still scene in whose air something moves, or the cookie of a light
FEW = 0.4  # of width and height


def drafts(parameters: Parameters, scene: SceneOptions, march: March, share: float) -> tuple[Parameters, SceneOptions, March]:
    """Make quicker ones, for pictures while things move. share: of width and height."""
    most = DRAFT_MAP // 2 if share < FEW else DRAFT_MAP
    steps = march.steps if isinstance(march.steps, int) else DRAFT_STEPS
    size = most if march.shadow_size is None else march.shadow_size
    return (
        msgspec.structs.replace(parameters, quality="draft"),
        msgspec.structs.replace(scene, resolution=min(scene.share(parameters), RESOLUTION)),
        msgspec.structs.replace(march, steps="table" if march.steps == "table" else min(steps, DRAFT_STEPS), shadow_size=min(size, most)),
    )


class SceneView:
    """Shows stages (`airlight.scenes.Stage`), one after the other, with one renderer and one LightShafts."""

    def __init__(self, canvas: Any) -> None:
        self.canvas = canvas
        self.renderer = DividedRenderer(canvas, pixel_scale=1, ppaa="none", enable_events=False)
        use_hdr(self.renderer)
        self.viewport = Viewport.from_viewport_or_renderer(self.renderer)
        self.shafts: Any = None
        self.dt = 0.0
        self.stage: Any = None
        self.camera: Any = None
        self.controller: Any = None
        self.saved: dict[str, Any] = {}
        self.moved: set[int] = set()  # the lights that were
        self.shapes = Shapes()
        self.posed: Any = None
        self.clip = np.eye(4)  # from world to clip space, of the camera as it was posed last
        self.daylight = DaylightOfView()
        self._events: list[dict[str, Any]] = []  # that steer, of which nothing was made yet

    def open(self, stage: Any, state: ViewerState, lamps: Sequence[str] = ()) -> None:
        """Show another stage, and let the state say what it has. lamps: the options that its lights were written as."""
        self.stage, self.opened = stage, self.opened + 1
        self.saved = {name: camera.get_state() for name, camera in stage.cameras.items()}
        names = tuple(stage.cameras)
        state.eye = Eye(name=names[0], names=names)
        state.duration, state.time, state.playing = stage.duration, 0.0, stage.duration > 0
        state.lights = [self._light_control(light, stage) for light in stage.lights]
        others = [control for control in state.lights if control.written is None]
        for control, text in zip(others, lamps if len(lamps) == len(others) else ()):
            control.written = text
        state.lights_before = [replace(control) for control in state.lights]
        open_defaults(state, stage.settings)
        state.path_drawn, state.automatic = (False if stage.path is not None else None), {"mix": 1.0}
        self.camera = self.controller = self.posed = None
        if self.shafts is None:
            self.shafts = LightShafts(self.renderer, stage.scene, stage.cameras[names[0]], stage.lights)
            self.shafts.doubts = False  # the panel tells
            self.renderer.effect_passes = [self.shafts]
            self.renderer.ppaa = "fxaa"  # after the shafts, on tones
        self.shafts.scene, self.shafts.lights, self.shafts.radius = stage.scene, list(stage.lights), stage.radius
        self.shafts.fields = stage.fields
        self._expose(state)
        self.dt, self.moved, self.shapes = 0.0, set(), Shapes()

    def relit(self, state: ViewerState) -> None:
        """Let the state say what lights the stage has now, and expose it anew."""
        stage = self.stage
        state.lights = [self._light_control(light, stage) for light in stage.lights]
        self.moved, self.shapes = set(), Shapes()
        state.lights_before = [replace(control) for control in state.lights]
        self.shafts.lights = list(stage.lights)
        self._expose(state)

    def _expose(self, state: ViewerState) -> None:
        """Measure the automatic exposure of the stage from its first camera, by the state's method; it stays while the stage is shown."""
        stage, exposure = self.stage, Exposure()
        if may_need(stage):
            parameters, composite, in_scene, medium, march = state.structs[:5]
            more: Any = {"medium": medium, "march": march}
            exposure = Studio(stage, Shot(METERED_WIDTH, METERED_WIDTH * 9 // 16, 1), parameters, composite, in_scene, **more).exposure
        self.shafts.pre_exposure, self.shafts.automatic_ev = exposure.pre, exposure.ev
        state.automatic["ev"] = exposure.ev

    @staticmethod
    def _light_control(light: SceneLight, stage: Any) -> LightControl:
        place = light.homogeneous()
        position = tuple(round(float(v), 5) for v in place[:3])
        movable = light is stage.movable or any(light.target is one for one in stage.draggable)
        made = LightControl(position, light.color, light.strength, movable, direction=bool(place[3] == 0))
        made.density, made.extinction = light.density, light.extinction
        describe(made, light, stage.radius)
        return made

    def _apply_lights(self, state: ViewerState) -> None:
        for i, (light, control, before) in enumerate(zip(self.stage.lights, state.lights, state.lights_before, strict=True)):
            self.shapes.apply(i, light, control, before, self.stage)
            if control.aim is not None:
                continue
            light.color, light.strength = control.color, control.strength
            light.density, light.extinction = control.density, control.extinction
            if not control.movable or (control.position == before.position and i not in self.moved):
                continue
            self.moved.add(i)  # then it has to be put back, too
            if light.target is None and light.position is not None:
                light.position = triple(control.position)
            elif light.target is None:
                if any(control.position):
                    light.direction = triple(control.position)
            elif isinstance(light.target, gfx.DirectionalLight):
                towards = light.homogeneous()[:3]
                about = np.asarray(light.target.world.position) - towards
                if any(control.position):
                    way = np.asarray(control.position) / np.linalg.norm(control.position)
                    light.target.world.position = about + way * np.linalg.norm(towards)
            else:
                light.target.world.position = control.position

    def _steer(self, state: ViewerState) -> None:
        """Choose the camera and the controller that the state says."""
        eye = state.eye
        camera = self.stage.cameras[eye.name]
        kind = gfx.FlyController if eye.fly else gfx.OrbitController
        again = camera is not self.camera
        if again or (not eye.moved and self.was_moved):
            camera.set_state(self.saved[eye.name])
            self.posed = None
        if again or type(self.controller) is not kind or (not eye.moved and self.was_moved):
            self.camera = self.shafts.camera = camera
            self.controller = None
        if self.controller is None:
            self._pose(state)
            if kind is gfx.OrbitController:
                self._look_from(self.stage.center)
                self.controller = kind(camera)
            else:
                self.controller = kind(camera, speed=0.4 * self.stage.radius)
        self.was_moved = eye.moved

    was_moved = False
    opened = 0  # stages so far

    def _look_from(self, center: Any) -> None:
        """Let orbits go around what lies as far ahead as the middle of the scene: a controller tells the distance by width and height."""
        camera = self.camera
        ahead = np.asarray(camera.world.forward, float)
        distance = max(float((np.asarray(center) - camera.world.position) @ ahead), 0.1 * self.stage.radius)
        if camera.depth_range is None:
            camera.depth_range = camera.near, camera.far  # which would follow width and height
        scale = extent(camera.fov, distance) / (0.5 * (camera.width + camera.height))
        camera.width, camera.height = camera.width * scale, camera.height * scale

    def _pose(self, state: ViewerState) -> None:
        pose = (state.time, state.eye.name, state.eye.moved)
        if pose != self.posed:
            self.stage.pose(state.time, None if state.eye.moved else self.camera)
            self.posed = pose

    def _blow(self, state: ViewerState) -> None:
        """Let time pass in a still scene too, as long as something moves in its air."""
        air = (any(state.medium.wind) and state.medium.noise_amount > 0) or any(numbered(one) for one in self.shafts.fields)
        moves = self.stage.cookies or (air and METHODS[state.parameters.method].lights_medium)
        duration = self.stage.duration or (AIR_SECONDS if moves else 0.0)
        if duration != state.duration:
            state.duration, state.playing = duration, duration > 0
            state.time = min(state.time, duration)

    def handle(self, event: dict[str, Any]) -> None:
        """Steer by an event of the canvas, at the next `update`: until then the camera may be elsewhere, near the origin."""
        self._events.append(event)

    def update(self, state: ViewerState, dt: float) -> bool:
        """Pose everything as the state says. dt: seconds since the last frame. True if another frame has to follow."""
        self.dt = dt
        self._blow(state)
        self._steer(state)
        for event in self._events:
            self.controller.handle_event(SimpleNamespace(type=event["event_type"], **event), self.viewport)
        self._events.clear()
        moving = self.controller.tick() is not None
        if moving:
            state.eye.moved = self.was_moved = True
        self._pose(state)
        self.daylight.follow(self, state)
        self._apply_lights(state)
        if self.stage.path is not None:
            self.stage.path.visible = bool(state.path_drawn)
        eye, camera = state.eye, self.camera
        self.clip = np.asarray(camera.projection_matrix @ camera.view_matrix, np.float64)
        eye.eye = triple(camera.world.position)
        eye.fov = float(camera.fov)
        ahead = np.asarray(camera.world.forward, float)
        distance = max(float((self.stage.center - np.asarray(eye.eye)) @ ahead), 0.1 * self.stage.radius)
        eye.target = triple(np.asarray(eye.eye) + distance * ahead)
        resolve_medium(state, float(np.linalg.norm(self.stage.center - eye.eye)), self.stage.radius)
        if self.stage.fields:
            state.doubt = ""  # what lies in the air may well be seen
        if (medium := self.shafts.resolved_medium) is not None:  # by the height of what was drawn
            has_units = METHODS[state.parameters.method].has_units
            of_pass = has_units and doubt_of_pass(self.shafts, medium, self.shafts.layer.size[1])
            lines = without_air(medium), state.doubt, of_pass, self.shafts.lacks
            state.doubt = next((line for line in lines if line), "")
            state.automatic |= {"fog_depth": medium.fog_depth, "air": medium.air, "sun_extinction": medium.sun_extinction}
        state.automatic["jitter"], state.automatic["resolution"] = state.parameters.offset, state.in_scene.share(state.parameters)
        return moving

    def key(self, state: ViewerState) -> tuple[Any, ...]:
        """Collect what says what is seen, but for what the state says."""
        return id(self.stage), self.camera.world.matrix.tobytes(), self.camera.projection_matrix.tobytes()

    def _surfaces(self, state: ViewerState) -> tuple[Any, ...]:
        """Collect what says what surfaces look like, before the shafts."""
        lights = tuple((tuple(c.position), c.color, c.strength, shape_of(c)) for c in state.lights)
        about = self.daylight.key, self.shafts.pre_exposure, self.shafts.panes.way
        return self.opened, state.time, state.path_drawn, lights, self.key(state), *about

    def show(self, state: ViewerState, texture: Any, share: float = 1.0, settles: bool = False) -> None:
        """Draw onto a texture of the canvas's size. share: of its width and height, that is drawn, below 1 a draft; settles: light
        adaptation does at once. Raises AirlightError for parameters that do not go together."""
        shafts, stage = self.shafts, self.stage
        parameters, shafts.composite, scene, shafts.medium, march = state.structs[:5]
        if share < 1:
            parameters, scene, march = drafts(parameters, scene, march, share)
        shafts.parameters, shafts.in_scene, shafts.march, shafts.daylight = parameters, scene, march, stage.daylight
        shafts.enabled, shafts.debug, shafts.timing = state.shafts or bool(state.debug), state.debug, state.timing
        bodies = [tuple(c.position) for c, light in zip(state.lights, stage.lights, strict=True) if light.target is not None]
        shafts.still = self.opened, state.time, *bodies
        shafts.dt, shafts.time, shafts.fields = 0.0 if settles else self.dt, state.time, stage.fields
        follow((*stage.fields, *stage.cookies), state.time, stage.fps)
        self.renderer.pixel_scale, self.renderer.texture = share, texture
        self.renderer.pixel_filter = "linear" if share < 1 else "mitchell"  # which takes as long as a draft's all else
        origin_of_view = origin(stage.center, stage.radius, self.camera)
        with near_origin(stage.scene, self.camera, origin_of_view, shafts.lights), undrawn(stage.fields):
            self.renderer.show(stage.scene, self.camera, self._surfaces(state))
        if state.timing:
            state.passes = shafts.profile()

    # where lights are in the view

    def marks(self, state: ViewerState, area: Area) -> list[tuple[float, float] | None]:
        """Find where the movable lights are on the canvas."""
        if self.camera is None:
            return [None for _ in state.lights]
        clip, eye = self.clip, np.asarray(state.eye.eye)
        return [
            controls.project(eye + np.asarray(control.position) if control.direction else control.position, clip, area)
            for control in state.lights
        ]

    def aims(self, state: ViewerState, area: Area) -> list[tuple[float, float] | None]:
        """Find where on the canvas projectors shine to."""
        if self.camera is None:
            return [None for _ in state.lights]
        return [controls.project(c.aim, self.clip, area) if c.aim is not None and c.movable else None for c in state.lights]

    def dragged(self, state: ViewerState, number: int, to: tuple[float, float], area: Area, aim: bool = False) -> Triple:
        """Put a light, or where it aims, by dragging its mark: at its distance from the eye's plane; a sun, in that direction."""
        control = state.lights[number]
        if aim and control.aim is not None:
            return controls.drag_in_view(control.aim, to, self.clip, area)
        if control.direction:
            return controls.toward_in_view(to, self.clip, state.eye.eye, area)
        return controls.drag_in_view(control.position, to, self.clip, area)

    def pixels_shown(self) -> np.ndarray:
        """Read back the last frame without the panel: (H, W, 3) float32 linear."""
        seen = self.renderer.snapshot()[..., :3].astype(np.float32)
        return np.ascontiguousarray(np.clip(seen, 0, 1))
