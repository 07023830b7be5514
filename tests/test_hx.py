"""Settings that a medium has from Hx Volumetric Lighting: their shader functions against float64 twins, and what they do to a layer."""

import dataclasses
import re
from typing import Any

import numpy as np
import pytest
import test_march
from calling import call
from documented import DOCS
from test_march import CASES, SIZE, air, brute, depths, heights_for, layer, projection, rays

from airlight.errors import AirlightError
from airlight.gpu.device import open_device
from airlight.gpu.structs import struct_dtype
from airlight.gpu.timing import compute, run_ms
from airlight.jobs.light_text import PLACE, SUN, read_light, read_scene_light
from airlight.lights.punctual import PunctualLight
from airlight.medium.resolve import resolve
from airlight.options import March as MarchOptions
from airlight.options import Medium, build, declared, presets
from airlight.reference import march as march_twin
from airlight.reference import medium as medium_twin
from airlight.reference import paths, soften, tracer, variance
from airlight.reference import scene as scene_twin
from airlight.scatter.march.march import March
from airlight.scatter.march.variance import Moments
from airlight.shadows import Shadow

RNG = np.random.default_rng(19)
COUNT = 300
STEPS = "scatter/march/steps.wgsl"
SOFTEN = "scatter/march/soften.wgsl"
FRAME, LIGHT = (struct_dtype(STEPS, name) for name in ("Frame", "Light"))
NODES, WEIGHTS = np.polynomial.legendre.leggauss(400)


def unit(count: int = COUNT) -> np.ndarray:
    v = RNG.normal(size=(count, 3))
    return np.asarray(v / np.linalg.norm(v, axis=1, keepdims=True), np.float32)


def between(low: float, high: float, *shape: int) -> np.ndarray:
    return RNG.uniform(low, high, (COUNT, *shape)).astype(np.float32)


def close(found: Any, truth: Any, rtol: float = 2e-5, atol: float = 1e-6) -> None:
    assert np.shape(found) == np.shape(truth) and np.ptp(truth) > 0
    np.testing.assert_allclose(found, truth, rtol=rtol, atol=atol)


def cast(kind: str, count: int = 48) -> tuple[PunctualLight, Shadow]:
    """A light of CASES, and its shadow map, half of whose texels hold something."""
    lamp, made = CASES[kind]
    views = made()
    return lamp, Shadow(depths(heights_for(kind, len(views))), count, views)


# ---------------------------------------------------------------- the glow around a sun


@pytest.mark.parametrize("size", [0.5, 5.0, 40.0, 90.0])
def test_a_glow_is_normalised_and_half_as_bright_at_its_size(size: float) -> None:
    kappa = air(sun_glow_size=size).glow_concentration
    low = 1 - min(40 / kappa, 2.0)  # beyond, nothing is left
    cosine = low + (1 - low) * (NODES + 1) / 2
    ahead, ways = np.array([0.0, 0.0, 1.0]), np.stack([np.sqrt(1 - cosine**2), 0 * cosine, cosine], axis=-1)
    total = 2 * np.pi * (1 - low) / 2 * (WEIGHTS @ medium_twin.glow_between(ahead, ways, kappa))
    assert total == pytest.approx(1, abs=1e-9)
    turned = np.array([np.sin(np.radians(size)), 0.0, np.cos(np.radians(size))])
    assert medium_twin.glow_between(ahead, turned, kappa) == pytest.approx(medium_twin.glow_between(ahead, ahead, kappa) / 2)


def test_a_glow_in_the_shader() -> None:
    a, b, kappa = unit(), unit(), between(0.5, 3000)
    b[::2] = (a + 0.05 * b)[::2] / np.linalg.norm(a + 0.05 * b, axis=1)[::2, None]
    close(call("medium/phase.wgsl", "glow_between", [a, b, kappa]), medium_twin.glow_between(a, b, kappa), rtol=2e-3)
    frame, light = np.zeros((), FRAME), np.zeros((), LIGHT)
    frame["sigma_s"], frame["sun_glow"], frame["glow_concentration"] = (0.1, 0.2, 0.3), 0.4, 20.0
    light["intensity"], light["position"], light["lobes"] = (3, 2, 1), unit(1)[0], (0.5, -0.3, 0.25)
    ray = np.zeros(COUNT, struct_dtype(STEPS, "Ray"))
    ray["direction"] = a
    found = call(STEPS, "in_scatter_directional", [ray], bindings={"frame": frame, "light": light})
    close(found, march_twin.in_scatter_directional(a, frame, light, 0), rtol=1e-4)


