"""Habits that a reader would have to enforce otherwise: verbs begin what describes a function, and tests use public names."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from airlight.scatter.methods import AUTO, METHODS

TESTS = Path(__file__).parent
SOURCE = TESTS.parent / "src" / "airlight"

# Private names of other projects that tests look at: canaries of those that Airlight relies on, and steps that nothing public takes.
THEIRS = {
    "test_browser_messages.py": {"_active_client"},  # rendercanvas
    "test_browser_page.py": {"_active_client", "_websockets"},
    "test_browser_upstream.py": {"_active_client", "_encode_frame", "_is_closed", "_last_frame", "_size_info"},
    "test_viewer_panel.py": {"_process_events"},
    "viewer_driver.py": {"_process_events"},
    "test_gpu.py": {"_ffi", "_parse", "_parser"},  # wgpu, cffi
    "test_punctual.py": {"_gfx_update_uniform_buffer"},  # pygfx
    "test_medium_pass.py": {"_blender", "_textures"},
    "test_scene_pass.py": {"_blender", "_texture_info", "_textures"},
    "test_scene_private.py": {"_base", "_compose_pipeline", "_gfx_update_uniform_buffer", "_gfx_use_alpha_test", "_morph_target_influences",
                              "_perspective", "_render_recording", "_texture_info", "_update_object", "_view_offset"},
    "test_renderer.py": {"_repr_png_"},  # what IPython calls
    "test_viewer_window.py": {"_repr_mimebundle_"},
}  # fmt: skip


NAMED_TUPLE = ("_asdict", "_fields", "_make", "_replace")  # public, in spite of their names


def is_private(name: str) -> bool:
    return name.startswith("_") and not name.startswith("__") and name not in NAMED_TUPLE


def private_names(text: str) -> set[str]:
    """Find the private names that a module uses of others: imported, as attributes, or as words for setattr and its like."""
    names = set()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Attribute) and not (isinstance(node.value, ast.Name) and node.value.id in ("self", "cls")):
            names.add(node.attr)
        elif isinstance(node, ast.Import | ast.ImportFrom):
            paths = [alias.name for alias in node.names] + [getattr(node, "module", None) or ""]
            names |= {part for path in paths for part in path.split(".")}
        elif isinstance(node, ast.Call) and (isinstance(node.func, ast.Name | ast.Attribute)):
            called = node.func.id if isinstance(node.func, ast.Name) else node.func.attr
            if called in ("getattr", "setattr", "hasattr", "delattr", "attrgetter", "object"):
                said = (argument.value for argument in node.args if isinstance(argument, ast.Constant))
                names |= {part for text in said if isinstance(text, str) for part in text.split(".")}
    return {name for name in names if is_private(name)}


def descriptions(folder: Path) -> Iterator[tuple[str, bool, str]]:
    """List (where, whether it is a function's, first line) of docstrings, and of comments with three strokes in shaders."""
    for path in sorted(folder.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef) and (text := ast.get_docstring(node)):
                is_function = isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
                yield f"{path.relative_to(folder)}:{getattr(node, 'lineno', 1)}", is_function, text.splitlines()[0]
    for path in sorted(folder.rglob("*.wgsl")):
        before = ""
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
            if (comment := line.strip()).startswith("///") and not before.startswith("///"):
                yield f"{path.relative_to(folder)}:{number}", True, comment.lstrip("/ ")
            before = comment


def beginning_with(words: str, functions: bool, folder: Path = SOURCE) -> list[str]:
    return [f"{where}: {line}" for where, is_function, line in descriptions(folder)
            if re.match(rf"({words})\b", line) and (is_function or not functions)]  # fmt: skip


def test_tests_use_public_names() -> None:
    found = {path.name: private_names(path.read_text(encoding="utf-8")) for path in TESTS.rglob("*.py")}
    new = {name: names - THEIRS.get(name, set()) for name, names in found.items()}
    assert not {name: names for name, names in new.items() if names}, "make it public under a good name, or test what it does from outside"
    gone = {name: names - found.get(name, set()) for name, names in THEIRS.items()}
    assert not {name: names for name, names in gone.items() if names}, "the list names what no test uses"


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("from airlight.api import _shafts", {"_shafts"}),
        ("import a._b.c", {"_b"}),
        ("from a._b import c", {"_b"}),
        ("thing.part._made", {"_made"}),
        ("monkeypatch.setattr(module, '_made', None)", {"_made"}),
        ("monkeypatch.setattr('airlight.api._shafts', None)", {"_shafts"}),
        ("mock.patch.object(module, '_made')", {"_made"}),
        ("self._made = thing.__dict__", set()),
        ("say(type='_x')", set()),
    ],
)
def test_private_names_are_found(text: str, names: set[str]) -> None:
    assert private_names(text) == names


