"""Steering behaviours for vehicles in three dimensions (NumPy only).

A behaviour looks at a vehicle and gives the force that it would like; `Run` limits that force, and the speed, and integrates in steps
of a fixed length, so that what is seen at a time depends neither on the frame rate nor on what was asked before.
Lengths in scene units, times in seconds, a vehicle's mass is 1.
Source: Reynolds, Steering Behaviors for Autonomous Characters, Game Developers Conference 1999.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

Vector = npt.NDArray[np.float64]  # (3,)


def limited(vector: Vector, most: float) -> Vector:
    """Shorten a vector to the length `most` where it is longer."""
    length = float(np.sqrt(vector @ vector))
    return vector * (most / length) if length > most else vector


@dataclass(frozen=True)
class Vehicle:
    """A point mass: position, velocity and the force of the last step (its acceleration), with its limits."""

    position: Vector
    velocity: Vector
    max_speed: float
    max_force: float
    force: Vector = field(default_factory=lambda: np.zeros(3))

    def stepped(self, wish: Vector, dt: float) -> "Vehicle":
        """Move the vehicle by `dt` under the force `wish`, limited; the velocity is limited too (semi-implicit Euler, as Reynolds)."""
        force = limited(wish, self.max_force)
        velocity = limited(self.velocity + force * dt, self.max_speed)
        return replace(self, position=self.position + velocity * dt, velocity=velocity, force=force)


Behaviour = Callable[[Sequence[Vehicle], int], Vector]  # all vehicles and which one is meant: the wished force


def _towards(vehicle: Vehicle, target: Vector, speed: float, response: float) -> Vector:
    """Compute the force that turns the velocity into `speed` towards the target within about `response` seconds."""
    offset = target - vehicle.position
    distance = float(np.sqrt(offset @ offset))
    wanted = offset * (speed / distance) if distance > 0 else np.zeros(3)
    return (wanted - vehicle.velocity) / response


def seek(vehicle: Vehicle, target: Vector, *, response: float = 0.25) -> Vector:
    """Steer towards the target at full speed."""
    return _towards(vehicle, target, vehicle.max_speed, response)


def arrive(vehicle: Vehicle, target: Vector, *, slowing: float, response: float = 0.25) -> Vector:
    """Steer towards the target, slower within the distance `slowing` of it, at rest there.

    The speed follows the lesser of Reynolds' ramp (max_speed · distance / slowing) and of what the brakes can still stop:
    v² = 2 · max_force · distance, with a fifth of the force kept back.
    """
    offset = target - vehicle.position
    distance = float(np.sqrt(offset @ offset))
    speed = min(vehicle.max_speed, vehicle.max_speed * distance / slowing, float(np.sqrt(1.6 * vehicle.max_force * distance)))
    return _towards(vehicle, target, speed, response)


def intercept(vehicle: Vehicle, position: Vector, velocity: Vector) -> float:
    """Compute the seconds until the vehicle at full speed could meet what flies straight on: the first root of |d + v t| = s t.

    What cannot be caught gives distance / max_speed, Reynolds' plain estimate.
    """
    d = position - vehicle.position
    a = float(velocity @ velocity) - vehicle.max_speed**2
    b, c = float(d @ velocity), float(d @ d)  # a t² + 2 b t + c = 0
    plain = float(np.sqrt(c)) / vehicle.max_speed
    if abs(a) < 1e-9 * vehicle.max_speed**2:
        return -c / (2 * b) if b < 0 else plain
    inside = b * b - a * c
    if inside < 0:
        return plain
    roots = [t for t in ((-b - np.sqrt(inside)) / a, (-b + np.sqrt(inside)) / a) if t >= 0]
    return float(min(roots)) if roots else plain


def pursue(vehicle: Vehicle, position: Vector, velocity: Vector, *, response: float = 0.25, ahead: float = np.inf) -> Vector:
    """Seek where the quarry will be when it can be met, at most `ahead` seconds from now."""
    return seek(vehicle, position + velocity * min(intercept(vehicle, position, velocity), ahead), response=response)


def shadow(vehicle: Vehicle, quarry: Vehicle, *, behind: float, slowing: float, response: float = 0.25, ahead: float = 2.0) -> Vector:
    """Pursue at an offset: stay `behind` in the quarry's wake; far off this is pursuit, near by it is arrival in its frame.

    `arrive` is asked for the velocity relative to the quarry, so that at rest means flying along.
    """
    speed = float(np.sqrt(quarry.velocity @ quarry.velocity))
    place = quarry.position - (quarry.velocity * (behind / speed) if speed > 0 else 0.0)
    offset = place - vehicle.position
    if offset @ offset > slowing**2:
        return pursue(vehicle, place, quarry.velocity, response=response, ahead=ahead)
    relative = replace(vehicle, velocity=vehicle.velocity - quarry.velocity)
    return quarry.force + arrive(relative, place, slowing=slowing, response=response)


class Path:
    """A closed smooth curve: the periodic cubic spline (C²) through the given points, by arc length; `radius` is the tube around it."""

    def __init__(self, points: npt.ArrayLike, radius: float, samples: int = 1024) -> None:
        p = np.asarray(points, np.float64)
        n = len(p)
        if p.ndim != 2 or p.shape[1] != 3 or n < 3:
            raise ValueError(f"a closed path needs three points or more, of three coordinates; got shape {p.shape}")
        shift = np.eye(n)
        # Unit knots: m[i-1] + 4 m[i] + m[i+1] = 3 (p[i+1] − p[i−1]) makes the second derivative continuous.
        before, after = np.roll(shift, -1, axis=1), np.roll(shift, 1, axis=1)
        slopes = np.linalg.solve(4 * shift + before + after, 3 * (np.roll(p, -1, axis=0) - np.roll(p, 1, axis=0)))
        u = np.arange(samples * 8) * (n / (samples * 8))
        i = u.astype(int)
        f = (u - i)[:, None]
        p0, p1, m0, m1 = p[i], p[(i + 1) % n], slopes[i], slopes[(i + 1) % n]
        fine = p0 + f * (m0 + f * (3 * (p1 - p0) - 2 * m0 - m1 + f * (2 * (p0 - p1) + m0 + m1)))
        closed = np.concatenate([fine, fine[:1]])
        along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(closed, axis=0), axis=1))])
        self.length = float(along[-1])
        self.radius = radius
        even = np.arange(samples) * (self.length / samples)
        self.points = np.stack([np.interp(even, along, closed[:, k]) for k in range(3)], axis=1)  # (samples, 3), evenly spaced
        self._next = np.roll(self.points, -1, axis=0)
        self._chord = self._next - self.points
        self._square = np.einsum("ij,ij->i", self._chord, self._chord)

    def at(self, s: float) -> Vector:
        """Find the point at the arc length s, which wraps around."""
        u = (s / self.length % 1.0) * len(self.points)
        i = int(u) % len(self.points)
        return self.points[i] + self._chord[i] * (u - int(u))

    def nearest(self, position: Vector) -> tuple[float, float]:
        """Find the curve's nearest point: (its arc length, the distance to it)."""
        d = position - self.points
        f = np.clip(np.einsum("ij,ij->i", d, self._chord) / self._square, 0.0, 1.0)
        off = d - f[:, None] * self._chord
        square = np.einsum("ij,ij->i", off, off)
        i = int(square.argmin())
        return (i + float(f[i])) * self.length / len(self.points), float(np.sqrt(square[i]))


