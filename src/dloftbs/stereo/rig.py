"""Two or more cameras with known poses, which see curves in space together."""

from __future__ import annotations

import copy
import itertools
import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from time import perf_counter
from typing import Any, cast

import numpy as np
import numpy.typing as npt

from dloftbs.camera import CameraLike, PinholeCamera, as_camera, inverse_of, is_rotation, read_rig
from dloftbs.config import Colour, ConfigLike, RoiLike
from dloftbs.data.curve import BSplineCurve
from dloftbs.data.detection import Detection
from dloftbs.data.frame import Frame, as_frame
from dloftbs.data.frame_result import FrameResult
from dloftbs.errors import InputError
from dloftbs.kernels import preparation
from dloftbs.pipeline import Pipeline
from dloftbs.segmentation import Segmenter
from dloftbs.stereo.cable_colours import colour_costs
from dloftbs.stereo.doubts import RigDoubts
from dloftbs.stereo.rig_objects import RigObjects, associate
from dloftbs.stereo.rig_result import RigObject, RigResult
from dloftbs.stereo.shutters import Steps
from dloftbs.stereo.space_fit import Pose, RigErrors
from dloftbs.stereo.view_curves import curves_of_views
from dloftbs.stereo.view_groups import Group, RigGeometry
from dloftbs.support.array_likes import as_array
from dloftbs.support.arrays import AnyArray, FloatArray, as_float_array, as_numbers, frozen
from dloftbs.support.values import check_flag, check_number, check_path, list_of, shown

FARTHEST_M = 10.0
"""Largest distance between two cameras of a rig, metres.

Source: by hand; a baseline of 10 mm in the wrong unit is 10 m.
"""

_MOST_ROTATION_DEG, _MOST_PIXELS, _MOST_SECONDS = 45.0, 1000.0, 1.0
"""Largest standard deviations that are taken, degrees, px and s.

Source: by hand; what is larger is a wrong unit.
"""

View = Frame | npt.ArrayLike | str | os.PathLike[str]
"""An image or a mask of one view, its file, or a whole frame."""


