"""Two streams from their sources to the results of a rig: the input of ``dloftbs stereo``."""

from __future__ import annotations

from collections.abc import Generator, Iterator
from contextlib import ExitStack
from dataclasses import replace
from itertools import islice
from typing import Any

from dloftbs.cli.followed_stream import FollowedStream, StreamOptions
from dloftbs.cli.frames import UsableFrames
from dloftbs.cli.input_options import InputOptions
from dloftbs.cli.stream_report import RunReport
from dloftbs.data.frame import Frame
from dloftbs.data.frame_result import FrameResult
from dloftbs.errors import InputError
from dloftbs.sources import Source
from dloftbs.sources.video import LiveSource
from dloftbs.stereo import CameraRig, StereoPipeline
from dloftbs.support.overlap import Ahead, cores

_APART_S = 0.02
"""Largest difference of the times of two views of one moment where nobody knows the frame rate, seconds.

Source: by hand; less than half of the time between frames at 25 a second.
"""

Pair = tuple[Frame, Frame]


class StereoRun(FollowedStream[Pair]):
    """Two open streams and the report on them; a context manager that reads in its block, and closes the sources.

    Parameters
    ----------
    where : (str, str)
        Left and right, as `dloftbs.sources.open` takes them.
    rig : CameraRig
        Of two cameras.
    options : StreamOptions
        Of the left stream, and of the run.
    right : InputOptions
        Of the right stream.
    side_by_side : bool
        Whether the left stream shows both views beside each other.

    Raises
    ------
    InputError, SourceError
        As `dloftbs.sources.open`, and if the rig has another number of cameras.
    """

    def __init__(
        self,
        where: tuple[str, str],
        rig: CameraRig,
        options: StreamOptions,
        right: InputOptions,
        *,
        side_by_side: bool = False,
    ) -> None:
        if len(rig.cameras) != 2:
            raise InputError(f"the rig of two streams must have two cameras, got {len(rig.cameras)}")
        self._pipeline = StereoPipeline(rig, options.config)
        self.options = options
        segmented = options.config.segmentation.needs_image
        inputs = [options.inputs] if side_by_side else [options.inputs, right]
        self._sources: list[Source] = []
        with ExitStack() as stack:
            for path, own, camera in zip(where, inputs, rig.cameras, strict=False):
                # Pictures are read as stored, since a camera goes with them; a registration has its own.
                beside = replace(camera, size=None) if own.registration is None else None
                source = replace(own, camera=beside).open(
                    path,
                    options.fps,
                    segmented=segmented,
                    mask_is=options.config.segmentation.mask_is,
                    jobs=max(cores() // len(inputs), 1),
                    keep_messages=options.keep_messages,
                )
                self._sources.append(stack.enter_context(source))
            stack.pop_all()
        self.source = self._sources[0]
        lives = [source for source in self._sources if isinstance(source, LiveSource)]
        for source in lives:  # one clock for all, though one was opened after the other
            source.opened_s = lives[0].opened_s
        names = " and ".join(source.name for source in self._sources)
        self._nothing = f"{names}: no moment of both views could be read"
        self._frames = [
            UsableFrames(source, options.config, own, path)
            for source, own, path in zip(self._sources, inputs, where, strict=False)
        ]
        lengths = [source.length for source in self._sources if source.length is not None]
        usable = -(-min(lengths) // options.every) if lengths else None
        length = min((n for n in (usable, options.limit) if n is not None), default=None)
        self.report = RunReport(length, objects=options.config.linking.objects)
        self._read = Ahead(self._wanted(), newest=self.source.live)

    @property
    def _skipped(self) -> int:
        return sum(frames.skipped for frames in self._frames)

    def _result_of(self, given: Pair) -> tuple[Frame, FrameResult]:
        """Return the left frame and the left view's result, with the rig's ids and curves."""
        result = self._pipeline.process(given)
        return replace(given[0], camera=self._pipeline.rig.cameras[0]), result.as_frame_result()

    def _wanted(self) -> Generator[Pair, None, None]:
        """Yield the pairs, and close the sources in the thread that reads; of recordings, read none in excess."""
        with ExitStack() as stack:
            for source in self._sources:
                stack.enter_context(source)
            if len(self._frames) == 1:
                pairs: Iterator[Pair] = map(halves_of, self._frames[0])
            else:
                apart_s = _APART_S if not self.source.fps else 0.5 / self.source.fps
                pairs = pairs_of(iter(self._frames[0]), iter(self._frames[1]), apart_s)
            wanted = islice(pairs, 0, None, self.options.every)
            yield from wanted if self.source.live else islice(wanted, self.options.limit)


def pairs_of(left: Iterator[Frame], right: Iterator[Frame], apart_s: float) -> Iterator[Pair]:
    """Yield the frames of two streams that belong together, by their times, or by their numbers where one has none.

    Parameters
    ----------
    left, right : iterator of Frame
    apart_s : float
        Largest difference of the times of one moment, seconds. What has no partner is left out, and so is a frame whose
        successor is nearer to its partner.
    """
    one, other = _Stream(left), _Stream(right)
    while one.frame is not None and other.frame is not None:
        a, b = one.frame, other.frame
        if a.stamp is None or b.stamp is None:
            late, most = float(a.index - b.index), 0.0
        else:
            late, most = a.stamp - b.stamp, apart_s
        earlier = other if late > 0.0 else one
        if abs(late) > most or earlier.comes_nearer(abs(late)):
            earlier.advance()
        else:
            yield a, b
            one.advance()
            other.advance()


class _Stream:
    """A stream of frames to be paired, of which the next one is read only where it may be the better partner.

    Attributes
    ----------
    frame : Frame or None
        The current one; None at the end.
    """

    def __init__(self, frames: Iterator[Frame]) -> None:
        self._frames = frames
        self._ahead: list[Frame | None] = []
        self._least_s = 0.0
        self.frame = next(frames, None)

    def advance(self) -> None:
        """Go on to the next frame."""
        before = self.frame
        self.frame = self._ahead.pop() if self._ahead else next(self._frames, None)
        step_s = _step_s(before, self.frame)
        if step_s > 0.0:
            self._least_s = min(self._least_s or step_s, step_s)

    def comes_nearer(self, early_s: float) -> bool:
        """Return whether the next frame is nearer to a time that is so much later than the current one's.

        Where frames follow each other too slowly for that, none is read: a camera has none yet.
        """
        if 2.0 * early_s <= self._least_s:
            return False
        if not self._ahead:
            self._ahead.append(next(self._frames, None))
        step_s = _step_s(self.frame, self._ahead[0])
        return 0.0 < step_s < 2.0 * early_s


def _step_s(before: Frame | None, after: Frame | None) -> float:
    """Return the time from one frame to another, seconds; 0 where it is not known."""
    if before is None or after is None or before.stamp is None or after.stamp is None:
        return 0.0
    return after.stamp - before.stamp


def halves_of(frame: Frame) -> Pair:
    """Return the left and the right half of a frame that shows two views beside each other.

    Raises
    ------
    InputError
        If its width is odd.
    """
    width = frame.size[1]
    if width % 2:
        raise InputError(f"a frame with two views beside each other must have an even width, got {width}")
    return _cut(frame, slice(None, width // 2)), _cut(frame, slice(width // 2, None))


def _cut(frame: Frame, columns: slice) -> Frame:
    names = "index", "stamp", "name", "depth_unit_m", "mask_is"
    kept: dict[str, Any] = {name: getattr(frame, name) for name in names}
    for name in ("image", "mask", "depth", "occluders", "instances"):
        whole = getattr(frame, name)
        kept[name] = None if whole is None else whole[:, columns]
    return Frame(**kept)
