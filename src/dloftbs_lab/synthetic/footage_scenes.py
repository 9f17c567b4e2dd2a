"""Scenes of the suite of real footage: what lies there at each moment, and what is wrong with its mask."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from dloftbs.support.arrays import FloatArray
from dloftbs_lab.synthetic import footage_faults as faults
from dloftbs_lab.synthetic.blemishes import jitter_edges
from dloftbs_lab.synthetic.edge_cases import paint_picture
from dloftbs_lab.synthetic.footage_faults import Cable, Highlight, Image, Mask, Size
from dloftbs_lab.synthetic.generated import proportion
from dloftbs_lab.synthetic.headings import calm, tilted
from dloftbs_lab.synthetic.motion import Heading, Motion, fit_motion
from dloftbs_lab.synthetic.strand import Strand, integrate

_CYCLE = 10.0
"""Times the length of a sequence that a cable's whole motion takes: 4 s."""
_MIN_WIDTH_PX = 9.0
"""Of a thick cable in a small image: fringes, highlights and rims of a pixel each need the room."""
_STEP_PX = 0.5
_JUNK_APART_PX, _JUNK_PX = 28.0, (5.0, 15.0)
_SALT = 300
_COILED = 0.75  # phase from which a worm is coiled up
_APART_WIDTHS = 3.0  # of two cables side by side

_PATCH = (52, 50, 54)
"""Of what lies over a gap, BGR: dark tape."""

Rng = np.random.Generator


@dataclass(frozen=True, eq=False)
class Shot:
    """One moment: the cables, the lowest first, the mask (H, W) left of them, and a picture (H, W, 3) if any."""

    cables: tuple[Cable, ...]
    mask: Mask
    image: Image | None = None


Scene = Callable[[float, Rng], Shot]
"""The moment at a phase of the sequence, 0 to 1, with the random numbers of the frame."""
MakeScene = Callable[[Rng, Size, int], Scene]
"""A scene by the random numbers of the sequence, the size of its frames and its number within the family."""


def video_edge(rng: Rng, size: Size, number: int) -> Scene:
    """Draw a cable in a coded video."""
    del number
    cable, seed = _moving(rng, size, calm(rng), (14.0, 26.0)), int(rng.integers(2**31))

    def scene(phase: float, noise: Rng) -> Shot:
        cables = (cable(phase),)
        return Shot(cables, faults.filmed(noise, np.random.default_rng(seed), cables, size))

    return scene


def video_crossing(rng: Rng, size: Size, number: int) -> Scene:
    """Draw two cables of one colour that cross in a coded video."""
    del number
    tilt, width = float(rng.uniform(0.35, 0.7)), float(rng.uniform(12.0, 22.0))
    pair = [_moving(rng, size, tilted(calm(rng), side * tilt), (width, width), 800.0) for side in (-1.0, 1.0)]
    seed = int(rng.integers(2**31))

    def scene(phase: float, noise: Rng) -> Shot:
        cables = tuple(cable(phase) for cable in pair)
        return Shot(cables, faults.filmed(noise, np.random.default_rng(seed), cables, size))

    return scene


def highlight_inside(rng: Rng, size: Size, number: int) -> Scene:
    """Draw a glossy cable: one long hole, rows of pin-holes, or two to three holes side by side, in turn."""
    cable = _moving(rng, size, calm(rng), (18.0, 40.0))
    lines = (1, 1, int(rng.integers(2, 4)))[number % 3]
    starts, ends = rng.uniform(0.1, 0.35, lines), rng.uniform(0.6, 0.9, lines)
    middles = np.linspace(-0.22, 0.22, lines) if lines > 1 else rng.uniform(-0.15, 0.15, 1)
    half = float(rng.uniform(0.04, 0.07 if lines > 1 else 0.17))

    def scene(phase: float, noise: Rng) -> Shot:
        one = cable(phase)
        mask = _tube(one, size)
        for start, end, middle in zip(starts, ends, middles, strict=True):
            span = (start * one.strand.length, end * one.strand.length)
            Highlight(span, (middle, middle), half, number % 3 == 1).cut(mask, one, noise)
        return Shot((one,), mask)

    return scene


def highlight_at_border(rng: Rng, size: Size, number: int) -> Scene:
    """Draw a glossy cable that leaves the image, with a highlight that does so too."""
    bridged = number % 3 == 2
    cable = _moving(rng, size, calm(rng), (18.0, 40.0), out=True)
    start, middle, half = (float(rng.uniform(*ends)) for ends in ((0.3, 0.6), (-0.15, 0.15), (0.06, 0.16)))

    def scene(phase: float, noise: Rng) -> Shot:
        one = cable(phase)
        mask = _tube(one, size)
        Highlight((start * one.strand.length, one.strand.length), (middle, middle), half, bridged).cut(mask, one, noise)
        return Shot((one,), mask)

    return scene


