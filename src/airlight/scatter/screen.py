"""Shares between the methods of the screen: the textures of a light's passes, and the factors of its sum."""
from dataclasses import dataclass
from typing import Any

from airlight.lights import ImageLight
from airlight.options.declare import RGB
from airlight.options.shafts import Parameters


@dataclass(frozen=True)
class Target:
    """Names the textures of the passes of one light.

    source: rgba16float, what emits, with an apron of so many texels on each side; layer: rgba16float, which is written; before: the layer
    of the lights before, which is added, or None.
    """

    source: Any
    layer: Any
    apron: int = 0
    before: Any = None


def gains(p: Parameters, light: ImageLight, per_sample: bool = False) -> tuple[RGB, RGB | None]:
    """Give the factors (of the sum, of the pixel itself), RGB, that make a raw sum the layer of Eq. 4 or Listing 13-1.

    per_sample: the raw sum is over the samples, not the integral that is their limit.
    """
    if p.normalization == "mean":
        return times(p.exposure * p.weight / (p.samples if per_sample else 1), light), None
    lam = p.lam
    # the limit of sum decay^i is lam / (1 - decay) times int e^(-lam s): n for no decay
    count = 1 if per_sample else (p.samples if lam == 0 else lam / (1 - p.decay))
    return times(p.exposure * p.weight * count, light), times(p.exposure, light)


def times(factor: float, light: ImageLight) -> RGB:
    """Multiply a light's colour."""
    r, g, b = light.rgb
    return factor * r, factor * g, factor * b
