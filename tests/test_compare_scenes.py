"""`airlight compare SCENE`: errors, factors, costs and truths against what they are made of, small."""

import dataclasses
import re
import sys
import types
import warnings
from functools import lru_cache

import numpy as np
import pytest

pytest.importorskip("pygfx")
from rasterising import edge_error
from tags import Tags

from airlight.cli import cli, main
from airlight.compare import page, rule, scenes, words
from airlight.compare.variants import IN_SCENES, usual, variant
from airlight.errors import AirlightError, AirlightWarning
from airlight.files import read_image
from airlight.gpu.device import shared_device
from airlight.options import Composite
from airlight.pygfx.panes import is_seen_through
from airlight.reference import tracer
from airlight.reference.medium import Layer
from airlight.scatter.methods import of_medium
from airlight.scenes import open_scene
from airlight.scenes.offline import Shot
from airlight.scenes.replay import Replay
from airlight.scenes.triangles import world_panes, world_triangles

SIZE = (64, 36)
EXACT = "method=march,steps=exact,resolution=1,shadow_size=2048"
STEPS, PICTURE, ARTICLE = "method=march,steps=8,resolution=1,shadow_size=2048", "method=epipolar", "method=article,shadow_size=256"
TEXTS = {"window": (EXACT, STEPS, ARTICLE), "slats": (EXACT, PICTURE)}
TRIANGLES = {"window": 276, "slats": 240}


@lru_cache
def view(name="window"):
    shared_device()  # whose passes are timed
    return scenes.ComparedView(open_scene(name), Shot(*SIZE, samples=1))


def chosen(*texts, name="window"):
    return [variant(text, view(name).stage.settings, True) for text in texts]


@lru_cache
def result(name):
    return scenes.compare(view(name), chosen(*TEXTS[name], name=name), runs=1)


@lru_cache
def traced(name):
    """(light, way) of the tracer, asked by other means."""
    here = view(name)
    air = here.resolved(chosen(EXACT, name=name)[0])
    triangles = world_triangles(here.stage.scene, here.lights)[0]
    found = tracer.layer(here.camera.view_matrix, here.camera.projection_matrix, SIZE, triangles, here.punctual, air)
    return found.radiance, found.path_length


def by_hand(found, truth, way):
    """(rmse, p99, worst, bias, pixels), a pixel at a time."""
    height, width = way.shape
    edge = np.zeros(way.shape, bool)
    for y in range(height):
        for x in range(width):
            for before in ((y - 1, x), (y, x - 1)):
                if min(before) >= 0 and abs(np.log(way[y, x] / way[before])) > 0.05:
                    edge[y, x] = edge[before] = True
    kept = [(y, x) for y in range(height) for x in range(width) if not edge[max(y - 2, 0) : y + 3, max(x - 2, 0) : x + 3].any()]
    off = np.array([found[at] - truth[at] for at in kept])
    mean = np.mean([truth[at] for at in kept])
    order = np.argsort(np.abs(off).sum(axis=1))[: 1 + int(0.99 * (len(kept) - 1))]
    every = np.abs(off) / mean
    return np.sqrt((off[order] ** 2).mean()) / mean, np.percentile(every, 99), every.max(), off.mean() / mean, len(kept)


@pytest.mark.parametrize("name", [pytest.param(name, marks=pytest.mark.slow) if name == "window" else name for name in TEXTS])
def test_errors_are_those_computed_by_hand(name):
    found = result(name)
    truth, way = traced(name)
    for row, v in zip(found.rows, chosen(*TEXTS[name], name=name), strict=True):
        light = view(name).light(v)[0]
        assert np.allclose(row.layer, (row.factor or 1) * light, rtol=1e-5, atol=1e-9)
        *errors, bias, kept = by_hand(np.asarray(row.layer, float), truth, way)
        assert (row.rmse, row.p99, row.worst) == pytest.approx(errors, rel=0.01)
        assert row.bias is None or row.bias == pytest.approx(bias, rel=0.01, abs=1e-5)
        assert kept == found.truths[0].kept < SIZE[0] * SIZE[1]
        assert (row.bias is None) == (row.factor is not None) == (v.parameters.method != "march")
    assert np.allclose(found.truths[0].layer, truth, rtol=1e-5)
    exact, *others = found.rows
    assert exact.rmse < 0.01 and all(row.rmse > 2 * exact.rmse for row in others)
    assert exact.layer.dtype == np.float32 and f"tracer over the scene's {TRIANGLES[name]} triangles" in found.truths[0].about


