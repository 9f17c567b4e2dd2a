"""Motions of cables in front of a pinhole camera, nothing of them hidden: bodies in space as functions of a phase."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from dloftbs.support.arrays import FloatArray
from dloftbs_lab.synthetic.generated import proportion
from dloftbs_lab.synthetic.headings import drifting
from dloftbs_lab.synthetic.motion import window
from dloftbs_lab.synthetic.strand import random_heading

FRAMES = 80
"""Frames of a whole sequence; speeds are those at this number."""

Body = Callable[[float], FloatArray]
"""Phase in 0..1 to points (n, 3): X and Y in the plane, H towards the camera, px of an image of the plane."""
Box = tuple[float, float, float, float]

_FOCAL_PX = 900.0  # HD; the plane is as far away as the focal length, so that it is seen one to one
_LENGTH_PX = (450.0, 700.0)
_BEND_WIDTHS = 5.0  # smallest bending radius
_MARGIN_PX = 24.0
_FIT_PHASES = np.linspace(0.0, 1.0, 41)
_FIT_STEPS = 12
_SHRINK = 0.96
_POINTS_PER_PX = 2.0  # so that they are at most a pixel apart where a cable comes nearer by a half
_SHORTER = 0.2
_TILT = math.radians(65.0)
_NEARER = 0.5
_STEP_PX = (40.0, 80.0)
_STEP_SHARE = (0.2, 0.33)
_APART_PX = 140.0
_CORNER = (math.radians(40.0), math.radians(70.0))


@dataclass(frozen=True)
class Camera:
    """A pinhole camera straight above the plane.

    Parameters
    ----------
    size : (int, int)
        ``(H, W)`` px.
    """

    size: tuple[int, int]

    @property
    def focal_px(self) -> float:
        """Focal length, and the distance of the plane."""
        return _FOCAL_PX * proportion(self.size)

    def magnification(self, points: FloatArray) -> FloatArray:
        """Return how much larger things are at points (n, 3) than in the plane, shape (n,)."""
        return self.focal_px / (self.focal_px - points[:, 2])

    def project(self, points: FloatArray) -> FloatArray:
        """Return points (n, 3) in the image, shape (n, 2) px."""
        middle = (np.array(self.size[::-1]) - 1.0) / 2.0
        return middle + points[:, :2] * self.magnification(points)[:, None]


@dataclass(frozen=True)
class Part:
    """One cable and when it is there.

    Parameters
    ----------
    body : Body
    present : (float, float)
        Phases from which and up to which; the last one is not included.
    """

    body: Body
    present: tuple[float, float] = (0.0, math.inf)

    def there(self, phase: float) -> bool:
        """Return whether it is there at a phase."""
        return self.present[0] <= phase < self.present[1]


@dataclass(frozen=True)
class Stage:
    """Common values of a sequence's cables: the camera, and their width in the plane, px."""

    camera: Camera
    width_px: float

    @property
    def scale(self) -> float:
        """Pixels per pixel of a 1280 x 720 image."""
        return proportion(self.camera.size)

    @property
    def box(self) -> Box:
        """Left, top, right and bottom of what the cables stay in, px."""
        margin = _MARGIN_PX * self.scale + self.width_px
        return margin, margin, self.camera.size[1] - margin, self.camera.size[0] - margin


def bends(rng: np.random.Generator, stage: Stage) -> list[Part]:
    """Return a cable that bends and drifts, and whose length in the image changes by up to a fifth."""
    return [Part(_fitted(_bending(rng, stage, _SHORTER), stage, stage.box))]


def tilts(rng: np.random.Generator, stage: Stage) -> list[Part]:
    """Return a rigid cable that tilts out of the image plane about its middle, to 65 degrees and back."""
    shape, side = _rigid(rng, stage), float(rng.choice((-1.0, 1.0)))
    lengthwise = np.linalg.svd(shape[:, :2], full_matrices=False)[2][0]

    def body(phase: float) -> FloatArray:
        angle = side * _TILT * window(phase, (0.05, 0.5), (0.5, 0.95))
        along = shape[:, :2] @ lengthwise
        level = shape[:, :2] + np.outer(along * (math.cos(angle) - 1.0), lengthwise)
        return np.column_stack((level, along * math.sin(angle)))

    return [Part(_fitted(body, stage, stage.box))]


def approaches(rng: np.random.Generator, stage: Stage) -> list[Part]:
    """Return a rigid cable that comes nearer until half of the distance is left, and goes back."""
    shape, way = _rigid(rng, stage), rng.uniform(-0.1, 0.1, 2) * stage.camera.size[::-1]

    def nearness(phase: float) -> float:
        return window(phase, (0.05, 0.5), (0.5, 0.95))

    def body(phase: float) -> FloatArray:
        return shape + np.array([*(nearness(phase) * way), 0.0])

    return [Part(_fitted(body, stage, stage.box, lambda phase: _NEARER * stage.camera.focal_px * nearness(phase)))]


