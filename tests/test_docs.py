"""What documents name is there: paths, `path:name` in them, links, commands, the README's figures."""

import contextlib
import itertools
import re
import shlex
from functools import cache
from pathlib import Path

import click
import pytest
from documented import DOCS

from airlight.cli import cli

ROOT = DOCS.parent
README = ROOT / "README.md"
PAGES = [*sorted(DOCS.rglob("*.md")), README, ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md"]
OF_CODE = ("architecture", "equations", "glossary", "references")
NAMED = re.compile(r"`((?:src/airlight/|tests/|scripts/|docs/)?[\w/-]+(?:\.(?:py|wgsl|toml|md|html|js|sh)|/))(?::(\w+(?:\.\w+)?))?`")
DEFINES = r"^[ \t]*(?:(?:async )?(?:def|class|fn|struct|const|alias|override)\s+{0}\b|(?:var<\w+> )?{0}\b(?:\[.*\])?\s*(?::.*)?=|{0}: )"


def names(page: str) -> list[tuple[str, str]]:
    return sorted(set(NAMED.findall((DOCS / f"{page}.md").read_text(encoding="utf-8"))))


def headings(text: str) -> set[str]:
    """The anchors that GitHub gives to headings."""
    plain = (re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", line) for line in re.findall(r"^#+ (.*)$", text, re.M))
    return {re.sub(r"[^\w\- ]", "", line.lower()).replace(" ", "-") for line in plain}


@pytest.mark.parametrize("page", OF_CODE)
def test_what_is_named_is_there(page: str) -> None:
    found = names(page)
    assert len(found) > 10
    lacking = []
    for path, name in found:
        at = next((place for place in (ROOT / path, ROOT / "src" / "airlight" / path) if place.exists()), None)
        parts = name.split(".") if name else []
        if at is None or not all(re.search(DEFINES.format(part), at.read_text(encoding="utf-8"), re.M) for part in parts):
            lacking.append(f"{path}:{name}".rstrip(":"))
    assert lacking == []


def test_the_architecture_names_all_of_the_packages_top_level() -> None:
    there = {path.name + "/" * path.is_dir() for path in (ROOT / "src" / "airlight").iterdir()} - {"__pycache__/", "py.typed"}
    assert sorted(there - {path for path, _ in names("architecture")}) == []


def test_tests_that_are_named_are_there() -> None:
    files = (ROOT / "tests").rglob("*.py")
    there = {name for path in files for name in re.findall(r"^def (test_\w+)", path.read_text(encoding="utf-8"), re.M)}
    found = {name for page in OF_CODE for name in re.findall(r"`(test_\w+)`", (DOCS / f"{page}.md").read_text(encoding="utf-8"))}
    assert len(found) > 30 and sorted(found - there) == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_classes_that_are_named_are_there(page: Path) -> None:
    """`SceneLight(...)` and the like: words of two capitals between backticks, ours or another program's that we name."""
    found = set(re.findall(r"`(?:airlight\.)?([A-Z][a-z]+(?:[A-Z][a-z]+)+)\b[^`]*`", page.read_text(encoding="utf-8")))
    assert sorted(found - code_words()) == []


@cache
def code_words() -> frozenset[str]:
    paths = (path for path in (ROOT / "src").rglob("*") if path.suffix in (".py", ".wgsl", ".toml"))
    return frozenset(word for path in paths for word in re.findall(r"\w+", path.read_text(encoding="utf-8")))


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    lacking = []
    for target in re.findall(r"\]\((?!https?:)([^) ]+)\)", re.sub(r"```.*?```", "", text, flags=re.S)):
        path, _, anchor = target.partition("#")
        at = page.parent / path if path else page
        if not at.exists() or (anchor and at.suffix == ".md" and anchor not in headings(at.read_text(encoding="utf-8"))):
            lacking.append(target)
    assert lacking == []


COMMANDS = [page for page in PAGES if re.search(r"^    airlight \w", page.read_text(encoding="utf-8"), re.M)]


@pytest.mark.parametrize("page", COMMANDS, ids=lambda page: page.name)
def test_commands_are_understood(page: Path) -> None:
    lines = re.findall(r"^    airlight ((?:.*\\\n)*.*)$", page.read_text(encoding="utf-8"), re.M)
    for line in lines:
        name, *words = itertools.takewhile(lambda word: word not in "|>", shlex.split(line.replace("\\\n", " "), comments=True))
        command = cli.commands.get(name)
        assert command is not None, line
        with contextlib.suppress(click.exceptions.Exit):  # which a list of presets ends with
            command.make_context(name, words)  # raises for what it does not know
    assert lines


def test_the_readmes_figures_are_those_of_the_pages_that_it_links() -> None:
    text = README.read_text(encoding="utf-8")
    figures = re.findall(r"^- (.*?)(?=^- |^$)", text.split("## Three figures")[1].split("\n## ")[0], re.M | re.S)
    assert len(figures) == 3 and text.count("\n") <= 80  # two screens
    for figure in figures:
        page = re.search(r"\]\((docs/[\w-]+\.md)", figure)
        assert page is not None
        there = (ROOT / page[1]).read_text(encoding="utf-8").replace(" %", "%")
        numbers = re.findall(r"(?<![\w.])\d+\.\d+(?:%| times)?", figure.split("([")[0].replace(" %", "%").replace("**", ""))
        assert numbers and [number for number in numbers if not re.search(rf"(?<![\d.]){re.escape(number)}(?!\d)", there)] == []
