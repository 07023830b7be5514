"""docs/references.md: whatever is cited can be looked up there, and each entry is cited where it says."""

import re
from functools import cache

import pytest
from documented import DOCS

ROOT = DOCS.parent
AUTHORS = r"[A-Z][\w-]+(?:, [A-Z][\w-]+)*(?:,? and [A-Z][\w-]+)?(?: et al\.)?"
BY_YEAR = re.compile(rf"(?<![\w.])({AUTHORS}),? \(?((?:19|20)\d\d)\b(?![-\d])")
NO_AUTHORS = {"At", "JPEG", "Asia", "Conference", "Demo", "GDC", "Games", "SIGGRAPH"}  # before a year or a size: names of other things


@cache
def entries() -> dict[str, str]:
    """Text by key."""
    return dict(re.findall(r"^### (\w+)\n(.*?)(?=^### |\Z)", (DOCS / "references.md").read_text(encoding="utf-8"), re.M | re.S))


def phrases(text: str) -> list[str]:
    """By which an entry is cited, beside author and year."""
    return [" ".join(phrase.split()) for phrase in re.findall(r'"([^"]+)"', text)]


def resolved(citation: str) -> set[str]:
    """The keys of the entries that a citation means."""
    years = {m[1].split(",")[0].split(" ")[0].replace("-", "") + m[2] for m in BY_YEAR.finditer(citation)} & set(entries())
    return years | {key for key, text in entries().items() if any(phrase in citation for phrase in phrases(text))}


def sources() -> dict[str, str]:
    """What docs/parameters.md, which is made from the declarations, says of each parameter's source."""
    page = (DOCS / "parameters.md").read_text(encoding="utf-8").split("## Presets")[0]
    return dict(re.findall(r"^\| `(\w+)` \| .* \| ([^|]+) \|$", page, re.M))


def cited() -> list[tuple[str, str]]:
    """(file, citation by author and year) of all that is written in the repository, but for this list itself."""
    out = []
    for folder in ("src", "tests", "scripts", "docs"):
        for path in sorted(path for path in (ROOT / folder).rglob("*") if path.suffix in (".py", ".wgsl", ".toml", ".md")):
            if path.name not in ("references.md", "test_references.py"):
                text = re.sub(r"\n[ \t]*(?:///? |# )?", " ", path.read_text(encoding="utf-8"))  # a citation may go on in the next line
                found = [m[0] for m in BY_YEAR.finditer(text) if not NO_AUTHORS & set(m[1].replace(",", "").split())]
                out += [(path.relative_to(ROOT).as_posix(), citation) for citation in found]
    return out


def test_entries_are_alphabetical_and_say_where_they_are_cited() -> None:
    keys = list(entries())
    assert len(keys) > 40 and keys == sorted(keys, key=str.lower)
    for key, text in entries().items():
        assert re.search(r"`[\w/.-]+\.\w+`|Parameters?\s+`|\]\(equations\.md|method `", text), key


@pytest.mark.parametrize("name", sources())
def test_a_parameters_source_is_an_entry(name: str) -> None:
    for part in sources()[name].split(";"):
        assert part.strip().startswith("Airlight") or resolved(part.strip()), f"{part!r} is not in docs/references.md"


def test_parameters_that_an_entry_names_cite_it() -> None:
    for key, text in entries().items():
        named = re.findall(r"Parameters?\s+((?:`\w+`,?\s*)+)", text)
        for name in re.findall(r"\w+", " ".join(named)):
            assert key in resolved(sources()[name]), f"{key}: {name} cites {sources()[name]}"


def test_citations_are_entries() -> None:
    found = cited()
    assert len(found) > 40
    assert [(path, citation) for path, citation in found if not resolved(citation)] == []


def test_files_that_an_entry_names_cite_it() -> None:
    for key, text in entries().items():
        for name in re.findall(r"`((?:src|docs|tests|scripts)/[\w/.-]+)`", text):
            path = ROOT / name
            assert path.exists(), f"{key}: there is no {name}"
            said = re.sub(r"\s+(?:///? |# )?", " ", path.read_text(encoding="utf-8"))
            assert key in resolved(said), f"{name} does not cite {key}"
