"""Output of the pipeline: detections, crossings and tracks of one frame."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, overload

import numpy as np

from dloftbs._arrays import LARGEST
from dloftbs._text import readable
from dloftbs._values import (
    MAX_WHOLE,
    check_all,
    check_integer,
    check_number,
    check_size,
    check_stamp,
    check_text,
    check_type,
    count_of,
    set_fields,
    shown,
)
from dloftbs.centerline import Centerline
from dloftbs.detection import Crossing, Detection
from dloftbs.errors import InputError
from dloftbs.frame import Frame
from dloftbs.tracks import Track


@dataclass(frozen=True, eq=False, repr=False)
class FrameResult:
    """Detections, crossings and tracks of a frame; as a sequence it is its detections, and true if there are any.

    Parameters
    ----------
    detections : tuple of Detection
        In a fixed order: the same mask gives the same order.
    tracks : tuple of Track
        By id; tracks that are gone are not listed.
    reason : str, optional
        Reason why nothing was detected; None where something was.
    stage_ms : mapping of str to float
        Milliseconds that each stage took, in the order in which they ran.
    index, stamp, name
        As the frame has them.
    size : (int, int)
        ``(H, W)`` of the frame.
    crossings : tuple of Crossing
        Crossings of the detections with each other and themselves, by their passes.
    dropped : tuple of Centerline
        Detections beyond the known number of objects (`ObjectsConfig.objects`).
    frame : Frame, optional
        The frame itself, as `detect` keeps it and a stream does not; a notebook shows the curves over it.

    Raises
    ------
    InputError
        If a value is of another type or out of range.
    """

    detections: tuple[Detection, ...]
    tracks: tuple[Track, ...]
    reason: str | None
    size: tuple[int, int]
    stage_ms: Mapping[str, float] = field(default_factory=dict)
    index: int = 0
    stamp: float | None = None
    name: str = ""
    crossings: tuple[Crossing, ...] = ()
    dropped: tuple[Centerline, ...] = ()
    frame: Frame | None = None

    def __post_init__(self) -> None:
        set_fields(
            self,
            detections=check_all("detections", self.detections, Detection),
            tracks=check_all("tracks", self.tracks, Track),
            reason=None if self.reason is None else check_text("reason", self.reason),
            size=check_size("size", self.size, 0),
            index=check_integer("index", self.index, 0, MAX_WHOLE),
            stamp=check_stamp(self.stamp),
            name=check_text("name", self.name),
            crossings=check_all("crossings", self.crossings, Crossing),
            stage_ms=_stage_ms(self.stage_ms),
            dropped=check_all("dropped", self.dropped, Centerline),
        )
        if self.frame is not None:
            check_type("frame", self.frame, Frame)

    @classmethod
    def _unchecked(
        cls,
        detections: tuple[Detection, ...],
        tracks: tuple[Track, ...],
        reason: str | None,
        size: tuple[int, int],
        stage_ms: dict[str, float],
        index: int,
        stamp: float | None,
        name: str,
        crossings: tuple[Crossing, ...],
        dropped: tuple[Centerline, ...],
        frame: Frame | None = None,
    ) -> FrameResult:
        """Make what the constructor makes, faster."""
        result = cls.__new__(cls)
        result.__dict__.update(
            detections=detections,
            tracks=tracks,
            reason=reason,
            size=size,
            stage_ms=stage_ms,
            index=index,
            stamp=stamp,
            name=name,
            crossings=crossings,
            dropped=dropped,
            frame=frame,
        )
        return result

    @overload
    def __getitem__(self, index: int) -> Detection: ...

    @overload
    def __getitem__(self, index: slice) -> tuple[Detection, ...]: ...

    def __getitem__(self, index: int | slice) -> Detection | tuple[Detection, ...]:
        return self.detections[index]

    def __iter__(self) -> Iterator[Detection]:
        return iter(self.detections)

    def __len__(self) -> int:
        return len(self.detections)

    def __repr__(self) -> str:
        parts = [count_of(len(self.detections), "detection")]
        parts += [count_of(len(self.tracks), "track")] * bool(self.tracks)
        parts += [count_of(len(self.crossings), "crossing")] * bool(self.crossings)
        why = [] if self.reason is None else [shown(self.reason)]
        return f"FrameResult(frame {self.index}: {', '.join(parts + why)})"

    def _repr_png_(self) -> bytes:
        """Return what a notebook shows: the curves over the frame, or over nothing where it was not kept."""
        from dloftbs import viz

        return viz.as_png(viz.draw(np.zeros(self.size, np.bool_) if self.frame is None else self.frame, self))

    @property
    def total_ms(self) -> float:
        """Milliseconds of all stages together."""
        return sum(self.stage_ms.values())

    def to_dict(self) -> dict[str, Any]:
        """Return plain values, ready for JSON."""
        return {
            "index": self.index,
            "stamp": self.stamp,
            "name": readable(self.name),
            "size": list(self.size),
            "reason": self.reason,
            "detections": [detection.to_dict() for detection in self.detections],
            "crossings": [crossing.to_dict() for crossing in self.crossings],
            "dropped": [_dropped(line) for line in self.dropped],
            "tracks": [track.to_dict() for track in self.tracks],
            "stage_ms": dict(self.stage_ms),
        }


def _stage_ms(given: object) -> dict[str, float]:
    if not isinstance(given, Mapping):
        raise InputError(f"stage_ms must map stages to milliseconds, got {shown(given)}")
    return {
        check_text("a stage of stage_ms", stage): check_number("milliseconds of stage_ms", ms, 0.0, LARGEST)
        for stage, ms in given.items()
    }


def _dropped(line: Centerline) -> dict[str, Any]:
    """Return a description of an object that was dropped; without a curve, the ``u`` of its joints says nothing."""
    return {
        "start": line.points[0].tolist(),
        "end": line.points[-1].tolist(),
        "closed": line.closed,
        "width_px": line.width,
        "confidence": line.confidence,
    }
