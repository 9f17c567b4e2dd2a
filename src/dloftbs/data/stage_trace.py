"""Results of all stages on one frame, for pictures and for finding out what went wrong."""

from __future__ import annotations

from dataclasses import dataclass

from dloftbs.data.centerline import Segment
from dloftbs.data.frame import Frame
from dloftbs.data.frame_result import FrameResult
from dloftbs.data.presentation import outputs
from dloftbs.support.arrays import BoolArray, FloatArray
from dloftbs.support.values import count_of


@dataclass(frozen=True, eq=False, repr=False)
class StageTrace:
    """Everything between a frame and its curves, for pictures and for finding out what went wrong.

    Points are ``(x, y)`` px in the frame.

    Parameters
    ----------
    frame : Frame
    mask, cleaned : numpy.ndarray, shape (H, W), bool
        As segmented or given, and after the morphology.
    skeleton, endpoints, branch_points : numpy.ndarray, shape (n, 2)
        All skeleton pixels; those with one neighbour; those with more than two.
    segments, short_segments : tuple of Segment
        Paths of the walks: the ones kept, and the ones too short.
    result : FrameResult
    """

    frame: Frame
    mask: BoolArray
    cleaned: BoolArray
    skeleton: FloatArray
    endpoints: FloatArray
    branch_points: FloatArray
    segments: tuple[Segment, ...]
    short_segments: tuple[Segment, ...]
    result: FrameResult

    def __repr__(self) -> str:
        kept, short = count_of(len(self.segments), "segment"), len(self.short_segments)
        return f"StageTrace({self.frame!r}, {kept}, {short} too short, {self.result!r})"

    def _repr_png_(self) -> bytes:
        """Return the picture that a notebook shows: a figure of all stages."""
        return outputs().trace_png(self)