def test_descriptions_begin_with_a_verb() -> None:
    assert not beginning_with("What|Where|Whether|How", False)
    assert not beginning_with("The|A|An", True)  # which suit modules and classes


def test_descriptions_are_found(tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text('"""How it is."""\nclass A:\n    """The thing."""\n    def b(self):\n        """What is.\n\n  More."""')
    (tmp_path / "b.wgsl").write_text("/// A ray,\n/// whether it is lit.\nfn a() {}\n// Where\n")
    assert beginning_with("What|Where|Whether|How", False, tmp_path) == ["a.py:1: How it is.", "a.py:4: What is."]
    assert beginning_with("The|A|An", True, tmp_path) == ["b.wgsl:1: A ray,"]


def compared_names(text: str, names: set[str]) -> set[str]:
    """Find which names a module compares something with, by ==, in, match, or by a dict in which something is looked up."""
    found: set[str] = set()
    for node in ast.walk(ast.parse(text)):
        parts: list[ast.AST] = []
        if isinstance(node, ast.Compare):
            parts = [node.left, *node.comparators]
        elif isinstance(node, ast.MatchValue):
            parts = [node.value]
        elif isinstance(node, ast.Subscript | ast.Attribute) and isinstance(node.value, ast.Dict):  # {"march": 1}[name], .get(name)
            parts = [key for key in node.value.keys if key is not None]
        for part in parts:
            found |= {one.value for one in ast.walk(part) if isinstance(one, ast.Constant) and isinstance(one.value, str)} & names
    return found


def test_only_methods_know_their_names() -> None:
    names = set(METHODS) - {AUTO}  # a word of many other options
    compared = {
        str(path.relative_to(SOURCE)): found
        for path in SOURCE.rglob("*.py")
        if path.relative_to(SOURCE).parts[0] != "scatter" and (found := compared_names(path.read_text(encoding="utf-8"), names))
    }
    assert compared == {}


@pytest.mark.parametrize("text", ['p.method == "march"', 'm in ("radial", "x")', '{"march": 1}[m]', 'match m:\n    case "march": pass'])
def test_names_that_are_compared_are_found(text: str) -> None:
    assert compared_names(text, {"march", "radial"})


def test_names_of_options_are_not_taken_for_comparisons() -> None:
    assert not compared_names('f(**{"march": march}); Parameters(method="march")', {"march"})


def test_shaders_leave_sines_to_no_driver() -> None:
    """Vulkan lets a driver's be off by 2^-11: half a pixel at a thousand. `unit_at` of wgsl/unit_at.wgsl is good to 2e-7."""
    own = r"\b(sin|cos|tan|asin|acos|sinh|cosh|sincos)\("
    found = [f"{path.relative_to(SOURCE)}: {line.strip()}" for path in SOURCE.rglob("*.wgsl")
             for line in path.read_text(encoding="utf-8").splitlines() if re.search(own, line.split("//")[0])]  # fmt: skip
    assert not found


def test_slow_tests_that_are_named_are_there() -> None:
    root = Path(__file__).parents[1]
    for name in (root / "tests" / "slow_too.txt").read_text().split():
        file, _, test = name.partition("::")
        assert f"def {test.partition('[')[0]}(" in (root / file).read_text(), name
