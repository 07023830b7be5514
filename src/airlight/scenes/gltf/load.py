"""Load a stage from a glTF file."""

import math
from collections.abc import Callable
from importlib import resources
from typing import Any

import numpy as np
import pygfx as gfx
import pylinalg as la

from airlight.errors import warn
from airlight.files.photometry import IntensityDistribution
from airlight.pygfx import Projector, SceneLight
from airlight.scenes.environment import Environment, load_environment
from airlight.scenes.gltf import schema
from airlight.scenes.gltf.materials import colour
from airlight.scenes.gltf.meshes import vertices
from airlight.scenes.gltf.model import Model
from airlight.scenes.gltf.projectors import projector_of
from airlight.scenes.gltf.validate import Gltf
from airlight.scenes.lamps import cast_shadow, glowing, lost_maps
from airlight.scenes.stage import Stage

MAX_LIGHTS = 8  # the brightest; each has a shadow map
LOW_SUN = math.radians(25)  # up to here the sunrise suits a file's sun, above the sky
FOV = 40.0  # degrees, of the camera that a file without one gets
VIEW_FROM = np.array([0.35, 0.12, 1.0])  # where it stands
FILL = 0.8  # of a 16:9 picture that what there is to see fills
SUN_ASIDE = math.radians(14)  # from where that camera looks, where a file without lights has its sun
SKY_LIMIT = 8.0  # greatest radiance of the background
GLOW = 0.5  # the mean radiance around a light that its shafts are made for: brighter surroundings make its strength smaller
PROFILE_AXES = {  # of EXT_lights_ies, rows right, up, ahead: its horizontal angles of types A and B begin a quarter of a turn aside
    "C": np.diag([1.0, 1.0, -1.0]),
    "A": np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]]),
}
SUN_SIZE = 1.0  # degrees: of the disc of a light that has no body


def load(path: str, environment: str | None = None, animation: str | None = None, scene: str | None = None, lamps: bool = False) -> Stage:
    """Load a stage as `scenes.open_scene` says."""
    gltf = Gltf(path, scene)
    return stage_of(gltf, Model(gltf, animation), environment, lamps)


def stage_of(gltf: Any, model: Any, environment: str | None, lamps: bool) -> Stage:
    """Make the stage of a model, as `Model` is one, with the cameras and lights of its file's document."""
    return _Loader(gltf, model, environment, lamps).stage()


def model(name_or_path: str) -> tuple[gfx.Group, Callable[[float], None]]:
    """Load a model that comes with Airlight (by its name) or a file's, without cameras and lights, and pose(t) of its looped animation."""
    path = name_or_path
    if not path.lower().endswith((".glb", ".gltf")):
        path = str(resources.files("airlight") / "data" / "scenes" / "models" / f"{path}.glb")
    found = Model(Gltf(path))
    return found.root, found.pose


