"""What the shaders of a march read: scene.wgsl's structs as NumPy records. All positions are in the camera's view space."""

import math
from typing import Any

import numpy as np

from airlight.lamps import Lamp
from airlight.medium import Settled
from airlight.projection import depth_terms, eye_rays
from airlight.shadows import Shadow

MOST_VIEWS = 6
FRAME = np.dtype(
    [
        ("rays", "f4", 4),
        ("depth", "f4", 4),
        ("sigma_t", "f4", 3),
        ("flat", "f4"),
        ("sigma_s", "f4", 3),
        ("max_distance", "f4"),
        ("ambient", "f4", 3),
        ("", "u4"),
        ("size", "u4", 2),
        ("pixels", "u4", 2),
    ]
)
VIEW = np.dtype([("matrix", "f4", (4, 4)), ("near", "f4"), ("far", "f4"), ("texel", "f4"), ("depth_scale", "f4")])
LIGHT = np.dtype(
    [
        ("intensity", "f4", 3),
        ("range", "f4"),
        ("place", "f4", 3),
        ("cone_scale", "f4"),
        ("axis", "f4", 3),
        ("cone_offset", "f4"),
        ("lobes", "f4", 3),
        ("cosine", "f4"),
        ("views", "u4"),
        ("side", "f4"),
        ("bias", "f4"),
        ("spread", "f4"),
        ("blend", "f4"),
        ("steps", "u4"),
        ("", "f4", 2),
        ("view", VIEW, MOST_VIEWS),
    ]
)


def frame_record(projection: Any, air: Settled, size: tuple[int, int], pixels: tuple[int, int]) -> np.ndarray:
    """size: of what is computed; pixels: of the picture and its depth."""
    out = np.zeros((), FRAME)
    out["rays"], out["flat"] = eye_rays(projection)
    out["depth"] = depth_terms(projection)
    out["sigma_t"], out["sigma_s"], out["ambient"] = air.sigma_t, air.sigma_s, air.ambient
    out["max_distance"], out["size"], out["pixels"] = air.max_distance, size, pixels
    return out


def light_record(lamp: Lamp, shadow: Shadow | None, view: Any, air: Settled) -> np.ndarray:
    """view: (4, 4) world to view space. Without a shadow map there are no views, and everything is lit."""
    out, view = np.zeros((), LIGHT), np.asarray(view, np.float64)
    into = np.linalg.inv(view)
    factor = lamp.strength * lamp.seen_from(into[:3, 3], air.medium.lamp_distance, air.medium.lamp_fade)
    out["intensity"] = np.array(lamp.intensity) * factor
    out["place"] = view[:3, :3] @ lamp.direction if lamp.is_sun else (view @ np.append(lamp.position, 1.0))[:3]
    out["axis"] = view[:3, :3] @ lamp.direction
    out["cone_scale"], out["cone_offset"] = lamp.cone()
    out["cosine"] = math.cos(lamp.outer) if lamp.kind == "spot" else -1.0
    out["range"], out["lobes"] = lamp.range, air.lobes(lamp)[1:]
    out["bias"] = air.march.shadow_bias
    out["spread"] = math.tan(lamp.angular_radius or math.radians(air.march.sun_size)) if lamp.is_sun else 0.0
    out["blend"], out["steps"] = air.march.cascade_blend, air.steps
    if shadow is not None:
        out["views"], out["side"] = len(shadow.views), shadow.size
        for i, one in enumerate(shadow.views):
            at = out["view"][i]
            at["matrix"] = (one.matrix @ into).T  # WGSL keeps columns
            at["near"], at["far"] = one.span[0], min(one.span[1], 3e38)
            at["texel"], at["depth_scale"] = one.texel, one.depth_scale
    return out
