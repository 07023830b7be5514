"""Puts lamps into a stage that it does not have: where a user says, or in one of its meshes; lets lamps cast shadows on surfaces."""

import contextlib
import dataclasses
import math
import shlex
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pygfx as gfx

from airlight.colour import srgb_decode
from airlight.errors import AirlightError, warn
from airlight.lights.punctual import Triple
from airlight.messages import nearest
from airlight.pygfx import SceneLight
from airlight.pygfx.projector import Projector
from airlight.scenes.exposure import PHYSICAL_CANDELA, PHYSICAL_LUX
from airlight.scenes.gltf.materials import broken_driver, spare_maps
from airlight.scenes.stage import Stage
from airlight.scenes.triangles import of_mesh

MAX_INTENSITY = 1e9  # lux or candela
NAMES_TOLD = 12
BODY_RADIANCE = 4.0  # of a body in the picture, up to which its shafts grow with it: beyond, they would cover all


@dataclass(frozen=True)
class NamedLight:
    """Asks for an object of the scene as a light: a lamp that it has, or a mesh, with a lamp in it.

    color, strength, intensity: as SceneLight's of a lamp. Of a mesh they are candela, with strength None: what it emits, tinted.
    density, extinction, photometry, cookie: as SceneLight's.
    """

    name: str
    color: Triple = (1.0, 1.0, 1.0)
    strength: float | None = None
    intensity: float | None = None
    density: float = 1.0
    extinction: float = 1.0
    photometry: Any = None
    cookie: Any = None


@dataclass
class Lighting:
    """Says what shines in a stage, and what has to be done for it.

    lights: what casts shafts. moved: lamps of the stage, and where they go. added: lamps, and the object that each one hangs on.
    bodies: meshes around lamps, which hide nothing. own: projectors that a program or another lighting may have too, their intensities, and
    the stage, whose exposure scales them only while they shine in it.
    """

    lights: list[SceneLight]
    moved: list[tuple[Any, Any]] = field(default_factory=list)
    added: list[tuple[Any, Any]] = field(default_factory=list)
    bodies: list[Any] = field(default_factory=list)
    own: list[tuple[Any, float, Stage]] = field(default_factory=list)

    def move(self) -> None:
        for lamp, position in self.moved:
            lamp.world.position = position

    @contextlib.contextmanager
    def shining(self) -> Iterator[None]:
        """Let the added lamps shine for as long as the block lasts."""
        casting = [(mesh, mesh.cast_shadow) for mesh in self.bodies]
        self.add()
        try:
            yield
        finally:
            for lamp, parent in self.added:
                parent.remove(lamp)
            for projector, intensity, _ in self.own:
                projector.intensity = intensity
            for mesh, cast in casting:
                mesh.cast_shadow = cast

    def add(self) -> None:
        """Let the added lamps shine from now on."""
        for lamp, parent in self.added:
            parent.add(lamp)
        for projector, intensity, stage in self.own:
            projector.intensity = intensity * stage.pre_exposure
        for mesh in self.bodies:
            mesh.cast_shadow = False


