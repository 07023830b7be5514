"""Who is told of each temporary file before it is made, so that it goes even if this process is killed."""

from collections.abc import Callable


def _nobody(path: str) -> None:
    pass


announce: Callable[[str], None] = _nobody
