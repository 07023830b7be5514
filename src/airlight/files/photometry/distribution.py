"""Hold how a lamp spreads its light, as photometric files measure it, and the rules that every format's numbers are held to."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NoReturn

import numpy as np

from airlight.errors import AirlightError
from airlight.messages import counted

MAX_VALUES = 2**21  # intensities of a file
MAX_CANDELA = 1e9  # as of lights of scenes
LEAST_CANDELA = 1e-9
MAX_NEGATIVE = 0.01  # of the peak: by how much an intensity may lie below 0 before it is no noise of a measurement any more
WITHIN = 0.05  # degrees, by which angles may be off where they say how a distribution is symmetric
ROUNDING = 1e-6  # degrees
CLOSING = 1.5  # widest steps that may lie between the last plane and the first, around the circle
TABLE_ERROR = 1e-3  # of bilinear lookups in `table`, of the peak
ROWS = (181, 361, 721, 1801, 3601)  # of `table`, the fewest that do
COLUMNS = (72, 360, 720, 1440)
MAX_TEXELS = 2**22
JUMP_ROWS = 721  # of `table` where the light ends at once: what is mixed there is a quarter of a degree
POLAR_ROWS = 721  # of `table` of the types A and B, whose poles are aside
RANGES = {"A": ((-90, 90), (-180, 180)), "B": ((-180, 180), (-90, 90)), "C": ((0, 180), (-360, 720))}


@dataclass(frozen=True, eq=False)
class IntensityDistribution:
    """Luminous intensities over directions: a Photometry of `lights/shape.py`.

    kind: the type of photometry by IES LM-63. vertical (V,), horizontal (H,): degrees, ascending. factors: (H, V), 0..1, of `peak`, cd,
    the greatest intensity. mirrored: whether the planes repeat as mirror images around the circle (C), or to the left (A, B); upright:
    whether what is below is the mirror image of what is above (A, B). tilt: (2, N) degrees by which the luminaire is turned up from where
    it points straight down, and factors of `peak` then. told: what was mended, a line each.

    Directions are given along right, up, ahead, as seen from the lamp; `ahead` is where both angles are 0.

    C: ahead is the nadir, straight down as the luminaire hangs; the vertical angle is that to it. The horizontal angle goes from right, 0,
    by way of up, 90: counterclockwise as seen from above a luminaire that shines down. Planes share the axis ahead.
    B: vertical angles turn around the axis to the right, positive upwards; horizontal ones rise from the vertical plane to the right: this
    axis is their pole.
    A: horizontal angles turn around the axis up, positive to the right; vertical ones rise from the horizontal plane: up is their pole.
    """

    kind: str
    vertical: np.ndarray
    horizontal: np.ndarray
    factors: np.ndarray
    peak: float
    mirrored: bool = False
    upright: bool = False
    tilt: np.ndarray | None = None
    path: str = ""
    told: tuple[str, ...] = ()

    def at(self, q: Any) -> np.ndarray:
        """Evaluate (...) the intensity, as a share of the peak's, in directions q (..., 3), of any length; 0 beyond the file's angles."""
        right, up, ahead = np.moveaxis(np.asarray(q, float), -1, 0)
        across = {"A": up, "B": right, "C": np.hypot(right, up)}[self.kind]
        if self.kind == "C":
            return self._among(_degrees(across, ahead), _degrees(up, right))
        if self.kind == "B":
            return self._among(_degrees(up, ahead), _degrees(across, np.hypot(up, ahead)))
        return self._among(_degrees(across, np.hypot(right, ahead)), _degrees(right, ahead))

    @cached_property
    def table(self) -> np.ndarray:
        """Sample (R, C): rows from ahead to behind, 0 to 180 degrees with both ends, columns from right by way of up, 0 to 360 degrees
        without the last.

        Of type C the coarsest of some steps, 1 to 1/20 degree between rows and 5 to 1/4 between columns, whose bilinear lookups are within
        TABLE_ERROR of `at`, the finest where none is; but where the light ends at once. At most MAX_TEXELS. Of A and B 1/4 degree.
        """
        if self.kind != "C":
            t, p = np.meshgrid(np.linspace(0, np.pi, POLAR_ROWS), np.arange(2 * POLAR_ROWS - 2) * (np.pi / (POLAR_ROWS - 1)), indexing="ij")
            return self.at(np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)], axis=-1))
        ends = [end for end, side in ((self.vertical[0], 0), (self.vertical[-1], -1)) if 0 < end < 180 and self.factors[:, side].any()]
        rows = next((n for n in ROWS if _lost(self.vertical, self.factors, 180 / (n - 1)) <= TABLE_ERROR), ROWS[-1])
        rows = max(rows, JUMP_ROWS) if ends else rows
        columns = 4
        if len(self.horizontal) > 1:
            columns = next((n for n in COLUMNS if _lost(self.horizontal, self.factors.T, 360 / n) <= TABLE_ERROR), COLUMNS[-1])
        rows = next(n for n in (rows, *ROWS[::-1]) if n * columns <= MAX_TEXELS)
        vertical, horizontal = np.linspace(0, 180, rows), np.arange(columns) * (360 / columns)
        return self._among(*np.meshgrid(vertical, horizontal, indexing="ij"))

    def own_candela(self, direction: Sequence[float]) -> float:
        """Give the intensity of the peak that the file says, cd, for a luminaire whose `ahead` is a direction (3,), world, y up."""
        return self.peak * self.tilted(direction)

    def tilted(self, direction: Sequence[float]) -> float:
        """Give the factor of `peak` for a luminaire whose `ahead` is a direction (3,), world, y up; 1 without a TILT section."""
        if self.tilt is None:
            return 1.0
        down = -float(direction[1]) / max(math.hypot(*map(float, direction)), 1e-30)
        return float(np.interp(math.degrees(math.acos(min(max(down, -1.0), 1.0))), *self.tilt))

    def _among(self, vertical: np.ndarray, horizontal: np.ndarray) -> np.ndarray:
        """Interpolate bilinearly between the file's angles."""
        vertical = np.abs(vertical) if self.upright else vertical
        first, span = self.horizontal[0], self.horizontal[-1] - self.horizontal[0]
        if self.kind != "C":
            horizontal = np.abs(horizontal) if self.mirrored else horizontal
        elif len(self.horizontal) > 1:
            around = np.mod(horizontal - first, 2 * span if self.mirrored else 360.0)
            horizontal = first + (np.minimum(around, 2 * span - around) if self.mirrored else np.minimum(around, span))
        else:
            horizontal = np.full_like(vertical, first)
        (i, s, inside), (j, t, beside) = _between(self.vertical, vertical), _between(self.horizontal, horizontal)
        k = np.minimum(j + 1, len(self.horizontal) - 1)
        low = self.factors[j, i] + t * (self.factors[k, i] - self.factors[j, i])
        high = self.factors[j, i + 1] + t * (self.factors[k, i + 1] - self.factors[j, i + 1])
        return np.where(inside & beside, low + s * (high - low), 0.0)


