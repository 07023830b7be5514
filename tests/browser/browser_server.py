"""Serve a canvas to clients that keep the rules or break them."""

import gc
import http.client
import json
import re
import socket
import subprocess
import sys
import threading
import time
from contextlib import contextmanager

import numpy as np
import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

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
        self.shade, self.still = 0, False  # blue; whether it stays
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
            self.shade += not self.still
            width, height = canvas.get_physical_size()
            context.set_bitmap(np.full((height, width, 4), (40, 90, self.shade % 256, 255), np.uint8))

        canvas.add_event_handler(self.events.append, *KINDS, "key_down", "key_up", "char")
        canvas.request_draw(draw)
        canvas.set_title("A view")

    def draw_again(self):
        """Draw one frame more, and wait for it."""
        before = self.drawn
        remote.loop.call_soon_threadsafe(self.canvas.request_draw)
        until(lambda: self.drawn > before)

    def stop(self):
        if self.thread.is_alive():
            remote.loop.call_soon_threadsafe(self.canvas.close)
        self.thread.join(10)
        assert not self.thread.is_alive() and self.failed is None, self.failed

    def call(self, what):
        """Do something in the server's thread."""
        remote.loop.call_soon_threadsafe(what)

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


def shot(page, path):
    page.screenshot(path=path)
    return read_image(path).codes[..., :3].astype(int)


@contextmanager
def live(**more):
    made = Live(**more)
    try:
        yield made
    finally:
        made.stop()


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


@contextmanager
def drawing(view):
    """The canvas draws as fast as the steering client takes frames."""
    view.canvas.set_update_mode("continuous", max_fps=100)
    try:
        yield
    finally:
        view.canvas.set_update_mode("ondemand", max_fps=30)


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


def all_closed(transports):
    return all(transport.is_closing() and not transport.get_write_buffer_size() for transport in transports)


def sockets():
    """The server's ends of what is connected."""
    return [o for o in gc.get_objects() if issubclass(type(o), remote.Socket) and not o.disconnected]  # asks no weak proxy


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
