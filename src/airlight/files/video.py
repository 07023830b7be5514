"""Films: H.264 in MP4 by PyAV, whole or not at all."""

import contextlib
import os
from collections.abc import Callable, Iterator
from fractions import Fraction
from typing import Any, BinaryIO

import numpy as np

from airlight.errors import AirlightError, MachineError
from airlight.files.atomic import check_output, replacing
from airlight.files.decode import MARK, opened

BT709 = 1  # of ISO/IEC 23091-2: primaries, transfer and matrix alike
LIMITED = 1  # AVCOL_RANGE_MPEG: 16 to 235
# The preset medium but for the macroblock tree, which in x264's AVX-512 code reads memory that nothing has written: two runs differ.
# One thread, for the bytes depend on their number.
_X264 = {"preset": "medium", "x264-params": "mbtree=0"}


def library() -> Any:
    """Import PyAV. Raises AirlightError where it is not installed."""
    try:
        import av
    except ImportError:
        raise AirlightError("films need an extra: pip install airlight[video]; or write numbered frames, as in film.####.png") from None
    av.logging.set_level(av.logging.PANIC)
    return av


def is_film(path: str) -> bool:
    return path.lower().endswith(".mp4")


def check_film(path: str, width: int, height: int, overwrite: bool = False) -> None:
    """Refuse, before any heavy work, a film that could not or should not be written. Raises AirlightError."""
    if width % 2 or height % 2:
        raise AirlightError(f"{path}: H.264 films have an even width and height, not {width}x{height}; change --width, --height")
    check_output(path, [], overwrite, image=False)
    library()


class FileCursor:
    """Reads and writes a file at a position of its own: FFmpeg reads what it has written to put the index in front."""

    name = "film.mp4"

    def __init__(self, file: BinaryIO) -> None:
        self._file, self._position = file, 0

    @property
    def closed(self) -> bool:
        return self._file.closed

    def read(self, size: int) -> bytes:
        self._file.seek(self._position)
        data = self._file.read(size)
        self._position += len(data)
        return data

    def write(self, data: bytes) -> int:
        self._file.seek(self._position)
        self._position += self._file.write(data)
        return len(data)

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        start = {os.SEEK_SET: 0, os.SEEK_CUR: self._position}
        self._position = offset + (start[whence] if whence in start else self._file.seek(0, os.SEEK_END))
        return self._position

    def tell(self) -> int:
        return self._position

    def close(self) -> None:
        """Leave the file to whoever opened it."""


@contextlib.contextmanager
def film(
    path: str | os.PathLike[str],
    width: int,
    height: int,
    fps: Fraction,
    crf: float = 18,
    overwrite: bool = False,
    settings: str | None = None,
) -> Iterator[Callable[[np.ndarray], None]]:
    """Open a film: a function that adds a frame, (height, width, 3) uint8 sRGB codes; at the block's end it is verified and in place.

    yuv420p, limited range, converted by and tagged as BT.709; the index in front; the same frames give the same bytes.
    crf: x264's quality, 0 (lossless) to 51. settings: a text about the run, kept as the film's comment.
    Raises AirlightError before writing, MachineError when the disk is full.
    """
    name = os.fsdecode(path)
    check_film(name, width, height, overwrite)
    av = library()
    count, sound = 0, True
    with replacing(name, overwrite) as file, _ffmpeg_errors(av, name):
        options = {"movflags": "faststart", "fflags": "+bitexact"}
        container = av.open(FileCursor(file), "w", format="mp4", options=options, io_open=lambda *_: FileCursor(file))
        stream = container.add_stream("libx264", rate=fps, options={"crf": f"{crf:g}", **_X264})
        stream.width, stream.height, stream.pix_fmt = width, height, "yuv420p"
        codec = stream.codec_context
        codec.thread_count = 1
        codec.color_primaries = codec.color_trc = codec.colorspace = BT709
        codec.color_range = LIMITED
        container.metadata["comment"] = MARK + (settings or "")

        def add(codes: np.ndarray) -> None:
            nonlocal count, sound
            if codes.shape != (height, width, 3) or codes.dtype != np.uint8:  # FFmpeg would scale it
                raise ValueError(f"a frame of {codes.shape} {codes.dtype} in a film of {width}x{height}")
            if not sound:  # FFmpeg crashes if it is asked again after it has failed
                raise MachineError(f"{name}: could not be written")
            sound = False
            with _ffmpeg_errors(av, name):
                rgb = av.VideoFrame.from_ndarray(np.ascontiguousarray(codes), format="rgb24")
                frame = rgb.reformat(format="yuv420p", dst_colorspace="ITU709", dst_color_range="MPEG", threads=1)
                frame.pts, frame.time_base = count, 1 / fps
                container.mux(stream.encode(frame))
            count, sound = count + 1, True

        yield add
        container.mux(stream.encode(None))
        container.close()
        file.flush()
        verify_film(av, file, name, width, height, count)


@contextlib.contextmanager
def _ffmpeg_errors(av: Any, name: str) -> Iterator[None]:
    """Raise FFmpeg's errors as a MachineError; those of the file, as a full disk, are `replacing`'s to tell."""
    try:
        yield
    except av.FFmpegError as error:
        raise MachineError(f"{name}: could not be encoded ({' '.join(str(error).split())[:200]})") from error


def verify_film(av: Any, file: BinaryIO, name: str, width: int, height: int, count: int) -> None:
    """Decode the film: every frame must be there."""
    with av.open(FileCursor(file)) as container:
        stream = container.streams.video[0]
        stream.thread_type = "AUTO"
        found = 0
        for frame in container.decode(stream):
            found += (frame.width, frame.height) == (width, height) and not frame.is_corrupt
    if found != count or stream.frames != count:
        raise MachineError(f"{name}: did not read back as it was written; nothing was saved, try again")


def read_settings(path: str) -> str:
    """Read the settings of the run that wrote a film. Raises AirlightError where there are none."""
    av = library()
    text = ""
    with opened(path) as (name, _), contextlib.suppress(av.FFmpegError, UnicodeDecodeError), av.open(name, format="mp4") as container:
        text = container.metadata.get("comment", "")
    if len(text) <= len(MARK) or not text.startswith(MARK):
        raise AirlightError(f"{path}: holds no settings of Airlight; films that Airlight wrote do")
    return text[len(MARK) :]
