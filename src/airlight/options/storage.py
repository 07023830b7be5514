"""Declare options of packing outputs: compression, quality, chroma subsampling."""

import os
from collections.abc import Iterable
from dataclasses import dataclass

from airlight.errors import AirlightError
from airlight.messages import nearest

# Extension: OpenImageIO's format name and the bits that it can hold.
OUTPUTS: dict[str, tuple[str, tuple[int, ...]]] = {
    ".png": ("png", (8, 16)),
    ".jpg": ("jpeg", (8,)),
    ".jpeg": ("jpeg", (8,)),
    ".tif": ("tiff", (8, 16, 32)),
    ".tiff": ("tiff", (8, 16, 32)),
    ".webp": ("webp", (8,)),
    ".exr": ("openexr", (16, 32)),
    ".hdr": ("hdr", (32,)),
    ".dpx": ("dpx", (8, 16)),
    ".jxl": ("jpegxl", (8, 16)),
    ".avif": ("avif", (8,)),
}
EXR = ("none", "rle", "zip", "zips", "piz", "pxr24", "b44", "b44a", "dwaa", "dwab", "htj2k32", "htj2k256")
LOSSY_EXR = ("pxr24", "b44", "b44a", "dwaa", "dwab")
TIFF = ("none", "lzw", "zip", "packbits")
SUBSAMPLING = ("4:4:4", "4:2:2", "4:2:0")
_OF_OPTION = {
    "compression": ("--compression", (".exr", ".tif", ".tiff")),
    "file_quality": ("--file-quality", (".jpg", ".jpeg", ".webp", ".avif", ".jxl")),
    "subsampling": ("--subsampling", (".jpg", ".jpeg", ".avif")),
}


@dataclass(frozen=True)
class Storage:
    """Says how outputs are packed; what is None is kept from an input of the same format, else as usual.

    compression: of EXR (one of EXR, DWA's level after a colon) and TIFF. file_quality: 1 to 100, of JPEG, WebP, AVIF, JPEG XL, of which
    100 is lossless. subsampling: of JPEG and AVIF, one of SUBSAMPLING.
    """

    compression: str | None = None
    file_quality: int | None = None
    subsampling: str | None = None

    def check(self, outputs: Iterable[str]) -> None:
        """Raise AirlightError for what means nothing for any of the outputs, or is no compression of one."""
        if self == Storage():
            return
        kinds = {os.path.splitext(path)[1].lower() for path in outputs}
        for name, (option, extensions) in _OF_OPTION.items():
            if getattr(self, name) is not None and not kinds & set(extensions):
                raise AirlightError(f"{option} means something for {' '.join(extensions)} alone: leave it out, or name such an output")
        if self.compression is None:
            return
        name, _, level = self.compression.partition(":")
        for extensions, possible in (((".exr",), EXR), ((".tif", ".tiff"), TIFF)):
            if kinds & set(extensions) and name not in possible:
                hint = nearest(name, possible, f": use one of {', '.join(possible)}")
                raise AirlightError(f"--compression {self.compression} is none of {extensions[0]}{hint}")
        if level and not (name in ("dwaa", "dwab") and level.replace(".", "", 1).isdecimal()):
            raise AirlightError(f"--compression {self.compression}: only dwaa and dwab take a level, a number from 0, as in dwaa:45")

    def of(self, path: str) -> "Storage":
        """Leave out what means nothing for one of several outputs."""
        kind = os.path.splitext(path)[1].lower()
        return Storage(**{name: getattr(self, name) for name, (_, extensions) in _OF_OPTION.items() if kind in extensions})

    @property
    def repacks(self) -> bool:
        """Tell whether a lossy input is to be packed otherwise than it was."""
        return self.file_quality is not None or self.subsampling is not None
