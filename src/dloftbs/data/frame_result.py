"""Output of the pipeline: detections, crossings and tracks of one frame."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, cast, overload

from dloftbs.config import Roi, read_roi
from dloftbs.data.branch_point import BranchPoint
from dloftbs.data.detection import Crossing, Detection, place_in
from dloftbs.data.dropped import Dropped
from dloftbs.data.frame import Frame
from dloftbs.data.harness import Harness, Route
from dloftbs.data.presentation import outputs
from dloftbs.data.tracks import Track
from dloftbs.errors import InputError
from dloftbs.support.arrays import LARGEST
from dloftbs.support.text import readable
from dloftbs.support.values import (
    MAX_WHOLE,
    check_all,
    check_flag,
    check_integer,
    check_number,
    check_size,
    check_stamp,
    check_text,
    check_type,
    count_of,
    list_of,
    set_fields,
    shown,
    values_of,
)


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
    dropped : tuple of Dropped
        Objects that are rather no cables (`LinkingConfig.min_probability`), or exceed the known number of objects
        (`ObjectsConfig.objects`).
    frame : Frame, optional
        The frame itself, as `detect` keeps it and a stream does not; a notebook shows the curves over it.
    roi : tuple, optional
        Region of interest that alone was read, px of the frame: ``(x, y, w, h)``, or the corners ``((x, y), ...)`` of a
        polygon. None where all of the frame was read, and where the pipelines of a `PipelineGroup` have several ones.
    branch_points : tuple of BranchPoint
        Where three or more ends of detections meet; none unless objects may branch (`LinkingConfig.branched`).
    harnesses : tuple of Harness
        Detections by the objects that they are branches of, each in one; none unless objects may branch.
    diagnosis : tuple of str
        What is strange about the input, and what to do about it: a mask that is mostly set, a unit of depth in which
        cables have no plausible thickness, a stamp that two different frames share.

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
    dropped: tuple[Dropped, ...] = ()
    frame: Frame | None = None
    roi: Roi | None = None
    branch_points: tuple[BranchPoint, ...] = ()
    harnesses: tuple[Harness, ...] = ()
    diagnosis: tuple[str, ...] = ()

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
            stage_ms=checked_stage_ms(self.stage_ms),
            dropped=check_all("dropped", self.dropped, Dropped),
            roi=None if self.roi is None else read_roi(self.roi),
            branch_points=check_all("branch_points", self.branch_points, BranchPoint),
            harnesses=check_all("harnesses", self.harnesses, Harness),
            diagnosis=check_all("diagnosis", self.diagnosis, str),
        )
        if self.frame is not None:
            check_type("frame", self.frame, Frame)

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
        return outputs().result_png(self)

    @property
    def routes(self) -> tuple[Route, ...]:
        """Routes of all harnesses, in their order: of each from the end of its trunk to each other end.

        An object without branch points is one route; there are none unless objects may branch.
        """
        return tuple([route for harness in self.harnesses for route in harness.routes])

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
            "roi": None if self.roi is None else [one if isinstance(one, int) else list(one) for one in self.roi],
            "reason": self.reason,
            "detections": [detection.to_dict() for detection in self.detections],
            "crossings": [crossing.to_dict() for crossing in self.crossings],
            "dropped": [one.to_dict() for one in self.dropped],
            "tracks": [self._track(track) for track in self.tracks],
            "stage_ms": dict(self.stage_ms),
            **({"harnesses": [harness.to_dict() for harness in self.harnesses]} if self.harnesses else {}),
            **({"diagnosis": list(self.diagnosis)} if self.diagnosis else {}),
        }

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> FrameResult:
        """Build a result from what `to_dict` gave, or from a row of `sinks.read_json_lines`, without loss.

        What that leaves out is not there: pixels of the centre lines, cameras, velocities, and the frame. Without the
        pixels, `Detection.curve_std` is that of a clean mask. So `topology.Diagram.from_result` may take an order for
        known that was a guess before; the command's ``--with topology`` writes what the result itself says.

        Raises
        ------
        InputError
            If it is no dictionary, a key is missing or a value is wrong.
        """
        keys = "index", "stamp", "name", "size", "reason", "detections", "crossings", "dropped", "tracks", "stage_ms"
        index, stamp, name, size, reason, found, crossings, dropped, tracks, stage_ms, roi = values_of(
            "a result", data, *keys, "roi"
        )
        detections = tuple(Detection.from_dict(row) for row in list_of("detections", found))
        rows = list_of("harnesses", data.get("harnesses", ()))
        harnesses = tuple([Harness.from_dict(row, detections, number) for number, row in enumerate(rows)])
        return cls(
            detections,
            tuple(_track_of(row, detections) for row in list_of("tracks", tracks)),
            reason,
            size,
            stage_ms,
            index,
            stamp,
            name,
            tuple(Crossing.from_dict(row) for row in list_of("crossings", crossings)),
            tuple(Dropped.from_dict(row) for row in list_of("dropped", dropped)),
            roi=roi,
            branch_points=tuple([point for harness in harnesses for point in harness.branch_points]),
            harnesses=harnesses,
            diagnosis=tuple(list_of("diagnosis", data.get("diagnosis", ()))),
        )

    def _track(self, track: Track) -> dict[str, Any]:
        """Return the plain values of a track, with the number of its detection and whether it is run backwards."""
        number, is_reversed = self._place_of(track)
        return {**track.to_dict(), "detection": number, "reversed": is_reversed}

    def _place_of(self, track: Track) -> tuple[int | None, bool]:
        """Return which of `detections` a track holds, None for none, and whether it holds it run the other way."""
        return (None, False) if track.detection is None else place_in(self.detections, track.detection)

    def save(self, path: str | Path, frame: Frame | None = None) -> None:
        """Write the result into a file of the kind that its name says, as `sinks.open` opens it.

        Parameters
        ----------
        path : str or Path
            ``.jsonl``, ``.npz``, ``.csv``, ``.ply``, ``.usda``, ``.png`` and so on; an older file is replaced.
        frame : Frame, optional
            To draw on, where the result did not keep its own. Without either, the curves are drawn over nothing.

        Raises
        ------
        InputError
            If the suffix is unknown, or the file has the name of the frame, which it may be.
        SinkError
            If it cannot be written.
        """
        outputs().save(self, path, frame)

    def to_dataframe(self, samples: int = 100) -> Any:
        """Return the objects as a table of pandas, with the columns of a ``.csv``: a row for each point of each object.

        Parameters
        ----------
        samples : int
            Points an object, at equal distances along its curve.

        Returns
        -------
        pandas.DataFrame
            NaN where a frame has no stamp, or an object no curve in space. Tables of several frames are put together by
            `pandas.concat`.

        Raises
        ------
        InputError
            If pandas is not installed, or `samples` is no integer of at least 2.
        """
        return outputs().points_table(self, samples)

    def to_supervision(self) -> Any:
        """Return the objects as detections of supervision, whose annotators, trackers and metrics then take them.

        Tracks, or detections where there are no tracks, in their order; objects that the frame does not show are left
        out. `Frame(instances=...)` and `detect(instances=...)` read such detections.

        Returns
        -------
        supervision.Detections
            ``mask`` (N, H, W), bool: each curve drawn with the object's width, without inferred parts; ``xyxy`` its
            box; ``confidence``; ``class_id`` 0 and the data ``class_name`` "cable"; ``tracker_id`` the ids of tracks;
            the data ``length_px``, and ``length_m``, NaN without a curve in space.

        Raises
        ------
        InputError
            If supervision is not installed.
        """
        return outputs().supervision_detections(self)

    def plot(self, ax: Any = None) -> Any:
        """Draw the curves into axes of matplotlib, over the frame where the result kept it, in pixels.

        A dot is the start of a curve, a ring its end; dashed is what was inferred. The legend has ids and lengths.

        Parameters
        ----------
        ax : matplotlib.axes.Axes, optional
            By default the axes of a new figure.

        Returns
        -------
        matplotlib.axes.Axes

        Raises
        ------
        InputError
            If matplotlib is not installed, or `ax` is no axes.
        """
        return outputs().plot(self, ax)


def checked_stage_ms(given: object) -> dict[str, float]:
    """Return the milliseconds of stages, checked.

    Raises
    ------
    InputError
        If it is no mapping from texts to such numbers.
    """
    if not isinstance(given, Mapping):
        raise InputError(f"stage_ms must map stages to milliseconds, got {shown(given)}")
    return {
        check_text("a stage of stage_ms", stage): check_number("milliseconds of stage_ms", ms, 0.0, LARGEST)
        for stage, ms in given.items()
    }


def _track_of(row: object, detections: tuple[Detection, ...]) -> Track:
    number, is_reversed = values_of("a track", row, "detection", "reversed")
    if number is None:
        return Track.from_dict(cast("Mapping[str, Any]", row))
    detection = detections[check_integer("the detection of a track", number, 0, len(detections) - 1)]
    backwards = check_flag("reversed", is_reversed)
    return Track.from_dict(cast("Mapping[str, Any]", row), detection.reversed() if backwards else detection)
