"""Evaluates the functions of scatter/screen_shadows/*.wgsl in float64, each under its shader's name. Vectors lie along the last axis."""

from typing import Any

import numpy as np
import numpy.typing as npt

from airlight.reference.march import directional_integral, in_scatter_punctual
from airlight.reference.medium import transmittance_integral

Array = npt.NDArray[Any]
STEEPEST, BENT, DEPTH_ERROR = 16.0, 0.3, 0.01


def sun_coordinate(distance: Any, nearest: Any, octaves: Any) -> Array:
    """Evaluates the coordinate of rays of a sun that pass the eye's line to it at distances, m: 1 at the largest."""
    return np.asarray(np.log2(1 + np.asarray(distance, float) / nearest) / octaves)


def lamp_coordinate(place: Any, lamp: Any) -> Array:
    """Evaluates the coordinate of a lamp's rays to places (..., 3): the angle at the lamp between them and the eye, over pi."""
    place, lamp = np.asarray(place, float), np.asarray(lamp, float)
    across = np.linalg.norm(np.cross(place, lamp), axis=-1)
    return np.asarray(np.arctan2(across, ((lamp - place) * lamp).sum(axis=-1)) / np.pi)


def coordinate(place: Any, light: Any, is_directional: bool, nearest: float, octaves: float) -> Array:
    """Evaluates the coordinate of a light's rays to places (..., 3), view space."""
    position = np.asarray(light["position"], float)
    if is_directional:
        return sun_coordinate(np.linalg.norm(np.cross(place, position), axis=-1), nearest, octaves)
    return lamp_coordinate(place, position)


def covered_part(range: Any, first: Any) -> Array:
    """Measures how much of each of the bins (..., 4) lies in ranges (..., 2), in bins."""
    range, first = np.asarray(range, float), np.asarray(first, float)
    return np.maximum(np.clip(range[..., 1:] - first, 0, 1) - np.clip(range[..., :1] - first, 0, 1), 0)


def ray_through(p: Any, frame: Any) -> Array:
    """Makes (..., 3) the directions of the view's rays through places of the picture (..., 2), px, 1 long along the camera's axis."""
    at = frame["rays"][:2].astype(float) * (np.asarray(p, float) / frame["pixels"]) + frame["rays"][2:].astype(float)
    return np.concatenate([at, np.full((*at.shape[:-1], 1), -1.0)], axis=-1)


def is_on_body(place: Any, sphere: Any) -> npt.NDArray[np.bool_]:
    """Tells whether places (..., 3), view space, are on bodies of light, whose spheres (..., 4) are seen there, about as far away."""
    place, sphere = np.asarray(place, float), np.asarray(sphere, float)
    away, middle = np.linalg.norm(place, axis=-1), np.linalg.norm(sphere[..., :3], axis=-1)
    beside = np.linalg.norm(np.cross(place, sphere[..., :3]), axis=-1) < sphere[..., 3] * away
    return np.asarray(beside & (np.abs(away - middle) < sphere[..., 3] + DEPTH_ERROR * middle))


def is_joined(inverse: Any, angle: Any) -> npt.NDArray[np.bool_]:
    """Tells whether a surface goes on from a sample to the next. inverse: (..., 3) of depths, 1/m, of the sample before, of it and of the
    next one; 0: none. angle: between samples, radians."""
    before, here, ahead = np.moveaxis(np.asarray(inverse, float), -1, 0)
    step = ahead - here
    is_alike = np.abs(step) <= STEEPEST * np.asarray(angle, float) * np.maximum(here, ahead)
    is_plane = (before > 0) & (np.abs(step - (here - before)) <= BENT * np.abs(step))
    return np.asarray((np.minimum(here, ahead) > 0) & (is_alike | is_plane))


def sun_weight(ray: Any, range: Any, frame: Any, light: Any, fog: str, fades: bool) -> Array:
    """Weighs what a sun adds to ranges of t (..., 2) of rays."""
    range = np.asarray(range, float)
    if fog == "none":
        ends = transmittance_integral(range, frame["sigma_t"].astype(float))
        return np.asarray((ends[..., 1, :] - ends[..., 0, :])[..., 1])
    return np.asarray(directional_integral(ray, range, frame, light, fog, fades)[..., 1])


def lamp_weight(ray: Any, cosine: Any, sine: Any, frame: Any, light: Any, kind: int, fog: str) -> Array:
    """Weighs what a lamp adds to rays where its own ray has an angle, of this cosine and sine, to the eye."""
    position, direction = light["position"].astype(float), np.asarray(ray["direction"], float)
    away = np.linalg.norm(position)
    t0 = direction @ position
    h = np.maximum(np.linalg.norm(position - t0[..., None] * direction, axis=-1), 1e-6 * away + 1e-9)
    sine_there, cosine_there = (sine * h - cosine * t0) / away, (cosine * h + sine * t0) / away
    d = h / np.maximum(cosine_there, 1e-3)
    t = np.maximum(t0 + d * sine_there, 0)
    axis_cosine = ((t[..., None] * direction - position) * light["axis"]).sum(axis=-1) / d
    found = in_scatter_punctual(ray, t, d, -sine_there, axis_cosine, frame, light, kind, fog)[..., 1]
    return np.where(cosine_there <= 1e-3, 0.0, found)
