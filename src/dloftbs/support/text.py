"""Text that every file and stream takes."""

from __future__ import annotations


def readable(text: str) -> str:
    r"""Return a text without what no encoding has: bytes of a file name that are no UTF-8 become escapes.

    Python keeps such bytes as lone surrogates, and all that is not ASCII where the locale is POSIX's; UTF-8 among them
    comes back as itself, so that a file has the same name in every locale.

    Examples
    --------
    >>> readable("cable\udcff.png")
    'cable\\xff.png'
    """
    try:
        raw = text.encode("utf-8", "surrogateescape")
    except UnicodeEncodeError:  # surrogates that stand for no byte: a name of Windows, or somebody's own text
        raw = text.encode("utf-8", "backslashreplace")
    return raw.decode("utf-8", "backslashreplace")
