"""Video files, decoded by PyAV."""

from __future__ import annotations

import math
import os
from collections import deque
from collections.abc import Callable, Generator, Iterator
from contextlib import closing
from pathlib import Path
from threading import Lock
from typing import Any

from dloftbs.errors import SourceError
from dloftbs.sources.containers import damage_in
from dloftbs.sources.picture_order import PictureOrder
from dloftbs.sources.pixels import MAX_PIXELS, check_pixels
from dloftbs.sources.video_picture import Converter, VideoPicture
from dloftbs.sources.video_streams import main_stream

MAX_FAILURES = 100
"""Reads of a file in a row that may fail before it is given up."""

_SILENT = ("vp8", "ffv1")
"""Decoders of FFmpeg that mend damage without a word: several pictures at a time would make it a matter of chance."""
_HELD = 4
"""Pictures held back until those after them came: threads report damage late, by about as far as codecs reorder."""

Lost = Callable[[int, int], None]
"""Takes the index of the first of some pictures that cannot be decoded, and their number."""
Ended = Callable[[int, str | None], None]
"""Takes the number of pictures that a file is known to have, lost ones included, and how its layout is damaged."""


class VideoFile:
    """A video file, and the pictures of its main stream.

    Parameters
    ----------
    path : Path

    Attributes
    ----------
    length : int or None
        Number of pictures by the header of the container: an estimate, too high or too low.
    fps : float or None
        Mean number of pictures per second.
    format : str or None
        Format of the pictures in FFmpeg's names, such as ``"yuv420p"``.
    is_exact : bool
        Whether pictures keep the numbers that were stored: grey or RGB of 8 bits, by a codec that never loses any.
    unread : str or None
        Names the other video streams, if there are any.

    Raises
    ------
    SourceError
        If it cannot be opened, holds no video or none that can be decoded, or its pictures are too large.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._readings: list[_Reading] = []
        with closing(_Reading(path)) as reading:
            self.fps = reading.fps
            self.length = reading.length
            self.format = reading.format
            self.is_exact = reading.is_exact
            self.unread = reading.unread

    def close(self) -> None:
        """End all readings; waits for the picture that another thread is decoding."""
        for reading in list(self._readings):
            reading.close()

    def count(self) -> int:
        """Count the pictures without decoding them.

        Raises
        ------
        SourceError
            If the file cannot be opened any more.
        """
        with closing(_Reading(self._path)) as reading:
            return sum(packet is not None and not packet.is_discard for packet in reading.packets())

    def pictures(self, lost: Lost, ended: Ended) -> Generator[VideoPicture, None, None]:
        """Yield the pictures, decoded on all cores.

        At the first sign of damage the file is read again from its start, on one core: on several, it is chance which
        pictures are lost, and how damaged ones are mended.

        Parameters
        ----------
        lost, ended : callable
            See `Lost` and `Ended`; the latter is not called where the file is closed before its end.

        Raises
        ------
        SourceError
            If the file cannot be opened any more.
        """
        given = 0
        try:
            for picture in self._read(lost, ended, careful=False):
                yield picture
                given += 1
        except _DoubtError:
            for picture in self._read(lost, ended, careful=True):
                if picture.index >= given:
                    yield picture

    def _read(self, lost: Lost, ended: Ended, *, careful: bool) -> Iterator[VideoPicture]:
        reading = _Reading(self._path, careful=careful)
        self._readings.append(reading)
        try:
            yield from reading.pictures(lost, ended)
        finally:
            self._readings.remove(reading)
            reading.close()


class _DoubtError(Exception):
    """Pictures may be lost or damaged."""


class _Reading:
    """One pass over a video file.

    Parameters
    ----------
    path : Path
    careful : bool
        Decode on one core, and go on after damage; otherwise a `_DoubtError` is raised there.
    """

    def __init__(self, path: Path, *, careful: bool = True) -> None:
        import av

        self._errors = av.FFmpegError
        self._converter = Converter()
        self._careful = careful
        self._lock = Lock()
        self._container: Any = None
        self._ends_whole = True
        try:
            self._file = path.open("rb")  # for its layout
        except OSError as error:
            raise SourceError(f"{path}: cannot be opened as a video: {error.strerror or error}") from error
        try:
            # With a scheme, a name such as concat:a.mp4 is that of a file.
            self._container = av.open(f"file:{os.path.abspath(path)}", metadata_errors="replace")
            self._stream, self.unread = main_stream(self._container)
            check_pixels(self._stream.codec_context.height, self._stream.codec_context.width)
        except (av.FFmpegError, SourceError) as error:
            self.close()
            why = "cannot be opened as a video: no format that FFmpeg reads, or cut off"
            raise SourceError(f"{path}: {error if isinstance(error, SourceError) else why}") from error
        threads = "SLICE" if self._stream.codec_context.name in _SILENT else "AUTO"
        self._stream.thread_type = "NONE" if careful else threads
        options = {"max_pixels": str(MAX_PIXELS)}  # a video may grow in its middle
        # Threads may mark a damaged picture too late, and then have an error soon after it.
        self._stream.codec_context.options = options if careful else {**options, "err_detect": "explode"}
        self.format: str | None = self._stream.codec_context.pix_fmt
        self.is_exact = _is_exact(self._stream.codec_context)
        rate = self._stream.average_rate or self._stream.guessed_rate
        self.fps = float(rate) if rate else None
        self.length = self._stream.frames or self._estimated_length()

    def close(self) -> None:
        """Let go of the file."""
        with self._lock:
            if self._container is not None:
                self._container.close()
            self._container = None
            self._file.close()

    def pictures(self, lost: Lost, ended: Ended) -> Iterator[VideoPicture]:
        """Yield the pictures; see `VideoFile.pictures`."""
        order = PictureOrder(self._stream.time_base, 1.0 / self.fps if self.fps else 0.0)
        held: deque[VideoPicture] = deque()
        index = 0
        failures = missing = 0  # since the last whole picture
        for frame in self._decoded(order):
            passed, seconds = (0, None) if frame is None else order.come(frame.pts)
            is_whole = frame is not None and not frame.is_corrupt
            if not self._careful and not (is_whole and (passed == 0 or index == 0)):
                raise _DoubtError
            if frame is None:
                failures += 1
                continue
            if not is_whole:
                missing += passed + 1
                continue
            if failures or missing:  # a codec may have packets without a picture: only damage makes them a loss
                missing += failures if frame.pts is None else passed
                if missing:
                    lost(index, missing)
                index += missing
                failures = missing = 0
            held.append(VideoPicture(index, seconds, frame, self._converter))
            index += 1
            if self._careful or len(held) > _HELD:
                yield held.popleft()
        if order.left and not self._careful and self._container is not None:
            raise _DoubtError
        yield from held
        if self._container is None:  # closed
            return
        if failures or missing:
            index += missing + (order.left or failures)
        ended(index, damage_in(self._file) or (None if self._ends_whole else "cut off"))

    def packets(self) -> Iterator[Any]:
        """Yield the packets of the stream, and None where some cannot be read."""
        packets = self._container.demux(self._stream)
        failures = 0
        cut = None  # a packet that may be the last one, of a file that ends in its middle
        while failures <= MAX_FAILURES:
            with self._lock:
                if self._container is None:
                    return
                try:
                    packet = next(packets)
                except (StopIteration, IndexError):  # the latter from PyAV where streams turn up late in a file
                    break
                except self._errors:
                    packet, packets = None, self._container.demux(self._stream)
            if packet is None:
                failures += 1
                if failures == 1:
                    yield None
            elif packet.size:  # an empty one would end the decoder
                failures = 0
                if cut is not None:
                    yield cut
                cut = packet if packet.is_corrupt else None
                if cut is None:
                    yield packet
        self._ends_whole = cut is None and not failures
        if cut is not None:
            yield None

    def _decoded(self, order: PictureOrder) -> Iterator[Any]:
        """Yield the pictures of PyAV, and None for each failure."""
        begun = False
        for packet in self.packets():
            if packet is None:
                yield None
                continue
            begun = begun or packet.is_keyframe
            order.send(packet)
            frames = self._decode(packet)
            # A recording may begin between two key frames, with pictures that nothing decodes.
            yield from frames if begun else (frame for frame in frames if frame is not None)
        yield from self._decode(None)

    def _decode(self, packet: Any) -> list[Any]:
        with self._lock:
            if self._container is None:
                return []
            try:
                frames: list[Any] = self._stream.codec_context.decode(packet)
            except self._errors:
                return [None]
            return frames

    def _estimated_length(self) -> int | None:
        duration, unit_s = self._stream.duration, float(self._stream.time_base or 0)
        if duration is None:  # Matroska states the time of its end, counted in microseconds by FFmpeg
            duration, unit_s = (self._container.duration or 0) - (self._container.start_time or 0), 1e-6
        count = duration * unit_s * (self.fps or 0.0)
        return round(count) if math.isfinite(count) and count >= 1.0 else None


def _is_exact(context: Any) -> bool:
    """Return whether numbers survive the codec of a stream, and the conversion to BGR of 8 bits."""
    pixels, codec = context.format, context.codec
    if pixels is None or codec.lossy or not codec.lossless:
        return False
    is_grey = len(pixels.components) == 1 and not pixels.has_palette
    return (is_grey or pixels.is_rgb) and all(component.bits == 8 for component in pixels.components)
