"""Help on one screen: that it is one, that it says what is so, and that its examples run."""

import os
import shlex
import subprocess
import sys

import click
import numpy as np
import pytest
from click.testing import CliRunner

from airlight.cli import cli, main
from airlight.cli.help import SCREENS
from airlight.files import read_image, write_image

EXAMPLES = [line for one in SCREENS.values() for _, line in one.examples]
NARROW = {"COLUMNS": "80", "TERMINAL_WIDTH": "80"}


def shown(*args: str) -> str:
    done = CliRunner().invoke(cli, [*args], env=NARROW)
    assert done.exit_code == 0
    return done.output


@pytest.mark.parametrize("command", [[], *([name] for name in cli.commands)])
def test_help_is_one_screen(command):
    text = shown(*command, "--help")
    lines = text.splitlines()
    assert len(lines) <= 40 and max(map(len, lines)) <= 80, text
    assert text == shown(*command, "-h") and "\033" not in text
    about = SCREENS[command[0] if command else "airlight"]
    assert all(line in text for _, line in about.examples) and 1 <= len(about.examples) <= 3
    if not command:
        assert all(f"  {name} " in text for name in cli.commands)


@pytest.mark.parametrize("name", list(cli.commands))
def test_the_rest_is_behind_help_all(name):
    options = [p for p in cli.commands[name].params if isinstance(p, click.Option) and p.name != "help_all"]
    screen, rest = shown(name, "--help"), shown(name, "--help-all")
    assert all(any(one in rest for one in p.opts) for p in options)
    told = [p for p in options if p.name in SCREENS[name].options]
    assert len(told) == len(SCREENS[name].options) == min(10, len(options))  # none is misspelt, and a few are all told
    assert all(p.opts[-1] in screen for p in told)
    assert ("--help-all" in screen) == (len(options) > len(told))


@pytest.mark.parametrize("line", EXAMPLES)
def test_examples_are_understood(line):
    program, name, *args = shlex.split(line)
    assert program == "airlight"
    cli.commands[name].make_context(name, args)


def test_examples_of_pictures_run(tmp_path, monkeypatch):
    """What a newcomer types first, in a folder with a photograph and a folder of photographs."""
    pixels = np.random.default_rng(1).random((24, 32, 3)).astype(np.float32) * 0.5
    pixels[4:8, 12:16] = 1
    write_image(tmp_path / "photo.jpg", pixels)
    for folder in ("photos", "shafts"):
        (tmp_path / folder).mkdir()
    write_image(tmp_path / "photos" / "one.jpg", pixels)
    monkeypatch.chdir(tmp_path)
    for _, line in SCREENS["image"].examples:
        assert main(shlex.split(line)[1:]) == 0
    for written in ("out.jpg", "out.png", "shafts/one.jpg"):
        assert read_image(written).width == 32


def test_words_are_bold_on_a_terminal_alone(monkeypatch):
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True, raising=False)
    monkeypatch.delenv("NO_COLOR", raising=False)
    from airlight.cli.help import strong

    assert strong("Usage:") != "Usage:"
    monkeypatch.setenv("NO_COLOR", "1")
    assert strong("Usage:") == "Usage:"


def test_help_reads_nothing_heavy():
    """Help imports no Rich either: it is the first thing that anybody sees."""
    code = "import sys; from airlight.cli import main; main(['render', '--help']); "
    code += "print([m for m in 'rich.console numpy wgpu difflib OpenImageIO'.split() if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, env=os.environ)
    assert done.stdout.splitlines()[-1] == "[]", done.stderr
