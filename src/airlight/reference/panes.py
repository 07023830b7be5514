"""Traces the layer of a medium behind, between and before panes that are seen through, as ground truth: by the tracer, in float64.

A pane dims light that passes it by its opacity. Of panes i that let p_i pass, v_i being 0 where one would hide the light if it were opaque,
else 1, the product of p_i + (1 - p_i) v_i is left of it: a sum over subsets of the panes, in each of which these are opaque.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from airlight.lights.punctual import PunctualLight
from airlight.medium.resolve import ResolvedMedium
from airlight.reference import tracer
from airlight.reference.medium import Layer
from airlight.reference.profile import seen_through

Array = tracer.Array


@dataclass(frozen=True)
class Pane:
    """Describes what a ray meets once at most: triangles (N, 3, 3), world, and the share of light that it lets through, 0..1."""

    triangles: Array
    passed: float


def left_behind(depth: Any, surfaces: Any, left: Any) -> Array:
    """Finds what is left (...) of a light at depths (...), which fall with the distance from it, behind surfaces at depths (..., 4), each
    nearer to it than the next; left (..., 4): behind each."""
    count = (np.asarray(surfaces) > np.asarray(depth)[..., None]).sum(axis=-1)
    every = np.concatenate([np.ones((*count.shape, 1)), np.broadcast_to(left, (*count.shape, 4))], axis=-1)
    return np.asarray(np.take_along_axis(every, count[..., None], axis=-1)[..., 0])


def dimmed_steps(n: Any, directional: bool) -> Array:
    """Chooses how many of n steps take what is left of a light from one look-up."""
    n = np.asarray(n)
    return np.where(n >= 64, 8.0 if directional else 4.0, np.where(n >= 32, 2.0, 1.0))


def layer(
    view: Any,
    projection: Any,
    size: tuple[int, int],
    triangles: Array,
    panes: Sequence[Pane],
    lights: Sequence[PunctualLight],
    medium: ResolvedMedium,
    casters: Array | None = None,
    dims: bool = True,
) -> Layer:
    """Computes the layer of a medium as `tracer.layer`, seen through panes. triangles, casters: without these.

    dims: whether the panes dim light. The transmittance is the medium's alone, up to what is solid.
    """
    solid = np.asarray(triangles, float).reshape(-1, 3, 3)
    casting = solid if casters is None else np.asarray(casters, float).reshape(-1, 3, 3)
    shades = panes if dims else ()

    def lit(seen: Array) -> Layer:
        """Sums over the subsets of panes that hide light. seen: what ends rays."""
        found = None
        for opaque in product((False, True), repeat=len(shades)):
            share = float(np.prod([1 - pane.passed if hides else pane.passed for pane, hides in zip(shades, opaque, strict=True)]))
            hiding = [pane.triangles for pane, hides in zip(shades, opaque, strict=True) if hides]
            one = tracer.layer(view, projection, size, seen, lights, medium, np.concatenate([casting, *hiding]))
            radiance = share * one.radiance + (0 if found is None else found.radiance)
            found = Layer(radiance, one.transmittance, one.path_length)
        assert found is not None
        return found

    behind = lit(solid)
    if not panes:
        return behind
    before = [lit(np.concatenate([solid, pane.triangles])) for pane in panes]
    met = [one.path_length < behind.path_length for one in before]
    order = np.argsort(np.stack([-one.path_length for one in before]), axis=0)

    def sorted_by_distance(values: list[Array]) -> Array:
        return np.asarray(np.take_along_axis(np.stack(values), order[..., None], axis=0))

    passed = sorted_by_distance([np.where(hit, pane.passed, 1.0)[..., None] for hit, pane in zip(met, panes, strict=True)])
    air = sorted_by_distance([one.radiance for one in before])
    radiance = seen_through(behind.radiance, np.zeros_like(air), passed, air, np.ones_like(air))
    return Layer(radiance, behind.transmittance, behind.path_length)
