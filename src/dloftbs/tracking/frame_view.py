"""View of a frame: where the image's border or an occluder may cut a cable, and where one may be hidden."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from dloftbs.data.curve import BSplineCurve
from dloftbs.data.curve_samples import SAMPLES, sample_curve
from dloftbs.data.frame_region import distances_to
from dloftbs.evidence import HIDDEN, IN_SIGHT, OcclusionEvidence
from dloftbs.kernels.polyline_lengths import arc_parameter
from dloftbs.support.arrays import FloatArray, IntArray
from dloftbs.tracking.kernels.interpolation import extend_ends
from dloftbs.tracking.observation import Observation
from dloftbs.tracking.partial_match import WHOLE
from dloftbs.tracking.reconstruction import CURVE_SAMPLES, EVEN_U

_BORDER_PX = 3.0
"""Distance from the image's border within which it may cut an end, px, besides `_BORDER_WIDTHS`.

Source: by hand; cleaning, thinning and fitting each move an end by a pixel.
"""

_BORDER_WIDTHS = 1.5
"""Distance from the image's border within which it may cut an end, widths.

Source: by hand; a cable that leaves at a slant ends about one width before it.
"""

_BEYOND = np.array([0.5, 1.0, 1.5])
"""Distances beyond an end, along its tangent, at which a frame is asked what hides the rest of a cable, widths.

Source: geometry; a cable that goes under an edge at a slant ends up to a width and a half before it.
"""


_AT_ENDS = np.array([0, SAMPLES - 1]).repeat(len(_BEYOND))
"""Indices of the end that each of these places lies beyond, in the samples of a curve.

Source: by definition.
"""


class EndView(NamedTuple):
    """View beyond one end of a curve.

    Parameters
    ----------
    at_border : bool
        True if the image's border may cut it.
    hidden : bool
        True if the frame shows that something may hide the rest.
    in_sight : bool
        True if there is evidence that nothing hides a continuation.
    """

    at_border: bool
    hidden: bool = False
    in_sight: bool = False

    @property
    def is_cut(self) -> bool:
        """True if the border or something that hides the rest may cut the curve there."""
        return self.at_border or self.hidden


@dataclass(slots=True, eq=False)
class View:
    """Scene of one frame, as far as tracking asks for it.

    Parameters
    ----------
    size : (int, int) or None
        ``(H, W)`` of the image, px.
    occlusion : OcclusionEvidence or None
        None if the frame shows nothing of what hides cables.
    outline : numpy.ndarray, shape (n, 2), or None
        Corners of the polygon that alone is seen of the image, px: its edges act as the image's border.
    """

    size: tuple[int, int] | None = None
    occlusion: OcclusionEvidence | None = None
    outline: FloatArray | None = None
    _looked: dict[tuple[int, float], tuple[Observation, tuple[EndView, EndView]]] = field(default_factory=dict)

    def are_at_border(self, points: FloatArray, width: float) -> list[bool]:
        """Return for both ends of a curve if they lie within about a width of the border of the image."""
        if self.size is None:
            return [False, False]
        margin, (rows, columns) = _BORDER_PX + (0.0 if math.isnan(width) else _BORDER_WIDTHS * width), self.size
        ends = points[:: len(points) - 1]
        beside = [min(x, y, columns - 1.0 - x, rows - 1.0 - y) < margin for x, y in ends.tolist()]
        if self.outline is None:
            return beside
        return [one or far < margin for one, far in zip(beside, distances_to(self.outline, ends).tolist(), strict=True)]

    def ends(self, observation: Observation, width: float) -> tuple[EndView, EndView]:
        """Return what the frame shows beyond the two ends of an observation of a track of some width, px."""
        key = id(observation), width
        if key not in self._looked:
            told = self.look_beyond(observation.points, width, observation.curve_3d, observation.curve_span)
            self._looked[key] = observation, told  # as long as it is kept, no other object has its id
        return self._looked[key][1]

    def look_beyond(
        self, points: FloatArray, width: float, curve_3d: BSplineCurve | None, span: tuple[float, float] = WHOLE
    ) -> tuple[EndView, EndView]:
        """Return the same of points (n, 2), those of a span of a curve in the image that is `curve_3d` in space."""
        first, last = self.are_at_border(points, width)
        if self.occlusion is None:
            return EndView(first), EndView(last)
        places = extend_ends(points, _BEYOND, _BORDER_PX if math.isnan(width) else width)
        depth_m = None
        if curve_3d is not None:
            depth_m = sample_curve(curve_3d, *self.span_in_space(curve_3d, span))[0][_AT_ENDS, 2]
        start, stop = self.occlusion.look(places, width, depth_m).reshape(2, -1).tolist()
        hidden = HIDDEN in start, HIDDEN in stop
        # Nearer places may lie on the end itself.
        in_sight = [HIDDEN not in end and end[-1] == IN_SIGHT for end in (start, stop)]
        return EndView(first, hidden[0], in_sight[0]), EndView(last, hidden[1], in_sight[1])

    def look(self, points: FloatArray, width: float, curve_3d: BSplineCurve | None) -> IntArray | None:
        """Return what the frame shows of the samples of a curve; None if it shows nothing."""
        if self.occlusion is None:
            return None
        depth_m = None if curve_3d is None else self.occlusion.depth_along(curve_3d)
        return self.occlusion.look(points, width, depth_m)

    def project(self, points_m: FloatArray) -> FloatArray | None:
        """Return points (n, 3) in space as the camera sees them, (n, 2); None if it is not known to."""
        return None if self.occlusion is None else self.occlusion.project(points_m)

    def span_in_space(self, curve_3d: BSplineCurve, span: tuple[float, float]) -> tuple[float, float]:
        """Return the span of a curve in space that is seen as a span of the curve in the image.

        It is the same without a camera. Depth that jumps, where a detection goes over from one cable to another, is
        long in space and short in the image.
        """
        points = None if span == WHOLE else self.project(sample_curve(curve_3d, count=CURVE_SAMPLES)[0])
        if points is None or (points == points[0]).all():  # along a ray
            return span
        low, high = np.interp(span, arc_parameter(points, False), EVEN_U).tolist()
        return low, high
