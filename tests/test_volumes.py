"""Volumes from files: every voxel, its place in the world, what large grids become, and what is refused."""

import hashlib
import io
import itertools
import pickle
import re
import struct
import tracemalloc
import zipfile
from pathlib import Path

import numpy as np
import pytest
import volume_files as made
from volume_files import ACTIVE, BLOSC, BOX, ZIP, Grid, npy, npz

from airlight.errors import AirlightError
from airlight.files.volumes import FORMATS, MAX_VOXELS, Volume, file_of_frame, read_volume
from airlight.files.volumes.blosc import inflate, lz4, unpack

DATA = Path(__file__).parent / "data" / "volumes"
RANDOM = np.random.default_rng(7)
VALUES = (RANDOM.random((20, 13, 9)) * (RANDOM.random((20, 13, 9)) < 0.7)).astype(np.float32)
CORNER = (-9, 3, 120)


def kept(folder: Path, data: bytes, name: str = "a.vdb") -> str:
    path = folder / name
    path.write_bytes(data)
    return str(path)


def world(volume: Volume, *index: float) -> np.ndarray:
    return volume.matrix[:3] @ (*index, 1)


def sampled(volume: Volume, points: np.ndarray) -> np.ndarray:
    """The density at points (N, 3), from what Volume says of itself alone."""
    index = (points - volume.matrix[:3, 3]) @ np.linalg.inv(volume.matrix[:3, :3]).T
    sides = np.array(volume.density.shape[::-1])
    inside = ((index >= -volume.edge) & (index <= sides - 1 + volume.edge)).all(axis=1)
    index = np.clip(index, 0, sides - 1)
    low = np.minimum(index.astype(int), np.maximum(sides - 2, 0))
    share, total = index - low, np.zeros(len(points))
    for step in itertools.product((0, 1), repeat=3):
        x, y, z = np.minimum(low + step, sides - 1).T
        total += np.prod(np.where(step, share, 1 - share), axis=1) * volume.density[z, y, x]
    return np.where(inside, total, 0)


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


# ---------------------------------------------------------------- Blosc


def test_lz4_by_hand():
    """Blocks put together from the description of the format."""
    assert lz4(bytes([0x50]) + b"hello", 5) == b"hello"
    assert lz4(b"\x1fa\1\0\xff\x06\x10z", 1 + 15 + 4 + 255 + 6 + 1) == b"a" * 281 + b"z"  # a match that is longer than it is far
    assert lz4(bytes([0x31]) + b"abc" + b"\3\0" + b"\x20" + b"xy", 10) == b"abcabcab" + b"xy"
    assert lz4(bytes([0xF0, 0xFF, 0x01]) + bytes(range(200)) + bytes(71), 271) == bytes(range(200)) + bytes(71)
    assert lz4(b"\0", 0) == b"" == inflate(b"x\x9c\x03\0\0\0\0\1", 0)


SHORT = [b"", b"\x50hell", b"\xf0\xff\xff", b"\x11a\1", b"\x10ab", b"\x30abc"]


@pytest.mark.parametrize("data", [*SHORT, b"\x11a\0\0\x10b", b"\x11a\2\0\x10b", b"\x1fa\1\0\xff\xff\x10z"])
def test_damaged_lz4(data):
    with pytest.raises(ValueError, match="LZ4"):
        lz4(data, 4)


@pytest.mark.parametrize("element", [1, 2, 4, 8])
@pytest.mark.parametrize("how", [{}, {"block": 512}, {"whole": True}, {"stored": True}, {"codec": 3}, {"shuffled": False}, {"block": 700}])
def test_blosc(element, how):
    for data in (VALUES.tobytes()[:4096], bytes(4096), RANDOM.bytes(2048), VALUES.astype(np.float16).tobytes()[:300]):
        block = min(how.get("block", len(data)), len(data)) // element * element
        frame = made.blosc(data, element, **{**how, "block": block})
        assert unpack(frame, len(data)) == data
        for damaged in (frame[:-1], frame[:10], frame[:12] + b"\xff" + frame[13:], frame[:2] + bytes([frame[2] | 0xE0 & ~2]) + frame[3:]):
            if damaged != frame and not how.get("stored"):
                with pytest.raises(ValueError, match="Blosc"):
                    unpack(damaged, len(data))


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


# ---------------------------------------------------------------- dense files


