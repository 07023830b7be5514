"""Draw what lies behind a picture's shafts: `airlight image --debug`. Made by the passes and grids of the product itself."""

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from airlight import api
from airlight.errors import AirlightError
from airlight.files import Picture
from airlight.layers import gpu_inputs
from airlight.lights import ImageLight
from airlight.options import Parameters
from airlight.scatter.epipolar.epipolar import EpipolarPlan
from airlight.scatter.epipolar.grid import Grid, Quadrant
from airlight.scatter.epipolar.moments import Mixture
from airlight.scatter.methods import METHODS
from airlight.scatter.render import PictureRenderer, emitted, plan, source_pixels

Array = npt.NDArray[Any]
DIM = 0.25  # factor of the picture below lines
LINE, NODE = (0.05, 0.25, 0.6), (1.0, 0.6, 0.1)
STEPS = {1: (0.1, 0.35, 1.0), 2: (0.1, 0.8, 0.15), 4: (1.0, 0.55, 0.0)}  # colour of steps up to so many px: blue, green, orange
LONGER = (1.0, 0.05, 0.1)  # red
APART = 24  # px between drawn lines at the far edge, and between drawn nodes


def view(
    name: str,
    picture: Picture,
    lights: list[ImageLight],
    parameters: Parameters,
    mask: Any = None,
    depth: Any = None,
    device: PictureRenderer | str | None = None,
    say: Callable[[str], None] = lambda text: None,
) -> Array:
    """Compute one view: source, lines, moments (H, W, 3), linear; mask, fraction (H, W), 0..1. Its parameters `auto_threshold`.

    source: I m, what is summed. mask: m. fraction: D(phi) of Eq. 2. lines: the epipolar lines and nodes over the picture, every
    k-th. moments: the steps of every k-th line, coloured by their length. say gets what a picture cannot show, powers among it.
    Raises AirlightError where there are no lines, MachineError where there is no adapter.
    """
    if name == "fraction":
        keys = {field: getattr(parameters, field) for field in parameters.__struct_fields__}
        image = picture.rec709(picture.linear())
        return api.occlusion_fraction(image, lights, alpha=picture.alpha, depth=depth, mask=mask, device=device, **keys)
    gpu = device if isinstance(device, PictureRenderer) else PictureRenderer(device)
    pixels, planes = gpu_inputs(picture, [parameters], mask, depth)
    if name in ("source", "mask"):
        seen = source_pixels(gpu, *emitted(gpu, pixels, parameters, fraction=name == "mask", **planes), picture.width)
        return seen if name == "source" else seen[..., 0]
    source, _ = emitted(gpu, pixels, parameters, **planes)
    plain = [dataclasses.replace(light, cookie=None) for light in lights]
    plans, _ = plan(gpu.device, (picture.width, picture.height), plain, parameters, source)
    canvas = picture.linear() * np.float32(DIM)
    for i, one in enumerate(plans):
        if not isinstance(one, EpipolarPlan):
            is_short = METHODS[parameters.method].is_converged
            why = "its rays are short enough to be summed directly" if is_short else f"method {parameters.method}"
            raise AirlightError(f"--debug {name}: there are no lines ({why}); use method epipolar and a larger picture")
        say(_described(one, i + 1, parameters.lam))
        draw(canvas, one.grid, by_step=name == "moments")
    return canvas


def weight_error(mix: Mixture, density: float, lam: float) -> float:
    """Measure the largest error of the fitted weight e^(-lam s) over the way to the light, the weight at the pixel being 1."""
    x = np.linspace(max(1 - density, 1e-3), 1, 1000)  # distance from the light over the pixel's
    return float(np.abs(density * x[:, None] ** mix.p @ mix.c - np.exp(-lam / density * (1 - x))).max())


def _described(one: EpipolarPlan, number: int, lam: float) -> str:
    grid, mix = one.grid, one.mix
    lines = sum(q.lines for q in grid.quadrants)
    beyond = f" and {len(mix.beyond_p)} beyond the light" if mix.opposite else ""
    every = ", ".join(f"{_every(q)}th of {q.lines}" for q in grid.quadrants)
    return (
        f"light {number}: {len(mix.p)} powers{beyond} ({', '.join(f'{p:.3g}' for p in mix.p)}), largest error of the weight "
        f"{weight_error(mix, grid.density, lam):.1e}; {lines} lines; shown: every {every}"
    )


def _every(q: Quadrant) -> int:
    """Choose every how many-th line is drawn: a power of two, so that it is one of the nearer zones' too."""
    apart = max(q.dm * q.u[-1], 1e-3)
    return int(2 ** max(len(q.splits) - 2, round(np.log2(max(APART / apart, 1)))))


def draw(canvas: Array, grid: Grid, by_step: bool = False) -> None:
    """Draw every k-th line of a grid onto (H, W, 3): coloured by the length of its steps, or with nodes some APART px apart."""
    for q in grid.quadrants:
        lines, nodes = np.arange(0, q.lines, _every(q)), q.u[q.stored :]
        along, step = np.arange(nodes[0], nodes[-1], 0.5), np.diff(nodes)
        if not by_step:
            _dots(canvas, grid, q, lines, along, LINE)
            _dots(canvas, grid, q, lines, nodes[:: max(1, round(APART / float(step.max())))], NODE, 1)
            continue
        length = step[np.searchsorted(nodes, along, side="right") - 1]
        shorter = 0.0
        for longest, color in (*STEPS.items(), (np.inf, LONGER)):
            _dots(canvas, grid, q, lines, along[(length > shorter) & (length <= longest)], color)
            shorter = longest


def _dots(canvas: Array, grid: Grid, q: Quadrant, lines: Array, u: Array, color: tuple[float, float, float], reach: int = 0) -> None:
    """Colour the pixels of the lines at the distances u, and those up to `reach` beside them."""
    uv = grid.uv(q, u, q.sign)
    at = np.floor(uv[:, None, :2] + lines[:, None] * uv[:, None, 2:]).astype(np.int64).reshape(-1, 2)
    for dx in range(-reach, reach + 1):
        for dy in range(-reach, reach + 1):
            x, y = at[:, 0] + dx, at[:, 1] + dy
            fine = (x >= 0) & (y >= 0) & (x < grid.size[0]) & (y < grid.size[1])
            canvas[y[fine], x[fine]] = color