def follow(vehicle: Vehicle, path: Path, *, ahead: float, response: float = 0.25) -> Vector:
    """Steer along the path: seek the point that lies `ahead` seconds of flight beyond the nearest one.

    Reynolds corrects only outside the tube; correcting always gives a smoother flight, and the tube is then what a test may ask for.
    """
    return seek(vehicle, path.at(path.nearest(vehicle.position)[0] + ahead * vehicle.max_speed), response=response)


class Run:
    """Vehicles and their behaviours from time 0 on, in steps of 1/rate seconds; every state that was reached is kept."""

    def __init__(self, vehicles: Sequence[Vehicle], behaviours: Sequence[Behaviour], rate: int = 60) -> None:
        self.rate = rate
        self.behaviours = tuple(behaviours)
        self.states: list[tuple[Vehicle, ...]] = [tuple(vehicles)]

    def step(self, k: int) -> tuple[Vehicle, ...]:
        """Move the vehicles k steps from the start."""
        while len(self.states) <= k:
            now = self.states[-1]
            wishes = [behaviour(now, i) for i, behaviour in enumerate(self.behaviours)]
            self.states.append(tuple(v.stepped(wish, 1 / self.rate) for v, wish in zip(now, wishes)))
        return self.states[k]

    def at(self, t: float) -> tuple[Vehicle, ...]:
        """Find the vehicles at t >= 0 seconds, linear between two steps."""
        k = int(t * self.rate)
        f = t * self.rate - k
        return tuple(
            replace(
                a,
                position=a.position + f * (b.position - a.position),
                velocity=a.velocity + f * (b.velocity - a.velocity),
                force=a.force + f * (b.force - a.force),
            )
            for a, b in zip(self.step(k), self.step(k + 1))
        )


def loop(seed: int, *, radius: float, height: float, rise: float, wander: float, points: int = 9) -> Vector:
    """Draw a ring around the y axis, (points, 3), counter-clockwise from +x towards −z, its radius and height varied by the seed.

    radius: mean, in units; wander: the radius' largest relative change; height: mean; rise: the height's largest change.
    """
    rng = np.random.default_rng(seed)
    angle = np.arange(points) * (2 * np.pi / points)
    r = radius * (1 + wander * rng.uniform(-1, 1, points))
    return np.stack([r * np.cos(angle), height + rise * rng.uniform(-1, 1, points), -r * np.sin(angle)], axis=1)
