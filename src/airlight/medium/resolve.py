"""Resolves `options.Medium` and `options.March` for a scene: coefficients, and a value for all that is unset."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from airlight.medium.field import Field
from airlight.messages import number
from airlight.options import March, Medium
from airlight.options.declare import as_text

OPTICAL_DEPTH = 0.5  # across a scene, where sigma_t is unset
FOG_OPTICAL_DEPTH = 3.0  # the same at the density of its base, of fog that thins out with height: few rays stay down there
MAX_DISTANCE_RADII = 4.0  # of a scene, where max_distance is unset
BY_QUALITY = {"draft": (32, 1024), "normal": (64, 2048), "final": (0, 4096)}  # steps, 0: exact; shadow_size
TABLES = {"draft": "draft", "normal": "normal", "final": "fine"}  # by quality, names of scatter/visibility/table.py
BY_TABLE: tuple[str, ...] = ()  # qualities in which light goes by tables where steps are unset
VISIBLE_CONTRAST = 0.02  # the least that is seen, by which visibility is defined (Koschmieder 1924)
HIDING_DEPTH = -math.log(VISIBLE_CONTRAST)  # 3.912, the optical depth at the visibility's distance: nothing is seen through more
SEEN_DEPTH = 2.0  # optical depth of the densest way through volumes and particles, where no extinction is said
LEAST_DEPTH = 0.3  # of it, below which one is told that they are hardly seen
AMID = "where in the air glass stands (before a far sky its colours are pale)"
EMPTY_DEPTH = 1e-3  # optical depth across a scene up to which only a very strong light shows in it: some 10 times white, at g = 0
FOGS = ("none", "exponential", "linear")  # numbered as in medium/height.wgsl
FOG_SHARE = 0.1  # of the scene's height, where fog_depth is unset
NOISE_SHARE = 1 / 8  # of the scene's radius, where noise_size is unset
PHASES = ("henyey-greenstein", "two-lobe", "isotropic", "rayleigh", "cornette-shanks")  # numbered as in medium/phase.wgsl


@dataclass(frozen=True)
class ResolvedMedium:
    """Holds a medium and how it is marched, with nothing unset. sigma_t, sigma_s, ambient: (3,) float64, 1/m, 1/m, radiance.

    settings, march: as they were given. fields: densities on grids, in world metres. time: s, of what the wind moves. origin: (3,) m, the
    world's place of what is drawn at 0, as fog_base is counted from it. table: the fineness of tables of visibility, as
    scatter/visibility/table.py names them, by which lights go where they can; None: all go by steps.
    """

    sigma_t: npt.NDArray[np.float64]
    sigma_s: npt.NDArray[np.float64]
    ambient: npt.NDArray[np.float64]
    max_distance: float
    steps: int  # 0: exact
    shadow_size: int
    fog_base: float
    fog_depth: float
    settings: Medium
    march: March
    air: float = 1.0
    noise_size: float = 1.0
    time: float = 0.0
    fields: tuple[Field, ...] = ()
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    table: str | None = None

    @property
    def varies(self) -> bool:
        """Tells whether the density has more than closed forms: noise, or fields."""
        return bool(self.fields) or self.settings.noise_amount > 0

    @property
    def exact(self) -> bool:
        return self.steps == 0

    @property
    def sun_extinction(self) -> str:
        """Tells what dims a sun's light: none, volumes, or all. Unset it is all where what is above a place has an end. Air without an end
        dims no sun, nor does noise in it: all is then of what else lies there."""
        m = self.settings
        if m.sun_extinction == "all" and m.fog == "none" and m.noise_amount > 0 and self.air > 0:
            return "volumes" if self.fields else "none"
        ends = self.air == 0 or m.fog == "exponential" or (m.fog == "linear" and m.fog_above == 0)
        unset = "all" if ends else "volumes" if self.fields else "none"
        return unset if m.sun_extinction is None else m.sun_extinction

    @property
    def fades_suns(self) -> bool:
        """Tells whether a sun's light is dimmed by the fog above a place."""
        return self.settings.fog != "none" and self.air > 0 and self.sun_extinction == "all"

    def optical_length(self, transmittance: npt.NDArray[Any]) -> npt.NDArray[np.float64]:
        """Finds (...) the length, m, of paths of density 1 with a transmittance (..., 3)."""
        channel = int(np.argmax(self.sigma_t))
        found = -np.log(np.maximum(transmittance[..., channel].astype(np.float64), 1e-30))
        return np.asarray(found / max(float(self.sigma_t[channel]), 1e-30))

    def seen_from(self, origin: Any) -> "ResolvedMedium":
        """Moves it by -origin (3,), m, as a scene is that is drawn near the origin."""
        if not np.any(origin):
            return self
        x, y, z = (float(v) for v in origin)
        return replace(self, fog_base=self.fog_base - y, origin=(x, y, z))

    def exposed(self, factor: float) -> "ResolvedMedium":
        """Scales its own light, for a scene whose radiances are scaled."""
        return self if factor == 1 else replace(self, ambient=self.ambient * factor)

    def lobes(self, anisotropy: float | None = None) -> tuple[int, float, float, float]:
        """Returns (index in PHASES, g, g of the second lobe, its share), for a light with an anisotropy of its own, or none."""
        m = self.settings
        own = m.anisotropy if anisotropy is None else anisotropy
        return PHASES.index(m.phase), own, m.back_anisotropy, m.back_share if m.phase == "two-lobe" else 0.0

    @property
    def sun_reach(self) -> float:
        """Gives the distance from the eye, m, as far as suns light the medium."""
        own = self.settings.sun_distance
        return self.max_distance if own is None else min(self.max_distance, own)

    @property
    def sun_steps(self) -> int:
        """Gives the steps for suns; 0: exact."""
        own = self.march.sun_steps
        return self.steps if own is None or self.exact else own

    @property
    def glow_concentration(self) -> float:
        """Computes kappa of the glow around suns, which falls by e^(-kappa (1 - cosine))."""
        return math.log(2) / (1 - math.cos(math.radians(self.settings.sun_glow_size)))

    @property
    def least_seen(self) -> float:
        """Gives the part of a surface's light that is seen through the medium, however much of it there is."""
        return 1 - self.settings.extinction_share if self.settings.extinction else 1.0

    def of_light(self, density: float, extinction: float) -> "ResolvedMedium":
        """Gives the medium that a light has to itself: density times as dense, and extinction times as extinguishing."""
        if density == extinction == 1:
            return self
        return replace(self, sigma_t=self.sigma_t * (density * extinction), sigma_s=self.sigma_s * density)


