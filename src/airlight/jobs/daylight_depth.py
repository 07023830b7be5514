"""Makes distances from the eye, in metres, and the sky, of a map of depths, of a mask, or of one distance."""

from dataclasses import dataclass

import numpy as np

from airlight.errors import AirlightError
from airlight.options import DaylightPicture

FAR_AWAY = 1e8  # m: renderers write 1e10 and more where there is nothing
HALF_MOST = 65504.0  # where a renderer that writes halves ends
AT_THE_END = 1 / 510  # of a map's range: half a step of 8 bits
Plane = np.ndarray


@dataclass(frozen=True)
class Distances:
    """Holds metres (H, W) float32 along each ray, infinite where there is only sky, and the share (H, W) of a pixel that is sky."""

    metres: Plane
    sky: Plane


def from_map(values: Plane, whole: bool, place: DaylightPicture, span: tuple[float, float] | None, lengths: Plane, path: str) -> Distances:
    """Turn a map of depths (H, W) into distances.

    values: floats as stored, or with `whole` integers as 0..1; infinite is sky. span: metres of its nearest and farthest value, or None
    for floats in units of depth_unit. lengths: (H, W) of a ray that goes 1 m along the view's axis. Raises AirlightError.
    """
    if np.isnan(values).any():
        share = float(np.isnan(values).mean())
        raise AirlightError(f"{path}: {share:.1%} of the depths are no number (NaN): write them as infinite where there is sky")
    if (values < 0).any():
        least = f"{path}: holds negative depths, down to {values.min():g}"
        raise AirlightError(f"{least}: give distances from the eye, which are more than 0")
    if whole and span is None:
        raise AirlightError(f"{path}: its depths are whole numbers, which say no metres: add --depth-range NEAR,FAR, as in 2,5000")
    inverse = place.depth_kind == "inverse"
    if span is not None:
        metres, sky = _ranged(values.astype(float), whole, inverse, span)
    else:
        with np.errstate(divide="ignore"):
            metres = place.depth_unit / values.astype(float) if inverse else values.astype(float) * place.depth_unit
        sky = ~np.isfinite(metres) | (metres >= FAR_AWAY) | (values >= HALF_MOST if not inverse else values == 0)
    if sky.all():
        raise AirlightError(f"{path}: all of its depths are endless, as if all were sky: check --depth-kind and --depth-unit")
    if not inverse and not sky.any() and not metres.any():
        raise AirlightError(f"{path}: all of its depths are 0: give a map with distances")
    metres = metres if place.depth_kind == "ray" else metres * lengths
    return Distances(np.where(sky, np.inf, metres).astype(np.float32), sky.astype(np.float32))


def _ranged(values: Plane, whole: bool, inverse: bool, span: tuple[float, float]) -> tuple[Plane, Plane]:
    """Stretch a relative map between two distances; its very end is sky."""
    finite = np.isfinite(values)
    low, high = (0.0, 1.0) if whole or not finite.any() else (float(values[finite].min()), float(values[finite].max()))
    share = np.clip((np.where(finite, values, high) - low) / ((high - low) or 1.0), 0, 1)
    far = 1 - share if inverse else share
    near, end = span
    if inverse:
        with np.errstate(divide="ignore"):
            metres = 1 / (1 / end + (1 / near - 1 / end) * (1 - far))
    elif np.isinf(end):
        raise AirlightError(f"--depth-range {near:g},inf goes with --depth-kind inverse: give the metres of the farthest value")
    else:
        metres = near + (end - near) * far
    return metres, (far >= 1 - AT_THE_END) | ~finite


def at_one_distance(sky: Plane, distance: float) -> Distances:
    """Put all that is not sky at one distance, m. sky: (H, W), 0..1."""
    return Distances(np.where(sky >= 1, np.inf, distance).astype(np.float32), sky.astype(np.float32))


def with_soft_edge(found: Distances, light: Plane) -> Distances:
    """Let a photograph (H, W, 3), linear, say how much of a pixel is sky along the edge that a map has, and give such pixels the distance
    of what is beside them."""
    from airlight.detect.sky_edge import soften, spread

    is_sky = found.sky >= 1
    if is_sky.all() or not is_sky.any():
        return found
    share = soften(light, is_sky)
    with np.errstate(divide="ignore"):
        metres = np.exp(spread(np.log(found.metres), ~is_sky & (found.metres > 0), is_sky & (share < 1)))
    share = np.where(np.isfinite(metres), share, 1)
    return Distances(np.where(share >= 1, np.inf, metres).astype(np.float32), share.astype(np.float32))


def with_sky(found: Distances, sky: Plane) -> Distances:
    """Let a mask (H, W), 0..1, say what is sky; what the map alone has as sky is then as far as the farthest else."""
    ends = np.isfinite(found.metres)
    most = float(found.metres[ends].max()) if ends.any() else np.inf
    metres = np.where(ends, found.metres, most)
    return Distances(np.where(sky >= 1, np.inf, metres).astype(np.float32), sky.astype(np.float32))
