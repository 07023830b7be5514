"""`airlight bench`: time and error of each method on this adapter, as ratios to a one-tap copy, in one run."""

import json
import subprocess
import time
from pathlib import Path
from typing import Any

import numpy as np

from airlight.files import replacing
from airlight.gpu.device import Device, open_device
from airlight.gpu.timing import run_ms
from airlight.lights import Light
from airlight.parameters import Parameters
from airlight.reference.radial import converged
from airlight.reference.scenes import foliage
from airlight.scatter.render import plan

SUN = (0.6, 0.35)
LIGHTS = {"inside": (0.60016, 0.35019), "edge": (0.02, 0.3), "outside": (1.2, -0.25)}
LENGTHS = ((0.8, 1.5), (0.926, 3.24), (0.96, 6.3), (1.0, 0.0))
POINTS = 2000  # random pixels at which the error is measured
COPIES = [(entry, strip, along) for entry in ("copy_wide", "copy_square") for strip in (1, 4, 8, 16) for along in (False, True)]


def _commit() -> str:
    try:
        done = subprocess.run(
            ["git", "describe", "--always", "--dirty"], cwd=Path(__file__).parent, capture_output=True, text=True, timeout=10
        )
        return done.stdout.strip() or "unknown"
    except (OSError, subprocess.SubprocessError):
        return "unknown"


