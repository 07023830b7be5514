"""Grids in one texture: where they lie, and what is interpolated there."""

import numpy as np
from calling import call

from airlight.gpu.device import open_device
from airlight.gpu.structs import struct_dtype
from airlight.scatter.march.atlas import GAP, MAX_TEXELS, Atlas, arrange, filters

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