@pytest.mark.parametrize("steps", ["exact", 64])
def test_a_glow_lies_around_the_sun_in_a_layer(steps: Any) -> None:
    lamp, _ = CASES["sun"]
    lamp = dataclasses.replace(lamp, direction=(0.0, 0.0, -1.0))
    plain, glowing = (layer([(lamp, None)], air(steps=steps, **more))[..., :3] for more in ({}, {"sun_glow": 0.5, "sun_glow_size": 4.0}))
    assert glowing[8, 12].min() > 2 * plain[8, 12].max() and np.allclose(glowing[0, 0], 0.5 * plain[0, 0], rtol=0.02)
    close(glowing, brute(lamp, air(sun_glow=0.5, sun_glow_size=4.0), [], []), rtol=1e-3)


# ---------------------------------------------------------------- how far suns light, and in how many steps


@pytest.mark.parametrize("steps", ["exact", 64])
def test_suns_light_as_far_as_they_are_asked_to(steps: Any) -> None:
    """A medium that ends there has the same light, but another transmittance and ambient light."""
    pair = [cast("sun")]
    found = layer(pair, air(steps=steps, sun_distance=7.0))
    ended = layer(pair, air(steps=steps, max_distance=7.0))
    np.testing.assert_allclose(found[..., :3], ended[..., :3], rtol=2e-5, atol=1e-7)
    assert (found[..., 3] == 20).all() and found[..., :3].mean() < 0.8 * layer(pair, air(steps=steps))[..., :3].mean()
    assert np.array_equal(layer(pair, air(steps=steps, sun_distance=1e6)), layer(pair, air(steps=steps)))
    lamp = [cast("spot")]
    assert np.array_equal(layer(lamp, air(steps=steps, sun_distance=7.0)), layer(lamp, air(steps=steps)))


def test_maps_of_suns_hold_no_more_than_they_light() -> None:
    lamp, hulls = CASES["sun"][0], np.random.default_rng(2).uniform(-200, 200, (40, 8, 3))
    for medium in (air(radius=300.0), air(radius=300.0, sun_distance=20.0)):
        (near, *_) = lamp.shadow_views(np.eye(4), projection(), hulls, medium)
        size = near.texel * medium.shadow_size
        assert (size < 120) == (medium.sun_reach == 20), size


def test_suns_have_steps_of_their_own() -> None:
    sun, lamp = cast("sun"), cast("spot")
    own = air(steps=64, sun_steps=7)
    assert np.array_equal(layer([sun], own), layer([sun], air(steps=7)))
    assert np.array_equal(layer([lamp], own), layer([lamp], air(steps=64)))
    assert not np.array_equal(layer([sun], own), layer([sun], air(steps=64)))
    assert np.array_equal(layer([sun], air(steps="exact", sun_steps=7)), layer([sun], air(steps="exact")))


def test_lamps_too_far_away_cost_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    passes: list[str] = []
    monkeypatch.setattr("airlight.scatter.march.march.compute", lambda *what: (passes.append(what[4]), compute(*what)))
    pairs, far = [cast("spot"), cast("sun")], air(ambient=(0.1, 0.1, 0.1), lamp_distance=1.0)
    found = layer(pairs, far)
    assert "march sun" in passes and "march spot" not in passes
    assert np.array_equal(found, layer(pairs[1:], far)) and not np.array_equal(found, layer(pairs, air(ambient=(0.1, 0.1, 0.1))))


# ---------------------------------------------------------------- a share of the dimming


