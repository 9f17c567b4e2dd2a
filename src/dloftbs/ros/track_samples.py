"""Points along tracks, for messages."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from dloftbs.data.frame_result import FrameResult
from dloftbs.data.spans import inside
from dloftbs.data.tracks import Track, TrackState
from dloftbs.errors import InputError
from dloftbs.support.array_likes import as_array
from dloftbs.support.arrays import BoolArray, FloatArray, as_points, as_vector
from dloftbs.support.values import check_type, set_fields, shown

SAMPLES = 100
"""Points a curve, as in tables of points."""


@dataclass(frozen=True, eq=False)
class SampledTrack:
    """Points along a track, evenly spaced by `u`.

    Parameters
    ----------
    track : Track
    points : numpy.ndarray, shape (n, 2) px or (n, 3) m
    s : numpy.ndarray, shape (n,)
        Length from the start, in the unit of the points.
    inferred : numpy.ndarray, shape (n,), bool
        Points that the frame does not show.

    Raises
    ------
    InputError
        If one is of another type, or there are not as many of each.
    """

    track: Track
    points: FloatArray
    s: FloatArray
    inferred: BoolArray

    def __post_init__(self) -> None:
        check_type("track", self.track, Track)
        points = as_points("points", self.points)
        inferred = as_array("inferred", self.inferred)
        if inferred.shape != (len(points),) or inferred.dtype != np.bool_:
            raise InputError(f"inferred must be {len(points)} of bool, got {inferred.shape} of {inferred.dtype}")
        set_fields(self, points=points, s=as_vector("s", self.s, len(points)), inferred=inferred)


def objects_of(result: FrameResult) -> tuple[Track, ...]:
    """Return the tracks of a result; where it has none, its detections as such, numbered from 1."""
    check_type("result", result, FrameResult)
    if result.tracks:
        return result.tracks
    return tuple(
        Track(
            number,
            TrackState.CONFIRMED,
            found.curve,
            found.curve_3d,
            1,
            0,
            found,
            found.inferred,
            found.confidence,
            found.width_px,
            camera=found.camera,
        )
        for number, found in enumerate(result.detections, start=1)
    )


def sample_px(track: Track) -> SampledTrack:
    """Return points along a track in the image.

    Raises
    ------
    InputError
        If it is no track.
    """
    check_type("track", track, Track)
    u = np.linspace(0.0, 1.0, SAMPLES)
    return SampledTrack(track, track.curve(u), u * track.curve.length, inside(u, track.inferred))


def sample_m(track: Track) -> SampledTrack | None:
    """Return points along a track in space; None where it has no curve there.

    Raises
    ------
    InputError
        If it is no track.
    """
    check_type("track", track, Track)
    curve = track.curve_3d
    if curve is None:
        return None
    u = np.linspace(0.0, 1.0, SAMPLES)
    return SampledTrack(track, curve(u), u * curve.length, inside(u, track.inferred_3d))


def sampled_m(result: FrameResult) -> Iterator[SampledTrack]:
    """Yield the points of all objects of a result that have a curve in space.

    Raises
    ------
    InputError
        If it is no result.
    """
    for track in objects_of(result):
        sample = sample_m(track)
        if sample is not None:
            yield sample


def checked_samples(samples: Iterable[SampledTrack], dims: int) -> tuple[SampledTrack, ...]:
    """Return the points of tracks as a tuple.

    Raises
    ------
    InputError
        If they are something else, or have other dimensions.
    """
    if not isinstance(samples, Iterable):
        raise InputError(f"samples must be some of SampledTrack, got {shown(samples)}")
    checked = tuple(samples)
    for sample in checked:
        check_type("a sample", sample, SampledTrack)
        if sample.points.shape[1] != dims:
            raise InputError(f"the points of a sample must have {dims} dimensions, got {sample.points.shape[1]}")
    return checked
