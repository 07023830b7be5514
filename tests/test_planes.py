"""Small operations on planes: means that stay, blurs that are nearly Gaussian, parts as a flood would find them."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from airlight.planes import blur, box, box_radii, label, shrink, shrunk_size

SIZES = st.integers(1, 90)


@given(SIZES, SIZES, st.integers(1, 100), st.integers(0, 2**31), st.booleans())
def test_shrink_preserves_means(width: int, height: int, side: int, seed: int, colour: bool) -> None:
    """Every pixel counts by its area: the mean of all holds to float32, and none leaves the range."""
    plane = np.random.default_rng(seed).random((height, width, 3) if colour else (height, width))
    small = shrink(plane, side)
    assert small.shape[1::-1] == shrunk_size(width, height, side) and max(small.shape[:2]) <= max(side, 1) and small.dtype == np.float32
    np.testing.assert_allclose(small.mean(axis=(0, 1), dtype=float), plane.mean(axis=(0, 1)), atol=2e-7)
    assert plane.min() - 1e-6 <= small.min() and small.max() <= plane.max() + 1e-6


def test_shrink_against_areas() -> None:
    """Overlaps of areas, one by one."""
    plane = np.random.default_rng(3).random((17, 23))
    rows, columns = 7, 10
    expected = np.zeros((rows, columns))
    for r in range(rows):
        for c in range(columns):
            down, along = (
                np.clip(np.minimum(np.arange(n) + 1, (i + 1) * n / m) - np.maximum(np.arange(n), i * n / m), 0, None)
                for n, m, i in ((17, rows, r), (23, columns, c))
            )
            expected[r, c] = down @ plane @ along / (down.sum() * along.sum())
    assert shrunk_size(23, 17, 10) == (columns, rows)
    np.testing.assert_allclose(shrink(plane, 10), expected, atol=1e-6)


@pytest.mark.parametrize("bad", [math.nan, math.inf, 3e38])
def test_shrink_keeps_what_is_no_number_to_its_area(bad: float) -> None:
    """One pixel of each kind in 40 x 60: all but the areas that it touches are as without it."""
    plane = np.random.default_rng(0).random((40, 60)).astype(np.float32)
    spoilt = plane.copy()
    spoilt[17, 23] = bad
    off = np.nonzero(shrink(plane, 25) != shrink(spoilt, 25))
    assert 1 <= len(off[0]) <= 4 and all(np.ptp(axis) <= 1 for axis in off)


def test_shrink_leaves_what_is_small_enough() -> None:
    plane = np.random.default_rng(0).random((5, 8)).astype(np.float32)
    assert np.array_equal(shrink(plane, 8), plane) and np.array_equal(shrink(plane, 100), plane)
    assert shrunk_size(5000, 1, 400) == (400, 1)


@given(SIZES, SIZES, st.integers(0, 12), st.integers(0, 2**31))
def test_box_is_the_mean_over_a_square(width: int, height: int, radius: int, seed: int) -> None:
    plane = np.random.default_rng(seed).random((height, width))
    wide = np.pad(plane, radius, mode="edge")
    side = 2 * radius + 1
    y, x = seed % height, seed // 7 % width
    assert box(plane, radius)[y, x] == pytest.approx(wide[y : y + side, x : x + side].mean(), abs=1e-12)


@pytest.mark.parametrize("sigma", [0.3, 0.8, 1.5, 3.0, 3.05, 3.7, 4.0, 4.7, 8.0, 20.0])
def test_blur_is_close_to_a_gaussian(sigma: float) -> None:
    """Of a point, its sum and place kept; of a line within 10 % of the Gaussian's peak, of a point 19 %, the deviation 5 %: boxes have
    whole widths, and three of them are flatter. Up to 3 px, where the kernel is the Gaussian itself, 1 %."""
    size = 2 * math.ceil(5 * sigma) + 1
    point = np.zeros((size, size))
    point[size // 2, size // 2] = 1
    found = blur(point, sigma)
    at = np.arange(size) - size // 2
    exact = np.exp(-0.5 * (at / sigma) ** 2)
    exact /= exact.sum()
    few = sigma <= 3
    assert np.abs(found.sum(axis=0) - exact).max() <= (0.01 if few else 0.10) * exact.max()
    exact = exact[:, None] * exact
    assert np.abs(found - exact).max() <= (0.01 if few else 0.19) * exact.max()
    assert found.sum() == pytest.approx(1, abs=1e-9) and found.min() >= -1e-12
    np.testing.assert_allclose(found, found.T, atol=1e-12)
    np.testing.assert_allclose(found, found[::-1, ::-1], atol=1e-12)
    deviation = math.sqrt((found.sum(axis=0) * at**2).sum() / (exact.sum(axis=0) * at**2).sum())
    assert deviation == pytest.approx(1, abs=0.01 if few else 0.05)


def test_blur_keeps_what_is_even_and_what_is_sharp() -> None:
    even = np.full((9, 14), 0.37)
    for sigma in (0.1, 1.0, 7.0):
        np.testing.assert_allclose(blur(even, sigma), even, atol=1e-12)
    plane = np.random.default_rng(1).random((6, 7))
    assert np.array_equal(blur(plane, 0.1), plane)


def test_box_radii_have_the_variance_of_the_gaussian() -> None:
    """Three boxes' widths are odd, so their variances come in steps: half of one is missed at most, of 2 (sigma + 1) / 3 each."""
    for sigma in np.arange(1.0, 60, 0.37):
        variance = sum(((2 * r + 1) ** 2 - 1) / 12 for r in box_radii(sigma))
        assert abs(variance - sigma**2) <= (sigma + 1) / 3 + 1e-9