class _Loader:
    def __init__(self, gltf: Any, model: Any, environment: str | None, lamps: bool) -> None:
        self._gltf, self._environment, self._lamps = gltf, environment, lamps
        self._document = gltf.document
        self._model = model
        self._nodes, self._moving = self._model.nodes, self._model.moving
        self._scene = gfx.Scene()
        self._scene.add(self._model.root)
        self._cameras: dict[str, gfx.PerspectiveCamera] = {}
        self._camera_nodes: dict[int, list[gfx.PerspectiveCamera]] = {}
        self._lights: dict[int, gfx.Light] = {}
        self._described: dict[int, schema.Light] = {}
        self._profiles: dict[int, IntensityDistribution] = {}
        self._surroundings: Environment | None = None

    # ---------------------------------------------------------------- building

    def stage(self) -> Stage:
        for i in sorted(self._gltf.order):
            node = self._document.nodes[i]
            if node.camera is not None:
                self._add_camera(i, self._document.cameras[node.camera], node.name)
        self._add_lights()
        self._center, self._radius = center, radius = self._bounds()
        self._finish_cameras()
        added = self._surround()
        self._spare_maps()
        lights = self._scene_lights(added)
        fixed = [light for i, light in self._lights.items() if i not in self._moving and not isinstance(light, gfx.DirectionalLight)]
        movable = next((light for light in lights if light.target in fixed), None)
        path, duration = self._gltf.container.path, self._model.duration
        emissive = () if self._lights else tuple(glowing(self._model.drawn))
        sky_sun = None if self._surroundings is None else self._surroundings.sun_illuminance()
        more: dict[str, Any] = {"glowing": emissive, "sky_sun": sky_sun, "photometric": bool(self._lights), "draggable": fixed}
        return Stage(path, self._scene, self._cameras, lights, duration, self.pose, center, radius, movable, **more)

    def _add_camera(self, i: int, described: schema.Camera, name: str) -> None:
        lens, flat = described.perspective, described.orthographic
        if described.type == "perspective" and lens is not None:
            camera = gfx.PerspectiveCamera(math.degrees(lens.yfov), depth_range=(lens.znear, lens.zfar or 0.0))
        else:
            assert flat is not None
            camera = gfx.PerspectiveCamera(0, width=2 * abs(flat.xmag), height=2 * abs(flat.ymag), depth_range=(flat.znear, flat.zfar))
        base = (name or described.name)[:80] or f"camera {len(self._cameras) + 1}"
        unique = base
        while unique in self._cameras:
            unique = f"{base} {len(self._cameras) + 1}"
        self._cameras[unique] = camera
        self._camera_nodes.setdefault(i, []).append(camera)

    def _add_lights(self) -> None:
        nodes, lights = self._document.nodes, self._document.extensions.lights.lights
        shown = sorted({*self._gltf.order} - self._gltf.hidden)
        named = {i: lights[found.light] for i in shown if (found := nodes[i].extensions.light) is not None}
        for i in shown:
            if (one := nodes[i].extensions.profile) is not None:
                if i in named:
                    self._gltf.tell("both", f"node {i} has a light of EXT_lights_ies and one of KHR_lights_punctual; the first is shown")
                profile = self._profiles[i] = self._gltf.profile(one.light)
                name = self._document.extensions.profiles.lights[one.light].name
                r, g, b = (min(max(value, 0.0), 1.0) for value in one.color)
                named[i] = schema.Light(type="point", name=name, color=(r, g, b), intensity=one.multiplier * profile.peak)
        shining = {i: light for i, light in named.items() if light.intensity > 0 and max(light.color) > 0}
        if len(shining) > MAX_LIGHTS:
            warn(f"{self._gltf.container.path}: has {len(shining)} lights; the {MAX_LIGHTS} brightest shine", 4)
            shining = dict(sorted(shining.items(), key=lambda item: -item[1].intensity)[:MAX_LIGHTS])
        for i, light in shining.items():
            self._lights[i], self._described[i] = projector_of(self._gltf, light) or _light(light), light
            self._lights[i].name = nodes[i].name[:80] or self._lights[i].name or f"light {len(self._lights)}"
            self._scene.add(self._lights[i])

    def _spare_maps(self) -> None:
        """Spare maps as `spare_maps` says."""
        if lost := lost_maps(self._scene):
            warn(f"{self._gltf.container.path}: shown without its {lost}: this version of software Vulkan fails on so many", 4)

    # ---------------------------------------------------------------- time

    def pose(self, t: float, camera: Any = None) -> None:
        """Pose everything as it is at t seconds; the camera too, if it is one of the file's that moves."""
        self._model.pose(t)
        for i, light in self._lights.items():
            if i in self._moving:
                self._aim(i, light)
        for i, cameras in self._camera_nodes.items():
            if i in self._moving:
                for one in cameras:
                    if one is camera:
                        self._look(i, one)

    def _aim(self, i: int, light: gfx.Light) -> None:
        """Put a light where its node is. It hangs on the scene: pygfx turns lights itself, which no mirrored parent would survive."""
        matrix = self._nodes[i].world.matrix
        place, ahead = matrix[:3, 3], -matrix[:3, 2]
        length = float(np.linalg.norm(ahead))
        ahead = ahead / length if length > 1e-12 else np.array([0.0, 0.0, -1.0])
        if isinstance(light, gfx.DirectionalLight):
            place = self._center - ahead * self._radius * 1.5
        light.local.position = place
        if isinstance(light, Projector):
            upright = np.linalg.norm(np.cross(ahead, matrix[:3, 1])) > 1e-6 * np.linalg.norm(matrix[:3, 1])
            light.upwards = tuple(matrix[:3, 1]) if upright else (0.0, 1.0, 0.0)  # of a node that has no height
        if i in self._profiles:
            light.local.rotation = la.quat_from_mat(_turn(matrix))
        if not isinstance(light, gfx.PointLight):
            light.target.local.position = place + ahead * self._radius

    def _look(self, i: int, camera: gfx.PerspectiveCamera) -> None:
        """Put a camera where its node is, without the node's scale."""
        matrix = self._nodes[i].world.matrix
        whole = np.eye(4)
        whole[:3, :3], whole[:3, 3] = _turn(matrix), matrix[:3, 3]
        camera.local.matrix = whole

    # ---------------------------------------------------------------- what there is to see, and by what light

    def _bounds(self) -> tuple[np.ndarray, float]:
        """Bound the vertices by a sphere, at a few times if they move."""
        low, high = np.full(3, np.inf), np.full(3, -np.inf)
        for share in (0.25, 0.5, 0.75, 0.0) if self._model.duration else (0.0,):
            self._model.pose(share * self._model.duration)
            for thing in self._model.drawn:
                points = vertices(thing)
                low, high = np.minimum(low, points.min(axis=0)), np.maximum(high, points.max(axis=0))
        return (low + high) / 2, max(float(np.linalg.norm(high - low)) / 2, 1e-6)

    def _finish_cameras(self) -> None:
        if not self._cameras:
            camera = gfx.PerspectiveCamera(FOV)
            away = VIEW_FROM / np.linalg.norm(VIEW_FROM)
            right = np.cross([0.0, 1.0, 0.0], away)
            right /= np.linalg.norm(right)
            points = np.concatenate([vertices(thing) for thing in self._model.drawn]) - self._center
            high, wide, near = np.abs(points @ np.cross(away, right)), np.abs(points @ right), points @ away
            slope = math.tan(math.radians(FOV / 2)) * FILL
            distance = float(np.max(near + np.maximum(high / slope, wide / (slope * 16 / 9))))
            distance = max(distance, 1.01 * float(near.max()), self._radius / 10)
            camera.local.position = self._center + away * distance
            camera.look_at(self._center)
            self._cameras["view"] = camera
            camera.depth_range = (max(distance - float(near.max()), distance / 20) / 4, 0.0)
        for i, cameras in self._camera_nodes.items():
            for camera in cameras:
                self._look(i, camera)
        for camera in self._cameras.values():
            distance = max(float(np.linalg.norm(camera.local.position - self._center)), self._radius)
            near, far = camera.depth_range
            if not far:
                camera.depth_range = (near, max(100 * near, 4 * (distance + self._radius)))
            if camera.fov:  # what orbit controls take for the distance of what is looked at
                camera.width = camera.height = 2 * distance * math.tan(math.radians(camera.fov / 2))

    def _surround(self) -> gfx.DirectionalLight | None:
        """Choose surroundings that suit the lights; their sun where it is the only light, which is added here."""
        suns = [light for light in self._lights.values() if isinstance(light, gfx.DirectionalLight)]
        for i, light in self._lights.items():
            self._aim(i, light)
        for light in self._lights.values():
            self._shadow(light)
        towards = None
        if suns:
            towards = np.asarray(suns[0].local.position - suns[0].target.local.position, float)
            towards /= np.linalg.norm(towards)
        chosen = self._environment
        if chosen is None:
            if (self._lights or self._lamps) and not suns:
                chosen = "none"
            else:
                chosen = "sunrise" if towards is None or math.asin(min(max(towards[1], -1), 1)) < LOW_SUN else "sky"
        if chosen == "none":
            self._scene.add(gfx.Background.from_color("#06070a", "#14161c"), gfx.AmbientLight(intensity=0.25))
            return None if self._lights or self._lamps else self._add_sun(np.array([0.45, 0.6, 0.66]), np.full(3, 3.0))
        surroundings = load_environment(chosen)
        if towards is None:
            camera = next(iter(self._cameras.values()))
            ahead = np.asarray(camera.world.forward, float)
            turn = math.atan2(ahead[0], -ahead[2]) + SUN_ASIDE
            towards = np.array([math.sin(turn), 0.0, -math.cos(turn)])
        surroundings = surroundings.turned_to(towards)
        surroundings.surround(self._scene, limit=SKY_LIMIT)
        self._surroundings = surroundings
        return None if self._lights or self._lamps else self._add_sun(*surroundings.sun_and_light())

    def _add_sun(self, direction: np.ndarray, irradiance: np.ndarray) -> gfx.DirectionalLight:
        strongest = float(irradiance.max())
        sun = gfx.DirectionalLight(colour(tuple(irradiance / strongest)), min(strongest, 20.0))
        sun.local.position = self._center + direction * self._radius * 1.5
        sun.target.local.position = self._center
        self._scene.add(sun)
        self._shadow(sun)
        return sun

    def _shadow(self, light: gfx.Light) -> None:
        cast_shadow(light, self._center, self._radius)

    def _scene_lights(self, sun: gfx.DirectionalLight | None) -> list[SceneLight]:
        """Make lights for shafts; their looks, for methods that see no intensities, in proportion to the strongest of their unit."""
        if sun is not None:
            level = self._level(_towards(sun))
            return [SceneLight(sun, screen_tint=(level,) * 3, disc_half_angle=SUN_SIZE)]
        found = []
        for i, light in self._lights.items():
            described = self._described[i]
            lux = described.type == "directional"  # not to be compared with candela
            strongest = max(other.intensity for other in self._described.values() if (other.type == "directional") == lux)
            r, g, b = (max(0.0, value) for value in described.color)
            share = described.intensity / strongest * self._level(_towards(light) if lux else None) / max(r, g, b)
            shape: dict[str, Any] = {}
            if i in self._profiles:
                kind = self._profiles[i].kind
                shape = {"photometry": self._profiles[i], "turned": PROFILE_AXES["C" if kind == "C" else "A"]}
            found.append(SceneLight(light, screen_tint=(share * r, share * g, share * b), disc_half_angle=SUN_SIZE, **shape))
        return found

    def _level(self, towards: np.ndarray | None) -> float:
        """Choose the level of the shafts that the picture's methods make of a light in this direction, or among the things."""
        if self._surroundings is None:
            return 1.0
        return min(1.0, GLOW / max(self._surroundings.aureole(towards, SKY_LIMIT), 1e-6))


