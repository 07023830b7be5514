"""The viewer in a web browser: rendercanvas' remote view behind guards of our own.

rendercanvas.http trusts whoever connects. Here a client must have opened the printed address (its token becomes a cookie), come from our
own page (Host and Origin, against DNS rebinding and other sites), and be one of eight; its messages are decoded by type, clamped, counted,
and encoded anew before rendercanvas sees them. The first client steers, the others watch; when it goes, the next one steers.
"""

import asyncio
import contextlib
import errno
import functools
import hmac
import ipaddress
import secrets
import signal
import socket
import threading
from collections.abc import Callable, Iterator
from importlib.resources import files
from typing import TYPE_CHECKING, Any
from urllib.parse import parse_qs, urlsplit

import msgspec

from airlight.errors import AirlightError, warn
from airlight.process.supervisor import STOPS
from airlight.viewer import download
from airlight.viewer.client_messages import Feedback, Paste, decode_message
from airlight.viewer.upload import MOST_FILE, PATH, PageDesktop

if TYPE_CHECKING:
    import uvicorn

TITLE = "Airlight"
SIZE = (1280, 720)  # until the first client tells its own
MOST_CLIENTS = 8
MOST_BYTES = 16 * 1024  # of a message
RATE, BURST = 240, 480  # messages a second, and how many at once; our page sends at most about 200 a second
PATIENCE = 10.0  # s that a client may take to acknowledge a frame
CLOSE_TIME = 0.5  # s for closing a connection
SHUTDOWN = 0.3  # s for all clients when the program ends
PAGE = "/ws"

