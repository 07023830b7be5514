"""The look in NumPy, float64: the twins of look/*.wgsl, each of the name of its shader function; the light's rays on a grid of angles.

Pictures are scene-linear Rec. 709 with white at 1, distances in picture diagonals, L the cube root of luminance.
"""

import math
from dataclasses import dataclass, field

import numpy as np

from airlight.look.grid import HALF_WEIGHT_DIAGONALS, LINES, RADII, STEPS, Array, RayGrid, points
from airlight.planes import smoothstep as smoothstep
from airlight.reference.colour import REC709

WHITE = 0.9911  # code 254: nothing is lit beyond it
EMITS = (0.45, 0.85)  # of the way from the surroundings' luminance to the light's, in logarithms: where emission begins, and is whole
DARK = (0.10, 0.28)  # L: air before what is darker than the first shows no light, before the second all; at least, and of the surroundings'
DARK_OF, DARK_MOST = (0.55, 1.25), (0.24, 0.55)  # tone, at most
MOST = 0.35  # of L: what no shaft exceeds
BREADTHS = ((2.5, 0.9), (12.0, 2.0))  # degrees: of the means over angles that a ray is compared with; the fineness above which they grow
COARSE = 4  # lines that the wide means take together
SOFT = 0.012  # diagonals: nearer to the light rays run together
BEYOND_SOFT = 0.25  # the same within the picture of a light beyond it: rays gather before they are seen, and none starts at a border
THINNEST = (0.004, 4.0)  # diagonals of a ray's sigma at least, so that none is a scratch near the light; but no more than these degrees
FIRST_LENGTH = 0.01  # diagonals of weighted path before the picture, on which emission is taken to be as at its border, or at the light
REST = 0.3  # of the greatest mean, added to each: far from the light what is faint stays faint
TINT = 0.5  # of the light's colour that is seen on a surface, the rest is white
FINE = 1.0  # weight of what stands out against the narrow mean, beside that of the narrow against the wide
CONTRAST = 0.40  # of tanh: how soon a ray that stands out is at its full
SKY = (0.42, 0.80, 0.5)  # L: where shafts are seen less, from, to, by how much: in a clear sky they look like flare
BRIGHT = (0.45, 0.80, 0.85)  # L: where missing light darkens less, from, to, by how much: dark bands on a bright sky look like dirt
EMITTER = 0.97  # of a shaft is not seen before what emits
SHADE_MOST = 0.30  # of L: what missing light takes at most
EXTINCTION = 0.20  # of the shade: how much of what lies behind a shaft its air hides
SURFACE = (0.6, 0.15, 0.40)  # share of a shaft that lights the surface behind it instead of the air: at most; L from, to


@dataclass(frozen=True)
class Tones:
    """Holds luminances about a light: the geometric mean of its surroundings, and its own."""

    surroundings: float
    light: float

    @property
    def span(self) -> float:
        """Compute ln(light / surroundings), at least a quarter."""
        return max(math.log(self.light / self.surroundings), 0.25)


def lightness(y: Array) -> Array:
    """Compute L, the cube root of luminance."""
    return np.cbrt(np.maximum(y, 0))


def emission(y: Array, tones: Tones) -> Array:
    """Find the emission of a pixel of luminance y, 0..1, by where it lies between the surroundings and the light."""
    return smoothstep(np.log(np.maximum(y, 1e-5) / tones.surroundings) / tones.span, *EMITS)


def nearness_weight(distance: Array) -> Array:
    """Weigh an emitter, g, by its distance from the light, or from where its ray enters the picture."""
    return 1 / (1 + np.square(distance / HALF_WEIGHT_DIAGONALS))