def distribution(
    kind: str, angles: tuple[Sequence[float], Sequence[float]], candela: np.ndarray, path: str, **more: Any
) -> IntensityDistribution:
    """Make a distribution of vertical and horizontal angles, degrees, and (H, V) candela, after a check of them. Raises AirlightError."""
    vertical, horizontal = (np.asarray(one, float) for one in angles)
    told = list(more.pop("told", ()))
    for word, one, (low, high) in zip(("vertical", "horizontal"), (vertical, horizontal), RANGES[kind], strict=True):
        if not (np.diff(one) > 0).all():
            at = int(np.argmax(np.diff(one) <= 0))
            _refuse(path, f"its {word} angles do not rise: {one[at]:g} stands before {one[at + 1]:g}")
        if one[0] < low - WITHIN or one[-1] > high + WITHIN:
            _refuse(path, f"its {word} angles, {one[0]:g} to {one[-1]:g} degrees, are beyond {low} to {high}, those of type {kind}")
    if len(vertical) < 2:
        _refuse(path, "it has one vertical angle, between which and others nothing is known")
    peak = float(candela.max())
    if not LEAST_CANDELA <= peak <= MAX_CANDELA:
        _refuse(path, f"its greatest intensity is {peak:g} cd, beyond {LEAST_CANDELA:g} to {MAX_CANDELA:g}")
    if (lowest := float(candela.min())) < 0:
        if lowest < -MAX_NEGATIVE * peak:
            _refuse(path, f"its intensities go down to {lowest:g} cd, and light cannot be negative")
        told.append(f"{path}: {counted(int((candela < 0).sum()), 'intensity', 'intensities')} below 0, taken for 0")
    factors = np.maximum(candela, 0.0) / peak
    more |= {"path": path, "told": tuple(told)}
    if kind == "C":
        horizontal, factors, more["mirrored"] = _around(horizontal, factors, path)
    else:
        more |= {"mirrored": _from_zero(horizontal), "upright": _from_zero(vertical)}
    return IntensityDistribution(kind, vertical, horizontal, factors, peak, **more)


