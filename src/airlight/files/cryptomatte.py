"""Mattes of objects by their names, from an EXR's Cryptomatte: ranked pairs of an identifier and its coverage.

Source: Cryptomatte Specification, 1.2.0.
"""

import json
import os
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import Any

import numpy as np

from airlight.errors import AirlightError
from airlight.messages import close

MOST_MANIFEST = 1 << 26  # bytes of a manifest that lies beside the picture
_RANK = re.compile(r"(\d\d)\.(r|g|b|a|red|green|blue|alpha)", re.IGNORECASE)


@dataclass(frozen=True)
class Matte:
    """Holds one Cryptomatte of a file: its name, its pairs of channels (identifier, coverage), and the identifiers of objects."""

    name: str
    pairs: tuple[tuple[int, int], ...]
    manifest: dict[str, int]


def murmur3(text: str) -> int:
    """Hash a name by MurmurHash3_32 with seed 0, over UTF-8. Source: A. Appleby's smhasher, MurmurHash3.cpp."""
    data, mask = text.encode(), 0xFFFFFFFF
    whole = len(data) // 4 * 4
    h = 0
    for at in range(0, len(data), 4):
        k = int.from_bytes(data[at : at + 4], "little") * 0xCC9E2D51 & mask
        h ^= (k << 15 | k >> 17) * 0x1B873593 & mask
        if at < whole:
            h = ((h << 13 | h >> 19) & mask) * 5 + 0xE6546B64 & mask
    h ^= len(data)
    h = (h ^ h >> 16) * 0x85EBCA6B & mask
    h = (h ^ h >> 13) * 0xC2B2AE35 & mask
    return h ^ h >> 16


def identifier(text: str) -> int:
    """Compute the bits of the float that stands for a name: its hash, with an exponent that no float of value lacks."""
    bits = murmur3(text)
    return bits ^ 1 << 23 if bits >> 23 & 255 in (0, 255) else bits


def mattes(spec: Any, names: Sequence[str], path: str) -> list[Matte]:
    """List the Cryptomattes of a file. names: of its channels."""
    found = []
    for item in spec.extra_attribs:
        key = item.name.split("/")
        if len(key) != 3 or key[0] != "cryptomatte" or key[2] != "name":
            continue
        name, ranks = str(item.value), dict[int, dict[str, int]]()
        for i, channel in enumerate(names):
            start = channel.lower().rfind(name.lower())
            rank = _RANK.fullmatch(channel[start + len(name) :]) if start == 0 or (start > 0 and channel[start - 1] == ".") else None
            if rank is not None:
                ranks.setdefault(int(rank[1]), {})[rank[2][0].lower()] = i
        pairs = [
            (rank[a], rank[b]) for _, rank in sorted(ranks.items()) for a, b in (("r", "g"), ("b", "a")) if a in rank and b in rank
        ]
        found.append(Matte(name, tuple(pairs), _manifest(spec, "/".join(key[:2]), path)))
    return found


def _manifest(spec: Any, key: str, path: str) -> dict[str, int]:
    """Read the identifiers of names; none where there is no manifest, or one that makes no sense."""
    text = spec.get_string_attribute(f"{key}/manifest")
    beside = os.path.basename(spec.get_string_attribute(f"{key}/manif_file"))  # of the same folder alone
    try:
        if not text and beside:
            file = os.path.join(os.path.dirname(path), beside)
            if os.path.isfile(file) and os.path.getsize(file) <= MOST_MANIFEST:
                with open(file, encoding="utf-8") as source:
                    text = source.read()
        value = json.loads(text) if text else {}
        return {str(name): int(bits, 16) for name, bits in value.items()}
    except (ValueError, TypeError, AttributeError, OSError, RecursionError):
        return {}


def choose(found: Sequence[Matte], text: str) -> tuple[Matte, str] | None:
    """Find the Cryptomatte and the object that are meant by `MATTE/OBJECT`, or by the object alone where a manifest has it."""
    for matte in sorted(found, key=lambda one: -len(one.name)):
        if text.startswith(f"{matte.name}/"):
            return matte, text[len(matte.name) + 1 :]
    return next(((matte, text) for matte in found if _named(matte, text)), None)


def _named(matte: Matte, text: str) -> list[str]:
    """List the names of a manifest that are meant: the one, or those of a pattern with * and ?."""
    return [text] if text in matte.manifest else [name for name in matte.manifest if fnmatchcase(name, text)]


def coverage(matte: Matte, text: str, plane: Callable[[int], np.ndarray], path: str) -> np.ndarray:
    """Sum the coverage of an object, or of all whose names match a pattern: (H, W) float32 in 0..1.

    plane: gives a channel, (H, W) float32, by its place. Raises AirlightError where there is no such object.
    """
    names = _named(matte, text)
    if not names and (matte.manifest or set(text) & set("*?")):
        near = close(text, matte.manifest, 3, 0.5) or list(matte.manifest)[:8]
        there = f"it has {', '.join(near)}" + (" ..." if len(matte.manifest) > len(near) else "") if near else "it lists no names"
        raise AirlightError(f"{path}: its Cryptomatte {matte.name} has no object {text!r}; {there}")
    if not matte.pairs:
        raise AirlightError(f"{path}: lacks the channels {matte.name}00.R ... of its Cryptomatte; write them with the picture")
    wanted = np.array([matte.manifest[name] for name in names] or [identifier(text)], np.uint32)
    total: Any = 0
    for ids, covers in matte.pairs:
        bits = np.ascontiguousarray(plane(ids), np.float32).view(np.uint32)
        total = total + np.where(np.isin(bits, wanted), np.nan_to_num(plane(covers), posinf=0, neginf=0), 0)
    result = np.clip(total, 0, 1).astype(np.float32)
    if not names and not result.any():
        raise AirlightError(f"{path}: no pixel of its Cryptomatte {matte.name} is of {text!r}, and it lists no names; check the spelling")
    return result
