"""Fills the uniforms of the passes over a scene's picture: its camera, and where its lights are seen."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from airlight.colour import srgb_decode
from airlight.composite.scene import MAX_LIGHTS, UNIFORMS
from airlight.errors import AirlightError
from airlight.gpu.device import Device
from airlight.options import Composite, SceneOptions
from airlight.projection import Projected, depth_terms, pixel_rays, project
from airlight.pygfx.lights import BODY, SceneLight

Region = tuple[float, float, float, float]
WHOLE: Region = (0.0, 0.0, 1.0, 1.0)
Seen = list[tuple[SceneLight, Projected]]  # lights whose shafts are seen, and where


class Uniforms:
    """Holds a record of composite.scene.UNIFORMS, and the buffer that it is written to."""

    def __init__(self, device: Device) -> None:
        self.device = device
        self.record = np.zeros((), UNIFORMS)
        self.buffer = device.buffer(size=UNIFORMS.itemsize, uniform=True)

    def update(self, camera: Any, lights: Sequence[SceneLight], share: float, size: tuple[int, int]) -> Seen:
        """Sets the camera and every light, for a picture of this size, and a source that is a share of it along each side; returns the
        lights whose shafts are seen. Raises AirlightError."""
        if len(lights) > MAX_LIGHTS:
            raise AirlightError(f"{len(lights)} lights in LightShafts: at most {MAX_LIGHTS}")
        record = self.record
        matrix, projection = np.asarray(camera.view_matrix, np.float64), np.asarray(camera.projection_matrix, np.float64)
        record["rays"], record["depth"], record["pixels"] = pixel_rays(projection), depth_terms(projection), size
        perspective = projection[3, 3] == 0
        texel = abs(record["rays"][1]) / max(1.0, share * size[1])  # its angle, at the view's axis
        seen: Seen = []
        cones = 0
        for light in lights:
            light.check()
            found = project(light.homogeneous(), matrix, projection)
            rgb = light.seen((0, 0)).rgb
            if found.fade * max(rgb) > 0:
                at = record["aim"][len(seen)]
                at["direction"], at["fade"], at["color"] = found.direction, found.fade, rgb
                seen.append((light, found))
            body = light.body() if perspective else None
            if perspective and cones < MAX_LIGHTS and (body or (light.disc_half_angle > 0 and found.fade > 0)):
                _write_cone(record["cone"][cones], light, body, found, matrix, float(texel))
                cones += 1
        record["aims"], record["cones"] = len(seen), cones
        record["aim"]["fade"][len(seen) :] = 0
        return seen

    def lay_out(self, size: tuple[int, int], texels: tuple[int, int], apron: int) -> None:
        """Sets the size of the picture, and of the source without its apron, a border of so many texels."""
        self.record["texels"], self.record["apron"] = texels, apron
        self.record["ratio"], self.record["pixel"] = np.array(size) / texels, 1 / np.array(size)

    def write(
        self, region: Region, composite: Composite, scene: SceneOptions, follow: float, exposure: float, extinction_share: float
    ) -> None:
        """Sets the rest, and sends all of it. region: where the view lies in the source; follow: share that light adaptation
        takes of what it measures now; exposure: factor of the picture for a display; extinction_share: as Medium's."""
        record = self.record
        record["region"], record["follow"], record["exposure"] = region, follow, exposure
        if scene.clear is not None:
            record["clear"] = srgb_decode(np.array([int(scene.clear[i : i + 2], 16) for i in (1, 3, 5)]) / 255)
        record["mix"] = 1.0 if composite.mix is None else composite.mix
        record["reach"], record["adapt"] = scene.depth_aware, composite.adapt
        record["extinction_share"] = extinction_share
        self.device.queue.write_buffer(self.buffer, 0, record.tobytes())


def _write_cone(record: Any, light: SceneLight, body: Any, found: Projected, matrix: Any, texel: float) -> None:
    """Fills the Cone of a light that is a body or has a disc. texel: the angle of one of the source's texels."""
    direction, half, near, far = np.array(found.direction), math.radians(light.disc_half_angle), 0.0, 0.0
    if body:
        centre, radius, solid = body
        at = (matrix @ np.append(centre, 1.0))[:3]
        distance = float(np.linalg.norm(at))
        if distance > radius:
            direction, half = at / distance, math.asin(radius / distance)
        else:  # the eye is in it
            half = math.pi
        near, far = max(distance - BODY * radius, 0.0), distance + BODY * radius if solid else 3e38
    record["direction"], record["cosine"] = direction, math.cos(half)
    record["near"], record["far"] = near, far
    record["sharp"] = 1 / max(math.sin(half) * texel, 1e-9)
    record["disc"] = 1.0 if light.disc_half_angle > 0 else 0.0
