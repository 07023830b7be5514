"""Encode codes to files in memory, and read back what was encoded."""

import contextlib
import mmap
import struct
from typing import Any

import numpy as np

from airlight.errors import MachineError, warn
from airlight.files import boxes, by_pillow, dpx
from airlight.files.decode import problem
from airlight.files.storage import is_exact


def encode_file(memory: str, format: str, spec: Any, codes: np.ndarray, name: str) -> None:
    """Encode (H, W, C) codes to the file `memory`. name: of the output, for messages. Raises MachineError."""
    import OpenImageIO as oiio

    if format == "avif":
        by_pillow.encode_avif(memory, spec, codes, name)
        return
    out = oiio.ImageOutput.create(format)
    if out is None:
        raise MachineError(f"{name}: this OpenImageIO cannot write {format} ({problem(oiio)}); use another format")
    fine = out.open(memory, spec)
    text = problem(out)
    if fine:
        fine = out.write_image(codes)
        text += problem(out)
        fine = out.close() and fine
        late = problem(out)
        # OpenImageIO 3.2 says so of every TIFF without Exif data, and the file is right.
        text += "" if late.startswith("failed TIFFWriteCustomDirectory() of the Exif data") else late
    if not fine or text:
        raise MachineError(f"{name}: could not be encoded ({' '.join(text.replace(memory, 'it').split())[:200] or 'no reason given'})")
    if format == "jpegxl":
        block = boxes.exif_block(spec, name)
        if block:
            boxes.append_exif(memory, block)
    elif format == "dpx":
        dpx.put_name(memory, name)
    elif format == "openexr" and not is_exact(spec, format) and not _stays_finite(memory, spec, codes):
        warn(f"{name}: {spec.get_string_attribute('compression')} would make infinities of its extremes; compressed by zips", 5)
        spec.attribute("compression", "zips")
        encode_file(memory, format, spec, codes, name)


def _stays_finite(memory: str, spec: Any, codes: np.ndarray) -> bool:
    """Decode a lossy EXR, and tell whether all its finite numbers, (H, W, C), came back as such: B44 shifts logarithms."""
    import OpenImageIO as oiio

    inp = oiio.ImageInput.open(memory)
    if inp is None:
        return True  # `verify` tells
    back = inp.read_image(0, 0, 0, codes.shape[2], "float")
    order = [spec.channelnames.index(channel) for channel in inp.spec().channelnames]
    inp.close()
    return back is None or bool((np.isfinite(back.reshape(codes.shape)) | ~np.isfinite(codes[..., order])).all())


def verify(memory: str, codes: np.ndarray, spec: Any, format: str, name: str) -> None:
    """Decode what was encoded; codes must come back as they were where the format is exact. Of an EXR all chunks must be there and
    whole, and some rows are decoded: it took a fifth of the time of a sequence to decode them all."""
    import OpenImageIO as oiio

    if format == "avif":
        if not by_pillow.verify_avif(memory, codes):
            raise MachineError(f"{name}: did not read back as it was written; nothing was saved, try again or another format")
        return
    hints = oiio.ImageSpec()
    hints.attribute("oiio:UnassociatedAlpha", 1)
    problem(oiio)  # of a file that the caller's own program opened before
    inp = oiio.ImageInput.open(memory, hints)
    text = problem(oiio)
    fine = inp is not None and (format != "openexr" or _all_chunks(memory, len(codes)))
    if inp is not None:
        kind = {"float16": "half", "float32": "float"}.get(codes.dtype.name, codes.dtype.name)
        found = inp.spec()
        fine = fine and (found.height, found.width, found.nchannels) == codes.shape
        fine = fine and (format != "openexr" or set(found.channelnames) == set(spec.channelnames))
        if fine and format == "openexr":
            order = [spec.channelnames.index(channel) for channel in found.channelnames]
            for row in {round(part * (len(codes) - 1)) for part in (0, 1 / 3, 2 / 3, 1)}:
                back = inp.read_scanlines(0, 0, found.y + row, found.y + row + 1, 0, 0, found.nchannels, kind)
                row_codes = codes[row][:, order]
                fine = fine and back is not None
                if back is not None and is_exact(spec, format):
                    fine = fine and np.array_equal(np.reshape(back, row_codes.shape), row_codes, equal_nan=True)
        elif fine:
            back = inp.read_image(0, 0, 0, found.nchannels, kind)
            fine = back is not None and (not is_exact(spec, format) or np.array_equal(np.reshape(back, codes.shape), codes))
        text += problem(inp)
        inp.close()
        text += problem(inp)
    if text or not fine:
        raise MachineError(f"{name}: did not read back as it was written; nothing was saved, try again or another format")


def _all_chunks(path: str, height: int) -> bool:
    """Tell whether the chunks of a one-part EXR of scan lines follow each other from the table of offsets to the end, with all rows.

    Source: OpenEXR File Layout, openexr.com: attributes are name, type, size, value; a chunk is its first row, its size, its data.
    """
    with (
        contextlib.suppress(IndexError, struct.error),  # a header that ends early
        open(path, "rb") as file,
        mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data,
    ):
        at = 8
        while data[at] != 0:
            at = data.find(b"\0", data.find(b"\0", at) + 1) + 1
            at += 4 + int(struct.unpack_from("<i", data, at)[0])
        table = at + 1
        count = (struct.unpack_from("<Q", data, table)[0] - table) // 8
        end, rows = table + 8 * count, []
        for offset in struct.unpack_from(f"<{count}Q", data, table):
            if offset != end or offset + 8 > len(data):
                return False
            row, size = struct.unpack_from("<ii", data, offset)
            rows.append(row)
            end += 8 + size
        step = rows[1] - rows[0] if count > 1 else height
        return end == len(data) and rows == list(range(rows[0], rows[0] + height, step))
    return False