HEADERS = [
    (
        b"content-security-policy",
        b"default-src 'none'; script-src 'self'; style-src 'self'; img-src blob: data:; connect-src 'self'; "
        b"base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    ),
    (b"x-frame-options", b"DENY"),
    (b"x-content-type-options", b"nosniff"),
    (b"cache-control", b"no-store"),
    (b"referrer-policy", b"no-referrer"),
    (b"cross-origin-resource-policy", b"same-origin"),
    (b"cross-origin-opener-policy", b"same-origin"),
]

class _Sent(msgspec.Struct):
    """Holds what matters of a message to a client."""

    type: str
    index: int = 0
    value: Any = None


class _Client:
    """Serves one websocket: passes its messages to rendercanvas, filtered, and counts the frames on their way to it."""

    def __init__(self, app: Any, desktop: PageDesktop, scope: Any, receive: Any, send: Any) -> None:
        self.desktop, self.is_active = desktop, False
        self.app, self.scope, self.take, self.give = app, scope, receive, send
        self.inbox: asyncio.Queue[Any] = asyncio.Queue(maxsize=16)
        self.sent = self.confirmed = 0
        self.allowance, self.counted = float(BURST), asyncio.get_running_loop().time()
        self.patience = asyncio.timeout(None)

    async def run(self) -> None:
        """Serve until the client goes, talks too much, or takes no frames any more."""
        served = asyncio.create_task(self.app(self.scope, self.inbox.get, self._send))
        served.add_done_callback(lambda _: self._wait(0.0))
        code, why = 1008, "it took no frames"
        try:
            async with self.patience:
                code, why = await self._listen()
        except TimeoutError:
            pass
        finally:
            if not served.done():
                await self.inbox.put({"type": "websocket.disconnect", "code": 1005})
            await served
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(CLOSE_TIME):
                await self.give({"type": "websocket.close", "code": code, "reason": why})

    async def _listen(self) -> tuple[int, str]:
        """Pass messages on until the client is to be closed: with what code, and why."""
        while True:
            event = await self.take()
            if event["type"] == "websocket.disconnect":
                return 1000, ""
            if event["type"] == "websocket.connect":
                await self.inbox.put(event)
                continue
            if not self._may_speak():
                return 1008, "too many messages"
            message = decode_message(event.get("text") or "")
            if isinstance(message, Feedback):
                if not self.confirmed < message.index <= self.sent:
                    continue
                self.confirmed = message.index
                self._wait(PATIENCE if self.confirmed < self.sent else None)
            if isinstance(message, Paste):
                if self.is_active:
                    self.desktop.clipboard = message.text
            elif message is not None:
                await self.inbox.put({"type": "websocket.receive", "text": msgspec.json.encode(message).decode()})

    def _may_speak(self) -> bool:
        now = asyncio.get_running_loop().time()
        self.allowance = min(BURST, self.allowance + RATE * (now - self.counted)) - 1
        self.counted = now
        return self.allowance >= 0

    def _wait(self, seconds: float | None) -> None:
        """End it in some seconds; None: no more."""
        with contextlib.suppress(RuntimeError):  # it ends already
            self.patience.reschedule(None if seconds is None else asyncio.get_running_loop().time() + seconds)

    async def _send(self, event: Any) -> None:
        if "text" in event:
            message = msgspec.json.decode(event["text"], type=_Sent)
            if message.type == "framebufferdata":
                if self.sent == self.confirmed:
                    self._wait(PATIENCE)
                self.sent = message.index
            elif message.type == "active":
                self.is_active = message.value is True
        await self.give(event)
        if self.is_active and "text" in event and message.type == "active":
            told = {"type": "key", "value": self.desktop.grant(), "most": MOST_FILE}
            await self.give({"type": "websocket.send", "text": msgspec.json.encode(told).decode()})


class Guard:
    """Guards rendercanvas' own ASGI application, `app`.

    loopback: whether it listens to this machine only; host: as the user gave it; port: for the cookie's name; desktop: takes files.
    """

    def __init__(self, app: Any, renderview: str, host: str, port: int, loopback: bool, desktop: PageDesktop | None = None) -> None:
        self.app, self.loopback, self.desktop = app, loopback, desktop or PageDesktop()
        self.token, self.secret = secrets.token_urlsafe(32), secrets.token_urlsafe(32)
        self.cookie = f"airlight-{port}"  # browsers share cookies among the ports of a host
        own = socket.gethostname().lower()
        self.names = {"localhost"} if loopback else {"localhost", host.lower(), own, f"{own}.local"}
        self.clients = 0
        page = files("airlight").joinpath("viewer/page")
        self.files = {
            "/": ("text/html", page.joinpath("index.html").read_bytes()),
            "/view.css": ("text/css", page.joinpath("view.css").read_bytes()),
            "/view.js": ("text/javascript", page.joinpath("view.js").read_bytes()),
            "/files.js": ("text/javascript", page.joinpath("files.js").read_bytes()),
            "/renderview.js": ("text/javascript", renderview.encode()),
        }

    async def __call__(self, scope: Any, receive: Any, send: Any) -> None:
        if scope["type"] == "http":
            await (self._take(scope, receive, send) if scope["path"] == PATH else self._answer(scope, send))
        elif scope["type"] == "websocket":
            await self._connect(scope, receive, send)

    async def _connect(self, scope: Any, receive: Any, send: Any) -> None:
        if scope["path"] != PAGE or not self._is_ours(scope):
            await send({"type": "websocket.close"})  # before it is accepted: 403
            return
        if self.clients >= MOST_CLIENTS:
            await send({"type": "websocket.accept"})
            await send({"type": "websocket.close", "code": 1013, "reason": f"{MOST_CLIENTS} windows show this already"})
            return
        self.clients += 1
        try:
            await _Client(self.app, self.desktop, scope, receive, send).run()
        finally:
            self.clients -= 1

    async def _take(self, scope: Any, receive: Any, send: Any) -> None:
        """Take a file from our page."""
        if scope["method"] != "POST":
            await _reply(send, 405, "A file is sent here by POST.\n")
        elif not self._is_ours(scope):
            await _reply(send, 403, "Files are taken from the page that Airlight serves, and from no other.\n")
        else:
            status, line = await self.desktop.take(functools.partial(_header, scope), receive)
            await _reply(send, status, line and f"{line}\n", headers=[(b"connection", b"close")] if status != 200 else ())

    def _is_ours(self, scope: Any) -> bool:
        """Tell whether a request comes from our own page, which has the cookie."""
        host = _header(scope, b"host")
        return self.allows_host(host) and _header(scope, b"origin") == f"http://{host}" and self._is_known(scope)

    async def _answer(self, scope: Any, send: Any) -> None:
        token = parse_qs(scope["query_string"].decode("latin-1")[:1024]).get("token", [""])[0]
        saved = self.desktop.tickets.path(scope["path"])
        if not self.allows_host(_header(scope, b"host")):
            await _reply(send, 403, "This is not the address that Airlight printed.\n")
        elif scope["path"] not in self.files and saved is None:
            await _reply(send, 404, "There is nothing here.\n")
        elif scope["method"] not in ("GET", "HEAD"):
            await _reply(send, 405, "Only GET is answered.\n")
        elif scope["path"] == "/" and hmac.compare_digest(token.encode(), self.token.encode()):
            cookie = f"{self.cookie}={self.secret}; Path=/; HttpOnly; SameSite=Strict"
            await _reply(send, 303, "", headers=[(b"location", b"/"), (b"set-cookie", cookie.encode())])
        elif token or not self._is_known(scope):
            await _reply(send, 403, "Open the address that Airlight printed, with its token.\n")
        elif saved is not None:
            if scope["method"] != "GET" or not await download.give(saved, send, HEADERS):
                await _reply(send, 404, "The file is there no longer: save it again.\n")
        else:
            kind, body = self.files[scope["path"]]
            await _reply(send, 200, body, kind)

    def allows_host(self, host: str) -> bool:
        """Tell whether a Host header names this machine by an address, or by a name that no other site can point at it.

        Its port may differ, as it does behind a tunnel.
        """
        try:
            name = urlsplit(f"//{host}").hostname or ""
        except ValueError:
            return False
        if name in self.names:
            return True
        try:
            address = ipaddress.ip_address(name)
        except ValueError:
            return False
        return address.is_loopback or not self.loopback

    def _is_known(self, scope: Any) -> bool:
        """Tell whether the cookie is there."""
        for part in _header(scope, b"cookie").split(";"):
            name, _, value = part.strip().partition("=")
            if name == self.cookie and hmac.compare_digest(value.encode(), self.secret.encode()):
                return True
        return False


def _header(scope: Any, name: bytes) -> str:
    """Read a header; empty where it is not there exactly once."""
    found = [value for key, value in scope["headers"] if key.lower() == name]
    return found[0].decode("latin-1") if len(found) == 1 else ""


async def _reply(send: Any, status: int, body: str | bytes, kind: str = "text/plain", headers: Any = ()) -> None:
    body = body.encode() if isinstance(body, str) else body
    described = [(b"content-type", f"{kind}; charset=utf-8".encode()), (b"content-length", str(len(body)).encode())]
    await send({"type": "http.response.start", "status": status, "headers": [*described, *HEADERS, *headers]})
    await send({"type": "http.response.body", "body": body})


def serve(start: Callable[[Any], Any], host: str = "127.0.0.1", port: int = 0, announce: Callable[[str], None] = print) -> None:
    """Show in browsers what start(canvas) draws on a canvas of rendercanvas, until Ctrl-C, or until the canvas is closed.

    start: installs the drawing function and event handlers. host: to listen on; other machines only where it is not loopback, with a
    warning. port: 0 for any that is free. announce: is told the address to open, which holds the secret token.
    Raises AirlightError where packages lack or the port is taken; and what `start` raises.
    """
    try:
        from airlight.viewer import remote  # noqa: F401
    except ImportError as error:
        raise AirlightError(f"the browser view needs more packages ({error}): pip install airlight[viewer]") from None
    with contextlib.closing(_listen(host, port)) as listening, _handlers_kept() as handlers:
        asyncio.run(_serve(start, listening, host, announce, handlers))


def _listen(host: str, port: int) -> socket.socket:
    try:
        family, _, _, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)[0]
        return socket.create_server(address[:2], family=family)
    except (OSError, UnicodeError) as error:
        if getattr(error, "errno", None) == errno.EADDRINUSE:
            raise AirlightError(f"port {port} of {host} is taken; give another --port, or none for any that is free") from None
        reason = getattr(error, "strerror", None) or str(error)
        raise AirlightError(f"cannot listen on {host} port {port} ({reason}); give another --host or --port") from None


