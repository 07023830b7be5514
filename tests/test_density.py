"""The public density of a medium: known values of fog, noise, grids and blends, and what it refuses."""

from typing import Any

import numpy as np
import pytest
from calling import call

import airlight
from airlight.errors import AirlightError
from airlight.files.volumes import Volume
from airlight.files.volumes.volume import between
from airlight.gpu.device import open_device
from airlight.medium.field import BLENDS, Field
from airlight.medium.resolve import FOGS, resolve
from airlight.options import March, Medium
from airlight.reference import field
from airlight.scatter.march.records import frame_record
from airlight.scatter.march.varying import Varying

RNG = np.random.default_rng(30)
BOX = np.array([[-1.0, 0.0, 2.0], [3.0, 2.0, 5.0]])


def volume(values: Any, edge: float = 0.5, box: Any = BOX) -> Volume:
    values = np.asarray(values, np.float32)
    return Volume(values, between(np.asarray(box, float), values.shape), edge, "made")


def ramp(a: float = 1.0, b: Any = (0.5, 0.25, 0.125)) -> Volume:
    """a + b . x, which a trilinear grid has exactly."""
    own = volume(np.zeros((6, 4, 8)))
    index = np.stack(np.meshgrid(*[np.arange(n) for n in (8, 4, 6)], indexing="ij"), axis=-1).transpose(2, 1, 0, 3)
    return volume(a + (index @ own.matrix[:3, :3].T + own.matrix[:3, 3]) @ b)


def test_air_is_1_and_fog_falls_with_height() -> None:
    at = np.array([[0, -5, 0], [3, 0, 1], [0, 2, 0], [0, 4, 9]])
    np.testing.assert_array_equal(airlight.density(at), 1)
    np.testing.assert_array_equal(airlight.density(at, medium=Medium(air=0.25)), 0.25)
    fog = Medium(fog="exponential", fog_depth=2, fog_base=1, air=3)
    np.testing.assert_allclose(airlight.density(at, medium=fog), [3, 3, 3 * np.exp(-0.5), 3 * np.exp(-1.5)])
    fog = Medium(fog="linear", fog_above=0.2)
    np.testing.assert_allclose(airlight.density(at, medium=fog, height=40), [1, 1, 0.6, 0.2])
    np.testing.assert_allclose(airlight.density(at, medium=fog, radius=20), [1, 1, 0.6, 0.2])


def test_a_grid_is_trilinear_between_its_centres() -> None:
    at = RNG.uniform([-0.7, 0.3, 2.3], [2.7, 1.7, 4.7], (300, 3))
    np.testing.assert_allclose(airlight.density(at, fields=[Field(ramp())]), 1 + at @ [0.5, 0.25, 0.125], rtol=1e-6)


def test_a_grid_ends_at_its_faces() -> None:
    """Clamped for half a voxel, 0 beyond; with no edge it ends at the outermost centres."""
    own = volume([[[1.0, 3.0]]])  # centres at x = 0 and 2
    at = [[x, 1, 3] for x in (-1.01, -0.99, 0, 1, 2, 2.99, 3.01)] + [[1, -0.01, 3], [1, 2.01, 3], [1, 1, 1.99]]
    np.testing.assert_allclose(airlight.density(at, fields=[Field(own)]), [0, 1, 1, 2, 3, 3, 0, 0, 0, 0], atol=1e-9)
    tight = volume(np.pad(np.ones((1, 1, 1)), 1), 0.0, [[-1.5, -1.5, -1.5], [1.5, 1.5, 1.5]])
    np.testing.assert_allclose(airlight.density([[0, 0, 0], [0.25, 0, 0], [0.5, 0.5, 0], [1.01, 0, 0]], fields=[Field(tight)]),
                               [1, 0.75, 0.25, 0], atol=1e-9)


@pytest.mark.parametrize(("blend", "within", "without"), [
    ("add", 2 + 1.5, 2), ("multiply", 2 * 1.5, 2), ("replace", 1.5, 2), ("min", 1.5, 2), ("max", 2, 2),
])
def test_blends_join_what_is_there(blend: str, within: float, without: float) -> None:
    """1.5 times a field of 1 in air of 2; and outside its box."""
    found = airlight.density([[0, 1, 3], [9, 9, 9]], medium=Medium(air=2), fields=[Field(volume(np.ones((2, 2, 2))), blend, 1.5)])
    np.testing.assert_allclose(found, [within, without])
    assert blend in BLENDS


