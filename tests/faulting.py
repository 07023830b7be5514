"""A fault at the N-th call to the system while an output is written: an error, or the process killed. Run by test_faults.py.

Every call of files/atomic.py that touches the output's folder is counted: open, write (half of the data is written first), flush,
fsync, chmod, link, replace, unlink, and stat. For each N until no N-th call is made the output must be the old file or the new one.
"""

import builtins
import errno
import json
import os
import signal
import sys
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from airlight.errors import AirlightError, MachineError
from airlight.files import atomic, write_image
from airlight.files.video import film
from airlight.process import supervisor

CALLS = ("open", "fsync", "chmod", "link", "replace", "unlink", "stat")
MOST = 100  # calls for one output
PIXELS = np.random.default_rng(4).random((40, 60, 3)).astype(np.float32)


def write(target: Path, overwrite: bool = False) -> None:
    """Write an output of the extension's kind: the picture, or a film of three frames of it."""
    if target.suffix != ".mp4":
        write_image(target, PIXELS, overwrite=overwrite)
        return
    with film(target, 60, 40, Fraction(24), overwrite=overwrite) as add:
        for _ in range(3):
            add((255 * PIXELS).astype(np.uint8))


class Fault:
    """Stands for `os` and `open` in airlight.files.atomic; the call number `at` fails by `action`."""

    def __init__(self, at: int, action: Callable[[], None]) -> None:
        self.at, self.action, self.count, self.failed = at, action, 0, ""

    def __getattr__(self, name: str) -> Any:
        real = getattr(os, name)
        return (lambda *a, **k: (self.call(name), real(*a, **k))[1]) if name in CALLS else real

    def call(self, name: str) -> None:
        self.count += 1
        if self.count == self.at:
            self.failed = name
            self.action()

    def file(self, *args: Any) -> Any:
        file, fault = builtins.open(*args), self  # noqa: SIM115

        class File:
            def write(self, data: Any) -> int:
                half = file.write(bytes(data)[: len(data) // 2])
                fault.call("write")
                return half + file.write(bytes(data)[len(data) // 2 :])

            def flush(self) -> None:
                fault.call("flush")
                file.flush()

            def __getattr__(self, name: str) -> Any:  # read, seek and fileno
                return getattr(file, name)

            def __enter__(self) -> "File":
                return self

            def __exit__(self, *_: Any) -> None:
                file.close()

        return File()

    def run(self, target: Path, overwrite: bool) -> None:
        atomic.os, atomic.open = self, self.file
        try:
            write(target, overwrite)
        finally:
            atomic.os, atomic.open = os, builtins.open


def state(folder: Path, target: Path, old: bytes | None, new: bytes) -> str:
    """What is wrong with the folder, or nothing."""
    others = [p.name for p in folder.iterdir() if p != target]
    held = target.read_bytes() if target.exists() else None
    return f"left: {others}" if others else "" if held in (old, new) else "neither the old file nor the new one"


def kill() -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def fail(number: int) -> Callable[[], None]:
    def action() -> None:
        raise OSError(number, os.strerror(number))

    return action


def tried(folder: Path, extension: str, overwrite: bool, number: int) -> tuple[int, list[str]]:
    """(calls, faults found) of one format and error; number 0: SIGKILL, in a child process."""
    target = folder / f"out.{extension}"
    if number:
        write(target)
    else:  # in a child: a fork after the codecs' threads were started would hang
        supervisor.supervised(lambda: write(target) or 0)
    new, old = target.read_bytes(), b"old" if overwrite else None
    wrong, at = [], 0
    while True:
        at += 1
        target.unlink(missing_ok=True)
        if old is not None:
            target.write_bytes(old)
        fault, raised, said = Fault(at, fail(number) if number else kill), None, []
        supervisor.say = said.append
        if number:
            try:
                fault.run(target, overwrite)
            except AirlightError as error:
                raised = error
            done = not fault.failed
        else:
            code = supervisor.supervised(lambda: fault.run(target, overwrite) or 0)  # noqa: B023
            done = code == 0
            if not done and (code != 1 or len(said) != 1):
                wrong.append(f"killed at call {at}: exit code {code}, {said}")
        problem = state(folder, target, old, new)
        if fault.failed == "unlink":  # which is how it would have been removed
            problem = ""
            for path in folder.iterdir():
                if path != target:
                    path.unlink()
        if raised is None and (number or done) and (not target.exists() or target.read_bytes() != new):
            problem = "no error, and not the new file"
        if done and raised is not None:
            problem = f"an error without a fault: {raised}"
        of_machine = number in (errno.ENOSPC, errno.EIO) and fault.failed in ("open", "write", "flush", "fsync", "replace")
        if of_machine and raised is not None and not isinstance(raised, MachineError):
            problem = f"not a failure of the machine: {raised}"
        if problem:
            wrong.append(f"{extension} {number or 'kill'} at call {at} ({fault.failed}): {problem}")
        if at == MOST:
            wrong.append(f"{extension} {number or 'kill'}: fails at every call, or without a fault")
        if done or at == MOST:
            return at - 1, wrong


if __name__ == "__main__":
    folder, kind, formats = Path(sys.argv[1]), sys.argv[2], sys.argv[3:]
    calls, wrong = 0, []
    for extension in formats:
        for overwrite in (False, True):
            for number in (0,) if kind == "kill" else (errno.ENOSPC, errno.EIO, errno.EACCES):
                where = folder / f"{extension}{overwrite:d}{number}"
                where.mkdir()
                made, found = tried(where, extension, overwrite, number)
                calls, wrong = calls + made, wrong + found
    print(json.dumps({"calls": calls, "wrong": wrong}))
