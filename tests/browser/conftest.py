"""A server for each test that asks for one."""

import os
import shutil

import pytest
from browser_server import live


@pytest.fixture
def view():
    """A server of its own for each test: rendercanvas has one in a process."""
    with live() as made:
        yield made


@pytest.fixture(scope="module")
def chromium():
    path = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if path is None:
        assert os.environ.get("CI") != "true", "no chromium: scripts/ensure_chromium.sh installs it"
        pytest.skip("no chromium")
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        started = playwright.chromium.launch(executable_path=path, args=["--no-sandbox"])
        yield started
        started.close()
