"""Command-line options made from the declared parameters."""

from collections.abc import Callable
from typing import Any, TypeVar

import click
import rich_click
from click.shell_completion import CompletionItem

from airlight.cli.types import Choice, Real
from airlight.errors import AirlightError
from airlight.messages import nearest
from airlight.options import NOT_IN_SCENES, Option, declared, of_medium_alone, presets
from airlight.options.daylight import OF_PICTURE
from airlight.options.declare import as_text
from airlight.scatter.methods import FOR_MEDIUM, METHODS, check_picture

F = TypeVar("F", bound=Callable[..., Any])


class _Choice(Choice):
    """Takes one of the choices of an option, of methods those that there are now; says why a method is none of a picture's."""

    def __init__(self, option: Option) -> None:
        super().__init__(option.choices)
        self.option = option

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        self.choices = self.option.choices
        if value not in self.choices:
            try:
                check_picture(value)
            except AirlightError as error:
                self.fail(str(error), param, ctx)
        return super().convert(value, param, ctx)


class _Numbers(click.ParamType):
    """Three numbers, or one for all three; or a number or a word: each within the bounds of `of`. form: of three."""

    def __init__(self, of: click.ParamType, form: str, words: tuple[str, ...]) -> None:
        self.of, self.triple, self.words = of, form, words
        self.name = form or "|".join(("n", *words))

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
        return [CompletionItem(word) for word in self.words if word.startswith(incomplete)]

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if not self.triple:
            if value in self.words:
                return value
            try:
                return self.of.convert(value, param, ctx)
            except click.BadParameter as error:
                hint = nearest(str(value), self.words, f"; or write {' or '.join(self.words)}")
                self.fail(error.message.rstrip(".") + hint, param, ctx)
        parts = value if isinstance(value, (tuple, list)) else str(value).split(",")
        if len(parts) not in (1, 3):
            self.fail(f"{value!r} is not {self.triple}: write three numbers, as in 0.1,0.2,0.3, or one for all three", param, ctx)
        found = tuple(self.of.convert(part, param, ctx) for part in parts)
        return found * (3 // len(found))


_EXPOSURE = ("ev", "view_transform", "adapt_seconds")  # of a scene's options, those of the picture for a display: a panel of their own


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


def _option(p: Option) -> Callable[[F], F]:
    kind: Any = p.kind
    if p.choices:
        kind = _Choice(p)
    elif p.kind in (int, float):
        ends: dict[str, Any] = {"min": p.low, "max": p.high, "min_open": p.low_open, "max_open": p.high_open}
        kind = Real(beyond=p.beyond, **ends) if p.kind is float else click.IntRange(**ends)
        if p.is_triple or p.words:
            kind = _Numbers(kind, p.axes if p.is_triple else "", p.words)
    return click.option(
        f"{p.flag}/--no-{p.flag[2:]}" if p.kind is bool else p.flag,
        p.name,
        cls=rich_click.RichOption,
        type=kind,
        metavar="|".join((*p.words, "NAME") if p.kind is str else ("N", *p.words)) if p.words and not p.form else p.form or None,
        default=as_text(p.default) if p.is_triple and p.default is not None else p.default,
        show_default=p.default is not None,
        panel="Exposure" if p.name in _EXPOSURE else p.group.capitalize(),
        help=f"{p.description}{f' ({p.unit})' if p.unit else ''}. {p.source}",
    )


def given(ctx: click.Context, name: str) -> bool:
    """Tell whether the user wrote this option, and not just its default holds."""
    return ctx.get_parameter_source(name) not in (click.core.ParameterSource.DEFAULT, click.core.ParameterSource.DEFAULT_MAP, None)


def gather(ctx: click.Context, preset: str | None, medium: str | None = None) -> dict[str, Any]:
    """Collect the values that are set: those of `--settings-from`, over them the preset's, the medium's, and those of the command line.

    A medium, or an option of one, is lit by march if no method is said. Raises AirlightError.
    """
    others = frozenset() if ctx.command.name == "image" else OF_PICTURE  # scenes have a --sun and a --fov of their own
    options = [p.name for p in declared(scenes=True) if p.name in ctx.params and p.name not in others]
    recalled = {name: ctx.params[name] for name in options if name in (ctx.default_map or {})}
    values = recalled | (presets.load(preset) if preset is not None else {})
    written = {name: ctx.params[name] for name in options if given(ctx, name)}
    if medium is None:
        return ({} if of_medium_alone(written) is None else {"method": FOR_MEDIUM}) | values | written
    found = {"method": FOR_MEDIUM} | values | presets.load(medium, presets.MEDIA) | written
    if not METHODS[found["method"]].has_units:
        raise AirlightError(f"--medium means nothing with method {found['method']}: leave it out, or give --method march too")
    return found
