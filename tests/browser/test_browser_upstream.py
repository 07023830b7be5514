"""What the browser view relies on in rendercanvas and uvicorn."""

import numpy as np
import pytest
from browser_server import SIZE, frames, say
from rendercanvas import http as theirs
from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol

from airlight.files import read_image
from airlight.viewer import remote

REPLACED = (
    *("_quality", "_rc_set_title", "_rc_close", "_update_active_states", "_encode_frame"),
    *("_rc_present_bitmap", "_send_last_frame_to_ready_clients", "_schedule_lossless_draw"),
)


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


def test_a_picture_that_all_have_is_not_sent_again(view):
    """Whoever comes later gets it."""
    with view.open() as client:
        say(client, **SIZE)
        assert frames(client, 1.0)
        view.still = True
        for _ in range(5):
            view.draw_again()
        assert view.drawn > 5 and frames(client, 0.5) == []
        with view.open() as watcher:
            assert len(frames(watcher, 1.0)) == 1


@pytest.mark.parametrize(
    ("owner", "name"),
    [
        *((theirs.HttpRenderCanvas, n) for n in REPLACED),
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
    assert canvas._active_client == 0 and callable(theirs.asgi.send_to)
    assert canvas._is_closed is False and canvas._size_info["physical_size"] == canvas.get_physical_size()
    assert "encode_array" in theirs.HttpRenderCanvas._encode_frame.__code__.co_names
    assert callable(canvas._size_info.set_physical_size) and isinstance(canvas._last_frame, tuple)
