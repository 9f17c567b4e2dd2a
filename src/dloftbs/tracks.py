"""Objects through time."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Any

from dloftbs._arrays import LARGEST
from dloftbs._values import MAX_WHOLE, check_integer, check_number, check_spans, check_type, set_fields
from dloftbs.curve import BSplineCurve, check_curve
from dloftbs.detection import Detection


class TrackState(str, Enum):
    """Stage of a track's life."""

    TENTATIVE = "tentative"
    """Seen, but in too few frames to be sure."""
    CONFIRMED = "confirmed"
    """Seen in this frame."""
    HIDDEN = "hidden"
    """Nothing of it is seen in this frame; the curve is predicted."""


@dataclass(frozen=True, eq=False)
class Track:
    """One object through time, as it stands after one frame.

    Parameters
    ----------
    id : int
        From 1 on, never used again.
    state : TrackState
    curve : BSplineCurve
        In the image, px; ``u = 0`` stays at the same end from frame to frame.
    curve_3d : BSplineCurve, optional
        In the camera's frame, metres, in the same direction.
    hits : int
        Frames in which the object was detected, in all.
    misses : int
        Frames since it was last detected.
    detection : Detection, optional
        This frame's detection, run in the track's direction; the longest one, where several are parts of the object.
        None while hidden, and where the tracker was given bare curves.
    inferred : tuple of (float, float)
        The intervals of the ``u`` of `curve`, ascending, that this frame does not show.
    confidence : float
        Confidence in the curve, in 0..1: 1 where it is seen, and less the longer ago the inferred part of it was seen.
    width : float, optional
        Of the object, px, when it was last seen; None where no detection told it.

    Raises
    ------
    InputError
        If a value is of another type or out of range.
    """

    id: int
    state: TrackState
    curve: BSplineCurve
    curve_3d: BSplineCurve | None
    hits: int
    misses: int
    detection: Detection | None
    inferred: tuple[tuple[float, float], ...] = ()
    confidence: float = 1.0
    width: float | None = None

    def __post_init__(self) -> None:
        check_type("state", self.state, TrackState)
        check_curve("curve", self.curve, 2)
        if self.curve_3d is not None:
            check_curve("curve_3d", self.curve_3d, 3)
        if self.detection is not None:
            check_type("detection", self.detection, Detection)
        set_fields(
            self,
            id=check_integer("id", self.id, 1, MAX_WHOLE),
            hits=check_integer("hits", self.hits, 0, MAX_WHOLE),
            misses=check_integer("misses", self.misses, 0, MAX_WHOLE),
            inferred=check_spans("inferred", self.inferred),
            confidence=check_number("confidence", self.confidence, 0.0, 1.0),
            width=None if self.width is None else check_number("width", self.width, 0.0, LARGEST),
        )

    @classmethod
    def _unchecked(
        cls,
        number: int,
        state: TrackState,
        curve: BSplineCurve,
        curve_3d: BSplineCurve | None,
        hits: int,
        misses: int,
        detection: Detection | None,
        inferred: tuple[tuple[float, float], ...],
        confidence: float,
        width: float | None,
    ) -> Track:
        """Make what the constructor makes, faster."""
        track = cls.__new__(cls)
        track.__dict__.update(
            id=number,
            state=state,
            curve=curve,
            curve_3d=curve_3d,
            hits=hits,
            misses=misses,
            detection=detection,
            inferred=inferred,
            confidence=confidence,
            width=width,
        )
        return track

    def to_dict(self) -> dict[str, Any]:
        """Return plain values, ready for JSON."""
        return {
            "id": self.id,
            "state": self.state.value,
            "hits": self.hits,
            "misses": self.misses,
            "curve": self.curve.to_dict(),
            "curve_3d": None if self.curve_3d is None else self.curve_3d.to_dict(),
            "inferred": [list(interval) for interval in self.inferred],
            "confidence": self.confidence,
            "width_px": self.width,
        }
