"""`airlight compare` and the debug views, against the reference and against what they are made of."""

import base64
import re
from functools import lru_cache

import numpy as np
import pytest
from tags import Tags

import airlight
from airlight.cli import main
from airlight.colour import encode_codes
from airlight.compare import measure, page, sheet, words
from airlight.compare.variants import limit_key, usual, variant
from airlight.debug import LINE, NODE, STEPS, weight_error
from airlight.errors import AirlightError
from airlight.files import read_image, read_mask, write_image
from airlight.gpu.device import open_device
from airlight.lights import Light
from airlight.options import Parameters
from airlight.reference import radial as reference
from airlight.reference.scenes import foliage
from airlight.scatter.epipolar.grid import QUALITY, Grid
from airlight.scatter.epipolar.moments import mixture
from airlight.scatter.methods import of_screen

LIGHT = (0.6, 0.35)
TEXTS = ["method=epipolar", "method=radial,samples=12", "vesper", "method=radial,samples=24,density=1.2,jitter=midpoint"]


@pytest.fixture(scope="module")
def photo(tmp_path_factory):
    path = tmp_path_factory.mktemp("compare") / "in & out.exr"
    write_image(path, 1.3 * foliage(48, 32), bits=32)  # most of the sky emits
    return path


@lru_cache
def result(path, texts=tuple(TEXTS)):
    return measure.compare(read_image(path), [Light(LIGHT)], [variant(text, {}) for text in texts], runs=1)


def own_errors(path, text):
    """A variant's errors by other functions, at all pixels outside the disc."""
    image = read_image(path).linear().astype(np.float64)
    p = variant(text, {}).parameters
    named = {name: getattr(p, name) for name in p.__struct_fields__}
    found = airlight.light_shafts(image.astype(np.float32), LIGHT, **named)
    emitted = reference.source(image, p)
    sums = reference.converged(emitted, LIGHT, density=p.density, lam=p.lam, taps=6000)
    truth = p.exposure * p.weight * sums
    if p.normalization == "listing":
        truth = p.exposure * emitted + p.lam / (1 - p.decay) * truth
    y, x = np.indices((32, 48)) + 0.5
    away = np.hypot(x - LIGHT[0] * 48, y - LIGHT[1] * 32) > 0.02 * 48
    off = np.abs(found - truth)[away] / truth[away].mean()
    return float(np.sqrt((off**2).mean())), float(np.percentile(off, 99)), float(off.max())


@pytest.mark.parametrize("text", TEXTS)
def test_errors_are_those_computed_independently(photo, text):
    row = result(photo).rows[TEXTS.index(text)]
    assert (row.rmse, row.p99, row.worst) == pytest.approx(own_errors(photo, text), rel=0.01, abs=2e-5)
    assert row.ms > 0 and row.copies == pytest.approx(row.ms / result(photo).copy_ms)
    assert row.reference_error < 1e-3


def test_the_better_method_has_the_smaller_error(photo):
    rows = result(photo).rows
    assert rows[0].rmse < 0.002 < 0.02 < rows[1].rmse
    assert rows[0].difference.mean() < 0.1 * rows[1].difference.mean()


def test_random_pixels_tell_the_same_error(photo, monkeypatch):
    monkeypatch.setattr(measure, "FEW", 0)
    monkeypatch.setattr(measure, "POINTS", 800)
    sampled = measure.compare(read_image(photo), [Light(LIGHT)], [variant(TEXTS[1], {})], runs=1)
    assert not sampled.everywhere and sampled.points == 800
    assert sampled.rows[0].rmse == pytest.approx(result(photo).rows[1].rmse, rel=0.15)
    here, there = sampled.rows[0].difference, result(photo).rows[1].difference  # against epipolar final, and the reference
    clear = there > 0.1
    assert np.ptp(here[clear] / there[clear]) < 0.05  # the means, of these pixels and of all, are not quite the same


