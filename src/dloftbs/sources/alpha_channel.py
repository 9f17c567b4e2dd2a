"""Masks in the alpha channel of an image, beside a colour that says nothing, or something else."""

from __future__ import annotations

import io

import numpy as np

from dloftbs.sources.image_header import PNG, is_webp, png_chunks
from dloftbs.sources.tiff_pages import PLANAR, SAMPLES, TILE_WIDTH, first_page, is_tiff
from dloftbs.support.arrays import AnyArray

LEFT_OUT = "its alpha channel is not opaque, and is left out; save it as a grey image if it is the mask"

_PNG_WITH_ALPHA = (b"\x04", b"\x06")
"""Types of colour in the header of a PNG: grey and colours, each with alpha."""
_WEBP_FLAG, _WEBP_LOSSLESS_BIT = 0x10, 0x10
"""Of alpha, in the flags of WebP's extended header, and in the last byte of the lossless one's sizes."""
_GREY_ALPHA = 2
"""Channels of grey and alpha."""


def may_have_alpha(data: bytes) -> bool:
    """Return whether the header of an image file says that there may be an alpha channel."""
    if data.startswith(PNG):
        before = (kind for kind, _, _ in png_chunks(data[: data.find(b"IDAT") + 4]))
        return data[25:26] in _PNG_WITH_ALPHA or b"tRNS" in before
    if is_webp(data):
        kind = data[12:16]
        if kind == b"VP8X":
            return bool(data[20] & _WEBP_FLAG)
        return kind == b"VP8L" and bool(data[24] & _WEBP_LOSSLESS_BIT)
    if is_tiff(data):
        page = first_page(data)
        return page is not None and page.has_alpha
    return data.startswith(b"BM") and data[28:30] == b"\x20\0"


def split(pixels: AnyArray) -> tuple[AnyArray, AnyArray | None]:
    """Return the colours, (H, W) or (H, W, 3), and the alpha channel (H, W), if there is one, of decoded pixels."""
    import cv2

    if pixels.ndim == 2 or pixels.shape[2] == 3:
        return pixels, None
    return np.asarray(cv2.cvtColor(pixels, cv2.COLOR_BGRA2BGR)), np.asarray(cv2.extractChannel(pixels, 3))


def alpha_of_grey_tiff(data: bytes) -> AnyArray | None:
    """Return the alpha channel of a TIFF of grey and alpha, which OpenCV leaves out; None of any other file.

    FFmpeg knows strips of grey and alpha, and takes tiles for strips; None of those.
    """
    page = first_page(data) if is_tiff(data) else None
    if page is None or page.tags.get(SAMPLES) != _GREY_ALPHA or TILE_WIDTH in page.tags or page.tags.get(PLANAR) == 2:
        return None
    import av

    try:
        with av.open(io.BytesIO(data), format="tiff_pipe") as container:
            frame = next(container.decode(video=0))
    except (av.FFmpegError, StopIteration):
        return None
    return np.ascontiguousarray(frame.to_ndarray(format="rgba" if frame.format.name == "ya8" else "rgba64le")[..., 3])


def telling(pixels: AnyArray, alpha: AnyArray | None) -> AnyArray | None:
    """Return an alpha channel that says something about the pixels.

    One that is opaque says nothing, nor does one that is the same everywhere while the colours are not.
    """
    if alpha is None:
        return None
    opaque = np.iinfo(alpha.dtype).max if np.issubdtype(alpha.dtype, np.integer) else 1.0
    least = alpha.min()
    if least == opaque or (least == alpha.max() and not _is_constant(pixels)):
        return None
    return alpha


def is_one_colour(pixels: AnyArray, alpha: AnyArray) -> bool:
    """Return whether all pixels have one colour, or all but the transparent ones, which are then black."""
    if _is_constant(pixels):
        return True
    seen = alpha != 0
    return bool(seen.any()) and not pixels[~seen].any() and _is_constant(pixels[seen][None])


def _is_constant(pixels: AnyArray) -> bool:
    """Return whether all pixels are the same; nearly all images show in a few that they are not."""
    return all(bool((part == pixels[0, 0]).all()) for part in (pixels[::16, ::16], pixels))
