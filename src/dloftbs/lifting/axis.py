"""Depth to the axis of each object, in metres (not in the paper, which lifts every pixel by itself)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from dloftbs.camera import PinholeCamera
from dloftbs.data.depth import ReadableDepth
from dloftbs.data.detection import Crossing, Detection
from dloftbs.data.mask_crop import MaskCrop
from dloftbs.lifting.beside import Beside, DepthEdges, look_beside
from dloftbs.lifting.kernels import sections as kernels
from dloftbs.lifting.kernels.penalized_spline import deviation_of_line, smooth
from dloftbs.lifting.kernels.surfaces import BORDER_PX, LEAST_SHARE, SHARE, find_surface
from dloftbs.lifting.kernels.tubes import mask_occluded, surface_to_axis
from dloftbs.lifting.kernels.wrong_depth import strike_ground, strike_steps
from dloftbs.support.arrays import BoolArray, FloatArray

_STEP_WIDTHS = 0.4
"""Distance from section to section, widths.

Source: measured; closer sections make depth hardly more accurate.
"""

_MIN_PIXELS = 9.0
"""Smallest number of pixels of a section.

Source: by hand; a median of as many is robust.
"""

_MIN_SECTIONS = 8
"""Smallest number of sections of a curve.

Source: by hand; twice the four coefficients of a cubic.
"""

_SECTIONS = 3
"""Number of sections from knot to knot of the smooth line.

Source: by hand; so a knot span is determined by several.
"""

_BLOCK_WIDTHS = 8.0
"""Length over which the width is levelled, widths.

Source: by hand.
"""

_MIXED_PX = 2.0
"""Distance along the curve from an occluder within which no depth is taken, px.

Source: by hand; pixels there mix with it, on both grids.
"""

_FLOOR_WIDTHS = 0.05
"""Accuracy of a cable's surface that is enough, widths.

Source: by hand; it keeps the cable's own texture from counting less where depth is exact.
"""

_STRETCH_WIDTHS = 6.0
"""Largest length of an occluder that only depth shows, widths.

Source: by hand; a longer one shows in the mask.
"""

_INFERRED_WIDTHS = 1.0
"""Least length of a stretch without depth that is reported, widths.

Source: by hand.
"""

_MAX_TIMES = 2.0
"""Largest ratio of an extrapolated depth to the farthest one that was seen.

Source: by hand; beyond it the extrapolation has failed.
"""

MIN_SEEN = 0.3
"""Least share of a curve that must have depth of its own.

Source: by hand.
"""

MAX_EXTRAPOLATED = 0.2
"""Largest share of a curve's length that is extended straight beyond the last depth at an end.

