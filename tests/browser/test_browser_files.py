"""Files and texts that pass between the page and the server: bytes, never paths, and from the window that steers alone."""

import http.client
import json
import os
import re
import subprocess
import sys
from pathlib import Path
from urllib.parse import quote

import numpy as np
import pytest
from browser_server import frames, say, shot, taking, until
from hypothesis import given
from hypothesis import strategies as some

from airlight.files import write_image
from airlight.viewer import download, upload

BYTES = bytes(range(256)) * 700


def key_of(client, seconds=0.3):
    """The key that a client was given, if any."""
    key = None
    end = 0
    while end < 40:
        try:
            got = client.recv(timeout=seconds)
        except TimeoutError:
            break
        end += 1
        if isinstance(got, str) and (message := json.loads(got))["type"] == "key":
            key = message["value"]
    return key


def post(view, body=BYTES, name="a.png", method="POST", path="/file", **changed):
    """(status, line) of a file that is sent; changed: headers, None leaves one out."""
    headers = {"host": view.home, "origin": f"http://{view.home}", "cookie": view.cookie, "content-length": str(len(body))}
    headers |= {"x-airlight-key": view.canvas.desktop.key, "x-file-name": quote(name)}
    headers |= {header.replace("_", "-"): value for header, value in changed.items()}
    connection = http.client.HTTPConnection("127.0.0.1", view.port, timeout=5)
    try:
        connection.putrequest(method, path, skip_host=True, skip_accept_encoding=True)
        for header, value in headers.items():
            if value is not None:
                connection.putheader(header, value)
        connection.endheaders()
        if body:
            connection.send(body)
        answer = connection.getresponse()
        return answer.status, answer.read().decode()
    finally:
        connection.close()


def test_a_file_arrives_as_its_bytes_and_goes_at_the_end(view):
    woken = []
    view.canvas.desktop.wake = lambda: woken.append(True)
    assert post(view, name="été/../Sun \u202egnp.png") == (200, "") and woken == [True]
    (path,) = view.canvas.desktop.arrived.popleft()
    assert Path(path).read_bytes() == BYTES and os.path.basename(path) == "Sun _gnp.png"
    assert view.canvas.desktop.names == {path: "Sun _gnp.png"}
    assert post(view, b"other", name="Sun \u202egnp.png")[0] == 200
    (second,) = view.canvas.desktop.arrived.popleft()
    assert view.canvas.desktop.names[second] == "Sun _gnp (2).png" and Path(path).read_bytes() == BYTES
    folder = Path(path).parents[1]
    assert os.name == "nt" or folder.stat().st_mode & 0o077 == 0
    view.stop()
    assert not folder.exists()


@pytest.mark.parametrize(
    "wrong",
    [
        *({"cookie": None}, {"cookie": "airlight-1=x"}, {"origin": None}, {"origin": "http://evil.example"}, {"origin": "null"}),
        *({"host": "evil.example", "origin": "http://evil.example"}, {"x_airlight_key": None}, {"x_airlight_key": "x"}),
    ],
)
def test_others_send_nothing(view, wrong):
    status, line = post(view, b"", content_length="0", **wrong)
    assert status == 403 and line.count("\n") == 1
    assert not view.canvas.desktop.arrived and not view.canvas.desktop.names


def test_a_file_is_refused_before_it_is_read(view, monkeypatch):
    most = upload.MOST_FILE
    status, line = post(view, b"", name="big.exr", content_length=str(most + 1))  # not a byte is sent
    assert (status, line) == (413, "big.exr: has 512 MiB; at most 512 MiB can be sent\n")
    for length in (None, "-1", "1e3", "9" * 30, "x"):
        assert post(view, b"", content_length=length)[0] in (400, 411)
    for method in ("GET", "PUT", "OPTIONS", "DELETE"):
        assert post(view, b"", method=method, content_length="0")[0] == 405
    monkeypatch.setattr(upload, "MOST_FILE", 10)
    assert post(view, b"x" * 10)[0] == 200 and post(view, b"", content_length="11")[0] == 413
    assert len(view.canvas.desktop.names) == 1


