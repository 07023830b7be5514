"""Fog that depends on height: its closed forms against quadrature, the shader's functions against their float64 twins."""

from typing import Any

import numpy as np
import pytest
import validating
from calling import call
from rasterising import edge_error
from test_tracer import look

from airlight.compare.scenes import ComparedView
from airlight.compare.variants import variant
from airlight.errors import AirlightError
from airlight.gpu.device import open_device
from airlight.gpu.structs import struct_dtype
from airlight.lights.directional import DirectionalLight
from airlight.medium.resolve import FOGS, resolve
from airlight.options import March, Medium
from airlight.pygfx.casters import Casters
from airlight.pygfx.casters import height as height_of
from airlight.reference import height, march, medium, paths, tracer
from airlight.scatter.march.atlas import solid
from airlight.scenes import offline, open_scene
from airlight.scenes.offline import Shot

RNG = np.random.default_rng(18)
COUNT = 400
KINDS = FOGS[1:]
FRAME, LIGHT, RAY = (struct_dtype("scatter/march/walk.wgsl", name) for name in ("Frame", "Light", "Ray"))
FIELD = struct_dtype("scatter/march/field.wgsl", "Field")
NODES, WEIGHTS = np.polynomial.legendre.leggauss(40)


def unused() -> dict[str, Any]:
    """What the shaders of a march bind for a density that varies, and for a light's shape."""
    device = open_device()
    nothing = solid(device, (1, 1, 1), "r16float")
    textures = {"atlas": nothing, "table_texture": nothing, "linear": device.sampler()}
    textures |= {"cookie": np.zeros((1, 1, 4), "f4"), "cookie_sampler": device.sampler()}
    return {"field": np.zeros((), FIELD), "voxels": np.zeros(4, "f4"), "table": np.zeros(4, "f4"), **textures}


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
    falling = height.height_density(np.arange(-1, 9.0), [2.0, 0.3], kind)
    assert falling[0] == 1 and (np.diff(falling) <= 0).all()


@pytest.mark.parametrize("kind", KINDS)
def test_heights_in_the_shader(kind: str) -> None:
    layer, a, b, own = layers(), heights(), heights(), constants(kind)
    b[::5] = a[::5] + 1e-4
    found = call("medium/height.wgsl", "height_density", [a, layer], constants=own)
    np.testing.assert_allclose(found, height.height_density(a, layer, kind), rtol=1e-5, atol=1e-6)
    found = call("medium/height.wgsl", "mean_height_density", [a, b, layer], constants=own)
    np.testing.assert_allclose(found, height.mean_height_density(a, b, layer, kind), rtol=1e-5, atol=1e-6)
    found = call("medium/height.wgsl", "height_column", [a, layer], constants=own)
    np.testing.assert_allclose(found, height.height_column(a, layer, kind), rtol=1e-5, atol=1e-6)
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
    frame["air"] = 1.0
    place = RNG.uniform(-5, 5, (COUNT, 3)).astype(np.float32)
    close(call("scatter/march/ray.wgsl", "height", [place], **own), march.height(place, frame), 1e-5)
    assert np.ravel(call("scatter/march/ray.wgsl", "layer_of_fog", [], **own)).tolist() == march.layer_of_fog(frame).tolist()
    close(call("scatter/march/ray.wgsl", "optical_length", [ray, t], **own), march.optical_length(ray, t, frame, kind), 2e-5)
    segment = np.sort(RNG.uniform(0, 15, (COUNT, 2)), axis=1).astype(np.float32)
    for fades in (False, True) if kind != "none" else ():
        more = lit | {"constants": constants(kind) | {"FADES": fades}}
        found = call("scatter/march/ray.wgsl", "directional_integral", [ray, segment], **more)
        close(found, march.directional_integral(ray, segment, frame, light, kind, fades), 2e-4, 1e-4)
        found = call("scatter/march/lights.wgsl", "integrate_evenly", [ray, segment], **more)
        close(found, march.integrate_evenly(ray, segment, frame, light, kind, fades), 2e-4, 1e-4)
    if kind == "none":
        found = call("scatter/march/lights.wgsl", "integrate_evenly", [ray, segment], **lit)
        close(found, march.integrate_evenly(ray, segment, frame, light, kind, False), 1e-3, 1e-4)
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
    own["bindings"] = own["bindings"] | unused()
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


@pytest.mark.parametrize(
    ("kind", "above", "fades"), [("exponential", 0, True), ("linear", 0, True), ("linear", 0.2, True), ("linear", 0.2, False)]
)
def test_a_sun_is_exact_over_any_stretch(kind: str, above: float, fades: bool, frame: Any, light: Any) -> None:
    """By quadrature of density, of the light's own way too: closed, but for a ramp to something, whose bands are 3e-3 off at most."""
    frame["fog_above"] = above
    ray, segment = rays()[:60], np.sort(RNG.uniform(0, 15, (60, 2)), axis=1).astype(np.float32)
    found = march.integrate_evenly(ray, segment, frame, light, kind, fades)
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


# ---------------------------------------------------------------- whole pictures


def open_air(**values: Any) -> Any:
    own = {"sigma_t": (0.1, 0.2, 0.4), "max_distance": 20.0, "fog": "exponential", "fog_depth": 2.0} | values
    return resolve(Medium(**own), March(), "final", 5)


