"""Particles baked into a grid: their mass, where they lie, how wide they are; and the kernel that a sprite makes."""

import math
import re
import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

import airlight
from airlight.errors import AirlightError, AirlightWarning
from airlight.medium import particles as baking
from airlight.medium.particles import LEAST_CELLS, bake, particle_mass, radial_profile, spacing

pytestmark = pytest.mark.filterwarnings("error")
RANDOM = np.random.default_rng(18)
SETTINGS = settings(max_examples=25, deadline=None, derandomize=True)


def mass(grid: np.ndarray, matrix: np.ndarray) -> float:
    return float(grid.sum(dtype=np.float64) * matrix[0, 0] ** 3)


def centres(grid: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    """(Z, Y, X, 3) where the cells' centres are in the world."""
    z, y, x = np.indices(grid.shape)
    return np.stack([x, y, z], axis=-1) @ matrix[:3, :3].T + matrix[:3, 3]


def by_hand(grid: np.ndarray, matrix: np.ndarray, points: np.ndarray, radii: np.ndarray, masses: np.ndarray) -> np.ndarray:
    """Sum (1 - q^2)^2 at the centres of cells, each particle over all of them, divided by its own sum there; float64."""
    out, at = np.zeros(grid.shape), centres(grid, matrix)
    for point, radius, weight in zip(points, radii, masses, strict=True):
        reach = ((at - point) ** 2).sum(axis=-1) / max(radius, LEAST_CELLS * matrix[0, 0]) ** 2
        values = np.maximum(1 - reach, 0) ** 2
        out += values * weight / (values.sum() * matrix[0, 0] ** 3)
    return out


@SETTINGS
@given(st.integers(1, 40), st.sampled_from([16, 24, 40]), st.floats(-4, 0.5), st.integers(0, 99), st.booleans())
def test_they_are_what_a_sum_by_hand_makes(count: int, cells: int, size: float, seed: int, flat: bool) -> None:
    chance = np.random.default_rng(seed)
    points = chance.uniform(-3, 5, (count, 3)) * (1, 1, 0 if flat else 2) + (100, -7, 0)
    radii, weights = chance.uniform(0.3, 1, count) * 10.0**size, chance.uniform(0, 3, count)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AirlightWarning)
        grid, matrix, _ = bake(points, radii, weights, cells)
    masses = particle_mass(radii, weights)
    assert grid.dtype == np.float32 and grid.flags.c_contiguous and max(grid.shape) <= cells
    np.testing.assert_allclose(grid, by_hand(grid, matrix, points, radii, masses), rtol=1e-5, atol=1e-6 * grid.max())
    assert mass(grid, matrix) == pytest.approx(masses.sum(), rel=1e-6)
    inner = np.zeros(grid.shape, bool)
    inner[1:-1, 1:-1, 1:-1] = True
    assert not grid[~inner].any(), "no empty layer around"


def test_one_is_its_kernel() -> None:
    """A particle that is many cells wide has its own density, at its centre and beside it, and its closed mass."""
    grid, matrix, notes = bake([[3, 2, 1]], 0.5, 4.0, 128)
    q = np.linalg.norm(centres(grid, matrix) - (3, 2, 1), axis=-1) / 0.5
    np.testing.assert_allclose(grid, 4 * np.maximum(1 - q**2, 0) ** 2, atol=4e-3)
    assert mass(grid, matrix) == pytest.approx(32 * math.pi / 105 * 4 / 8, rel=1e-6) and not notes


def test_a_move_by_cells_moves_the_grid_alone() -> None:
    points, radii = RANDOM.uniform(0, 4, (200, 3)), RANDOM.uniform(0.05, 0.5, 200)
    grid, matrix, _ = bake(points, radii, 1.0, 64)
    for steps in ((5, 0, 0), (-3, 1000, 7)):
        moved, other, _ = bake(points + np.array(steps) * matrix[0, 0], radii, 1.0, 64)
        np.testing.assert_allclose(moved, grid, atol=1e-5 * grid.max())
        np.testing.assert_allclose(other[:3, 3] - matrix[:3, 3], np.array(steps) * matrix[0, 0], atol=1e-9)


