"""NumPy records of the structs in scene.wgsl, which the shaders of a march read. All positions are in the camera's view space."""

from typing import Any

import numpy as np

from airlight.gpu.structs import struct_dtype
from airlight.lights.punctual import PunctualLight
from airlight.medium.resolve import ResolvedMedium
from airlight.projection import depth_terms, eye_rays
from airlight.scatter.march.cookies import even_colour, shape_record
from airlight.scatter.march.shade import Shade
from airlight.shadows import Shadow

FRAME, LIGHT = (struct_dtype("scatter/march/scene.wgsl", name) for name in ("Frame", "Light"))


def frame_record(view: Any, projection: Any, medium: ResolvedMedium, size: tuple[int, int], pixels: tuple[int, int]) -> np.ndarray:
    """Fills a FRAME. view: (4, 4) world to view space; size: of what is computed; pixels: of the picture and its depth."""
    out, view = np.zeros((), FRAME), np.asarray(view, np.float64)
    out["up"] = view[:3, 1]
    out["base_height"] = np.linalg.inv(view)[1, 3] - medium.fog_base
    out["rays"], out["flat"] = eye_rays(projection)
    out["depth"] = depth_terms(projection)
    out["size"], out["pixels"] = size, pixels
    for name in FRAME.names or ():  # what is named as in the medium is the medium's: resolved, or as it or its march is set
        for holder in (medium, medium.settings, medium.march):
            if hasattr(holder, name):
                out[name] = getattr(holder, name)
                break
    return out


def dark_record(medium: ResolvedMedium) -> np.ndarray:
    """Fills the LIGHT of a pass without a light, which has steps all the same."""
    out = np.zeros((), LIGHT)
    out["steps"] = medium.steps
    return out


def light_record(
    light: PunctualLight, shadow: Shadow | None, view: Any, medium: ResolvedMedium, shade: Shade | None = None
) -> np.ndarray:
    """Fills a LIGHT. view: (4, 4) world to view space. Without a shadow map there are no views, and everything is lit.

    shade: of what dims it more than closed forms do.
    """
    out, view = np.zeros((), LIGHT), np.asarray(view, np.float64)
    into = np.linalg.inv(view)
    even = even_colour(light)
    shape = 1.0 if even is None else even
    out["intensity"] = np.array(light.intensity) * shape * (light.strength * light.fade(into[:3, 3], medium))
    out["position"], out["axis"] = light.in_view(view), view[:3, :3] @ light.axis()
    out["cone_scale"], out["cone_offset"] = light.cone()
    out["cone_cosine"], out["range"] = light.cone_cosine(), light.attenuation_range()
    out["lobes"] = medium.lobes(light.anisotropy)[1:]
    out["bias"], out["disc_tangent"] = medium.march.shadow_bias, light.disc_tangent(medium.march.sun_size)
    out["climb"] = view[:3, 1] @ out["position"]
    out["blend"], out["steps"] = medium.march.cascade_blend, medium.sun_steps if light.directional else medium.steps
    if shade is not None:
        out["shade_rows"] = shade.rows @ into
        out["shade_into"] = (view @ np.vstack([shade.into, [0, 0, 0, 1]]))[:3]
        out["shade_count"], out["shade_faces"] = shade.count, shade.faces
        out["shade_near"], out["shade_step"], out["shade_tangent"] = shade.near, shade.step, shade.tangent
        out["shade_cell"], out["shade_pieces"], out["shade_stride"] = shade.cell, shade.pieces, shade.stride
    shape_record(out, light, into)
    if shadow is not None:
        out["views"], out["side"], out["glass_side"] = len(shadow.views), shadow.size, shadow.glass_side
        for i, one in enumerate(shadow.views):
            at = out["view"][i]
            at["matrix"] = (one.matrix @ into).T  # WGSL keeps columns
            at["near"], at["far"] = one.span[0], min(one.span[1], 3e38)
            at["texel"], at["depth_scale"] = one.texel, one.depth_scale
    return out
