"""Tubes around curves: which pixels they cover, and where along and across the tube each pixel lies."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from dloftbs.data.curve import BSplineCurve
from dloftbs.data.curve_pixels import SAMPLE_PX, pixels_near
from dloftbs.errors import InputError
from dloftbs.support.arrays import FloatArray
from dloftbs_lab.synthetic.strand import Strand

_CHUNK_PX = 8.0
_ITERATIONS = 3
_SEAM_PX = 0.05


def draw_tube_mask(curve: BSplineCurve, width_px: float, size: tuple[int, int]) -> npt.NDArray[np.bool_]:
    """Draw the pixels whose centre lies within half a width of a curve; the ends are round, nothing is anti-aliased.

    The distance is taken to points 0.1 px apart, which is exact to 0.003 px at a width of 1 and better above.

    Parameters
    ----------
    curve : BSplineCurve
        In the plane, px; it may leave the image.
    width_px : float
    size : (int, int)
        ``(H, W)`` of the image.

    Returns
    -------
    numpy.ndarray, shape (H, W), bool

    Raises
    ------
    InputError
        If the curve is not plane or the width not positive.
    """
    if curve.ndim != 2:
        raise InputError(f"curve must be in the plane, got {curve.ndim} dimensions")
    if not width_px > 0:
        raise InputError(f"width_px must be positive, got {width_px}")
    points = curve.spline(np.linspace(0.0, 1.0, max(2, math.ceil(curve.length / SAMPLE_PX) + 1)))
    rows, columns, _ = pixels_near(points, width_px, size)
    mask = np.zeros(size, bool)
    mask[rows, columns] = True
    return mask


@dataclass(frozen=True, eq=False)
class Footprint:
    """The pixels that a tube covers, one entry for each pass over a pixel.

    Parameters
    ----------
    pixel : numpy.ndarray, shape (m,), intp
        Index into the flattened image.
    sample : numpy.ndarray, shape (m,), intp
        The nearest sample of the strand.
    arc : numpy.ndarray, shape (m,)
        Arc length at the foot of the perpendicular, px, beyond the ends negative or above the length.
    offset : numpy.ndarray, shape (m,)
        Signed distance from the centre line, px; positive on the right of the direction of travel as seen on screen.
    """

    pixel: npt.NDArray[np.intp]
    sample: npt.NDArray[np.intp]
    arc: FloatArray
    offset: FloatArray


def footprint(strand: Strand, reach_px: float, size: tuple[int, int]) -> Footprint:
    """Find every pixel within `reach_px` of the strand, once for each pass of the strand over it.

    `reach_px` must stay below the bending radius. Where the strand passes twice, both passes are listed.
    """
    # Windows about eight pixels of arc apart; each keeps the pixels whose foot falls into its own stretch.
    count = max(1, math.ceil(strand.length / _CHUNK_PX))
    half = strand.length / count / 2.0
    centre = (2.0 * np.arange(count, dtype=np.float64) + 1.0) * half
    chunk, columns, rows = _candidates(strand, centre, half, reach_px)
    inside = (columns >= 0) & (columns < size[1]) & (rows >= 0) & (rows < size[0])
    chunk, columns, rows = chunk[inside], columns[inside], rows[inside]
    sample, arc, across = _feet(strand, columns, rows, centre[chunk])
    excess = np.maximum(np.maximum(-arc, arc - strand.length), 0.0)
    offset = np.where(excess > 0.0, np.copysign(np.hypot(excess, across), across), across)
    low = np.where(chunk == 0, -np.inf, centre[chunk] - half - _SEAM_PX)
    high = np.where(chunk == count - 1, np.inf, centre[chunk] + half + _SEAM_PX)
    keep = np.flatnonzero((arc >= low) & (arc < high) & (np.abs(offset) <= reach_px))
    pixel = (rows[keep] * size[1] + columns[keep]).astype(np.intp)
    order = np.lexsort((arc[keep], pixel))
    pixel, keep = pixel[order], keep[order]
    # Two windows may claim a pixel on their seam; the same pass is listed once.
    first = np.ones(len(keep), bool)
    first[1:] = (np.diff(pixel) != 0) | (np.diff(arc[keep]) > 4.0 * _SEAM_PX)
    keep = keep[first]
    return Footprint(pixel[first], sample[keep], arc[keep], offset[keep])


def _candidates(
    strand: Strand, centre: FloatArray, half: float, reach_px: float
) -> tuple[npt.NDArray[np.intp], FloatArray, FloatArray]:
    """Return window number, column and row, each (m,), of every pixel that may belong to a window."""
    index = (centre / strand.spacing).round().astype(np.intp)
    middle, tangent = strand.points[index], strand.tangents[index]
    corner = middle.round()
    ticks = np.arange(-(radius := math.ceil(reach_px + half) + 1), radius + 1, dtype=np.float64)
    dx, dy = ticks + (corner - middle)[:, 0, None, None], ticks[:, None] + (corner - middle)[:, 1, None, None]
    tx, ty = tangent[:, 0, None, None], tangent[:, 1, None, None]
    # A pixel on the outside of a bend lies further along the tangent than its foot does.
    slack = half * (1.0 + 1.2 * reach_px * np.abs(strand.bending[index])) + 1.0
    slack[[0, -1]] += reach_px
    bulge = 1.0 + 0.5 * np.abs(strand.bending[index]) * slack**2
    near = np.abs(dx * tx + dy * ty) <= slack[:, None, None]
    near &= np.abs(dy * tx - dx * ty) <= reach_px + bulge[:, None, None]
    chunk, row, column = np.nonzero(near)
    return chunk, corner[chunk, 0] + ticks[column], corner[chunk, 1] + ticks[row]


def _feet(
    strand: Strand, columns: FloatArray, rows: FloatArray, arc: FloatArray
) -> tuple[npt.NDArray[np.intp], FloatArray, FloatArray]:
    """Newton's method for the foot of the perpendicular, from a start nearby: nearest sample, arc, distance across."""
    # Complex numbers turn a pixel into the frame of the strand with one multiplication.
    place = columns + 1j * rows
    points = strand.points[:, 0] + 1j * strand.points[:, 1]
    turn = np.exp(-1j * strand.heading)
    for _ in range(_ITERATIONS):
        sample = np.clip((arc / strand.spacing).round(), 0, len(points) - 1).astype(np.intp)
        local = (place - points[sample]) * turn[sample]
        arc = sample * strand.spacing + local.real / np.maximum(1.0 - strand.bending[sample] * local.imag, 0.2)
    return sample, arc, local.imag
