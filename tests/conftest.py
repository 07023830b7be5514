"""Settings of every test."""

import contextlib
import os
import signal
import tempfile

import pytest
from hypothesis import settings

settings.register_profile("airlight", derandomize=True, deadline=None, max_examples=30)
settings.load_profile("airlight")

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # so a shell starts what runs in its background; tests send it
    signal.signal(signal.SIGINT, signal.default_int_handler)

if not os.environ.get("XDG_RUNTIME_DIR"):  # or the graphics libraries complain on stderr
    os.environ["XDG_RUNTIME_DIR"] = tempfile.mkdtemp(prefix="airlight-tests-")


@pytest.fixture(scope="session", autouse=True)
def default_device() -> None:
    """wgpu's default device, which pygfx uses, tells times in whichever order the tests run."""
    from airlight.errors import MachineError
    from airlight.gpu.device import shared_device

    with contextlib.suppress(MachineError):
        shared_device()
