"""Video files, cameras and network streams, through OpenCV."""

from __future__ import annotations

import math
import os
import re
import time
from abc import abstractmethod
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from dloftbs._text import readable
from dloftbs.camera import PinholeCamera
from dloftbs.errors import SourceError
from dloftbs.frame import Frame
from dloftbs.sources.cameras import why_not
from dloftbs.sources.pixels import AnyArray, Kind, check_pixels, image_or_mask
from dloftbs.sources.source import Source, logger

if TYPE_CHECKING:
    import cv2

MAX_FAILURES = 100
"""Reads in a row that may fail before a stream is given up."""
LIVE_SCHEMES = ("rtsp", "rtsps", "rtp", "srtp", "udp", "rtmp", "rtmps", "srt")
"""Addresses under which there is never a file, as there may be under http."""
RETRY_S = 0.02
"""Wait after a failed read of a camera or a stream, which fails at once while it is disturbed."""


def open_capture(path: Path) -> cv2.VideoCapture:
    """Return what OpenCV makes of a video file, whatever its name: names that are no UTF-8 crash OpenCV."""
    import cv2

    name = os.fsencode(path)
    if readable(os.fspath(path)).encode() == name:
        return cv2.VideoCapture(name.decode())
    with TemporaryDirectory(prefix="dloftbs-") as folder:  # what is open does without its name
        link = Path(folder, f"video{readable(path.suffix)}")
        link.symlink_to(path.resolve())
        return cv2.VideoCapture(str(link))


class _CaptureSource(Source):
    """Base of files and live streams: reading on over failures, and releasing the capture in the end.

    A video is an image stream unless `kind` is "mask": a grey or a black frame does not make it a mask.
    """

    def __init__(self, kind: Kind, camera: PinholeCamera | None) -> None:
        self._kind: Kind = "mask" if kind == "mask" else "image"
        self._camera = camera
        self._captures: list[cv2.VideoCapture] = []

    def close(self) -> None:
        super().close()
        for capture in list(self._captures):
            self._release(capture)

    def _release(self, capture: cv2.VideoCapture) -> None:
        capture.release()
        if capture in self._captures:
            self._captures.remove(capture)

    @abstractmethod
    def _gives_up(self, index: int, failures: int) -> bool:
        """Return whether reading ends after this number of failures in a row, the latest at this index."""

    def _decoded(self, capture: cv2.VideoCapture) -> Iterator[tuple[int, AnyArray]]:
        index = failures = 0
        while True:
            read, pixels = capture.read()
            if not read:
                failures += 1
                if self._gives_up(index + failures - 1, failures):
                    return
                continue
            if failures:
                last = index + failures - 1
                what = f"frame {index}" if failures == 1 else f"frames {index} to {last}"
                self._skip(f"{what} of {self.name}", "cannot be decoded", failures)
                index += failures
                failures = 0
            yield index, pixels
            if self._closed:
                return
            index += 1

    def _frame(self, index: int, pixels: AnyArray, stamp: float | None, name: str) -> Frame:
        image, mask = image_or_mask(pixels, self._kind, lossy=True)
        return Frame(image=image, mask=mask, camera=self._camera, index=index, stamp=stamp, name=f"{name}#{index}")


