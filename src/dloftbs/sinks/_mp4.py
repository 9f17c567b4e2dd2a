"""H.264 in a fragmented MP4, which stays readable when the process is killed; OpenCV cannot write one."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from fractions import Fraction
from typing import Any

import numpy as np

from dloftbs.errors import SinkError
from dloftbs.sinks._images import BgrImage
from dloftbs.support.safe_files import AppendFile

CODEC = "libx264"
# Without look-ahead and with a fragment per picture, a killed process loses the last picture and no more.
_CODEC_OPTIONS = {"preset": "veryfast", "tune": "zerolatency", "crf": "23"}
_FILE_OPTIONS = {"movflags": "frag_every_frame+empty_moov+default_base_moof", "flush_packets": "1"}
_TICKS_PER_S = 90_000
"""Of pictures with times of their own, as MPEG streams count them."""


class H264Mp4:
    """A video in .mp4 or .mov that browsers play, valid after every picture.

    Odd sizes get a black row or column, since H.264 wants even ones.

    Parameters
    ----------
    file : AppendFile
        Empty; stays with the caller, who closes it.
    size : (int, int)
        ``(H, W)`` px of every picture.
    rate : Fraction or None
        Pictures per second; None where each picture comes with its time.
    container : str
        ``"mp4"`` or ``"mov"``.

    Raises
    ------
    SinkError
        If the file cannot be written, or PyAV has no encoder for it.
    """

    def __init__(self, file: AppendFile, size: tuple[int, int], rate: Fraction | None, container: str) -> None:
        import av

        self._av: Any = av
        self._file = file
        self._whole = file.size
        self._ticks = -1
        self._output = _Output(file)
        self.size = size
        height, width = size
        self._padding = ((0, height % 2), (0, width % 2), (0, 0))
        with self._sink_errors():
            self._container = self._av.open(self._output, "w", format=container, options=_FILE_OPTIONS)
            self._stream = self._container.add_stream(CODEC, rate=rate, options=_CODEC_OPTIONS)
        if rate is None:
            self._stream.codec_context.time_base = Fraction(1, _TICKS_PER_S)
        self._stream.height, self._stream.width = height + height % 2, width + width % 2
        self._stream.pix_fmt = "yuv420p"

    def add(self, image: BgrImage, seconds: float | None = None) -> None:
        """Append a picture (H, W, 3), shown after so many `seconds` of a video without a rate."""
        picture = self._av.VideoFrame.from_ndarray(np.pad(image, self._padding), format="bgr24")
        if seconds is not None:
            self._ticks = max(round(seconds * _TICKS_PER_S), self._ticks + 1)
            picture.pts, picture.time_base = self._ticks, Fraction(1, _TICKS_PER_S)
        with self._sink_errors():
            self._container.mux(self._stream.encode(picture))
        self._whole = self._file.size

    def finish(self) -> None:
        """Write the pictures that the encoder still holds; nothing more after an error."""
        with self._sink_errors():
            self._container.mux(self._stream.encode())
            self._container.close()

    @contextmanager
    def _sink_errors(self) -> Iterator[None]:
        """Raise errors in the block as `SinkError`, and cut the file back to whole fragments."""
        try:
            yield
        except (self._av.FFmpegError, self._av.codec.codec.UnknownCodecError, SinkError) as error:
            self._output.ended = True
            with suppress(SinkError):  # the first error says more
                self._file.shorten(self._whole)
            if isinstance(error, SinkError):
                raise
            is_known = not isinstance(error, self._av.codec.codec.UnknownCodecError)
            why = error if is_known else f"this build of PyAV has no encoder {CODEC}; that of pip install av has"
            raise SinkError(f"cannot write {str(self._file.path)!r}: {why}") from error


class _Output:
    """File that PyAV writes to; bytes after its end are dropped, as the trailer of a container that had an error."""

    def __init__(self, file: AppendFile) -> None:
        self._file = file
        self.ended = False

    def write(self, data: bytes) -> int:
        if not self.ended:
            self._file.append(bytes(data))
        return len(data)