def test_an_edge_and_the_worst_do_not_count():
    way = np.full((20, 30), 4.0)
    way[:, 20:] = 8.0
    where = rule.clear(way)
    assert where[:, :17].all() and where[:, 23:].all() and not where[:, 17:23].any()
    truth = np.full((20, 30, 3), 2.0)
    found = truth + 0.2
    found[:, 18:22] = 1e9
    found[0, :2] = 100.0  # 2 of 480
    errors = rule.errors(found, truth, where)
    assert errors.rmse == pytest.approx(0.1) and errors.p99 == pytest.approx(0.1) and errors.worst == pytest.approx(49)
    assert errors.bias == pytest.approx((0.1 * 478 + 49 * 2) / 480)


def test_the_factor_is_the_one_that_fits_best():
    truth = np.random.default_rng(1).random((6, 8, 3))
    where = np.ones((6, 8), bool)
    where[0] = False
    found = 4 * truth
    found[0] = 7.0
    assert rule.factor(found, truth, where) == pytest.approx(0.25) and rule.factor(0 * found, truth, where) == 0.0
    light = view("slats").light(chosen(PICTURE, name="slats")[0])[0]
    truth, way = traced("slats")

    def off(factor):
        return ((factor * light - truth)[rule.clear(way)] ** 2).sum()

    best = result("slats").rows[1].factor
    assert best > 0 and off(best) < min(off(0.98 * best), off(1.02 * best))


OTHERWISE = EXACT + ",extinction=false,view_transform=none", EXACT + ",adapt=0.7,mix=0.5"
GLASS = pytest.param("panes", EXACT, marks=pytest.mark.slow)


@pytest.mark.parametrize(("name", "text"), [*(("window", text) for text in (EXACT, *OTHERWISE)), GLASS])
def test_the_truth_is_composited_as_the_renderer_does(name, text):
    here, v = view(name), chosen(text, name=name)[0]
    replay = here.replay(v)
    frame = replay.frame(*here.moment, layer=True)
    layer = Layer(frame.layer[..., :3], frame.layer_transmittance, frame.layer[..., 3])
    mine = here.composited(layer, v)
    off = np.abs(mine - frame.pixels().clip(0, 1))
    assert np.ptp(mine) > 0.2 and off.max() < 0.03 and off.mean() < 0.002
    without = here.composited(layer._replace(radiance=0 * layer.radiance), v)
    assert np.abs(without - frame.pixels().clip(0, 1)).mean() > 5 * off.mean()


@pytest.mark.slow
def test_glass_is_in_the_truth_where_it_is_in_the_picture():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = scenes.compare(view("panes"), chosen(EXACT, EXACT + ",transparency=none", name="panes"), runs=1)
    assert [row.rmse < 0.01 and abs(row.bias) < 0.005 for row in found.rows] == [True, True]
    assert ["386 triangles, 7 of its meshes seen through," in truth.about for truth in found.truths] == [True, False]
    assert np.abs(found.truths[0].layer - found.truths[1].layer).mean() > 0.1 * found.truths[1].layer.mean()


def test_a_truth_without_some_glass_says_so_in_a_line(monkeypatch):
    here = view("panes")
    panes = [thing for thing in here.stage.scene.iter() if getattr(thing, "material", None) is not None and is_seen_through(thing)]
    medium = here.resolved(chosen(EXACT, name="panes")[0])
    found, unknown = world_panes(here.stage.scene, here.lights, panes[:1])
    assert [pane.dims for pane in found] == [False] + [True] * 6 and unknown == []
    assert sorted(round(1 - pane.passed, 3) for pane in found) == [0.3, 0.3, 0.3, 0.35, 0.5, 0.5, 0.65]
    kept = panes[1].material.alpha_mode, panes[2].material.alpha_mode
    try:
        panes[1].material.color_mode = "vertex"  # of which the tracer knows nothing
        panes[1].material.alpha_mode, panes[2].material.alpha_mode = "multiply", "add"  # of which one adds light alone
        with pytest.warns(AirlightWarning, match="truth of the ray tracer lacks 1 thing that is seen through .mesh.: .*--against walk"):
            assert "5 of its meshes" in here.truth(medium, "tracer")[1]
        mitsuba = types.SimpleNamespace(layer=lambda *what: (Layer(*[np.ones((36, 64, 3))] * 2, np.ones((36, 64))), 0.0))
        monkeypatch.setattr(scenes, "mitsuba", mitsuba)
        with pytest.warns(AirlightWarning, match="truth of Mitsuba lacks 6 things that are seen through: .*--against walk"):
            here.truth(medium, "mitsuba")
    finally:
        panes[1].material.color_mode = "auto"
        panes[1].material.alpha_mode, panes[2].material.alpha_mode = kept


