"""The march's shader functions one by one, over random arrays, against their float64 twins."""

from typing import Any

import numpy as np
import pytest
from calling import call

from airlight.gpu.structs import struct_dtype
from airlight.medium.resolve import FOGS
from airlight.reference import lights, march, march_air, medium

RNG = np.random.default_rng(11)
COUNT = 200
FRAME, LIGHT, RAY = (struct_dtype("scatter/march/walk.wgsl", name) for name in ("Frame", "Light", "Ray"))
PHASES = range(5)


def unit(shape: tuple[int, ...] = (COUNT,)) -> np.ndarray:
    v = RNG.normal(size=(*shape, 3))
    return np.asarray((v / np.linalg.norm(v, axis=-1, keepdims=True)).astype(np.float32))


def between(low: float, high: float, *shape: int) -> np.ndarray:
    return RNG.uniform(low, high, (COUNT, *shape)).astype(np.float32)


def ranges(low: float = 0.0, high: float = 9.0) -> np.ndarray:
    return np.sort(between(low, high, 2), axis=-1)


def rays() -> np.ndarray:
    out = np.zeros(COUNT, RAY)
    out["origin"], out["direction"], out["reach"] = between(-2, 2, 3), unit(), between(1, 20)
    return out


@pytest.fixture
def frame() -> Any:
    out = np.zeros((), FRAME)
    out["sigma_t"], out["sigma_s"] = (0.1, 0.2, 0.05), (0.09, 0.1, 0.05)
    out["size"], out["pixels"] = (12, 7), (37, 23)
    out["sun_glow"], out["glow_concentration"] = 0.3, 40.0
    return out


@pytest.fixture
def light() -> Any:
    out = np.zeros((), LIGHT)
    out["intensity"], out["position"], out["axis"] = (3, 2, 1), unit(())[:3] * 3, unit(())
    out["cone_scale"], out["cone_offset"], out["cone_cosine"] = 4.0, -3.0, 0.75
    out["lobes"], out["range"], out["side"], out["bias"], out["views"] = (0.5, -0.3, 0.25), 12.0, 64, 0.1, 2
    view = out["view"][1]
    view["matrix"] = np.array([[9, 1, 0.1, 0.2], [-1, 8, 0.2, -0.1], [0.5, 1, 0.05, -1], [30, 33, 0.5, 5]])
    view["depth_scale"], view["texel"] = 30.0, 0.2
    return out


def close(found: Any, truth: Any, rtol: float = 2e-5, atol: float = 1e-6) -> None:
    assert np.shape(found) == np.shape(truth) and np.ptp(truth) > 0
    np.testing.assert_allclose(found, truth, rtol=rtol, atol=atol)


def test_transmittance() -> None:
    t, sigma = between(0, 30), between(0, 0.5, 3)
    sigma[::7, 1] = 0
    close(call("medium/transmittance.wgsl", "transmittance", [t, sigma]), np.exp(-t[:, None] * sigma.astype(float)))
    each = [medium.transmittance(a, b) for a, b in zip(t, sigma, strict=True)]
    close(call("medium/transmittance.wgsl", "transmittance", [t, sigma]), np.array(each))
    x = np.concatenate([between(0, 1e-3, 3), between(0, 0.5, 3), between(0, 30, 3)])
    close(call("medium/transmittance.wgsl", "mean_transmittance", [x]), medium.mean_transmittance(x))
    each = [medium.transmittance_integral(a, b) for a, b in zip(t, sigma, strict=True)]
    close(call("medium/transmittance.wgsl", "transmittance_integral", [t, sigma]), np.array(each))


@pytest.mark.parametrize("kind", PHASES)
def test_phase(kind: int) -> None:
    cosine, lobes, constants = between(-1, 1), np.stack([between(-0.95, 0.95), between(-0.9, 0.9), between(0, 1)], axis=-1), {"PHASE": kind}
    a, b = unit(), unit()
    b[::2] = (a + 1e-2 * b)[::2] / np.linalg.norm(a + 1e-2 * b, axis=1)[::2, None]  # near peaks
    apart = np.stack([1 - cosine.astype(float), 1 + cosine.astype(float)], axis=-1)
    for found, truth in (
        (call("medium/phase.wgsl", "phase", [cosine, lobes], constants=constants), medium.phase(cosine, lobes, kind)),
        (call("medium/phase.wgsl", "phase_apart", [apart, lobes], constants=constants), medium.phase_apart(apart, lobes, kind)),
        (call("medium/phase.wgsl", "phase_between", [a, b, lobes], constants=constants), medium.phase_between(a, b, lobes, kind)),
    ):
        np.testing.assert_allclose(found, truth, rtol=2e-4)


