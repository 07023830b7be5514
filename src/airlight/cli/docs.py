"""docs/parameters.md from the declarations and presets: `python -m airlight.cli.docs [FILE]`."""

import sys
from pathlib import Path

from airlight.options import Option, declared, presets
from airlight.options.declare import as_text


def _row(p: Option) -> str:
    unit = f" ({p.unit})" if p.unit else ""
    default = "–" if p.default is None else f"`{as_text(p.default)}`"
    option = f"`{p.flag}`, `--no-{p.flag[2:]}`" if p.kind is bool else f"`{p.flag}`"
    return f"| `{p.name}` | {option} | {p.range}{unit} | {default} | {p.description} | {p.source} |"


def page() -> str:
    lines = ["# Parameters", "", "Made by `python -m airlight.cli.docs` from `airlight/options/` and the presets; do not edit."]
    for group in dict.fromkeys(p.group for p in declared(scenes=True)):
        lines += ["", f"## {group.capitalize()}", "", "| name | option | range (unit) | default | what it does | source |"]
        lines += ["|---|---|---|---|---|---|", *(_row(p) for p in declared(scenes=True) if p.group == group)]
    for kind, about in ((presets.PRESETS, ()), (presets.MEDIA, ("Of `--medium`, in 1/m; the files say where the numbers come from.", ""))):
        lines += ["", f"## {kind.capitalize()}", "", *about, "| name | what it is | values |", "|---|---|---|"]
        for name in presets.names(kind):
            values = "; ".join(f"{key} {as_text(value)}" for key, value in presets.load(name, kind).items())
            lines.append(f"| `{name}` | {presets.description(name, kind)} | {values} |")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    target = Path(sys.argv[1] if len(sys.argv) > 1 else "docs/parameters.md")
    target.parent.mkdir(exist_ok=True)
    target.write_text(page(), encoding="utf-8")