def bilinear(plane: Array, x: Array, y: Array) -> Array:
    """Sample (H, W[, C]) at pixel coordinates (0 the centre of the first), borders repeated."""
    height, width = plane.shape[:2]
    x, y = np.clip(x, 0, width - 1), np.clip(y, 0, height - 1)
    x0, y0 = np.minimum(x.astype(int), max(width - 2, 0)), np.minimum(y.astype(int), max(height - 2, 0))
    x1, y1 = np.minimum(x0 + 1, width - 1), np.minimum(y0 + 1, height - 1)
    shape = x.shape + (1,) * (plane.ndim - 2)
    fx, fy = (x - x0).reshape(shape), (y - y0).reshape(shape)
    return np.asarray((plane[y0, x0] * (1 - fx) + plane[y0, x1] * fx) * (1 - fy) + (plane[y1, x0] * (1 - fx) + plane[y1, x1] * fx) * fy)


def resized(plane: Array, width: int, height: int) -> Array:
    """Resize a plane to other pixels: bilinear at their centres."""
    x = (np.arange(width) + 0.5) * plane.shape[1] / width - 0.5
    y = (np.arange(height) + 0.5) * plane.shape[0] / height - 0.5
    return bilinear(plane, *np.meshgrid(x, y))


def mean_codes(codes: Array, width: int, height: int) -> Array:
    """Average codes (H, W, 3), as such, to (height, width, 3) by bilinear samples, two pixels apart at most."""
    shrinks = max(codes.shape[1] / width, codes.shape[0] / height)
    taps = max(1, math.ceil(shrinks / 2))
    total = np.zeros((height, width, 3))
    for j in range(taps):
        y = (np.arange(height) + (j + 0.5) / taps) * (codes.shape[0] / height) - 0.5
        for i in range(taps):
            x = (np.arange(width) + (i + 0.5) / taps) * (codes.shape[1] / width) - 0.5
            total += bilinear(codes, *np.meshgrid(x, y))
    return total / taps**2


def matte(y: Array, tones: Tones, parts: Array, grid: RayGrid) -> tuple[Array, Array]:
    """Find what emits, and that weighted by how near it is: (E g, E), (H, W) each. y: luminance; parts: (H, W), 1 for what may emit."""
    height, width = y.shape
    px, py = points(width, height)
    dx, dy = px - grid.light[0], py - grid.light[1]
    distance = np.maximum(np.hypot(dx, dy), 1e-9)
    e = emission(y, tones) * parts
    return e * nearness_weight(distance - grid.entry(dx / distance, dy / distance)), e


def _along(grid: RayGrid, distance: Array) -> tuple[Array, Array, Array]:
    """Place the distances, (n, LINES) or (n, 1), on each line: x, y in diagonals, and whether they lie in the picture."""
    angle = grid.start + (np.arange(LINES) + 0.5) * (grid.span / LINES)
    x = grid.light[0] + distance * np.cos(angle)
    y = grid.light[1] + distance * np.sin(angle)
    return x, y, (x >= 0) & (x <= grid.box[0]) & (y >= 0) & (y <= grid.box[1])


def scan(weighted: Array, emits: Array, grid: RayGrid) -> tuple[Array, Array]:
    """Sum along lines, (C, w), (RADII, LINES) each: the share of emitters on the way from the light, Eq. 4 of density and decay 1 over the
    weights of the whole way; and how dark the point is, by which it counts in means."""
    height, width = emits.shape
    diagonal = math.hypot(width, height)
    step = grid.step / STEPS
    x, y, within = _along(grid, (grid.nearest + (np.arange(RADII * STEPS) + 0.5) * step)[:, None])
    light = np.where(within, bilinear(weighted, x * diagonal - 0.5, y * diagonal - 0.5), 0.0)
    total = np.cumsum(light * step, axis=0)[STEPS - 1 :: STEPS]
    angle = grid.start + (np.arange(LINES) + 0.5) * (grid.span / LINES)
    begins = grid.entry(np.cos(angle), np.sin(angle))
    x, y, _ = _along(grid, begins)
    first = bilinear(weighted, x * diagonal - 0.5, y * diagonal - 0.5)
    kept = (grid.nearest + (np.arange(RADII) + 1) * grid.step)[:, None]
    path_length = HALF_WEIGHT_DIAGONALS * np.arctan(np.maximum(kept - begins, 0) / HALF_WEIGHT_DIAGONALS)
    x, y, _ = _along(grid, kept)
    return (total + FIRST_LENGTH * first) / (path_length + FIRST_LENGTH), 1.02 - bilinear(emits, x * diagonal - 0.5, y * diagonal - 0.5)


