"""Volumes from files: every voxel, its place in the world, what large grids become, and what is refused."""

import hashlib
import struct
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
import volume_files as made
from volume_files import ACTIVE, BLOSC, BOX, ZIP, Grid, kept, npy, sampled, world

from airlight.errors import AirlightError
from airlight.files.volumes import FORMATS, MAX_VOXELS, Volume, file_of_frame, read_volume

DATA = Path(__file__).parent / "data" / "volumes"
RANDOM = np.random.default_rng(7)
VALUES = (RANDOM.random((20, 13, 9)) * (RANDOM.random((20, 13, 9)) < 0.7)).astype(np.float32)
CORNER = (-9, 3, 120)


def assert_equal(volume: Volume, grid: Grid, step: float = 0.5) -> None:
    low = np.round(volume.matrix[:3, 3] / step).astype(int)
    values, active = made.dense_of(grid, tuple(low), tuple(low + volume.density.shape[::-1]))
    np.testing.assert_array_equal(volume.density[1:-1, 1:-1, 1:-1], values.astype(np.float32).T[1:-1, 1:-1, 1:-1])
    assert np.count_nonzero(active) == grid.active() == np.count_nonzero(active[1:-1, 1:-1, 1:-1])  # none lies outside
    np.testing.assert_allclose(world(volume, 1, 2, 3), step * (low + (1, 2, 3)), atol=1e-12)


# ---------------------------------------------------------------- OpenVDB


@pytest.mark.filterwarnings("ignore:.*inactive voxels that are not 0")
@pytest.mark.parametrize("kind, half", [("float", False), ("float", True), ("double", False), ("double", True), ("half", False)])
@pytest.mark.parametrize("flags", [0, ACTIVE, ZIP, ZIP | ACTIVE, BLOSC, BLOSC | ACTIVE])
def test_every_voxel(kind, half, flags, tmp_path):
    """Leaves whose inactive voxels have none, one, two or many values, and active tiles of both nodes, in each way that they are stored."""
    pick = np.arange(VALUES.size).reshape(VALUES.shape) % 7
    cases = ([0.0], 222), ([0.25], 223), ([0.0, 0.25], 224), ([0.25, 0.5], 225), ([0.0, 0.25, 0.5], 224)
    for i, (others, version) in enumerate(cases):
        active = (VALUES > 0) & (pick > 0)
        values = np.where(active, VALUES, np.array(others, np.float32)[pick % len(others)])
        tiles = {((16, 0, 120), 8): (0.5, True), ((-16, 0, 104), 8): (0.75, True)} if i else {}
        if i == 3 and kind == "float":
            tiles[(0, 0, -128), 128] = (1.25, True)
        leaves = made.leaves_of(CORNER, values, active)
        grid = Grid(leaves=leaves, tiles=tiles, type=kind, half=half, flags=flags)
        assert_equal(read_volume(kept(tmp_path, made.vdb(grid, version=version))), grid)


@pytest.mark.parametrize(
    "name, grid, low, step, mark",
    [
        ("sphere-openimageio", "density", -12, 0.1, "72c99e4b67ecf068"),
        ("torus-arnold", "voxel_fog_density", (-25, -4, 1), 0.4032309651374817, "54068c48a04962eb"),
    ],
)
def test_real_files(name, grid, low, step, mark):
    """As OpenVDB reads them: the marks are of its arrays."""
    volume = read_volume(str(DATA / f"{name}.vdb"))
    values = np.ascontiguousarray(volume.density[1:-1, 1:-1, 1:-1].T)
    assert hashlib.sha256(values.tobytes()).hexdigest()[:16] == mark
    np.testing.assert_allclose(world(volume, 1, 1, 1), np.broadcast_to(low, 3) * step, rtol=1e-6)
    assert volume.name == grid and volume.told == ()


@pytest.mark.parametrize("told", [{"suffix": False}, {"more": {"is_saved_as_half_float": None}}])
def test_half_is_told_in_two_places(told, tmp_path):
    grid = Grid(leaves=made.leaves_of(CORNER, VALUES), half=True, **told)
    assert_equal(read_volume(kept(tmp_path, made.vdb(grid))), grid)


