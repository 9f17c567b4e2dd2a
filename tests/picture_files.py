"""Image files as other programs write them, in memory."""

from __future__ import annotations

import io
import struct
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dloftbs import sources

Image = pytest.importorskip("PIL.Image")

ORIENTATION = 274
BAR = np.zeros((48, 64), np.uint8)
BAR[20:24, 5:60] = 200
COLOUR = np.full((48, 64, 3), (90, 60, 30), np.uint8)
COLOUR[20:24, 5:60] = (10, 200, 30)


def bar(number: int) -> np.ndarray:
    """A bar that goes down, by a row a frame."""
    return np.roll(BAR, number, 0)


def pillow(pixels: np.ndarray, format: str, *, orientation: int | None = None, **options: Any) -> bytes:
    """Encode RGB, grey, or either with alpha."""
    exif = Image.Exif()
    if orientation is not None:
        exif[ORIENTATION] = orientation
        options["exif"] = exif
    stream = io.BytesIO()
    Image.fromarray(pixels).save(stream, format, **options)
    return stream.getvalue()


def tiff(pages: Sequence[Any], **options: Any) -> bytes:
    """Encode arrays or images of Pillow as the pages of a TIFF."""
    images = [page if isinstance(page, Image.Image) else Image.fromarray(page) for page in pages]
    stream = io.BytesIO()
    images[0].save(stream, "TIFF", save_all=True, append_images=images[1:], **options)
    return stream.getvalue()


def plain_tiff(pages: Sequence[np.ndarray], order: str = "<", *, big: bool = False, **tags: int) -> bytes:
    """Lay out an uncompressed TIFF by hand: grey pages, their tags, and more tags such as ``t254=1``."""
    head, offset, count_form, entry_form = (16, "Q", "Q", "HHQQ") if big else (8, "I", "H", "HHII")
    data = bytearray((b"II" if order == "<" else b"MM") + struct.pack(f"{order}H", 43 if big else 42))
    data += struct.pack(f"{order}HH", 8, 0) if big else b""
    link = len(data)
    data += bytes(head - link)
    for page in pages:
        rows, columns = page.shape
        start = len(data)
        data += page.astype(page.dtype.newbyteorder(order)).tobytes()
        kind = {"u": 1, "i": 2, "f": 3}[page.dtype.kind]
        values = {256: columns, 257: rows, 258: 8 * page.dtype.itemsize, 259: 1, 262: 1, 273: start, 277: 1}
        values |= {278: rows, 279: page.nbytes, 339: kind, **{int(tag[1:]): value for tag, value in tags.items()}}
        struct.pack_into(order + offset, data, link, len(data))
        data += struct.pack(order + count_form, len(values))
        for tag, value in sorted(values.items()):
            data += struct.pack(order + entry_form, tag, 16 if big else 4, 1, value)
        link = len(data)
        data += bytes(struct.calcsize(offset))
    return bytes(data)


def save(path: Path, data: bytes) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(data)
    return path


def only(source: sources.Source) -> sources.Frame:
    with source:
        (frame,) = source
    return frame
