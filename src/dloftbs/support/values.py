"""Small checks of single values: numbers of any make in, plain Python values out, errors that say what came."""

from __future__ import annotations

import math
import operator
import os
from collections.abc import Collection, Mapping, Sequence
from dataclasses import fields, is_dataclass
from enum import Enum
from itertools import islice, pairwise
from numbers import Integral, Real
from pathlib import Path
from typing import Any, TypeVar

from dloftbs.errors import DloftbsError, InputError

Span = tuple[float, float]

_Kind = TypeVar("_Kind", bound=Enum)
_Made = TypeVar("_Made")

LONGEST_S = 1e11
"""Seconds: three thousand years. Larger values count milliseconds or less since 1970, and are no time in seconds."""

ROUNDING_S = 1e-6
"""Difference of two times that are the same, s.

Source: numerics; seconds since 1970 are rounded to 0.24e-6 as floating-point numbers.
"""

MAX_PX = 1_000_000
"""Pixels of an image's side, far above those of any sensor."""

MILLIMETRE_M = 0.001
"""Metres per count of an integer depth image where nobody says otherwise."""

DEPTH_UNITS_M = 1e-9, 1e3
"""Least and greatest metres per count of a depth image: sensors have 1e-5 to 1e-2."""

MAX_WHOLE = 2**53
"""Largest integer that JSON and a float64 hold exactly: no index, id or number of frames is larger."""

MASK_KINDS = ("auto", "binary", "probability", "labels")
"""Meanings that the values of a mask may have."""

_LONGEST_SHOWN = 200  # characters of a value in a message
_MAX_SHOWN = 8  # numbers of an array, items of a list and keys in a message
_LEVELS = 3  # of lists within lists in a message
_PLAIN = (str, bytes, int, float, complex, type(None))
_LONGEST_REPR = 280  # characters of a value by itself, a line or two


def as_integer(value: object) -> int | None:
    """Return a Python or NumPy integer as an int; None for all else, bool and times included."""
    if isinstance(value, bool):
        return None
    if isinstance(value, int):
        return int(value)
    if not isinstance(value, Integral):
        return None
    try:
        return operator.index(value)
    except TypeError:  # NumPy calls its time differences integers
        return None


def as_float(value: object) -> float | None:
    """Return a finite number of Python or NumPy as a float; None for all else, bool and times included."""
    given = as_integer(value) if not isinstance(value, float) and isinstance(value, Integral) else value
    if not isinstance(given, (float, Real)):
        return None
    try:
        number = float(given)
    except OverflowError:
        return None
    return number if math.isfinite(number) else None


def check_integer(name: str, value: object, low: int, high: int, error: type[DloftbsError] = InputError) -> int:
    """Return an integer in low..high, or raise the error."""
    number = as_integer(value)
    if number is None or not low <= number <= high:
        raise error(f"{name} must be an integer in {low}..{high}, got {shown(value)}")
    return number


def check_number(name: str, value: object, low: float, high: float, error: type[DloftbsError] = InputError) -> float:
    """Return a number in low..high, or raise the error."""
    number = as_float(value)
    if number is None or not low <= number <= high:
        raise error(f"{name} must be a finite number in {low:g}..{high:g}, got {shown(value)}")
    return number


def check_mask_kind(value: object, error: type[DloftbsError] = InputError) -> str:
    """Return what the values of a mask are; raise the error if it is none of `MASK_KINDS`."""
    if not isinstance(value, str) or value not in MASK_KINDS:
        raise error(f"mask_is must be one of {', '.join(MASK_KINDS)}, got {shown(value)}")
    return value


def check_text(name: str, value: object) -> str:
    """Return text as a plain str, or raise an `InputError`."""
    if not isinstance(value, str):
        raise InputError(f"{name} must be text, got {shown(value)}")
    return str(value)


