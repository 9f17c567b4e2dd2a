"""All JSON that the package writes goes through here: the same values give the same bytes, wherever they go."""

from __future__ import annotations

import msgspec


def encode(value: object, indent: int | None = None) -> bytes:
    """Return plain values, or msgspec's or standard data classes of them, as JSON; without an indent on one line.

    Numbers are those of Python: the types of this package hold no others.
    """
    data = msgspec.json.encode(value)
    return data if indent is None else msgspec.json.format(data, indent=indent)


def encode_line(value: object) -> bytes:
    """Return a value as one line of JSON, its end included."""
    return encode(value) + b"\n"
