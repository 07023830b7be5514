"""The command line. Nothing heavy is imported before a command needs it, so that help comes at once."""

import contextlib
import os
import sys
import warnings
from collections.abc import Callable, Sequence
from typing import Any

import click
import rich_click

from airlight.cli import bench, compare, image, info, render, view
from airlight.cli.help import screen
from airlight.cli.types import line_of
from airlight.errors import AirlightError, CommonWarning
from airlight.messages import say
from airlight.process import standard, supervisor


class _Stopped(Exception):
    """Ctrl-C. click would turn KeyboardInterrupt into a blank line and an Abort."""


class _Group(rich_click.RichGroup):
    def get_help(self, ctx: click.Context) -> str:
        return screen(ctx)

    def invoke(self, ctx: click.Context) -> Any:
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt:
            raise _Stopped from None


@click.group(
    name="airlight",
    cls=_Group,
    invoke_without_command=True,
    context_settings={"help_option_names": ["-h", "--help"]},
    commands=[image.image, render.render, view.view, compare.compare, info.info, bench.bench],  # type: ignore[arg-type]
)
@click.version_option(package_name="airlight", prog_name="airlight", message="%(prog)s %(version)s")
@click.pass_context
def cli(ctx: click.Context) -> None:
    """Light shafts for photographs and renders."""
    if ctx.invoked_subcommand is None:
        click.echo(ctx.get_help())


def main(args: Sequence[str] | None = None) -> int:
    """Run a command and return the exit code: 0 done, 2 wrong usage or bad input, 1 a failure of the machine, 130 Ctrl-C."""
    with warnings.catch_warnings():
        warnings.simplefilter("always", UserWarning)
        told: dict[str, set[str]] = {}  # each once, from wherever it comes

        def show(message: Warning | str, *_: Any, **__: Any) -> None:
            text = str(message)
            of = told.setdefault(text.partition(": ")[2] if isinstance(message, CommonWarning) else text, set())
            if not of:
                say(f"warning: {text}")
            of.add(text)

        warnings.showwarning = show
        code = _guarded(lambda: cli.main(args, prog_name="airlight", standalone_mode=False))
        for text, of in told.items():
            if len(of) > 1:
                say(f"warning: {len(of) - 1} more: {text}")
        code = _guarded(_flush) or code
        standard.release()
        return code


def _guarded(work: Callable[[], Any]) -> int:
    """Do some work and give its exit code; whatever goes wrong becomes one line on stderr."""
    try:
        try:
            code = work()
        except Exception:
            if supervisor.stopping:  # what a library made of the stop
                raise KeyboardInterrupt from None
            raise
        return code if isinstance(code, int) else 0
    except (_Stopped, KeyboardInterrupt, click.Abort):
        say(supervisor.STOPPED)
        return 130
    except click.ClickException as error:
        say(_of_scenes(error) or line_of(error))
        return 2
    except AirlightError as error:
        say(str(error))
        return error.exit_code
    except BrokenPipeError:  # `airlight info | head -1`
        _drop_stdout()
        return 1
    except MemoryError:
        say("not enough memory; use a smaller picture or --quality draft")
    except OSError as error:
        say(f"{error.filename or 'output'}: {error.strerror or error}")
        _drop_stdout()
    except Exception as error:
        if os.environ.get("AIRLIGHT_TRACEBACK"):
            import traceback

            traceback.print_exc()
        say(f"unexpected {type(error).__name__}: {error} (please report; AIRLIGHT_TRACEBACK=1 shows the trace)")
    return 1


def _of_scenes(error: click.ClickException) -> str:
    """Word what to do where `airlight image` is given an option of a medium; else ""."""
    from airlight.options import refuse_medium

    if not isinstance(error, click.NoSuchOption) or error.ctx is None or error.ctx.command is not image.image:
        return ""
    try:
        refuse_medium([error.option_name.lstrip("-").replace("-", "_")])
    except AirlightError as refused:
        return str(refused)
    return ""


def _flush() -> None:
    if sys.stdout is not None:
        sys.stdout.flush()


def _drop_stdout() -> None:
    """Discard what is left in stdout's buffer where it cannot be written to, or Python would complain at exit."""
    with contextlib.suppress(OSError, ValueError, AttributeError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
