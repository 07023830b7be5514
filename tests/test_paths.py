"""The truth of media that vary: lengths along paths, and what a sun and lamps scatter, against closed forms and small steps."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from test_density import ramp, volume
from test_tracer import look

from airlight.lights.directional import DirectionalLight
from airlight.lights.point import PointLight
from airlight.lights.punctual import PunctualLight
from airlight.lights.spot import SpotLight
from airlight.medium.field import Field
from airlight.medium.resolve import ResolvedMedium, doubt, resolve
from airlight.options import March, Medium
from airlight.reference import field, paths, tracer
from airlight.reference import medium as twin
from airlight.scatter.march.shade import fit_shade

RNG = np.random.default_rng(31)
SIGMA = (0.1, 0.2, 0.4)
NOTHING = np.zeros((0, 3, 3))
SUN = DirectionalLight((3.0, 2.0, 1.0), direction=(0.48, 0.6, -0.64))


def made(*fields: Field, **medium: Any) -> ResolvedMedium:
    return resolve(Medium(**{"sigma_t": SIGMA, "max_distance": 20.0, **medium}), March(), "final", 5.0, fields=fields)


def rough(edge: float = 0.5, shape: Any = (5, 4, 6), box: Any = ((-2, -1, -9), (2, 2, -5))) -> Any:
    return volume(RNG.uniform(0, 2, shape), edge, box)


def ways(count: int = 30) -> tuple[np.ndarray, np.ndarray]:
    return RNG.uniform([-3, -2, -11], [3, 3, -3], (count, 3)), RNG.uniform([-3, -2, -11], [3, 3, -3], (count, 3))


def in_steps(start: Any, end: Any, medium: ResolvedMedium, count: int = 5000) -> np.ndarray:
    """Density's integral by the midpoints of equal parts, of the public density."""
    share = ((np.arange(count) + 0.5) / count)[:, None]
    each = [field.density(a + share * (b - a), medium).mean() * np.linalg.norm(b - a) for a, b in zip(start, end, strict=True)]
    return np.array(each)


MEDIA = {
    "grid": lambda: made(Field(rough())),
    "tight": lambda: made(Field(rough(edge=0.0), factor=1.5)),
    "two": lambda: made(Field(rough()), Field(rough(box=((-1, 0, -10), (3, 1, -6))), "replace", 0.5)),
    "fog": lambda: made(Field(rough(), "multiply", 2), air=0.5, fog="exponential", fog_depth=1.0),
    "max": lambda: made(Field(rough(), "max"), Field(rough(), "min"), air=0.7, fog="linear", fog_depth=1.5, fog_base=-1),
    "noise": lambda: made(Field(rough()), air=0.5, noise_amount=3, noise_size=2, noise_octaves=2),
}


@pytest.mark.parametrize("kind", MEDIA)
def test_lengths_are_those_of_small_steps(kind: str) -> None:
    medium = MEDIA[kind]()
    at = RNG.uniform([-3, -2, -11], [3, 3, -3], (5000, 3))
    np.testing.assert_allclose(paths.density(at, medium), field.density(at, medium), rtol=1e-9, atol=1e-9)
    start, end = ways()
    end[:5, 0] = start[:5, 0]  # along an axis
    found, truth = paths.optical_length(start, end, medium), in_steps(start, end, medium)
    np.testing.assert_allclose(found, truth, rtol=1e-3, atol=1e-3)
    assert np.ptp(truth) > 0.5
    way, reach = end - start, np.linalg.norm(end - start, axis=1)
    along = paths.Lengths(start, way / reach[:, None], reach, medium)
    np.testing.assert_allclose(along.total, found, rtol=1e-12, atol=1e-12)
    which, share = RNG.integers(0, 30, 300), RNG.uniform(0, 1, 300)
    found = paths.optical_length(start[which], start[which] + share[:, None] * way[which], medium)
    np.testing.assert_allclose(along.to(which, share * reach[which]), found, rtol=2e-3 if kind == "max" else 1e-4, atol=1e-4)


def test_a_ramp_in_a_grid_has_its_closed_length() -> None:
    """tau = a t + b t^2 / 2, exactly."""
    start, end = RNG.uniform([-0.7, 0.3, 2.3], [2.7, 1.7, 4.7], (2, 50, 3))
    mean = 1 + ((start + end) / 2) @ [0.5, 0.25, 0.125]
    found = paths.optical_length(start, end, made(Field(ramp())))
    np.testing.assert_allclose(found, mean * np.linalg.norm(end - start, axis=1), rtol=1e-6)


