"""Ends of tracks that a gripper holds."""

from __future__ import annotations

import numpy as np

from dloftbs.camera import PinholeCamera
from dloftbs.data.curve import BSplineCurve
from dloftbs.data.frame_result import FrameResult
from dloftbs.data.tracks import EndKind, Track
from dloftbs.support.arrays import FloatArray
from dloftbs.support.values import varied


def with_held_ends(result: FrameResult, grippers: FloatArray, camera: PinholeCamera | None) -> FrameResult:
    """Return a result in which the ends that a gripper holds are of the kind `EndKind.HELD`.

    Parameters
    ----------
    result : FrameResult
    grippers : numpy.ndarray, shape (n, 4)
        As `Frame.grippers`.
    camera : PinholeCamera, optional
        Without it, only tracks with a curve in space have held ends.
    """
    spheres = grippers[grippers[:, 2] > 0.0]
    tracks = tuple([_marked(track, spheres, camera) for track in result.tracks])
    return varied(result, tracks=tracks)


def _marked(track: Track, grippers: FloatArray, camera: PinholeCamera | None) -> Track:
    """Return the track as it is where no end is held."""
    if track.ends is None:
        return track
    if track.curve_3d is not None:
        held = _held(track.curve_3d, grippers[:, :3], grippers[:, 3])
    elif camera is not None:
        scale = np.sqrt(camera.fx * camera.fy) / grippers[:, 2]
        held = _held(track.curve, camera.project(grippers[:, :3]), scale * grippers[:, 3])
    else:
        return track
    ends = [EndKind.HELD if is_held else end for end, is_held in zip(track.ends, held, strict=True)]
    if not any(held):
        return track
    return varied(track, ends=(ends[0], ends[1]))


def _held(curve: BSplineCurve, centres: FloatArray, radii: FloatArray) -> list[bool]:
    """Return whether each end of a curve lies within a radius (n,) of a centre (n, ndim); NaN holds nothing."""
    return [bool((np.linalg.norm(centres - end, axis=1) <= radii).any()) for end in (curve.start, curve.end)]
