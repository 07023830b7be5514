"""Build what the landscapes of the scenes are made of: land, water, mountains far away, a sun that rises over them, and trees."""

import numpy as np
import pygfx as gfx
import pylinalg as la

from airlight.planes import smoothstep
from airlight.scenes import ground
from airlight.scenes.ground import Array

FAR = 4000.0  # where disc and sky end
TILE = 300.0  # m, after which what grows on mountains repeats
SUN_RADIANCE = (24.0, 15.0, 6.7)
SUN_ANGLE = np.radians(1.1)  # half-angle of the disc


def square(n: int, size: float) -> tuple[Array, Array]:
    """Compute x and z, (n, n) each, of a square of `size` metres about the origin; rows go by z."""
    x, z = np.meshgrid(*[np.linspace(-size / 2, size / 2, n)] * 2)
    return x, z


def slope(h: Array, size: float) -> Array:
    """Compute how steep heights (n, n) of such a square are, metres a metre."""
    dz, dx = np.gradient(h, size / (len(h) - 1))
    return np.asarray(np.hypot(dx, dz))


def land(h: Array, size: float, albedo: Array, seed: int, every: int = 4, rough: float = 0.22) -> gfx.Mesh:
    """Build ground of heights (n, n) over a square of `size` metres about the origin, of linear albedo (n, n, 3).

    every: how many heights along a side make a vertex. seed: of its small bumps, whose slopes have the deviation `rough`.
    """
    n = len(h)
    x, z = square(n, size)
    dz, dx = np.gradient(h, size / (n - 1))
    k = np.arange(0, n, every)
    k[-1] = n - 1
    m = len(k)
    positions = np.stack([x, h, z], axis=-1)[np.ix_(k, k)].reshape(-1, 3).astype(np.float32)
    normal = np.stack([-dx, np.ones_like(h), -dz], axis=-1)[np.ix_(k, k)].reshape(-1, 3)
    uv = np.stack(np.meshgrid(k / (n - 1), k / (n - 1)), axis=-1).reshape(-1, 2).astype(np.float32)
    i = (np.arange(m - 1)[:, None] * m + np.arange(m - 1)).ravel()
    faces = np.concatenate([np.stack([i, i + m, i + 1], 1), np.stack([i + 1, i + m, i + m + 1], 1)]).astype(np.int32)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    geometry = gfx.Geometry(positions=positions, normals=normal.astype(np.float32), texcoords=uv, indices=faces)
    bumps = ground.normals(ground.noise(n, seed, 1.0, 8), rough)
    return gfx.Mesh(
        geometry,
        gfx.MeshStandardMaterial(
            map=ground.texture(ground.codes(albedo)),
            normal_map=ground.texture(bumps, srgb=False),
            roughness=0.95,
            metalness=0,
            side="front",
        ),
    )


def sea(fill: float) -> gfx.Mesh:
    """Build water at the height 0 all around, rippled; fill: factor that the environment lights the other surfaces by."""
    size, tile = 2 * FAR, 40.0
    geometry = gfx.plane_geometry(size, size, 1, 1)
    geometry.texcoords.data[:] *= size / tile
    material = gfx.MeshStandardMaterial(
        color=gfx.Color.from_physical(0.012, 0.03, 0.036),
        roughness=0.33,
        metalness=0,
        env_map_intensity=1 / fill,
        normal_map=ground.texture(ground.waves(512, 11, 0.12), srgb=False),
        side="front",
    )
    water = gfx.Mesh(geometry, material)
    water.local.rotation = la.quat_from_axis_angle((1, 0, 0), -np.pi / 2)
    return water