def test_variants():
    base = {"samples": 100, "decay": 0.97}
    assert variant("samples=10", base).parameters.lam == pytest.approx(Parameters(**base).lam)
    assert variant("samples=10,decay=0.9", base).parameters.decay == 0.9
    assert variant("vesper,scale=0.25", base).parameters.scale == 0.25
    assert variant("blend=add", base).composite.blend == "add"
    assert variant("method=radial,samples=32,jitter=blue", {}).name == "radial, n = 32, jitter blue"
    keys = {limit_key(variant(text, base).parameters) for text in ("method=radial,samples=16", "quality=draft", "method=radial,scale=0.5")}
    assert len(keys) == 1
    assert len({limit_key(variant(text, base).parameters) for text in ("decay=0.9", "density=0.5", "normalization=listing", "vesper")}) == 4
    found, lacking = usual({})
    assert {v.parameters.method for v in found} == set(of_screen()) and not lacking
    assert usual({"scale": 0.5, "method": "radial"})[1]  # not for epipolar


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("sampless=3", "did you mean 'samples'"),
        ("method=radail", "did you mean 'radial'"),
        ("vespr", "did you mean 'vesper'"),
        ("method=march", "airlight render SCENE"),
        ("samples=0", "samples"),
        ("samples=1.5", "samples"),
        ("decay=nan", "decay"),
        ("decay=1e99999", "decay"),
        ("scale=0.5", "scale"),
        ("scale=0.3,method=radial", "0.25"),
        ("", "preset"),
        ("samples=", "samples"),
        ("=3", "unknown key"),
        ("occlusion=depth", "depth"),
        ("occlusion=alpha", "alpha"),
    ],
)
def test_a_bad_variant_is_one_line(photo, tmp_path, capsys, text, says):
    command = ["compare", str(photo), "-o", str(tmp_path / "out.html"), "--light", "0.6,0.35", "--variant", text]
    assert main(command) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.startswith("airlight: ") and err.count("\n") == 1 and says in err
    assert not list(tmp_path.iterdir())


def test_nothing_to_compare_is_one_line(tmp_path, capsys):
    for name, size, says in (("black", 32, "nothing emits"), ("tiny", 1, "too small")):
        write_image(tmp_path / f"{name}.png", np.zeros((size, size, 3), np.float32))
        assert main(["compare", str(tmp_path / f"{name}.png"), "-o", str(tmp_path / "out.png"), "--light", "0.5,0.5", "--runs", "1"]) == 2
        err = capsys.readouterr().err
        assert says in err and err.count("\n") == 1
    assert not (tmp_path / "out.png").exists()


def test_the_page_is_complete_in_itself(photo, tmp_path, capsys):
    out = tmp_path / "out.html"
    command = ["compare", str(photo), "-o", str(out), "--light", "0.6,0.35", "--runs", "1", "--variant", TEXTS[0], "--variant", TEXTS[1]]
    assert main(command) == 0
    told = capsys.readouterr().out.splitlines()
    text = out.read_text(encoding="utf-8")
    tags = Tags()
    tags.feed(text)
    tags.close()
    assert not tags.open and tags.rows == 3
    assert not re.search(r"https?://|//[a-z]|@import|url\(", re.sub(r"data:image/jpeg;base64,[\w+/=]+", "", text).replace("// A", ""))
    assert len(tags.loaded) == 5 and all(uri.startswith("data:image/jpeg;base64,") for uri in tags.loaded)
    picture = tmp_path / "picture.jpg"
    picture.write_bytes(base64.b64decode(tags.loaded[0].partition(",")[2]))
    assert read_image(picture).codes.shape == (32, 48, 3)
    assert "in &amp; out.exr, 48 × 32" in text and "radial, n = 12" in text and "prefers-color-scheme" in text
    assert len(told) == 2
    for line in told:
        assert re.search(r"error +([\d.]+ %)", line)[1] in text
    assert main(command) == 2 and "--overwrite" in capsys.readouterr().err


def test_the_sheet_has_pictures_and_labels(photo, tmp_path):
    out = tmp_path / "out.png"
    command = ["compare", str(photo), "-o", str(out), "--light", "0.6,0.35", "--runs", "1"]
    assert main([*command, *(part for text in TEXTS[:2] for part in ("--variant", text))]) == 0
    codes = read_image(out).codes
    assert main([*command[:-4], *command[-4:], "-y", "--variant", TEXTS[1], "--variant", TEXTS[0], "--amplify", "5"]) == 0
    swapped = read_image(out).codes
    left, top = sheet.GAP, sheet.GAP + sheet.LINE + 6 + sheet.GAP
    rows = result(photo).rows
    for k, row in enumerate(rows[:2]):
        y = top + k * (32 + sheet.GAP + 3 * sheet.LINE)
        assert np.array_equal(codes[y : y + 32, left : left + 48], encode_codes(row.shown, np.uint8, dither=False))
        grey = np.repeat(10 * row.difference[..., None], 3, axis=2)
        assert np.array_equal(codes[y : y + 32, left + 48 : left + 96], encode_codes(grey, np.uint8, dither=False))
        label = sheet.Paper(300, sheet.LINE)
        label.write(0, 0, row.variant.name, 300)
        wanted = label.done()
        assert np.array_equal(codes[y + 36 : y + 36 + sheet.LINE, left : left + 300], wanted) and np.ptp(wanted) > 100
        other = top + (1 - k) * (32 + sheet.GAP + 3 * sheet.LINE)
        assert np.array_equal(swapped[other + 36 : other + 36 + sheet.LINE, left : left + 300], wanted)
    for name in ("out.jpg", "out.exr"):
        write_image(tmp_path / name, airlight.files.to_linear(codes)[0], encoded=codes)
        assert read_image(tmp_path / name).codes.shape[:2] == codes.shape[:2]


