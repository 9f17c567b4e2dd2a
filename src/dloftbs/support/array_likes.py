"""Arrays of other libraries as NumPy's: tensors, masked arrays, and pictures that name the order of their channels.

Objects are recognised by what they offer: none of these libraries is imported.
"""

from __future__ import annotations

import os
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from dloftbs.errors import InputError
from dloftbs.support.values import shown

Channels = Literal["one", "three", "any"]
"""Channels that pixels must have: those of a mask or of depth, those of a colour image, or either."""

_ONE_CHANNEL = ("1", "L", "I", "F", "I;16", "I;16L", "I;16B", "I;16N")
"""Modes of Pillow's pictures with one number a pixel, which is a mask's or depth's.

Source: Pillow's handbook, Concepts, Modes.
"""
_AMBIGUOUS = ("P", "PA", "LA", "La")
"""Modes that hold labels as often as colours, or a mask as often in the second channel as in the first.

Source: as `_ONE_CHANNEL`; label images are palette images in most data sets.
"""
_COLOURS_FIRST = ("RGB", "RGBA", "RGBX")
"""Modes whose first three channels are red, green and blue.

Source: as `_ONE_CHANNEL`.
"""
NONE_IS = "cv2.imread returns None where the path does not exist or is no image"


def as_array(name: str, value: object) -> npt.NDArray[Any]:
    """Return anything as an array, which shares the value's memory where NumPy can.

    Tensors are detached and brought to the host.

    Raises
    ------
    InputError
        If it is no array, is ragged, or its library does not hand it out.
    """
    if type(value) is np.ndarray:
        return value
    if isinstance(value, np.ndarray):
        if np.ma.is_masked(value):
            raise InputError(f"{name} has masked values, which are no numbers; leave them out, or fill them")
        return np.asarray(value)
    if value is None or isinstance(value, (str, bytes, os.PathLike)):
        raise InputError(f"{name} must be an array of numbers, got {shown(value)}")
    try:
        array = np.asarray(_on_host(value))
    except Exception as error:  # errors of other libraries share no base but this
        raise InputError(f"{name} must be an array of numbers, got {shown(value)}: {error}") from error
    if array.ndim == 0 and array.dtype.kind == "O":
        raise InputError(f"{name} must be an array, got {shown(value)}")
    return array


def as_pixels(name: str, value: object, channels: Channels) -> npt.NDArray[Any]:
    """Return an image, a mask or depth as an array: colours as BGR, masked pixels as 0.

    Raises
    ------
    InputError
        As `as_array`; and if it is None, or a picture whose mode does not suit.
    """
    if value is None:
        raise InputError(f"{name} is None ({NONE_IS})")
    if isinstance(value, (str, os.PathLike)):
        raise InputError(f"{name} must be an array, got {shown(value)}; detect, track and sources.open read files")
    if isinstance(value, np.ma.MaskedArray):
        return np.asarray(value.filled(0))
    mode = _mode_of(value)
    if mode is not None:
        return _of_picture(name, value, mode, channels)
    array = as_array(name, value)
    if array.ndim == 0:
        raise InputError(f"{name} must be an array, got {shown(value)}")
    return _narrowed(array) if array.ndim == 3 and isinstance(value, (list, tuple)) else array


def is_array_like(value: object) -> bool:
    """Return True for an array of any library, or a picture that NumPy converts; False for a list and a number."""
    if isinstance(value, np.generic):
        return False
    offers = ("__array__", "__array_interface__", "__dlpack__", "__cuda_array_interface__")
    return any(hasattr(type(value), name) for name in offers)  # of a picture itself, one of them would copy it


def _on_host(value: Any) -> Any:
    """Return what NumPy converts, of an array that is elsewhere or is part of a graph of gradients."""
    if hasattr(value, "detach") and hasattr(value, "cpu"):  # PyTorch
        tensor = value.detach().cpu()
        return tensor.float() if "bfloat16" in str(getattr(tensor, "dtype", "")) else tensor
    if hasattr(value, "get") and (hasattr(value, "__cuda_array_interface__") or type(value).__name__ == "UMat"):
        return value.get()  # CuPy, OpenCV
    if hasattr(value, "__dlpack__") and not hasattr(value, "__array__"):
        return np.from_dlpack(value)
    return value


def _mode_of(value: object) -> str | None:
    """Return the mode of a picture as Pillow names it; None for all else, files and mapped memory among it."""
    mode = getattr(value, "mode", None)
    is_picture = isinstance(mode, str) and is_array_like(value) and not isinstance(value, np.memmap)
    return mode if is_picture else None


def _of_picture(name: str, picture: Any, mode: str, channels: Channels) -> npt.NDArray[Any]:
    if channels != "three" and mode in _ONE_CHANNEL:
        return as_array(name, picture)
    if channels == "one" and mode == "P":
        return as_array(name, picture)
    if channels == "any" and mode in _AMBIGUOUS:
        raise InputError(
            f"{name} is a picture of mode {mode}, which may hold colours or a mask: pass x.convert('RGB') for its "
            f"colours, or {'np.asarray(x)' if mode == 'P' else 'x.getchannel(0) or x.getchannel(1)'} for its mask"
        )
    if channels == "one":
        raise InputError(
            f"{name} must have one channel, got a picture of mode {mode}; pass {name}.convert('L'), "
            f"or the channel that holds it: {name}.getchannel(0)"
        )
    if mode in ("I", "F") or mode.startswith("I;"):
        raise InputError(f"{name} must have 8 bits a channel, got a picture of mode {mode}")
    if mode not in _COLOURS_FIRST:
        try:
            picture = picture.convert("RGB")
        except (AttributeError, ValueError, OSError) as error:
            raise InputError(f"{name}: a picture of mode {mode} cannot be turned into RGB: {error}") from error
    pixels = as_array(name, picture)
    if pixels.ndim != 3 or pixels.shape[2] < 3:
        raise InputError(f"{name} says that its mode is {mode}, and has shape {pixels.shape}")
    return np.ascontiguousarray(pixels[..., 2::-1])  # the first three, the last of them first


def _narrowed(array: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Return counts of a list, which has no type, as bytes where they are such."""
    if array.dtype.kind in "iu" and array.size and array.min() >= 0 and array.max() <= 255:
        return array.astype(np.uint8)
    return array
