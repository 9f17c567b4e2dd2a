"""Faults of masks, drawn from random numbers: wrong pixels, ragged edges, discs and strokes."""

from __future__ import annotations

import math
from collections.abc import Sequence

import cv2
import numpy as np
import numpy.typing as npt

from dloftbs.data.curve import BSplineCurve
from dloftbs.support.arrays import FloatArray
from dloftbs_lab.synthetic.strand import integrate

Mask = npt.NDArray[np.bool_]
Range = tuple[float, float]

_FRACTION_BITS = 4
_SAMPLE_PX = 2.0
_OFF_END = 1.5


def flip_pixels(mask: Mask, share: float, rng: np.random.Generator) -> None:
    """Turn a share of all pixels of `mask` (H, W) into their opposite: salt-and-pepper."""
    chosen = rng.choice(mask.size, round(share * mask.size), replace=False, shuffle=False)
    mask.reshape(-1)[chosen] ^= True


def jitter_edges(mask: Mask, sigma_px: float, correlation_px: float, rng: np.random.Generator) -> Mask:
    """Return `mask` (H, W) with its border moved in and out by a smooth random field."""
    if not mask.any() or mask.all():
        return mask
    inside = cv2.distanceTransform(mask.view(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_5)
    outside = cv2.distanceTransform((~mask).view(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_5)
    # Distances to pixel centres: the border runs halfway between the last pixel inside and the first outside.
    signed = inside - outside + np.where(mask, np.float32(-0.5), np.float32(0.5))
    return np.asarray(signed + smooth_field(mask.shape, sigma_px, correlation_px, rng) > 0.0)


def smooth_field(
    shape: tuple[int, ...], sigma: float, correlation_px: float, rng: np.random.Generator
) -> npt.NDArray[np.float32]:
    """Return normal noise (H, W) whose correlation falls to 1 / e over `correlation_px`."""
    noise = rng.standard_normal(shape, dtype=np.float32)
    # Noise blurred by a Gaussian of deviation s has the correlation exp(-d^2 / (2 s)^2).
    blur = correlation_px / 2.0
    ticks = 2 * math.ceil(4.0 * blur) + 1
    kernel = cv2.getGaussianKernel(ticks, blur, cv2.CV_64F)
    # Two passes, each of which leaves the root of the sum of squares.
    gain = sigma / float((kernel**2).sum())
    return np.asarray(cv2.sepFilter2D(noise, cv2.CV_32F, kernel * gain, kernel, borderType=cv2.BORDER_REFLECT))


def draw_discs(mask: Mask, centres: FloatArray, radii: FloatArray, value: bool) -> None:
    """Set the pixels of `mask` (H, W) within discs, centres (n, 2) px and radii (n,) px."""
    canvas, unit = mask.view(np.uint8), 2**_FRACTION_BITS
    for (x, y), radius in zip((centres * unit).round().astype(int), (radii * unit).round().astype(int), strict=True):
        cv2.circle(canvas, (int(x), int(y)), int(radius), int(value), -1, cv2.LINE_8, _FRACTION_BITS)


def draw_blobs(mask: Mask, centres: FloatArray, sizes: Range, value: bool, rng: np.random.Generator) -> None:
    """Set the pixels of `mask` (H, W) within ellipses of random radii and angles around centres (n, 2) px."""
    canvas = mask.view(np.uint8)
    for centre in centres:
        axes = 2.0 * rng.uniform(*sizes, 2)
        box = ((float(centre[0]), float(centre[1])), (float(axes[0]), float(axes[1])), float(rng.uniform(0.0, 180.0)))
        cv2.ellipse(canvas, box, int(value), -1)


def draw_stroke(mask: Mask, lengths: Range, widths: Range, rng: np.random.Generator) -> None:
    """Draw a short bent stroke somewhere into `mask` (H, W)."""
    length, width = rng.uniform(*lengths), rng.uniform(*widths)
    along = np.linspace(0.0, 1.0, max(8, math.ceil(length / _SAMPLE_PX)))
    bend = rng.uniform(-1.2, 1.2, 2)
    heading = rng.uniform(0.0, 2.0 * math.pi) + bend[0] * along + bend[1] * np.cos(math.pi * along)
    points = integrate(heading, length).points + rng.uniform((0.0, 0.0), mask.shape[::-1])
    fixed = (points * 2**_FRACTION_BITS).round().astype(np.int32)
    cv2.polylines(mask.view(np.uint8), [fixed], False, 1, max(1, round(width)), cv2.LINE_8, _FRACTION_BITS)


def gaps_along(
    curves: Sequence[BSplineCurve], share: float, radii: Range, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray]:
    """Choose discs on curves, centres (n, 2) and radii (n,), that cut out a share of their common length.

    Along the curves, taken one after the other, no two discs overlap.
    """
    lengths = np.array([curve.length for curve in curves])
    total = share * float(lengths.sum())
    count = max(1, round(total / (radii[0] + radii[1])))
    radius = rng.uniform(*radii, count)
    radius *= 0.5 * total / radius.sum()
    # The rest is split at random into what lies before, between and behind the gaps.
    free = (lengths.sum() - total) * np.diff(np.sort(rng.random(count)), prepend=0.0)
    centre = np.cumsum(free + 2.0 * radius) - radius
    return _points_at(curves, lengths, centre), radius


def spots_on(curves: Sequence[BSplineCurve], radii: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Choose centres (n, 2) on curves for discs of radii (n,), evenly over their common length but off their ends.

    An end that is hidden could not be found by any method: something is left to be seen of it.
    """
    lengths = np.array([curve.length for curve in curves])
    owner = rng.choice(len(curves), len(radii), p=lengths / lengths.sum())
    margin = np.minimum(_OFF_END * radii / lengths[owner], 1.0 / 3.0)
    u = margin + rng.random(len(radii)) * (1.0 - 2.0 * margin)
    return np.array([curves[i].spline(a) for i, a in zip(owner, u, strict=True)])


def _points_at(curves: Sequence[BSplineCurve], lengths: FloatArray, arc: FloatArray) -> FloatArray:
    """Return the points (n, 2) at distances (n,) along curves taken one after the other."""
    starts = np.concatenate(([0.0], np.cumsum(lengths)[:-1]))
    owner = np.searchsorted(starts, arc, side="right") - 1
    return np.array([curves[i].spline(a) for i, a in zip(owner, (arc - starts[owner]) / lengths[owner], strict=True)])
