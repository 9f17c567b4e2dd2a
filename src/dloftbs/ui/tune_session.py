"""A segmentation that is tuned on the frames of a source, for `dloftbs tune`."""

from __future__ import annotations

import asyncio
import functools
from collections.abc import Callable, Coroutine
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

import msgspec

from dloftbs._version import __version__
from dloftbs.config import Config, Roi, SegmentationConfig, read_roi
from dloftbs.data.frame import Frame
from dloftbs.data.frame_result import FrameResult
from dloftbs.errors import DloftbsError, InputError
from dloftbs.pipeline import Pipeline
from dloftbs.pipeline.soft_mask import plain_mask
from dloftbs.support.arrays import AnyArray
from dloftbs.support.documents import check_readable
from dloftbs.support.safe_files import write_whole
from dloftbs.support.text import readable
from dloftbs.ui.advice import doubt
from dloftbs.ui.audience import Audience
from dloftbs.ui.frame_store import FrameStore
from dloftbs.ui.messages import (
    Accept,
    AcceptStrokes,
    Ack,
    Clear,
    Delete,
    Draw,
    Erase,
    Redo,
    Save,
    Seek,
    SetHeight,
    SetMethod,
    SetObjects,
    SetRanges,
    SetRegion,
    TuneMessage,
    Undo,
    ViewMessage,
)
from dloftbs.ui.payload import describe
from dloftbs.ui.strip import Counts, Strip
from dloftbs.ui.tune_document import STROKES, DrawnStroke, History, Point, TuneDocument, edited
from dloftbs.ui.tune_segmentation import (
    RegionSegmenter,
    Segment,
    Translator,
    lies_on,
    object_at,
    strokes_along,
    suggestion,
)
from dloftbs.ui.viewer import Viewer
from dloftbs.ui.wire import encode_jpeg, encode_picture, encode_runs, encode_text
from dloftbs.viz.overlay import as_picture
from dloftbs.viz.style import Style

_LIVE_PERIOD_S = 0.04  # from one look at a camera to the next
_TRIED_FRAMES = 8  # of a video, before a guess is offered
_NO_STROKES = "there are none: draw one along a cable"
T = TypeVar("T")


@dataclass
class _Look:
    """One browser's part: the frame it looks at, what it is just drawing, and the image that it has."""

    index: int | None
    draft: TuneDocument | None = None
    image: int | None = None
    number: int = 0