def gaussian(sigma: float) -> Array:
    """Weigh whole numbers by a Gaussian, out to three sigma, their sum 1."""
    reach = math.ceil(3 * sigma)
    weights = np.exp(-0.5 * np.square(np.arange(-reach, reach + 1) / max(sigma, 1e-3)))
    return np.asarray(weights / weights.sum())


def across(rays: Array, sigma: float, round_trip: bool) -> Array:
    """Filter lines, (radii, lines), by a Gaussian: all the way round, or with nothing beyond the first and the last."""
    weights = gaussian(sigma)
    reach, count = len(weights) // 2, rays.shape[1]
    wide = np.pad(rays, ((0, 0), (reach, reach)), mode="wrap" if round_trip else "constant")
    size = count + 4 * reach
    product = np.fft.rfft(wide, size, axis=1) * np.fft.rfft(weights, size)
    return np.asarray(np.fft.irfft(product, size, axis=1)[:, 2 * reach : 2 * reach + count])


def fine_sigmas(grid: RayGrid, fineness: float) -> Array:
    """Choose the Gaussian of rays in lines by distance, (RADII,): wider than `fineness` where that would be a thin scratch."""
    distance = grid.nearest + (np.arange(RADII) + 1) * grid.step
    thinnest = THINNEST[0] / distance * (LINES / grid.span)
    return np.maximum(grid.lines(fineness), np.minimum(thinnest, grid.lines(THINNEST[1])))


def smooth(share: Array, grid: RayGrid, fineness: float) -> Array:
    """Filter C over neighbouring lines, which gives C'; fineness in degrees."""
    out = np.empty_like(share)
    for row, sigma in enumerate(fine_sigmas(grid, fineness)):
        out[row] = across(share[row : row + 1], sigma, grid.inside)[0] / across(np.ones((1, LINES)), sigma, grid.inside)[0]
    return out


def breadths(fineness: float) -> tuple[float, float]:
    """Choose the breadths of the narrow and the wide mean, degrees: always wider than the rays themselves."""
    narrow, wide = (degrees * max(1.0, fineness / from_here) for degrees, from_here in BREADTHS)
    return narrow, wide


def coarse_sigma(grid: RayGrid, degrees: float) -> float:
    """Choose the Gaussian of a wide mean in groups of COARSE lines, less the variance that grouping and going back add."""
    variance = grid.lines(degrees) ** 2 - (COARSE**2 - 1) / 12 - COARSE**2 / 6
    return math.sqrt(max(variance, 0.09 * COARSE**2)) / COARSE


