"""Imports go one way, without a circle, those inside functions included.

The table of methods names code as text: what it names is found by `scatter.methods`, which none of it imports before it is used.
"""

import ast
from collections.abc import Iterable, Iterator
from pathlib import Path

import pytest

SOURCE = Path(__file__).parents[1] / "src" / "airlight"

# A module may import what lies in its own layer and in those below. The longest name that fits a module counts.
LAYERS = (
    "__main__",
    "cli viewer bench compare",
    "jobs",
    "scenes",
    "pygfx",
    "api baked debug layers pictures",
    "scatter reference daylight",
    "shadows medium lights occlusion composite look detect reference.look reference.colour reference.around",
    "options gpu files notebook_image",
    "errors alpha arrays colour luminance planes noise progress projection messages process scatter.methods",
)
RANK = {name: -rank for rank, names in enumerate(LAYERS) for name in names.split()}
HOLDS_MATHS = {"shadows", "medium", "lights", "occlusion", "composite", "look", "detect", "scatter", "reference", "gpu"}



def module_names(root: Path) -> dict[str, Path]:
    """Map the name of each module below `root`, without the package's own, to its file; a package goes by its folder."""
    names = {}
    for path in root.rglob("*.py"):
        parts = path.relative_to(root).with_suffix("").parts
        names[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return names


def statements(node: ast.AST) -> Iterator[ast.Import | ast.ImportFrom]:
    """Find the import statements that can run: in functions too, not those under TYPE_CHECKING."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.Import | ast.ImportFrom):
            yield child
        elif isinstance(child, ast.If) and ast.unparse(child.test) in ("TYPE_CHECKING", "typing.TYPE_CHECKING"):
            yield from statements(ast.Module(child.orelse, []))
        else:
            yield from statements(child)


def imported(name: str, path: Path, modules: Iterable[str]) -> Iterator[str]:
    """List the modules of the package that one module imports."""
    package = ["airlight", *(part for part in name.split(".") if part)]
    if path.name != "__init__.py":
        package.pop()
    for statement in statements(ast.parse(path.read_text())):
        if isinstance(statement, ast.Import):
            sources = [alias.name for alias in statement.names]
        else:
            base = package[: len(package) - statement.level + 1] if statement.level else []
            base = [*base, *(statement.module.split(".") if statement.module else [])]
            sources = [".".join([*base, alias.name]) for alias in statement.names]
        for source in sources:
            first, *rest = source.split(".")
            if first == "airlight":
                yield next((known for end in (len(rest), len(rest) - 1) if (known := ".".join(rest[:end])) in modules), "")


def graph(root: Path) -> dict[str, set[str]]:
    """Read which modules each module imports; the package's own __init__, which imports on first use, is left out."""
    modules = module_names(root)
    return {name: set(imported(name, path, modules)) - {"", name} for name, path in modules.items() if name}


def rank(name: str) -> int:
    parts = name.split(".")
    for end in range(len(parts), 0, -1):
        if (found := RANK.get(".".join(parts[:end]))) is not None:
            return found
    raise AssertionError(f"{name}: LAYERS does not say where it belongs")


def wrong_directions(imports: dict[str, set[str]]) -> set[str]:
    """List imports that go up, into the command line, or from maths to files."""

    def top(name: str) -> str:
        return name.split(".")[0]

    return {
        f"{importer} {source}"
        for importer, sources in imports.items()
        for source in sources
        if rank(source) > rank(importer)
        or (top(source) == "cli" and top(importer) not in ("cli", "__main__"))
        or (top(source) == "files" and top(importer) in HOLDS_MATHS)
    }


def in_circles(imports: dict[str, set[str]]) -> set[str]:
    """List imports between modules that reach each other."""
    reached = {name: set(sources) for name, sources in imports.items()}
    for middle in reached:
        for sources in reached.values():
            if middle in sources:
                sources |= reached[middle]
    return {f"{name} {source}" for name, sources in imports.items() for source in sources if name in reached.get(source, ())}


def test_imports_go_one_way() -> None:
    assert not wrong_directions(graph(SOURCE))


def test_only_the_table_of_methods_and_the_package_itself_import_by_name() -> None:
    """What is imported by a text, or by the package's own attributes, is seen by no other test here."""
    found = set()
    for path in SOURCE.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            by_text = isinstance(node, ast.Call) and ast.unparse(node.func).endswith(("import_module", "__import__"))
            by_root = isinstance(node, ast.ImportFrom) and node.module == "airlight" and any(
                not (SOURCE / alias.name).with_suffix(".py").exists() and not (SOURCE / alias.name).is_dir() for alias in node.names
            )
            if (by_text and "airlight" in ast.unparse(node)) or by_root:
                found.add(path.relative_to(SOURCE).as_posix())
    assert found == {"__init__.py", "scatter/methods.py"}


def test_no_modules_import_each_other() -> None:
    assert not in_circles(graph(SOURCE))


@pytest.mark.parametrize(
    ("files", "directions", "circles"),
    [
        ({"gpu/device.py": "from ..errors import MachineError", "errors.py": ""}, set(), set()),
        ({"errors.py": "def f():\n    from .gpu import device", "gpu/device.py": ""}, {"errors gpu.device"}, set()),
        ({"api.py": "import airlight.cli.image", "cli/image.py": ""}, {"api cli.image"}, set()),
        ({"viewer/app.py": "from ..cli.image import x", "cli/image.py": ""}, {"viewer.app cli.image"}, set()),
        ({"look/plan.py": "from ..files import colour", "files/colour.py": ""}, {"look.plan files.colour"}, set()),
        ({"api.py": "if TYPE_CHECKING:\n    from .cli import image", "cli/image.py": ""}, set(), set()),
        ({"viewer/app.py": "if not TYPE_CHECKING:\n    import airlight.cli.image", "cli/image.py": ""}, {"viewer.app cli.image"}, set()),
        ({"files/a.py": "from .b import x", "files/b.py": "class A:\n    def f(self):\n        from . import a"}, set(),
         {"files.a files.b", "files.b files.a"}),
    ],
)  # fmt: skip
def test_they_are_read_as_they_run(tmp_path: Path, files: dict[str, str], directions: set[str], circles: set[str]) -> None:
    for name, text in files.items():
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        (path.parent / "__init__.py").touch()
        path.write_text(text)
    imports = graph(tmp_path)
    assert (wrong_directions(imports), in_circles(imports)) == (directions, circles)