class Bench:
    """One size of image on one device: a source, a layer, and what is timed on them."""

    def __init__(self, device: Device, width: int, height: int) -> None:
        self.device, self.size = device, (width, height)
        picture = np.ones((height, width, 4), np.float16)
        picture[..., :3] = foliage(width, height, sun=SUN)
        self.image = picture[..., :3].astype(np.float64)
        self.source, self.layer = (device.texture(width, height, "rgba16float") for _ in range(2))
        device.write(self.source, picture, width * 8)
        # a quarter of the points lies around the sun, where the rare large errors are, and counts by its area
        rng = np.random.default_rng(7)
        y, x = np.indices((height, width)).reshape(2, -1)
        near = np.hypot(x - SUN[0] * width, y - SUN[1] * height) < 0.015 * width
        chosen = [rng.choice(np.flatnonzero(part), n, replace=False) for part, n in ((near, POINTS // 4), (~near, POINTS - POINTS // 4))]
        self.x, self.y = x[np.concatenate(chosen)], y[np.concatenate(chosen)]
        self.share = np.concatenate([np.full(len(c), part.mean() / len(c)) for c, part in zip(chosen, (near, ~near), strict=True)])
        self.points = np.stack([(self.x + 0.5) / width, (self.y + 0.5) / height], axis=1)

    def copy(self) -> Any:
        """The fastest of the copy kernels."""
        best, best_ms = None, float("inf")
        for entry, strip, along in COPIES:
            pipeline = self.device.pipeline("gpu/copy.wgsl", entry, STRIP=strip, ALONG=along)
            bind = self.device.bind("gpu/copy.wgsl", self.source, self.layer)
            wide, high = (8, 8) if entry == "copy_square" else (64, 1)
            cells = (-(-self.size[0] // strip), self.size[1]) if along else (self.size[0], -(-self.size[1] // strip))
            groups = -(-cells[0] // wide), -(-cells[1] // high)

            def record(encoder: Any, pipeline: Any = pipeline, bind: Any = bind, groups: Any = groups) -> None:
                run = encoder.begin_compute_pass()
                run.set_pipeline(pipeline)
                run.set_bind_group(0, bind)
                run.dispatch_workgroups(*groups)
                run.end()

            ms = min(run_ms(self.device, record) for _ in range(5))
            if ms < best_ms:
                best, best_ms = record, ms
        return best

    def method(self, lights: list[Light], p: Parameters) -> Any:
        plans, _ = plan(self.device, self.size, lights, p, self.source, self.layer)

        def record(encoder: Any) -> None:
            for step in plans:
                step.record(encoder)

        return record

    def result(self) -> np.ndarray:
        width, height = self.size
        half = np.frombuffer(self.device.read(self.layer, 8), np.float16).reshape(height, width, 4)
        return half[self.y, self.x, :3].astype(np.float64)


def _times(device: Device, records: list[Any], runs: int) -> list[list[float]]:
    """Interleaved, so that a drifting machine slows all alike."""
    for record in records:
        run_ms(device, record)
    times: list[list[float]] = [[] for _ in records]
    for _ in range(runs):
        for record, own in zip(records, times, strict=True):
            own.append(run_ms(device, record))
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


def measure(device: Device, width: int = 1920, height: int = 1080, runs: int = 7, say: Any = print) -> list[dict[str, Any]]:
    """The records of one size: copy, radial n = 150, n = 100 at half resolution, epipolar at each quality, for each light."""
    bench = Bench(device, width, height)
    copy = bench.copy()
    records: list[dict[str, Any]] = []

    def note(case: str, method: str, times: list[float], p: Parameters | None, lam: float, **more: Any) -> None:
        ms = float(np.median(times))
        about = {"samples": p.samples, "density": p.density, "lambda": lam} if p else {"samples": 1, "density": 0.0, "lambda": 0.0}
        records.append(
            {
                "case": case,
                "method": method,
                **about,
                "width": width,
                "height": height,
                "ms": ms,
                "ms_min": min(times),
                "runs": len(times),
                **more,
            }
        )

    for case, position in LIGHTS.items():
        for density, lam in LENGTHS:
            truth = converged(bench.image, position, density=density, lam=lam, points=bench.points)
            away = np.hypot((bench.points[:, 0] - position[0]) * width, (bench.points[:, 1] - position[1]) * height) > 0.02 * width
            variants: list[tuple[str, Parameters, dict[str, Any]]] = [
                ("epipolar", _parameters("epipolar", density, lam, quality), {"quality": quality})
                for quality in ("draft", "normal", "final")
            ]
            slow: list[tuple[str, Parameters, dict[str, Any]]] = [
                ("radial", _parameters("radial", density, lam), {}),
                ("radial", _parameters("radial", density, lam, samples=100, scale=0.5), {"scale": 0.5}),
            ]
            fast = [bench.method([Light(position)], p) for _, p, _ in variants]
            times = _times(device, [copy, *fast], runs)
            note(case, "copy", times[0], None, lam)
            base = float(np.median(times[0]))
            slower = [bench.method([Light(position)], p) for _, p, _ in slow]
            times = times[1:] + _times(device, slower, 3)
            for (method, p, more), record, own in zip(variants + slow, fast + slower, times, strict=True):
                run_ms(device, record)
                off = ((bench.result() - truth) ** 2).mean(axis=1)
                share = np.where(away, bench.share, 0)
                error = float(np.sqrt(off @ share * share.sum()) / (truth.mean(axis=1) @ share))
                note(case, method, own, p, lam, error=error, **more)
                what = " ".join(f"{k} {v}" for k, v in more.items())
                ms = float(np.median(own))
                say(
                    f"{case:8} D {density:<5} lambda {lam:<5} {method:8} n {p.samples:<4} {what:14} "
                    f"{ms:8.1f} ms {ms / base:6.1f} copies  error {error:.2%}"
                )
    return records


def extras(device: Device, say: Any = print, runs: int = 5) -> list[dict[str, Any]]:
    """Four lights, 4K, lambda 0 against 10, and the whole call through the API."""
    from airlight.api import light_shafts

    records: list[dict[str, Any]] = []

    def note(case: str, method: str, size: tuple[int, int], times: list[float], lam: float, base: float) -> None:
        ms = float(np.median(times))
        records.append(
            {
                "case": case,
                "method": method,
                "samples": 150,
                "density": 0.926,
                "lambda": lam,
                "width": size[0],
                "height": size[1],
                "ms": ms,
                "ms_min": min(times),
                "runs": len(times),
                "quality": "normal",
            }
        )
        say(f"{case:24} lambda {lam:<5} {size[0]} x {size[1]} {ms:8.1f} ms {ms / base:6.1f} copies")

    for size in ((1920, 1080), (3840, 2160)):
        bench = Bench(device, *size)
        inside = Light(LIGHTS["inside"])
        cases = [("inside", [inside], lam) for lam in (0.0, 3.24, 10.0)]
        cases.append(("four lights", [inside] + [Light(p) for p in ((0.2, 0.4), (0.8, 0.7), (0.45, 0.9))], 3.24))
        plans = [bench.method(lights, _parameters("epipolar", 0.926, lam)) for _, lights, lam in cases]
        times = _times(device, [bench.copy(), *plans], runs)
        base = float(np.median(times[0]))
        for (case, _, lam), own in zip(cases, times[1:], strict=True):
            note(case, "epipolar", size, own, lam, base)
        image = bench.image.astype(np.float32)
        own = []
        for _ in range(3):
            start = time.perf_counter()
            light_shafts(image, inside, occlusion="none", density=0.926, samples=150, decay=float(np.exp(-3.24 / 150)), device=device)
            own.append((time.perf_counter() - start) * 1e3)
        note("whole call", "api", size, own, 3.24, base)
    return records


def run(json_path: str | None = None, overwrite: bool = False, device_name: str | None = None, say: Any = print) -> dict[str, Any]:
    """Measure, print, and write the records as JSON if asked to."""
    device = open_device(device_name)
    say(f"adapter: {device.name} ({device.info.get('backend_type')}); 1 copy = the fastest of {len(COPIES)} one-tap rgba16f copy kernels")
    result = {
        "adapter": device.name,
        "backend": device.info.get("backend_type"),
        "commit": _commit(),
        "records": measure(device, say=say) + extras(device, say=say),
    }
    if json_path is not None:
        with replacing(json_path, overwrite) as file:
            file.write((json.dumps(result, indent=1) + "\n").encode())
    return result
