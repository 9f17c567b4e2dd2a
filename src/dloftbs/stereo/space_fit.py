"""One curve in space of the curves that several views have of an object, with its standard deviation."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy.interpolate import BSpline

from dloftbs.data.curve import BSplineCurve
from dloftbs.stereo.kernels.band_equations import BAND, ORDER
from dloftbs.stereo.kernels.compare_widths import compare_widths
from dloftbs.stereo.kernels.deviations import deviations
from dloftbs.stereo.kernels.epipolar_paths import WIDTH_STD
from dloftbs.stereo.kernels.observations import DEPTH, WEIGHT
from dloftbs.stereo.kernels.space_fit import fit_views
from dloftbs.stereo.kernels.start_curve import start_curve
from dloftbs.support.arrays import AnyArray, BoolArray, FloatArray, IntArray, frozen

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
"""Largest number of Gauss's and Newton's steps.

Source: measured; more steps move no curve by 0.01 of its deviation.
"""

STD_SAMPLES = 101
"""Number of places at which the standard deviation of a curve is stated.

Source: by hand; a hundredth of the length.
"""

_LOOP_SAMPLES = 151
"""Number of the same along one and a half turns of a loop.

Source: by definition.
"""

_LEAST_CONTROL, _MOST_CONTROL = 8, 80
"""Least and largest number of control points of a curve in space.

Source: by hand; two for each bend of an S, and as many as bound the time.
"""


class Pose(NamedTuple):
    """From the frame of the first view to that of another: ``p_view = rotation @ p + shift``."""

    rotation: FloatArray
    shift: FloatArray


class Sight(NamedTuple):
    """View of an object.

    Parameters
    ----------
    view : int
    t : numpy.ndarray, shape (m,)
        Where each observation lies on the object, in 0..1; outside of it where it is no part of that.
    rows : numpy.ndarray, shape (m, 8)
        The observations; see `dloftbs.stereo.kernels.observations`.
    """

    view: int
    t: FloatArray
    rows: FloatArray


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
    shown: BoolArray
    residual_px: float
    width_m: float


class RigErrors(NamedTuple):
    """Standard deviations of a rig's calibration."""

    rotation_std_deg: float
    pixel_std: float


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
    *,
    closed: bool,
) -> SpaceCurve | None:
    """Fit a curve in space to what views show of an object; None where that leads behind a camera.

    Parameters
    ----------
    nodes : numpy.ndarray, shape (n, 2)
        Rays of the view that the curve is in the frame of, along the object, evenly spaced; those of a loop go around
        it one and a half times.
    inverse_depths, weights : numpy.ndarray, shape (n,)
        Roughly, as `correspond` returns them.
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
    closed : bool
        Whether it is a loop.
    """
    n = min(max(control_count, _LEAST_CONTROL), _MOST_CONTROL)
    turn = max(n // 6, 3) * 4 if closed else 0  # knot spans of a loop
    if closed:
        n = turn + turn // 2 + ORDER - 1
    knots, roughness = _basis(n)
    t, rows, views = _observations_of(sights)
    start_scale = (focals_px[first] / _START_STD_PX) ** 2
    lifted = bool(rows[:, DEPTH].any())
    if lifted:
        inverse_depths, weights = _with_depth(inverse_depths, weights, t, rows, views == first, start_scale)
    control, length = start_curve(
        nodes, inverse_depths, weights, start_scale, _BENDING, _LEAST_SHARE,
        *_basis(_LEAST_CONTROL + len(nodes) // 2), knots, roughness,
    )  # fmt: skip
    if length == 0.0:
        return None
    scale = 1.0 / (_BENDING * length**3)
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
    std = deviations(
        control, knots, t, rows, views, residuals, rotations, shifts,
        errors.pixel_std / focals, math.radians(errors.rotation_std_deg), factor,
        _LOOP_SAMPLES if closed else STD_SAMPLES,
    )  # fmt: skip
    shown = shown[_places(n - ORDER + 1, len(std))]
    across = residuals[rows[:, DEPTH] == 0.0] if lifted else residuals
    residual_px = math.sqrt(float(across @ across) / max(len(across), 1)) * focals_px[first]
    if not closed:
        return SpaceCurve(BSplineCurve._unchecked(knots, control, ORDER - 1, False), std, shown, residual_px, width_m)
    own = slice((len(std) - STD_SAMPLES) // 2, (len(std) + STD_SAMPLES) // 2)
    return SpaceCurve(_loop(control, turn), std[own], shown[own], residual_px, width_m)


def _observations_of(sights: Sequence[Sight]) -> tuple[FloatArray, FloatArray, IntArray]:
    """Return the places, the rows and the views of what is part of the object."""
    t = np.concatenate([sight.t for sight in sights])
    rows = np.concatenate([sight.rows for sight in sights])
    views = np.repeat([sight.view for sight in sights], [len(sight.t) for sight in sights])
    inside = (t >= 0.0) & (t <= 1.0)
    return t[inside], rows[inside], views[inside]


def _with_depth(
    inverse_depths: FloatArray, weights: FloatArray, t: FloatArray, rows: FloatArray, own: AnyArray, scale: float
) -> tuple[FloatArray, FloatArray]:
    """Return rough inverse depths, and their weights, with those that depth images of the same view measured."""
    measured = own & (rows[:, DEPTH] > 0.0)
    depths = rows[measured, DEPTH]
    at = np.rint(t[measured] * (len(weights) - 1)).astype(np.intp)
    more, sums = np.zeros(len(weights)), np.zeros(len(weights))
    np.add.at(more, at, rows[measured, WEIGHT] * depths**4 / scale)
    np.add.at(sums, at, rows[measured, WEIGHT] * depths**3 / scale)
    total = weights + more
    return np.divide(weights * inverse_depths + sums, total, out=np.zeros(len(total)), where=total > 0.0), total


def _loop(control: FloatArray, turn: int) -> BSplineCurve:
    """Return the loop that the middle of a spline is, which goes around it one and a half times."""
    first = turn // 4
    own = control[first : first + turn].copy()
    own[: ORDER - 1] = 0.5 * (own[: ORDER - 1] + control[first + turn : first + turn + ORDER - 1])
    knots = np.arange(-ORDER + 1, turn + ORDER) / turn
    return BSplineCurve._unchecked(knots, np.concatenate((own, own[: ORDER - 1])), ORDER - 1, True)


@lru_cache(maxsize=256)
def _places(spans: int, count: int) -> IntArray:
    """Return the knot span of each of so many even places."""
    return np.minimum((np.linspace(0.0, 1.0, count) * spans).astype(np.int64), spans - 1)


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
