"""Photometric files of luminaires, IES LM-63 (.ies) and EULUMDAT (.ldt): how strong a lamp is in which direction."""

from airlight.errors import AirlightError, warn
from airlight.files.decode import opened
from airlight.files.photometry import eulumdat, lm63
from airlight.files.photometry.distribution import MAX_VALUES, IntensityDistribution

FORMATS = {".ies": "IES LM-63", ".ldt": "EULUMDAT"}
MAX_BYTES = 2**25

__all__ = ["FORMATS", "MAX_BYTES", "MAX_VALUES", "IntensityDistribution", "parse_photometry", "read_photometry"]


def read_photometry(path: str, tell: bool = True) -> IntensityDistribution:
    """Read a photometric file. Warns of what was mended, with `tell`. Raises AirlightError."""
    with opened(path, "a photometric file: .ies or .ldt") as (name, _), open(name, "rb") as file:
        data = file.read(MAX_BYTES + 1)
    return parse_photometry(data, path, tell)


def parse_photometry(data: bytes, path: str, tell: bool = True) -> IntensityDistribution:
    """Read the bytes of a photometric file as `read_photometry` does. path: for messages."""
    if len(data) > MAX_BYTES:
        raise AirlightError(f"{path}: is larger than {MAX_BYTES >> 20} MiB; export it with fewer angles")
    text = _text(data).replace("\r\n", "\n").replace("\r", "\n")
    if lm63.is_lm63(text):
        found = lm63.parse(text, path)
    elif eulumdat.is_eulumdat(text):
        found = eulumdat.parse(text, path)
    else:
        raise AirlightError(f"{path}: {'is no photometric file that Airlight reads' if data else 'is empty'}; give {', '.join(FORMATS)}")
    for line in found.told if tell else ():
        warn(line)
    return found


def _text(data: bytes) -> str:
    """Decode UTF-8, UTF-16 with a mark, or else Latin-1."""
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        return data.decode("utf-16", "replace")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")
