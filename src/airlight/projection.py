"""Projects lights of a scene into the picture, and fades them as they leave it. NumPy only, float64.

Matrices act on column vectors; NDC is x right, y up, -1 to 1, as pygfx gives them.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from airlight.planes import smoothstep

Matrix = npt.NDArray[np.float64]
GUARD_HALF_SIZES = 8.0  # half picture sizes from its centre: a light farther out is held here, on the same side


@dataclass(frozen=True)
class Projected:
    """Describes a light in the picture."""

    position: tuple[float, float]  # normalised, (0, 0) top left; may lie outside
    fade: float  # 0..1: factor of its shafts; 0 where it cannot be seen, or is behind
    direction: tuple[float, float, float]  # from the eye to the light, unit, in view space: x right, y up, -z ahead
    distance: float  # from the eye; inf where the light is given by a direction


def _edge_cosine(ndc: Matrix, projection: Matrix) -> float:
    """Compute the cosine of the angle between the view's axis and its border, on the side of ndc (2,)."""
    side = ndc / max(np.abs(ndc).max(), 1e-12)
    x, y = (side + projection[:2, 2]) / np.array([projection[0, 0], projection[1, 1]])  # the ray there, at -z = 1
    return float(1.0 / np.sqrt(1.0 + x * x + y * y))


def project(point: Any, view: Any, projection: Any) -> Projected:
    """Project a light at point (4,), homogeneous world coordinates (w = 0: the direction towards it), seen by a camera.

    view: (4, 4), world to view space; projection: (4, 4), view space to clip space, perspective or orthographic.
    The fade is 1 in the view; in perspective it falls from the view's border, a smoothstep of the cosine to the view's axis, to 0 at
    right angles to it; behind the camera it is 0 (GPU Gems 3, 13.6). Without perspective there is no border to fall from: it is 1 but
    for the last tenth of the cosine, and 0 along the axis for directions, whose rays then have no side.
    """
    view, projection = np.asarray(view, np.float64), np.asarray(projection, np.float64)
    at = view @ np.asarray(point, np.float64)
    distance = float(np.linalg.norm(at[:3]))
    flat = projection[3, 3] != 0.0
    if not np.isfinite(at).all() or distance == 0.0:
        return Projected((0.5, 0.5), 0.0, (0.0, 0.0, 1.0), 0.0)
    direction = at[:3] / distance
    ahead = -float(direction[2])  # cosine of the angle to the view's axis
    clip = projection @ (np.append(direction, 0.0) if at[3] == 0 else np.append(at[:3] / at[3], 1.0) / distance)
    reach = float(np.abs(clip[:2]).max())
    # beyond the guard band, at right angles and behind, only the side on which the light lies is kept
    scale = max(float(clip[3]), reach / GUARD_HALF_SIZES)
    ndc = clip[:2] / scale if scale > 0 else np.zeros(2)
    if flat:
        fade = float(smoothstep(ahead, 0.0, 0.1))
        if at[3] == 0:
            fade *= float(smoothstep(np.hypot(direction[0], direction[1]), 0.0, 0.1))
    elif ahead <= 0:
        fade = 0.0
    else:
        inside = reach <= clip[3]
        fade = 1.0 if inside else float(smoothstep(ahead, 0.0, _edge_cosine(ndc, projection)))
    position = (float(0.5 + 0.5 * ndc[0]), float(0.5 - 0.5 * ndc[1]))
    return Projected(position, fade, (float(direction[0]), float(direction[1]), float(direction[2])), np.inf if at[3] == 0 else distance)


def eye_rays(projection: Any) -> tuple[Matrix, float]:
    """Give ((4,), flat): the view ray of picture position (u, v) begins at flat (x, y, 0) and goes along ((1 - flat) (x, y), -1), where
    (x, y) = (a u + c, b v + d) of the four (a, b, c, d); flat is 1 without perspective, else 0."""
    p = np.asarray(projection, np.float64)
    if p[3, 3] == 0:
        return np.array([2 / p[0, 0], -2 / p[1, 1], (p[0, 2] - 1) / p[0, 0], (p[1, 2] + 1) / p[1, 1]]), 0.0
    return np.array([2 / p[0, 0], -2 / p[1, 1], (-p[0, 3] - 1) / p[0, 0], (1 - p[1, 3]) / p[1, 1]]), 1.0


def pixel_rays(projection: Any) -> Matrix:
    """Give (4,): (x, y) of the view ray of picture position (u, v) is (a u + c, b v + d), at -z = 1; all 0 without perspective."""
    rays, flat = eye_rays(projection)
    return np.zeros(4) if flat else rays


def depth_terms(projection: Any) -> Matrix:
    """Give (4,): the distance along the view's axis at a depth d is (a d + b) / (c d + e), whose divisor is positive."""
    p = np.asarray(projection, np.float64)
    terms = np.array([-p[3, 3], p[2, 3], -p[3, 2], p[2, 2]])
    return terms if 0.5 * terms[2] + terms[3] > 0 else -terms
