"""Coefficients of the air at the wavelengths that are computed, and the way from these to the linear Rec. 709 channels.

Sources: Bruneton and Neyret 2008, as their later code and Hillaire 2020 have it: Rayleigh 1.24062e-6 1/m at 1 um, ozone of 300 DU, a clear
aerosol.
"""

from typing import Any, NamedTuple

import numpy as np

from airlight.daylight.checks import colour, number, one_of
from airlight.errors import AirlightError
from airlight.reference.daylight import AEROSOL_HEIGHT, Array

RAYLEIGH_1UM = 1.24062e-6  # 1/m
RAYLEIGH_550 = 13.558e-6  # 1/m, by which a visibility is understood
CLEAR_EXTINCTION = 4.44e-6  # 1/m, of the aerosol where nothing is said of it
KOSCHMIEDER = 3.912  # optical depth after which a contrast of 2 % is left
VISIBILITY = (0.05, 280.0)  # km
OZONE_DU = 300.0  # Dobson units of the coefficients below

NM = {"4": (630.0, 560.0, 500.0, 450.0), "rgb": (680.0, 550.0, 440.0)}
RAYLEIGH = {"4": None, "rgb": (5.802e-6, 13.558e-6, 33.1e-6)}  # 1/m; None: by RAYLEIGH_1UM
OZONE = {"4": (1.728e-6, 2.293e-6, 0.795e-6, 0.124e-6), "rgb": (0.650e-6, 1.881e-6, 0.085e-6)}  # 1/m at 25 km
TO_CHANNELS = {
    "4": ((0.80910, 0.67745, -0.67339, 0.18685), (-0.02943, 0.62897, 0.59631, -0.19584), (-0.02546, -0.03054, -0.00141, 1.05742)),
    "rgb": ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
}  # rows: red, green, blue; each sums to 1 within rounding: white is the sun outside the air


class Coefficients(NamedTuple):
    """Holds what the air does to light of W wavelengths: nm (W,); 1/m (W,), at the ground or, of ozone, at 25 km.

    ground_albedo (W,): 0..1.     to_channels (3, W): from them to linear Rec. 709. anisotropy: g of the aerosol's Cornette-Shanks function.
    """

    nm: Array
    rayleigh: Array
    aerosol_scattering: Array
    aerosol_extinction: Array
    ozone: Array
    ground_albedo: Array
    to_channels: Array
    anisotropy: float

    @property
    def extinction(self) -> Array:
        """Give (3, W) extinction of Rayleigh's air, aerosol and ozone, 1/m, where each density is 1."""
        return np.stack([self.rayleigh, self.aerosol_extinction, self.ozone])

    @property
    def scattering(self) -> Array:
        """Give (2, W) scattering of Rayleigh's air and aerosol, 1/m, where each density is 1."""
        return np.stack([self.rayleigh, self.aerosol_scattering])

    def channels(self, values: Array) -> Array:
        """Turn values (..., W) of the wavelengths into (..., 3) linear Rec. 709, white being the sun outside the air."""
        return np.asarray(values @ self.to_channels.T)


def coefficients(
    visibility: float | None, turbidity: float | None, ozone: float, ground_albedo: Any, aerosol_albedo: float,
    aerosol_anisotropy: float, wavelengths: str,
) -> Coefficients:  # fmt: skip
    """Resolve an atmosphere's settings, each as `Atmosphere` takes it. Raises AirlightError for what cannot be."""
    nm = np.array(NM[one_of("wavelengths", wavelengths, NM)])
    if visibility is not None and turbidity is not None:
        raise AirlightError("visibility and turbidity both say how hazy the air is; give one of them")
    if visibility is not None:
        clean = f"; clean air has {KOSCHMIEDER / RAYLEIGH_550 / 1000:.0f} km"
        far = number("visibility", visibility, *VISIBILITY, unit="km", more=clean)
        extinction = np.full(len(nm), KOSCHMIEDER / (1000 * far) - RAYLEIGH_550)
    elif turbidity is not None:
        t = number("turbidity", turbidity, 1, 10)
        extinction = (0.04608 * t - 0.04586) * (nm / 1000) ** -1.3 / AEROSOL_HEIGHT  # Preetham et al. 1999, A.1
    else:
        extinction = np.full(len(nm), CLEAR_EXTINCTION)
    rayleigh = RAYLEIGH[wavelengths]
    ground = colour("ground_albedo", ground_albedo, 0, 1)
    return Coefficients(
        nm=nm,
        rayleigh=RAYLEIGH_1UM * (nm / 1000) ** -4 if rayleigh is None else np.array(rayleigh),
        aerosol_scattering=extinction * number("aerosol_albedo", aerosol_albedo, 0, 1),
        aerosol_extinction=extinction,
        ozone=np.array(OZONE[wavelengths]) * number("ozone", ozone, 0, 600, unit="DU") / OZONE_DU,
        ground_albedo=ground if wavelengths == "rgb" else np.array([ground[0], ground[1], (ground[1] + ground[2]) / 2, ground[2]]),
        to_channels=np.array(TO_CHANNELS[wavelengths]),
        anisotropy=number("aerosol_anisotropy", aerosol_anisotropy, -0.99, 0.99),
    )
