"""`airlight info`: what computes here, with which versions, and what is missing."""

import importlib
import platform

import click

from airlight.cli.help import Command

LIBRARIES = {"wgpu": "wgpu", "numpy": "numpy", "OpenImageIO": "OpenImageIO", "opencolorio": "PyOpenColorIO"}  # distribution: module


@click.command(cls=Command)
def info() -> None:
    """Show adapters, versions, what is missing and how to get it."""
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
    click.echo(f"{name + ':':14}{' '.join(text.split())}")
