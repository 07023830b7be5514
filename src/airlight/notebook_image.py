"""Arrays that notebooks show as pictures."""

import tempfile
from pathlib import Path
from typing import Any

import numpy as np


class NotebookImage(np.ndarray):
    """Behaves as a NumPy array that a notebook shows: (H, W) or (H, W, 1, 3 or 4), floats as linear light."""

    def _repr_png_(self) -> bytes | None:
        if self.ndim not in (2, 3) or self.size == 0 or (self.ndim == 3 and self.shape[2] not in (1, 3, 4)):
            return None
        from airlight.arrays import to_linear
        from airlight.files import write_image

        codes: Any = np.asarray(self)
        rgb, _ = to_linear(codes)
        same = codes.dtype == np.uint8 and codes.ndim == 3 and codes.shape[2] >= 3
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, "image.png")
            write_image(path, rgb, encoded=np.ascontiguousarray(codes[..., :3]) if same else None)
            return path.read_bytes()


def shown(array: np.ndarray) -> Any:
    return array.view(NotebookImage)
