"""Cables in layers: who lies over whom at every pixel, and how a braided sleeve looks there."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from dloftbs.support.arrays import FloatArray
from dloftbs_lab.synthetic.sketch import LIGHT, SHADOW_SIDE, Image, halfway
from dloftbs_lab.synthetic.strand import Strand
from dloftbs_lab.synthetic.tube import Footprint, footprint

# How far, in widths, a cable darkens what lies beside and below it.
_CONTACT = 0.55
_HALFWAY = halfway(LIGHT)


@dataclass(frozen=True, eq=False)
class Layer:
    """One pass over each of some pixels, none of them twice.

    Parameters
    ----------
    pixel : numpy.ndarray, shape (m,), intp
        Index into the flattened image.
    cable : numpy.ndarray, shape (m,), intp
    sample : numpy.ndarray, shape (m,), intp
        Nearest sample of that cable's strand.
    arc, offset : numpy.ndarray, shape (m,)
        Distance along and, signed, across that cable, px.
    """

    pixel: npt.NDArray[np.intp]
    cable: npt.NDArray[np.intp]
    sample: npt.NDArray[np.intp]
    arc: FloatArray
    offset: FloatArray


def stack_layers(strands: Sequence[Strand], width_px: float, size: tuple[int, int]) -> list[Layer]:
    """Sort the passes at every pixel from the lowest up: the lower layers come first.

    A later cable lies over an earlier one, and on the same cable the pass further along lies over the one before.
    """
    prints = [footprint(strand, (0.5 + _CONTACT) * width_px, size) for strand in strands]
    pixel = np.concatenate([p.pixel for p in prints])
    cable = np.repeat(np.arange(len(prints)), [len(p.pixel) for p in prints])
    joined = Footprint(
        pixel,
        np.concatenate([p.sample for p in prints]),
        np.concatenate([p.arc for p in prints]),
        np.concatenate([p.offset for p in prints]),
    )
    # Each footprint is sorted by pixel, then arc, so that a stable sort by pixel keeps the order of the heights.
    order = np.argsort(pixel, kind="stable")
    starts = np.flatnonzero(np.diff(pixel[order], prepend=-1))
    rank = np.arange(len(order)) - np.repeat(starts, np.diff(starts, append=len(order)))
    layers = []
    for level in range(int(rank.max(initial=-1)) + 1):
        pick = order[rank == level]
        layers.append(Layer(pixel[pick], cable[pick], joined.sample[pick], joined.arc[pick], joined.offset[pick]))
    return layers


def visible_cables(layers: Sequence[Layer], width_px: float, size: tuple[int, int]) -> npt.NDArray[np.intp]:
    """Return the topmost cable at each pixel, shape (H, W), -1 where there is none."""
    owner = np.full(size[0] * size[1], -1, np.intp)
    for layer in layers:
        inside = np.abs(layer.offset) <= width_px / 2.0
        owner[layer.pixel[inside]] = layer.cable[inside]
    return owner.reshape(size)


def cast_shadow(canvas: Image, strands: Sequence[Strand], width_px: float) -> None:
    """Darken the table `canvas` (H, W, 3) beside the cables."""
    height, width = canvas.shape[:2]
    small = np.zeros(((height + 1) // 2, (width + 1) // 2), np.uint8)
    drop = 0.42 * width_px * SHADOW_SIDE
    for strand in strands:
        # Half resolution, OpenCV's fixed point with four fractional bits.
        points = ((strand.points[::4] + drop) * 8.0).round().astype(np.int32)
        cv2.polylines(small, [points], False, 140, max(1, round(width_px / 2.0)), cv2.LINE_AA, 4)
    soft = cv2.GaussianBlur(small, (0, 0), max(0.22 * width_px, 0.5))
    light = cv2.cvtColor(255 - cv2.resize(soft, (width, height), interpolation=cv2.INTER_LINEAR), cv2.COLOR_GRAY2BGR)
    cv2.multiply(canvas, light, dst=canvas, scale=1.0 / 255.0)


def paint_layers(
    canvas: Image, layers: Sequence[Layer], strands: Sequence[Strand], dyes: Sequence[FloatArray], width_px: float
) -> None:
    """Paint the cables onto `canvas` (H, W, 3), the lowest layer first, each in its dye (3,) BGR."""
    flat = canvas.reshape(-1, 3)
    for layer in layers:
        alpha = np.clip(width_px / 2.0 - np.abs(layer.offset) + 0.5, 0.0, 1.0)
        colour = np.zeros((len(layer.pixel), 3))
        light = np.empty(len(layer.pixel))
        for number, (strand, dye) in enumerate(zip(strands, dyes, strict=True)):
            own = np.flatnonzero(layer.cable == number)
            light[own] = _contact_light(layer.offset[own], strand.tangents[layer.sample[own]], width_px)
            own = own[alpha[own] > 0.0]
            tangent = strand.tangents[layer.sample[own]]
            colour[own] = _sleeve(layer.arc[own], layer.offset[own], tangent, dye, width_px)
        below = flat[layer.pixel] * light[:, None]
        mixed = below + alpha[:, None] * (colour - below)
        flat[layer.pixel] = np.clip(mixed, 0.0, 255.0).round().astype(np.uint8)


def _sleeve(arc: FloatArray, offset: FloatArray, tangent: FloatArray, dye: FloatArray, width_px: float) -> FloatArray:
    """Return the colour (m, 3) of a braided sleeve on a cylinder."""
    q = np.clip(2.0 * offset / width_px, -1.0, 1.0)
    up = np.sqrt(1.0 - q * q)
    side = np.stack((-tangent[:, 1], tangent[:, 0]), axis=1)
    diffuse = np.maximum(q * (side @ LIGHT[:2]) + up * LIGHT[2], 0.0)
    shine = np.maximum(q * (side @ _HALFWAY[:2]) + up * _HALFWAY[2], 0.0) ** 22
    # Seen from above, the angle round the cylinder is compressed towards its edges.
    angle = np.arcsin(q) / math.pi
    turns = arc / (0.62 * width_px)
    braid = np.cos(2.0 * math.pi * (turns + angle)) * np.cos(2.0 * math.pi * (turns - angle))
    tracer = np.cos(2.0 * math.pi * (arc / (2.6 * width_px) + 1.1 * angle))
    light = (0.34 + 0.78 * diffuse) * (1.0 + 0.17 * braid)
    pale = 0.30 * np.clip(4.0 * (tracer - 0.62), 0.0, 1.0)[:, None]
    tint = 0.45 * dye.max() + 0.62 * dye
    surface = dye + pale * (tint - dye)
    return surface * light[:, None] + 46.0 * shine[:, None]


def _contact_light(offset: FloatArray, tangent: FloatArray, width_px: float) -> FloatArray:
    """Return the light (m,) left beside a cable: least right at it, on the side away from the lamp."""
    away = np.sign(offset) * (tangent[:, 0] * SHADOW_SIDE[1] - tangent[:, 1] * SHADOW_SIDE[0])
    beside = np.clip((np.abs(offset) / width_px - 0.5) / _CONTACT, 0.0, 1.0)
    return 1.0 - (0.36 + 0.24 * away) * (1.0 - beside) ** 2
