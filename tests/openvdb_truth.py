"""OpenVDB's own reading and writing of files, by an interpreter that has its module. Used by test_volumes_openvdb.py.

    write FOLDER                  makes files
    read OUT FILE[::GRID]...      keeps, for each grid, the box of its active voxels, their values and which are active
"""

import sys

import numpy as np

try:
    import openvdb as vdb  # from OpenVDB 12 on
except ImportError:
    import pyopenvdb as vdb


def fill(grid, low, high, value):
    grid.fill(low, high, value)
    return grid


def noise(shape, share=0.7, seed=0):
    random = np.random.default_rng(seed)
    return (random.random(shape) * (random.random(shape) < share)).astype(np.float32)


def write(folder):
    def keep(name, *grids):
        for grid in grids:
            grid.gridClass = vdb.GridClass.FOG_VOLUME
        vdb.write(f"{folder}/{name}.vdb", list(grids))

    def named(name="density", half=False):
        grid = vdb.FloatGrid()
        grid.name, grid.saveFloatAsHalf = name, half
        return grid

    for half in (False, True):
        grid = named(half=half)
        grid.copyFromArray(noise((40, 23, 57)), ijk=(-13, 4090, -60))
        keep(f"noise-half{half}", grid)
        grid = named(half=half)
        fill(grid, (-140, -70, -100), (90, 95, 80), 0.5)
        grid.copyFromArray(noise((30, 30, 30), seed=1), ijk=(0, 0, 0))
        grid.copyFromArray(np.full((16, 16, 16), 0.25, np.float32), ijk=(64, 64, 64))
        grid.prune()
        keep(f"tiles-half{half}", grid)
    big = fill(named(), (-1500, 0, 0), (520, 30, 20), 2.0)
    keep("root", big)
    first = named("smoke")
    first.copyFromArray(noise((12, 12, 12), seed=2))
    second = first.copy()
    second.name = "density"
    second.transform = vdb.createLinearTransform([[0.1, 0.2, 0, 0], [-0.2, 0.1, 0, 0], [0, 0, 0.3, 0], [5, 6, 7, 1]])
    keep("instance", first, second)
    both = named()
    both.copyFromArray(noise((9, 9, 9), seed=3))
    colour = vdb.Vec3SGrid()
    colour.name = "colour"
    colour.fill((0, 0, 0), (5, 5, 5), (1, 0, 0))
    mask = vdb.BoolGrid()
    mask.name = "mask"
    mask.fill((0, 0, 0), (5, 5, 5), True)
    keep("others", colour, mask, both)
    inactive = named()
    values = noise((24, 24, 24), seed=4)
    inactive.copyFromArray(values)
    inactive.mapOn(lambda value: value)
    access = inactive.getAccessor()
    for i in range(24):  # stored, and not active
        for j in range(24):
            access.setValueOff((i, j, (i * j) % 20), 0.125 if j % 2 else -0.0)
            if i > 12:
                access.setValueOff((i, j, 3), 0.375)
            if i > 20:
                access.setValueOff((i, j, 5), i / 64)
    keep("inactive", inactive)


def read(out, names):
    kept = {}
    for i, name in enumerate(names):
        path, _, wanted = name.partition("::")
        grid = vdb.read(path, wanted or "density")
        low, high = grid.evalActiveVoxelBoundingBox()
        shape = [b - a + 1 for a, b in zip(low, high)]
        values, active = np.zeros(shape, np.float32), np.zeros(shape, np.float32)
        grid.copyToArray(values, ijk=low)
        count = grid.activeVoxelCount()
        grid.mapOff(lambda value: 0.0)
        grid.mapOn(lambda value: 1.0)
        grid.copyToArray(active, ijk=low)
        corners = [grid.transform.indexToWorld(place) for place in (low, high, (low[0], high[1], low[2]))]
        held = {"low": low, "values": values, "active": active > 0, "corners": corners, "count": count}
        kept |= {f"{i}:{key}": np.array(value) for key, value in held.items()}
    np.savez(out, **kept)


if __name__ == "__main__":
    if sys.argv[1] == "write":
        write(sys.argv[2])
    else:
        read(sys.argv[2], sys.argv[3:])
