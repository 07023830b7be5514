"""Word messages, which name options as the command line has them, for Python and for the viewer's panel."""

import re
from collections.abc import Callable

from airlight.options import declared
from airlight.options.declare import Option

NAMED = re.compile(r"--([a-z][a-z-]*[a-z])(?: ([\w.+-]*\w))?")  # an option, and the word behind it, which may be its value


def label(name: str) -> str:
    """Name a parameter as the panel does: "near_range" is "Near range"."""
    return name.replace("_", " ").capitalize()


def in_python(text: str) -> str:
    """Write a message's options as keywords: `--rays 24` as `rays=24`, `--look classic` as `look="classic"`."""
    return _replaced(text, lambda name, value, is_word: f'{name}="{value}"' if is_word else f"{name}={value}" if value else name)


def in_panel(text: str) -> str:
    """Write a message's options as rows of the panel: `--rays 24` as `Rays at 24`."""
    return _replaced(text, lambda name, value, is_word: f"{label(name)} at {value}" if value else label(name))


def _replaced(text: str, write: Callable[[str, str, bool], str]) -> str:
    """Write the options that are parameters anew; others stay."""
    known = {one.name: one for one in declared(scenes=True)}

    def one(found: re.Match[str]) -> str:
        name, word = found[1].replace("-", "_"), found[2] or ""
        if name not in known:
            return found[0]
        if not word or _is_value(known[name], word):
            return write(name, word, bool(word) and not _is_number(word))
        return f"{write(name, '', False)} {word}"

    return NAMED.sub(one, text)


def _is_value(option: Option, word: str) -> bool:
    return _is_number(word) or word in (*(option.choices or ()), *(option.words or ()))


def _is_number(word: str) -> bool:
    return re.fullmatch(r"[+-]?\d[\d.]*(e[+-]?\d+)?", word) is not None
