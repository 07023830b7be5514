"""Presets: TOML files that give some parameters their values. The keys are the declared parameters and `description`."""

import difflib
import functools
import json
import os
import stat
import tomllib
from importlib import resources
from pathlib import Path
from typing import Any, get_args

import msgspec

from airlight import parameters
from airlight.errors import AirlightError

LARGEST = 1 << 20  # bytes; a preset has a few hundred


@functools.cache
def structs(scenes: bool = True) -> tuple[type[msgspec.Struct], ...]:
    """The declarations: every Struct of airlight.parameters. Options, presets and docs follow from them. scenes: of 3-D ones too."""
    found = [
        v for v in vars(parameters).values() if isinstance(v, type) and issubclass(v, msgspec.Struct) and not v.__name__.startswith("_")
    ]
    return tuple(s for s in found if s.__module__ == parameters.__name__ and (scenes or s is not parameters.InScene))


def keys() -> list[str]:
    return [field.name for struct in structs() for field in msgspec.structs.fields(struct)]


def build(values: dict[str, Any]) -> dict[type, Any]:
    """An instance of each declared Struct, with its share of the values. Raises AirlightError for a bad one."""
    return {s: s(**{f.name: values[f.name] for f in msgspec.structs.fields(s) if f.name in values}) for s in structs()}


def _folder() -> Path:
    return Path(str(resources.files("airlight"))) / "data" / "presets"


def names() -> list[str]:
    """The presets that come with Airlight."""
    return sorted(path.stem for path in _folder().glob("*.toml"))


def description(name: str) -> str:
    return str(_read(_folder() / f"{name}.toml").get("description", ""))


def load(preset: str | os.PathLike[str]) -> dict[str, Any]:
    """The values of a preset, checked: one that comes with Airlight by its name, or a .toml file."""
    name = os.fsdecode(preset)
    if name in names():
        return _check(_folder() / f"{name}.toml")
    if not name.lower().endswith(".toml"):
        raise AirlightError(f"there is no preset {name!r}{_nearest(name, names())}; use {', '.join(names())} or a .toml file")
    return _check(Path(name))


def save(path: str | os.PathLike[str], values: dict[str, Any], about: str = "") -> None:
    """Write some values as a preset, which `load` reads; a new file, whole or not at all. Raises AirlightError, MachineError."""
    from airlight.files.atomic import check_output, replacing

    build(values)
    check_output(path, image=False)
    lines = [f"description = {json.dumps(''.join(c if c.isprintable() else '?' for c in about))}", ""]
    for key, value in values.items():
        if value is not None:  # unset
            lines.append(f"{key} = {json.dumps(value)}")  # numbers, texts and truths are written alike in JSON and TOML
    with replacing(path) as file:
        file.write(("\n".join(lines) + "\n").encode())


def choices(kind: Any) -> list[str]:
    """The values of a declared Literal, in order; none for a number."""
    return [choice for choice in get_args(get_args(kind)[0]) if isinstance(choice, str)]


def group(kind: Any) -> str:
    """The group in which a field of this type is declared."""
    return str(kind.__metadata__[0].extra["group"])


def written(text: str) -> dict[str, Any]:
    """The values of a text such as `samples=32,jitter=blue` or `vesper,samples=64`: parameters, and presets by their names."""
    types = {field.name: field.type for struct in structs() for field in msgspec.structs.fields(struct)}
    values: dict[str, Any] = {}
    for part in text.split(","):
        key, equals, value = (word.strip() for word in part.partition("="))
        if not equals:
            values |= load(key)
        elif key not in types:
            raise AirlightError(f"unknown key {key!r}{_nearest(key, keys())}")
        else:
            try:
                values[key] = msgspec.convert(value, types[key], strict=False)
            except msgspec.ValidationError as error:
                known = choices(types[key])
                rest = f"{_nearest(value, known)}; use {', '.join(known)}" if known else ""
                raise AirlightError(f"{key} = {value!r}: {error}{rest}") from None
    return values


def _check(path: Path) -> dict[str, Any]:
    values = _read(path)
    about = values.pop("description", "")
    if not isinstance(about, str):
        raise AirlightError(f"{path}: description must be a text")
    for key in values:
        if key not in keys():
            raise AirlightError(f"{path}: unknown key {key!r}{_nearest(key, keys())}")
    try:
        build(values)
    except AirlightError as error:
        raise AirlightError(f"{path}: {error}") from None
    return values


def _read(path: Path) -> dict[str, Any]:
    try:
        status = path.stat()
        if not stat.S_ISREG(status.st_mode) or status.st_size > LARGEST:
            raise AirlightError(f"{path}: is not a preset (a regular .toml file of at most {LARGEST} bytes)")
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise AirlightError(f"{path}: cannot be read ({error.strerror}); give a preset's name or a .toml file") from None
    except RecursionError:
        raise AirlightError(f"{path}: is nested too deeply; a preset is a list of key = value lines") from None
    except UnicodeDecodeError:
        raise AirlightError(f"{path}: is not TOML: it is no UTF-8 text") from None
    except ValueError as error:  # not TOML, a NUL in the name, a number of too many digits
        raise AirlightError(f"{path}: is not TOML: {error}") from None


def _nearest(word: str, known: list[str]) -> str:
    close = difflib.get_close_matches(word, known, n=1)
    return f"; did you mean {close[0]!r}?" if close else ""