def test_the_cost_is_that_of_the_passes_that_make_light():
    rows = [*result("window").rows, result("slats").rows[1]]
    assert [[name for name, _ in row.parts] for row in rows] == [
        ["shadow maps", "march"],
        ["shadow maps", "march"],
        ["shadow maps", "article"],
        ["source", "shafts"],
    ]
    for row in rows:
        assert row.ms == pytest.approx(sum(ms for _, ms in row.parts)) and min(ms for _, ms in row.parts) > 0
    assert [row.copies for row in rows[:3]] == pytest.approx([row.ms / result("window").copy_ms for row in rows[:3]])
    assert re.fullmatch(r"[\d.]+ copies \([\d.]+ ms: shadow maps [\d.]+, march [\d.]+\)", words.cost(rows[0]))
    labels = "merge", "adapt", "panes", "glass", "pane spans", "prepass", "upsample", "march sun", "epipolar scan"
    assert [scenes.part_of(label) for label in labels] == [
        None,
        None,
        None,
        "shadow maps",
        "march",
        "source",
        "march",
        "march",
        "shafts",
    ]


def test_a_cost_without_timestamps_is_the_whole(monkeypatch):
    monkeypatch.setattr(Replay, "spent", lambda self, record=None: (5.0, {}))
    found = scenes.compare(view(), chosen(STEPS), runs=1)
    assert found.rows[0].ms == 5.0 and found.rows[0].parts is None and "(5.0 ms)" in words.cost(found.rows[0])
    assert any("no timestamps" in note for note in words.notes(found, 10.0))


def test_each_medium_has_its_own_truth():
    found = scenes.compare(view(), chosen(EXACT, EXACT + ",sigma_t=0.4"), runs=1)
    assert [row.truth for row in found.rows] == [0, 1] and max(row.rmse for row in found.rows) < 0.01
    assert found.truths[1].layer.mean() != pytest.approx(found.truths[0].layer.mean(), rel=0.05)
    told = [note for note in words.notes(found, 10.0) if note.startswith("Truth of")]
    assert len(told) == 2 and "sigma t 0.4" in told[1]
    shares = ((900, 900, "at 6 % of the pixels"), (900, 9000, "at 6 % (march"))
    for first, second, line in shares:  # of the truths' pixels: which, where they differ
        truths = [dataclasses.replace(truth, kept=kept) for truth, kept in zip(found.truths, (first, second), strict=True)]
        noted = " ".join(words.notes(dataclasses.replace(found, truths=truths, size=(150, 100)), 10.0))
        assert line in noted and ("sigma t 0.4) of the pixels" in noted) is (first != second)
    assert {"before0", "before1"} <= set(re.findall(r"id='(\w+)'", page.page(found, "t", 10.0)))


@pytest.mark.slow
def test_the_walk_where_the_tracer_would_take_too_long(monkeypatch):
    monkeypatch.setattr(scenes, "MAX_SHADOW_SIDE", 2048)
    air = view().resolved(chosen(EXACT)[0])
    (light, transmittance, way), about = view().truth(air, "walk")
    assert np.allclose(transmittance, np.exp(-way[..., None] * air.sigma_t), rtol=1e-5)
    assert "2048 texels, as --against walk asks" in about
    truth, far = traced("window")
    assert rule.errors(light, truth, rule.clear(far)).rmse < 0.01
    if edge_error() <= 1 / 512:
        assert np.allclose(way, far, rtol=1e-3)
    else:  # SwiftShader, which also loses depth of large triangles that pass behind the eye, as those of this room: docs/drivers.md
        assert np.isclose(way, far, rtol=2e-2).mean() > 0.99, np.sort(np.abs(way / far - 1).ravel())[-60:]
    monkeypatch.setattr(scenes, "MAX_TRACED", 0)
    (again, *_), about = view().truth(air, None)
    assert "276 triangles are too many" in about and np.array_equal(again, light)
    monkeypatch.setattr(scenes, "MAX_TRACED", 1e9)
    noisy = view().resolved(variant("noise_amount=3,noise_size=0.02", {}, in_scene=True))
    assert "density that varies so finely is too much" in view().truth(noisy, None)[1]


