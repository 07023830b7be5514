"""Run the command in a child process, so that what ends a process outright becomes one line and leaves nothing behind.

A failed submit aborts within the GPU library, a driver may crash, the kernel may end what takes too much memory: Python can catch
none of it. A long dispatch or a decoder does not return for Ctrl-C. The parent can wait. It forks before anything is imported, for
memory that both hold is copied page by page once the child writes to it.
"""

import contextlib
import os
import signal
import sys
from collections.abc import Callable
from typing import Any, NoReturn

from airlight.messages import say
from airlight.process import temporaries

STOPS = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))
GRACE = 0.7  # seconds in which the child may end by itself once it is told to stop
DEATH_SIGNAL = 1  # PR_SET_PDEATHSIG of prctl(2)
STOPPED = "stopped; nothing half-written is left"
stopping = False  # whether this process was told to stop


def stop_once(got: int, _: Any) -> NoReturn:
    """Unwind at a first signal, so that temporary files are removed, which no second signal may disturb."""
    global stopping
    stopping = True
    for number in STOPS:
        signal.signal(number, signal.SIG_IGN)
    if got == signal.SIGINT:
        raise KeyboardInterrupt
    sys.exit(128 + got)


def _stop_again(unraised: Any) -> None:
    """Raise a stop once more that fell into a destructor or a library's callback, where it is lost; a sys.unraisablehook."""
    if isinstance(unraised.exc_value, (KeyboardInterrupt, SystemExit)) and hasattr(signal, "setitimer"):
        stop = unraised.exc_value

        def again(*_: Any) -> NoReturn:
            raise stop.with_traceback(None)

        signal.signal(signal.SIGALRM, again)
        signal.setitimer(signal.ITIMER_REAL, 0.002)
    else:
        sys.__unraisablehook__(unraised)


def prepare_process() -> None:
    """Have standard streams that can be written to, and remove temporary files at every signal that asks for an end."""
    for handle in range(3):  # a closed one would be given to the next file that is opened, which prints would then land in
        try:
            os.fstat(handle)
        except OSError:
            os.open(os.devnull, os.O_RDWR)
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")  # file names that are not text, symbols that the locale lacks
    for number in STOPS:
        if signal.getsignal(number) in (signal.SIG_DFL, signal.default_int_handler):
            signal.signal(number, stop_once)
    sys.unraisablehook = _stop_again


def supervised(work: Callable[[], int]) -> int:
    """Run `work` in a child process on Linux and return its exit code; a death by a signal becomes a line and 1, or 128 + a stop's number.

    Elsewhere `work` is simply called: Windows has no fork, and Apple's libraries do not work in a forked process.
    What libraries write to stderr by themselves is not shown, unless AIRLIGHT_TRACEBACK is set.
    """
    if sys.platform != "linux":
        return work()
    noise = os.memfd_create("stderr")
    reader, writer = os.pipe()
    for stream in filter(None, (sys.stdout, sys.stderr)):
        stream.flush()
    signal.pthread_sigmask(signal.SIG_BLOCK, STOPS)
    parent, child = os.getpid(), os.fork()
    if child == 0:
        os.close(reader)
        _be_child(work, writer, noise, parent)
    os.close(writer)
    return _watch(child, reader, noise)


def _be_child(work: Callable[[], int], writer: int, noise: int, parent: int) -> NoReturn:
    code: Any = 1

    def announce(path: str) -> None:
        os.write(writer, os.fsencode(path) + b"\0")

    try:
        import ctypes

        ctypes.CDLL(None).prctl(DEATH_SIGNAL, signal.SIGTERM)
        signal.pthread_sigmask(signal.SIG_UNBLOCK, STOPS)
        if sys.stderr is not None and not os.environ.get("AIRLIGHT_TRACEBACK"):
            sys.stderr = os.fdopen(os.dup(2), "w", buffering=1, encoding=sys.stderr.encoding, errors="backslashreplace")
            os.dup2(noise, 2)

        temporaries.announce = announce
        if os.getppid() == parent:
            code = work()
            announce("")  # it has ended by itself
    except KeyboardInterrupt:  # before the command begins
        say(STOPPED)
        code = 128 + signal.SIGINT
        announce("")
    except SystemExit as error:  # of a stop, or of click, once the reader of a pipe is gone or completions are told: unwound all the same
        code = error.code if isinstance(error.code, int) else int(error.code is not None)
        with contextlib.suppress(OSError):
            announce("")
    finally:
        os._exit(code)  # at once: what a driver still computes is waited for no longer


def _watch(child: int, reader: int, noise: int) -> int:
    stopped: list[int] = []

    def tell(number: int) -> None:
        with contextlib.suppress(ProcessLookupError):
            os.kill(child, number)

    def stop(got: int, _: Any) -> None:
        if not stopped:
            tell(got)
            signal.setitimer(signal.ITIMER_REAL, GRACE)
        stopped.append(got)

    signal.signal(signal.SIGALRM, lambda *_: tell(signal.SIGKILL))
    for number in STOPS:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, stop)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, STOPS)
    names = b""
    while part := os.read(reader, 1 << 16):  # until the child is gone
        names += part
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    signal.setitimer(signal.ITIMER_REAL, 0)
    if code >= 0 and (stopped or names.endswith(b"\0\0") or names == b"\0"):
        return code
    for name in reversed(names.split(b"\0")[:-1]):  # a folder is announced before what is put into it
        with contextlib.suppress(OSError):
            os.rmdir(name) if os.path.isdir(name) else os.unlink(name)
    if stopped:
        say(STOPPED)
        return 128 + stopped[0]
    if code == -signal.SIGKILL:
        say("the system ended the work, most likely for want of memory; use a smaller picture or --quality draft")
        return 1
    last = os.pread(noise, 8192, max(0, os.fstat(noise).st_size - 8192)).decode(errors="replace")
    _, begin, rest = last.partition("panicked at")  # as Rust, and so wgpu, begins
    last = " ".join((begin + rest.partition("stack backtrace")[0]).split())[:200]
    what = (signal.Signals(-code).name if code < 0 else f"exit {code}") + (f": {last}" if last else "")
    say(f"the graphics driver or another library failed ({what}); nothing half-written is left; try another --device or a smaller picture")
    return 1
