"""The browser view: every guard, by clients that break the rules, and the page in a real browser."""

import gc
import http.client
import json
import math
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time
from contextlib import ExitStack, contextmanager, suppress

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rendercanvas import http as theirs
from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from airlight.errors import AirlightError, AirlightWarning
from airlight.files import read_image
from airlight.viewer import browser, remote

SIZE = {"type": "resize", "width": 64, "height": 48, "pwidth": 64, "pheight": 48, "ratio": 1, "timestamp": 1}
POINTER = {"x": 5, "y": 6, "button": 1, "buttons": [1], "modifiers": ["Shift"], "ntouches": 0, "touches": {}, "timestamp": 2.5}
KINDS = ("resize", "close", "pointer_down", "pointer_up", "pointer_move", "pointer_enter", "pointer_leave", "double_click", "wheel")


def until(condition, seconds=5.0):
    """The condition's value once it is true."""
    end = time.monotonic() + seconds
    while not (value := condition()):
        assert time.monotonic() < end, "it did not come true in time"
        time.sleep(0.01)
    return value


class Live:
    """A served canvas of one colour, in a thread; every event is kept."""

    def __init__(self, host="127.0.0.1"):
        self.events, self.drawn, self.said, self.failed = [], 0, [], None
        self.ready = threading.Event()
        self.thread = threading.Thread(target=self._run, args=(host,))
        self.thread.start()
        assert self.ready.wait(20) and self.failed is None, self.failed
        self.url = re.search(r"http://\S+", self.said[0])[0]
        self.port = int(re.search(r":(\d+)/", self.url)[1])
        self.token = self.url.partition("token=")[2]
        self.home = f"127.0.0.1:{self.port}"

    def _run(self, host):
        try:
            browser.serve(self._start, host=host, announce=self._announced)
        except BaseException as error:
            self.failed = error
        self.ready.set()

    def _announced(self, text):
        self.said.append(text)
        self.ready.set()

    def _start(self, canvas):
        self.canvas = canvas
        context = canvas.get_bitmap_context()

        def draw():
            self.drawn += 1
            width, height = canvas.get_physical_size()
            context.set_bitmap(np.full((height, width, 4), (40, 90, self.drawn % 256, 255), np.uint8))

        canvas.add_event_handler(self.events.append, *KINDS, "key_down", "key_up", "char")
        canvas.request_draw(draw)
        canvas.set_title("A view")

    def stop(self):
        if self.thread.is_alive():
            remote.loop.call_soon_threadsafe(self.canvas.close)
        self.thread.join(10)
        assert not self.thread.is_alive() and self.failed is None, self.failed

    def get(self, path, host=None, cookie=None, method="GET"):
        """(status, headers, body) of a request, its path sent as it is."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=5)
        try:
            connection.putrequest(method, path, skip_host=True)
            for name, value in (("Host", host or self.home), ("Cookie", cookie)):
                if value is not None:
                    connection.putheader(name, value)
            connection.endheaders()
            answer = connection.getresponse()
            return answer.status, {name.lower(): value for name, value in answer.getheaders()}, answer.read()
        finally:
            connection.close()

    @property
    def cookie(self):
        return self.get(f"/?token={self.token}")[1]["set-cookie"].partition(";")[0]

    def open(self, host=None, origin=None, cookie=None, path="/ws", **more):
        """A websocket, ours unless told otherwise; "" leaves a header out."""
        host = host or self.home
        cookie = self.cookie if cookie is None else cookie
        return connect(
            f"ws://{host}{path}",
            sock=socket.create_connection(("127.0.0.1", self.port)),
            origin=(f"http://{host}" if origin is None else origin) or None,
            additional_headers={"Cookie": cookie} if cookie else None,
            compression=None,
            proxy=None,
            max_size=None,
            ping_interval=None,
            close_timeout=1,
            max_queue=None,
            **more,
        )

    def kinds(self):
        return [event["event_type"] for event in self.events]


@contextmanager
def live(**more):
    made = Live(**more)
    try:
        yield made
    finally:
        made.stop()


@pytest.fixture
def view():
    """A server of its own for each test: rendercanvas has one in a process."""
    with live() as made:
        yield made


def say(client, **message):
    client.send(json.dumps(message))


def frames(client, seconds, acknowledge=True):
    """The frames that arrive in some seconds, as (index, bytes)."""
    found, end = [], time.monotonic() + seconds
    while (left := end - time.monotonic()) > 0:
        try:
            got = client.recv(timeout=left)
        except TimeoutError:
            break
        if isinstance(got, bytes):
            header = client.header
            found.append((header["index"], got))
            if acknowledge:
                say(client, type="_framefeedback", index=header["index"], timestamp=header["timestamp"], localtime=1.0)
        else:
            client.header = json.loads(got)
    return found


def taking(client, condition):
    """Until the condition is true, with the client taking frames: events wait for frames to be taken."""
    until(lambda: frames(client, 0.02) is not None and condition())


def closed(client, seconds=5.0):
    """(code, reason) with which the server closes, or fails the test."""
    end = time.monotonic() + seconds
    with pytest.raises(ConnectionClosed) as caught:
        while time.monotonic() < end:
            client.recv(timeout=max(0.01, end - time.monotonic()))
    return caught.value.rcvd.code, caught.value.rcvd.reason


# Who may come in.


def test_the_token_becomes_a_cookie(view):
    status, headers, body = view.get(f"/?token={view.token}")
    assert status == 303 and headers["location"] == "/" and not body
    name, *attributes = headers["set-cookie"].split("; ")
    assert set(attributes) == {"Path=/", "HttpOnly", "SameSite=Strict"}
    assert view.token not in name and len(view.token) >= 43
    for path in ("/", "/view.js", "/view.css", "/renderview.js"):
        assert view.get(path)[0] == 403
        assert view.get(path, cookie=name[:-1] + "-")[0] == 403
        assert view.get(path, cookie=f"other=1; {name}")[0] == 200
    for wrong in ("?token=", "?token=" + view.token[:-1], "?token=" + "a" * 5000, "?token=%ff%00", "?" + "&".join(["token=a"] * 500)):
        assert view.get("/" + wrong)[0] == 403
    assert view.get("/view.js?token=" + view.token)[0] == 403  # exchanged at / only


def test_other_servers_have_other_secrets(view):
    first = (view.token, view.cookie)
    guards = [browser.Guard(None, "", "127.0.0.1", 1, True) for _ in range(2)]
    assert len({first[0], *(g.token for g in guards), *(g.secret for g in guards)}) == 5


@pytest.mark.parametrize("path", ["/", "/nothing", "/view.js"])
@pytest.mark.parametrize("known", [True, False])
def test_every_answer_has_the_headers(view, path, known):
    _, headers, _ = view.get(path, cookie=view.cookie if known else None)
    policy = dict(part.strip().split(" ", 1) for part in headers["content-security-policy"].split(";"))
    assert policy["default-src"] == policy["frame-ancestors"] == "'none'" and policy["script-src"] == policy["connect-src"] == "'self'"
    assert headers["x-frame-options"] == "DENY" and headers["x-content-type-options"] == "nosniff"
    assert headers["cache-control"] == "no-store" and headers["referrer-policy"] == "no-referrer" and "server" not in headers


@pytest.mark.parametrize(
    "path",
    [
        *(
            "/../pyproject.toml",
            "/..%2f..%2fetc/passwd",
            "/%2e%2e/browser.py",
            "/./",
            "//",
            "//etc/passwd",
            "/view.js/",
            "/page/index.html",
        ),
        *("/index.html", "/renderview-client.js", "/x/view.js", "/view.js%00", "/ws", "/etc/passwd", "/?/../view.js/.."),
    ],
)
def test_nothing_else_is_served(view, path):
    status, _, body = view.get(path, cookie=view.cookie)
    assert (status, len(body) < 100) == ((404, True) if not path.startswith("/?") else (200, False))
    assert view.get(path.partition("?")[0] + "x", cookie=view.cookie)[0] == 404


def test_only_get_is_answered(view):
    assert view.get("/", cookie=view.cookie, method="POST")[0] == 405
    assert view.get("/", cookie=view.cookie, method="HEAD")[2] == b""
    assert view.get(f"/?token={view.token}", method="POST")[0] == 405


def handshake_text(host, origin, cookie, path="/ws"):
    lines = [f"GET {path} HTTP/1.1", "Upgrade: websocket", "Connection: Upgrade", "Sec-WebSocket-Version: 13"]
    lines += ["Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ=="]
    lines += [f"{name}: {value}" for name, value in (("Host", host), ("Origin", origin), ("Cookie", cookie)) if value is not None]
    return "\r\n".join([*lines, "", ""]).encode()


def handshake(view, host, origin, cookie, path="/ws"):
    """The status of a websocket handshake with these headers; None leaves one out."""
    with socket.create_connection(("127.0.0.1", view.port), timeout=5) as raw:
        raw.sendall(handshake_text(host, origin, cookie, path))
        return int(raw.recv(4096).split()[1])


@pytest.mark.parametrize(
    "host", ["evil.example", "evil.example:80", "127.0.0.1.evil.example", "192.168.0.9", "localhost.", "[::1", "a@b:c"]
)
def test_another_host_is_another_site(view, host):
    assert view.get("/", host=host, cookie=view.cookie)[0] == 403
    assert view.get(f"/?token={view.token}", host=host)[0] == 403
    # as a browser whose DNS was rebound: Host and Origin agree, the cookie is there
    assert handshake(view, host, f"http://{host}", view.cookie) == 403
    assert view.canvas is not None and not theirs.asgi.get_count()


@pytest.mark.parametrize("host", ["localhost:9000", "127.0.0.1", "[::1]:80", "LOCALHOST"])
def test_a_tunnel_may_change_the_port(view, host):
    assert view.get("/", host=host, cookie=view.cookie)[0] == 200
    assert handshake(view, host, f"http://{host}", view.cookie) == 101


def test_a_websocket_needs_our_page(view):
    home, cookie = f"http://{view.home}", view.cookie
    port = view.port + 1 if view.port < 65535 else 1
    others = ["http://evil.example", f"http://127.0.0.1:{port}", "https://" + view.home, home + "/", home + ".", "null", "", None]
    for origin in others:
        assert handshake(view, view.home, origin, cookie) == 403, origin
    for wrong in (None, "", cookie[:-1], cookie + "x", cookie.replace("airlight", "other"), "airlight-1=" + cookie.partition("=")[2]):
        assert handshake(view, view.home, home, wrong) == 403, wrong
    for path in ("/", "/ws/", "/ws/x", "/view.js", "/../ws"):
        assert handshake(view, view.home, home, cookie, path) == 403, path
    assert handshake(view, view.home, home, f"{view.cookie}", f"/ws?token={view.token}") == 101
    until(lambda: not theirs.asgi.get_count())


def test_hosts_where_all_may_come():
    """With --host 0.0.0.0 the machine's addresses and names are ours; a name that a stranger gives to it is not."""
    guard = browser.Guard(None, "", "Render.Example", 80, False)
    for host in ("192.168.0.9:80", "[fe80::1]:80", "render.example", "localhost", socket.gethostname() + ":80"):
        assert guard._is_ours(host), host
    for host in ("evil.example", "1.2.3.4.evil.example", "render.example.evil", "", ":80", "[", "http://localhost"):
        assert not guard._is_ours(host), host


