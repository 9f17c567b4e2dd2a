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
from dloftbs.stereo.kernels.epipolar_paths import WIDTH_STD, triangulate_path
from dloftbs.stereo.kernels.space_fit import BAND, ORDER, compare_widths, deviations, fit_views, start_curve
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

_ITERATIONS = 3
"""Number of Gauss's and Newton's steps.

Source: measured; more steps move no curve by 0.01 of its deviation.
"""

STD_SAMPLES = 101
"""Number of places at which the standard deviation of a curve is stated.

Source: by hand; a hundredth of the length.
"""

_LEAST_CONTROL, _MOST_CONTROL = 8, 80
"""Least and largest number of control points of a curve in space.

Source: by hand; two for each bend of an S, and as many as bound the time.
"""

_Ints = npt.NDArray[np.int64]


class Pose(NamedTuple):
    """From the frame of the first view to that of another: ``p_view = rotation @ p + shift``."""

    rotation: FloatArray
    shift: FloatArray


class Sight(NamedTuple):
    """View of an object.

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
    rotations: FloatArray,
    shifts: FloatArray,
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
    rotations : numpy.ndarray, shape (k, 3, 3)
    shifts : numpy.ndarray, shape (k, 3)
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
    control, length = start_curve(
        nodes, inverse_depths, weights, (focals_px[first] / _START_STD_PX) ** 2, _BENDING, _LEAST_SHARE,
        *_basis(_LEAST_CONTROL + len(nodes) // 2), knots, roughness,
    )  # fmt: skip
    if length == 0.0:
        return None
    scale = 1.0 / (_BENDING * length**3)
    inside = [(sight.t >= 0.0) & (sight.t <= 1.0) for sight in sights]
    t = np.concatenate([sight.t[own] for sight, own in zip(sights, inside, strict=True)])
    rows = np.concatenate([sight.curve.rows[own] for sight, own in zip(sights, inside, strict=True)])
    views = np.concatenate(
        [np.full(np.count_nonzero(own), sight.view) for sight, own in zip(sights, inside, strict=True)]
    )
    residuals, depths, factor = np.empty(len(t)), np.empty(len(t)), np.empty((3 * n, BAND))
    most, shown, focals = _MOST_PX / focals_px[first], np.empty(n - ORDER + 1, bool), np.array(focals_px)
    for repeated in (False, True):
        if not fit_views(
            control, knots, t, rows, views, rotations, shifts,
            roughness, scale, most, _ITERATIONS, residuals, depths, factor,
        ):  # fmt: skip
            return None
        unlike, width_m = compare_widths(
            t, rows, depths, views, focals, n - ORDER + 1, WIDTH_STD, _RADIUS_STD_PX, _WIDTH_STDS, shown
        )
        if repeated or unlike == 0:
            break
    pixel_std = errors.pixel_std / focals
    std = deviations(
        control, knots, t, rows, views, rotations, shifts,
        pixel_std, math.radians(errors.rotation_std_deg), factor, STD_SAMPLES,
    )  # fmt: skip
    residual_px = math.sqrt(float(residuals @ residuals) / len(residuals)) * focals_px[first]
    curve = BSplineCurve._unchecked(knots, control, ORDER - 1, False)
    return SpaceCurve(curve, std, shown[_places(n - ORDER + 1)], residual_px, width_m)


@lru_cache(maxsize=256)
def _places(spans: int) -> _Ints:
    """Return the knot span of each place at which the standard deviation is stated."""
    return np.minimum((np.linspace(0.0, 1.0, STD_SAMPLES) * spans).astype(np.int64), spans - 1)


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