def check_path(name: str, value: object, error: type[DloftbsError] = InputError) -> Path:
    """Return a path, or raise the error: also for text that no file system has for a name."""
    if not isinstance(value, (str, Path, os.PathLike)):
        raise error(f"{name} must be a path, got {shown(value)}")
    text = os.fsdecode(value)
    try:
        unnameable = "a null byte" if b"\0" in os.fsencode(text) else ""
    except UnicodeEncodeError as wrong:
        unnameable = f"the character {text[wrong.start]!r}"
    if unnameable:
        raise error(f"{name} must be a path, which cannot hold {unnameable}, got {shown(text)}")
    return Path(text)


def check_flag(name: str, value: object) -> bool:
    """Return a bool of Python or NumPy as a bool, or raise an `InputError`."""
    if not isinstance(value, bool) and type(value).__name__ not in ("bool", "bool_"):
        raise InputError(f"{name} must be True or False, got {shown(value)}")
    return bool(value)


def check_type(name: str, value: object, wanted: type) -> None:
    """Raise an `InputError` if a value is of another type."""
    if not isinstance(value, wanted):
        raise InputError(f"{name} must be a {wanted.__name__}, got {shown(value)}")


def check_stamp(value: object) -> float | None:
    """Return a time in seconds or None, or raise an `InputError`."""
    if value is None:
        return None
    stamp = as_float(value)
    if stamp is None or abs(stamp) > LONGEST_S:
        raise InputError(f"stamp must be a finite number of seconds, {LONGEST_S:g} at most, got {shown(value)}")
    return stamp


def is_same_time(stamp: float | None, other: float | None) -> bool:
    """Return whether two times in seconds are known and the same, to the rounding of seconds since 1970."""
    return stamp is not None and other is not None and abs(stamp - other) <= ROUNDING_S


def is_before(stamp: float | None, other: float | None) -> bool:
    """Return whether a time in seconds is known to lie before another one."""
    return stamp is not None and other is not None and stamp < other - ROUNDING_S


def check_size(name: str, value: object, least: int = 1) -> tuple[int, int]:
    """Return the size ``(H, W)`` of an image as a tuple, or raise an `InputError`; frames may be empty, cameras not."""
    if isinstance(value, (tuple, list)) and len(value) == 2:
        rows, columns = as_integer(value[0]), as_integer(value[1])
        if rows is not None and columns is not None and least <= rows <= MAX_PX and least <= columns <= MAX_PX:
            return rows, columns
    kind = "positive integers" if least else "integers of at least 0"
    raise InputError(f"{name} must be two {kind} (H, W), got {shown(value)}; {MAX_PX} at most")


def check_pair(name: str, value: object, low: float, high: float) -> Span:
    """Return two numbers in low..high as a tuple, or raise an `InputError`."""
    if not isinstance(value, (tuple, list)) or len(value) != 2:
        raise InputError(f"{name} must be two numbers, got {shown(value)}")
    one, other = value
    return check_number(name, one, low, high), check_number(name, other, low, high)


def check_spans(name: str, value: object) -> tuple[Span, ...]:
    """Return intervals of a curve's ``u``, ascending in 0..1, as tuples, or raise an `InputError`."""
    if not isinstance(value, (tuple, list)):
        raise InputError(f"{name} must be intervals (low, high) of u, got {shown(value)}")
    spans = tuple(check_pair(name, span, 0.0, 1.0) for span in value)
    if any(low > high for low, high in spans) or any(a[0] > b[0] for a, b in pairwise(spans)):
        raise InputError(f"{name} must be ascending intervals (low, high) of u, got {shown(value)}")
    return spans


def values_of(what: str, data: object, *keys: str) -> list[Any]:
    """Return the values of keys in a dictionary as `to_dict` makes it, or raise an `InputError`."""
    if not isinstance(data, Mapping):
        raise InputError(f"{what} needs a dictionary as of to_dict, got {shown(data)}")
    if missing := [key for key in keys if key not in data]:
        raise InputError(f"{what} needs the key {missing[0]!r}, got {shown(list(data))}")
    return [data[key] for key in keys]