def swings(rng: np.random.Generator, stage: Stage) -> list[Part]:
    """Return a rigid cable that swings to and fro, in the first frame already; no point moves more than 80 px a frame.

    The pixels are those of HD.
    """
    return [_swinging(rng, stage, lambda _: float(rng.uniform(*_STEP_PX)) * stage.scale)]


def darts(rng: np.random.Generator, stage: Stage) -> list[Part]:
    """Return a rigid cable that swings so fast that its fastest point moves by up to a third of its length a frame."""
    return [_swinging(rng, stage, lambda length: float(rng.uniform(*_STEP_SHARE)) * length)]


def _swinging(rng: np.random.Generator, stage: Stage, fastest_step: Callable[[float], float]) -> Part:
    """Return a rigid cable that swings; its length in the image gives how far its fastest point moves in a frame."""
    shape = _rigid(rng, stage)
    reach = rng.uniform(0.1, 0.2) * stage.camera.size[1]
    turn, lag, start = rng.uniform(0.1, 0.4), rng.uniform(0.0, math.pi), rng.uniform(0.0, 2.0 * math.pi)
    across = rng.uniform(-0.3, 0.3)

    def at(beat: float) -> FloatArray:
        angle, way = turn * math.sin(beat + lag), reach * math.sin(beat)
        cos, sin = math.cos(angle), math.sin(angle)
        turned = shape @ np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]])
        return turned + np.array([way, across * way, 0.0])

    swing = _fitted(lambda phase: at(2.0 * math.pi * phase), stage, stage.box)
    moments = np.array([swing(phase) for phase in _FIT_PHASES])
    fastest = float(np.linalg.norm(np.diff(moments, axis=0), axis=2).max()) * (len(_FIT_PHASES) - 1)
    length = float(np.linalg.norm(np.diff(moments[0], axis=0), axis=1).sum())
    beats = FRAMES * fastest_step(length) / fastest
    return Part(lambda phase: swing(start + beats * phase))


def ends_meet(rng: np.random.Generator, stage: Stage) -> list[Part]:
    """Return two cables whose ends come together at an angle, stay so for a while, and part again."""
    bending = _bending(rng, stage, _SHORTER / 2.0)
    cut, turn = float(rng.uniform(0.35, 0.65)), float(rng.choice((-1.0, 1.0)) * rng.uniform(*_CORNER))
    cos, sin = math.cos(turn), math.sin(turn)

    def half(phase: float, *, second: bool) -> FloatArray:
        points = bending(phase)
        at = round(cut * (len(points) - 1))
        way = (points[at, :2] - points[at - 8, :2]) / np.linalg.norm(points[at, :2] - points[at - 8, :2])
        apart = _APART_PX * stage.scale * (1.0 - window(phase, (0.15, 0.4), (0.6, 0.85)))
        if not second:
            return points[: at + 1] - np.array([*(apart * way), 0.0])
        away = points[at:] - points[at] + np.array([*(apart * way), 0.0])
        return points[at] + away @ np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]])

    both = _fitted(lambda phase: np.concatenate([half(phase, second=k) for k in (False, True)]), stage, stage.box)
    count = len(half(0.0, second=False))
    return [Part(lambda phase: both(phase)[:count]), Part(lambda phase: both(phase)[count:])]


def cut_in_two(rng: np.random.Generator, stage: Stage) -> list[Part]:
    """Return a cable that is cut, and from then on its shorter part, which moves away from the longer one."""
    bending = _bending(rng, stage, _SHORTER / 2.0)
    share, moment = float(rng.uniform(0.55, 0.7)), float(rng.uniform(0.25, 0.4))
    turn = float(rng.uniform(-1.0, 1.0))
    side = np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])

    def pieces(phase: float) -> FloatArray:
        points = bending(phase)
        at = round(share * (len(points) - 1))
        way = side @ (points[at, :2] - points[at - 8, :2]) / np.linalg.norm(points[at, :2] - points[at - 8, :2])
        apart = _APART_PX * stage.scale * window(phase, (moment, 1.0), (1.5, 2.0))
        points[at + 1 :, :2] += apart * way
        return points

    whole = _fitted(pieces, stage, stage.box)
    count = round(share * (len(bending(0.0)) - 1)) + 1
    return [
        Part(lambda phase: whole(phase)[: count if phase >= moment else None]),
        Part(lambda phase: whole(phase)[count:], (moment, math.inf)),
    ]


def exchange(rng: np.random.Generator, stage: Stage) -> list[Part]:
    """Return two cables of which one is taken away, and a third one that comes later in another place."""
    left, top, right, bottom = stage.box
    edges = np.linspace(left, right, 4) if right - left > bottom - top else np.linspace(top, bottom, 4)
    gap = 1.5 * stage.width_px
    strips: list[Box] = [
        (low + gap, top, high - gap, bottom) if right - left > bottom - top else (left, low + gap, right, high - gap)
        for low, high in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True)
    ]
    stays, goes, comes = (_fitted(_bending(rng, stage, _SHORTER / 2.0), stage, strips[i]) for i in rng.permutation(3))
    gone, there = float(rng.uniform(0.2, 0.35)), float(rng.uniform(0.55, 0.7))
    return [Part(stays), Part(goes, (0.0, gone)), Part(comes, (there, math.inf))]