def highlight_at_side(rng: Rng, size: Size, number: int) -> Scene:
    """Draw a glossy cable with a highlight that runs out of one side of it."""
    del number
    cable = _moving(rng, size, calm(rng), (18.0, 40.0))
    start, length = float(rng.uniform(0.15, 0.4)), float(rng.uniform(0.2, 0.35))
    inside, side = float(rng.uniform(0.0, 0.15)), float(rng.choice((-1.0, 1.0)))
    half = float(rng.uniform(0.06, 0.12))

    def scene(phase: float, noise: Rng) -> Shot:
        one = cable(phase)
        mask = _tube(one, size)
        span = (start * one.strand.length, (start + length) * one.strand.length)
        Highlight(span, (side * inside, side * 0.55), half).cut(mask, one, noise)
        return Shot((one,), mask)

    return scene


def pinholes(rng: Rng, size: Size, number: int) -> Scene:
    """Draw a cable with a highlight, two others with hundreds of pin-holes, salt, and thin junk at the border."""
    cable = _moving(rng, size, calm(rng), (24.0, 36.0))
    middle, half = float(rng.uniform(-0.12, 0.12)), float(rng.uniform(0.08, 0.15))
    junk, seed = number % 2 == 1, int(rng.integers(2**31))

    def scene(phase: float, noise: Rng) -> Shot:
        whole = cable(phase)
        length, apart = whole.strand.length, np.array((0.0, _APART_WIDTHS * whole.width_px))
        cables = tuple(Cable(whole.strand.moved(side * apart), whole.width_px) for side in (-1.0, 0.0, 1.0))
        mask = np.logical_or.reduce(faults.visible_masks(cables, size))
        Highlight((0.1 * length, 0.45 * length), (middle, middle), half).cut(mask, cables[0], noise)
        for other in cables[1:]:
            faults.pierce(mask, other, noise)
        faults.sprinkle(mask, noise, _SALT, (1, 2), True)
        if junk:
            _strip(mask, np.random.default_rng(seed))
        return Shot(cables, mask)

    return scene


def dashes(rng: Rng, size: Size, number: int) -> Scene:
    """Draw thin lines of 1 to 2 px, broken into dashes; straight or gently curved, every other sequence with salt."""
    count, straight, salt = int(rng.integers(1, 5)), number % 3 == 0, 60 * (number % 2)
    width, bend = float(rng.uniform(1.2, 2.0)), 0.0 if straight else float(rng.uniform(-0.5, 0.5))
    tilt, length = float(rng.uniform(-0.3, 0.3)), float(rng.uniform(0.5, 0.8)) * size[1]
    apart = 0.7 * size[0] / (count + 1)
    steps = math.ceil(length / _STEP_PX)
    line = integrate(tilt + bend * np.linspace(-0.5, 0.5, steps), length)
    low = np.array(size[::-1]) / 2.0 - line.points.mean(axis=0) - np.array((0.0, apart * (count - 1) / 2.0))
    drift = rng.uniform(-1.0, 1.0, 2) * np.array((8.0, 6.0))

    def scene(phase: float, noise: Rng) -> Shot:
        places = [low + phase * drift + np.array((0.0, apart * i)) for i in range(count)]
        cables = tuple(Cable(line.moved(place), width) for place in places)
        masks = [faults.dashed(noise, one, (3.0, 15.0), (5.0, 12.0), size) for one in cables]
        mask = np.logical_or.reduce(masks)
        faults.sprinkle(mask, noise, salt, (1, 2), True)
        return Shot(cables, mask)

    return scene


