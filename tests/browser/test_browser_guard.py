"""The browser view's guard: who may come in, and what is served."""

import socket
from contextlib import ExitStack

import pytest
from browser_server import closed, frames, handshake, until
from rendercanvas import http as theirs

from airlight.viewer import browser, remote


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
        assert guard.allows_host(host), host
    for host in ("evil.example", "1.2.3.4.evil.example", "render.example.evil", "", ":80", "[", "http://localhost"):
        assert not guard.allows_host(host), host


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
