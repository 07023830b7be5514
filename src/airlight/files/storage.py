"""Choose how outputs are packed: as chosen, as the input's, or as usual."""

import contextlib
from typing import Any

import numpy as np

from airlight.errors import warn
from airlight.options.storage import EXR, LOSSY_EXR, SUBSAMPLING, Storage
from airlight.process import standard

QUALITY = 95  # of JPEG, WebP and JPEG XL that are made from other formats
AVIF_QUALITY = 90
# The luminance table of quality 50, in zigzag order. Source: ITU-T T.81, table K.1.
_LUMINANCE = (
    *(16, 11, 12, 14, 12, 10, 16, 14, 13, 14, 18, 17, 16, 19, 24, 40, 26, 24, 22, 22, 24, 49, 35, 37, 29, 40, 58, 51, 61, 60, 57, 51),
    *(56, 55, 64, 72, 92, 78, 64, 68, 87, 69, 55, 56, 80, 109, 81, 87, 95, 98, 103, 104, 103, 62, 77, 113, 121, 112, 100, 120, 92, 101),
    *(103, 99),
)


def describe(spec: Any, like: Any, format: str, storage: Storage) -> None:
    """Put into the spec of an output how it is packed. like: the input's Picture, or None."""
    quality = storage.file_quality
    if format == "openexr":
        spec.attribute("compression", _exr(spec, like, storage.compression))
    elif format == "jpeg":
        own = like is not None and like.format == "jpeg"
        kept = like.spec.get_string_attribute("jpeg:subsampling") if own else ""
        spec.attribute("compression", f"jpeg:{quality or (jpeg_quality(like.path) if own else None) or QUALITY}")
        spec.attribute("jpeg:subsampling", storage.subsampling or (kept if kept in (*SUBSAMPLING, "4:1:1") else SUBSAMPLING[0]))
    elif format == "png":
        spec.attribute("png:compressionLevel", 4)
    elif format == "webp":
        is_exact = quality is None and (like is None or like.lossless)
        spec.attribute("compression", "lossless:10" if is_exact else f"webp:{quality or QUALITY}")
    elif format == "jpegxl":
        spec.attribute("compression", f"jpegxl:{quality or (100 if like is None or like.lossless else QUALITY)}")
    elif format == "avif":
        spec.attribute("compression", f"avif:{quality or AVIF_QUALITY}")
        spec.attribute("avif:subsampling", storage.subsampling or SUBSAMPLING[0])
    elif format == "tiff":
        spec.attribute("compression", storage.compression or "zip")


def quality_of(spec: Any) -> int:
    """Read the quality from a spec that `describe` has filled."""
    return int(spec.get_string_attribute("compression").partition(":")[2])


def is_exact(spec: Any, format: str) -> bool:
    """Tell whether codes come back from the output as they went in."""
    compression = spec.get_string_attribute("compression")
    if format == "openexr":
        return compression.partition(":")[0] not in LOSSY_EXR
    return format in ("png", "tiff", "dpx") or (format == "jpegxl" and compression == "jpegxl:100")


def _exr(spec: Any, like: Any, chosen: str | None) -> str:
    own = like is not None and like.format == "openexr"
    kept = like.spec.get_string_attribute("compression") if own else ""
    name = chosen or (kept if kept in EXR else "zips")
    if own and chosen is None and kept in ("dwaa", "dwab"):
        level = like.spec.get_float_attribute("openexr:dwaCompressionLevel", 45.0)
        name = f"{kept}:{level:g}"
    holds_ids = any(item.name.startswith("cryptomatte/") for item in spec.extra_attribs)
    if chosen is not None and kept != chosen and holds_ids and name.partition(":")[0] in LOSSY_EXR:
        warn(f"{like.path}: holds Cryptomatte, whose numbers {chosen} would change; compressed by zips", 6)
        return "zips"
    return name


def jpeg_quality(path: str) -> int | None:
    """Estimate libjpeg's quality, 1 to 100, whose luminance table is nearest to that of a JPEG; None where none is found."""
    with contextlib.suppress(OSError, IndexError), open(standard.local(path), "rb") as file:
        data = file.read(1 << 20)
        at = 2
        while data[at] == 0xFF and data[at + 1] != 0xDA:
            size = int.from_bytes(data[at + 2 : at + 4], "big")
            body = data[at + 4 : at + 2 + size]
            if data[at + 1] == 0xDB:
                wide = body[0] >> 4  # the first table is luminance's
                table = np.frombuffer(body, ">u2" if wide else "u1", 64, 1)
                return 1 + int(np.argmin([np.abs(_scaled(quality) - table).sum() for quality in range(1, 101)]))
            at += 2 + max(size, 2)
    return None


def _scaled(quality: int) -> np.ndarray:
    """Scale the table as libjpeg does, jcparam.c."""
    scale = 5000 // quality if quality < 50 else 200 - 2 * quality
    return np.clip((np.array(_LUMINANCE) * scale + 50) // 100, 1, 255)