@contextlib.contextmanager
def _handlers_kept() -> Iterator[dict[int, Any]]:
    """Keep the handlers of signals (none are known outside of the main thread), and put them back afterwards."""
    main = threading.current_thread() is threading.main_thread()
    before = {number: signal.getsignal(number) for number in STOPS} if main else {}
    try:
        yield before
    finally:
        _handle(before)


def _handle(handlers: dict[int, Any]) -> None:
    for number, handler in handlers.items():
        signal.signal(number, handler)


async def _serve(
    start: Callable[[Any], Any], listening: socket.socket, host: str, announce: Callable[[str], None], handlers: dict[int, Any]
) -> None:
    import uvicorn

    from airlight.viewer import remote

    class Server(uvicorn.Server):
        @contextlib.contextmanager
        def capture_signals(self) -> Iterator[None]:
            yield  # they are ours, below

    bound, port = listening.getsockname()[:2]
    loopback = ipaddress.ip_address(bound.partition("%")[0]).is_loopback
    desktop = PageDesktop()
    guard = Guard(remote.asgi, remote.RENDERVIEW, host, port, loopback, desktop)
    server = Server(_config(uvicorn, guard, remote.Door, remote.Socket))

    def stop(*_: Any) -> None:
        server.should_exit = True

    def interrupted(*_: Any) -> None:
        with contextlib.suppress(RuntimeError):  # it has ended already
            ours.call_soon_threadsafe(canvas.close)  # after the frame that is being drawn; none follows

    ours = asyncio.get_running_loop()
    canvas = remote.RemoteCanvas(SIZE, TITLE, stop, desktop)
    try:
        await asyncio.sleep(0)  # in which rendercanvas' loop starts, and handles signals
        _handle(handlers)  # Ctrl-C ends `start` as it would end anything
        shown = start(canvas)  # kept alive
        _handle(dict.fromkeys(handlers, interrupted))
        name = socket.gethostname() if bound in ("0.0.0.0", "::") else host
        written = f"[{name}]" if ":" in name else name
        if not loopback:
            warn(
                f"listening on {host}: whoever has the address below can look and steer, and all is sent unencrypted; "
                "safer is the default --host with a tunnel (ssh -L)"
            )
        announce(f"Open http://{written}:{port}/?token={guard.token} in a browser; Ctrl-C ends it.")
        await server.serve(sockets=[listening])
        del shown
    finally:
        canvas.close()
        remote.loop.stop(force=True)
        desktop.close()


def _config(uvicorn: Any, guard: Guard, http: Any, ws: Any) -> "uvicorn.Config":
    return uvicorn.Config(
        guard,
        http=http,
        ws=ws,
        lifespan="off",
        log_config=None,
        log_level="critical",
        access_log=False,
        ws_max_size=MOST_BYTES,
        ws_per_message_deflate=False,
        ws_ping_interval=PATIENCE,
        ws_ping_timeout=PATIENCE,
        proxy_headers=False,
        server_header=False,
        timeout_graceful_shutdown=SHUTDOWN,
    )
