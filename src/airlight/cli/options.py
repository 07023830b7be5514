"""Command-line options made from the declared parameters."""

import difflib
import functools
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import click
import msgspec
import rich_click
from msgspec import inspect

from airlight import presets
from airlight.errors import AirlightError
from airlight.parameters import IN_WORLD, NOT_IN_SCENES, check_picture, is_triple

F = TypeVar("F", bound=Callable[..., Any])


@dataclass(frozen=True)
class Declared:
    """What a declaration says about one parameter."""

    name: str
    default: Any
    kind: type  # int, float, bool or str
    triple: bool  # three of them, of red, green and blue; low and high are those of each
    choices: tuple[str, ...]  # of a text
    words: tuple[str, ...]  # that may stand for a number
    low: float | None
    low_open: bool
    high: float | None
    high_open: bool
    description: str
    group: str
    source: str
    unit: str
    slider: tuple[float, ...] | None  # where it is usually moved: its bounds, if nothing else is said; three or more: its only values
    log: bool  # moved in ratios
    methods: tuple[str, ...]  # with which it means something; (): all

    @property
    def option(self) -> str:
        return "--" + self.name.replace("_", "-")

    @property
    def range(self) -> str:
        """`≥ 1, ≤ 100`, `> 0, ≤ 16`, or the choices."""
        if self.choices or self.kind is bool:
            return ", ".join(self.choices or ("true", "false"))
        low = "" if self.low is None else f"{'>' if self.low_open else '≥'} {self.low:g}"
        high = "" if self.high is None else f"{'<' if self.high_open else '≤'} {self.high:g}"
        form = "r,g,b" if self.triple else ""
        return ", ".join(part for part in (form, low, high, *self.words) if part)


@functools.cache
def declared(scenes: bool = False) -> tuple[Declared, ...]:
    """Every parameter of every declaration, in order. scenes: those of 3-D scenes too, and the choices that only these have."""
    found = [_declared(field) for struct in presets.structs(scenes) for field in msgspec.structs.fields(struct)]
    if scenes:
        return tuple(found)
    return tuple(replace(p, choices=tuple(c for c in p.choices if c not in IN_WORLD)) if p.name == "method" else p for p in found)


def _declared(field: msgspec.structs.FieldInfo) -> Declared:
    kind = inspect.type_info(field.type)
    said: dict[str, Any] = {}
    notes: dict[str, Any] = {}
    while isinstance(kind, (inspect.Metadata, inspect.UnionType)):
        if isinstance(kind, inspect.Metadata):
            said = {**(kind.extra_json_schema or {}), **said}
            notes = {**(kind.extra or {}), **notes}
            kind = kind.type
        else:  # float | None, int | Literal | None
            kind = next(t for t in kind.types if not isinstance(t, (inspect.NoneType, inspect.LiteralType)) or len(kind.types) == 2)
    choices, triple = presets.choices(field.type), is_triple(field.type)
    if isinstance(kind, inspect.TupleType):
        kind = kind.item_types[0]
        kind = kind.type if isinstance(kind, inspect.Metadata) else kind
    number = isinstance(kind, (inspect.IntType, inspect.FloatType))
    ge, gt, le, lt = (getattr(kind, bound) if number else None for bound in ("ge", "gt", "le", "lt"))
    return Declared(
        name=field.name,
        default=field.default,
        kind={inspect.IntType: int, inspect.FloatType: float, inspect.BoolType: bool}.get(type(kind), str),
        triple=triple,
        choices=() if number else choices,
        words=choices if number else (),
        low=ge if gt is None else gt,
        low_open=gt is not None,
        high=le if lt is None else lt,
        high_open=lt is not None,
        description=said.get("description", ""),
        group=notes.get("group", "other"),
        source=notes.get("source", ""),
        unit=notes.get("unit", ""),
        slider=notes.get("slider") or (None if ge is None or le is None else (ge, le)),
        log=notes.get("log", False),
        methods=notes.get("methods", ()),
    )


