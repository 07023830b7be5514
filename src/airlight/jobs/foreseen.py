"""Tells how much is left of a picture or frame that is made alone."""

import contextlib
from collections.abc import Iterator

from airlight.progress import Work

# seconds, about, that follow the sum of light: of a picture, for each pixel; of a frame, for each sample, and each pixel that is written
PICTURE_S, MERGE_S, WRITE_S = 7e-8, 1e-7, 5e-7
SOURCE_S = 3e-8  # the same of a frame's source, and its sum along lines, for each sample
QUICK_SAMPLES = 2**22  # of a frame that is summed along lines: they take less than a second, and nothing is told


@contextlib.contextmanager
def foreseen(told: Work, after: float, is_whole: bool, drawing: bool = False) -> Iterator[None]:
    """Let the long passes that are submitted in a block tell how much is left, in seconds. after: of those, what follows them.

    drawing: whether that of a scene is told too: where what follows it is short, or tells for itself how long it is. is_whole: whether
    each pass is carried out in one, and nothing is told: where it is timed, as parts have no time of their own, or quick.
    """
    from airlight.gpu.slices import watching

    with contextlib.nullcontext() if is_whole else watching(lambda share: told.foresee(share, after), drawing):
        yield