def resolve(
    medium: Medium,
    march: March,
    quality: str,
    radius: float,
    height: float | None = None,
    fields: Sequence[Field] = (),
    time: float = 0.0,
    basin: Field | None = None,
) -> ResolvedMedium:
    """Gives all that is unset a value, which follows from radius, the scene's in metres, and from the quality: draft, normal or final.

    height: of the scene, m; None: as much as it is wide. fields, time: see ResolvedMedium. basin: air of
    lowlands, which joins after all fields, and leaves the air's own density as it would be without.
    """
    across = OPTICAL_DEPTH if medium.fog == "none" else FOG_OPTICAL_DEPTH
    sigma_t = np.array(medium.sigma_t if medium.sigma_t is not None else (across / (2 * radius),) * 3, float)
    air = medium.air if medium.air is not None else 0.0 if fields else 1.0
    if not fields and basin is None:  # where there is nothing but air its density is one of the coefficients
        sigma_t, air = sigma_t * air, 1.0
    steps, size = BY_QUALITY[quality]
    requested = march.steps
    table = TABLES[quality] if requested == "table" or (requested is None and quality in BY_TABLE) else None
    if requested is None or requested == "table":
        requested = steps
    return ResolvedMedium(
        sigma_t=sigma_t,
        sigma_s=sigma_t * medium.albedo,
        ambient=np.array(medium.ambient, float),
        max_distance=MAX_DISTANCE_RADII * radius if medium.max_distance is None else medium.max_distance,
        steps=0 if requested == "exact" else requested,
        shadow_size=size if march.shadow_size is None else march.shadow_size,
        fog_base=medium.fog_base,
        fog_depth=medium.fog_depth if medium.fog_depth is not None else FOG_SHARE * (height or 2 * radius),
        settings=medium,
        march=march,
        air=air,
        noise_size=medium.noise_size if medium.noise_size is not None else NOISE_SHARE * radius,
        time=time,
        fields=tuple(fields) + (() if basin is None else (basin,)),
        table=table,
    )


