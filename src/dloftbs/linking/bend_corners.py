"""The way of a cable around a bend at which its skeleton cuts the corner."""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from dloftbs.support.arrays import ByteArray, FloatArray

_CORNER_WIDTHS = 3.0
"""Largest distance from a branch end to the corner of its bend, and from there to the mask's edge, widths.

Source: by hand.
"""

_PARALLEL = 0.4
"""Sine of the angle of two branch ends below which the point where they meet is uncertain.

Source: by hand; at this angle an error of 1 px aside is 2.5 px along.
"""

_OPEN = -0.5
"""Cosine of the angle between two sides up to which they make no corner.

Source: geometry; at a turn of 60 degrees a skeleton passes the corner at a twentieth of a width.
"""

_LONG_WIDTHS = 1.5
"""Length of the skeleton in a corner from which the two sides are followed along its edges, widths.

Source: by hand; it is clear of the junction for half a width.
"""

_BULGE_WIDTHS = 0.25
"""Length by which the mask widens towards the tip of a loop, widths; the sides of other folds draw near each other.

Source: by hand; more than the noise of two edges of pixels.
"""

_STEP_PX = 0.25
"""Step in which the edge is sought, px.

Source: by hand; finer than the noise of an edge of pixels.
"""

_HALF = 0.5
"""Value of the mask, between pixels, at its edge.

Source: by definition.
"""


def way_around(
    mask: ByteArray, here: FloatArray, there: FloatArray, width: float, radius: float, stub: FloatArray | None
) -> FloatArray | None:
    """Return the points of a cable that goes around a corner from one side to the other; None where there is none.

    The axis lies half a width inside of the outer edge, however the inner edges close: the corner is where the two
    sides meet, but no nearer to the edge than that, and the cable turns into it by an arc.

    Parameters
    ----------
    mask : (H, W) uint8
    here, there : numpy.ndarray, shape (4,)
        Where the two sides end, and their outward unit tangents.
    width : float
        Of the cables, px.
    radius : float
        Half the width of this one, px.
    stub : numpy.ndarray, shape (m, 2), optional
        The skeleton in the corner from the junction on, if it has a branch there.

    Returns
    -------
    numpy.ndarray, shape (n, 2), or None
        Both sides left out.
    """
    if stub is not None and len(stub) > _LONG_WIDTHS * width:
        return _around_fold(mask, here, there, width, radius, stub)
    corner = _corner(mask, here, there, width, radius, None if stub is None else stub[-1])
    if corner is None:
        return None
    onward = _unit(here[2:] + there[2:])
    return np.concatenate((_arc(here, corner, onward), corner[None], _arc(there, corner, onward)[::-1]))


def _around_fold(
    mask: ByteArray, here: FloatArray, there: FloatArray, width: float, radius: float, stub: FloatArray
) -> FloatArray | None:
    """Return the points of a cable along the two outer edges of a fold whose inside is closed, around its tip."""
    first, reach = int(width), max(int(0.5 * width), 1)
    index = np.arange(first, len(stub))
    middle, before, after = stub[index], np.maximum(index - reach, 0), np.minimum(index + reach, len(stub) - 1)
    along = stub[after] - stub[before]
    along /= np.maximum(np.hypot(*along.T), 1e-9)[:, None]
    onward, tip = along[-1], stub[-1]
    (ahead,) = _edges(mask, tip[None], onward[None], _CORNER_WIDTHS * width)
    if ahead == np.inf:
        return None
    corner = tip + (ahead - radius) * onward
    normal = np.column_stack((-along[:, 1], along[:, 0]))
    edges = [_edges(mask, middle, way, 2.0 * width) for way in (normal, -normal)]
    off = np.maximum(np.minimum(edges, 2.0 * width) - radius, 0.0)
    sides = middle + off[0][:, None] * normal, middle - off[1][:, None] * normal
    is_loop = float(off.sum(axis=0).max() - off[:, 0].sum()) > _BULGE_WIDTHS * width  # beyond where its sides cross
    comes_left = float((here[:2] - there[:2]) @ normal[0]) > 0.0
    if comes_left == is_loop:
        sides = sides[::-1]
    ways = []
    for side, way in zip((here, there), sides, strict=True):
        kept = way[(way - corner) @ onward < 0.0]
        if len(kept) == 0:
            ways.append(_arc(side, corner, onward))
            continue
        turned = np.concatenate((kept[-1], onward))
        ways.append(np.concatenate((between(side[:2], kept[0]), kept, _arc(turned, corner, onward))))
    return np.concatenate((ways[0], corner[None], ways[1][::-1]))


