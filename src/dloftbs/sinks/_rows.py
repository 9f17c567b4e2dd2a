"""The rows of the tabular sinks: one per object and frame."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from dloftbs.camera import PinholeCamera
from dloftbs.data.curve import BSplineCurve
from dloftbs.data.detection import Detection
from dloftbs.data.frame_result import FrameResult
from dloftbs.data.tracks import Track

NO_TRACK = 0
"""The track id of a row that is only a detection; tracks count from 1."""
NO_DETECTION = -1
"""The detection number of a track that no detection of its frame belongs to."""


@dataclass(frozen=True)
class ObjectRow:
    """One object in one frame: a track where the result has tracks, else a detection."""

    track_id: int
    number: int
    state: str
    curve: BSplineCurve
    curve_3d: BSplineCurve | None
    detection: Detection | None
    camera: PinholeCamera | None
    source: Detection | Track

    @property
    def name(self) -> int:
        """The track's id, or the detection's number."""
        return self.track_id or self.number


def object_rows(result: FrameResult) -> Iterator[ObjectRow]:
    """Yield the rows of a result, in its order."""
    for track in result.tracks:
        place = result._place_of(track)[0]
        number, state = NO_DETECTION if place is None else place, track.state.value
        yield ObjectRow(track.id, number, state, track.curve, track.curve_3d, track.detection, track.camera, track)
    if not result.tracks:
        for number, found in enumerate(result.detections):
            yield ObjectRow(NO_TRACK, number, "", found.curve, found.curve_3d, found, found.camera, found)
