"""Base of the sections, and the checks of their values."""

from __future__ import annotations

import msgspec

from dloftbs.errors import ConfigError
from dloftbs.support.values import abridged, as_integer, check_integer, check_number, shown

MIN, MAX = 1e-9, 1_000_000_000  # of any number here: far from what is of use, and what is computed of it is finite


class Section(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Base of the sections: immutable, compared by value, unknown keys refused, and shown by what is no default."""

    def __repr__(self) -> str:
        named = ((field.name, field.default) for field in msgspec.structs.fields(self))
        changed = [f"{name}={getattr(self, name)!r}" for name, default in named if getattr(self, name) != default]
        return abridged(f"{type(self).__name__}({', '.join(changed)})")


def require(condition: bool, name: str, expected: str, value: object) -> None:
    """Raise a `ConfigError` that says what came, unless a condition holds."""
    if not condition:
        raise ConfigError(f"{name} must be {expected}, got {shown(value)}")


def keep_integer(section: Section, name: str, low: int, high: int) -> None:
    """Check an integer, and keep it as an int."""
    number = check_integer(name, getattr(section, name), low, high, ConfigError)
    msgspec.structs.force_setattr(section, name, number)


def keep_number(section: Section, name: str, low: float, high: float) -> None:
    """Check a number, and keep it as a float."""
    number = check_number(name, getattr(section, name), low, high, ConfigError)
    msgspec.structs.force_setattr(section, name, number)


def keep_size(section: Section, name: str, top: int) -> None:
    """Check rows and columns, and keep them as a tuple of int."""
    given = getattr(section, name)
    sides = tuple(as_integer(side) for side in given) if isinstance(given, (tuple, list)) else ()
    valid = len(sides) == 2 and all(side is not None and 0 < side <= top for side in sides)
    require(valid, name, f"two integers in 1..{top}: rows and columns", given)
    msgspec.structs.force_setattr(section, name, sides)


def keep_range(section: Section, name: str, top: int, *, wraps: bool = False) -> None:
    """Check a range of integers, and keep it as a tuple of int."""
    given = getattr(section, name)
    bounds = tuple(as_integer(bound) for bound in given) if isinstance(given, tuple) else ()
    valid = len(bounds) == 2 and all(bound is not None and 0 <= bound <= top for bound in bounds)
    expected = f"a tuple of two integers in 0..{top}" + ("" if wraps else ", low before high")
    if wraps and len(bounds) == 2 and all(bound is not None and 0 <= bound <= 360 for bound in bounds):
        expected += f" (half degrees: {top + 1} of them are a circle)"
    require(valid and (wraps or given[0] <= given[1]), name, expected, given)
    msgspec.structs.force_setattr(section, name, bounds)
