"""Renders the layer of `tracer.layer` by Monte Carlo: Mitsuba 3's volpath with max_depth 2, which shares nothing with Airlight but the
rays, the triangles and the numbers of the lights. Needs the extra `validate`.

Where Mitsuba means something else than Airlight, it is given a scene in which it means the same:

- a pixel's rays all go through its centre: each is a radiancemeter of its own, a row of them one batch;
- suns are attenuated in Mitsuba, on all of their way through the medium. A row's rays lie in one plane, so the medium is a thin sheet
  around it, and the way out of that is short;
- the medium ends at max_distance from the eye. For lights, which may stand farther away, it only absorbs there;
- spots fall off by Airlight's ramp, a texture on a spot that is as bright everywhere in its cone; times a cookie or photometry;
- projectors, whose picture is the irradiance of a plane in Mitsuba, have one that makes their intensity the cookie's alone. They have no
  near plane: what is before it has to be out of view;
- surfaces are black.

A medium that varies is a grid in a box (mitsuba_fields.py). There suns are dimmed on all of their way, as sun_extinction all has it; of
fog, the ball of max_distance around the eye scatters, and the rest only absorbs.

Each light, and each sigma_t of a colour, is rendered on its own in grey, with white light, or a cookie's, in a medium of albedo 1, so that
no sample of a pixel is spent on another choice than where the light is scattered.
"""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from airlight.errors import AirlightError
from airlight.lights.directional import DirectionalLight
from airlight.lights.point import PointLight
from airlight.lights.projector import ProjectorLight
from airlight.lights.punctual import PositionalLight, PunctualLight
from airlight.lights.spot import SpotLight
from airlight.medium.resolve import ResolvedMedium
from airlight.projection import eye_rays
from airlight.reference import mitsuba_fields, paths
from airlight.reference.lights import cone_ramp
from airlight.reference.medium import Layer, transmittance

Array = npt.NDArray[Any]
SHEET_SHARE = 1e-5  # of max_distance, half the thickness of a row's medium: far above the rounding of a ray in float32
SAMPLER = {True: "stratified", False: "orthogonal"}  # suns: one distance; lights: that, and by chance the light's own way, together
RAMP_TEXELS = 2048  # texels across a spot's cone
MAX_HALF_ANGLE = 1.4  # radians, half angle of a spot that a texture covers well
PHASES = ("henyey-greenstein", "two-lobe", "isotropic", "rayleigh")


