"""Actors that move over the cables: the grippers that hold the ends, the arms behind them, and a gloved hand."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from dloftbs.support.arrays import BoolArray, FloatArray
from dloftbs_lab.synthetic.sketch import Point, Sketch, Sprite, smooth_noise
from dloftbs_lab.synthetic.strand import Strand

Placed = tuple[Sprite, tuple[float, float], float]
"""A sprite, its position px and its angle."""

_WRIST = 38.0

_BODY = (62.0, 60.0, 58.0)
_JAW = (158.0, 156.0, 150.0)
_SHELL = (206.0, 206.0, 202.0)
_GLOVE = (66.0, 64.0, 62.0)


def hold_ends(
    strand: Strand, tool: tuple[Sprite, Sprite], bases: tuple[FloatArray, FloatArray], scale: float
) -> tuple[list[Placed], list[Placed]]:
    """Place a gripper at each end of a cable, and an arm from there to its base (2,) px; `tool` is gripper and arm."""
    gripper, arm = tool
    grippers: list[Placed] = []
    arms: list[Placed] = []
    ends = ((strand.points[0], strand.heading[0]), (strand.points[-1], strand.heading[-1] + math.pi))
    for (end, angle), base in zip(ends, bases, strict=True):
        wrist = end - _WRIST * scale * np.array([math.cos(angle), math.sin(angle)])
        grippers.append((gripper, pair(end), float(angle)))
        arms.append(place_arm(arm, wrist, base))
    return grippers, arms


def place_arm(arm: Sprite, wrist: FloatArray, base: FloatArray) -> Placed:
    """Place an arm between its wrist and its base, both (2,) px."""
    reach = base - wrist
    return arm, pair(wrist), math.atan2(reach[1], reach[0])


def hidden_by(actors: Sequence[Placed], size: tuple[int, int]) -> BoolArray:
    """Return what the actors hide, shape (H, W)."""
    mask = np.zeros(size, bool)
    for sprite, position, angle in actors:
        sprite.cover(mask, position, angle)
    return mask


def pair(point: FloatArray) -> tuple[float, float]:
    """Return a point (2,) as plain numbers."""
    return float(point[0]), float(point[1])


def draw_gripper(scale: float, width: float) -> Sprite:
    """Draw a parallel gripper that reaches along +x and holds a cable of `width` design px by its end, the origin.

    The jaws stand at both sides of the cable, so that its end is hidden by less than its width.
    """
    s = Sketch(-74.0, -42.0, 44.0, 42.0, scale)
    gap = width / 2.0 + 1.0
    for side in (-1.0, 1.0):
        inner, outer = sorted((side * gap, side * (gap + 11.0)))
        s.bevel(s.box(-12.0, inner, 34.0, outer, 3.0), _JAW, 3.0, 0.5)
        near, far = sorted((side * gap, side * (gap + 4.0)))
        s.bevel(s.box(8.0, near, 32.0, far, 1.0), (52.0, 50.0, 48.0), 1.5, 0.3)
    s.bevel(s.box(-66.0, -34.0, -4.0, 34.0, 8.0), _BODY, 5.0, 0.9)
    s.bevel(s.box(-17.0, -30.0, -9.0, 30.0, 2.0), (92.0, 90.0, 88.0), 2.0, 0.5)
    for side in (-1.0, 1.0):
        s.bevel(s.disc((-13.0, 23.0 * side), 3.0), (150.0, 148.0, 146.0), 2.0, -0.5)
    return s.finish(10.0, 7.0, 0.5)


def draw_arm(scale: float, length: float) -> Sprite:
    """Draw a robot's forearm that runs along +x from the wrist at its origin."""
    s = Sketch(-44.0, -46.0, length, 46.0, scale)
    radius = 25.0 + 8.0 * np.clip(s.x / 500.0, 0.0, 1.0)
    q = np.clip(s.y / radius, -1.0, 1.0)
    shade = 0.38 + 0.62 * np.sqrt(1.0 - 0.96 * q * q)
    s.fill(np.abs(s.y) - radius - np.minimum(s.x, 0.0) * 9.0, np.asarray(_SHELL) * shade[..., None])
    for seam in (58.0, 330.0):
        s.fill(np.maximum(np.abs(s.x - seam) - 1.3, np.abs(s.y) - radius), (84.0, 83.0, 82.0), 0.8)
    s.fill(
        np.maximum(np.abs(s.x - 74.0) - 7.0, np.abs(s.y) - radius), np.asarray((60.0, 168.0, 214.0)) * shade[..., None]
    )
    s.bevel(s.disc((0.0, 0.0), 36.0), _SHELL, 9.0, 0.5)
    s.bevel(s.disc((0.0, 0.0), 24.0), (118.0, 117.0, 115.0), 3.0, -0.4)
    s.bevel(s.disc((0.0, 0.0), 20.0), (178.0, 178.0, 175.0), 4.0, 0.5)
    for turn in np.arange(6) * np.pi / 3.0:
        s.fill(s.disc((14.0 * float(np.cos(turn)), 14.0 * float(np.sin(turn))), 2.0), (70.0, 70.0, 70.0))
    return s.finish(30.0, 14.0, 0.42)


