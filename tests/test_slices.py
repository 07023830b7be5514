"""Slices in a medium: functions of their shaders beside twins, and the picture beside the march's exact integral."""

import dataclasses
import itertools
from typing import Any

import numpy as np
import pytest
from calling import call
from test_article import camera, projection, rays
from test_slices_printed import LIGHTS, projector, shadow_of
from written import depth_texture

from airlight.gpu.device import open_device
from airlight.gpu.slices import watching
from airlight.gpu.structs import struct_dtype
from airlight.lights.directional import DirectionalLight
from airlight.lights.point import PointLight
from airlight.lights.punctual import PunctualLight
from airlight.lights.shape import Cookie
from airlight.lights.spot import SpotLight
from airlight.medium.resolve import FOGS, ResolvedMedium, resolve
from airlight.options import March, Medium
from airlight.reference import slices as twin
from airlight.scatter.march.march import March as Marching
from airlight.scatter.march.records import frame_record, light_record
from airlight.scatter.slices.records import slicing_record
from airlight.scatter.slices.slices import Slices
from airlight.shadows import Shadow

RNG = np.random.default_rng(19)
SLICES, PRINTED, AVERAGE, BLUR, EARLIER = (f"scatter/slices/{name}.wgsl" for name in ("slices", "printed", "average", "blur", "earlier"))
RAY = struct_dtype(SLICES, "Ray")
KINDS = {"directional": "DIRECTIONAL", "cone": "CONE", "bounded": "BOUNDED", "point": "CUBE"}
VIEW = camera(7)


def air(march: March | None = None, **more: Any) -> ResolvedMedium:
    values: dict[str, Any] = {"sigma_t": 0.05, "max_distance": 60.0, "anisotropy": 0.4} | more
    return resolve(Medium(**values), march or March(), "normal", 10.0)


def some_rays(count: int) -> np.ndarray:
    out = np.zeros(count, RAY)
    unit = RNG.normal(size=(count, 3))
    unit[:, 2] = -np.abs(unit[:, 2]) - 0.5
    out["direction"] = unit / np.linalg.norm(unit, axis=1, keepdims=True)
    out["origin"], out["reach"] = RNG.normal(size=(count, 3)) * 0.1, RNG.uniform(1, 50, count)
    return out


def records(kind: str, medium: ResolvedMedium | None = None) -> tuple[PunctualLight, dict[str, Any]]:
    made = {"directional": "sun", "cone": "spot", "bounded": "projector", "point": "point"}[kind]
    light, medium = LIGHTS[made](VIEW, 7), medium or air()
    bound = {
        "frame": frame_record(VIEW, projection(), medium, (19, 13), (19, 13)),
        "light": light_record(light, None, VIEW, medium),
        "slicing": slicing_record(light, None, VIEW, (np.array([-3.0, -2.0, 1.0]), np.array([4.0, 5.0, 9.0])), 10.0),
    }
    return light, bound


# ---------------------------------------------------------------- functions


