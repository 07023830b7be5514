"""The server's beginning and end: ports, hosts, signals, clients that hang."""

import signal
import socket
import subprocess
import sys
import time

import pytest
from browser_server import Where, all_closed, live, masked, process, sockets, stuck, until

from airlight.errors import AirlightError, AirlightWarning
from airlight.viewer import browser


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
