"""From a place on a curve in the image to the same place on the object's curve in space, and back.

Each curve's ``u`` is its own arc length: what recedes from the camera is shorter in the image than it is. The same
place has the same share of the length of the curve in space as the camera sees it.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from dloftbs.camera import PinholeCamera
from dloftbs.data.curve import ROUNDING, BSplineCurve
from dloftbs.errors import InputError
from dloftbs.support.arrays import FloatArray, as_float_array, frozen
from dloftbs.support.values import shown

_U = frozen(np.linspace(0.0, 1.0, 1000))
"""Parameters of the points from which lengths are taken; between them a curve is straight to a millionth."""


def to_space(u: npt.ArrayLike, curve_3d: BSplineCurve, camera: PinholeCamera) -> FloatArray:
    """Return the ``u`` on a curve in space of the places that have these in the image, in the same shape.

    Raises
    ------
    InputError
        If a ``u`` is no number in 0..1, or some of the curve does not lie in front of the camera.
    """
    shares, dense = _shares(curve_3d, camera)
    return np.interp(_checked("u", u), shares, dense)


def to_image(u_3d: npt.ArrayLike, curve_3d: BSplineCurve, camera: PinholeCamera) -> FloatArray:
    """Return the ``u`` in the image of the places that have these on a curve in space, in the same shape.

    Raises
    ------
    InputError
        As `to_space`.
    """
    shares, dense = _shares(curve_3d, camera)
    return np.interp(_checked("u_3d", u_3d), dense, shares)


def is_in_front(curve_3d: BSplineCurve) -> bool:
    """Return True if all of a curve lies in front of the camera, where alone it has an image."""
    return bool((curve_3d(_U)[:, 2] > 0.0).all())


def _shares(curve_3d: BSplineCurve, camera: PinholeCamera) -> tuple[FloatArray, FloatArray]:
    """Return the shares of the length in the image at even ``u`` in space, and these."""
    points = curve_3d(_U)
    if not (points[:, 2] > 0.0).all():
        raise InputError("the curve in space must lie in front of the camera; some of it does not")
    steps = np.linalg.norm(np.diff(camera.project(points), axis=0), axis=1)
    along = np.concatenate(([0.0], np.cumsum(steps)))
    return (along / along[-1] if along[-1] > 0.0 else _U), _U  # seen from its end it is a point


def _checked(name: str, u: npt.ArrayLike) -> FloatArray:
    values = as_float_array(name, u)
    if not ((values >= -ROUNDING) & (values <= 1.0 + ROUNDING)).all():
        raise InputError(f"{name} must be in 0..1, got {shown(u)}")
    return values