def test_henyey_greenstein() -> None:
    apart = np.stack([between(0, 2), between(0, 2)], axis=-1)
    apart[:, 1] = 2 - apart[:, 0]
    g = between(-0.99, 0.99)
    close(call("medium/phase.wgsl", "henyey_greenstein", [apart, g]), medium.henyey_greenstein(apart, g), rtol=1e-4)


def test_attenuation() -> None:
    cosine, scale, offset, d = between(-1, 1), between(0, 20), between(-9, 1), between(0, 20)
    close(call("lights/irradiance.wgsl", "cone_ramp", [cosine, scale, offset]), lights.cone_ramp(cosine, scale, offset), atol=1e-5)
    reach = between(0, 20) * (np.arange(COUNT) % 3 > 0)
    close(call("lights/irradiance.wgsl", "range_window", [d, reach]), lights.range_window(d, reach), atol=1e-5)


def test_sampled_pixel(frame: Any) -> None:
    p = RNG.integers(0, (14, 9), (COUNT, 2))  # two beyond the border
    truth = march.sampled_pixel(p, frame["size"], frame["pixels"])
    assert np.array_equal(call("scatter/march/ray.wgsl", "sampled_pixel", [p], bindings={"frame": frame}), truth)


@pytest.mark.parametrize("kind", PHASES)
def test_in_scattering(kind: int, frame: Any, light: Any) -> None:
    own: Any = {"bindings": {"frame": frame, "light": light}, "constants": {"PHASE": kind, "CONE": True}}
    sun = light.copy()
    sun["position"] = unit(())
    ray = rays()
    found = call("scatter/march/ray.wgsl", "in_scatter_directional", [ray], **(own | {"bindings": {"frame": frame, "light": sun}}))
    close(found, march.in_scatter_directional(ray["direction"], frame, sun, kind), rtol=1e-4)
    t, d, cosine, axis_cosine = between(0, 9), between(0.1, 11), between(-1, 1), between(0.5, 1)
    found = call("scatter/march/ray.wgsl", "in_scatter_punctual", [ray, t, d, cosine, axis_cosine], **own)
    close(found, march.in_scatter_punctual(ray, t, d, cosine, axis_cosine, frame, light, kind), rtol=1e-3, atol=1e-6)


def test_nearest_approach_and_parameters(light: Any) -> None:
    ray, t = rays(), between(-5, 9)
    nearest = march.nearest_approach(ray, light)
    close(call("scatter/march/steps.wgsl", "nearest_approach", [ray], bindings={"light": light}), nearest, rtol=1e-4, atol=1e-4)
    close(call("scatter/march/steps.wgsl", "sinh_parameter", [nearest, t]), march.sinh_parameter(nearest, t), rtol=1e-3, atol=1e-4)
    close(call("scatter/march/steps.wgsl", "equiangular_angle", [nearest, t]), march.equiangular_angle(nearest, t), atol=1e-5)


@pytest.mark.parametrize("kind", PHASES)
def test_substituted_integrands(kind: int, frame: Any, light: Any) -> None:
    ray, v, angle = rays(), between(-2, 2), between(-1.4, 1.4)
    own: Any = {"bindings": {"frame": frame, "light": light}, "constants": {"PHASE": kind, "CONE": True}}
    nearest = march.nearest_approach(ray, light).astype(np.float32)
    found = call("scatter/march/steps.wgsl", "sinh_integrand", [ray, nearest, v], **own)
    close(found, march.sinh_integrand(ray, nearest, v, frame, light, kind), rtol=5e-3, atol=1e-5)
    found = call("scatter/march/steps.wgsl", "equiangular_integrand", [ray, nearest, angle], **own)
    close(found, march.equiangular_integrand(ray, nearest, angle, frame, light, kind), rtol=5e-3, atol=1e-5)


@pytest.mark.parametrize("cone", [False, True])
def test_integral_over_a_segment(cone: bool, frame: Any, light: Any) -> None:
    ray, segment = rays(), ranges()
    light["cone_scale"], light["cone_offset"] = (4.0, -2.4) if cone else (0.0, 1.0)
    if cone:  # through the axis, so that there are parts before, in and behind what is fully lit
        to = light["position"] + between(1, 3, 1) * light["axis"] - ray["origin"]
        ray["direction"], segment[:, 0] = to / np.linalg.norm(to, axis=1, keepdims=True), segment[:, 0] / 9
    own: Any = {"bindings": {"frame": frame, "light": light}, "constants": {"CONE": cone}}
    nearest = march.nearest_approach(ray, light).astype(np.float32)
    full = march.full_cone_range(ray, segment, light, cone).astype(np.float32)
    found = call("scatter/march/walk.wgsl", "integrate_punctual", [ray, nearest, full, segment], **own)
    assert cone == (((full > segment[:, :1] + 0.1) & (full < segment[:, 1:] - 0.1)).all(axis=1).mean() > 0.05)
    truth = march.integrate_punctual(ray, nearest, full, segment, frame, light, 0)
    np.testing.assert_allclose(found, truth, rtol=2e-3, atol=2e-3 * truth.mean())