def test_what_does_not_arrive_whole_leaves_nothing(view, monkeypatch):
    monkeypatch.setattr(upload, "STALL", 0.2)
    desktop = view.canvas.desktop
    assert post(view, BYTES, content_length=str(len(BYTES) + 1)) == (400, "a.png: did not arrive whole; send it again\n")
    assert not desktop.names and not desktop.busy and os.listdir(desktop.folder) == []
    monkeypatch.setattr(upload.PageDesktop, "busy", True, raising=False)
    desktop.busy = True
    assert post(view, b"", content_length="5")[0] == 409
    desktop.busy = False
    assert post(view)[0] == 200


def test_the_user_of_a_browser_has_no_paths(view):
    assert view.canvas.desktop.has_paths is False


def test_a_full_disk_is_told(view, monkeypatch):
    def full(*_, **__):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(upload, "open", full, raising=False)
    status, line = post(view)
    assert status == 507 and line.startswith("a.png: cannot be kept (No space left on device)") and not view.canvas.desktop.names
    monkeypatch.undo()
    assert post(view)[0] == 200


def test_the_last_files_are_kept_and_the_one_that_is_shown(view):
    desktop = view.canvas.desktop
    assert post(view, b"first")[0] == 200
    (desktop.in_use,) = desktop.arrived.popleft()
    for i in range(upload.MOST_KEPT + 2):
        assert post(view, b"x", name=f"{i}.png")[0] == 200
    assert len(desktop.names) == upload.MOST_KEPT and desktop.in_use in desktop.names
    gone = desktop.arrived[0][0]
    assert desktop.lacks(gone) and not desktop.lacks(desktop.in_use) and not os.path.exists(gone)


@given(some.text(max_size=300) | some.sampled_from(["..", ".", "", "/", "a/..", "C:\\x\\..", "a\0b.png", "é" * 300 + ".tiff", ".hidden"]))
def test_names_are_names(name):
    made = upload.file_name(quote(name, errors="replace"))
    assert made and made not in (".", "..") and len(made) <= upload.MOST_NAME and made == os.path.basename(made)
    assert not re.search(r'[\x00-\x1f/\\:*?"<>|]', made)
    assert upload.file_name("Sun%20over%20%C3%A9.jpg") == "Sun over é.jpg"


def test_only_the_window_that_steers_has_the_key(view):
    with view.open() as first:
        key = key_of(first)
        assert key == view.canvas.desktop.key
        with view.open() as second:
            assert key_of(second) is None
            key = key_of(first) or key  # it may be another one by now
            say(second, type="paste", text="not mine", timestamp=1)
            say(first, type="paste", text="mine", timestamp=1)
            until(lambda: view.canvas.desktop.paste() == "mine")
            assert post(view, x_airlight_key=key)[0] == 200
            first.close()
            assert until(lambda: key_of(second)) == view.canvas.desktop.key != key
    assert post(view, x_airlight_key=key)[0] == 403
    with view.open() as client:  # too long, or no text
        say(client, type="paste", text="x" * 4097, timestamp=1)
        say(client, type="paste", text=5, timestamp=1)
        say(client, type="key_down", key="a", modifiers=[], timestamp=1)
        taking(client, lambda: "key_down" in view.kinds())
        assert frames(client, 0.1) is not None and view.canvas.desktop.paste() == "mine"


def test_a_saved_picture_is_given_for_its_ticket_alone(view, tmp_path):
    kept, said, desktop = tmp_path / "été out.png", [], view.canvas.desktop
    kept.write_bytes(BYTES * 10)
    desktop.say = said.append
    desktop.deliver(str(kept))
    (told,) = said
    address = f"/{told['value']}"
    assert told["type"] == "download" and told["name"] == kept.name and re.fullmatch(r"/saved/[\w-]{43}", address)
    status, headers, body = view.get(address, cookie=view.cookie)
    assert status == 200 and body == BYTES * 10
    headers = {name.lower(): value for name, value in dict(headers).items()}
    assert headers["content-disposition"] == "attachment; filename*=UTF-8''%C3%A9t%C3%A9%20out.png"
    assert headers["x-content-type-options"] == "nosniff" and headers["content-type"] == "application/octet-stream"
    assert view.get(address)[0] == view.get(address, cookie="airlight-1=x")[0] == 403
    assert view.get(address, host="evil.example", cookie=view.cookie)[0] == 403
    for wrong in (address[:-1], "/saved/", "/saved/etc/hostname", "/saved/..%2fview.js", "/saved/../view.js", f"{address}/"):
        assert view.get(wrong, cookie=view.cookie)[0] == 404
    assert view.get(address, cookie=view.cookie, method="DELETE")[0] == 405
    kept.unlink()
    assert view.get(address, cookie=view.cookie)[0] == 404
    for _ in range(download.MOST_TICKETS):
        desktop.deliver(str(kept))
    kept.write_bytes(b"x")
    assert view.get(address, cookie=view.cookie)[0] == 404  # too old


