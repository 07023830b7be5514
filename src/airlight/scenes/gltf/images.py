"""PNG and JPEG images inside a glTF file: their size from the header, their pixels by `airlight.files`."""

import os
import tempfile

import numpy as np

from airlight.errors import AirlightError

MAX_SIDE = 4096  # pixels of a texture; larger ones are halved


def size(data: bytes | memoryview) -> tuple[str, int, int] | None:
    """Read ("png" or "jpeg", width, height) from the header, or None for anything else."""
    head = bytes(data[:24])
    if head.startswith(b"\x89PNG\r\n\x1a\n") and head[12:16] == b"IHDR":
        return "png", int.from_bytes(head[16:20], "big"), int.from_bytes(head[20:24], "big")
    if not head.startswith(b"\xff\xd8\xff"):
        return None
    at = 2
    while at + 9 <= len(data) and data[at] == 0xFF:
        kind = data[at + 1]
        if kind == 0xFF:  # filling
            at += 1
        elif 0xC0 <= kind <= 0xCF and kind not in (0xC4, 0xC8, 0xCC):  # start of a frame
            height, width = int.from_bytes(data[at + 5 : at + 7], "big"), int.from_bytes(data[at + 7 : at + 9], "big")
            return "jpeg", width, height
        else:
            at += 2 + max(2, int.from_bytes(data[at + 2 : at + 4], "big"))
    return None


def pixels(data: bytes | memoryview, kind: str, name: str) -> np.ndarray:
    """Decode (H, W, 4) uint8 codes as the file has them, straight alpha, upright or not. Raises AirlightError that begins with name."""
    from airlight.files.decode import decode

    with tempfile.TemporaryDirectory(prefix="airlight-") as folder:
        path = os.path.join(folder, f"image.{kind}")
        with open(path, "wb") as file:
            file.write(data)
        try:
            codes = decode(path, "error")[0]
        except AirlightError as error:
            raise type(error)(str(error).replace(path, name).replace(", or pass --on-damage warn to use what is there", "")) from error
    if codes.dtype == np.uint16:
        codes = (codes >> 8).astype(np.uint8)
    channels = codes.shape[2]
    out = np.full((*codes.shape[:2], 4), 255, np.uint8)
    out[..., :3] = codes[..., :3] if channels >= 3 else codes[..., :1]
    if channels in (2, 4):
        out[..., 3] = codes[..., -1]
    while max(out.shape[:2]) > MAX_SIDE:
        height, width = max(1, out.shape[0] // 2), max(1, out.shape[1] // 2)
        rows, columns = min(2, out.shape[0]), min(2, out.shape[1])
        blocks = out[: height * rows, : width * columns].reshape(height, rows, width, columns, 4)
        out = np.rint(blocks.mean(axis=(1, 3), dtype=np.float32)).astype(np.uint8)
    return out
