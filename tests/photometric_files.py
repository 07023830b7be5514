"""Photometric files made by hand: IES LM-63 of every type and symmetry, and EULUMDAT."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

DATA = Path(__file__).parent / "data" / "photometry"
SHIPPED = sorted(DATA.glob("*.ies"))
CODES = {"C": 1, "B": 2, "A": 3}

FORMS: dict[str, tuple[str, Sequence[float], Sequence[float]]] = {  # kind, vertical, horizontal angles
    "axial": ("C", np.arange(0, 181, 7.5), [0]),
    "axial-down": ("C", [0, 2, 7, 20, 45, 90], [0]),
    "quadrant": ("C", np.arange(0, 181, 10), [0, 22.5, 45, 67.5, 90]),
    "half": ("C", np.arange(0, 181, 5), np.arange(0, 181, 30)),
    "whole": ("C", np.arange(0, 181, 12), np.arange(0, 361, 15)),
    "up-light": ("C", np.arange(90, 181, 15), np.arange(0, 361, 45)),
    "a-half": ("A", np.arange(-90, 91, 10), np.arange(0, 91, 10)),
    "a-whole": ("A", np.arange(-90, 91, 15), np.arange(-90, 91, 7.5)),
    "b-half": ("B", np.arange(-90, 91, 10), np.arange(0, 91, 15)),
    "b-whole": ("B", np.arange(-90, 91, 15), np.arange(-90, 91, 10)),
    "b-quadrant": ("B", np.arange(0, 91, 15), np.arange(0, 91, 10)),
}


def values(vertical: Sequence[float], horizontal: Sequence[float], seed: int = 1) -> np.ndarray:
    """(H, V) candela by chance, the same in all planes at the poles of type C, whole at 0 and at 360 degrees."""
    found = np.random.default_rng(seed).uniform(10, 900, (len(horizontal), len(vertical))).round(1)
    for pole in (0, 180):
        found[:, np.asarray(vertical) == pole] = 777.0
    if horizontal[-1] - horizontal[0] == 360:
        found[-1] = found[0]
    return found


def ies(
    kind: str,
    vertical: Sequence[float],
    horizontal: Sequence[float],
    candela: np.ndarray,
    *,
    version: str = "IESNA:LM-63-2002\n[TEST] made\n",
    tilt: str = "TILT=NONE",
    factors: tuple[float, float, float] = (1, 1, 1),
    lumens: float = -1,
    ends: str = "\r\n",
    comma: bool = False,
    wide: int = 10,
) -> bytes:
    """Write a file. factors: multiplier, ballast factor, and what stands behind it. wide: numbers a line."""
    head = [1, lumens, factors[0], len(vertical), len(horizontal), CODES[kind], 2, 0, 0, 0, *factors[1:], 40]
    numbers = [f"{value:g}" for part in (head, vertical, horizontal, np.ravel(candela)) for value in part]
    lines = [(", " if comma else " ").join(numbers[i : i + wide]) for i in range(0, len(numbers), wide)]
    return ends.join([*version.split("\n")[:-1], tilt, *lines, ""]).encode("latin-1")


def form(name: str, **more: object) -> bytes:
    kind, vertical, horizontal = FORMS[name]
    return ies(kind, vertical, horizontal, values(vertical, horizontal), **more)


def ldt(symmetry: int, candela: np.ndarray, flux: float = 2000.0, conversion: float = 1.0, comma: bool = False, step: float = 30) -> bytes:
    """Write EULUMDAT of planes every `step` degrees. candela: (stored planes, angles from 0 to 180 degrees) per 1000 lumens."""
    planes, rows = round(360 / step), candela.shape[1]
    head = ["Maker", 1, symmetry, planes, step, rows, 180 / (rows - 1), "report", "name", "1", "file.ldt", "today", *[100] * 9, 50, 80]
    lines = [*head, conversion, 0, 1, 1, "LED", flux, "warm", "80", 20, *[0.5] * 10]
    lines += [*np.arange(planes) * step, *np.linspace(0, 180, rows), *np.ravel(candela)]
    written = [f"{line:g}" if not isinstance(line, str) else line for line in lines]
    return "\r\n".join(line.replace(".", ",") if comma and line != "file.ldt" else line for line in [*written, ""]).encode("latin-1")


STORED = {0: 12, 1: 1, 2: 7, 3: 7, 4: 4}  # planes of 30 degrees


def seeds() -> list[bytes]:
    made = [form(name, **({"comma": True, "ends": "\n"} if i % 2 else {})) for i, name in enumerate(FORMS)]
    tilted = form("axial", tilt="TILT=INCLUDE\r\n1\r\n3\r\n0 90 180\r\n1 0.9 0.8", version="Some lamp\n")
    made += [tilted, form("quadrant", tilt="TILT=lamp.tlt", wide=1, version="IESNA91\n"), form("half", factors=(2, 0.5, 1.5))]
    made += [ldt(symmetry, values(np.linspace(0, 180, 13), range(count))) for symmetry, count in STORED.items()]
    return made + [path.read_bytes() for path in SHIPPED]
