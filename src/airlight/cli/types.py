"""Types of options and arguments that click lacks: choices that know what was meant, names that come with Airlight or files."""

import math
import re
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import click
from click.shell_completion import CompletionItem

from airlight.messages import nearest


class Choice(click.Choice[str]):
    """Takes one of some words; of another says which is most like it."""

    def __init__(self, choices: Sequence[str]) -> None:
        super().__init__(choices)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if value not in self.choices:
            self.fail(f"{str(value)!r} is none of {', '.join(self.choices)}{nearest(str(value), self.choices)}", param, ctx)
        return value


class Real(click.FloatRange):
    """Takes a number within bounds, and no nan, which click finds in any. beyond: how a message ends that refuses one out of them."""

    def __init__(self, *bounds: Any, beyond: str = "", **more: Any) -> None:
        super().__init__(*bounds, **more)
        self.beyond = beyond

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        try:
            found = super().convert(value, param, ctx)
        except click.BadParameter as error:
            is_beyond = self.beyond and "not in the range" in error.message
            self.fail(error.message.rstrip(".") + self.beyond if is_beyond else error.message, param, ctx)
        if math.isnan(found):
            ends = (self.min, self.min_open, ">≥"), (self.max, self.max_open, "<≤")
            bounds = ", ".join(f"{signs[not is_open]} {end:g}" for end, is_open, signs in ends if end is not None)
            self.fail(f"{str(value)!r} is no number: give one{f' {bounds}' if bounds else ''}", param, ctx)
        return found


class NameOrFile(click.ParamType):
    """Takes any text; completes it by names that come with Airlight, and by files. names: gives them, each with what it is."""

    name = "text"

    def __init__(self, names: Callable[[], Iterable[tuple[str, str]]]) -> None:
        self.names = names

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
        found = [CompletionItem(name, help=about) for name, about in self.names() if name.startswith(incomplete)]
        return [CompletionItem(incomplete, type="file"), *found]  # click's script for bash forgets what comes before the files


def _flags(command: click.Command) -> list[str]:
    return [one for param in command.params for one in (*param.opts, *param.secondary_opts) if one.startswith("-")]


def line_of(error: click.ClickException) -> str:
    """Write click's error as a line of ours: an unknown option with the commands that have it, or with what is most like it."""
    if isinstance(error, click.NoSuchOption):
        if error.ctx is None:
            return error.format_message()
        commands = getattr(error.ctx.find_root().command, "commands", {})
        having = [f"`airlight {name}`" for name, command in commands.items() if error.option_name in _flags(command)]
        listed = " and ".join([", ".join(having[:-1]), having[-1]] if having[1:] else having)
        hint = f"; {listed} {'have' if len(having) > 1 else 'has'} it" if having else ""
        known = _flags(error.ctx.command)
        hint = hint or nearest(error.option_name, known, f"; {'--help-all' if '--help-all' in known else '--help'} shows all")
        return f"{error.option_name} is no option of `{error.ctx.command_path}`{hint}"
    if isinstance(error, click.NoSuchCommand):
        commands = getattr(error.ctx.command, "commands", {}) if error.ctx is not None else {}
        return f"there is no command {error.command_name!r}{nearest(error.command_name, commands, '; there is ' + ', '.join(commands))}"
    text = error.format_message()
    for kind, words in (("integer", "whole number"), ("float", "number")):
        text = re.sub(rf" is not a valid {kind}( range)?", f" is no {words}", text)
    if isinstance(error, click.MissingParameter) and error.ctx is not None:
        return f"{text.rstrip('.')}; `{error.ctx.command_path} --help` shows examples"
    return text
