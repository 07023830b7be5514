"""Take numbers off the text of a photometric file, one after the other."""

import itertools
import math
import re
from collections.abc import Iterator, Sequence

from airlight.errors import AirlightError

NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")


def next_pieces(pieces: Iterator[str], count: int, word: str, path: str) -> list[str]:
    """Take so many pieces of a file; word: among what they are. Raises AirlightError where it ends before."""
    found = list(itertools.islice(pieces, count))
    if len(found) < count:
        raise AirlightError(f"{path}: is cut off: it ends among {word}; copy or export it again")
    return found


def as_numbers(pieces: Sequence[str], word: str, path: str) -> list[float]:
    """Read pieces as finite numbers; word: what they are. Raises AirlightError."""
    wrong = next((piece for piece in pieces if not NUMBER.fullmatch(piece)), None)
    if wrong is not None:
        raise AirlightError(f"{path}: {wrong[:30]!r} stands among its {word}, which are numbers; correct it, or export it again")
    found = [float(piece) for piece in pieces]
    if not all(map(math.isfinite, found)):
        raise AirlightError(f"{path}: a number of its {word} is too large; correct it, or export it again")
    return found
