"""Measures a small copy of the picture for a look: tones, what may emit, the light's colour, how far and how strong shafts are.

All lengths in picture diagonals, colours scene-linear Rec. 709 with white at 1. Nothing here needs a GPU.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from airlight.lights import ImageLight
from airlight.look.grid import LINES, Array, RayGrid, points
from airlight.luminance import luminance
from airlight.planes import blur, box, label, shrink_to, shrunk_size
from airlight.reference import look as twin
from airlight.reference.look import RaySettings, Tones

COPY_SIDE_PX = 400  # px of the copy's longer side
GLANCED = 2  # every how many-th of its pixels, along each axis, is looked at for rays and contrast
AROUND = (0.25, 0.5)  # within which the light's own tone, and that of its surroundings, are looked for
BLACK = 1e-4  # luminance
HOLDS = 0.012  # a part that comes as near to the light holds it
EMITTING = 0.1  # of full emission: from here pixels hang together as parts
TOP = 0.25  # of the height: where parts lie that a light above the picture shines through
GAP = 0.3  # of full emission, which gaps that a light beyond the picture shines through reach: specks in an even sky do not
SPECK = 5e-4  # of the picture: smaller parts may be dust, birds or lens spots
SECTORS, GAPS = 64, (0.06, 0.25)  # of the view from such a light; the share of them with gaps from which there are any, and with specks
RING = (0.40, 0.70, 0.12)  # where the light's colour is read: emission of the tone, from, to; distance
SCENE = (0.35, 0.25)  # share of the scene's colour in the light's, as air and surfaces have given it; diagonals in which it is read
UNCLIPPED = (0.90, 0.97)  # largest channel of pixels that are bright, and still have their colour
WARM = np.array([1.0, 0.86, 0.50])
GOLDEN = np.array([1.0, 0.70, 0.30])  # where a given warmth leads
WARM_LINE = math.log(WARM[0] / WARM[2]), math.log(WARM[1] / math.sqrt(WARM[0] * WARM[2]))  # how warm it is, and its green
WARMTH = {"disc": 0.6, "glow": 0.6, "beyond": 0.5, "opening": 0.35, "lamps": 0.0}  # how far a pale light is drawn to WARM
PALE = 0.35  # share of it that holds for a light which is as warm already
BLUE = -0.15  # ln(R / B) below which a light is meant to be blue
ASIDE = (0.12, 0.30)  # ln of green over what a warm white of the same R / B has, either way: from where a light is meant to have its hue
PURER, LEAST_CHANNEL = 1.5, 0.12
OPENING = 0.02  # share of the picture from which a bright part is an opening
REACH = (0.8, 0.15, 0.6)  # of the distance within which half of what can show shafts lies; least, most
LIGHT_ENOUGH = (0.75, 1.0)  # ln of the light's tone over its surroundings', from which something shines: noise has less
FINE_ENOUGH, SEEN_ENOUGH = (0.004, 0.008), (0.15, 0.28)  # rms of fine rays, and visible share, from which there are shafts, and whole ones
GUIDE = (0.012, 0.08)  # of the guided filter: radius of the longer side, deviation of L that counts as texture
SHOWN = (0.3, 4.0)  # the 99th percentile of pictures of floats that are shown as they are
VISIBLE = 8.0  # 100 x OKLab distance that 95 % of the pixels stay below at strength 1
STRONGEST = 8.0
HAZE = (0.4, 0.7)  # nearness without a depth map: at most, and where the haze makes an end of it
SOFT_EDGE = 0.03  # diagonals over which emission falls off where mist blurs all gaps
CONES = np.array(
    [[0.4122214708, 0.5363325363, 0.0514459929], [0.2119034982, 0.6806995451, 0.1073969566], [0.0883024619, 0.2817188376, 0.6299787005]]
)
OPPONENTS = np.array(
    [[0.2104542553, 0.7936177850, -0.0040720468], [1.9779984951, -2.4285922050, 0.4505937099], [0.0259040371, 0.7827717662, -0.8086757660]]
)


def oklab(color: Array) -> Array:
    """Convert (..., 3) linear Rec. 709 to OKLab (Ottosson 2020)."""
    return np.cbrt(np.maximum(color, 0) @ CONES.T) @ OPPONENTS.T


def white_of(color: Array) -> float:
    """Find white of a picture of floats: 1 where its 99th percentile is that of a picture as it is shown, else what makes it so."""
    bright = float(np.percentile(np.nan_to_num(color[::3, ::3].max(axis=-1), posinf=6e4), 99))
    return max(bright / SHOWN[1], 1.0) if bright > 1 else min(bright / SHOWN[0], 1.0) if bright > 1e-30 else 1.0


def _usable(color: Array) -> Array:
    return np.maximum(np.nan_to_num(color.astype(np.float64), posinf=1e4), 0)


def few(plane: Array) -> Array:
    """Take the pixels of a plane of the small copy that are glanced at."""
    return plane[::GLANCED, ::GLANCED]


@dataclass
class Small:
    """Holds a small copy of a picture, (h, w, 3) with white at 1, and what is made of it once, whatever the light.

    near: (h, w), 1 near. single: the picture's own pixels, not means of them, at the `few`; those of the copy if unset.
    """

    color: Array
    near: Array | None = None
    single: Array | None = None
    y: Array = field(init=False)
    guide: Array = field(init=False)  # (h, w, 2): B = guide[0] L + guide[1]
    base: Array = field(init=False)  # B

    def __post_init__(self) -> None:
        self.color = _usable(self.color)
        self.single = few(self.color) if self.single is None else _usable(self.single)
        self.y = luminance(self.color)
        level = twin.lightness(self.y)
        radius = max(1, round(GUIDE[0] * max(level.shape)))
        mean = box(level, radius)
        variance = np.maximum(box(level * level, radius) - mean * mean, 0)
        slope = variance / (variance + GUIDE[1] ** 2)
        self.guide = np.stack([box(slope, radius), box(mean * (1 - slope), radius)], axis=-1)
        self.base = self.guide[..., 0] * level + self.guide[..., 1]

    @property
    def size(self) -> tuple[int, int]:
        return self.y.shape[1], self.y.shape[0]

    @property
    def hidden(self) -> Array:
        """Return the nearness of things, (h, w), 0 where nothing says so."""
        return np.zeros_like(self.y) if self.near is None else self.near


def small_copy(color: Array, white: float = 1.0, near: Array | None = None, size: tuple[int, int] | None = None) -> Small:
    """Copy a picture (H, W, 3), Rec. 709, and of its nearness (H, W). size: (width, height) of the picture, if color has fewer
    pixels."""
    width, height = size or (color.shape[1], color.shape[0])
    to = shrunk_size(width, height, COPY_SIDE_PX)
    rows, columns = (
        ((few_of + 0.5) * full / copied).astype(int)
        for few_of, full, copied in ((np.arange(0, n, GLANCED), m, n) for n, m in zip(to[::-1], color.shape[:2], strict=True))
    )
    return Small(shrink_to(color, *to) / white, None if near is None else shrink_to(near, *to), color[rows[:, None], columns] / white)


def tones(small: Small, grid: RayGrid) -> Tones:
    """Measure the tones about the light, by distance from it or from where the picture is nearest to it."""
    x, y = points(*small.size)
    distance = np.hypot(x - grid.light[0], y - grid.light[1]) - grid.nearest
    close, around = (small.y[distance < max(reach, distance.min() + 1e-9)] for reach in AROUND)
    surroundings = float(np.exp(np.log(np.maximum(around, BLACK)).mean()))
    return Tones(surroundings, max(float(np.percentile(close, 99.5)), surroundings * 1.0001))


def parts(small: Small, tone: Tones, grid: RayGrid, drawn: bool | None = None, held: bool = False) -> Array:
    """Mark bright parts, (h, w), through which the light comes: those that hold it, touch the border on its side, or lie above it.

    Reflections, flower heads and snow below the light are none. Where a light beyond the picture has nothing but specks to shine through,
    they are none either: marked is the glow of the sky, for rays to be `drawn` in it, None: if it is so smooth that they will be. held: a
    frame before has settled that there are gaps, or rays to draw.
    """
    emits = twin.emission(small.y, tone)
    numbers, count = label(emits > EMITTING)
    x, y = points(*small.size)
    distance = np.hypot(x - grid.light[0], y - grid.light[1])
    sides = [numbers[0]]  # the sky reaches the top
    if grid.light[0] < 0:
        sides.append(numbers[:, 0])
    if grid.light[0] > grid.box[0]:
        sides.append(numbers[:, -1])
    if grid.light[1] > grid.box[1]:
        sides.append(numbers[-1])
    sides.append(numbers[distance < max(HOLDS, distance.min() + 1e-9)])
    size = np.maximum(np.bincount(numbers.ravel(), minlength=count + 1), 1)
    height = np.bincount(numbers.ravel(), weights=y.ravel(), minlength=count + 1) / size
    kept = height < (grid.light[1] if grid.light[1] > 0 else TOP * grid.box[1])
    kept[np.concatenate(sides)] = True
    kept[0] = False
    found = _wider(kept[numbers].astype(np.float64))
    if grid.inside or (held and not drawn) or gap_share(emits * found, grid) >= GAPS[1]:
        return found
    if gap_share(emits * (kept & (size >= SPECK * numbers.size))[numbers], grid) >= GAPS[0]:
        return found
    glow = _wider((size >= OPENING * numbers.size)[numbers] * (numbers > 0.0))
    return glow if drawn or (drawn is None and _is_smooth(emits * glow)) else np.zeros_like(glow)


def gap_share(emits: Array, grid: RayGrid) -> float:
    """Find the share of the view from a light beyond the picture, 0..1, in which something emits."""
    height, width = emits.shape
    sector = np.clip(grid.polar(*points(width, height))[1] * (SECTORS / LINES), 0, SECTORS - 1).astype(int)
    return len(np.unique(sector[emits > GAP])) / SECTORS


def _wider(found: Array) -> Array:
    """Spread marks by a pixel, as they are enlarged."""
    for axis in (0, 1):
        wide = np.pad(found, [(1, 1) if a == axis else (0, 0) for a in (0, 1)])
        found = np.maximum.reduce([np.take(wide, range(i, i + found.shape[axis]), axis=axis) for i in range(3)])
    return found


def wants_haze(lights: Sequence[ImageLight]) -> bool:
    """Tell whether the haze may say what is near: where the light is a sun, or comes from beyond the picture."""
    return all(light.kind in ("disc", "beyond") for light in lights)


def haze_nearness(small: Small) -> Array:
    """Guess what is near, (h, w), weakly: what no haze lies before, by the dark channel (He, Sun and Tang 2009)."""
    radius = max(1, round(0.01 * max(small.size)))
    dark = small.color.min(axis=-1)
    for axis in (0, 1):
        size = dark.shape[axis]
        wide = np.pad(dark, [(radius, radius) if a == axis else (0, 0) for a in (0, 1)], mode="edge")
        dark = np.minimum.reduce([np.take(wide, range(i, i + size), axis=axis) for i in range(2 * radius + 1)])
    level = np.log(np.maximum(blur(dark, 2 * radius), 1e-4))
    first, last = np.percentile(level, (5, 97))
    far = np.clip((level - first) / max(last - first, 1e-3), 0, 1)
    return HAZE[0] * (1 - twin.smoothstep(far, 0.0, HAZE[1]))


def ring_color(small: Small, tone: Tones, grid: RayGrid) -> Array:
    """Measure the colour of the ring about a light, (3,), where it is not clipped, with some of that of the scene which it lights."""
    x, y = points(*small.size)
    distance = np.hypot(x - grid.light[0], y - grid.light[1]) - grid.nearest
    rank = np.log(np.maximum(small.y, 1e-5) / tone.surroundings) / tone.span
    most = small.color.max(axis=-1)
    weight = (most < UNCLIPPED[1]) * twin.smoothstep(rank, *RING[:2]) * np.exp(-np.square(distance / RING[2]))
    bright = weight * (most >= UNCLIPPED[0])
    if bright.sum() > 0.02 * weight.sum() and bright.sum() > 1:
        weight = bright
    ring = (small.color * weight[..., None]).sum(axis=(0, 1)) / max(weight.sum(), 1e-9) if weight.sum() > 0 else np.ones(3)
    around = few(small.y) * few(twin.visible(small.base, twin.darkness(tone)) * (1 - twin.emission(small.y, tone)))
    around = around * np.exp(-np.square(few(distance) / SCENE[1]))
    scene = (few(small.color) * around[..., None]).sum(axis=(0, 1)) / max(around.sum(), 1e-9) if around.sum() > 0 else ring
    ring, scene = (np.maximum(color / max(float(luminance(color)), 1e-9), 1e-3) for color in (ring, scene))
    return np.asarray(ring ** (1 - SCENE[0]) * scene ** SCENE[0])


def own_warmth(ring: Array, kind: str) -> float:
    """Tell how far a light whose ring has this colour is drawn to a warm white where no warmth is given."""
    warm = math.log(ring[0] / ring[2])
    need = float(np.clip(1 - warm / WARM_LINE[0], 0, 1))
    aside = abs(math.log(ring[1] / math.sqrt(ring[0] * ring[2])) - warm * WARM_LINE[1] / WARM_LINE[0])
    meant = float(twin.smoothstep(np.array(aside), *ASIDE))
    return WARMTH[kind] * (PALE + (1 - PALE) * need) * (1 - meant) if warm > BLUE else 0.0


def light_color(small: Small, tone: Tones, grid: RayGrid, kind: str, warmth: float | None) -> tuple[float, float, float]:
    """Choose the colour of what the light adds, luminance 1: that of the ring about it, drawn to a warm white as it is pale, or by
    `warmth`."""
    ring = ring_color(small, tone, grid)
    if warmth is None:
        warmth = own_warmth(ring, kind)
        toward = WARM
    else:
        toward = GOLDEN if warmth >= 0 else GOLDEN[::-1]
        if (warmth >= 0) == (ring[0] * toward[2] > ring[2] * toward[0]):  # it is as warm, or as cool, already: some more of its own
            toward = ring * (toward / toward.max()) ** 0.5
    ring, toward = ring / luminance(ring), toward / luminance(toward)
    mixed = np.exp((1 - abs(warmth)) * np.log(ring) + abs(warmth) * np.log(toward)) ** PURER
    mixed = np.maximum(mixed / mixed.max(), LEAST_CHANNEL)
    r, g, b = mixed / luminance(mixed)
    return float(r), float(g), float(b)


@dataclass
class Seen:
    """Holds one light before the small copy: what it emits through, and its bands at the `few` pixels, (h, w, 3), with their distances."""

    grid: RayGrid
    tones: Tones
    parts: Array
    kind: str
    emits: Array
    bands: Array | None = None
    distance: Array | None = None


def see(
    small: Small,
    position: tuple[float, float],
    size: tuple[int, int],
    kind: str | None,
    masked: Array | None = None,
    drawn: bool | None = None,
    held: bool = False,
) -> Seen:
    """Look at a light. size: of the whole picture; kind: as in detect.Candidate, None to be told by what is there; masked: (h, w), what
    may emit at all; drawn, held: as of `parts`."""
    grid = RayGrid(size, position)
    tone = tones(small, grid)
    may_emit = parts(small, tone, grid, drawn, held)
    if masked is not None:
        may_emit = may_emit * masked
    emits = twin.emission(small.y, tone) * may_emit
    if kind is None:
        kind = "beyond" if not grid.inside else "opening" if (emits > 0.5).mean() > OPENING else "disc"
    return Seen(grid, tone, may_emit, kind, emits)


def is_misty(seen: Seen) -> bool:
    """Tell whether all edges of what emits are wide and smooth, as of a sky in mist: there are no gaps for light to come through."""
    return _is_smooth(seen.emits)


def _is_smooth(emits: Array) -> bool:
    if min(emits.shape) < 2:
        return False
    diagonal = math.hypot(*emits.shape)
    rise = np.hypot(*np.gradient(emits)) * diagonal
    between = (emits > 0.1) & (emits < 0.9)
    return bool(between.mean() > 0.02 and np.median(rise[between]) < 1 / SOFT_EDGE)


@dataclass(frozen=True)
class Found:
    """Holds the measures of one light's rays: the rms of all that stands out, and of fine rays; how much is visible; their reach."""

    deviation: float
    fine: float
    rest: float
    visible: float
    length: float
    span: float  # ln of the light's tone over its surroundings'

    @property
    def holds(self) -> float:
        """Rate, 0..1, how much of the asked contrast the picture holds."""
        steps = (self.fine, *FINE_ENOUGH), (self.visible, *SEEN_ENOUGH), (self.span, *LIGHT_ENOUGH)
        return math.prod(float(twin.smoothstep(np.array(value), low, high)) for value, low, high in steps)