def test_dense_conventions(tmp_path):
    """density[z, y, x] between outer faces, clamped within them and 0 outside; a matrix instead of bounds; Mitsuba's the same."""
    density = np.arange(1, 25, dtype=np.float32).reshape(2, 3, 4)
    bounds = np.array([[1, 2, 3], [5, 8, 7]], float)
    matrix = np.array([[1, 0, 0, 1.5], [0, 2, 0, 3], [0, 0, 2, 4], [0, 0, 0, 1]])
    files = [("a.npz", npz(density=density, bounds=bounds), {}), ("b.npz", npz(density=density, matrix=matrix), {})]
    files += [("c.npy", npy(density), {"bounds": bounds}), ("d.vol", made.vol(density, bounds.ravel()), {})]
    files += [("e.npz", npz(only=density.astype(">f8"), bounds=0 * bounds), {"bounds": bounds.ravel()})]
    files += [("f.npy", npy(density.astype(np.uint8)), {"bounds": bounds})]
    for name, data, more in files:
        volume = read_volume(kept(tmp_path, data, name), **more)
        np.testing.assert_array_equal(volume.density, density)
        assert volume.density.dtype == np.float32 and volume.density.flags.c_contiguous and volume.edge == 0.5
        np.testing.assert_allclose(volume.matrix, matrix)
        np.testing.assert_allclose(volume.bounds, bounds)
        points = np.array([[1.5, 3, 4], [1.0, 2, 3], [0.99, 3, 4], [2, 3, 4], [5, 8, 7], [5, 8, 7.01]])
        np.testing.assert_allclose(sampled(volume, points), [1, 1, 0, 1.5, 24, 0])
        assert volume.mass == pytest.approx(density.sum() * 4)
    turned = read_volume(str(tmp_path / "a.npz"), up="z", scale=2)
    np.testing.assert_allclose(turned.bounds, [[2, 6, -16], [10, 14, -4]])


def test_channels_and_bounds_of_mitsuba(tmp_path):
    several = np.stack([np.full((2, 3, 4), v) for v in (1.0, 2.0, 3.0)], axis=-1)
    path = kept(tmp_path, made.vol(several), "a.vol")
    with pytest.raises(AirlightError, match=r"has 3 channels, as a colour has.*grid=0 to 2"):
        read_volume(path)
    assert (read_volume(path, grid="1").density == 2).all()
    with pytest.raises(AirlightError, match="no channel '3', but 0, 1, 2"):
        read_volume(path, grid="3")
    path = kept(tmp_path, made.vol(several[..., 0], (1.4e-45,) * 6), "b.vol")
    with pytest.raises(AirlightError, match=r"its bounds are no box: 1.4.*; give bounds=x0,y0,z0,x1,y1,z1"):
        read_volume(path)
    np.testing.assert_allclose(read_volume(path, bounds=BOX).bounds, BOX)


