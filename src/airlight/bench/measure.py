"""Time and error of each method on one device, as ratios to a one-tap copy, in one run."""

import importlib
import time
from collections.abc import Sequence
from typing import Any

import numpy as np

from airlight.bench.rivals import PolarWarp
from airlight.gpu.device import Device
from airlight.gpu.timing import compute, run_ms
from airlight.lights import ImageLight
from airlight.options import Parameters
from airlight.reference.radial import converged
from airlight.reference.scenes import foliage
from airlight.scatter.render import plan

SUN = (0.6, 0.35)
LIGHTS = {"inside": (0.60016, 0.35019), "edge": (0.02, 0.3), "outside": (1.2, -0.25)}
LENGTHS = ((0.8, 1.5), (0.926, 3.24), (0.96, 6.3), (1.0, 0.0))
POINTS = 4000  # random pixels at which the error is measured
COPIES = [(entry, strip, along) for entry in ("copy_wide", "copy_square") for strip in (1, 4, 8, 16) for along in (False, True)]
KERNELS = len(COPIES) + 1  # and one that draws


class Passes:
    """Holds a source and a layer of one size on one device, and what is timed on them."""

    def __init__(self, device: Device, source: Any, layer: Any) -> None:
        self.device, self.source, self.layer = device, source, layer
        self.size: tuple[int, int] = layer.size[:2]

    def copy(self) -> Any:
        """Choose the fastest of the copy kernels."""
        records = [self._compute_copy(*kernel) for kernel in COPIES] + [self._drawn_copy()]
        times = _times(self.device, records, 5)
        return min(zip(records, times, strict=True), key=lambda found: min(found[1]))[0]

    def _compute_copy(self, entry: str, strip: int, along: bool) -> Any:
        pipeline = self.device.pipeline("gpu/copy.wgsl", entry, STRIP=strip, ALONG=along)
        bind = self.device.bind("gpu/copy.wgsl", self.source, self.layer)
        wide, high = (8, 8) if entry == "copy_square" else (64, 1)
        cells = (-(-self.size[0] // strip), self.size[1]) if along else (self.size[0], -(-self.size[1] // strip))

        def record(encoder: Any) -> None:
            compute(encoder, pipeline, bind, (-(-cells[0] // wide), -(-cells[1] // high)))

        return record

    def _drawn_copy(self) -> Any:
        pipeline = self.device.raster("gpu/copy_raster.wgsl", "cover", "copy")
        bind = self.device.bind("gpu/copy_raster.wgsl", self.source)
        target = {"view": self.layer.create_view(), "load_op": "load", "store_op": "store"}

        def record(encoder: Any) -> None:
            run = encoder.begin_render_pass(color_attachments=[target])
            run.set_pipeline(pipeline)
            run.set_bind_group(0, bind)
            run.draw(3)
            run.end()

        return record

    def method(self, lights: list[ImageLight], p: Parameters) -> Any:
        plans, _ = plan(self.device, self.size, lights, p, self.source, self.layer)

        def record(encoder: Any) -> None:
            for step in plans:
                step.record(encoder)

        return record


class Bench(Passes):
    """Times passes on a synthetic image, and measures their errors."""

    def __init__(self, device: Device, width: int, height: int) -> None:
        picture = np.ones((height, width, 4), np.float16)
        picture[..., :3] = foliage(width, height, sun=SUN)
        self.image = picture[..., :3].astype(np.float64)
        super().__init__(device, *(device.texture(width, height, "rgba16float") for _ in range(2)))
        device.write(self.source, picture, width * 8)
        # a quarter of the points lies around the sun, where the rare large errors are, and counts by its area
        rng = np.random.default_rng(7)
        y, x = np.indices((height, width)).reshape(2, -1)
        near = np.hypot(x - SUN[0] * width, y - SUN[1] * height) < 0.015 * width
        chosen = [rng.choice(np.flatnonzero(part), n, replace=False) for part, n in ((near, POINTS // 4), (~near, POINTS - POINTS // 4))]
        self.x, self.y = x[np.concatenate(chosen)], y[np.concatenate(chosen)]
        self.share = np.concatenate([np.full(len(c), part.mean() / len(c)) for c, part in zip(chosen, (near, ~near), strict=True)])
        self.points = np.stack([(self.x + 0.5) / width, (self.y + 0.5) / height], axis=1)

    def result(self) -> np.ndarray:
        width, height = self.size
        half = np.frombuffer(self.device.read(self.layer, 8), np.float16).reshape(height, width, 4)
        return half[self.y, self.x, :3].astype(np.float64)

    def error(self, found: np.ndarray, truth: np.ndarray, light: tuple[float, float]) -> float:
        """Compute rmse over the mean, outside a disc of 2 % of the width around the light; found and truth at the points."""
        width, height = self.size
        away = np.hypot((self.points[:, 0] - light[0]) * width, (self.points[:, 1] - light[1]) * height) > 0.02 * width
        share = np.where(away, self.share, 0)
        off = ((found - truth) ** 2).mean(axis=1)
        return float(np.sqrt(off @ share * share.sum()) / (truth.mean(axis=1) @ share))


def _times(device: Device, records: list[Any], runs: int, slow: int = 0) -> list[list[float]]:
    """Time functions interleaved, so that a drifting machine slows all alike; the last `slow` of them in every third run only."""
    for record in records:
        run_ms(device, record)
    times: list[list[float]] = [[] for _ in records]
    for turn in range(runs):
        for i, record in enumerate(records):
            if i < len(records) - slow or turn % 3 == 1:
                times[i].append(run_ms(device, record))
    return times


def _parameters(method: Any, density: float, lam: float, quality: Any = "normal", samples: int = 150, scale: float = 1.0) -> Parameters:
    return Parameters(
        method=method,
        samples=samples,
        weight=1.0,
        exposure=1.0,
        density=density,
        decay=float(np.exp(-lam / samples)),
        jitter="midpoint",
        quality=quality,
        scale=scale,
        occlusion="none",
    )  # type: ignore[arg-type]


def record_of(
    case: str, method: str, size: tuple[int, int], times: list[float], samples: int = 1, density: float = 0.0, lam: float = 0.0, **more: Any
) -> dict[str, Any]:
    """Make one record of the JSON file; more: quality, scale, error."""
    return {
        "case": case,
        "method": method,
        "samples": samples,
        "density": density,
        "lambda": lam,
        "width": size[0],
        "height": size[1],
        "ms": float(np.median(times)),
        "ms_min": min(times),
        "runs": len(times),
        **more,
    }


def methods(
    device: Device,
    say: Any,
    size: tuple[int, int] = (1920, 1080),
    runs: int = 9,
    lights: Sequence[str] = tuple(LIGHTS),
    lengths: Sequence[tuple[float, float]] = LENGTHS,
) -> list[dict[str, Any]]:
    """Time copy, radial n = 150, n = 100 at half resolution, epipolar at each quality: for each light, density and lambda."""
    bench = Bench(device, *size)
    copy = bench.copy()
    records: list[dict[str, Any]] = []
    for case in lights:
        position = LIGHTS[case]
        for density, lam in lengths:
            truth = converged(bench.image, position, density=density, lam=lam, points=bench.points)
            variants: list[tuple[Parameters, dict[str, Any]]] = [
                (_parameters("epipolar", density, lam, quality), {"quality": quality}) for quality in ("draft", "normal", "final")
            ]
            variants.append((_parameters("radial", density, lam), {}))
            variants.append((_parameters("radial", density, lam, samples=100, scale=0.5), {"scale": 0.5}))
            plans = [bench.method([ImageLight(position)], p) for p, _ in variants]
            times = _times(device, [copy, *plans], runs, slow=2)
            records.append(record_of(case, "copy", size, times[0], lam=lam))
            base = records[-1]["ms"]
            for (p, more), record, own in zip(variants, plans, times[1:], strict=True):
                run_ms(device, record)
                error = bench.error(bench.result(), truth, position)
                one = record_of(case, p.method, size, own, p.samples, density, lam, error=error, **more)
                records.append(one)
                what = " ".join(f"{k} {v}" for k, v in more.items())
                say(
                    f"{case:8} D {density:<5} lambda {lam:<5} {p.method:8} n {p.samples:<4} {what:14} "
                    f"{one['ms']:8.1f} ms {one['ms'] / base:6.1f} copies  error {error:.2%}"
                )
    return records


def rivals(device: Device, say: Any, runs: int = 7) -> list[dict[str, Any]]:
    """Time OpenCV's polar warp beside the epipolar method, at density 1, light inside; nothing where OpenCV is not installed."""
    try:
        cv2 = importlib.import_module("cv2")
    except ImportError:
        say("rival: OpenCV is not installed (pip install opencv-python-headless), so its polar warp is left out")
        return []
    size = (1920, 1080)
    bench, position = Bench(device, *size), LIGHTS["inside"]
    copy, image = bench.copy(), bench.image.astype(np.float32)
    records = []
    for lam in (0.0, 3.24):
        truth = converged(bench.image, position, density=1.0, lam=lam, points=bench.points)
        ours = bench.method([ImageLight(position)], _parameters("epipolar", 1.0, lam))
        fineness = {"opencv polar 2048": (2048, 1.0), "opencv polar 4096": (4096, 0.5)}
        theirs = {name: PolarWarp(cv2, size, position, lam, *fine) for name, fine in fineness.items()}
        times: dict[str, list[float]] = {"copy": [], "ours": [], **{name: [] for name in theirs}}
        errors: dict[str, float] = {}
        for turn in range(runs + 1):
            spent = {"copy": run_ms(device, copy), "ours": run_ms(device, ours)}
            for name, warp in theirs.items():
                start = time.perf_counter()
                found = warp(image)
                spent[name] = (time.perf_counter() - start) * 1e3
                if turn == 0:
                    errors[name] = bench.error(found[bench.y, bench.x].astype(np.float64), truth, position)
            if turn:
                for name, ms in spent.items():
                    times[name].append(ms)
        run_ms(device, ours)
        error = bench.error(bench.result(), truth, position)
        found_all = [record_of("rival", "epipolar", size, times["ours"], 150, 1.0, lam, error=error, quality="normal")]
        found_all += [record_of("rival", name, size, times[name], 1, 1.0, lam, error=errors[name]) for name in theirs]
        base = float(np.median(times["copy"]))
        for one in found_all:
            copies = one["ms"] / base
            say(f"rival    D 1.0   lambda {lam:<5} {one['method']:20} {one['ms']:8.1f} ms {copies:6.1f} copies  error {one['error']:.2%}")
        records += found_all
    return records


def extras(device: Device, say: Any, runs: int = 7) -> list[dict[str, Any]]:
    """Time four lights, 4K, lambda 0 against 10, and whole calls through the API."""
    from airlight.api import add_light_shafts, light_shafts

    records: list[dict[str, Any]] = []
    for size in ((1920, 1080), (3840, 2160)):
        bench = Bench(device, *size)
        inside = ImageLight(LIGHTS["inside"])
        cases = [("inside", [inside], lam) for lam in (0.0, 3.24, 10.0)]
        cases.append(("four lights", [inside] + [ImageLight(p) for p in ((0.2, 0.4), (0.8, 0.7), (0.45, 0.9))], 3.24))
        plans = [bench.method(lights, _parameters("epipolar", 0.926, lam)) for _, lights, lam in cases]
        times = _times(device, [bench.copy(), *plans], runs)
        base = float(np.median(times[0]))
        image = bench.image.astype(np.float32)
        codes = np.rint(255 * np.minimum(image, 1.0)).astype(np.uint8)
        keywords: dict[str, Any] = {"density": 0.926, "samples": 150, "decay": float(np.exp(-3.24 / 150)), "device": device}
        for name, call, given in (("layer of floats", light_shafts, image), ("composite of 8 bit", add_light_shafts, codes)):
            own = []
            for _ in range(5):
                start = time.perf_counter()
                call(given, inside, **keywords)
                own.append((time.perf_counter() - start) * 1e3)
            cases.append((f"whole call, {name}", [inside], 3.24))
            times.append(own[1:])
        for (case, _, lam), own in zip(cases, times[1:], strict=True):
            method = "api" if case.startswith("whole") else "epipolar"
            one = record_of(case, method, size, own, 150, 0.926, lam, quality="normal")
            records.append(one)
            say(f"{case:32} lambda {lam:<5} {size[0]} x {size[1]} {one['ms']:8.1f} ms {one['ms'] / base:6.1f} copies")
    return records
