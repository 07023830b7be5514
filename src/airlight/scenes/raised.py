"""Raises what pygfx and wgpu only log."""

import contextlib
import logging
from collections.abc import Iterator

from airlight.errors import MachineError


class _Errors(logging.Handler):
    def __init__(self) -> None:
        super().__init__(logging.ERROR)
        self.found: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        self.found.append(record.getMessage() + (f": {record.exc_info[1]}" if record.exc_info else ""))


@contextlib.contextmanager
def raised() -> Iterator[None]:
    """Raises what pygfx and wgpu only log, as a broken shader, as a MachineError."""
    errors = _Errors()
    loggers = [logging.getLogger(name) for name in ("pygfx", "wgpu")]
    for logger in loggers:
        logger.addHandler(errors)
    try:
        yield
    finally:
        for logger in loggers:
            logger.removeHandler(errors)
    if errors.found:
        raise MachineError(f"the scene could not be drawn ({' '.join(errors.found[0].split())[:200]}); try another --device")
