"""One frame of a stage as pygfx hands it to an effect pass, to be carried out again and timed."""

from typing import Any

import numpy as np

from airlight.gpu.device import Device
from airlight.gpu.timing import run_ms


class Again:
    """The pass of a studio's frame. Its settings may be changed in between: what it draws on stays."""

    def __init__(self, studio: Any, time: float = 0.0, turn: float = 0.0) -> None:
        self.studio, self.shafts = studio, studio.shafts
        self.device: Device = self.shafts.device
        self.seen: dict[str, Any] = {}
        inner = self.shafts.render

        def render(command_encoder: Any, color_tex: Any, depth_tex: Any, target_tex: Any) -> None:
            self.seen.update(color_tex=color_tex, depth_tex=depth_tex, target_tex=target_tex)
            inner(command_encoder, color_tex, depth_tex, target_tex)

        self.shafts.render = render
        self.frame = studio.frame(time, turn)
        self.shafts.render = inner

    def record(self, encoder: Any) -> None:
        self.shafts.render(encoder, **self.seen)

    def once(self) -> tuple[float, dict[str, float]]:
        """Wall ms of the whole pass, and ms of each of its parts by label; {} where the device has no timestamps."""
        self.shafts.timing = True
        wall = run_ms(self.device, self.record)
        spent: dict[str, float] = {}
        for label, ms in self.shafts.profile():
            spent[label] = spent.get(label, 0.0) + ms
        self.shafts.timing = False
        return wall, spent

    def per_pass(self, runs: int) -> dict[str, float]:
        """Median ms of each part by its label."""
        times: dict[str, list[float]] = {}
        for _ in range(runs):
            for label, ms in self.once()[1].items():
                times.setdefault(label, []).append(ms)
        return {label: float(np.median(own)) for label, own in times.items()}