def found(small: Small, seen: Seen) -> Found:
    """Measure the rays where they can be seen."""
    assert seen.bands is not None and seen.distance is not None
    weight = few(twin.visible(small.base, twin.darkness(seen.tones)) * (1 - seen.emits))
    total = max(float(weight.sum()), 1e-9)
    rest = twin.REST * max(float(seen.bands[..., 2].max()), 1e-6)
    out = twin.standing_out(seen.bands, rest)
    fine = seen.bands[..., 0] / (seen.bands[..., 2] + rest)
    order = np.argsort(seen.distance, axis=None)
    gathered = np.cumsum(weight.ravel()[order])
    half = float(seen.distance.ravel()[order][min(np.searchsorted(gathered, 0.5 * gathered[-1]), len(order) - 1)])
    deviation, fine_rms = (math.sqrt(float((weight * v * v).sum()) / total) for v in (out, fine))
    return Found(deviation, fine_rms, rest, float(weight.mean()), float(np.clip(REACH[0] * half, *REACH[1:])), seen.tones.span)


def sums(small: Small, lights: Sequence[tuple[Seen, RaySettings]]) -> tuple[Array, Array]:
    """Sum all lights as `change` takes them, of the `few` pixels: ((h, w, 3) added, (h, w) missing light)."""
    added, missing = np.zeros((*few(small.y).shape, 3)), np.zeros_like(few(small.y))
    for seen, settings in lights:
        assert seen.bands is not None and seen.distance is not None
        x, y = (few(plane) for plane in points(*small.size))
        away = np.maximum(seen.distance, 1e-9)
        entry = seen.grid.entry((x - seen.grid.light[0]) / away, (y - seen.grid.light[1]) / away)
        amount = twin.ray_amount(seen.bands, seen.distance, entry, few(seen.emits), settings)
        added += np.maximum(amount, 0)[..., None] * np.array(settings.color)
        missing += np.maximum(-amount, 0)
    return added, missing


