"""Lamps that a user puts into a scene light its surfaces and its air as the file's own do; meshes that emit are offered as lights."""

from pathlib import Path

import numpy as np
import pygfx as gfx
import pytest
from gltf_rooms import room

from airlight.cli import main
from airlight.colour import encode_codes
from airlight.errors import AirlightError
from airlight.jobs.light_text import PLACE, SUN, read_scene_light
from airlight.options import March, Medium, Parameters
from airlight.pygfx.punctual import punctual_lights
from airlight.scenes import Stage, open_scene
from airlight.scenes.lamps import NamedLight, candela, lighting, offer, radiance, relight
from airlight.scenes.offline import Shot, Studio

AIR = {"medium": Medium(sigma_t=(0.03,) * 3), "march": March(steps=16)}
POINT = {"type": "point", "intensity": 40, "color": [1, 0.5, 0.25]}
AT = [0.4, 1.5, -2]


def codes(stage: Stage, *lights: object, method: str = "march") -> np.ndarray:
    studio = Studio(stage, Shot(160, 90, 1, lights=lights), Parameters(method=method), **AIR)
    studio.frame()
    return encode_codes(studio.frame().pixels(), np.uint8).astype(int)


def test_a_lamp_that_is_added_is_a_lamp_of_the_file(tmp_path: Path) -> None:
    w = room()
    plain = open_scene(w.save(tmp_path), "none", lamps=True)
    w.node(extensions=w.light(**POINT), translation=AT)
    own = codes(open_scene(w.save(tmp_path), "none"))
    lamp = read_scene_light("0.4,1.5,-2;color=1,0.5,0.25;strength=40", PLACE)
    assert np.ptp(own[:60, 30:130], axis=(0, 1)).min() > 60, "light and shadow"
    assert np.abs(codes(plain, lamp) - own).max() <= 1
    assert np.abs(codes(plain, lamp) - own).max() <= 1, "once more, and no brighter"
    assert not [thing for thing in plain.scene.iter() if isinstance(thing, gfx.PointLight)]


def test_a_sun_that_is_added_is_a_sun_of_the_file(tmp_path: Path) -> None:
    w = room()
    w.node(extensions=w.light(**POINT), translation=AT)
    lamp, sun = read_scene_light("0.4,1.5,-2", PLACE), read_scene_light("180,40;strength=2;color=0.5,0.5,1", SUN)
    added = codes(open_scene(w.save(tmp_path), "none"), lamp, sun)
    half = np.radians(-40) / 2
    w.node(extensions=w.light(type="directional", intensity=2, color=[0.5, 0.5, 1]), rotation=[np.sin(half), 0, 0, np.cos(half)])
    own = codes(open_scene(w.save(tmp_path), "none"))
    assert np.abs(added - own).max() <= 1


def test_a_file_without_lights_has_no_sun_beside_a_lamp(tmp_path: Path) -> None:
    path = room().save(tmp_path)
    suns = [[thing for thing in open_scene(path, lamps=lamps).scene.iter() if isinstance(thing, gfx.DirectionalLight)] for lamps in (0, 1)]
    assert list(map(len, suns)) == [1, 0]


def test_a_mesh_as_the_light(tmp_path: Path) -> None:
    """A lamp in its middle, of its radiance times a quarter of its surface; it hides nothing of that."""
    w = room(bulb=50)
    stage = open_scene(w.save(tmp_path), "none", lamps=True)
    made = lighting(stage, [NamedLight("Bulb")])
    with made.shining():
        (lamp,) = punctual_lights(made.lights)
    expected = 50 * np.array([1, 0.5, 0.25]) * 6 * 0.4**2 / 4
    assert lamp.intensity == pytest.approx(expected, rel=1e-4) and lamp.position == pytest.approx(AT)
    seen = codes(stage, NamedLight("Bulb"))
    w.node(extensions=w.light(type="point", intensity=float(expected[0]), color=[1, 0.5, 0.25]), translation=AT)
    w.json["nodes"] = [node for node in w.json["nodes"] if node.get("name") != "Bulb"]
    w.json["scenes"][0]["nodes"] = list(range(len(w.json["nodes"])))
    alone = codes(open_scene(w.save(tmp_path), "none"))
    beside = np.ones((90, 160), bool)
    beside[30:60, 70:100] = False  # the bulb, and the air about it
    assert np.abs(seen - alone)[beside].max() <= 2
    assert np.abs(codes(stage, NamedLight("Bulb", (1, 0.5, 0.25), float(expected[0]))) - seen).max() <= 1, "its strength in candela"
    assert all(mesh.cast_shadow for mesh in stage.scene.iter() if isinstance(mesh, gfx.Mesh)), "as it was"


