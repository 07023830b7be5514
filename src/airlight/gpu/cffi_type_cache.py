"""A quicker start of wgpu: most of the time until the first picture went into parsing the names of C types.

cffi parses each name behind a prelude of all declared names, here some 430: 13 ms a name, 65 names. But names of declared types,
pointers to them and arrays of them need no parser. What cffi would have answered is answered; anything else is left to cffi.
"""

import contextlib
import re
from typing import Any

_SIMPLE = re.compile(r"\s*(\w+)\s*(\*|\[\s*\])?\s*")


def cache_simple_types(ffi: Any) -> None:
    """Let an `FFI` look simple types up; leaves it alone where cffi is not as known (tests/test_gpu.py tells)."""
    with contextlib.suppress(AttributeError, ImportError):
        from cffi import model
        from cffi.commontypes import resolve_common_type

        parser = ffi._parser
        slow, declared, pointer = parser.parse_type_and_quals, parser._declarations, parser._get_type_pointer

        def quick(text: str) -> Any:
            found = _SIMPLE.fullmatch(text)
            if found is None or found[1] == "void":
                return slow(text)
            known = declared.get(f"typedef {found[1]}")
            try:
                kind, qualifiers = known if known is not None else resolve_common_type(parser, found[1])
            except Exception:
                return slow(text)
            if found[2] == "*":
                return pointer(kind, qualifiers), 0
            return (model.ArrayType(kind, None) if found[2] else kind), qualifiers

        parser.parse_type_and_quals = quick
