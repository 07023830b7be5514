"""AVIF in and out, and run-length BMP in, by Pillow where it is installed: OpenImageIO's wheel does neither."""

import io
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from typing import Any

import numpy as np

from airlight.errors import AirlightError, MachineError, warn
from airlight.files import boxes
from airlight.files.extras import copy_exif
from airlight.files.storage import quality_of


def _library(path: str, what: str) -> Any:
    try:
        return import_module("PIL.Image")
    except ImportError:
        raise AirlightError(f"{path}: {what} needs an extra: pip install airlight[avif]") from None


def need_avif(path: str) -> None:
    """Raise AirlightError where AVIF cannot be written for want of Pillow, or of its encoder."""
    _library(path, "writing AVIF")
    if not import_module("PIL.features").check("avif"):
        raise AirlightError(f"{path}: the Pillow that is installed was built without AVIF: pip install -U airlight[avif]")


@contextmanager
def _decoding(path: str, pillow: Any) -> Iterator[None]:
    """Tell of damage in a line."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of sizes that are within our own limits
            yield
    except (ValueError, EOFError, SyntaxError, RuntimeError, OSError, MemoryError, TypeError, pillow.DecompressionBombError) as error:
        text = " ".join(str(error).split())[:150]
        raise AirlightError(f"{path}: cannot be decoded ({text or 'no reason given'}); copy or export it again") from None


def decode_avif(file: Any, path: str, check: Any) -> tuple[np.ndarray, Any]:
    """Decode AVIF: (H, W, 3 or 4) uint8 and its spec, with ICC profile or CICP, and Exif. Arguments as `extras.decode_raw`."""
    pillow = _library(path, "reading AVIF")
    pixels, spec, image = _decode(pillow, file, path, check, "AVIF")
    file.seek(0)
    head = file.read(4096)
    codes = boxes.colour_codes(head)
    if boxes.is_deep(head):
        warn(f"{path}: has more than 8 bits, of which 8 are read; export it as PNG or TIFF of 16 bits to use them all", 6)
    icc = image.info.get("icc_profile")
    if icc:
        spec.attribute("ICCProfile", f"uint8[{len(icc)}]", np.frombuffer(icc, np.uint8))
    elif codes is not None and codes[:2] != (2, 2):
        spec.attribute("CICP", "int[4]", (*codes[:2], 0, 1))
    if getattr(image, "n_frames", 1) > 1:
        spec.attribute("oiio:subimages", int(image.n_frames))
        warn(f"{path}: holds {image.n_frames} pictures; only the first is used", 6)
    copy_exif(spec, image.info.get("exif") or b"", path)
    return pixels, spec


def avif_exif(path: str) -> bytes:
    """Find the Exif block of an AVIF; empty where there is none."""
    pillow = _library(path, "reading AVIF")
    with _decoding(path, pillow), pillow.open(path, formats=("AVIF",)) as image:
        return bytes(image.info.get("exif") or b"")


def decode_bmp(file: Any, path: str, check: Any) -> tuple[np.ndarray, Any]:
    """Decode a BMP of run lengths that OpenImageIO refuses: (H, W, 3) uint8 and its spec. Arguments as `extras.decode_raw`."""
    pixels, spec, _ = _decode(_library(path, "reading this run-length BMP"), file, path, check, "BMP")
    return pixels, spec


def _decode(pillow: Any, file: Any, path: str, check: Any, kind: str) -> tuple[np.ndarray, Any, Any]:
    import OpenImageIO as oiio

    with _decoding(path, pillow):
        image = pillow.open(file, formats=(kind,))
        mode = "RGBA" if image.mode in ("RGBA", "LA", "PA") else "RGB"
        spec = oiio.ImageSpec(image.size[0], image.size[1], len(mode), "uint8")
        check(spec, path)
        pixels = np.asarray(image.convert(mode))
        spec.attribute("Orientation", int(image.getexif().get(0x0112, 1)))  # Pillow leaves the pixels as they lie
    return pixels, spec, image


def encode_avif(memory: str, spec: Any, codes: np.ndarray, name: str) -> None:
    """Encode (H, W, 3 or 4) uint8 to the file `memory`, with the spec's ICC profile and Exif. Raises MachineError."""
    pillow = _library(name, "writing AVIF")
    profile = spec.getattribute("ICCProfile")
    options = {
        "quality": quality_of(spec),
        "subsampling": spec.get_string_attribute("avif:subsampling"),
        "icc_profile": b"" if profile is None else bytes(bytearray(profile)),
        "exif": boxes.exif_block(spec, name),
        "max_threads": 1,  # more give other bytes
    }
    try:
        held = io.BytesIO()
        pillow.fromarray(codes).save(held, "AVIF", **options)
    except (ValueError, RuntimeError, OSError, MemoryError) as error:
        raise MachineError(f"{name}: could not be encoded ({' '.join(str(error).split())[:200]})") from None
    with open(memory, "wb") as file:
        file.write(held.getbuffer())


def verify_avif(memory: str, codes: np.ndarray) -> bool:
    """Decode what was encoded, and compare sizes."""
    pillow = import_module("PIL.Image")
    try:
        with pillow.open(memory, formats=("AVIF",)) as image:
            return bool(np.asarray(image).shape == codes.shape)
    except (ValueError, EOFError, SyntaxError, RuntimeError, OSError):
        return False
