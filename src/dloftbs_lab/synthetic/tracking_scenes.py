"""Scenes of the sequences that tracking is measured on: cables as functions of a phase, and their occluders."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from dloftbs.support.arrays import BoolArray, FloatArray
from dloftbs_lab.synthetic.generated import proportion
from dloftbs_lab.synthetic.headings import drifting, tilted, untying
from dloftbs_lab.synthetic.motion import Heading, Sway, fit_motion, looping, smoothstep, window
from dloftbs_lab.synthetic.strand import Strand, integrate
from dloftbs_lab.synthetic.tracking_covers import Cover, CoverShape, Lid, Reach, middle

FRAMES = 60
"""Frames of a whole sequence; speeds are those at this number."""
MAX_PX = 15.0
"""Largest motion of a point of a cable from one frame to the next, about, px in HD."""
MAX_HIDDEN = 0.3
"""The largest share of a cable's length that the occluders of "occluded" hide together."""
MAX_IN_HANDS = 0.5
"""The same of the hands of "hands"."""

Size = tuple[int, int]
Mask = BoolArray
Moving = Callable[[float], Strand]
"""Phase in 0..1 to a cable."""

_PHASES = np.linspace(0.0, 1.0, 31)
_SAMPLE_PX = 0.5
_ATTEMPTS = 60
_FAR_PX = 3000.0  # beyond any border, HD
_OUT_PX = 185.0  # how far a cable that leaves moves, HD
_SHIFT = 4  # of OpenCV's fixed-point coordinates


@dataclass(frozen=True)
class Stage:
    """Size of the image that the cables lie in, and their width.

    Parameters
    ----------
    size : (int, int)
        ``(H, W)`` px.
    width_px : float
        Of the cables.
    """

    size: Size
    width_px: float

    @property
    def scale(self) -> float:
        """Pixels per pixel of a 1280 x 720 image."""
        return proportion(self.size)

    @property
    def box(self) -> tuple[float, float, float, float]:
        """Left, top, right and bottom of where cables that stay inside move, px."""
        margin = 30.0 * self.scale + self.width_px / 2.0
        return margin, margin, self.size[1] - margin, self.size[0] - margin


@dataclass(frozen=True)
class Play:
    """Cables, the lowest first, and what covers them."""

    cables: tuple[Moving, ...]
    covers: tuple[Cover, ...] = ()

    def strands(self, phase: float) -> tuple[Strand, ...]:
        """Return the cables at a phase."""
        return tuple(cable(phase) for cable in self.cables)

    def covered(self, phase: float, strands: Sequence[Strand], size: Size) -> Mask:
        """Return the pixels (H, W) that are behind an occluder; `strands` are those at the phase."""
        picture = np.zeros(size, np.uint8)
        for cover in self.covers:
            for polygon in cover.polygons(phase, strands):
                corners = np.rint(polygon * (1 << _SHIFT)).astype(np.int32)
                cv2.fillConvexPoly(picture, corners, 1, cv2.LINE_8, _SHIFT)
        return picture > 0


def crossing(rng: np.random.Generator, stage: Stage, cables: int) -> Play:
    """Return cables that bend, turn and travel freely and cross each other."""
    return Play(_free(rng, stage, cables))


def occluded(rng: np.random.Generator, stage: Stage, cables: int) -> Play:
    """Return free cables, over which discs and bars move that hide up to `MAX_HIDDEN` of each."""
    moving = _free(rng, stage, cables)
    moments = [Play(moving).strands(phase) for phase in _PHASES]
    covers = _reaches(rng, stage, moments[0], ("bar", "disc"))
    shrink = 1.0
    while True:
        play = Play(moving, tuple(replace(cover, radius_px=shrink * cover.radius_px) for cover in covers))
        if _most_hidden(play, moments, stage.size) <= MAX_HIDDEN:
            return play
        shrink *= 0.93


def hands(rng: np.random.Generator, stage: Stage, cables: int) -> Play:
    """Return free cables, over which hands move that hide up to `MAX_IN_HANDS` of each."""
    moving = _free(rng, stage, cables)
    moments = [Play(moving).strands(phase) for phase in _PHASES]
    while True:
        play = Play(moving, tuple(_reaches(rng, stage, moments[0], ("hand", "hand"))))
        if _most_hidden(play, moments, stage.size) <= MAX_IN_HANDS:
            return play