def test_a_gaussian_puff_has_its_closed_length() -> None:
    """tau = rho e^(-d^2 / 2 s^2) s sqrt(pi / 2) [erf]; a grid of it is off by what its voxels are."""
    s, n, at = 0.6, 96, np.array([0.1, 0.2, -7.0])
    side = np.linspace(-3, 3, n, endpoint=False) + 3 / n
    z, y, x = np.meshgrid(side, side, side, indexing="ij")
    puff = made(Field(volume(np.exp(-(x**2 + y**2 + z**2) / (2 * s * s)), 0.5, [at - 3, at + 3]), factor=2.0))
    start, ray = at + RNG.uniform(-0.7, 0.7, (40, 3)), RNG.normal(size=(40, 3))
    ray /= np.linalg.norm(ray, axis=1)[:, None]
    near = -((start - at) * ray).sum(axis=1)
    d = np.linalg.norm(start + near[:, None] * ray - at, axis=1)
    ends = [math.erf((1.5 - t) / s / math.sqrt(2)) + math.erf(t / s / math.sqrt(2)) for t in near]
    truth = 2 * np.exp(-(d**2) / (2 * s * s)) * s * math.sqrt(math.pi / 2) * np.array(ends)
    np.testing.assert_allclose(paths.optical_length(start, start + 1.5 * ray, puff), truth, rtol=5e-3)


def test_noise_has_the_mean_length_and_panels_enough() -> None:
    medium = made(noise_amount=4, noise_size=2)
    start, end = ways(500)
    way = np.linalg.norm(end - start, axis=1)
    found = paths.optical_length(start, end, medium)
    assert abs(found.sum() / way.sum() - 1) < 4 * (found / way).std() / math.sqrt(500)
    assert (found / way).std() > 0.05
    finer = in_steps(start[:20], end[:20], medium, 2000)
    np.testing.assert_allclose(found[:20], finer, rtol=2e-3)
    assert np.sqrt(np.mean((found[:20] / finer - 1) ** 2)) < 5e-4


# ---------------------------------------------------------------- light


def camera_rays(size: tuple[int, int] = (12, 8)) -> tuple[np.ndarray, np.ndarray]:
    view, projection = look(np.array([0.0, 0.5, 0.0]))
    u, v = np.meshgrid((np.arange(size[0]) + 0.5) / size[0], (np.arange(size[1]) + 0.5) / size[1])
    origin, ray, _ = tracer.camera_rays(np.linalg.inv(view), projection, u.ravel(), v.ravel())
    return origin, ray


def traced(medium: ResolvedMedium, light: PunctualLight, size: tuple[int, int] = (12, 8), triangles: Any = NOTHING) -> Any:
    return tracer.layer(*look(np.array([0.0, 0.5, 0.0])), size, triangles, [light], medium)


def test_slabs_have_their_closed_light() -> None:
    """T = prod e^(-sigma_i l_i), L = p E albedo (1 - T) while nothing dims the sun; ambient light likewise."""
    wide = [(-50, -50), (50, 50)]
    slabs = [Field(volume(np.full((1, 1, 1), rho), 0.5, [(*wide[0], far), (*wide[1], near)])) for rho, near, far in
             ((1.5, -2, -4), (0.3, -4, -7), (2.0, -9, -10))]
    medium = made(*slabs, sun_extinction="none", ambient=(0.2, 0.1, 0.4))
    _, ray = camera_rays()
    length = (1.5 * 2 + 0.3 * 3 + 2.0 * 1) / -ray[:, 2]
    through = np.exp(-length[:, None] * np.array(SIGMA))
    there = twin.phase(ray @ np.array(SUN.direction), medium.lobes()[1:], medium.lobes()[0])[:, None]
    truth = 0.9 * (there * np.array(SUN.intensity) + np.array([0.2, 0.1, 0.4])) * (1 - through)
    found = traced(medium, SUN)
    np.testing.assert_allclose(found.radiance.reshape(-1, 3), truth, rtol=1e-7)
    np.testing.assert_allclose(found.transmittance.reshape(-1, 3), through, rtol=1e-7)


