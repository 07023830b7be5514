"""WGSL sources: files beside the modules that use them, with `//! include "path"` lines."""

import re
from importlib.resources import files

_INCLUDE = re.compile(r'^//! include "([\w/.]+)"$', re.M)


def load(path: str) -> str:
    """The text of a .wgsl file, its path relative to the package, each include put in once."""
    done: set[str] = set()

    def expand(name: str) -> str:
        if name in done:
            return ""
        done.add(name)
        return _INCLUDE.sub(lambda m: expand(m[1]), files("airlight").joinpath(name).read_text(encoding="utf-8"))

    return expand(path)