def touching(rng: np.random.Generator, stage: Stage, cables: int) -> Play:
    """Return two cables; the second comes up to the first, lies along it for a while, touching, and parts again."""
    assert cables == 2  # `tracking.CASTS` says so
    for _ in range(_ATTEMPTS):
        (first,) = _free(rng, stage, 1, most_px=4.0, travel=(0.04, 0.04))
        second = _beside(rng, stage, first)
        if all(_inside(second(phase), stage) for phase in _PHASES[::3]):
            break
    return Play((first, second))


def leaving(rng: np.random.Generator, stage: Stage, cables: int) -> Play:
    """Return cables of which the first leaves the image, wholly or in part, and comes back, and the second likewise."""
    sides = rng.permutation(4)
    wholly = bool(rng.random() < 0.5)
    out = [_out(rng, stage, int(sides[i]), wholly == (i == 0)) for i in range(min(cables, 2))]
    return Play((*_free(rng, stage, cables - len(out), most_px=8.0), *out))


def ends_pass(rng: np.random.Generator, stage: Stage, cables: int) -> Play:
    """Return a cable that closes to a ring until its ends have slid past each other, a few widths apart, and opens."""
    assert cables == 1  # `tracking.CASTS` says so
    k, gap_px = stage.scale, float(rng.uniform(1.7, 3.0)) * stage.width_px
    length, least, most = float(rng.uniform(780.0, 900.0)) * k, rng.uniform(0.87, 0.9), rng.uniform(1.04, 1.06)
    sway, side, turn = Sway.draw(rng, 2, 0.06, 0.05), rng.choice((-1.0, 1.0)), rng.uniform(0.0, 2.0 * math.pi)
    back = (0.52, 1.0) if rng.random() < 0.5 else (1.5, 2.0)

    def spiral(tightening: float) -> Heading:
        def heading(along: FloatArray, phase: float) -> FloatArray:
            turns = least + (most - least) * window(phase, (0.04, 0.52), back)
            bent = side * 2.0 * math.pi * turns * (along + tightening * (along * along - along))
            return turn + 0.4 * phase + bent + sway(along, phase)

        return heading

    tightening = 0.0
    while _end_gap(spiral(tightening), length) < gap_px:
        tightening += 0.01
    travel = (float(rng.uniform(-0.08, 0.08)) * stage.size[1], 0.0)
    motion = fit_motion(spiral(tightening), stage.box, length, stage.width_px, travel, lambda phase: phase)
    return Play((motion.strand,))


def loop_opens(rng: np.random.Generator, stage: Stage, cables: int) -> Play:
    """Return a cable with a loop that opens: swung open, or run off its end."""
    assert cables == 1  # `tracking.CASTS` says so
    swung, mirrored, turned = bool(rng.random() < 0.5), bool(rng.random() < 0.5), rng.choice((0.0, math.pi))
    inner, first, last, length = (looping(rng), 0.6, 0.91, 850.0) if swung else (untying(rng), 0.5, 0.995, 1000.0)
    sign = -1.0 if mirrored else 1.0

    def heading(along: FloatArray, phase: float) -> FloatArray:
        return turned + sign * inner(along, phase)

    motion = fit_motion(heading, stage.box, length * stage.scale, stage.width_px)
    return Play((lambda phase: motion.strand(first + (last - first) * phase),))


def hidden(rng: np.random.Generator, stage: Stage, cables: int) -> Play:
    """Return short cables; a disc grows over one of them until nothing of it is seen for a while, and shrinks again."""
    moving = _free(rng, stage, cables, length_px=420.0, most_px=8.0)
    number = int(rng.integers(cables))
    rise = float(rng.uniform(0.2, 0.3))
    dark = float(rng.uniform(5.0, 9.0)) / FRAMES
    radius = 1.04 * max(
        float(np.linalg.norm(strand.points - middle(strand), axis=1).max()) for strand in map(moving[number], _PHASES)
    )
    lid = Lid(number, radius + stage.width_px, (rise, rise + 0.15), (rise + 0.15 + dark, rise + 0.3 + dark))
    return Play(moving, (lid,))


