"""Option types of lights of the image plane."""

from typing import Any

import click
from click.shell_completion import CompletionItem

from airlight.errors import AirlightError
from airlight.jobs.light_text import LightText, read_light


class LightType(click.ParamType):
    name = "X,Y|auto"
    parallel = False

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
        words = ("auto", "auto:1", "auto:2", "auto:3+") if not self.parallel else ()
        return [CompletionItem(word) for word in words if word.startswith(incomplete)]

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> LightText:
        if isinstance(value, LightText):
            return value
        try:
            return read_light(value, self.parallel)
        except AirlightError as error:
            self.fail(str(error), param, ctx)


class AngleType(LightType):
    name = "DEG"
    parallel = True
