"""The small stage instead of any other scene."""

import pytest
from render_stage import kept_renderer, stage

from airlight import scenes
from airlight.scenes import offline


@pytest.fixture(autouse=True)
def staged(monkeypatch):
    """The small stage instead of any other, and one renderer for each size: each one dropped leaks."""
    monkeypatch.setattr(scenes, "open_scene", stage)
    monkeypatch.setattr(offline, "make_renderer", kept_renderer)
