"""What clients of the browser view may say; the rest is dropped or ends them."""

import json
import math
from contextlib import suppress

import numpy as np
import pytest
from browser_server import KINDS, POINTER, SIZE, closed, say, taking, until
from hypothesis import given
from hypothesis import strategies as st
from rendercanvas import http as theirs
from websockets.exceptions import ConnectionClosed

from airlight.viewer import browser


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
            assert browser.decode_message(text) is None, text
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
    assert browser.decode_message(text) is None or json.loads(text)["type"] in (*KINDS, "key_down", "key_up", "char", "_framefeedback")


@given(NUMBER, NUMBER, NUMBER, NUMBER)
def test_numbers_are_finite_and_bounded(a, b, c, d):
    size = browser.decode_message(json.dumps({**SIZE, "pwidth": a, "pheight": b, "ratio": c, "width": d}))
    if size is not None:
        assert isinstance(size.pwidth, int) and isinstance(size.pheight, int)
        assert 1 <= size.pwidth <= 4096 and 1 <= size.pheight <= 4096 and size.pwidth * size.pheight <= 3840 * 2160
        assert 0 < size.ratio <= 10 and math.isclose(size.width, size.pwidth / size.ratio) and math.isfinite(size.height)
    wheel = browser.decode_message(json.dumps(dict(type="wheel", x=a, y=b, dx=c, dy=d, buttons=[], modifiers=[], timestamp=a)))
    if wheel is not None:
        assert max(abs(wheel.x), abs(wheel.y)) <= 8192 and max(abs(wheel.dx), abs(wheel.dy)) <= 10_000 and 0 <= wheel.timestamp <= 1e10


def test_a_huge_window_has_fewer_pixels_but_the_same_points():
    size = browser.decode_message(json.dumps({**SIZE, "pwidth": 5120, "pheight": 2880, "ratio": 2}))
    assert size.pwidth * size.pheight <= 3840 * 2160 and size.pwidth / size.pheight == pytest.approx(16 / 9, rel=1e-3)
    assert (size.width, size.height) == (pytest.approx(2560, rel=1e-3), pytest.approx(1440, rel=1e-3))
    plain = browser.decode_message(json.dumps({**SIZE, "pwidth": 3840, "pheight": 2160, "ratio": 2}))
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
