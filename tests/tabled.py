"""Marches of what tables of visibility are tested with, before a wall that fills the lower part of a picture."""

import math
from typing import Any

import numpy as np
from written import depth_texture

from airlight.gpu.device import open_device
from airlight.gpu.timing import run_ms
from airlight.medium.resolve import ResolvedMedium, resolve
from airlight.options import March as Marching
from airlight.options import Medium
from airlight.scatter.march.march import March

SIZE = (64, 36)


def projection(size: tuple[int, int] = SIZE, fov: float = 50.0) -> np.ndarray:
    near, far, slope = 0.1, 100.0, math.tan(math.radians(fov) / 2)
    out = np.zeros((4, 4))
    out[0, 0], out[1, 1] = size[1] / size[0] / slope, 1 / slope
    out[2, 2], out[2, 3], out[3, 2] = -far / (far - near), -far * near / (far - near), -1
    return out


def air(steps: Any, quality: str = "normal", **values: Any) -> ResolvedMedium:
    medium = {"sigma_t": (0.08, 0.08, 0.08), "max_distance": 20.0, "albedo": (0.9, 0.8, 0.7)}
    medium |= {k: v for k, v in values.items() if k in Medium.__struct_fields__}
    march = {k: v for k, v in values.items() if k in Marching.__struct_fields__}
    return resolve(Medium(**medium), Marching(steps=steps, **march), quality, 10.0)


def ground(size: tuple[int, int]) -> np.ndarray:
    """(H, W) depths of a wall 14 m ahead in the picture's lower half, and of nothing above."""
    p = projection(size)
    depth = (p[2, 2] * -14 + p[2, 3]) / 14
    return np.where(np.arange(size[1])[:, None] > size[1] * 0.6, depth, 1.0) * np.ones(size[0])


def layer(
    lights: Any, medium: ResolvedMedium, size: tuple[int, int] = SIZE, share: float = 1.0, march: Any = None, behind: bool = True
) -> np.ndarray:
    """(H, W, 4) of the march, and its transmittance beside it. behind: the ground is there."""
    device = open_device()
    march = march or March(device, size)
    march.update(np.eye(4), projection(size), lights, medium, jitter="midpoint", share=share)
    depth = depth_texture(device, ground(size) if behind else np.ones(size[::-1]))
    run_ms(device, lambda encoder: march.record(encoder, depth))
    read = (np.frombuffer(device.read(t, 16), np.float32).reshape(*size[::-1], 4) for t in (march.layer, march.transmittance))
    return np.concatenate(list(read), axis=2)


def off(found: np.ndarray, truth: np.ndarray) -> float:
    return float(np.sqrt(np.mean((found - truth)[..., :3] ** 2)) / truth[..., :3].mean())
