"""A frame with its truth, and what scoring asks of them for every method: computed once, when it is first asked for."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from dloftbs.config import DepthConfig
from dloftbs.data.curve import BSplineCurve
from dloftbs.data.depth import to_metres
from dloftbs.data.frame import Frame
from dloftbs.support.arrays import BoolArray, FloatArray
from dloftbs_lab.evaluation.curves import length_of
from dloftbs_lab.evaluation.runner.found import Curve
from dloftbs_lab.evaluation.runner.mask_pixels import MaskPixels, shows
from dloftbs_lab.evaluation.traces import SAMPLES, Trace, trace_of
from dloftbs_lab.truth import Truth

_SAMPLES = 1000
_MIN_SINE = 1e-3  # between a curve and the line of sight, below which the surface in front has no place beside it


@dataclass(frozen=True, eq=False)
class SpaceLine:
    """A true line in space.

    Parameters
    ----------
    traces : tuple of Trace
        The whole line, and where that is less, its visible extent; metres.
    lengths_m : tuple of float
        The length of each.
    """

    traces: tuple[Trace, ...]
    lengths_m: tuple[float, ...]


@dataclass(frozen=True, eq=False)
class PointCloud:
    """The pixels of a mask in space: points (n, 3), m, and the tree in which they are looked up."""

    points: FloatArray

    @cached_property
    def tree(self) -> cKDTree:
        """The points as a tree; one that is not balanced is built in less time than a balanced one saves."""
        return cKDTree(self.points, balanced_tree=False)


@dataclass(frozen=True, eq=False)
class KnownFrame:
    """A frame and its truth.

    The visible extent of an object reaches from the first to the last point that is seen; hidden parts in between
    belong to it. In the image an end that lies on another object is not seen, even if it is on top, since in a mask it
    does not show.

    Parameters
    ----------
    frame : Frame
    truth : Truth
    radius_m : float, optional
        Radius of the objects in space, where they all have one.
    """

    frame: Frame
    truth: Truth
    radius_m: float | None = None

    @cached_property
    def pixels(self) -> MaskPixels | None:
        """The visible pixels of all objects, or those of the frame's mask; None where there is no mask."""
        mask = self.truth.mask if self.truth.mask is not None else self.frame.is_cable
        return None if mask is None else MaskPixels(mask)

    @cached_property
    def visible(self) -> BoolArray:
        """For each object, whether it shows at all, shape (objects,)."""
        if not self.truth.visible_masks:
            return np.ones(len(self.truth.ids), np.bool_)
        return np.array([mask.any() for mask in self.truth.visible_masks], np.bool_)

    @cached_property
    def traces(self) -> tuple[Trace, ...]:
        """The true curves in the image."""
        return tuple(trace_of("true", curve, SAMPLES) for curve in self.truth.curves)

    @cached_property
    def extents(self) -> tuple[Trace | None, ...]:
        """Their visible extents, None where this is the whole or nothing."""
        if not self.truth.visible_masks:
            return (None,) * len(self.truth.curves)
        lines = [curve.sample(_SAMPLES) for curve in self.truth.curves]
        radii = [_radius(line, mask) for line, mask in zip(lines, self.truth.visible_masks, strict=True)]
        extents = []
        for i, points in enumerate(lines):
            seen = shows(self.truth.visible_masks[i], points)
            _lose_ends(seen, points, [(lines[j], radii[j]) for j in range(len(lines)) if j != i])
            extents.append(_extent(points, seen, self.truth.curves[i]))
        return tuple(None if extent is None else Trace(extent, closed=False) for extent in extents)

    @cached_property
    def shown(self) -> tuple[BoolArray, ...]:
        """For each object, at which of `SAMPLES` evenly spaced ``u`` the mask shows it."""
        u = np.linspace(0.0, 1.0, SAMPLES)
        return tuple(
            np.any([np.zeros(SAMPLES, np.bool_), *((u >= low) & (u <= high) for low, high in spans)], axis=0)
            for spans in self.truth.shown_spans
        )

    @cached_property
    def axes(self) -> tuple[SpaceLine, ...]:
        """The true axes in space."""
        return tuple(self._space_line(number, curve) for number, curve in enumerate(self.truth.curves_3d))

    @cached_property
    def surfaces(self) -> tuple[SpaceLine, ...]:
        """The lines on the surfaces that face the camera; none where the radius is not known."""
        return tuple(self._space_line(number, line) for number, line in enumerate(self._surface_lines()))

    @cached_property
    def cloud(self) -> PointCloud | None:
        """The frame's mask in space; None without depth, and where none of its pixels has any.

        Missing depth is that which `DepthConfig` does not read by default, such as that of a saturated sensor.
        """
        frame, is_cable = self.frame, self.frame.is_cable
        if is_cable is None or frame.depth is None or frame.camera is None:
            return None
        rows, columns = np.divmod(np.flatnonzero(is_cable), is_cable.shape[1])
        depth_m = to_metres(frame.depth[rows, columns], frame.depth_unit_m, DepthConfig())
        known = np.isfinite(depth_m)
        if not known.any():
            return None
        pixels = np.column_stack((columns, rows))[known].astype(np.float64)
        return PointCloud(frame.camera.deproject(pixels, depth_m[known]))

    def _surface_lines(self) -> Iterator[FloatArray]:
        if self.radius_m is not None:
            for curve in self.truth.curves_3d:
                yield surface_line(curve.sample(_SAMPLES), self.radius_m)

    def _space_line(self, number: int, line: Curve) -> SpaceLine:
        lines, camera = [line], self.frame.camera
        if camera is not None and self.truth.visible_masks:
            points = line.sample(_SAMPLES) if isinstance(line, BSplineCurve) else line
            extent = _extent(points, shows(self.truth.visible_masks[number], camera.project(points)), line)
            lines += [] if extent is None else [extent]
        traces = [trace_of("true", one, SAMPLES) for one in lines]
        return SpaceLine(tuple(traces), tuple(map(length_of, lines, traces)))


