"""Reads the pictures that lights send out, and of films the one of a frame."""

import contextlib
import functools
from collections.abc import Iterator
from typing import Any

import numpy as np

from airlight.errors import AirlightError, warn
from airlight.files.sequence import numbered
from airlight.files.volumes import file_of_frame
from airlight.lights.shape import Cookie
from airlight.planes import shrink_to

MOST = 4096  # pixels along a side


def read_cookie(path: str, frame: int = 1, size: float = 1.0) -> Cookie:
    """Read an image as a Cookie, in linear RGB: what is not opaque lets as much less through. One of more than MOST pixels a side is
    averaged to that, and said so. frame: of numbered files, `gobo.####.png`; size: m, of a directional light's. Raises AirlightError."""
    return Cookie(_pixels(file_of_frame(path, frame)), size=size)


@functools.lru_cache(4)
def kept_cookie(path: str) -> Cookie:
    """Read an image as `read_cookie` does, once for all lights and pictures that have it."""
    return read_cookie(path)


def open_cookie(path: str, size: float = 1.0, option: str = "") -> Cookie:
    """Read an image as `read_cookie` does; of numbered files give a FilmCookie. option: that asks for it. Raises AirlightError."""
    with of_option(option):
        return read_cookie(path, size=size) if numbered(path) is None else FilmCookie(path, size)


@contextlib.contextmanager
def of_option(option: str) -> Iterator[None]:
    """Let errors of files name the option that gave them. Raises AirlightError."""
    try:
        yield
    except AirlightError as error:
        raise type(error)(f"{option}: {error}" if option else str(error)) from None


class FilmCookie(Cookie):
    """Gives of numbered files the picture of `frame`, which may be set; its file is read when the picture is asked for, and once while it
    is the same. Where a frame is missing, the one before it stays, before the first the first, which is said once."""

    def __init__(self, path: str, size: float = 1.0) -> None:
        """Find the files. Raises AirlightError where there are none."""
        object.__setattr__(self, "size", size)
        self.path, self.frame = path, 1
        pattern = numbered(path)
        self._there = [] if pattern is None else pattern.on_disk()
        file_of_frame(path, 1, self._there)
        self._known, self._count, self._held = "", 0, np.zeros((1, 1, 3), np.float32)
        self._told: set[str] = set()

    def __repr__(self) -> str:
        """Write its pattern and frame, and read no file."""
        return f"FilmCookie({self.path!r}, frame={self.frame!r}, size={self.size:g})"

    @property
    def pixels(self) -> Any:
        """Give the frame's, (H, W, 3). Raises AirlightError."""
        self._advance()
        return self._held

    @property
    def revision(self) -> int:  # type: ignore[override]
        """Count the files that were read, with the frame's. Raises AirlightError."""
        self._advance()
        return self._count

    def _advance(self) -> None:
        """Read the frame's file, unless it is the one that was read last."""
        found = file_of_frame(self.path, self.frame, self._there)
        if self.frame not in self._there and "missing" not in self._told:
            self._told.add("missing")
            warn(f"{self.path}: has no frame {self.frame}; frames that are missing look as those before them, here as {found}")
        if found != self._known:
            self._held, self._known, self._count = _pixels(found, self._told), found, self._count + 1


def _pixels(path: str, told: set[str] | None = None) -> Any:
    """Read the pixels (H, W, 3) of a cookie. told: what was said before, and is not again."""
    from airlight.files import read_image

    picture = read_image(path)
    pixels = np.maximum(picture.rec709(picture.linear()), 0)
    side = max(pixels.shape[:2])
    if side > MOST:
        factor = -(-side // MOST)
        rows, columns = (max(n // factor, 1) for n in pixels.shape[:2])
        pixels = shrink_to(pixels, columns, rows)
        if told is None or "large" not in told:
            warn(f"{path}: has {side:,} pixels along a side; as a cookie it is averaged to {max(rows, columns):,}")
        if told is not None:
            told.add("large")
    return np.ascontiguousarray(pixels)
