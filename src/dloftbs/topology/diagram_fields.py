"""Checks of what users make a diagram of."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from dloftbs.errors import InputError
from dloftbs.support.values import MAX_WHOLE, check_flag, check_integer, check_number, shown


def check_sequence(name: str, value: object) -> Sequence[Any]:
    """Return a sequence that is no text, or raise an `InputError`."""
    if not isinstance(value, Sequence) or isinstance(value, (str, bytes)):
        raise InputError(f"{name} must be a sequence, got {shown(value)}")
    return value


def checked_fields(
    passes: object,
    closed: object,
    turns: object,
    tops: object,
    confidences: object,
    labels: object,
    objects: object,
    strand_confidences: object,
) -> dict[str, Any]:
    """Return the fields of a `Diagram` as plain tuples, with those that were left out.

    Raises
    ------
    InputError
        If a value is of another type or out of range.
    """
    strands = tuple([tuple(check_sequence("passes", one)) for one in check_sequence("passes", passes)])
    signs = _items("turns", turns, None, lambda one: check_integer("turns", one, -1, 1))
    n = len(signs)
    if 0 in signs:
        raise InputError("turns must be 1 or -1, got 0")
    found = sorted(check_integer("passes", number, 0, MAX_WHOLE) for strand in strands for number in strand)
    if found != [number for number in range(n) for _ in range(2)]:
        raise InputError(f"passes must have each of the {n} crossings of turns twice, got {shown(strands)}")
    fields = {
        "passes": strands,
        "turns": signs,
        "closed": _items("closed", closed, len(strands), lambda one: check_flag("closed", one)),
        "tops": _items("tops", tops, n, lambda one: None if one is None else check_integer("tops", one, 0, 1)),
    }
    for name, given, count in (
        ("confidences", confidences, n),
        ("strand_confidences", strand_confidences, len(strands)),
    ):
        sure = given if check_sequence(name, given) else (1.0,) * count
        fields[name] = _items(name, sure, count, lambda one: check_number("confidences", one, 0.0, 1.0))
    for name, given, count in (("labels", labels, n), ("objects", objects, len(strands))):
        names = given if check_sequence(name, given) else tuple(range(count))
        names = _items(name, names, count, lambda one: check_integer("labels", one, 0, MAX_WHOLE))
        if len(set(names)) < count:
            raise InputError(f"{name} must differ, got {shown(names)}")
        fields[name] = names
    return fields


def _items(name: str, given: object, count: int | None, check: Callable[[Any], Any]) -> tuple[Any, ...]:
    items = tuple([check(one) for one in check_sequence(name, given)])
    if count is not None and len(items) != count:
        raise InputError(f"{name} must have {count} items, got {len(items)}")
    return items
