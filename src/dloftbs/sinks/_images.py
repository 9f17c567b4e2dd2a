"""Pictures on their way to a file."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from dloftbs.errors import SinkError

BgrImage = npt.NDArray[np.uint8]

JPEG_QUALITY = 85
"""0..100; lines stay clean, and a frame of 1280 x 720 takes about 0.15 MB."""


def encode(image: BgrImage, suffix: str) -> bytes:
    """Return a picture (H, W, 3) as the content of a file with that suffix.

    Raises
    ------
    SinkError
        If OpenCV cannot encode it.
    """
    import cv2

    options = [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY] if suffix in (".jpg", ".jpeg") else []
    try:
        encoded, data = cv2.imencode(suffix, image, options)
    except cv2.error as error:
        raise SinkError(f"cannot encode a picture of shape {image.shape} as {suffix}: {error}") from error
    if not encoded:
        raise SinkError(f"cannot encode a picture of shape {image.shape} as {suffix}")
    return data.tobytes()


def fitted(image: BgrImage, size: tuple[int, int]) -> BgrImage:
    """Return a picture (H, W, 3) scaled into the size ``(H, W)``, with black bars where its sides differ."""
    import cv2

    height, width = size
    scale = min(height / image.shape[0], width / image.shape[1])
    rows = min(height, max(1, round(image.shape[0] * scale)))
    columns = min(width, max(1, round(image.shape[1] * scale)))
    canvas: BgrImage = np.zeros((height, width, 3), np.uint8)
    top, left = (height - rows) // 2, (width - columns) // 2
    method = cv2.INTER_AREA if scale < 1.0 else cv2.INTER_LINEAR
    canvas[top : top + rows, left : left + columns] = cv2.resize(image, (columns, rows), interpolation=method)
    return canvas