def test_long_names_are_cut_and_own_limits_shown(photo):
    made = sheet.sheet(result(photo), "title " * 40, 10.0)
    plain = sheet.sheet(result(photo), "title", 10.0)
    assert made.shape[1] == plain.shape[1] and made.shape[0] > plain.shape[0]
    paper = sheet.Paper(200, 40)
    paper.write(0, 0, "x" * 100, 200)
    assert paper.texts[0][2].endswith("…") and (paper.done()[:, 199] == sheet.PAPER).all()
    assert "normalization listing" in page.page(result(photo), "t", 10.0)
    assert words.limit(result(photo).rows[2].parameters) == "D = 0.794667, lambda = 1.5, normalization listing"
    assert [words.percent(v) for v in (0.00171, 0.153, 0.05, 2.0, 0)] == ["0.17 %", "15 %", "5.0 %", "200 %", "0 %"]


# The debug views.


def seen(path, view, tmp_path, *options, at=LIGHT):
    out = tmp_path / f"{view}.exr"
    command = ["image", str(path), "-o", str(out), "-y", "--light", f"{at[0]},{at[1]}", "--debug", view, *options]
    assert main(command) == 0
    return read_mask(out) if view in ("mask", "fraction") else read_image(out).linear()


@pytest.mark.parametrize("border", ["clamp", "black"])
def test_source_mask_and_fraction_are_the_references(photo, tmp_path, border):
    image = read_image(photo).linear()
    p = Parameters(threshold=0.6, smoothness=0.3, border=border)
    options = ("--threshold", "0.6", "--smoothness", "0.3", "--border", border)
    m = reference.mask(image, None, None, p)
    assert 0.05 < m.mean() < 0.95 and ((m > 0.1) & (m < 0.9)).any()
    assert np.allclose(seen(photo, "mask", tmp_path, *options), m, atol=1e-3)
    assert np.allclose(seen(photo, "source", tmp_path, *options), reference.source(image, p), rtol=1e-3, atol=1e-3)
    fraction = reference.occlusion_fraction(m, LIGHT, density=p.density, border=border)
    assert np.abs(seen(photo, "fraction", tmp_path, *options) - fraction).max() < 0.01


def test_the_source_of_a_very_bright_picture_keeps_its_scale(tmp_path):
    path = tmp_path / "bright.exr"
    write_image(path, foliage(32, 24) * 1e4, bits=32)
    truth = reference.source(read_image(path).linear(), Parameters())
    found = seen(path, "source", tmp_path)
    assert truth.max() > 5000 and np.allclose(found, truth, rtol=2e-3)


def grid_of(size, at):
    p = Parameters()
    mix = mixture(p.density, p.lam, QUALITY["normal"].tolerance)
    place = (at[0] * size[0], at[1] * size[1])
    laid = size, place, mix, p.lam, p.density, QUALITY["normal"], "clamp", open_device().max_side
    grid = Grid(*laid)
    return (Grid(*laid, "wide") if grid.halves else grid), place


