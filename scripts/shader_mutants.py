"""Makes small faults in the pure functions of shaders, and prints the share that the tests of functions notice, and the others.

Each mutant changes one operator, comparison, number, or pair of arguments of a function that has a float64 twin; tried are the tests that
call it, or a function that calls it. Tests of passes and of pictures are not tried: they can only notice more. Mutants that do not
compile are set aside.

    python scripts/shader_mutants.py [PART OF A PATH OR FUNCTION ...] [--each N]
"""

import argparse
import contextlib
import io
import random
import re
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

TESTS = Path(__file__).parent.parent / "tests"
sys.path.insert(0, str(TESTS))

import calling  # noqa: E402  of the tests, as the ones below
import pytest  # noqa: E402
from test_twins import pure  # noqa: E402
from wgsl import functions, uncommented  # noqa: E402

from airlight.gpu.device import open_device  # noqa: E402
from airlight.gpu.shader import load  # noqa: E402

PAIRS = ("+", "-"), ("*", "/"), ("<", ">="), (">", "<="), ("==", "!="), ("&&", "||")
INSTEAD = {one: other for pair in PAIRS for one, other in (pair, pair[::-1])}
OTHER = {"min": "max", "max": "min", "floor": "ceil", "ceil": "floor", "cos": "sin", "sin": "cos", "exp": "exp2", "exp2": "exp"}
TOKEN = re.compile(
    r"(?P<sign>(?<=[(,=*/+<>]) ?-(?=[\w(]))|(?P<operator> (?:[-+*/<>]|<=|>=|==|!=|&&|\|\|) )|(?P<name>\b(?:" + "|".join(OTHER) + r")(?=\())"
    r"|(?P<clamp>\bclamp(?=\())|(?P<select>\bselect(?=\())|(?P<number>(?<![\w.])\d+(?:\.\d*)?(?:e[-+]?\d+)?[uif]?(?![\w.]))"
)
QUIET = ["-q", "-x", "--no-header", "-p", "no:cacheprovider", "-p", "no:xdist", "-W", "ignore"]


class Calls:
    """Notes, as a plugin of pytest, which test calls which functions."""

    def __init__(self) -> None:
        self.test = ""
        self.of: dict[str, set[tuple[str, str]]] = {}

    @pytest.hookimpl
    def pytest_runtest_setup(self, item: Any) -> None:
        self.test = item.nodeid

    def note(self, path: str, function: str) -> None:
        self.of.setdefault(self.test, set()).add((path, function))


def run(tests: Sequence[str], plugin: Any = None) -> bool:
    """Run tests in this process, without a word. True: they passed."""
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        return pytest.main([*QUIET, *tests], plugins=[plugin] if plugin else []) == pytest.ExitCode.OK


def covered() -> dict[tuple[str, str], list[str]]:
    """Map each (path, function) that tests call, and each that it calls in turn, to the tests."""
    calls = Calls()
    original = calling.call

    def noted(path: str, function: str, *args: Any, **options: Any) -> Any:
        calls.note(path, function)
        return original(path, function, *args, **options)

    calling.call = noted
    all_of_them = {p: p.read_text("utf-8") for p in sorted(TESTS.rglob("test_*.py"))}
    files = [str(p) for p, text in all_of_them.items() if "from calling import call" in text and p.stem != "test_calling"]
    assert run(files, calls), "the tests fail without a fault too"
    calling.call = original
    found: dict[tuple[str, str], list[str]] = {}
    for test, called in calls.of.items():
        for path, name in called:
            bodies = {f.name: f.body for f in functions(load(path))}
            reached, todo = set(), [name]
            while todo:
                one = todo.pop()
                if one in bodies and one not in reached:
                    reached.add(one)
                    todo += re.findall(r"(?<![.\w])(\w+)\(", bodies[one])
            for one in reached:
                found.setdefault((path, one), []).append(test)
    return found


def mutants(body: str) -> Iterator[tuple[int, int, str]]:
    """List (begin, end, text instead) of each small fault in a function's body."""
    for m in TOKEN.finditer(body):
        kind, text = m.lastgroup, m[0].strip()
        if kind == "sign":
            yield m.start(), m.end(), m[0].replace("-", "")
        elif kind == "operator":
            yield m.start(), m.end(), f" {INSTEAD[text]} "
        elif kind == "name":
            yield m.start(), m.end(), OTHER[text]
        elif kind in ("clamp", "select"):
            begin, parts = m.end() + 1, [""]
            depth, end = 1, begin
            while depth:
                depth += {"(": 1, ")": -1}.get(body[end], 0)
                if body[end] == "," and depth == 1:
                    parts.append("")
                elif depth:
                    parts[-1] += body[end]
                end += 1
            a, b, *rest = parts
            yield m.start(), end, f"({a})" if kind == "clamp" else f"select({b.strip()}, {a}, {','.join(rest).strip()})"
        elif kind == "number":
            digits = text.rstrip("uif")
            whole = "." not in digits and "e" not in digits
            more = str(int(digits) + 1) if whole else repr(float(digits) * 1.01 or 0.01)
            yield m.start(), m.end(), more + text[len(digits) :]


def try_all(only: Sequence[str], each: int) -> None:
    """Try mutants of the functions whose path or name holds one of `only`, at most `each` a function, and print the report."""
    tests = covered()
    device = open_device().device
    counts: dict[str, list[int]] = {}
    survivors = []
    for path, name in sorted(pure()):
        own = next(f for f in functions(load(path)) if f.name == name)
        if only and not any(one in path or one in name for one in only):
            continue
        mine = sorted({test for (_, function), its in tests.items() if function == name for test in its})
        users = sorted({user for user, function in tests if function == name})
        chosen = list(mutants(own.body))
        random.Random(name).shuffle(chosen)
        for begin, end, instead in chosen[: each or None]:
            body = own.body[:begin] + instead + own.body[end:]

            def faulty(wanted: str, name: str = name, old: str = own.body, new: str = body) -> str:
                code = uncommented(load(wanted))
                return re.sub(rf"(\bfn {name}\((?:[^()]|\([^()]*\))*\)[^{{]*\{{){re.escape(old)}", lambda m: m[1] + new, code)

            try:
                device.create_shader_module(code=faulty(users[0] if users else path))
            except Exception:  # does not compile
                continue
            calling.load = faulty
            noticed = bool(mine) and not run(mine)
            calling.load = load
            calling._pipeline.cache_clear()
            of = counts.setdefault(path, [0, 0])
            of[0] += 1
            of[1] += noticed
            if not noticed:
                near = " ".join((own.body[max(0, begin - 30) : begin] + "[" + own.body[begin:end] + "]" + own.body[end : end + 20]).split())
                survivors.append(f"{path}:{name}: {near} -> {instead.strip()}")
                print(survivors[-1], file=sys.stderr, flush=True)
    print("| shader | mutants | noticed |\n|---|--:|--:|")
    for path, (tried, noticed) in counts.items():
        print(f"| `{path}` | {tried} | {noticed / tried:.0%} |")
    tried, noticed = (sum(of[i] for of in counts.values()) for i in (0, 1))
    print(f"| all | {tried} | {noticed / max(tried, 1):.1%} |\n\n{len(survivors)} not noticed:", *survivors, sep="\n")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("only", nargs="*", help="parts of paths or names of functions; none: all")
    parser.add_argument("--each", type=int, default=0, help="mutants of each function; 0: all")
    options = parser.parse_args()
    try_all(options.only, options.each)


if __name__ == "__main__":
    main()
