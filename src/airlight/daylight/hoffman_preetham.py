"""Evaluates GPU Gems 3's Eq. 1 and Eq. 2: daylight in even air, as Hoffman and Preetham 2002 have it."""

from typing import Any

import numpy as np

from airlight.daylight.checks import broadcast, numbers, one_of
from airlight.medium.resolve import PHASES
from airlight.reference.daylight import Array, hoffman_preetham_phase
from airlight.reference.medium import mean_transmittance
from airlight.reference.medium import phase as normalised_phase

BETA_RAYLEIGH = (6.953e-6, 11.757e-6, 24.380e-6)  # 1/m at 650, 570 and 475 nm
BETA_MIE = (2e-5, 3e-5, 4e-5)  # 1/m: light haze, by the authors' notes
LONGEST = 1e12  # m
NAMES = ("hp", "hg")


def hoffman_preetham(
    l0: Any, e_sun: Any, beta_rayleigh: Any, beta_mie: Any, g: Any, distance: Any, theta: Any, phase: str = "hp", dark: Any = 0.0,
    attenuate: str = "all",
) -> Array:  # fmt: skip
    """Evaluate (..., 3) radiance by Eq. 1 of Mitchell's chapter 13 of GPU Gems 3, and by Eq. 2 where something hides the sun.

    L = L0 e^(-(bR + bM) s) + E (bR pR(theta) + bM pM(theta)) / (bR + bM) (1 - e^(-(bR + bM) s)).

    l0: radiance of what is seen, e_sun: the sun's irradiance, beta_rayleigh, beta_mie: scattering coefficients, 1/m, each one number or
    (..., 3); distance: s, m, g: -0.999..0.999, and theta: 0..180 degrees between the view and the direction to the sun, each (...).
    phase: "hp", the aerosol's phase function as printed, whose integral is (1 - g) / (1 + g); "hg": Henyey and Greenstein 1941, whose
    integral is 1. dark: D, 0..1, one number or (..., 3), the part of the way that sees no sun. attenuate: "all", Eq. 2 as printed, (1 - D)
    times all of L; "source", as its text says: (1 - D) times the sun's light only. Arguments broadcast. Raises AirlightError for what is
    out of range. Sources: Hoffman and Preetham 2002.
    """
    one_of("phase", phase, NAMES), one_of("attenuate", attenuate, ("all", "source"))
    channels = {
        "l0": numbers("l0", l0, -np.inf, np.inf), "e_sun": numbers("e_sun", e_sun, 0, LONGEST),
        "beta_rayleigh": numbers("beta_rayleigh", beta_rayleigh, 0, LONGEST), "beta_mie": numbers("beta_mie", beta_mie, 0, LONGEST),
        "dark": numbers("dark", dark, 0, 1),
    }  # fmt: skip
    scalars = {
        "g": numbers("g", g, -0.999, 0.999), "distance": numbers("distance", distance, 0, LONGEST, unit="m"),
        "theta": np.radians(numbers("theta", theta, 0, 180, unit="degrees")),
    }  # fmt: skip
    scalars = {name: one[..., None] for name, one in scalars.items()}
    l0, e_sun, rayleigh, mie, dark, g, s, angle, _ = broadcast(**channels, **scalars, channels=np.zeros(3))
    cosine = np.cos(angle)
    if phase == "hp":
        aerosol = hoffman_preetham_phase(cosine, g)
    else:
        aerosol = normalised_phase(cosine, np.stack([g, g, 0 * g], axis=-1), PHASES.index("henyey-greenstein"))
    scattered = rayleigh * normalised_phase(cosine, (0, 0, 0), PHASES.index("rayleigh")) + mie * aerosol
    depth = (rayleigh + mie) * s
    sunlight = e_sun * scattered * s * mean_transmittance(depth)
    seen = l0 * np.exp(-depth)
    return np.asarray((1 - dark) * (seen + sunlight) if attenuate == "all" else seen + (1 - dark) * sunlight)
