"""Describes to slices the volumes that lights fill: records of scatter/slices/volume.wgsl, and the boxes around them."""

from typing import Any

import numpy as np
import numpy.typing as npt

from airlight.gpu.structs import struct_dtype
from airlight.lights.punctual import PositionalLight, PunctualLight
from airlight.medium.resolve import ResolvedMedium
from airlight.shadows import Shadow

Array = npt.NDArray[np.floating[Any]]
SLICING = struct_dtype("scatter/slices/volume.wgsl", "Slicing")
UNBOUND = 1e30  # m


def view_box(light: PunctualLight, view: Any, medium: ResolvedMedium) -> tuple[Array, Array]:
    """Bound a light's volume in view space: (3,) the least and the most to the right, up, and ahead of the eye, m.

    view: (4, 4) world to view space. A light without an end is bounded by the medium's, which lies around the eye; one that has no sides by
    what is ahead.
    """
    whole = np.array([-UNBOUND, -UNBOUND, 0.0]), np.array([UNBOUND, UNBOUND, medium.max_distance])
    if not isinstance(light, PositionalLight):
        return whole[0], np.array([UNBOUND, UNBOUND, medium.sun_reach])
    eye, reach = np.linalg.inv(view)[:3, 3], light.attenuation_range()
    far = float(getattr(light, "far", 0.0)) or reach
    if light.cone_cosine() < 0 and not len(light.planes()):
        if not reach:
            return whole
        middle = light.in_view(view) * (1, 1, -1)
        return middle - reach, middle + reach
    endless = not far
    if endless:
        far = float(np.linalg.norm(light.origin() - eye)) + medium.max_distance
    near = float(getattr(light, "near", 0.0)) if len(light.planes()) else 0.0
    wide, high = light.tangents()
    corners = [(x * wide * z, y * high * z, z) for z in (near, far) for x in (-1, 1) for y in (-1, 1)]
    at = light.origin() + np.array(corners) @ light.axes()
    seen = (at @ view[:3, :3].T + view[:3, 3]) * (1, 1, -1)
    low, top = seen.min(axis=0), seen.max(axis=0)
    if endless:
        low[2], top[2] = max(low[2], 0.0), min(top[2], medium.max_distance)
    return low, top


def has_window(light: PunctualLight) -> bool:
    """Tells whether a light shines through an outline: a spot's, or a projector's."""
    return not light.directional and (light.cone_cosine() >= 0 or len(light.planes()) > 0)


def slicing_record(
    light: PunctualLight, shadow: Shadow | None, view: Any, box: tuple[Array, Array], count: float, cell: int = 1
) -> np.ndarray:
    """Fill a SLICING. box: see `view_box`; count: planes in it; cell: pixels along one, whose planes lie apart."""
    out, view = np.zeros((), SLICING), np.asarray(view, np.float64)
    into = np.linalg.inv(view)
    out["low"], out["high"] = box
    out["count"], out["cell"], out["views"] = count, cell, 0 if shadow is None else len(shadow.views)
    axes = light.axes()
    out["rows"] = np.column_stack([axes, -axes @ light.origin()]) @ into
    out["tangents"] = light.tangents()
    if light.directional and light.cookie is not None:
        rows, columns = light.cookie.pixels.shape[:2]
        out["tangents"] = light.cookie.size / 2 * np.array([1.0, rows / columns])
    return out