class VideoSource(_CaptureSource):
    """A video file.

    Parameters
    ----------
    path : Path
    kind : {"auto", "image", "mask"}
        "auto" is "image". In masks cable begins at half brightness, since codecs ring around edges.
    camera : PinholeCamera, optional
        Goes with every frame.
    fps : float, optional
        Gives the stamps ``index / fps``, in place of the container's times.

    Raises
    ------
    SourceError
        If OpenCV cannot open the file.
    """

    def __init__(
        self, path: Path, *, kind: Kind = "auto", camera: PinholeCamera | None = None, fps: float | None = None
    ) -> None:
        import cv2

        super().__init__(kind, camera)
        self.name = str(path)
        self._path = path
        capture = self._open()
        count = _positive(capture.get(cv2.CAP_PROP_FRAME_COUNT))
        self.length = None if count is None else round(count)
        self.fps = fps or _positive(capture.get(cv2.CAP_PROP_FPS))
        self._timed = fps is None
        self._release(capture)

    def __iter__(self) -> Iterator[Frame]:
        """Yield the frames. What cannot be decoded is skipped; a file that ends early is reported.

        Raises
        ------
        SourceError
            If the source is closed, or the file cannot be opened any more.
        """
        self._begin()
        return self._frames()

    def _frames(self) -> Iterator[Frame]:
        capture = self._open()
        count = 0
        last = -1
        previous: float | None = None
        try:
            for index, pixels in self._decoded(capture):
                previous = stamp = self._stamp(capture, index, previous)
                count, last = count + 1, index
                yield self._frame(index, pixels, stamp, self._path.name)
        finally:
            self._release(capture)
        if not self._closed:
            self._check_end(count, last)

    def _open(self) -> cv2.VideoCapture:
        capture = open_capture(self._path)
        if not capture.isOpened():
            capture.release()
            raise SourceError(f"{self.name}: cannot be opened as a video: no format that OpenCV reads, or cut off")
        _check_size(capture, self.name)
        self._captures.append(capture)
        return capture

    def _stamp(self, capture: cv2.VideoCapture, index: int, previous: float | None) -> float | None:
        import cv2

        if self._timed:
            seconds = capture.get(cv2.CAP_PROP_POS_MSEC) / 1000.0
            # Some formats tell no time: it is then 0, or stands still.
            if math.isfinite(seconds) and seconds >= 0.0 and (previous is None or seconds > previous):
                return seconds
        return None if self.fps is None else index / self.fps

    def _gives_up(self, index: int, failures: int) -> bool:
        return self.length is None or index >= self.length or failures > MAX_FAILURES

    def _check_end(self, count: int, last: int) -> None:
        expected = self.length or 1  # a video that does not say how many frames it has must still have one
        if last + 1 < expected:
            self.skipped += expected - last - 1
            why = "it is cut off or damaged, or counts wrongly"
            logger.warning("%s: read %d frames of the %d that it should have; %s", self.name, count, expected, why)


class LiveSource(_CaptureSource):
    """A camera or a network stream, which can be read once; stamps are seconds since it was opened.

    Parameters
    ----------
    where : int or str
        Index of a camera, or address of a stream.
    kind : {"auto", "image", "mask"}
        As for `VideoSource`.
    camera : PinholeCamera, optional
        Goes with every frame.

    Raises
    ------
    SourceError
        If OpenCV cannot open it.
    """

    def __init__(self, where: int | str, *, kind: Kind = "auto", camera: PinholeCamera | None = None) -> None:
        import cv2

        super().__init__(kind, camera)
        self.live = isinstance(where, int) or where.partition("://")[0].lower() in LIVE_SCHEMES
        # Addresses may hold a password, and names end up in logs and results.
        self.name = f"camera {where}" if isinstance(where, int) else re.sub(r"//[^/@]*@", "//***@", where)
        if isinstance(where, str) and readable(where) != where:  # OpenCV crashes on it
            raise SourceError(f"{self.name} cannot be opened: an address must be text, and has bytes that are no UTF-8")
        self._capture = cv2.VideoCapture(where)
        if not self._capture.isOpened():
            self._capture.release()
            why = f": {why_not(where)}" if isinstance(where, int) else ""
            raise SourceError(f"{self.name} cannot be opened{why}")
        _check_size(self._capture, self.name)
        self._captures.append(self._capture)
        self._opened = time.monotonic()
        self._started = False
        self.fps = _positive(self._capture.get(cv2.CAP_PROP_FPS))

    def __iter__(self) -> Iterator[Frame]:
        """Yield the frames as they come, until the stream ends or is closed.

        Raises
        ------
        SourceError
            If the source is closed, or was iterated before.
        """
        self._begin()
        if self._started:
            raise SourceError(f"{self.name} is live and can be read only once; open it again")
        self._started = True
        return self._frames()

    def _frames(self) -> Iterator[Frame]:
        try:
            for index, pixels in self._decoded(self._capture):
                yield self._frame(index, pixels, time.monotonic() - self._opened, self.name)
        finally:
            self._release(self._capture)
        if not self._closed:
            logger.warning("%s ended: %d reads in a row failed", self.name, MAX_FAILURES)

    def _gives_up(self, index: int, failures: int) -> bool:
        if self._closed or failures >= MAX_FAILURES:
            return True
        time.sleep(RETRY_S)
        return False


def _check_size(capture: cv2.VideoCapture, name: str) -> None:
    """Refuse a video whose frames are too large, before one is decoded."""
    import cv2

    sides = (capture.get(cv2.CAP_PROP_FRAME_HEIGHT), capture.get(cv2.CAP_PROP_FRAME_WIDTH))
    try:
        check_pixels(*(int(side) if math.isfinite(side) else 0 for side in sides))
    except SourceError as error:
        capture.release()
        raise SourceError(f"{name}: {error}") from error


def _positive(value: float) -> float | None:
    return value if math.isfinite(value) and value > 0 else None
