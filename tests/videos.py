"""Small videos of any container, codec, time and pixel format, written by PyAV."""

from __future__ import annotations

import os
import struct
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import numpy as np

RATE = 20
COUNT = 40
ROWS, COLUMNS = 64, 96


def picture(number: int, rows: int = ROWS, columns: int = COLUMNS) -> np.ndarray:
    """A bright block that steps to the right, on faint noise, BGR."""
    pixels = np.random.default_rng(number).integers(0, 40, (rows, columns, 3), dtype=np.uint8)
    left = (4 * number) % (columns - 16)
    pixels[rows // 2 - 8 : rows // 2 + 8, left : left + 16] = 255
    return pixels


def number_in(image: np.ndarray) -> int:
    """The number of the picture that a decoded one was, of the first 20."""
    bright = np.nonzero(image[len(image) // 2, :, 1] > 128)[0]
    return round((bright.mean() - 7.5) / 4)


def write(
    path: Path,
    codec: str = "libx264",
    *,
    pictures: Sequence[Any] | None = None,
    count: int = COUNT,
    times: Sequence[float] | None = None,
    pixel_format: str = "yuv420p",
    container: str | None = None,
    unit_s: Fraction = Fraction(1, 1000),
    group: int = 10,
    between: int = 0,
    rotation: int = 0,
    options: dict[str, str] | None = None,
    codec_options: dict[str, str] | None = None,
) -> Path:
    """Write a video; pictures are BGR arrays or frames of PyAV, `between` is the number of B-frames in a row."""
    pictures = [picture(number) for number in range(count)] if pictures is None else pictures
    times = [number / RATE for number in range(len(pictures))] if times is None else times
    with own_priority(), av.open(str(path), "w", format=container, options=options or {}) as output:
        stream = output.add_stream(codec, rate=RATE, options=codec_options or {})
        frames = [as_frame(pixels).reformat(format=pixel_format) for pixels in pictures]
        stream.width, stream.height, stream.pix_fmt = frames[0].width, frames[0].height, pixel_format
        stream.codec_context.gop_size, stream.codec_context.max_b_frames = group, between
        stream.codec_context.time_base = unit_s
        if rotation:
            stream.set_display_rotation(rotation)
        for frame, seconds in zip(frames, times, strict=True):
            frame.pts, frame.time_base = round(seconds / unit_s), unit_s
            output.mux(stream.encode(frame))
        output.mux(stream.encode())
    return path


@contextmanager
def own_priority() -> Iterator[None]:
    """Keep the scheduling of the process: as root, SVT-AV1 makes the thread that encodes a real-time one.

    Browsers that a test starts later would inherit that, and two of them starve the machine.
    """
    if not hasattr(os, "sched_getscheduler"):  # Linux alone has it
        yield
        return
    policy, parameters = os.sched_getscheduler(0), os.sched_getparam(0)
    try:
        yield
    finally:
        os.sched_setscheduler(0, policy, parameters)


def as_frame(pixels: Any) -> Any:
    return pixels if isinstance(pixels, av.VideoFrame) else av.VideoFrame.from_ndarray(pixels, format="bgr24")


def write_av1(path: Path, **options: Any) -> Path:
    return write(path, "libsvtav1", codec_options={"preset": "12"}, **options)


def write_vp9(path: Path, **options: Any) -> Path:
    return write(path, "libvpx-vp9", codec_options={"cpu-used": "8"}, **options)


def trim(source: Path, target: Path, first: int, count: int) -> Path:
    """Copy an MP4 with an edit list that shows some of its pictures: what phones and editors write."""
    data = bytearray(source.read_bytes())
    at = data.index(b"elst")
    scale = struct.unpack_from(">I", data, data.index(b"mvhd") + 16)[0]
    media_scale = struct.unpack_from(">I", data, data.index(b"mdhd") + 16)[0]
    _, start, rate = struct.unpack_from(">IiI", data, at + 12)
    start += first * media_scale // RATE
    struct.pack_into(">IiI", data, at + 12, count * scale // RATE, start, rate)
    target.write_bytes(data)
    return target


def cut(source: Path, share: float) -> Path:
    """Leave out the end of a file."""
    data = source.read_bytes()
    source.write_bytes(data[: int(share * len(data))])
    return source


def blank(source: Path, start: float, length: int) -> Path:
    """Put zeros into a file at a share of its length."""
    data = bytearray(source.read_bytes())
    at = int(start * len(data))
    data[at : at + length] = bytes(length)
    source.write_bytes(data)
    return source
