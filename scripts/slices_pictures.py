"""Makes the pictures of docs/slices.md: python scripts/slices_pictures.py FOLDER [NAME ...]

The figures of the chapter "Light Shaft Rendering" (Mitchell 2004) with a room of our own: a projector high on the left shines through a
window's bars, a slide or coloured glass past a chair. Without names all are made, each as NAME.N.png in the folder; `times` prints what
clipping saves.
"""

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pygfx as gfx
from pictures import read
from PIL import Image

from airlight.lights.shape import Cookie
from airlight.options import March, Medium, Parameters, SceneOptions, build
from airlight.options.presets import load
from airlight.pygfx import SceneLight
from airlight.pygfx.effect import enable_timing
from airlight.pygfx.projector import Projector
from airlight.scenes.offline import Shot, Studio
from airlight.scenes.stage import Stage

SIZE = 480, 270
LAMP, AIM = (-3.4, 3.6, -0.6), (1.6, 0.0, -1.2)
PHOTOGRAPH = Path(__file__).parent.parent / "examples/photos/casa-mila.jpg"


def bars() -> np.ndarray:
    """A window of three by four panes, soft at their edges."""
    y, x = np.mgrid[0:256, 0:192]
    inside = [np.minimum(one % side, side - one % side) for one, side in ((x, 64), (y, 64))]
    return np.repeat(np.clip((np.minimum(*inside) - 5) / 3, 0, 1)[..., None], 3, axis=2)


