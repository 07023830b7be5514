"""Checks arguments of the daylight: each failure is an AirlightError of one line that says what may be given."""

from collections.abc import Iterable
from numbers import Real
from typing import Any

import numpy as np

from airlight.errors import AirlightError
from airlight.messages import nearest
from airlight.reference.daylight import Array

MOST_SHOWN = 40  # characters of a value in a message


def one_of(name: str, value: Any, known: Iterable[str]) -> str:
    """Check that a word is one of those known."""
    names = list(known)
    if not isinstance(value, str):
        quoted = [repr(one) for one in names]
        raise AirlightError(f"{name} is {_shown(value)}, and no text; give {', '.join(quoted[:-1])} or {quoted[-1]}")
    if value not in names:
        raise AirlightError(f"{name} is {value!r}; give {', '.join(names[:-1])} or {names[-1]}{nearest(value, names)}")
    return value


def true_or_false(name: str, value: Any) -> bool:
    """Check that a switch is a truth value."""
    if not isinstance(value, bool | np.bool_):
        raise AirlightError(f"{name} is {_shown(value)}; give True or False")
    return bool(value)


def numbers(name: str, value: Any, least: float, most: float, unit: str = "", more: str = "", finite: bool = True) -> Array:
    """Check that numbers of any shape are within bounds, and finite unless told: float64. more: ends the message."""
    unit = f" {unit}" if unit else ""
    bounds = f"give {least:g}{unit} or more" if np.isfinite(least) else "give finite numbers"
    if np.isfinite(most):
        bounds = f"give {least:g} to {most:g}{unit}"
    array = _real(name, value, bounds)
    bad = ~((array >= least) & (array <= most) & (np.isfinite(array) | (not finite)))  # which NaN is
    if bad.any():
        raise AirlightError(f"{name} is {array[bad].flat[0]:g}{unit}; {bounds}{more}")
    return array


def number(name: str, value: Any, least: float, most: float, unit: str = "", more: str = "") -> float:
    """Check that one number is finite and within bounds."""
    array = numbers(name, value, least, most, unit, more)
    if array.ndim:
        raise AirlightError(f"{name} has the shape {array.shape}; give one number")
    return float(array)


def colour(name: str, value: Any, least: float, most: float) -> Array:
    """Check that a number, or three, lie within bounds: (3,) float64."""
    array = numbers(name, value, least, most)
    if array.shape not in ((), (1,), (3,)):
        raise AirlightError(f"{name} has the shape {array.shape}; give one number, or red, green and blue")
    return np.array(np.broadcast_to(array, (3,)))


def _real(name: str, value: Any, bounds: str) -> Array:
    """Turn numbers of any shape into float64: texts, truth values, None and complex numbers, which NumPy would turn into some, are none."""
    try:
        given = value if isinstance(value, np.ndarray | np.generic) else np.asarray(value, object)
        if given.dtype.kind == "O":
            wrong = [one for one in given.flat if isinstance(one, bool) or not isinstance(one, Real)]
        else:
            wrong = [] if given.dtype.kind in "iuf" else list(given.flat[:1])
        if wrong:
            raise AirlightError(f"{name} is {_shown(wrong[0])}, and no number; {bounds}")
        return np.asarray(given, float)
    except (TypeError, ValueError, OverflowError):
        raise AirlightError(f"{name} is no number, and no array of numbers; {bounds}") from None


def _shown(value: Any) -> str:
    """Write what was given instead of what is wanted, in a line, shortened."""
    text = " ".join((str(value) if isinstance(value, np.generic) else repr(value)).split())
    return text if len(text) <= MOST_SHOWN else f"{text[:MOST_SHOWN]}..."


def broadcast(**arrays: Array) -> list[Array]:
    """Broadcast arrays against each other."""
    try:
        return [np.array(array) for array in np.broadcast_arrays(*arrays.values())]
    except ValueError:
        shapes = ", ".join(f"{name} {array.shape}" for name, array in arrays.items())
        raise AirlightError(f"shapes do not fit each other: {shapes}") from None