def doubt(medium: ResolvedMedium, distance: float, radius: float) -> str | None:
    """Words one line where the medium hides the scene, or only a very strong light would show in it, with what would suit, or where its fog
    is of no air; else None. An empty one is meant so; of one that varies in space no more is known.

    distance: of the eye from the scene's centre; radius: of the scene; metres. Every colour has to be lost, or to be missing.
    """
    if (line := without_air(medium)) is not None:
        return line
    near, far = (min(max(distance, size), medium.max_distance) for size in (radius, 2 * radius))
    if near <= 0 or not medium.sigma_t.any() or medium.settings.fog != "none" or medium.varies:
        return None
    if medium.least_seen < VISIBLE_CONTRAST and (medium.sigma_t * near).min() > HIDING_DEPTH:
        return hides(medium, near)
    return is_too_thin(medium, far, "but by a very strong light") if (medium.sigma_t * far).max() < EMPTY_DEPTH else None


def without_air(medium: ResolvedMedium) -> str | None:
    """Words that fog and noise are of air that there is not, since it is unset beside volumes and particles; else None."""
    m = medium.settings
    if m.air is not None or medium.air > 0 or (m.fog == "none" and m.noise_amount == 0):
        return None
    return "fog and noise are of the air, of which there is none beside volumes and particles: give it a density, air = 1, for both"


def left_out(method: str, noise: bool, fields: bool, glass: bool = False, between: bool = False) -> str | None:
    """Words what of a scene a method leaves out: noise in the air, densities on grids, what glass takes from light, between: that it stands
    amid the air; else None."""
    named = "noise in the air" * noise, "volumes, particles and lowlands" * fields, "what glass takes from light" * glass, AMID * between
    lacks = [what for what in named if what]
    return f"method {method} leaves out {' and '.join(lacks)}, which this scene has: method march follows all of it" if lacks else None


def hardly_seen(depth: float, cure: str) -> str | None:
    """Words that volumes and particles, whose densest way has such an optical depth, are hardly seen; else None. cure: of {0}, a factor."""
    if not 0 < depth < LEAST_DEPTH:
        return None
    told = f"the volumes and particles are hardly seen: the densest way through them has an optical depth of {depth:.2g}"
    return f"{told}; {cure.format(number(SEEN_DEPTH / depth, 1))}"


def hides(medium: ResolvedMedium, path_length: float) -> str:
    """Words that a medium hides what lies behind so many metres of it."""
    beyond = f"{_across(medium, path_length)}, and beyond {HIDING_DEPTH:.1f} nothing is seen"
    return f"the medium hides the scene: {beyond}; it would be seen with a sigma_t of about {as_suits(medium, path_length)} 1/m"


def is_too_thin(medium: ResolvedMedium, path_length: float, unless: str = "") -> str:
    """Words that a medium is not seen over so many metres of it. unless: by what, where the light in it is not known."""
    seen = f"{_across(medium, path_length)}; it would be seen with a sigma_t of about {as_suits(medium, path_length)} 1/m"
    return f"the medium is too thin to be seen{unless and ' '}{unless}: {seen}"


def _across(medium: ResolvedMedium, path_length: float) -> str:
    return f"an optical depth of {number(float((medium.sigma_t * path_length).mean()), 2)} over {number(path_length, 3)} m"


def as_suits(medium: ResolvedMedium, path_length: float) -> str:
    """Write the extinction that gives OPTICAL_DEPTH over so many metres, in the medium's own hue."""
    scale = OPTICAL_DEPTH / (medium.sigma_t * path_length).mean()
    return as_text(tuple(float(f"{v:.2g}") for v in medium.sigma_t * scale))
