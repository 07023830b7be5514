"""Bake particles, and what lies in basins, into volumes: arrays in, a grid with its place in the world out."""

import os
from typing import Any

import numpy as np

from airlight.errors import AirlightError, warn
from airlight.files.images import read_image
from airlight.files.volumes.volume import CLAMPED, Volume
from airlight.luminance import luminance
from airlight.medium import basin as lowlands
from airlight.medium import particles as baking

MAX_SPRITE = 2**22  # pixels


def particles(
    positions: Any, radius: Any = None, density: Any = None, *, cells: int = 128, sprite: Any = None, name: str = "particles"
) -> Volume:
    """Bake particles into a volume: each adds density (1 - q^2)^2, q = distance / radius < 1, and the volume has their mass exactly.

    positions: (N, 3), world metres, y up. radius: (N,) or one for all, metres, >= 0; None: twice the mean spacing. density: (N,) or one for
    all, >= 0, at a particle's centre, a factor of the medium's sigma_t; None: 1, or where radius is None too by which particles that lie
    evenly add up to 1. cells: along the longest side of the grid, 16..512; radii of less than two cells are widened to these, with the same
    mass. sprite: a picture's file, or an array (H, W) of alpha or (H, W, C) of colours, whose alpha, or luminance where it has none,
    averaged over rings, is the kernel instead, with the same mass. name: for messages.
    Those without radius or density count for nothing; those that are not finite, and a few that lie far from all others, are left out.
    Warns of it. Raises AirlightError for negative numbers and for arrays that do not fit together.
    """
    profile = None if sprite is None else sprite_profile(sprite)
    volume = bake(positions, radius, density, cells, profile, name)
    for line in volume.told:
        warn(line)
    return volume


def basin(ground: Any, bounds: Any, level: float, density: float = 1.0, *, cells: int = 128) -> Volume:
    """Fill the air over ground that lies below a level, up to that level, with a density.

    ground: (H, W) world y of the ground, metres, by z and x; NaN where there is none. bounds: ((x, z), (x, z)), metres, the map's least and
    greatest borders. level: world y. density: >= 0. cells: along the longer side, at most. The borders of the volume are those of the
    level: it ends there at once. Raises AirlightError, also where no ground lies below the level.
    """
    if not 0 <= density <= 1e12:
        raise AirlightError(f"basin: density = {density:g}; give 0 to 1e12")
    made = lowlands.bake(ground, bounds, level, cells)
    if made is None:
        lowest = np.nanmin(np.asarray(ground, np.float64), initial=np.inf)
        raise AirlightError(f"basin: no ground lies below the level {level:g} m: the lowest is at {lowest:g} m; give a higher level")
    return basin_volume(*made, density)


def basin_volume(grid: np.ndarray, matrix: np.ndarray, density: float = 1.0) -> Volume:
    """Make the volume of what `medium.basin.bake` gives."""
    return Volume(grid if density == 1 else grid * np.float32(density), matrix, CLAMPED, "basin", stored=grid.shape)


def empty(name: str) -> Volume:
    """Make a volume of density 0."""
    return Volume(np.zeros((2, 2, 2), np.float32), np.eye(4), 0.0, name, stored=(2, 2, 2))


def bake(
    positions: Any, radius: Any, density: Any, cells: int, profile: np.ndarray | None, name: str, weight: np.ndarray | None = None
) -> Volume:
    """Bake particles as `particles` does, without a warning: what was changed is told by the volume. profile: see `sprite_profile`.
    weight: (N,) factors of the density, also of one that is chosen here."""
    points = np.asarray(positions)
    told: list[str] = []
    if radius is None and points.ndim == 2 and points.shape[1] == 3 and points.dtype.kind in "fiu":
        radius, density, told = baking.completed(points, radius, density, name)
    radius, density = (1.0 if one is None else one for one in (radius, density))
    grid, matrix, notes = baking.bake(positions, radius, density if weight is None else density * weight, cells, profile, name)
    return Volume(grid, matrix, 0.0, name, stored=grid.shape, told=(*told, *notes))


def sprite_profile(sprite: Any) -> np.ndarray:
    """Average a sprite's alpha, or its luminance where it has none, over rings: (K,) the kernel of particles, for `medium.particles.bake`.

    sprite: a picture's file, or (H, W), or (H, W, C) of 1 to 4 channels. Raises AirlightError.
    """
    if isinstance(sprite, str | os.PathLike):
        picture = read_image(sprite)
        codes, name = picture.codes, os.fsdecode(sprite)
    else:
        codes, name = np.asarray(sprite), "sprite"
    codes = codes[..., None] if codes.ndim == 2 else codes
    if codes.ndim != 3 or not 1 <= codes.shape[2] <= 4 or not codes.size or codes.dtype.kind not in "fiu":
        raise AirlightError(f"{name}: has the shape {codes.shape}; a sprite is (H, W) or (H, W, C) of 1 to 4 channels")
    step = max(1, int((codes.shape[0] * codes.shape[1] / MAX_SPRITE) ** 0.5))
    values = codes[::step, ::step].astype(np.float64)
    alpha = values[..., -1]
    if codes.shape[2] not in (2, 4) or alpha.min() == alpha.max():
        alpha = values[..., 0] if codes.shape[2] < 3 else np.asarray(luminance(values[..., :3]))
    try:
        return baking.radial_profile(alpha)
    except AirlightError as error:
        raise AirlightError(f"{name}: {error}") from None
