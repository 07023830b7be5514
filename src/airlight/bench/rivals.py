"""The strongest rival on a CPU: OpenCV's polar warp with prefix moments. Only for density 1 and a light in the picture."""

from typing import Any

import numpy as np

from airlight.scatter.epipolar.moments import mixture


class PolarWarp:
    """Computes S by OpenCV: the image warped to (radius, angle), running moments along the radius, warped back.

    Maps and factors are made once, like a plan; the moments are those of the epipolar method. step: of the radius, px.
    """

    def __init__(self, cv2: Any, size: tuple[int, int], light: tuple[float, float], lam: float, angles: int, step: float) -> None:
        self.cv2 = cv2
        width, height = size
        at = light[0] * width - 0.5, light[1] * height - 0.5  # OpenCV counts from pixel centres
        reach = max(np.hypot(x - at[0], y - at[1]) for x in (0, width - 1) for y in (0, height - 1))
        edge = step * np.arange(int(np.ceil(reach / step)) + 3)
        middle, outer = 0.5 * (edge[1:] + edge[:-1]), edge[1:]
        phi = 2 * np.pi * np.arange(angles) / angles
        self.there = [(np.outer(middle, turn(phi)) + a).astype(np.float32) for turn, a in zip((np.cos, np.sin), at, strict=True)]
        x, y = np.meshgrid(np.arange(width) - at[0], np.arange(height) - at[1])
        turns = np.mod(np.arctan2(y, x), 2 * np.pi) * angles / (2 * np.pi)
        self.back = [m.astype(np.float32) for m in (turns, np.maximum(np.hypot(x, y) / step - 1, 0))]  # row i holds S at outer[i]
        mix = mixture(1.0, lam)
        far = edge[-1]  # keeps the powers in range
        self.weights = np.stack([np.diff((edge / far) ** (p + 1)) / (p + 1) for p in mix.p]).astype(np.float32)
        self.factors = np.stack([c * (outer / far) ** -(p + 1) for p, c in zip(mix.p, mix.c, strict=True)]).astype(np.float32)

    def __call__(self, image: np.ndarray) -> np.ndarray:
        """Sum an image (H, W, 3) float32 to S, likewise."""
        cv2 = self.cv2
        polar = cv2.remap(image, *self.there, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        rows = polar.reshape(len(polar), -1)
        sums = np.zeros((len(self.weights), rows.shape[1]), np.float32)
        part = np.empty(rows.shape[1], np.float32)
        for i, row in enumerate(rows):  # row by row, so that all of it stays in the cache
            for total, weight in zip(sums, self.weights[:, i], strict=True):
                np.multiply(row, weight, out=part)
                np.add(total, part, out=total)
            np.multiply(sums[0], self.factors[0, i], out=row)
            for total, factor in zip(sums[1:], self.factors[1:, i], strict=True):
                np.multiply(total, factor, out=part)
                np.add(row, part, out=row)
        return np.asarray(cv2.remap(polar, *self.back, cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP))
