"""The stream with the results drawn on it, as a video or as one picture per frame."""

from __future__ import annotations

import logging
import math
import re
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path

import numpy as np

from dloftbs.data.frame import Frame
from dloftbs.data.frame_result import FrameResult
from dloftbs.errors import InputError
from dloftbs.sinks._earlier_files import EarlierFiles
from dloftbs.sinks._images import encode, fitted
from dloftbs.sinks._mp4 import H264Mp4
from dloftbs.sinks.sink import PathSink
from dloftbs.support.arrays import ByteArray, check_image
from dloftbs.support.safe_files import AppendFile, UnusedNames, claim_file, claim_folder, write_whole

logger = logging.getLogger("dloftbs.sinks")

Draw = Callable[[Frame, FrameResult], ByteArray]
"""Frame and result to a picture (H, W, 3), BGR."""

VIDEO_SUFFIXES = (".mp4", ".mov")
MIN_FPS, MAX_FPS = 0.01, 1000.0
"""Rates that a video may have, 1/s."""
_STEP_S = 1.0 / 30.0
"""From a frame to one without a later stamp, in a video by stamps."""
MAX_STEM_BYTES = 200
"""Of a picture's name; file systems take 255 bytes, some of which go to its number, its suffix and a temporary name."""
_UNSAFE = re.compile(r'[<>:"/\\|?*\x00-\x1f\x7f]')
_RESERVED = re.compile(r"(con|prn|aux|nul|com[0-9]|lpt[0-9])(\..*)?", re.IGNORECASE)  # names of devices on Windows
IMAGE_SUFFIXES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".webp")


def _default_draw(frame: Frame, result: FrameResult) -> ByteArray:
    from dloftbs import viz

    return viz.draw(frame, result)


class OverlayVideoSink(PathSink):
    """Writes a video of the frames with the results drawn on them: ids, directions, and inferred parts.

    The pictures are H.264, which every player and browser plays, in fragments of one picture each: whenever the process
    dies, the video plays with every frame for which `write` returned, but the last. The video has the size of its first
    picture; later ones of another size are scaled into it, with black bars and one warning in the log. A sink that got
    no frame leaves no file.

    Parameters
    ----------
    path : str or Path
        The file, ``.mp4`` or ``.mov``; missing folders are made, an older file is replaced with the first
        frame.
    fps : float or None
        Frames per second of the video, 0.01 to 1000. None: each picture is shown at the stamp of its frame, counted
        from the first one, as is right for a camera, whose frames may come unevenly. A frame whose stamp is missing, or
        not later than the one before, is shown 1/30 s after it.
    draw : callable, optional
        ``draw(frame, result)`` returns the picture (H, W, 3), uint8, BGR. `dloftbs.viz.draw` where it is left out.

    Raises
    ------
    InputError
        If the suffix is another or `fps` is out of range; in `write`, if `draw` returned something else.
    SinkError
        If the file cannot be opened.
    """

    def __init__(self, path: str | Path, fps: float | None = 30.0, draw: Draw = _default_draw) -> None:
        super().__init__(path)
        self._suffix = self._path.suffix.lower()
        if self._suffix not in VIDEO_SUFFIXES:
            raise InputError(f"a video's name must end in {', '.join(VIDEO_SUFFIXES)}, got {str(path)!r}")
        self._rate: Fraction | None = None
        if fps is not None:
            if not isinstance(fps, (int, float)) or not math.isfinite(fps) or not MIN_FPS <= fps <= MAX_FPS:
                raise InputError(f"fps must be None or a number in {MIN_FPS:g}..{MAX_FPS:g}, got {fps!r}")
            self._rate = Fraction(fps).limit_denominator(1001)
        self._shown_s: float | None = None  # of the last picture
        self._stamp: float | None = None
        self._draw = draw
        self._video: H264Mp4 | None = None
        self._warned = False
        self._file = AppendFile(self._path)

    def _write(self, frame: Frame, result: FrameResult) -> None:
        image = check_image(self._draw(frame, result))
        if self._video is None:
            self._video = H264Mp4(self._file, (image.shape[0], image.shape[1]), self._rate, self._suffix[1:])
        size = self._video.size
        if image.shape[:2] != size:
            if not self._warned:
                logger.warning("a picture of %s in a video of %s (rows, columns): scaled", image.shape[:2], size)
                self._warned = True
            image = fitted(image, size)
        self._video.add(np.ascontiguousarray(image), None if self._rate is not None else self._time_of(frame))

    def _time_of(self, frame: Frame) -> float:
        """Return when the next picture is shown, seconds."""
        since = 0.0 if frame.stamp is None or self._stamp is None else frame.stamp - self._stamp
        self._stamp = frame.stamp
        self._shown_s = 0.0 if self._shown_s is None else self._shown_s + (since if since > 0.0 else _STEP_S)
        return self._shown_s

    def _close(self) -> None:
        if self._video is None:
            self._file.discard()
            return
        try:
            self._video.finish()
        finally:
            self._file.close()


