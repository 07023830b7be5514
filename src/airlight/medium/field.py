"""Hold densities that lie in a part of a medium: grids, and how they join what lies there."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from airlight.errors import AirlightError
from airlight.messages import nearest

if TYPE_CHECKING:
    from airlight.files.volumes import Volume

BLENDS = ("add", "multiply", "replace", "min", "max")  # numbered as in medium/grid.wgsl


@dataclass(frozen=True, eq=False)
class Field:
    """A density on a grid, in a medium. Raises AirlightError.

    volume: the grid, with its place in the world. blend: how it joins the density that lies there: add to it; within the grid's box
    multiply it, replace it, or be the lesser (min) or greater (max) of both. factor: of its densities, >= 0.
    """

    volume: Volume
    blend: str = "add"
    factor: float = 1.0

    @cached_property
    def longest(self) -> float:
        """Find the greatest optical length straight through the grid along one of its axes, m."""
        edges = np.linalg.norm(self.volume.matrix[:3, :3], axis=0)[::-1]
        sums = (self.volume.density.sum(axis=axis).max() * edge for axis, edge in enumerate(edges))
        return self.factor * float(max(sums))

    def __post_init__(self) -> None:
        if self.blend not in BLENDS:
            raise AirlightError(f"blend {self.blend!r}{nearest(self.blend, BLENDS)}; use {', '.join(BLENDS)}")
        if not 0 <= self.factor < float("inf"):
            raise AirlightError(f"factor = {self.factor:g}; give 0 or more")


def as_field(density: Any, cells: int = 128) -> Field | None:
    """Make a field of a field, of a volume, or of what gives one by `field(cells)`, as particles do; None where that gives none.

    cells: along the longest side of a grid that particles are put into.
    """
    if isinstance(density, Field):
        return density
    return density.field(cells) if hasattr(density, "field") else Field(density)