def flooded(mask: np.ndarray) -> np.ndarray:
    """The parts of a mask by flooding from pixel to pixel, over corners as well."""
    marks = np.zeros(mask.shape, int)
    number = 0
    for start in zip(*np.nonzero(mask), strict=True):
        if marks[start]:
            continue
        number += 1
        marks[start] = number
        waiting = [start]
        while waiting:
            y, x = waiting.pop()
            for j in range(max(y - 1, 0), min(y + 2, mask.shape[0])):
                for i in range(max(x - 1, 0), min(x + 2, mask.shape[1])):
                    if mask[j, i] and not marks[j, i]:
                        marks[j, i] = number
                        waiting.append((j, i))
    return marks


def same_parts(found: tuple[np.ndarray, int], expected: np.ndarray) -> bool:
    """Whether both name the same parts, whatever their numbers, from 1 to the count."""
    numbers, count = found
    pairs = set(zip(numbers.ravel().tolist(), expected.ravel().tolist(), strict=True))
    ones, others = ({pair[i] for pair in pairs} for i in (0, 1))
    return len(pairs) == len(ones) == len(others) and count == expected.max() and ones - {0} == set(range(1, count + 1))


@given(st.integers(1, 40), st.integers(1, 40), st.floats(0, 1), st.integers(0, 2**31))
def test_label_is_a_flood(width: int, height: int, share: float, seed: int) -> None:
    mask = np.random.default_rng(seed).random((height, width)) < share
    assert same_parts(label(mask), flooded(mask))


def test_label_of_spirals_and_combs() -> None:
    """Parts whose rows join late: a spiral, a comb open above, one open below, and a chess board, which hangs together over corners."""
    spiral = np.zeros((41, 41), bool)
    y = x = 20
    steps = [(0, 1), (1, 0), (0, -1), (-1, 0)]
    for leg in range(18):
        dy, dx = steps[leg % 4]
        for _ in range(2 * (leg // 2 + 1)):
            spiral[y, x] = True
            y, x = y + dy, x + dx
    comb = np.zeros((12, 30), bool)
    comb[:, ::2] = True
    below, above = comb.copy(), comb.copy()
    below[-1], above[0] = True, True
    for mask, count in ((spiral, 1), (comb, 15), (below, 1), (above, 1), (np.indices((9, 9)).sum(0) % 2 == 0, 1)):
        assert same_parts(label(mask), flooded(mask)) and label(mask)[1] == count
