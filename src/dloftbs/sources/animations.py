"""Animated PNG and WebP files: a stream in one image file."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import accumulate
from pathlib import Path

import numpy as np

from dloftbs.camera import PinholeCamera
from dloftbs.data.frame import Frame
from dloftbs.errors import SourceError, source_errors
from dloftbs.sources.alpha_channel import LEFT_OUT, split, telling
from dloftbs.sources.image_header import is_animated, is_lossy, read_durations
from dloftbs.sources.pixels import Kind, check_header, image_or_mask, read_bytes
from dloftbs.sources.source import ReadSource, logger
from dloftbs.support.arrays import AnyArray

ANIMATED_EXTENSIONS = (".png", ".webp")
"""Endings of the image files that may hold an animation."""
_MAX_PIXELS = 1 << 26
"""Pixels that are decoded at a time, 0.3 GB with an alpha channel: OpenCV begins anew for each piece."""
_NEEDED = "reading animations needs OpenCV 4.11 or newer: pip install -U opencv-python-headless"


class AnimationSource(ReadSource):
    """The frames of an animated PNG or WebP file, which is kept in memory as it is, compressed.

    It is an image stream unless `kind` is "mask", as a video is.

    Parameters
    ----------
    data : bytes
        Content of the file.
    name : str
        For messages.
    label : str
        Name of the frames, before their number.
    kind : {"auto", "image", "mask"}
        "auto" is "image".
    mask_is, camera
        As `FileSource` has them.
    fps : float, optional
        Gives the stamps ``index / fps``, in place of the file's times. A file that shows a frame for no time has none.

    Raises
    ------
    SourceError
        If the header is that of no image, or of one that is too large, or OpenCV reads no animations.
    """

    def __init__(
        self,
        data: bytes,
        name: str,
        label: str,
        *,
        kind: Kind = "auto",
        mask_is: str = "auto",
        camera: PinholeCamera | None = None,
        fps: float | None = None,
    ) -> None:
        import cv2

        self.name = name
        with source_errors(name):
            rows, columns = check_header(data)
            if not hasattr(cv2, "imdecodeanimation"):
                raise SourceError(f"this is OpenCV {cv2.__version__}, and {_NEEDED}")
        durations = read_durations(data)
        self.length = len(durations)
        self._stamps = _stamps(durations, fps)
        self.fps = _rate(durations) if fps is None else fps
        self._data = data
        self._label = label
        self._kind: Kind = "mask" if kind == "mask" else "image"
        self._mask_is = mask_is
        self._camera = camera
        self._piece = max(1, _MAX_PIXELS // max(rows * columns, 1))

    def _frames(self) -> Iterator[Frame]:
        assert self.length is not None  # the constructor counted
        lossy = is_lossy(self._data)
        count = 0
        left_out = False
        for count, (pixels, alpha) in enumerate(self._decoded(), 1):
            index = count - 1
            with source_errors(self.name):
                image, mask = image_or_mask(pixels, self._kind, self._mask_is, lossy=lossy, alpha=alpha)
            if image is not None and not left_out and telling(pixels, alpha) is not None:
                left_out = True
                logger.warning("%s: %s", self.name, LEFT_OUT)
            stamp, name = self._stamps[index], f"{self._label}#{index}"
            yield Frame(
                image=image, mask=mask, camera=self._camera, index=index, stamp=stamp, name=name, mask_is=self._mask_is
            )
            if self._closed:
                return
        if count == 0:
            raise SourceError(f"{self.name}: cannot be decoded as an animation: it is corrupt or cut off")
        if count < self.length:
            self.skipped += self.length - count
            logger.warning(
                "%s: read %d frames of the %d that it should have; it is cut off or damaged",
                self.name,
                count,
                self.length,
            )

    def _decoded(self) -> Iterator[tuple[AnyArray, AnyArray | None]]:
        """Yield the colours of each picture, and its alpha channel if it has one."""
        import cv2

        data = np.frombuffer(self._data, np.uint8)
        assert self.length is not None
        for start in range(0, self.length, self._piece):
            wanted = min(self._piece, self.length - start)
            try:
                _, animation = cv2.imdecodeanimation(data, start, wanted)
            except cv2.error as error:
                logger.warning("%s: frame %d cannot be decoded: %s", self.name, start, error.err)
                return
            yield from map(split, animation.frames)
            if len(animation.frames) < wanted:
                return


def open_animation(
    path: Path,
    *,
    kind: Kind = "auto",
    mask_is: str = "auto",
    camera: PinholeCamera | None = None,
    fps: float | None = None,
) -> AnimationSource | None:
    """Open an image file as an animation; None where it is none, or cannot be read.

    Raises
    ------
    SourceError
        As `AnimationSource`.
    """
    if path.suffix.lower() not in ANIMATED_EXTENSIONS:
        return None
    try:
        with path.open("rb") as file:
            if not is_animated(file):
                return None
    except OSError:  # which comes again where the image is read
        return None
    data = read_bytes(path)
    if len(read_durations(data)) < 2:
        return None
    return AnimationSource(data, str(path), path.name, kind=kind, mask_is=mask_is, camera=camera, fps=fps)


def _stamps(durations: tuple[float, ...], fps: float | None) -> list[float | None]:
    if fps is not None:
        return [index / fps for index in range(len(durations))]
    if not all(durations):
        return [None] * len(durations)
    return [0.0, *accumulate(durations[:-1])]


def _rate(durations: tuple[float, ...]) -> float | None:
    """Return the mean number of frames per second; None where the file shows a frame for no time."""
    return len(durations) / math.fsum(durations) if all(durations) else None
