"""Video files, cameras and network streams."""

from __future__ import annotations

import math
import re
import time
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from dloftbs.camera import PinholeCamera
from dloftbs.data.frame import Frame
from dloftbs.errors import InputError, SourceError, source_errors
from dloftbs.sources.cameras import why_not
from dloftbs.sources.pixels import Kind, check_pixels, image_or_mask
from dloftbs.sources.source import ReadSource, logger
from dloftbs.sources.video_file import VideoFile
from dloftbs.sources.video_picture import COUNTS, VideoPicture
from dloftbs.support.arrays import AnyArray
from dloftbs.support.text import readable
from dloftbs.support.values import LONGEST_S, ROUNDING_S

if TYPE_CHECKING:
    import cv2

MAX_FAILURES = 100
"""Reads in a row that may fail before a camera or a network stream is given up."""
LIVE_SCHEMES = ("rtsp", "rtsps", "rtp", "srtp", "udp", "rtmp", "rtmps", "srt")
"""Addresses under which there is never a file, as there may be under http."""
MAX_LIVE_FPS = 1000.0
"""Rate above which what a driver or a stream says is the tick of its clock, 90 kHz say, and no rate."""
_MS_PER_S = 1e3
_NO_RATE = "fps cannot go with a camera or a stream"
RETRY_S = 0.02
"""Wait after a failed read of a camera or a stream, which fails at once while it is disturbed."""


class _PictureSource(ReadSource):
    """An image stream, unless `kind` is "mask": a grey or a black frame does not make it a mask."""

    _lossy = True

    def __init__(self, kind: Kind, mask_is: str, camera: PinholeCamera | None) -> None:
        self._kind: Kind = "mask" if kind == "mask" else "image"
        self._mask_is = mask_is
        self._camera = camera

    def _frame(self, index: int, pixels: AnyArray, stamp: float | None, name: str) -> Frame:
        with source_errors(self.name):
            image, mask = image_or_mask(pixels, self._kind, self._mask_is, lossy=self._lossy)
        return Frame(
            image=image,
            mask=mask,
            camera=self._camera,
            index=index,
            stamp=stamp,
            name=f"{name}#{index}",
            mask_is=self._mask_is,
        )

    def _skip_frames(self, first: int, count: int) -> None:
        what = f"frame {first}" if count == 1 else f"frames {first} to {first + count - 1}"
        self._skip(f"{what} of {self.name}", "cannot be decoded", count)


class VideoSource(_PictureSource):
    """A video file, read by PyAV; turned as its display matrix says.

    Parameters
    ----------
    path : Path
    kind : {"auto", "image", "mask"}
        "auto" is "image". In masks cable begins at half brightness, since codecs ring around edges, unless they are a
        probability. Those of exact videos (`VideoFile.is_exact`) and of one channel of 16 bits keep their values.
    mask_is, camera
        As `FileSource` has them.
    fps : float, optional
        Gives the stamps ``index / fps``, in place of the stream's presentation times, counted from its first frame.
        Where different frames share a time, by a clock that is too coarse, each comes 1 / rate after the one before it,
        with a warning.

    Attributes
    ----------
    holds_counts : bool
        Whether the masks have one channel of 16 bits.

    Raises
    ------
    SourceError
        If the file cannot be opened, holds no video or none that can be decoded, or its frames are too large.
    """

    length_is_estimate = True

    def __init__(
        self,
        path: Path,
        *,
        kind: Kind = "auto",
        mask_is: str = "auto",
        camera: PinholeCamera | None = None,
        fps: float | None = None,
    ) -> None:
        super().__init__(kind, mask_is, camera)
        self.name = str(path)
        self._label = path.name
        self._file = VideoFile(path)
        self._lossy = not self._file.is_exact
        self.length = self._file.length
        self.fps = fps or self._file.fps
        self._timed = fps is None
        self._has_warned = False
        self.holds_counts = self._kind == "mask" and self._file.format in COUNTS
        if self._file.unread is not None:
            logger.warning("%s: %s", self.name, self._file.unread)

    def close(self) -> None:
        """Close the file; waits for the frame that another thread is decoding."""
        super().close()
        self._file.close()

    def _frames(self) -> Iterator[Frame]:
        count = following = 0  # frames that came, and the index after the last one that came or was skipped
        stamp: float | None = None
        last: AnyArray | None = None

        def lost(first: int, number: int) -> None:
            nonlocal following
            self._skip_frames(first, number)
            following = first + number

        def ended(known: int, damage: str | None) -> None:
            self._check_end(count, following, known, damage)

        with closing(self._file.pictures(lost, ended)) as pictures:
            for picture in pictures:
                count, following = count + 1, picture.index + 1
                with source_errors(self.name):
                    pixels = picture.counts() if self.holds_counts else picture.bgr()
                stamp = self._stamp(picture, stamp, last, pixels)
                last = pixels
                yield self._frame(picture.index, pixels, stamp, self._label)
                if self._closed:
                    return

    def _stamp(
        self, picture: VideoPicture, previous: float | None, last: AnyArray | None, pixels: AnyArray
    ) -> float | None:
        """Return the stamp of a picture behind another one, whose stamp and pixels are known."""
        stamp = picture.seconds if self._timed else None
        if stamp is None or stamp > LONGEST_S:
            stamp = None if self.fps is None else picture.index / self.fps
        if stamp is None or previous is None or stamp > previous + ROUNDING_S:
            return stamp
        if self.fps is None or (last is not None and np.array_equal(last, pixels)):
            return previous
        if not self._has_warned:
            self._has_warned = True
            logger.warning(
                "%s: frame %d differs from the one before it and has the same time, %.17g s, since the clock of the "
                "file is coarse; such frames are taken to be 1/%.6g s apart: give the rate (fps, --fps)",
                self.name,
                picture.index,
                stamp,
                self.fps,
            )
        return previous + 1.0 / self.fps

    def _check_end(self, count: int, following: int, known: int, damage: str | None) -> None:
        expected = max(known, 1)  # a video has a frame
        if damage is not None:  # by how many frames nobody knows
            expected = max(known, self.length or 0, following + 1)
        if following < expected:
            self.skipped += expected - following
            why = damage or "cut off or damaged"
            logger.warning(
                "%s: read %d frames of the %d that it should have; it is %s", self.name, count, expected, why
            )


