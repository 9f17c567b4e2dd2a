"""Words for colours, each a range of hue, saturation and value."""

from __future__ import annotations

import difflib

_MIN_LIKENESS = 0.6  # of a word that was meant; difflib's own default: a share of letters in common

COLOUR_WORDS = {
    "red": "170:10",
    "orange": "5:22",
    "yellow": "20:35",
    "green": "40:85",
    "cyan": "83:100",
    "blue": "95:130",
    "purple": "128:155",
    "magenta": "140:165",
    "pink": "150:178",
    "white": "0:179,0:40,180:255",
    "grey": "0:179,0:40,60:180",
    "black": "0:179,0:255,0:60",
}
"""Ranges on OpenCV's scale, in the notation of `HsvRange.parse`. Neighbours overlap, since light shifts a hue.

Source: the hues of the CSS colours of these names and of their usual shades, 5 to either side for noise and light.
"""
_SPELLINGS = {"gray": "grey", "violet": "purple", "turquoise": "cyan"}


def range_of_word(text: str) -> str | None:
    """Return the range of a word in the notation of `HsvRange.parse`; None for any other text."""
    word = text.strip().lower()
    return COLOUR_WORDS.get(_SPELLINGS.get(word, word))


def word_meant(text: str) -> str:
    """Return the end of a message that names the word like a text; empty if there is none, or it has no letters."""
    words = (*COLOUR_WORDS, *_SPELLINGS)
    given = text.strip().lower()
    within = [word for word in given.replace(",", " ").split() if word in words]
    like = within or difflib.get_close_matches(given, words, 1, _MIN_LIKENESS)
    return f"; did you mean {like[0]!r}?" if like else ""
