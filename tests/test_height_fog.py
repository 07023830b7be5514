"""Fog that depends on height: its closed forms against quadrature, the shader's functions against their float64 twins."""

from typing import Any

import numpy as np
import pytest
from calling import call

from airlight.gpu.structs import struct_dtype
from airlight.medium.resolve import FOGS
from airlight.reference import height, march, medium

RNG = np.random.default_rng(18)
COUNT = 400
KINDS = FOGS[1:]
FRAME, LIGHT, RAY = (struct_dtype("scatter/march/walk.wgsl", name) for name in ("Frame", "Light", "Ray"))
NODES, WEIGHTS = np.polynomial.legendre.leggauss(40)


def quadrature(low: Any, high: Any, layer: Any, kind: str) -> Any:
    """The integral of density over heights, by Gauss's rule between its kinks, which knows no closed form."""
    total = np.zeros(np.shape(low))
    for band in np.linspace(-60, 60, 241):
        start, end = np.clip(band * layer[..., 0], low, high), np.clip((band + 0.5) * layer[..., 0], low, high)
        for node, weight in zip(NODES, WEIGHTS, strict=True):
            y = start + (end - start) * (node + 1) / 2
            total += weight * (end - start) / 2 * height.height_density(y, layer, kind)
    return total


def layers() -> np.ndarray:
    return np.stack([RNG.uniform(0.5, 9, COUNT), RNG.uniform(0, 1, COUNT)], axis=-1).astype(np.float32)


def heights() -> np.ndarray:
    return (RNG.uniform(-3, 3, COUNT) * RNG.choice([0.1, 1, 4], COUNT)).astype(np.float32)


def constants(kind: str) -> dict[str, Any]:
    return {"FOG": FOGS.index(kind)}