def layer(
    view: Any,
    projection: Any,
    size: tuple[int, int],
    triangles: Array,
    lights: Sequence[PunctualLight],
    medium: ResolvedMedium,
    casters: Array | None = None,
    *,
    spp: int = 256,
    seed: int = 0,
) -> tuple[Layer, Array]:
    """Renders the layer of `tracer.layer`, and (H, W, 3) half the difference of two independent halves of the samples: on the mean over
    pixels, its square is that of the error of the radiance.

    spp: rays of a pixel, light and sigma_t; Mitsuba's samplers take some more. The camera has perspective, and what is nearer than its
    near plane is seen. Raises AirlightError for what Mitsuba has not: the Cornette-Shanks phase function, ambient light, a range of lights,
    spots wider than 1.4 radians, cookies of suns, photometry of points, projectors that planes bound or that fall off otherwise than with
    the square of the distance, and triangles that only the eye, or only the light, meets.
    """
    width, height = size
    triangles = np.asarray(triangles, float).reshape(-1, 3, 3)
    (a, b, c, d), flat = eye_rays(projection)
    _refuse(triangles, casters, lights, medium, bool(flat))
    mi = ready()
    into = np.linalg.inv(np.asarray(view, float))
    eye = into[:3, 3]
    x, y = np.meshgrid(a * (np.arange(width) + 0.5) / width + c, b * (np.arange(height) + 0.5) / height + d)
    rays = np.stack([x, y, -np.ones_like(x)], axis=2) @ into[:3, :3].T
    rays /= np.linalg.norm(rays, axis=2, keepdims=True)
    mesh = _mesh(mi, triangles)
    halves = np.zeros((2, height, width, 3))
    for light in lights:
        factor = light.fade(eye, medium) * light.strength * np.array(light.intensity)
        albedo = np.divide(medium.sigma_s, medium.sigma_t, out=np.zeros(3), where=medium.sigma_t > 0)
        for sigma in np.unique(medium.sigma_t[albedo * factor > 0]):
            grey = _grey(mi, eye, rays, mesh, light, medium, float(sigma), (spp + 1) // 2, seed)
            halves += np.where(medium.sigma_t == sigma, albedo * factor, 0) * grey
    reach = length = _way(mi, eye, rays, mesh, medium.max_distance)
    if not paths.is_even(medium):
        ends = eye + reach[..., None] * rays
        length = paths.optical_length(np.broadcast_to(eye, ends.shape).reshape(-1, 3), ends.reshape(-1, 3), medium).reshape(reach.shape)
    return Layer(halves.mean(axis=0), transmittance(length, medium.sigma_t), reach), (halves[0] - halves[1]) / 2


def _refuse(triangles: Array, casters: Array | None, lights: Sequence[PunctualLight], medium: ResolvedMedium, flat: bool) -> None:
    if casters is not None and not np.array_equal(triangles, np.asarray(casters, float).reshape(-1, 3, 3)):
        raise AirlightError("Mitsuba has no triangles that cast no shadow: leave out bodies of lamps")
    if np.any(medium.ambient):
        raise AirlightError("Mitsuba has no ambient light in a medium: set ambient to 0")
    if medium.settings.phase not in PHASES:
        raise AirlightError(f"Mitsuba has no phase function {medium.settings.phase}: take {', '.join(PHASES)}")
    if medium.settings.sun_glow or medium.sun_reach < medium.max_distance:
        raise AirlightError("Mitsuba's suns have no glow and no distance of their own: leave out sun_glow and sun_distance")
    if flat:
        raise AirlightError("the rays of a row have to meet in the eye: take a camera with perspective")
    if not paths.is_even(medium):
        mitsuba_fields.refuse(medium, list(lights))
    for light in lights:
        if type(light) not in EMITTERS:
            raise AirlightError(f"Mitsuba has no {light.word} light here: take {', '.join(kind.word for kind in EMITTERS)}")
        if (light.density, light.extinction) != (1, 1):
            raise AirlightError("Mitsuba has one medium for all lights: leave out their density and extinction")
        if light.attenuation_range():
            raise AirlightError("Mitsuba's lamps have no range: set it to 0")
        if isinstance(light, SpotLight) and light.outer > MAX_HALF_ANGLE:
            raise AirlightError(f"a spot of {light.outer:.2f} radians is too wide for a texture: at most {MAX_HALF_ANGLE}")
        if not isinstance(light, SpotLight | ProjectorLight) and (light.cookie is not None or light.photometry is not None):
            raise AirlightError(f"Mitsuba has no {light.word} with a shape: take a spot or a projector, or leave out cookie and photometry")
        if isinstance(light, ProjectorLight) and (light.clip or light.far or light.falloff_terms() != (1, 0, 0)):
            raise AirlightError("Mitsuba's projectors have no end, no clip planes, one falloff: leave out far, clip, falloff and ambient")


def ready() -> Any:
    """Import Mitsuba. Raises AirlightError where it is not installed."""
    try:
        import mitsuba as mi
    except ImportError:
        raise AirlightError("Mitsuba is missing: pip install 'airlight[validate]'") from None
    mi.set_variant("scalar_rgb")  # the one that needs nothing but itself
    mi.set_log_level(mi.LogLevel.Error)
    return mi


def _grey(
    mi: Any, eye: Array, rays: Array, mesh: Any, light: PunctualLight, medium: ResolvedMedium, sigma: float, spp: int, seed: int
) -> Array:
    """Renders (2, H, W, 3) radiance, twice, of a light of 1 in a medium of albedo 1."""
    height, width = rays.shape[:2]
    even = paths.is_even(medium)
    media, inside = _even(mi, eye, light, medium, sigma) if even else _varying(mi, eye, light, medium, sigma)
    emitter = mi.load_dict(EMITTERS[type(light)](mi, light))
    parts = {"type": "scene", "lamp": emitter} | media | ({"mesh": mesh} if mesh else {})
    integrator = mi.load_dict({"type": "volpath", "max_depth": 2})
    scene = mi.load_dict(parts)
    found = np.zeros((2, height, width, 3))
    for row in range(height):
        if light.directional and even:
            scene = mi.load_dict(parts | _sheet(mi, eye, rays[row], SHEET_SHARE * medium.max_distance, medium.max_distance, inside))
        sensor = _sensor(mi, eye, rays[row], inside, SAMPLER[light.directional] if even else "independent")
        for half in range(2):
            number = (2 * seed + half) * height + row
            picture = mi.render(scene, sensor=sensor, integrator=integrator, spp=spp, seed=number)
            found[half, row] = np.array(picture)[0, :, :3]
    return found


def _even(mi: Any, eye: Array, light: PunctualLight, medium: ResolvedMedium, sigma: float) -> tuple[dict[str, Any], Any]:
    """Makes a medium of density 1, and what the eye is in."""
    inside = mi.load_dict(_medium(light, medium, sigma, 1.0))
    ball = {"type": "sphere", "center": eye.tolist(), "radius": medium.max_distance, "bsdf": {"type": "null"}, "interior": inside}
    if not light.directional:
        ball["exterior"] = mi.load_dict(_medium(light, medium, sigma, 0.0))
    return {"ball": mi.load_dict(ball)}, inside


def _varying(mi: Any, eye: Array, light: PunctualLight, medium: ResolvedMedium, sigma: float) -> tuple[dict[str, Any], Any]:
    """Makes a medium of grids, and what the eye is in, None where that is nothing."""
    density, into = mitsuba_fields.grid(medium, eye, light)
    phase = _phase(light, medium)
    inside = mitsuba_fields.medium_of(mi, phase, density, into, sigma, 1.0)
    if medium.fields:
        corners = np.stack(np.meshgrid(*[[0, 1]] * 3), axis=-1).reshape(-1, 3) @ into[:3, :3].T + into[:3, 3]
        if np.linalg.norm(corners - eye, axis=1).max() > medium.max_distance:
            raise AirlightError("the volume reaches farther than max_distance, where Mitsuba's goes on: set it higher")
        box = mi.load_dict(mitsuba_fields.box(mi, into, inside))
        return {"box": box}, inside if mitsuba_fields.holds(into, eye) else None
    outside = mitsuba_fields.medium_of(mi, phase, density, into, sigma, 0.0)
    ball = {"type": "sphere", "center": eye.tolist(), "radius": medium.max_distance, "bsdf": {"type": "null"}, "interior": inside}
    ball["exterior"] = outside
    return {"ball": mi.load_dict(ball), "box": mi.load_dict(mitsuba_fields.box(mi, into, outside))}, inside


def _medium(light: PunctualLight, medium: ResolvedMedium, sigma: float, albedo: float) -> dict[str, Any]:
    return {"type": "homogeneous", "albedo": albedo, "sigma_t": sigma, "phase": _phase(light, medium)}


def _phase(light: PunctualLight, medium: ResolvedMedium) -> dict[str, Any]:
    name, (_, g, back, share) = medium.settings.phase, medium.lobes(light.anisotropy)
    if name in ("isotropic", "rayleigh"):
        return {"type": name}
    first = {"type": "hg", "g": g}
    if name == "henyey-greenstein":
        return first
    return {"type": "blendphase", "first": first, "second": {"type": "hg", "g": back}, "weight": share}


def _directional(mi: Any, light: DirectionalLight) -> dict[str, Any]:
    """Describes a directional light of irradiance 1."""
    return {"type": "directional", "direction": [-k for k in light.direction], "irradiance": 1.0}


def _point(mi: Any, light: PointLight) -> dict[str, Any]:
    """Describes a point light of intensity 1."""
    return {"type": "point", "position": [float(k) for k in light.position], "intensity": 1.0}


def _spot(mi: Any, light: SpotLight) -> dict[str, Any]:
    """Describes a spot of intensity 1 along its axis, whose falloff and shape are a texture."""
    degrees = float(np.degrees(light.outer))
    side = (2 * (np.arange(RAMP_TEXELS) + 0.5) / RAMP_TEXELS - 1) * np.tan(light.outer)
    picture = _shape_over(light, side, side[::-1])
    picture *= cone_ramp(1 / np.sqrt(1 + side**2 + side[:, None] ** 2), *light.cone())[..., None] ** 2
    return {
        "type": "spot",
        "to_world": _facing(mi, light),
        "cutoff_angle": degrees,
        "beam_width": degrees,
        "intensity": 1.0,
        "texture": _texture(mi, picture[::-1, ::-1]),  # which begins with its lower right corner, as seen from the light
    }


def _projector(mi: Any, light: ProjectorLight) -> dict[str, Any]:
    """Describes a projector of intensity 1 times its cookie. Mitsuba makes of a picture p the intensity pi p / cos^3 of the angle to the
    axis, and has square texels."""
    wide, high = light.tangents()
    rows = max(round(RAMP_TEXELS * high / wide), 1)
    x = (2 * (np.arange(RAMP_TEXELS) + 0.5) / RAMP_TEXELS - 1) * wide
    y = (1 - 2 * (np.arange(rows) + 0.5) / rows) * high
    picture = _shape_over(light, x, y) * (1 + x**2 + y[:, None] ** 2)[..., None] ** -1.5 / np.pi
    degrees = float(np.degrees(2 * np.arctan(wide)))
    return {"type": "projector", "to_world": _facing(mi, light), "fov": degrees, "fov_axis": "x", "irradiance": _texture(mi, picture)}


def _shape_over(light: PositionalLight, x: Array, y: Array) -> Array:
    """Evaluates (H, W, 3) a light's shape 1 m ahead of it, at x (W,) m to the right and y (H,) m up."""
    across, up = np.meshgrid(x, y)
    places = np.stack([across, up, np.ones_like(across)], axis=-1) @ light.axes() + light.origin()
    return np.array(light.colour(places))


def _facing(mi: Any, light: PositionalLight) -> Any:
    """Turns what shines along +z, with +x to its left, to the axes of a light's shape."""
    right, up, ahead = light.axes()
    matrix = np.eye(4)
    matrix[:3] = np.column_stack([-right, up, ahead, light.origin()])
    return mi.ScalarTransform4f(matrix.tolist())


def _texture(mi: Any, picture: Array) -> dict[str, Any]:
    bitmap = mi.Bitmap(np.ascontiguousarray(picture, np.float32))
    return {"type": "bitmap", "bitmap": bitmap, "raw": True, "wrap_mode": "clamp"}


EMITTERS: dict[type[PunctualLight], Callable[[Any, Any], dict[str, Any]]] = {
    DirectionalLight: _directional,
    SpotLight: _spot,
    PointLight: _point,
    ProjectorLight: _projector,
}


def _mesh(mi: Any, triangles: Array) -> Any:
    """Make black triangles; None where there is none."""
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


def _sheet(mi: Any, eye: Array, rays: Array, half: float, reach: float, inside: Any) -> dict[str, Any]:
    """Describes the two sides of a row's medium, half its thickness from the plane of its rays; beyond them is nothing."""
    normal = np.cross(rays[0], rays[-1])
    normal /= np.linalg.norm(normal)
    middle = rays[0] + rays[-1]
    sides = {}
    for name, out in (("above", normal), ("below", -normal)):
        at = eye + half * out
        turn = mi.ScalarTransform4f().look_at(at.tolist(), (at + out).tolist(), middle.tolist()).scale(2 * reach)
        sides[name] = {"type": "rectangle", "to_world": turn, "bsdf": {"type": "null"}, "interior": inside}
    return sides


def _sensor(mi: Any, eye: Array, rays: Array, inside: Any, sampler: str) -> Any:
    film = {"type": "hdrfilm", "height": 1, "rfilter": {"type": "box"}, "pixel_format": "rgb", "component_format": "float32"}
    one = {"type": "radiancemeter", "origin": eye.tolist(), "film": {**film, "width": 1}}
    meters = {f"meter{i:06}": {**one, "direction": ray.tolist()} for i, ray in enumerate(rays)}
    film["width"] = len(rays)
    around = {} if inside is None else {"medium": inside}
    return mi.load_dict({"type": "batch", **around, "film": film, "sampler": {"type": sampler}, **meters})


def _way(mi: Any, eye: Array, rays: Array, mesh: Any, reach: float) -> Array:
    """Finds (H, W) metres to the first triangle, at most reach."""
    if mesh is None:
        return np.full(rays.shape[:2], reach)
    scene = mi.load_dict({"type": "scene", "mesh": mesh})
    start = mi.Point3f(eye.tolist())
    found = [scene.ray_intersect_preliminary(mi.Ray3f(start, mi.Vector3f(ray))).t for ray in rays.reshape(-1, 3).tolist()]
    return np.minimum(np.reshape(found, rays.shape[:2]), reach)