def _from_zero(angles: np.ndarray) -> bool:
    return abs(float(angles[0])) < WITHIN and len(angles) > 1


def _around(horizontal: np.ndarray, factors: np.ndarray, path: str) -> tuple[np.ndarray, np.ndarray, bool]:
    """Close the circle of a type C's planes: their angles, factors, and whether they repeat as mirror images."""
    span = float(horizontal[-1] - horizontal[0])
    if len(horizontal) == 1 or abs(span - 360) < WITHIN:
        return horizontal, factors, False
    if abs(span - 90) < WITHIN or abs(span - 180) < WITHIN:
        return horizontal, factors, True
    if 180 < span < 360 and 360 - span <= CLOSING * float(np.diff(horizontal).max()):
        return np.append(horizontal, horizontal[0] + 360), np.concatenate([factors, factors[:1]]), False
    _refuse(path, f"its horizontal angles, {horizontal[0]:g} to {horizontal[-1]:g} degrees, leave a part of the circle out")


def _refuse(path: str, reason: str) -> NoReturn:
    raise AirlightError(f"{path}: {reason}; export it again, or correct it")


def _degrees(y: np.ndarray, x: np.ndarray) -> np.ndarray:
    return np.degrees(np.arctan2(y, x))


def _between(angles: np.ndarray, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Find the index of the angle below, the share 0..1 of the next, and whether x lies among the angles, but for rounding."""
    if len(angles) == 1:
        return np.zeros(x.shape, int), np.zeros(x.shape), np.ones(x.shape, bool)
    i = np.clip(np.searchsorted(angles, x, side="right") - 1, 0, len(angles) - 2)
    share = np.clip((x - angles[i]) / (angles[i + 1] - angles[i]), 0.0, 1.0)
    return i, share, (x >= angles[0] - ROUNDING) & (x <= angles[-1] + ROUNDING)


def _lost(angles: np.ndarray, factors: np.ndarray, step: float) -> float:
    """Find by how much factors (N, angles) are missed where they are interpolated between multiples of a step: most at their own angles."""
    low = np.floor(angles / step + ROUNDING) * step
    share = np.clip((angles - low) / step, 0.0, 1.0)
    i, s, _ = _between(angles, low)
    j, t, _ = _between(angles, low + step)
    below = factors[:, i] + s * (factors[:, i + 1] - factors[:, i])
    above = factors[:, j] + t * (factors[:, j + 1] - factors[:, j])
    return float(np.abs(below + share * (above - below) - factors).max())
