"""The package as a user gets it: the wheel has all it needs, and works where only the wheel is installed."""

import os
import subprocess
import sys
import sysconfig
import tomllib
import venv
import zipfile
from importlib import metadata
from pathlib import Path

import pytest
from packaging.requirements import Requirement

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "src" / "airlight"
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]

USE = """
import sys, numpy as np, airlight
assert airlight.__file__.startswith(sys.prefix), f"not the wheel's: {airlight.__file__}"
shafts = airlight.light_shafts(np.ones((8, 8, 3), np.float32), (0.5, 0.5), occlusion="none")
assert np.isfinite(shafts).all() and np.any(shafts), shafts
print("shafts made")
"""


def run(*command: object, cwd: Path) -> str:
    """The output of a command that knows nothing of this checkout; its stderr is shown where it fails."""
    environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    done = subprocess.run([str(part) for part in command], cwd=cwd, env=environment, capture_output=True, text=True, timeout=200)
    assert done.returncode == 0, f"{command} exited with {done.returncode}\n{done.stdout}\n{done.stderr}"
    return done.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    run(sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", folder, cwd=ROOT)
    (built,) = folder.glob("*.whl")
    return built


def test_adapter_present() -> None:
    """GPU tests run on a real adapter: without one they would pass on NumPy and prove nothing."""
    done = subprocess.run([sys.executable, ROOT / "scripts" / "probe_adapter.py"], capture_output=True, text=True, timeout=100)
    assert done.returncode == 0, f"{done.stdout}{done.stderr}\nrun make vulkan"


def test_the_environment_meets_the_declared_ranges() -> None:
    for text in PROJECT["dependencies"]:
        requirement = Requirement(text)
        assert metadata.version(requirement.name) in requirement.specifier, text


def test_wheel_holds_every_file_of_the_package(wheel: Path) -> None:
    files = {p.relative_to(PACKAGE.parent).as_posix() for p in PACKAGE.rglob("*") if p.is_file() and "__pycache__" not in p.parts}
    assert "airlight/py.typed" in files
    assert any(name.endswith(".wgsl") for name in files)
    with zipfile.ZipFile(wheel) as archive:
        packed = set(archive.namelist())
    assert files - packed == set()
    assert {name for name in packed - files if ".dist-info/" not in name} == set()


def test_wheel_works_in_a_clean_environment(wheel: Path, tmp_path: Path) -> None:
    """The dependencies are lent by this environment; its editable Airlight is not, for a .pth file in a lent folder is not read."""
    home = tmp_path / "env"
    venv.create(home, with_pip=False, symlinks=os.name != "nt")
    scripts = home / ("Scripts" if os.name == "nt" else "bin")
    python = scripts / ("python.exe" if os.name == "nt" else "python")
    site = Path(run(python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))", cwd=tmp_path).strip())
    (site / "lent.pth").write_text(sysconfig.get_path("purelib") + "\n", encoding="utf-8")
    bare = subprocess.run([python, "-c", "import airlight"], cwd=tmp_path, capture_output=True, text=True, env={"PATH": os.environ["PATH"]})
    assert "ModuleNotFoundError" in bare.stderr, "airlight is there before its wheel is installed"

    run(
        sys.executable,
        "-m",
        "pip",
        "--python",
        python,
        "install",
        "--no-deps",
        "--no-index",
        "--disable-pip-version-check",
        wheel,
        cwd=tmp_path,
    )
    assert PROJECT["version"] in run(scripts / "airlight", "--version", cwd=tmp_path)
    assert run(scripts / "airlight", "info", cwd=tmp_path).strip()
    assert "shafts made" in run(python, "-c", USE, cwd=tmp_path)
