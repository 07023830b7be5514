"""Pictures' RGB colour spaces that ICC profiles describe, by OpenColorIO."""

import os
import tempfile
from collections.abc import Callable

import numpy as np

from airlight.colour import srgb_encode

# XYZ (D65) to linear Rec. 709.
XYZ_TO_709 = np.linalg.inv(
    [[0.4123907993, 0.3575843394, 0.1804807884], [0.2126390059, 0.7151686788, 0.0721923154], [0.0193308187, 0.1191947798, 0.9505321522]]
)


class Profile:
    """Convert by an RGB ICC profile: `decode` and `encode` work in place on contiguous (h, W, 3) float32, codes as 0..1."""

    def __init__(self, icc: bytes):
        """Compile a profile. Raises ValueError where OpenColorIO cannot use it (tables instead of curves and a matrix, damage, not RGB)."""
        import PyOpenColorIO as ocio

        ocio.SetLoggingLevel(ocio.LOGGING_LEVEL_NONE)  # it prints what it thinks of a profile's curves
        if icc[16:20] != b"RGB ":
            raise ValueError("not an RGB profile")
        handle, name = tempfile.mkstemp(suffix=".icc")
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(icc)
            matrix = np.eye(4)
            matrix[:3, :3] = XYZ_TO_709
            both = ocio.GroupTransform()
            both.appendTransform(ocio.FileTransform(src=name, direction=ocio.TRANSFORM_DIR_INVERSE))
            both.appendTransform(ocio.MatrixTransform(matrix=matrix.ravel().tolist()))
            config = ocio.Config.CreateRaw()
            directions = (ocio.TRANSFORM_DIR_FORWARD, ocio.TRANSFORM_DIR_INVERSE)
            ways = [config.getProcessor(both, way).getOptimizedCPUProcessor(ocio.OPTIMIZATION_LOSSLESS) for way in directions]
        except ocio.Exception as error:
            raise ValueError(str(error).strip().splitlines()[-1]) from error
        finally:
            os.unlink(name)
        self.decode: Callable[[np.ndarray], None] = ways[0].applyRGB
        self.encode: Callable[[np.ndarray], None] = ways[1].applyRGB

    def is_srgb(self) -> bool:
        """Compare the profile with sRGB, to within half an 8-bit code."""
        steps = np.linspace(0, 1, 9, dtype=np.float32)
        codes = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1).reshape(1, -1, 3)
        linear = codes.copy()
        self.decode(linear)
        if not np.isfinite(linear).all():
            raise ValueError("gives no finite colours")
        return bool(np.abs(srgb_encode(np.clip(linear, 0, 1)) - codes).max() <= 1 / 512)

    def matrix(self) -> tuple[np.ndarray | None, bool]:
        """Give its linear RGB's matrix (3, 3) to linear Rec. 709, None where it is that, and tell whether codes are linear light."""
        rows = np.concatenate([np.eye(3), np.eye(3) / 4, np.full((1, 3), 0.5)]).astype(np.float32).reshape(1, 7, 3)
        self.decode(rows)
        matrix = rows[0, :3].T.astype(np.float64)
        if not np.isfinite(rows).all():
            raise ValueError("gives no finite colours")
        is_linear = np.allclose(rows[0, 3:6].T * 4, matrix, atol=2e-3) and np.allclose(rows[0, 6] * 2, matrix.sum(axis=1), atol=2e-3)
        return (None if np.abs(matrix - np.eye(3)).max() < 5e-4 else matrix), bool(is_linear)
