"""Declares parameters: type, range, unit, default, purpose and source once, of which command line, panel, presets and docs are made.

A group of parameters is a class, a parameter a line in it:

    class Fog(Options, group="fog"):
        height: float = real(10.0, "height of its upper side", "Hx Volumetric Lighting", "m", ge=0)

Instances are frozen and validated on construction; a value that does not fit raises AirlightError.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Annotated, Any, Literal, dataclass_transform

import msgspec
from msgspec import Meta

from airlight.errors import AirlightError
from airlight.messages import nearest
from airlight.scatter import methods

RGB = tuple[float, float, float]


@dataclass(frozen=True)
class Option:
    """Describes one parameter.

    kind: int, float, bool or str. is_triple: three numbers, of red, green and blue, where one stands for three that are equal; or of
    `axes` x, y, z. choices: of
    a text; form: how a text is written, as AZ,EL. words: that may stand for a number, or of a text those that are
    always known. low, high: bounds, of each of three; open: excluded. slider: the range in which it is
    usually moved by hand, its bounds if nothing else is said; or its only values, three or more. is_log: moved in ratios.
    beyond: how a message ends that refuses a number out of bounds.
    """

    default: Any
    description: str
    source: str
    unit: str = ""
    kind: type = float
    is_triple: bool = False
    axes: str = "r,g,b"
    form: str = ""
    choices_of: tuple[str, ...] | Callable[[], tuple[str, ...]] = ()
    words: tuple[str, ...] = ()
    low: float | None = None
    low_open: bool = False
    high: float | None = None
    high_open: bool = False
    pattern: str | None = None
    slider: tuple[float, ...] | None = None
    is_log: bool = False
    beyond: str = ""
    group: str = ""
    name: str = ""

    @property
    def choices(self) -> tuple[str, ...]:
        return self.choices_of() if callable(self.choices_of) else self.choices_of

    @property
    def methods(self) -> tuple[str, ...]:
        """List the methods with which it means something; (): all."""
        return methods.reading(self.name, self.group)

    @property
    def flag(self) -> str:
        """Write its name on the command line: --max-distance."""
        return "--" + self.name.replace("_", "-")

    @property
    def range(self) -> str:
        """Write its range: `≥ 1, ≤ 100`, `> 0, ≤ 16`, or the choices."""
        if self.choices or self.kind is bool:
            return ", ".join(self.choices or ("true", "false"))
        low = "" if self.low is None else f"{'>' if self.low_open else '≥'} {self.low:g}"
        high = "" if self.high is None else f"{'<' if self.high_open else '≤'} {self.high:g}"
        form = self.axes if self.is_triple else self.form
        return ", ".join(part for part in (form, low, high, *self.words) if part)

    @property
    def type(self) -> Any:
        """Give the type against which msgspec checks its values."""
        found: Any = self.kind
        if self.choices_of and not callable(self.choices_of):
            found = Literal[self.choices_of]
        low, high = "gt" if self.low_open else "ge", "lt" if self.high_open else "le"
        bounds: dict[str, Any] = {low: self.low, high: self.high, "pattern": self.pattern}
        kept = {bound: value for bound, value in bounds.items() if value is not None}
        found = Annotated[found, Meta(**kept)] if kept else found
        if self.is_triple:
            found = tuple[found, found, found]
        if self.words and self.kind is not str:
            found = found | Literal[self.words]
        return found | None if self.default is None else found

    def cure(self, value: Any) -> str:
        """Say, to end a message, which word is most like a wrong value, or which there are; nothing of a number."""
        known = self.choices or self.words
        return nearest(value, known, f"; use {', '.join(known)}") if known and isinstance(value, str) else self.beyond

    def convert(self, value: Any, strict: bool = True) -> Any:
        """Check a value, or with strict False read it from a text. Raises msgspec.ValidationError."""
        found = msgspec.convert(value, self.type, strict=strict)
        if callable(self.choices_of) and found not in self.choices:
            raise msgspec.ValidationError(f"Invalid enum value {found!r}")
        return found


def real(default: Any, description: str, source: str, unit: str = "", **more: Any) -> Any:
    """Declare a number; None: unset. more: bounds ge, gt, le, lt; slider, log, beyond, group."""
    return _option(default, description, source, unit, float, **more)


def whole(default: Any, description: str, source: str, unit: str = "", **more: Any) -> Any:
    """Declare a whole number; more: as real, and words that may stand for it."""
    return _option(default, description, source, unit, int, **more)


def rgb(default: Any, description: str, source: str, unit: str = "", **more: Any) -> Any:
    """Declare a number for each of red, green and blue; more: as real."""
    return _option(default, description, source, unit, float, is_triple=True, **more)


def vector(default: Any, description: str, source: str, unit: str = "", **more: Any) -> Any:
    """Declare a number for each of the axes x, y and z; more: as real."""
    return _option(default, description, source, unit, float, is_triple=True, axes="x,y,z", **more)


def choice(default: Any, of: tuple[str, ...] | Callable[[], tuple[str, ...]], description: str, source: str, **more: Any) -> Any:
    """Declare one of some words; more: group."""
    return _option(default, description, source, "", str, choices_of=of, **more)


def text(default: Any, pattern: str, description: str, source: str, **more: Any) -> Any:
    """Declare a text of a pattern; more: group, form, and words that are always known."""
    return _option(default, description, source, "", str, pattern=pattern, **more)


def switch(default: bool, description: str, source: str, **more: Any) -> Any:
    """Declare what is on or off; more: group."""
    return _option(default, description, source, "", bool, **more)


def _option(default: Any, description: str, source: str, unit: str, kind: type, log: bool = False, **more: Any) -> Option:
    low, low_open = more.pop("ge", None), "gt" in more
    high, high_open = more.pop("le", None), "lt" in more
    low, high = more.pop("gt", low), more.pop("lt", high)
    if low is not None and high is not None and not (low_open or high_open):
        more.setdefault("slider", (low, high))
    more |= {"low": low, "low_open": low_open, "high": high, "high_open": high_open}
    return Option(default, description, source, unit, kind, is_log=log, **more)


@dataclass_transform(kw_only_default=True, frozen_default=True, field_specifiers=(real, whole, rgb, vector, choice, text, switch))
class _Declaring(msgspec.StructMeta):
    """Makes the fields of a msgspec Struct of the Options in a class."""

    def __new__(mcls, name: str, bases: Any, body: dict[str, Any], group: str = "") -> Any:
        found = [
            replace(value, name=key, group=value.group or group) for key, value in body.items() if isinstance(value, Option)
        ]
        body["__annotations__"] = {one.name: one.type for one in found}
        body |= {one.name: one.default for one in found}
        made = super().__new__(mcls, name, bases, body, frozen=True, kw_only=True, forbid_unknown_fields=True)
        _OPTIONS[made] = tuple(found)
        return made


_OPTIONS: dict[type, tuple[Option, ...]] = {}


class Options(msgspec.Struct, metaclass=_Declaring):
    """A group of parameters. Validated on construction; raises AirlightError."""

    def __post_init__(self) -> None:
        for one in _OPTIONS[type(self)]:
            value = getattr(self, one.name)
            if hasattr(value, "tolist"):  # NumPy's
                value = value.tolist()
            if one.is_triple:
                value = (value,) * 3 if isinstance(value, (int, float)) else value
                value = tuple(value) if isinstance(value, list) else value
            if value is not getattr(self, one.name):
                msgspec.structs.force_setattr(self, one.name, value)
            try:
                one.convert(value)
            except msgspec.ValidationError as error:
                raise AirlightError(f"{one.name} = {value!r}: {error}{one.cure(value)}") from None

    @classmethod
    def options(cls) -> tuple[Option, ...]:
        """List the parameters of this class, in the order in which they are declared."""
        return _OPTIONS[cls]



def as_text(value: Any, between: str = ",") -> str:
    """Write a value as on a command line: 0.5, exact, true; 0.1,0.2,0.3, or 0.1 where all three are equal."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, tuple):
        return between.join(str(v) for v in (value[:1] if len(set(value)) == 1 else value))
    return str(value)
