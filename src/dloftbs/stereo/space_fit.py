"""One curve in space of the curves that several views have of an object, with its standard deviation."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.interpolate import BSpline

from dloftbs.data.curve import BSplineCurve
from dloftbs.kernels.cubic_samples import sample_cubic
from dloftbs.stereo.kernels.epipolar_paths import WIDTH_STD, triangulate_path
from dloftbs.stereo.kernels.space_fit import BAND, ORDER, deviations, fit_points, fit_views
from dloftbs.stereo.view_curves import ViewCurve
from dloftbs.support.arrays import FloatArray, frozen

_BENDING = 10.0
"""Spectral density of the second derivative by arc length that a cable is expected to have, 1 / m.

Source: by hand; bends of a radius of 0.2 m that change over 0.2 m.
"""

_MOST_PX = 2.0
"""Residual beyond which an observation counts less, px.

Source: by hand; a rig that is wrong by 0.1 degree at 900 px has 0.8 px in each view.
"""

_START_STD_PX = 0.5
"""Standard deviation of the rough start, px.

Source: by hand; a chord between two nodes lies as far beside the curve.
"""

_LEAST_SHARE = 0.2
"""Least inverse depth of the start, as a share of the mean.

Source: by hand; no cable is five times as far away in one part as on the whole.
"""

_WIDTH_STDS = 3.0
"""Difference of the widths in two views beyond which they show two things, standard deviations.

Source: by hand; a thousandth of Gaussian errors is larger.
"""

_RADIUS_STD_PX = 0.3
"""Standard deviation of half the width of a mask, px.

Source: geometry; a mask's border is right to the root of a twelfth of a pixel.
"""

_ITERATIONS = 4
"""Number of Gauss's and Newton's steps.

Source: measured; more steps move no curve by 0.01 of its deviation.
"""

STD_SAMPLES = 101
"""Number of places at which the standard deviation of a curve is stated.

Source: by hand; a hundredth of the length.
"""

_LEAST_CONTROL, _MOST_CONTROL = 8, 80

_Ints = npt.NDArray[np.int64]


class Pose(NamedTuple):
    """From the frame of the first view to that of another: ``p_view = rotation @ p + shift``."""

    rotation: FloatArray
    shift: FloatArray


class Sight(NamedTuple):
    """What a view shows of an object.

    Parameters
    ----------
    view : int
    curve : ViewCurve
    t : numpy.ndarray, shape (m,)
        Where each of the curve's observations lies on the object, in 0..1; outside of it where it is no part of that.
    """

    view: int
    curve: ViewCurve
    t: FloatArray


class SpaceCurve(NamedTuple):
    """A curve in space and how well it is known.

    Parameters
    ----------
    curve : BSplineCurve
        In the frame of one of the views, metres.
    std_m : numpy.ndarray, shape (STD_SAMPLES,)
        At even parameters of the spline.
    shown : numpy.ndarray, shape (STD_SAMPLES,), bool
        Whether at least two views show the object there.
    residual_px : float
        Root of the mean squared distance of the projections from the curves.
    width_m : float
        Width of the object.
    """

    curve: BSplineCurve
    std_m: FloatArray
    shown: npt.NDArray[np.bool_]
    residual_px: float
    width_m: float


class RigErrors(NamedTuple):
    """Standard deviations of a rig's calibration."""

    rotation_std_deg: float
    pixel_std: float


