"""Pictures and planes for the looks, written once."""

from pathlib import Path

import numpy as np
import pytest
import thumbs
from look_commands import SHAPE, plane_of_subject

from airlight.files import write_image


@pytest.fixture(scope="session")
def shots(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Pictures, and planes beside them: near.png, black on the left; far.png, its inverse; subject.png, white in the middle."""
    folder = tmp_path_factory.mktemp("shots")
    for name in (thumbs.OPENING, thumbs.SUN, "dandelions", "night-light-frames"):
        write_image(folder / f"{name}.png", None, encoded=thumbs.codes(name))
    write_image(folder / "dark.png", None, encoded=np.full((*SHAPE, 3), 9, np.uint8))
    column = np.repeat((np.arange(SHAPE[1]) >= SHAPE[1] // 2)[None, :], SHAPE[0], axis=0)
    for name, plane in (("near", column), ("far", ~column), ("subject", plane_of_subject())):
        write_image(folder / f"{name}.png", None, encoded=np.repeat((255 * plane).astype(np.uint8)[..., None], 3, axis=2))
    return folder


@pytest.fixture
def photo(shots: Path) -> Path:
    return shots / f"{thumbs.OPENING}.png"
