"""Sequences of straight bars, and methods of which the scores are known; importable by other processes."""

from __future__ import annotations

import dataclasses
import functools
import signal
import sys
import time
from multiprocessing import connection
from pathlib import Path

import numpy as np
from builders import curve_through

from dloftbs.camera import PinholeCamera
from dloftbs.data.frame import Frame
from dloftbs_lab.evaluation.runner.run import evaluate
from dloftbs_lab.evaluation.runner.sequence_run import Method
from dloftbs_lab.evaluation.suites import Suite
from dloftbs_lab.known_sequence import KnownSequence
from dloftbs_lab.truth import Truth

SIZE = (120, 200)
LEFT, RIGHT = 20.0, 180.0
CAMERA = PinholeCamera(100.0, 100.0, 100.0, 60.0)
DEPTH_M = 2.0


class Bars(KnownSequence):
    """Horizontal bars, 5 px wide, that move down by a pixel a frame."""

    def __init__(self, name="bars", length=3, rows=(30, 70), fps=30.0, deep=False, only_masks=False):
        self.name, self.length, self.fps = name, length, fps
        self.rows, self.deep, self.only_masks = rows, deep, only_masks

    def frame(self, index):
        mask = np.logical_or.reduce(self._masks(index)) if self.rows else np.zeros(SIZE, bool)
        return Frame(mask=mask, camera=CAMERA if self.deep else None, index=index)

    def truth(self, index):
        curves = () if self.only_masks else bars(index, self.rows)
        curves_3d = tuple(lifted(curve) for curve in curves) if self.deep else ()
        return Truth(curves, self._masks(index), tuple(range(len(self.rows))), curves_3d)

    def _masks(self, index):
        masks = []
        for row in self.rows:
            mask = np.zeros(SIZE, bool)
            mask[row + index - 2 : row + index + 3, int(LEFT) : int(RIGHT) + 1] = True
            masks.append(mask)
        return tuple(masks)


class Rung(Bars):
    """One level of a ladder."""

    def __init__(self, level):
        super().__init__(f"specks {level}")
        self.base, self.ladder, self.level, self.unit = "bars", "specks", level, "%"


class Drawing:
    """A scene that is drawn when it is first needed, and written down in a file."""

    def __init__(self, log):
        self.log = log

    @functools.cached_property
    def shape(self):
        with open(self.log, "a") as file:
            file.write("drawn\n")
        return SIZE


class Drawn(Bars):
    """Bars in a scene that other sequences may share."""

    def __init__(self, name, drawing):
        super().__init__(name)
        self.drawing = drawing

    def frame(self, index):
        assert self.drawing.shape == SIZE
        return super().frame(index)


def bars(index, rows=(30, 70)):
    """The true curves of a frame."""
    return tuple(curve_through(np.column_stack((np.linspace(LEFT, RIGHT, 30), np.full(30, r + index)))) for r in rows)


def lifted(curve):
    """The curve on a plane in front of the camera."""
    points = curve.sample(30)
    return curve_through(CAMERA.deproject(points, np.full(len(points), DEPTH_M)))


def perfect(frame):
    return bars(frame.index)


def lone(frame):
    return bars(frame.index, (30,))


def reversed_truth(frame):
    return [curve.reversed() for curve in bars(frame.index)]


def other_order(frame):
    return bars(frame.index)[::-1]


def shifted(frame):
    return [curve.transformed(np.eye(2), (0.0, 7.0)) for curve in bars(frame.index)]


def truncated(frame):
    return [curve(np.linspace(0.0, 0.5, 200)) for curve in bars(frame.index)]


def halves_swapped(frame):
    return [np.roll(curve.sample(1000), 500, axis=0) for curve in bars(frame.index)]


def three(frame):
    return bars(frame.index, (30, 70, 90))


def in_space(frame):
    return [lifted(curve).sample(50) + np.array([0.0, 0.01, 0.0]) for curve in bars(frame.index)]


def nothing(frame):
    return []


def named(frame):
    return dict(enumerate(bars(frame.index)))


def turning(frame):
    """The first name changes hands, and the direction turns, from the second frame on."""
    first, second = bars(frame.index)
    return {7: first, 8: second} if frame.index == 0 else {9: first, 8: second.reversed()}


def raising(frame):
    if frame.index == 1:
        raise RuntimeError("no idea")
    return bars(frame.index)


def junk(frame):
    return [None, "a curve?", 7, [np.zeros((5, 4))], [np.zeros((1, 2))], 3.0][frame.index]


class Unreadable:
    """Looks like a list of curves, and falls over when it is read."""

    def __iter__(self):
        raise RuntimeError("no curves after all")


def unreadable(frame):
    return [np.array(None), Unreadable(), dict.fromkeys([0], None)][frame.index]


def leaving(frame):
    sys.exit(0)


def raising_what_no_encoding_has(frame):
    raise RuntimeError("cannot read \udcff.png or \ud800")


class LeavesAtTheStart:
    def start(self, frame, truth):
        sys.exit(0)

    def __call__(self, frame):
        return []


class LeavesWhenItIsMade:
    def __init__(self):
        sys.exit(0)


def dying(frame):
    signal.raise_signal(signal.SIGKILL)


def lazy(frame):
    return (curve for curve in bars(frame.index))


class Counting:
    """Finds as many bars as it was called times."""

    def __init__(self):
        self.calls = 0

    def __call__(self, frame):
        self.calls += 1
        return bars(frame.index)[: self.calls]


def logging_method(log: str, pause: float = 0.0):
    def call(frame):
        with Path(log).open("a") as file:
            file.write(f"{frame.index}\n")
        time.sleep(pause)
        return bars(frame.index)

    return call


def always(function):
    """The factory of a function."""
    return functools.partial(_same, function)


def _same(function):
    return function


def method(function, name=None):
    return Method(name or function.__name__, always(function))


def suite(*sequences, name="stub"):
    return Suite(name, "bars", sequences or (Bars(),), "settings")


def without_times(parts):
    """All that must not depend on the machine."""
    return [
        dataclasses.replace(part, rows=tuple(dataclasses.replace(row, ms=0.0) for row in part.rows)) for part in parts
    ]


def halting(frame):
    """Take long between the two parts of an answer that this process writes in two: a busy machine may do so."""
    if not hasattr(halting, "write"):
        halting.write = connection.Connection._send

        def write(self, data, *rest):
            halting.write(self, data, *rest)
            if len(data) == 4:  # the length alone
                time.sleep(600.0)

        connection.Connection._send = write
    return bars(frame.index)


def to_be_interrupted(folder: str) -> None:
    """Score sequences that are long enough for such an answer, in two processes."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    sequences = [Bars(f"bars {i}", length=200, rows=(10,), only_masks=True) for i in range(100)]
    evaluate([suite(*sequences)], [method(halting)], Path(folder), jobs=2)


def to_be_killed(folder: str, log: str) -> None:
    """Score four sequences slowly, in two processes."""
    sequences = [Bars(f"bars {i}", length=4) for i in range(4)]
    slow = Method("slow", functools.partial(logging_method, log, 0.15))
    evaluate([suite(*sequences)], [slow], Path(folder), jobs=2)
