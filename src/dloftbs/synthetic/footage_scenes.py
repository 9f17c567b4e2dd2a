"""Scenes of the suite of real footage: what lies there at each moment, and what is wrong with its mask."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from dloftbs._arrays import FloatArray
from dloftbs.synthetic import footage_faults as faults
from dloftbs.synthetic.footage_faults import Cable, Highlight, Image, Mask, Size
from dloftbs.synthetic.generated import proportion
from dloftbs.synthetic.headings import calm, drifting
from dloftbs.synthetic.motion import Heading, Motion, fit_motion, smoothstep
from dloftbs.synthetic.strand import Strand, integrate
from dloftbs.synthetic.edge_cases import paint_picture

_CYCLE = 10.0
"""Times the length of a sequence that a cable's whole motion takes: 4 s."""
_LEAST_WIDTH_PX = 9.0
"""Of a thick cable in a small image: fringes, highlights and rims of a pixel each need the room."""
_STEP_PX = 0.5
_JUNK, _JUNK_PX = 40, (5.0, 15.0)
_SALT = 300
_PINHOLES = 700

Rng = np.random.Generator


@dataclass(frozen=True, eq=False)
class Shot:
    """One moment: the cables, the lowest first, the mask (H, W) that is left of them, and a picture (H, W, 3) or None."""

    cables: tuple[Cable, ...]
    mask: Mask
    image: Image | None = None


Scene = Callable[[float, Rng], Shot]
"""The moment at a phase of the sequence, 0 to 1, with the random numbers of the frame."""
MakeScene = Callable[[Rng, Size, int], Scene]
"""A scene by the random numbers of the sequence, the size of its frames and its number within the family."""


def video_edge(rng: Rng, size: Size, number: int) -> Scene:
    """A cable in a coded video."""
    del number
    cable, seed = _moving(rng, size, calm(rng), (14.0, 26.0)), int(rng.integers(2**31))

    def scene(phase: float, noise: Rng) -> Shot:
        cables = (cable(phase),)
        return Shot(cables, faults.filmed(noise, np.random.default_rng(seed), cables, size))

    return scene


def video_crossing(rng: Rng, size: Size, number: int) -> Scene:
    """Two cables of one colour that cross in a coded video."""
    del number
    tilt, width = float(rng.uniform(0.35, 0.7)), float(rng.uniform(12.0, 22.0))
    pair = [_moving(rng, size, _tilted(calm(rng), side * tilt), (width, width), 800.0) for side in (-1.0, 1.0)]
    seed = int(rng.integers(2**31))

    def scene(phase: float, noise: Rng) -> Shot:
        cables = tuple(cable(phase) for cable in pair)
        return Shot(cables, faults.filmed(noise, np.random.default_rng(seed), cables, size))

    return scene


def highlight_inside(rng: Rng, size: Size, number: int) -> Scene:
    """A glossy cable: one long hole, rows of pin-holes, or two to three holes side by side, in turn."""
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
    """A glossy cable that leaves the image, with a highlight that does so too."""
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
    """A glossy cable with a highlight that runs out of one side of it."""
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
    """A highlight in one part of a cable, with hundreds of pin-holes in another, salt, and thin junk at the border."""
    cable = _moving(rng, size, calm(rng), (18.0, 36.0))
    middle, half = float(rng.uniform(-0.12, 0.12)), float(rng.uniform(0.08, 0.15))
    junk, seed = number % 2 == 1, int(rng.integers(2**31))

    def scene(phase: float, noise: Rng) -> Shot:
        one = cable(phase)
        mask, length = _tube(one, size), one.strand.length
        Highlight((0.1 * length, 0.45 * length), (middle, middle), half).cut(mask, one, noise)
        faults.pierce(mask, one, (0.6 * length, 0.95 * length), noise, _PINHOLES)
        faults.sprinkle(mask, noise, _SALT, (1, 2), True)
        if junk:
            _strip(mask, np.random.default_rng(seed))
        return Shot((one,), mask)

    return scene


def dashes(rng: Rng, size: Size, number: int) -> Scene:
    """Thin lines of 1 to 2 px, broken into dashes; straight or gently curved, every other sequence with salt."""
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
    """A worm of 65 x 6 px that swims between specks."""
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
    """A cable whose edges change from frame to frame by up to a third of its width, smooth or rough in turn."""
    cable = _moving(rng, size, calm(rng), (12.0, 30.0))
    roughness = 3.0 if number % 2 else 20.0

    def scene(phase: float, noise: Rng) -> Shot:
        one = cable(phase)
        return Shot((one,), faults.ragged(noise, one, 1.0 / 3.0, roughness, size))

    return scene


