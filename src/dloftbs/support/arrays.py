"""Small checks of arrays that the data types share; errors say what came."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from dloftbs.errors import InputError
from dloftbs.support.array_likes import as_array, as_pixels

AnyArray = npt.NDArray[Any]
FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]
ByteArray = npt.NDArray[np.uint8]

LARGEST = 1e12
"""Px or metres: no coordinate is larger, so that lengths and curvatures of curves are finite."""


def frozen(array: FloatArray) -> FloatArray:
    """Mark an array that nobody else holds as read-only, and return it."""
    array.setflags(write=False)
    return array


def as_points(name: str, value: npt.ArrayLike, dims: tuple[int, ...] = (2, 3)) -> FloatArray:
    """Return a read-only copy of finite points (n, d), with d among `dims`.

    Raises
    ------
    InputError
        If the shape differs or a value is no finite number.
    """
    array = as_float_array(name, value)
    if array.ndim != 2 or array.shape[1] not in dims:
        wanted = " or ".join(f"(n, {d})" for d in dims)
        raise InputError(f"{name} must have shape {wanted}, got {array.shape}")
    return frozen(array)


def as_vector(name: str, value: npt.ArrayLike, size: int | None = None) -> FloatArray:
    """Return a read-only copy of a finite vector (n,), of `size` elements where that is given.

    Raises
    ------
    InputError
        If the shape differs or a value is no finite number.
    """
    array = as_float_array(name, value)
    if array.ndim != 1 or (size is not None and array.size != size):
        raise InputError(f"{name} must have shape ({'n' if size is None else size},), got {array.shape}")
    return frozen(array)


def as_float_array(name: str, value: npt.ArrayLike) -> FloatArray:
    """Return a copy of numbers of any shape, each at most `LARGEST`.

    Raises
    ------
    InputError
        If something is no number, or not finite, or too large.
    """
    array = as_array(name, value)
    if array.dtype.kind not in "fiu":
        raise InputError(f"{name} must be an array of numbers, got {array.shape} of {array.dtype}")
    with np.errstate(over="ignore"):  # longer floating point than float64 may become infinite
        array = array.astype(np.float64)
    finite = np.isfinite(array)
    if not finite.all():
        raise InputError(f"{name} must be finite, got {int((~finite).sum())} values that are not")
    if (np.abs(array) > LARGEST).any():
        raise InputError(f"{name} must be at most {LARGEST:g}, got {float(np.abs(array).max())}")
    return array


def as_numbers(name: str, value: npt.ArrayLike) -> FloatArray:
    """Return numbers of any shape as they are, NaN and infinity among them, copied only if they have another type.

    Raises
    ------
    InputError
        If something is no number.
    """
    array = as_array(name, value)
    if array.dtype.kind not in "fiub":
        raise InputError(f"{name} must be an array of numbers, got {array.shape} of {array.dtype}")
    return array.astype(np.float64, copy=False)


_OF_OBJECTS = "if it is a mask per object of one frame, give detect(instances=x) or Frame(instances=x)"
_IS_A_STACK = f"; track follows a stack of frames, and sources.open opens one; {_OF_OBJECTS}"
_MARKED = {"mask": "cable", "occluders": "an occluder"}


def check_image(image: npt.ArrayLike) -> AnyArray:
    """Return the image (H, W, 3) as an array, BGR; leading axes of length one are dropped.

    Raises
    ------
    InputError
        If it is not uint8 of that shape.
    """
    array = image if type(image) is np.ndarray else as_pixels("image", image, "three")
    if array.ndim > 3:
        array = _without_leading_ones(array, 3)
    if array.ndim != 3 or array.shape[2] != 3 or array.dtype != np.uint8:
        remedy = _image_remedy(array)
        raise InputError(f"image must have shape (H, W, 3) and type uint8, got {array.shape} of {array.dtype}{remedy}")
    return array


def _image_remedy(array: AnyArray) -> str:
    """Return what makes an image of an array that is none, to be added to a message; nothing where that is unclear."""
    channels = array.shape[-1] if array.ndim == 3 else 0
    if channels == 3:
        return _EIGHT_BITS.get(array.dtype.kind, "")
    if channels == 4:
        return "; four channels: image[..., :3] if they are BGRA, image[..., 2::-1] if they are RGBA"
    if channels and array.shape[0] in (3, 4) and array.dtype != np.bool_:
        return (
            f"; channels come last: image.transpose(1, 2, 0), and [..., 2::-1] of that if they are RGB; {_OF_OBJECTS}"
        )
    if array.ndim == 2:
        return "; a grey image is repeated: np.dstack([image] * 3)"
    return _IS_A_STACK if array.ndim in (3, 4) else ""


_EIGHT_BITS = {
    "f": "; scale it first: (255 * image).astype(np.uint8) if it is in 0..1, image.astype(np.uint8) if it is in 0..255",
    "u": "; reduce it first: (image >> 8).astype(np.uint8) if it has 16 bits",
    "i": "; image.astype(np.uint8) if it is in 0..255",
}


def looks_like_image(array: AnyArray) -> bool:
    """Return whether an array is meant as a colour image, a wrong one among them, rather than as a mask."""
    if array.ndim > 3:
        array = _without_leading_ones(array, 3)
    if array.ndim > 3:
        return 3 in (array.shape[1], array.shape[-1])
    if array.ndim < 3:
        return False
    return 1 not in (array.shape[0], array.shape[2]) or (array.shape[2] == 3 and array.dtype == np.uint8)


def check_mask(mask: npt.ArrayLike, name: str = "mask", *, may_be_soft: bool = False) -> AnyArray:
    """Return a mask as an array (H, W) of bool or integers; if it may be soft, it may be a probability in 0..1, too.

    Raises
    ------
    InputError
        If it has another shape or type, or a probability is not in 0..1.
    """
    array = _as_plane(name, mask)
    if array.dtype.kind == "f" and may_be_soft:
        _check_probability(array)
    elif array.dtype.kind not in "biu":
        remedy = f"; threshold it first: {name} > 0.5" if array.dtype.kind == "f" else ""
        raise InputError(
            f"{name} must be bool or integer, any non-zero being {_MARKED[name]}, got {array.dtype}{remedy}"
        )
    return array


def _check_probability(array: AnyArray) -> None:
    low, high = (float(array.min()), float(array.max())) if array.size else (0.0, 0.0)
    if not (low >= 0.0 and high <= 1.0):  # NaN is neither
        raise InputError(
            f"mask must be a probability in 0..1 where it is floating point, got {low:.4g}..{high:.4g}; of scores, "
            "give 1 / (1 + exp(-scores)), and of 0..255 mask.astype(np.uint8)"
        )


def check_depth(depth: npt.ArrayLike) -> AnyArray:
    """Return the depth as an array (H, W) of integers or floating point.

    Raises
    ------
    InputError
        If it has another shape or type, such as integers of 8 bits.
    """
    array = _as_plane("depth", depth)
    if not holds_depth(array.dtype):
        raise InputError(
            f"depth must be integer counts or floating-point metres, got {array.dtype}{depth_remedy(array.dtype)}"
        )
    return array


def holds_depth(dtype: np.dtype[Any]) -> bool:
    """Return whether arrays of a type may be depth: floating point or integers, but not of 8 bits, as pictures have."""
    return dtype.kind in "fiu" and dtype.itemsize > 1


def depth_remedy(dtype: np.dtype[Any]) -> str:
    """Return what makes depth of arrays of a type that is none, to be added to a message; nothing but for 8 bits."""
    if dtype.kind not in "iu":
        return ""
    return (
        "; 8 bits are taken for a picture of depth, scaled for the eye: give what was measured, and if these are "
        "counts, depth.astype(np.uint16)"
    )


def _as_plane(name: str, value: npt.ArrayLike) -> AnyArray:
    array = value if type(value) is np.ndarray else as_pixels(name, value, "one")
    if array.ndim == 2:
        return array
    plane = plane_of(array)
    if plane.ndim != 2:
        remedy = _IS_A_STACK if plane.ndim in (3, 4) else ""
        if plane.ndim == 3 and plane.shape[2] in (3, 4):
            remedy = f"; read it with one channel (cv2.IMREAD_UNCHANGED), or pass {name}[..., 0]"
        raise InputError(f"{name} must have shape (H, W), (H, W, 1) or (1, H, W), got {array.shape}{remedy}")
    return plane


def plane_of(array: AnyArray) -> AnyArray:
    """Return an array without the axes of length one before and behind rows and columns, of which none may be left."""
    array = _without_leading_ones(array, 3)
    if array.ndim == 3 and array.shape[2] == 1:
        return array[:, :, 0]
    return _without_leading_ones(array, 2)


def _without_leading_ones(array: AnyArray, ndim: int) -> AnyArray:
    while array.ndim > ndim and array.shape[0] == 1:
        array = array[0]
    return array


def as_bytes(array: AnyArray) -> npt.NDArray[np.uint8]:
    """Return a mask as bytes, not 0 where it is set, copied only if it has another type."""
    if array.dtype == np.bool_:
        return array.view(np.uint8)
    pixels: npt.NDArray[np.uint8] = array if array.dtype == np.uint8 else (array != 0).view(np.uint8)
    return pixels