@pytest.mark.parametrize("at", [(0.3, 0.4), (1.3, -0.2)])
def test_lines_and_steps_are_those_of_the_grid(tmp_path, capsys, at):
    size = (400, 300)
    path = tmp_path / "black.exr"
    write_image(path, np.zeros((size[1], size[0], 3), np.float32))
    grid, light = grid_of(size, at)
    drawn = seen(path, "lines", tmp_path, at=at)
    text = capsys.readouterr().err
    assert f"{len(grid.mix.p)} powers" in text and f"{sum(q.lines for q in grid.quadrants)} lines" in text
    is_line = np.isclose(drawn, LINE, atol=0.02).all(axis=2)
    is_node = np.isclose(drawn, NODE, atol=0.02).all(axis=2)
    assert (is_line | is_node | (drawn == 0).all(axis=2)).all() and is_line.mean() > 0.02 and is_node.mean() > 0.005
    every = [int(k) for k in re.findall(r"(\d+)th of", text)]
    y, x = np.nonzero(is_line)
    steps = seen(path, "moments", tmp_path, at=at)
    colour_of = {length: np.isclose(steps, color, atol=0.02).all(axis=2) for length, color in STEPS.items()}
    nearest = np.full(len(x), np.inf)
    for q, k in zip(grid.quadrants, every, strict=True):
        # each line that is drawn is there at its far end, if that lies in the picture
        slope = q.m_lo + q.dm * np.arange(0, q.lines, k)
        end = np.zeros((len(slope), 2))
        u = min(q.u[-1], q.u_max) - 1
        end[:, q.axis], end[:, 1 - q.axis] = light[q.axis] + q.sign * u, light[1 - q.axis] + slope * u
        inner = end[((end > 1) & (end < np.array(size) - 1)).all(axis=1)].astype(int)
        assert len(inner)
        for i, j in inner:
            assert (is_line | is_node)[j - 1 : j + 2, i - 1 : i + 2].any()
        # and nothing else is
        place = np.stack([x, y], axis=1) + 0.5 - light
        along = q.sign * place[:, q.axis]
        away = np.abs(place[:, 1 - q.axis, None] - along[:, None] * slope).min(axis=1)
        nearest = np.where(along >= 0, np.minimum(nearest, away), nearest)
        # steps have the colour of their length
        lengths, middles = np.diff(q.u), 0.5 * (q.u[1:] + q.u[:-1])
        one = slope[np.argmin(np.abs(slope - 0.1))]
        for middle, length in list(zip(middles, lengths, strict=True))[q.stored + 2 : -2 : 5]:
            spot = np.zeros(2)
            spot[q.axis], spot[1 - q.axis] = light[q.axis] + q.sign * middle, light[1 - q.axis] + one * middle
            i, j = np.floor(spot).astype(int)
            if 1 <= i < size[0] - 1 and 1 <= j < size[1] - 1:
                named = min(n for n in STEPS if length <= n)
                assert colour_of[named][j - 1 : j + 2, i - 1 : i + 2].any(), (middle, length)
    assert nearest.max() < 1.5


def test_the_weight_error_is_that_of_the_fit():
    assert weight_error(mixture(0.9, 0.0), 0.9, 0.0) < 1e-12
    coarse, fine = (weight_error(mixture(0.97, 2.0, tolerance), 0.97, 2.0) for tolerance in (1e-1, 6e-4))
    assert fine < 2e-3 < coarse < 0.3


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (["--debug", "lines", "--method", "radial"], "epipolar"),
        (["--debug", "moments"], "larger picture"),
        (["--debug", "fraction", "--light", "0,0", "--light", "1,1"], "one light"),
        (["--debug", "source", "--layer", "LAYER"], "--layer"),
        (["--debug", "nosuch"], "--debug"),
        (["--debug", "mask", "--occlusion", "alpha"], "alpha"),
    ],
)
def test_a_view_that_is_not_there_is_one_line(photo, tmp_path, capsys, options, says):
    out = tmp_path / "out.png"
    options = [str(tmp_path / "layer.exr") if o == "LAYER" else o for o in options]
    light = [] if "--light" in options else ["--light", "0.6,0.35"]
    assert main(["image", str(photo), "-o", str(out), *light, *options]) == 2
    err = capsys.readouterr().err
    assert says in err and err.count("\n") == 1 and not list(tmp_path.iterdir())


def test_every_view_of_the_command_line_exists(photo, tmp_path):
    from airlight.cli import cli

    views = next(p for p in cli.commands["image"].params if p.name == "debug").type.choices
    assert len(views) == 5
    for view in views:
        if view in ("lines", "moments"):
            with pytest.raises(AirlightError, match="no lines"):
                airlight.debug.view(view, read_image(photo), [Light(LIGHT)], Parameters())
        else:
            assert airlight.debug.view(view, read_image(photo), [Light(LIGHT)], Parameters()).shape[:2] == (32, 48)
