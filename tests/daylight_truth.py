"""Reads the truth tables of tests/data/daylight."""

import csv
from functools import cache
from pathlib import Path

import numpy as np

FOLDER = Path(__file__).parent / "data" / "daylight"
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


@cache
def rows(name: str) -> list[dict[str, str]]:
    with open(FOLDER / f"{name}.csv", encoding="utf-8") as file:
        return list(csv.DictReader(line for line in file if not line.startswith("#")))


def of_kind(*kinds: str) -> list[dict[str, str]]:
    """Rows of truth.csv."""
    return [row for row in rows("truth") if row["kind"] in kinds]


def column(table: list[dict[str, str]], name: str) -> np.ndarray:
    return np.array([float(row[name] or "inf") for row in table])


def colours(table: list[dict[str, str]], name: str, channels: str = "rgb") -> np.ndarray:
    """(rows, 3)."""
    return np.stack([column(table, f"{name}{channel}") for channel in channels], axis=-1)


def shadows(table: list[dict[str, str]]) -> list[tuple[np.ndarray, np.ndarray]]:
    """One stretch a row, by the remark `dark 200 to 600 m`; none is empty."""
    words = [row["remark"].split() or ["dark", "0", "to", "0"] for row in table]
    return [(np.array([float(word[1]) for word in words]), np.array([float(word[3]) for word in words]))]


def error(found: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """Relative error; below 1 % of the row's largest channel, of that."""
    least = 0.01 * truth.max(axis=-1, keepdims=True)
    return np.abs(found - truth) / np.maximum(np.maximum(truth, least), 1e-30)