@pytest.mark.parametrize("kind", KINDS)
def test_closed_forms_are_integrals(kind: str) -> None:
    layer, a, b = layers().astype(float), heights().astype(float), heights().astype(float)
    low, high = np.minimum(a, b), np.maximum(a, b)
    mean = height.mean_height_density(a, b, layer, kind)
    np.testing.assert_allclose(mean * (high - low), quadrature(low, high, layer, kind), rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(height.mean_height_density(a, a, layer, kind), height.height_density(a, layer, kind), rtol=1e-12)
    far = 50 * layer[:, 0]
    column = quadrature(a, far, layer, kind) - (far - a) * (layer[:, 1] if kind == "linear" else 0)
    np.testing.assert_allclose(height.height_column(a, layer, kind), column, rtol=1e-9, atol=1e-9)
    assert height.height_density(-1.0, [2.0, 0.3], kind) == 1 and (np.diff(height.height_density(np.arange(9.0), [2.0, 0.3], kind)) <= 0).all()


@pytest.mark.parametrize("kind", KINDS)
def test_heights_in_the_shader(kind: str) -> None:
    layer, a, b, own = layers(), heights(), heights(), constants(kind)
    b[::5] = a[::5] + 1e-4
    for name, arguments in (("height_density", [a, layer]), ("mean_height_density", [a, b, layer]), ("height_column", [a, layer])):
        found = call("medium/height.wgsl", name, arguments, constants=own)
        np.testing.assert_allclose(found, getattr(height, name)(*arguments, kind), rtol=1e-5, atol=1e-6)
    bands = len(height.BANDS[kind]) - 1
    k = np.arange(COUNT) % bands
    found = call("medium/height.wgsl", "height_band", [k.astype(np.uint32), layer], constants=own)
    np.testing.assert_allclose(found, height.height_band(k, layer, kind), rtol=1e-6)
    assert found[0, 0] < -1e12 and found[bands - 1, 1] > 1e12 and (found[: bands - 1, 1] / layer[: bands - 1, 0])[0] == 0


@pytest.fixture
def frame() -> Any:
    out = np.zeros((), FRAME)
    out["sigma_t"], out["sigma_s"] = (0.1, 0.2, 0.05), (0.09, 0.1, 0.05)
    out["up"], out["base_height"], out["fog_depth"], out["fog_above"] = (0.36, 0.48, 0.8), 0.7, 2.5, 0.1
    return out


@pytest.fixture
def light() -> Any:
    out = np.zeros((), LIGHT)
    out["intensity"], out["position"], out["axis"], out["climb"] = (3, 2, 1), (1, 2, -2), (0, 0, 1), 0.4
    out["cone_offset"], out["lobes"] = 1.0, (0.5, -0.3, 0.25)
    return out


def rays() -> np.ndarray:
    out = np.zeros(COUNT, RAY)
    direction = RNG.normal(size=(COUNT, 3))
    out["direction"] = direction / np.linalg.norm(direction, axis=1, keepdims=True)
    out["direction"][::9] = (0.8, -0.6, 0)  # level
    out["origin"], out["reach"] = RNG.uniform(-2, 2, (COUNT, 3)), RNG.uniform(1, 20, COUNT)
    return out


def close(found: Any, truth: Any, rtol: float, share: float = 1e-5) -> None:
    assert np.shape(found) == np.shape(truth) and np.ptp(truth) > 0
    np.testing.assert_allclose(found, truth, rtol=rtol, atol=share * np.abs(truth).mean())


@pytest.mark.parametrize("kind", FOGS)
def test_rays_in_the_shader(kind: str, frame: Any, light: Any) -> None:
    ray, t = rays(), RNG.uniform(0, 15, COUNT).astype(np.float32)
    own: Any = {"bindings": {"frame": frame}, "constants": constants(kind)}
    lit: Any = own | {"bindings": {"frame": frame, "light": light}}
    place = RNG.uniform(-5, 5, (COUNT, 3)).astype(np.float32)
    close(call("scatter/march/ray.wgsl", "height", [place], **own), march.height(place, frame), 1e-5)
    assert np.ravel(call("scatter/march/ray.wgsl", "layer_of_fog", [], **own)).tolist() == [2.5, np.float32(0.1)]
    close(call("scatter/march/ray.wgsl", "optical_length", [ray, t], **own), march.optical_length(ray, t, frame, kind), 2e-5)
    segment = np.sort(RNG.uniform(0, 15, (COUNT, 2)), axis=1).astype(np.float32)
    for fades in (False, True) if kind != "none" else ():
        more = lit | {"constants": constants(kind) | {"FADES": fades}}
        for name in ("directional_integral", "integrate_directional"):
            file = "ray" if name.startswith("d") else "lights"
            found = call(f"scatter/march/{file}.wgsl", name, [ray, segment], **more)
            close(found, getattr(march, name)(ray, segment, frame, light, kind, fades), 2e-4, 1e-4)
    if kind == "none":
        found = call("scatter/march/lights.wgsl", "integrate_directional", [ray, segment], **lit)
        close(found, march.integrate_directional(ray, segment, frame, light, kind, False), 1e-3, 1e-4)
        return
    k = np.arange(COUNT) % 9
    found = call("scatter/march/ray.wgsl", "clip_to_band", [ray, segment, k.astype(np.uint32)], **own)
    truth = march.clip_to_band(ray, segment, k, frame, kind)
    some = truth[:, 1] > truth[:, 0]
    assert some.mean() > 0.1 and ((found[:, 1] > found[:, 0]) == some).mean() > 0.98
    close(np.where(some[:, None], found, 0), np.where(some[:, None], truth, 0), 1e-3, 1e-3)


@pytest.mark.parametrize("kind", KINDS)
def test_lamps_in_the_shader(kind: str, frame: Any, light: Any) -> None:
    ray, segment = rays(), np.sort(RNG.uniform(0, 15, (COUNT, 2)), axis=1).astype(np.float32)
    own: Any = {"bindings": {"frame": frame, "light": light}, "constants": constants(kind)}
    nearest = march.nearest_approach(ray, light).astype(np.float32)
    v = march.sinh_parameter(nearest, segment[:, 0]).astype(np.float32)
    found = call("scatter/march/steps.wgsl", "sinh_integrand", [ray, nearest, v], **own)
    close(found, march.sinh_integrand(ray, nearest, v, frame, light, 0, kind), 5e-3, 1e-3)
    angle = march.equiangular_angle(nearest, segment[:, 0]).astype(np.float32)
    found = call("scatter/march/steps.wgsl", "equiangular_integrand", [ray, nearest, angle], **own)
    close(found, march.equiangular_integrand(ray, nearest, angle, frame, light, 0, kind), 5e-3, 1e-3)
    some, parts = slice(0, 60), (ray[:60], nearest[:60], segment[:60], segment[:60])
    found = call("scatter/march/lights.wgsl", "integrate_in_fog", list(parts), **own)
    truth = march.integrate_in_fog(*parts, frame, light, 0, kind)
    close(found, truth, 2e-3, 2e-3)
    dense = lamp_by_quadrature(ray[some], segment[some], frame, light, kind)
    close(truth, dense, 5e-4, 1e-4)


def lamp_by_quadrature(ray: Any, segment: Any, frame: Any, light: Any, kind: str) -> np.ndarray:
    """Sum what a lamp scatters over 40,000 equal parts of segments, with lengths by the trapezoid rule."""
    direction, count, out = ray["direction"].astype(float), 40_000, []
    for r, along, (start, end) in zip(ray, direction, segment.astype(float), strict=True):
        t = np.linspace(0, end, count)
        place = r["origin"] + t[:, None] * along
        y = frame["base_height"] + place @ frame["up"].astype(float)
        layer = np.array([frame["fog_depth"], frame["fog_above"]], float)
        rho = height.height_density(y, layer, kind)
        length = np.concatenate([[0], np.cumsum((rho[1:] + rho[:-1]) / 2 * np.diff(t))])
        away = place - light["position"]
        d = np.linalg.norm(away, axis=1)
        lamp = d * height.mean_height_density(y, march.height(light["position"], frame), layer, kind)
        cosine = -(away @ along) / d
        strength = medium.phase(cosine, light["lobes"], 0) / d**2 * rho * ((t >= start) & (t <= end))
        values = strength[:, None] * np.exp(-(length + lamp)[:, None] * frame["sigma_t"].astype(float))
        out.append(frame["sigma_s"] * light["intensity"] * np.trapezoid(values, t, axis=0))
    return np.array(out)


@pytest.mark.parametrize(("kind", "above", "fades"), [("exponential", 0, True), ("linear", 0, True), ("linear", 0.2, True), ("linear", 0.2, False)])
def test_a_sun_is_exact_over_any_stretch(kind: str, above: float, fades: bool, frame: Any, light: Any) -> None:
    """By quadrature of density, of the light's own way too: closed, but for a ramp to something, whose bands are 3e-3 off at most."""
    frame["fog_above"] = above
    ray, segment = rays()[:60], np.sort(RNG.uniform(0, 15, (60, 2)), axis=1).astype(np.float32)
    found = march.integrate_directional(ray, segment, frame, light, kind, fades)
    truth = []
    for r, (start, end) in zip(ray, segment.astype(float), strict=True):
        t = np.linspace(0, end, 60_001)
        y = frame["base_height"] + (r["origin"] + t[:, None] * r["direction"].astype(float)) @ frame["up"].astype(float)
        layer = np.array([frame["fog_depth"], frame["fog_above"]], float)
        rho = height.height_density(y, layer, kind)
        length = np.concatenate([[0], np.cumsum((rho[1:] + rho[:-1]) / 2 * np.diff(t))])
        if fades:
            length = length + height.height_column(y, layer, kind) / float(light["climb"])
        inside = ((t >= start) & (t <= end)) * rho
        truth.append(np.trapezoid(inside[:, None] * np.exp(-length[:, None] * frame["sigma_t"].astype(float)), t, axis=0))
    close(found, np.array(truth), 3e-3 if above and fades else 3e-4, 1e-4)
