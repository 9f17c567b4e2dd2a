"""Drawings of hard cases with one or two cables: sharp bends, ends that face each other, junctions, borders."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import make_interp_spline

from dloftbs.data.curve import BSplineCurve
from dloftbs.support.arrays import FloatArray
from dloftbs_lab.synthetic.free_ends import END_STYLES, ROUND, EndStyle, FreeEnd
from dloftbs_lab.synthetic.space_axis import curve_through_samples
from dloftbs_lab.synthetic.strand import Strand, integrate

_SAMPLE_PX = 0.5
_MARGIN_PX = 10.0
_GAP_PX = (36.0, 150.0)
_BREAK_WIDTHS = (0.5, 4.0)  # length of a break of the mask
_PIECE_WIDTHS = 5.0  # least length of a piece between two breaks
_CLOSEST_WIDTHS = 2.0  # distance of two ends with ground in sight between them, at least
_NEAR_WIDTHS = (1.5, 8.0)  # distance of two tips
_OUTSIDE_PX = 60.0  # how far a cable goes on beyond the border
_RING_POINTS = 64
_WIDENING = (1.2, 3.5)
_TURNING = 4.0  # of a cable that turns about, radians at most


@dataclass(frozen=True, eq=False)
class Drawn:
    """A cable of a drawing.

    Parameters
    ----------
    points : numpy.ndarray, shape (n, 2)
        Along its centre line, px; of a ring the last is the first again.
    ends : (FreeEnd, FreeEnd)
    corner : int, optional
        Index of the point that is a corner between straight arms.
    ring : bool
        Whether it is a loop without ends.
    gaps : tuple of (int, int, FreeEnd, FreeEnd)
        Points between which the mask is broken, and the look of the ends there.
    widening : float
        Width at the last point over that at the first, of a cable that comes near the camera.
    """

    points: FloatArray
    ends: tuple[FreeEnd, FreeEnd] = (ROUND, ROUND)
    corner: int | None = None
    ring: bool = False
    gaps: tuple[tuple[int, int, FreeEnd, FreeEnd], ...] = ()
    widening: float = 1.0

    @property
    def pieces(self) -> list[tuple[FloatArray, FloatArray, tuple[FreeEnd, FreeEnd]]]:
        """The points of each piece of the mask, its width over that at the first point, and the look of its ends."""
        widths = np.linspace(1.0, self.widening, len(self.points))
        starts = [(0, self.ends[0]), *((stop, end) for _, stop, _, end in self.gaps)]
        stops = [*((start, end) for start, _, end, _ in self.gaps), (len(self.points), self.ends[1])]
        return [
            (self.points[a:b], widths[a:b], (first, last)) for (a, first), (b, last) in zip(starts, stops, strict=True)
        ]

    def curve(self) -> BSplineCurve:
        """Return the centre line."""
        if self.ring:
            u = np.linspace(0.0, 1.0, _RING_POINTS + 1)
            picks = (u * (len(self.points) - 1)).round().astype(np.intp)
            spline = make_interp_spline(u, self.points[picks], k=3, bc_type="periodic")
            return BSplineCurve(spline.t, spline.c, closed=True)
        if self.corner is None:
            return curve_through_samples(self.points)
        bend = self.corner / (len(self.points) - 1)
        return BSplineCurve([0.0, 0.0, bend, 1.0, 1.0], self.points[[0, self.corner, -1]], 1)


@dataclass(frozen=True)
class Sheet:
    """Sheet to draw on: its size (H, W) px, and the width of the cables."""

    size: tuple[int, int]
    width_px: float

    @property
    def side(self) -> float:
        """The shorter side less a margin, px, but not more than that of an image of 640 x 480."""
        return min(*self.size, 480) - 2.0 * (_MARGIN_PX + self.width_px)

    def place(self, rng: np.random.Generator, parts: Sequence[FloatArray]) -> list[FloatArray]:
        """Return points (n, 2) of each part, all moved together to where they fit."""
        every = np.concatenate(parts)
        margin = _MARGIN_PX + 1.5 * self.width_px
        low, high = every.min(axis=0), every.max(axis=0)
        room = np.array(self.size[::-1]) - 1.0 - 2.0 * margin - (high - low)
        # What is larger than the room is centred.
        shift = margin - low + np.where(room > 0.0, rng.random(2), 0.5) * room
        return [points + shift for points in parts]


def bend(rng: np.random.Generator, sheet: Sheet, angle: float, turn: float) -> list[Drawn]:
    """Return a cable of two straight arms with an inside angle, radians, turned by an angle."""
    arms = sheet.side * rng.uniform(0.35, 0.6, 2)
    counts = np.ceil(arms / _SAMPLE_PX).astype(int)
    # The same spacing on both arms, so that the corner lies where its index says.
    first, last = (
        np.outer(np.arange(1, n + 1) * _SAMPLE_PX, (math.cos(a), math.sin(a)))
        for n, a in zip(counts, (turn, turn + angle), strict=True)
    )
    (points,) = sheet.place(rng, [np.concatenate((first[::-1], np.zeros((1, 2)), last))])
    # Frayed and tapered ends are off by more than what is left for the corner.
    return [Drawn(points, _two(rng, ("flat", "round")), corner=int(counts[0]))]


def facing(rng: np.random.Generator, sheet: Sheet, styles: Sequence[EndStyle]) -> list[Drawn]:
    """Return two cables along one smooth line, with plain ground between the ends that face each other."""
    return _apart(rng, sheet, float(rng.uniform(*_GAP_PX)) * min(1.0, sheet.side / 480.0 + 0.1), styles)


def close(rng: np.random.Generator, sheet: Sheet) -> list[Drawn]:
    """Return two cables along one smooth line, as far from each other as a break of the mask is long."""
    return _apart(rng, sheet, rng.uniform(_CLOSEST_WIDTHS, _BREAK_WIDTHS[1]) * sheet.width_px, ("flat", "round"))


def _apart(rng: np.random.Generator, sheet: Sheet, gap: float, styles: Sequence[EndStyle]) -> list[Drawn]:
    """Return two cables along one smooth line, whose ends are some pixels apart."""
    lengths = sheet.side * rng.uniform(0.25, 0.4, 2)
    line = _line(rng, float(lengths.sum()) + gap, 0.5)
    first, second = (round(float(value) / _SAMPLE_PX) for value in (lengths[0], lengths[0] + gap))
    facing_ends = _two(rng, styles)
    one, other = sheet.place(rng, [line.points[: first + 1], line.points[second:]])
    return [Drawn(one, (FreeEnd.draw(rng), facing_ends[0])), Drawn(other, (facing_ends[1], FreeEnd.draw(rng)))]


def nearby(rng: np.random.Generator, sheet: Sheet) -> list[Drawn]:
    """Return two cables whose ends lie near each other by chance, and lead elsewhere."""
    lengths = sheet.side * rng.uniform(0.25, 0.4, 2)
    one, other = (_line(rng, float(length), 0.5) for length in lengths)
    side = rng.choice((-1.0, 1.0))
    ahead = one.heading[-1] + side * rng.uniform(-0.5, 1.0)
    away = one.heading[-1] + side * rng.uniform(1.2, 2.2) - other.heading[0]
    cos, sin = math.cos(away), math.sin(away)
    start = one.points[-1] + rng.uniform(*_NEAR_WIDTHS) * sheet.width_px * np.array([math.cos(ahead), math.sin(ahead)])
    parts = sheet.place(rng, [one.points, start + other.points @ np.array([[cos, sin], [-sin, cos]])])
    return [Drawn(points, _two(rng)) for points in parts]


def broken(rng: np.random.Generator, sheet: Sheet) -> list[Drawn]:
    """Return a cable whose mask is broken in one to four places, as colour ranges and networks break it."""
    line = _line(rng, sheet.side * rng.uniform(0.7, 1.0), 0.8)
    width = sheet.width_px / _SAMPLE_PX
    fit = int((len(line.points) / width - _PIECE_WIDTHS) / (_BREAK_WIDTHS[1] + _PIECE_WIDTHS))
    count = min(int(rng.integers(1, 5)), max(fit, 1))
    longest = min(_BREAK_WIDTHS[1] * width, len(line.points) / 3.0)  # some sheets are small
    room = (len(line.points) - count * longest) / (count + 1)
    slack = max(room - _PIECE_WIDTHS * width, 0.0)
    gaps = []
    for number in range(count):
        length = min(rng.uniform(*_BREAK_WIDTHS) * width, longest)
        start = (number + 1) * room + number * longest + rng.uniform(-0.5, 0.5) * slack
        gaps.append((round(start), round(start + length), *_two(rng, ("flat", "round", "tapered"))))
    (points,) = sheet.place(rng, [line.points])
    return [Drawn(points, _two(rng), gaps=tuple(gaps))]


def junction(rng: np.random.Generator, sheet: Sheet, angles: tuple[float, float]) -> list[Drawn]:
    """Return a cable that ends under another one, at an angle between two to it, radians."""
    across = _line(rng, sheet.side * rng.uniform(0.7, 1.0), 0.3)
    at = int(rng.uniform(0.35, 0.65) * (len(across.points) - 1))
    stem = _line(rng, sheet.side * rng.uniform(0.35, 0.6), 0.3)
    turned = float(across.heading[at] + rng.choice((-1.0, 1.0)) * rng.uniform(*angles) - stem.heading[0])
    cos, sin = math.cos(turned), math.sin(turned)
    branch = across.points[at] + stem.points @ np.array([[cos, sin], [-sin, cos]])
    below, above = sheet.place(rng, [branch, across.points])
    return [Drawn(below, (ROUND, FreeEnd.draw(rng))), Drawn(above, _two(rng))]


def parallel(rng: np.random.Generator, sheet: Sheet) -> list[Drawn]:
    """Return two cables side by side, a few pixels to two widths of ground between them."""
    line = _line(rng, sheet.side, 0.8)
    apart = sheet.width_px + rng.uniform(3.0, 3.0 + 2.0 * sheet.width_px)
    normal = np.stack((-line.tangents[:, 1], line.tangents[:, 0]), axis=1)
    cut = rng.integers(0, len(line.points) // 8, 4)
    sides = [
        (line.points + sign * apart / 2.0 * normal)[cut[2 * i] : len(line.points) - cut[2 * i + 1]]
        for i, sign in enumerate((-1.0, 1.0))
    ]
    return [Drawn(points, _two(rng)) for points in sheet.place(rng, sides)]


def border(rng: np.random.Generator, sheet: Sheet) -> list[Drawn]:
    """Return two cables that leave the image close together, as if they were one that turns round outside."""
    apart = sheet.width_px + rng.uniform(3.0, 6.0 * sheet.width_px)
    out = math.ceil(_OUTSIDE_PX / _SAMPLE_PX)
    parts = []
    for sign in (-1.0, 1.0):
        # The border is the line x = 0; cables go inwards and away from each other.
        length, slant, bent = sheet.side * rng.uniform(0.4, 0.6), rng.uniform(0.0, 0.9), rng.uniform(0.0, 0.5)
        along = np.linspace(0.0, 1.0, math.ceil(length / _SAMPLE_PX) + 1)
        inside = integrate(sign * (slant + bent * along), length).points + np.array([0.0, sign * apart / 2.0])
        outside = inside[0] + np.outer(np.arange(-out, 0) * _SAMPLE_PX, (1.0, 0.0))
        parts.append(np.concatenate((outside, inside)))
    height, width = sheet.size
    side = int(rng.integers(4))
    wide = width if side % 2 else height
    reach = float(np.abs(np.concatenate(parts)[:, 1]).max()) + _MARGIN_PX + sheet.width_px
    place = rng.uniform(min(reach, wide / 2.0), max(wide - reach, wide / 2.0))
    drawn = []
    for x, y in (points.T for points in parts):
        columns, rows = ((x, y + place), (y + place, x), (width - 1 - x, y + place), (y + place, height - 1 - x))[side]
        drawn.append(Drawn(np.column_stack((columns, rows)), (ROUND, FreeEnd.draw(rng))))
    return drawn


def crossed_ring(rng: np.random.Generator, sheet: Sheet) -> list[Drawn]:
    """Return a ring and a straight cable across it, either on top."""
    radius = sheet.side * rng.uniform(0.18, 0.3)
    angle = np.linspace(0.0, 2.0 * math.pi, math.ceil(2.0 * math.pi * radius / _SAMPLE_PX) + 1)
    wave = 1.0 + rng.uniform(0.0, 0.12) * np.cos(2.0 * angle + rng.uniform(0.0, 2.0 * math.pi))
    ring = radius * wave[:, None] * np.stack((np.cos(angle), np.sin(angle)), axis=1)
    ring[-1] = ring[0]
    turn, off = rng.uniform(0.0, 2.0 * math.pi), rng.uniform(-0.6, 0.6) * radius
    way = np.array([math.cos(turn), math.sin(turn)])
    reach = radius + sheet.side * rng.uniform(0.1, 0.18)
    arc = np.arange(-reach, reach, _SAMPLE_PX)
    straight = np.outer(arc, way) + off * np.array([-way[1], way[0]])
    ring, straight = sheet.place(rng, [ring, straight])
    drawn = [Drawn(ring, ring=True), Drawn(straight, _two(rng))]
    return drawn if rng.random() < 0.5 else drawn[::-1]


def frayed(rng: np.random.Generator, sheet: Sheet) -> list[Drawn]:
    """Return a cable that turns about and comes near the camera with a frayed end."""
    widening = float(rng.uniform(*_WIDENING))
    line = _line(rng, sheet.side * rng.uniform(0.8, 1.6), _TURNING)
    (points,) = replace(sheet, width_px=widening * sheet.width_px).place(rng, [line.points])
    return [Drawn(points, (FreeEnd.draw(rng), FreeEnd.draw(rng, "frayed")), widening=widening)]


def _line(rng: np.random.Generator, length_px: float, bending: float) -> Strand:
    """Draw a smooth line from the origin in any direction, whose heading changes by some radians at most."""
    along = np.linspace(0.0, 1.0, math.ceil(length_px / _SAMPLE_PX) + 1)
    arc, wave = rng.uniform(-bending, bending), rng.uniform(-0.3, 0.3) * bending
    heading = rng.uniform(0.0, 2.0 * math.pi) + arc * along + wave * np.cos(2.0 * math.pi * along)
    return integrate(heading, length_px)


def _two(rng: np.random.Generator, styles: Sequence[EndStyle] = END_STYLES) -> tuple[FreeEnd, FreeEnd]:
    first, last = (FreeEnd.draw(rng, styles[int(rng.integers(len(styles)))]) for _ in range(2))
    return first, last
