"""One line, with its cure, where daylight shows nothing, hides all, or is much brighter than the photograph's own."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from airlight.errors import warn
from airlight.jobs.daylight_sun import SUN_DOWN
from airlight.luminance import REC709_F32
from airlight.messages import number

if TYPE_CHECKING:
    from airlight.daylight import Atmosphere
    from airlight.jobs.daylight_depth import Distances
    from airlight.jobs.daylight_view import View
    from airlight.options import Daylight

HIDDEN, CLEAR = 0.01, 0.99  # transmittance: of the nearest twentieth, of the farthest
STRONGEST = 1e9  # sun's strength that the option takes
AT_ODDS = 2.0  # times that the photograph's own sky is brighter or darker than the model's
CLIPPED = 0.97  # linear: as bright pixels do not say how bright they were
LOOKED_AT = 200  # pixels of the sky
LEAST_SKY = 0.02  # of the picture


@dataclass
class Doubts:
    """Looks at a picture with its daylight."""

    air: "Atmosphere | None"  # None: even
    view: "View"
    found: "Distances"
    day: "Daylight"
    strength: float

    def tell(self, path: str, light: np.ndarray, through: np.ndarray, tell: Callable[[str], object]) -> None:
        """Warn, and tell what may be meant. light: (H, W, 3) linear Rec. 709 as it was; through: what was let through."""
        if self.view.sun.elevation < SUN_DOWN:
            down = f"the sun is {-self.view.sun.elevation:.1f} degrees below the horizon"
            warn(f"{down}: the sky is lit, but there are no shafts, since nothing is left to hide; a sun above 0 has some")
        step = max(1, int((light.shape[0] * light.shape[1] / 50_000) ** 0.5))
        some = slice(step // 2, None, step), slice(step // 2, None, step)
        self._tell_distances(through[some], some)
        if self.air is not None and self.view.sun.elevation > 0:
            self._tell_strength(path, light[some] @ REC709_F32, some, tell)

    def _tell_distances(self, through: np.ndarray, some: Any) -> None:
        """Warn of air that hides all, or nothing, of what is not sky."""
        land = self.found.sky[some] < 0.5
        if not land.any():
            return
        left, metres = through[land].mean(axis=1), self.found.metres[some][land]
        near, far = float(np.quantile(metres, 0.05)), float(np.quantile(metres, 0.95))
        option = "--turbidity" if self.day.turbidity is not None else "--visibility"
        option = option if self.air is not None else "--beta-mie"
        more, less = {"--visibility": ("longer", "shorter"), "--turbidity": ("lower", "higher"), "--beta-mie": ("lower", "higher")}[option]
        if float(np.quantile(left, 0.95)) < HIDDEN:
            warn(f"this air hides nearly all that the picture shows, from {number(near, 2)} m on: give a {more} {option}")
        elif float(np.quantile(left, 0.05)) > CLEAR:
            warn(f"this air shows nothing up to the picture's {number(far, 2)} m: give a {less} {option}, or check the depths")

    def _tell_strength(self, path: str, own: np.ndarray, some: Any, tell: Callable[[str], object]) -> None:
        """Tell which strength of the sun fits the photograph's own sky, where that has another."""
        from airlight.daylight.picture import sky_strength

        rows, columns = np.nonzero((self.found.sky[some] >= 1) & (own < CLIPPED) & (own > 0))
        if len(rows) < LEAST_SKY * own.size or self.day.sky == "replace":
            return
        chosen = slice(None, None, max(1, len(rows) // LOOKED_AT))
        rows, columns = rows[chosen], columns[chosen]
        camera, (left, top) = self.view.camera, self.view.corner
        y, x = (np.arange(size)[which] for size, which in zip(self.found.sky.shape, some))
        rays = camera.in_camera((left + x[columns] + 0.5) / camera.width, (top + y[rows] + 0.5) / camera.height) @ camera.axes
        up, turn = np.degrees(np.arcsin(np.clip(rays[:, 1], -1, 1))), np.degrees(np.arctan2(rays[:, 0], rays[:, 2]))
        keep = up > 0
        if not keep.any() or self.air is None:
            return
        azimuth = turn[keep] - self.view.azimuth
        fits = sky_strength(self.air, own[rows, columns][keep], up[keep], azimuth, self.view.sun.elevation, self.view.altitude)
        ratio = self.strength / fits if fits > 0 else 1.0
        if not 1 / AT_ODDS <= ratio <= AT_ODDS:
            how = f"{number(ratio, 2)} times brighter" if ratio > 1 else f"{number(1 / ratio, 2)} times darker"
            cure = f"--sun-strength {number(fits, 2)} has the sky's measure" if fits <= STRONGEST else "more --visibility, or a higher sun"
            tell(f"{path}: the air is {how} than the photograph's own sky: {cure}")
