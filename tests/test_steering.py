"""Steering behaviours: limits, arrival, interception, path following; times do not depend on who asks when."""

from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from airlight.scenes.steering import Path, Run, Vehicle, arrive, follow, intercept, limited, loop, pursue, seek, shadow

place = st.tuples(*[st.floats(-50, 50)] * 3).map(np.array)
speeds, forces = st.floats(1, 30), st.floats(2, 60)


def vehicle(position: Any = (0, 0, 0), velocity: Any = (0, 0, 0), max_speed: float = 10.0, max_force: float = 20.0) -> Vehicle:
    return Vehicle(np.array(position, float), limited(np.array(velocity, float), max_speed), max_speed, max_force)


def flight(path: Path, seed: int = 3) -> Run:
    """A leader on the path and a pursuer that starts at a place chosen by the seed."""
    start = path.at(0)
    behind = start + np.random.default_rng(seed).uniform(-40, 40, 3)
    return Run(
        [vehicle(start, 10 * (path.at(1) - start), 12, 14), vehicle(behind, (0, 0, 0), 18, 22)],
        [
            lambda now, i: follow(now[i], path, ahead=0.5, response=0.5),
            lambda now, i: shadow(now[i], now[0], behind=15, slowing=20),
        ],
    )


@settings(max_examples=40, deadline=None)
@given(place, place, place, place, speeds, forces, st.sampled_from(["seek", "arrive", "pursue", "follow", "shadow"]))
def test_limits_hold(p: Any, v: Any, goal: Any, drift: Any, speed: float, force: float, which: str) -> None:
    path = Path(loop(1, radius=20, height=0, rise=5, wander=0.3), radius=3, samples=64)
    wishes = {
        "seek": lambda now, i: seek(now[i], goal),
        "arrive": lambda now, i: arrive(now[i], goal, slowing=10),
        "pursue": lambda now, i: pursue(now[i], goal, drift),
        "follow": lambda now, i: follow(now[i], path, ahead=0.5),
        "shadow": lambda now, i: shadow(now[i], vehicle(goal, drift, 60), behind=5, slowing=10),
    }
    run = Run([vehicle(p, v, speed, force)], [wishes[which]])
    for k in range(1, 121):
        before, (now,) = run.step(k - 1)[0], run.step(k)
        assert np.linalg.norm(now.force) <= force * (1 + 1e-12)
        assert np.linalg.norm(now.velocity) <= speed * (1 + 1e-12)
        assert np.linalg.norm(now.position - before.position) <= speed / run.rate * (1 + 1e-9)
        assert np.linalg.norm(now.velocity - before.velocity) <= force / run.rate * (1 + 1e-9)


@settings(max_examples=40, deadline=None)
@given(place, place, place, speeds, forces)
def test_arrive_comes_to_rest_at_the_target(p: Any, v: Any, goal: Any, speed: float, force: float) -> None:
    run = Run([vehicle(p, v, speed, force)], [lambda now, i: arrive(now[i], goal, slowing=8)])
    turning = speed / force * 2
    time = turning + (np.linalg.norm(goal - p) + speed * turning) / speed + 8 * (8 / speed) + 10
    end = run.at(float(time))[0]
    assert np.linalg.norm(end.position - goal) < 0.02
    assert np.linalg.norm(end.velocity) < 0.05


def test_arrive_does_not_overshoot_and_seek_does() -> None:
    """From far away at full speed straight on: arrive never passes the target, which seek, by design, does."""
    passed = {}
    for name, wish in (
        ("arrive", lambda now, i: arrive(now[i], np.zeros(3), slowing=8)),
        ("seek", lambda now, i: seek(now[i], np.zeros(3))),
    ):
        run = Run([vehicle((-60, 0, 0), (10, 0, 0))], [wish])
        passed[name] = max(run.step(k)[0].position[0] for k in range(60 * 15))
    assert passed["arrive"] < 0.02
    assert passed["seek"] > 1


@settings(max_examples=60, deadline=None)
@given(place, st.tuples(*[st.floats(-4, 4)] * 3).map(np.array))
def test_pursuit_of_straight_flight_intercepts(quarry: Any, velocity: Any) -> None:
    """At the predicted time, but for what it takes to get up to speed; seek alone comes later."""
    start = vehicle((0, 0, 0), 10 * quarry / max(np.linalg.norm(quarry), 1e-9), 10, 200)
    due = intercept(start, quarry, velocity)
    assert np.linalg.norm(quarry + velocity * due) == pytest.approx(10 * due, rel=1e-6, abs=1e-6)
    times = {}
    for name, ahead in (("pursue", np.inf), ("seek", 0.0)):

        def wish(now: Any, i: int, ahead: float = ahead) -> Any:
            return pursue(now[i], now[1].position, velocity, ahead=ahead, response=0.1)

        run = Run([start, Vehicle(quarry, velocity, 10, 1)], [wish, lambda now, i: np.zeros(3)])
        gaps = (np.linalg.norm(run.step(k)[0].position - run.step(k)[1].position) for k in range(60 * 60))
        times[name] = next((k / 60 for k, gap in enumerate(gaps) if gap < 0.5), np.inf)
        if name == "pursue" and times[name] > 1.0:  # up to speed it flies straight, to where they meet
            ways = np.array([run.step(k)[0].velocity for k in range(45, int(times[name] * 60) - 10)])
            ways /= np.linalg.norm(ways, axis=1, keepdims=True)
            assert (ways @ ways[0]).min(initial=1.0) > np.cos(np.radians(2))
    assert times["pursue"] <= due + 0.5
    assert times["pursue"] <= times["seek"] + 1 / 60


