"""RAW and HEIC, which OpenImageIO's wheel does not read: by rawpy and pillow-heif, where they are installed."""

import contextlib
from importlib import import_module
from pathlib import PurePath
from typing import Any, Literal

import numpy as np

from airlight.errors import AirlightError
from airlight.files.atomic import scratch
from airlight.process import standard

# RAW files of most makers begin as a TIFF does, and hold a small preview that would be read in their place.
RAW = ".3fr .arw .cr2 .cr3 .crw .dcr .dng .erf .fff .iiq .kdc .mef .mos .nef .nrw .orf .pef .raf .raw .rw2 .rwl .sr2 .srf .srw .x3f"
_RAW_MAGIC = (b"FUJIFILMCCD-RAW", b"IIRO", b"IIRS", b"MMOR", b"IIU\0", b"FOVb", b"\0MRM")
_DNG_VERSION, _SUBFILE_TYPE = 50706, 254  # tags of TIFF
_AVIF = {b"avif", b"avis"}
_BRANDS = {b"heic", b"heix", b"heim", b"heis", b"hevc", b"hevx", b"mif1", b"msf1", b"mif2"}


def kind(path: str, head: bytes) -> str | None:
    """Tell RAW, HEIC and AVIF apart, or None: by the file's first bytes and, where those are a TIFF's or unknown, its extension."""
    if head[4:8] == b"ftyp":
        brands = {head[i : i + 4] for i in (8, *range(16, min(int.from_bytes(head[:4], "big"), 256), 4))}
        if head[8:12] in _AVIF or (brands & _AVIF and not brands & {b"heic", b"heix"}):
            return "avif"
        return "raw" if b"crx " in brands else "heic" if head[8:12] in _BRANDS or brands & (_BRANDS - {b"mif1", b"msf1", b"mif2"}) else None
    if head.startswith(_RAW_MAGIC):
        return "raw"
    tiff = head[:4] in (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")
    named = PurePath(path).suffix.lower() in RAW.split() or (standard.is_input(path) and _is_raw_tiff(head))
    return "raw" if tiff and named else None


def _is_raw_tiff(head: bytes) -> bool:
    """Tell a camera's TIFF, where it has no name: Canon's mark, a version of DNG, or a first picture that is a smaller copy of another."""
    order: Literal["little", "big"] = "little" if head[:2] == b"II" else "big"
    at = int.from_bytes(head[4:8], order)
    for entry in range(at + 2, at + 2 + 12 * int.from_bytes(head[at : at + 2], order), 12):
        tag, value = int.from_bytes(head[entry : entry + 2], order), int.from_bytes(head[entry + 8 : entry + 12], order)
        if tag == _DNG_VERSION or (tag == _SUBFILE_TYPE and value & 1):
            return True
    return head[8:10] == b"CR"


def _library(module: str, extra: str, path: str) -> Any:
    try:
        return import_module(module)
    except ImportError:
        raise AirlightError(f"{path}: reading {extra.upper()} needs an extra: pip install airlight[{extra}]") from None


def _damaged(path: str, error: Any) -> AirlightError:
    text = error.decode(errors="replace") if isinstance(error, bytes) else str(error)
    return AirlightError(f"{path}: cannot be decoded ({' '.join(text.split())[:150] or 'no reason given'}); copy or export it again")


def decode_raw(file: Any, path: str, check: Any) -> tuple[np.ndarray, Any]:
    """Decode RAW: (H, W, 3) uint16, linear Rec. 709 with the camera's white balance and the sensor's white, upright; and its spec.

    file: a binary file at its start. check: called with a spec before anything is decoded, raises AirlightError.
    """
    import OpenImageIO as oiio

    rawpy = _library("rawpy", "raw", path)
    try:
        with rawpy.imread(file) as raw:
            check(oiio.ImageSpec(raw.sizes.iwidth, raw.sizes.iheight, 3, "uint16"), path)
            pixels = raw.postprocess(
                output_bps=16, gamma=(1, 1), no_auto_bright=True, use_camera_wb=True, output_color=rawpy.ColorSpace.sRGB
            )
    except rawpy.LibRawError as error:
        raise _damaged(path, error.args[0] if error.args else error) from None
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], 3, "uint16")
    spec.attribute("oiio:ColorSpace", "lin_rec709_scene")
    return pixels, spec


def decode_heic(file: Any, path: str, check: Any) -> tuple[np.ndarray, Any]:
    """Decode HEIC: (H, W, 1 to 4) uint8, or uint16 of deeper ones, and its spec, with ICC profile or CICP, and Exif.

    Arguments as `decode_raw`.
    """
    import OpenImageIO as oiio

    heif = _library("pillow_heif", "heic", path)
    try:
        image = heif.open_heif(file, convert_hdr_to_8bit=False, hdr_to_16bit=False)
        mode, _, bits = image.mode.partition(";")
        channels = {"L": 1, "LA": 2, "RGB": 3, "RGBA": 4}.get(mode)
        if channels is None:
            raise AirlightError(f"{path}: is a HEIC of an unusual kind ({image.mode}); export it as PNG or TIFF")
        spec = oiio.ImageSpec(image.size[0], image.size[1], channels, "uint16" if bits else "uint8")
        check(spec, path)
        pixels = np.asarray(image)
        if bits:
            pixels = np.rint(pixels * (65535 / (2 ** int(bits) - 1))).astype(np.uint16)
    except (ValueError, EOFError, SyntaxError, RuntimeError, OSError) as error:
        raise _damaged(path, error) from None
    icc, nclx = image.info.get("icc_profile"), image.info.get("nclx_profile")
    if icc:
        spec.attribute("ICCProfile", f"uint8[{len(icc)}]", np.frombuffer(icc, np.uint8))
    elif nclx and (nclx["color_primaries"], nclx["transfer_characteristics"]) != (2, 2):
        spec.attribute("CICP", "int[4]", (nclx["color_primaries"], nclx["transfer_characteristics"], 0, 1))
    if any("gainmap" in str(kind).lower() for kind in image.info.get("aux") or ()):
        spec.attribute("airlight:gain_map", 1)
    copy_exif(spec, image.info.get("exif") or b"", path)
    return pixels, spec


def copy_exif(spec: Any, block: bytes, path: str) -> None:
    """Give the spec the tags of an Exif block, but not its orientation: the pixels are upright. OpenImageIO reads them in a JPEG."""
    import OpenImageIO as oiio

    block = block if block.startswith(b"Exif\0\0") else b"Exif\0\0" + block
    if not 6 < len(block) <= 65_533:  # a JPEG holds no more
        return
    with scratch(path, 1 << 20) as memory:
        out = oiio.ImageOutput.create("jpeg")
        fine = out is not None and out.open(memory, oiio.ImageSpec(1, 1, 1, "uint8"))
        if out is None or not (fine and out.write_image(np.zeros((1, 1, 1), np.uint8)) and out.close()):
            return
        with open(memory, "rb") as file:
            bare = file.read()
        with open(memory, "wb") as file:
            file.write(bare[:2] + b"\xff\xe1" + (len(block) + 2).to_bytes(2, "big") + block + bare[2:])
        inp = oiio.ImageInput.open(memory)
        for item in inp.spec().extra_attribs if inp is not None else ():
            if item.name != "Orientation" and not item.name.startswith(("oiio:", "jpeg:")):
                with contextlib.suppress(UnicodeError, TypeError, RuntimeError):  # text that is not UTF-8
                    spec.attribute(item.name, item.type, item.value)
