"""Standard input and output in place of files: `-` names what is piped in; `-.png`, with the ending of its format, what is written out.

Input is kept whole in memory, so that it can be read as a file is, more than once. While something is written out, whatever else would be
printed goes to stderr.
"""

import atexit
import contextlib
import errno
import os
import re
import sys
import tempfile
from typing import IO, BinaryIO

from airlight.errors import AirlightError, MachineError
from airlight.process import temporaries

NAME = "-"
MOST_INPUT = 1 << 31  # bytes
_BLOCK = 1 << 20
_OUTPUT = re.compile(r"-(\.\w+)?")


class _Streams:
    """Remembers where the input is kept, and where standard output went."""

    def __init__(self) -> None:
        self.kept: str | None = None
        self.output: int | None = None  # the handle of what was standard output
        self.memory: int | None = None


_STREAMS = _Streams()


def is_input(path: str) -> bool:
    return path == NAME


def is_output(path: str) -> bool:
    """Tell whether a name means standard output: `-`, or `-` with an ending. A file of that name is `./-.png`."""
    return _OUTPUT.fullmatch(path) is not None


def is_folder(path: str) -> bool:
    """Tell whether a folder is to be read: `-` is standard input, even where a folder has that name."""
    return path != NAME and os.path.isdir(path)


def shown(path: str) -> str:
    """Write an output for a message: standard output without the ending, which the user may not have written."""
    return NAME if is_output(path) else path


def refuse_frames(pattern: str) -> None:
    """Raise AirlightError for numbered outputs whose name begins as that of standard output does: `-.####.png`, `-####.png`."""
    if pattern.startswith((f"{NAME}.", f"{NAME}#", f"{NAME}%")):
        raise AirlightError(f"{pattern}: frames do not go to standard output, which {NAME} stands for; files of that name are ./{pattern}")


def local(path: str) -> str:
    """Name a file with the same bytes: of standard input, which is read whole when first asked for, else the path itself.

    Raises AirlightError where nothing is piped in, or too much; MachineError where there is no room for it.
    """
    if path != NAME:
        return path
    if _STREAMS.kept is None:
        if sys.stdin is None or os.isatty(0):
            raise AirlightError("-: stands for standard input, and nothing is piped into it: use < FILE or PROGRAM |")
        _STREAMS.kept = _keep()
    return _STREAMS.kept


def _keep() -> str:
    """Copy standard input into memory, or where there are no files in memory into a temporary one."""
    try:
        if hasattr(os, "memfd_create") and os.path.isdir("/proc/self/fd"):
            _STREAMS.memory = handle = os.memfd_create("stdin")
            name = f"/proc/self/fd/{handle}"
        else:
            handle, name = tempfile.mkstemp("airlight")
            temporaries.announce(name)
            atexit.register(_remove, name)
        size = 0
        while block := os.read(0, _BLOCK):
            size += len(block)
            if size > MOST_INPUT:
                raise AirlightError(f"-: more than {MOST_INPUT >> 30} GiB are piped in; give the name of a file")
            _write_all(handle, block)
        if _STREAMS.memory is None:
            os.close(handle)
    except OSError as error:
        raise MachineError(f"-: cannot be read ({error.strerror}); give the name of a file") from error
    return name


def _remove(name: str) -> None:
    with contextlib.suppress(OSError):
        os.unlink(name)


def _write_all(handle: int, data: bytes | memoryview) -> None:
    left = memoryview(data)
    while left:
        left = left[os.write(handle, left) :]


def claim(binary: bool) -> None:
    """Keep standard output for what will be written: all else that is printed goes to stderr. binary: it is none for a terminal.

    Raises AirlightError for such output to a terminal, MachineError where the output is closed.
    """
    if _STREAMS.output is not None:
        return
    if sys.stdout is None:
        raise MachineError("-: standard output is closed: name a file, or send it on, as in > out.png or | PROGRAM")
    if binary and os.isatty(1):
        raise AirlightError("-: is a terminal, which would show a picture's bytes as signs: send them on, as in > out.png or | PROGRAM")
    with contextlib.suppress(OSError, ValueError):
        sys.stdout.flush()
    _STREAMS.output = os.dup(1)
    elsewhere = 2
    with contextlib.suppress(OSError, ValueError, AttributeError):  # the supervisor hides what libraries write to 2
        elsewhere = sys.stderr.fileno()
    os.dup2(elsewhere, 1)


def send(file: IO[bytes] | BinaryIO) -> None:
    """Write a whole file to what standard output was. Raises MachineError where nobody reads it, or it is full."""
    claim(False)
    assert _STREAMS.output is not None
    file.seek(0)
    try:
        while block := file.read(_BLOCK):
            _write_all(_STREAMS.output, block)
    except BrokenPipeError:
        raise MachineError("-: what reads the output ended before all of it was written") from None
    except OSError as error:
        reason = "the disk is full" if error.errno in (errno.ENOSPC, errno.EDQUOT) else error.strerror
        raise MachineError(f"-: could not be written ({reason})") from None


def release() -> None:
    """Give standard output back, and forget what was piped in: at the end of a command."""
    if _STREAMS.output is not None:
        if sys.stdout is not None:
            with contextlib.suppress(OSError, ValueError):
                sys.stdout.flush()
        os.dup2(_STREAMS.output, 1)
        os.close(_STREAMS.output)
    if _STREAMS.memory is not None:
        os.close(_STREAMS.memory)
    _STREAMS.__init__()  # type: ignore[misc]