def member(name: str, data: bytes) -> bytes:
    held = io.BytesIO()
    with zipfile.ZipFile(held, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(name, data)
    return held.getvalue()


def header(text: str) -> bytes:
    return b"\x93NUMPY\1\0" + len(text).to_bytes(2, "little") + text.encode()


CUBE = np.ones((2, 2, 2), np.float32)


@pytest.mark.parametrize(
    "data, more, line",
    [
        (npy(CUBE), {}, "has no place in the world; give bounds="),
        (npz(density=CUBE), {}, "has no place in the world; save bounds"),
        (npz(a=CUBE, b=CUBE, bounds=BOX), {}, "no array 'density', but 'a', 'b', 'bounds'"),
        (npz(a=CUBE, bounds=BOX), {"grid": "b"}, "no array 'b'"),
        (npz(density=CUBE, bounds=BOX[::-1]), {}, "bounds 1, 1, 1, 0, 0, 0 are no box"),
        (npz(density=CUBE, bounds=np.zeros(100)), {}, "its bounds has 100 numbers"),
        (npz(density=CUBE, matrix=np.eye(4).T + np.eye(4, k=-3)), {}, "its matrix is not .4, 4. with 0, 0, 0, 1 as last row"),
        (npz(density=CUBE, matrix=np.zeros((4, 4)) + np.diag([0, 0, 0, 1])), {}, "voxels are flat"),
        (npy(CUBE), {"bounds": (0, 0, 0, 1, np.inf, 1)}, "bounds 0, 0, 0, 1, inf, 1 are no box"),
        (npy(CUBE), {"bounds": BOX, "scale": -1}, "scale is -1"),
        (npy(CUBE), {"bounds": BOX, "up": "x"}, "up is 'x'"),
        (npy(CUBE[0]), {"bounds": BOX}, r"shape \(2, 2\); a volume is density\[z, y, x\]"),
        (npy(CUBE[:0]), {"bounds": BOX}, "shape"),
        (npy(CUBE.astype(complex)), {"bounds": BOX}, "values of type <c16; save it as float32"),
        (npy(CUBE)[:-1], {"bounds": BOX}, "is cut off"),
        (header("{'descr': '|O', 'fortran_order': False, 'shape': (1, 1, 1)}\n") + pickle.dumps([1]), {"bounds": BOX}, "Python objects"),
        (header("{'descr': '<f4', 'fortran_order': False, 'shape': (4000, 4000, 4000)}\n"), {"bounds": BOX}, "more than the limit"),
        (header("{'descr': '<f4', 'fortran_order': False, 'shape': (99999, 1, 1)}\n"), {"bounds": BOX}, "4096 a side"),
        (header("{'descr': '<f4', 'fortran_order': False, 'shape': (1000, 1000, 1000)}\n"), {"bounds": BOX}, "is cut off"),
        (header("{'descr': [('a', '<f4')], 'fortran_order': False, 'shape': (1, 1, 1)}\n"), {"bounds": BOX}, "values of type"),
        (header("(" * 200), {"bounds": BOX}, "header makes no sense"),
        (header("{'descr': '<f4', 'fortran_order': False, 'shape': (-1, 1, 1)}\n"), {"bounds": BOX}, "header makes no sense"),
        (member("density.npy", b"nonsense"), {"bounds": BOX}, "does not begin as NumPy's do"),
        (member("readme.txt", b"nonsense"), {"bounds": BOX}, "no array 'density', but none"),
        (npz(density=CUBE, bounds=BOX)[:-30], {}, "its archive cannot be read"),
        (made.vol(CUBE, kind=2), {}, "values of kind 2, not float32"),
        (made.vol(CUBE, version=2), {}, "version 2"),
        (made.vol(CUBE)[:-1], {}, "is cut off"),
        (made.vol(CUBE)[:8] + b"\xff\xff\xff\x7f" + made.vol(CUBE)[12:], {}, "more than the limit"),
        (made.vol(CUBE)[:8] + bytes(4) + made.vol(CUBE)[12:], {}, "is damaged: 0x2x2 voxels"),
        (made.vdb(Grid(leaves=made.leaves_of(CORNER, VALUES))), {"bounds": BOX}, "lies where the file itself says; leave its bounds away"),
    ],
)
def test_dense_files_refused(data, more, line, tmp_path):
    tracemalloc.start()
    with pytest.raises(AirlightError, match=line) as told:
        read_volume(kept(tmp_path, data, "a.bin"), **more)
    assert tracemalloc.get_traced_memory()[1] < 20e6
    tracemalloc.stop()
    assert "\n" not in str(told.value) and "; " in str(told.value)


@pytest.mark.filterwarnings("ignore:.*coarsened")
@pytest.mark.parametrize("whole", made.seeds())
def test_cut_off(whole, tmp_path):
    more = {"bounds": BOX} if whole[:6] == b"\x93NUMPY" else {"grid": "0"} if whole[:3] == b"VOL" else {}
    read_volume(kept(tmp_path, whole), limit=10**4, **more)
    for end in [*range(0, len(whole), max(1, len(whole) // 60)), len(whole) - 1]:
        with pytest.raises(AirlightError, match=r"cut off|empty|archive|no volume|makes no sense|begin as|damaged"):
            read_volume(kept(tmp_path, whole[:end]), limit=10**4, **more)


# ---------------------------------------------------------------- what is no density


def test_broken_and_negative_voxels(tmp_path):
    density = np.full((8, 9, 10), 2, np.float32)
    density[3, 4, 4:6], density[0, 0, 0], density[7, 8, 9] = np.nan, np.inf, -0.001
    density[3, 4, 6] = 5
    grid = Grid(leaves=made.leaves_of((0, 0, 0), density.T, np.ones(density.T.shape, bool)))
    for path, more in ((kept(tmp_path, npy(density), "a.npy"), {"bounds": BOX}), (kept(tmp_path, made.vdb(grid)), {})):
        with pytest.warns(UserWarning) as told:
            volume = read_volume(path, **more)
        first = "0, 0, 0"
        lines = [str(one.message) for one in told]
        assert re.search(f"3 voxels that are no finite numbers, the first at x, y, z = {first}, are mended from those around", lines[0])
        assert "1 voxels slightly below 0, down to -0.001, are taken as 0" in lines[1] and len(lines) == 2
        mended = volume.density if more else volume.density[1:-1, 1:-1, 1:-1]
        expected = density.copy()
        expected[3, 4, 4], expected[3, 4, 5], expected[0, 0, 0], expected[7, 8, 9] = 2, (24 * 2 + 5) / 25, 2, 0
        np.testing.assert_allclose(mended, expected, rtol=1e-6)
    density[:, :, 2:] = np.nan
    with pytest.raises(AirlightError, match="577 of its 720 voxels are no finite numbers, the first at x, y, z = 0, 0, 0"):
        read_volume(kept(tmp_path, npy(density), "a.npy"), bounds=BOX)
    with pytest.raises(AirlightError, match="negative densities, 720 voxels down to -3, the first at x, y, z = 0, 0, 0; densities are 0"):
        read_volume(kept(tmp_path, npy(np.full((8, 9, 10), -3)), "a.npy"), bounds=BOX)


def test_inactive_voxels(tmp_path):
    """What is stored counts within the box of the active ones, as in OpenVDB's samplers; what lies outside is told."""
    active = np.zeros(VALUES.shape, bool)
    active[2:9, 3:8, 1:7] = True
    values = np.ones(VALUES.shape, np.float32)
    values[0, 0, 0], values[19, 12, 8] = np.nan, -1
    grid = Grid(leaves=made.leaves_of((0, 0, 0), values, active))
    with pytest.warns(UserWarning, match=f"{VALUES.size - 7 * 5 * 6} inactive voxels that are not 0, outside the box"):
        volume = read_volume(kept(tmp_path, made.vdb(grid)))
    assert volume.density.sum() == 7 * 5 * 6 and volume.stored == (6, 5, 7) and len(volume.told) == 1


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
