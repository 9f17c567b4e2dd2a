"""Numbers that change with time, as data: what a cable in space is moved by."""

from __future__ import annotations

import math
from bisect import bisect_right
from dataclasses import dataclass, replace


@dataclass(frozen=True)
class Moment:
    """A point in time of a sequence.

    Parameters
    ----------
    phase : float
        0 at the first frame, 1 at the last, however many there are.
    seconds : float
        Since the first frame.
    """

    phase: float
    seconds: float


@dataclass(frozen=True)
class Signal:
    """A smooth function of time: what happens once goes by phase, what must keep its speed goes by seconds.

    Parameters
    ----------
    keys : tuple of (float, float)
        Phases in ascending order and the values there; between them the value goes smoothly, and rests at each.
    slow : tuple of (float, float, float)
        Sines to add: amplitude, periods in the whole sequence, where in its period each is at the start, radians.
    fast : tuple of (float, float, float)
        The same with periods per second.
    """

    keys: tuple[tuple[float, float], ...]
    slow: tuple[tuple[float, float, float], ...] = ()
    fast: tuple[tuple[float, float, float], ...] = ()

    def __call__(self, moment: Moment) -> float:
        """Return the value at a moment."""
        value = self._keyed(moment.phase)
        for sines, time in ((self.slow, moment.phase), (self.fast, moment.seconds)):
            for amplitude, rate, start in sines:
                value += amplitude * math.sin(2.0 * math.pi * rate * time + start)
        return value

    def swaying(self, amplitude: float, periods: float, start: float = 0.0) -> Signal:
        """Return the signal plus a sine with this number of periods in the sequence."""
        return replace(self, slow=(*self.slow, (amplitude, periods, start)))

    def swinging(self, amplitude: float, hertz: float, start: float = 0.0) -> Signal:
        """Return the signal plus a sine with this number of periods per second."""
        return replace(self, fast=(*self.fast, (amplitude, hertz, start)))

    def _keyed(self, phase: float) -> float:
        after = bisect_right(self.keys, phase, key=lambda key: key[0])
        if after == 0:
            return self.keys[0][1]
        if after == len(self.keys):
            return self.keys[-1][1]
        (begin, first), (end, last) = self.keys[after - 1], self.keys[after]
        x = (phase - begin) / (end - begin)
        return first + (last - first) * x * x * x * (x * (6.0 * x - 15.0) + 10.0)


def steady(value: float) -> Signal:
    """Return a signal that stays as it is."""
    return Signal(((0.0, value),))


def keyed(*keys: tuple[float, float]) -> Signal:
    """Return a signal that goes smoothly from key to key, ``(phase, value)``."""
    return Signal(keys)
