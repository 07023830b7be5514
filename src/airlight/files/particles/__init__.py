"""Particles from tables of text (.csv), NumPy's .npz, and .ply: where they lie, how large and how dense they are."""

from dataclasses import replace

import numpy as np

from airlight.errors import AirlightError, warn
from airlight.files.decode import opened
from airlight.files.particles import npz, ply, text
from airlight.files.particles.columns import Particles
from airlight.messages import nearest

FORMATS = (".csv", ".npz", ".ply")
UP = ("y", "z")

__all__ = ["FORMATS", "Particles", "read_particles"]


def read_particles(path: str, scale: float = 1.0, up: str | None = None) -> Particles:
    """Read particles, in world metres.

    scale: metres a unit, > 0. up: the file's axis that points up, y unless it is z, with which (x, y, z) becomes (x, z, -y).
    Warns of what was not read. Raises AirlightError.
    """
    if not (np.isfinite(scale) and scale > 0):
        raise AirlightError(f"{path}: scale is {scale:g}; give metres a unit, more than 0")
    up = up or "y"
    if up not in UP:
        raise AirlightError(f"{path}: up is {up!r}{nearest(up, UP)}; use y or z")
    quiet = np.errstate(all="ignore")  # of numbers that are none, which are looked for where they are used
    with opened(path, "a file of particles: .csv, .npz or .ply") as (name, head), open(name, "rb") as file, quiet:
        if head.startswith(npz.MAGIC):
            found = npz.read(file, path)
        elif head.startswith(ply.MAGIC):
            found = ply.read(file, path)
        elif head and b"\0" not in head:
            found = text.read(file, path)
        else:
            raise AirlightError(f"{path}: {'holds no particles that Airlight reads' if head else 'is empty'}; give {', '.join(FORMATS)}")
    for line in found.told:
        warn(line)
    points = found.positions
    if up == "z":
        points = np.column_stack([points[:, 0], points[:, 2], -points[:, 1]])
    with np.errstate(all="ignore"):
        return replace(found, positions=points * scale, radii=None if found.radii is None else found.radii * scale)
