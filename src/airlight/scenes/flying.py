"""The scene `flying`: over a bay at sunrise an ornithopter pursues an airship, which follows a looped path around a temple."""

from __future__ import annotations

import numpy as np
import pygfx as gfx
import pylinalg as la

from airlight.pygfx import SceneLight
from airlight.scenes import Stage, ground
from airlight.scenes.environment import Environment
from airlight.scenes.gltf.load import model
from airlight.scenes.steering import Path, Run, Vehicle, follow, limited, loop, shadow

SUN = np.array([0.10, 0.095, -1.0]) / np.linalg.norm([0.10, 0.095, -1.0])  # direction to it
SUN_RADIANCE = (16.0, 10.0, 4.5)
FILL = 2.5  # how much brighter the sky lights than it looks, as a photographer's reflector: dark sides keep their texture
SUN_ANGLE = np.radians(1.1)  # half-angle of the disc
FAR = 4000.0  # where disc and sky end
SETTLED = 56.0  # seconds of flight before time 0: what the start was no longer matters


def _island(size: float, top: float, seed: int, flat: float) -> gfx.Mesh:
    """An island about the origin, `size` across, its plateau of radius `flat` at the height `top`."""
    n = 512
    x, z = np.meshgrid(*[np.linspace(-size / 2, size / 2, n)] * 2)
    rough, fine = ground.noise(n, seed, 2.3, 2), ground.noise(n, seed + 1, 1.6, 12)
    r = np.hypot(x, z) / (1 + 0.10 * rough)
    edge = ground.smoothstep(size * 0.48, size * 0.33, r)
    hills = (0.55 * rough + 0.10 * fine) * ground.smoothstep(flat * 0.8, flat * 1.4, np.hypot(x, z))
    h = edge * (top + hills) - 2.5 * (1 - edge) - 0.0
    dz, dx = np.gradient(h, size / (n - 1))
    steep = ground.smoothstep(0.55, 1.1, np.hypot(dx, dz) + 0.12 * fine)
    patches = 0.5 + 0.5 * np.tanh(ground.noise(n, seed + 2, 1.2, 6))
    albedo = ground.mix(ground.mix((0.10, 0.13, 0.035), (0.23, 0.19, 0.075), patches), (0.24, 0.21, 0.18), steep)
    albedo *= (1 + 0.25 * ground.noise(n, seed + 3, 0.5))[..., None].clip(0.4, 1.6)
    albedo *= ground.mix((0.5, 0.5, 0.5), (1, 1, 1), ground.smoothstep(-0.2, 1.0, h))  # wet below
    k = np.arange(0, n, 4)
    k[-1] = n - 1
    m = len(k)
    positions = np.stack([x, h, z], axis=-1)[np.ix_(k, k)].reshape(-1, 3).astype(np.float32)
    normal = np.stack([-dx, np.ones_like(h), -dz], axis=-1)[np.ix_(k, k)].reshape(-1, 3)
    uv = np.stack(np.meshgrid(k / (n - 1), k / (n - 1)), axis=-1).reshape(-1, 2).astype(np.float32)
    i = (np.arange(m - 1)[:, None] * m + np.arange(m - 1)).ravel()
    faces = np.concatenate([np.stack([i, i + m, i + 1], 1), np.stack([i + 1, i + m, i + m + 1], 1)]).astype(np.int32)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    geometry = gfx.Geometry(positions=positions, normals=normal.astype(np.float32), texcoords=uv, indices=faces)
    bumps = ground.normals(ground.noise(n, seed + 4, 1.0, 8), 0.22)
    return gfx.Mesh(
        geometry,
        gfx.MeshStandardMaterial(
            map=ground.texture(ground.codes(albedo)), normal_map=ground.texture(bumps, srgb=False), roughness=0.95, metalness=0, side="front"
        ),
    )


def _sea() -> gfx.Mesh:
    size, tile = 2 * FAR, 40.0
    geometry = gfx.plane_geometry(size, size, 1, 1)
    geometry.texcoords.data[:] *= size / tile
    material = gfx.MeshStandardMaterial(
        color=gfx.Color.from_physical(0.012, 0.03, 0.036),
        roughness=0.25,
        metalness=0,
        env_map_intensity=1 / FILL,
        normal_map=ground.texture(ground.waves(512, 11, 0.12), srgb=False),
        side="front",
    )
    sea = gfx.Mesh(geometry, material)
    sea.local.rotation = la.quat_from_axis_angle((1, 0, 0), -np.pi / 2)
    return sea


