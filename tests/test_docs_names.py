"""The documents about the code name what is there: each path, and each `path:name` in it; and their links lead somewhere."""

import re

import pytest
from documented import DOCS

ROOT = DOCS.parent
PAGES = [*sorted(DOCS.glob("*.md")), ROOT / "README.md", ROOT / "CONTRIBUTING.md"]
OF_CODE = ("architecture", "equations", "glossary", "references")
NAMED = re.compile(r"`((?:src/airlight/|tests/|scripts/|docs/)?[\w/-]+(?:\.(?:py|wgsl|toml|md|html|js|sh)|/))(?::(\w+(?:\.\w+)?))?`")
DEFINES = r"^[ \t]*(?:(?:async )?(?:def|class|fn|struct|const|alias|override)\s+{0}\b|(?:var<\w+> )?{0}\b(?:\[.*\])?\s*(?::.*)?=|{0}: )"


def names(page: str) -> list[tuple[str, str]]:
    return sorted(set(NAMED.findall((DOCS / f"{page}.md").read_text(encoding="utf-8"))))


def headings(text: str) -> set[str]:
    """The anchors that GitHub gives to headings."""
    plain = (re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", line) for line in re.findall(r"^#+ (.*)$", text, re.M))
    return {re.sub(r"[^\w\- ]", "", line.lower()).replace(" ", "-") for line in plain}


@pytest.mark.parametrize("page", [page for page in OF_CODE if (DOCS / f"{page}.md").exists()])
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


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page: object) -> None:
    text = page.read_text(encoding="utf-8")  # type: ignore[attr-defined]
    lacking = []
    for target in re.findall(r"\]\((?!https?:)([^) ]+)\)", re.sub(r"```.*?```", "", text, flags=re.S)):
        path, _, anchor = target.partition("#")
        at = page.parent / path if path else page  # type: ignore[attr-defined]
        if not at.exists() or (anchor and at.suffix == ".md" and anchor not in headings(at.read_text(encoding="utf-8"))):
            lacking.append(target)
    assert lacking == []