def test_the_intercept_of_what_cannot_be_caught_is_the_plain_estimate() -> None:
    away = vehicle(max_speed=5)
    assert intercept(away, np.array([10.0, 0, 0]), np.array([6.0, 0, 0])) == 2.0
    assert intercept(away, np.array([10.0, 0, 0]), np.array([5.0, 0, 0])) == 2.0
    assert intercept(away, np.array([10.0, 0, 0]), np.array([-5.0, 0, 0])) == pytest.approx(1.0)


@settings(max_examples=12, deadline=None)
@given(st.integers(0, 10**6), st.floats(0, 0.25), place)
def test_the_follower_stays_within_the_tube_once_settled(seed: int, wander: float, start: Any) -> None:
    path = Path(loop(seed, radius=40, height=20, rise=6, wander=wander), radius=5)
    run = Run([vehicle(start, (0, 0, 1), 12, 14)], [lambda now, i: follow(now[i], path, ahead=0.5, response=0.5)])
    off = [path.nearest(run.step(k)[0].position)[1] for k in range(60 * 15, 60 * 45, 5)]
    assert max(off) < path.radius
    along = [path.nearest(run.step(k)[0].position)[0] for k in range(60 * 15, 60 * 20, 5)]
    ahead = (np.diff(along) + path.length / 2) % path.length - path.length / 2
    assert (ahead > 0).all()  # never turns back


def test_the_path_is_closed_smooth_and_by_arc_length() -> None:
    path = Path(loop(5, radius=30, height=10, rise=4, wander=0.2), radius=2)
    steps = np.linalg.norm(np.roll(path.points, -1, axis=0) - path.points, axis=1)
    assert steps.max() / steps.min() < 1.001
    bends = np.roll(path.points, -1, axis=0) - 2 * path.points + np.roll(path.points, 1, axis=0)
    bends /= (path.length / len(path.points)) ** 2
    jumps = np.linalg.norm(np.roll(bends, -1, axis=0) - bends, axis=1)
    assert jumps.max() < 0.1 * np.linalg.norm(bends, axis=1).max()  # a continuous curvature, over the seam too
    np.testing.assert_allclose(path.at(path.length + 3.0), path.at(3.0), atol=1e-9)
    s, off = path.nearest(path.at(17.25))
    assert s == pytest.approx(17.25, abs=1e-6) and off < 1e-9


def test_the_pursuer_catches_up_and_keeps_its_distance() -> None:
    path = Path(loop(7, radius=45, height=20, rise=6, wander=0.15), radius=5)
    run = flight(path)
    gaps = [float(np.linalg.norm(run.step(k)[0].position - run.step(k)[1].position)) for k in range(60 * 12, 60 * 40, 10)]
    assert min(gaps) > 10 and max(gaps) < 20
    for k in range(60 * 12, 60 * 40, 10):
        leader, hunter = run.step(k)
        assert (hunter.position - leader.position) @ leader.velocity < 0  # behind


def test_between_two_steps_lies_the_line() -> None:
    run = flight(Path(loop(2, radius=40, height=20, rise=5, wander=0.2), radius=5))
    for k in (0, 17, 200):
        for share in (0.0, 0.25, 0.5):
            a, b, seen = run.step(k)[1], run.step(k + 1)[1], run.at((k + share) / run.rate)[1]
            np.testing.assert_allclose(seen.position, (1 - share) * a.position + share * b.position, atol=1e-9)
            np.testing.assert_allclose(seen.velocity, (1 - share) * a.velocity + share * b.velocity, atol=1e-9)


@pytest.mark.parametrize("rates", [(24, 30, 60, 144)])
def test_frame_rates_see_the_same_flight(rates: tuple[int, ...]) -> None:
    """What each frame rate sees at the times that it shares with another is the same, though each asks its own run at its own times."""
    path = Path(loop(2, radius=40, height=20, rise=5, wander=0.2), radius=5)
    seen: dict[Fraction, list[Any]] = {}
    for rate in rates:
        run = flight(path)
        for frame in range(rate * 6 + 1):
            states = run.at(frame / rate)
            seen.setdefault(Fraction(frame, rate), []).append(np.concatenate([v.position for v in states]))
    shared = [positions for positions in seen.values() if len(positions) > 1]
    assert len([p for p in shared if len(p) == len(rates)]) > 30
    for positions in shared:
        for other in positions[1:]:
            np.testing.assert_allclose(other, positions[0], rtol=0, atol=1e-9)


def test_the_same_seed_gives_the_same_run_in_any_order() -> None:
    path = Path(loop(2, radius=40, height=20, rise=5, wander=0.2), radius=5)
    times = np.linspace(0, 8, 33)
    forward, backward, other = flight(path), flight(path), flight(path, seed=4)
    a = [forward.at(t)[1].position for t in times]
    b = [backward.at(t)[1].position for t in times[::-1]][::-1]
    np.testing.assert_array_equal(a, b)
    assert np.abs(np.array(a) - [other.at(t)[1].position for t in times]).max() > 1
    np.testing.assert_array_equal(loop(3, radius=9, height=1, rise=1, wander=0.1), loop(3, radius=9, height=1, rise=1, wander=0.1))


def test_a_path_needs_three_points() -> None:
    with pytest.raises(ValueError, match="three points"):
        Path([[0, 0, 0], [1, 0, 0]], radius=1)
