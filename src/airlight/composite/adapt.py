"""Light adaptation (GPU Gems 3, 13.8): a picture's tones balanced by its own average, least and greatest luminance."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from airlight.luminance import REC709_F32
from airlight.planes import by_rows

FloatArray = npt.NDArray[np.float32]
MIDDLE_GREY = 0.18  # what the average becomes in a picture whose tones lie evenly about it


@dataclass(frozen=True)
class Ramp:
    """Maps luminance by Reinhard's curve: Y becomes y (1 + y / white^2) / (1 + y), y = scale Y."""

    scale: float
    white: float

    def gain(self, luminance: FloatArray) -> FloatArray:
        """Compute the factor of luminances Y."""
        y = np.float32(self.scale) * np.maximum(luminance, 0)
        return np.asarray(np.float32(self.scale) * (1 + y * np.float32(self.white**-2)) / (1 + y), np.float32)


def measure_ramp(luminances: FloatArray) -> Ramp:
    """Find the ramp for a picture of these luminances, linear. Scaling them changes nothing but the ramp's scale, inversely.

    The least and the greatest are the 0.1th and 99.9th percentile of those above zero, the average is that of their logarithms. The
    average is put at 0.18 4^((2 avg - min - max) / (max - min)), of logarithms, dark pictures darker and bright ones brighter
    (Reinhard 2003, "Parameter estimation for photographic tone reproduction", Eq. 4); the greatest becomes white (Reinhard et al. 2002,
    "Photographic tone reproduction for digital images", Eq. 4), but never what the average's scale leaves below 1.
    """
    lit = luminances[np.isfinite(luminances) & (luminances > 1e-30)].astype(np.float64)
    if not lit.size:
        return Ramp(1.0, 1.0)
    least, greatest = np.log(np.percentile(lit, (0.1, 99.9)))
    average = float(np.log(lit).clip(least, greatest).mean())
    lean = (2 * average - least - greatest) / (greatest - least) if greatest - least > 1e-6 else 0.0
    scale = MIDDLE_GREY * 4.0**lean / np.exp(average)
    return Ramp(float(scale), max(float(scale * np.exp(greatest)), 1.0))


def adapt(image: FloatArray, ramp: Ramp, strength: float, luminance: FloatArray = REC709_F32) -> None:
    """Adapt (H, W, 3) linear in place: colours times gain^strength, so that hues stay. strength 0: none of it; 1: all.

    luminance: (3,) weights of the image's RGB.
    """

    def rows(first: int, last: int) -> None:
        part = image[first:last]
        part *= (ramp.gain(part @ luminance) ** np.float32(strength))[..., None]

    by_rows(rows, image.shape[0])
