"""Put the figures of `airlight bench --json FILE` into README.md, between its bench comment and the next blank line."""

import json
import statistics
import sys
from pathlib import Path

ORDER = [("epipolar", q, None) for q in ("draft", "normal", "final")] + [("radial", None, None), ("radial", None, 0.5)]


def table(records: list[dict]) -> str:
    """A row a method: copies and error of each case at D 0.926, lambda 3.24."""
    rows = ["| method | inside: copies | error | edge: copies | error | outside: copies | error |", "|---|---|---|---|---|---|---|"]
    for method, quality, scale in ORDER:
        cells = []
        for case in ("inside", "edge", "outside"):
            here = [r for r in records if r["case"] == case and abs(r["lambda"] - 3.24) < 1e-6 and r["height"] == 1080]
            copy = statistics.median(r["ms"] for r in records if r["case"] == case and r["method"] == "copy")
            one = next(r for r in here if (r["method"], r.get("quality"), r.get("scale")) == (method, quality, scale))
            cells += [f"{one['ms'] / copy:.1f}", f"{one['error']:.2%}"]
            samples = one["samples"]
        name = f"{method} {quality}" if quality else f"{method}, n = {samples}" + (", half resolution" if scale else "")
        rows.append(f"| {name} | " + " | ".join(cells) + " |")
    return "\n".join(rows)


def main() -> None:
    readme = Path(__file__).parent.parent / "README.md"
    head, mark, rest = readme.read_text().partition("<!-- bench -->\n")
    if not mark:
        sys.exit("README.md has no <!-- bench --> comment")
    after = rest.lstrip("\n") if rest.startswith("\n") else rest.partition("\n\n")[2]
    readme.write_text(head + mark + table(json.loads(Path(sys.argv[1]).read_text())["records"]) + "\n\n" + after)


main()
