"""The scene `flying`: over a bay at sunrise an ornithopter pursues an airship, which follows a looped path around a temple."""

from __future__ import annotations

import numpy as np
import pygfx as gfx
import pylinalg as la

from airlight.planes import smoothstep
from airlight.pygfx import SceneLight
from airlight.scenes import ground
from airlight.scenes.environment import Environment
from airlight.scenes.gltf.load import model
from airlight.scenes.landscape import FAR, land, mountains, sea, slope, square, sunrise, woods
from airlight.scenes.stage import Stage
from airlight.scenes.steering import Path, Run, Vehicle, follow, limited, loop, shadow

SUN = np.array([0.10, 0.095, -1.0]) / np.linalg.norm([0.10, 0.095, -1.0])  # direction to it
FILL = 2.5  # how much brighter the sky lights than it looks, as a photographer's reflector: dark sides keep their texture
SETTLED = 58.5  # seconds of flight before time 0: what the start was no longer matters
CRAFT = 4.2  # size of the craft
MIST = {"sigma_t": (0.0035, 0.0035, 0.0035), "albedo": (1.0, 1.0, 1.0), "anisotropy": 0.4, "max_distance": 140.0, "cascades": 2}
TREES = (  # place, size, turn in degrees
    ((19.0, 4.8, 4.0), 0.9, 20),
    ((-5.0, 4.8, -16.0), 0.62, 250),
    ((47.0, 1.9, 58.0), 0.9, 75),
)


def _island(size: float, top: float, seed: int, flat: float) -> gfx.Mesh:
    """Build an island about the origin, `size` across, its plateau of radius `flat` at the height `top`."""
    n = 512
    x, z = square(n, size)
    rough, fine = ground.noise(n, seed, 2.3, 2), ground.noise(n, seed + 1, 1.6, 12)
    r = np.hypot(x, z) / (1 + 0.10 * rough)
    edge = smoothstep(r, size * 0.48, size * 0.33)
    hills = (0.55 * rough + 0.10 * fine) * smoothstep(np.hypot(x, z), flat * 0.8, flat * 1.4)
    h = edge * (top + hills) - 2.5 * (1 - edge)
    steep = smoothstep(slope(h, size) + 0.12 * fine, 0.55, 1.1)
    patches = 0.5 + 0.5 * np.tanh(ground.noise(n, seed + 2, 1.2, 6))
    albedo = ground.mix(ground.mix((0.10, 0.13, 0.035), (0.23, 0.19, 0.075), patches), (0.24, 0.21, 0.18), steep)
    albedo *= (1 + 0.25 * ground.noise(n, seed + 3, 0.5))[..., None].clip(0.4, 1.6)
    albedo *= ground.mix((0.5, 0.5, 0.5), (1, 1, 1), smoothstep(h, -0.2, 1.0))  # wet below
    return land(h, size, albedo, seed + 4)


def _placed(group: gfx.WorldObject, position: tuple[float, float, float], scale: float = 1.0, turn: float = 0.0) -> gfx.WorldObject:
    group.local.position = position
    group.local.scale = (scale,) * 3
    group.local.rotation = la.quat_from_axis_angle((0, 1, 0), np.radians(turn))
    return group


def _turned(forward: np.ndarray, up: np.ndarray) -> np.ndarray:
    """Compute the rotation (4,) that brings +z to `forward` and +y as near to `up` as can be; unlike `look_at`, from no rotation before."""
    z = forward / np.linalg.norm(forward)
    x = np.cross(up, z)
    x /= np.linalg.norm(x)
    matrix = np.eye(4)
    matrix[:3, :3] = np.stack([x, np.cross(z, x), z], axis=1)
    return np.asarray(la.quat_from_mat(matrix))


def _fly(craft: gfx.WorldObject, vehicle: Vehicle) -> None:
    """Put a craft (nose to +z) where its vehicle is, nose along the velocity, banked into the turn as the force asks (Reynolds)."""
    craft.local.position = vehicle.position
    craft.local.rotation = _turned(vehicle.velocity, np.array([0, 9.81, 0]) + limited(vehicle.force, 9.81))


def _look(camera: gfx.PerspectiveCamera, eye: np.ndarray, target: np.ndarray) -> None:
    camera.local.position = eye
    camera.local.rotation = _turned(eye - target, np.array([0.0, 1.0, 0.0]))


def flight(seed: int) -> tuple[Path, Run]:
    """Plan the path, and the flight of the two craft: 0 follows the path, 1 pursues 0."""
    path = Path(loop(seed, radius=46, height=24, rise=5, wander=0.16) + np.array([12, 0, -8]), radius=6, samples=512)
    start = path.at(0)
    ahead = path.at(1) - start
    leader = Vehicle(start, 15 * ahead, max_speed=15, max_force=14)
    hunter = Vehicle(start - 60 * ahead + np.array([0, 10, 0]), 10 * ahead, max_speed=21, max_force=22)
    return path, Run(
        [leader, hunter],
        [
            lambda now, i: follow(now[i], path, ahead=0.5, response=0.5),
            lambda now, i: shadow(now[i], now[0], behind=24, slowing=30, response=0.7),
        ],
    )