def _free(
    rng: np.random.Generator,
    stage: Stage,
    cables: int,
    *,
    length_px: float = 680.0,
    most_px: float = MAX_PX,
    travel: tuple[float, float] = (0.2, 0.2),
) -> tuple[Moving, ...]:
    """Return cables that stay inside, evenly spread in direction so that they cross rather than cover each other."""
    lean = rng.uniform(0.0, 2.0 * math.pi)
    return tuple(
        _paced(
            rng,
            stage,
            tilted(drifting(rng), math.pi * (number + rng.uniform(-0.2, 0.2)) / cables + lean),
            _part_of(rng, stage.box) if cables > 1 else stage.box,
            (length_px, most_px),
            travel,
        )
        for number in range(cables)
    )


def _part_of(rng: np.random.Generator, box: tuple[float, float, float, float]) -> tuple[float, float, float, float]:
    """Draw a box inside of a box, of a little less width and height: the middles of cables are not all in one place."""
    cut_x, cut_y = 0.2 * (box[2] - box[0]), 0.15 * (box[3] - box[1])
    x, y = rng.random(2)
    return box[0] + x * cut_x, box[1] + y * cut_y, box[2] - (1.0 - x) * cut_x, box[3] - (1.0 - y) * cut_y


def _paced(
    rng: np.random.Generator,
    stage: Stage,
    heading: Heading,
    box: tuple[float, float, float, float],
    length_and_most_px: tuple[float, float],
    travel: tuple[float, float],
) -> Moving:
    """Return a cable that moves as fast as it may, at most once to and fro; lengths and speeds are those in HD."""
    length_px, most_px = (stage.scale * value for value in length_and_most_px)
    way = np.multiply(travel, stage.size[::-1]) * rng.choice((-1.0, 1.0), 2)
    motion = fit_motion(
        heading,
        box,
        length_px,
        stage.width_px,
        (float(way[0]), float(way[1])),
        lambda phase: 0.5 - 0.5 * math.cos(2.0 * math.pi * phase),
    )
    start = float(rng.random())
    moments = np.array([motion.strand(phase).points[::40] for phase in _PHASES])
    fastest = float(np.linalg.norm(np.diff(moments, axis=0), axis=2).max()) * (len(_PHASES) - 1) / FRAMES
    rate = min(1.0, most_px / fastest)
    return lambda phase: motion.strand((start + rate * phase) % 1.0)


