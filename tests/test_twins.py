"""Each pure shader function has a float64 twin of its name in reference/, named in its comment, and is called over arrays in a test.

Entry points are excepted, and functions that touch more than their parameters, uniforms and read-only records: textures, arrays in
buffers, workgroup and private memory, pointers; themselves or by what they call (wgsl.impure).
"""

import ast
import re
from functools import cache
from pathlib import Path

import pytest
from wgsl import Function, functions, impure, uncommented

import airlight
from airlight.gpu.shader import load

PACKAGE = Path(airlight.__file__).parent
TESTS = Path(__file__).parent
SHADERS = sorted(str(p.relative_to(PACKAGE).as_posix()) for p in PACKAGE.rglob("*.wgsl"))
TWIN = re.compile(r"\bTwin: ([\w/]+\.py):(\w+)\.(?=\s|$)")


@cache
def own(path: str) -> tuple[Function, ...]:
    """The functions of a file itself, without what it includes."""
    return tuple(functions((PACKAGE / path).read_text("utf-8")))


@cache
def definitions(path: str) -> set[str]:
    """The functions and classes of a module of the package."""
    file = PACKAGE / path
    if not file.is_file():
        return set()
    return {node.name for node in ast.parse(file.read_text("utf-8")).body if isinstance(node, ast.FunctionDef | ast.ClassDef)}


@cache
def users() -> dict[str, list[str]]:
    """For each file the files that are loaded with it, itself among them."""
    found: dict[str, list[str]] = {path: [] for path in SHADERS}

    def include(path: str, into: str) -> None:
        if into not in found[path]:
            found[path].append(into)
            for other in re.findall(r'^//! include "([\w/.]+)"$', (PACKAGE / path).read_text("utf-8"), re.M):
                include(other, into)

    for path in SHADERS:
        include(path, path)
    return found


@cache
def touches(path: str) -> set[str]:
    """The functions of a file, and of what it includes, that touch memory."""
    return impure(load(path))


@cache
def called() -> set[str]:
    """The names of the functions that tests `call`."""
    return {name for file in TESTS.rglob("test_*.py") for name in re.findall(r'\bcall\(\s*[^,()]+,\s*"(\w+)"', file.read_text("utf-8"))}


@cache
def pure() -> dict[tuple[str, str], Function]:
    """By (path, name)."""
    found = {}
    for path in SHADERS:
        # a fragment of a shader is judged by what uses it: it may name what only they declare
        touching = set.union(*(touches(user) for user in users()[path]))
        found |= {(path, f.name): f for f in own(path) if not f.is_entry and f.name not in touching}
    return found


def problem(path: str, function: Function) -> str:
    """What a pure function lacks, or nothing."""
    named = TWIN.findall(function.about)
    if len(named) != 1:
        return "its comment names no twin: it ends with `Twin: reference/FILE.py:NAME.`"
    module, name = named[0]
    if name != function.name or not module.startswith("reference/"):
        return f"its twin {module}:{name} has another name, or is not in reference/"
    if name not in definitions(module):
        return f"there is no {name} in {module}"
    if name not in called():
        return f'no test calls it: call("{path}", "{name}", ...)'
    return ""


def test_each_pure_function_has_a_twin() -> None:
    found = {f"{path}:{name}": problem(path, f) for (path, name), f in pure().items()}
    assert {name: text for name, text in found.items() if text} == {}


def test_twins_that_are_named_exist() -> None:
    """In any comment, of an entry point or a file too, and in one form."""
    wrong = set()
    for path in SHADERS:
        text = (PACKAGE / path).read_text("utf-8")
        named = TWIN.findall(text)
        if len(named) != len(re.findall(r"twin", text, re.I)) or any(name not in definitions(module) for module, name in named):
            wrong.add(path)
    assert wrong == set()


def test_names_of_pure_functions_are_unique() -> None:
    """So that a name says which function a test calls."""
    names = [name for _, name in pure()]
    assert sorted(names) == sorted(set(names))


@pytest.mark.parametrize("path", SHADERS)
def test_no_function_is_overlooked(path: str) -> None:
    code = uncommented((PACKAGE / path).read_text(encoding="utf-8"))
    assert len(functions((PACKAGE / path).read_text(encoding="utf-8"))) == len(re.findall(r"\bfn\b", code))


def test_this_finds_functions() -> None:
    """The rule itself: there are many pure functions, and entry points and reads of textures are not among them."""
    names = set(pure())
    assert len(names) > 50
    assert {("wgsl/half.wgsl", "nearest_half"), ("look/rays.wgsl", "polar"), ("medium/phase.wgsl", "phase")} <= names
    assert not {("look/bands.wgsl", "scan"), ("viewer/show.wgsl", "between"), ("scatter/epipolar/scan.wgsl", "store_sum")} & names
    broken = Function("polar", "Find it. Twin: reference/look.py:no_such_name.", False, (), "f32", "")
    assert problem("look/rays.wgsl", broken) and problem("look/rays.wgsl", Function("polar", "", False, (), "f32", ""))