@pytest.mark.parametrize("kind", KINDS)
def test_places_in_the_light(kind: str) -> None:
    light, bound = records(kind)
    places, flags = RNG.normal(size=(500, 3)) * 5, {KINDS[kind]: True}
    out = call(SLICES, "in_light", [places], bindings={"slicing": bound["slicing"]})
    np.testing.assert_allclose(out, twin.in_light(places, bound["slicing"]), atol=2e-5)
    into = np.linalg.inv(VIEW)
    world = places @ into[:3, :3].T + into[:3, 3]
    np.testing.assert_allclose(out, (world - light.origin()) @ light.axes().T, atol=5e-5)
    directional = kind == "directional"
    q = RNG.uniform(0.5, 4, (500, 3))
    at = call(SLICES, "picture_place", [q], constants=flags, bindings={"slicing": bound["slicing"]})
    np.testing.assert_allclose(at, twin.picture_place(q, bound["slicing"], directional), rtol=1e-5, atol=1e-6)
    at = call(PRINTED, "noise_place", [q], constants={} if kind == "bounded" else flags, bindings={"slicing": bound["slicing"]})
    np.testing.assert_allclose(at, twin.noise_place(q, bound["slicing"], kind == "point", directional), rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("kind", KINDS)
def test_ranges_of_rays(kind: str) -> None:
    _, bound = records(kind)
    ray = some_rays(2000)
    out = call(SLICES, "volume_range", [ray], constants={KINDS[kind]: True}, bindings={name: bound[name] for name in ("frame", "light")})
    want = twin.volume_range(ray, bound["frame"], bound["light"], kind)
    lit, expected = (np.maximum(one[..., 1] - one[..., 0], 0) for one in (out, want))
    np.testing.assert_allclose(lit, expected, rtol=2e-3, atol=2e-2)
    np.testing.assert_allclose(out[expected > 0.1], want[expected > 0.1], rtol=2e-3, atol=2e-2)
    assert (expected > 0).mean() > 0.02
    assert (out[..., 0] == 0).any() and (out[..., 0][want[..., 0] == 0] == 0).all()  # they begin at the eye
    whole = np.tile(np.array([0.5, 40.0]), (2000, 1))
    held = {"slicing": bound["slicing"]}
    found, want = call(PRINTED, "clip_to_box", [ray, whole], bindings=held), twin.clip_to_box(ray, whole, bound["slicing"])
    np.testing.assert_allclose(np.maximum(np.diff(found), 0), np.maximum(np.diff(want), 0), rtol=2e-3, atol=2e-3)
    places = RNG.normal(size=(2000, 3)) * 6
    inside = call(PRINTED, "in_volume", [places], bindings={"light": bound["light"]})
    assert (inside == twin.in_volume(places, bound["light"])).mean() > 0.999


@pytest.mark.parametrize("fog", FOGS[1:])
@pytest.mark.parametrize("fades", [False, True])
def test_a_suns_share(fog: str, fades: bool) -> None:
    _, bound = records("directional", air(fog=fog, fog_depth=2.0, fog_above=0.0))
    ray = some_rays(500)
    t = RNG.uniform(0, 30, 500)
    constants = {"DIRECTIONAL": True, "FOG": FOGS.index(fog), "FADES": fades}
    out = call(SLICES, "directional_share", [ray, t], constants=constants, bindings={name: bound[name] for name in ("frame", "light")})
    np.testing.assert_allclose(out, twin.directional_share(ray, t, bound["frame"], bound["light"], fog, fades), rtol=2e-3, atol=1e-6)


def test_small_functions() -> None:
    _, bound = records("bounded")
    d = RNG.uniform(0.1, 1000, 300)
    bound["slicing"]["printed"] = 20000.0, 3.0, 0.35
    out = call(PRINTED, "printed_falloff", [d], bindings={"slicing": bound["slicing"]})
    np.testing.assert_allclose(out, twin.printed_falloff(d, bound["slicing"]), rtol=1e-5, atol=1e-6)
    light = RNG.uniform(-0.1, 1.2, 500)
    np.testing.assert_array_equal(call(PRINTED, "codes_of", [light.astype(np.float32)]), twin.codes_of(light.astype(np.float32)))
    for count in (1, 2, 7, 16):
        k = np.arange(count, dtype=np.uint32)
        np.testing.assert_allclose(call(BLUR, "blur_place", [k, np.uint32(count)]), twin.blur_place(k, count), atol=1e-6)
    for m in range(1, 9):
        p = np.stack(np.meshgrid(np.arange(m), np.arange(m)), axis=-1).reshape(-1, 2).astype(np.uint32)
        out = call(SLICES, "plane_offset", [p, np.uint32(m)])
        np.testing.assert_allclose(out, twin.plane_offset(p, np.full(len(p), m)), atol=1e-6)
        np.testing.assert_allclose(np.sort(out), (np.arange(m * m) + 0.5) / (m * m), atol=1e-6)  # each once
        off = np.stack(np.meshgrid(*[np.arange(-(m // 2), m // 2 + 1)] * 2), axis=-1).reshape(-1, 2).astype(np.int32)
        weight = call(AVERAGE, "cell_weight", [off, np.int32(m)])
        np.testing.assert_array_equal(weight, twin.cell_weight(off, np.full(len(off), m)))
        sums = np.zeros(m * m)
        np.add.at(sums, (off % m) @ [1, m], weight)
        np.testing.assert_allclose(sums, 1)  # each place of planes is met once


@pytest.mark.parametrize("constants", [{}, {"DIRECTIONAL": True}, {"FALLS": True}])
def test_planes_lie_in_order(constants: dict[str, bool]) -> None:
    """From the least to the most, closer to each other near a lamp, and each place is found again."""
    bent = not constants
    least = RNG.uniform(0, 10, 200)
    most, count, lamp = least + RNG.uniform(0.1, 50, 200), RNG.integers(1, 200, 200).astype(float), RNG.uniform(-20, 60, 200)
    made = call(SLICES, "laid_planes", [least, most, count, lamp], constants=constants)
    want = twin.laid_planes(least, most, count, lamp, bent)
    found = np.stack([made[name] for name in ("first", "apart", "lamp", "bend")], axis=-1)
    np.testing.assert_allclose(found, want, rtol=2e-4, atol=2e-5)
    k = RNG.uniform(0, 1, 200) * count
    place = call(SLICES, "plane_place", [k, made], constants=constants)
    np.testing.assert_allclose(place, twin.plane_place(k, want, bent), rtol=2e-4, atol=2e-3)
    np.testing.assert_allclose(twin.plane_place(count, want, bent), most)
    at = call(SLICES, "plane_at", [place, made], constants=constants)
    np.testing.assert_allclose(at, twin.plane_at(place.astype(float), found.astype(float), bent), rtol=1e-3, atol=1e-3)
    np.testing.assert_allclose(twin.plane_at(twin.plane_place(k, want, bent), want, bent), k, atol=1e-6)


def test_balls_and_polygons() -> None:
    near, radius = np.abs(RNG.normal(size=(300, 2))) * 4, RNG.uniform(0.5, 6, 300)
    range = np.tile([0.5, 9.0], (300, 1))
    clipped = call(SLICES, "clip_to_ball", [near, range, radius])
    np.testing.assert_allclose(clipped, twin.clip_to_ball(near, range, radius), rtol=1e-3, atol=1e-3)
    q, along, part = RNG.normal(size=(300, 2)), RNG.normal(size=(300, 2)) + 2, RNG.uniform(-1, 1, 300)
    along[:5], part[:5] = (1.0, 1.0), 1.0  # never met
    found, want = call(EARLIER, "polygon_distance", [q, along, part]), twin.polygon_distance(q, along, part)
    assert (found[:5] == -1).all()
    np.testing.assert_allclose(found, want, rtol=2e-3, atol=1e-3)


def test_shares_of_cascades() -> None:
    _, bound = records("directional")
    light = bound["light"]
    for i, (near, far) in enumerate([(0, 5), (5, 20), (20, 3e38)]):
        light["view"][i]["near"], light["view"][i]["far"] = near, far
    light["blend"] = 0.3
    ahead = RNG.uniform(0, 40, 400)
    for i in range(3):
        out = call(SLICES, "share_of_cascade", [np.uint32(i), ahead], bindings={"light": light})
        np.testing.assert_allclose(out, twin.share_of_cascade(i, ahead, light), atol=1e-5)


# ---------------------------------------------------------------- pictures


def pictured(kind: Any, light: PunctualLight | None, medium: ResolvedMedium, size: tuple[int, int], depths: Any = None, shadow: Any = None,
             share: float = 1.0) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """(height, width, 4) the layer, and the transmittance."""
    device = open_device()
    made = kind(device, size)
    made.update(VIEW, projection(), [] if light is None else [(light, shadow)], made.resolve(medium), share=share)
    encoder = device.encoder()
    made.record(encoder, depth_texture(device, np.ones(size[::-1]) if depths is None else depths))
    device.submit(encoder)
    read = [np.frombuffer(device.read(one, 16), np.float32).reshape(size[1], size[0], 4) for one in (made.layer, made.transmittance)]
    return read[0], read[1]


def of_planes(n: int, cell: int = 1, **more: Any) -> ResolvedMedium:
    return air(March(planes=n, plane_cell=cell, **more))


def plain(kind: str) -> PunctualLight:
    one = projector(VIEW, 7)
    return {
        "sun": DirectionalLight((3.0, 2.0, 1.0), (0.3, 0.9, 0.1)),
        "spot": SpotLight((30.0, 20.0, 10.0), one.position, one.direction, inner=0.2, outer=0.4),
        "point": PointLight((30.0, 20.0, 10.0), one.position),
        "ranged": PointLight((30.0, 20.0, 10.0), one.position, range=6.0),
        "projector": dataclasses.replace(one, cookie=None),
        "cookie": one,
    }[kind]


def errors_of(
    light: PunctualLight, planes: tuple[int, ...], size: tuple[int, int], shadow: Any, cell: int = 1, trim: float = 1.0
) -> list[float]:
    """Root mean squares over the mean, against the exact walk, of this share of the values, the others being farther off."""
    true = pictured(Marching, light, air(March(steps="exact")), size, shadow=shadow)[0][..., :3]
    found = []
    for n in planes:
        out = pictured(Slices, light, of_planes(n, cell), size, shadow=shadow)[0][..., :3]
        off = np.sort(np.abs(out - true).ravel())
        found.append(float(np.sqrt(np.mean(off[: round(trim * off.size)] ** 2)) / true.mean()))
    return found


LONG = [pytest.param(one, marks=pytest.mark.slow) for one in ("spot", "point", "ranged", "projector")]


@pytest.mark.parametrize("kind", ["sun", "cookie", *LONG])
def test_planes_converge_to_the_exact_walk(kind: str) -> None:
    """Where nothing is in shadow a sample is the middle of its part, and errors fall faster; with shadows as 1 / n, on the mean."""
    light, size = plain(kind), (40, 24)
    clear = errors_of(light, (32, 64, 128, 256), size, None)
    assert all(b < max(0.5 * a, 3e-3) for a, b in itertools.pairwise(clear)), clear  # the walk has errors too
    shaded = errors_of(light, (64, 512, 4096), size, shadow_of(light, VIEW, 3, March()) if kind != "sun" else block(light))
    assert all(b < 0.3 * a for a, b in itertools.pairwise(shaded)), shaded  # 1/8 on the mean, by luck more or less


def block(light: PunctualLight, size: int = 32) -> Shadow:
    """A map with one dark square in its middle, two metres from a lamp."""
    medium = dataclasses.replace(air(), shadow_size=size)
    views = light.shadow_views(VIEW, projection(), np.linalg.inv(VIEW)[:3, 3] + RNG.uniform(-20, 20, (3, 8, 3)), medium)
    maps = np.zeros((len(views), size, size), np.float32)
    maps[:, 10:22, 10:22] = 0.98 if light.directional else views[0].depth_scale / 2
    return Shadow(depth_texture(open_device(), maps), size, views)


@pytest.mark.parametrize("kind", ["sun", "spot"])
def test_cells_are_as_many_more_planes(kind: str) -> None:
    """In a picture that hardly changes from pixel to pixel, 8 planes in cells of 4 x 4 are nearer than 32 alone."""
    light = plain(kind)
    if isinstance(light, SpotLight):  # beside the view: the light itself is a peak
        x, y, z = (np.linalg.inv(VIEW) @ [-9.0, 0.5, -9.0, 1.0])[:3]
        light = dataclasses.replace(light, position=(float(x), float(y), float(z)))
    shadow, size = block(light), (240, 144)
    eight, many = errors_of(light, (8, 32), size, shadow, trim=0.95)  # without the silhouettes of volumes, which cells blur
    (celled,) = errors_of(light, (8,), size, shadow, cell=4, trim=0.95)
    assert celled < many < eight


def test_the_average_is_its_twin() -> None:
    """Over cells of every size, with edges of depth, against the layer without it."""
    light, size = plain("projector"), (24, 14)
    depths = np.where(np.arange(24)[None, :] < 12, 1.0, 0.999) + np.zeros((14, 1))
    through = pictured(Slices, light, of_planes(9), size, depths)[1]
    for m in (3, 4):
        made = of_planes(9, m)
        device = open_device()
        one = Slices(device, size)
        one.update(VIEW, projection(), [(light, None)], made)
        encoder = device.encoder()
        one.record(encoder, depth_texture(device, depths))
        device.submit(encoder)
        before, after = (np.frombuffer(device.read(t, 16), np.float32).reshape(14, 24, 4) for t in (one.targets[1], one.layer))
        np.testing.assert_allclose(after, twin.averaged(before, m, made.march.depth_sharpness), rtol=2e-4, atol=1e-7)
    true = pictured(Marching, light if light.kind != "projector" else None, air(March(steps="exact")), size, depths)[1]
    np.testing.assert_allclose(through, true, rtol=1e-5)


def test_work_in_parts_is_the_same() -> None:
    """Where it is watched, or an interrupt may come, a light's pass is divided."""
    light, told = plain("cookie"), list[float]()
    whole = pictured(Slices, light, of_planes(8), (160, 130))[0]
    with watching(told.append):
        parts = pictured(Slices, light, of_planes(8), (160, 130))[0]
    assert np.array_equal(whole, parts) and len(told) > 3


@pytest.mark.parametrize("share", [1.0, 0.5])
def test_without_light_there_is_ambient_light_alone(share: float) -> None:
    medium = air(ambient=(0.2, 0.1, 0.05))
    for one, other in zip(*(pictured(kind, None, medium, (20, 12), share=share) for kind in (Slices, Marching)), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-4)


def test_a_white_cookie_is_none() -> None:
    light = plain("projector")
    white = dataclasses.replace(light, cookie=Cookie(np.ones((4, 5, 3))))
    one, other = (pictured(Slices, each, of_planes(16), (24, 14))[0] for each in (light, white))
    assert np.array_equal(one, other) and one[..., :3].max() > 0


def test_a_projector_is_what_small_steps_sum_up_to() -> None:
    """With its falloffs, in float64 along each ray."""
    size = (24, 14)
    origins, directions = rays(projection(), size)
    into = np.linalg.inv(VIEW)
    start, along = origins @ into[:3, :3].T + into[:3, 3], directions @ into[:3, :3].T
    medium = air()
    dt = 0.01
    t = (np.arange(round(60 / dt)) + 0.5) * dt
    for falloff in ("inverse", "constant"):
        light = dataclasses.replace(plain("projector"), falloff=falloff, ambient=0.01)  # a cookie is filtered
        want = np.zeros((size[1], size[0], 3))
        for at in np.ndindex(size[1], size[0]):
            places = start[at] + t[:, None] * along[at]
            to_light, d, factor = light.incident(places)
            keep = factor > 0
            cosine = (to_light[keep] * along[at]).sum(axis=-1)
            g = 0.4
            phase = (1 - g * g) / (4 * np.pi * (1 + g * g - 2 * g * cosine) ** 1.5)
            dim = np.exp(-0.05 * (t[keep] + d[keep]))
            want[at] = (light.colour(places[keep]) * (phase * dim * factor[keep])[:, None]).sum(axis=0) * dt
        want *= medium.sigma_s * light.intensity
        out = pictured(Slices, light, of_planes(500), size)[0][..., :3]
        assert want.max() > 0 and np.sqrt(np.mean((out - want) ** 2)) < 0.015 * want.mean()


def test_planes_lie_where_a_light_is_seen_alone() -> None:
    """Empty space before and behind its range has none: small steps along the rays find the same least and most ahead of the eye."""
    light, size, device = plain("ranged"), (24, 14), open_device()
    made = Slices(device, size)
    made.update(VIEW, projection(), [(light, None)], of_planes(8))
    encoder = device.encoder()
    made.record(encoder, depth_texture(device, np.ones(size[::-1])))
    device.submit(encoder)
    extent = np.frombuffer(device.queue.read_buffer(made.extents[0]), np.float32)[:2]
    origins, directions = rays(projection(), size)
    t = np.arange(0, 60, 0.01)[:, None, None, None]
    places = origins + t * directions
    ahead = -places[..., 2][np.linalg.norm(places - light.in_view(VIEW), axis=-1) < 6]
    np.testing.assert_allclose(extent, [ahead.min(), ahead.max()], atol=0.03)
    assert ahead.min() > 1 and ahead.max() < 30  # of 60 m
