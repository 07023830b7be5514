"""The scenes of validation, measured: what Airlight draws of them, and its error against the tracer and against Mitsuba."""

from dataclasses import dataclass
from functools import cache

import numpy as np

from airlight.compare import rule
from airlight.lights.punctual import PunctualLight
from airlight.medium.resolve import ResolvedMedium
from airlight.options import March, Medium, Parameters, build
from airlight.pygfx.punctual import punctual_lights
from airlight.reference import mitsuba, panes
from airlight.scenes import open_scene
from airlight.scenes.offline import Shot, Studio
from airlight.scenes.triangles import world_panes, world_triangles

SIZE = 480, 270
# whose media vary in space
VARYING = "mist-sun", "mist-lamp", "ramp-sun", "ramp-spots", "smoke-sun", "smoke-spot", "in-smoke", "drift", "puffs", "smoke-slide"
SEEN_THROUGH = "panes", "stained", "pendant"  # with glass
SHAPED = "slide", "gobo", "leaves", "clipped", "street", "flood"  # lights with a shape, alone in air that is even
NOT_OF_MITSUBA = (*VARYING, *SEEN_THROUGH, "leaves", "clipped", "street")  # which it is not given, or has not
VARYING_SIZE = 160, 90  # of their pictures, whose truth takes some ten times as long
GRID = 5  # Mitsuba has the pixels in the middle of squares of so many, whose rays are those of a picture that much smaller
SPP = {True: 1024, False: 6000}  # Mitsuba's rays of a pixel for a sun, and for a lamp, whose own way through the medium is a game of chance
MORE = {"dense": 4, "slide": 4}  # times as many: few of that game are won


@dataclass(frozen=True)
class Drawn:
    """A frame's (H, W, 3) layer, and what a ray tracer needs for the same."""

    layer: np.ndarray
    view: np.ndarray
    projection: np.ndarray
    seen: np.ndarray
    casting: np.ndarray
    lamps: list[PunctualLight]
    air: ResolvedMedium
    glass: list[panes.Pane]

    def traced(self) -> tuple[np.ndarray, np.ndarray]:
        """(H, W, 3) the true light, and (H, W) metres of the rays."""
        height, width = self.layer.shape[:2]
        found = panes.layer(self.view, self.projection, (width, height), self.seen, self.glass, self.lamps, self.air, self.casting)
        return found.radiance, found.path_length


@dataclass(frozen=True)
class Noisy:
    """Against a picture of Monte Carlo, over the mean. rmse: at most, by two standard errors; the noise is taken off. unsure: the standard
    error of the bias. noise: rms of the Monte Carlo picture's own error."""

    rmse: float
    bias: float
    unsure: float
    noise: float


def draw(name: str, width: int, height: int, **values: object) -> Drawn:
    """One sample at pixel centres, quality final."""
    stage = open_scene(name)
    built = build(stage.settings | {"method": "march", "quality": "final"} | values)
    studio = Studio(stage, Shot(width, height, samples=1), built[Parameters], medium=built[Medium], march=built[March])
    layer = studio.frame(layer=True).layer[..., :3].astype(float)
    seen, casting = world_triangles(stage.scene, stage.lights)
    glass, unknown = world_panes(stage.scene, stage.lights)
    assert not unknown
    camera = studio.camera
    medium, matrices = studio.shafts.resolved_medium, (camera.view_matrix.copy(), camera.projection_matrix.copy())
    return Drawn(layer, *matrices, seen, casting, punctual_lights(stage.lights), medium, glass)


def without_worst(off: np.ndarray, among: np.ndarray) -> np.ndarray:
    """(H, W) bool: pixels, but for those that are farthest off."""
    worst = np.abs(off).mean(axis=2)
    return np.asarray(among & (worst <= np.quantile(worst[among], 1 - rule.WORST)))


def error(found: np.ndarray, truth: np.ndarray, way: np.ndarray) -> tuple[float, float]:
    """(rmse, bias) over the mean, by the rule of `airlight compare`."""
    found_errors = rule.errors(found, truth, rule.clear(way))
    return found_errors.rmse, found_errors.bias


@cache
def exact(name: str) -> tuple[Drawn, np.ndarray, np.ndarray]:
    """The exact walk of a scene, and the tracer's light and way."""
    drawn = draw(name, *(VARYING_SIZE if name in VARYING else SIZE))
    return drawn, *drawn.traced()


@cache
def by_mitsuba(name: str) -> tuple[np.ndarray, np.ndarray]:
    """(H / GRID, W / GRID, 3) light and half the difference of its halves."""
    drawn, width, height = exact(name)[0], *(k // GRID for k in SIZE)
    light = np.zeros((2, height, width, 3))
    for sun in (True, False):
        some = [lamp for lamp in drawn.lamps if lamp.directional == sun]
        rays = SPP[sun] * MORE.get(name, 1)
        found, noise = mitsuba.layer(drawn.view, drawn.projection, (width, height), drawn.seen, some, drawn.air, drawn.casting, spp=rays)
        light += found.radiance, noise
    return light[0], light[1]


def error_by_mitsuba(name: str, tracers: bool = False) -> Noisy:
    """Of the exact walk, or of the tracer; the pixels are those of `error` that are in the grid. Which are the worst the tracer says, since
    by Monte Carlo they would be the noisiest; so it does which 1 % are the brightest, left out here: rays that nearly meet a lamp, most of
    whose light comes from a stretch that few samples find."""
    drawn, truth, way = exact(name)
    light, halves = by_mitsuba(name)
    grid = np.s_[GRID // 2 :: GRID, GRID // 2 :: GRID]
    among, bright = rule.clear(way), truth.mean(axis=2)
    among &= bright <= np.quantile(bright[among], 0.99)
    kept = without_worst(drawn.layer - truth, among)[grid]
    off = (truth if tracers else drawn.layer)[grid] - light
    among, mean = among[grid], light[among[grid]].mean()
    squares = (off[kept] ** 2 - halves[kept] ** 2).mean(axis=1) / mean**2  # of independent halves A, B: (x - A) (x - B)
    spread = squares.std() / np.sqrt(len(squares))
    return Noisy(
        rmse=float(np.sqrt(max(squares.mean(), 0) + 2 * spread)),
        bias=float(off[among].mean() / mean),
        unsure=float(halves[among].mean(axis=1).std() / np.sqrt(among.sum()) / mean),
        noise=float(np.sqrt(np.mean(halves[kept] ** 2)) / mean),
    )