def _lap(path: Path, run: Run) -> float:
    """Measure the seconds of a lap of vehicle 0 once it is settled: from one passing of its place at SETTLED to the next."""
    length, k = path.length, round(SETTLED * run.rate)
    start, done, before = path.nearest(run.step(k)[0].position)[0], 0.0, 0.0
    last = start
    while done < length:
        k += 1
        here = path.nearest(run.step(k)[0].position)[0]
        before, done = done, done + (here - last + length / 2) % length - length / 2
        last = here
    return (k - (done - length) / (done - before)) / run.rate - SETTLED


def _surroundings(scene: gfx.Scene) -> list[gfx.Mesh]:
    """Build sky, sea, mountains and islands with what stands on them; give the mountains."""
    ranges = []
    picture = ground.sky(SUN, 768, 5)
    scene.add(gfx.Background(None, gfx.BackgroundSkyboxMaterial(map=Environment(picture).cube(512))))
    Environment(FILL * picture).surround(scene, background=False)
    scene.add(sea(FILL))
    for far, height, seed, haze in ((3000.0, 330.0, 31, 0.74), (1900.0, 150.0, 32, 0.55), (1000.0, 46.0, 37, 0.33)):
        ranges.append(mountains(SUN, far, height, seed, haze))
    scene.add(*ranges)
    isle, near = _island(116, 5.0, 21, 30), _island(44, 2.2, 25, 8)
    isle.local.position, near.local.position = (-13, 0, -2), (47, 0, 56)
    isle.receive_shadow = near.receive_shadow = True
    scene.add(isle, near, _placed(model("temple")[0], (-28, 4.7, 0), 1.0, 62))
    for place, size, turn in TREES:
        tree = _placed(model("oak")[0], place, size, turn)
        for part in _meshes(tree):
            if part.material.alpha_test > 0:
                part.material.alpha_test = 0.65  # finer leaves, more sky between them
        scene.add(tree)
    return ranges


def _meshes(root: gfx.WorldObject) -> list[gfx.Mesh]:
    return [thing for thing in root.iter() if isinstance(thing, gfx.Mesh)]


def flying(seed: int = 4) -> Stage:
    """Build the stage; its duration is one lap, after which everything is where it was. seed: the loop's shape."""
    scene = gfx.Scene()
    ranges = _surroundings(scene)
    centre = np.array([0.0, 10.0, 10.0])
    disc, sun = sunrise(centre, SUN, 95)
    (airship, _), (ornithopter, flap) = model("airship"), model("ornithopter")
    for craft in (airship, ornithopter):
        craft.local.scale = (CRAFT,) * 3
    path, run = flight(seed)
    duration = _lap(path, run)
    line = gfx.Line(
        gfx.Geometry(positions=np.concatenate([path.points, path.points[:1]]).astype(np.float32)),
        gfx.LineMaterial(color="#ffd27f", thickness=2.0),
        visible=False,
    )
    scene.add(disc, sun.target, airship, ornithopter, line)
    for thing in (part for root in scene.children if isinstance(root, gfx.Group) for part in _meshes(root)):
        thing.cast_shadow = thing.receive_shadow = True

    watch = gfx.PerspectiveCamera(45, 16 / 9, depth_range=(0.5, 2 * FAR))
    chase = gfx.PerspectiveCamera(55, 16 / 9, depth_range=(0.5, 2 * FAR))
    beats = round(duration / 0.8)  # a whole number, so that the loop closes

    def pose(t: float, camera: gfx.PerspectiveCamera | None = None) -> None:
        phase = t / duration % 1.0
        first, second = run.at(SETTLED + phase * duration)
        _fly(airship, first)
        _fly(ornithopter, second)
        flap(phase * beats)  # the clip is one beat and a second long
        if camera is watch:  # sways from side to side, and turns a little after the craft
            sway = 2 * np.pi * (phase + 0.75)
            eye = np.array([12 + 6 * np.sin(sway), 9 + 1.5 * np.cos(sway), 106])
            middle = 0.7 * (eye + 100 * SUN) + 0.3 * first.position
            _look(watch, eye, middle * (0.7, 0.75, 1))
        elif camera is chase:
            back = second.velocity / np.linalg.norm(second.velocity)
            _look(chase, second.position - 22 * back + (0, 5, 0), first.position * 0.6 + second.position * 0.4)

    cameras = {"watch": watch, "chase": chase}
    for camera in cameras.values():
        pose(0.0, camera)
    light = SceneLight(target=disc, screen_tint=(0.7, 0.7, 0.7))
    clear = {"hazy": tuple(ranges), "clear": woods()}
    return Stage("flying", scene, cameras, [light], duration, pose, centre, 90.0, path=line, settings=MIST, **clear)