def partners_on(
    a: FloatArray, b: FloatArray, pose: Pose, path: _Ints, backwards: bool
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return what `triangulate_path` does, of a second curve that may be run backwards."""
    if not backwards:
        return triangulate_path(a, b, pose.rotation, pose.shift, path)
    last = len(b) - 1
    turned = np.stack((path[:, 0], last - path[:, 1]), axis=1)
    depths, weights, partners = triangulate_path(a, np.ascontiguousarray(b[::-1]), pose.rotation, pose.shift, turned)
    return depths, weights, last - partners


def fit_in_space(
    nodes: FloatArray,
    inverse_depths: FloatArray,
    weights: FloatArray,
    sights: Sequence[Sight],
    poses: Sequence[Pose],
    focals_px: Sequence[float],
    control_count: int,
    errors: RigErrors,
    first: int,
) -> SpaceCurve | None:
    """Fit a curve in space to what views show of an object; None where that leads behind a camera.

    Parameters
    ----------
    nodes : numpy.ndarray, shape (n, 2)
        Rays of the view that the curve is in the frame of, along the object, evenly spaced.
    inverse_depths, weights : numpy.ndarray, shape (n,)
        Roughly, as `partners_on` returns them.
    sights : sequence of Sight
    poses : sequence of Pose
        From that frame to those of all views.
    focals_px : sequence of float
        Of all views.
    control_count : int
        Number of control points that the curves in the image need.
    errors : RigErrors
    first : int
        The view in whose frame the curve is.
    """
    n = min(max(control_count, _LEAST_CONTROL), _MOST_CONTROL)
    knots, roughness = _basis(n)
    start = _start(nodes, inverse_depths, weights * (focals_px[first] / _START_STD_PX) ** 2)
    if start is None:
        return None
    length = float(np.sqrt((np.diff(start, axis=0) ** 2).sum(axis=1)).sum())
    scale = 1.0 / (_BENDING * length**3)
    # A rough point is as uncertain as half the distance to the next.
    even = np.linspace(0.0, 1.0, len(start))
    control = fit_points(even, start, np.full(len(start), (2.0 * len(start) / length) ** 2), knots, roughness, scale)
    parts = [(sight, np.flatnonzero((sight.t >= 0.0) & (sight.t <= 1.0))) for sight in sights]
    t = np.concatenate([sight.t[own] for sight, own in parts])
    rays = np.concatenate([sight.curve.rays[own] for sight, own in parts])
    normals = np.concatenate([sight.curve.normals[own] for sight, own in parts])
    row_weights = np.concatenate([sight.curve.weights[own] for sight, own in parts])
    views = np.repeat([sight.view for sight, _ in parts], [len(own) for _, own in parts])
    rotations = np.stack([pose.rotation for pose in poses])
    shifts = np.stack([pose.shift for pose in poses])
    radii = np.concatenate([sight.curve.radii[own] for sight, own in parts])
    clear = np.concatenate([sight.curve.clear[own] for sight, own in parts])
    residuals, depths, factor = np.empty(len(t)), np.empty(len(t)), np.empty((3 * n, BAND))
    most = _MOST_PX / focals_px[first]
    for repeated in (False, True):
        if not fit_views(
            control, knots, t, rays, normals, row_weights, views, rotations, shifts,
            roughness, scale, most, _ITERATIONS, residuals, depths, factor,
        ):  # fmt: skip
            return None
        unlike = _contradicted(t, views, radii, depths, focals_px) & clear
        if repeated or not unlike.any():
            break
        row_weights[unlike] = 0.25 / radii[unlike] ** 2
        clear[unlike] = False
    pixel_std = np.full((len(poses), 2), errors.pixel_std) / np.array(focals_px)[:, None]
    std = deviations(
        control, knots, t, rays, normals, row_weights, views, rotations, shifts,
        pixel_std, math.radians(errors.rotation_std_deg), factor, STD_SAMPLES,
    )  # fmt: skip
    residual_px = math.sqrt(float((residuals**2).mean())) * focals_px[first]
    width_m = 2.0 * float(np.median(radii * depths))
    curve = BSplineCurve._unchecked(knots, control, ORDER - 1, False)
    return SpaceCurve(curve, std, _shown(t[clear], views[clear], n), residual_px, width_m)


def _start(nodes: FloatArray, inverse_depths: FloatArray, weights: FloatArray) -> FloatArray | None:
    """Return points in space along rays, at depths whose inverses are smooth; None where they lie behind the camera."""
    total = float(weights.sum())
    if not total > 0.0:
        return None
    mean = float((weights * inverse_depths).sum()) / total
    steps = np.diff(nodes, axis=0)
    length = float(np.hypot(steps[:, 0], steps[:, 1]).sum())
    if not (mean > 0.0 and length > 0.0):
        return None
    knots, roughness = _basis(_LEAST_CONTROL + len(nodes) // 2)
    even = np.linspace(0.0, 1.0, len(nodes))
    columns = np.zeros((len(nodes), 3))
    columns[:, 0] = inverse_depths
    # What bends in space bends as much in depth, whose inverse falls with the square; a length has the depth in it.
    prior = 1.0 / (_BENDING * length**3 * mean)
    control = fit_points(even, columns, weights, knots, roughness, prior)
    smooth, _ = sample_cubic(knots, control, 0.0, 1.0, len(nodes))
    depths = 1.0 / np.maximum(smooth[:, 0], _LEAST_SHARE * mean)
    points: FloatArray = np.empty((len(nodes), 3))
    points[:, 0], points[:, 1], points[:, 2] = nodes[:, 0] * depths, nodes[:, 1] * depths, depths
    return points


def _contradicted(
    t: FloatArray, views: _Ints, radii: FloatArray, depths: FloatArray, focals_px: Sequence[float]
) -> npt.NDArray[np.bool_]:
    """Return which observations show another width, in metres, than those of other views at the same place."""
    unlike = np.zeros(len(t), bool)
    widths = np.log(radii * depths)
    sure = _WIDTH_STDS * np.sqrt(WIDTH_STD**2 + (_RADIUS_STD_PX / (radii * np.array(focals_px)[views])) ** 2)
    own = [np.flatnonzero(views == view) for view in range(len(focals_px))]
    own = [rows[np.argsort(t[rows], kind="stable")] for rows in own if len(rows)]
    for rows in own:
        for others in own:
            if rows is not others:
                expected = np.interp(t[rows], t[others], widths[others])
                unlike[rows] |= np.abs(widths[rows] - expected) > sure[rows]
    return unlike


def _shown(t: FloatArray, views: _Ints, n: int) -> npt.NDArray[np.bool_]:
    """Return whether two views have observations in a place's knot span."""
    spans = n - ORDER + 1
    of_t = np.minimum((t * spans).astype(np.int64), spans - 1)
    counts = np.zeros((int(views.max(initial=0)) + 1, spans), bool)
    counts[views, of_t] = True
    places = np.minimum((np.linspace(0.0, 1.0, STD_SAMPLES) * spans).astype(np.int64), spans - 1)
    return (counts.sum(axis=0) >= 2)[places]


@lru_cache(maxsize=256)
def _basis(n: int) -> tuple[FloatArray, FloatArray]:
    """Return the knots of n control points, and the products of their functions' second derivatives, by bands."""
    inner = np.linspace(0.0, 1.0, n - ORDER + 2)
    knots = np.concatenate((np.zeros(ORDER - 1), inner, np.ones(ORDER - 1)))
    # Second derivatives are linear within a span: two points integrate their products exactly.
    at = 0.5 * (inner[:-1] + inner[1:]), 0.5 / math.sqrt(3.0) * np.diff(inner)
    nodes = np.sort(np.concatenate((at[0] - at[1], at[0] + at[1])))
    values = BSpline(knots, np.eye(n), ORDER - 1)(nodes, 2)
    gram = values.T @ values * (0.5 * (inner[1] - inner[0]))
    bands = np.zeros((n, ORDER))
    for k in range(ORDER):
        bands[: n - k, k] = np.diagonal(gram, k)
    return frozen(knots), frozen(bands)
