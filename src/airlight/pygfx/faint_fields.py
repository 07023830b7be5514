"""Judges whether the volumes and particles of a medium are dense and large enough to be seen."""

from collections.abc import Sequence

import numpy as np

from airlight.medium.field import Field
from airlight.medium.resolve import ResolvedMedium, hardly_seen
from airlight.projection import Matrix

FEW_PX = 4  # of a grid's diagonal, below which it is a speck
ADDING = ("add", "max")  # blends of what is seen by itself


def doubt_of_fields(medium: ResolvedMedium, view: Matrix, projection: Matrix, height: int) -> str | None:
    """Word one line where what lies in a medium is too thin to be seen, or too small; else None. See `too_small`."""
    own = [field.longest for field in medium.fields if field.blend in ADDING]
    longest, sigma = max(own, default=0.0), float(medium.sigma_t.max())
    thin = hardly_seen(sigma * longest, "give them a factor of {0}, or the medium a larger sigma_t")
    return thin or too_small(medium.fields, view, projection, height, medium.origin)


def too_small(fields: Sequence[Field], view: Matrix, projection: Matrix, height: int, origin: Sequence[float] = (0, 0, 0)) -> str | None:
    """Word one line for the first of the fields in front of the eye that is a few pixels large; else None.

    view, projection: (4, 4), of a picture of `height` pixels; origin: (3,) m, the world's place of their 0.
    """
    for field in fields:
        low, high = np.asarray(field.volume.bounds, float) - origin
        size, centre = float(np.linalg.norm(high - low)), np.append((low + high) / 2, 1)
        w = float((np.asarray(projection) @ view @ centre)[3])  # 1 of an orthographic view
        if w <= 0 or not field.volume.density.any():
            continue
        wide = abs(float(projection[1][1])) * size / w * height / 2
        if wide < FEW_PX:
            what, middle = field.volume.path or "a volume", ", ".join(f"{v:.4g}" for v in centre[:3] + origin)
            cure = "it may need another scale, or a nearer eye"
            return f"{what}: is too small to be seen, {size:.2g} m around {middle}, {wide:.2g} pixels here; {cure}"
    return None
