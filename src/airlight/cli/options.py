"""Command-line options made from the declared parameters."""

import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal, TypeVar, get_args, get_origin

import click
import msgspec
import rich_click
from msgspec import inspect

from airlight import presets

F = TypeVar("F", bound=Callable[..., Any])
# What a picture's own light and border need; a scene knows what emits, and is added to before its tone curve.
NOT_IN_SCENES = frozenset({"occlusion", "threshold", "smoothness", "border", "scale", "blend", "veil"})


@dataclass(frozen=True)
class Declared:
    """What a declaration says about one parameter."""

    name: str
    default: Any
    kind: type  # int, float, bool or str
    choices: tuple[str, ...]
    low: float | None
    low_open: bool
    high: float | None
    high_open: bool
    description: str
    group: str
    source: str
    unit: str

    @property
    def option(self) -> str:
        return "--" + self.name.replace("_", "-")

    @property
    def range(self) -> str:
        """`1 … 100`, `> 0, ≤ 16`, or the choices."""
        if self.choices:
            return ", ".join(self.choices)
        low = "" if self.low is None else f"{'>' if self.low_open else '≥'} {self.low:g}"
        high = "" if self.high is None else f"{'<' if self.high_open else '≤'} {self.high:g}"
        return ", ".join(part for part in (low, high) if part)


@functools.cache
def declared(scenes: bool = False) -> tuple[Declared, ...]:
    """Every parameter of every declaration, in order. scenes: those of 3-D scenes too."""
    return tuple(_declared(field) for struct in presets.structs(scenes) for field in msgspec.structs.fields(struct))


def _declared(field: msgspec.structs.FieldInfo) -> Declared:
    kind = inspect.type_info(field.type)
    said: dict[str, Any] = {}
    notes: dict[str, Any] = {}
    while isinstance(kind, (inspect.Metadata, inspect.UnionType)):
        if isinstance(kind, inspect.Metadata):
            said = {**(kind.extra_json_schema or {}), **said}
            notes = {**(kind.extra or {}), **notes}
            kind = kind.type
        else:  # float | None
            kind = next(t for t in kind.types if not isinstance(t, inspect.NoneType))
    number = isinstance(kind, (inspect.IntType, inspect.FloatType))
    ge, gt, le, lt = (getattr(kind, bound) if number else None for bound in ("ge", "gt", "le", "lt"))
    return Declared(
        name=field.name,
        default=field.default,
        kind={inspect.IntType: int, inspect.FloatType: float, inspect.BoolType: bool}.get(type(kind), str),
        choices=_choices(field.type),
        low=ge if gt is None else gt,
        low_open=gt is not None,
        high=le if lt is None else lt,
        high_open=lt is not None,
        description=said.get("description", ""),
        group=notes.get("group", "other"),
        source=notes.get("source", ""),
        unit=notes.get("unit", ""),
    )


def _choices(annotation: Any) -> tuple[str, ...]:
    """The values of the Literal within an annotation, in the order in which they are written (msgspec sorts them)."""
    if get_origin(annotation) is Literal:
        return get_args(annotation)
    return next((found for part in get_args(annotation) if (found := _choices(part))), ())


def parameter_options(command: F) -> F:
    """Decorator: one option for each declared parameter, in a panel for each group."""
    for parameter in reversed(declared()):
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
        kind = click.Choice(p.choices)
    elif p.kind in (int, float):
        kind_of_range: Any = click.IntRange if p.kind is int else click.FloatRange
        kind = kind_of_range(p.low, p.high, min_open=p.low_open, max_open=p.high_open)
    return click.option(
        f"{p.option}/--no-{p.option[2:]}" if p.kind is bool else p.option,
        p.name,
        cls=rich_click.RichOption,
        type=kind,
        default=p.default,
        show_default=p.default is not None,
        panel=p.group.capitalize(),
        help=f"{p.description}{f' ({p.unit})' if p.unit else ''}. {p.source}",
    )


def given(ctx: click.Context, name: str) -> bool:
    """Whether the user wrote this option, and not just its default holds."""
    return ctx.get_parameter_source(name) not in (click.core.ParameterSource.DEFAULT, click.core.ParameterSource.DEFAULT_MAP, None)


def gather(ctx: click.Context, preset: str | None) -> dict[str, Any]:
    """The values that are set: those of `--settings-from`, over them the preset's, over them those of the command line."""
    options = [p.name for p in declared(scenes=True) if p.name in ctx.params]
    recalled = {name: ctx.params[name] for name in options if name in (ctx.default_map or {})}
    values = presets.load(preset) if preset is not None else {}
    return recalled | values | {name: ctx.params[name] for name in options if given(ctx, name)}