def _corner(
    mask: ByteArray, here: FloatArray, there: FloatArray, width: float, radius: float, mitre: FloatArray | None
) -> FloatArray | None:
    cosine = float(here[2:] @ there[2:])
    if cosine <= _OPEN:
        return None
    onward = _unit(here[2:] + there[2:])
    foot, farthest = 0.5 * (here[:2] + there[:2]), np.inf
    meets = _meeting(here, there, _CORNER_WIDTHS * width)
    if meets is not None:
        farthest = float((meets - foot) @ onward)
        foot = meets - farthest * onward
    most = _CORNER_WIDTHS * width
    if mitre is not None:
        to_mitre = float((mitre - foot) @ onward)
        farthest = np.inf if meets is None else max(farthest, to_mitre)  # tangents of short branches meet too early
        most += max(to_mitre, 0.0)
    (edge,) = _edges(mask, foot[None], onward[None], most)
    ahead = min(farthest, float(edge) - radius)
    if not 0.0 < ahead < np.inf:
        return None
    return foot + ahead * onward


def _meeting(here: FloatArray, there: FloatArray, most: float) -> FloatArray | None:
    """Return where the lines ahead of two sides meet, if that is certain and not farther than `most`, px."""
    (ax, ay, adx, ady), (bx, by, bdx, bdy) = here.tolist(), there.tolist()
    sine = adx * bdy - ady * bdx
    if abs(sine) < _PARALLEL:
        return None
    ahead = ((bx - ax) * bdy - (by - ay) * bdx) / sine
    back = ((bx - ax) * ady - (by - ay) * adx) / sine
    if min(ahead, back) <= 0.0 or max(ahead, back) > most:
        return None
    return here[:2] + ahead * here[2:]


def _edges(mask: ByteArray, starts: FloatArray, directions: FloatArray, most: float) -> FloatArray:
    """Return how far the mask's edge is along unit vectors, px; infinity where there is none up to `most`.

    A start may lie in a notch before the mask. The edge is where the mask, interpolated between pixels, falls below one
    half: the same wherever the pixels are counted from.

    Parameters
    ----------
    mask : (H, W) uint8
    starts, directions : numpy.ndarray, shape (n, 2)
    most : float
        px.

    Returns
    -------
    numpy.ndarray, shape (n,)
    """
    t = np.arange(0.0, 2.0 * most, _STEP_PX)
    places = starts[:, None] + t[:, None] * directions[:, None]
    covered = ndimage.map_coordinates(mask, places[..., ::-1].transpose(2, 0, 1), np.float64, order=1) - _HALF
    on_mask = covered >= 0.0
    result = np.full(len(starts), np.inf)
    for k, first in enumerate(on_mask.argmax(axis=1).tolist()):
        beyond = np.flatnonzero(~on_mask[k, first:])
        if on_mask[k, first] and t[first] <= most and len(beyond):
            at = first + int(beyond[0])
            before, after = covered[k, at - 1], covered[k, at]
            result[k] = t[at - 1] + _STEP_PX * before / (before - after)
    return result


def _arc(side: FloatArray, corner: FloatArray, onward: FloatArray) -> FloatArray:
    """Return the points from a side to the corner: straight on, and by an arc into the direction across there."""
    start, tangent = side[:2], side[2:]
    along = float(tangent @ onward)
    if along == 0.0:  # it runs across the way on, and never comes up to the corner
        return between(start, corner)
    straight = float((corner - start) @ onward) / along
    turn = start + straight * tangent
    aside = turn - corner
    if float(aside @ (start - corner)) <= 0.0:  # the line passes the corner at its other side
        return between(start, corner)
    leg = min(float(np.hypot(*aside)), straight)
    bent = turn - leg * tangent
    steps = max(int(2.0 * leg), 1)
    t = np.arange(1, steps)[:, None] / steps  # where the arc begins there may be the start, and its end is the corner
    arc = (1.0 - t) ** 2 * bent + 2.0 * t * (1.0 - t) * turn + t**2 * corner
    return np.concatenate((between(start, bent), arc))


def between(start: FloatArray, stop: FloatArray) -> FloatArray:
    """Return the points between two others, about 1 px apart."""
    steps = max(int(np.hypot(*(stop - start))), 1)
    result: FloatArray = start + np.arange(1, steps)[:, None] / steps * (stop - start)
    return result


def _unit(vector: FloatArray) -> FloatArray:
    result: FloatArray = vector / max(float(np.hypot(*vector)), 1e-9)
    return result
