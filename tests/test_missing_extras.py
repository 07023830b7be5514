"""Without an extra, what needs it says in one line what to install; other names of the package work on."""

import subprocess
import sys

import pytest

ABSENT = {
    "scenes": ("pygfx", "import airlight.pygfx"),
    "notebook": ("anywidget", "import airlight; airlight.view('table')"),
    "scenes, a part": ("pylinalg", "from airlight.pygfx import LightShafts"),
}


@pytest.mark.parametrize("case", ABSENT)
def test_what_to_install_is_said(case: str) -> None:
    package, code = ABSENT[case]
    source = f"import sys; sys.modules[{package!r}] = None; {code}"
    done = subprocess.run([sys.executable, "-c", source], capture_output=True, text=True, timeout=120)
    last = done.stderr.splitlines()[-1]
    assert done.returncode == 1 and last.startswith(("ImportError: airlight.", "airlight.errors.AirlightError: ")), done.stderr
    assert package in last and f"airlight[{case.partition(',')[0]}]" in last.rpartition(": pip install ")[2]


def test_the_rest_needs_no_extra() -> None:
    source = "import sys; sys.modules['pygfx'] = sys.modules['imgui_bundle'] = None; import airlight; airlight.light_shafts"
    done = subprocess.run([sys.executable, "-c", source], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
