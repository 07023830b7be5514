"""Places the camera of a photograph under the sky: directions of pixels, and the pitch and heading that put the sun where it is seen.

Directions are (east, up, north); of the camera (right, up, forward). Azimuths count clockwise from north. Angles are degrees.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from airlight.errors import AirlightError
from airlight.reference.daylight import Array

MOST_APART = 1.0  # degrees between the sun and the light in the picture, before they contradict each other


def direction_of(azimuth: Any, elevation: Any) -> Array:
    """Give the direction (..., 3) that an azimuth and an elevation stand for."""
    turn, up = np.radians(azimuth), np.radians(elevation)
    return np.stack(np.broadcast_arrays(np.sin(turn) * np.cos(up), np.sin(up), np.cos(turn) * np.cos(up)), axis=-1)


def angle_between(a: Any, b: Any) -> float:
    """Compute the angle between two directions, degrees."""
    return math.degrees(math.atan2(float(np.linalg.norm(np.cross(a, b))), float(np.dot(a, b))))


@dataclass(frozen=True)
class Camera:
    """Describes a camera: size of the picture, pixels; angle of view of its smaller side; where it looks; how it is turned clockwise."""

    width: int
    height: int
    fov: float
    pitch: float = 0.0
    roll: float = 0.0
    heading: float = 0.0

    @property
    def focal(self) -> float:
        """Give the focal length in pixels."""
        return min(self.width, self.height) / 2 / math.tan(math.radians(self.fov) / 2)

    @property
    def axes(self) -> Array:
        """Give (3, 3): rows are the camera's right, up and forward as (east, up, north)."""
        turn, up, roll = (math.radians(one) for one in (self.heading, self.pitch, self.roll))
        right = np.array([math.cos(turn), 0.0, -math.sin(turn)])
        forward = np.array([math.sin(turn) * math.cos(up), math.sin(up), math.cos(turn) * math.cos(up)])
        upward = np.array([-math.sin(turn) * math.sin(up), math.cos(up), -math.cos(turn) * math.sin(up)])
        return np.stack(
            [math.cos(roll) * right - math.sin(roll) * upward, math.sin(roll) * right + math.cos(roll) * upward, forward]
        )

    def in_camera(self, x: Any, y: Any) -> Array:
        """Give the direction (..., 3) of a point of the picture, right, up, forward; x, y: parts of its size from its top left."""
        across = (np.asarray(x, float) - 0.5) * self.width / self.focal
        down = (np.asarray(y, float) - 0.5) * self.height / self.focal
        found = np.stack(np.broadcast_arrays(across, -down, np.ones(())), axis=-1)
        return np.asarray(found / np.linalg.norm(found, axis=-1, keepdims=True))

    def seen(self, direction: Any) -> tuple[float, float] | None:
        """Find where in the picture a direction (3,) is seen, parts of its size from its top left; None behind the camera."""
        right, up, forward = (float(one) for one in self.axes @ np.asarray(direction, float))
        if forward <= 1e-6:
            return None
        return 0.5 + right / forward * self.focal / self.width, 0.5 - up / forward * self.focal / self.height

    def at(self, x: Any, y: Any) -> Array:
        """Give the direction (..., 3) of a point of the picture, east, up, north; x, y: as of in_camera."""
        return np.asarray(self.in_camera(x, y) @ self.axes)

    @property
    def view(self) -> Array:
        """Give the matrix (4, 4) from the world, x east, y up, z south, into the camera, which looks along its -z."""
        right, up, forward = self.axes * np.array([1.0, 1.0, -1.0])
        found = np.eye(4)
        found[:3, :3] = right, up, -forward
        return found

    def projection(self, left: int, top: int, width: int, height: int) -> Array:
        """Give the matrix (4, 4) of an endless perspective on a part of the picture, pixels; depth is 1 near and 0 far away."""
        across, down = self.width / width, self.height / height
        found = np.zeros((4, 4))
        found[0] = 2 * self.focal / width, 0, 1 + 2 * left / width - across, 0
        found[1] = 0, 2 * self.focal / height, down - 1 - 2 * top / height, 0
        found[2, 3], found[3, 2] = 1, -1
        return found

    def lengths(self, left: int, top: int, width: int, height: int) -> Array:
        """Give (height, width) float32 the way along each ray of a part of the picture that goes 1 along the camera's axis."""
        across = (left + np.arange(width) + 0.5 - self.width / 2) / self.focal
        down = (top + np.arange(height) + 0.5 - self.height / 2) / self.focal
        return np.sqrt(1 + across**2 + down[:, None] ** 2).astype(np.float32)


def solve_pitch(camera: Camera, light: tuple[float, float], elevation: float) -> float:
    """Find the pitch, -90..90, with which a point of the picture is seen at an elevation: of two the one nearer to 0.

    Raises AirlightError where none does, as a point far aside is never seen high up.
    """
    right, up, forward = camera.in_camera(*light)
    roll = math.radians(camera.roll)
    raised = up * math.cos(roll) - right * math.sin(roll)
    reach, own = math.hypot(raised, forward), math.atan2(raised, forward)
    sine = math.sin(math.radians(elevation))
    if abs(sine) > reach + 1e-12:
        most = math.degrees(math.asin(min(reach, 1.0)))
        raise AirlightError(
            f"the light at {light[0]:.3g},{light[1]:.3g} is at most {most:.1f} degrees high, however the camera looks, and the sun "
            f"{elevation:.1f}: give another --light, --fov or sun"
        )
    lift = math.asin(min(max(sine / reach, -1.0), 1.0))
    found = [(one - own + math.pi) % (2 * math.pi) - math.pi for one in (lift, math.pi - lift)]
    pitch = math.degrees(min(found, key=abs))
    if abs(pitch) > 90 + 1e-9:
        raise AirlightError(
            f"the camera would look over its head for the sun, {elevation:.1f} degrees high, to be at {light[0]:.3g},{light[1]:.3g}: give "
            "another --light, --fov or sun"
        )
    return pitch