def test_instances_and_names(tmp_path):
    leaves = made.leaves_of(CORNER, VALUES)
    smoke = Grid("smoke", leaves)
    place = ("ScaleTranslateMap", ((0.1, 0.2, 0.3), (1, 2, 3)))
    shared = Grid("density", parent="smoke", map=place)
    path = kept(tmp_path, made.vdb(smoke, shared, Grid("empty"), Grid("density\x1e1", leaves, type="double")))
    with pytest.warns(UserWarning, match="2 grids are named 'density', of which 'density' is read"):
        first = read_volume(path)
    other = read_volume(path, grid="smoke")
    np.testing.assert_array_equal(first.density, other.density)
    assert (first.name, other.name) == ("density", "smoke")
    np.testing.assert_allclose(world(first, 0, 0, 0), np.array([-10, 2, 119]) * (0.1, 0.2, 0.3) + (1, 2, 3))
    assert read_volume(path, grid="density[1]").name == "density[1]"
    twins = kept(tmp_path, made.vdb(Grid("a\x1e0", leaves, more={"comment": "long" * 1000}), Grid("a\x1e1")), "twins.vdb")
    with pytest.warns(UserWarning, match=r"2 grids are named 'a', of which 'a\[0\]' is read; grid= names another"):
        assert read_volume(twins, grid="a").name == "a[0]"
    assert read_volume(twins, grid="a[0]").told == ()
    with pytest.raises(AirlightError, match=r"no grid 'smok', but .*'smoke' \(float\).*did you mean 'smoke'"):
        read_volume(path, grid="smok")
    with pytest.warns(UserWarning, match="no active voxels: it adds nothing"):
        assert read_volume(path, grid="empty").mass == 0
    only = kept(tmp_path, made.vdb(Grid("heat", leaves), Grid("v", {}, type="vec3s")))
    assert read_volume(only).name == "heat"


@pytest.mark.parametrize(
    "kind, told, place",
    [
        ("ScaleMap", ((0.1, 0.2, 0.3),), (0.1, 0.4, 0.9)),
        ("UniformScaleMap", (2.0,), (2, 4, 6)),
        ("TranslationMap", (5, 6, 7), (6, 8, 10)),
        ("ScaleTranslateMap", ((0.5, 1, 2), (1, 1, 1)), (1.5, 3, 7)),
        ("UniformScaleTranslateMap", (2.0, (1, 0, -1)), (3, 4, 5)),
        ("AffineMap", [[0, 2, 0, 0], [-3, 0, 0, 0], [0, 1, 4, 0], [10, 20, 30, 1]], (4, 25, 42)),
        ("UnitaryMap", [[0, 1, 0, 0], [-1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]], (-2, 1, 3)),
    ],
)
def test_maps(kind, told, place, tmp_path):
    """The voxel 1, 2, 3, alone, lies where its row times the matrix is."""
    grid = Grid(leaves=made.leaves_of((1, 2, 3), np.ones((1, 1, 1), np.float32)), map=(kind, told))
    path = kept(tmp_path, made.vdb(grid))
    volume = read_volume(path)
    assert volume.density.shape == (3, 3, 3) and volume.density[1, 1, 1] == 1
    np.testing.assert_allclose(world(volume, 1, 1, 1), place)
    np.testing.assert_allclose(world(read_volume(path, scale=0.1, up="z"), 1, 1, 1), np.array([place[0], place[2], -place[1]]) * 0.1)
    low, high = volume.bounds
    assert (low < place).all() and (high > place).all()
    assert volume.mass == pytest.approx(abs(np.linalg.det(volume.matrix[:3, :3])))


def test_density_fades_to_the_background(tmp_path):
    grid = Grid(leaves=made.leaves_of((0, 0, 0), np.full((1, 1, 1), 2, np.float32)), map=("UniformScaleMap", (1.0,)))
    volume = read_volume(kept(tmp_path, made.vdb(grid)))
    points = np.array([[0, 0, 0], [0.5, 0, 0], [-0.25, 0.5, 0], [0, 0, 1], [0, 0, 1.01]])
    np.testing.assert_allclose(sampled(volume, points), [2, 1, 0.75, 0, 0], atol=1e-12)


NOISE = np.frombuffer(RANDOM.bytes(2048), np.float32).reshape(8, 8, 8)
UNPACKED = made.vdb(Grid(leaves={(0, 0, 0): (NOISE, np.ones(NOISE.shape, bool))}, flags=ZIP))