Source: by hand.
"""

_NOT_ITS_OWN = "something else's, or a step away"

_Interval = tuple[float, float]


class Lifted(NamedTuple):
    """Points on the axis of an object.

    Parameters
    ----------
    points_m : numpy.ndarray, shape (n, 3)
        In the camera's frame, in order from end to end, evenly spaced in the image; of a loop, once around.
    u : numpy.ndarray, shape (n,)
        Their normalised arc length in space.
    inferred : tuple of (float, float)
        The intervals of `u` that no depth shows.
    radius_m : float
    depth_freedom : float
        Effective number of parameters of the depth along the object: 2 is straight.
    std_per_m : float
        Standard deviation of the smooth line by the noise of depth, as 1 / depth.
    """

    points_m: FloatArray
    u: FloatArray
    inferred: tuple[_Interval, ...]
    radius_m: float
    depth_freedom: float
    std_per_m: float


class _Sections(NamedTuple):
    """Sections across a curve, ascending in its parameter."""

    u: FloatArray
    points: FloatArray
    tangents: FloatArray
    radius: FloatArray
    used: BoolArray
    spacing_px: float

    def nearest(self, u: float, closed: bool) -> int:
        """Return the number of the section at a parameter."""
        n = len(self.u)
        return round(u * n) % n if closed else round(u * (n - 1))


def lift(
    detections: Sequence[Detection],
    crossings: Sequence[Crossing],
    crop: MaskCrop,
    depth: ReadableDepth,
    camera: PinholeCamera,
    depth_edges: DepthEdges | None = None,
) -> list[Lifted | str]:
    """Lift objects into space: along each, the nearest surface within the mask, made smooth, then moved to the axis.

    Depth is looked at in sections across the middle of the object, where no other pass covers it and the mask is not
    interrupted. A robust smooth line is laid through it, in 1 / depth, for which a straight cable is straight. It
    bridges the sections without depth of their own: they are inferred. The radius, one for the
    whole object, comes from the width in the image.

    Parameters
    ----------
    detections : sequence of Detection
        Their curves in the image count, not those in space.
    crossings : sequence of Crossing
        Of the detections. A pass that is not known to be on top is not looked at where the other one may cover it.
    crop : MaskCrop
        The mask that they were found in.
    depth : ReadableDepth
    camera : PinholeCamera
    depth_edges : DepthEdges, optional
        What earlier frames of the same camera show of it; this frame adds to it.

    Returns
    -------
    list of Lifted or str
        For each detection; text says why its depth is too little.
    """
    sections = [_lay_sections(detection) for detection in detections]
    for crossing in crossings:
        passes = crossing._fitted_passes(detections)
        for number, (a, u_a) in enumerate(passes):
            b, u_b = passes[1 - number]
            if crossing.top == number:
                continue
            mine, other = sections[a], sections[b]
            closed_a, closed_b = detections[a].curve.closed, detections[b].curve.closed
            at_a, at_b = mine.nearest(u_a, closed_a), other.nearest(u_b, closed_b)
            reach = float(other.radius[at_b]) + SHARE * float(mine.radius[at_a]) + BORDER_PX
            mask_occluded(mine.used, mine.points, closed_a, at_a, other.points, closed_b, at_b, reach)
    beside = look_beside([(s.points, s.tangents, s.radius) for s in sections], crop, depth)
    edges = DepthEdges() if depth_edges is None else depth_edges
    edges.add(beside)
    edges_px = *edges.displacement_px, edges.fattening_px
    return [
        _lift_one(detection, own, one, edges_px, crop, depth, camera)
        for detection, own, one in zip(detections, sections, beside, strict=True)
    ]


def _lay_sections(detection: Detection) -> _Sections:
    curve, line, width = detection.curve, detection.centerline, detection.width_px
    half = max(min(SHARE * 0.5 * width, 0.5 * width - BORDER_PX), LEAST_SHARE * 0.5 * width)
    step = max(_STEP_WIDTHS * width, _MIN_PIXELS / (2 * int(half) + 1))
    block = int(_BLOCK_WIDTHS * width)
    u, points, tangents, radius, length = kernels.lay_sections(
        curve.knots, curve.control_points, line.u, line.radius, curve.closed, step, _MIN_SECTIONS, block
    )
    used = np.ones(len(u), dtype=np.bool_)
    margin = _MIXED_PX / max(length, 1.0)
    for low, high in line.gaps:
        used[(u > low - margin) & (u < high + margin)] = False
    return _Sections(u, points, tangents, radius, used, length / len(u))


def _lift_one(
    detection: Detection,
    sections: _Sections,
    beside: Beside,
    edges_px: tuple[float, float, float],
    crop: MaskCrop,
    depth: ReadableDepth,
    camera: PinholeCamera,
) -> Lifted | str:
    """Lift one object; `edges_px` has the displacement ``(x, y)`` and the fattening of the depth image."""
    closed, width, focal_px = detection.curve.closed, detection.width_px, math.sqrt(camera.fx * camera.fy)
    n, (h, w), (left, top) = len(sections.u), crop.size, crop.origin
    surface, counts, shift = find_surface(
        sections.points,
        sections.tangents,
        sections.radius,
        sections.used,
        crop.pixels[1 : h + 1, 1 : w + 1],
        depth.stored,
        left,
        top,
        *depth[1:],
        focal_px,
        *edges_px,
        beside.ground_m,
        beside.noise_per_m,
    )
    slenderness, spacing = sections.radius / focal_px, sections.spacing_px / focal_px
    strike_ground(surface, beside.ground_m, slenderness, beside.noise_per_m, spacing)
    most = max(round(_STRETCH_WIDTHS * width / sections.spacing_px), 2)
    known = strike_steps(surface, slenderness, spacing, most, n if closed else int(MAX_EXTRAPOLATED * (n - 1)))
    if _is_too_few(known, n):
        return _too_few(known, counts > 0.0)
    spans = max(round(n / _SECTIONS), 1)
    line, freedom = _smooth(1.0 / surface, counts, spans, _FLOOR_WIDTHS * width / focal_px, closed)
    least = max(round(_INFERRED_WIDTHS * width / sections.spacing_px), 1)
    seen, stretches, known, first, last, lowest, lowest_seen = kernels.confirm_sections(surface, closed, least, line)
    if _is_too_few(known, n):
        return _too_few(known, counts > 0.0)
    beyond = slice(None, first) if first > n - 1 - last else slice(last + 1, None)
    if not closed and max(first, n - 1 - last) > MAX_EXTRAPOLATED * (n - 1):
        return _too_far(counts[beyond] > 0.0, n)
    if lowest * _MAX_TIMES < lowest_seen:
        return f"the extrapolated depth exceeds {_MAX_TIMES:.0f} times the largest measured depth"
    rays = kernels.find_rays(
        sections.points, sections.tangents, sections.radius, camera.fx, camera.fy, camera.cx, camera.cy
    )
    if camera.distortion:
        rays[:, :, :2] = camera.lens.undistorted(rays[:, :, :2])
        beyond_lens = int(np.isnan(rays).any(axis=(0, 2)).sum())
        if beyond_lens:
            return f"{beyond_lens} of {n} sections of the curve lie beyond the field of the lens model"
    points, u, radius = surface_to_axis(rays, line, shift, seen, closed)
    inferred = _intervals(stretches.tolist(), u, closed) if len(stretches) else ()
    return Lifted(points, u, inferred, radius, freedom, deviation_of_line(1.0 / surface, line, seen, freedom))


def _smooth(
    inverse: FloatArray, counts: FloatArray, spans: int, floor: float, closed: bool
) -> tuple[FloatArray, float]:
    """Return what `smooth` returns for 1 / depth; around a loop, which has no ends, it goes twice."""
    if not closed:
        return smooth(inverse, counts, spans, floor)
    n = len(inverse)
    half = n // 2
    inverse, counts = np.roll(np.tile(inverse, 2), half), np.roll(np.tile(counts, 2), half)
    line, freedom = smooth(inverse, counts, 2 * spans, floor)
    return line[half : half + n], 0.5 * freedom


def _is_too_few(seen: int, sections: int) -> bool:
    return seen < max(MIN_SEEN * sections, 2)


def _too_few(seen: int, measured: BoolArray) -> str:
    """Say that few sections are seen, of those where depth was measured."""
    text = f"only {seen} of {len(measured)} sections of the curve have depth, fewer than {100.0 * MIN_SEEN:.0f} %"
    others = int(measured.sum()) - seen
    return text if others <= 0 else f"{text}; in {others} more it is {_NOT_ITS_OWN}"


def _too_far(beyond: BoolArray, sections: int) -> str:
    """Say that nothing is seen at an end, given where depth was measured beyond the last section that is."""
    share, most = 100.0 * len(beyond) / (sections - 1), 100.0 * MAX_EXTRAPOLATED
    others = int(beyond.sum())
    what = "no depth" if others == 0 else f"no depth of their own (in {others} sections it is {_NOT_ITS_OWN})"
    return f"the last {share:.0f} % of the curve have {what}, more than {most:.0f} %"


def _intervals(stretches: list[list[int]], u: FloatArray, closed: bool) -> tuple[_Interval, ...]:
    """Return the intervals of `u` that stretches of sections cover, each from halfway to the last seen before.

    That of an open curve's first or last section goes to the end.
    """
    n = len(u)

    def before(section: int) -> float:
        """Return the place halfway to a section, which on a loop may be counted on beyond the seam."""
        one, other = (float(u[k % n]) + k // n for k in (section - 1, section))
        return 0.5 * (one + other) % 1.0

    intervals = []
    for start, stop in stretches:
        low = before(start) if closed or start > 0 else 0.0
        high = before(stop) if closed or stop < n else 1.0
        if low > high:
            intervals += [(0.0, high), (low, 1.0)]
        else:
            intervals.append((low, high))
    return tuple(sorted(intervals))