def test_a_stratified_grid_has_the_closed_light_of_a_sun_through_it() -> None:
    """L = albedo p E e^(-tau_v(a) - tau_L(a)) tau_v phi((1 - m / s) tau_v), of density that falls with height to 0."""
    high, side = 3.0, 60.0
    n = 33
    y = np.linspace(0, high, n)
    values = np.broadcast_to((0.8 * (1 - y / high))[None, :, None], (2, n, 2))
    step = high / (n - 1)
    own = Field(volume(values, 0.0, [(-side, -step / 2, -side), (side, high + step / 2, side)]))
    medium = made(own, max_distance=3.0)
    assert medium.sun_extinction == "all"
    origin, ray = camera_rays()
    s = SUN.direction[1]

    def column(y: np.ndarray) -> np.ndarray:
        return 0.4 * high * np.clip(1 - y / high, 0, 1) ** 2

    start, end = origin[:, 1], origin[:, 1] + 3 * ray[:, 1]
    climb = ray[:, 1]
    some = (end > 0.02) & (np.abs(climb) > 1e-3)
    tau = (column(start) - column(end))[:, None] / climb[:, None] * np.array(SIGMA)
    first = column(start)[:, None] / s * np.array(SIGMA)
    x = (1 - climb / s)[:, None] * tau
    there = twin.phase(ray @ np.array(SUN.direction), medium.lobes()[1:], medium.lobes()[0])[:, None]
    truth = 0.9 * there * np.array(SUN.intensity) * np.exp(-first) * tau * -np.expm1(-x) / x
    found = traced(medium, SUN).radiance.reshape(-1, 3)
    np.testing.assert_allclose(found[some], truth[some], rtol=1e-5)
    assert some.sum() > 60


LIGHTS = {
    "sun": SUN,
    "point": PointLight((20.0, 30.0, 40.0), (0.6, 1.4, -6.0)),
    "spot": SpotLight((20.0, 30.0, 40.0), (1.4, 3.0, -5.0), (-0.36, -0.8, -0.48), inner=0.3, outer=0.6),
}


def light_in_steps(origin: Any, ray: Any, light: PunctualLight, medium: ResolvedMedium, reach: float, count: int = 300) -> np.ndarray:
    """What each ray scatters, by the midpoints of equal parts, and the light's own way by those of others."""
    found, t = [], (np.arange(count) + 0.5) * reach / count
    for o, r in zip(origin, ray, strict=True):
        points = o + t[:, None] * r
        rho = field.density(points, medium)
        length = (np.cumsum(rho) - rho / 2) * reach / count
        to_light, away, irradiance = light.incident(points)
        ends = points + 12 * to_light if light.directional else points + to_light * away[:, None]
        own = medium if not light.directional or medium.sun_extinction == "all" else replace(medium, air=0.0)
        length = length + in_steps(points, ends, own, 200)
        cosine = (to_light * r).sum(axis=1)
        value = rho * tracer.phase(cosine, medium, light) * irradiance
        found.append((value[:, None] * np.exp(-length[:, None] * medium.sigma_t)).sum(axis=0) * reach / count)
    return np.array(found) * medium.sigma_s * light.intensity


@pytest.mark.parametrize("kind", LIGHTS)
@pytest.mark.parametrize("air", [0.0, 0.3])
def test_light_is_what_small_steps_sum_up_to(kind: str, air: float) -> None:
    smooth = volume(RNG.uniform(0.2, 2, (4, 3, 4)), 0.0, ((-2, -1, -9), (2, 2, -5)))
    medium = made(Field(smooth), air=air, max_distance=11.0)
    origin = np.zeros((6, 3))
    ray = RNG.uniform([-1.2, -0.5, -8], [1.2, 1.5, -6], (6, 3))
    ray /= np.linalg.norm(ray, axis=1)[:, None]
    reach = np.full(6, 11.0)
    along = paths.Lengths(origin, ray, reach, medium)
    found = tracer.in_scattered(origin, ray, np.arange(6), 0 * reach, reach, LIGHTS[kind], medium, along)
    truth = light_in_steps(origin, ray, LIGHTS[kind], medium, 11.0)
    assert truth.min() >= 0 and truth.mean() > 0.01
    np.testing.assert_allclose(found, truth, rtol=0.01, atol=0.005 * truth.mean())


@pytest.mark.parametrize("kind", LIGHTS)
def test_a_light_may_have_a_medium_of_its_own(kind: str) -> None:
    """Twice as dense, half of that extinction: as in a medium of such coefficients."""
    own, light = Field(rough()), LIGHTS[kind]
    found = traced(made(own, air=0.3), replace(light, density=2.0, extinction=0.5)).radiance
    twice = replace(made(own, air=0.3), sigma_s=2 * 0.9 * np.array(SIGMA))
    np.testing.assert_allclose(found, traced(twice, light).radiance, rtol=1e-9)
    assert np.abs(found - traced(made(own, air=0.3), light).radiance).max() > 0.1 * found.max()


