"""Take means of a grid's voxels over the cells of a coarser one, block by block, so that the fine grid need not be held as a whole."""

import numpy as np


class Means:
    """Gathers blocks of voxels into a grid (Z, Y, X) of means, float64; the sum over cells, times their size, stays what it was.

    stored: (Z, Y, X) voxels, in all; kept: (Z, Y, X) cells, as many or fewer along each axis. Where they are as many, values come through
    bit for bit. What lies beyond the stored box is left out.
    """

    def __init__(self, stored: tuple[int, ...], kept: tuple[int, ...]) -> None:
        self.stored, self.kept = stored[::-1], kept[::-1]  # x, y, z
        self.grid = np.zeros(kept)

    def add(self, corners: np.ndarray, values: np.ndarray, edge: int = 1) -> None:
        """Add blocks (B, Dx, Dy, Dz) of cubes of `edge` voxels a side. corners: (B, 3), their first voxels x, y, z, in the box or not."""
        shares = [self._shares(corners[:, axis], values.shape[axis + 1], edge, axis) for axis in range(3)]
        wx, wy, wz = (weights for _, weights in shares)
        out = np.matmul(np.matmul(wy.transpose(0, 2, 1)[:, None], values), wz[:, None])
        out = np.matmul(wx.transpose(0, 2, 1), out.reshape(*out.shape[:2], -1)).reshape(len(out), wx.shape[2], *out.shape[2:])
        self._put([first for first, _ in shares], out)

    def _put(self, firsts: list[np.ndarray], cells: np.ndarray) -> None:
        """Add blocks of cells (B, Kx, Ky, Kz); those beyond the grid are 0."""
        if len(cells) == 1:  # no cell twice
            x, y, z = (slice(int(first[0]), int(first[0]) + n) for first, n in zip(firsts, cells.shape[1:], strict=True))
            part = self.grid[z, y, x]
            part += cells[0].T[: part.shape[0], : part.shape[1], : part.shape[2]]
            return
        x, y, z = (
            np.minimum(first[:, None] + np.arange(n), size - 1) for first, n, size in zip(firsts, cells.shape[1:], self.kept, strict=True)
        )
        flat = (z[:, None, None, :] * self.kept[1] + y[:, None, :, None]) * self.kept[0] + x[:, :, None, None]
        np.add.at(self.grid.reshape(-1), flat.reshape(-1), cells.reshape(-1))

    def _shares(self, corner: np.ndarray, count: int, edge: int, axis: int) -> tuple[np.ndarray, np.ndarray]:
        """Work out along an axis the first cell (B,) and how much each of the voxels has in each of the cells from there, (B, count, K)."""
        voxels = np.clip(corner[:, None] + edge * np.arange(count + 1), 0, self.stored[axis])
        ends = voxels * (self.kept[axis] / self.stored[axis])
        first = np.floor(ends[:, 0]).astype(np.int64)
        reach = max(1, int(np.max(np.ceil(ends[:, -1] - 1e-9) - first)))
        cell = (first[:, None] + np.arange(reach))[:, None, :]
        low, high = ends[:, :-1, None], ends[:, 1:, None]
        return first, np.maximum(0.0, np.minimum(high, cell + 1) - np.maximum(low, cell))

    def add_planes(self, planes: np.ndarray, first: int) -> None:
        """Add whole planes (D, Y, X) of a dense grid, the first of them at that z."""
        for axis in (1, 2):
            planes = _along(planes, axis, self.grid.shape[axis])
        each = self.kept[2] / self.stored[2]
        for i, plane in enumerate(planes):
            low, high = (first + i) * each, (first + i + 1) * each
            for cell in range(int(low), min(int(np.ceil(high)), self.kept[2])):
                share = min(high, cell + 1) - max(low, cell)
                if share > 1e-9:
                    self.grid[cell] += share * plane


def _along(values: np.ndarray, axis: int, size: int) -> np.ndarray:
    """Take the means along one axis over `size` cells."""
    count = values.shape[axis]
    if count == size:
        return values
    ends = np.arange(size + 1) * (count / size)
    low, high = ends[:-1], ends[1:]
    start = low.astype(np.int64)
    form = [1] * values.ndim
    form[axis] = size
    total = np.zeros([size if a == axis else n for a, n in enumerate(values.shape)])
    for step in range(int(np.ceil(count / size)) + 1):
        at = start + step
        share = np.maximum(0.0, np.minimum(high, at + 1) - np.maximum(low, at)) * (size / count)
        total += share.reshape(form) * np.take(values, np.minimum(at, count - 1), axis)
    return total