def kind_of(what: str, kinds: type[_Kind], value: object) -> _Kind:
    """Return the member of an enumeration that has a plain value, or raise an `InputError`."""
    known = {kind.value: kind for kind in kinds}
    if not isinstance(value, str) or value not in known:
        raise InputError(f"{what} must be one of {', '.join(known)}, got {shown(value)}")
    return known[value]


def list_of(what: str, data: object) -> list[Any]:
    """Return a list of plain values as it is, or raise an `InputError`."""
    if not isinstance(data, (list, tuple)):
        raise InputError(f"{what} must be a list, got {shown(data)}")
    return list(data)


def check_all(name: str, values: object, wanted: type) -> tuple[object, ...]:
    """Return values of one type as a tuple, or raise an `InputError`."""
    if not isinstance(values, Sequence) or not all(isinstance(value, wanted) for value in values):
        raise InputError(f"{name} must be a sequence of {wanted.__name__}, got {shown(values)}")
    return tuple(values)


def set_fields(instance: object, **fields: object) -> None:
    """Replace fields of a frozen instance while it is made."""
    for name, value in fields.items():
        object.__setattr__(instance, name, value)


def unchecked(kind: type[_Made], /, **values: object) -> _Made:
    """Return an instance with these attributes, faster than its constructor, which would check them."""
    made = kind.__new__(kind)
    made.__dict__.update(values)
    return made


def varied(one: _Made, /, **values: object) -> _Made:
    """Return a copy of an instance with some attributes replaced, which are not checked."""
    return unchecked(type(one), **{**one.__dict__, **values})


def abridged(text: str) -> str:
    """Return the `repr` of a value, cut off where it is long."""
    return text if len(text) <= _LONGEST_REPR else f"{text[:_LONGEST_REPR]}..."


def shown(value: object) -> str:
    """Return a value as a message says it: short, whatever it is; arrays by their shapes, mappings by their keys."""
    try:
        text = _outlined(value)
    except ValueError:  # Python writes no integer of more than some thousand digits
        text = "an integer of thousands of digits, or what holds one"
    return text if len(text) <= _LONGEST_SHOWN else f"{text[:_LONGEST_SHOWN]}... ({len(text)} characters)"


def _outlined(value: object, levels: int = _LEVELS) -> str:
    kind = type(value).__name__
    if hasattr(value, "shape") and hasattr(value, "dtype") and not isinstance(value, type):
        shape = tuple(value.shape)
        if math.prod(shape) > _MAX_SHOWN:
            return f"{'array' if kind == 'ndarray' else kind} {shape} of {value.dtype}"
    elif isinstance(value, Mapping):
        if not all(isinstance(item, _PLAIN) for item in value.values()):
            return f"a {kind} with the keys {_listed(value, levels)}"
    elif is_dataclass(value) and not isinstance(value, type) and value.__dataclass_params__.repr:  # type: ignore[attr-defined]
        # How a dataclass was made is written in it, but has no types.
        return f"{kind}({_listed([getattr(value, field.name) for field in fields(value)], levels)})"
    elif isinstance(value, (list, tuple)) and not (
        len(value) <= _MAX_SHOWN and all(isinstance(item, _PLAIN) for item in value)
    ):
        listed = _listed(value, levels)
        return f"[{listed}]" if isinstance(value, list) else f"({listed}{',' * (len(value) == 1)})"
    return " ".join(repr(value).splitlines())


def _listed(values: Collection[object], levels: int) -> str:
    """Return the first of some values, and how many there are if those are not all."""
    if levels == 0:
        return "..."
    more = f", ... ({len(values)} in all)" if len(values) > _MAX_SHOWN else ""
    return ", ".join(_outlined(value, levels - 1) for value in islice(values, _MAX_SHOWN)) + more


def count_of(number: int, what: str) -> str:
    """Return a number of things in words, as "1 track" and "2 tracks"."""
    return f"{number} {what}" + "s" * (number != 1)


def extent_of(length: float, unit: str, closed: bool) -> str:
    """Return a curve's length in words, and whether it is a loop."""
    return f"{'loop' if closed else 'open'}, {length:.4g} {unit}"
