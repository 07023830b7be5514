"""What the fields of `parameters.Medium` and `parameters.March` mean together: coefficients, and what is unset, settled."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from airlight.lamps import Lamp
from airlight.options import March, Medium
from airlight.options.declare import as_text

DEPTH = 0.5  # optical depth across a scene, where sigma_t is unset
REACH = 4.0  # of a scene's radius, where max_distance is unset
BY_QUALITY = {"draft": (32, 1024), "normal": (64, 2048), "final": (0, 4096)}  # steps, 0: exact; shadow_size
BLACK, EMPTY = 6.0, 1e-3  # optical depths across a scene: from here nothing is seen through it, up to here nothing is seen of it
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

    def lobes(self, lamp: Lamp) -> tuple[int, float, float, float]:
        """(number of the phase function, g, g of the second lobe, its share) for a lamp."""
        m = self.medium
        own = m.anisotropy if lamp.anisotropy is None else lamp.anisotropy
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


def doubt(air: Settled, distance: float, radius: float) -> str | None:
    """One line where the medium hides the scene or cannot be seen, with what would suit; else None. An empty medium is meant to be empty.

    distance: of the eye from the scene's centre; radius: of the scene; metres. Every colour has to be lost, or to be missing.
    """
    way = min(max(distance, 2 * radius), air.max_distance)
    depths = air.sigma_t * way
    if way <= 0 or not depths.any():
        return None
    suits = as_text(tuple(float(f"{v:.2g}") for v in air.sigma_t * (DEPTH / depths.mean())))
    across = f"an optical depth of {depths.mean():.2g} over {way:.3g} m"
    if depths.min() > BLACK and air.medium.extinction:
        return f"the medium hides the scene: {across}; it would be seen with a sigma_t of about {suits} 1/m"
    if depths.max() < EMPTY:
        return f"the medium is too thin to be seen: {across}; it would be seen with a sigma_t of about {suits} 1/m"
    return None
