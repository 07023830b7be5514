"""Take a file that the page of the browser view sends: its bytes, never a path, no more than a limit, kept until the viewer ends."""

import asyncio
import contextlib
import hmac
import os
import re
import secrets
import shutil
import tempfile
from collections.abc import Callable
from typing import Any
from urllib.parse import unquote

from airlight.process import temporaries
from airlight.viewer.desktop import Desktop
from airlight.viewer.download import Tickets

PATH = "/file"
MOST_FILE = 512 << 20  # bytes
MOST_KEPT = 8  # files; the oldest goes
MOST_NAME = 100  # characters
STALL = 20.0  # s without a byte
MEBI = 1 << 20
Answer = tuple[int, str]  # HTTP status, one line


class PageDesktop(Desktop):
    """The desktop on which the page that steers is open. `say` sends that page a message; `key` is known to it alone, not to watchers."""

    has_paths = False

    def __init__(self) -> None:
        super().__init__()
        self.say: Callable[[dict[str, Any]], Any] = lambda message: None
        self.key = secrets.token_urlsafe(32)
        self.tickets = Tickets()
        self.folder = ""
        self.count = 0
        self.busy = False
        self.light: int | None = None  # for whose cookie the page was asked last

    def grant(self) -> str:
        """Make the key of the client that steers from now on."""
        self.key = secrets.token_urlsafe(32)
        return self.key

    def copy(self, text: str) -> str:
        self.say({"type": "clipboard", "value": text})
        return "goes to the browser's clipboard"

    def choose(self, folder: str, light: int | None = None) -> str:
        self.light = light
        self.say({"type": "choose", "most": MOST_FILE, "cookie": light is not None})
        return ""

    def deliver(self, path: str) -> None:
        self.say({"type": "download", "value": self.tickets.issue(path), "name": os.path.basename(path)})

    async def take(self, header: Callable[[bytes], str], receive: Any) -> Answer:
        """Keep the body of a request, and let the viewer open it. header: reads one of the request."""
        key, length, name = header(b"x-airlight-key"), header(b"content-length"), file_name(header(b"x-file-name"))
        if not hmac.compare_digest(key.encode(), self.key.encode()):
            return 403, "Only the window that steers may open files."
        if not re.fullmatch(r"\d{1,15}", length):
            return 411, "The file's length has to be said."
        if int(length) > MOST_FILE:
            return 413, f"{name}: has {int(length) / MEBI:,.0f} MiB; at most {MOST_FILE // MEBI} MiB can be sent"
        if self.busy:
            return 409, "Another file is on its way: wait for it."
        self.busy = True
        path = ""
        try:
            path = self.place(name)
            with open(path, "xb") as file:
                if not await _copied(receive, file.write, int(length)):
                    return 400, f"{name}: did not arrive whole; send it again"
        except OSError as error:
            return 507, f"{name}: cannot be kept ({error.strerror or error}); make room in {tempfile.gettempdir()}"
        else:
            self._keep(path, name)
            path = ""
        finally:
            self.busy = False
            if path:
                shutil.rmtree(os.path.dirname(path), ignore_errors=True)
        self.receive([next(reversed(self.names))], self.light if header(b"x-airlight-for") == "cookie" else None)
        return 200, ""

    def place(self, name: str) -> str:
        """Make a folder of its own for a file of this name."""
        if not self.folder:
            folder = os.path.join(tempfile.gettempdir(), f"airlight-{secrets.token_hex(8)}")
            temporaries.announce(folder)
            os.mkdir(folder, 0o700)
            self.folder = folder
        self.count += 1
        folder = os.path.join(self.folder, str(self.count))
        path = os.path.join(folder, name)
        for made in (folder, path):
            temporaries.announce(made)
        os.mkdir(folder)
        return path

    def _keep(self, path: str, name: str) -> None:
        stem, ending = os.path.splitext(name)
        number = 1
        while name in self.names.values():
            number += 1
            name = f"{stem} ({number}){ending}"
        self.names[path] = name
        for old in [one for one in self.names if one != self.in_use][: max(0, len(self.names) - MOST_KEPT)]:
            del self.names[old]
            shutil.rmtree(os.path.dirname(old), ignore_errors=True)

    def lacks(self, path: str) -> bool:
        return bool(self.folder) and path.startswith(self.folder) and path not in self.names

    def close(self) -> None:
        """Remove all files."""
        if self.folder:
            shutil.rmtree(self.folder, ignore_errors=True)
            self.names.clear()


async def _copied(receive: Any, write: Callable[[bytes], Any], length: int) -> bool:
    """Write the body of a request, and tell whether all of it came."""
    got = 0
    with contextlib.suppress(TimeoutError):
        while True:
            async with asyncio.timeout(STALL):
                event = await receive()
            if event["type"] != "http.request":
                return False
            got += len(event["body"])
            if got > length:
                return False
            write(event["body"])
            if not event.get("more_body"):
                return got == length
    return False


def file_name(quoted: str) -> str:
    """Make of what a page calls a file a name that any system can keep: no folder, no control characters, not too long."""
    name = re.split(r"[/\\]", unquote(quoted))[-1]
    name = re.sub(r'[\x00-\x1f\x7f-\x9f<>:"|?*\ud800-\udfff\u2028-\u202e]', "_", name).strip(" .") or "file"
    stem, ending = os.path.splitext(name)
    return stem[: MOST_NAME - len(ending[:12])] + ending[:12]