def mountains(sun: Array, distance: float, height: float, seed: int, haze: float) -> gfx.Mesh:
    """Build a mountain range all around at a distance, as a strip, with a saddle before the sun (direction to it); the haze (0..1) lies
    thicker at its foot."""
    n = 513
    azimuth = np.linspace(-np.pi, np.pi, n)
    ridge = ground.noise(n - 1, seed, 1.55, 4)[0]
    crest = height * (0.42 + 0.30 * np.append(ridge, ridge[0])).clip(0.03)
    dip = 1 - 0.75 * np.exp(-(((azimuth - np.arctan2(sun[0], -sun[2])) / 0.16) ** 2))  # a saddle before the sun
    top, foot = np.maximum(crest * dip, height * 0.02), np.full(n, -5.0)
    rows = [foot, np.maximum(top * 0.5, 0), top]
    x, z = distance * np.sin(azimuth), -distance * np.cos(azimuth)
    positions = np.concatenate([np.stack([x, y, z], 1) for y in rows]).astype(np.float32)
    towards = np.exp(-np.hypot(azimuth - np.arctan2(sun[0], -sun[2]), 0.1) / 0.55)
    air = ground.mix((0.09, 0.11, 0.18), (0.62, 0.28, 0.12), towards)
    stone = np.array([0.010, 0.014, 0.026])
    colour = np.concatenate([ground.mix(stone, air, np.full(n, h)) for h in (min(1.0, haze + 0.3), haze + 0.1, haze)])
    i = np.arange(n - 1)
    faces = [np.stack([i + k * n, i + 1 + k * n, i + n + k * n], 1) for k in (0, 1)]
    faces += [np.stack([i + 1 + k * n, i + 1 + n + k * n, i + n + k * n], 1) for k in (0, 1)]
    # By the slopes of the crest, seen from the middle; used where light falls on them.
    rise = 0.5 * np.gradient(top, distance * (azimuth[1] - azimuth[0]))
    normal = np.stack([-np.sin(azimuth) - rise * np.cos(azimuth), np.full(n, 0.9), np.cos(azimuth) - rise * np.sin(azimuth)], 1)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    normals = np.concatenate([normal] * len(rows)).astype(np.float32)
    across = np.round(2 * np.pi * distance / TILE) * (azimuth / (2 * np.pi))
    texcoords = np.concatenate([np.stack([across, y / TILE], 1) for y in rows]).astype(np.float32)
    indices = np.concatenate(faces).astype(np.int32)
    geometry = gfx.Geometry(
        positions=positions, normals=normals, texcoords=texcoords, indices=indices, colors=colour.astype(np.float32)
    )
    return gfx.Mesh(geometry, gfx.MeshBasicMaterial(color_mode="vertex", side="both"))


def woods(seed: int = 51) -> gfx.MeshStandardMaterial:
    """Paint what grows on mountains as light falls on it, without the haze: woods, and stone."""
    n = 256
    rough, fine = ground.noise(n, seed, 1.6, 2), ground.noise(n, seed + 1, 1.0, 12)
    albedo = ground.mix((0.045, 0.06, 0.03), (0.17, 0.16, 0.13), smoothstep(rough + 0.4 * fine, 0.6, 1.6)) * (1 + 0.2 * fine)[..., None]
    bumps = ground.texture(ground.normals(rough + 0.4 * fine, 0.25), srgb=False)
    return gfx.MeshStandardMaterial(
        map=ground.texture(ground.codes(albedo)), normal_map=bumps, roughness=1.0, metalness=0, side="both"
    )


def sunrise(centre: Array, towards: Array, reach: float) -> tuple[gfx.Mesh, gfx.DirectionalLight]:
    """Build a sun's disc in a direction from the centre, and the light that hangs on it, with shadows within `reach` of the centre."""
    away = FAR * 0.9
    sun = gfx.DirectionalLight(color=gfx.Color.from_physical(1.0, 0.66, 0.36), intensity=5.0, cast_shadow=True)
    sun.target.local.position = centre
    sun.shadow.camera.width = sun.shadow.camera.height = 2 * reach
    sun.shadow.camera.depth_range = (away - 200, away + 200)
    sun.shadow.bias = 0.002  # of that range: 0.8 units
    sun.shadow.cull_mode = "none"
    disc = gfx.Mesh(
        gfx.sphere_geometry(away * float(np.tan(SUN_ANGLE)), 48, 24),
        gfx.MeshBasicMaterial(color=gfx.Color.from_physical(*SUN_RADIANCE)),
    )
    disc.local.position = centre + towards * away
    disc.add(sun)
    return disc, sun