def lighting(stage: Stage, requested: Sequence[SceneLight | NamedLight | Projector]) -> Lighting:
    """Choose what shines, in place of the stage's own shafts; nothing requested but projectors: those, and the projectors.

    A position or a direction moves the next lamp of its kind, where there is one left; else a lamp is added there that shades surfaces and
    casts shadows on them, of color times strength candela or lux. Raises AirlightError for what has no such name, or emits nothing.
    """
    projectors = [one for one in requested if isinstance(one, Projector)]
    others = [one for one in requested if not isinstance(one, Projector)]
    made = Lighting([] if others else list(stage.lights))
    for projector in projectors:
        cast_shadow(projector, stage.center, stage.radius)
        made.added.append((projector, stage.scene))
        made.own.append((projector, projector.intensity, stage))
        made.lights.append(SceneLight(projector))
    if not others:
        return made
    stage.measured = stage.measured or any(one.intensity is not None for one in others)
    free = [light for light in stage.lights if light.target is not None]
    for one in others:
        if isinstance(one, NamedLight):
            _named(stage, one, made)
            continue
        sun = one.direction is not None
        taken = next((light for light in free if isinstance(light.target, gfx.DirectionalLight) == sun), None)
        if taken is None:
            made.lights.append(_added(stage, one, made))
            continue
        free.remove(taken)
        _set(taken.target, one.intensity)
        made.moved.append((taken.target, _turned(taken.target, one.direction) if one.direction is not None else one.position))
        made.lights.append(dataclasses.replace(taken, color=one.color, strength=one.strength, **_own(one)))
    if any(light.cookie is not None and shines_around(light) for light in made.lights):
        raise AirlightError("a cookie is of a light that shines all around; give --light the name of a spot, or use --projector or --sun")
    if made.added:
        lost = lost_maps(stage.scene, [lamp for lamp, _ in made.added])
        if lost:
            warn(f"{stage.name}: shown without its {lost}: this version of software Vulkan fails on so many", 4)
    return made


def relight(stage: Stage, requested: Sequence[SceneLight | NamedLight | Projector]) -> None:
    """Let a stage have the requested lights for good, as `lighting` chooses them."""
    made = lighting(stage, requested)
    made.move()
    made.add()
    stage.lights = made.lights
    stage.draggable += [lamp for lamp, parent in made.added if parent is stage.scene and not isinstance(lamp, gfx.DirectionalLight)]
    if stage.movable not in stage.lights:
        lamps = [lamp for lamp, parent in made.added if parent is stage.scene and not isinstance(lamp, gfx.DirectionalLight)]
        stage.movable = next((light for light in stage.lights if light.target in lamps), None)


def shines_around(light: SceneLight) -> bool:
    """Tell whether a light has no side that a cookie could be on: a point light's, or one that is given by a position."""
    lamps = () if light.target is None else light.target.iter()
    return light.position is not None or any(isinstance(lamp, gfx.PointLight) for lamp in lamps)


def cast_shadow(light: gfx.Light, center: np.ndarray, radius: float) -> None:
    """Let a light cast shadows over the whole of a scene, the ball around `center`; near planes and biases that fit its size."""
    light.cast_shadow = True
    light.shadow.cull_mode = "none"
    r = radius
    camera = light.shadow.camera
    if isinstance(light, gfx.DirectionalLight):
        camera.width = camera.height = 2.05 * r
        camera.depth_range = (0.4 * r, 2.6 * r)
        light.shadow.bias = 0.004
        return
    distance = float(np.linalg.norm(light.world.position - center))
    # pygfx sets a spot's angle, and far planes from the range, with near planes that swallow every bias, unless they are so already.
    far = light.distance * 10 if light.distance else 2 * (distance + r)
    if isinstance(light, gfx.SpotLight):
        camera.fov, camera.aspect = 180 / math.pi * 2 * light.angle, 1
    camera.depth_range = (min(r / 100, far / 2), far)
    light.shadow.bias = 2e-4


def lost_maps(scene: Any, added: Iterable[gfx.Light] = ()) -> str:
    """Spare maps of a scene's materials as `spare_maps` says, for its lights and the added ones; the names of those lost, in words."""
    if not broken_driver():
        return ""
    things = list(scene.iter())
    kinds = {type(thing) for thing in (*things, *added) if isinstance(thing, gfx.Light)} - {gfx.AmbientLight}
    others = len(kinds) + (scene.environment is not None)
    materials = {thing.material for thing in things if isinstance(thing, gfx.Mesh)}
    lost = {name for material in materials for name in spare_maps(material, others)}
    return ", ".join(sorted(name.replace("_", " ") + "s" for name in lost))


