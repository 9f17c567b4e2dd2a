"""From annotated points to true curves."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from scipy.interpolate import make_interp_spline

from dloftbs.camera import PinholeCamera
from dloftbs.data.curve import BSplineCurve
from dloftbs.errors import InputError
from dloftbs.support.arrays import as_points
from dloftbs_lab.truth import Truth


def curve_through(points: npt.ArrayLike) -> BSplineCurve:
    """Interpolate points, in order, with the distance along them as parameter.

    That is the arc length as far as the points follow the object's bends. (To repeat the fit with the length of the
    curve itself would be closer on smooth curves, but runs away on jagged ones.)

    Cubic, or of lower degree where there are fewer than four points. Points that repeat the one before are left out; a
    last point that is the first again makes the curve a loop.

    Parameters
    ----------
    points : array_like, shape (n, 2) or (n, 3)

    Raises
    ------
    InputError
        If they are no finite points, or fewer than two differ.
    """
    given = as_points("points", points)
    kept = given[np.concatenate(([True], (np.diff(given, axis=0) != 0).any(axis=1)))] if len(given) else given
    if len(kept) < 2:
        raise InputError(f"a curve needs 2 points or more that differ, got {len(kept)}")
    closed = len(kept) > 4 and np.array_equal(kept[0], kept[-1])
    u = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(kept, axis=0), axis=1))))
    spline = make_interp_spline(u / u[-1], kept, k=min(3, len(kept) - 1), bc_type="periodic" if closed else None)
    return BSplineCurve(spline.t, spline.c, spline.k, closed=closed)


def truth_of(
    polylines: Sequence[npt.ArrayLike], ids: Sequence[int] | None = None, camera: PinholeCamera | None = None
) -> Truth:
    """Return the truth that annotated points show.

    Parameters
    ----------
    polylines : sequence of array_like, shape (n, 2) or (n, 3)
        ``(x, y)`` px, all with or all without their depth along the optical axis, metres.
    ids : sequence of int, optional
        1, 2 and so on where they are left out.
    camera : PinholeCamera, optional
        With it and with depths that are all positive, there are curves in space too.

    Raises
    ------
    InputError
        If a polyline is wrong, or dimensions or counts disagree.
    """
    points = [as_points(f"polyline {number}", polyline) for number, polyline in enumerate(polylines)]
    if len({polyline.shape[1] for polyline in points}) > 1:
        raise InputError("polylines must be all with depth or all without")
    curves_3d: tuple[BSplineCurve, ...] = ()
    if camera is not None and all(polyline.shape[1] == 3 and (polyline[:, 2] > 0).all() for polyline in points):
        curves_3d = tuple(curve_through(camera.deproject(p[:, :2], p[:, 2])) for p in points)
    numbers = tuple(range(1, len(points) + 1)) if ids is None else tuple(ids)
    return Truth(tuple(curve_through(polyline[:, :2]) for polyline in points), (), numbers, curves_3d)
