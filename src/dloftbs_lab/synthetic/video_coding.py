"""Pictures as a video codec leaves them, bit for bit the same on every machine: colour at half resolution, blocks.

No codec is called, since builds and threads change its output. As H.264 and JPEG do, the colour is averaged over 2 x 2
pixels, and blocks of 8 x 8 values are transformed and quantised; all sums are of whole numbers.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Image = npt.NDArray[np.uint8]
Ints = npt.NDArray[np.int64]

_BLOCK = 8
_TRANSFORM = np.array(
    [
        [64, 64, 64, 64, 64, 64, 64, 64],
        [89, 75, 50, 18, -18, -50, -75, -89],
        [83, 36, -36, -83, -83, -36, 36, 83],
        [75, -18, -89, -50, 50, 89, 18, -75],
        [64, -64, -64, 64, 64, -64, -64, 64],
        [50, -89, 18, 75, -75, -18, 89, -50],
        [36, -83, 83, -36, -36, 83, -83, 36],
        [18, -50, 75, -89, 89, -75, 50, -18],
    ],
    np.int64,
)
"""Cosines in whole numbers, as H.265 has them (ITU-T H.265, 8.6.4.2)."""
_GAIN_BITS = 15
"""Of the transform in both directions: a row's sum of squares is 2^15 to 0.1 %."""
_COLOUR_BITS = 16
_TO_YCC = np.array([[7471, 38470, 19595], [32768, -21709, -11059], [-5329, -27439, 32768]], np.int64)
"""BGR to luma and the two colour differences, times 2^16 (ITU-T BT.601)."""
_TO_BGR = np.array([[65536, 116130, 0], [65536, -22553, -46802], [65536, 0, 91881]], np.int64)


def coded(picture: Image, step: int) -> Image:
    """Return a picture (H, W, 3) BGR as it comes out of a codec.

    Parameters
    ----------
    picture : numpy.ndarray, shape (H, W, 3), uint8
        BGR.
    step : int
        Step of the quantisation, in grey levels of an orthonormal transform: 8 is a good video, 40 a bad one.
    """
    height, width = picture.shape[:2]
    pad = 2 * _BLOCK
    whole = np.pad(picture, ((0, -height % pad), (0, -width % pad), (0, 0)), mode="edge").astype(np.int64)
    luma, *colours = _rounded(whole @ _TO_YCC.T, _COLOUR_BITS).transpose(2, 0, 1)
    planes = [_quantised(luma, step)]
    for colour in colours:
        half = _rounded(colour[::2, ::2] + colour[1::2, ::2] + colour[::2, 1::2] + colour[1::2, 1::2], 2)
        planes.append(_quantised(half, step).repeat(2, axis=0).repeat(2, axis=1))
    back = _rounded(np.stack(planes, axis=-1) @ _TO_BGR.T, _COLOUR_BITS)
    return back[:height, :width].clip(0, 255).astype(np.uint8)


def thresholded(picture: Image, least_saturation: int, least_value: int) -> npt.NDArray[np.bool_]:
    """Return the pixels (H, W) of a picture (H, W, 3) that are colourful and bright enough, each of 0..255."""
    value = picture.max(axis=2).astype(np.int64)
    spread = value - picture.min(axis=2)
    return np.asarray((value >= least_value) & (255 * spread >= least_saturation * value))


def _quantised(plane: Ints, step: int) -> Ints:
    """Transform blocks of a plane (H, W), round each value to a multiple of a step, and transform them back."""
    rows, columns = plane.shape[0] // _BLOCK, plane.shape[1] // _BLOCK
    blocks = plane.reshape(rows, _BLOCK, columns, _BLOCK).swapaxes(1, 2)
    unit = step << _GAIN_BITS
    levels = (_TRANSFORM @ blocks @ _TRANSFORM.T + unit // 2) // unit
    back = _rounded(_TRANSFORM.T @ (levels * step) @ _TRANSFORM, _GAIN_BITS)
    return back.swapaxes(1, 2).reshape(plane.shape)


def _rounded(values: Ints, bits: int) -> Ints:
    """Return values over 2^bits, rounded."""
    return (values + (1 << (bits - 1))) >> bits
