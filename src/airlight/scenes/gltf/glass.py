"""Draw KHR_materials_transmission: light passes, tinted by the base colour, below a faint reflection; nothing is bent or blurred.

What passes is drawn by one mesh, which multiplies what is behind; the others only add light. So lights are tinted once, by that one.
"""

from typing import Any

import numpy as np

from airlight.colour import srgb_decode, srgb_encode
from airlight.scenes.gltf import schema
from airlight.scenes.gltf.opacity import split

DARK = 0.05  # transmission times tint below which nothing is seen through a surface: it is drawn, and casts, as a solid one
BODY = 0.02  # of a surface's own colour, from which it is drawn over what is behind
TINT: dict[str, Any] = {"alpha_mode": "multiply", "depth_write": False}
GLOSS: dict[str, Any] = {"alpha_mode": "add", "depth_write": False}
GLOSS_WHOLE: dict[str, Any] = {  # whatever the alpha of a map that tells glass from its frame
    "alpha_config": {"method": "blended", "color_src": "one", "color_dst": "one", "alpha_src": "zero", "alpha_dst": "one"},
    "depth_write": False,
}


def transmission(m: schema.Material, metal: float = 1.0) -> float:
    """Compute the share of light, 0..1, that passes a material, its tint and textures aside. metal: mean of its metalness texture."""
    found = m.extensions.transmission
    if found is None or m.extensions.unlit is not None:
        return 0.0
    metalness = min(max(m.pbr_metallic_roughness.metallic_factor, 0.0), 1.0) * metal
    return float(min(max(found.transmission_factor, 0.0), 1.0) * (1 - metalness))


def tint(m: schema.Material) -> np.ndarray:
    """Compute what colours the light that passes, (3,): the base colour, and what KHR_materials_volume absorbs on the way."""
    colour = np.clip(m.pbr_metallic_roughness.base_color_factor[:3], 0, 1)
    volume = m.extensions.volume
    if volume is None or not volume.attenuation_distance or volume.thickness_factor <= 0:
        return colour
    depth = min(volume.thickness_factor / volume.attenuation_distance, 100.0)
    absorbed: np.ndarray = colour * np.clip(volume.attenuation_color, 0, 1) ** depth
    return absorbed


def is_glass(m: schema.Material, share: float) -> bool:
    """Tell whether light passes a material of which `transmission` is the share."""
    return share * float(tint(m).max()) >= DARK


def in_frame(codes: np.ndarray, base: np.ndarray | None, share: float) -> np.ndarray:
    """Make a base colour texture, (H, W, 4) uint8, whose alpha is 1 but where light passes, and there 1 - its share.

    codes: of the transmission texture, in its red; base: of the base colour, of any size.
    """
    if base is None:
        out = np.full((*codes.shape[:2], 4), 255, np.uint8)
    else:
        out = base.copy()
        rows, columns = (np.arange(n) * m // n for n, m in zip(base.shape[:2], codes.shape[:2], strict=True))
        codes = codes[rows[:, None], columns]
    passed = codes[..., 0] / 255.0 * share
    out[..., 3] = np.where(passed >= DARK, np.rint(255 * (1 - passed)), 255)
    return out


def through_frame(codes: np.ndarray) -> np.ndarray:
    """Make of a texture of `in_frame` what of the light passes it, its alpha as it is."""
    return _with_linear(codes, srgb_decode(codes[..., :3] / 255.0) * (1 - codes[..., 3:] / 255.0))


def through_cover(codes: np.ndarray, passed: np.ndarray, alpha: float) -> np.ndarray:
    """Make of a base colour texture, (H, W, 4) uint8, what passes where its alpha, times another, is what glass covers of a place, of which
    passed (3,) passes: the rest is open."""
    covered = alpha * codes[..., 3:] / 255.0
    return _with_linear(codes, 1 - covered * (1 - passed * srgb_decode(codes[..., :3] / 255.0)))


def _with_linear(codes: np.ndarray, linear: np.ndarray) -> np.ndarray:
    out = codes.copy()
    out[..., :3] = np.rint(255 * srgb_encode(np.clip(linear, 0, 1)))
    return out


def draws(share: float, least: float, framed: bool, tinted: bool) -> list[tuple[str, dict[str, Any]]]:
    """List (what, settings of pygfx) of the draws that show glass, first to last: "frame", "tint", "body", "gloss".

    share: of light that passes, and `least` where it is least; framed: an alpha, of `in_frame`, tells glass from what is solid; tinted:
    not all that is behind is seen through it as it is.
    """
    found = [("tint", TINT)] if tinted else []
    if least < 1 - BODY:
        found.append(("body", GLOSS if framed else {**GLOSS, "opacity": 1 - share}))
    if not framed:
        return [*found, ("gloss", {**GLOSS, "opacity": share if share < 1 - BODY else 1.0})]
    frame, rest = split(1 - DARK)
    glass = {name: rest[name] for name in ("alpha_test", "alpha_compare")}
    found.append(("gloss", GLOSS_WHOLE))
    return [("frame", frame), *((what, {**settings, **glass}) for what, settings in found)]
