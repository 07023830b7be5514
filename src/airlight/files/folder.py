"""A folder's pictures, in the order in which people count."""

import os
import re
from collections.abc import Sequence

from airlight.errors import AirlightError
from airlight.files.decode import format_of
from airlight.files.extras import RAW
from airlight.files.sequence import Numbered
from airlight.messages import counted
from airlight.options.storage import OUTPUTS

_READ = ".bmp .dib .gif .heic .heif .hif .cin .jpe .jfif .jp2 .j2k .j2c .pbm .pgm .ppm .pnm .pfm"
ENDINGS = {*OUTPUTS, *RAW.split(), *_READ.split()}  # of pictures' names
FEWEST_FRAMES = 3  # whose numbers follow each other, to be taken for a clip's
_FRAME = re.compile(r"(.*?)(\d+)(\.\w+)")


def natural(name: str) -> list[tuple[int, int, str]]:
    """Make the key by which names are put in order, numbers in them by their value: a2 before a10."""
    return [(1, int(part), "") if part.isdecimal() else (0, 0, part.lower()) for part in re.split(r"(\d+)", name)]


def _is_picture(path: str) -> bool:
    try:
        return bool(format_of(path))
    except AirlightError:
        return os.path.splitext(path)[1].lower() in ENDINGS


def pictures_in(folder: str) -> tuple[list[str], int, int]:
    """List a folder's pictures; count what else is there, files and folders. Hidden files are not looked at.

    A picture is told by its first bytes; where these cannot be read, or say nothing, by its name: then it fails by itself, and is named.

    Raises AirlightError where the folder cannot be read, or holds none.
    """
    found, files, folders = [], 0, 0
    try:
        names = sorted((name for name in os.listdir(folder) if not name.startswith(".")), key=natural)
    except OSError as error:
        raise AirlightError(f"{folder}: cannot be read ({error.strerror}); check the permissions of the folder") from None
    for path in (os.path.join(folder, name) for name in names):
        if os.path.isdir(path):
            folders += 1
        elif _is_picture(path):
            found.append(path)
        else:
            files += 1
    if not found:
        there = ", but " + counted(files, "other file") if files else ", but " + counted(folders, "folder") if folders else ": it is empty"
        cure = "" if files or not folders else ": give it instead" if folders == 1 else ": give one of them"
        raise AirlightError(f"{folder}: holds no pictures{there}{cure}")
    return found, files, folders


def clip_of(paths: Sequence[str]) -> Numbered | None:
    """Find the pattern of a folder's pictures, if they may be one clip: their names differ in numbers alone, which follow each other."""
    found = [_FRAME.fullmatch(os.path.basename(path)) for path in paths]
    names = {(one[1], one[3], len(one[2])) for one in found if one is not None}
    if None in found or len(paths) < FEWEST_FRAMES or len(names) != 1:
        return None
    numbers = sorted(int(one[2]) for one in found if one is not None)
    if numbers != list(range(numbers[0], numbers[0] + len(numbers))):
        return None
    (before, after, digits), folder = names.pop(), os.path.dirname(paths[0])
    return Numbered(os.path.join(folder, before), digits, after, "#" * digits if digits > 1 else "%d")
