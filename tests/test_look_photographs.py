"""The look on the shipped photographs, their lights marked by hand: rays rather than a veil, as strong as asked for, nothing blown out."""

from collections.abc import Iterator

import numpy as np
import pytest
from look_goldens import LIGHTS, PHOTOS, blocks, changed, goldens, photograph
from look_scenes import Change, rays_share, shone

import airlight
from airlight.files import read_image
from airlight.parameters import Look
from airlight.planes import shrink
from airlight.reference.look import WHITE

FULL = ["casa-mila", "beacon-street-sunset", "hill-sunset", "dandelions", "tea-gardens-mist", "night-light-frames"]


@pytest.fixture(scope="module")
def renderer() -> Iterator[airlight.Renderer]:
    yield airlight.Renderer()


@pytest.fixture(scope="module")
def changes(renderer: airlight.Renderer) -> dict[str, Change]:
    """Each photograph at 640 px."""
    return {name: changed(renderer, name, 640) for name in LIGHTS}


def test_rays_are_most_of_the_change(changes: dict[str, Change]) -> None:
    """What varies within 12 degrees is .6 of the change or more, on average and in each; of a white screen it is .29."""
    shares = {name: rays_share(change, LIGHTS[name].position) for name, change in changes.items() if change.applied.settled.changes}
    assert len(shares) == 7 and np.mean(list(shares.values())) > 0.75 and min(shares.values()) > 0.6


@pytest.mark.parametrize("strength", [1.0, 1.6])
@pytest.mark.parametrize("name", FULL)
def test_the_asked_contrast_is_reached(renderer: airlight.Renderer, changes: dict[str, Change], name: str, strength: float) -> None:
    """Within 5 %; on the beacon, whose fine rays are few at 640 px, nine tenths of it."""
    change = changes[name] if strength == 1 else changed(renderer, name, 640, strength)
    wanted = change.applied.settled.wanted
    assert wanted == pytest.approx(8 * strength) if name != "beacon-street-sunset" else 6.8 * strength < wanted < 8 * strength
    assert change.contrast == pytest.approx(wanted, rel=0.05)


def test_a_sun_over_the_sea_is_left_as_it_is(renderer: airlight.Renderer, changes: dict[str, Change]) -> None:
    change = changes["sea-sunset"]
    assert np.array_equal(change.after, change.before)
    assert change.applied.settled.message == "nothing stands before the light: no shafts; --rays 24 draws some"
    assert shone(renderer, photograph("sea-sunset", 640), LIGHTS["sea-sunset"]).applied.codes is None


def test_a_dark_room_is_given_less(changes: dict[str, Change]) -> None:
    """It shows little air: between a tenth and a half of what is asked."""
    change = changes["dark-room-opening"]
    assert 0.8 < change.applied.settled.wanted < 4 and change.contrast == pytest.approx(change.applied.settled.wanted, rel=0.05)


def test_mist_without_gaps_gets_drawn_rays(changes: dict[str, Change]) -> None:
    """Tea gardens only, and a line says so."""
    for name, change in changes.items():
        drawn = name == "tea-gardens-mist"
        assert change.applied.settled.lights[0].rays == (24 if drawn else 0)
        assert ("24 rays drawn" in change.applied.settled.message) == drawn


@pytest.mark.parametrize("name", LIGHTS)
def test_neither_blown_out_nor_much_brighter(renderer: airlight.Renderer, changes: dict[str, Change], name: str) -> None:
    """The mean luminance within 8 %, nothing newly above code 254: of floats, and of dithered codes."""
    change = changes[name]
    assert abs(change.brightening) < 0.08
    assert np.all(change.after <= np.maximum(change.before, WHITE) + 1e-6)
    picture = photograph(name, 640)
    codes = shone(renderer, picture, LIGHTS[name], Look(strength=1.6)).applied.codes
    assert codes is None or not np.any((codes > 254) & (picture <= 254))


NIGHT = pytest.mark.xfail(reason="small lamps emit less in a smaller copy, since emission is found of means: 2.4 codes", strict=True)


@pytest.mark.parametrize("name", ["casa-mila", "beacon-street-sunset", pytest.param("night-light-frames", marks=NIGHT)])
def test_half_the_size_is_the_half(renderer: airlight.Renderer, name: str) -> None:
    """Of 1,280 and 640 px: within a code on average, eight in 99 of 100 values."""
    full = shrink(read_image(PHOTOS / f"{name}.jpg").linear(), 1280)
    one, half = shone(renderer, full, LIGHTS[name]), shone(renderer, shrink(full, 640), LIGHTS[name])
    off = np.abs(Change(shrink(one.after, 640), half.after, half.applied).codes)
    assert off.mean() < 1 and np.percentile(off, 99) < 8


@pytest.mark.parametrize("name", LIGHTS)
def test_the_change_is_the_kept_one(renderer: airlight.Renderer, name: str) -> None:
    """At 320 px, means of 32 x 24 blocks: within a tenth of a code on average, .3 and 2 % everywhere, for another decoder of JPEG and as
    the strength is solved to 1 %. Where it is meant to differ, look_goldens.py writes new ones."""
    kept = goldens()[name]
    off = np.abs(blocks(changed(renderer, name, 320)) - kept)
    assert off.mean() < 0.1 and np.all(off < 0.3 + 0.02 * np.abs(kept))