class LiveSource(_PictureSource):
    """A camera, a network stream or a recording at an address, which can be read once, by OpenCV.

    Stamps are seconds since it was opened; `opened_s` is that moment on the monotonic clock. Streams that are read
    together need the same one. A recording, whose number of frames is stated, has stamps of its own.

    Parameters
    ----------
    where : int or str
        Index of a camera, or address of a stream.
    kind, mask_is, camera
        As `VideoSource` has them.
    fps : float, optional
        Gives the stamps ``index / fps`` of a recording, in place of its times.

    Raises
    ------
    InputError
        If there is a rate for what comes at a pace of its own.
    SourceError
        If OpenCV cannot open it.
    """

    single_pass = True

    def __init__(
        self,
        where: int | str,
        *,
        kind: Kind = "auto",
        mask_is: str = "auto",
        camera: PinholeCamera | None = None,
        fps: float | None = None,
    ) -> None:
        import cv2

        super().__init__(kind, mask_is, camera)
        self.live = isinstance(where, int) or where.partition("://")[0].lower() in LIVE_SCHEMES
        if self.live and fps is not None:
            raise InputError(_NO_RATE)
        # Addresses may hold a password, and names end up in logs and results.
        self.name = f"camera {where}" if isinstance(where, int) else without_password(where)
        if isinstance(where, str) and readable(where) != where:  # OpenCV crashes on it
            raise SourceError(f"{self.name} cannot be opened: an address must be text, and has bytes that are no UTF-8")
        self._capture = cv2.VideoCapture(where)
        if not self._capture.isOpened():
            self._capture.release()
            why = f": {why_not(where)}" if isinstance(where, int) else ""
            raise SourceError(f"{self.name} cannot be opened{why}")
        _check_size(self._capture, self.name)
        self.opened_s = time.monotonic()
        self._started = False
        self._rate = fps
        self._stated_fps = _positive(self._capture.get(cv2.CAP_PROP_FPS))
        is_tick = self._stated_fps is not None and self._stated_fps > MAX_LIVE_FPS
        self.fps = fps or (None if is_tick else self._stated_fps)
        frames = None if self.live else _positive(self._capture.get(cv2.CAP_PROP_FRAME_COUNT))
        if frames is not None:  # a recording
            self.length, self.length_is_estimate = int(frames), True
        elif fps is not None:
            self._capture.release()
            raise InputError(_NO_RATE)

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

    def close(self) -> None:
        """Let go of the camera."""
        super().close()
        self._capture.release()

    def _frames(self) -> Iterator[Frame]:
        try:
            for index, pixels, stamp in self._arriving() if self.length is None else self._recorded(self.length):
                yield self._frame(index, pixels, stamp, self.name)
                if self._closed:
                    return
        finally:
            self._capture.release()

    def _arriving(self) -> Iterator[tuple[int, AnyArray, float]]:
        """Yield the pictures of a camera or a stream with their numbers and stamps."""
        for index, pixels in self._decoded():
            yield index, pixels, time.monotonic() - self.opened_s
        if not self._closed:
            logger.warning("%s ended: %d reads in a row failed", self.name, MAX_FAILURES)

    def _recorded(self, stated: int) -> Iterator[tuple[int, AnyArray, float]]:
        """Yield the pictures of a recording, which ends where none can be read, with their numbers and stamps."""
        import cv2

        index, seconds = 0, 0.0
        while not self._closed:
            read, pixels = self._capture.read()
            if not read:
                break
            seconds = max(float(self._capture.get(cv2.CAP_PROP_POS_MSEC)), 0.0) / _MS_PER_S
            yield index, pixels, seconds if self._rate is None else index / self._rate
            index += 1
        # What is stated may be the duration by the rate, rounded.
        reached = max(index, round(seconds * (self._stated_fps or 0.0)) + 1)
        if not self._closed and reached + 1 < stated:
            logger.warning("%s ended after %d frames, and states about %d", self.name, index, stated)

    def _decoded(self) -> Iterator[tuple[int, AnyArray]]:
        index = failures = 0
        while failures < MAX_FAILURES and not self._closed:
            read, pixels = self._capture.read()
            if not read:
                failures += 1
                time.sleep(RETRY_S)
                continue
            if failures:
                self._skip_frames(index, failures)
                index += failures
                failures = 0
            yield index, pixels
            index += 1


def without_password(address: str) -> str:
    """Return an address without the user and the password in it."""
    return re.sub(r"//[^/?#]*@", "//***@", address)


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
