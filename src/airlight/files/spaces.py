"""Linear RGB spaces of float pictures: named by an OpenColorIO config, or by chromaticities."""

import os
from collections.abc import Sequence
from typing import Any

import numpy as np

from airlight.errors import AirlightError
from airlight.files.colour import XYZ_TO_709
from airlight.messages import close

CONFIG = "ocio://studio-config-latest"  # where $OCIO names none
D65 = (0.3127, 0.3290)
# x, y of red, green, blue and white: what OpenEXR's attribute `chromaticities` says of these spaces.
CHROMATICITIES = (
    (0.6400, 0.3300, 0.3000, 0.6000, 0.1500, 0.0600, *D65),  # Rec. 709
    (0.7080, 0.2920, 0.1700, 0.7970, 0.1310, 0.0460, *D65),  # Rec. 2020
    (0.6800, 0.3200, 0.2650, 0.6900, 0.1500, 0.0600, *D65),  # P3-D65
    (0.6400, 0.3300, 0.2100, 0.7100, 0.1500, 0.0600, *D65),  # Adobe RGB
    (0.7130, 0.2930, 0.1650, 0.8300, 0.1280, 0.0440, 0.32168, 0.33767),  # ACEScg, AP1
    (0.7347, 0.2653, 0.0000, 1.0000, 0.0001, -0.0770, 0.32168, 0.33767),  # ACES2065-1, AP0
)
_BRADFORD = np.array([[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]])


def to_xyz(chromaticities: Sequence[float], white: np.ndarray) -> np.ndarray:
    """Derive (3, 3): linear RGB of chromaticities (x, y of red, green, blue, white) to XYZ that are relative to a white of XYZ (3,).

    White goes to white by the Bradford transform. Of CIE XYZ itself, whose primaries are the axes, the white that is
    written with them, (1/3, 1/3), is that of the axes: neutral is D65's XYZ, as programs keep pictures in it. Raises ValueError for
    numbers that span no colours.
    """
    points = np.asarray(chromaticities, np.float64).reshape(4, 2)
    columns = np.vstack([points[:3].T, 1 - points[:3].sum(axis=1)])  # y may be 0
    neutral = _white(*D65)
    if np.abs(columns - np.eye(3)).max() > 1e-4:
        with np.errstate(all="ignore"):
            neutral = _white(*points[3])
            try:
                columns = columns * np.linalg.solve(columns, neutral)
            except np.linalg.LinAlgError:
                columns = np.full((3, 3), np.nan)
    with np.errstate(all="ignore"):
        matrix = np.linalg.inv(_BRADFORD) @ np.diag(_BRADFORD @ white / (_BRADFORD @ neutral)) @ _BRADFORD @ columns
        if not (np.isfinite(matrix).all() and np.abs(matrix).max() < 100 and abs(np.linalg.det(matrix)) > 1e-4):
            raise ValueError("chromaticities that span no colours")
    return matrix


def _white(x: float, y: float) -> np.ndarray:
    return np.array([x, y, 1 - x - y]) / y


def to_rec709(chromaticities: Sequence[float]) -> np.ndarray | None:
    """Derive (3, 3): linear RGB of chromaticities to linear Rec. 709, as `to_xyz`; None where they are the same."""
    matrix = XYZ_TO_709 @ to_xyz(chromaticities, _white(*D65))
    return None if np.abs(matrix - np.eye(3)).max() < 5e-4 else matrix


def chromaticities_of(matrix: np.ndarray) -> tuple[float, ...]:
    """Derive chromaticities, white that of D65, of a linear RGB by its matrix (3, 3) to linear Rec. 709."""
    columns = np.linalg.inv(XYZ_TO_709) @ matrix
    return (*(float(v) for v in (columns[:2] / columns.sum(axis=0)).T.ravel()), *D65)


def is_same(one: np.ndarray | None, other: np.ndarray | None) -> bool:
    """Compare two matrices to Rec. 709, None for that itself, to within what rounded chromaticities differ by."""
    both = [np.eye(3) if matrix is None else matrix for matrix in (one, other)]
    return bool(np.abs(both[0] - both[1]).max() < 2e-3)


def by_name(name: str, own_config: bool = True) -> tuple[np.ndarray | None, tuple[float, ...] | None]:
    """Look up a linear space in $OCIO's config, else the built-in one: its matrix to linear Rec. 709 (None: it is that), and its
    chromaticities. own_config: False for the built-in one. Raises AirlightError for a name that is unknown or not linear."""
    import PyOpenColorIO as ocio

    own = os.environ.get("OCIO") if own_config else None
    try:
        config = ocio.Config.CreateFromEnv() if own else ocio.Config.CreateFromBuiltinConfig(CONFIG)
    except (ocio.Exception, ocio.ExceptionMissingFile) as error:
        raise AirlightError(f"the OpenColorIO config that $OCIO names cannot be used ({_short(error)}); correct or unset OCIO") from None
    space = config.getColorSpace(name)
    linear = [n for n in config.getColorSpaceNames() if config.isColorSpaceLinear(n, ocio.REFERENCE_SPACE_SCENE)]
    if space is None:
        names = {n.lower(): n for s in linear for n in (s, *config.getColorSpace(s).getAliases())}
        near = [names[n] for n in close(name, names, 3, 0.4)] or linear[:6]
        where = "$OCIO" if own else "OpenColorIO's studio config"
        raise AirlightError(f"colorspace {name!r} is not in {where}; the nearest: {', '.join(near)}")
    if space.getName() not in linear:
        raise AirlightError(f"colorspace {name!r} is not linear, and only linear light adds up; convert the picture first, to ACEScg say")
    try:
        processor = config.GetProcessorToBuiltinColorSpace(config, space.getName(), "lin_rec709_scene")
        rows = np.eye(3, dtype=np.float32).reshape(1, 3, 3)
        processor.getOptimizedCPUProcessor(ocio.OPTIMIZATION_LOSSLESS).applyRGB(rows)
    except ocio.Exception as error:
        raise AirlightError(f"colorspace {name!r} has no known relation to Rec. 709 ({_short(error)}); use another") from None
    matrix = rows[0].T.astype(np.float64)
    known = next((c for c in CHROMATICITIES if is_same(matrix, to_rec709(c))), None)
    return (None if np.abs(matrix - np.eye(3)).max() < 5e-4 else matrix), known or chromaticities_of(matrix)


def _short(error: Any) -> str:
    return " ".join(str(error).split())[:120].rstrip(". ")