def _turn(matrix: np.ndarray) -> np.ndarray:
    """Find the rotation (3, 3) of a node's (4, 4) matrix, without its scale."""
    u, size, v = np.linalg.svd(matrix[:3, :3])
    turn: np.ndarray = u @ v if size[2] > 0 else np.eye(3)
    if np.linalg.det(turn) < 0:
        turn[:, 0] *= -1
    return turn


def _towards(light: gfx.DirectionalLight) -> np.ndarray:
    return np.asarray(light.world.position - light.target.world.position)


def _light(described: schema.Light) -> gfx.Light:
    """Make a light of KHR_lights_punctual: lux for a directional one, candela for others, which fade with the square of the distance."""
    top = max(described.color)
    color = colour(tuple(value / top for value in described.color))
    intensity = min(described.intensity * top, 1e9)
    if described.type == "directional":
        light = gfx.DirectionalLight(color, intensity)
    elif described.type == "point":
        light = gfx.PointLight(color, intensity, decay=2, distance=described.range or 0)
    else:
        outer = min(max(described.spot.outer_cone_angle, 1e-3), math.radians(89))
        inner = min(described.spot.inner_cone_angle, outer * 0.999)
        light = gfx.SpotLight(color, intensity, decay=2, distance=described.range or 0, angle=outer, penumbra=1 - inner / outer)
    light.name = described.name[:80]
    return light