def low(share: Array, weights: Array, grid: RayGrid, degrees: float) -> Array:
    """Average C' over lines, weighted by how dark points are, (RADII, LINES): the light that is smooth in angle."""
    sigma = coarse_sigma(grid, degrees)
    groups = [plane.reshape(RADII, LINES // COARSE, COARSE).sum(axis=2) for plane in (share * weights, weights)]
    light, weight = (across(plane, sigma, grid.inside) for plane in groups)
    return between_groups(light / np.maximum(weight, 1e-9), grid.inside)


def between_groups(means: Array, round_trip: bool) -> Array:
    """Interpolate values of groups of lines at the lines themselves, linearly."""
    wide = np.pad(means, ((0, 0), (1, 1)), mode="wrap" if round_trip else "edge")
    at = (np.arange(LINES) + 0.5) / COARSE + 0.5
    first = at.astype(int)
    return np.asarray(wide[:, first] * (1 - (at - first)) + wide[:, first + 1] * (at - first))


def bands(share: Array, weights: Array, grid: RayGrid, fineness: float, pattern: Array | None = None) -> Array:
    """Split C', (RADII, LINES, 3): less its narrow mean; all that stands out, less the narrow and less the wide mean; the wide mean.

    pattern: (LINES,), drawn rays, which stand out instead; of the picture's own only the narrow is left, and less of it.
    """
    smoothed = smooth(share, grid, fineness)
    narrow, wide = (low(smoothed, weights, grid, degrees) for degrees in breadths(fineness))
    fine, all_of_it = smoothed - narrow, FINE * (smoothed - narrow) + narrow - wide
    if pattern is not None:
        all_of_it = DRAWN[0] * fine + DRAWN[1] * pattern * wide
    return np.stack([fine, all_of_it, wide], axis=-1)


DRAWN = (0.4, 0.1)  # share of the picture's own fine rays beside drawn ones; of the light that drawn ones take and give


def at_points(rays: Array, grid: RayGrid, x: Array, y: Array) -> tuple[Array, Array]:
    """Sample the bands at points in diagonals, (..., 3), and measure the points' distances from the light."""
    distance, line = grid.polar(x, y)
    row = (distance - grid.nearest) / grid.step - 1
    if grid.inside:
        rays, line = np.concatenate([rays[:, -1:], rays, rays[:, :1]], axis=1), line + 1
    return bilinear(rays, line, row), distance


@dataclass(frozen=True)
class RaySettings:
    """Turns one light's bands into amounts.

    deviation: the rms of what stands out; rest: see REST; length: diagonals; mist: share of the smooth light; soft: see SOFT; weight: of
    this light among several; color: of the added light, luminance 1; tones: about the light; around: of its cookie, `around_table`.
    """

    grid: RayGrid
    tones: Tones
    deviation: float
    rest: float
    length: float
    mist: float
    soft: float
    weight: float
    color: tuple[float, float, float]
    around: Array | None = field(default=None, compare=False)


MIST = 0.8  # of a full ray: the smooth light where it is whole, at mist 1
ENDS = 0.12  # of the lines of a light beyond the picture, either side: drawn rays fade there, where they graze its border


def standing_out(found: Array, rest: float) -> Array:
    """Compute k: what stands out over the light that is smooth in angle."""
    return np.asarray(found[..., 1] / (found[..., 2] + rest))


def ray_amount(found: Array, distance: Array, entry: Array, emits: Array, s: RaySettings) -> Array:
    """Compute the signed light, about -1..1, that a light's rays add (above 0) or lack (below); next to none before what emits itself.

    found: (..., 3) bands; distance: from the light; entry: at which the ray enters the picture.
    """
    smooth_light = s.mist * MIST * found[..., 2] / (found[..., 2] + s.rest)
    amount = np.tanh(CONTRAST * standing_out(found, s.rest) / s.deviation) + smooth_light
    fall = np.exp(-distance / s.length) * smoothstep(distance - entry, 0.0, s.soft)
    return np.asarray(s.weight * amount * fall * (1 - EMITTER * emits))


def amounts_at(rays: Array, s: RaySettings, x: Array, y: Array) -> Array:
    """Sample `ray_amount`, found on the grid's own positions, at points in diagonals, before emitters take their part."""
    distance = s.grid.nearest + (np.arange(RADII) + 1)[:, None] * s.grid.step
    angle = s.grid.start + (np.arange(LINES) + 0.5) * (s.grid.span / LINES)
    found = ray_amount(rays, distance, s.grid.entry(np.cos(angle), np.sin(angle)), np.zeros_like(distance), s)
    return at_points(found[..., None], s.grid, x, y)[0][..., 0]


def darkness(tones: Tones) -> tuple[float, float]:
    """Set (L before which no light is seen, L before which all is): what is dark beside the surroundings' tone is near, or stays black."""
    level = tones.surroundings ** (1 / 3)
    low, high = (min(max(share * level, least), most) for share, least, most in zip(DARK_OF, DARK, DARK_MOST, strict=True))
    return low, high


def visible(base: Array, dark: tuple[float, float] = DARK) -> Array:
    """Find how much of a shaft is seen before a pixel of smoothed lightness B: none before black, less before a bright sky. dark: see
    `darkness`."""
    return smoothstep(base, *dark) * (1 - SKY[2] * smoothstep(base, *SKY[:2]))


def change(
    base: Array, added: Array, missing: Array, strength: float, shade: float, dark: tuple[float, float] = DARK
) -> tuple[Array, Array]:
    """Compute (add, take): the light that comes in, (..., 3), and the share that a pixel's air and missing light take, (...), below 0 what
    the light on its surface gives.

    base: B, a pixel's smoothed lightness; added: (..., 3) and missing: (...), the sums of `ray_amount` over lights, added times color;
    dark: see `darkness`.
    """
    light = added @ REC709
    shown = strength * visible(base, dark)
    rise = MOST * (1 - np.exp(-shown * light / MOST))
    hidden = EXTINCTION * shade * rise / MOST
    amount = (base + rise) ** 3 - base**3
    on_surface = SURFACE[0] * smoothstep(base, *SURFACE[1:])
    gain = on_surface * amount / np.maximum(base, SURFACE[1]) ** 3
    in_air = (1 - on_surface) * amount + base**3 * hidden
    less = shade * (1 - BRIGHT[2] * smoothstep(base, *BRIGHT[:2])) * shown * missing
    dim = (1 - SHADE_MOST * (1 - np.exp(-less / np.maximum(base, 0.12) / SHADE_MOST))) ** 3
    return (in_air / np.maximum(light, 1e-9))[..., None] * added, 1 - dim * (1 - hidden) - gain


def put(color: Array, add: Array, take: Array, near: Array) -> tuple[Array, Array]:
    """Put the light on a pixel (..., 3): (added, taken), taken a share of it. near: (...), 1 where shafts pass behind.

    One factor for all channels keeps the hue, and the sum from passing WHITE.
    """
    taken = np.maximum(take, 0) * (1 - near)
    room = WHITE - color * (1 - taken)[..., None]
    tint = add / np.maximum(add @ REC709, 1e-9)[..., None]
    given = (add + np.maximum(-take, 0)[..., None] * color * (1 - TINT + TINT * tint)) * (1 - near)[..., None]
    fits = np.where(room > 0, 1 / (1 + given / np.maximum(room, 1e-6)), 0.0).min(axis=-1)
    return given * fits[..., None], taken


def drawn_pattern(count: int, grid: RayGrid, seed: int, phase: float = 0.0) -> Array:
    """Draw rays that no gap of the picture makes, (LINES,), mean 0 and deviation 1: three octaves of smooth noise over the angle.

    count: of the widest rays over the whole of the lines; phase: any number, moves them on smoothly, each on its own, as time does.
    """
    total = np.zeros(LINES)
    for octave, share in enumerate((1.0, 0.6, 0.35)):
        cells = count * 2**octave
        rng = np.random.default_rng((seed, octave))
        height, turn = rng.random(cells + 1), rng.random(cells + 1)
        value = np.sin(2 * math.pi * (turn + phase * (0.5 + height))) * np.sqrt(height)
        if grid.inside:
            value[-1] = value[0]
        at = (np.arange(LINES) + 0.5) / LINES * cells
        first = at.astype(int)
        way = smoothstep(at - first, 0.0, 1.0)
        total += share * (value[first] * (1 - way) + value[first + 1] * way)
    if not grid.inside:
        side = np.abs(np.linspace(-1, 1, LINES))
        total = (total - total.mean()) * smoothstep(1 - side, 0.0, 2 * ENDS)
    total -= total.mean()
    return np.asarray(total / max(float(total.std()), 1e-9))