def glass() -> np.ndarray:
    """Panes of eight colours between leads."""
    colours = np.array([(0.9, 0.1, 0.05), (0.05, 0.2, 0.9), (0.95, 0.7, 0.1), (0.1, 0.6, 0.15), (0.7, 0.15, 0.6), (0.95, 0.9, 0.8)])
    y, x = np.mgrid[0:256, 0:192]
    return bars() * colours[(x // 64 * 5 + y // 64 * 2) % len(colours)]


def slide() -> np.ndarray:
    """The middle of a photograph."""
    codes = read(str(PHOTOGRAPH))[:, :, :3].astype(float) / 255
    side = min(codes.shape[:2])
    top, left = ((size - side) // 2 for size in codes.shape[:2])
    step = max(side // 256, 1)
    return codes[top : top + side : step, left : left + side : step] ** 2.2


COOKIES = {"white": None, "bars": bars, "glass": glass, "slide": slide}


def box(scene: gfx.Scene, size: Any, place: Any, colour: str) -> None:
    mesh = gfx.Mesh(gfx.box_geometry(*size), gfx.MeshStandardMaterial(color=colour, roughness=0.9, metalness=0))
    mesh.local.position = place
    mesh.cast_shadow = mesh.receive_shadow = True
    scene.add(mesh)


def room(cookie: str = "bars", **more: Any) -> Stage:
    """A dark room with a chair and two crates in a projector's light."""
    scene = gfx.Scene()
    scene.add(gfx.Background.from_color("#050608"), gfx.AmbientLight("#8090a8", 0.5))
    box(scene, (12, 0.1, 8), (0, -0.05, -1), "#5a4632")
    box(scene, (12, 5, 0.1), (0, 2.5, -4), "#6a6258")
    for x in (-0.25, 0.25):
        for z in (-1.45, -0.95):
            box(scene, (0.06, 0.55, 0.06), (x, 0.275, z), "#3b2717")
    box(scene, (0.6, 0.06, 0.6), (0, 0.58, -1.2), "#4a3120")
    for y in (0.8, 1.0, 1.2, 1.4):
        box(scene, (0.06, 0.09, 0.56), (0.27, y, -1.2), "#4a3120")
    for z in (-1.45, -0.95):
        box(scene, (0.06, 0.9, 0.06), (0.27, 1.05, z), "#3b2717")
    box(scene, (0.8, 0.8, 0.8), (1.9, 0.4, -2.3), "#503c28")
    box(scene, (0.5, 0.5, 0.5), (-1.7, 0.25, 0.2), "#503c28")
    made = COOKIES[cookie]
    lamp = Projector("#fff1dc", 260, fov=(26, 34), near=0.6, far=8.0, cookie=None if made is None else Cookie(made()), **more)
    lamp.cast_shadow = True
    lamp.local.position, lamp.target.local.position = LAMP, AIM
    scene.add(lamp, lamp.target)
    camera = gfx.PerspectiveCamera(48, SIZE[0] / SIZE[1], depth_range=(0.05, 100))
    camera.local.position = (0.2, 1.6, 4.2)
    camera.look_at((-0.1, 1.35, -1.2))
    return Stage("room", scene, {"front": camera}, [SceneLight(lamp)], 0.0, lambda t, c=None: None, np.array([0.0, 1.2, -1.0]), 4.0)


def draw(to: Path, stage: Stage, time: float = 0.0, **values: Any) -> np.ndarray:
    """Film a stage with the preset, or a method of `values`, as a picture (H, W, 3) uint8."""
    built = build(({} if "method" in values else load("shaderx3")) | {"shadow_size": 1024} | values)
    shot, scene = Shot(*SIZE, samples=1, smooth=True), built[SceneOptions]
    studio = Studio(stage, shot, built[Parameters], in_scene=scene, medium=built[Medium], march=built[March])
    codes = np.asarray(np.clip(studio.frame(time).pixels(), 0, 1) * 255 + 0.5, np.uint8)
    Image.fromarray(codes).save(to)
    print(to)
    return codes


PLAIN = {"plane_noise": False}


def falloff(to: Path) -> None:
    for n, kind in enumerate(("none", "inverse", "inverse-square", "ambient")):
        draw(to / f"falloff.{n}.png", room("white"), plane_falloff=kind, **PLAIN)


def cookies(to: Path) -> None:
    for n, name in enumerate(COOKIES):
        draw(to / f"cookies.{n}.png", room(name), **PLAIN)


def shadows(to: Path) -> None:
    for n, shadow in enumerate((False, True)):
        draw(to / f"shadows.{n}.png", room(), plane_shadow=shadow, **PLAIN)


def noise(to: Path) -> None:
    for n, more in enumerate(({"plane_noise": False}, {"plane_noise": True})):
        draw(to / f"noise.{n}.png", room("white"), **more)


def planes(to: Path) -> None:
    for n, more in enumerate(({"planes": 25}, {"planes": 50}, {"planes": 100}, {"planes": 25, "plane_blur": 12, "plane_blur_radius": 5.0})):
        draw(to / f"planes.{n}.png", room(), **PLAIN, **more)


def mask(to: Path) -> None:
    """A part of the picture, twice as large and twice as bright."""
    for n, channels in enumerate((False, True)):
        codes = draw(to / f"mask.{n}.png", room("white"), plane_mask=channels, plane_falloff="inverse-square", **PLAIN)
        part = np.clip(codes[20:155, 110:350].astype(float) * 2, 0, 255).astype(np.uint8)
        Image.fromarray(part.repeat(2, axis=0).repeat(2, axis=1)).save(to / f"mask.{n}.png")


def medium(to: Path) -> None:
    air = {"sigma_t": 0.08, "albedo": 0.95, "anisotropy": 0.3, "max_distance": 12.0, "resolution": 0.5, "ev": 3.0}
    for n, more in enumerate(({"method": "march", "steps": 64}, {"method": "slices"}, {"method": "slices", "planes": 16, "plane_cell": 4})):
        draw(to / f"medium.{n}.png", room("glass"), **air, **more)


def earlier(to: Path) -> None:
    for n, method in enumerate(("slices-extruded", "slices-diced", "slices-thickness", "slices-printed")):
        more = {} if n < 3 else {"plane_noise": False}
        draw(to / f"earlier.{n}.png", room(), 2.0, method=method, resolution=1.0, **more)


def times(to: Path) -> None:
    """Print what clipping saves: the passes of the slices alone, medians of interleaved frames."""
    found: dict[bool, list[float]] = {True: [], False: []}
    studios = {}
    for clip in found:
        built = build(load("shaderx3") | {"plane_clip": clip, "shadow_size": 1024})
        shot = Shot(*SIZE, samples=1)
        studios[clip] = Studio(room(), shot, built[Parameters], in_scene=built[SceneOptions], medium=built[Medium], march=built[March])
        studios[clip].shafts.timing = True
    for _ in range(9):
        for clip, studio in studios.items():
            studio.frame()
            found[clip].append(sum(ms for label, ms in studio.shafts.profile() if label.startswith("slices projector")))
    cut, whole = (float(np.median(found[clip])) for clip in (True, False))
    print(f"clipped {cut:.1f} ms, not clipped {whole:.1f} ms: {whole / cut:.1f} times")


FIGURES = {one.__name__: one for one in (falloff, cookies, shadows, noise, planes, mask, medium, earlier, times)}

if __name__ == "__main__":
    folder, *names = sys.argv[1:]
    Path(folder).mkdir(exist_ok=True)
    enable_timing()  # before anything is on the device
    for name in names or FIGURES:
        FIGURES[name](Path(folder))