class OverlayPictureSink(PathSink):
    """Writes one picture: a single frame with the results drawn on it.

    It appears as a whole or not at all, whenever the process dies.

    Parameters
    ----------
    path : str or Path
        The file: ``.png``, ``.jpg``, ``.bmp``, ``.tif`` or ``.webp``; missing folders are made, an older file is
        replaced.
    draw : callable, optional
        ``draw(frame, result)`` returns the picture (H, W, 3), uint8, BGR. `dloftbs.viz.draw` where it is left out.

    Raises
    ------
    InputError
        If the suffix is another; in `write`, if `draw` returned something else, or a second frame comes.
    SinkError
        If the folder cannot be made.
    """

    def __init__(self, path: str | Path, draw: Draw = _default_draw) -> None:
        super().__init__(path)
        self._suffix = self._path.suffix.lower()
        if self._suffix not in IMAGE_SUFFIXES:
            raise InputError(f"a picture's name must end in {', '.join(IMAGE_SUFFIXES)}, got {str(path)!r}")
        self._draw = draw
        self._written = False
        self._claim = claim_file(self._path)

    def _write(self, frame: Frame, result: FrameResult) -> None:
        if self._written:
            raise InputError(f"{str(self._path)!r} is one picture, and this is a second frame; give a folder instead")
        data = encode(check_image(self._draw(frame, result)), self._suffix)
        write_whole(self._path, data)
        self._written = True

    def _close(self) -> None:
        self._claim.release()  # the picture is complete already


class OverlayImagesSink(PathSink):
    """Writes one picture per frame, with the results drawn on it.

    A picture is named as its frame, without folder and suffix, in at most 200 bytes that every file system takes: as
    ``cable_000012`` for ``cable.mp4#12``, or by the frame's index in six digits where it has no name; so none ever
    leaves the folder. What comes a second time under the same name gets ``_1`` and so on. Pictures of an earlier run
    are replaced, and closing warns in the log of those that stay. Each appears as a whole or not at all, whenever the
    process dies. The names used stay in memory.

    Parameters
    ----------
    folder : str or Path
        Made where it is missing.
    draw : callable, optional
        ``draw(frame, result)`` returns the picture (H, W, 3), uint8, BGR. `dloftbs.viz.draw` where it is left out.
    suffix : str
        The format: ``.png``, ``.jpg``, ``.bmp``, ``.tif`` or ``.webp``.
    ending : str
        Stands between name and suffix, for a folder that holds other pictures: with ``".overlay"``, they are named
        ``photo.overlay.png``.

    Raises
    ------
    InputError
        If the suffix is another or the ending holds a slash; in `write`, if `draw` returned something else.
    SinkError
        If the folder cannot be made.
    """

    def __init__(self, folder: str | Path, draw: Draw = _default_draw, suffix: str = ".png", ending: str = "") -> None:
        super().__init__(folder)
        if _UNSAFE.search(ending):
            raise InputError(f"ending must be a part of a file's name, got {ending!r}")
        if suffix not in IMAGE_SUFFIXES:
            raise InputError(f"suffix must be one of {', '.join(IMAGE_SUFFIXES)}, got {suffix!r}")
        self._draw = draw
        self._format = suffix
        self._suffix = f"{ending}{suffix}"
        self._unused = UnusedNames()
        self._earlier = EarlierFiles(self._path, self._suffix)
        self._claim = claim_folder(self._path)

    def _write(self, frame: Frame, result: FrameResult) -> None:
        data = encode(check_image(self._draw(frame, result)), self._format)
        name = f"{self._unused(picture_name(frame))}{self._suffix}"
        self._earlier.replaced_by(name)
        write_whole(self._path / name, data)

    def _close(self) -> None:
        self._claim.release()  # every picture is complete already
        self._earlier.warn()


def picture_name(frame: Frame) -> str:
    """Return the name of a frame's picture, without its suffix, that every file system takes."""
    name, mark, number = frame.name.rpartition("#")  # of a video's or a stack's frame
    is_numbered = bool(mark) and number.isascii() and number.isdecimal()
    text = f"{Path(name).stem}_{int(number):06d}" if is_numbered else Path(frame.name).stem
    text = text.encode("utf-8", "backslashreplace").decode("utf-8")
    stem = _UNSAFE.sub("_", text).encode("utf-8")[:MAX_STEM_BYTES].decode("utf-8", "ignore").strip(". ")
    if _RESERVED.fullmatch(stem):
        stem = f"_{stem}"
    return stem or f"{frame.index:06d}"
