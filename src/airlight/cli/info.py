"""`airlight info`: what computes here, with which versions, and what is missing; or what a scene has, and where."""

import importlib
import platform

import click

from airlight.cli.help import Command
from airlight.cli.shared import SCENE
from airlight.jobs.frames import needing_scenes

LIBRARIES = {"wgpu": "wgpu", "numpy": "numpy", "OpenImageIO": "OpenImageIO", "opencolorio": "PyOpenColorIO"}  # distribution: module


@click.command(cls=Command)
@click.argument("scene", metavar="[SCENE]", type=SCENE, required=False)
def info(scene: str | None) -> None:
    """Show adapters, versions, what is missing and how to get it; or what SCENE has and where it lies, in metres, for --volume,
    --light and --eye.
    """
    if scene is not None:
        with needing_scenes():
            from airlight.scenes import open_scene
            from airlight.scenes.contents import contents
        for name, where in contents(open_scene(scene)):
            _line(name, where)
        return
    _line("airlight", _version("airlight"))
    _line("python", f"{platform.python_version()} on {platform.platform()}")
    missing = []
    for name, module in LIBRARIES.items():
        try:
            importlib.import_module(module)
            _line(name, _version(name))
        except Exception as error:  # a broken installation raises anything
            _line(name, f"cannot be imported ({error})")
            missing.append(f"{name}: pip install --force-reinstall {name}")
    missing += _adapters()
    for line in missing:
        _line("missing", line)


def _adapters() -> list[str]:
    """Shows the adapters; what is missing if there is none."""
    from airlight.gpu import device

    try:
        found = device.adapters()
        best = device.choose().info if found else None
    except Exception as error:
        return [f"adapter: {error}"]
    if best is None:
        _line("adapter", "none: NumPy computes instead, slowly, and large pictures with less detail")
        return [f"adapter: {device.cure()}"]
    for adapter in found:
        one = adapter.info
        chosen = " (used)" if dict(one) == dict(best) else ""
        _line("adapter", f"{one['device']}, {one['backend_type']}, {one['adapter_type']}, driver: {device.driver_of(one)}{chosen}")
    return []


def _version(distribution: str) -> str:
    from importlib import metadata  # a tenth of the time that help takes

    try:
        return metadata.version(distribution)
    except metadata.PackageNotFoundError:
        return "not installed as a package"


def _line(name: str, text: str) -> None:
    plain = "".join(c if c.isprintable() else "?" for c in name)
    click.echo(f"{plain + ':' if plain else '':14} {' '.join(text.split())}")
