"""One stream from its source to its results: the input of ``dloftbs track``, and each one of ``dloftbs batch``."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from itertools import islice
from types import TracebackType

from dloftbs.cli.followed_stream import FollowedStream, StreamOptions
from dloftbs.cli.frames import UsableFrames
from dloftbs.cli.stream_report import RunReport
from dloftbs.data.frame import Frame
from dloftbs.data.frame_result import FrameResult
from dloftbs.pipeline import Pipeline
from dloftbs.pipeline.mask_faults import MaskSamples
from dloftbs.support.arrays import AnyArray
from dloftbs.support.overlap import Ahead, cores


class StreamRun(FollowedStream[Frame]):
    """An open stream and the report on it; a context manager that reads in its block, and closes the source.

    Parameters
    ----------
    where : str or sequence of str
        As `dloftbs.sources.open` takes it.
    options : StreamOptions
    in_turn : bool
        Read, track and write in the thread of the caller alone: other processes use the other cores.

    Raises
    ------
    InputError, SourceError
        As `dloftbs.sources.open`.
    """

    def __init__(self, where: str | Sequence[str], options: StreamOptions, *, in_turn: bool = False) -> None:
        self._pipeline = Pipeline(options.config)
        jobs = 1 if in_turn else cores()
        self.source = options.inputs.open(
            where,
            options.fps,
            segmented=options.config.segmentation.needs_image,
            mask_is=options.config.segmentation.mask_is,
            jobs=jobs,
            keep_messages=options.keep_messages,
        )
        self.options = options
        self._nothing = f"{self.source.name}: no frame could be read"
        self._in_turn = in_turn
        self._frames = UsableFrames(self.source, options.config, options.inputs, where, options.every)
        usable = None if self.source.length is None else -(-self.source.length // options.every)
        length = min((n for n in (usable, options.limit) if n is not None), default=None)
        self.report = RunReport(length, objects=options.config.linking.objects)
        self.report.masks = self._samples = MaskSamples(options.config.cleaning)
        self._read = Ahead(self._wanted(), newest=self.source.live, in_turn=in_turn)

    @property
    def mask(self) -> AnyArray | None:
        """Mask of the last frame that was tracked: of the one that is written, where all goes in turn."""
        return self._pipeline.mask

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        super().__exit__(kind, error, trace)
        if self._in_turn:
            self.source.close()  # by nobody yet, if no frame was asked for; else only the thread that reads may

    @property
    def _skipped(self) -> int:
        return self._frames.skipped

    def _result_of(self, given: Frame) -> tuple[Frame, FrameResult]:
        result = self._pipeline.process(given)
        self._samples.add(self._pipeline.mask, result.detections, len(result.tracks))
        return given, result

    def _wanted(self) -> Generator[Frame, None, None]:
        """Yield the frames, and close the source in the thread that reads; of a recording, read none in excess."""
        with self.source:
            yield from self._frames if self.source.live else islice(self._frames, self.options.limit)