def _range(distance: float, height: float, seed: int, haze: float) -> gfx.Mesh:
    """A mountain range around the view at a distance, as a strip; the haze (0..1) lies thicker at its foot."""
    n = 600
    azimuth = np.linspace(-1.5, 1.5, n)
    ridge = ground.noise(1024, seed, 1.55, 2)[0]
    crest = height * (0.42 + 0.30 * np.interp(np.linspace(0, 1023, n), np.arange(1024), ridge)).clip(0.03)
    dip = 1 - 0.75 * np.exp(-(((azimuth - np.arctan2(SUN[0], -SUN[2])) / 0.16) ** 2))  # a saddle before the sun
    top, foot = np.maximum(crest * dip, height * 0.02), np.full(n, -5.0)
    rows = [foot, np.maximum(top * 0.5, 0), top]
    x, z = distance * np.sin(azimuth), -distance * np.cos(azimuth)
    positions = np.concatenate([np.stack([x, y, z], 1) for y in rows]).astype(np.float32)
    towards = np.exp(-np.hypot(azimuth - np.arctan2(SUN[0], -SUN[2]), 0.1) / 0.55)
    air = ground.mix((0.09, 0.11, 0.18), (0.62, 0.28, 0.12), towards)
    stone = np.array([0.010, 0.014, 0.026])
    colour = np.concatenate([ground.mix(stone, air, np.full(n, h)) for h in (min(1.0, haze + 0.3), haze + 0.1, haze)])
    i = np.arange(n - 1)
    faces = [np.stack([i + k * n, i + 1 + k * n, i + n + k * n], 1) for k in (0, 1)]
    faces += [np.stack([i + 1 + k * n, i + 1 + n + k * n, i + n + k * n], 1) for k in (0, 1)]
    geometry = gfx.Geometry(positions=positions, indices=np.concatenate(faces).astype(np.int32), colors=colour.astype(np.float32))
    return gfx.Mesh(geometry, gfx.MeshBasicMaterial(color_mode="vertex", side="both"))


def _placed(group: gfx.WorldObject, position: tuple[float, float, float], scale: float = 1.0, turn: float = 0.0) -> gfx.WorldObject:
    group.local.position = position
    group.local.scale = (scale,) * 3
    group.local.rotation = la.quat_from_axis_angle((0, 1, 0), np.radians(turn))
    return group


def _fly(craft: gfx.WorldObject, vehicle: Vehicle) -> None:
    """Put a craft (nose to +z) where its vehicle is, nose along the velocity, banked into the turn as the force asks (Reynolds)."""
    forward = vehicle.velocity / np.linalg.norm(vehicle.velocity)
    up = np.array([0, 9.81, 0]) + limited(vehicle.force, 9.81)
    right = np.cross(up, forward)
    right /= np.linalg.norm(right)
    matrix = np.eye(4)
    matrix[:3, :3] = np.stack([right, np.cross(forward, right), forward], axis=1)
    craft.local.position = vehicle.position
    craft.local.rotation = la.quat_from_mat(matrix)


def _run(seed: int) -> tuple[Path, Run]:
    """The path, and the flight of the two craft: 0 follows the path, 1 pursues 0."""
    path = Path(loop(seed, radius=46, height=24, rise=5, wander=0.16) + np.array([12, 0, -8]), radius=6)
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
    """Seconds of a lap of vehicle 0 once it is settled: from one passing of the place where it is at SETTLED to the next."""
    length, k = path.length, round(SETTLED * run.rate)
    start, done, before = path.nearest(run.step(k)[0].position)[0], 0.0, 0.0
    last = start
    while done < length:
        k += 1
        here = path.nearest(run.step(k)[0].position)[0]
        before, done = done, done + (here - last + length / 2) % length - length / 2
        last = here
    return (k - (done - length) / (done - before)) / run.rate - SETTLED


