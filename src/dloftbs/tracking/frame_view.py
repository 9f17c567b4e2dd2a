"""View of a frame: where the image's border or an occluder may cut a cable, and where one may be hidden."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from dloftbs._arrays import FloatArray
from dloftbs.curve import BSplineCurve
from dloftbs.evidence import HIDDEN, IN_SIGHT, OcclusionEvidence
from dloftbs.observation import Appearance, Observation, sample_curve
from dloftbs.tracking.kernels.end_places import places_beyond
from dloftbs.tracking.partial_match import WHOLE

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


class Sought(Protocol):
    """Track, as far as a frame is asked about it."""

    width: float
    appearance: Appearance | None


@dataclass(frozen=True, eq=False)
class View:
    """Scene of one frame, as far as tracking asks for it.

    Parameters
    ----------
    size : (int, int) or None
        ``(H, W)`` of the image, px.
    occlusion : OcclusionEvidence or None
        None if the frame tells nothing of what hides cables.
    """

    size: tuple[int, int] | None = None
    occlusion: OcclusionEvidence | None = None

    def is_at_border(self, point: FloatArray, width: float) -> bool:
        """Return True if a point lies within about a width of the border of the image."""
        if self.size is None:
            return False
        margin = _BORDER_PX + (0.0 if math.isnan(width) else _BORDER_WIDTHS * width)
        x, y = float(point[0]), float(point[1])
        return min(x, y, self.size[1] - 1.0 - x, self.size[0] - 1.0 - y) < margin

    def ends_at_border(self, observation: Observation, sought: Sought) -> list[bool]:
        """Return, for each end of an observation, True if the image's border may cut it."""
        return [self.is_at_border(observation.points[k], sought.width) for k in (0, -1)]

    def cut_ends(self, observation: Observation, sought: Sought) -> list[bool]:
        """Return, for each end of an observation, True if the border or something that hides the rest may cut it."""
        cut = self.ends_at_border(observation, sought)
        if self.occlusion is None or all(cut):
            return cut
        hidden = self.hidden_ends(observation, sought)
        return [one or other for one, other in zip(cut, hidden, strict=True)]

    def hidden_ends(self, observation: Observation, sought: Sought) -> list[bool]:
        """Return, for each end of an observation, True if the frame tells that something may hide the rest."""
        return self.hidden_beyond(observation.points, sought, observation.curve_3d, observation.curve_span)

    def hidden_beyond(
        self, points: FloatArray, sought: Sought, curve_3d: BSplineCurve | None, span: tuple[float, float] = WHOLE
    ) -> list[bool]:
        """Return the same of points (n, 2) along a curve, which are those of a span of one in space.

        The image is not asked: beyond an end the ground may be another one than that beside the cable.
        """
        if self.occlusion is None:
            return [False, False]
        told = self._look_beyond(points, sought.width, curve_3d, span, None)
        hidden: list[bool] = (told == HIDDEN).any(axis=1).tolist()
        return hidden

    def ends_in_sight(self, observation: Observation, sought: Sought) -> list[bool]:
        """Return, for each end of an observation, True if there is evidence that nothing hides a continuation."""
        if self.occlusion is None:
            return [False, False]
        seen = observation.points, sought.width, observation.curve_3d, observation.curve_span
        told = self._look_beyond(*seen, sought.appearance)
        # Nearer places may lie on the end itself.
        in_sight: list[bool] = ((told != HIDDEN).all(axis=1) & (told[:, -1] == IN_SIGHT)).tolist()
        return in_sight

    def look(self, points: FloatArray, sought: Sought, curve_3d: BSplineCurve | None) -> npt.NDArray[np.int64] | None:
        """Return what the frame tells of the samples of a curve; None if it tells nothing."""
        if self.occlusion is None:
            return None
        depth_m = None if curve_3d is None else self.occlusion.depth_along(curve_3d)
        return self.occlusion.look(points, sought.width, depth_m, sought.appearance)

    def project(self, curve_3d: BSplineCurve, count: int) -> FloatArray | None:
        """Return points (count, 2) along a curve in space as the camera sees them; None if it is not known to."""
        return None if self.occlusion is None else self.occlusion.project(curve_3d, count)

    def _look_beyond(
        self,
        points: FloatArray,
        width: float,
        curve_3d: BSplineCurve | None,
        span: tuple[float, float],
        appearance: Appearance | None,
    ) -> npt.NDArray[np.int64]:
        """Return what the frame tells beyond the two ends of points along a curve, as (2, `_BEYOND`)."""
        assert self.occlusion is not None
        places = places_beyond(points, _BORDER_PX if math.isnan(width) else width, _BEYOND)
        ends_m = None if curve_3d is None else sample_curve(curve_3d, *span, 2)[0][:, 2]
        depth_m = None if ends_m is None else np.repeat(ends_m, len(_BEYOND))
        return self.occlusion.look(places, width, depth_m, appearance).reshape(2, -1)
