"""Mutated files through the command line: one line or a picture, and never a signal, a hang, a traceback or a left-over file."""

import os
import sys

import pytest
from fuzzing import campaign

SEED = 1  # the same mutants every time


def tried(number, tmp_path, workers, capsys):
    codes, faults, peak = campaign(number, SEED, tmp_path, workers)
    with capsys.disabled():
        print(f"\n{sum(codes.values())} mutants of seed {SEED}: exit codes {codes}, at most {peak >> 10} MiB beyond the device; ", end="")
    assert not faults, "\n".join(faults)
    assert sum(codes.values()) == number and set(codes) == {0, 2}
    assert min(codes.values()) > number / 10  # both refusals and pictures, or the mutants are too tame or too wild


@pytest.mark.skipif(sys.platform != "linux", reason="the worker looks at its memory in /proc")
def test_mutants(tmp_path, capsys):
    tried(600, tmp_path, 1, capsys)


@pytest.mark.slow
@pytest.mark.timeout(1800)
@pytest.mark.skipif(sys.platform != "linux", reason="the worker looks at its memory in /proc")
def test_many_mutants(tmp_path, capsys):
    tried(40_000, tmp_path, os.cpu_count() or 1, capsys)