def test_clipping(light: Any) -> None:
    ray, span = rays(), ranges(-5, 9)
    b, a = between(-5, 5), between(-2, 2)
    a[::5] = 0
    close(call("scatter/march/ray.wgsl", "clip_range", [span, b, a]), march.clip_range(span, b, a), rtol=1e-4, atol=1e-4)

    def same(found: np.ndarray, truth: np.ndarray) -> None:
        """Empty ranges are alike, whatever their ends; a ray that touches a cone's edge may be either."""
        empty = found[:, 1] <= found[:, 0], truth[:, 1] <= truth[:, 0]
        both = ~empty[0] & ~empty[1]
        assert (empty[0] != empty[1]).sum() <= 1 and 0.05 < both.mean() < 0.95
        off = np.abs(found - truth)[both].max(axis=1)
        assert np.quantile(off, 0.97) < 2e-3

    q, direction, axis, cosine = between(-3, 3, 3), unit(), unit(), between(0.05, 0.95)
    found = call("scatter/march/lights.wgsl", "clip_to_narrow_cone", [q, direction, axis, span, cosine])
    same(found, march.clip_to_narrow_cone(q, direction, axis, span, cosine))
    found = call("scatter/march/lights.wgsl", "clip_to_narrow_cone", [10 * q, direction, axis, 10 * span, cosine])
    same(found / 10, march.clip_to_narrow_cone(q, direction, axis, span, cosine))
    edge, beside = np.float32([0.8, 0, 0.6]), np.float32([[-2, 0.1, 0.5], [-2, -0.1, 0], [2, 0.5, 1]])  # parallel to the cone's edge
    others = np.float32([0, 0, 1]), np.float32([0, 9]), edge[2]
    found = call("scatter/march/lights.wgsl", "clip_to_narrow_cone", [beside, edge, *others])
    np.testing.assert_allclose(found, march.clip_to_narrow_cone(beside, edge, *others), atol=2e-3)
    cosine[::2] = 0
    found = call("scatter/march/lights.wgsl", "clip_to_cone", [ray, span, cosine], bindings={"light": light})
    same(found, march.clip_to_cone(ray, span, cosine, light))
    light["cone_scale"], light["cone_offset"] = 2.0, 0.2
    for cone in (False, True):
        found = call("scatter/march/lights.wgsl", "full_cone_range", [ray, span], bindings={"light": light}, constants={"CONE": cone})
        same(found, march.full_cone_range(ray, span, light, cone)) if cone else np.testing.assert_array_equal(found, span)


@pytest.mark.parametrize("margin", [0.0, 1.0])
def test_projection_into_a_shadow_view(margin: float, light: Any) -> None:
    ray, span = rays(), ranges()
    found = call("scatter/march/lights.wgsl", "project_ray", [1, ray, span, margin], bindings={"light": light})
    a, b, clipped = march.project_ray(1, ray, span, margin, light)
    close(found["a"], a, rtol=1e-4, atol=1e-4)
    close(found["b"], b, rtol=1e-4, atol=1e-4)
    inside = clipped[:, 1] > clipped[:, 0] + 1e-3
    assert 0.05 < inside.mean() < 0.95 and np.array_equal(found["range"][:, 1] > found["range"][:, 0] + 1e-3, inside)
    np.testing.assert_allclose(found["range"][inside], clipped[inside], rtol=2e-3, atol=2e-3)


@pytest.mark.parametrize("directional", [False, True])
def test_shadow_depths(directional: bool, light: Any) -> None:
    constants = {"DIRECTIONAL": directional, "BIASED": True}
    depth, bias = between(0, 1), between(0, 0.1)
    depth[::9] = 0
    found = call("scatter/march/lights.wgsl", "biased_occluder_depth", [depth, bias], constants=constants)
    np.testing.assert_allclose(found, march.biased_occluder_depth(depth, bias, directional), rtol=1e-5, atol=1e-6)
    for biased in (False, True):
        found = call("scatter/march/lights.wgsl", "depth_bias", [1], bindings={"light": light}, constants={"BIASED": biased})
        assert float(found) == pytest.approx(march.depth_bias(1, light, biased), rel=1e-6)
    s, w = between(0, 1), between(0.2, 5, 2)
    span = ranges()
    found = call("scatter/march/walk.wgsl", "line_to_t", [s, span, w], constants=constants)
    close(found, march.line_to_t(s, span, w, directional), rtol=1e-4)


