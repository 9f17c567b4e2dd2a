"""Reasons of a run, counted by kind."""

from __future__ import annotations

import re
from collections import Counter

_MAX_KINDS = 20
_OTHER = "other reasons"
_NUMBER = re.compile(r"\d+(?:\.\d+)?")


class Reasons:
    """Counts reasons; those that differ in their numbers alone are one kind, which is shown with the numbers' ranges.

    Its size does not grow with the stream.
    """

    def __init__(self) -> None:
        self._times: Counter[tuple[str, ...]] = Counter()  # by the texts between the numbers
        self._ranges: dict[tuple[str, ...], list[tuple[str, str]]] = {}

    def add(self, reason: str) -> bool:
        """Count a reason, and return whether it is the first of its kind."""
        numbers = _NUMBER.findall(reason)
        kind = tuple(_NUMBER.split(reason))
        if kind not in self._times and len(self._times) >= _MAX_KINDS:
            numbers, kind = [], (_OTHER,)
        is_first = kind not in self._times
        self._times[kind] += 1
        known = self._ranges.setdefault(kind, [(number, number) for number in numbers])
        self._ranges[kind] = [
            (min(low, number, key=float), max(high, number, key=float))
            for (low, high), number in zip(known, numbers, strict=True)
        ]
        return is_first

    @property
    def total(self) -> int:
        """Number of reasons so far."""
        return self._times.total()

    def counts(self) -> dict[str, int]:
        """Return how often each kind came, the most frequent one first."""
        return {self._text(kind): times for kind, times in self._times.most_common()}

    def lines(self) -> list[str]:
        """Return a line for each kind."""
        return [f"{times:8d}  {text}" for text, times in self.counts().items()]

    def _text(self, kind: tuple[str, ...]) -> str:
        shown = [low if float(low) == float(high) else f"{low} to {high}" for low, high in self._ranges[kind]]
        return "".join(text + number for text, number in zip(kind, [*shown, ""], strict=True))