def coils(rng: Rng, size: Size, number: int) -> Scene:
    """A worm that coils up to a lump, in which nobody sees its course, and stretches again."""
    del number
    angle, most = float(rng.uniform(0.0, 2.0 * math.pi)), float(rng.uniform(1.7, 2.3))
    length, width = float(rng.uniform(90.0, 130.0)), float(rng.uniform(7.0, 9.0))

    def scene(phase: float, noise: Rng) -> Shot:
        del noise
        bent = 1.0 - float(smoothstep(np.abs(np.array(2.0 * phase - 1.0))))
        along = np.linspace(0.0, 1.0, 401)
        # A spiral: the outer end turns more slowly.
        heading = angle + 2.0 * math.pi * most * bent * (along + 0.25 * along * along) / 1.25
        strand = integrate(heading, length)
        one = Cable(strand.moved(np.array(size[::-1]) / 2.0 - strand.points.mean(axis=0)), width)
        mask = _tube(one, size)
        return Shot((one,), faults.lump(mask) if most * bent > 0.9 else mask)

    return scene


def rings(rng: Rng, size: Size, number: int) -> Scene:
    """Two interlocked rings, or a ring with a cable across it, in turn."""
    width = max(5.0, float(rng.uniform(8.0, 16.0)) * proportion(size))
    radius = float(rng.uniform(0.18, 0.26)) * min(size)
    middle, turn = np.array(size[::-1]) / 2.0, float(rng.uniform(0.0, 2.0 * math.pi))
    way = np.array((math.cos(turn), math.sin(turn)))
    other, waves = float(rng.uniform(0.8, 1.1)) * radius, rng.uniform(0.0, 0.08, 2)
    off = float(rng.uniform(-0.5, 0.5)) * radius

    def scene(phase: float, noise: Rng) -> Shot:
        del noise
        swing = radius * (0.05 * math.sin(2.0 * math.pi * phase))
        if number % 2:
            line = integrate(np.full(401, turn), 3.2 * radius)
            across = line.moved(middle - line.points.mean(axis=0) + (off + swing) * np.array((-way[1], way[0])))
            cables = (_ring(middle, radius, waves[0], width), Cable(across, width))
        else:
            apart = 0.55 * (radius + other) + swing
            cables = (
                _ring(middle - 0.5 * apart * way, radius, waves[0], width),
                _ring(middle + 0.5 * apart * way, other, waves[1], width),
            )
        return Shot(cables, np.logical_or.reduce(faults.visible_masks(cables, size)))

    return scene


def two_colours(rng: Rng, size: Size, number: int) -> Scene:
    """Two wires of different colours along one line, with ground between their ends; with a picture."""
    del number
    cable, gap = _moving(rng, size, calm(rng), (10.0, 20.0)), float(rng.uniform(2.0, 4.0))
    seed, first = int(rng.integers(2**31)), float(rng.uniform(0.35, 0.65))

    def scene(phase: float, noise: Rng) -> Shot:
        del noise
        whole = cable(phase)
        count, free = len(whole.strand.points), gap * whole.width_px / whole.strand.spacing
        stop = round(first * count)
        parts = _part(whole, 0, stop), _part(whole, stop + round(free), count)
        masks = faults.visible_masks(parts, size)
        look = np.random.default_rng(seed)
        # One picture of each wire, on the same ground: the hues of `paint_picture` are drawn evenly.
        return Shot(parts, np.logical_or(*masks), _two_dyes(look, masks))

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
    """Return a cable that moves slowly, by the phase of the sequence; with `out` its last end is outside of the image."""
    k = proportion(size)
    width = max(_LEAST_WIDTH_PX, float(rng.uniform(*widths_px)) * k)
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


def _tilted(heading: Heading, angle: float) -> Heading:
    return lambda along, phase: heading(along, phase) + angle


def _tube(cable: Cable, size: Size) -> Mask:
    return faults.visible_masks((cable,), size)[0].copy()


def _ring(centre: FloatArray, radius_px: float, wave: float, width_px: float) -> Cable:
    """Return a ring, a little oval."""
    turn = np.linspace(0.0, 2.0 * math.pi, math.ceil(2.0 * math.pi * radius_px / _STEP_PX) + 1)
    axes = np.array((1.0 + wave, 1.0 - wave)) * radius_px
    points = centre + axes * np.stack((np.cos(turn), np.sin(turn)), axis=1)
    points[-1] = points[0]
    heading = np.unwrap(np.arctan2(axes[1] * np.cos(turn), -axes[0] * np.sin(turn)))
    # The samples of an oval are not quite evenly spaced: by less than a tenth of the step.
    spacing = float(np.linalg.norm(np.diff(points, axis=0), axis=1).mean())
    return Cable(Strand(points, heading, spacing), width_px, ring=True)


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
    """Draw short thin pieces along the right border of a mask (H, W)."""
    height, width = mask.shape
    for _ in range(_JUNK):
        centre = np.array((width - rng.uniform(2.0, 10.0), rng.uniform(0.0, height)))
        faults.speck(mask, centre, float(rng.uniform(*_JUNK_PX)), float(rng.uniform(1.0, 2.0)), math.pi * float(rng.random()))