def flying(seed: int = 7) -> Stage:
    """The stage; its duration is one lap, after which everything is where it was. seed: the loop's shape."""
    scene = gfx.Scene()
    picture = ground.sky(SUN, 768, 5)
    scene.add(gfx.Background(None, gfx.BackgroundSkyboxMaterial(map=Environment(picture).cube(512))))
    Environment(FILL * picture).surround(scene, background=False)

    disc = gfx.Mesh(
        gfx.sphere_geometry(FAR * 0.9 * float(np.tan(SUN_ANGLE)), 48, 24),
        gfx.MeshBasicMaterial(color=gfx.Color.from_physical(*SUN_RADIANCE)),
    )
    disc.local.position = SUN * FAR * 0.9
    scene.add(disc)
    centre = np.array([0.0, 10.0, 10.0])
    sun = gfx.DirectionalLight(color=gfx.Color.from_physical(1.0, 0.66, 0.36), intensity=5.0, cast_shadow=True)
    sun.local.position = centre + SUN * 300
    sun.target.local.position = centre
    sun.shadow.camera.width = sun.shadow.camera.height = 190
    sun.shadow.camera.depth_range = (100, 500)
    sun.shadow.bias = 0.002
    sun.shadow.cull_mode = "none"
    scene.add(sun, sun.target)

    scene.add(_sea())
    for far, height, noise, haze in ((3000.0, 330.0, 31, 0.74), (1900.0, 150.0, 32, 0.55), (1000.0, 46.0, 37, 0.33)):
        scene.add(_range(far, height, noise, haze))

    land = _island(116, 5.0, 21, 30)
    land.local.position = (-13, 0, -2)
    near = _island(44, 2.2, 25, 8)
    near.local.position = (47, 0, 56)
    for island in (land, near):
        island.receive_shadow = True
        scene.add(island)
    scene.add(_placed(model("temple")[0], (-28, 4.7, 0), 1.0, 62))
    trees = (  # place, size, turn
        ((19, 4.8, 4), 0.9, 20),
        ((-5, 4.8, -16), 0.62, 250),
        ((-52, 4.2, 10), 0.7, 130),
        ((47, 1.9, 58), 0.9, 75),
    )
    for place, size, turn in trees:
        tree = _placed(model("oak")[0], place, size, turn)
        for part in tree.iter():
            if getattr(part, "material", None) is not None and part.material.alpha_test > 0:
                part.material.alpha_test = 0.65  # finer leaves, more sky between them
        scene.add(tree)

    airship, _ = model("airship")
    ornithopter, flap = model("ornithopter")
    airship.local.scale = (4.2,) * 3
    ornithopter.local.scale = (4.2,) * 3
    scene.add(airship, ornithopter)
    for thing in scene.iter():
        if isinstance(thing, gfx.Mesh) and isinstance(thing.material, gfx.MeshStandardMaterial):
            thing.receive_shadow = True
            thing.cast_shadow = thing not in (land, near)

    path, run = _run(seed)
    duration = _lap(path, run)
    line = gfx.Line(
        gfx.Geometry(positions=np.concatenate([path.points, path.points[:1]]).astype(np.float32)),
        gfx.LineMaterial(color="#ffd27f", thickness=2.0),
        visible=False,
    )
    line.name = "path"
    scene.add(line)

    watch = gfx.PerspectiveCamera(45, 16 / 9, depth_range=(0.5, 2 * FAR))
    chase = gfx.PerspectiveCamera(55, 16 / 9, depth_range=(0.5, 2 * FAR))
    beats = round(duration / 0.8)

    def pose(t: float, camera: gfx.PerspectiveCamera | None = None) -> None:
        phase = t / duration % 1.0
        first, second = run.at(SETTLED + phase * duration)
        _fly(airship, first)
        _fly(ornithopter, second)
        flap(phase * beats % 1.0)
        turn = 2 * np.pi * (phase + 0.75)
        if camera in (None, watch):
            watch.local.position = (12 + 6 * np.sin(turn), 9 + 1.5 * np.cos(turn), 106)
            middle = 0.7 * (watch.local.position + 100 * SUN) + 0.3 * first.position
            watch.look_at(middle * (0.7, 0.75, 1))
        if camera in (None, chase):
            back = second.velocity / np.linalg.norm(second.velocity)
            chase.local.position = second.position - 22 * back + np.array([0, 5.0, 0])
            chase.look_at(first.position * 0.6 + second.position * 0.4)

    pose(0.0)
    return Stage("flying", scene, {"watch": watch, "chase": chase}, [SceneLight(target=disc, emitter=True)], duration, pose, centre, 90.0)
