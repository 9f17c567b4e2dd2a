"""A sequence made for tracking, of bars that are hidden for a while, and trackers of which the scores are known."""

from __future__ import annotations

import numpy as np
from lab.evaluation.joint_stubs import joined, path
from lab.evaluation.runner_stubs import LEFT, RIGHT, Bars, bars

from dloftbs.data.frame_result import FrameResult
from dloftbs.data.tracks import Track, TrackState
from dloftbs_lab.truth import Truth


class Hidden(Bars):
    """Two bars that move down by a pixel a frame; of the first, columns are hidden in some frames.

    `hidden` maps frames to the first and last hidden column.
    """

    family, cables = "stub", 2

    def __init__(self, length=8, hidden=None):
        super().__init__("hidden bars", length)
        self.hidden = hidden or {}

    def frame(self, index):
        frame = super().frame(index)
        return type(frame)(mask=self.truth(index).mask, index=index)

    def truth(self, index):
        whole = super().truth(index)
        first, second = whole.visible_masks
        if index in self.hidden:
            first = first.copy()
            low, high = self.hidden[index]
            first[:, low : high + 1] = False
        return Truth(whole.curves, (first, second), whole.ids)


HALF = dict.fromkeys((3, 4, 5), (100, 199))
WHOLE = dict.fromkeys((3, 4), (0, 199))


def swapping(frame):
    """Each bar has the other's name from the fifth frame on."""
    first, second = bars(frame.index)
    return {0: first, 1: second} if frame.index < 4 else {1: first, 0: second}


def flipping(frame):
    """Both run the other way from the fifth frame on."""
    return {i: bar if frame.index < 4 else bar.reversed() for i, bar in enumerate(bars(frame.index))}


def ghostly(frame):
    """A third bar, where nothing is, in the last four of eight frames."""
    first, second = bars(frame.index)
    if frame.index < 4:
        return {0: first, 1: second}
    return {0: first, 1: second, 2: first.sample(200) + np.array([0.0, 20.0])}


def one_only(frame):
    return {0: bars(frame.index)[0]}


class Remembering:
    """Knows the whole first bar from its second frame on, and in its first one only what shows of it."""

    def __init__(self):
        self.knows = False

    def __call__(self, frame):
        first, second = bars(frame.index)
        half = first(np.linspace(0.0, 0.5, 200))
        known, self.knows = self.knows, True
        return {0: first if known or frame.index not in HALF else half, 1: second}


def bent_where_hidden(frame):
    """The first bar is right where it shows, and runs up to 8 px off where it does not."""
    first, second = bars(frame.index)
    if frame.index not in HALF:
        return {0: first, 1: second}
    x = np.linspace(LEFT, RIGHT, 801)
    return {0: np.column_stack((x, 30.0 + frame.index + np.maximum(x - 100.0, 0.0) / 10.0)), 1: second}


class HiddenTracker:
    """Publishes the first bar's track all the time, but sees it only while it shows, and after `late` frames more."""

    late = 0
    number = 7

    def __init__(self):
        self.dark = False

    def __call__(self, frame):
        first, second = (joined(path((LEFT, row + frame.index), (RIGHT, row + frame.index))) for row in (30, 70))
        sees = frame.index not in WHOLE and not (self.dark and frame.index < 5 + self.late)
        self.dark = self.dark or not sees
        number = self.number if frame.index < 5 else 7
        state = TrackState.CONFIRMED if sees else TrackState.HIDDEN
        one = Track(number, state, bars(frame.index)[0], None, 3, 0 if sees else 1, first if sees else None)
        other = Track(9, TrackState.CONFIRMED, bars(frame.index)[1], None, 3, 0, second)
        return FrameResult((first, second) if sees else (second,), (one, other), None, frame.size)


class LateTracker(HiddenTracker):
    late = 2


class RenamingTracker(HiddenTracker):
    number = 3
