"""Reads densities, and projectors, as a user writes them, `SOURCE;key=value;...`; and follows numbered files with the frame."""

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from airlight.errors import AirlightError
from airlight.files.particles.npz import kind_of
from airlight.files.volumes import file_of_frame
from airlight.medium.field import Field
from airlight.messages import nearest

FACTOR, SCALE = (0.0, 1e9), (1e-9, 1e9)


@dataclass(frozen=True)
class Grammar:
    """Describes what may stand behind the source of a density.

    what: the density, in words. form: how it is written. texts: keys whose values are kept as they are, with what these are. words: those
    of a few values. numbers: those of a number, with the least and the greatest. vectors: those of several numbers, with their form,
    `x,y,z`. several: those that may stand more than once.
    """

    what: str
    form: str
    texts: Mapping[str, str]
    words: Mapping[str, tuple[str, ...]]
    numbers: Mapping[str, tuple[float, float]]
    vectors: Mapping[str, str] = field(default_factory=dict)
    several: tuple[str, ...] = ()

    @property
    def keys(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys((*self.texts, *self.words, *self.numbers, *self.vectors)))

    def read(self, text: str) -> tuple[str, dict[str, Any]]:
        """Divide a text into its source, as it is written, and the values of the keys that are given. Raises AirlightError."""
        source, *rest = (part.strip() for part in str(text).split(";"))
        known: dict[str, Any] = {}
        for part in filter(None, rest):
            name, _, value = (word.strip() for word in part.partition("="))
            if name in self.keys and not value:
                raise AirlightError(f"{name} has no value in the {self.what} {text!r}: give {self._form(name)}")
            if name not in self.keys:
                hint = nearest(name, self.keys, f": write {self.form}")
                raise AirlightError(f"cannot read {part!r} in the {self.what} {text!r}{hint}")
            if name in self.several:
                known[name] = (*known.get(name, ()), self._value(name, value, text))
                continue
            if name in known:
                raise AirlightError(f"{name} stands twice in the {self.what} {text!r}; leave one out")
            known[name] = self._value(name, value, text)
        if not source:
            raise AirlightError(f"cannot read the {self.what} {text!r}: write {self.form}")
        return source, known

    def _form(self, name: str) -> str:
        """Write a key with what it takes, for who left that out."""
        if name in self.texts:
            return f"a {self.texts[name]}, {name}={self.texts[name].upper()}"
        if name in self.words:
            return f"one of {', '.join(self.words[name])}"
        return f"{name}={self.vectors.get(name, 'N')}, numbers" if name in self.vectors else f"a number, {name}=N"

    def _value(self, name: str, value: str, text: str) -> Any:
        if name in self.texts:
            return value
        if name in self.words:
            if value not in self.words[name]:
                hint = f"{nearest(value, self.words[name])}; use {', '.join(self.words[name])}"
                raise AirlightError(f"{name} is {value!r} in the {self.what} {text!r}{hint}")
            return value
        form = self.vectors.get(name, "")
        try:
            found = tuple(float(part) for part in value.split(","))
        except ValueError:
            found = ()
        low, high = self.numbers.get(name, (-math.inf, math.inf))
        if len(found) != form.count(",") + 1 or not all(low <= number <= high and math.isfinite(number) for number in found):
            bounds = f" of {low:g} to {high:g}" if name in self.numbers else ""
            cure = f"give numbers{bounds}, {form}" if form else f"give a number of {low:g} to {high:g}"
            raise AirlightError(f"{name} is {value} in the {self.what} {text!r}; {cure}")
        return found if form else found[0]


class FileDensity:
    """Gives the density of a file, of numbered files (`smoke.####.vdb`) that of `frame`, which may be set.

    Whoever derives from it reads. kind: what it is a density of. baked: whether into as many cells as are asked for.
    """

    kind, baked = "volume", False

    def __init__(self, path: str, frame: int = 1) -> None:
        self.path, self.frame = path, frame
        self._known: tuple[str, int] | None = None
        self._field: Field | None = None

    def field(self, cells: int = 128) -> Field:
        """Read the file of the frame: the same Field while it is the same. Raises AirlightError."""
        path = file_of_frame(self.path, self.frame)
        known = path, cells if self.baked else 0
        if self._field is None or self._known != known:
            found = npz_kind(path)
            if found not in (None, self.kind):
                a, other = ("a ", "") if found == "volume" else ("", "a ")
                raise AirlightError(f"{path}: holds {a}{found}, not {other}{self.kind}; give it by --{found}")
            self._field, self._known = self._read(path, cells), known
        return self._field

    def _read(self, path: str, cells: int) -> Field:
        """Read a file. cells: along the longest side of the grid, where one is made."""
        raise NotImplementedError


def npz_kind(path: str) -> str | None:
    """Tell of what a file is whose name may be a volume's and particles' alike: "particles" or "volume"; None where that is not known."""
    return kind_of(path) if path.lower().endswith(".npz") and os.path.isfile(path) else None