@pytest.mark.parametrize(
    "data, line",
    [
        (made.vdb(Grid(grid_class="level set")), "'density' is a level set, distances to a surface.*; export it as a fog volume"),
        (made.vdb(Grid(grid_class="staggered")), "staggered"),
        (made.vdb(Grid(background=0.5)), "has 0.5 wherever no voxel is"),
        (made.vdb(Grid(map=("NonlinearFrustumMap", ()))), "widens with the distance, as a camera's view; resample"),
        (made.vdb(Grid(tree="5_5_3")), r"no grid of float, double or half values, but 'density' \(odd tree\)"),
        (made.vdb(Grid("v", type="float", tree="5_4_3"), Grid("w")), r"no grid 'density', but 'v' \(float\), 'w' \(float\); name one"),
        (made.vdb(version=224), "no grid of float, double or half values, but none"),
        (made.vdb(Grid(), version=221), "file version 221, older than 222 to 225"),
        (made.vdb(Grid(), version=226), "newer"),
        (made.vdb(Grid(), stream=True), "was written as a stream"),
        (made.vdb(Grid(flags=8)), "packed in an unknown way"),
        (made.vdb(Grid(leaves=made.leaves_of(CORNER, VALUES), count=5)), "active voxels, not as many as it says"),
        (made.vdb(Grid(leaves=made.leaves_of(CORNER, VALUES)))[:-1], "is cut off"),
        (UNPACKED.replace(struct.pack("<q", -2048), struct.pack("<q", -2044)), "another number of values than it says"),
        (made.vdb(Grid(parent="gone")), "shares the tree of one that is not there"),
        (made.vdb(Grid(parent="density")), "shares the tree of one that is not there"),
        (made.vdb(Grid(tiles={((0, 0, 0), 8): (np.nan, True)})), "a tile of 8 voxels a side is no finite number"),
        (made.vdb(Grid(leaves=made.leaves_of(CORNER, -VALUES))), "negative densities.*down to -0.99.*x, y, z = .*; densities are 0"),
        (made.vdb(Grid(leaves=made.leaves_of(CORNER, VALUES), map=("UniformScaleMap", (1e9,)))), "reaches farther than 1e.09 m"),
        (made.vdb(Grid(leaves=made.leaves_of(CORNER, VALUES), map=("AffineMap", np.diag([1.0, 0, 1, 1])))), "voxels are flat"),
        (b"", "is empty; give .vdb"),
        (b"not a volume", "is no volume that Airlight reads; give .vdb"),
    ],
)
def test_refused(data, line, tmp_path):
    with pytest.raises(AirlightError, match=line) as told:
        read_volume(kept(tmp_path, data))
    assert str(told.value).startswith(str(tmp_path / "a.vdb")) and "\n" not in str(told.value) and "; " in str(told.value)


def test_other_kinds_of_grids_are_told(tmp_path):
    for kind, words in (("vec3s", "vec3s"), ("ptdataidx32", "points"), ("bool", "bool")):
        data = made.vdb(Grid(type=kind))
        with pytest.raises(AirlightError, match=rf"grid 'density' holds no float values: {words}; name one"):
            read_volume(kept(tmp_path, data), grid="density")


@pytest.mark.filterwarnings("ignore:.*coarsened", "ignore:.*inactive voxels", "ignore:.*no active voxels")
def test_counts_are_not_believed(tmp_path):
    """Each number of the file as large as can be: nothing is made of it, nor does reading take long."""
    data = made.vdb(Grid(leaves=made.leaves_of(CORNER, VALUES), tiles={((0, 0, 0), 4096): (1.0, True)}))
    refused = 0
    tracemalloc.start()
    for at in range(8, 700, 2):
        try:
            read_volume(kept(tmp_path, data[:at] + b"\xff\xff\xff\x7f" + data[at + 4 :]), limit=1000)
        except AirlightError:
            refused += 1
    assert refused > 150 and tracemalloc.get_traced_memory()[1] < 20e6
    tracemalloc.stop()


# ---------------------------------------------------------------- coarser


def test_coarsened_to_the_means(tmp_path):
    """A tree becomes the means over boxes, here of 2 x 2 x 2; so does the same grid in a dense file, by rows or by columns."""
    values = np.where(VALUES[:18, :12, :8] > 0, VALUES[:18, :12, :8], 0.125)
    means = values.reshape(9, 2, 6, 2, 4, 2).mean(axis=(1, 3, 5)).T
    grid = Grid(leaves=made.leaves_of((-9, 3, 121), values), map=("UniformScaleMap", (1.0,)))
    with pytest.warns(UserWarning, match=r"18x12x8 voxels are more than are kept \(216, .*coarsened to 9x6x4 by means, which keep"):
        volume = read_volume(kept(tmp_path, made.vdb(grid)), limit=216)
    np.testing.assert_allclose(volume.density[1:-1, 1:-1, 1:-1], means, rtol=1e-6)
    assert volume.stored == (8, 12, 18) and len(volume.told) == 1
    np.testing.assert_allclose(world(volume, 1, 1, 1), (-8.5, 3.5, 121.5))
    box = ((0, 0, 0), (18, 12, 8))
    for order in "CF":
        with pytest.warns(UserWarning, match="coarsened"):
            dense = read_volume(kept(tmp_path, npy(np.array(values.T, order=order)), "a.npy"), bounds=box, limit=216)
        np.testing.assert_allclose(dense.density, means, rtol=1e-6)
        np.testing.assert_allclose(dense.bounds, box)
        np.testing.assert_allclose(world(dense, 0, 0, 0), (1, 1, 1))