class TuneSession:
    """One document for all browsers, each with a frame of its own.

    Parameters
    ----------
    store : FrameStore
        Started and closed with the session.
    config : Config
        To begin with; all but the segmentation, the number of objects and the region of interest stays as it is.
    target : Path, optional
        File that is written on saving, and no other; without it the page shows the text.
    command : str
        Command to run next.
    """

    def __init__(self, store: FrameStore, config: Config, target: Path | None, command: str) -> None:
        self._store, self._config, self._target, self._command = store, config, target, command
        roi = None if config.region.roi is None else read_roi(config.region.roi)
        self._translator = Translator(store.source.name, store.frame, config.segmentation, roi, live=store.live)
        self._history = History(
            msgspec.structs.replace(self._translator.first, objects=config.linking.objects, roi=roi)
        )
        self._saved = self._history.document
        self._audience = Audience()
        self._looks: dict[Viewer, _Look] = {}
        self._pool = ThreadPoolExecutor(1, "dloftbs-tuning")
        self._rest = msgspec.structs.replace(
            config, segmentation=SegmentationConfig(mask_is=config.segmentation.mask_is)
        )
        self._pipeline: tuple[tuple[int | None, Roi | None], Pipeline] | None = None
        self._segmenter: tuple[TuneDocument, RegionSegmenter] | None = None
        self._guesses: dict[tuple[int, TuneDocument], bool] = {}
        self._trial: tuple[tuple[int, TuneDocument], asyncio.Task[None]] | None = None
        self._strip = Strip(store, self._new_segmenter, self._new_pipeline, self._tell_counts)
        self._counts = Counts()
        self._tasks: set[asyncio.Task[None]] = set()
        self._loop: asyncio.AbstractEventLoop | None = None

    def open(self, loop: asyncio.AbstractEventLoop) -> None:
        """Begin to read the source."""
        self._loop = loop
        self._audience.open(loop)
        self._store.start()
        self._strip.start(self._history.document)
        if self._store.live:
            self._follow_camera()

    def close(self) -> None:
        """End."""
        self._audience.close()
        self._store.stop()  # a look at a silent camera waits for its first frame
        self._strip.close()
        self._pool.shutdown(wait=True, cancel_futures=True)
        self._store.close()

    def join(self, viewer: Viewer) -> None:
        """Take a browser in."""
        self._audience.add(viewer)
        self._looks[viewer] = _Look(None if self._store.live else 0)
        viewer.post("state", encode_text("state", **self._state()))
        viewer.post("strip", encode_text("strip", **self._strip_fields(self._counts)))
        viewer.refresh()

    def leave(self, viewer: Viewer) -> None:
        """Forget a browser."""
        self._audience.remove(viewer)
        self._looks.pop(viewer, None)

    def handle(self, viewer: Viewer, message: TuneMessage | ViewMessage) -> None:
        """Do what a message asks.

        Raises
        ------
        DloftbsError
            If that cannot be.
        """
        look, document = self._looks[viewer], self._history.document
        if isinstance(message, (Draw, Accept, Delete)):
            self._store.pin(message.frame)
        match message:
            case Ack():
                return
            case Seek():
                if message.index is None and not self._store.live:
                    raise InputError("only a camera has a newest frame")
                look.index, look.draft = message.index, None
                viewer.refresh()
            case (
                Draw()
                | AcceptStrokes()
                | Erase()
                | SetRanges()
                | SetHeight()
                | SetMethod()
                | SetObjects()
                | SetRegion()
                | Clear()
            ):
                self._edit(viewer, look, edited(document, message), done=getattr(message, "done", True))
            case Undo() | Redo():
                look.draft = None
                self._history.undo() if isinstance(message, Undo) else self._history.redo()
                self._changed()
            case Accept():
                look.draft = None
                self._do(viewer, self._accept(message.frame))
            case Delete():
                self._do(viewer, self._delete(message.frame, message.point))
            case Save():
                self._do(viewer, self._save())
            case _:
                raise InputError(f"this page does not take the message {type(message).__name__}")

    def _edit(self, viewer: Viewer, look: _Look, document: TuneDocument, *, done: bool) -> None:
        """Show a draft to the browser that makes it, or take a change over for all."""
        look.draft = None if done else document
        if done:
            self._history.change(document)
            self._changed()
        viewer.refresh()

    def _changed(self) -> None:
        if not self._tasks:  # an object that is being deleted needs its frame
            drafts = [look.draft for look in self._looks.values() if look.draft is not None]
            documents = [*self._history.states, *drafts]
            self._store.unpin_others({stroke.frame for document in documents for stroke in document.strokes})
        self._strip.ask(self._history.document)
        self._audience.tell("state", **self._state())
        self._audience.refresh()

    def _state(self) -> dict[str, Any]:
        history, source = self._history, self._store.source
        return {
            "mode": "tune",
            "name": source.name,
            "live": self._store.live,
            "length": self._store.length,
            "fps": source.fps,
            "target": None if self._target is None else str(self._target),
            "command": self._command_for(history.document),
            "can_undo": history.can_undo,
            "can_redo": history.can_redo,
            "saved": history.document == self._saved,
            **history.document.to_dict(),
        }

    def _do(self, viewer: Viewer, work: Coroutine[Any, Any, None]) -> asyncio.Task[None]:
        """Do something that takes time, and tell the browser that asked if it fails."""

        async def done() -> None:
            try:
                await work
            except DloftbsError as error:
                viewer.post("error", encode_text("error", kind=type(error).__name__, message=str(error)))

        task = asyncio.ensure_future(done())
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        return task

    async def _accept(self, index: int) -> None:
        """Take the suggestion for a frame over as strokes along its curves."""
        strokes = strokes_along(index, await self._in_pool(lambda: self._guess(index)))
        if not strokes:
            raise InputError("nothing in this frame looks like a cable: draw a stroke along it")
        document = self._history.document
        for stroke in strokes:
            document = document.with_stroke(stroke)
        self._history.change(document)
        self._changed()

    async def _delete(self, index: int, point: Point) -> None:
        """Draw on the object at a point as no cable, which the file then says, too."""
        removed, added = await self._in_pool(lambda: self._strokes_without(index, point))
        document = self._history.document  # which somebody may have changed meanwhile
        strokes = (*(one for one in document.strokes if one not in removed), *added)
        self._history.change(msgspec.structs.replace(document, strokes=strokes, method=STROKES))
        self._changed()

    def _strokes_without(self, index: int, point: Point) -> tuple[list[DrawnStroke], list[DrawnStroke]]:
        """Return the strokes to remove and those to add, so that the object at a point is no cable."""
        document, frame = self._history.document, self._store.frame(index)
        if frame.image is None:
            raise InputError("these frames are masks already: there is nothing to tune")
        mask, is_suggested = self._mask(document, frame, is_draft=False)
        result = self._detector(document).detect(replace(frame, mask=mask))
        deleted = object_at(result, point)
        if deleted is None:
            raise InputError("there is no object at this place: click on its curve")
        kept = strokes_along(frame.index, [one for one in result if one is not deleted]) if is_suggested else []
        on_it = [one for one in document.strokes if one.cable and one.frame == index and lies_on(one, deleted)]
        left = msgspec.structs.replace(
            document, strokes=tuple(one for one in document.strokes if one not in on_it), method=STROKES
        )
        is_by_strokes = document.method == STROKES and left.is_empty
        if not (is_suggested or is_by_strokes or left.shows_cable):
            raise InputError(f"an object can be deleted where strokes make the mask, and {_NO_STROKES}")
        return on_it, [*kept, *strokes_along(index, [deleted], cable=False)]

    def _try_soon(self, viewer: Viewer, index: int, document: TuneDocument) -> None:
        """Try the guess for a frame, unless that was done, in the place of another one that is being tried."""
        asked = index, document
        if asked in self._guesses or self._store.live:
            return
        if self._trial is not None and not self._trial[1].done():
            self._trial[1].cancel()
            del self._guesses[self._trial[0]]
        self._guesses[asked] = False
        self._trial = asked, self._do(viewer, self._try_guess(index, document))

    async def _try_guess(self, index: int, document: TuneDocument) -> None:
        """Try the strokes along a guess on frames all over the video, and offer it where they find as many objects."""
        while not self._store.ended:
            await asyncio.sleep(_LIVE_PERIOD_S)
        guess = await self._in_pool(lambda: self._guess(index))
        tried = msgspec.structs.replace(document, strokes=tuple(strokes_along(index, guess)))
        samples = self._store.samples()
        some = samples[:: max(1, len(samples) // _TRIED_FRAMES)]
        held = 0
        for frame in some if tried.strokes else ():
            if self._history.document != document:
                return
            held += await self._in_pool(functools.partial(self._finds, tried, frame, len(guess)))
        self._guesses[index, document] = 2 * held > len(some)
        self._audience.refresh()  # those whose trial this one took the place of ask again

    def _finds(self, document: TuneDocument, frame: Frame, count: int) -> bool:
        """Return whether a document finds so many objects in a frame, and little else."""
        mask, _ = self._mask(document, frame, is_draft=False)
        found = self._detector(document).detect(replace(frame, mask=mask))
        return len(found) == count and doubt(mask, roi=document.roi) is None

    async def _save(self) -> None:
        """Write the configuration, or show it where no file was named."""
        document = self._history.document
        if document.is_empty and document.roi is None:
            raise InputError("nothing says yet what is cable: draw a stroke along one first")
        if document.method == STROKES and document.strokes and not document.shows_cable:
            raise InputError(f"Not cable strokes count beside strokes along cables, and {_NO_STROKES}, or erase these")
        text = await self._in_pool(lambda: self._text_of(document))
        data = check_readable(text)
        if self._target is not None:
            target = self._target
            await self._in_pool(lambda: write_whole(target, data))
        self._saved = document
        self._audience.tell("saved", text=text, command=self._command_for(document))
        self._audience.tell("state", **self._state())

    def _text_of(self, document: TuneDocument) -> str:
        section = self._translator.section_of(document)
        config = msgspec.structs.replace(self._config, segmentation=section)
        config = config.replace({"linking.objects": document.objects}).with_roi(document.roi)
        name = readable(self._store.source.name)
        return f"# The configuration of dloftbs {__version__}, tuned on {name}\n{config.to_yaml()}"

    def _command_for(self, document: TuneDocument) -> str:
        """Return the command to run next; it names the number of cables, which the file holds as well."""
        return self._command if document.objects is None else f"{self._command} --objects {document.objects}"

    async def _in_pool(self, function: Callable[[], T]) -> T:
        return await asyncio.get_running_loop().run_in_executor(self._pool, function)

    async def render(self, viewer: Viewer) -> tuple[int, bytes] | None:
        """Return the frame that a browser looks at, with the mask and the curves of the moment."""
        look = self._looks.get(viewer)
        if look is None:
            return None
        document, index, image = look.draft or self._history.document, look.index, look.image
        is_draft = look.draft is not None
        self._strip.idle.clear()
        try:
            frame, header, parts = await self._in_pool(lambda: self._picture(document, index, image, is_draft=is_draft))
        except DloftbsError as error:
            viewer.post("error", encode_text("error", kind=type(error).__name__, message=str(error)))
            return None
        finally:
            self._strip.idle.set()
        look.image, look.number = frame.index, look.number + 1
        if header["suggested"] and header["curves"]:
            self._try_soon(viewer, frame.index, document)
        return look.number, encode_picture({**header, "number": look.number}, parts)

    def _picture(
        self, document: TuneDocument, index: int | None, image: int | None, *, is_draft: bool
    ) -> tuple[Frame, dict[str, Any], dict[str, bytes]]:
        frame = self._store.frame(index)
        self._store.keep(frame)
        mask, is_suggested = self._mask(document, frame, is_draft=is_draft)
        detector, masked = self._detector(document), replace(frame, mask=mask)
        result, plain = detector.detect(masked), plain_mask(masked, detector.config)
        header = {
            **describe(result),
            "index": frame.index,
            "name": frame.name,
            "has_depth": frame.depth is not None,
            "suggested": is_suggested,
            "offered": is_suggested and self._guesses.get((frame.index, document), False),
            "doubt": None if is_suggested else doubt(plain, roi=document.roi),
        }
        parts = {"mask": encode_runs(plain)}
        if frame.index != image:
            parts["image"] = encode_jpeg(as_picture(frame, Style()))
        return frame, header, parts

    def _mask(self, document: TuneDocument, frame: Frame, *, is_draft: bool) -> tuple[AnyArray, bool]:
        """Return the mask of a frame, and whether it is but a suggestion."""
        if frame.image is None:
            assert frame.mask is not None  # a frame has one or the other
            return frame.mask, False
        if document.is_empty:
            return suggestion(frame, document.roi), True
        draft = self._translator.draft_of(document) if is_draft else None
        if draft is not None:
            return draft(frame), False
        if self._segmenter is None or self._segmenter[0] != document:
            self._segmenter = document, self._translator.segmenter_of(document)
        segmenter = self._segmenter[1]
        segmenter.reset()  # of frames in any order
        return segmenter(frame), False

    def _detector(self, document: TuneDocument) -> Pipeline:
        asked = document.objects, document.roi
        if self._pipeline is None or self._pipeline[0] != asked:
            # Loads the kernels, in the thread that uses it.
            self._pipeline = asked, self._new_pipeline(document)
        return self._pipeline[1]

    def _new_pipeline(self, document: TuneDocument) -> Pipeline:
        return Pipeline(self._rest.replace({"linking.objects": document.objects}).with_roi(document.roi))

    def _guess(self, index: int) -> FrameResult:
        frame = self._store.frame(index)
        if frame.image is None:
            raise InputError("these frames are masks already: there is nothing to tune")
        document = self._history.document
        mask = suggestion(frame, document.roi)
        return self._detector(document).detect(replace(frame, mask=mask))

    def _new_segmenter(self, document: TuneDocument) -> Segment | None:
        """Return what makes masks in the strip; None where nothing says yet what is cable."""
        return None if document.is_empty else self._translator.segmenter_of(document)

    def _tell_counts(self, counts: Counts) -> None:
        self._counts = counts
        self._audience.tell("strip", **self._strip_fields(counts))

    def _strip_fields(self, counts: Counts) -> dict[str, Any]:
        return {
            "objects": list(counts.objects),
            "length": self._store.length,
            "done": counts.done,
            "warnings": counts.warnings,
        }

    def _follow_camera(self) -> None:
        """Show the newest frame to all who look at no other, again and again."""
        assert self._loop is not None
        ended = self._store.ended  # before the look: no frame comes after it
        for viewer, look in self._looks.items():
            if look.index is None:
                viewer.refresh()
        if not ended:
            self._loop.call_later(_LIVE_PERIOD_S, self._follow_camera)
