"""Dense volumes, Blosc frames, voxels that are no densities, and files that are cut off."""

import io
import pickle
import re
import tracemalloc
import zipfile

import numpy as np
import pytest
import volume_files as made
from volume_files import BOX, Grid, kept, npy, npz, sampled

from airlight.errors import AirlightError
from airlight.files.volumes import read_volume
from airlight.files.volumes.blosc import inflate, lz4, unpack

RANDOM = np.random.default_rng(7)
VALUES = (RANDOM.random((20, 13, 9)) * (RANDOM.random((20, 13, 9)) < 0.7)).astype(np.float32)
CORNER = (-9, 3, 120)


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
        (npy(CUBE[0]), {"bounds": BOX}, r"has 2 dimensions, not three: its shape is \(2, 2\); a volume is density\[z, y, x\]"),
        (npy(CUBE[0]), {}, "has 2 dimensions, not three"),  # before anything is asked of it that would not help
        (npy(CUBE[:0]), {"bounds": BOX}, r"has no voxels: its shape is \(0, 2, 2\)"),
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
        assert "1 voxel slightly below 0, down to -0.001, is taken as 0" in lines[1] and len(lines) == 2
        mended = volume.density if more else volume.density[1:-1, 1:-1, 1:-1]
        expected = density.copy()
        expected[3, 4, 4], expected[3, 4, 5], expected[0, 0, 0], expected[7, 8, 9] = 2, (24 * 2 + 5) / 25, 2, 0
        np.testing.assert_allclose(mended, expected, rtol=1e-6)
    density[3, 4, 5], density[0, 0, 0] = 2, 2
    with pytest.warns(UserWarning, match="1 voxel that is no finite number, the first at x, y, z = 4, 4, 3, is mended from those around"):
        read_volume(kept(tmp_path, npy(density.clip(0)), "a.npy"), bounds=BOX)
    density[:, :, 2:] = np.nan
    with pytest.raises(AirlightError, match="576 of its 720 voxels are no finite numbers, the first at x, y, z = 2, 0, 0"):
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