@dataclass(frozen=True, eq=False, repr=False, init=False)
class CameraRig:
    """Cameras that look at the same cables, each with its pose.

    Parameters
    ----------
    cameras : sequence of PinholeCamera
        Two or more, in the order of the views; also what `PinholeCamera` is made of elsewhere: K, or a file. One camera
        alone is enough where it moves: see `detect`.
    poses : sequence of array_like, each of shape (4, 4)
        Pose of each camera in the frame of the rig, as TF and forward kinematics give it: ``p_rig = pose @ p_camera``,
        in metres, with a camera's x to the right, y down and z forward (its optical frame). May be left out for one
        camera. Results are in the frame of the first camera, whatever that of the rig is.
    rotation_std_deg : float
        Standard deviation of the rotations between the cameras, about each axis, degrees. It enters the stated
        deviations of curves, and lets views match that are off by as much.
    pixel_std : float
        Standard deviation of each camera's principal point, px; likewise.
    time_std_s : float
        Standard deviation of the time between two views' stamps, s, as of cameras that stamp what arrives. In a stream
        it enters the stated deviations of what moves.
    triggered : bool
        Whether all cameras expose at once, whatever their stamps say. Otherwise a `StereoPipeline` moves what a view
        shows along with its track, to the time of the first view.

    Attributes
    ----------
    cameras : tuple of PinholeCamera
    poses : tuple of numpy.ndarray
        Read-only.

    Raises
    ------
    InputError
        If a value is of a wrong type or shape, a pose is none, two cameras are at one place, or they are so far apart
        that their poses are rather in millimetres.
    SourceError
        If the file of a camera cannot be read.
    """

    cameras: tuple[PinholeCamera, ...]
    poses: tuple[FloatArray, ...]
    rotation_std_deg: float
    pixel_std: float
    time_std_s: float
    triggered: bool

    def __init__(
        self,
        cameras: Sequence[CameraLike],
        poses: Sequence[npt.ArrayLike] | None = None,
        *,
        rotation_std_deg: float = 0.0,
        pixel_std: float = 0.0,
        time_std_s: float = 0.0,
        triggered: bool = False,
    ) -> None:
        if not isinstance(cameras, (list, tuple)) or not cameras:
            raise InputError(f"cameras must be a list of PinholeCamera, one for each view, got {shown(cameras)}")
        put = object.__setattr__
        put(self, "cameras", tuple(as_camera(camera) for camera in cameras))
        if poses is None:
            if len(self.cameras) > 1:
                raise InputError(
                    f"{len(self.cameras)} cameras need their poses: CameraRig(cameras, poses), each 4 x 4 and metres"
                )
            poses = [np.eye(4)]
        put(self, "poses", _checked_poses(poses, len(self.cameras)))
        put(self, "rotation_std_deg", check_number("rotation_std_deg", rotation_std_deg, 0.0, _MOST_ROTATION_DEG))
        put(self, "pixel_std", check_number("pixel_std", pixel_std, 0.0, _MOST_PIXELS))
        put(self, "time_std_s", check_number("time_std_s", time_std_s, 0.0, _MOST_SECONDS))
        put(self, "triggered", check_flag("triggered", triggered))

    @classmethod
    def from_file(
        cls,
        path: str | Path,
        *more: str | Path,
        rectified: bool = False,
        rotation_std_deg: float | None = None,
        pixel_std: float | None = None,
        time_std_s: float | None = None,
        triggered: bool | None = None,
    ) -> CameraRig:
        """Read a rig from YAML, JSON or XML.

        Understood are our own (see `to_dict`), where a camera's pose may also be ``translation_m`` with ``rpy`` as of
        URDF, or with ``quaternion_xyzw`` as of TF; Kalibr's camchain; what OpenCV's stereoCalibrate returns as its
        samples write it (M1, D1, M2, D2 and R, T, in one file or two); and two camera_info of ROS, left and right.

        Parameters
        ----------
        path, *more : str or Path
        rectified : bool
            Of camera_info: whether the images are rectified, and have the intrinsics of P and no lens.
        rotation_std_deg, pixel_std, time_std_s : float, optional
            As the constructor has them; what a file of our own says without it.
        triggered : bool, optional
            Likewise.

        Raises
        ------
        InputError
            If it is no path.
        SourceError
            If a file cannot be read or holds no rig.
        """
        paths = [check_path("path", one) for one in (path, *more)]
        (cameras, poses), others = read_rig(paths, rectified=rectified)
        given = {
            "rotation_std_deg": rotation_std_deg,
            "pixel_std": pixel_std,
            "time_std_s": time_std_s,
            "triggered": triggered,
        }
        told = {key: others[key.replace("_", "")] for key in given if key.replace("_", "") in others}
        return cls(cameras, poses, **told | {key: value for key, value in given.items() if value is not None})

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> CameraRig:
        """Build a rig from what `to_dict` returns.

        Raises
        ------
        InputError
            If it is no dictionary, a key is missing or a value is wrong.
        """
        if not isinstance(data, Mapping) or "cameras" not in data:
            raise InputError(f"a rig needs a dictionary with cameras, as of to_dict, got {shown(data)}")
        rows = [dict(row) if isinstance(row, Mapping) else row for row in list_of("cameras", data["cameras"])]
        for row in rows:
            if not isinstance(row, dict) or "pose" not in row:
                raise InputError(f"each camera of a rig needs its pose, got {shown(row)}")
        poses = [row.pop("pose") for row in rows]
        cameras = [PinholeCamera.from_dict(row) for row in rows]
        others = ("rotation_std_deg", "pixel_std", "time_std_s", "triggered")
        return cls(cameras, poses, **{key: data[key] for key in others if key in data})

    def to_dict(self) -> dict[str, Any]:
        """Return plain values, ready for JSON and YAML, which `from_dict` and `from_file` take back."""
        return {
            "cameras": [
                {**camera.to_dict(), "pose": pose.tolist()}
                for camera, pose in zip(self.cameras, self.poses, strict=True)
            ],
            "rotation_std_deg": self.rotation_std_deg,
            "pixel_std": self.pixel_std,
            "time_std_s": self.time_std_s,
            "triggered": self.triggered,
        }

    def __repr__(self) -> str:
        apart = ", ".join(f"{1e3 * float(np.linalg.norm(pose.shift)):.4g} mm" for pose in self._geometry.steps[0][1:])
        return f"CameraRig({len(self.cameras)} cameras{f', {apart} from the first' if apart else ''})"

    @cached_property
    def _geometry(self) -> RigGeometry:
        return self._geometry_of(self.cameras, self.poses)

    def _geometry_of(self, cameras: tuple[PinholeCamera, ...], poses: Sequence[FloatArray]) -> RigGeometry:
        errors = RigErrors(self.rotation_std_deg, self.pixel_std)
        steps = []
        for start in poses:
            made = [inverse_of(pose) @ start for pose in poses]
            steps.append(tuple(Pose(np.ascontiguousarray(one[:3, :3]), one[:3, 3].copy()) for one in made))
        focals = tuple(math.sqrt(camera.fx * camera.fy) for camera in cameras)
        rotations = np.stack([[pose.rotation for pose in own] for own in steps])
        shifts = np.stack([[pose.shift for pose in own] for own in steps])
        return RigGeometry(cameras, tuple(steps), errors, focals, rotations, shifts)

    def project(self, points_m: npt.ArrayLike) -> tuple[FloatArray, ...]:
        """Project points in the frame of the first camera to the images of all.

        Parameters
        ----------
        points_m : array_like, shape (..., 3)

        Returns
        -------
        tuple of numpy.ndarray, each of shape (..., 2)
            px; NaN beyond the field of a lens.

        Raises
        ------
        InputError
            If the last axis is not 3 or a point is not in front of a camera.
        """
        points = as_numbers("points_m", points_m)
        if points.ndim < 1 or points.shape[-1] != 3:
            raise InputError(f"points_m must have shape (..., 3), got {points.shape}")
        pairs = zip(self.cameras, self._geometry.steps[0], strict=True)
        return tuple(camera.project(points @ pose.rotation.T + pose.shift) for camera, pose in pairs)

    def detect(
        self,
        views: Sequence[View],
        *,
        hsv: Colour | None = None,
        mask: Sequence[npt.ArrayLike] | None = None,
        depth: Sequence[npt.ArrayLike] | None = None,
        depth_unit_m: float | None = None,
        objects: int | None = None,
        config: ConfigLike | None = None,
        segmenter: Segmenter | str | os.PathLike[str] | None = None,
        roi: RoiLike | None = None,
        mask_is: str | None = None,
        poses: Sequence[npt.ArrayLike] | None = None,
    ) -> RigResult:
        """Find the objects of one moment in all views, and where they are in space, without memory.

        Parameters
        ----------
        views : sequence of array_like, str, path or Frame
            One for each camera, in the rig's order: masks or BGR images as `dloftbs.detect` takes them. Pictures are
            read as stored, since their cameras go with them.
        hsv, objects, config, segmenter, roi, mask_is
            As `dloftbs.detect` has them, for all views.
        mask : sequence of array_like, optional
            A mask (H, W) for each view, beside images.
        depth : sequence of array_like, optional
            Depth (H, W) for each view, registered to it.
        depth_unit_m : float, optional
            As `Frame` has it.
        poses : sequence of array_like, each of shape (4, 4), optional
            In place of the rig's own, in its convention: where each view was taken from, as of one camera that moves
            before a scene that stays still. A rig of one camera then takes any number of views.

        Returns
        -------
        RigResult

        Raises
        ------
        InputError
            If there are not as many views as cameras, sizes differ from those of the cameras, a pose is none; and as
            `dloftbs.detect`.
        ConfigError, SourceError
            As `dloftbs.detect`.
        """
        pipeline = Pipeline(config, hsv=hsv, objects=objects, segmenter=segmenter, roi=roi, mask_is=mask_is)
        geometry = self._for(views, poses)
        frames = self._frames(views, geometry.cameras, pipeline, mask=mask, depth=depth, depth_unit_m=depth_unit_m)
        found = [pipeline._detect_with_mask(frame) for frame in frames]
        return self._combine(
            [result for result, _ in found], [own for _, own in found], frames, geometry, RigDoubts(lasting=False)
        )[0]

    def _for(self, views: Sequence[View], poses: Sequence[npt.ArrayLike] | None = None) -> RigGeometry:
        """Return the geometry of views, of which there must be as many as cameras or poses."""
        if not isinstance(views, (list, tuple)):
            raise InputError(f"views must be a list, one image, mask or frame for each camera, got {shown(views)}")
        count = len(views)
        if count < 2:
            raise InputError(f"a rig needs two views or more of one moment, got {count}")
        if len(self.cameras) not in (count, 1 if poses is not None else count):
            raise InputError(
                f"views must be as many as the rig's cameras, {len(self.cameras)}, got {count}"
                + ("; a camera that moves needs poses=, one for each view" if len(self.cameras) == 1 else "")
            )
        if poses is None:
            return self._geometry
        cameras = self.cameras if len(self.cameras) == count else self.cameras * count
        return self._geometry_of(cameras, _checked_poses(poses, count))

    def _frames(
        self,
        views: Sequence[View],
        cameras: Sequence[PinholeCamera],
        pipeline: Pipeline,
        *,
        mask: Sequence[npt.ArrayLike] | None = None,
        depth: Sequence[npt.ArrayLike] | None = None,
        depth_unit_m: float | None = None,
        index: int = 0,
    ) -> list[Frame]:
        """Return a frame for each view, with its camera.

        Raises
        ------
        InputError, SourceError
            As `detect`.
        """
        from dloftbs.sources.one_frame import read_frame
        from dloftbs.sources.pixels import kind_for

        beside = {"mask": mask, "depth": depth}
        for name, given in beside.items():
            if given is not None and (not isinstance(given, (list, tuple)) or len(given) != len(views)):
                raise InputError(f"{name} must be a list, one for each of {len(views)} views, got {shown(given)}")
        frames = []
        known = pipeline.config.segmentation.mask_is
        for number, (view, camera) in enumerate(zip(views, cameras, strict=True)):
            if isinstance(view, (str, os.PathLike)):
                kind = kind_for("auto", segmented=pipeline.segments_images and mask is None)
                frame = replace(read_frame(view, kind, known, as_stored=True), index=index)
            else:
                grey = pipeline.segments_images and mask is None
                frame = as_frame(cast("Frame | npt.ArrayLike", view), index, grey_as_image=grey, mask_is=known)
            own: dict[str, Any] = {name: given[number] for name, given in beside.items() if given is not None}
            if depth_unit_m is not None:
                own["depth_unit_m"] = depth_unit_m
            try:
                camera.check_size(frame.size)
                frames.append(_with_camera(replace(frame, **own) if own else frame, camera))
            except InputError as error:
                raise InputError(f"view {number}: {error}") from error
        sizes = {frame.size for frame in frames}
        if len(sizes) > 1 and any(camera.size is None for camera in cameras):
            raise InputError(
                f"the views have the sizes {', '.join(map(str, sorted(sizes)))} (rows, columns), and the cameras do "
                "not say which they are for: PinholeCamera(..., size=(H, W)), or camera.scaled(size) for resized images"
            )
        return frames

    def _combine(
        self,
        results: Sequence[FrameResult],
        masks: Sequence[AnyArray],
        frames: Sequence[Frame],
        geometry: RigGeometry,
        doubts: RigDoubts,
        carried: Mapping[tuple[int, int], FloatArray] | None = None,
        steps: Sequence[Steps] | None = None,
    ) -> tuple[RigResult, tuple[Group, ...]]:
        """Return the objects in space of what the views show by themselves, and the groups that made them.

        Parameters
        ----------
        results, masks, frames : sequence
            Of each view.
        geometry : RigGeometry
        doubts : RigDoubts
            Of the same rig at earlier moments.
        carried : mapping of (int, int) to numpy.ndarray, optional
            Costs that earlier moments give to pairs of detections of two views.
        steps : sequence of sequence, optional
            For each view how far its detections are to be moved; see `dloftbs.stereo.shutters`.
        """
        preparation.prepare(("stereo", "kernels"))
        since = perf_counter()
        steps = [[None] * len(result.detections) for result in results] if steps is None else steps
        curves = curves_of_views(results, masks, geometry.cameras, steps)
        found = associate(results, curves, geometry, colour_costs(results, frames), carried or {})
        doubt = doubts.about_poses(curves, geometry, found.groups)
        if doubt is not None:
            found = RigObjects(
                tuple(
                    RigObject(one.members, None, doubt, confidence=one.confidence, pieces=one.pieces)
                    for one in found.objects
                ),
                found.groups,
            )
        doubts.about_unit(found.objects)
        views = tuple(_with_space(view, result, found, geometry) for view, result in enumerate(results))
        stage_ms = {"stereo": 1e3 * (perf_counter() - since)}
        combined = RigResult(views, found.objects, (), stage_ms, results[0].index, results[0].stamp)
        return combined, found.groups


