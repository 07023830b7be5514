"""Declares the sum along rays to a light of the picture: samples, falloff, what emits."""

import math
from collections.abc import Callable

from airlight.errors import AirlightError
from airlight.options.declare import Options, choice, real, whole
from airlight.scatter import methods
from airlight.scatter.methods import METHODS, Method

THRESHOLD, SMOOTHNESS = 0.85, 0.2  # linear luminances, where none are given
MAX_SAMPLES = 16384  # software Vulkan stops an invocation's loops at 65,535 trips
GEMS = "GPU Gems 3, ch. 13"


def _abouts(names: tuple[str, ...]) -> str:
    """Say in a line what methods are."""
    return "; ".join(f"{name}: {METHODS[name].about}" for name in names)


class Parameters(Options, group="shafts"):
    """Shape the light shafts of an image. Validated on construction; raises AirlightError."""

    method: str = choice(
        methods.DEFAULT, lambda: tuple(METHODS),
        f"{_abouts(methods.of_screen())}; in scenes also {_abouts(methods.of_medium())}",
        "Airlight; " + GEMS, group="method",
    )
    samples: int = whole(
        100,
        "samples n along the ray; for epipolar it only sets lambda = -n ln(decay)",
        GEMS + ", Eq. 4", ge=1, le=MAX_SAMPLES, slider=(1, 300),
    )
    density: float = real(
        0.97,
        "part of the way to the light that a ray covers; above 1 it passes the light; where light is parallel, the ray's length "
        "in image widths",
        GEMS + ", Listing 13-1", "ray lengths", gt=0, le=16, slider=(0.05, 1.5),
    )
    decay: float = real(0.98, "factor from one sample to the next", GEMS + ", Eq. 4", "per sample", ge=1e-6, le=1, slider=(0.9, 1))
    weight: float = real(1.0, "factor of every sample", GEMS + ", Eq. 4", ge=0, le=1e6, slider=(0, 2))
    exposure: float = real(1.5, "factor of the whole sum", GEMS + ", Eq. 4", ge=0, le=1e6, slider=(0, 3))
    normalization: str = choice(
        "mean", ("mean", "listing"),
        "mean: Eq. 4, the sum over n; listing: Listing 13-1 as printed, no 1/n and the first sample unweighted",
        GEMS + ", Eq. 4, Listing 13-1", group="method",
    )
    border: str = choice(
        "clamp", ("clamp", "black"),
        "what lies outside the image: its border pixels, or nothing",
        GEMS + ", sec. 13.6", group="method",
    )
    jitter: str | None = choice(
        None, ("fixed", "midpoint", "gradient", "blue"),
        "where samples lie in their step: start, middle, interleaved-gradient noise, blue noise; unset: fixed, with march blue",
        GEMS + ", sec. 13.8; Jimenez 2014", group="method",
    )
    scale: float = real(
        1.0,
        "resolution of the radial sum: 1, 0.5 or 0.25, filtered down and up",
        GEMS + ", sec. 13.8", ge=0.25, le=1, slider=(1, 0.5, 0.25), group="method",
    )
    quality: str = choice(
        "normal", ("draft", "normal", "final"),
        "fineness of what is computed: the epipolar grid, the rays of the smart look; of a medium the steps, the shadow maps and, where it"
        " is final, full resolution; of rendered scenes the samples of a pixel, 1, 4 or 9",
        "Airlight", group="method",
    )
    occlusion: str = choice(
        "luminance", ("luminance", "alpha", "depth", "contrast", "none"),
        "what emits: pixels above a luminance, transparent ones, far ones, or all; contrast: all, those below the luminance with "
        "a quarter of their contrast, so that their texture draws no streaks",
        GEMS + ", sec. 13.5", group="occlusion",
    )
    threshold: float | None = real(
        None,
        f"linear luminance (or depth) at which a pixel counts half as emitting; unset: {THRESHOLD}, in 8 and 16 bit of the light's own "
        "luminance",
        "Blender, Resolve", "linear", ge=0, le=65504, slider=(0, 2), group="occlusion",
    )
    smoothness: float | None = real(
        None,
        f"half width of the soft knee around the threshold; unset: {SMOOTHNESS}, in 8 and 16 bit of the light's own luminance unless a "
        "threshold is given",
        "Blender Sun Beams", "linear", ge=0, le=65504, slider=(0, 2), group="occlusion",
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        method = METHODS[self.method]
        if self.scale not in (1.0, 0.5, 0.25):
            raise AirlightError(f"scale = {self.scale!r}: use 1, 0.5 or 0.25")
        if self.scale != 1.0 and method.full_size:
            raise AirlightError(f"scale goes with method {_those(lambda m: not m.full_size)}: {self.method} {method.full_size}")
        if self.normalization == "listing" and not method.sums_listing:
            listing = _those(lambda m: m.sums_listing)
            raise AirlightError(f"normalization listing goes with methods {listing}: with {self.method} use mean")

    @property
    def offset(self) -> str:
        """Choose where samples lie in their step: `jitter`, or what suits the method."""
        return self.jitter or METHODS[self.method].jitter

    @property
    def knee(self) -> tuple[float, float]:
        """Give (low, high): where a pixel begins to emit, and where it does so fully; linear luminance, or depth."""
        threshold = THRESHOLD if self.threshold is None else self.threshold
        smoothness = SMOOTHNESS if self.smoothness is None else self.smoothness
        return threshold - smoothness, threshold + smoothness

    @property
    def lam(self) -> float:
        """Compute lambda = -samples ln(decay), the optical length of the whole ray."""
        return -self.samples * math.log(self.decay)


def _those(fits: Callable[[Method], bool]) -> str:
    """Name the methods of the screen that fit, in words."""
    return " and ".join(name for name in methods.of_screen() if fits(METHODS[name]))
