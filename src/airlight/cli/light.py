"""Option types of lights of the image plane."""

from typing import Any

import click

from airlight.errors import AirlightError
from airlight.jobs.light_text import LightText, read_light


class LightType(click.ParamType):
    name = "X,Y|auto"
    parallel = False

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
