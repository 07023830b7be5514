"""Holds what a comparison found. Errors are over the mean of the truth; pictures are linear, scaled down to fit a box."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from airlight.compare.variants import Variant
from airlight.options import Parameters

Array = npt.NDArray[Any]


@dataclass
class Row:
    """A variant's figures. copies: its ms over those of a one-tap copy."""

    variant: Variant
    rmse: float
    p99: float
    worst: float
    ms: float
    copies: float
    shown: Array  # (h, w, 3) the composited picture
    difference: Array  # (h, w) |layer - truth|, mean of RGB, over the mean


@dataclass
class PictureRow(Row):
    parameters: Parameters  # the threshold resolved
    reference_error: float
    best_error: float  # rmse of what the difference is against


@dataclass
class SceneRow(Row):
    """layer: (h, w, 3) the light alone, times factor where that is not None: of methods without units, which have no bias."""

    layer: Array
    truth: int  # which of the truths
    bias: float | None = None
    factor: float | None = None
    parts: list[tuple[str, float]] | None = None  # (name, ms) of the cost; None where the device has no timestamps


@dataclass
class Truth:
    """Holds what a scene's variants are measured against. about: by what its light is computed."""

    about: str
    kept: int  # pixels at which the error is measured
    shown: Array  # (h, w, 3) composited as the variants are
    layer: Array  # (h, w, 3)


@dataclass
class Comparison:
    rows: list[Any]  # of its kind
    adapter: str
    copy_ms: float
    size: tuple[int, int]


@dataclass
class PictureComparison(Comparison):
    rows: list[PictureRow]
    points: int
    everywhere: bool  # the reference was evaluated at all pixels, and differences are against it
    before: Array  # (h, w, 3) the picture


@dataclass
class SceneComparison(Comparison):
    rows: list[SceneRow]
    truths: list[Truth]

    @property
    def white(self) -> float:
        """Choose what of the light alone is shown white."""
        return max(float(np.quantile(self.truths[0].layer, 0.999)), 1e-9)
