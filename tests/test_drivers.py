"""What the script that finds drivers says where it can do nothing: one line, with its cure."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "scripts"))

import drivers


def test_a_command_that_is_not_there(monkeypatch, capsys):
    monkeypatch.setattr(drivers, "drivers", lambda: {"lavapipe": {}})
    monkeypatch.setattr(sys, "argv", ["drivers.py", "lavapipe", "no-such-command"])
    assert drivers.main() == 2
    said = capsys.readouterr().err
    assert said.startswith("no-such-command: cannot be run (") and said.count("\n") == 1
    monkeypatch.setattr(sys, "argv", ["drivers.py", "lavapip", "true"])
    assert drivers.main() == 2 and capsys.readouterr().err == "there is no driver lavapip; there is lavapipe\n"
    monkeypatch.setattr(sys, "argv", ["drivers.py", "lavapipe", sys.executable, "-c", "raise SystemExit(5)"])
    assert drivers.main() == 5


def test_an_interpreter_without_wgpu(monkeypatch, capsys):
    monkeypatch.setattr(drivers, "PROBE", "import sys; sys.modules['wgpu'] = None; " + drivers.PROBE)
    with pytest.raises(SystemExit) as stopped:
        drivers.adapters({})
    said = capsys.readouterr().err
    assert stopped.value.code == 2 and "wgpu" in said and ": use .venv/bin/python, which" in said and said.count("\n") == 1