def test_a_share_of_the_dimming_in_the_shader() -> None:
    transmittance, share = between(0, 1, 3), between(0, 1)
    found = call("composite/medium.wgsl", "share_of_dimming", [transmittance, share])
    close(found, [scene_twin.share_of_dimming(t, s) for t, s in zip(transmittance, share, strict=True)])
    assert np.array_equal(call("composite/medium.wgsl", "share_of_dimming", [transmittance, 1.0]), transmittance)
    assert (call("composite/medium.wgsl", "share_of_dimming", [transmittance, 0.0]) == 1).all()


def test_a_medium_that_leaves_surfaces_a_share_hides_nothing() -> None:
    assert [air(extinction_share=s).least_seen for s in (1.0, 0.7, 0.0)] == pytest.approx([0, 0.3, 1])
    assert air(extinction=False).least_seen == 1


# ---------------------------------------------------------------- softening, and the upsampling's guide


@pytest.mark.parametrize("kernel", ["gaussian", "box"])
def test_a_neighbours_weight_in_the_shader(kernel: str) -> None:
    away, off, sharpness = between(-3, 3), between(0, 2), between(0, 40)
    found = call(SOFTEN, "soften_weight", [away, off, sharpness], constants={"GAUSSIAN": kernel == "gaussian"})
    close(found, soften.soften_weight(away, off, sharpness, kernel))
    a, b = between(0, 9), between(0, 9)
    close(call(SOFTEN, "relative_difference", [a, b]), march_twin.relative_difference(a.astype(float), b.astype(float)))


def marched(medium: Any, held: np.ndarray, share: float = 1.0, pixels: tuple[int, int] = SIZE) -> tuple[np.ndarray, np.ndarray]:
    """A march's layer, and what it was marched as, before a picture's depth `held`."""
    device, march = open_device(), March(open_device(), pixels)
    march.update(np.eye(4), projection(), [cast("sun")], medium, jitter="blue", share=share)
    seen = depths(held)
    run_ms(device, lambda encoder: march.record(encoder, seen))
    both = (march.layer, pixels), (march.marched_layers[0], march.size)
    found, small = (np.frombuffer(device.read(t, 16), np.float32).reshape(size[1], size[0], 4) for t, size in both)
    return found, small


@pytest.mark.parametrize(("passes", "kernel", "share"), [(1, "gaussian", 1.0), (3, "box", 1.0), (2, "gaussian", 0.5)])
def test_a_softened_layer_is_its_twins(passes: int, kernel: str, share: float) -> None:
    held = np.where(np.arange(SIZE[0]) < 11, 0.98, 1.0) * np.ones(SIZE[::-1])
    plain = marched(air(steps=16), held, share)[1]
    found = marched(air(steps=16, soften=passes, soften_kernel=kernel), held, share)[1]
    close(found, soften.softened(plain, passes, kernel), rtol=1e-4)
    assert np.array_equal(found[..., 3], plain[..., 3])
    rough = [np.abs(np.diff(x[..., :3], axis=1)).mean() for x in (plain, found)]
    assert rough[1] < 0.8 * rough[0] and found[..., :3].mean() == pytest.approx(plain[..., :3].mean(), rel=0.05)


def test_softening_passes_no_edge_of_depth() -> None:
    """Light behind an edge of depth does not come before it."""
    image = np.zeros((12, 12, 4))
    image[:, :6], image[:, 6:] = (1, 1, 1, 2), (5, 5, 5, 20)
    for sharpness, most in ((24.0, 1e-6), (0.0, 2.1)):
        found = soften.softened(image, 4, "box", sharpness)
        assert 0 <= found[:, :6, 0].max() - 1 <= most
    assert found[:, :6, 0].max() > 2


