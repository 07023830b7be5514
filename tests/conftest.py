"""Settings of every test."""

import os
import tempfile

from hypothesis import settings

settings.register_profile("airlight", derandomize=True, deadline=None, max_examples=30)
settings.load_profile("airlight")

if not os.environ.get("XDG_RUNTIME_DIR"):  # or the graphics libraries complain on stderr
    os.environ["XDG_RUNTIME_DIR"] = tempfile.mkdtemp(prefix="airlight-tests-")
