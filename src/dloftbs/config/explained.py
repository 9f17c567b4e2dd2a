"""Meanings of the settings, taken from the docstrings of the sections, and the right key for a wrong one."""

from __future__ import annotations

import difflib
import inspect
import re
import textwrap
from collections.abc import Mapping

_COMMENT_COLUMNS = 110  # of a line of the settings as text
_LIKE_ENOUGH = 0.6  # difflib's own measure and its default: a share of letters in common


def summary(section: type) -> str:
    """Return the first line of a section's docstring."""
    return (inspect.getdoc(section) or "").partition("\n")[0]


def meanings(section: type) -> dict[str, str]:
    """Return what a docstring in NumPy's style says of each parameter, what it takes over from a base included."""
    found: dict[str, str] = {}
    for kind in reversed(section.__mro__):
        text = inspect.cleandoc(kind.__dict__.get("__doc__") or "")
        _, _, parameters = text.partition("Parameters\n----------\n")
        parameters = re.split(r"\n\w+\n---+\n", parameters)[0]
        for names, entry in re.findall(r"^(\w[\w, ]*?)(?: : .*)?\n((?:[ ]{4}.*\n?)+)", parameters, re.MULTILINE):
            meaning = " ".join(entry.split())
            if not meaning.startswith("As for `"):
                found |= dict.fromkeys(names.split(", "), meaning)
    return found


def comment(text: str) -> list[str]:
    """Return text of a docstring as lines of a comment in YAML, and Python's words as YAML has them."""
    for python, yaml in (("None", "null"), ("True", "true"), ("False", "false")):
        text = re.sub(rf"\b{python}\b", yaml, text)
    return [f"# {line}" for line in textwrap.wrap(text.replace("`", ""), _COMMENT_COLUMNS)]


def meant(key: str, known: Mapping[str, str]) -> str:
    """Return the end of a message that says which dotted key a wrong one may stand for; empty if there is none.

    Parameters
    ----------
    key : str
        The wrong key, with or without its section, or a wrong section.
    known : mapping of str to str
        Each section and dotted key, and the setting under which alone it counts, or an empty text.
    """
    if key in known:
        return f"; it is a setting of {known[key]}"
    names = [full.partition(".")[2] for full in known]  # empty for a section
    last = key.rpartition(".")[2]
    if not last:
        return ""
    near = difflib.get_close_matches(key, known, 1, _LIKE_ENOUGH)
    same = [full for full, name in zip(known, names, strict=True) if name == last]
    like = difflib.get_close_matches(last, names, 1, _LIKE_ENOUGH)
    beneath = [full for full, name in zip(known, names, strict=True) if name in like]
    best = [*same, *near, *beneath][:1]
    return f"; did you mean {best[0]!r}?" if best else ""
