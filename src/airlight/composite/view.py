"""Finds view transforms by name, and samples those of OpenColorIO into tables for the GPU."""

import functools
import os
from typing import Any

import numpy as np
import numpy.typing as npt

from airlight.errors import AirlightError
from airlight.messages import nearest

VIEWS = {"none": 0, "filmic": 1, "agx": 2}  # numbered as in scene_merge.wgsl
TABLE = 3  # likewise: any other
SIDE = 65  # of a table
NEAR, FAR = 2.0**-10, 1024.0  # radiance: up to the first a table is linear, up to the second it reaches
CONFIG = "ocio://studio-config-latest"  # where $OCIO names none


def number(name: str) -> int:
    """Give the number of a view transform in scene_merge.wgsl."""
    return VIEWS.get(name.lower(), TABLE)


def check(name: str) -> None:
    """Raise AirlightError for what is no view transform."""
    if number(name) == TABLE:
        view(name)


def view(name: str) -> Any:
    """Find OpenColorIO's CPU processor from linear Rec. 709 light to the codes of the sRGB display, for a view of $OCIO's config, else of
    the built-in one, by its name or a part of it that no other has. Raises AirlightError."""
    return _view(name, os.environ.get("OCIO"))


def table(name: str) -> npt.NDArray[np.float16]:
    """Sample a view over `view_coordinate` of tone.wgsl: (SIDE, SIDE, SIDE, 4) codes 0..1, along blue, green, red. Raises AirlightError."""
    return _table(name, os.environ.get("OCIO"))


@functools.lru_cache(maxsize=4)
def _table(name: str, own: str | None) -> npt.NDArray[np.float16]:
    low, high = np.log2(NEAR), np.log2(FAR + NEAR)
    nodes = 2.0 ** (low + (high - low) * np.linspace(0, 1, SIDE)) - NEAR
    blue, green, red = np.meshgrid(nodes, nodes, nodes, indexing="ij")
    colors = np.stack([red, green, blue], axis=-1).astype(np.float32).reshape(1, -1, 3)
    _view(name, own).applyRGB(colors)
    codes = np.ones((SIDE, SIDE, SIDE, 4), np.float16)
    codes[..., :3] = np.clip(np.nan_to_num(colors), 0, 1).reshape(SIDE, SIDE, SIDE, 3)
    return codes


@functools.lru_cache(maxsize=4)
def _view(name: str, own: str | None) -> Any:
    import PyOpenColorIO as ocio

    try:
        config = ocio.Config.CreateFromEnv() if own else ocio.Config.CreateFromBuiltinConfig(CONFIG)
    except (ocio.Exception, ocio.ExceptionMissingFile) as error:
        raise AirlightError(f"the OpenColorIO config that $OCIO names cannot be used ({_short(error)}); correct or unset OCIO") from None
    displays = list(config.getDisplays())
    display = next((one for one in displays if "srgb" in one.lower()), None)
    if display is None:
        raise AirlightError(f"the OpenColorIO config of $OCIO has no display for sRGB, only {', '.join(displays[:6])}; unset OCIO")
    views = list(config.getViews(display))
    found = [one for one in views if one.lower() == name.lower()] or [one for one in views if name.lower() in one.lower()]
    if len(found) != 1:
        wrong = "may be one of several views" if found else "is no view transform"
        known = ", ".join([*VIEWS, *(repr(one) for one in found or views)])
        wrong += nearest(name, () if found else [*VIEWS, *views])
        raise AirlightError(f"--view-transform {name!r} {wrong}; there is {known} (OpenColorIO, {display})")
    try:
        into = ocio.Config.GetProcessorFromBuiltinColorSpace("lin_rec709_scene", config, _scene_space(ocio, config))
        out = config.getProcessor(_scene_space(ocio, config), display, found[0], ocio.TRANSFORM_DIR_FORWARD)
        both = ocio.GroupTransform([into.createGroupTransform(), out.createGroupTransform()])
        return config.getProcessor(both).getDefaultCPUProcessor()
    except ocio.Exception as error:
        raise AirlightError(f"--view-transform {name!r} has no known relation to Rec. 709 ({_short(error)}); use another") from None


def _scene_space(ocio: Any, config: Any) -> str:
    """Name a linear space of the config: its role scene_linear, else its first that is linear."""
    if config.hasRole("scene_linear"):
        return str(config.getColorSpace("scene_linear").getName())
    for name in config.getColorSpaceNames():
        if config.isColorSpaceLinear(name, ocio.REFERENCE_SPACE_SCENE):
            return str(name)
    raise AirlightError("the OpenColorIO config of $OCIO has no linear space; unset OCIO")


def _short(error: Any) -> str:
    return " ".join(str(error).split())[:120].rstrip(". ")
