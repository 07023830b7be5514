"""The light of `tracer.layer` once more, by Monte Carlo: Mitsuba 3's volpath with max_depth 2, which shares nothing with Airlight but the
rays, the triangles and the numbers of the lamps. Needs the extra `validate`.

Where Mitsuba means something else than Airlight, it is given a scene in which it means the same:

- a pixel's rays all go through its centre: each is a radiancemeter of its own, a row of them one batch;
- suns are attenuated in Mitsuba, on all of their way through the medium. A row's rays lie in one plane, so the medium is a thin sheet
  around it, and the way out of that is short;
- the medium ends at max_distance from the eye. For lamps, which may stand farther away, it only absorbs there;
- spots fall off by Airlight's ramp, a texture on a spot that is as bright everywhere in its cone;
- surfaces are black.

Each lamp, and each sigma_t of a colour, is rendered on its own in grey, with white light in a medium of albedo 1, so that no sample of a
pixel is spent on another choice than where the light is scattered.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from airlight.errors import AirlightError
from airlight.lamps import Lamp
from airlight.medium import Settled
from airlight.projection import eye_rays
from airlight.reference.medium import Layer, transmittance

Array = npt.NDArray[Any]
SHEET = 1e-5  # of max_distance, half the thickness of a row's medium: far above the rounding of a ray in float32
SAMPLER = {True: "stratified", False: "orthogonal"}  # suns: one distance; lamps: that, and by chance the light's own way, together
RAMP = 2048  # texels across a spot's cone
WIDEST = 1.4  # radians, half angle of a spot that a texture covers well
PHASES = ("henyey-greenstein", "two-lobe", "isotropic", "rayleigh")


def layer(
    view: Any,
    projection: Any,
    size: tuple[int, int],
    triangles: Array,
    lamps: Sequence[Lamp],
    air: Settled,
    casters: Array | None = None,
    *,
    spp: int = 256,
    seed: int = 0,
) -> tuple[Layer, Array]:
    """The layer as of `tracer.layer`, and (H, W, 3) half the difference of two independent halves of the samples: on the mean over pixels,
    its square is that of the error of the radiance.

    spp: rays of a pixel, lamp and sigma_t; Mitsuba's samplers take some more. The camera has perspective, and what is nearer than its
    near plane is seen. Raises AirlightError for what Mitsuba has not: the Cornette-Shanks phase function, ambient light, a range of lamps,
    spots wider than 1.4 radians, and triangles that only the eye, or only the light, meets.
    """
    width, height = size
    triangles = np.asarray(triangles, float).reshape(-1, 3, 3)
    (a, b, c, d), flat = eye_rays(projection)
    _refuse(triangles, casters, lamps, air, bool(flat))
    mi = ready()
    into = np.linalg.inv(np.asarray(view, float))
    eye = into[:3, 3]
    x, y = np.meshgrid(a * (np.arange(width) + 0.5) / width + c, b * (np.arange(height) + 0.5) / height + d)
    rays = np.stack([x, y, -np.ones_like(x)], axis=2) @ into[:3, :3].T
    rays /= np.linalg.norm(rays, axis=2, keepdims=True)
    mesh = _mesh(mi, triangles)
    halves = np.zeros((2, height, width, 3))
    for lamp in lamps:
        factor = lamp.seen_from(eye, air.medium.lamp_distance, air.medium.lamp_fade) * lamp.strength * np.array(lamp.intensity)
        albedo = np.divide(air.sigma_s, air.sigma_t, out=np.zeros(3), where=air.sigma_t > 0)
        for sigma in np.unique(air.sigma_t[albedo * factor > 0]):
            grey = _grey(mi, eye, rays, mesh, lamp, air, float(sigma), (spp + 1) // 2, seed)
            halves += np.where(air.sigma_t == sigma, albedo * factor, 0) * grey[..., None]
    reach = _way(mi, eye, rays, mesh, air.max_distance)
    return Layer(halves.mean(axis=0), transmittance(reach, air.sigma_t), reach), (halves[0] - halves[1]) / 2


def _refuse(triangles: Array, casters: Array | None, lamps: Sequence[Lamp], air: Settled, flat: bool) -> None:
    if casters is not None and not np.array_equal(triangles, np.asarray(casters, float).reshape(-1, 3, 3)):
        raise AirlightError("Mitsuba has no triangles that cast no shadow: leave out bodies of lamps")
    if np.any(air.ambient):
        raise AirlightError("Mitsuba has no ambient light in a medium: set ambient to 0")
    if air.medium.phase not in PHASES:
        raise AirlightError(f"Mitsuba has no phase function {air.medium.phase}: take {', '.join(PHASES)}")
    if flat:
        raise AirlightError("the rays of a row have to meet in the eye: take a camera with perspective")
    for lamp in lamps:
        if not lamp.is_sun and lamp.range:
            raise AirlightError("Mitsuba's lamps have no range: set it to 0")
        if lamp.kind == "spot" and lamp.outer > WIDEST:
            raise AirlightError(f"a spot of {lamp.outer:.2f} radians is too wide for a texture: at most {WIDEST}")


def ready() -> Any:
    """Mitsuba. Raises AirlightError where it is not installed."""
    try:
        import mitsuba as mi
    except ImportError:
        raise AirlightError("Mitsuba is missing: pip install 'airlight[validate]'") from None
    mi.set_variant("scalar_rgb")  # the one that needs nothing but itself
    mi.set_log_level(mi.LogLevel.Error)
    return mi


def _grey(mi: Any, eye: Array, rays: Array, mesh: Any, lamp: Lamp, air: Settled, sigma: float, spp: int, seed: int) -> Array:
    """(2, H, W) radiance, twice, of a lamp of 1 in a medium of albedo 1."""
    height, width = rays.shape[:2]
    medium = mi.load_dict(_medium(lamp, air, sigma, 1.0))
    ball = {"type": "sphere", "center": eye.tolist(), "radius": air.max_distance, "bsdf": {"type": "null"}, "interior": medium}
    if not lamp.is_sun:
        ball["exterior"] = mi.load_dict(_medium(lamp, air, sigma, 0.0))
    parts = {"type": "scene", "ball": mi.load_dict(ball), "lamp": mi.load_dict(_emitter(mi, lamp))} | ({"mesh": mesh} if mesh else {})
    integrator = mi.load_dict({"type": "volpath", "max_depth": 2})
    scene = mi.load_dict(parts)
    found = np.zeros((2, height, width))
    for row in range(height):
        if lamp.is_sun:
            scene = mi.load_dict(parts | _sheet(mi, eye, rays[row], SHEET * air.max_distance, air.max_distance, medium))
        sensor = _sensor(mi, eye, rays[row], medium, SAMPLER[lamp.is_sun])
        for half in range(2):
            number = (2 * seed + half) * height + row
            picture = mi.render(scene, sensor=sensor, integrator=integrator, spp=spp, seed=number)
            found[half, row] = np.array(picture)[0, :, 0]
    return found


def _medium(lamp: Lamp, air: Settled, sigma: float, albedo: float) -> dict[str, Any]:
    return {"type": "homogeneous", "albedo": albedo, "sigma_t": sigma, "phase": _phase(lamp, air)}


def _phase(lamp: Lamp, air: Settled) -> dict[str, Any]:
    name, (_, g, back, share) = air.medium.phase, air.lobes(lamp)
    if name in ("isotropic", "rayleigh"):
        return {"type": name}
    first = {"type": "hg", "g": g}
    if name == "henyey-greenstein":
        return first
    return {"type": "blendphase", "first": first, "second": {"type": "hg", "g": back}, "weight": share}


def _emitter(mi: Any, lamp: Lamp) -> dict[str, Any]:
    place = np.asarray(lamp.position, float)
    if lamp.is_sun:
        return {"type": "directional", "direction": [-k for k in lamp.direction], "irradiance": 1.0}
    if lamp.kind == "point":
        return {"type": "point", "position": place.tolist(), "intensity": 1.0}
    degrees = float(np.degrees(lamp.outer))
    scale, offset = lamp.cone()
    side = (2 * (np.arange(RAMP) + 0.5) / RAMP - 1) * np.tan(lamp.outer)
    cosine = 1 / np.sqrt(1 + side**2 + side[:, None] ** 2)
    ramp = np.clip(cosine * scale + offset, 0, 1)[..., None] ** 2
    up = np.eye(3)[np.argmin(np.abs(lamp.direction))]
    return {
        "type": "spot",
        "to_world": mi.ScalarTransform4f().look_at(place.tolist(), (place + lamp.direction).tolist(), up.tolist()),
        "cutoff_angle": degrees,
        "beam_width": degrees,
        "intensity": 1.0,
        "texture": {"type": "bitmap", "bitmap": mi.Bitmap(ramp.astype(np.float32)), "raw": True, "wrap_mode": "clamp"},
    }


def _mesh(mi: Any, triangles: Array) -> Any:
    """Black triangles; None where there is none."""
    if not len(triangles):
        return None
    properties = mi.Properties()
    properties["bsdf"] = mi.load_dict({"type": "conductor", "specular_reflectance": 0.0})
    mesh = mi.Mesh("triangles", 3 * len(triangles), len(triangles), props=properties)
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = triangles.astype(np.float32).ravel()
    parameters["faces"] = np.arange(3 * len(triangles), dtype=np.uint32)
    parameters.update()
    return mesh


def _sheet(mi: Any, eye: Array, rays: Array, half: float, reach: float, medium: Any) -> dict[str, Any]:
    """The two sides of a row's medium, half its thickness from the plane of its rays; beyond them is nothing."""
    normal = np.cross(rays[0], rays[-1])
    normal /= np.linalg.norm(normal)
    middle = rays[0] + rays[-1]
    sides = {}
    for name, out in (("above", normal), ("below", -normal)):
        place = eye + half * out
        turn = mi.ScalarTransform4f().look_at(place.tolist(), (place + out).tolist(), middle.tolist()).scale(2 * reach)
        sides[name] = {"type": "rectangle", "to_world": turn, "bsdf": {"type": "null"}, "interior": medium}
    return sides


def _sensor(mi: Any, eye: Array, rays: Array, medium: Any, sampler: str) -> Any:
    film = {"type": "hdrfilm", "height": 1, "rfilter": {"type": "box"}, "pixel_format": "rgb", "component_format": "float32"}
    one = {"type": "radiancemeter", "origin": eye.tolist(), "film": {**film, "width": 1}}
    meters = {f"meter{i:06}": {**one, "direction": ray.tolist()} for i, ray in enumerate(rays)}
    film["width"] = len(rays)
    return mi.load_dict({"type": "batch", "medium": medium, "film": film, "sampler": {"type": sampler}, **meters})


def _way(mi: Any, eye: Array, rays: Array, mesh: Any, reach: float) -> Array:
    """(H, W) metres to the first triangle, at most reach."""
    if mesh is None:
        return np.full(rays.shape[:2], reach)
    scene = mi.load_dict({"type": "scene", "mesh": mesh})
    start = mi.Point3f(eye.tolist())
    found = [scene.ray_intersect_preliminary(mi.Ray3f(start, mi.Vector3f(ray))).t for ray in rays.reshape(-1, 3).tolist()]
    return np.minimum(np.reshape(found, rays.shape[:2]), reach)
