"""`airlight image --daylight`: pictures equal the library, bad input is one line, the camera has the sun where the light is."""

import itertools
import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from PIL import Image, TiffImagePlugin

from airlight.cli import main
from airlight.daylight import Atmosphere, hoffman_preetham
from airlight.daylight.camera import Camera, angle_between, direction_of, solve_pitch
from airlight.daylight.picture import displayed, irradiance_of_white, sky_strength, within_white
from airlight.daylight.sun import sun_position
from airlight.detect.sky import find_sky
from airlight.detect.sky_edge import land_part, soften
from airlight.errors import AirlightError
from airlight.files import exif, read_image, write_image
from airlight.files.planes_of import plane_of_file
from airlight.jobs import daylight_picture
from airlight.jobs.daylight_depth import from_map
from airlight.jobs.daylight_shadows import dark_share
from airlight.jobs.daylight_text import read_when
from airlight.options import DaylightPicture

WIDTH, HEIGHT, FOV = 24, 16, 40.0
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


def grey(value: Any, shape: tuple[int, int] = (HEIGHT, WIDTH)) -> np.ndarray:
    return np.repeat(np.broadcast_to(np.asarray(value, np.float32), shape)[..., None], 3, axis=2)


@pytest.fixture
def files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A grey picture, and depths that grow from below, endless in its upper third."""
    monkeypatch.chdir(tmp_path)
    write_image("in.exr", grey(0.25), bits=32)
    metres = np.geomspace(9000, 300, HEIGHT)[:, None] * np.ones(WIDTH)
    metres[: HEIGHT // 3] = 1e10
    write_image("depth.exr", grey(metres), bits=32)
    return tmp_path


def run(*args: str, code: int = 0) -> None:
    assert main(["image", "in.exr", "-o", "out.exr", "-y", "--daylight", "air", *args]) == code


def refused(capsys: Any, *args: str) -> str:
    capsys.readouterr()
    run(*args, code=2)
    out, error = capsys.readouterr()
    assert out == "" and error.startswith("airlight: ") and error.count("\n") == 1, error
    return str(error)


def channels(name: str) -> np.ndarray:
    return np.stack([plane_of_file("out.exr", f"{name}.{one}") for one in "RGB"], axis=-1)


def truth(camera: Camera, metres: np.ndarray, sun: float, azimuth: float, **air: Any) -> tuple[np.ndarray, np.ndarray]:
    """What the air adds, of an irradiance by which white is 1, and its transmittance."""
    x, y = (np.arange(WIDTH) + 0.5) / WIDTH, (np.arange(HEIGHT)[:, None] + 0.5) / HEIGHT
    rays = camera.in_camera(x, y) @ camera.axes
    model = Atmosphere(**air)
    elevation, turn = np.degrees(np.arcsin(rays[..., 1])), np.degrees(np.arctan2(rays[..., 0], rays[..., 2])) - azimuth
    radiance, through = model.aerial(elevation, turn, sun, 2000.0, metres * camera.lengths(0, 0, WIDTH, HEIGHT))
    return radiance * irradiance_of_white(model, sun, 2000.0), through


def white_in_the_sun(**air: Any) -> tuple[str, str]:
    return "--sun-strength", str(irradiance_of_white(Atmosphere(multiple="none", **air), 15.0, 2000.0))


@pytest.mark.parametrize("multiple", ["none", pytest.param("orders", marks=pytest.mark.slow)])
def test_a_picture_without_shadows_is_the_library(files: Path, multiple: str) -> None:
    """The sun behind the camera: D is 0, and each pixel that has a depth is L0 T + L1 + Lms; the sky stays as it was, to the bit."""
    white = irradiance_of_white(Atmosphere(visibility=30, multiple=multiple), 15.0, 2000.0)
    run("--depth", "depth.exr", "--fov", str(FOV), "--sun", "40,15", "--heading", "200", "--pitch", "3", "--altitude", "2000",
        "--visibility", "30", "--multiple", multiple, "--sun-strength", str(white))  # fmt: skip
    metres = plane_of_file("depth.exr", "R")
    sky = metres > 1e9
    camera = Camera(WIDTH, HEIGHT, FOV, 3.0, 0.0, 200.0)
    added, through = truth(camera, np.where(sky, 1e5, metres), 15.0, 40.0, visibility=30, multiple=multiple)
    out = read_image("out.exr").codes[..., :3]
    assert np.array_equal(out[sky], read_image("in.exr").codes[..., :3][sky])
    wanted = 0.25 * through + added
    assert np.abs(out[~sky] / wanted[~sky] - 1).max() < 0.006
    assert np.abs(channels("transmittance")[~sky] - through[~sky]).max() < 0.004 and (channels("transmittance")[sky] == 1).all()
    assert np.abs(channels("airlight")[~sky] / added[~sky] - 1).max() < 0.01
    z = plane_of_file("out.exr", "Z")
    assert np.allclose(z[~sky], metres[~sky], rtol=1e-5) and (z[sky] >= 1e10).all()


def test_the_sky_of_a_photograph_is_found() -> None:
    """Smooth, to the top, above an edge as fine as it is; clouds are of it, and what is below something is not."""
    y, x = np.mgrid[:240, :320] + 0.5
    land = y > 120 + 20 * np.sin(x / 25)
    image = np.where(land, 0.08 + 0.05 * ((np.floor(x) + np.floor(y)) % 2), 0.3 + 0.001 * y)[..., None] * np.array([0.8, 1.0, 1.3])
    image[30:50, 100:160] = 0.9
    image[150:200, 100:200] = 0.7
    found = find_sky(image)
    assert np.abs(found - ~land).mean() < 0.015 and found[155:].max() == 0 and (found[25:55, 90:170] == 1).all()
    for other in (image[:1], image[::-1], np.random.default_rng(1).random((60, 80, 3))):
        assert not find_sky(other).any()


def test_a_skyline_goes_straight_on_where_the_sun_dazzles() -> None:
    """White that reaches below it, with a glow around, draws no notch; and the share of a pixel out of focus is that of the mixture."""
    y, x = np.mgrid[:240, :360] + 0.5
    share = np.clip((126 - y) / 12 + 0.5, 0, 1)
    sky = (0.2 + 0.001 * y)[..., None] * np.array([0.8, 1.0, 1.4])
    land = (0.03 + 0.02 * ((np.floor(x / 3) + np.floor(y / 3)) % 2))[..., None] * np.array([1.1, 1.0, 0.7])
    image = share[..., None] * sky + (1 - share[..., None]) * land
    found = find_sky(image)
    assert np.abs(found - share).max() < 0.3 and np.abs(found - share).mean() < 0.01
    away = np.hypot(x - 180, y - 118)
    image += np.where(away < 22, 1.0, 0.9 * np.exp(-np.maximum(away - 22, 0) / 6))[..., None] * np.array([1.0, 0.95, 0.8])
    assert np.abs(find_sky(np.minimum(image, 1)) - share)[:, 150:210].mean() < 0.03


def test_mixed_pixels_lose_the_light_of_the_old_sky() -> None:
    """A soft edge that is known as a hard one; the part of its light that the land has; a sky drawn anew leaves no fringe of the old."""
    y = np.arange(40)[:, None] + 0.5 + 0.3 * np.arange(60) / 60
    share = np.clip(20.4 - y, 0, 1).astype(np.float32)
    colours = np.array([0.5, 0.6, 0.9]), np.array([0.06, 0.05, 0.02])
    image = (share[..., None] * colours[0] + (1 - share[..., None]) * colours[1]).astype(np.float32)
    assert np.abs(soften(image, share >= 0.5) - share).max() < 0.13
    wanted = (1 - share[..., None]) * colours[1] / image
    assert np.abs(land_part(image, share) - wanted).max() < 1e-4
    assert np.array_equal(soften(np.full_like(image, 0.3), share >= 0.5), share >= 0.5)  # alike: the edge stays


def test_a_replaced_sky_leaves_no_fringe(files: Path) -> None:
    """What is written is the photograph times its transmittance and the layer; of a mixed pixel the land's light alone stays."""
    share = np.clip(HEIGHT / 2 + 0.5 - np.arange(HEIGHT), 0, 1)[:, None] * np.ones(WIDTH)
    write_image("in.exr", grey(0.02 * (1 - share) + 0.7 * share), bits=32, overwrite=True)
    write_image("depth.exr", grey(np.where(share >= 0.5, 1e10, 50.0)), bits=32, overwrite=True)
    run("--depth", "depth.exr", "--fov", str(FOV), "--sun", "40,15", "--heading", "200", "--pitch", "8", "--sky", "replace",
        "--sun-strength", "0", "--multiple", "none")  # fmt: skip
    out = read_image("out.exr").codes[..., :3]
    made = read_image("in.exr").codes[..., :3] * channels("transmittance") + channels("airlight")
    assert np.allclose(out, made, atol=2e-3) and out[share == 1].max() == 0
    assert np.allclose(out[HEIGHT // 2], 0.01, atol=0.004) and np.allclose(out[-1], 0.02, rtol=0.02)


def test_daylight_has_the_measure_of_the_photographs_sky(files: Path, capsys: Any) -> None:
    """Where nothing is typed; a strength that is typed counts; after sunset a sky that is drawn anew is no darker than the old one."""
    where = ("--depth", "depth.exr", "--fov", str(FOV), "--heading", "200", "--pitch", "8", "--multiple", "none", "--visibility", "30")
    write_image("in.exr", grey(0.02), bits=32, overwrite=True)  # exposed for the sun
    run(*where, "--sun", "40,15")
    told = capsys.readouterr().err
    assert "in.exr: daylight is as bright as the photograph's sky, --sun-strength " in told and "would be 1 with " in told
    white, own = told.split("would be 1 with ")[1].split()[0], channels("airlight")
    run(*where, "--sun", "40,15", "--sun-strength", white)
    assert "has the sky's measure" in capsys.readouterr().err
    assert channels("airlight")[-1].mean() / own[-1].mean() > 2
    write_image("in.exr", grey(0.25), bits=32, overwrite=True)  # of mist, brighter than a clear sky: exposed for white at most
    run(*where, "--sun", "40,15")
    assert "measure" not in capsys.readouterr().err
    misty = channels("airlight")[-1]
    run(*where, "--sun", "40,15", "--sun-strength", white)
    assert np.allclose(channels("airlight")[-1], misty, rtol=0.05)
    run(*where, "--sun", "200,-6", "--sky", "replace")
    sky = read_image("out.exr").codes[: HEIGHT // 3, :, :3] @ LUMINANCE
    assert 0.03 < np.median(sky) < 0.5
    capsys.readouterr()
    run(*where, "--sun", "200,-6", "--sky", "replace", "--sun-strength", "1")
    assert "by this sun its sky is nearly black, --sun-strength " in capsys.readouterr().err


def test_parts_of_a_picture_join(files: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    args = ("--depth", "depth.exr", "--fov", str(FOV), "--sun-elevation", "9", "--light", "0.8,0.2", "--multiple", "none",
            "--sky", "replace", "--ground-albedo", "0.1,0.2,0.3")  # fmt: skip
    run(*args)
    whole = read_image("out.exr").codes
    monkeypatch.setattr(daylight_picture, "PART", 5 * WIDTH)
    run(*args)
    assert np.allclose(read_image("out.exr").codes, whole, rtol=2e-3, atol=1e-5) and whole[..., :3].max() > 1


@pytest.mark.parametrize("kind", ["replace", "air"])
def test_a_sky_that_is_drawn_goes_on_below_the_horizon(files: Path, kind: str) -> None:
    """As from a hill whose height is not told: no ground is drawn where the user has sky, and no line."""
    metres = np.full((HEIGHT, WIDTH), 1e10)
    metres[-1] = 100.0
    write_image("depth.exr", grey(metres), bits=32, overwrite=True)
    run("--depth", "depth.exr", "--fov", str(FOV), "--sun", "230,15", "--heading", "200", "--pitch", "0", "--sky", kind,
        "--multiple", "none")  # fmt: skip
    sky = read_image("out.exr").codes[: HEIGHT - 1, :, :3] @ LUMINANCE
    horizon = HEIGHT // 2
    assert np.allclose(sky[horizon + 1 :], sky[horizon], rtol=0.02) and (np.abs(sky[horizon] / sky[horizon - 1] - 1) < 0.35).all()


@pytest.mark.parametrize(("kind", "adds"), [("air", True), ("replace", False)])
def test_skies(files: Path, kind: str, adds: bool) -> None:
    run("--depth", "depth.exr", "--fov", str(FOV), "--sun", "40,15", "--heading", "200", "--pitch", "8", "--altitude", "2000",
        "--sky", kind, "--multiple", "none", *white_in_the_sun())  # fmt: skip
    camera = Camera(WIDTH, HEIGHT, FOV, 8.0, 0.0, 200.0)
    sky = plane_of_file("depth.exr", "R") > 1e9
    added, through = truth(camera, np.full((HEIGHT, WIDTH), 1e7), 15.0, 40.0, multiple="none")
    wanted = added + (0.25 * through if adds else 0)
    assert np.abs(read_image("out.exr").codes[..., :3][sky] / wanted[sky] - 1).max() < 0.01


def test_a_soft_mask_mixes_sky_and_land(files: Path) -> None:
    write_image("mask.png", grey(np.linspace(0, 1, HEIGHT)[::-1, None] ** 2.2))
    share = read_image("mask.png").codes[..., 0] / 255.0
    args = ("--mask", "mask.png", "--distance", "5000", "--fov", str(FOV), "--sun", "40,15", "--heading", "200", "--altitude", "2000")
    run(*args, "--visibility", "30", "--multiple", "none", *white_in_the_sun(visibility=30))
    out = read_image("out.exr").codes[..., 1]
    along = Camera(WIDTH, HEIGHT, FOV).lengths(0, 0, WIDTH, HEIGHT)
    added, through = truth(Camera(WIDTH, HEIGHT, FOV, 0.0, 0.0, 200.0), 5000 / along, 15.0, 40.0, visibility=30, multiple="none")
    land = 0.25 * through[..., 1] + added[..., 1]
    assert np.abs(out - (share * 0.25 + (1 - share) * land)).max() < 0.01 * out.max()


def test_even_air_is_equation_1(files: Path) -> None:
    assert main(["image", "in.exr", "-o", "out.exr", "-y", "--daylight", "hoffman-preetham", "--distance", "3000", "--mask", "none.png",
                 "--fov", "40", "--sun", "40,15", "--heading", "200"]) == 2  # fmt: skip
    write_image("none.png", grey(0.0))
    assert main(["image", "in.exr", "-o", "out.exr", "-y", "--daylight", "hoffman-preetham", "--distance", "3000", "--mask", "none.png",
                 "--fov", "40", "--sun", "40,15", "--heading", "200", "--beta-mie", "1e-4"]) == 0  # fmt: skip
    camera = Camera(WIDTH, HEIGHT, FOV, 0.0, 0.0, 200.0)
    ray = camera.at(0.5 + 0.5 / WIDTH, 0.5 + 0.5 / HEIGHT)
    theta = angle_between(ray, direction_of(40, 15))
    wanted = hoffman_preetham(0.25, math.pi, (6.953e-6, 11.757e-6, 24.380e-6), 1e-4, 0.8, 3000, theta)
    assert read_image("out.exr").codes[HEIGHT // 2, WIDTH // 2, :3] == pytest.approx(wanted, rel=2e-3)


def test_a_pole_before_the_sun_takes_sunlight_from_the_sky_alone(files: Path, capsys: Any) -> None:
    """Ground that recedes darkens nothing; a near pole does, of what lies behind it as seen from the sun. Its own sky is kept."""
    write_image("sky.exr", grey(0.5, (48, 64)), bits=32)
    metres = np.full((48, 64), 1e10)
    metres[32:] = np.geomspace(20000, 5, 16)[:, None]
    metres[14:40, 30:34] = 4.0
    write_image("pole.exr", grey(metres, (48, 64)), bits=32)
    assert main(["image", "sky.exr", "-o", "out.exr", "-y", "--daylight", "air", "--depth", "pole.exr", "--fov", "40", "--light", "0.2,0.3",
                 "--sun-elevation", "10", "--occlusion-fraction", "d.png", "--visibility", "20", "--multiple", "none"]) == 0  # fmt: skip
    dark = read_image("d.png").codes[..., 0] / 255.0
    assert dark[20, :25].max() < 0.02 and dark[20:30, 45:].min() > 0.03  # towards the sun nothing, beyond the pole its shadow
    assert dark[40:, :12].max() < 0.02 and dark[33:36, :8].max() < 0.02  # ground under the sun
    out = read_image("out.exr").codes[..., :3]
    assert (out[20, 45:] < 0.499).all() and (out[20, :20] == 0.5).all()
    assert "camera looks" in capsys.readouterr().err


@pytest.mark.parametrize(("elevation", "roll", "x", "y"), list(itertools.product([-3.0, 12.0, 40.0], [0.0, -8.0], [0.1, 0.8], [0.2, 0.7])))
def test_pitch_puts_the_sun_at_the_light(elevation: float, roll: float, x: float, y: float) -> None:
    camera = Camera(1600, 900, 50.0, roll=roll, heading=77.0)
    pitch = solve_pitch(camera, (x, y), elevation)
    aimed = Camera(1600, 900, 50.0, pitch, roll, 77.0)
    ray = aimed.at(x, y)
    assert math.degrees(math.asin(ray[1])) == pytest.approx(elevation, abs=1e-9) and abs(pitch) <= 90
    assert aimed.seen(ray) == pytest.approx((x, y), abs=1e-9)
    assert aimed.seen(-ray) is None
    world = np.append(ray * [1, 1, -1], 0)  # as a pass sees it, in a part of the picture
    clip = aimed.projection(300, 100, 500, 600) @ aimed.view @ world
    assert 0.5 + 0.5 * clip[0] / clip[3] == pytest.approx((x * 1600 - 300) / 500)
    assert 0.5 - 0.5 * clip[1] / clip[3] == pytest.approx((y * 900 - 100) / 600)


def test_a_camera_turned_clockwise_sees_the_horizon_sink_on_the_left() -> None:
    camera = Camera(100, 100, 60.0, roll=10.0)
    assert camera.at(0.1, 0.5)[1] > 0 > camera.at(0.9, 0.5)[1]
    assert camera.at(0.5, 0.5) == pytest.approx([0, 0, 1])
    assert Camera(100, 100, 60.0, heading=90.0).at(0.9, 0.5)[2] < 0 < Camera(100, 100, 60.0, heading=90.0).at(0.9, 0.5)[0]


SUN = ("--sun-elevation", "10", "--light", "0.5,0.3")
FAR = ("--distance", "3000", "--fov", "50")


@pytest.mark.parametrize(
    ("args", "says"),
    [
        (FAR, "--daylight air needs a sun: add --sun AZ,EL, --sun-elevation EL with --light, or --when and --where"),
        ((*FAR, "--sun", "10,20", "--when", "2026-06-21T12:00Z", "--where", "1,2"), "--when and --sun both say where the sun is"),
        ((*FAR, "--when", "2026-06-21T12:00Z"), "--when needs the place too: add --where LAT,LON"),
        ((*FAR, "--when", "2026-06-21T12:00", "--where", "1,2"), "has no zone: add Z, or as for Central European Summer Time +02:00"),
        ((*FAR, "--when", "2026-02-30T12:00Z", "--where", "1,2"), "there is no such time (day "),
        ((*FAR, "--when", "noon", "--where", "1,2"), "that is no time by ISO 8601: write it as 2026-06-21T19:30+02:00"),
        ((*FAR, "--when", "2026-06-21T12:00Z", "--where", "91,10"), "the latitude 91 is beyond 90 degrees"),
        ((*FAR, "--when", "2026-06-21T12:00Z", "--where", "10,191"), "the longitude 191 is beyond 180 degrees"),
        ((*FAR, "--when", "2026-06-21T12:00Z", "--where", "here"), "write latitude and longitude in degrees"),
        ((*FAR, "--when", "2026-06-21T12:00Z", "--where", "1,2,9999"), "give --altitude for an eye above it"),
        ((*FAR, "--when", "exif", "--where", "1,2"), "--when exif: it does not say when it was taken: give --when"),
        ((*FAR, "--when", "2026-06-21T12:00Z", "--where", "exif"), "--where exif: it does not say where it was taken: give --where"),
        ((*SUN, "--distance", "3000", "--fov", "exif"), "--fov exif: it does not say its focal length on 35 mm film: give --fov"),
        ((*SUN, "--fov", "50"), "how far things are: add --depth FILE, or --distance METRES"),
        ((*SUN, "--distance", "3000"), "add --fov DEGREES"),
        ((*SUN, *FAR, "--depth", "depth.exr"), "--depth and --distance both say how far things are"),
        ((*SUN, "--fov", "50", "--depth", "whole.png"), "its depths are whole numbers, which say no metres: add --depth-range NEAR,FAR"),
        ((*SUN, "--fov", "50", "--depth", "small.exr"), "the depths are 8 x 4 pixels, the picture 24 x 16"),
        ((*SUN, "--fov", "50", "--depth", "below.exr"), "holds negative depths, down to -3"),
        ((*SUN, "--fov", "50", "--depth", "nan.exr"), "of the depths are no number (NaN)"),
        ((*SUN, *FAR, "--visibility", "20", "--turbidity", "3"), "--visibility and --turbidity both say how hazy the air is"),
        ((*SUN, *FAR, "--visibility", "300"), "300.0 is not in the range 0.05<=x<=280; clean air has 289 km"),
        ((*SUN, *FAR, "--visibility", "nan"), "'--visibility': 'nan' is no number: give one ≥ 0.05, ≤ 280"),
        ((*SUN, "--distance", "3000", "--fov", "nan"), "'--fov': 'nan' is no number: give one ≥ 1, ≤ 170; or write exif"),
        ((*SUN, *FAR, "--ground-albedo", "0.1,nan,0.2"), "'--ground-albedo': 'nan' is no number: give one ≥ 0, ≤ 1"),
        ((*FAR, "--sun", "10,-19"), "the sun is -19.0 degrees high, and below -18 no daylight is left"),
        ((*FAR, "--sun", "10"), "write azimuth and elevation in degrees, as in --sun 240,12"),
        ((*SUN, *FAR, "--pitch", "30"), "degrees away from the sun, which this camera has "),
        ((*FAR, "--sun", "100,10", "--light", "0.5,0.3", "--heading", "90"), "degrees away from the sun"),
        (("--sun-elevation", "80", "--light", "-9,0.3", *FAR), "is at most"),
        ((*SUN, *FAR, "--strength", "2"), "--strength shapes shafts that are added, and daylight has its own measure"),
        ((*SUN, *FAR, "--samples", "50"), "--samples does nothing with daylight by method epipolar: leave it out, or add --method radial"),
        ((*SUN, *FAR, "--decay", "0.9"), "--decay shapes shafts that are added, and daylight has its own measure: leave it out"),
        ((*SUN, "--fov", "50", "--depth", "depth.exr", "--threshold", "0.5"), "--threshold finds the sky by its brightness, and --depth"),
        ((*SUN, *FAR, "--mask-invert"), "--mask-invert inverts the image of --mask; give both"),
        ((*SUN, *FAR, "--where", "47,11"), "--where 47,11 places the sun by --when: give --when too, or --altitude for the height alone"),
        ((*SUN, *FAR, "--beta-mie", "1e-5"), "--beta-mie means nothing with --daylight air"),
        ((*SUN, *FAR, "--depth-range", "2,50"), "--depth-range describes the depths: add --depth FILE"),
        ((*SUN, "--fov", "50", "--depth", "depth.exr", "--depth-range", "50,2"), "the nearer first, as in --depth-range 2,5000"),
        ((*SUN, *FAR, "--light", "0.1,0.2"), "--daylight has one sun"),
        ((*FAR, "--sun-elevation", "10", "--light", "0.5,0.3;strength=2"), "leave all but its place out"),
    ],
)  # fmt: skip
def test_bad_input_is_one_line_with_its_cure(files: Path, capsys: Any, args: tuple[str, ...], says: str) -> None:
    write_image("whole.png", grey(0.5))
    write_image("small.exr", grey(5.0, (4, 8)), bits=32)
    for name, value in (("below", -3.0), ("nan", math.nan)):
        metres = np.full((HEIGHT, WIDTH), 50.0)
        metres[3, 3] = value
        plane = grey(metres)
        write_raw(f"{name}.exr", plane)
    assert says in refused(capsys, *args)


def write_raw(path: str, plane: np.ndarray) -> None:
    import OpenImageIO as oiio

    out = oiio.ImageOutput.create(path)
    assert out.open(path, oiio.ImageSpec(plane.shape[1], plane.shape[0], 3, "float"))
    assert out.write_image(plane) and out.close()


def test_options_of_daylight_need_it(files: Path, capsys: Any) -> None:
    assert main(["image", "in.exr", "-o", "out.exr", "--visibility", "20"]) == 2
    assert "--visibility is for daylight: add --daylight air" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("more", "says"),
    [
        (("--visibility", "0.3", "--sun", "200,20"), "hides nearly all that the picture shows, from 3000 m on: give a longer --visibility"),
        (("--sun", "200,-4"), "the sun is 4.0 degrees below the horizon: the sky is lit, but there are no shafts"),
        (("--sun", "20,20"), "the sun is behind the camera: daylight, but no shafts"),
    ],
)  # fmt: skip
def test_doubts_are_told(files: Path, capsys: Any, more: tuple[str, ...], says: str) -> None:
    write_image("none.png", grey(0.0))
    run("--mask", "none.png", "--distance", "3000", "--fov", "40", "--heading", "200", "--multiple", "none", *more)
    assert says in capsys.readouterr().err
    run("--mask", "none.png", "--distance", "20", "--fov", "40", "--heading", "200", "--sun", "200,20", "--multiple", "none")
    assert "this air shows nothing up to the picture's 20 m: give a shorter --visibility" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("values", "whole", "span", "options", "metres"),
    [
        ([2.0, 5e10, np.inf], False, None, {"depth_unit": 0.5}, [1.0, np.inf, np.inf]),
        ([0.5, 0.0, 0.01], False, None, {"depth_kind": "inverse"}, [2.0, np.inf, 100.0]),
        ([0.0, 0.5, 1.0], True, (10.0, 110.0), {}, [10.0, 60.0, np.inf]),
        ([1.0, 0.5, 0.0], True, (10.0, math.inf), {"depth_kind": "inverse"}, [10.0, 20.0, np.inf]),
        ([3.0, 5.0, 7.0], False, (1.0, 101.0), {}, [1.0, 51.0, np.inf]),
        ([65504.0, 3.0, 4.0], False, None, {}, [np.inf, 3.0, 4.0]),
    ],
)  # fmt: skip
def test_maps_of_depths(values: Any, whole: bool, span: Any, options: dict[str, Any], metres: Any) -> None:
    plane, slant = np.array([values], np.float32), np.full((1, 3), 1.25)
    for kind, factor in ({"z": 1.25, "ray": 1.0} if "depth_kind" not in options else {"inverse": 1.25}).items():
        found = from_map(plane, whole, DaylightPicture(**(options | {"depth_kind": kind})), span, slant, "d.exr")
        assert found.metres[0] == pytest.approx(np.array(metres) * factor) and np.array_equal(found.sky[0] == 1, np.isinf(metres))


def test_relative_depths_have_no_endless_end() -> None:
    with pytest.raises(AirlightError, match="goes with --depth-kind inverse"):
        from_map(np.ones((1, 2), np.float32), True, DaylightPicture(), (1.0, math.inf), np.ones((1, 2)), "d.png")


def test_only_what_is_nearer_hides_the_sun_of_a_pixels_air() -> None:
    """The share of a mask's row to the right of each pixel, with the sun at the right: ground that recedes towards it is not counted."""
    from airlight.jobs.daylight_depth import Distances

    def fraction(mask: np.ndarray) -> np.ndarray:
        away = np.cumsum((1 - mask)[:, ::-1], axis=1)[:, ::-1] - (1 - mask)
        return (away / np.maximum(np.arange(mask.shape[1])[::-1], 1)).astype(np.float32)

    metres = np.geomspace(10, 10000, 40)[None].astype(np.float32)
    ground = Distances(metres, np.zeros_like(metres))
    assert dark_share(ground, fraction, is_map=True).max() == 0 and dark_share(ground, fraction, is_map=False).max() == 1
    metres[0, 30] = 5.0
    dark = dark_share(ground, fraction, is_map=True)
    assert (dark[0, 10:30] > 0.01).all() and dark[0, 31:].max() == 0
    sky = Distances(np.full_like(metres, np.inf), np.ones_like(metres))
    sky.metres[0, 30], sky.sky[0, 30] = 5.0, 0
    assert (dark_share(sky, fraction, is_map=True)[0, :30] > 0.02).all()


def test_what_a_photograph_says() -> None:
    said: dict[str, Any] = {"Exif:DateTimeOriginal": "2026:06:21 19:30:05", "Exif:OffsetTimeOriginal": "+02:00"}
    spec = SimpleNamespace(getattribute=lambda name: said.get(name))
    assert exif.taken_at(spec, "a.jpg") == "2026-06-21T19:30:05+02:00"
    del said["Exif:OffsetTimeOriginal"]
    with pytest.raises(AirlightError, match=r"its time 2026-06-21T19:30 has no offset from UTC: give --when 2026-06-21T19:30\+02:00"):
        exif.taken_at(spec, "a.jpg")
    said |= {"GPS:DateStamp": "2026:06:21", "GPS:TimeStamp": (17.0, 30.0, 6.0)}
    assert read_when(exif.taken_at(spec, "a.jpg")) == read_when("2026-06-21T19:30:06+02:00")
    said |= {"GPS:TimeStamp": (23.0, 59.0, 59.99)}
    assert exif.taken_at(spec, "a.jpg") == "2026-06-21T23:59:59Z"
    said |= {"GPS:Latitude": (33.0, 52.0, 7.68), "GPS:LatitudeRef": "S", "GPS:Longitude": (151.0, 12.0, 33.48), "GPS:LongitudeRef": "E"}
    assert exif.taken_from(spec, "a.jpg") == pytest.approx((-33.8688, 151.2093, None), abs=1e-9)
    said |= {"GPS:Altitude": 12.5, "GPS:AltitudeRef": 1, "Exif:FocalLengthIn35mmFilm": 28}
    assert exif.taken_from(spec, "a.jpg")[2] == -12.5 and exif.focal_length(spec, "a.jpg") == 28


@pytest.mark.parametrize(
    ("said", "wrong"),
    [
        ({}, ""),
        ({"altitude": (0, 0)}, ""),  # not known
        ({"latitude": ((95, 1), (0, 1), (0, 1))}, "photo.jpg: --where exif: its place 95,10.98 is not on the earth: give --where LAT,LON"),
        ({"latitude": ((0, 0), (0, 1), (0, 1))}, "--where exif: its place nan,10.98 is not on the earth"),
        ({"altitude": (-5000, 1)}, "--where exif: its altitude -5000 m is not one of the air"),
        ({"time": "2026:02:30 10:00:00"}, "photo.jpg: --when exif: 2026-02-30T10:00:00+02:00: there is no such time"),
        ({"time": "2026:12:21 01:00:00"}, "below -18 no daylight is left: give a --when by day, or in twilight"),
    ],
)  # fmt: skip
def test_a_jpeg_says_where_its_sun_was(files: Path, capsys: Any, said: dict[str, Any], wrong: str) -> None:
    """Time, place and lens as a camera writes them; each lack names the file and its cure, in one line."""
    rational, (metres, unit) = TiffImagePlugin.IFDRational, said.get("altitude", (2962, 1))
    latitude = [rational(*one) for one in said.get("latitude", ((47, 1), (25, 1), (12, 1)))]
    exif_of = Image.Exif()
    exif_of.get_ifd(0x8769).update({0x9003: said.get("time", "2026:06:21 19:30:05"), 0x9011: "+02:00", 0xA405: 24})
    longitude = [rational(one) for one in (10, 58, 48)]
    place = {1: "N", 2: latitude, 3: "E", 4: longitude, 5: bytes([metres < 0]), 6: rational(abs(metres), unit)}
    exif_of.get_ifd(0x8825).update(place)
    Image.fromarray(np.full((HEIGHT, WIDTH, 3), 120, np.uint8)).save("photo.jpg", exif=exif_of)
    write_image("none.png", grey(0.0))
    args = ["--daylight", "air", "--multiple", "none", "--distance", "3000", "--mask", "none.png", "--when", "exif", "--where", "exif"]
    code = main(["image", "photo.jpg", "-o", "out.png", *args, "--fov", "exif", "--heading", "300"])
    error = capsys.readouterr().err
    _, azimuth, apparent = (float(one) for one in sun_position("2026-06-21T17:30:05Z", 47.42, 10.98, 2962))  # summer time
    assert (round(azimuth, 1), round(apparent, 1)) == (288.4, 15.1)
    told = "sun at azimuth 288.4, 15.1 degrees high; angle of view 53.1 degrees, of a lens of 24 mm on 35 mm film"
    assert code == (2 if wrong else 0) and (wrong or told) in error and (not wrong or error.count("\n") == 1)


def test_all_that_is_found_of_sun_and_camera_is_one_line(files: Path, capsys: Any) -> None:
    write_image("photo.png", np.where(np.hypot(*(np.mgrid[:HEIGHT, :WIDTH] - 4))[..., None] < 2, 1.0, 0.1) * np.ones(3, np.float32))
    assert main(["image", "photo.png", "-o", "out.png", "--daylight", "air", "--multiple", "none", "--distance", "900", "--fov", "40",
                 "--light", "auto:1", "--when", "2026-06-21T19:30+02:00", "--where", "47,11"]) == 0  # fmt: skip
    lines = [line for line in capsys.readouterr().err.splitlines() if not line.startswith("airlight: warning: ")]
    assert len(lines) <= 3 and [part.split(" ")[0] for part in lines[0].split("; ")] == ["sun", "light", "camera"], lines


def test_light_beyond_white_pales_and_keeps_its_luminance() -> None:
    light = np.array([[0.2, 0.9, 1.0], [1.3, 0.9, 0.1], [5.0, 3.0, 0.2], [0.5, 0.4, -0.05], [-0.1, -0.1, -0.1]])
    made = within_white(light, LUMINANCE)
    assert made.min() >= 0 and made.max() <= 1 and np.array_equal(made[0], light[0]) and (made[2] == 1).all() and (made[4] == 0).all()
    assert made @ LUMINANCE == pytest.approx(np.clip(light @ LUMINANCE, 0, 1)) and made[1, 0] == pytest.approx(1) and made[3, 2] == 0


def test_light_that_is_added_bends_towards_white() -> None:
    behind = np.full((50, 3), 0.2)
    added = np.geomspace(1e-3, 50, 50)[:, None] * np.array([1.4, 1.0, 0.3])
    made = displayed(behind, added, LUMINANCE)
    grey, share = made @ LUMINANCE, added @ LUMINANCE / 0.8
    assert (np.diff(grey) >= 0).all() and grey[-1] == pytest.approx(1) and made.max() <= 1
    exact = (share < 0.6) & ((behind + added).max(axis=1) <= 1)
    assert exact.sum() > 20 and np.allclose(made[exact], (behind + added)[exact])
    assert np.array_equal(displayed(behind, 0 * added, LUMINANCE), behind)
    white = displayed(np.ones((1, 3)), np.ones((1, 3)), LUMINANCE)
    assert white == pytest.approx(np.ones((1, 3)))


def test_strengths() -> None:
    air = Atmosphere(multiple="none")
    assert irradiance_of_white(air, 45.0, 2.0) * (air.sun(45.0) @ LUMINANCE) == pytest.approx(math.pi)
    hazy = Atmosphere(visibility=3, multiple="none")  # where the sky lights more than the sun
    assert irradiance_of_white(hazy, 8.0, 2.0) * (hazy.irradiance(8.0)[1] @ LUMINANCE) == pytest.approx(math.pi)
    assert irradiance_of_white(air, -10.0, 2.0) == irradiance_of_white(air, 5.0, 2.0)
    assert irradiance_of_white(Atmosphere(visibility=0.05, multiple="none"), 20.0, 2.0) == 1e9  # where nothing is left of either
    up, turn = np.array([20.0, 40.0, 60.0]), np.array([10.0, 90.0, 170.0])
    assert sky_strength(air, 3.5 * (air.sky(up, turn, 30.0) @ LUMINANCE), up, turn, 30.0, 2.0) == pytest.approx(3.5)
