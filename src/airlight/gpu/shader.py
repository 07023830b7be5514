"""WGSL sources: files beside the modules that use them, with two directives.

`//! include "path"` puts another file in, once. `//! each k of 3: statement` repeats the statement with 0u, 1u, 2u for k: the
translator guards every loop against running for ever, and so keeps drivers from unrolling it.
"""

import re
from importlib.resources import files
from typing import Any

_BINDING = re.compile(r"^@group\(0\) @binding\((\d+)\) var(?:<(\w+)(?:, (\w+))?>)? (\w+): (\w+)(?:<(\w+)(?:, \w+)?>)?;", re.M)
_FILTERED = re.compile(r"\btexture(?:Sample\w*|Gather\w*)\(\s*(?:\d,\s*)?(\w+)")
_EACH = re.compile(r"^ *//! each (\w+) of (\d+): (.+)$", re.M)
_INCLUDE = re.compile(r'^//! include "([\w/.]+)"$', re.M)


def load(path: str) -> str:
    """Read a .wgsl file, its path relative to the package, and carry out its directives."""
    done: set[str] = set()

    def expand(name: str) -> str:
        if name in done:
            return ""
        done.add(name)
        return _INCLUDE.sub(lambda m: expand(m[1]), files("airlight").joinpath(name).read_text(encoding="utf-8"))

    return _EACH.sub(lambda m: " ".join(re.sub(rf"\b{m[1]}\b", f"{i}u", m[3]) for i in range(int(m[2]))), expand(path))


def bindings(code: str) -> list[dict[str, Any]]:
    """List the layout entries of group 0, read off the declarations, so that all entry points of a file share one bind group.

    Textures that no function samples or gathers are never filtered: they may be rgba32float on any adapter.
    """
    filtered = set(_FILTERED.findall(code))
    stages = "COMPUTE" if "@compute" in code else "VERTEX|FRAGMENT"
    entries = []
    for number, space, access, name, kind, argument in _BINDING.findall(code):
        entry: dict[str, Any] = {"binding": int(number), "visibility": stages}
        if space == "uniform":
            entry["buffer"] = {"type": "uniform"}
        elif space == "storage":
            entry["buffer"] = {"type": "storage" if access == "read_write" else "read-only-storage"}
        elif kind == "sampler":
            entry["sampler"] = {"type": "filtering"}
        elif kind == "texture_storage_2d":
            entry["storage_texture"] = {"access": "write-only", "format": argument}
        elif kind == "texture_storage_2d_array":
            entry["storage_texture"] = {"access": "write-only", "format": argument, "view_dimension": "2d-array"}
        elif kind == "texture_storage_3d":
            entry["storage_texture"] = {"access": "write-only", "format": argument, "view_dimension": "3d"}
        elif kind == "texture_depth_2d":
            entry["texture"] = {"sample_type": "depth"}
        elif kind == "texture_3d":
            entry["texture"] = {"sample_type": "float", "view_dimension": "3d"}
        elif kind == "texture_depth_2d_array":
            entry["texture"] = {"sample_type": "depth", "view_dimension": "2d-array"}
        else:
            dimension = "2d-array" if kind == "texture_2d_array" else "2d"
            entry["texture"] = {"sample_type": "float" if name in filtered else "unfilterable-float", "view_dimension": dimension}
        entries.append(entry)
    return entries
