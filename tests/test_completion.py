"""Completion in shells: what is offered, that it is quick, and that the shells' scripts take it."""

import os
import subprocess
import sys

import pytest
from click.shell_completion import ShellComplete

from airlight.cli import cli
from airlight.options import presets
from airlight.scenes.names import NAMES, VALIDATION

FILE = "FILE"


def offered(line: str) -> list[str]:
    """What may follow a line, whose last word is the one that is completed."""
    *words, last = line.split(" ")
    found = ShellComplete(cli, {}, "airlight", "_AIRLIGHT_COMPLETE").get_completions(words, last)
    return [FILE if one.type == "file" else one.value for one in found]


@pytest.mark.parametrize(
    ("line", "names"),
    [
        ("", sorted(cli.commands)),
        ("im", ["image"]),
        ("image --meth", ["--method"]),
        ("image --help", ["--help-all", "--help"]),
        ("image in.png --method r", ["radial"]),
        ("image in.png --look ", ["smart", "classic"]),
        ("image in.png --format j", ["jpg", "jpeg", "jxl"]),
        ("image in.png --preset mi", [FILE, "misty"]),
        ("image in.png --light a", ["auto", "auto:1", "auto:2", "auto:3+"]),
        ("image in.png -o ", [FILE]),
        ("image ", [FILE]),
        ("render ", [FILE, *NAMES, *VALIDATION]),
        ("render table --medium ", [FILE, *presets.names(presets.MEDIA)]),
        ("render table --method m", ["multipass", "march"]),
        ("render table --steps ", ["exact", "table"]),
        ("render a.glb --environment s", [FILE, "sunrise", "sky"]),
        ("view fl", [FILE, "flying", "flood"]),
        ("compare sl", [FILE, "slats", "slide"]),
        ("compare slats --against ", ["tracer", "walk", "mitsuba"]),
    ],
)
def test_what_is_offered(line, names):
    assert offered(line) == names


def test_commands_are_described_in_whole_phrases():
    found = ShellComplete(cli, {}, "airlight", "_AIRLIGHT_COMPLETE").get_completions([], "")
    told = {one.value: one.help for one in found}
    assert set(told) == set(cli.commands) and told["image"] == "Add light shafts to a picture, or to many"
    assert not any("..." in text or "\n" in text for text in told.values())


def test_completion_reads_nothing_heavy():
    code = "import sys; from airlight.cli import main\ntry: main()\nexcept SystemExit: pass\n"
    code += "print([m for m in 'rich.console numpy wgpu difflib OpenImageIO'.split() if m in sys.modules])"
    environment = {**os.environ, "COMP_WORDS": "airlight render t", "COMP_CWORD": "2", "_AIRLIGHT_COMPLETE": "bash_complete"}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, env=environment)
    assert done.stdout.splitlines() == ["file,t", "plain,table", "plain,two-spots", "[]"], done.stderr


@pytest.mark.skipif(os.name == "nt", reason="bash")
def test_the_script_for_bash(tmp_path):
    """As the documents say: the script is what the command prints. Names go before files, which click's script would let forget them."""
    program = tmp_path / "airlight"
    program.write_text(f'#!/bin/sh\nexec {sys.executable} -m airlight "$@"\n')
    program.chmod(0o755)
    script = 'eval "$(_AIRLIGHT_COMPLETE=bash_source airlight)"; compopt() { echo "$@"; }; COMP_WORDS=(airlight render ta); COMP_CWORD=2; '
    script += '_airlight_completion airlight; echo "${COMPREPLY[@]}"'
    environment = {**os.environ, "PATH": f"{tmp_path}{os.pathsep}{os.environ['PATH']}"}
    done = subprocess.run(["bash", "--norc", "-c", script], capture_output=True, text=True, env=environment, timeout=60)
    assert done.stdout.split("\n") == ["-o default", "table", ""], done