def surface_line(axis: FloatArray, radius_m: float) -> FloatArray:
    """Return the line on the surface of a round object that faces the camera, for points (n, 3) along its axis."""
    tangents = np.gradient(axis, axis=0)
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    towards = -axis / np.linalg.norm(axis, axis=1, keepdims=True)
    across = towards - (towards * tangents).sum(axis=1, keepdims=True) * tangents
    sine = np.linalg.norm(across, axis=1, keepdims=True)
    return axis + radius_m * np.where(sine > _MIN_SINE, across / np.maximum(sine, _MIN_SINE), towards)


def _extent(points: FloatArray, seen: BoolArray, curve: Curve) -> FloatArray | None:
    """Return the points from the first to the last that is seen, or None where this is the whole or nothing."""
    (where,) = np.nonzero(seen)
    if (
        (isinstance(curve, BSplineCurve) and curve.closed)
        or len(where) < 2
        or (where[0] == 0 and where[-1] == len(points) - 1)
    ):
        return None
    return points[where[0] : where[-1] + 1]


def _radius(line: FloatArray, mask: BoolArray) -> float:
    """Return half the width of an object: the visible area over twice the visible length, px."""
    length = float(shows(mask, line).mean() * np.linalg.norm(np.diff(line, axis=0), axis=1).sum())
    return float(mask.sum()) / (2.0 * length) if length > 0.0 else 0.0


def _lose_ends(seen: BoolArray, points: FloatArray, others: Sequence[tuple[FloatArray, float]]) -> None:
    """Take from `seen` (n,) the points from either end on that lie on other objects, lines (m, 2) px and radii px."""
    for order in (range(len(points)), range(len(points) - 1, -1, -1)):
        for i in order:
            if not any((np.linalg.norm(line - points[i], axis=1) <= radius).any() for line, radius in others):
                break
            seen[i] = False
