"""OpenVDB's own library reads files as Airlight does: real ones, some that it wrote, and those of the tests' own writer."""

import itertools
import os
import shutil
import subprocess
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import volume_files as made

from airlight.files.volumes import read_volume

DATA = Path(__file__).parent / "data" / "volumes"
TRUTH = Path(__file__).parent / "openvdb_truth.py"
ENOUGH = 2**40  # voxels: nothing is coarsened


@cache
def interpreter() -> str:
    """Find a Python that has OpenVDB's module, "" where there is none."""
    for candidate in dict.fromkeys(["/usr/bin/python3", shutil.which("python3", path=os.defpath) or ""]):
        for module in ("pyopenvdb", "openvdb"):
            if Path(candidate).is_file() and not subprocess.run([candidate, "-c", f"import {module}"], capture_output=True).returncode:
                return candidate
    return ""


@pytest.fixture
def openvdb():
    if not interpreter() and os.environ.get("CI") != "true":
        pytest.skip("no Python here has OpenVDB's module, which pip does not install: 'apt-get install python3-openvdb' brings one")

    def run(*arguments: object) -> None:
        done = subprocess.run([interpreter(), str(TRUTH), *map(str, arguments)], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr

    return run


def compare(openvdb, folder: Path, files: list[Path], grids: tuple[str, ...] = ("",)) -> int:
    """Compare what is read of files, all values in the box of the active voxels bit for bit, and where it lies; count the active voxels."""
    names = [(path, grid) for path in files for grid in grids]
    openvdb("read", folder / "truth.npz", *(f"{path}::{grid}" for path, grid in names))
    total = 0
    with np.load(folder / "truth.npz") as kept:
        for i, (path, grid) in enumerate(names):
            truth = {key: kept[f"{i}:{key}"] for key in ("values", "active", "corners", "count")}
            volume = read_volume(str(path), grid=grid or None, limit=ENOUGH)
            values = volume.density[1:-1, 1:-1, 1:-1].transpose(2, 1, 0)
            np.testing.assert_array_equal(values, truth["values"], str(path))
            assert np.count_nonzero(truth["active"]) == truth["count"]
            assert np.count_nonzero(volume.density) == np.count_nonzero(values)  # around it all is 0
            shape = np.array(values.shape)
            ends = np.array([[1, 1, 1], shape, [1, shape[1], 1]])
            np.testing.assert_allclose(ends @ volume.matrix[:3, :3].T + volume.matrix[:3, 3], truth["corners"], rtol=1e-12, atol=1e-9)
            total += int(truth["count"])
    return total


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.*inactive voxels")
def test_real_files(openvdb, tmp_path):
    assert compare(openvdb, tmp_path, [DATA / "sphere-openimageio.vdb"]) == 9047
    assert compare(openvdb, tmp_path, [DATA / "torus-arnold.vdb"], ("voxel_fog_density",)) == 2450


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.*inactive voxels")
def test_files_that_openvdb_wrote(openvdb, tmp_path):
    openvdb("write", tmp_path)
    files = sorted(tmp_path.glob("*.vdb"))
    assert len(files) == 8
    assert compare(openvdb, tmp_path, files) > 10**7
    assert compare(openvdb, tmp_path, [tmp_path / "instance.vdb"], ("smoke", "density")) == 2 * 1191


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.*inactive voxels")
def test_made_files(openvdb, tmp_path):
    """Versions, compressions, tiles, maps; of doubles OpenVDB's module in Debian reads none."""
    random = np.random.default_rng(5)
    values = random.random((20, 13, 9)).astype(np.float32) * (random.random((20, 13, 9)) < 0.7)
    kept = random.random(values.shape)
    for i, (half, flags, version) in enumerate(itertools.product((False, True), (0, 1, 2, 3, 4, 6), (222, 223, 224))):
        held = np.choose((kept * 9).astype(int) % (2 + i % 4), [values, 0.0 * values, 0.25 + 0 * values, 0.75 + 0 * values, values])
        leaves = made.leaves_of((-9, 3, 120), np.asarray(held, np.float32), (kept < 0.5) & (held > 0))
        tiles = {((16, 0, 120), 8): (0.5, True), ((-16, 0, 104), 8): (0.25, False), ((128, 0, 0), 128): (0.75, True)}
        shapes = {"blosc": {}}
        if flags & 4:
            shapes = {"blosc": [{}, {"block": 256}, {"whole": True}, {"stored": True}, {"codec": 3}, {"shuffled": False}][i % 6]}
        maps = ("ScaleMap", ((0.1, 0.2, 0.3),)), ("TranslationMap", (1, 2, 3)), ("ScaleTranslateMap", ((0.5, 0.25, 1.0), (3, 4, 5)))
        turned = [[0, 0.2, 0, 0], [-0.2, 0, 0, 0], [0.1, 0, 0.3, 0], [7, 8, 9, 1]]
        maps += ("UniformScaleTranslateMap", (2.0, (1, 1, 1))), ("AffineMap", turned), ("UniformScaleMap", (0.125,))
        grid = made.Grid(leaves=leaves, tiles=tiles, half=half, flags=flags, map=maps[i % 6], **shapes)
        (tmp_path / f"{i}-{half}-{flags}-{version}.vdb").write_bytes(made.vdb(grid, version=version))
    assert compare(openvdb, tmp_path, sorted(tmp_path.glob("*.vdb"))) > 36 * 128**3