def test_the_upsampling_has_a_guide_of_the_users_own() -> None:
    rng, values = np.random.default_rng(5), {"depth_sharpness": 2.0, "depth_threshold": 1.5}
    held = np.kron(rng.choice([0.9, 0.97, 0.99, 1.0], (8, 8)), np.ones((6, 6)))[:23, :37]
    found, small = marched(air(steps=16, **values), held, 0.25, (37, 23))
    reach = found[..., 3].astype(float)
    np.testing.assert_allclose(found[..., :3], march_twin.upsampled(small, reach, test_march.RGB, 2.0, 1.5), rtol=1e-3, atol=1e-5)
    default = marched(air(steps=16), held, 0.25, (37, 23))[0]
    assert np.abs(default - found)[..., :3].max() > 0.05 * found[..., :3].mean()


# ---------------------------------------------------------------- variance shadow maps


@pytest.mark.parametrize("directional", [True, False])
def test_variance_in_the_shader(directional: bool) -> None:
    own: Any = {"constants": {"DIRECTIONAL": directional}}
    depth, bias = between(0, 1), between(0, 0.3)
    found = call(STEPS, "biased_receiver_depth", [depth, bias], **own)
    close(found, variance.biased_receiver_depth(depth, bias.astype(float), directional))
    # the bias moves the receiver as it would have moved what hides it
    occluder = between(0.01, 1)
    moved = march_twin.biased_occluder_depth(occluder, bias.astype(float), directional)
    same = (depth >= moved) == (variance.biased_receiver_depth(depth, bias.astype(float), directional) >= occluder)
    assert same.all()
    a, b, part, cut = between(0, 1, 2), between(0, 1, 2), between(0, 1), between(0, 0.9)
    close(call(STEPS, "mix_moments", [a, b, part]), variance.mix_moments(a, b, part), rtol=1e-5)
    close(call(STEPS, "chebyshev_bound", [a, depth]), variance.chebyshev_bound(a, depth.astype(float)), rtol=1e-4)
    close(call(STEPS, "cut_leaks", [depth, cut]), variance.cut_leaks(depth, cut), rtol=1e-4)


def test_chebyshevs_bound_is_one() -> None:
    """Of any distribution, no smaller share is at or behind a receiver; of two depths, at the nearer, just that."""
    held = RNG.random((200, 9)) ** RNG.uniform(0.3, 4, (200, 1))
    moments = np.stack([held.mean(axis=1), held.var(axis=1)], axis=-1)
    for depth in np.linspace(0, 1, 11):
        assert (variance.chebyshev_bound(moments, depth) >= (held <= depth).mean(axis=1) - 1e-12).all()
    for share in (0.1, 0.5, 0.9):
        mixed = variance.mix_moments([0.2, 0.0], [0.8, 0.0], 1 - share)
        assert variance.chebyshev_bound(mixed, 0.2) == pytest.approx(share)


@pytest.mark.parametrize(("size", "radius"), [(48, 3), (33, 8), (16, 0)])
def test_moments_are_those_of_the_texels_around(size: int, radius: int) -> None:
    device = open_device()
    held = np.random.default_rng(size).random((2, size, size)).astype(np.float32)
    held[1] = 0.7 + 1e-4 * held[1]  # whose variance has few digits as a difference of squares
    moments = Moments(device)
    moments.fit([depths(held)])
    run_ms(device, lambda encoder: moments.record(encoder, radius, [None]))
    texture = moments.views[0].texture
    layout = {"bytes_per_row": 8 * size, "rows_per_image": size}
    data = device.queue.read_texture({"texture": texture}, layout, (size, size, 2))
    found = np.frombuffer(data, np.float32).reshape(2, size, size, 2)
    truth = np.stack([variance.averaged_moments(layer, radius) for layer in held])
    np.testing.assert_allclose(found[..., 0], truth[..., 0], rtol=1e-6)
    np.testing.assert_allclose(found[..., 1], truth[..., 1], rtol=2e-3, atol=1e-13)


def test_moments_of_maps_that_are_kept_are_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    recorded: list[Any] = []
    monkeypatch.setattr("airlight.scatter.march.variance.compute", lambda *what: recorded.append(what))
    moments, texture = Moments(open_device()), depths(np.ones((1, 16, 16)))
    for count, (radius, drawn) in zip((2, 0, 2, 2, 2), [(2, "a"), (2, "a"), (3, "a"), (3, "b"), (3, None)], strict=True):
        recorded.clear()
        moments.fit([texture])
        moments.record(None, radius, [drawn])
        assert len(recorded) == count