def test_the_tracer_has_the_closed_form_of_a_sun_above_exponential_fog() -> None:
    """L = sigma_s p E e^(-tau_v(a) - tau_L(a)) times density's integral times phi((1 - m / s) tau_v), over whole rays."""
    air, sun = open_air(fog_base=0.3), DirectionalLight((3.0, 2.0, 1.0), direction=(0.48, 0.6, -0.64))
    view, projection = look(np.array([0.0, 0.8, 6.0]))
    found = tracer.layer(view, projection, (16, 9), np.zeros((0, 3, 3)), [sun], air)
    u, v = np.meshgrid((np.arange(16) + 0.5) / 16, (np.arange(9) + 0.5) / 9)
    origin, ray, _ = tracer.camera_rays(np.linalg.inv(view), projection, u.ravel(), v.ravel())
    up = ray[:, 1] > 0
    origin, ray, depth, s = origin[up], ray[up], 2.0, 0.6
    start, climb = origin[:, 1] - 0.3, ray[:, 1]
    length = depth / climb * (np.exp(-start / depth) - np.exp(-(start + 20 * climb) / depth))
    tau, own = length[:, None] * air.sigma_t, (depth * np.exp(-start / depth) / s)[:, None] * air.sigma_t
    rise = (1 - climb / s)[:, None] * tau
    there = medium.phase(ray @ np.array(sun.direction), air.lobes()[1:], air.lobes()[0])[:, None]
    truth = air.sigma_s * sun.intensity * there * np.exp(-own) * length[:, None] * medium.mean_transmittance(rise)
    truth = np.where(rise < 0, air.sigma_s * sun.intensity * there * np.exp(-own) * length[:, None] * np.expm1(-rise) / -rise, truth)
    np.testing.assert_allclose(found.radiance.reshape(-1, 3)[up], truth, rtol=1e-10)
    np.testing.assert_allclose(found.transmittance.reshape(-1, 3)[up], np.exp(-tau), rtol=1e-10)


def test_density_of_points() -> None:
    points = np.array([[0, -4, 0], [5, 1, 2], [0, 3, 0], [1, 5, 9.0]])
    np.testing.assert_allclose(paths.density(points, open_air(fog_base=1)), np.exp([0, 0, -1, -2]))
    linear = open_air(fog="linear", fog_depth=4.0, fog_base=1.0, fog_above=0.2)
    np.testing.assert_allclose(paths.density(points, linear), [1, 1, 0.6, 0.2])
    np.testing.assert_allclose(paths.density(points, open_air(fog="none")), 1)
    assert resolve(Medium(fog="exponential"), March(), "normal", 5.0, 30.0).fog_depth == 3.0


FOGGY = [
    ("mirrored", {"fog": "exponential", "fog_depth": 0.8, "fog_base": 0.2}),
    ("foliage-beside", {"fog": "linear", "fog_depth": 4.0, "fog_above": 0.2, "sun_extinction": "all"}),
    ("headlamp", {"fog": "exponential", "fog_depth": 1.0}),
    ("two-spots", {"fog": "linear", "fog_depth": 2.0, "fog_above": 0.1}),
]


@pytest.mark.parametrize(("name", "values"), FOGGY[::4])
def test_a_small_picture_in_fog_is_that_of_the_tracer(name: str, values: dict[str, Any]) -> None:
    drawn = validating.draw(name, 80, 45, shadow_size=2048, **values)
    rmse, bias = validating.error(drawn.layer, *drawn.traced())
    assert rmse < 0.0095 + 0.1 * edge_error() and abs(bias) < 0.005


@pytest.mark.slow
@pytest.mark.timeout(900)
@pytest.mark.parametrize(("name", "values"), FOGGY)
def test_a_picture_in_fog_is_that_of_the_tracer(name: str, values: dict[str, Any]) -> None:
    drawn = validating.draw(name, 240, 135, **values)
    rmse, bias = validating.error(drawn.layer, *drawn.traced())
    assert rmse < 0.006 and abs(bias) < 0.001


def test_fog_lies_where_it_is_whatever_is_drawn_at_the_origin(monkeypatch: pytest.MonkeyPatch) -> None:
    values = {"fog": "exponential", "fog_depth": 0.8, "fog_base": 0.2, "shadow_size": 512}
    here = validating.draw("mirrored", 48, 27, **values).layer
    monkeypatch.setattr(offline, "origin", lambda *_: np.array([0.0, 1.0, 0.0]))
    there = validating.draw("mirrored", 48, 27, **values).layer
    np.testing.assert_allclose(there, here, rtol=0.02, atol=0.02 * here.mean())
    lower = validating.draw("mirrored", 48, 27, **values | {"fog_base": -0.8}).layer
    assert np.abs(lower - here).mean() > 0.05 * here.mean()


@pytest.mark.slow
def test_the_fog_even_at_every_height_is_the_even_medium() -> None:
    """A ramp to 1 has density 1 everywhere, by other code."""
    values = {"shadow_size": 512, "steps": "exact"}
    even = validating.draw("mirrored", 48, 27, **values).layer
    ramp = validating.draw("mirrored", 48, 27, **values, fog="linear", fog_above=1.0, sun_extinction="none").layer
    np.testing.assert_allclose(ramp, even, rtol=2e-4, atol=2e-4 * even.mean())


def test_a_comparison_has_the_fog_that_is_drawn() -> None:
    """Its depth follows from the scene's height where it is unset."""
    one = variant("method=march,fog=exponential,shadow_size=256", {}, in_scene=True)
    view = ComparedView(open_scene("mirrored"), Shot(32, 18, samples=1))
    view.light(one)
    drawn = view.replay(one).shafts.resolved_medium.fog_depth
    assert view.resolved(one).fog_depth == drawn
    with view.set_up():
        assert drawn == 0.1 * height_of(Casters(view.device, view.stage.scene, view.lights, view.hidden).gather())
    noisy = variant("method=march,noise_amount=1,shadow_size=256", {}, in_scene=True)
    with pytest.raises(AirlightError, match="use --against tracer"):
        view.truth(view.resolved(noisy), "mitsuba")
