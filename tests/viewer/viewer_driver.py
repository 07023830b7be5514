"""Drive the viewer offscreen by events, with pictures and scenes for its tests."""

import os
import shlex
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import strategies as some

from airlight.cli import render as render_command
from airlight.cli.options import gather
from airlight.look.apply import apply
from airlight.options import Look, declared
from airlight.viewer import app, command
from airlight.viewer.frames import AT_ONCE
from airlight.viewer.state import ViewerState

SIZE, SCENE_SIZE = (1280, 720), (800, 560)
CLASSIC = {"look": "classic"}


class Driver:
    """A viewer on an offscreen canvas, and hands: the one place that touches the canvas's private `_process_events`."""

    def __init__(self, source: Any, folder: Path, **options: Any) -> None:
        from rendercanvas.offscreen import RenderCanvas

        self.canvas = RenderCanvas(size=SIZE)
        self.viewer = app.Viewer(self.canvas, source, folder=str(folder), **{"pace": AT_ONCE, **options})
        self.state = self.viewer.state
        self.frame(3)

    @property
    def places(self) -> Any:
        return self.viewer.panel.places

    def frame(self, count: int = 1) -> np.ndarray:
        for _ in range(count):
            self.canvas._process_events()
            pixels = self.canvas.draw()
        return np.asarray(pixels)[..., :3]

    def event(self, kind: str, at: tuple[float, float], **more: Any) -> None:
        buttons = {"button": 0, "buttons": (), "modifiers": (), "ntouches": 0, "touches": {}}
        self.canvas.submit_event({"event_type": kind, "x": at[0], "y": at[1], **buttons, **more})
        self.frame()

    def drag(self, start: tuple[float, float], end: tuple[float, float], steps: int = 3) -> None:
        self.event("pointer_move", start)
        self.event("pointer_down", start, button=1, buttons=(1,))
        for i in range(1, steps + 1):
            at = (start[0] + (end[0] - start[0]) * i / steps, start[1] + (end[1] - start[1]) * i / steps)
            self.event("pointer_move", at, buttons=(1,))
        self.event("pointer_up", end, button=1)
        self.frame()

    def where(self, name: str, along: float = 0.5) -> tuple[float, float]:
        """A place in a widget, which is scrolled to."""
        for _ in range(40):
            bottom = self.places["message"][1] - 12 if "message" in self.places else self.canvas.get_logical_size()[1] - 8
            x0, y0, x1, y1 = self.places[name]
            if (y0 >= 0 and y1 <= bottom) or ":" in name or name == "message":
                break
            self.event("pointer_move", (60.0, 300.0))
            self.event("wheel", (60.0, 300.0), dx=0, dy=-60 if y0 < 0 else 60)
            self.frame(2)
        x0, y0, x1, y1 = self.places[name]
        return x0 + along * (x1 - x0), (y0 + y1) / 2

    def click(self, name: str, along: float = 0.5) -> None:
        at = self.where(name, along)
        self.drag(at, at, 1)

    def choose(self, name: str, choice: str) -> None:
        self.click(name)
        self.frame()
        self.click(f"{name}:{choice}", 0.2)
        self.frame(2)

    def open_group(self, name: str) -> None:
        self.click(f"group {name}", 0.2)
        self.frame()

    def type(self, name: str, text: str) -> None:
        self.click(name)
        held = ("Control",)
        for kind, key in (("key_down", "Control"), ("key_down", "a"), ("key_up", "a")):
            self.canvas.submit_event({"event_type": kind, "key": key, "modifiers": held})
            self.frame()
        self.canvas.submit_event({"event_type": "key_up", "key": "Control", "modifiers": ()})
        self.frame()
        for letter in text:
            self.canvas.submit_event({"event_type": "char", "data": letter, "is_composing": False, "modifiers": ()})
        self.frame(2)


