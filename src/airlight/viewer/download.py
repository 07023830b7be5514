"""Give the page of the browser view a picture that was saved from a file of its own: by a ticket that it alone is told."""

import os
import secrets
from typing import Any
from urllib.parse import quote

PATH = "/saved/"
MOST_TICKETS = 8  # the oldest goes
BLOCK = 1 << 20  # bytes


class Tickets:
    """Remembers the files that may be fetched, each under a random name of 256 bits."""

    def __init__(self) -> None:
        self.paths: dict[str, str] = {}

    def issue(self, path: str) -> str:
        """Make the address of a file, relative to the page's."""
        ticket = secrets.token_urlsafe(32)
        self.paths[ticket] = path
        for old in list(self.paths)[:-MOST_TICKETS]:
            del self.paths[old]
        return PATH.lstrip("/") + ticket

    def path(self, address: str) -> str | None:
        """Find the file of an address."""
        return self.paths.get(address.removeprefix(PATH))


async def give(path: str, send: Any, headers: list[tuple[bytes, bytes]]) -> bool:
    """Answer a request with a file's bytes, to be kept under its name. False, with nothing sent, where it cannot be read."""
    try:
        file = open(path, "rb")  # noqa: SIM115 - closed below; errors of reading on are another matter
    except OSError:
        return False
    with file:
        left = os.fstat(file.fileno()).st_size
        kept = f"attachment; filename*=UTF-8''{quote(os.path.basename(path), safe='')}"
        described = [
            (b"content-type", b"application/octet-stream"),
            (b"content-length", str(left).encode()),
            (b"content-disposition", kept.encode()),
        ]
        await send({"type": "http.response.start", "status": 200, "headers": [*described, *headers]})
        while block := file.read(min(BLOCK, left)):
            left -= len(block)
            await send({"type": "http.response.body", "body": block, "more_body": True})
        await send({"type": "http.response.body", "body": b""})
    return True
