"""Number of objects over the whole source, counted in the background on a sample of its frames."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from threading import Event, Lock, Thread
from time import monotonic

from dloftbs.errors import DloftbsError
from dloftbs.pipeline import Pipeline
from dloftbs.pipeline.soft_mask import plain_mask
from dloftbs.pipeline.steadiness import Steadiness
from dloftbs.ui.advice import doubt, mend_in_strip, set_cables
from dloftbs.ui.frame_store import FrameStore
from dloftbs.ui.tune_document import TuneDocument
from dloftbs.ui.tune_segmentation import Segment

_TELL_EVERY_S = 0.15
_NEWS_S = 0.3  # between two looks for more frames
_PATIENCE_S = 5.0


@dataclass
class Counts:
    """The strip so far: frames and their numbers of objects, and what is strange about them."""

    document: TuneDocument | None = None
    objects: list[tuple[int, int]] = field(default_factory=list)
    done: bool = False
    warnings: list[str] = field(default_factory=list)


class Strip:
    """Counts the objects in all samples, anew with each document, in a thread that gives way to who draws.

    Parameters
    ----------
    store : FrameStore
    segmenter : callable
        From a document to what makes masks; None where the document is empty.
    make_pipeline : callable
        From a document to what finds and follows objects in its masks.
    tell : callable
        Called with the counts now and then, in this thread.
    """

    def __init__(
        self,
        store: FrameStore,
        segmenter: Callable[[TuneDocument], Segment | None],
        make_pipeline: Callable[[TuneDocument], Pipeline],
        tell: Callable[[Counts], None],
    ) -> None:
        self._store, self._segmenter, self._make_pipeline, self._tell = store, segmenter, make_pipeline, tell
        self.idle = Event()
        self.idle.set()
        self._lock = Lock()
        self._news = Event()
        self._wanted: TuneDocument | None = None
        self._closed = False
        self._thread = Thread(target=self._run, name="dloftbs-strip", daemon=True)

    def start(self, document: TuneDocument) -> None:
        """Begin with a document."""
        self.ask(document)
        self._thread.start()

    def ask(self, document: TuneDocument) -> None:
        """Count anew, with another document."""
        with self._lock:
            self._wanted = document
        self._news.set()

    def close(self) -> None:
        """Stop."""
        self._closed = True
        self._news.set()
        self.idle.set()
        if self._thread.is_alive():
            self._thread.join(_PATIENCE_S)

    def _run(self) -> None:
        while not self._closed:
            self._news.wait()
            self._news.clear()
            with self._lock:
                document = self._wanted
            if document is not None and not self._closed:
                self._count(document)

    def _interrupted(self) -> bool:
        return self._closed or self._news.is_set()

    def _count(self, document: TuneDocument) -> None:
        counts = Counts(document)
        try:
            segment = self._segmenter(document)
            if segment is not None:
                self._count_all(document, segment, counts)
        except DloftbsError as error:
            counts.warnings = [str(error)]
        if not self._interrupted():
            counts.done = True
            self._tell(counts)

    def _count_all(self, document: TuneDocument, segment: Segment, counts: Counts) -> None:
        pipeline, steadiness = self._make_pipeline(document), Steadiness(document.objects)
        doubted: str | None = None
        told, last = monotonic(), -1
        while not self._interrupted():
            ended = self._store.ended  # before the samples: none comes after it
            fresh = [frame for frame in self._store.samples() if frame.index > last]
            for frame in fresh:
                self.idle.wait()
                if self._interrupted():
                    return
                masked = replace(frame, mask=segment(frame))
                doubted = doubted or doubt(plain_mask(masked, pipeline.config), frame.name, document.roi)
                result = pipeline.process(masked)
                steadiness.add(result.tracks, len(result))
                last = frame.index
                counts.objects.append((frame.index, len(result)))
                if monotonic() - told > _TELL_EVERY_S:
                    told = monotonic()
                    self._tell(counts)
            warnings = doubted, mend_in_strip(steadiness), set_cables(steadiness)
            counts.warnings = [text for text in warnings if text is not None]
            if ended:
                return
            if not fresh:
                self._store.wait_for_samples(len(self._store.samples()), _NEWS_S)