def glowing(things: Iterable[Any]) -> list[str]:
    """List the names, each once, of the meshes that emit light, or of what they hang on."""
    names = [name for thing in things if isinstance(thing, gfx.Mesh) and radiance(thing.material).any() and (name := _name(thing))]
    return list(dict.fromkeys(names))


def offer(stage: Stage) -> str | None:
    """Say which meshes of a stage that has no lights of its own may be its light; None where there are none, or it has lights."""
    if not stage.glowing:
        return None
    names = [repr(name) for name in stage.glowing[:3]]
    more = f" and {len(stage.glowing) - 3} more" if len(stage.glowing) > 3 else ""
    what = f"the mesh {names[0]} is emissive" if len(stage.glowing) == 1 else f"the meshes {', '.join(names)}{more} are emissive"
    return f"{stage.name}: no lights; {what}: --light {shlex.quote(stage.glowing[0])}"


def radiance(material: Any) -> np.ndarray:
    """Average the (3,) linear radiance that a material emits, by its factor and its map; an unlit one emits none."""
    emissive = getattr(material, "emissive", None)
    if emissive is None:
        return np.zeros(3)
    found = np.array(emissive.to_physical()[:3]) * getattr(material, "emissive_intensity", 1.0)
    texture = getattr(material, "emissive_map", None)
    if texture is not None and found.any():
        found = found * srgb_decode(np.asarray(texture.texture.data[..., :3], float).reshape(-1, 3) / 255).mean(axis=0)
    return np.asarray(found)


def candela(mesh: Any) -> np.ndarray:
    """Compute the (3,) intensity of a mesh from afar, on average over all directions: its radiance times its projected area, which of a
    convex body is a quarter of its surface (Cauchy)."""
    a, b, c = np.moveaxis(of_mesh(mesh), 1, 0)
    area = float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()) / 2
    return radiance(mesh.material) * (area / 4)


def named(scene: Any, name: str, option: str) -> list[Any]:
    """Find the objects of a name. Raises AirlightError where there are none, for that option."""
    found: dict[str, list[Any]] = {}
    for thing in scene.iter():
        if thing.name:
            found.setdefault(thing.name, []).append(thing)
    if name not in found:
        hint = nearest(name, found, f"; there is {', '.join(list(found)[:NAMES_TOLD]) or 'nothing with a name'}")
        raise AirlightError(f"{option} {name}: the scene has no object of that name{hint}")
    return found[name]


def _turned(sun: gfx.DirectionalLight, direction: Any) -> np.ndarray:
    """Find where a sun has to be for its light to come from a direction, as far from its target as it is."""
    about, towards = np.asarray(sun.target.world.position, float), np.asarray(direction, float)
    return np.asarray(about + towards / np.linalg.norm(towards) * np.linalg.norm(np.asarray(sun.world.position) - about))


def _lamp(kind: type, intensity: np.ndarray, **more: Any) -> gfx.Light:
    top = float(intensity.max())
    color = gfx.Color.from_physical(*(float(v) for v in (intensity / top if top > 0 else np.ones(3))))
    return kind(color, min(top, MAX_INTENSITY), **more)


def _set(target: Any, intensity: float | None) -> None:
    """Give the lamps of an object an intensity, unless it is None."""
    for lamp in (thing for thing in target.iter() if isinstance(thing, gfx.Light) and intensity is not None):
        lamp.intensity = intensity


