"""Lights of glTF files with the shape of photometric files: EXT_lights_ies."""

import base64
import math
from pathlib import Path

import numpy as np
import pygfx as gfx
import pytest
from gltfs import TRIANGLE, Writer
from photometric_files import form, ies, values

from airlight.errors import AirlightError, AirlightWarning
from airlight.lights.punctual import PunctualLight
from airlight.pygfx.punctual import punctual_lights
from airlight.scenes import Stage, open_scene

HALF = math.sqrt(0.5)
KINDS = {
    "C": ([0, 30, 60, 90], np.arange(0, 361, 90)),
    "A": ([-90, -30, 0, 30, 90], [-90, 0, 45, 90]),
    "B": ([-90, 0, 30, 90], [-90, 0, 60, 90]),
}


def saved(folder: Path, data: bytes, **node: object) -> Stage:
    w = Writer()
    w.node(mesh=w.mesh(TRIANGLE))
    more = {name: node.pop(name) for name in ("multiplier", "color") if name in node}
    w.node(extensions=w.profile(data, **more), **node)
    return open_scene(w.save(folder), "none")


def only(stage: Stage) -> PunctualLight:
    (light,) = punctual_lights(stage.lights)
    return light


def test_a_light_has_the_candela_of_its_file(tmp_path: Path) -> None:
    data = form("half")
    stage = saved(tmp_path, data, multiplier=0.5, color=[1, 0.5, 7], name="street", translation=[1, 2, 3])
    light, peak = only(stage), values(np.arange(0, 181, 5), np.arange(0, 181, 30)).max()
    assert np.allclose(light.intensity, np.array([1, 0.5, 1]) * 0.5 * peak) and light.position == pytest.approx((1, 2, 3))
    assert isinstance(stage.lights[0].target, gfx.PointLight) and stage.lights[0].target.name == "street"
    assert stage.lights[0].target.decay == 2 and stage.lights[0].target.cast_shadow


@pytest.mark.parametrize("kind", KINDS)
def test_axes_are_those_of_the_extension(kind: str, tmp_path: Path) -> None:
    """Angles 0 are -Z, and 90 degrees of the vertical one are +X; horizontal ones go from +X to +Y, of the types A and B to -Y."""
    vertical, horizontal = KINDS[kind]
    candela = values(vertical, horizontal)
    data = ies(kind, vertical, horizontal, candela)
    light = only(saved(tmp_path, data))
    found = light.colour(np.array([(0.0, 0, -2), (3, 0, 0)]))[:, 0] * light.intensity[0]
    at = list(vertical).index
    first = list(horizontal).index(0)
    assert found[0] == pytest.approx(candela[first, at(0)]) and found[1] == pytest.approx(candela[first, at(90)], rel=1e-6)
    if kind == "C":
        assert light.colour(np.array([0, HALF, -HALF / math.sqrt(3)]))[0] * light.intensity[0] == pytest.approx(candela[1, at(60)])
    else:
        h = horizontal[2]
        aside = np.array([0, -math.sin(math.radians(h)), -math.cos(math.radians(h))])
        assert light.colour(aside)[0] * light.intensity[0] == pytest.approx(candela[2, at(0)])


def test_a_node_turns_its_light_whatever_its_scale(tmp_path: Path) -> None:
    data = form("whole")
    still = only(saved(tmp_path, data))
    turned = only(saved(tmp_path, data, rotation=[0, HALF, 0, HALF], scale=[2, 0.5, 3], translation=[5, 0, 0]))  # -Z to -X
    q = np.random.default_rng(2).normal(size=(50, 3))
    there = np.stack([q[:, 2], q[:, 1], -q[:, 0]], axis=-1)
    assert np.allclose(turned.colour(there + (5, 0, 0)), still.colour(q), atol=1e-6)
    assert turned.intensity == still.intensity


def test_a_light_turns_with_its_animation(tmp_path: Path) -> None:
    w = Writer()
    w.node(mesh=w.mesh(TRIANGLE))
    lamp = w.node(extensions=w.profile(form("axial-down")))
    w.animate(lamp, "rotation", [0, 1], [[0, 0, 0, 1], [0, HALF, 0, HALF]])
    stage = open_scene(w.save(tmp_path), "none")
    ahead = []
    for time in (0.0, 0.999999):
        stage.pose(time, None)
        ahead.append(only(stage).axes()[2])
    assert np.allclose(ahead, [(0, 0, -1), (-1, 0, 0)], atol=1e-4)


def test_files_beside_and_inside(tmp_path: Path) -> None:
    for uri in ("street.ies", "data:application/x-ies-lm-63;base64," + base64.b64encode(form("half")).decode()):
        (tmp_path / "street.ies").write_bytes(form("half"))
        w = Writer()
        w.node(mesh=w.mesh(TRIANGLE))
        w.node(extensions=w.profile(b""))
        w.json["extensions"]["EXT_lights_ies"]["lights"] = [{"uri": uri}]
        assert only(open_scene(w.save(tmp_path), "none")).photometry.kind == "C"


def test_refused_and_told(tmp_path: Path) -> None:
    with pytest.raises(AirlightError, match=r"scene.glb: light profile 0: is no photometric file that Airlight reads; "):
        saved(tmp_path, b"no light")
    w = Writer()
    w.node(mesh=w.mesh(TRIANGLE))
    w.node(extensions=w.profile(form("half")) | w.light(type="point", intensity=5))
    with pytest.warns(AirlightWarning, match="node 1 has a light of EXT_lights_ies and one of KHR_lights_punctual; the first is shown"):
        assert only(open_scene(w.save(tmp_path), "none")).photometry is not None
    w.json["extensions"]["EXT_lights_ies"]["lights"][0]["uri"] = "street.ies"
    with pytest.raises(AirlightError, match="light profile 0 needs either a URI or a buffer view"):
        open_scene(w.save(tmp_path), "none")
    w.json["nodes"][1]["extensions"]["EXT_lights_ies"]["light"] = 3
    with pytest.raises(AirlightError, match="the light profile of node 1"):
        open_scene(w.save(tmp_path), "none")
