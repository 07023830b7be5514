"""Grids in one texture: where they lie, and what is interpolated there."""

import numpy as np
from calling import call

from airlight.gpu.device import open_device
from airlight.gpu.structs import struct_dtype
from airlight.reference import grid as twins
from airlight.scatter.march.atlas import GAP, MAX_TEXELS, Atlas, arrange, filters
from airlight.scatter.march.varying import UNBOUND, slabs_of

FIELD = "scatter/march/field.wgsl"
RNG = np.random.default_rng(5)


def test_grids_lie_apart_where_they_take_least_room() -> None:
    counts = [(9, 9, 3), (9, 9, 2), (8, 9, 4)]
    size, corners = arrange(counts, 2048) or ((0, 0, 0), [])
    assert size == (9, 9, 9 + 2 * GAP) and corners == [(0, 0, 0), (0, 0, 3 + GAP), (0, 0, 5 + 2 * GAP)]
    assert arrange([(1500, 4, 4), (1500, 4, 4)], 2048) == ((1500, 9, 4), [(0, 0, 0), (0, 4 + GAP, 0)])
    assert arrange([(2049, 2, 2)], 2048) is None
    assert arrange([(1024, 1024, MAX_TEXELS // 2**20 + 1)], 2048) is None


def test_the_texture_gives_what_the_buffer_does() -> None:
    """With grids that are huge beside one that is not, of which nothing may leak."""
    device = open_device()
    shapes = ((1e5, (4, 5, 6)), (1, (3, 4, 6)), (1e5, (2, 5, 6)), (1, (1, 1, 1)))
    grids = [RNG.uniform(0, high, shape).astype(np.float32) for high, shape in shapes]
    ends = np.cumsum([0, *(grid.size for grid in grids)])
    atlas, own = Atlas(device), np.zeros((), struct_dtype(FIELD, "Field"))
    atlas.update(grids)
    if not filters(device):
        assert not atlas.corners
        return
    own["atlas_texel"] = 1 / np.array(atlas.texture.size)
    for i, grid in enumerate(grids):
        own["grids"][i]["count"], own["grids"][i]["first"] = grid.shape[::-1], ends[i]
        own["grids"][i]["corner"] = (np.array(atlas.corners[i]) + 0.5) * own["atlas_texel"]
    at = RNG.uniform(-1, 6, (400, 3)).astype(np.float32)
    voxels = np.concatenate([grid.ravel() for grid in grids])
    bindings = {"field": own, "voxels": voxels, "atlas": atlas.texture, "linear": device.sampler()}
    for i, grid in enumerate(grids):
        which = np.full(400, i, np.uint32)
        buffered = call(FIELD, "grid_density", [at, which], bindings=bindings)
        sampled = call(FIELD, "grid_density", [at, which], bindings=bindings, constants={"ATLAS": True})
        assert np.abs(sampled - buffered).max() < (0.02 if i in (1, 3) else 0.01 * grid.max())
    held = atlas.texture
    atlas.update([grids[0], 2 * grids[1], *grids[2:]])
    assert atlas.texture is held
    doubled = call(FIELD, "grid_density", [at, np.full(400, 1, np.uint32)], bindings=bindings, constants={"ATLAS": True})
    np.testing.assert_allclose(doubled.mean(), 2 * grids[1].mean(), rtol=0.2)


def test_rays_are_cut_to_where_there_is_density() -> None:
    density = np.zeros((7, 8, 9))
    density[1, 2, 5] = density[3, 4, 6] = 1
    low_sums, high_sums, low_differences, high_differences = slabs_of(density)
    assert list(low_sums) == [5, 1, 4] and list(high_sums) == [12, 9, 11]
    assert list(low_differences) == [0, -1, -6] and list(high_differences) == [5, 3, -1]
    assert (np.abs(slabs_of(0 * density)) == UNBOUND).all()
    b, a = RNG.uniform(-4, 9, (400, 3)).astype(np.float32), RNG.uniform(-3, 3, (400, 3)).astype(np.float32)
    ranges = np.tile(np.float32([0, 4]), (400, 1))
    bottom, top = np.float32([0, -1, -2]), np.float32([5, 3, 1])
    found = call("medium/grid.wgsl", "clip_to_slabs", [b, a, ranges, bottom, top])
    truth = twins.clip_to_slabs(b, a, ranges, bottom, top)
    some = truth[:, 1] > truth[:, 0]
    assert some.sum() > 20 and ((found[:, 1] > found[:, 0]) == some).all()
    np.testing.assert_allclose(found[some], truth[some], rtol=1e-4, atol=1e-4)