def _added(stage: Stage, one: SceneLight, made: Lighting) -> SceneLight:
    """Make the lamp of a light that is given by a position or a direction."""
    intensity = np.array(one.color, float) * one.strength * (1.0 if one.intensity is None else one.intensity)
    if one.direction is not None:
        towards = np.asarray(one.direction, float)
        lamp = _lamp(gfx.DirectionalLight, intensity)
        lamp.local.position = stage.center + towards / np.linalg.norm(towards) * stage.radius * 1.5
        lamp.target.local.position = stage.center
    else:
        lamp = _lamp(gfx.PointLight, intensity, decay=2)
        lamp.local.position = one.position
    cast_shadow(lamp, stage.center, stage.radius)
    made.added.append((lamp, stage.scene))
    physical = one.intensity is not None or intensity.max() >= (PHYSICAL_CANDELA if one.direction is None else PHYSICAL_LUX)
    tint: Any = tuple(float(v) for v in (intensity / max(intensity.max(), 1e-30) if physical else intensity))  # what is exposed
    return SceneLight(lamp, screen_tint=tint, disc_half_angle=one.disc_half_angle, anisotropy=one.anisotropy, **_own(one))


def _own(one: SceneLight | NamedLight) -> Any:
    """Gather what a light has to itself in a medium, and its shape."""
    shape = {name: getattr(one, name) for name in ("photometry", "cookie") if getattr(one, name) is not None}
    return {"density": one.density, "extinction": one.extinction} | shape


def _named(stage: Stage, one: NamedLight, made: Lighting) -> None:
    """Add the lights of an object's name: the lamps of that name, else a lamp in each mesh of it."""
    things = named(stage.scene, one.name, "--light")
    strength = 1.0 if one.strength is None else one.strength
    lamps = [light for light in stage.lights if any(thing is light.target for thing in things)]
    if lamps:
        for light in lamps:
            _set(light.target, one.intensity)
        made.lights += [dataclasses.replace(light, color=one.color, strength=strength, **_own(one)) for light in lamps]
        return
    known: set[int] = set()
    for thing in things:
        meshes = [mesh for mesh in thing.iter() if isinstance(mesh, gfx.Mesh) and id(mesh) not in known]
        known |= {id(mesh) for mesh in meshes}
        if meshes:
            made.lights.append(_in_mesh(stage, one, meshes, made))
    if not known:
        raise AirlightError(f"--light {one.name}: is no mesh and no lamp whose shafts the scene shows; name another, or write x,y,z")


def _in_mesh(stage: Stage, one: NamedLight, meshes: list[Any], made: Lighting) -> SceneLight:
    """Put a lamp into the brightest of the meshes of an object, in the middle of all that emit."""
    once = {id(mesh.geometry): mesh for mesh in meshes}  # what is blended may be drawn twice
    powers = [candela(mesh) * (once[id(mesh.geometry)] is mesh) for mesh in meshes]
    emitting = [mesh for mesh, power in zip(meshes, powers, strict=True) if power.any()] or meshes
    asked = one.strength if one.intensity is None else one.intensity
    if asked is not None:
        intensity = np.array(one.color, float) * asked
    else:
        intensity = np.array(one.color, float) * sum(powers)
        if not np.any(powers):
            raise AirlightError(f"--light {one.name}: the mesh emits no light; say how many candela it has, as in '{one.name};strength=50'")
    body = max(zip(meshes, powers, strict=True), key=lambda pair: float(pair[1].sum()))[0]
    corners = np.concatenate([of_mesh(mesh).reshape(-1, 3) for mesh in emitting])
    lamp = _lamp(gfx.PointLight, intensity, decay=2)
    body.add(lamp)  # for its place; it is taken out again
    lamp.world.position = (corners.min(axis=0) + corners.max(axis=0)) / 2
    cast_shadow(lamp, stage.center, stage.radius)
    body.remove(lamp)
    made.added.append((lamp, body))
    made.bodies += meshes
    # Methods of the screen sum the body's own light, which is in the picture whatever the lamp's strength.
    share = 0.0 if asked == 0 else min(1.0, BODY_RADIANCE / max(float(radiance(body.material).max()), BODY_RADIANCE))
    tint: Any = tuple(share * v for v in one.color)
    return SceneLight(body, screen_tint=tint, **_own(one))


def _name(thing: Any) -> str:
    while thing is not None and not thing.name:
        thing = thing.parent
    return "" if thing is None else str(thing.name)