def test_what_moves_does_not_stir_what_rests() -> None:
    """Cells lie on a lattice of the world, of a size that goes by rungs."""
    points = RANDOM.uniform(0, 4, (50, 3))
    grid, matrix, _ = bake(points, 0.3, 1.0, 64)
    points[0] = (-0.04, 2, 2)
    other, place, _ = bake(points, 0.3, 1.0, 64)
    assert place[0, 0] == matrix[0, 0]
    shift = np.rint((matrix[:3, 3] - place[:3, 3]) / matrix[0, 0]).astype(int)
    assert np.abs(shift).sum() < 4
    far = np.linalg.norm(centres(other, place) - points[0], axis=-1) > 0.31
    at = np.argwhere(far & (other > 0))
    before = at - shift[::-1]
    inside = ((before >= 0) & (before < grid.shape)).all(axis=1)
    now, then = other[tuple(at[inside].T)], grid[tuple(before[inside].T)]
    assert (now == then).mean() > 0.9  # but for where the one was before


@pytest.mark.parametrize("place", [0.0, 0.13, 0.37, 0.5])
@pytest.mark.parametrize("radius", [1e-6, 0.01, 0.099, 0.11, 0.3])
def test_small_ones_are_widened_and_keep_their_mass(radius: float, place: float) -> None:
    """Wherever they lie in a cell. Between two that hold the grid open."""
    points = np.array([[0, 0, 0], [6, 0, 0], [3 + place * 0.1, place * 0.1, place * 0.05]])
    grid, matrix, notes = bake(points, [0.5, 0.5, radius], [1e-30, 1e-30, 2], 64)
    assert mass(grid, matrix) == pytest.approx(32 * math.pi / 105 * 2 * radius**3, rel=1e-5)
    wide = max(radius, LEAST_CELLS * matrix[0, 0])
    held = centres(grid, matrix)[grid > 1e-20]
    assert np.linalg.norm(held - points[2], axis=1).max() < wide
    assert bool(notes) == (radius * 2 < wide)
    middle = (held * grid[grid > 1e-20][:, None]).sum(axis=0) / grid[grid > 1e-20].sum()
    np.testing.assert_allclose(middle, points[2], atol=0.12 * matrix[0, 0])


def test_they_add_up(monkeypatch: pytest.MonkeyPatch) -> None:
    """f(a) + f(b) = f(a and b), also where large kernels are sampled in fewer cells than there are."""
    chance = np.random.default_rng(3)
    points, radii = chance.uniform(0, 4, (60, 3)), chance.uniform(0.1, 2, 60)
    exact, _, _ = bake(points, radii, 1.0, 64)
    parts = [bake(points, radii, weights, 64)[0] for weights in (np.arange(60) % 2 + 1e-30, 1 - np.arange(60) % 2 + 1e-30)]
    np.testing.assert_allclose(parts[0] + parts[1], exact, rtol=1e-5, atol=1e-5)
    monkeypatch.setattr(baking, "WORK", 2e4)
    coarse, place, _ = bake(points, radii, 1.0, 64)
    assert mass(coarse, place) == pytest.approx(particle_mass(radii, np.ones(60)).sum(), rel=1e-6)
    expected = by_hand(coarse, place, points, radii, particle_mass(radii, np.ones(60)))
    assert not np.allclose(coarse, expected, rtol=1e-3)
    np.testing.assert_allclose(coarse, expected, atol=0.05 * expected.max())
    assert np.sqrt(((coarse - expected) ** 2).mean()) < 0.05 * expected.mean()


def test_the_longest_side_has_the_cells() -> None:
    points = RANDOM.uniform(0, 1, (500, 3)) * (8, 1, 2)
    for cells in (16, 64, 256, 512):
        grid, _, _ = bake(points, 0.05, 1.0, cells)
        assert 0.85 * cells - 2 <= grid.shape[2] <= cells
        assert 2 * grid.shape[1] < grid.shape[2]
    grid, _, _ = bake(RANDOM.uniform(0, 1, (500, 3)), 0.05, 1.0, 512)
    assert 0.8 * baking.MAX_CELLS < grid.size <= baking.MAX_CELLS


