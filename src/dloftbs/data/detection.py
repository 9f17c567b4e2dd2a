"""Objects in one frame, and their crossings."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, cast

import numpy as np
import numpy.typing as npt

from dloftbs.camera import PinholeCamera
from dloftbs.data.centerline import Centerline, Joint, JointKind, NearJoint, Point, Segment
from dloftbs.data.curve import BSplineCurve, check_curve, spans_by_length
from dloftbs.data.deviation import WEIGHTS, WEIGHTS_3D, deviation, deviation_at, terms_in_image, terms_in_space
from dloftbs.data.inferred_spans import InferredSpans
from dloftbs.data.object_shape import ObjectShape
from dloftbs.data.u_mapping import to_image
from dloftbs.errors import InputError
from dloftbs.support.arrays import LARGEST, FloatArray, frozen
from dloftbs.support.values import (
    MAX_WHOLE,
    check_integer,
    check_number,
    check_pair,
    check_spans,
    check_text,
    check_type,
    extent_of,
    list_of,
    set_fields,
    shown,
    unchecked,
    values_of,
)

_MAX_PIXELS = 100_000
"""Largest number of points of a segment that is laid along a curve.

Source: bounds memory; only curves that leave the picture by far are so long.
"""

_Passes = tuple[tuple[int, float], tuple[int, float]]

NO_DEPTH = "the frame has no depth"
"""Reason for no curve in space where nobody asked for one."""


@dataclass(frozen=True, eq=False, repr=False)
class Detection(InferredSpans, ObjectShape):
    """One object in one frame.

    Parameters
    ----------
    centerline : Centerline
        The pixels that the curve was fitted to, and how they were linked.
    curve : BSplineCurve
        In the image, px.
    curve_3d : BSplineCurve, optional
        In the camera's frame, metres: the object's axis, or what was published, its surface. Its ``u`` is its own arc
        length in space, normalised, with hidden parts counted in; ``u = 0`` is at the same end as that of `curve`.
    no_3d_reason : str, optional
        Reason why there is no `curve_3d`.
    inferred_3d : tuple of (float, float)
        The intervals of the ``u`` of `curve_3d`, ascending, that no depth shows: under another cable or an occluder,
        in holes of the depth image, where depth was not to be believed, and beyond the last depth at an end.
    camera : PinholeCamera, optional
        The one that `curve_3d` is in the frame of.

    Raises
    ------
    InputError
        If a field has another type, or the intervals are not ascending in 0..1.
    """

    centerline: Centerline
    curve: BSplineCurve
    curve_3d: BSplineCurve | None = None
    no_3d_reason: str | None = None
    inferred_3d: tuple[tuple[float, float], ...] = field(default_factory=tuple)  # see `InferredSpans`
    camera: PinholeCamera | None = None

    def __post_init__(self) -> None:
        check_type("centerline", self.centerline, Centerline)
        check_curve("curve", self.curve, 2)
        if self.curve_3d is not None:
            check_curve("curve_3d", self.curve_3d, 3)
        if self.no_3d_reason is not None:
            set_fields(self, no_3d_reason=check_text("no_3d_reason", self.no_3d_reason))
        if self.camera is not None:
            check_type("camera", self.camera, PinholeCamera)
        set_fields(self, inferred_3d=check_spans("inferred_3d", self.inferred_3d))

    @classmethod
    def _unchecked(
        cls,
        centerline: Centerline,
        curve: BSplineCurve,
        curve_3d: BSplineCurve | None = None,
        no_3d_reason: str | None = None,
        fitted_inferred_3d: tuple[tuple[float, float], ...] = (),
        camera: PinholeCamera | None = None,
        depth_std_per_m: float | None = None,
    ) -> Detection:
        """Make what the constructor makes, faster, from intervals of the own parameter of the spline in space.

        What lifting knows besides is the mean deviation of 1 / depth along the object from a smooth line.
        """
        return unchecked(
            cls,
            centerline=centerline,
            curve=curve,
            curve_3d=curve_3d,
            no_3d_reason=no_3d_reason,
            _fitted_inferred_3d=fitted_inferred_3d,
            camera=camera,
            _depth_std_per_m=depth_std_per_m,
        )

    def __repr__(self) -> str:
        in_space = "" if self.curve_3d is None else f", {self.curve_3d.length:.4g} m in space"
        extent = extent_of(self.curve.length, "px", self.curve.closed)
        return f"Detection({extent}, {self.width_px:.3g} px wide, confidence {self.confidence:.2g}{in_space})"

    @property
    def width_px(self) -> float:
        """Width of the object: twice the median radius along the centre line."""
        return self.centerline.width_px

    @cached_property
    def joints(self) -> tuple[Joint, ...]:
        """Joints that link the segments, in order, with the spans of the ``u`` of `curve` that they cover."""
        joints = self.centerline.joints
        spans = spans_by_length(self.curve, tuple([joint.u for joint in joints]))
        return tuple([joint._over(span) for joint, span in zip(joints, spans, strict=True)])

    @property
    def near_joints(self) -> tuple[NearJoint, ...]:
        """Gaps that its ends may go on across, but that were not bridged: rather, or as far as known, it ends there."""
        return self.centerline.near_joints

    @cached_property
    def confidence(self) -> float:
        """The probability that it is a cable, all joints are right, no end goes on and no lump hides the course."""
        return self.centerline.confidence

    @property
    def existence(self) -> float:
        """The probability that it is a cable at all, and no debris or error of the segmentation, in 0..1."""
        return self.centerline.existence

    @property
    def inferred(self) -> tuple[tuple[float, float], ...]:
        """The intervals of the ``u`` of `curve` that were inferred across gaps of the mask rather than seen."""
        return tuple([joint.u for joint in self.joints if joint.kind is JointKind.GAP])

    def curve_std(self, u: npt.ArrayLike) -> FloatArray:
        """Return the standard deviation of points of `curve`, shape (...), px: of their distance from the true axis.

        Of 100 points, 68 are within one deviation, and 95 within two. Errors along the curve do not count, nor does
        another course of the object, which `confidence` is about. A detection that was read from a file does not know
        the noise of its pixels: its deviations are those of a clean mask.

        Raises
        ------
        InputError
            If a ``u`` is not on the curve.
        """
        at = self.curve.u_at(self.curve.t_at(u))
        terms = terms_in_image(self.curve, self.centerline, self.inferred, at.ravel())
        return deviation(terms, WEIGHTS).reshape(at.shape)

    def curve_3d_std(self, u_3d: npt.ArrayLike) -> FloatArray:
        """Return the standard deviation of points of `curve_3d`, shape (...), metres: of their distance from the axis.

        From that in the image, the noise of depth, and how far from measured depth a point was inferred. In the views
        of a rig it is that of the object in space: see `RigObject.curve_3d_std`.

        Raises
        ------
        InputError
            If a ``u`` is not on the curve, there is no curve in space, or it was read from a file, which has no camera.
        """
        curve, camera = self._placed()
        of_rig = self.__dict__.get("_rig_std_m")
        if of_rig is not None:
            return deviation_at(of_rig, curve, u_3d)
        at = curve.u_at(curve.t_at(u_3d))
        flat = np.mod(at.ravel(), 1.0) if curve.closed else at.ravel()
        noise = self.__dict__.get("_depth_std_per_m") or 0.0
        in_image = self.curve_std(to_image(flat, curve, camera))
        focal = math.sqrt(camera.fx * camera.fy)
        terms = terms_in_space(curve, self.inferred_3d, in_image, focal, self.width_px, noise, flat)
        return deviation(terms, WEIGHTS_3D).reshape(at.shape)

    def reversed(self) -> Detection:
        """Return the same object run the other way."""
        curve_3d = None if self.curve_3d is None else self.curve_3d.reversed()
        backwards = Detection._unchecked(
            self.centerline.reversed(),
            self.curve.reversed(),
            curve_3d,
            self.no_3d_reason,
            (),
            self.camera,
            self.__dict__.get("_depth_std_per_m"),
        )
        if "_rig_std_m" in self.__dict__:
            backwards.__dict__["_rig_std_m"] = self.__dict__["_rig_std_m"][::-1]
        for name in ("inferred_3d", "_fitted_inferred_3d"):
            if name in self.__dict__:
                backwards.__dict__[name] = tuple(
                    [(1.0 - high, 1.0 - low) for low, high in reversed(self.__dict__[name])]
                )
        return backwards

    def to_dict(self) -> dict[str, Any]:
        """Return plain values, ready for JSON."""
        return {
            "curve": self.curve.to_dict(),
            "curve_3d": None if self.curve_3d is None else self.curve_3d.to_dict(),
            "no_3d_reason": self.no_3d_reason,
            "inferred_3d": [list(interval) for interval in self.inferred_3d],
            "width_px": self.width_px,
            "confidence": self.confidence,
            "existence": self.existence,
            "joints": [joint.to_dict() for joint in self.joints],
            "near_joints": [near.to_dict() for near in self.near_joints],
        }

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Detection:
        """Build a detection from what `to_dict` gave, without loss.

        That has no pixels: the centre line lies on the curve, about a pixel from point to point, and `curve_std` is
        that of a clean mask. Nor has it a camera.

        Raises
        ------
        InputError
            If it is no dictionary, a key is missing or a value is wrong.
        """
        keys = "curve", "curve_3d", "no_3d_reason", "inferred_3d", "width_px", "confidence", "existence"
        shape, shape_3d, reason, inferred_3d, width, confidence, existence, rows, near = values_of(
            "a detection", data, *keys, "joints", "near_joints"
        )
        curve = BSplineCurve.from_dict(shape)
        check_curve("curve", curve, 2)
        joints = tuple([Joint.from_dict(row) for row in list_of("joints", rows)])
        near_joints = tuple([NearJoint.from_dict(row) for row in list_of("near_joints", near)])
        thick = check_number("width_px", width, 0.0, LARGEST)
        line = _line_along(curve, joints, near_joints, thick, confidence, existence)
        curve_3d = None if shape_3d is None else BSplineCurve.from_dict(shape_3d)
        detection = cls(line, curve, curve_3d, reason, inferred_3d)
        detection.__dict__.update(joints=joints, confidence=confidence)
        return detection


def _line_along(
    curve: BSplineCurve,
    joints: tuple[Joint, ...],
    near_joints: tuple[NearJoint, ...],
    width: float,
    confidence: object,
    existence: object,
) -> Centerline:
    """Return a centre line on a curve, of which only the joints, the width and two probabilities are known."""
    certainty = check_number("confidence", confidence, 0.0, 1.0)
    is_cable = check_number("existence", existence, 0.0, 1.0)
    ends = 1.0 - max((near.confidence for near in near_joints), default=0.0)
    known = math.prod((joint.confidence for joint in joints), start=ends * is_cable)
    edges = [0.0, *(edge for joint in joints for edge in joint.u), 1.0]
    segments, places = [], []
    for low, high in zip(edges[::2], edges[1::2], strict=True):
        count = min(max(math.ceil(abs(high - low) * curve.length), 1), _MAX_PIXELS) + 1
        places.append(np.linspace(low, high, count))
        segments.append(Segment(curve(places[-1]), np.full(count, 0.5 * width)))
    own = tuple([joint._over((float(low), float(high))) for joint in joints for low, high in [curve.t_at(joint.u)]])
    course = min(certainty / known, 1.0) if known > 0.0 else 0.0
    line = Centerline(tuple(segments), own, curve.closed, near_joints, course, is_cable)
    line.__dict__["u"] = frozen(curve.t_at(np.concatenate(places)))
    return line


@dataclass(frozen=True)
class Crossing:
    """Crossing of one object with another, or with itself, in the image.

    Parameters
    ----------
    position : (float, float)
        ``(x, y)`` px.
    passes : ((int, float), (int, float))
        The two that cross, each as the index of its detection in `FrameResult.detections` and the ``u`` in 0..1 of that
        detection's curve; the lower index first, and where both are of the same detection, the lower ``u``.
    top : int, optional
        Pass that lies on top, 0 or 1; None where that is not known.
    confidence : float
        Probability that `top` is right, from 0.6 on as `find_crossings` states it; 0 where it is not known.

    Raises
    ------
    InputError
        If a value is of another type or out of range.
    """

    position: Point
    passes: _Passes
    top: int | None = None
    confidence: float = 0.0

    def __post_init__(self) -> None:
        passes = self.passes
        if not isinstance(passes, tuple) or [len(one) if isinstance(one, tuple) else 0 for one in passes] != [2, 2]:
            raise InputError(f"passes must be two pairs (detection, u), got {shown(passes)}")
        set_fields(
            self,
            position=check_pair("position", self.position, -LARGEST, LARGEST),
            passes=tuple(
                (check_integer("detection of a pass", number, 0, MAX_WHOLE), check_number("u of a pass", u, 0.0, 1.0))
                for number, u in passes
            ),
            top=None if self.top is None else check_integer("top", self.top, 0, 1),
            confidence=check_number("confidence", self.confidence, 0.0, 1.0),
        )

    if not TYPE_CHECKING:  # where it would vouch for any name

        def __getattr__(self, name: str) -> Any:
            """Measure the curves once somebody asks where they cross: in most frames, nobody does."""
            fitted = self.__dict__.get("_fitted")
            if name != "passes" or fitted is None:
                raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
            passes = tuple([(number, float(curve.u_at(t))) for (number, t), curve in zip(*fitted, strict=True)])
            self.__dict__[name] = passes
            return passes

    def _fitted_passes(self, detections: Sequence[Detection]) -> _Passes:
        """Return the passes by the own parameters of the splines of the frame's detections."""
        fitted: tuple[_Passes, object] | None = self.__dict__.get("_fitted")
        if fitted is not None:
            return fitted[0]
        (a, u_a), (b, u_b) = self.passes
        return (a, float(detections[a].curve.t_at(u_a))), (b, float(detections[b].curve.t_at(u_b)))

    def to_dict(self) -> dict[str, Any]:
        """Return plain values, ready for JSON."""
        return {
            "position": list(self.position),
            "passes": [{"detection": detection, "u": u} for detection, u in self.passes],
            "top": self.top,
            "confidence": self.confidence,
        }

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Crossing:
        """Build a crossing from what `to_dict` gave, without loss.

        Raises
        ------
        InputError
            If it is no dictionary, a key is missing or a value is wrong.
        """
        position, rows, top, confidence = values_of("a crossing", data, "position", "passes", "top", "confidence")
        passes = [tuple(values_of("a pass", row, "detection", "u")) for row in list_of("passes", rows)]
        return cls(position, cast(_Passes, tuple(passes)), top, confidence)


def place_in(detections: Sequence[Detection], one: Detection) -> tuple[int | None, bool]:
    """Return which of some detections another one is, None for none of them, and whether it runs the other way."""
    wanted = one.curve.control_points
    for number, detection in enumerate(detections):
        control = detection.curve.control_points
        if np.array_equal(control, wanted):
            return number, False
        if np.array_equal(control[::-1], wanted):
            return number, True
    return None, False


def curves_of(found: Sequence[Detection | BSplineCurve]) -> list[BSplineCurve]:
    """Return the curves in the image of objects that a tracker is given.

    Raises
    ------
    InputError
        If an item is neither a detection nor a curve in the image.
    """
    if not isinstance(found, (tuple, list, Sequence)):  # the first two are recognised at once
        raise InputError(f"expected a sequence of Detection or BSplineCurve, got {shown(found)}")
    curves = []
    for item in found:
        curve = item.curve if isinstance(item, Detection) else item
        if not isinstance(curve, BSplineCurve) or curve.ndim != 2:
            raise InputError(f"expected a Detection or a BSplineCurve in the image (ndim 2), got {curve!r}")
        curves.append(curve)
    return curves
