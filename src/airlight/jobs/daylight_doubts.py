"""One line, with its cure, where daylight shows nothing, hides all, leaves all dark, or is much brighter than the photograph's own."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from airlight.errors import warn
from airlight.jobs.daylight_strength import STRONGEST, some_of, strength_of_sky
from airlight.jobs.daylight_sun import SUN_DOWN
from airlight.luminance import REC709_F32
from airlight.messages import number

if TYPE_CHECKING:
    from airlight.daylight import Atmosphere
    from airlight.jobs.daylight_depth import Distances
    from airlight.jobs.daylight_view import View
    from airlight.options import Daylight

HIDDEN, CLEAR = 0.01, 0.99  # transmittance: of the nearest twentieth, of the farthest
AT_ODDS = 2.0  # times that the photograph's own sky is brighter or darker than the model's
BLACK = 0.003  # linear: the median of what has the model's light, that is hardly seen
SHOWN = 0.2  # linear: as bright as it is wanted then, where the photograph is no brighter


@dataclass
class Doubts:
    """Looks at a picture with its daylight."""

    air: "Atmosphere | None"  # None: even
    view: "View"
    found: "Distances"
    day: "Daylight"

    def tell(self, light: np.ndarray, through: np.ndarray, added: np.ndarray, tell: Callable[[str], object]) -> None:
        """Warn, in one line, and tell what may be meant. light: (H, W, 3) linear Rec. 709 as it was; through: what was let through; added:
        what was added."""
        doubts: list[str] = []
        if self.view.sun.elevation < SUN_DOWN:
            down = f"the sun is {-self.view.sun.elevation:.1f} degrees below the horizon"
            doubts.append(f"{down}: the sky is lit, but there are no shafts, since nothing is left to hide; a sun above 0 has some")
        some = some_of(*light.shape[:2])
        self._tell_distances(through[some], some, doubts.append)
        if doubts:
            warn("; ".join(doubts))
        if self.air is None or self.view.strength is None:
            return
        if not self._tell_dark(light[some], through[some], added[some], some, tell) and self.view.sun.elevation > 0:
            self._tell_strength(light, tell)

    def _tell_distances(self, through: np.ndarray, some: Any, tell: Callable[[str], object]) -> None:
        """Tell of air that hides all, or nothing, of what is not sky."""
        land = self.found.sky[some] < 0.5
        if not land.any():
            return
        left, metres = through[land].mean(axis=1), self.found.metres[some][land]
        near, far = float(np.quantile(metres, 0.05)), float(np.quantile(metres, 0.95))
        option = "--turbidity" if self.day.turbidity is not None else "--visibility"
        option = option if self.air is not None else "--beta-mie"
        more, less = {"--visibility": ("longer", "shorter"), "--turbidity": ("lower", "higher"), "--beta-mie": ("lower", "higher")}[option]
        if float(np.quantile(left, 0.95)) < HIDDEN:
            tell(f"this air hides nearly all that the picture shows, from {number(near, 2)} m on: give a {more} {option}")
        elif float(np.quantile(left, 0.05)) > CLEAR:
            tell(f"this air shows nothing up to the picture's {number(far, 2)} m: give a {less} {option}, or check the depths")

    def _tell_dark(self, light: np.ndarray, through: np.ndarray, added: np.ndarray, some: Any, tell: Callable[[str], object]) -> bool:
        """Tell which strength of the sun shows anything, where what is seen by the model's light is nearly black; whether that is so."""
        is_sky = self.found.sky[some] >= 1
        lit = is_sky if self.day.sky in ("air", "replace") and is_sky.any() else ~is_sky & (through.mean(axis=-1) < 0.5)
        strength = self.view.strength or 0.0
        if not lit.any() or strength == 0:
            return False
        own, model = (float(np.median(one[lit] @ REC709_F32)) for one in (light, added))
        if float(np.median((light * through + added)[lit] @ REC709_F32)) > BLACK or model <= 0:
            return False
        fits = strength * max(own, SHOWN) / model
        cure = f"--sun-strength {number(fits, 2)} shows it" if fits <= STRONGEST else "a higher sun shows it"
        tell(f"by this sun {'its sky' if lit is is_sky else 'what lies behind the air'} is nearly black, {cure}")
        return True

    def _tell_strength(self, light: np.ndarray, tell: Callable[[str], object]) -> None:
        """Tell which strength of the sun fits the photograph's own sky, where that has another."""
        if self.day.sky == "replace" or self.air is None or (self.day.sun_strength is None and self.day.sky != "air"):
            return  # chosen by that sky, no brighter than white
        fits, strength = strength_of_sky(self.air, self.view, self.found, light, True), self.view.strength or 0.0
        ratio = strength / fits if fits else 1.0
        if fits and ratio and not 1 / AT_ODDS <= ratio <= AT_ODDS:
            how = f"{number(ratio, 2)} times brighter" if ratio > 1 else f"{number(1 / ratio, 2)} times darker"
            cure = f"--sun-strength {number(fits, 2)} has the sky's measure" if fits <= STRONGEST else "more --visibility, or a higher sun"
            tell(f"the air is {how} than the photograph's own sky, {cure}")
