"""Interface of a curve to the modules that answer questions about its shape, which it calls itself."""

from __future__ import annotations

from typing import Protocol

import numpy.typing as npt
from scipy.interpolate import BSpline

from dloftbs.support.arrays import FloatArray


class CurveLike(Protocol):
    """The part of `BSplineCurve` that they use; see there."""

    @property
    def spline(self) -> BSpline: ...  # noqa: D102

    @property
    def breaks(self) -> FloatArray: ...  # noqa: D102

    @property
    def degree(self) -> int: ...  # noqa: D102

    @property
    def closed(self) -> bool: ...  # noqa: D102

    @property
    def length(self) -> float: ...  # noqa: D102

    def __call__(self, u: npt.ArrayLike) -> FloatArray: ...  # noqa: D102

    def t_at(self, u: npt.ArrayLike) -> FloatArray: ...  # noqa: D102

    def u_at(self, t: npt.ArrayLike) -> FloatArray: ...  # noqa: D102

    def tangent(self, u: npt.ArrayLike) -> FloatArray: ...  # noqa: D102

    def curvature(self, u: npt.ArrayLike) -> FloatArray: ...  # noqa: D102

    def sample(self, n: int | None = None, *, spacing: float | None = None) -> FloatArray: ...  # noqa: D102

    def nearest(self, point: npt.ArrayLike) -> tuple[float, float]: ...  # noqa: D102