_FINGERS: tuple[tuple[tuple[Point, float], ...], ...] = (
    (((108.0, 20.0), 17.5), ((58.0, 11.0), 14.5), ((24.0, 3.0), 12.5), ((4.0, 0.0), 11.0)),
    (((112.0, -6.0), 17.5), ((80.0, -20.0), 15.5), ((76.0, -33.0), 14.0), ((98.0, -38.0), 12.5)),
    (((120.0, -26.0), 17.0), ((93.0, -42.0), 15.0), ((93.0, -55.0), 13.5), ((114.0, -56.0), 12.0)),
    (((134.0, -42.0), 15.5), ((111.0, -60.0), 13.5), ((113.0, -70.0), 12.0), ((130.0, -69.0), 11.0)),
    (((176.0, 38.0), 20.0), ((134.0, 52.0), 16.0), ((102.0, 46.0), 13.5), ((82.0, 40.0), 11.5)),
)
"""Index finger, the three curled fingers and the thumb: joints and radii from the knuckle to the tip."""

_PALM: tuple[tuple[Point, float], ...] = (
    ((116.0, 14.0), 24.0),
    ((128.0, -12.0), 26.0),
    ((150.0, -20.0), 32.0),
    ((168.0, 4.0), 38.0),
    ((206.0, 0.0), 36.0),
    ((250.0, -4.0), 35.0),
)


def draw_hand(scale: float, rng: np.random.Generator, angle: float) -> Sprite:
    """Draw a gloved hand that points along -x with its index finger, the tip at the origin; paste it at `angle`."""
    s = Sketch(-20.0, -96.0, 560.0, 88.0, scale)
    lumps = [_limb(s, _PALM)] + [_limb(s, finger) for finger in _FINGERS]
    distance, height = _melt(lumps)
    crease = smooth_noise(rng, s.x.shape, (16.0 * scale, 8.0 * scale)) + 0.6 * smooth_noise(
        rng, s.x.shape, (5.0 * scale, 9.0 * scale)
    )
    s.relief(distance, height + 0.3 * crease, _GLOVE, 0.16, angle)
    cuff = np.maximum(s.capsule((226.0, -3.0), (258.0, -5.0), 39.0, 41.0), 220.0 - s.x)
    bulge = np.sqrt(np.maximum(41.0**2 - (s.y + 4.0) ** 2, 0.0)) + 1.4 * np.cos((s.x - 220.0) * 0.5)
    s.relief(cuff, bulge, np.multiply(_GLOVE, 0.85), 0.1, angle)
    sleeve = np.maximum(s.capsule((258.0, -5.0), (580.0, -8.0), 48.0, 66.0), 250.0 - s.x)
    weave = 0.5 * np.sin(s.x * 1.9 + s.y * 1.9) + 0.5 * np.sin(s.x * 1.9 - s.y * 1.9)
    fold = 3.5 * smooth_noise(rng, s.x.shape, (60.0 * scale, 26.0 * scale))
    cloth = np.sqrt(np.maximum(72.0**2 - (s.y + 7.0) ** 2, 0.0)) + fold + 0.18 * weave
    s.relief(sleeve, cloth, (112.0, 108.0, 104.0), 0.0, angle)
    return s.finish(16.0, 11.0, 0.55)


def _limb(s: Sketch, joints: tuple[tuple[Point, float], ...]) -> tuple[FloatArray, FloatArray]:
    """Return distance and height of a chain of tapered round rods."""
    distance = np.full(s.x.shape, np.inf)
    height = np.zeros(s.x.shape)
    for (start, start_radius), (end, end_radius) in pairwise(joints):
        outside = s.capsule(start, end, start_radius, end_radius)
        radius = max(start_radius, end_radius)
        distance = np.minimum(distance, outside)
        inner = np.clip(-outside, 0.0, radius)
        height = np.maximum(height, np.sqrt(inner * (2.0 * radius - inner)))
    return distance, height


def _melt(lumps: list[tuple[FloatArray, FloatArray]], blend: float = 5.0) -> tuple[FloatArray, FloatArray]:
    """Join limbs with soft creases between them: a smooth maximum of the heights."""
    distance = np.minimum.reduce([lump[0] for lump in lumps])
    heights = np.stack([lump[1] for lump in lumps])
    top = heights.max(axis=0)
    height: FloatArray = top + blend * np.log(np.exp((heights - top) / blend).sum(axis=0))
    return distance, height
