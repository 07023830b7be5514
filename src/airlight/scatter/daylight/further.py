"""Keeps tables of light scattered before on the device, for the suns that view rays meet, and solves coming suns in the background."""

import math
import threading
from typing import Any

import numpy as np

from airlight.daylight.atmosphere import Atmosphere
from airlight.daylight.coefficients import Coefficients
from airlight.daylight.multiple import KINDS, LEAST, SUNS, kept, reach
from airlight.gpu.device import Device
from airlight.reference.daylight import ORDERS_SIZE
from airlight.reference.daylight_view import sun_position

SLOTS = 12  # of suns that are held at a time
CELL = (*ORDERS_SIZE, 2, 4)  # float32 of one sun
AHEAD = 3  # suns that are solved beyond those that a moving sun needs


def needed(sun: float) -> tuple[int, int]:
    """Give the first and the last of the suns that are solved which rays meet from an eye that has the sun at an elevation, degrees."""
    ends = np.clip([sun - float(reach(sun)), sun + float(reach(sun))], SUNS[0], SUNS[-1])
    return math.floor(sun_position(ends[0])), math.ceil(sun_position(ends[1]))


def numbers_of(air: Atmosphere) -> tuple[Any, ...]:
    """Give what tells airs apart: all that an air consists of, to compare."""
    return air.multiple, *(np.asarray(one, float).tobytes() for one in air.coefficients)


def logarithms(air: Coefficients, multiple: str, first: int, last: int) -> np.ndarray:
    """Give (suns, *CELL) float32 logarithms of light scattered before, of a kind of KINDS, for SUNS[first] to SUNS[last]."""
    out = np.full((last + 1 - first, *CELL), math.log(LEAST), np.float32)
    if (kind := KINDS[multiple]) is not None:
        out[..., : len(air.nm)] = kept(kind, air).logarithms(first, last)
    return out


class Further:
    """Holds tables of light scattered before, of one air by its kind of multiple scattering, in a buffer of SLOTS suns.

    solving: the thread that solves suns in the background, or has done so; None before.
    """

    def __init__(self, device: Device) -> None:
        self.device = device
        self.buffer = device.buffer(size=4 * SLOTS * math.prod(CELL))
        self._held = [-1] * SLOTS  # suns
        self._air: tuple[Any, ...] = ()
        self._sun: float | None = None
        self.solving: threading.Thread | None = None

    def update(self, air: Atmosphere, sun: float) -> None:
        """Write what a sun at an elevation, degrees, needs. Waits for what is not solved; of a sun that moves, solves what comes next."""
        first, last = needed(sun)
        if self._air != (own := numbers_of(air)):
            self._air, self._held, self._sun = own, [-1] * SLOTS, None
        new = [i for i in range(first, last + 1) if self._held[i % SLOTS] != i]
        if new:
            tables = logarithms(air.coefficients, air.multiple, new[0], new[-1])
            for i in new:
                self.device.queue.write_buffer(self.buffer, (i % SLOTS) * 4 * math.prod(CELL), tables[i - new[0]].tobytes())
                self._held[i % SLOTS] = i
        if self._sun is not None and sun != self._sun:
            if sun > self._sun:
                self._look_ahead(air, range(last + 1, min(last + 1 + AHEAD, len(SUNS))))
            else:
                self._look_ahead(air, range(first - 1, max(first - 1 - AHEAD, -1), -1))
        self._sun = sun

    def _look_ahead(self, air: Atmosphere, suns: range) -> None:
        """Solve suns in the background, unless others are being solved."""
        kind = KINDS[air.multiple]
        if kind is None or not suns or (self.solving is not None and self.solving.is_alive()):
            return

        def solve() -> None:
            for i in suns:
                kept(kind, air.coefficients).logarithms(i, i)

        self.solving = threading.Thread(target=solve, name="daylight", daemon=True)
        self.solving.start()
