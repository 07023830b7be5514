"""What the fields of `parameters.Medium` and `parameters.March` mean together: coefficients, and what is unset, settled."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from airlight.lamps import Lamp
from airlight.parameters import March, Medium

DEPTH = 0.5  # optical depth across a scene, where sigma_t is unset
REACH = 4.0  # of a scene's radius, where max_distance is unset
BY_QUALITY = {"draft": (32, 1024), "normal": (64, 2048), "final": (0, 4096)}  # steps, 0: exact; shadow_size
PHASES = ("henyey-greenstein", "two-lobe", "isotropic", "rayleigh", "cornette-shanks")  # numbered as in scatter/march/scene.wgsl


@dataclass(frozen=True)
class Settled:
    """A medium and how it is marched, with nothing unset. sigma_t, sigma_s, ambient: (3,) float64, 1/m, 1/m, radiance."""

    sigma_t: npt.NDArray[np.float64]
    sigma_s: npt.NDArray[np.float64]
    ambient: npt.NDArray[np.float64]
    max_distance: float
    steps: int  # 0: exact
    shadow_size: int
    medium: Medium
    march: March

    @property
    def exact(self) -> bool:
        return self.steps == 0

    def lobes(self, lamp: Lamp | None = None) -> tuple[int, float, float, float]:
        """(number of the phase function, g, g of the second lobe, its share) for a lamp."""
        m = self.medium
        own = m.anisotropy if lamp is None or lamp.anisotropy is None else lamp.anisotropy
        return PHASES.index(m.phase), own, m.back_anisotropy, m.back_share if m.phase == "two-lobe" else 0.0


def settle(medium: Medium, march: March, quality: str, radius: float) -> Settled:
    """radius: of the scene, metres; what is unset follows from it and from the quality (draft, normal, final)."""
    sigma_t = np.array(medium.sigma_t if medium.sigma_t is not None else (DEPTH / (2 * radius),) * 3, float)
    steps, size = BY_QUALITY[quality]
    asked = steps if march.steps is None else march.steps
    return Settled(
        sigma_t=sigma_t,
        sigma_s=sigma_t * medium.albedo,
        ambient=np.array(medium.ambient, float),
        max_distance=REACH * radius if medium.max_distance is None else medium.max_distance,
        steps=0 if asked == "exact" else asked,
        shadow_size=size if march.shadow_size is None else march.shadow_size,
        medium=medium,
        march=march,
    )
