"""Results that were found in a region of interest, moved into the pixels of the whole image.

Everything in pixels moves by the region's top left pixel; what is in metres, and the camera, are the whole image's.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from dloftbs.camera import PinholeCamera
from dloftbs.data.branch_point import BranchPoint
from dloftbs.data.centerline import BranchEnd, Centerline, Joint, NearJoint, Segment
from dloftbs.data.curve import BSplineCurve
from dloftbs.data.detection import Crossing, Detection
from dloftbs.data.frame import Frame
from dloftbs.data.frame_region import Region
from dloftbs.data.frame_result import FrameResult
from dloftbs.data.stage_trace import StageTrace
from dloftbs.data.tracks import Track
from dloftbs.support.arrays import FloatArray, frozen
from dloftbs.support.values import varied


@dataclass(frozen=True)
class WholeImage:
    """The way of results from a region of interest into the whole image.

    Parameters
    ----------
    region : Region
    frame : Frame
        The whole one.
    """

    region: Region
    frame: Frame
    _moved: dict[int, tuple[object, object]] = field(default_factory=dict)

    def result(self, found: FrameResult) -> FrameResult:
        """Return a result as that of the whole frame."""
        detections = tuple([self._detection(one) for one in found.detections])
        harnesses = tuple(
            [
                replace(one, detections=detections, branch_points=tuple(map(self._branch_point, one.branch_points)))
                for one in found.harnesses
            ]
        )
        return varied(
            found,
            detections=detections,
            tracks=tuple([self._track(one) for one in found.tracks]),
            size=self.region.image_size,
            stage_ms=dict(found.stage_ms),
            crossings=tuple([self._crossing(one) for one in found.crossings]),
            dropped=tuple([replace(one, centerline=self._centerline(one.centerline)) for one in found.dropped]),
            frame=None if found.frame is None else self.frame,
            roi=self.region.roi,
            branch_points=tuple([point for one in harnesses for point in one.branch_points]),
            harnesses=harnesses,
        )

    def trace(self, made: StageTrace) -> StageTrace:
        """Return what the stages made as that of the whole frame."""
        return StageTrace(
            self.frame,
            self.region.paste(made.mask),
            self.region.paste(made.cleaned),
            self._points(made.skeleton),
            self._points(made.endpoints),
            self._points(made.branch_points),
            tuple([self._segment(one) for one in made.segments]),
            tuple([self._segment(one) for one in made.short_segments]),
            self.result(made.result),
        )

    @property
    def _offset(self) -> FloatArray:
        return np.array(self.region.origin, np.float64)

    def _points(self, points: FloatArray) -> FloatArray:
        return points + self._offset

    def _detection(self, found: Detection) -> Detection:
        """Return a detection moved; one that comes again, as that of a track, is the same one again."""
        kept = self._moved.get(id(found))
        if kept is None:
            line, curve = self._centerline(found.centerline), self._curve(found.curve)
            moved = varied(found, centerline=line, curve=curve, camera=self._camera(found.camera))
            moved.__dict__.pop("joints", None)  # made anew when asked for
            kept = self._moved[id(found)] = found, moved
        assert isinstance(kept[1], Detection)
        return kept[1]

    def _track(self, found: Track) -> Track:
        return varied(
            found,
            curve=self._curve(found.curve),
            detection=None if found.detection is None else self._detection(found.detection),
            camera=self._camera(found.camera),
            _fitted_parts=tuple([part._replace(detection=self._detection(part.detection)) for part in found._parts]),
        )

    def _crossing(self, found: Crossing) -> Crossing:
        (x, y), (left, top) = found.position, self.region.origin
        return varied(found, position=(x + left, y + top))

    def _branch_point(self, found: BranchPoint) -> BranchPoint:
        (x, y), (left, top) = found.position, self.region.origin
        return replace(found, position=(x + left, y + top))

    def _branch_end(self, met: BranchEnd | None) -> BranchEnd | None:
        left, top = self.region.origin
        return None if met is None else replace(met, point=(met.point[0] + left, met.point[1] + top))

    def _camera(self, known: PinholeCamera | None) -> PinholeCamera | None:
        return None if known is None else self.frame.camera

    def _curve(self, curve: BSplineCurve) -> BSplineCurve:
        return BSplineCurve._unchecked(curve.knots, self._points(curve.control_points), curve.degree, curve.closed)

    def _centerline(self, line: Centerline) -> Centerline:
        forwards: Centerline | None = line.__dict__.get("_forwards")
        if forwards is not None:
            return self._centerline(forwards).reversed()
        kept = self._moved.get(id(line))
        if kept is None:
            moved = varied(
                line,
                segments=tuple([self._segment(one) for one in line.segments]),
                joints=tuple([self._joint(one) for one in line.joints]),
                near_joints=tuple([self._near_joint(one) for one in line.near_joints]),
                branch_ends=tuple([self._branch_end(one) for one in line.branch_ends]),
            )
            moved.__dict__.pop("points", None)
            kept = self._moved[id(line)] = line, moved
        assert isinstance(kept[1], Centerline)
        return kept[1]

    def _segment(self, segment: Segment) -> Segment:
        return varied(segment, points=frozen(self._points(segment.points)))

    def _joint(self, joint: Joint) -> Joint:
        left, top = self.region.origin
        start, stop = (None if one is None else (one[0] + left, one[1] + top) for one in joint.alternatives)
        return replace(joint, alternatives=(start, stop))

    def _near_joint(self, near: NearJoint) -> NearJoint:
        (x, y), (left, top) = near.point, self.region.origin
        return replace(near, point=(x + left, y + top))