@pytest.mark.filterwarnings("ignore:.*coarsened")
@pytest.mark.parametrize("limit", [2000, 1000, 100, 10, 1])
def test_mass_is_kept(limit, tmp_path):
    """By means over boxes that are no whole numbers of voxels; where the mass lies does not change either."""
    grid = Grid(leaves=made.leaves_of(CORNER, VALUES), tiles={((8, 64, 160), 8): (0.5, True)})
    paths = [(kept(tmp_path, made.vdb(grid)), {}), (kept(tmp_path, npy(VALUES.T), "a.npy"), {"bounds": BOX})]
    for path, more in paths:
        whole, coarse = read_volume(path, **more), read_volume(path, limit=limit, **more)
        assert coarse.density.size <= (limit if more else 27 * limit) < whole.density.size or limit == 2000
        assert coarse.mass == pytest.approx(whole.mass, rel=1e-6)
        centre = [np.array([np.average(world_of(v, axis), weights=v.density) for axis in range(3)]) for v in (whole, coarse)]
        size = np.linalg.norm(coarse.matrix[:3, :3], axis=0)
        assert (np.abs(centre[1] - centre[0]) < size / 2).all()


def world_of(volume: Volume, axis: int) -> np.ndarray:
    z, y, x = np.indices(volume.density.shape)
    return volume.matrix[axis, 0] * x + volume.matrix[axis, 1] * y + volume.matrix[axis, 2] * z + volume.matrix[axis, 3]


@pytest.mark.filterwarnings("ignore:.*coarsened")
def test_huge_trees_take_little(tmp_path):
    """Tiles of all three sizes, 8192 voxels apart, whose grid in full would be a terabyte."""
    tiles = {((-4096, 0, 0), 4096): (0.5, True), ((4096, 0, 0), 128): (1.0, True), ((4096, 4096, 4096), 8): (3.0, True)}
    grid = Grid(leaves=made.leaves_of((4096, 8000, 0), VALUES), tiles=tiles, map=("UniformScaleMap", (1.0,)))
    path = kept(tmp_path, made.vdb(grid))
    tracemalloc.start()
    volume = read_volume(path, limit=40**3)
    assert tracemalloc.get_traced_memory()[1] < 100e6
    tracemalloc.stop()
    assert volume.mass == pytest.approx(4096**3 / 2 + 128**3 + 3 * 512 + VALUES.sum(dtype=float), rel=1e-6)
    assert sampled(volume, np.array([[-2000.0, 2000, 2000]])) == pytest.approx(0.5)
    assert np.prod(np.array(volume.density.shape) - 2) <= 40**3


# ---------------------------------------------------------------- sequences


def test_file_of_a_frame(tmp_path):
    for number in (3, 4, 8):
        (tmp_path / f"smoke.{number:04d}.vdb").write_bytes(b"")
    pattern = str(tmp_path / "smoke.####.vdb")
    found = [Path(file_of_frame(pattern, frame)).name for frame in (-5, 3, 4, 6, 8, 100)]
    assert found == [f"smoke.{n:04d}.vdb" for n in (3, 3, 4, 4, 8, 8)]
    assert file_of_frame(str(tmp_path / "smoke.%04d.vdb"), 4) == str(tmp_path / "smoke.0004.vdb")
    assert file_of_frame(pattern, 7, [1, 2]) == str(tmp_path / "smoke.0002.vdb")
    assert file_of_frame("plain.vdb", 7) == "plain.vdb"
    with pytest.raises(AirlightError, match=r"no files of that pattern; did you mean '.*smoke.####.vdb'"):
        file_of_frame(str(tmp_path / "smok.####.vdb"), 1)


def test_not_files(tmp_path):
    with pytest.raises(AirlightError, match=r"is a folder; give the name of a volume: .vdb, .npz"):
        read_volume(str(tmp_path))
    with pytest.raises(AirlightError, match="cannot be read"):
        read_volume(str(tmp_path / "none.vdb"))
    assert set(FORMATS) == {".vdb", ".npz", ".npy", ".vol"} and MAX_VOXELS == 256**3