def test_at_most_eight_windows(view):
    with ExitStack() as all:
        clients = [all.enter_context(view.open()) for _ in range(8)]
        ninth = all.enter_context(view.open())
        code, reason = closed(ninth)
        assert code == 1013 and "8" in reason and theirs.asgi.get_count() == 8
        clients[3].close()
        until(lambda: theirs.asgi.get_count() == 7)
        assert frames(all.enter_context(view.open()), 0.5)


def test_connections_are_counted_before_they_say_anything(view, monkeypatch):
    monkeypatch.setattr(remote, "MOST_CONNECTIONS", 5)
    with ExitStack() as all:
        idle = [all.enter_context(socket.create_connection(("127.0.0.1", view.port), timeout=1)) for _ in range(5)]
        with socket.create_connection(("127.0.0.1", view.port), timeout=5) as sixth, pytest.raises((ConnectionError, IndexError)):
            sixth.sendall(b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n")
            sixth.recv(100).split()[1]
        idle[0].sendall(b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n")
        assert b"403" in idle[0].recv(100)


# What they may say.


def test_events_arrive_as_they_were_sent(view):
    with view.open() as client:
        say(client, **SIZE)
        for kind in ("pointer_down", "pointer_up", "pointer_move", "pointer_enter", "pointer_leave"):
            say(client, type=kind, **POINTER)
        say(client, type="double_click", **{k: v for k, v in POINTER.items() if k not in ("ntouches", "touches")})
        say(client, type="wheel", x=1, y=2, dx=0, dy=-120, buttons=[], modifiers=[], timestamp=3)
        say(client, type="key_down", key="a", modifiers=[], timestamp=3)
        say(client, type="key_up", key="a", modifiers=["Control"], timestamp=3)
        say(client, type="char", data="ä", is_composing=False, input_type="insertText", timestamp=3)
        taking(client, lambda: "char" in view.kinds())
    assert [kind for kind in view.kinds() if kind != "resize"] == [*KINDS[2:], "key_down", "key_up", "char"]
    down = next(e for e in view.events if e["event_type"] == "pointer_down")
    assert (down["x"], down["y"], down["button"], down["buttons"], down["modifiers"]) == (5, 6, 1, (1,), ("Shift",))
    assert next(e for e in view.events if e["event_type"] == "wheel")["dy"] == -120
    assert view.events[-1]["data"] == "ä" and view.canvas.get_physical_size() == (64, 48)


WRONG = [
    *("", "null", "[]", "1", '"close"', "{", "[" * 8000, '{"type":' * 2000, '{"type":"close","timestamp":1}', '{"type":"close"}'),
    *('{"type":"_clients_change","ids":[1]}', '{"type":"_clients_change","ids":[1],"timestamp":1}', '{"type":"_x","timestamp":1}'),
    *('{"type":"animate","timestamp":1}', '{"type":"before_draw","timestamp":1}', '{"type":"*","timestamp":1}', '{"type":["close"]}'),
    *(
        '{"type":"key_down","key":"' + "a" * 40 + '","modifiers":[],"timestamp":1}',
        '{"type":"key_down","key":1,"modifiers":[],"timestamp":1}',
    ),
    *('{"type":"key_down","key":"a","modifiers":["x"],"timestamp":1}', '{"type":"key_down","key":"a","modifiers":[]}'),
    '{"type":"key_down","key":"a","modifiers":[],"timestamp":1,"event_type":"close"}',
    '{"type":"key_down","key":"a","modifiers":[],"timestamp":NaN}',
    json.dumps({**SIZE, "pwidth": "64"}),
    json.dumps({**SIZE, "ratio": None}),
    json.dumps(SIZE).replace("64", "Infinity"),
    json.dumps(SIZE).replace("64", "1e999"),
    json.dumps({"type": "pointer_down", **POINTER, "x": True}),
    json.dumps({"type": "pointer_down", **POINTER, "button": 99}),
    json.dumps({"type": "pointer_down", **POINTER, "buttons": [1] * 100}),
    json.dumps({"type": "pointer_down", **POINTER, "touches": {"1": {}}}),
    json.dumps({"type": "pointer_down", **POINTER, "stop_propagation": True}),
    json.dumps({"type": "_framefeedback", "index": 1.5, "timestamp": 1, "localtime": 1}),
    json.dumps({"type": "_framefeedback", "index": 1, "timestamp": "x", "localtime": 1}),
]


def test_what_is_not_allowed_is_dropped(view, caplog):
    with view.open() as client, view.open() as second:
        say(client, **SIZE)
        taking(client, lambda: "resize" in view.kinds() and view.canvas.get_physical_size() == (64, 48))
        active = view.canvas._active_client
        for text in WRONG:
            assert browser.understood(text) is None, text
            client.send(text)
            second.send(text)
        client.send(b"\x00" * 100)
        say(client, type="key_down", key="end", modifiers=[], timestamp=1)
        taking(client, lambda: "key_down" in view.kinds())
        assert [kind for kind in view.kinds() if kind != "resize"] == ["key_down"]
        assert view.canvas._active_client == active and not view.canvas.get_closed() and theirs.asgi.get_count() == 2
    assert not caplog.records  # nor does rendercanvas complain about anything that it got


leaf = st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=40)
tree = st.recursive(leaf, lambda c: st.lists(c, max_size=3) | st.dictionaries(st.text(max_size=5), c, max_size=3), max_leaves=5)
ANY = st.dictionaries(st.sampled_from(["type", "x", "key", "event_type"]), tree)
NUMBER = st.floats() | st.integers() | st.sampled_from([1e308, -1e308, 10**400, 1e12, 5e-324, 0, -1])


@given(st.text(max_size=200) | ANY.map(json.dumps))
def test_whatever_is_said_is_refused_or_harmless(text):
    assert browser.understood(text) is None or json.loads(text)["type"] in (*KINDS, "key_down", "key_up", "char", "_framefeedback")


@given(NUMBER, NUMBER, NUMBER, NUMBER)
def test_numbers_are_finite_and_bounded(a, b, c, d):
    size = browser.understood(json.dumps({**SIZE, "pwidth": a, "pheight": b, "ratio": c, "width": d}))
    if size is not None:
        assert isinstance(size.pwidth, int) and isinstance(size.pheight, int)
        assert 1 <= size.pwidth <= 4096 and 1 <= size.pheight <= 4096 and size.pwidth * size.pheight <= 3840 * 2160
        assert 0 < size.ratio <= 10 and math.isclose(size.width, size.pwidth / size.ratio) and math.isfinite(size.height)
    wheel = browser.understood(json.dumps(dict(type="wheel", x=a, y=b, dx=c, dy=d, buttons=[], modifiers=[], timestamp=a)))
    if wheel is not None:
        assert max(abs(wheel.x), abs(wheel.y)) <= 8192 and max(abs(wheel.dx), abs(wheel.dy)) <= 10_000 and 0 <= wheel.timestamp <= 1e10


def test_a_huge_window_has_fewer_pixels_but_the_same_points():
    size = browser.understood(json.dumps({**SIZE, "pwidth": 5120, "pheight": 2880, "ratio": 2}))
    assert size.pwidth * size.pheight <= 3840 * 2160 and size.pwidth / size.pheight == pytest.approx(16 / 9, rel=1e-3)
    assert (size.width, size.height) == (pytest.approx(2560, rel=1e-3), pytest.approx(1440, rel=1e-3))
    plain = browser.understood(json.dumps({**SIZE, "pwidth": 3840, "pheight": 2160, "ratio": 2}))
    assert (plain.pwidth, plain.pheight, plain.ratio, plain.width) == (3840, 2160, 2, 1920)


def test_an_absurd_size_is_not_obeyed(view):
    with view.open() as client:
        for width, height in ((1e12, 1e12), (1e12, 1), (-5, -5), (0, 0), (64, 48)):
            say(client, **{**SIZE, "pwidth": width, "pheight": height})
            wanted = {1e12: (2880, 2880) if height > 1 else (4096, 1), 64: (64, 48)}.get(width, (1, 1))
            until(lambda wanted=wanted: np.abs(np.subtract(view.canvas.get_physical_size(), wanted)).max() <= 1)


def test_long_messages_end_it(view):
    with view.open() as client:
        client.send(" " * (browser.MOST_BYTES - len(text := json.dumps(SIZE))) + text)  # as long as may be
        taking(client, lambda: "resize" in view.kinds())
        client.send(" " * (browser.MOST_BYTES + 1 - len(text)) + text)
        assert closed(client)[0] == 1009
    with view.open() as client:
        with suppress(ConnectionClosed):
            client.send([" " * 8000, " " * 8000, " " * 8000])  # in fragments
        assert closed(client)[0] == 1009


def test_a_flood_ends_it(view, monkeypatch):
    passed = []
    monkeypatch.setattr(view.canvas, "submit_event", lambda event: passed.append(event["event_type"]))
    with view.open() as client, pytest.raises(ConnectionClosed):
        for _ in range(20_000):
            say(client, type="key_down", key="a", modifiers=[], timestamp=1)
        closed(client)
    until(lambda: not theirs.asgi.get_count())
    assert browser.BURST / 2 <= passed.count("key_down") <= browser.BURST + browser.RATE * 5
    with view.open() as client:
        for _ in range(100):
            say(client, type="key_up", key="a", modifiers=[], timestamp=1)
        until(lambda: passed.count("key_up") == 100)


# Who steers, and who is waited for.


def test_the_first_steers_and_the_others_watch(view):
    with view.open() as first:
        until(lambda: theirs.asgi.get_count() == 1)
        with view.open() as second:
            until(lambda: theirs.asgi.get_count() == 2)
            say(second, type="pointer_down", **{**POINTER, "x": 1})
            say(second, **{**SIZE, "pwidth": 100, "pheight": 100})
            say(first, type="pointer_down", **{**POINTER, "x": 2})
            taking(first, lambda: "pointer_down" in view.kinds())
            frames(first, 0.2)
            assert [e["x"] for e in view.events if e["event_type"] == "pointer_down"] == [2]
            assert view.canvas.get_physical_size() != (100, 100)
            first.close()
            until(lambda: theirs.asgi.get_count() == 1)
            say(second, type="pointer_down", **{**POINTER, "x": 3})
            taking(second, lambda: [e["x"] for e in view.events if e["event_type"] == "pointer_down"] == [2, 3])


@contextmanager
def drawing(view):
    """The canvas draws as fast as the steering client takes frames."""
    view.canvas.set_update_mode("continuous", max_fps=100)
    try:
        yield
    finally:
        view.canvas.set_update_mode("ondemand", max_fps=30)


def test_a_watcher_that_takes_nothing_gets_two_frames(view):
    with drawing(view), view.open() as first, view.open() as second:
        say(first, **SIZE)
        seen, ignored = [], []
        reader = threading.Thread(target=lambda: seen.extend(frames(first, 1.5)))
        reader.start()
        ignored = frames(second, 1.5, acknowledge=False)
        reader.join()
        assert len(ignored) == 2 < len(seen)


@pytest.mark.parametrize("index", [10**9, -1, 0, 3])
def test_frames_that_were_not_sent_cannot_be_acknowledged(view, index):
    with drawing(view), view.open() as client:
        say(client, **SIZE)
        assert len(frames(client, 0.5, acknowledge=False)) == 2
        say(client, type="_framefeedback", index=index, timestamp=1, localtime=1)
        assert not frames(client, 0.5, acknowledge=False)
        say(client, type="_framefeedback", index=2, timestamp=1, localtime=1)
        assert len(frames(client, 0.5, acknowledge=False)) == 2


def test_who_takes_no_frames_is_not_waited_for(view, monkeypatch):
    monkeypatch.setattr(browser, "PATIENCE", 1.0)
    seen = []
    with drawing(view), view.open() as dead, view.open() as second:
        reader = threading.Thread(target=lambda: seen.extend(frames(second, 2.0)))
        reader.start()
        assert closed(dead, 4)[0] == 1008
        reader.join()
        assert len(seen) > 2  # it steers now
        assert theirs.asgi.get_count() == 1


def stuck(view):
    """A connected websocket that reads nothing any more, with a small buffer."""
    raw = socket.socket()
    raw.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    raw.settimeout(5)
    raw.connect(("127.0.0.1", view.port))
    raw.sendall(handshake_text(view.home, f"http://{view.home}", view.cookie))
    assert raw.recv(12) == b"HTTP/1.1 101"
    return raw


def masked(opcode, data):
    """A short frame as a client sends it, under the mask 0."""
    return bytes([0x80 | opcode, 0x80 | len(data), 0, 0, 0, 0]) + data


def test_pings_that_nobody_reads_fill_no_memory(view, monkeypatch):
    most = []

    def seen(self):
        original(self)
        most.append(self.transport.get_write_buffer_size())

    original = remote.Socket.handle_ping
    monkeypatch.setattr(remote.Socket, "handle_ping", seen)
    with stuck(view) as raw:
        for _ in range(200):
            raw.sendall(masked(9, b"x" * 125) * 1000)  # 26 MB in all
    assert most and max(most) < 1 << 20


def test_a_client_that_reads_nothing_is_cut_off(view, monkeypatch):
    monkeypatch.setattr(browser, "PATIENCE", 0.5)
    monkeypatch.setattr(remote, "encode", lambda *_: ("image/jpeg", bytes(20_000_000)))  # more than buffers on the way hold
    monkeypatch.setattr(theirs, "encode_array", remote.encode)
    with drawing(view), stuck(view) as raw:
        until(lambda: theirs.asgi.get_count() == 1)
        until(lambda: not theirs.asgi.get_count())
        time.sleep(browser.CLOSE_TIME + remote.LINGER + 0.5)
        with pytest.raises(OSError):  # reset: the server holds it no more, nor what it should have taken
            for _ in range(10):
                raw.sendall(masked(1, b"{}"))
                time.sleep(0.05)


# Beginning and end.


def test_a_client_that_hangs_does_not_outlive_the_end():
    """Its connection holds what it does not take; all is released in time, without a warning (which pytest makes an error)."""
    with live() as seen, stuck(seen) as raw:
        raw.sendall(masked(9, b"x" * 125) * 60_000)
        until(lambda: any(s.transport.get_write_buffer_size() for s in sockets()))
        hanging = [s.transport for s in sockets()]
        begun = time.monotonic()
        seen.stop()
        assert time.monotonic() - begun < 1
        assert all_closed(hanging)


def all_closed(transports):
    return all(transport.is_closing() and not transport.get_write_buffer_size() for transport in transports)


def sockets():
    """The server's ends of what is connected."""
    return [o for o in gc.get_objects() if issubclass(type(o), remote.Socket) and not o.disconnected]  # asks no weak proxy


def test_a_taken_port_is_one_line():
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        with pytest.raises(AirlightError, match=f"port {port} of 127.0.0.1 is taken; give another --port") as caught:
            browser.serve(lambda canvas: None, port=port)
    assert "\n" not in str(caught.value) and caught.value.exit_code == 2


@pytest.mark.parametrize("host", ["no.such.host.invalid", "203.0.113.1", "", "x" * 300])
def test_a_host_that_is_not_ours_is_one_line(host):
    with pytest.raises(AirlightError, match="give another --host or --port") as caught:
        browser.serve(lambda canvas: None, host=host)
    assert "\n" not in str(caught.value)


def test_what_start_raises_comes_out_and_all_is_closed():
    canvases = []

    def fail(canvas):
        canvases.append(canvas)
        raise AirlightError("no such scene")

    before = signal.getsignal(signal.SIGINT)
    with pytest.raises(AirlightError, match="no such scene"):
        browser.serve(fail, announce=pytest.fail)
    assert canvases[0].get_closed() and signal.getsignal(signal.SIGINT) is before
    with live() as again:
        assert again.get("/", cookie=again.cookie)[0] == 200


def test_other_machines_only_with_a_warning():
    with pytest.warns(AirlightWarning, match="whoever has the address") as said, live(host="0.0.0.0") as seen:
        assert f"http://{socket.gethostname()}:{seen.port}/?token=" in seen.said[0]
        assert seen.get("/", host=f"192.168.0.9:{seen.port}", cookie=seen.cookie)[0] == 200
        assert seen.get("/", host="evil.example", cookie=seen.cookie)[0] == 403
    assert len(said) == 1


APP = """
import signal
import wgpu
from airlight.viewer.browser import serve

handlers = [signal.getsignal(n) for n in (signal.SIGINT, signal.SIGTERM)]

def start(canvas):
    device = wgpu.gpu.request_adapter_sync().request_device_sync()
    context = canvas.get_wgpu_context()
    context.configure(device=device, format=context.get_preferred_format(device.adapter).removesuffix("-srgb"))
    color = [0.2, 0.2, 0.2]

    def draw():
        view = context.get_current_texture().create_view()
        encoder = device.create_command_encoder()
        clear = {"view": view, "load_op": "clear", "store_op": "store", "clear_value": (*color, 1)}
        encoder.begin_render_pass(color_attachments=[clear]).end()
        device.queue.submit([encoder.finish()])

    def moved(event):
        width, height = canvas.get_logical_size()
        color[:] = event["x"] / width, event["y"] / height, 0.5
        canvas.request_draw()

    def key(event):
        color[:] = (1, 1, 0) if event["key"] == "y" else (0, 0, 0)
        canvas.request_draw()

    canvas.add_event_handler(moved, "pointer_down", "pointer_move")
    canvas.add_event_handler(key, "key_down")
    canvas.request_draw(draw)

serve(start, announce=lambda text: print(text, flush=True))
kept = handlers == [signal.getsignal(n) for n in (signal.SIGINT, signal.SIGTERM)]
print("ended" if kept else "ended, with other handlers of signals", flush=True)
"""


@contextmanager
def process(*arguments):
    """A program that serves, and the address that it says."""
    child = subprocess.Popen([sys.executable, "-c", APP, *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        yield child, re.search(r"http://\S+", child.stdout.readline())[0]
    finally:
        child.kill()
        child.communicate()


class Where:
    """What `stuck` and `handshake_text` need of a server in another process."""

    def __init__(self, url):
        self.port = int(re.search(r":(\d+)/", url)[1])
        self.home = f"127.0.0.1:{self.port}"
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=5)
        connection.request("GET", "/?" + url.partition("?")[2])
        self.cookie = connection.getresponse().getheader("set-cookie").partition(";")[0]
        connection.close()


@pytest.mark.skipif(sys.platform == "win32", reason="there are no such signals")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_ctrl_c_ends_it_at_once_also_with_a_client_that_hangs(number):
    with process() as (child, url), stuck(Where(url)), socket.create_connection(("127.0.0.1", Where(url).port)):
        time.sleep(0.3)
        begun = time.monotonic()
        child.send_signal(number)
        assert child.stdout.readline() == "ended\n"
        assert time.monotonic() - begun < 1
        assert child.wait(5) == 0
        assert not [line for line in child.stderr.read().splitlines() if "XDG" not in line]


LOADING = """
import signal
from airlight.viewer.browser import serve

def start(canvas):
    signal.raise_signal(signal.SIGINT)
    print("it went on")

try:
    serve(start)
except KeyboardInterrupt:
    print("stopped")
"""


def test_ctrl_c_ends_what_is_still_loading():
    done = subprocess.run([sys.executable, "-c", LOADING], capture_output=True, text=True, timeout=30)
    assert done.stdout == "stopped\n" and not [line for line in done.stderr.splitlines() if "XDG" not in line]


# What is rendercanvas' and uvicorn's own.


def test_frames_keep_their_picture(tmp_path):
    y, x = np.mgrid[:90, :160]
    array = np.stack([x, y, (x + y) % 256, 255 + 0 * x], axis=2).astype(np.uint8)
    for quality, mime, name, off in ((remote.QUALITY, "image/jpeg", "a.jpg", 8), (100, "image/png", "a.png", 0)):
        kind, data = remote.encode(array, quality)
        (tmp_path / name).write_bytes(data)
        codes = read_image(tmp_path / name).codes
        assert kind == mime and codes.shape == (90, 160, 3)
        assert np.abs(codes.astype(int) - array[..., :3]).max() <= off


def test_an_idle_picture_becomes_exact(view):
    with view.open() as client:
        say(client, **SIZE)
        kinds = []
        for _, data in frames(client, 1.0):
            kinds.append("png" if data[:4] == b"\x89PNG" else "jpeg")
        assert kinds[0] == "jpeg" and kinds[-1] == "png"


@pytest.mark.parametrize(
    ("owner", "name"),
    [
        *((theirs.HttpRenderCanvas, n) for n in ("_quality", "_rc_set_title", "_rc_close", "_update_active_states", "_encode_frame")),
        *((theirs, n) for n in ("encode_array", "asgi", "loop")),
        *((WebSocketsSansIOProtocol, n) for n in ("handle_ping", "keepalive_timeout", "on_task_complete", "shutdown")),
        (H11Protocol, "connection_made"),
    ],
)
def test_private_names_are_still_there(owner, name):
    """What viewer/remote.py overrides. Where one is gone, its replacement does nothing: look for the new name."""
    assert hasattr(owner, name), f"{owner.__name__}.{name} is gone from this version"


def test_private_attributes_are_still_there(view):
    canvas = view.canvas
    assert canvas._is_closed is False and canvas._size_info["physical_size"] == canvas.get_physical_size()
    assert "encode_array" in theirs.HttpRenderCanvas._encode_frame.__code__.co_names
    assert callable(canvas._size_info.set_physical_size)


# In a real browser.


@pytest.fixture(scope="module")
def chromium():
    path = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if path is None:
        assert os.environ.get("CI") != "true", "no chromium: scripts/ensure_chromium.sh installs it"
        pytest.skip("no chromium")
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        started = playwright.chromium.launch(executable_path=path, args=["--no-sandbox"])
        yield started
        started.close()


SIZE_SHOWN = "(() => { const p = document.getElementById('picture'); return [p.naturalWidth, p.naturalHeight] })()"
STATUS = "document.getElementById('status').textContent"


def shot(page, path):
    page.screenshot(path=path)
    return read_image(path).codes[..., :3].astype(int)


@pytest.mark.parametrize("ratio", [1, 2])
def test_a_browser_shows_and_steers(chromium, tmp_path, ratio):
    """The picture fills the window pixel by pixel, follows pointer and keys; the page says when it is alone, and comes back."""
    path = tmp_path / "shot.png"
    with process() as (child, url), ExitStack() as all:
        context = chromium.new_context(viewport={"width": 600, "height": 400}, device_scale_factor=ratio)
        all.callback(context.close)
        page = context.new_page()
        trouble, asked = [], []
        page.on("console", lambda message: trouble.append(message.text))
        page.on("pageerror", lambda error: trouble.append(str(error)))
        page.on("request", lambda request: asked.append(request.url))
        page.goto(url)
        until(lambda: page.evaluate(SIZE_SHOWN) == [600 * ratio, 400 * ratio], 20)
        assert page.url == url.partition("?")[0] and page.evaluate("document.cookie") == ""
        until(lambda: np.ptp(shot(page, path), axis=(0, 1)).max() == 0)  # nothing but the picture: no status, no border
        grey = shot(page, path)
        assert grey.shape == (400 * ratio, 600 * ratio, 3) and np.abs(grey - round(255 * 0.2)).max() <= 1

        def shown(color):
            return np.abs(shot(page, path)[200] - np.round(np.multiply(255, color))).max() <= 2

        page.mouse.move(450, 100)
        until(lambda: shown((0.75, 0.25, 0.5)))
        page.mouse.move(60, 360)
        page.mouse.down()
        until(lambda: shown((0.1, 0.9, 0.5)))
        page.mouse.up()
        page.keyboard.press("y")
        until(lambda: shown((1, 1, 0)))

        second = context.new_page()
        second.goto(url)
        until(lambda: second.evaluate(STATUS).startswith("Watching"))
        assert page.evaluate(STATUS) == ""
        second.mouse.click(300, 200)
        page.set_viewport_size({"width": 500, "height": 300})
        until(lambda: page.evaluate(SIZE_SHOWN) == [500 * ratio, 300 * ratio])
        assert shown((1, 1, 0))  # the watcher's click did nothing
        page.goto("about:blank")
        until(lambda: second.evaluate(STATUS) == "")
        second.mouse.click(300, 200)
        until(lambda: np.abs(shot(second, path)[200, 300] - (128, 128, 128)).max() <= 2)
        assert not trouble and {address.partition("/")[2].split("/")[1] for address in asked} == {f"127.0.0.1:{Where(url).port}"}

        child.send_signal(signal.SIGINT)
        until(lambda: second.evaluate(STATUS).startswith("Disconnected"))


def test_a_quick_drag_keeps_its_order_and_end(chromium, view):
    """Moves are sent in bundles, yet before the button is up; turns of the wheel are added up."""
    page = chromium.new_page()
    page.goto(view.url)
    until(lambda: page.evaluate(SIZE_SHOWN)[0] > 64)
    assert page.title() == "A view"
    page.mouse.move(100, 100)
    page.mouse.down()
    page.mouse.move(300, 150, steps=10)
    page.mouse.up()
    for _ in range(5):
        page.mouse.wheel(0, 40)
    page.keyboard.press("a")
    until(lambda: "key_up" in view.kinds())
    kinds = [kind for kind in view.kinds() if kind != "resize"]
    up = kinds.index("pointer_up")
    found = [event for event in view.events if event["event_type"] != "resize"]
    assert kinds.index("pointer_down") < up and kinds[up - 1] == "pointer_move"
    assert (found[up - 1]["x"], found[up - 1]["y"], found[up - 1]["buttons"]) == (300, 150, (1,))
    assert sum(event["dy"] for event in found if event["event_type"] == "wheel") == 200
    page.close()


def test_a_page_comes_back_by_itself(chromium, view):
    page = chromium.new_page()
    page.goto(view.url)
    until(lambda: page.evaluate(SIZE_SHOWN)[0] > 64)
    before = view.canvas._active_client
    remote.loop.call_soon_threadsafe(lambda: [s.send({"type": "title", "value": "x" * 10}) for s in theirs.asgi._websockets.values()])
    until(lambda: page.title() == "x" * 10)
    remote.loop.call_soon_threadsafe(lambda: [t.transport.abort() for t in sockets()])
    until(lambda: view.canvas._active_client > before)
    until(lambda: page.evaluate(STATUS) == "")
    count = view.drawn
    page.set_viewport_size({"width": 300, "height": 200})
    until(lambda: view.drawn > count and page.evaluate(SIZE_SHOWN) == [300, 200])
    page.close()


def test_a_page_of_another_site_gets_nothing(chromium, view):
    """A browser that holds the cookie, on a page of another origin: no frame, no script, no websocket."""
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]

        def answer():
            connection, _ = other.accept()
            with connection:
                connection.recv(4096)
                connection.sendall(b"HTTP/1.1 200 OK\r\nContent-Type: text/html\r\nConnection: close\r\n\r\n<h1>other</h1>")

        thread = threading.Thread(target=answer, daemon=True)
        thread.start()
        context = chromium.new_context()
        page = context.new_page()
        page.goto(view.url)  # the cookie is there
        until(lambda: page.evaluate(SIZE_SHOWN)[0] > 64)
        page.goto("about:blank")
        until(lambda: not theirs.asgi.get_count())
        page.goto(f"http://127.0.0.1:{port}/")
        said = page.evaluate(
            """home => new Promise(done => { const s = new WebSocket(`ws://${home}/ws`);
               s.onopen = () => done('open'); s.onclose = e => done('closed ' + e.code) })""",
            view.home,
        )
        assert said == "closed 1006"
        assert (
            page.evaluate("home => fetch(`http://${home}/`, {credentials: 'include'}).then(() => 'read', () => 'refused')", view.home)
            == "refused"
        )
        context.close()
        thread.join(5)