class _Choice(click.Choice[str]):
    """The choices of a picture, which say why a method is none of them."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if value not in self.choices:
            try:
                check_picture(value)
            except AirlightError as error:
                self.fail(str(error), param, ctx)
        return super().convert(value, param, ctx)


class _Numbers(click.ParamType):
    """Three numbers, or one for all three; or a number or a word: each within the bounds of `of`."""

    def __init__(self, of: click.ParamType, triple: bool, words: tuple[str, ...]) -> None:
        self.of, self.triple, self.words = of, triple, words
        self.name = "r,g,b" if triple else "|".join(("n", *words))

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if not self.triple:
            if value in self.words:
                return value
            try:
                return self.of.convert(value, param, ctx)
            except click.BadParameter as error:
                close = difflib.get_close_matches(str(value), self.words, 1)
                hint = f"; did you mean {close[0]!r}?" if close else f"; or write {' or '.join(self.words)}"
                self.fail(error.message.rstrip(".") + hint, param, ctx)
        parts = value if isinstance(value, (tuple, list)) else str(value).split(",")
        if len(parts) not in (1, 3):
            self.fail(f"{value!r} is not r,g,b: write three numbers, as in 0.1,0.2,0.3, or one for all three", param, ctx)
        found = tuple(self.of.convert(part, param, ctx) for part in parts)
        return found * (3 // len(found))


def parameter_options(command: F, scenes: bool = False) -> F:
    """Decorator: one option for each declared parameter, in a panel for each group. scenes: those of 3-D scenes too."""
    for parameter in reversed(declared(scenes)):
        command = _option(parameter)(command)
    return command


def scene_options(command: F) -> F:
    """Decorator: one option for each declared parameter that means something in a 3-D scene."""
    for parameter in reversed(declared(scenes=True)):
        if parameter.name not in NOT_IN_SCENES:
            command = _option(parameter)(command)
    return command


def _option(p: Declared) -> Callable[[F], F]:
    kind: Any = p.kind
    if p.choices:
        kind = _Choice(p.choices)
    elif p.kind in (int, float):
        kind_of_range: Any = click.IntRange if p.kind is int else click.FloatRange
        kind = kind_of_range(p.low, p.high, min_open=p.low_open, max_open=p.high_open)
        if p.triple or p.words:
            kind = _Numbers(kind, p.triple, p.words)
    return click.option(
        f"{p.option}/--no-{p.option[2:]}" if p.kind is bool else p.option,
        p.name,
        cls=rich_click.RichOption,
        type=kind,
        metavar="|".join(("N", *p.words)) if p.words else None,
        default=presets.text(p.default) if p.triple and p.default is not None else p.default,
        show_default=p.default is not None,
        panel=p.group.capitalize(),
        help=f"{p.description}{f' ({p.unit})' if p.unit else ''}. {p.source}",
    )


def given(ctx: click.Context, name: str) -> bool:
    """Whether the user wrote this option, and not just its default holds."""
    return ctx.get_parameter_source(name) not in (click.core.ParameterSource.DEFAULT, click.core.ParameterSource.DEFAULT_MAP, None)


def gather(ctx: click.Context, preset: str | None, medium: str | None = None) -> dict[str, Any]:
    """The values that are set: those of `--settings-from`, over them the preset's, the medium's, and those of the command line.

    A medium is lit by march if no method is said. Raises AirlightError.
    """
    options = [p.name for p in declared(scenes=True) if p.name in ctx.params]
    recalled = {name: ctx.params[name] for name in options if name in (ctx.default_map or {})}
    values = recalled | (presets.load(preset) if preset is not None else {})
    written = {name: ctx.params[name] for name in options if given(ctx, name)}
    if medium is None:
        return values | written
    found = {"method": "march"} | values | presets.load(medium, presets.MEDIA) | written
    if found["method"] != "march":
        raise AirlightError(f"--medium means nothing with method {found['method']}: leave it out, or give --method march too")
    return found


def check_given(ctx: click.Context, method: str, by: str = "") -> None:
    """Raise AirlightError for an option of the command line that means nothing with the method. by: what asks for it, if not --method."""
    for p in declared(scenes=True):
        if p.methods and method not in p.methods and p.name in ctx.params and given(ctx, p.name):
            wrong = f"{p.option} means nothing with method {method}"
            if by.startswith("--medium"):
                raise AirlightError(f"{wrong}, which {by} asks for: leave one of the two out")
            asked = f", which {by} asks for" if by else ""
            raise AirlightError(f"{wrong}{asked}: leave it out, or use --method {' or '.join(p.methods)}")