def _with_camera(frame: Frame, camera: PinholeCamera) -> Frame:
    """Return a frame with a camera that suits its size; all else was checked before."""
    seen = copy.copy(frame)
    object.__setattr__(seen, "camera", camera)
    return seen


def _with_space(view: int, result: FrameResult, found: RigObjects, geometry: RigGeometry) -> FrameResult:
    """Return the result of a view whose detections have their curves in space, in its own camera's frame."""
    detections = list(result.detections)
    pose, camera = geometry.steps[0][view], geometry.cameras[view]
    for one, group in zip(found.objects, found.groups, strict=True):
        match = group.matches.get(view)
        if match is None:
            continue
        if one.curve_3d is None:
            for number in one.pieces[view]:
                part = detections[number]
                if part.curve_3d is None:
                    detections[number] = Detection._unchecked(part.centerline, part.curve, None, one.no_3d_reason)
            continue
        if len(group.matches) < 2:
            continue
        for number in one.pieces[view]:
            if number != match.second:
                part = detections[number]
                reason = f"it is a part of the object of detection {match.second}, which has its curve in space"
                detections[number] = Detection._unchecked(part.centerline, part.curve, None, reason)
        own = detections[match.second]
        run = one.reversed() if match.backwards else one
        curve = run.curve_3d
        assert curve is not None  # it has one either way
        if view > 0:
            control = curve.control_points @ pose.rotation.T + pose.shift
            curve = BSplineCurve._unchecked(curve.knots, control, curve.degree, curve.closed)
        made = Detection._unchecked(own.centerline, own.curve, curve, None, run.__dict__["_fitted_inferred_3d"], camera)
        made.__dict__["_rig_std_m"] = run.std_m
        detections[match.second] = made
    return _with_detections(result, tuple(detections))


