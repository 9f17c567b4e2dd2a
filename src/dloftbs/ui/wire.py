"""Messages to the browser: text in JSON, and pictures as one binary message each."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import cv2
import msgspec
import numpy as np

from dloftbs.support.arrays import AnyArray, ByteArray
from dloftbs.support.text import readable

LONGEST_SIDE_PX = 1920
"""Longer side of pictures that are sent, px: a larger frame is reduced, and its curves keep the frame's pixels.

Source: by hand; full HD, more than a page shows.
"""
JPEG_QUALITY = 82
"""Quality of pictures, in 0..100.

Source: by hand; at HD some 200 kB, and no blocks that show.
"""


def encode_text(kind: str, /, **fields: Any) -> str:
    """Return a message in JSON whose field ``type`` is its kind."""
    return msgspec.json.encode(_as_readable({"type": kind, **fields})).decode()


def encode_picture(header: Mapping[str, Any], parts: Mapping[str, bytes]) -> bytes:
    """Return a binary message: the header's length (4 bytes, little endian), the header in JSON, the parts.

    The header's ``parts`` has the name and the number of bytes of each part, in order.
    """
    sizes = [(name, len(data)) for name, data in parts.items()]
    text = msgspec.json.encode(_as_readable({**header, "parts": sizes}))
    return b"".join((len(text).to_bytes(4, "little"), text, *parts.values()))


def _as_readable(fields: dict[str, Any]) -> dict[str, Any]:
    """Return fields whose texts, and those in lists, are readable: names of files may hold bytes that are no UTF-8."""

    def readable_in(value: Any) -> Any:
        if isinstance(value, str):
            return readable(value)
        return [readable_in(one) for one in value] if isinstance(value, list) else value

    return {name: readable_in(value) for name, value in fields.items()}


def encode_jpeg(image: ByteArray) -> bytes:
    """Return an image (H, W, 3) BGR or (H, W) as a JPEG file, reduced to `LONGEST_SIDE_PX`."""
    height, width = image.shape[:2]
    scale = LONGEST_SIDE_PX / max(height, width)
    if scale < 1.0:
        size = (max(1, round(width * scale)), max(1, round(height * scale)))
        image = cv2.resize(image, size, interpolation=cv2.INTER_AREA).astype(np.uint8, copy=False)
    _, data = cv2.imencode(".jpg", image, (cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY))
    return data.tobytes()


def encode_runs(mask: AnyArray) -> bytes:
    """Return a plain mask (H, W) as the lengths of its runs, row after row, of ground and cable in turn, uint32.

    The first run is ground; it is 0 long where the mask begins with cable.
    """
    flat = np.ascontiguousarray(mask).reshape(-1) != 0
    edges = np.flatnonzero(flat[1:] != flat[:-1]) + 1
    bounds = np.concatenate(([0] * (1 + bool(flat[0])), edges, [flat.size]))
    return np.diff(bounds).astype("<u4").tobytes()