def test_a_few_that_have_strayed_are_left_out_with_a_line() -> None:
    points = RANDOM.normal(0, 1, (1000, 3))
    points[[3, 500]] = (9000, 0, 0), (0, 400, -80000)
    grid, matrix, (line,) = bake(points, 0.2, 1.0, 64)
    assert re.search("2 particles far from all others, up to x, y, z = 0, 400, -80000, with 0.002 of the mass, are left out", line)
    assert matrix[0, 0] < 0.3 and mass(grid, matrix) == pytest.approx(998 * particle_mass(0.2, 1.0), rel=1e-6)
    points[:30] += (500, 0, 0)  # too many to have strayed
    grid, matrix, notes = bake(points, 0.2, 1.0, 64)
    assert matrix[0, 0] > 7 and "radii of 0.2 m are drawn as" in notes[-1] and "raise particle_cells" in notes[-1]


def test_what_is_not_finite_is_left_out_and_what_is_negative_refused() -> None:
    points, radii, weights = RANDOM.random((10, 3)), np.full(10, 0.3), np.ones(10)
    radii[2], weights[4], points[7, 1] = np.nan, np.inf, np.nan
    with pytest.warns(AirlightWarning, match="smoke: 3 particles that are no finite numbers, the first number 2, are left out"):
        volume = airlight.particles(points, radii, weights, name="smoke")
    assert volume.mass == pytest.approx(7 * particle_mass(0.3, 1.0), rel=1e-6) and volume.edge == 0
    for wrong, line in (
        (dict(radius=-radii), "particle 0 has the radius -0.3; give 0 or more"),
        (dict(radius=0.1, density=np.arange(10) - 3.0), "particle 0 has the density -3"),
        (dict(radius=np.ones(9)), "its values of radius are not 10 numbers"),
        (dict(radius=1.0, density="thick"), "its values of density are not 10 numbers"),
        (dict(radius=np.nan), "none of its 10 particles is of finite numbers"),
        (dict(radius=1e10), "reaches farther than 1e.09 m; give a smaller scale"),
        (dict(radius=1.0, cells=5), "particle_cells = 5; give 16 to 512"),
        (dict(radius=1.0, density=1e20), r"has a density of 1e\+20"),
    ):
        with pytest.raises(AirlightError, match=line):
            airlight.particles(points, **wrong)
    for shape in ((10, 2), (30,), (2, 5, 3)):
        with pytest.raises(AirlightError, match=re.escape(f"positions have the shape {shape}; give (N, 3)")):
            airlight.particles(np.zeros(shape), 1.0)
    with pytest.raises(AirlightError, match="positions are no numbers"):
        airlight.particles([["a", "b", "c"]], 1.0)


@pytest.mark.parametrize("points, radius", [(np.zeros((0, 3)), 1.0), (np.zeros((0, 3)), None), (np.ones((4, 3)), 0.0)])
def test_none_are_an_empty_volume(points: np.ndarray, radius: float | None) -> None:
    with pytest.warns(AirlightWarning, match="has no particle with a radius and a density above 0"):
        volume = airlight.particles(points, radius, 1.0)
    assert volume.mass == 0 and np.isfinite(volume.bounds).all()


def test_extremes() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AirlightWarning)
        extremes = (([[0, 0, 0]], 1e-300), ([[1e9, 1e9, 1e9]], 1e-9), ([[-1e9, 0, 0], [1e9, 0, 0]], 1e-9), ([[5, 5, 5]] * 9, 1e9))
        for points, radius in extremes:
            volume = airlight.particles(points, radius, 1e12, cells=16)
            assert np.isfinite(volume.density).all() and volume.density.min() >= 0 and np.isfinite(volume.bounds).all()


