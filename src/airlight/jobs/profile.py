"""Shows where the time of a run went: wall time of each step, and of each pass on the GPU."""

import sys
import time
from collections.abc import Sequence


class Spent:
    """Counts wall time by step, summed over the pictures. passes: (label, ms) of those on the GPU, of all pictures."""

    def __init__(self) -> None:
        self.begun = time.perf_counter()
        self.steps: dict[str, float] = {}
        self.passes: list[tuple[str, float]] = []

    def add(self, name: str, begun: float) -> float:
        """Count the time since `begun`; returns now."""
        now = time.perf_counter()
        self.steps[name] = self.steps.get(name, 0.0) + (now - begun) * 1e3
        return now


def lines(spent: Spent, steps: Sequence[str], on_gpu: str, frames: int = 1) -> list[str]:
    """Write the table: ms of each step and its share of all, under `on_gpu` those of the GPU's passes, and the sum; means of frames."""
    by_label: dict[str, float] = {}
    for label, ms in spent.passes:
        by_label[label] = by_label.get(label, 0.0) + ms
    whole = sum(spent.steps.get(name, 0.0) for name in steps) or 1.0
    each = "" if frames < 2 else f" {'ms a frame':>12}"

    def row(name: str, ms: float) -> str:
        return f"{name:26} {ms:10.2f} ms {100 * ms / whole:5.1f} %" + (f" {ms / frames:12.2f}" if frames > 1 else "")

    found = [f"{'step, and pass on the GPU':26} {'sum':>13} {'share':>7}{each}"]
    for name in steps:
        found.append(row(name, spent.steps.get(name, 0.0)))
        if name == on_gpu:
            found += [row(f"  {label}", ms) for label, ms in by_label.items()]
    return [*found, row("sum", whole)]


def show(spent: Spent, steps: Sequence[str], on_gpu: str, frames: int = 1) -> None:
    """Print the table on stderr."""
    print("\n".join(lines(spent, steps, on_gpu, frames)), file=sys.stderr)