def _with_detections(result: FrameResult, detections: tuple[Detection, ...]) -> FrameResult:
    """Return the result of a view with detections that have other curves in space, also in its tracks and harnesses."""
    tracks = []
    for track in result.tracks:
        number, backwards = result._place_of(track)
        if number is not None and detections[number] is not result.detections[number]:
            own = detections[number].reversed() if backwards else detections[number]
            tracks.append(track._with_detection(own))
        else:
            tracks.append(track)
    seen = copy.copy(result)
    object.__setattr__(seen, "detections", detections)
    object.__setattr__(seen, "tracks", tuple(tracks))
    object.__setattr__(seen, "harnesses", tuple(replace(one, detections=detections) for one in result.harnesses))
    return seen


def _checked_poses(poses: Sequence[npt.ArrayLike], count: int) -> tuple[FloatArray, ...]:
    """Return poses as read-only arrays.

    Raises
    ------
    InputError
        If they are not as many, one is no pose, or the distances between them are none of a rig in metres.
    """
    if not isinstance(poses, (list, tuple, np.ndarray)) or len(poses) != count:
        given = len(poses) if isinstance(poses, (list, tuple, np.ndarray)) else shown(poses)
        raise InputError(f"poses must be {count}, one (4, 4) for each camera or view, got {given}")
    checked = [_checked_pose(f"pose {number}", pose) for number, pose in enumerate(poses)]
    for (first, one), (second, other) in itertools.combinations(enumerate(checked), 2):
        apart = float(np.linalg.norm(one[:3, 3] - other[:3, 3]))
        if apart > FARTHEST_M:
            raise InputError(
                f"poses must be in metres: cameras {first} and {second} would be {apart:.4g} m apart; if they are in "
                "millimetres, divide their translations by 1000"
            )
        if apart == 0.0:
            raise InputError(
                f"cameras {first} and {second} are at the same place, from where nothing shows how far away a cable "
                "is: poses are 4 x 4, with the camera's place in metres in the last column"
            )
    return tuple(checked)


def _checked_pose(name: str, pose: npt.ArrayLike) -> FloatArray:
    array = as_array(name, pose)
    if array.shape != (4, 4):
        raise InputError(f"{name} must have shape (4, 4), got {array.shape}")
    matrix = as_float_array(name, array)
    rotation = matrix[:3, :3]
    if not is_rotation(rotation):
        raise InputError(f"{name} must have a rotation, R R^T = 1 and det R = 1, got {rotation.tolist()}")
    if not np.allclose(matrix[3], (0.0, 0.0, 0.0, 1.0), rtol=0.0, atol=1e-9):
        raise InputError(f"the last row of {name} must be 0 0 0 1, got {matrix[3].tolist()}")
    # Few digits leave a rotation that stretches a little; the nearest one does not.
    left, _, right = np.linalg.svd(rotation)
    nearest = matrix.copy()
    nearest[:3, :3] = left @ right
    return frozen(nearest)