class Contrast:
    """Measures the visible contrast of a look of some strength: the 95th percentile of 100 times the OKLab distance to the picture, of the
    `few` pixels. added, missing: `sums`."""

    def __init__(self, small: Small, added: Array, missing: Array, shade: float, dark: tuple[float, float] = twin.DARK) -> None:
        assert small.single is not None
        self.color, self.base, self.near = small.single, few(small.base), few(small.hidden)
        self.sums, self.shade, self.dark = (added, missing), shade, dark
        self.before = oklab(self.color)

    def at(self, strength: float) -> float:
        added, taken = twin.put(self.color, *twin.change(self.base, *self.sums, strength, self.shade, self.dark), self.near)
        after = oklab(self.color * (1 - taken)[..., None] + added)
        return float(np.percentile(100 * np.sqrt(np.square(after - self.before).sum(axis=-1)), 95))

    def solve(self, wanted: float) -> tuple[float, float]:
        """Solve (strength, the contrast that it gives): the least that gives what is wanted, or the strongest where none does."""
        if wanted <= 0:
            return 0.0, 0.0
        low, high, reached = 0.0, STRONGEST, self.at(STRONGEST)
        if reached <= wanted:
            return high, reached
        below, above = 0.0, reached
        for _ in range(20):
            middle = low + (high - low) * min(max((wanted - below) / (above - below), 0.1), 0.9)
            now = self.at(middle)
            if abs(now - wanted) < 0.01 * wanted:
                return middle, now
            if now < wanted:
                low, below = middle, now
            else:
                high, above = middle, now
        return high, above