def seen_by_variance(views: Any, heights: np.ndarray, points: np.ndarray, radius: int, cut: float) -> np.ndarray:
    """(...) 0..1 of points (..., 3) of the light that one view lets through."""
    at = points @ views[0].matrix[:, :3].T + views[0].matrix[:, 3]
    moments, side = variance.averaged_moments(heights[0], radius), heights.shape[1]
    x, y, depth = (at[..., k] / at[..., 3] for k in range(3))
    inside, base = (x >= 0) & (x <= side) & (y >= 0) & (y <= side), (np.floor(x - 0.5), np.floor(y - 0.5))

    def held(i: int, j: int) -> np.ndarray:
        return np.asarray(moments[tuple(np.clip(v, 0, side - 1).astype(int) for v in (base[1] + j, base[0] + i))])

    u, v = x - 0.5 - base[0], y - 0.5 - base[1]
    rows = [variance.mix_moments(held(0, j), held(1, j), u) for j in (0, 1)]
    bound = variance.chebyshev_bound(variance.mix_moments(*rows, v), np.maximum(depth, 0))
    return np.where(inside & (at[..., 3] > 0), variance.cut_leaks(bound, cut), 1.0)


@pytest.mark.parametrize("kind", ["sun", "spot"])
def test_variance_shadow_maps_in_a_march(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    lamp, made = CASES[kind]
    heights = np.kron(heights_for(kind, 1)[:, :12, :12], np.ones((4, 4), np.float32))
    pair = [(lamp, Shadow(depths(heights), 48, made()))]
    monkeypatch.setattr(test_march, "lit", lambda views, held, points, pcf: seen_by_variance(views, held, points, 2, 0.3))
    medium = air(steps=2000, shadow_filter="variance", variance_radius=2, variance_cut=0.3)
    truth = brute(lamp, medium, made(), heights, 6000)
    found = layer(pair, medium)[..., :3]
    assert np.sqrt(np.mean((found - truth) ** 2)) < 6e-3 * truth.mean()
    plain = layer(pair, air(steps=600))[..., :3]
    rough = [np.abs(np.diff(x, axis=1)).mean() / x.mean() for x in (found, plain)]
    assert rough[0] < 0.95 * rough[1]
    leaking, cut = (layer(pair, air(steps=600, shadow_filter="variance", variance_radius=2, variance_cut=v))[..., :3] for v in (0, 0.6))
    assert cut.mean() < found.mean() < leaking.mean() > 1.1 * plain.mean()
    assert np.array_equal(layer(pair, air(shadow_filter="variance")), layer(pair, air()))  # exact takes nearest


@pytest.mark.parametrize("kind", CASES)
def test_variance_of_a_map_without_casters_is_no_shadow(kind: str) -> None:
    lamp, made = CASES[kind]
    views = made()
    open_air = layer([(lamp, None)], air(steps=200))[..., :3]
    found = layer([(lamp, Shadow(depths(np.zeros((len(views), 48, 48))), 48, views))], air(steps=200, shadow_filter="variance"))[..., :3]
    assert np.abs(found - open_air).max() < 0.02 * open_air.max()


# ---------------------------------------------------------------- a density and extinction of a light's own


@pytest.mark.parametrize("steps", ["exact", 64])
@pytest.mark.parametrize("kind", CASES)
def test_a_light_has_a_medium_of_its_own(kind: str, steps: Any) -> None:
    lamp, shadow = cast(kind)
    own = dataclasses.replace(lamp, density=2.0, extinction=0.25)
    medium = air(steps=steps)
    scaled = dataclasses.replace(medium, sigma_t=medium.sigma_t / 2, sigma_s=2 * medium.sigma_s)
    np.testing.assert_allclose(layer([(own, shadow)], medium)[..., :3], layer([(lamp, shadow)], scaled)[..., :3], rtol=1e-6)


@pytest.mark.slow
def test_lights_with_and_without_their_own_add_up_with_ambient_light_once() -> None:
    sun, spot = cast("sun"), cast("spot")
    own = [(dataclasses.replace(lamp, density=3.0, extinction=0.5), shadow) for lamp, shadow in (sun, spot)]
    glow, march = air(ambient=(0.3, 0.2, 0.1)), March(open_device(), SIZE)
    alone = layer([], glow)[..., :3]
    for pairs in ([own[0], spot], [sun, own[1]], own, [own[0]], [], [sun, spot]):
        found = layer(pairs, glow, march=march)[..., :3]
        np.testing.assert_allclose(found, sum((layer([pair], air())[..., :3] for pair in pairs), alone), rtol=1e-5)


def test_the_tracer_knows_them() -> None:
    view, size, medium = np.eye(4), (8, 6), air(sun_glow=0.3, sun_glow_size=20.0, sun_distance=6.0, ambient=(0.1, 0.1, 0.1))
    lamps = [dataclasses.replace(CASES[kind][0], density=1.5, extinction=0.7) for kind in ("sun", "spot")]
    truth = tracer.layer(view, projection(), size, np.zeros((0, 3, 3)), lamps, medium).radiance
    ends = {"sun": 6.0, "spot": 20.0}
    found = medium.sigma_s * medium.ambient * medium_twin.transmittance_integral(20.0, medium.sigma_t)
    for kind, lamp in zip(ends, lamps, strict=True):
        start, line = rays(size=size)
        t = (np.arange(20000) + 0.5) / 20000 * ends[kind]
        for y, x in np.ndindex(*size[::-1]):
            points = start[y, x] + line[y, x] * t[:, None]
            part = medium_twin.in_scattered(lamp, medium, line[y, x], points, t).sum(axis=0) * ends[kind] / 20000
            found = found + np.where((np.arange(6)[:, None, None] == y) & (np.arange(8)[:, None] == x), part, 0.0)
    np.testing.assert_allclose(truth, found, rtol=2e-4)


def test_lights_are_written_with_them() -> None:
    light = read_scene_light("1,2,3;density=2;extinction=0.5", PLACE)
    assert (light.density, light.extinction) == (2.0, 0.5)
    assert read_scene_light("90,20;density=3", SUN).density == 3.0 and read_scene_light("Lamp;extinction=0", PLACE).extinction == 0
    for text, form, says in (
        ("1,2,3;density=-1", PLACE, "density=-1 of the light '1,2,3;density=-1' is beyond 0 to 1e6"),
        ("90,20;extinction=nan", SUN, "extinction=nan"),
        ("90,20;extinction=x", SUN, "write numbers"),
        ("90,20;densty=2", SUN, "did you mean 'density'"),
    ):
        with pytest.raises(AirlightError, match=says.replace("(", r"\(")):
            read_scene_light(text, form)
    with pytest.raises(AirlightError, match="density=2"):
        read_light("0.5,0.5;density=2")


# ---------------------------------------------------------------- its page, its preset


def test_each_option_that_is_from_hx_is_on_its_page() -> None:
    text = DOCS.joinpath("hx.md").read_text(encoding="utf-8")
    named = set(re.findall(r"`(\w+)`", text))
    own = {one.name for one in declared(scenes=True) if "Hx Volumetric Lighting" in one.source}
    assert len(own) > 10 and own - named == set()
    assert set(presets.load("hx")) - named <= {"method"}


def test_the_preset_is_what_hx_begins_with() -> None:
    built = build(presets.load("hx"))
    medium = resolve(built[Medium], built[MarchOptions], "normal", 90.0)
    assert (medium.steps, medium.sun_steps, medium.sun_reach, medium.least_seen) == (16, 32, 128.0, 1.0)
    # of linear fog with a height of 5, a transition of 5 and a tenth above it
    assert [paths.density(np.array([0.0, y, 0.0]), medium) for y in (-1, 0, 2.5, 5, 9)] == pytest.approx([1, 1, 0.55, 0.1, 0.1])
