"""rendercanvas' remote canvas and uvicorn's websocket, with what theirs lack. Every private name of the two that is used is used here."""

import asyncio
from collections.abc import Callable
from importlib.resources import files
from typing import Any

import numpy as np
from rendercanvas import http
from rendercanvas.core.encoders import encode_png
from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol

from airlight.errors import MachineError
from airlight.files.atomic import scratch
from airlight.viewer.upload import PageDesktop

QUALITY = 90  # of the JPEG of a frame that others follow
LOSSLESS = 100  # rendercanvas asks for this where nothing has changed for 0.3 s
PNG_LEVEL = 1  # zlib's; higher ones are slow and win little
MOST_CONNECTIONS = 64
MOST_WAITING = 1 << 16  # bytes not yet taken by a client, above which its pings are not answered
LINGER = 0.15  # s that a closed connection has to take what is still to be sent

asgi, loop = http.asgi, http.loop
RENDERVIEW = files("rendercanvas.core").joinpath("renderview.js").read_text(encoding="utf-8")  # events of the page, CC0


def encode(array: np.ndarray, quality: int = QUALITY) -> tuple[str, bytes]:
    """Encode (H, W, 3 or 4) uint8 as (MIME type, bytes): a JPEG, or a PNG where the quality is 100."""
    if quality >= LOSSLESS:
        return "image/png", encode_png(array[..., :3], PNG_LEVEL)
    import OpenImageIO as oiio

    height, width = array.shape[:2]
    spec = oiio.ImageSpec(width, height, 3, "uint8")
    spec.attribute("compression", f"jpeg:{quality}")
    spec.attribute("jpeg:subsampling", "4:4:4")  # coloured text stays sharp
    with scratch("frame", array.size) as memory:
        out = oiio.ImageOutput.create("jpeg")
        if out is None or not (out.open(memory, spec) and out.write_image(array[..., :3]) and out.close()) or out.has_error:
            raise MachineError(f"a frame cannot be encoded ({(out or oiio).geterror()})")
        with open(memory, "rb") as file:
            return "image/jpeg", file.read()


class RemoteCanvas(http.HttpRenderCanvas):
    """The canvas that browsers show; `desktop` is that of its page.

    `closed` is called once it is closed, by the application or by the loop's end.
    """

    _quality = QUALITY
    _is_closed: bool

    def __init__(self, size: tuple[int, int], title: str, closed: Callable[[], None], desktop: PageDesktop) -> None:
        http.encode_array = encode  # theirs takes 120 ms for a PNG of 1280x720, unless a package more is there
        self._closed, self.desktop = closed, desktop
        desktop.say = self.say
        self._titled = ""
        self._seen: Any = None  # the pixels that were sent last
        super().__init__(size=size, title=title)
        self._size_info.set_physical_size(*size, 1.0)  # until a client tells its own: theirs would draw 1x1

    def say(self, message: dict[str, Any]) -> None:
        """Send the page that steers a message of our own."""
        asgi.send_to(message, [], self._active_client)

    def _rc_present_bitmap(self, *, data: Any, **more: Any) -> None:
        """Send a frame, unless all have it: while a picture refines, and nothing else happens, most are the same."""
        if self._seen is None or not np.array_equal(data, self._seen):
            self._seen = np.array(data)
            super()._rc_present_bitmap(data=data, **more)
            return
        self._send_last_frame_to_ready_clients()  # some may be new
        if self._last_frame[0]["mimetype"] != "image/png":
            self._schedule_lossless_draw(self._seen)

    def _rc_set_title(self, title: str) -> None:
        self._titled = title
        super()._rc_set_title(title)

    def _update_active_states(self) -> None:  # called where clients come and go
        super()._update_active_states()
        asgi.send_all({"type": "title", "value": self._titled})

    def _rc_close(self) -> None:  # theirs makes coroutines that nothing awaits
        if not self._is_closed:
            self._is_closed = True
            self._closed()


class Door(H11Protocol):
    """Accepts a connection, unless there are too many: each costs a file handle, before anybody has shown a token."""

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        super().connection_made(transport)
        if len(self.connections) > MOST_CONNECTIONS:
            transport.abort()


class Socket(WebSocketsSansIOProtocol):
    """A websocket that is really gone once it is closed, also where the client takes nothing more; and holds no heap of pongs for it."""

    def handle_ping(self) -> None:
        if self.transport.get_write_buffer_size() > MOST_WAITING:
            self.conn.data_to_send()  # the pong, dropped
        else:
            super().handle_ping()

    def keepalive_timeout(self) -> None:
        super().keepalive_timeout()
        self.transport.abort()

    def on_task_complete(self, task: "asyncio.Task[None]") -> None:
        super().on_task_complete(task)
        self.loop.call_later(LINGER, self.transport.abort)

    def shutdown(self) -> None:
        super().shutdown()
        self.loop.call_later(LINGER, self.transport.abort)