@pytest.mark.parametrize("directional", [False, True])
def test_a_rays_last_stretch(directional: bool, light: Any, frame: Any) -> None:
    ray, w = rays(), between(-1, 5)
    frame["max_distance"] = np.median(ray["reach"])
    shared = {"light": light, "frame": frame}
    found = call("scatter/march/lights.wgsl", "last_stretch", [1, ray, w], bindings=shared, constants={"DIRECTIONAL": directional})
    truth = march.last_stretch(1, ray, w, frame, light, directional)
    close(found, truth, rtol=1e-5, atol=1e-5)
    assert (truth[ray["reach"] >= frame["max_distance"]] == ray["reach"][ray["reach"] >= frame["max_distance"]]).all()
    assert 0.1 < (truth < ray["reach"]).mean() < 0.9


def test_steps_and_filters() -> None:
    k, turn = RNG.integers(0, 12, COUNT).astype(np.float32), between(0, 1)
    close(call("scatter/march/steps.wgsl", "vogel_disc", [k, turn]), march.vogel_disc(k, turn), rtol=1e-3, atol=1e-4)
    ahead, near, far, blend = between(0, 20), between(0, 5), between(8, 15), between(0.02, 1)
    found = call("scatter/march/steps.wgsl", "cascade_weight", [ahead, near, far, blend])
    close(found, march.cascade_weight(ahead, near, far, blend), atol=1e-4)
    beyond, each, o, n = between(-2, 30), between(0.01, 1), between(0, 1), np.float32(64)
    found, truth = call("scatter/march/steps.wgsl", "first_step", [beyond, each, o, n]), march.first_step(beyond, each, o, n)
    assert (np.abs(found - truth) <= 1).all() and (found == truth).mean() > 0.98  # a sample on the border


def test_hierarchy() -> None:
    side, i, level = RNG.integers(1, 9000, COUNT), RNG.integers(0, 6, COUNT), RNG.choice([3, 6], COUNT)
    assert np.array_equal(call("scatter/march/hierarchy.wgsl", "tiles_along", [side, level]), march.tiles_along(side, level))
    tile = RNG.integers(0, march.tiles_along(side, level)[:, None], (COUNT, 2))
    found = call("scatter/march/hierarchy.wgsl", "tile_index", [side, i, level, tile])
    assert np.array_equal(found, march.tile_index(side, i, level, tile))
    where = march.tile_index(100, np.arange(2)[:, None, None], 3, np.stack(np.meshgrid(range(13), range(13)), axis=-1))
    assert len(np.unique(where)) == 2 * 13**2 and where[1].min() == 13**2 + 2**2  # each its own, and views apart


def test_packed_depths_hold_what_was_packed() -> None:
    depths = np.sort(np.where(RNG.random((COUNT, 2)) < 0.2, 0, 10.0 ** RNG.uniform(-6, 0, (COUNT, 2))), axis=1).astype(np.float32)
    found = call("scatter/march/build_hierarchy.wgsl", "pack_conservative", [depths])
    halves = np.ascontiguousarray(found).view(np.float16).reshape(-1, 2).astype(float)
    assert (halves[:, 0] <= depths[:, 0]).all() and (halves[:, 1] >= depths[:, 1]).all()
    truth = march.pack_conservative(depths).view(np.float16).reshape(-1, 2).astype(float)
    np.testing.assert_allclose(halves, truth, rtol=1.01 / 1024)


def test_relative_difference() -> None:
    a, b = between(0, 20), between(0, 20)
    close(call("scatter/march/upsample.wgsl", "relative_difference", [a, b]), march.relative_difference(a, b), rtol=1e-4)


@pytest.mark.parametrize("views", [0, 2])
def test_ranges_and_fog_of_the_air(views: int, frame: Any, light: Any) -> None:
    sun, fog, ray, i = light.copy(), frame.copy(), rays(), RNG.integers(0, 2, COUNT)
    sun["views"], sun["climb"] = views, 0.4
    sun["view"]["near"][:2], sun["view"]["far"][:2] = (0.0, 3.0), (3.0, 9.0)
    found = call("scatter/march/air_steps.wgsl", "range_of_view", [i.astype(np.uint32), ray], bindings={"light": sun, "light_storage": sun})
    close(found, march_air.range_of_view(i, ray, sun), rtol=1e-4, atol=1e-4)
    fog["air"], fog["fog_depth"], fog["fog_above"] = 0.5, 4.0, 0.0
    t = between(0, 9)
    own: Any = {"bindings": {"light": sun, "frame": fog}, "constants": {"FOG": FOGS.index("exponential")}}
    found = call("scatter/march/air_steps.wgsl", "left_by_fog", [ray, t], **own)
    close(found, march_air.left_by_fog(ray, t, fog, sun, "exponential"), rtol=1e-3, atol=1e-5)
