"""Several clients of one view: who steers, who watches, and who is not waited for."""

import threading
import time

import pytest
from browser_server import POINTER, SIZE, closed, drawing, frames, masked, say, stuck, taking, until
from rendercanvas import http as theirs

from airlight.viewer import browser, remote


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