@pytest.mark.parametrize("name", ["Bulb", "Lamp"])
def test_a_light_by_its_name(name: str, tmp_path: Path) -> None:
    w = room(bulb=1)
    w.node(extensions=w.light(**POINT, name="Lamp data"), translation=AT, name="Lamp")
    stage = open_scene(w.save(tmp_path), "none")
    (light,) = lighting(stage, [NamedLight(name, strength=3)]).lights
    assert isinstance(light.target, gfx.PointLight if name == "Lamp" else gfx.Mesh)
    assert light.strength == (3 if name == "Lamp" else 1)


def test_names_that_are_none(tmp_path: Path) -> None:
    stage = open_scene(room(bulb=1).save(tmp_path), "none", lamps=True)
    for name, words in (("Blub", "did you mean 'Bulb'"), ("Sofa", "there is Floor, "), ("Floor", "emits no light; .*'Floor;strength=50'")):
        with pytest.raises(AirlightError, match=words):
            lighting(stage, [NamedLight(name)])
    assert read_scene_light("Bulb;strength=2", PLACE) == NamedLight("Bulb", strength=2.0)
    assert read_scene_light("1e3,2,-1e-2", PLACE).position == (1000, 2, -0.01)
    for text in ("1,2", "1,x,2", "1e3", "1;strength=x"):
        with pytest.raises(AirlightError):
            read_scene_light(text, PLACE)


def test_meshes_that_emit_are_offered(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    w = room(bulb=2)
    path, out = w.save(tmp_path), str(tmp_path / "a.png")
    assert offer(open_scene(path)) == f"{path}: no lights; the mesh 'Bulb' is emissive: --light Bulb"
    size = ["--width", "32", "--quality", "draft"]
    assert main(["render", path, "-o", out, *size]) == 0
    assert "--light Bulb" in capfd.readouterr().err
    behind = "the sun lies behind the camera: method epipolar sees the picture alone"
    for light, said in ((["--light", "Bulb"], ""), (["--sun", "160,35"], behind)):
        assert main(["render", path, "-o", out, "-y", *size, *light]) == 0
        err = capfd.readouterr().err
        assert err.startswith(said) and bool(err) == bool(said)
    w.node(extensions=w.light(**POINT))
    assert offer(open_scene(w.save(tmp_path))) is None
    assert offer(open_scene(room().save(tmp_path))) is None


def test_radiance_and_intensity() -> None:
    material = gfx.MeshStandardMaterial(emissive=gfx.Color.from_physical(1, 0.5, 0), emissive_intensity=4)
    assert radiance(material) == pytest.approx([4, 2, 0], abs=1e-3)
    assert candela(gfx.Mesh(gfx.sphere_geometry(0.5, 64, 32), material))[0] == pytest.approx(4 * np.pi * 0.25, rel=0.01)
    half = np.zeros((2, 2, 4), np.uint8)
    half[0] = 255
    material.emissive_map = gfx.TextureMap(gfx.Texture(half, dim=2))
    assert radiance(material) == pytest.approx([2, 1, 0], abs=1e-3)
    assert not radiance(gfx.MeshBasicMaterial()).any()


def test_a_stage_that_is_lit_for_good(tmp_path: Path) -> None:
    stage = open_scene(room(bulb=1).save(tmp_path), "none", lamps=True)
    relight(stage, [read_scene_light("1,2,3", PLACE), NamedLight("Bulb")])
    assert sum(isinstance(thing, gfx.PointLight) for thing in stage.scene.iter()) == 2
    assert stage.movable is stage.lights[0] and len(punctual_lights(stage.lights)) == 2


def test_a_lamp_in_candela_is_exposed_however_weak(tmp_path: Path) -> None:
    path = room().save(tmp_path)
    shown = []
    for candela_of_it in (2, 200, 20_000):
        lamp = read_scene_light(f"0.4,1.5,-2;strength={candela_of_it}cd", PLACE)
        shown.append(codes(open_scene(path, "none", lamps=True), lamp))
    assert all(30 < np.median(one[:70]) < 225 for one in shown)
    assert np.abs(shown[1] - shown[2]).mean() < 6, "but for the fill light, which is none of it"