def specks(rng: Rng, size: Size, number: int) -> Scene:
    """Draw a worm of 65 x 6 px that swims between specks."""
    del number
    waves, angle = float(rng.uniform(0.8, 1.2)), float(rng.uniform(0.0, 2.0 * math.pi))
    count = int(rng.integers(4, 9))
    lengths, turns = rng.uniform(2.0, 25.0, count), rng.uniform(0.0, math.pi, count)
    away, around = rng.uniform(16.0, 45.0, count), rng.uniform(0.0, 2.0 * math.pi, count)
    spots = np.stack((away * np.cos(around), away * np.sin(around)), axis=1)
    middle, way = np.array(size[::-1]) / 2.0, 12.0 * np.array((math.cos(angle), math.sin(angle)))

    def scene(phase: float, noise: Rng) -> Shot:
        del noise
        along = np.linspace(0.0, 1.0, 161)
        strand = integrate(angle + 0.8 * np.cos(2.0 * math.pi * (waves * along - phase)), 59.0)
        one = Cable(strand.moved(middle + phase * way - strand.points.mean(axis=0)), 6.0)
        mask = _tube(one, size)
        for spot, length, turn in zip(spots, lengths, turns, strict=True):
            # Specks keep clear of the worm: those that touch it would be a part of it for anybody.
            if np.linalg.norm(one.strand.points - middle - spot, axis=1).min() > 5.0 + length / 2.0:
                faults.speck(mask, middle + spot, length, 2.0, turn)
        return Shot((one,), mask)

    return scene


def ragged(rng: Rng, size: Size, number: int) -> Scene:
    """Draw a cable whose edges change from frame to frame by up to a third of its width, smooth or rough in turn."""
    cable = _moving(rng, size, calm(rng), (12.0, 30.0))
    roughness = 3.0 if number % 2 else 20.0

    def scene(phase: float, noise: Rng) -> Shot:
        one = cable(phase)
        return Shot((one,), faults.ragged(noise, one, 1.0 / 3.0, roughness, size))

    return scene


def coils(rng: Rng, size: Size, number: int) -> Scene:
    """Draw a worm that coils up to a lump, in which nobody sees its course."""
    del number
    angle, most = float(rng.uniform(0.0, 2.0 * math.pi)), float(rng.uniform(1.7, 2.3))
    length, width, tail = (float(rng.uniform(*ends)) for ends in ((90.0, 120.0), (7.0, 9.0), (0.1, 0.4)))
    reach = 0.45 * length * np.array((math.cos(angle), math.sin(angle)))

    def scene(phase: float, noise: Rng) -> Shot:
        del noise
        bent = min(phase / _COILED, 1.0) ** 2  # slow at first, while it is long
        along = np.linspace(0.0, 1.0, 401)
        # A spiral in which the tail does not take part.
        inner = np.minimum(along / (1.0 - tail), 1.0)
        heading = angle + 2.0 * math.pi * most * bent * ((1.0 - 0.25 * inner) * inner / 0.75 - 1.0)
        strand = integrate(heading, length)
        one = Cable(strand.moved(np.array(size[::-1]) / 2.0 + reach - strand.points[-1]), width)
        mask = _tube(one, size)
        return Shot((one,), faults.lump(mask) if most * bent > 0.9 else mask)

    return scene


