"""Daylight of scenes: the air before a picture against the library, with shadows; sun and sky of a stage; what a user writes."""

import math
import warnings
from typing import Any

import numpy as np
import pygfx as gfx
import pytest

from airlight.daylight import Atmosphere
from airlight.errors import AirlightError, AirlightWarning
from airlight.gpu.device import Device, shared_device
from airlight.jobs.sun_of_scene import SunRequest, check_view, put_daylight, scene_daylight, sun_up, with_daylight
from airlight.lights.directional import DirectionalLight
from airlight.medium.resolve import resolve
from airlight.options import Daylight as DaylightOptions
from airlight.options import DaylightScene, March, Medium
from airlight.pygfx import SceneLight
from airlight.scatter.march.daylight import AirLayer, Sun
from airlight.scenes.daylight import LOWEST, Daylight, Sky, sun_direction
from airlight.scenes.exposure import expose
from airlight.scenes.stage import Stage
from airlight.shadows import Shadow

SIZE = 48, 27
RADIUS = 200.0  # m, of what casts
AIR = Atmosphere(visibility=12, multiple="none")  # whose suns need no solving
AZIMUTH, ELEVATION, EYE, UNIT = 35.0, 24.0, 8.0, 3.0  # of the sun; m; irradiance above the air
AWAY = 1500.0  # m along the view's axis, of what is drawn in half of the picture


@pytest.fixture(scope="module")
def device() -> Device:
    return shared_device()


def camera() -> gfx.PerspectiveCamera:
    made = gfx.PerspectiveCamera(60, SIZE[0] / SIZE[1], depth_range=(0.5, 1e5))
    made.local.position = (0, EYE - 2, 0)
    made.look_at((10, EYE + 5, -100))
    return made


def filled(device: Device, depth: float, size: tuple[int, int, int]) -> Any:
    """Make a depth texture that holds one value."""
    usage = device.wgpu.TextureUsage
    texture = device.device.create_texture(size=size, format="depth32float", usage=usage.TEXTURE_BINDING | usage.RENDER_ATTACHMENT)
    encoder = device.device.create_command_encoder()
    view = texture.create_view(dimension="2d", base_array_layer=0, array_layer_count=1)
    held = {"view": view, "depth_clear_value": depth, "depth_load_op": "clear", "depth_store_op": "store"}
    encoder.begin_render_pass(color_attachments=[], depth_stencil_attachment=held).end()
    device.queue.submit([encoder.finish()])
    return texture


def read(device: Device, texture: Any) -> np.ndarray:
    return np.frombuffer(device.read(texture, 16), np.float32).reshape(SIZE[1], SIZE[0], 4)


def air_layer(device: Device, held: float | None, drawn: bool, exact: bool = True) -> tuple[np.ndarray, np.ndarray, Any]:
    """Evaluate the air's layer of a picture in which all lies AWAY, or is sky, and the views of the sun's map, which holds one depth."""
    eye = camera()
    medium = resolve(Medium(max_distance=2000.0), March(cascades=1, shadow_size=64), "final" if exact else "normal", RADIUS)
    light = DirectionalLight((1.0, 1.0, 1.0), tuple(sun_direction(AZIMUTH, ELEVATION)))
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (0, 0.4) for z in (-1, 1)]) * RADIUS
    views = light.shadow_views(eye.view_matrix, eye.projection_matrix, corners[None], medium)
    shadow = None if held is None else Shadow(filled(device, held, (64, 64, 1)), 64, views)
    p = eye.projection_matrix
    clip = p @ np.array([0, 0, -AWAY, 1.0])
    depth = filled(device, float(clip[2] / clip[3]) if drawn else 1.0, (*SIZE, 1))
    layer = AirLayer(device, SIZE)
    sun = Sun(AIR, sun_direction(AZIMUTH, ELEVATION), ELEVATION, UNIT, (0.0, 0.0, 0.0), EYE)
    given: dict[str, Any] = {} if shadow is None else {"light": light, "shadow": shadow}
    layer.update(eye.view_matrix, p, sun, medium, share=1.0 if exact else 0.5, **given)
    encoder = device.encoder()
    layer.record(encoder, depth)
    device.submit(encoder)
    return read(device, layer.layer), read(device, layer.transmittance), views


