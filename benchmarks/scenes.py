"""What is timed: masks of cables 12 px wide at 1280 x 720, made from seeds; of other sizes where it is about these."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import cycle

import cv2
import numpy as np
import numpy.typing as npt

from dloftbs_lab.synthetic import TrackingSequence, draw_tube_mask, random_curve

SIZE = (720, 1280)
WIDTH_PX = 12.0
_SWAY = 8
_HOOK, _HOOK_PX = 0.25, 4  # radius by the distance from one to the next, and thickness
Mask = npt.NDArray[np.uint8]


def cables(
    count: int, seed: int = 0, length_px: float = 1500.0, size: tuple[int, int] = SIZE, width_px: float = WIDTH_PX
) -> Mask:
    """Return the mask (H, W), 0 and 255, of `count` cables that lie across each other."""
    rng = np.random.default_rng(seed)
    mask = np.zeros(size, dtype=bool)
    radius_px = 40.0 * size[0] / SIZE[0]
    for _ in range(count):
        mask |= draw_tube_mask(random_curve(rng, length_px, size, min_radius_px=radius_px), width_px, size)
    return mask.astype(np.uint8) * 255


def hooks(count: int, size: tuple[int, int] = SIZE) -> Mask:
    """Return the mask (H, W), 0 and 255, of `count` half circles in rows, none of which touches or faces another."""
    mask = np.zeros(size, dtype=np.uint8)
    columns = math.ceil(math.sqrt(count * size[1] / size[0]))
    cell = size[1] / columns
    for number in range(count):
        row, column = divmod(number, columns)
        centre = round((column + 0.5) * cell), round((row + 0.5) * cell)
        radius = round(_HOOK * cell)
        cv2.ellipse(mask, centre, (radius, radius), 0.0, 90.0, 270.0, 255, _HOOK_PX)
    return mask


def swaying(mask: Mask) -> Iterator[Mask]:
    """Return a mask that moves up and down for ever, by 3 px a frame and 24 px at most."""
    return to_and_fro([_shifted(mask, 3 * step) for step in range(-_SWAY, _SWAY + 1)])


def _shifted(mask: Mask, by: int) -> Mask:
    moved = np.zeros_like(mask)
    moved[max(by, 0) : len(mask) + min(by, 0)] = mask[max(-by, 0) : len(mask) - max(by, 0)]
    return moved


def film(count: int, number: int = 0, frames: int = 60) -> list[Mask]:
    """Return the masks of a sequence of shorter cables that bend and travel freely, by up to 15 px a frame."""
    sequence = TrackingSequence("crossing", count, number, frames)
    return [np.asarray(frame.mask).astype(np.uint8) * 255 for frame in sequence]


def to_and_fro(masks: list[Mask]) -> Iterator[Mask]:
    """Return masks forwards and backwards for ever."""
    return cycle([*masks, *masks[-2:0:-1]])


def photograph(seed: int = 0) -> Mask:
    """Return a frame (720, 1280, 3) of the demo: textured cables on a cluttered table."""
    from dloftbs_lab.synthetic import DemoSequence

    image = DemoSequence(frames=90, seed=seed).frame(40).image
    assert image is not None  # the demo has images
    return image
