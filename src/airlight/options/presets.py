"""Presets: TOML files that give some parameters their values. The keys are the declared parameters and `description`.

There are two kinds, in folders of these names: presets, of any parameters, and media, of a medium's.
"""

import functools
import itertools
import json
import os
import stat
import tomllib
from importlib import resources
from pathlib import Path
from typing import Any

import msgspec

from airlight.errors import AirlightError
from airlight.messages import MOST_NAMES, close, nearest, nearest_file
from airlight.options import ALL, Medium, build, declared
from airlight.process import standard

PRESETS, MEDIA = "presets", "media"
LARGEST = 1 << 20  # bytes; a preset has a few hundred
MOST_NESTED = 200  # brackets of a file


def keys(kind: str = PRESETS) -> list[str]:
    """Name what a preset may hold."""
    return [one.name for group in (ALL if kind == PRESETS else (Medium,)) for one in group.options()]


def _folder(kind: str) -> Path:
    return Path(str(resources.files("airlight"))) / "data" / kind


@functools.cache
def names(kind: str = PRESETS) -> tuple[str, ...]:
    """List the presets that come with Airlight."""
    return tuple(sorted(path.stem for path in _folder(kind).glob("*.toml")))


def description(name: str, kind: str = PRESETS) -> str:
    return str(_read(_folder(kind) / f"{name}.toml", kind).get("description", ""))


def load(preset: str | os.PathLike[str], kind: str = PRESETS) -> dict[str, Any]:
    """Read the values of a preset, checked: one that comes with Airlight by its name, or a .toml file."""
    if not isinstance(preset, str | bytes | os.PathLike):
        raise AirlightError(f"{_what(kind)} must be a name or a path, not {type(preset).__name__}")
    name, known = os.fsdecode(preset), names(kind)
    if name in known:
        return _check(_folder(kind) / f"{name}.toml", kind)
    if not name.lower().endswith(".toml") and not standard.is_input(name):
        hint = nearest(name, known) or (nearest_file(name) if os.path.dirname(name) or os.path.splitext(name)[1] else "")
        hint = hint or f"; use {', '.join(known)} or a .toml file"
        raise AirlightError(f"there is no {_what(kind)} {name!r}{hint}")
    return _check(Path(name), kind)


def _what(kind: str) -> str:
    return "preset" if kind == PRESETS else "medium"


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


def divided(text: str) -> list[tuple[str, str | None]]:
    """Divide a text such as `vesper,noise-amount=3,wind=1,0,0` into keys, with underscores, and values; None for a preset's.

    Numbers behind one of a triple are its own: `wind=1,0,0` is `wind=1/0/0`.
    """
    triples = {one.name for one in declared(scenes=True) if one.is_triple}
    found: list[tuple[str, str | None]] = []
    for part in text.split(","):
        key, equals, value = (word.strip() for word in part.partition("="))
        last, before = found[-1] if found else ("", None)
        if not equals and last in triples and before is not None and before.count("/") < 2 and is_number(key):
            found[-1] = last, f"{before}/{key}"
        else:
            found.append((key.replace("-", "_"), value) if equals else (key, None))
    return found


def is_number(word: str) -> bool:
    """Tell whether a text is a number."""
    try:
        float(word)
    except ValueError:
        return False
    return True


def written(text: str) -> dict[str, Any]:
    """Read a text such as `samples=32,jitter=blue` or `vesper,sigma_t=0.1/0.2/0.3`: parameters, and presets by name. See `divided`."""
    known_as = {one.name: one for one in declared(scenes=True)}
    values: dict[str, Any] = {}
    for key, value in divided(text):
        if value is None:
            values |= load(key)
        elif key == "preset":
            raise AirlightError(f"a preset is named alone: write {value or 'its name'} in place of preset={value}")
        elif key not in known_as:
            raise AirlightError(f"unknown key {key!r}{nearest(key, keys())}")
        else:
            one, said = known_as[key], value.split("/")
            try:
                values[key] = one.convert((said * 3 if len(said) == 1 else said) if one.is_triple else value, strict=False)
            except msgspec.ValidationError as error:
                rest = one.cure(value)
                rest += "; write three numbers as 0.1/0.2/0.3, or one" if one.is_triple else ""
                raise AirlightError(f"{key} = {value!r}: {error}{rest}") from None
    return values


def _check(path: Path, kind: str) -> dict[str, Any]:
    values, known = _read(path, kind), keys(kind)
    about = values.pop("description", "")
    if not isinstance(about, str):
        raise AirlightError(f"{path}: description must be a text")
    for key in values:
        if key not in known:
            other = "; it is none of a medium's" if key in keys() else nearest(key, known)
            raise AirlightError(f"{path}: unknown key {key!r}{other}")
    try:
        built = build(values)
    except AirlightError as error:
        raise AirlightError(f"{path}: {error}") from None
    return {name: getattr(part, name) for name in values for part in built.values() if name in part.__struct_fields__}


def _meant(path: Path, kind: str) -> str:
    """Ask which file is meant, or which of our presets, by what its name has before the ending, which all have in common."""
    if path.parent != Path():
        return nearest_file(str(path))
    beside = itertools.islice(Path().glob("*.toml"), MOST_NAMES) if path.suffix.lower() == ".toml" else ()
    stems = {one.stem: one.name for one in beside} | {name: name for name in names(kind)}
    found = close(path.stem, stems)
    return f"; did you mean {stems[found[0]]!r}?" if found else ""


def _read(path: Path, kind: str) -> dict[str, Any]:
    try:
        there = Path(standard.local(str(path)))
        status = there.stat()
        if not stat.S_ISREG(status.st_mode) or status.st_size > LARGEST:
            raise AirlightError(f"{path}: is not a {_what(kind)} (a regular .toml file of at most {LARGEST} bytes)")
        text = there.read_text(encoding="utf-8")
        if sum(text.count(one) for one in "[{") > MOST_NESTED:  # before Python's own limit, at which destructors elsewhere fail too
            raise RecursionError
        return tomllib.loads(text)
    except OSError as error:
        hint = _meant(path, kind) or f"; give a {_what(kind)}'s name or a .toml file"
        raise AirlightError(f"{path}: cannot be read ({error.strerror}){hint}") from None
    except RecursionError:
        raise AirlightError(f"{path}: is nested too deeply; a {_what(kind)} is a list of key = value lines") from None
    except UnicodeDecodeError:
        raise AirlightError(f"{path}: is not TOML: it is no UTF-8 text") from None
    except ValueError as error:  # not TOML, a NUL in the name, a number of too many digits
        raise AirlightError(f"{path}: is not TOML: {error}") from None
