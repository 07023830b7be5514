"""Putting the layer on the picture."""

from typing import Any

import numpy as np


def composite(image: Any, layer: Any, blend: str, mix: float = 1.0) -> Any:
    """out = a + b (add), or a + b' (1 - a) with b' = b / (1 + b) (screen), linear; the identity where the layer is zero."""
    part = layer * np.asarray(mix, layer.dtype)
    if blend == "add":
        return image + part
    return image + np.maximum(1 - image, 0) * (part / (1 + part))