LINE = "document.getElementById('line').textContent"


def test_a_page_sends_files(chromium, view, tmp_path):
    """By its dialog, which the panel's button opens, and dropped onto it; what is too large is not sent."""
    page = chromium.new_page()
    page.goto(view.url)
    until(lambda: page.evaluate("document.getElementById('picture').naturalWidth > 64"))
    (tmp_path / "été.png").write_bytes(BYTES)
    desktop = view.canvas.desktop
    dialogs = []
    page.on("filechooser", lambda found: dialogs.append(found))
    page.mouse.click(100, 100)  # the browser opens its dialog for a user only
    view.call(lambda: desktop.choose(""))
    until(lambda: page.evaluate("1") and dialogs)
    dialogs[0].set_files(tmp_path / "été.png")
    until(lambda: desktop.arrived)
    (path,) = desktop.arrived.popleft()
    assert Path(path).read_bytes() == BYTES and desktop.names[path] == "été.png"
    until(lambda: page.evaluate(LINE) == "")

    drop = """names => { const data = new DataTransfer();
      for (const name of names) data.items.add(new File(['of ' + name], name));
      for (const kind of ['dragenter', 'dragover', 'drop'])
        document.body.dispatchEvent(new DragEvent(kind, {dataTransfer: data, bubbles: true, cancelable: true})) }"""
    page.evaluate(drop, ["one.glb", "two.glb"])
    until(lambda: desktop.arrived)
    assert Path(desktop.arrived.popleft()[0]).read_bytes() == b"of one.glb" and not desktop.arrived
    until(lambda: page.evaluate(LINE) == "one.glb is shown, the first of 2 files")
    assert "dropping" not in page.evaluate("document.body.className")

    page.evaluate(
        """() => { const data = new DataTransfer(); const file = new File(['x'], 'huge.exr');
        Object.defineProperty(file, 'size', {value: 600 * 1048576}); data.items.add(new File([], 'y'));
        Object.defineProperty(data, 'files', {value: [file]});
        document.body.dispatchEvent(new DragEvent('drop', {dataTransfer: data, bubbles: true, cancelable: true})) }"""
    )
    assert page.evaluate(LINE) == "huge.exr: has 600 MiB; at most 512 MiB can be sent"
    page.close()


def test_a_page_keeps_what_was_saved(chromium, view, tmp_path):
    page = chromium.new_page()
    page.goto(view.url)
    until(lambda: page.evaluate("document.getElementById('picture').naturalWidth > 64"))
    (tmp_path / "été out.png").write_bytes(BYTES)
    with page.expect_download() as waited:
        view.call(lambda: view.canvas.desktop.deliver(str(tmp_path / "été out.png")))
    assert waited.value.suggested_filename == "été out.png" and Path(waited.value.path()).read_bytes() == BYTES
    assert page.evaluate(LINE) == "été out.png goes to the browser's downloads"
    page.close()


