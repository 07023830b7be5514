"""Describes media that vary to Mitsuba, as grids of its own: fog by height, or a volume in no air."""

from typing import Any

import numpy as np
import numpy.typing as npt

from airlight.errors import AirlightError
from airlight.lights.punctual import PunctualLight
from airlight.medium.field import Field
from airlight.medium.resolve import ResolvedMedium
from airlight.reference import paths

Array = npt.NDArray[Any]
LAYERS = 64  # voxels in a fog_depth
MAX_LAYERS = 8192  # along the whole height
TOP_DEPTHS = {"exponential": 16.0, "linear": 1.0}  # of fog_depth, from its base up to the end of the medium


def refuse(medium: ResolvedMedium, lights: list[PunctualLight]) -> None:
    """Refuses what cannot be described. Raises AirlightError."""
    use = "use --against tracer"
    m, suns = medium.settings, any(light.directional for light in lights)
    one = len(medium.fields) == 1 and medium.air == 0 and medium.fields[0].blend in ("add", "replace", "max")
    if medium.varies and not one:
        raise AirlightError(f"Mitsuba is asked for fog, or for one volume in no air, not for noise or several together: {use}")
    if suns and medium.sun_extinction == "none":
        raise AirlightError(f"Mitsuba's suns are dimmed on their way through a medium that varies: set sun_extinction to all, or {use}")
    if not medium.fields and suns and m.fog == "linear" and m.fog_above > 0:
        raise AirlightError(f"Mitsuba's suns lose all their light in fog without an end: set fog_above to 0, or {use}")


def grid(medium: ResolvedMedium, eye: Array, light: PunctualLight) -> tuple[Array, Array]:
    """Makes (Z, Y, X) densities, and (4, 4) from the unit cube, their outer faces, to where they are drawn."""
    return _layers(medium, eye, light) if not medium.fields else _own(medium.fields[0], medium)


def _layers(medium: ResolvedMedium, eye: Array, light: PunctualLight) -> tuple[Array, Array]:
    """Samples fog along its height, in a box so wide that light comes in by its top."""
    depth, base, reach = medium.fog_depth, medium.fog_base, medium.max_distance
    low = min(base, float(eye[1]) - reach) - 1e-3 * reach
    high = base + TOP_DEPTHS[medium.settings.fog] * depth
    if medium.settings.fog_above > 0 and medium.settings.fog == "linear":
        high = max(high, float(eye[1]) + reach)
    if not light.directional:
        high = max(high, float(eye[1]) + reach, float(light.position[1])) + 1e-3 * reach  # type: ignore[attr-defined]
    step = max(depth / LAYERS, (high - low) / MAX_LAYERS)
    below, above = int(np.ceil((base - low) / step)), int(np.ceil((high - base) / step))
    y = base + step * np.arange(-below, above + 1)
    values = paths.density(np.stack([0 * y, y, 0 * y], axis=-1), medium)
    wide = reach
    if light.directional:
        up = max(float(light.axis()[1]), 0.02)
        wide += 1.1 * (high - low) / up
    else:
        wide = max(wide, float(np.abs(np.asarray(light.position) - eye).max()) * 1.1)  # type: ignore[attr-defined]
    first = np.array([eye[0] - wide, y[0] - step / 2, eye[2] - wide])
    return values[None, :, None], _cube(first, np.array([2 * wide, step * len(y), 2 * wide]))


def _own(field: Field, medium: ResolvedMedium) -> tuple[Array, Array]:
    """Takes a volume's own voxels."""
    volume = field.volume
    sides = np.array(volume.density.shape[::-1])
    into = np.eye(4)
    into[[0, 1, 2], [0, 1, 2]], into[:3, 3] = sides, -0.5  # from the unit cube to indices
    out = volume.matrix @ into
    out[:3, 3] -= medium.origin
    return field.factor * volume.density.astype(float), out


def _cube(low: Array, size: Array) -> Array:
    out = np.eye(4)
    out[[0, 1, 2], [0, 1, 2]], out[:3, 3] = size, low
    return out


def medium_of(mi: Any, phase: dict[str, Any], density: Array, into: Array, sigma: float, albedo: float) -> Any:
    """Describes a medium of grids."""
    voxels = mi.VolumeGrid(np.ascontiguousarray(density[..., None], np.float32))
    unit = {"type": "gridvolume", "grid": voxels, "to_world": mi.ScalarTransform4f(into), "wrap_mode": "clamp"}
    return mi.load_dict({"type": "heterogeneous", "albedo": albedo, "sigma_t": unit, "scale": sigma, "phase": phase})


def box(mi: Any, into: Array, inside: Any) -> dict[str, Any]:
    """Describes the box of a medium."""
    half = np.eye(4)
    half[[0, 1, 2], [0, 1, 2]], half[:3, 3] = 0.5, 0.5  # Mitsuba's cube is from -1 to 1
    return {"type": "cube", "to_world": mi.ScalarTransform4f(into @ half), "bsdf": {"type": "null"}, "interior": inside}


def holds(into: Array, point: Array) -> bool:
    """Tells whether a box holds a point."""
    at = np.linalg.inv(into) @ np.append(point, 1)
    return bool(np.all((at[:3] > 0) & (at[:3] < 1)))