def _reaches(
    rng: np.random.Generator, stage: Stage, strands: Sequence[Strand], shapes: tuple[CoverShape, CoverShape]
) -> list[Reach]:
    """Draw occluders of either shape for half of the cables: each moves along a part of one, or off one of its ends."""
    reaches = []
    for cable in rng.permutation(len(strands))[: (len(strands) + 1) // 2].tolist():
        start, stop = rng.uniform(0.1, 0.4), rng.uniform(0.6, 1.05)
        along = (start, stop) if rng.random() < 0.5 else (1.0 - start, 1.0 - stop)
        radius = float(rng.uniform(0.08, 0.15)) * strands[cable].length
        shape = shapes[0] if rng.random() < 0.5 else shapes[1]
        direction = float(rng.uniform(0.0, 2.0 * math.pi))
        reaches.append(Reach(cable, along, direction, radius, shape, _FAR_PX * stage.scale / 4.0))
    return reaches


def _most_hidden(play: Play, moments: Sequence[Sequence[Strand]], size: Size) -> float:
    """Return the largest share of a cable that is covered, at the phases `_PHASES` of the moments."""
    most = 0.0
    for phase, strands in zip(_PHASES, moments, strict=True):
        covered = play.covered(phase, strands, size)
        for strand in strands:
            columns, rows = np.rint(strand.points[::8]).astype(np.intp).T
            most = max(most, float(covered[rows, columns].mean()))
    return most


def _beside(rng: np.random.Generator, stage: Stage, first: Moving) -> Moving:
    """Return a cable that lies along a stretch of another one for a while."""
    k, side = stage.scale, float(rng.choice((-1.0, 1.0)))
    stretch, ends = float(rng.uniform(90.0, 240.0)) * k, rng.uniform(150.0, 250.0, 2) * k
    place, turns, spread = rng.uniform(0.25, 0.75), side * rng.uniform(0.5, 1.0, 2), rng.uniform(90.0, 140.0) * k
    close, far = float(rng.uniform(0.9, 1.0)) * stage.width_px, float(rng.uniform(5.0, 8.0)) * stage.width_px

    def leave(length: float, turn: float, bend: float) -> FloatArray:
        arc = np.arange(1.0, round(length / _SAMPLE_PX)) * _SAMPLE_PX
        fade = 40.0 * k
        return bend * fade * (1.0 - np.exp(-arc / fade)) + turn * smoothstep(arc / spread)

    def moving(phase: float) -> Strand:
        other = first(phase)
        count = round(stretch / other.spacing)
        start = round(place * (len(other.points) - count - 1))
        middle = other.heading[start : start + count + 1]
        # Backwards from the stretch the heading falls where ahead it rises: both ways lead to the same side.
        behind = leave(ends[0], turns[0], float(other.bending[start]))
        ahead = leave(ends[1], turns[1], float(other.bending[start + count]))
        heading = np.concatenate((middle[0] - behind[::-1], middle, middle[-1] + ahead))
        strand = integrate(heading, _SAMPLE_PX * (len(heading) - 1))
        at = start + count // 2
        normal = np.array([-other.tangents[at, 1], other.tangents[at, 0]])
        distance = far + (close - far) * window(phase, (0.1, 0.4), (0.6, 0.9))
        beside = other.points[at] + side * distance * normal
        return strand.moved(beside - strand.points[len(behind) + count // 2])

    return moving


def _out(rng: np.random.Generator, stage: Stage, side: int, wholly: bool) -> Moving:
    """Return a cable that moves over a border of the image, 0 to 3 for left, top, right and bottom, and comes back."""
    height, width = stage.size
    outward = np.array([(-1.0, 0.0), (0.0, -1.0), (1.0, 0.0), (0.0, 1.0)][side])
    away = _OUT_PX * stage.scale
    edge = 0.75 * stage.width_px
    # What leaves wholly lies in a strip along the border, as deep as it moves but for its width.
    depth = away - 2.5 * stage.width_px if wholly else 0.75 * min(stage.size)
    left, top, right, bottom = stage.box
    boxes = (
        (edge, top, edge + depth, bottom),
        (left, edge, right, edge + depth),
        (width - edge - depth, top, width - edge, bottom),
        (left, height - edge - depth, right, height - edge),
    )
    across = math.atan2(outward[1], outward[0])
    angle = across + (math.pi / 2.0 if wholly else rng.uniform(-0.5, 0.5)) + (math.pi if rng.random() < 0.5 else 0.0)
    sway = Sway.draw(rng, 3, 0.25, 0.12)
    length = (450.0, 2.0) if wholly else (float(rng.uniform(260.0, 420.0)), 2.0)
    calm = _paced(rng, stage, tilted(sway, angle), boxes[side], length, (0.02, 0.02))
    delay = float(rng.uniform(0.0, 0.06))

    def moving(phase: float) -> Strand:
        return calm(phase).moved(away * window(phase, (0.06 + delay, 0.46 + delay), (0.5 + delay, 0.92)) * outward)

    return moving


def _end_gap(heading: Heading, length_px: float) -> float:
    """Return how near either end of a cable comes to its other half, px."""
    along = np.linspace(0.0, 1.0, 201)
    nearest = math.inf
    for phase in _PHASES:
        points = integrate(heading(along, phase), length_px).points
        for end, rest in ((points[0], points[100:]), (points[-1], points[:101])):
            nearest = min(nearest, float(np.linalg.norm(rest - end, axis=1).min()))
    return nearest


def _inside(strand: Strand, stage: Stage) -> bool:
    room = np.array(stage.size[::-1]) - 1.0 - stage.width_px
    return bool((strand.points >= stage.width_px).all() and (strand.points <= room).all())
