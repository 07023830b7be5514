"""The looks by the command line: which is chosen, what is kept in settings, depths and subjects, where the light may be, what EXRs hold."""

import json
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
import thumbs
from test_compositing import AP1, load, store

import airlight
from airlight import api
from airlight.cli import main
from airlight.composite.blend import auto_levels_of, blend, resolve
from airlight.detect import ASK
from airlight.files import encode, read_image, read_settings, to_linear, write_image
from airlight.options import Composite
from airlight.reference import radial as reference

LIGHT = ["--light", "0.52,0.42"]
SHAPE = thumbs.linear().shape[:2]


@pytest.fixture(scope="module")
def shots(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Pictures, and planes beside them: near.png, black on the left; far.png, its inverse; subject.png, white in the middle."""
    folder = tmp_path_factory.mktemp("shots")
    for name in (thumbs.OPENING, thumbs.SUN, "dandelions", "night-light-frames"):
        write_image(folder / f"{name}.png", None, encoded=thumbs.codes(name))
    write_image(folder / "dark.png", None, encoded=np.full((*SHAPE, 3), 9, np.uint8))
    column = np.repeat((np.arange(SHAPE[1]) >= SHAPE[1] // 2)[None, :], SHAPE[0], axis=0)
    for name, plane in (("near", column), ("far", ~column), ("subject", plane_of_subject())):
        write_image(folder / f"{name}.png", None, encoded=np.repeat((255 * plane).astype(np.uint8)[..., None], 3, axis=2))
    return folder


def plane_of_subject() -> np.ndarray:
    plane = np.zeros(SHAPE, bool)
    plane[SHAPE[0] // 2 :, SHAPE[1] // 4 : 3 * SHAPE[1] // 4] = True
    return plane


@pytest.fixture
def photo(shots: Path) -> Path:
    return shots / f"{thumbs.OPENING}.png"


def call(*args: object) -> int:
    return main(["image", *map(str, args)])


def run(capsys: pytest.CaptureFixture[str], *args: object) -> str:
    """What a run that does its work says on stderr."""
    assert call(*args) == 0
    out, said = capsys.readouterr()
    assert out == ""
    return said


def refused(capsys: pytest.CaptureFixture[str], *args: object) -> str:
    assert main([str(a) for a in args]) == 2
    out, said = capsys.readouterr()
    assert out == "" and said.startswith("airlight: ") and said.count("\n") == 1, said
    return said


def codes(path: Path) -> np.ndarray:
    return read_image(path).codes


def layer_of(path: Path) -> np.ndarray:
    _, channels = load(path)
    return np.stack([channels[f"airlight.{name}"] for name in "RGB"], axis=2)


# ---------------------------------------------------------------- settings


@pytest.mark.parametrize(
    ("extension", "args"),
    [
        ("png", []),
        ("jpg", ["--depth", "near.png", "--near-range", "0.1,0.9"]),
        ("exr", ["--depth", "far.png", "--depth-near", "white", "--light", "auto:1+", "--shade", "0.2"]),
        ("png", ["--depth", "near.png", "--no-depth-aware"]),
        ("tif", ["--subject", "subject.png", "--wrap", "0.7", "--strength", "0.6"]),
        ("png", ["--rays", "9", "--rays-seed", "3", "--rays-shimmer", "0.25", "--light", "0.6,0.2;kind=glow;color=1,0.8,0.6"]),
        ("exr", ["--preset", "dramatic", "--fineness", "1.5", "--length", "0.3", "--warmth", "-0.4", "--quality", "draft", "--mist", "1"]),
        ("png", ["--mask", "near.png", "--mask-invert", "--light", "0.5,0.4;strength=2", "--light", "-0.2,0.1"]),
    ],
)
def test_settings_of_the_smart_look_repeat_to_the_byte(shots, photo, tmp_path, capsys, monkeypatch, extension, args):
    monkeypatch.chdir(shots)
    one, two = (tmp_path / f"{name}.{extension}" for name in ("one", "two"))
    said = run(capsys, photo, "-o", one, *args)
    held = json.loads(read_settings(one))
    assert held["look"] == "smart" and (("light at" in said) == ("--light" not in args or "auto:1+" in args))
    if "light at" in said:
        assert held["light"][0].endswith(";kind=opening")  # found: what it is, and where
    assert "light at" not in run(capsys, photo, "-o", two, "--settings-from", one)
    assert two.read_bytes() == one.read_bytes()
    plain = tmp_path / f"plain.{extension}"
    if args and "--no-depth-aware" not in args:  # each option shapes the result
        run(capsys, photo, "-o", plain)
        assert not np.array_equal(codes(plain), codes(one))


def test_settings_from_before_there_were_looks_are_of_the_sum(photo, tmp_path, capsys):
    old, classic = tmp_path / "old.png", tmp_path / "classic.png"
    for settings, args in (
        ('{"light": ["0.5,0.4"]}', []),
        ('{"decay": 0.9, "light": ["0.5,0.4"], "samples": 60}', ["--decay", "0.9", "--samples", "60"]),
        ('{"light": ["0.5,0.4"], "quality": "draft"}', ["--quality", "draft"]),
    ):
        write_image(old, None, encoded=codes(photo), settings=settings, overwrite=True)
        run(capsys, photo, "-o", classic, "-y", "--light", "0.5,0.4", "--look", "classic", *args)
        run(capsys, photo, "-o", tmp_path / "again.png", "-y", "--settings-from", old)
        assert (tmp_path / "again.png").read_bytes() == classic.read_bytes()
        assert json.loads(read_settings(classic))["look"] == "classic"
        assert "strength" in refused(capsys, "image", photo, "-o", tmp_path / "no.png", "--settings-from", old, "--strength", "2")
    run(capsys, photo, "-o", tmp_path / "smart.png", *LIGHT)
    for more in (["--samples", "9"], ["--preset", "classic-soft"], ["--look", "smart", "--preset", "pmndrs"]):
        refused(capsys, "image", photo, "-o", tmp_path / "no.png", "--settings-from", tmp_path / "smart.png", *more)
    assert not (tmp_path / "no.png").exists()


# ---------------------------------------------------------------- which look


@pytest.mark.parametrize(
    ("args", "says"),
    [
        (["--strength", "1", "--samples", "9"], "samples belongs to the classic look, strength does not"),
        (["--look", "smart", "--exposure", "1.5"], "exposure belongs to the classic look"),
        (["--look", "classic", "--mist", "0.5"], "mist belongs to the smart look"),
        (["--angle", "30", "--strength", "1"], "--angle belongs to the classic look"),
        (["--preset", "natural", "--threshold", "1"], "threshold belongs to the classic look"),
        (["--preset", "natural", "--look", "classic"], "strength belongs to the smart look"),
        (["--preset", "classic-soft", "--rays", "3"], "classic look, rays does not"),
        (["--preset", "both.toml"], "samples belongs to the classic look, strength does not"),
        (["--preset", "smart.toml", "--blend", "add"], "blend belongs to the classic look"),
        (["--preset", "classic.toml", "--look", "smart"], "samples belongs to the classic look"),
        (["--preset", "classic.toml", "--warmth", "0"], "samples belongs to the classic look, warmth does not"),
        (["--debug", "mask", "--strength", "1"], "--debug belongs to the classic look"),
        (["--occlusion-fraction", "f.png", "--shade", "0.5"], "--occlusion-fraction belongs to the classic look"),
        (["--depth", "near.png", "--occlusion", "depth", "--fineness", "1"], "occlusion belongs to the classic look"),
        (["--subject", "subject.png", "--look", "classic"], "--subject is for the smart look"),
        (["--subject", "subject.png", "--decay", "0.9"], "--subject is for the smart look"),
        (["--wrap", "0.5"], "add --subject FILE"),
        (["--near-range", "0.1,0.5"], "add --depth FILE"),
        (["--no-depth-aware"], "add --depth FILE"),
        (["--depth", "near.png", "--look", "classic", "--near-range", "0.1,0.5"], "leave the classic look"),
        (["--depth", "near.png", "--near-range", "0.5,0.1"], "the first the smaller"),
        (["--depth", "near.png", "--near-range", "low,high"], "two numbers"),
        (["--depth", "near.png", "--depth-layer", "Z"], "--depth and --depth-layer say the same thing"),
        (["--subject", "near.png", "--subject-layer", "Z"], "--subject and --subject-layer say the same thing"),
        (["--depth-layer", "Z"], "has no channel 'Z'"),
        (["--subject-layer", "Z"], "has no channel 'Z'"),
        (["--depth", "small.png"], "the depth is 5 x 4 pixels, the image 96 x 64"),
        (["--subject", "small.png"], "the subject is 5 x 4 pixels, the image 96 x 64"),
        (["--mask", "small.png"], "the mask is 5 x 4 pixels, the image 96 x 64"),
    ],
)
def test_what_does_not_go_together_is_refused_in_one_line(shots, photo, tmp_path, capsys, monkeypatch, args, says):
    monkeypatch.chdir(tmp_path)
    for name in ("near", "subject"):
        (tmp_path / f"{name}.png").write_bytes((shots / f"{name}.png").read_bytes())
    write_image(tmp_path / "small.png", None, encoded=np.zeros((4, 5, 3), np.uint8))
    for name, text in {"both": "strength = 1.0\nsamples = 9", "smart": "mist = 0.2", "classic": "samples = 9"}.items():
        (tmp_path / f"{name}.toml").write_text(text)
    light = [] if "--angle" in args else LIGHT
    before = sorted(tmp_path.iterdir())
    assert says in refused(capsys, "image", photo, "-o", "out.png", *light, *args)
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.parametrize(
    ("command", "says"),
    [
        (["render", "box", "--preset", "natural"], "belongs to a look, which a scene has not"),
        (["render", "box", "--strength", "1"], "--strength"),
        (["compare", "PHOTO", "--variant", "strength=1"], "which a comparison of methods has not"),
        (["compare", "PHOTO", "--variant", "misty", "--variant", "samples=9"], "which a comparison of methods has not"),
        (["compare", "PHOTO", "--preset", "soft"], "which a comparison of methods has not"),
    ],
)
def test_looks_are_of_pictures_alone(photo, tmp_path, capsys, command, says):
    words = [str(photo) if word == "PHOTO" else word for word in command]
    assert says in refused(capsys, *words, "-o", tmp_path / "out.png")
    assert not list(tmp_path.iterdir())


def test_quality_is_of_both_looks(photo, tmp_path, capsys):
    run(capsys, photo, "-o", tmp_path / "a.png", *LIGHT, "--quality", "draft")
    assert json.loads(read_settings(tmp_path / "a.png"))["look"] == "smart"
    run(capsys, photo, "-o", tmp_path / "b.png", *LIGHT, "--quality", "draft", "--look", "classic")
    assert json.loads(read_settings(tmp_path / "b.png"))["look"] == "classic"
    assert (tmp_path / "a.png").read_bytes() != (tmp_path / "b.png").read_bytes()


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
def test_the_classic_look_is_what_the_default_was(photo, tmp_path, capsys, dtype):
    """The sum of `light_shafts`, put on the picture as ever; the same whether it is named or implied."""
    linear = thumbs.linear()
    image = {"f4": linear.copy(), "u1": thumbs.codes()}.get(np.dtype(dtype).str[1:], encode(linear, np.uint16))
    classic = airlight.add_light_shafts(image, (0.52, 0.42), look="classic")
    for implied in ({"exposure": 1.5}, {"samples": 100, "density": 0.97}, {"occlusion": "luminance"}, {"blend": "auto"}):
        assert np.array_equal(classic, airlight.add_light_shafts(image, (0.52, 0.42), **implied))
    assert not np.array_equal(classic, airlight.add_light_shafts(image, (0.52, 0.42)))
    layer = np.asarray(airlight.light_shafts(image, (0.52, 0.42)))
    if dtype == np.float32:
        assert np.array_equal(classic, image + layer)
        return
    values = to_linear(image)[0]
    out, added = blend(values, layer, auto_levels_of(values, layer, resolve(Composite(), False)))
    expected = encode(out, dtype, added.any(axis=2), image)
    assert np.abs(expected.astype(int) - classic.astype(int)).max() <= (1 if dtype == np.uint8 else 300)
    if dtype == np.uint8:
        for name, more in (("a", ["--look", "classic"]), ("b", ["--exposure", "1.5"])):
            run(capsys, photo, "-o", tmp_path / f"{name}.png", *LIGHT, *more)
            assert np.array_equal(codes(tmp_path / f"{name}.png"), classic)


# ---------------------------------------------------------------- depths and subjects


@pytest.mark.parametrize("more", [[], ["--near-range", "0.2,0.5"]])
def test_depths_in_metres_within_an_exr(tmp_path, capsys, more):
    """Shafts pass behind the near half; the sky is infinitely far."""
    depth = np.full((*SHAPE, 1), 80, np.float32)
    depth[:, : SHAPE[1] // 2] = np.linspace(1.5, 1.6, SHAPE[1] // 2)[:, None]
    depth[: SHAPE[0] // 4, SHAPE[1] // 2 :] = np.inf
    pixels = np.concatenate([thumbs.linear(), depth], axis=2)
    source = store(tmp_path / "in.exr", pixels, "RGBZ", ["half"] * 3 + ["float"])
    run(capsys, source, "-o", tmp_path / "free.exr", *LIGHT)
    run(capsys, source, "-o", tmp_path / "out.exr", *LIGHT, "--depth-layer", "Z", *more)
    free, layer = layer_of(tmp_path / "free.exr"), layer_of(tmp_path / "out.exr")
    half = SHAPE[1] // 2
    assert free[:, :half].max() > 0.02 and layer[:, half:].max() > 0.02
    assert layer[:, : half - 1].max() == 0 and layer[: SHAPE[0] // 4, half:].max() > 0
    run(capsys, source, "-o", tmp_path / "off.exr", *LIGHT, "--depth-layer", "Z", "--no-depth-aware")
    assert np.array_equal(layer_of(tmp_path / "off.exr"), free)
    assert "did you mean 'Z'" in refused(capsys, "image", source, "-o", tmp_path / "no.exr", *LIGHT, "--depth-layer", "ZZ")
    assert np.array_equal(load(tmp_path / "out.exr")[1]["Z"], depth[..., 0])


def test_depth_maps_either_way_round(shots, photo, tmp_path, capsys):
    for name, more in (("near", []), ("far", ["--depth-near", "white"])):
        run(capsys, photo, "-o", tmp_path / f"{name}.exr", *LIGHT, "--depth", shots / f"{name}.png", *more)
    layer = layer_of(tmp_path / "near.exr")
    assert layer[:, : SHAPE[1] // 2 - 1].max() == 0 and layer[:, SHAPE[1] // 2 + 1 :].max() > 0.02
    assert np.array_equal(layer, layer_of(tmp_path / "far.exr"))


def test_depths_that_emit_are_of_the_sum(shots, photo, tmp_path, capsys):
    run(capsys, photo, "-o", tmp_path / "a.png", *LIGHT, "--depth", shots / "near.png", "--occlusion", "depth")
    held = json.loads(read_settings(tmp_path / "a.png"))
    assert (held["look"], held["occlusion"]) == ("classic", "depth")
    far = codes(shots / "near.png")[..., 0].astype(np.float32) / 255
    expected = airlight.add_light_shafts(codes(photo), (0.52, 0.42), occlusion="depth", depth=far)
    assert np.array_equal(codes(tmp_path / "a.png"), expected)
    run(capsys, photo, "-o", tmp_path / "b.png", *LIGHT, "--depth", shots / "near.png", "--look", "classic")  # what else for?
    assert np.array_equal(codes(tmp_path / "b.png"), expected)


def test_shafts_pass_behind_a_subject_and_wrap_round_its_edge(shots, photo, tmp_path, capsys):
    subject = plane_of_subject()
    edge = subject.copy()
    edge[SHAPE[0] // 2 + 2 :, SHAPE[1] // 4 + 2 : 3 * SHAPE[1] // 4 - 2] = False
    deep = np.zeros_like(subject)
    deep[SHAPE[0] // 2 + 12 :, SHAPE[1] // 4 + 12 : 3 * SHAPE[1] // 4 - 12] = True
    layers = []
    for wrap in ("0", "1"):
        out = tmp_path / f"{wrap}.exr"
        run(capsys, photo, "-o", out, *LIGHT, "--subject", shots / "subject.png", "--wrap", wrap, "--mist", "1")
        layers.append(layer_of(out).max(axis=2))
    hard, soft = layers
    assert hard[subject].max() == 0 and hard[~subject].max() > 0.02
    assert soft[edge].max() > 0.001 and soft[deep].max() < 0.1 * soft[edge].max() and (soft[subject] >= 0).all()


# ---------------------------------------------------------------- where the light may be


def test_candidates_are_shown_and_listed(shots, tmp_path, capsys):
    source, sheet, listed = shots / "dandelions.png", tmp_path / "sheet.png", tmp_path / "list.json"
    said = run(capsys, source, "--candidates", sheet)
    found = [line for line in said.splitlines() if line[0].isdigit()]
    assert len(found) >= 2 and found[0].startswith("1: 0.5") and "glow, confidence 0." in found[0] and found[1].startswith("2: ")
    assert codes(sheet).shape == codes(source).shape and not np.array_equal(codes(sheet), codes(source))
    assert [p.name for p in tmp_path.iterdir()] == ["sheet.png"]
    run(capsys, source, "--candidates", listed, "-o", tmp_path / "out.png")
    places = json.loads(listed.read_text())
    assert len(places) == len(found) and set(places[0]) == {"position", "kind", "confidence", "guess", "lamps"}
    assert places[0]["confidence"] >= places[1]["confidence"]
    assert [f"{v:.3f}" for v in places[0]["position"]] == found[0].split()[1].split(",")
    assert not np.array_equal(codes(tmp_path / "out.png"), codes(source))
    for path in (sheet, listed):
        old = path.read_bytes()
        assert "exists already" in refused(capsys, "image", source, "--candidates", path)
        assert path.read_bytes() == old
        run(capsys, source, "--candidates", path, "-y")
        assert path.read_bytes() == old


def test_candidates_that_cannot_be_shown(shots, photo, tmp_path, capsys):
    out = tmp_path / "sheet.png"
    for sources in ([photo, shots / "dandelions.png"], [shots / "shot.####.png"]):
        assert "--candidates shows one picture" in refused(capsys, "image", *sources, "--candidates", out)
    assert "input" in refused(capsys, "image", photo, "--candidates", photo, "-y")
    assert ".xyz" in refused(capsys, "image", photo, "--candidates", tmp_path / "sheet.xyz")
    assert "does not exist" in refused(capsys, "image", photo, "--candidates", tmp_path / "no" / "sheet.json")
    assert not list(tmp_path.iterdir())
    assert "no light found: give --light X,Y" in run(capsys, shots / "dark.png", "--candidates", tmp_path / "none.json")
    assert json.loads((tmp_path / "none.json").read_text()) == []


def test_the_next_place_and_the_best_together(shots, tmp_path, capsys):
    source = shots / "dandelions.png"
    found = airlight.detect.find_lights(codes(source))

    def lights(name: str, text: str) -> list[str]:
        run(capsys, source, "-o", tmp_path / name, "--light", text)
        return json.loads(read_settings(tmp_path / name))["light"]

    def near(text: str, place: tuple[float, float]) -> bool:
        return np.allclose([float(v) for v in text.split(";")[0].split(",")], place, atol=1e-3)

    (second,) = lights("a.png", "auto:2")
    assert near(second, found[1].position) and second.endswith(f";kind={found[1].kind}")
    both = lights("b.png", "auto:2+")
    assert len(both) == 2 and all(near(text, one.position) for text, one in zip(both, found, strict=False))
    line = refused(capsys, "image", source, "-o", tmp_path / "c.png", "--light", "auto:9")
    assert f"only {len(found)} places look like a light" in line and "--candidates FILE" in line and not (tmp_path / "c.png").exists()
    source = shots / "night-light-frames.png"
    lamps = lights("d.png", "auto:3+")
    assert len(lamps) == 3 and all(text.endswith(";kind=lamps") for text in lamps)


def test_an_unsure_light_leaves_the_bytes_of_a_jpeg(shots, tmp_path, capsys):
    """And everything that is no JPEG its codes; the exit code is 0, so that a batch goes on."""
    from airlight.detect import find_lights

    assert not find_lights(codes(shots / "dark.png")) or find_lights(codes(shots / "dark.png"))[0].confidence < ASK
    jpeg = oiio.ImageOutput.create("jpeg")
    assert jpeg.open(str(tmp_path / "in.jpg"), oiio.ImageSpec(96, 64, 3, "uint8"))
    assert jpeg.write_image(np.full((64, 96, 3), 9, np.uint8)) and jpeg.close()
    for look in ("smart", "classic"):
        said = run(capsys, tmp_path / "in.jpg", "-o", tmp_path / "out.jpg", "-y", "--look", look)
        assert said.endswith("in.jpg: no light found, left as it is: give --light X,Y\n") and said.count("\n") == 1
        assert (tmp_path / "out.jpg").read_bytes() == (tmp_path / "in.jpg").read_bytes()
    store(tmp_path / "in.exr", np.full((64, 96, 4), 0.01, np.float32), "RGBA", "float")
    run(capsys, tmp_path / "in.exr", "-o", tmp_path / "out.exr")
    assert np.array_equal(codes(tmp_path / "in.exr"), codes(tmp_path / "out.exr")) and layer_of(tmp_path / "out.exr").max() == 0
    run(capsys, shots / "dark.png", "-o", tmp_path / "out.png", "--layer", tmp_path / "layer.png")
    assert np.array_equal(codes(shots / "dark.png"), codes(tmp_path / "out.png")) and codes(tmp_path / "layer.png").max() == 0


# ---------------------------------------------------------------- what is written


@pytest.mark.parametrize("kind", ["half", "float"])
@pytest.mark.parametrize("space", [{}, {"chromaticities": AP1}])
def test_an_exr_is_the_picture_plus_its_layer(tmp_path, capsys, kind, space):
    """To the last bit by default, also in ACEScg; with a shade it is not, and the picture gets darker between the shafts."""
    source = store(tmp_path / "in.exr", 2 * thumbs.linear(), kind=kind, **space)  # some of it above white
    _, was = load(source)
    run(capsys, source, "-o", tmp_path / "out.exr", *LIGHT)
    _, now = load(tmp_path / "out.exr")
    sort = np.float16 if kind == "half" else np.float32
    for name in "RGB":
        layer = now[f"airlight.{name}"]
        assert layer.max() > 0.02 and (space or layer.min() >= 0)
        np.testing.assert_array_equal(now[name], (was[name] + layer).astype(sort))
    run(capsys, source, "-o", tmp_path / "shaded.exr", *LIGHT, "--shade", "0.5")
    _, shaded = load(tmp_path / "shaded.exr")
    assert (shaded["G"] < 0.98 * was["G"]).mean() > 0.02
    assert (shaded["G"] < 0.98 * (was["G"] + shaded["airlight.G"])).mean() > 0.02
    assert min(shaded[name].min() for name in "RGB") > 0


def test_the_light_has_one_colour_in_any_space(tmp_path, capsys):
    """Of the same colours in ACEScg the same light, but for how the file is rounded."""
    from airlight.files import spaces

    to_709 = spaces.to_rec709(AP1)
    in_ap1 = thumbs.linear() @ np.linalg.inv(to_709).T.astype(np.float32)
    run(capsys, store(tmp_path / "a.exr", thumbs.linear(), kind="float"), "-o", tmp_path / "oa.exr", *LIGHT)
    run(capsys, store(tmp_path / "b.exr", in_ap1, kind="float", chromaticities=AP1), "-o", tmp_path / "ob.exr", *LIGHT)
    one, other = layer_of(tmp_path / "oa.exr"), layer_of(tmp_path / "ob.exr") @ to_709.T.astype(np.float32)
    np.testing.assert_allclose(other, one, atol=0.01 * one.max())


def test_a_layer_of_8_bits_holds_what_is_added_alone(photo, tmp_path, capsys):
    run(capsys, photo, "-o", tmp_path / "out.png", *LIGHT, "--layer", tmp_path / "layer.png", "--shade", "1")
    before, after, layer = (read_image(path).linear() for path in (photo, tmp_path / "out.png", tmp_path / "layer.png"))
    assert layer.max() > 0.02 and (after < 0.9 * before - 0.004).any()  # it gets darker too
    assert (after <= before + layer + 0.02).all() and (layer <= after + 0.02).all()
    darker = (after < 0.9 * before - 0.004).all(axis=2)
    assert layer[darker].max() < 0.25 * layer.max()


def test_a_sequence_keeps_what_its_first_frame_settled(tmp_path, capsys, monkeypatch):
    """The second frame is darker and blue: its strength, tones and the colour of its light are the first's; alone they would not be."""
    for i, factor in ((1, (1, 1, 1)), (2, (0.2, 0.4, 0.8))):
        write_image(tmp_path / f"f.{i:04d}.exr", thumbs.linear() * np.float32(factor))
    held, true = [], api.render_look

    def look(*args, **more):
        done = true(*args, **more)
        held.append(done.held)
        return done

    monkeypatch.setattr(api, "render_look", look)
    run(capsys, tmp_path / "f.#.exr", "-o", tmp_path / "o.#.exr")
    run(capsys, tmp_path / "f.0002.exr", "-o", tmp_path / "alone.exr")
    first, second, alone = held
    for name in ("strength", "shade"):
        assert getattr(first, name) == getattr(second, name)
    settings = [one.lights[0].settings for one in held]
    for name in ("color", "tones", "length", "deviation"):
        assert getattr(settings[0], name) == getattr(settings[1], name), name
    assert alone.strength != first.strength and settings[2].color != settings[0].color
    one, two, other = (layer_of(tmp_path / f"{name}.exr").reshape(-1, 3) for name in ("o.0001", "o.0002", "alone"))
    assert one.max() > 0.02 and two.max() > 0.02 and np.abs(two - other).max() > 0.1 * two.max()


@pytest.mark.parametrize("extension", ["png", "tif", "exr", "jpg"])
def test_no_strength_gives_the_inputs_codes(tmp_path, capsys, extension):
    source, out = tmp_path / f"in.{extension}", tmp_path / f"out.{extension}"
    write_image(source, thumbs.linear())
    for more in (["--strength", "0"], ["--light", "0.5,0.4;strength=0"]):
        said = run(capsys, source, "-o", out, "-y", *(LIGHT if more[0] == "--strength" else []), *more)
        assert said == f"{source}: hardly changed: the strength is 0\n"
        assert np.array_equal(codes(out), codes(source))


# ---------------------------------------------------------------- what is told


def test_a_light_typed_in_pixels_without_saying_so(photo, tmp_path, capsys):
    for more in ([], ["--look", "classic"]):
        said = run(capsys, photo, "-o", tmp_path / "a.png", "-y", "--light", "400,300", *more)
        assert "the light 400,300 lies 400 pictures away: where pixels are meant, write 400px,300px\n" in said
        assert "pictures away" not in run(capsys, photo, "-o", tmp_path / "a.png", "-y", "--light", "40px,30px", *more)
        assert "pictures away" not in run(capsys, photo, "-o", tmp_path / "a.png", "-y", "--light", "1.5,-3", *more)


def test_what_is_hardly_changed_is_told_with_its_cure(photo, tmp_path, capsys):
    write_image(tmp_path / "opaque.png", None, encoded=codes(photo), alpha=np.ones(SHAPE, np.float32))
    assert codes(tmp_path / "opaque.png").shape[2] == 4
    for source, args, says in (
        (photo, ["--threshold", "3"], "little or nothing is as bright as --threshold 3; lower it"),
        (tmp_path / "opaque.png", ["--occlusion", "alpha"], "--occlusion alpha lets little or no light through; try --occlusion luminance"),
        (photo, ["--exposure", "0"], "weight or exposure is 0"),
        (photo, ["--weight", "0"], "weight or exposure is 0"),
        (photo, ["--mix", "0"], "raise --exposure, lower --threshold, or leave the options of the sum out for the smart look"),
        (photo, ["--strength", "0.01"], "--strength 2 shows more"),
    ):
        said = run(capsys, source, "-o", tmp_path / "out.png", "-y", *LIGHT, *args)
        assert said == f"{source}: hardly changed: {says}\n"
        assert np.abs(codes(tmp_path / "out.png").astype(int) - codes(source)).max() <= 2
    assert run(capsys, photo, "-o", tmp_path / "out.png", "-y", *LIGHT) == ""
    assert run(capsys, photo, "-o", tmp_path / "out.png", "-y", *LIGHT, "--look", "classic") == ""


def test_floats_above_white_are_changed_where_codes_would_not_be(tmp_path, capsys):
    store(tmp_path / "in.exr", np.full((20, 30, 3), 2, np.float32))
    assert run(capsys, tmp_path / "in.exr", "-o", tmp_path / "a.exr", *LIGHT, "--occlusion", "none") == ""
    assert "hardly changed" in run(capsys, tmp_path / "in.exr", "-o", tmp_path / "a.png", *LIGHT, "--occlusion", "none")


def test_nothing_before_the_light_and_black_round_it(tmp_path, capsys):
    even = np.repeat(np.linspace(0.1, 0.3, 64, dtype=np.float32)[:, None, None], 96, axis=1).repeat(3, axis=2)
    write_image(tmp_path / "even.png", even)
    black = np.zeros((64, 96, 3), np.float32)
    black[20:30, 40:50] = 1
    write_image(tmp_path / "black.png", black)
    for name, says, cure in (
        ("even", "nothing stands before the light: no shafts", "--rays 24 draws some"),
        ("black", "what lies round the light is black: no air shows there", "brighten the shadows first"),
    ):
        said = run(capsys, tmp_path / f"{name}.png", "-o", tmp_path / "a.png", "-y", "--light", "0.45,0.4;kind=disc")
        assert said == f"{tmp_path / name}.png: {says}; {cure}\n"
        assert np.array_equal(codes(tmp_path / "a.png"), codes(tmp_path / f"{name}.png"))
    write_image(tmp_path / "sea.png", None, encoded=thumbs.codes("sea-sunset"))
    assert "nothing stands before the light" in run(capsys, tmp_path / "sea.png", "-o", tmp_path / "a.png", "-y")
    said = run(capsys, tmp_path / "sea.png", "-o", tmp_path / "a.png", "-y", "--rays", "24")  # the cure
    assert said.count("\n") == 1 and not np.array_equal(codes(tmp_path / "a.png"), codes(tmp_path / "sea.png"))


@pytest.mark.parametrize("extension", ["png", "exr", "jpg"])
def test_a_grey_picture_stays_grey_unless_a_warmth_is_asked_for(tmp_path, capsys, extension):
    grey = encode(np.repeat((thumbs.linear() @ np.float32(reference.REC709))[..., None], 3, axis=2), np.uint8)
    spec, png = oiio.ImageSpec(SHAPE[1], SHAPE[0], 1, "uint8"), oiio.ImageOutput.create("png")
    assert png.open(str(tmp_path / "in.png"), spec) and png.write_image(np.ascontiguousarray(grey[..., :1])) and png.close()
    assert codes(tmp_path / "in.png").shape[2] == 1
    out = tmp_path / f"out.{extension}"
    run(capsys, tmp_path / "in.png", "-o", out, *LIGHT)
    made = codes(out)
    assert (made == made[..., :1]).all() and not np.array_equal(read_image(out).linear(), read_image(tmp_path / "in.png").linear())
    for more in (["--warmth", "1"], ["--light", "0.52,0.42;color=1,0.5,0.2"]):
        run(capsys, tmp_path / "in.png", "-o", out, "-y", *(LIGHT if more[0] == "--warmth" else []), *more)
        values = read_image(out).linear()
        assert values.shape[2] == 3 and values[..., 0].mean() > 1.02 * values[..., 2].mean()
