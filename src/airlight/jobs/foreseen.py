"""Tells how much is left of a picture or frame that is made alone."""

import contextlib
from collections.abc import Iterator

from airlight.progress import Work

# seconds, about, that follow the sum of light: of a picture, for each pixel; of a frame, for each sample, and each pixel that is written
PICTURE_S, MERGE_S, WRITE_S = 7e-8, 1e-7, 5e-7


@contextlib.contextmanager
def foreseen(told: Work, after: float, is_timed: bool) -> Iterator[None]:
    """Let the long passes that are submitted in a block tell how much is left, in seconds. after: of those, what follows them.

    is_timed: whether each pass is timed: one that is carried out in parts has no time of its own, and nothing is told.
    """
    from airlight.gpu.slices import watching

    with contextlib.nullcontext() if is_timed else watching(lambda share: told.foresee(share, after)):
        yield
