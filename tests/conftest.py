"""Settings of every test."""

import contextlib
import logging
import os
import signal
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from hypothesis import settings

if TYPE_CHECKING:
    from pass_stage import PassStage

settings.register_profile("airlight", derandomize=True, deadline=None, max_examples=30)
settings.load_profile("airlight")

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # so a shell starts what runs in its background; tests send it
    signal.signal(signal.SIGINT, signal.default_int_handler)

if not os.environ.get("XDG_RUNTIME_DIR"):  # or the graphics libraries complain on stderr
    os.environ["XDG_RUNTIME_DIR"] = tempfile.mkdtemp(prefix="airlight-tests-")


SLOW_TOO = frozenset(Path(__file__).with_name("slow_too.txt").read_text().split("\n"))  # of which others of the same test stay quick


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark as slow what slow_too.txt names: tests' long values, and tests of which `make validate` is early enough."""
    for item in items:
        if item.nodeid in SLOW_TOO:
            item.add_marker(pytest.mark.slow)


@pytest.fixture(scope="session", autouse=True)
def default_device() -> None:
    """wgpu's default device, which pygfx uses, tells times in whichever order the tests run."""
    from airlight.errors import MachineError
    from airlight.gpu.device import shared_device

    with contextlib.suppress(MachineError):
        shared_device()


@pytest.fixture(scope="module")
def kept_stage(request: pytest.FixtureRequest) -> "PassStage":
    """Make a module's own Stage, whose renderer all of its tests share."""
    made: PassStage = request.module.Stage()
    return made


@pytest.fixture
def stage(kept_stage: "PassStage", caplog: pytest.LogCaptureFixture) -> Iterator["PassStage"]:
    """Give a module's Stage as it is at first; errors in a frame are logged, not raised, and fail the test."""
    kept_stage.reset()
    yield kept_stage
    assert not [record for record in caplog.records if record.levelno >= logging.ERROR]