def rings(rng: Rng, size: Size, number: int) -> Scene:
    """Draw two interlocked rings, or a ring with a cable across it, in turn."""
    width = float(rng.uniform(4.0, 12.0))
    radius = min(float(rng.uniform(4.0, 9.0)) * width, 0.24 * min(size))
    middle, turn = np.array(size[::-1]) / 2.0, float(rng.uniform(0.0, 2.0 * math.pi))
    way = np.array((math.cos(turn), math.sin(turn)))
    other, waves = float(rng.uniform(0.5, 1.1)) * radius, rng.uniform(0.0, 0.2, 2)
    off, near = float(rng.uniform(-0.6, 0.6)) * radius, float(rng.uniform(0.45, 0.8))
    rough_px = 0.8 * (number // 2 % 2)

    def scene(phase: float, noise: Rng) -> Shot:
        swing = radius * (0.05 * math.sin(2.0 * math.pi * phase))
        if number % 2:
            line = integrate(np.full(401, turn), 3.2 * radius)
            across = line.moved(middle - line.points.mean(axis=0) + (off + swing) * np.array((-way[1], way[0])))
            cables = (_ring(middle, radius, waves[0], width), Cable(across, width))
        else:
            apart = max(near * (radius + other), 1.15 * abs(radius - other)) + swing
            cables = (
                _ring(middle - 0.5 * apart * way, radius, waves[0], width),
                _ring(middle + 0.5 * apart * way, other, waves[1], width),
            )
        mask = np.logical_or.reduce(faults.visible_masks(cables, size))
        return Shot(cables, jitter_edges(mask, rough_px, 2.0, noise) if rough_px else mask)

    return scene


def two_colours(rng: Rng, size: Size, number: int) -> Scene:
    """Draw two wires of different colours along one line, with a picture; every other gap is hidden by a patch."""
    cable, gap = _moving(rng, size, calm(rng), (10.0, 20.0)), float(rng.uniform(2.0, 4.0))
    seed, first = int(rng.integers(2**31)), float(rng.uniform(0.35, 0.65))

    def scene(phase: float, noise: Rng) -> Shot:
        del noise
        whole = cable(phase)
        count, free = len(whole.strand.points), gap * whole.width_px / whole.strand.spacing
        stop = round(first * count)
        parts = _part(whole, 0, stop), _part(whole, stop + round(free), count)
        masks = faults.visible_masks(parts, size)
        picture = _two_dyes(np.random.default_rng(seed), masks)
        if number % 2:
            middle = whole.strand.points[stop + round(free / 2.0)]
            rows, columns = np.ogrid[: size[0], : size[1]]
            patch = np.hypot(columns - middle[0], rows - middle[1]) <= 0.5 * gap * whole.width_px
            picture[patch & ~np.logical_or(*masks)] = _PATCH
        return Shot(parts, np.logical_or(*masks), picture)

    return scene


FOOTAGE_SCENES: Mapping[str, MakeScene] = {
    "video edge": video_edge,
    "video crossing": video_crossing,
    "highlight inside": highlight_inside,
    "highlight at the border": highlight_at_border,
    "highlight at the side": highlight_at_side,
    "pin-holes": pinholes,
    "dashes": dashes,
    "specks": specks,
    "ragged edges": ragged,
    "coils": coils,
    "rings": rings,
    "two colours": two_colours,
}


def _moving(
    rng: Rng, size: Size, heading: Heading, widths_px: tuple[float, float], length_px: float = 900.0, out: bool = False
) -> Callable[[float], Cable]:
    """Return a cable that moves slowly, by the phase of the sequence; with `out` its last end is outside the image."""
    k = proportion(size)
    width = max(_MIN_WIDTH_PX, float(rng.uniform(*widths_px)) * k)
    margin = width + 12.0 * k
    box = (margin, margin, size[1] - margin, size[0] - margin)
    motion: Motion = fit_motion(heading, box, length_px * k, width)
    start = float(rng.random())
    shift = np.zeros(2)
    if out:
        last = motion.strand(start).points[-1]
        shift = np.array((size[1] + 3.0 * width - last[0], 0.0))

    def cable(phase: float) -> Cable:
        return Cable(motion.strand(start + phase / _CYCLE).moved(shift), width)

    return cable


def _tube(cable: Cable, size: Size) -> Mask:
    return faults.visible_masks((cable,), size)[0].copy()


def _ring(centre: FloatArray, radius_px: float, wave: float, width_px: float) -> Cable:
    """Return a ring, a little oval."""
    turn = np.linspace(0.0, 2.0 * math.pi, math.ceil(2.0 * math.pi * radius_px / _STEP_PX) + 1)
    axes = np.array((1.0 + wave, 1.0 - wave)) * radius_px
    points = centre + axes * np.stack((np.cos(turn), np.sin(turn)), axis=1)
    points[-1] = points[0]
    heading = np.unwrap(np.arctan2(axes[1] * np.cos(turn), -axes[0] * np.sin(turn)))
    arc = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))))
    even = np.linspace(0.0, arc[-1], len(arc))
    strand = Strand(
        np.stack([np.interp(even, arc, axis) for axis in points.T], axis=1), np.interp(even, arc, heading), even[1]
    )
    return Cable(strand, width_px, ring=True)


def _part(cable: Cable, start: int, stop: int) -> Cable:
    strand = cable.strand
    return Cable(Strand(strand.points[start:stop], strand.heading[start:stop], strand.spacing), cable.width_px)


def _two_dyes(rng: Rng, masks: tuple[Mask, ...]) -> Image:
    """Paint two cables (H, W) of clearly different colours on one ground."""
    picture = paint_picture(rng, np.logical_or.reduce(masks))
    # Channels in another order are another hue, a third of the circle away.
    swapped = picture[..., [2, 0, 1]]
    picture[masks[1]] = swapped[masks[1]]
    return picture


def _strip(mask: Mask, rng: Rng) -> None:
    """Draw short thin pieces, clear of each other, along the right border of a mask (H, W)."""
    height, width = mask.shape
    for y in np.arange(_JUNK_APART_PX / 2.0, height, _JUNK_APART_PX):
        length, across, angle = (float(rng.uniform(*ends)) for ends in (_JUNK_PX, (1.0, 2.0), (0.0, math.pi)))
        faults.speck(mask, np.array((width - 10.0 + rng.uniform(-4.0, 4.0), y)), length, across, angle)