def rays() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Find the directions (H, W, 3) of pixels, their elevations and azimuths from the sun, degrees."""
    eye = camera()
    p = np.asarray(eye.projection_matrix)
    x, y = np.meshgrid((np.arange(SIZE[0]) + 0.5) / SIZE[0] * 2 - 1, 1 - (np.arange(SIZE[1]) + 0.5) / SIZE[1] * 2)
    towards = np.stack([x / p[0, 0], y / p[1, 1], -np.ones_like(x)], axis=-1)
    towards = towards / np.linalg.norm(towards, axis=-1, keepdims=True) @ np.asarray(eye.world.matrix)[:3, :3].T
    return towards, np.degrees(np.arcsin(towards[..., 1])), np.degrees(np.arctan2(towards[..., 0], -towards[..., 2])) - AZIMUTH


def test_the_air_before_a_surface_and_the_sky_are_the_librarys(device: Device) -> None:
    towards, elevation, azimuth = rays()
    axis = np.asarray(camera().world.forward)
    radiance, left = AIR.aerial(elevation, azimuth, ELEVATION, EYE, AWAY / (towards @ axis))
    layer, transmittance, _ = air_layer(device, None, True)
    above = elevation > -0.2  # below, the library's rays end at the ground, and scenes' at what is drawn
    assert np.abs(layer[..., :3] / (UNIT * radiance) - 1)[above].max() < 0.01
    assert np.abs(transmittance[..., :3] - left)[above].max() < 2e-3
    layer, transmittance, _ = air_layer(device, None, False)
    found = AIR.sky(elevation, azimuth, ELEVATION, EYE)
    near_sun = towards @ sun_direction(AZIMUTH, ELEVATION) > math.cos(math.radians(3))
    assert np.abs(layer[..., :3] / (UNIT * found) - 1)[~near_sun & (elevation > 0.5)].max() < 0.01
    assert (transmittance[..., :3] == 0).all()  # the sky replaces what is behind it


def test_a_sun_that_nothing_hides_leaves_the_air_as_it_is_to_the_bit(device: Device) -> None:
    alone, _, _ = air_layer(device, None, True)
    for exact in (True, False):
        assert (air_layer(device, 0.0, True, exact)[0][..., :3] == alone[..., :3]).all()


def test_missing_sunlight_is_that_of_the_stretch_that_is_hidden(device: Device) -> None:
    towards, elevation, azimuth = rays()
    layer, _, (view,) = air_layer(device, 1.0, False)
    # where each ray enters and leaves the map, which hides all that it holds
    start, along = view.matrix @ np.array([*np.asarray(camera().world.position), 1.0]), towards @ view.matrix[:3, :3].T
    with np.errstate(divide="ignore", invalid="ignore"):
        most = np.array([64, 64, 1])  # depth 1 is the map's near plane
        ends = np.stack([(np.array([0, 0, -np.inf]) - start[:3]) / along, (most - start[:3]) / along], axis=-1)
    first = np.clip(ends.min(axis=-1).max(axis=-1), 0, None)
    last = np.maximum(ends.max(axis=-1).min(axis=-1), first)
    parts = AIR.parts(elevation, azimuth, ELEVATION, EYE, shadow=[(first, last)])
    near_sun = towards @ sun_direction(AZIMUTH, ELEVATION) > math.cos(math.radians(3))
    seen = ~near_sun & (elevation > 1)
    assert parts.dark[seen].max() > 0.05  # there is something to be missed
    expected = UNIT * (parts.shadowed + parts.multiple)
    assert np.abs(layer[seen][:, :3] / expected[seen] - 1).max() < 0.015


def lit_stage() -> Stage:
    """Make a stage with a sun, a lamp, a background and a mesh."""
    scene = gfx.Scene()
    sun, lamp = gfx.DirectionalLight(intensity=3), gfx.PointLight(intensity=5, decay=2)
    scene.add(sun, lamp, gfx.AmbientLight(), gfx.Background.from_color("#123456"))
    scene.add(gfx.Mesh(gfx.box_geometry(1, 1, 1), gfx.MeshStandardMaterial()))
    lights = [SceneLight(sun), SceneLight(lamp)]
    return Stage("lit", scene, {"front": gfx.PerspectiveCamera()}, lights, 0.0, lambda *_: None, np.zeros(3), 2.0)


def test_a_stage_has_the_suns_light_and_its_lamps_and_gets_back_its_own() -> None:
    stage = lit_stage()
    lights, scene = list(stage.lights), stage.scene
    daylight = Daylight(AIR, lambda time: (90.0, 30.0 - 2 * time), 100.0)
    daylight.put(stage)
    assert [light.target for light in stage.lights] == [daylight.sun, lights[1].target]
    assert not lights[0].target.visible and lights[1].target.visible
    light = np.array(daylight.sun.color.to_physical()[:3]) * daylight.sun.intensity
    np.testing.assert_allclose(light, 132_600 * AIR.sun(30.0, 100.0, disc=True), rtol=1e-5)
    towards = stage.lights[0].homogeneous()[:3]
    np.testing.assert_allclose(towards / np.linalg.norm(towards), (math.cos(math.radians(30)), 0.5, 0), atol=1e-6)
    expose(stage, 2.0**-14)
    daylight.move(stage, 20.0)  # 10 degrees below the horizon
    assert daylight.sun.intensity == 0
    material = next(thing.material for thing in scene.iter() if isinstance(thing, gfx.Mesh))
    assert material.env_map_intensity == pytest.approx(132_600 * 2.0**-14 * float(daylight.sky.mean @ (0.2126, 0.7152, 0.0722)), rel=1e-3)
    expose(stage, 1.0)
    daylight.take_off(stage)
    assert stage.lights == lights and stage.daylight is None and lights[0].target.visible and daylight.sun not in scene.children


def test_the_sky_that_lights_surfaces_is_the_librarys() -> None:
    for sun in (40.0, 3.0):
        sky = Sky(AIR, sun, 2.0)
        elevation, azimuth = np.array([3.0, 12.0, 33.0, 71.0]), np.array([20.0, 75.0, -120.0, 170.0])
        np.testing.assert_allclose(sky.towards(elevation, azimuth), AIR.sky(elevation, azimuth, sun), rtol=0.04)
    level = sum(AIR.irradiance(3.0, 2.0))
    np.testing.assert_allclose(Sky(AIR, 3.0, 2.0).ground, 0.3 / np.pi * level, rtol=0.05)


def test_a_sun_sets_without_a_jump() -> None:
    suns = np.arange(-0.6, 0.6, 0.15)
    lights = np.array([Sky(AIR, float(sun), 2.0).mean[1] for sun in suns])
    assert (np.abs(np.diff(np.log(lights))) < 0.2).all() and (np.diff(lights) > 0).all()


def options(**values: Any) -> tuple[DaylightOptions, DaylightScene]:
    own = {name: values.pop(name) for name in ("day", "north") if name in values}
    return DaylightOptions(daylight="air", **values), DaylightScene(**own)


def test_the_sun_stands_by_angles_and_by_time_and_place_and_runs_through_a_day() -> None:
    by_angles = scene_daylight(*options(north=30.0, altitude=500.0), SunRequest(("200,12",)))
    assert by_angles is not None and by_angles.track(9.0) == (230.0, 12.0) and by_angles.altitude == 500.0 and by_angles.span is None
    by_time = scene_daylight(*options(when="2003-10-17T19:30:30Z", where="39.742476,-105.1786,1830.14"), SunRequest())
    assert by_time is not None and by_time.altitude == pytest.approx(1830.14)
    np.testing.assert_allclose(by_time.track(0.0), (194.3403, 39.8721 + 0.0195), atol=0.01)
    day = options(day="2026-06-21", where="47.42,10.98")
    run = scene_daylight(*day, SunRequest(seconds=(1.0, 3.0)))
    assert run is not None and run.span == (1.0, 3.0)
    assert run.track(1.0)[1] == pytest.approx(-0.27, abs=0.02) and run.track(3.0)[1] == pytest.approx(-0.27, abs=0.02)
    assert run.track(2.0)[1] == pytest.approx(90 - 47.42 + 23.44, abs=0.05)
    given = scene_daylight(*day, SunRequest(begin="12:00+02:00", end="14:00+02:00", seconds=(0.0, 1.0)))
    at_noon = scene_daylight(*options(when="2026-06-21T12:00+02:00", where="47.42,10.98"), SunRequest())
    assert given is not None and at_noon is not None and given.track(0.0) == pytest.approx(at_noon.track(0.0))


def test_sunrise_and_sunset() -> None:
    import datetime

    rise, fall = sun_up(datetime.date(2026, 3, 20), (0.0, 0.0, 0.0))  # the equinox at the equator: 12 hours, and refraction
    assert fall - rise == pytest.approx(12 * 3600 + 400, abs=90)
    with pytest.raises(AirlightError, match="does not rise"):
        sun_up(datetime.date(2026, 12, 21), (80.0, 10.0, 0.0))


@pytest.mark.parametrize(
    ("values", "request_", "told"),
    [
        ({}, SunRequest(), "needs a sun"),
        ({"when": "2026-06-21T12:00Z", "where": "1,2"}, SunRequest(("1,2",)), "--sun and --when both say"),
        ({"when": "2026-06-21T12:00Z"}, SunRequest(), "--when needs the place too"),
        ({"when": "2026-06-21T12:00", "where": "1,2"}, SunRequest(), "no zone: add Z"),
        ({"when": "exif", "where": "1,2"}, SunRequest(), "reads a photograph"),
        ({"when": "2026-06-21T00:00Z", "where": "0,0"}, SunRequest(), "no daylight is left"),
        ({"day": "2026-02-30", "where": "1,2"}, SunRequest(seconds=(0, 1)), "no such date"),
        ({"day": "2026-06-21", "where": "1,2"}, SunRequest(), "several frames"),
        ({"day": "2026-06-21", "where": "1,2"}, SunRequest(begin="9:00", seconds=(0, 1)), "cannot read --from"),
        ({"day": "2026-06-21", "where": "1,2"}, SunRequest(begin="09:00", seconds=(0, 1)), "no zone"),
        ({"day": "2026-06-21", "where": "1,2"}, SunRequest(begin="09:00Z", end="08:00Z", seconds=(0, 1)), "other --from and --to"),
        ({}, SunRequest(("1,2",), begin="09:00Z"), "--from and --to go with --day"),
        ({}, SunRequest(("1,2", "3,4")), "one sun"),
        ({}, SunRequest(("1,2;color=1,0,0",)), "cannot read --sun"),
    ],
)
def test_what_cannot_be_is_one_line(values: dict[str, Any], request_: SunRequest, told: str) -> None:
    with pytest.raises(AirlightError, match=told) as caught:
        scene_daylight(*options(**values), request_)
    assert "\n" not in str(caught.value)


def test_daylight_is_lit_by_march_in_air_alone_unless_a_medium_is_given() -> None:
    assert with_daylight({"daylight": "air"}, False) == {"daylight": "air", "method": "march", "sigma_t": (0.0, 0.0, 0.0)}
    assert "sigma_t" not in with_daylight({"daylight": "air"}, True)
    assert with_daylight({"daylight": "air", "fog": "linear", "method": "radial"}, False)["method"] == "radial"
    assert with_daylight({"daylight": "air", "method": "epipolar"}, False) == {"daylight": "air", "method": "epipolar"}
    assert with_daylight({"fog": "linear"}, False) == {"fog": "linear"}
    for values in ({"daylight": "hoffman-preetham"}, {"daylight": "air", "sky": "keep"}, {"ozone": 200.0}):
        with pytest.raises(AirlightError):
            with_daylight(values, False)
    with pytest.raises(AirlightError, match="for daylight"):
        check_view({"sun": "1,2"})


def test_a_sun_that_is_down_is_told() -> None:
    def put(sun: str) -> None:
        stage, (day, of_scene) = lit_stage(), options(multiple="none")
        put_daylight(stage, {DaylightOptions: day, DaylightScene: of_scene}, SunRequest((sun,)))
        assert stage.daylight is not None

    with pytest.warns(AirlightWarning, match="3.0 degrees below the horizon"):
        put("10,-3")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        put("10,3")


def test_suns_of_a_track_below_the_dusk_count_as_there() -> None:
    stage = lit_stage()
    daylight = Daylight(AIR, lambda time: (0.0, -40.0))
    daylight.put(stage)
    assert daylight.elevation == LOWEST