def test_radii_that_are_not_given_follow_the_spacing() -> None:
    lattice = np.stack(np.meshgrid(*[np.arange(12)] * 3), axis=-1).reshape(-1, 3) * 0.25
    inside, flat = RANDOM.random((4000, 3)), RANDOM.random((900, 3)) * (1, 0, 1)
    for points, expected in ((lattice, 0.25), (inside, 1 / 4000 ** (1 / 3)), (flat, 1 / 30)):
        assert spacing(points) == pytest.approx(expected, rel=0.35)
        assert spacing(np.concatenate([points, points])) == pytest.approx(spacing(points), rel=1e-6)
    assert spacing(RANDOM.random((300_000, 3))) == pytest.approx(1 / 300_000 ** (1 / 3), rel=0.2)
    assert spacing(np.concatenate([lattice, [[1e300, np.nan, 0], [-1e300, 0, 0]]])) == pytest.approx(spacing(lattice), rel=1e-6)
    assert spacing(np.ones((5, 3))) == 1.0 == spacing(np.zeros((0, 3)))
    with pytest.warns(AirlightWarning, match=r"smoke: has no radius: 0\.\d+ m, twice the mean spacing; no density: 0\.13, by which"):
        volume = airlight.particles(lattice, name="smoke", cells=64)
    inside = volume.density[tuple(slice(n // 3, -n // 3) for n in volume.density.shape)]
    assert inside.mean() == pytest.approx(1, rel=0.6)
    with pytest.warns(AirlightWarning, match=r"twice the mean spacing$"):
        assert airlight.particles(lattice, density=1.0, cells=64).mass > volume.mass


def test_a_sprite_is_a_kernel_of_its_rings() -> None:
    y, x = np.mgrid[:64, :48]
    q = np.hypot((2 * y + 1) / 64 - 1, (2 * x + 1) / 48 - 1)
    np.testing.assert_allclose(radial_profile(np.where(q < 1, (1 - q**2) ** 2, 0.7)), (1 - np.linspace(0, 1, 33) ** 2) ** 2, atol=0.02)
    np.testing.assert_allclose(radial_profile(q < 0.5), np.linspace(0, 1, 33) < 0.5, atol=0.7)
    with pytest.raises(AirlightError, match="shows nothing"):
        radial_profile(q > 1.1)
    points, radii = RANDOM.uniform(0, 3, (20, 3)), RANDOM.uniform(0.01, 0.6, 20)
    plain = airlight.particles(points, radii, 2.0, cells=64)
    for sprite in (q < 0.6, (q > 0.8) & (q < 0.9)):
        volume = airlight.particles(points, radii, 2.0, cells=64, sprite=np.uint8(255) * sprite)
        assert volume.mass == pytest.approx(plain.mass, rel=1e-6)
        assert np.abs(volume.density - plain.density).max() > 0.1
    ball = airlight.particles([[0, 0, 0]], 1.0, 1.0, cells=64, sprite=np.ones((9, 9)))
    assert ball.density.max() == pytest.approx(32 / 105 / (4 / 3), rel=0.02)  # the same mass, evenly


def test_a_sprite_file(tmp_path) -> None:
    y, x = np.mgrid[:32, :32]
    q = np.hypot((2 * y + 1) / 32 - 1, (2 * x + 1) / 32 - 1)
    pixels = np.zeros((32, 32, 4), np.uint8)
    pixels[..., 3] = 255 * np.clip(1 - q, 0, 1)
    Image.fromarray(pixels).save(tmp_path / "puff.png")
    Image.fromarray(pixels[..., 3]).save(tmp_path / "grey.png")
    by_alpha, by_luminance, by_array = (
        airlight.particles([[0, 0, 0]], 1.0, 1.0, sprite=one) for one in (str(tmp_path / "puff.png"), tmp_path / "grey.png", pixels)
    )
    np.testing.assert_allclose(by_alpha.density, by_luminance.density, atol=1e-6)
    np.testing.assert_array_equal(by_alpha.density, by_array.density)
    Image.fromarray(np.zeros((4, 4), np.uint8)).save(tmp_path / "black.png")
    with pytest.raises(AirlightError, match=r"black\.png: shows nothing: its alpha, or its luminance"):
        airlight.particles([[0, 0, 0]], 1.0, 1.0, sprite=tmp_path / "black.png")
    with pytest.raises(AirlightError, match=r"puf\.png.*did you mean"):
        airlight.particles([[0, 0, 0]], 1.0, 1.0, sprite=str(tmp_path / "puf.png"))
    with pytest.raises(AirlightError, match="a sprite is"):
        airlight.particles([[0, 0, 0]], 1.0, 1.0, sprite=np.zeros((2, 2, 7)))
