"""Reads the functions of WGSL sources: names, parameters, comments, and which are pure."""

import re
from dataclasses import dataclass

_COMMENT = re.compile(r"//[^\n]*")
_FUNCTION = re.compile(
    r"(?P<about>(?:^ *//[^\n]*\n)*)(?P<attributes>(?:^ *@(?:compute|vertex|fragment)\b[^\n]*\n)*)"
    r"^ *fn (?P<name>\w+)\((?P<parameters>(?:[^()]|\([^()]*\))*)\)(?: -> (?P<returns>[^{]+?))? *\{",
    re.M,
)
_BUILT_IN = re.compile(r"\b(?:texture[A-Z]\w*|atomic[A-Z]\w*|workgroupBarrier|storageBarrier|arrayLength)\(|\bdiscard\b")


@dataclass(frozen=True)
class Function:
    name: str
    about: str  # its comment, without the slashes
    is_entry: bool
    parameters: tuple[tuple[str, str], ...]  # name, type
    returns: str
    body: str  # without comments


def uncommented(code: str) -> str:
    return _COMMENT.sub("", code)


def functions(code: str) -> list[Function]:
    """All functions of a source, in its order."""
    found = []
    heads = list(_FUNCTION.finditer(code))
    for m, after in zip(heads, [*(head.start() for head in heads[1:]), len(code)], strict=False):  # no functions: no pairs
        text = re.sub(r"^//! each [^:]*:", "", code[m.end() : after], flags=re.M)
        text = re.sub(r"//! each \w+ of \d+:", "", text)
        text = uncommented(text)
        depth, end = 1, 0
        while depth:
            depth += {"{": 1, "}": -1}.get(text[end], 0)
            end += 1
        about = "\n".join(line.strip().lstrip("/").strip() for line in m["about"].splitlines())
        parameters = re.split(r",(?![^<]*>)", re.sub(r"@\w+(?:\([^)]*\))? ", "", m["parameters"]))
        pairs = tuple((name.strip(), kind.strip().replace(" ", "")) for name, kind in (p.split(":") for p in parameters if ":" in p))
        returns = (m["returns"] or "").strip().replace(" ", "")
        found.append(Function(m["name"], about, bool(m["attributes"]), pairs, returns, text[: end - 1]))
    return found


def memory(code: str) -> set[str]:
    """Name the variables that only an impure function touches: textures, buffers that are arrays or written, workgroup and private ones.

    Uniforms, and structs in storage that is only read, are parameters that all invocations share.
    """
    names = set()
    for space, name, kind in re.findall(r"^(?:@group\(\d+\) @binding\(\d+\) )?var(?:<([^>]*)>)? (\w+): *([^;=]+)", uncommented(code), re.M):
        is_record = not kind.startswith(("array", "texture", "sampler"))
        if not (is_record and space.replace(" ", "") in ("uniform", "storage,read", "storage")):
            names.add(name)
    return names


def impure(code: str) -> set[str]:
    """Name the functions that touch memory beyond their parameters, in their body or by what they call, or that are handed a pointer."""
    all_of_it, touches = functions(code), memory(code)
    names = {f.name for f in all_of_it if _BUILT_IN.search(f.body) or any(kind.startswith("ptr<") for _, kind in f.parameters)}
    names |= {f.name for f in all_of_it if (set(re.findall(r"(?<![.\w])\w+", f.body)) - _locals(f)) & touches}
    calls = {f.name: set(re.findall(r"(?<![.\w])(\w+)\(", f.body)) for f in all_of_it}
    while True:
        more = names | {f.name for f in all_of_it if calls[f.name] & names}
        if more == names:
            return names
        names = more


def _locals(own: Function) -> set[str]:
    return {name for name, _ in own.parameters} | set(re.findall(r"\b(?:let|var|const) (\w+)", own.body))
