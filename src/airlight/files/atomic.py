"""Write outputs that are whole or absent: checked before the work, written beside the target, renamed at the end."""

import contextlib
import errno
import os
import shutil
import stat
import sys
import tempfile
from collections.abc import Iterable, Iterator
from importlib.util import find_spec
from typing import BinaryIO

from airlight.errors import AirlightError, MachineError
from airlight.messages import nearest, nearest_file
from airlight.options.storage import OUTPUTS
from airlight.process import standard, temporaries


def output_format(path: str) -> tuple[str, tuple[int, ...]]:
    """Look up the format's name and possible bits by the name's extension. Raises AirlightError for an unknown one."""
    extension = os.path.splitext(path)[1].lower()
    if extension not in OUTPUTS:
        what = f"unknown extension {extension!r}" if extension else "no extension"
        raise AirlightError(f"{path}: {what}{nearest(extension, OUTPUTS, '; use one of ' + ' '.join(OUTPUTS))}")
    return OUTPUTS[extension]


def check_output(
    path: str | os.PathLike[str], inputs: Iterable[str | os.PathLike[str]] = (), overwrite: bool = False, image: bool = True
) -> None:
    """Refuse, before any heavy work, an output that could not or should not be written.

    That is: an unknown extension (only if `image`), a missing or closed folder, one of `inputs` (also by link), and an
    existing file unless `overwrite`. Raises AirlightError.
    """
    name = os.fsdecode(path)
    if "\0" in name or not os.path.basename(name):
        raise AirlightError(f"{name!r}: is not a file name; name the output file")
    if image and output_format(name)[0] == "avif" and find_spec("PIL") is None:
        raise AirlightError(f"{name}: writing AVIF needs an extra: pip install airlight[avif]")
    if standard.is_output(name):
        standard.claim(image or name.lower().endswith(".mp4"))
        return
    target = os.path.realpath(name)
    folder = os.path.dirname(target)
    if not os.path.isdir(folder):
        raise AirlightError(f"{name}: the folder {folder} does not exist{nearest_file(folder, '; create it first')}")
    try:
        there = os.stat(target)
    except FileNotFoundError:
        there = None
    except OSError as error:
        raise AirlightError(f"{name}: cannot be written ({error.strerror}); choose another name") from error
    if there is not None:
        if not stat.S_ISREG(there.st_mode):
            kind = "a folder" if stat.S_ISDIR(there.st_mode) else "not a regular file"
            raise AirlightError(f"{name}: is {kind}; choose another name")
        for source in inputs:
            with contextlib.suppress(OSError, ValueError):
                if os.path.samestat(there, os.stat(source)):
                    raise AirlightError(f"{name}: is also an input; choose another output name")
        if not overwrite:
            raise AirlightError(f"{name}: exists already; pass -y/--overwrite to replace it")
    if not os.access(folder, os.W_OK | os.X_OK):
        raise AirlightError(f"{name}: the folder {folder} cannot be written to; choose another or change its permissions")


@contextlib.contextmanager
def replacing(path: str | os.PathLike[str], overwrite: bool = False) -> Iterator[BinaryIO]:
    """Open a binary file to write to; at the end of the block it becomes `path`, whole, or after an exception nothing is left.
    Standard output, see `process.standard`, gets all of it then.

    Raises MachineError when the disk is full or fails, AirlightError when the target appeared meanwhile.
    """
    name = os.fsdecode(path)
    if standard.is_output(name):
        with tempfile.TemporaryFile() as file:
            yield file
            standard.send(file)
        return
    target = os.path.realpath(name)  # a link stays a link
    folder = os.path.dirname(target)
    temporary = ""
    try:
        try:
            # A short name: the target's may have the full 255 bytes already.
            temporary = os.path.join(folder, f".airlight-{os.urandom(6).hex()}")
            temporaries.announce(temporary)
            with open(os.open(temporary, os.O_CREAT | os.O_EXCL | os.O_RDWR | getattr(os, "O_BINARY", 0), 0o666), "w+b") as file:
                yield file
                file.flush()
                os.fsync(file.fileno())
            if overwrite:
                with contextlib.suppress(FileNotFoundError):
                    os.chmod(temporary, stat.S_IMODE(os.stat(target).st_mode))
                os.replace(temporary, target)
            else:
                _rename_new(temporary, target)
            _sync_folder(folder)
        finally:
            with contextlib.suppress(OSError):
                os.unlink(temporary)
    except FileExistsError as error:
        raise AirlightError(f"{name}: exists already; pass -y/--overwrite to replace it") from error
    except OSError as error:
        reason = error.strerror or str(error)
        if error.errno in (errno.ENOSPC, errno.EDQUOT):
            raise MachineError(f"{name}: the disk is full; make room or choose another folder") from error
        if error.errno in (errno.EIO, errno.EFBIG, errno.ENOMEM):
            raise MachineError(f"{name}: could not be written ({reason}); check the disk") from error
        raise AirlightError(f"{name}: could not be written ({reason}); choose another folder or name") from error


def _rename_new(temporary: str, target: str) -> None:
    """Rename without replacing: of two runs to one output the second fails."""
    try:
        os.link(temporary, target)
    except FileExistsError:
        raise
    except OSError:  # a file system without hard links
        if os.path.lexists(target):
            raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), target) from None
        os.replace(temporary, target)


def _sync_folder(folder: str) -> None:
    with contextlib.suppress(OSError):  # not every system can
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


def _check_room(name: str, most: int, folder: str | None) -> None:
    """Raise MachineError where `most` bytes might not fit: libjpeg ends the process then, and OpenImageIO's WebP hangs."""
    if folder is not None and shutil.disk_usage(folder).free < most:
        raise MachineError(f"{name}: the disk of {folder} is nearly full, {most >> 20} MiB are needed; make room or set TMPDIR")
    if sys.platform != "win32":
        import resource

        limit = resource.getrlimit(resource.RLIMIT_FSIZE)[0]
        if limit != resource.RLIM_INFINITY and limit < most:
            raise MachineError(f"{name}: files may have {limit} bytes here (ulimit -f), {most} are needed; raise the limit")


@contextlib.contextmanager
def scratch(name: str, most: int) -> Iterator[str]:
    """Name an empty file in memory, where libraries may write that would end the process on a full disk.

    name: of the output, for the message; most: bytes that it may need. Raises MachineError where there is no room for them.
    """
    if hasattr(os, "memfd_create") and os.path.isdir("/proc/self/fd"):
        _check_room(name, most, None)
        handle = os.memfd_create("airlight")
        try:
            yield f"/proc/self/fd/{handle}"
        finally:
            os.close(handle)
        return
    with tempfile.TemporaryDirectory() as folder:
        _check_room(name, most, folder)
        yield os.path.join(folder, "scratch")
