"""What the looks write, and what they say about it."""

import numpy as np
import OpenImageIO as oiio
import pytest
import thumbs
from look_commands import LIGHT, SHAPE, codes, layer_of, run
from test_compositing import AP1, load, store

from airlight import pictures
from airlight.files import encode, read_image, write_image
from airlight.reference import radial as reference


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
    held, true = [], pictures.render_look

    def look(*args, **more):
        done = true(*args, **more)
        held.append(done.held)
        return done

    monkeypatch.setattr(pictures, "render_look", look)
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


def test_a_light_typed_in_pixels_without_saying_so(photo, tmp_path, capsys):
    for more in ([], ["--look", "classic"]):
        said = run(capsys, photo, "-o", tmp_path / "a.png", "-y", "--light", "40,30", *more)
        assert "the light 40,30 lies 40 pictures away: where pixels are meant, write 40px,30px\n" in said
        said = run(capsys, photo, "-o", tmp_path / "a.png", "-y", "--light", "9000%,0px", *more)
        assert "the light 9000%,0px lies 90 pictures away: is it meant to be there?\n" in said
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
        (photo, ["--mix", "0"], "--mix 0 adds nothing of the shafts; leave it out"),
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
    assert "brighter than white" in run(capsys, tmp_path / "in.exr", "-o", tmp_path / "a.png", *LIGHT, "--occlusion", "none")


def test_nothing_before_the_light_and_black_round_it(tmp_path, capsys):
    even = np.repeat(np.linspace(0.1, 0.3, 64, dtype=np.float32)[:, None, None], 96, axis=1).repeat(3, axis=2)
    write_image(tmp_path / "even.png", even)
    black = np.zeros((64, 96, 3), np.float32)
    black[20:30, 40:50] = 1
    write_image(tmp_path / "black.png", black)
    for name, says, cure in (
        ("even", "nothing stands before the light: no shafts", "--rays 24 draws some"),
        ("black", "what lies round the light is black: no air shows there", "brighten the shadows first, or --look classic draws on black"),
    ):
        said = run(capsys, tmp_path / f"{name}.png", "-o", tmp_path / "a.png", "-y", "--light", "0.45,0.4;kind=disc")
        assert said == f"{tmp_path / name}.png: {says}; {cure}\n"
        assert np.array_equal(codes(tmp_path / "a.png"), codes(tmp_path / f"{name}.png"))
    cured = run(capsys, tmp_path / "black.png", "-o", tmp_path / "a.png", "-y", "--light", "0.45,0.4;kind=disc", "--look", "classic")
    assert cured == "" and not np.array_equal(codes(tmp_path / "a.png"), codes(tmp_path / "black.png"))
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