def test_mitsuba_is_asked_where_it_is_there(monkeypatch):
    asked = []

    def layer(view, projection, size, triangles, lamps, air, casters=None, *, spp=256):
        asked.append((size, triangles.shape, casters.shape, [lamp.word for lamp in lamps]))
        found = tracer.layer(view, projection, size, triangles, lamps, air, casters)
        light = 1.02 * found.radiance
        return found._replace(radiance=light), np.full_like(light, 0.0013 * light[rule.clear(found.path_length)].mean())

    monkeypatch.setattr(scenes, "mitsuba", types.SimpleNamespace(layer=layer, ready=lambda: None))
    found = scenes.compare(view(), chosen(EXACT), against="mitsuba", runs=1)
    assert asked == [(SIZE, (276, 3, 3), (276, 3, 3), ["sun"])]
    assert found.rows[0].bias == pytest.approx((1 + result("window").rows[0].bias) / 1.02 - 1, abs=1e-4)
    assert "noise alone makes an error of 0.13 %" in found.truths[0].about


def test_what_goes_with_a_scene():
    found, lacking = usual(view("slats").stage.settings, True, view("slats").lacks)
    assert {v.parameters.method for v in found} == {*of_medium(), "epipolar", "radial"} - {"article", "article-prose"}
    assert {text.partition(",")[0] for text in IN_SCENES} >= {"method=march", "method=slices", "method=slices-printed"}
    assert lacking == [f"{name}: it takes one light, a sun (here: spot)" for name in ("article", "article-prose")]
    dark = view("window")
    assert not dark.in_view
    found, lacking = usual(dark.stage.settings, True, dark.lacks)
    earlier = [f"slices-{kind}: it takes projectors and spots (here: sun)" for kind in ("extruded", "diced", "thickness")]
    assert {v.parameters.method for v in found} == {m for m in of_medium() if not any(m == text.split(":")[0] for text in earlier)}
    assert [reason for reason in lacking if "before the eye" not in reason] == earlier and len(lacking) == 6
    assert variant("vesper-scene", {}, True).parameters.method != "march"  # a preset may hold what means nothing there
    assert variant("blend=add", {}).composite == Composite(blend="add")


def test_excluded_casts_nothing_and_is_seen():
    stage = view("headlamp").stage
    seen, casting = world_triangles(stage.scene, stage.lights)
    hidden = [thing for thing in stage.scene.iter() if getattr(thing, "geometry", None) is not None][:1]
    again, fewer = world_triangles(stage.scene, stage.lights, hidden)
    assert np.array_equal(seen, again) and 0 < len(fewer) < len(casting)


@pytest.mark.parametrize("text", ["fog=exponential", "noise_amount=2,wind=1/0/0", "basin_level=3", "sun_extinction=none", "steps=16"])
def test_what_only_a_medium_has_asks_for_march(text):
    """As in `airlight render`; a method that is said beside it is kept, and refused; what is no medium's asks for none."""
    assert variant(text, {}, True).parameters.method == "march"
    for base, own in (({"method": "epipolar"}, text), ({}, f"method=epipolar,{text}")):
        with pytest.raises(AirlightError, match=r"means nothing with method epipolar: leave it out, or add method=.*march"):
            variant(own, base, True)
    assert variant("exposure=0.1", {}, True).parameters.method == "epipolar"


def test_options_are_those_of_render_and_image():
    own = {option.name: option for option in cli.commands["compare"].params}
    for command, names in (("render", ("eye", "time", "sun", "medium", "steps", "sigma_t")), ("image", ("mask", "angles", "threshold"))):
        theirs = {option.name: option for option in cli.commands[command].params}
        assert all(own[name] is theirs[name] for name in names)
    assert own["width"].default == 480 and next(p for p in cli.commands["render"].params if p.name == "width").default == 1280