def test_what_dims_a_sun_can_be_chosen() -> None:
    own = Field(rough())
    found = {how: traced(made(own, air=0.5, fog="exponential", fog_depth=2.0, sun_extinction=how), SUN).radiance.mean()
             for how in ("none", "volumes", "all")}
    assert found["none"] > 1.02 * found["volumes"] > 1.02**2 * found["all"]
    at = RNG.uniform([-2, -1, -9], [2, 2, -5], (50, 3))
    towards = np.array(SUN.direction)
    without = paths.sun_length(at, towards, made(own, air=0.5, fog="linear", fog_above=0.4, fog_depth=2.0, sun_extinction="all"))
    full = paths.optical_length(at, at + 100 * towards, made(own, air=0.5, fog="linear", fog_above=0.4, fog_depth=2.0))
    np.testing.assert_allclose(without, full - 100 * 0.5 * 0.4, rtol=1e-4)
    np.testing.assert_array_equal(paths.sun_length(at, towards, made(air=0.5)), 0)
    volumes = paths.sun_length(at, towards, made(own, air=0.5, sun_extinction="volumes"))
    np.testing.assert_allclose(volumes, paths.optical_length(at, at + 20 * towards, made(own)), rtol=1e-9)


def test_fog_of_no_air_is_told() -> None:
    """Beside fields the air is empty unless it is said to be; told where it is unset and something is asked of it."""
    own = Field(rough())
    for asked in ({"fog": "linear"}, {"noise_amount": 1.0}):
        assert "air = 1" in (doubt(made(own, **asked), 5.0, 5.0) or "")
        said = (made(own, **asked, air=0.0), made(own, **asked, air=0.5), made(**asked))
        assert [doubt(one, 5.0, 5.0) for one in said] == [None] * 3
    assert doubt(made(own, wind=(1, 0, 0)), 5.0, 5.0) is None


def test_noise_in_air_without_an_end_dims_no_sun() -> None:
    """As the air itself: in the truth and in the march's table alike, with and without what lies in it."""
    noisy, own = {"air": 0.5, "noise_amount": 3.0, "sun_extinction": "all"}, Field(rough())
    at, towards, box = RNG.uniform([-2, -1, -9], [2, 2, -5], (50, 3)), np.array(SUN.direction), np.array([[-9.0] * 3, [9.0] * 3])
    np.testing.assert_array_equal(paths.sun_length(at, towards, made(**noisy)), 0)
    assert fit_shade(SUN, made(**noisy), box) is None and fit_shade(SUN, made(**noisy, fog="linear"), box) is not None
    alone = paths.sun_length(at, towards, made(own, air=0.5, sun_extinction="volumes"))
    np.testing.assert_array_equal(paths.sun_length(at, towards, made(own, **noisy)), alone)
    shade = fit_shade(SUN, made(own, **noisy), box)
    assert alone.max() > 0 and shade is not None and shade.alone


def test_a_drawing_near_an_origin_has_the_same_light() -> None:
    medium = made(Field(rough()), air=0.4, noise_amount=1, fog="exponential", fog_depth=2.0)
    far = np.array([1000.0, -50.0, 300.0])
    moved = [Field(replace(f.volume, matrix=np.block([[f.volume.matrix[:3, :3], f.volume.matrix[:3, 3:] + far[:, None]],
                                                      [np.zeros((1, 3)), np.ones((1, 1))]]))) for f in medium.fields]
    start, end = ways(20)
    here = paths.optical_length(start, end, made(*medium.fields, air=0.4, fog="exponential", fog_depth=2.0))
    there = made(*moved, air=0.4, fog="exponential", fog_depth=2.0, fog_base=-50.0).seen_from(far)
    np.testing.assert_allclose(paths.optical_length(start, end, there), here, rtol=1e-9)


def test_what_varies_costs_the_tracer() -> None:
    """Even air nothing; noise by the square of its panels; a volume and noise more than each alone; a volume of no air less."""
    grid = Field(rough(shape=(80, 144, 80)))
    noise = {"noise_amount": 3.0, "noise_size": 1.0, "air": 0.1}
    assert paths.cost(made(), 10.0) == 0
    assert paths.cost(made(**noise), 20.0) == pytest.approx(4 * paths.cost(made(**noise), 10.0))
    in_air, alone, both = (paths.cost(made(grid, **more), 10.0) for more in ({"air": 0.1}, {}, noise))
    assert 1e3 < alone < in_air and both > in_air + paths.cost(made(**noise), 10.0) > 5e4
