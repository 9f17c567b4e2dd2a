"""Small checks that the data types share: arrays in, read-only float64 arrays out, errors that say what came."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from dloftbs.errors import InputError

FloatArray = npt.NDArray[np.float64]


def frozen(array: FloatArray) -> FloatArray:
    """Mark an array that nobody else holds as read-only, and return it."""
    array.flags.writeable = False
    return array


def as_points(name: str, value: npt.ArrayLike, dims: tuple[int, ...] = (2, 3)) -> FloatArray:
    """Return a read-only copy of finite points (n, d), with d among `dims`.

    Raises
    ------
    InputError
        If the shape differs or a value is not finite.
    """
    array = _as_float(name, value)
    if array.ndim != 2 or array.shape[1] not in dims:
        wanted = " or ".join(f"(n, {d})" for d in dims)
        raise InputError(f"{name} must have shape {wanted}, got {array.shape}")
    return frozen(array)


def as_vector(name: str, value: npt.ArrayLike, size: int | None = None) -> FloatArray:
    """Return a read-only copy of a finite vector (n,), of `size` elements where that is given.

    Raises
    ------
    InputError
        If the shape differs or a value is not finite.
    """
    array = _as_float(name, value)
    if array.ndim != 1 or (size is not None and array.size != size):
        raise InputError(f"{name} must have shape ({'n' if size is None else size},), got {array.shape}")
    return frozen(array)


def _as_float(name: str, value: npt.ArrayLike) -> FloatArray:
    try:
        array = np.array(value, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"{name} must be an array of numbers: {error}") from error
    if not np.isfinite(array).all():
        raise InputError(f"{name} must be finite, got {int((~np.isfinite(array)).sum())} values that are not")
    return array