BAD = [
    ("slat", [], "did you mean 'slats'?"),
    ("nosuch", [], "scenes are table"),
    ("nosuch.glb", [], "nosuch.glb"),
    ("slats", ["--variant", "method=article"], "a sun (here: spot)"),
    ("slats", ["--variant", "stepss=3"], "did you mean 'steps'"),
    ("slats", ["--variant", "steps=0"], "steps"),
    ("slats", ["--variant", "method=epipolar,steps=3"], "means nothing with method epipolar"),
    ("slats", ["--variant", "method=march,scale=0.5"], "for pictures"),
    ("slats", ["--variant", "volume=smoke.npz"], "give --volume beside --variant"),
    ("table", ["--method", "epipolar", "--variant", "fog=linear"], "fog means nothing with method epipolar"),
    ("slats", ["--against", "mitsuba"], "pip install 'airlight[validate]'"),
    ("slats", ["--against", "tracr"], "tracer"),
    ("slats", ["--mask", "m.png"], "--mask goes with a picture"),
    ("slats", ["--angle", "30"], "--angle goes with a picture"),
    ("slats", ["--light", "0.4,0.3"], "x,y,z"),
    ("slats", ["--camera", "nosuch"], "it has room"),
    ("slats", ["--camera", "room", "--eye", "1,2,3"], "exclude each other"),
    ("slats", ["--target", "1,2,3"], "--eye"),
    ("slats", ["--seed", "3"], "seed"),
    ("slats", ["--sigma-t", "0"], "scatters no light"),
    ("slats", ["--exclude", "nosuch"], "no object of that name"),
    ("table", ["--against", "tracer", "--variant", "method=march,steps=2"], "--against walk"),
    ("in.png", ["--camera", "room"], "--camera goes with a scene"),
    ("in.png", ["--medium", "mist"], "--medium goes with a scene"),
    ("in.png", ["--against", "walk"], "--against goes with a scene"),
    ("in.png", ["--light", "1,2,3"], "x,y"),
    ("in.png", ["--variant", "steps=3"], "for scenes"),
]


@pytest.mark.parametrize(("source", "options", "says"), BAD)
def test_what_cannot_be_compared_is_one_line(tmp_path, capsys, monkeypatch, source, options, says):
    monkeypatch.setitem(sys.modules, "mitsuba", None)  # as where it is not installed
    assert main(["compare", source, "-o", str(tmp_path / "out.html"), *options, *(["--width", "32"] * (".png" not in source))]) == 2
    out, err = capsys.readouterr()
    lines = [line for line in err.splitlines() if not line.startswith("left out: ")]
    assert out == "" and len(lines) == 1 and lines[0].startswith("airlight: ") and says in lines[0]
    assert not list(tmp_path.iterdir())


def test_page_and_sheet_of_a_scene(tmp_path, capsys):
    out = tmp_path / "out.html"
    command = ["compare", "mirrored", "--width", "64", "--runs", "1", "--variant", EXACT, "--variant", "method=epipolar"]
    assert main([*command, "-o", str(out)]) == 0
    told = capsys.readouterr().out.splitlines()
    text = out.read_text(encoding="utf-8")
    tags = Tags()
    tags.feed(text)
    tags.close()
    assert not tags.open and tags.rows == 3 and len(tags.loaded) == 2 + 2 * 3  # truth, its light; picture, light, difference of each
    assert all(uri.startswith("data:image/jpeg;base64,") for uri in tags.loaded)
    assert "mirrored, 64 × 36: light in the air compared" in text and "156 triangles" in text and "shadow maps" in text
    assert re.findall(r'data-over="(\w+)"', text) == ["before0"] * 2 and text.count("id='before0'") == 1
    assert len(told) == 2 and all(re.search(r"error +([\d.]+ %)", line)[1] in text for line in told)
    assert main([*command, "-o", str(out)]) == 2 and "--overwrite" in capsys.readouterr().err
    assert main([*command, "-o", str(tmp_path / "page"), "--html"]) == 0
    assert "156 triangles" in (tmp_path / "page").read_text(encoding="utf-8")
    assert main([*command, "-o", str(tmp_path / "out.png"), "--amplify", "5"]) == 0
    assert read_image(tmp_path / "out.png").codes.shape[1] > 2 * SIZE[0]


def test_nothing_to_measure_is_said():
    with pytest.raises(AirlightError, match="edge of depth"):
        small = scenes.ComparedView(open_scene("slats"), Shot(4, 2, samples=1))
        scenes.compare(small, [variant(EXACT, small.stage.settings, True)], runs=1)