def three_cross(rng: np.random.Generator, stage: Stage) -> list[Part]:
    """Return three cables that cross and move."""
    lean = rng.uniform(0.0, 2.0 * math.pi)
    return [
        Part(_fitted(_bending(rng, stage, _SHORTER, lean + math.pi * number / 3.0), stage, _part_of(rng, stage.box)))
        for number in range(3)
    ]


def _bending(rng: np.random.Generator, stage: Stage, shorter: float, lean: float | None = None) -> Body:
    """Return a cable that bends and drifts in the plane, and out of it so that it looks shorter by up to a share."""
    length = stage.scale * float(rng.uniform(*_LENGTH_PX))
    heading, angle = drifting(rng), rng.uniform(0.0, 2.0 * math.pi) if lean is None else lean
    # Of a slope that waves with the amplitude a, the mean cosine is 1 - a^2 / 4, about.
    slope = 2.0 * math.sqrt(rng.uniform(0.0, shorter))
    wave, start = rng.uniform(1.0, 2.0), rng.uniform(0.0, 2.0 * math.pi)
    way = rng.uniform(-0.12, 0.12, 2) * stage.camera.size[::-1]
    along = _along(length)

    def body(phase: float) -> FloatArray:
        swell = 0.5 - 0.5 * math.cos(2.0 * math.pi * phase)
        up = swell * slope * np.sin(2.0 * math.pi * wave * along + start)
        points = _integrated(angle + heading(along, phase), up, length)
        return points + np.array([*(swell * way), 0.0])

    return body


def _rigid(rng: np.random.Generator, stage: Stage) -> FloatArray:
    """Draw a shape in the plane, points (n, 3) around the origin."""
    length = stage.scale * float(rng.uniform(*_LENGTH_PX))
    along = _along(length)
    heading = rng.uniform(0.3, 1.0) * random_heading(rng, along, length, _BEND_WIDTHS * stage.width_px)
    return _integrated(heading + rng.uniform(0.0, 2.0 * math.pi), np.zeros(len(along)), length)


def _along(length_px: float) -> FloatArray:
    return np.linspace(0.0, 1.0, math.ceil(_POINTS_PER_PX * length_px) + 1)


def _integrated(heading: FloatArray, up: FloatArray, length_px: float) -> FloatArray:
    """Walk along headings and slopes (n,), radians; the mean of the points (n, 3) is the origin."""
    level = np.cos(up)
    directions = np.stack((level * np.cos(heading), level * np.sin(heading), np.sin(up)), axis=1)
    steps = 0.5 * (directions[1:] + directions[:-1]) * length_px / (len(heading) - 1)
    points = np.concatenate((np.zeros((1, 3)), np.cumsum(steps, axis=0)))
    return points - points.mean(axis=0)


def _fitted(body: Body, stage: Stage, box: Box, nearer: Callable[[float], float] = lambda _: 0.0) -> Body:
    """Return a body made smaller and moved in the plane until all of its motion is seen within a box.

    The height that is added, `nearer`, px at each phase, is not made smaller.
    """
    lifts = [np.array([0.0, 0.0, nearer(phase)]) for phase in _FIT_PHASES]
    moments = [body(phase)[[*range(0, len(body(0.0)), 8), -1]] for phase in _FIT_PHASES]
    room, middle = np.array([box[2] - box[0], box[3] - box[1]]), np.array([box[0] + box[2], box[1] + box[3]]) / 2.0
    factor, shift = 1.0, np.zeros(3)
    while True:
        for _ in range(_FIT_STEPS):
            lifted = [factor * points + lift + shift for points, lift in zip(moments, lifts, strict=True)]
            seen = np.concatenate([stage.camera.project(points) for points in lifted])
            low, high = seen.min(axis=0), seen.max(axis=0)
            # What is nearer moves further in the image, up to twice as far: half steps do not overshoot.
            shift = shift + np.array([*(0.5 * middle - 0.25 * (low + high)), 0.0])
        if (high - low <= room).all():
            return lambda phase: factor * body(phase) + np.array([0.0, 0.0, nearer(phase)]) + shift
        factor *= _SHRINK


def _part_of(rng: np.random.Generator, box: Box) -> Box:
    """Draw a box of a little less width and height inside of a box."""
    cut = np.array([0.2 * (box[2] - box[0]), 0.15 * (box[3] - box[1])])
    x, y = rng.random(2) * cut
    return box[0] + x, box[1] + y, box[2] - cut[0] + x, box[3] - cut[1] + y
