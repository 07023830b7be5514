"""Finds the graphics drivers of this machine: those that the system offers, and SwiftShader of an installed Chromium.

    python scripts/drivers.py                      list them, with their adapters
    python scripts/drivers.py NAME COMMAND ...     run a command where that driver is the only one

A process loads its drivers once, so each is tried in a process of its own, with the environment that `drivers` gives.
"""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

MANIFESTS = ("/usr/share/vulkan/icd.d", "/usr/local/share/vulkan/icd.d", "/etc/vulkan/icd.d", "~/.local/share/vulkan/icd.d")
BROWSERS = ("chromium", "chromium-browser", "google-chrome", "microsoft-edge")
BROWSER_FOLDERS = (
    "/usr/lib/chromium",
    "/usr/lib64/chromium-browser",
    "/usr/lib/chromium-browser",
    "/opt/google/chrome",
    "/opt/microsoft/msedge",
)
SWIFTSHADER = "vk_swiftshader_icd.json"  # beside libvk_swiftshader.so
VARIABLES = ("VK_DRIVER_FILES", "VK_ICD_FILENAMES")  # the loader's name, and the one it had before 1.3.207
NATIVE = ("Vulkan", "Metal", "D3D12")
PROBE = "import json, wgpu; print(json.dumps([dict(a.info) for a in wgpu.gpu.enumerate_adapters_sync()]))"


def browser_folders() -> list[Path]:
    """List the folders where a Chromium keeps its libraries."""
    commands = [shutil.which(name) for name in BROWSERS]
    found = [Path(path).resolve().parent for path in commands if path] + [Path(folder) for folder in BROWSER_FOLDERS]
    return list(dict.fromkeys(folder for folder in found if folder.is_dir()))


def manifests() -> list[Path]:
    """List the manifests of Vulkan drivers: those that the environment names, else the system's; and SwiftShader's."""
    named = [os.environ[name] for name in VARIABLES if os.environ.get(name)]
    if named:
        found = [Path(path) for path in named[0].split(os.pathsep)]
    else:
        found = [path for folder in MANIFESTS for path in sorted(Path(folder).expanduser().glob("*.json"))]
    return list(dict.fromkeys([*found, *(f / SWIFTSHADER for f in browser_folders() if (f / SWIFTSHADER).is_file())]))


def adapters(environment: dict[str, str]) -> list[dict[str, object]]:
    """Ask a process of its own which adapters of native back ends it finds, as wgpu describes them; none where it fails.

    Raises SystemExit, with what to do, where wgpu cannot be imported.
    """
    done = subprocess.run(
        [sys.executable, "-c", PROBE], env=os.environ | environment, capture_output=True, text=True, timeout=120, check=False
    )
    reason = done.stderr.strip().rpartition("\n")[2]
    if done.returncode and reason.startswith(("ModuleNotFoundError", "ImportError")):
        print(f"{sys.executable}: {reason}: use .venv/bin/python, which `make env` makes", file=sys.stderr)
        raise SystemExit(2)
    if done.returncode:
        return []
    return [one for one in json.loads(done.stdout.splitlines()[-1]) if one["backend_type"] in NATIVE]


def name_of(adapter: dict[str, object]) -> str:
    """Name the driver of an adapter in one lower-case word; Mesa's llvmpipe is lavapipe as Vulkan has it."""
    word = str(adapter["vendor"] or adapter["device"]).split()[0].lower()
    return {"llvmpipe": "lavapipe"}.get(word, word)


def drivers() -> dict[str, dict[str, str]]:
    """Find each driver with an adapter: its name, and the environment in which a process sees only that one."""
    found: dict[str, dict[str, str]] = {}
    for path in manifests():
        environment = dict.fromkeys(VARIABLES, str(path))
        for adapter in adapters(environment)[:1]:
            found.setdefault(name_of(adapter), environment)
    if not found:  # no manifests: Metal, Direct3D, or a loader that knows other places
        found = {name_of(adapter): {} for adapter in adapters({})[:1]}
    return found


def main() -> int:
    if sys.argv[1:2] in (["-h"], ["--help"]):
        print(__doc__.strip())
        return 0
    found = drivers()
    if len(sys.argv) > 2:
        if sys.argv[1] not in found:
            print(f"there is no driver {sys.argv[1]}; there is {', '.join(found) or 'none'}", file=sys.stderr)
            return 2
        try:
            return subprocess.run(sys.argv[2:], env=os.environ | found[sys.argv[1]], check=False).returncode
        except OSError as error:
            print(f"{sys.argv[2]}: cannot be run ({error.strerror}); give a command's name or path", file=sys.stderr)
            return 2
    for name, environment in found.items():
        for one in adapters(environment):
            print(f"{name:14}{one['device']}, {one['backend_type']}, {one['vendor']} {one['description']}".rstrip())
    if not found:
        print("no driver: install one (Debian: mesa-vulkan-drivers, and chromium for SwiftShader)", file=sys.stderr)
    return 0 if found else 1


if __name__ == "__main__":
    sys.exit(main())
