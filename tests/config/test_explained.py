"""What settings mean, read from docstrings, and the key that was meant."""

from __future__ import annotations

import pytest

from dloftbs.config.explained import comment, meanings, meant, summary


class Base:
    """A base.

    Parameters
    ----------
    low, high : float
        Bounds of
        the range.
    share : float
        Of the base.

    Raises
    ------
    ValueError
        Never.
    """


class Derived(Base):
    """A derived one.

    More of it.

    Parameters
    ----------
    low, high
        As for `Base`.
    share : float
        Of its own.
    """


def test_a_meaning_is_taken_over_from_the_base_where_the_docstring_says_so():
    assert meanings(Derived) == {"low": "Bounds of the range.", "high": "Bounds of the range.", "share": "Of its own."}
    assert meanings(Base)["share"] == "Of the base."
    assert meanings(object) == {}


def test_the_summary_is_the_first_line():
    assert summary(Derived) == "A derived one."


def test_a_comment_has_the_words_of_yaml_and_no_markup():
    assert comment("None: as `x` says, ``p``; True or False.") == ["# null: as x says, p; true or false."]
    assert all(line.startswith("# ") and len(line) < 120 for line in comment("word " * 100))
    assert comment("") == []


@pytest.mark.parametrize(
    ("key", "answer"),
    [
        ("a.size", "; did you mean 'a.size_px'?"),
        ("size_px", "; did you mean 'a.size_px'?"),
        ("b.size_px", "; did you mean 'a.size_px'?"),
        ("section", "; did you mean 'sections'?"),
        ("a.", ""),
        ("a.cost", "; it is a setting of a.method=other"),
        ("quite.different", ""),
        ("", ""),
    ],
)
def test_the_key_that_was_meant(key, answer):
    assert meant(key, {"a": "", "sections": "", "a.size_px": "", "a.cost": "a.method=other"}) == answer
