"""Reach what surrounds a canvas: the clipboard, the file dialog, files that are dropped on it."""

import functools
import shutil
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Sequence
from typing import Any

from airlight.jobs.densities import FILES as DENSITIES
from airlight.scenes.names import FILES

PICTURES = (
    *(".jpg", ".jpeg", ".png", ".tif", ".tiff", ".webp", ".exr", ".hdr", ".dpx", ".jxl", ".avif", ".heic", ".heif", ".bmp", ".gif", ".jp2"),
    *(".pfm", ".ppm", ".cin", ".dng", ".cr2", ".cr3", ".nef", ".arw", ".raf", ".orf", ".rw2"),
)
POLL = 0.05  # s between two looks at a dialog that is open
PROGRAMS = ("zenity", "matedialog", "qarma", "kdialog")  # which portable-file-dialogs calls where the system itself has no dialog


class Desktop:
    """Stands for no desktop at all: of a notebook, or where nothing is shown. The clipboard is the viewer's own.

    has_paths: whether a path means a file of the user's. wake: called, also from another thread, when there is something in `arrived`:
    lists of paths to open.
    """

    has_paths = True

    def __init__(self) -> None:
        self.arrived: deque[Sequence[str]] = deque()
        self.cookies: deque[tuple[int, str]] = deque()  # paths of cookies, each with the number of the light that it was chosen for
        self.names: dict[str, str] = {}  # of files that came as bytes: where they are kept, the name that they came with
        self.in_use = ""  # the one of them that is shown
        self.clipboard = ""
        self.wake: Callable[[], Any] = lambda: None

    def copy(self, text: str) -> str:
        """Put text on the clipboard. Returns where it is, as the panel says it."""
        self.clipboard = text
        return "stands below its button"

    def paste(self) -> str:
        """Read the text of the clipboard."""
        return self.clipboard

    def choose(self, folder: str, light: int | None = None) -> str:
        """Let the user choose a file; light: for whose cookie. Returns what to say where that cannot be done, else ""."""
        return "there is no file dialog here: type a path below"

    def deliver(self, path: str) -> None:
        """Hand a file that was saved to the user, whose folders are those of another machine."""

    def lacks(self, path: str) -> bool:
        """Tell whether a path is that of a file that came as bytes and is kept no longer."""
        return False

    def receive(self, paths: Sequence[str], light: int | None = None) -> None:
        """Take paths to open; light: the first is its cookie."""
        if paths and light is not None:
            self.cookies.append((light, paths[0]))
        elif paths:
            self.arrived.append(paths)
        if paths:
            self.wake()


class WindowDesktop(Desktop):
    """The desktop of a window of rendercanvas.glfw. Its private `_window` is used here and nowhere else."""

    def __init__(self, canvas: Any) -> None:
        super().__init__()
        import glfw

        self.glfw: Any = glfw
        self.dialog: FileDialog | None = None
        self.glfw.set_drop_callback(canvas._window, lambda window, paths: self.receive(paths))

    def copy(self, text: str) -> str:
        self.glfw.set_clipboard_string(None, text)
        return "is in the clipboard"

    def paste(self) -> str:
        text = self.glfw.get_clipboard_string(None)
        return text.decode(errors="replace") if isinstance(text, bytes) else text or ""

    def choose(self, folder: str, light: int | None = None) -> str:
        if self.dialog is not None and self.dialog.is_alive():
            return "the file dialog is open already"
        if sys.platform not in ("win32", "darwin") and not any(map(shutil.which, PROGRAMS)):
            return "no file dialog is installed (zenity or kdialog would be one): type a path below, or drop a file here"
        self.dialog = FileDialog(folder, functools.partial(self.receive, light=light))
        self.dialog.start()
        return ""


def kinds() -> list[str]:
    """List what a dialog offers: the name of a kind, then the endings of its files, and so on."""
    endings = " ".join(f"*{v}" for one in (*PICTURES, *FILES, *DENSITIES) for v in (one, one.upper()))
    return ["Pictures, scenes and volumes", endings, "All files", "*"]


class FileDialog(threading.Thread):
    """The system's dialog to open a file; `chosen` is told the paths in its thread, none if it was cancelled."""

    def __init__(self, folder: str, chosen: Callable[[Sequence[str]], Any]) -> None:
        super().__init__(name="file dialog", daemon=True)
        from imgui_bundle import portable_file_dialogs

        self.dialog = portable_file_dialogs.open_file("Open a picture, a scene, or a volume for its air", folder, kinds())
        self.chosen = chosen

    def run(self) -> None:
        while not self.dialog.ready(0):
            time.sleep(POLL)
        self.chosen(self.dialog.result())


def desktop_of(canvas: Any) -> Desktop:
    """Find what surrounds a canvas."""
    if type(canvas).__module__ == "rendercanvas.glfw":
        return WindowDesktop(canvas)
    found = getattr(canvas, "desktop", None)  # the browser view's
    return found if isinstance(found, Desktop) else Desktop()
