"""The guide's program runs, and draws shafts."""

from typing import Any

import numpy as np
import pytest
from documented import drawn

pytest.importorskip("pygfx")


def test_the_guides_program(caplog: Any) -> None:
    assert np.abs(drawn("scenes.md", caplog)).mean() > 5
