"""Images inside a glTF file: their size from the header, their pixels by `airlight.files`, or by Pillow."""

import io
import os
import tempfile
import warnings

import numpy as np

from airlight.errors import AirlightError

MAX_SIDE = 4096  # pixels of a texture; larger ones are halved


def size(data: bytes | memoryview) -> tuple[str, int, int] | None:
    """Read ("png", "jpeg", "webp" or "avif", width, height) from the header, or None for anything else."""
    head = bytes(data[:30])
    if head.startswith(b"\x89PNG\r\n\x1a\n") and head[12:16] == b"IHDR":
        return "png", int.from_bytes(head[16:20], "big"), int.from_bytes(head[20:24], "big")
    if head[:4] == b"RIFF" and head[8:12] == b"WEBP" and len(head) == 30:
        return _webp(head)
    if head[4:8] == b"ftyp" and (b"avif" in bytes(data[8:64]) or b"avis" in bytes(data[8:64])):
        return _avif(bytes(data[:65536]))
    return _jpeg(data) if head.startswith(b"\xff\xd8\xff") else None


def _jpeg(data: bytes | memoryview) -> tuple[str, int, int] | None:
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


def _webp(head: bytes) -> tuple[str, int, int] | None:
    """Read the size of a lossy, lossless or extended WebP (RFC 9649, section 2)."""
    if head[12:16] == b"VP8 " and head[23:26] == b"\x9d\x01\x2a":
        return "webp", int.from_bytes(head[26:28], "little") & 0x3FFF, int.from_bytes(head[28:30], "little") & 0x3FFF
    if head[12:16] == b"VP8L" and head[20] == 0x2F:
        bits = int.from_bytes(head[21:25], "little")
        return "webp", (bits & 0x3FFF) + 1, (bits >> 14 & 0x3FFF) + 1
    if head[12:16] == b"VP8X":
        return "webp", int.from_bytes(head[24:27], "little") + 1, int.from_bytes(head[27:30], "little") + 1
    return None


def _avif(data: bytes) -> tuple[str, int, int] | None:
    """Read the size of the largest item of an AVIF, from its boxes `ispe`."""
    found, at = None, data.find(b"ispe")
    while at >= 0 and at + 16 <= len(data):
        width, height = (int.from_bytes(data[at + i : at + i + 4], "big") for i in (8, 12))
        if found is None or width * height > found[1] * found[2]:
            found = "avif", width, height
        at = data.find(b"ispe", at + 4)
    return found


def readable(data: bytes | memoryview) -> bool:
    """Tell whether an image is of a kind that can be decoded here."""
    found = size(data)
    if found is not None and found[0] == "avif":
        from PIL import features

        return bool(features.check("avif"))
    return found is not None


def _pillow(data: bytes | memoryview, name: str, claimed: tuple[int, int]) -> np.ndarray:
    """Decode AVIF, (H, W, 4) uint8. claimed: the size that was checked."""
    from PIL import Image, features

    if not features.check("avif"):
        raise AirlightError(f"{name}: is AVIF, which this build of Pillow cannot read; install another, or convert the image to PNG")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            with Image.open(io.BytesIO(data), formats=["AVIF"]) as image:
                if image.size[0] * image.size[1] > claimed[0] * claimed[1]:
                    raise ValueError("larger than its header says")
                return np.array(image.convert("RGBA"), np.uint8)
    except (OSError, ValueError, SyntaxError, RuntimeError, MemoryError, Warning, Image.DecompressionBombError) as error:
        text = " ".join(str(error).split())[:120]
        raise AirlightError(f"{name}: is damaged ({text}); copy or export it again") from None


def pixels(data: bytes | memoryview, kind: str, name: str) -> np.ndarray:
    """Decode (H, W, 4) uint8 codes as the file has them, straight alpha, upright or not. Raises AirlightError that begins with name."""
    if kind == "avif":
        found = size(data)
        assert found is not None
        return _smaller(_pillow(data, name, found[1:]))
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
    return _smaller(out)


def _smaller(out: np.ndarray) -> np.ndarray:
    """Halve (H, W, 4) uint8 codes until no side is longer than MAX_SIDE."""
    while max(out.shape[:2]) > MAX_SIDE:
        height, width = max(1, out.shape[0] // 2), max(1, out.shape[1] // 2)
        rows, columns = min(2, out.shape[0]), min(2, out.shape[1])
        blocks = out[: height * rows, : width * columns].reshape(height, rows, width, columns, 4)
        out = np.rint(blocks.mean(axis=(1, 3), dtype=np.float32)).astype(np.uint8)
    return out
