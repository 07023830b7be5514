"""A server for each test that asks for one."""

import pytest
from browser_server import live


@pytest.fixture
def view():
    """A server of its own for each test: rendercanvas has one in a process."""
    with live() as made:
        yield made