def test_fields_follow_each_other() -> None:
    ones, most = volume(np.ones((2, 2, 2))), volume(np.full((2, 2, 2), 5.0))
    at = [[0, 1, 3]]
    assert airlight.density(at, fields=[Field(ones), Field(most, "multiply"), Field(ones, "add", 0.5)]) == 5.5
    assert airlight.density(at, fields=[Field(ones), Field(most, "replace"), Field(ones, "min", 2)]) == 2
    assert airlight.density([[9, 9, 9]], fields=[Field(ones)]) == 0  # with fields there is no air


def test_noise_multiplies_air_and_drifts() -> None:
    at, medium = RNG.uniform(-20, 20, (20_000, 3)), Medium(noise_amount=3, noise_size=2, wind=(1, 0, -0.5), air=0.5)
    found = airlight.density(at, medium=medium)
    assert 0.45 < found.mean() < 0.55 and found.std() > 0.1
    assert airlight.density(at[7], medium=medium) == found[7]
    np.testing.assert_allclose(airlight.density(at + [2, 0, -1], 2.0, medium), found, rtol=1e-9)
    np.testing.assert_allclose(airlight.density(at, 0, Medium(noise_amount=3, wind=(1, 0, -0.5), air=0.5), radius=16), found)


def test_what_is_drawn_near_an_origin_has_the_same_density() -> None:
    medium = Medium(fog="exponential", fog_depth=3, noise_amount=2, noise_size=4, air=0.5)
    own = resolve(medium, March(), "final", 10, fields=[Field(ramp())])
    at, origin = RNG.uniform([-1, 0, 2], [3, 2, 5], (100, 3)), np.array([300.5, -40, 7])
    np.testing.assert_allclose(field.density(at - origin, own.seen_from(origin)), field.density(at, own), rtol=1e-9)


@pytest.mark.parametrize(("values", "text"), [
    ({"points": [1, 2]}, "points of shape"),
    ({"points": [1, np.nan, 2]}, "finite"),
    ({"time": np.inf}, "finite"),
    ({"radius": 0}, "radius = 0"),
    ({"height": np.nan}, "height = nan"),
    ({"medium": Medium(fog="linear")}, "fog_depth is unset"),
    ({"medium": Medium(noise_amount=1), "height": 3}, "noise_size is unset"),
])
def test_what_density_refuses(values: dict[str, Any], text: str) -> None:
    with pytest.raises(AirlightError, match=text):
        airlight.density(**{"points": [0, 0, 0]} | values)


def test_the_march_has_the_same_density() -> None:
    """To 1e-5, at places that float32 knows exactly: fog, noise that drifts, grids in their order, from an eye far from the origin."""
    smoke = volume(RNG.uniform(0, 2, (4, 6, 8)), 0.5, [[1000, -1.5, 0], [1004, 1.5, 2]])
    fields = [Field(smoke, "add", 1.5), Field(volume(np.full((2, 2, 2), 0.25), 0.5, [[1003, 0, 0], [1005, 2, 2]]), "max")]
    medium = Medium(fog="exponential", fog_depth=2, noise_amount=2, noise_size=2, wind=(0.5, 0, -0.25), air=0.7)
    resolved = resolve(medium, March(), "final", 5.0, fields=fields, time=3.0)
    view, projection = np.eye(4), np.diag([1.5, 2, -1.0, 0])
    projection[2:, 2:] = [[-1.0, -0.1], [-1.0, 0]]
    view[:3, 3] = (-1002.0, -0.5, -1.5)
    place = (RNG.integers(-(2**15), 2**15, (3000, 3)) / 2**13 * [1, 0.5, 0.4]).astype(np.float32)
    place = (np.round(place * 2**12) / 2**12).astype(np.float32)
    varying = Varying(open_device())
    varying.update(view, projection, 64, resolved)
    bindings = {"frame": frame_record(view, projection, resolved, (64, 36), (64, 36)), "field": varying.record, "voxels": varying.voxels}
    bindings |= {"atlas": varying.atlas.texture, "linear": open_device().sampler()}  # which are read in steps alone
    own = {"FOG": FOGS.index("exponential"), "VARIES": True, "NOISE": True, "GRIDS": 2}
    found = call("scatter/march/field.wgsl", "density", [place, np.float32(0)], bindings=bindings, constants=own)
    truth = airlight.density(place - view[:3, 3], 3.0, medium, fields)
    assert np.ptp(truth) > 2 and truth.min() < 0.2
    np.testing.assert_allclose(found, truth, rtol=1e-5, atol=1e-5)