def applied(driver: Driver, pixels: np.ndarray, **look: Any) -> Any:
    """What the look makes of these pixels with the driver's lights."""
    from airlight import Renderer
    from airlight.files import to_linear

    lights = [control.image_light() for control in driver.state.lights]
    linear = to_linear(pixels)[0] if pixels.dtype == np.uint8 else pixels
    return apply(Renderer(), pixels, linear, lights, Look(**look), float_output=pixels.dtype != np.uint8)


def saved(driver: Driver) -> str:
    """The line that says what became of saving."""
    for _ in range(2000):
        driver.frame()
        if driver.viewer.saving is None and not driver.state.requests:
            return driver.state.message
        time.sleep(0.02)
    pytest.fail("it does not end")


def some_values(scenes: bool = True) -> Any:
    """Values of declared parameters, in their bounds; few at a time. scenes: also choices that only scenes have."""
    kinds: dict[str, Any] = {}
    own = {} if scenes else {d.name: d for d in declared()}
    for d in (own.get(d.name, d) for d in declared(scenes=True)):
        if d.choices:
            kinds[d.name] = some.sampled_from(d.choices)
        elif d.kind is bool:
            kinds[d.name] = some.booleans()
        elif d.kind is int:
            kinds[d.name] = some.integers(int(d.low), int(d.high)) | some.sampled_from(d.words or (int(d.low),))
        elif d.kind is float:
            kinds[d.name] = some.floats(d.low, d.high, exclude_min=d.low_open)
            kinds[d.name] = some.tuples(*[kinds[d.name]] * 3) | kinds[d.name] if d.is_triple else kinds[d.name]
        else:
            kinds[d.name] = some.from_regex("#[0-9a-f]{6}", fullmatch=True)
    return some.fixed_dictionaries({}, optional=kinds)


def resident() -> int:
    """Bytes."""
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def stage(name: str = "two boxes", **_: Any) -> Any:
    """A lamp that can be moved behind two boxes, one of which turns."""
    import pygfx as gfx

    from airlight.pygfx import SceneLight
    from airlight.scenes import Stage

    scene = gfx.Scene()
    scene.add(gfx.Background.from_color("#203040"), gfx.AmbientLight(intensity=0.5))
    boxes = [gfx.Mesh(gfx.box_geometry(1, 1, 1), gfx.MeshPhongMaterial(color="#a05030")) for _ in range(2)]
    boxes[0].local.position, boxes[1].local.position = (-1, 0, 0), (1.2, 0.3, 0)
    lamp = gfx.Mesh(gfx.sphere_geometry(0.4), gfx.MeshBasicMaterial(color="#ffffff"))
    lamp.local.position = (0, 0.5, -3)
    scene.add(*boxes, lamp)
    cameras = {}
    for key, x in (("front", 0.0), ("side", 4.0)):
        cameras[key] = gfx.PerspectiveCamera(50, depth_range=(0.1, 100))
        cameras[key].local.position = (x, 0.5, 6)
        cameras[key].look_at((0, 0, 0))
    light = SceneLight(target=lamp)

    def pose(t: float, camera: Any) -> None:
        boxes[0].local.euler_y = t
        if camera is cameras["side"]:
            camera.local.position = (4, 0.5 + 0.1 * t, 6)

    path = gfx.Line(gfx.Geometry(positions=np.array([[-2, -1, 0], [2, -1, 0]], np.float32)), gfx.LineMaterial(thickness=9, color="#ff0000"))
    path.visible = False
    scene.add(path)
    return Stage(name, scene, cameras, [light], 4.0, pose, np.zeros(3), 3.0, light, path)


def read_by_render(state: ViewerState) -> tuple[dict[str, Any], Any]:
    words = shlex.split(command.as_text(command.command_line(state)))
    assert words[:2] == ["airlight", "render"]
    with render_command.render.make_context("render", words[2:]) as ctx:
        return gather(ctx, None), ctx.params