def test_a_text_reaches_the_browsers_clipboard(chromium, view):
    """And where the browser does not let it, a dialog has it, selected."""
    context = chromium.new_context()
    context.grant_permissions(["clipboard-read", "clipboard-write"])
    page = context.new_page()
    page.goto(view.url)
    until(lambda: page.evaluate("document.getElementById('picture').naturalWidth > 64"))
    page.mouse.click(100, 100)
    view.call(lambda: view.canvas.desktop.copy("airlight image 'a é.png' -o b.png"))
    until(lambda: page.evaluate(LINE) == "Copied")
    assert page.evaluate("navigator.clipboard.readText()") == "airlight image 'a é.png' -o b.png"

    page.evaluate("navigator.clipboard.writeText('from elsewhere')")
    page.keyboard.press("Control+v")
    until(lambda: view.canvas.desktop.paste() == "from elsewhere")
    until(lambda: [e["key"] for e in view.events if e["event_type"] == "key_down"] == ["Control", "v"])

    page.evaluate("Object.defineProperty(navigator, 'clipboard', {value: undefined})")  # as on a page that is not secure
    view.call(lambda: view.canvas.desktop.copy("a longer text"))
    until(lambda: page.evaluate("document.getElementById('copying').open"))
    assert page.evaluate("getSelection().toString()") == "a longer text"
    page.click("#copy")
    until(lambda: page.evaluate(LINE) == "Copied")
    page.evaluate("delete navigator.clipboard")
    assert page.evaluate("document.getElementById('copying').open") is False
    context.close()


@pytest.mark.slow
def test_the_viewer_in_a_browser_opens_saves_and_copies(chromium, tmp_path):
    """The command itself: a picture is sent, shown, refused where it is none; the command that is copied names it as the user does."""
    y, x = np.mgrid[:120, :200]
    sun = np.exp(-((x - 60) ** 2 + (y - 40) ** 2) / 200) + 0.1
    for name, tint in (("first.png", (1, 0.2, 0.2)), ("second.png", (0.2, 0.2, 1))):
        write_image(tmp_path / name, None, encoded=np.rint(255 * np.clip(sun[..., None] * tint, 0, 1)).astype(np.uint8))
    (tmp_path / "bad.png").write_bytes(b"no picture")
    away = tmp_path / "away"
    away.mkdir()
    command = [sys.executable, "-m", "airlight", "view", str(tmp_path / "first.png"), "--browser"]
    child = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=away)
    try:
        url = re.search(r"http://\S+", child.stdout.readline())[0]
        context = chromium.new_context(viewport={"width": 1000, "height": 600})
        context.grant_permissions(["clipboard-read", "clipboard-write"])
        page = context.new_page()
        page.goto(url)

        def blue():
            codes = shot(page, tmp_path / "shot.png")[300:420, 500:800]
            return codes[..., 2].mean() - codes[..., 0].mean()

        until(lambda: blue() < -10, 60)
        with page.expect_file_chooser() as waited:
            page.mouse.click(60, 20)  # Open ...
        waited.value.set_files(tmp_path / "second.png")
        until(lambda: blue() > 10, 60)
        page.keyboard.press("Control+c")
        until(lambda: page.evaluate(LINE) == "Copied", 10)
        assert page.evaluate("navigator.clipboard.readText()").startswith("airlight image second.png -o second-shafts.png")
        with page.expect_download() as saved:
            page.keyboard.press("Control+s")
        assert Path(saved.value.path()).read_bytes() == (away / "second-shafts.png").read_bytes()
        with page.expect_file_chooser() as waited:
            page.keyboard.press("Control+o")
        waited.value.set_files(tmp_path / "bad.png")
        until(lambda: page.evaluate(LINE) == "", 20)
        page.wait_for_timeout(1000)
        assert blue() > 10  # and a line says what is wrong
        context.close()
    finally:
        child.terminate()
        child.communicate(timeout=20)


def test_a_viewer_that_ends_badly_leaves_no_file():
    """The supervisor removes the folder, also after a kill."""
    code = """
import os, signal, sys
from airlight.process.supervisor import supervised
from airlight.viewer.upload import PageDesktop
def work():
    desktop = PageDesktop()
    path = desktop.place("a.png")
    open(path, "wb").write(b"x")
    print(desktop.folder, flush=True)
    os.kill(os.getpid(), signal.SIGKILL)
sys.exit(supervised(work))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert done.returncode == 1 and "ended the work" in done.stderr
    assert done.stdout.startswith(("/", "C:")) and not os.path.exists(done.stdout.strip())
