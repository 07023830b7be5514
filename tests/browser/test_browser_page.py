"""The page in a real browser."""

import signal
import socket
import threading
from contextlib import ExitStack

import numpy as np
import pytest
from browser_server import Where, process, shot, sockets, until
from rendercanvas import http as theirs

from airlight.viewer import remote

SIZE_SHOWN = "(() => { const p = document.getElementById('picture'); return [p.naturalWidth, p.naturalHeight] })()"
STATUS = "document.getElementById('status').textContent"


@pytest.mark.parametrize("ratio", [pytest.param(1, marks=pytest.mark.slow), 2])
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
