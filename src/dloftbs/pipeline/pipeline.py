"""The stages on the frames of a stream, with the state that is kept from frame to frame."""

from __future__ import annotations

import logging
import os
from dataclasses import replace
from pathlib import Path
from time import perf_counter

import numpy as np
import numpy.typing as npt

from dloftbs.camera import PinholeCamera
from dloftbs.config import (
    Colour,
    Config,
    ConfigLike,
    NearestTrackingConfig,
    NetworkConfig,
    RoiLike,
    SegmentationConfig,
    TrackingConfig,
    choose_config,
    read_roi,
)
from dloftbs.data.frame import Frame, as_frame
from dloftbs.data.frame_region import Region
from dloftbs.data.frame_result import FrameResult
from dloftbs.data.harness import find_harnesses
from dloftbs.data.prompt import Prompt
from dloftbs.data.stage_trace import StageTrace
from dloftbs.data.tracks import Track, TrackState
from dloftbs.errors import InputError
from dloftbs.evidence import OcclusionEvidence
from dloftbs.kernels import preparation
from dloftbs.lifting import DepthEdges
from dloftbs.pipeline.held_ends import with_held_ends
from dloftbs.pipeline.inspection import Segments, graph_segments, trace_stages
from dloftbs.pipeline.mask_gate import MaskGate, known_share
from dloftbs.pipeline.plausibility import GRID_PX, doubt_mask
from dloftbs.pipeline.prompting import make_prompt
from dloftbs.pipeline.published import NearestTracker, make_segments
from dloftbs.pipeline.stages import StageRun, kernel_rooms, run_stages
from dloftbs.pipeline.thickness import doubt_unit
from dloftbs.pipeline.whole_image import WholeImage
from dloftbs.segmentation import FrameSegmenter, Segmenter, make_segmenter
from dloftbs.support.arrays import AnyArray
from dloftbs.support.values import count_of, is_before, is_same_time, shown, unchecked
from dloftbs.tracking import HarnessIds, Tracker

_log = logging.getLogger("dloftbs.pipeline")
_NETWORK = ".onnx"  # suffix of a network's file


class Pipeline:
    """Detection and tracking: from frames to curves, with identities and directions kept.

    A pipeline belongs to one thread; several pipelines are independent of each other.

    Parameters
    ----------
    config : Config, str, path or dict, optional
        Also a YAML file, or a dictionary as `Config.from_dict` takes it.
    hsv : str, HsvRange or several, optional
        Colour of the cables, such as ``"170:10,80:255,60:255"``, in the place of `SegmentationConfig.hsv`.
    objects : int, optional
        Number of objects, if it is known, in the place of `ObjectsConfig.objects`.
    segmenter : callable, str or path, optional
        From an image (H, W, 3) to a mask (H, W), in the place of a colour. A function of two arguments gets a
        `Prompt`, too: where the tracks are expected, for a network such as SAM. Or the ONNX file of
        a network that takes RGB in 0..1, as `NetworkConfig` has it by default.
    roi : (x, y, w, h), polygon or str, optional
        Region of interest, in the place of `RegionConfig.roi`: the rest of the image is left out, a cable ends at the
        region's edge as at the image's border, and results are in pixels of the whole image.
    mask_is : {"auto", "binary", "probability", "labels"}, optional
        What the values of masks are, in the place of `SegmentationConfig.mask_is`; see `Frame`.
    branched : bool, optional
        Whether objects may branch, as wiring harnesses do, in the place of `LinkingConfig.branched`.

    Raises
    ------
    InputError, ConfigError
        If an argument is of another type or out of range, or there are both a colour and a segmenter.

    Examples
    --------
    >>> import numpy as np
    >>> mask = np.zeros((100, 200), np.uint8)
    >>> mask[48:53, 20:180] = 255
    >>> result = Pipeline().process(mask)
    >>> result.tracks[0].id, round(result.detections[0].width_px, 1)
    (1, 5.0)
    """

    def __init__(
        self,
        config: ConfigLike | None = None,
        *,
        hsv: Colour | None = None,
        objects: int | None = None,
        segmenter: Segmenter | str | os.PathLike[str] | None = None,
        roi: RoiLike | None = None,
        mask_is: str | None = None,
        branched: bool | None = None,
    ) -> None:
        self._config = choose_config(config, hsv, objects, roi, mask_is, branched)
        if segmenter is not None and hsv is not None:
            raise InputError("give either hsv or a segmenter, got both")
        roi = self._config.region.roi
        self._roi = None if roi is None else read_roi(roi)
        self._segmenter = (
            make_segmenter(self._config.segmentation, self._roi) if segmenter is None else _as_segmenter(segmenter)
        )
        self._segments_images = segmenter is not None or self._config.segmentation.needs_image
        self._tracker = make_tracker(self._config.tracking)
        tracking = self._config.tracking
        self._gate = MaskGate(tracking) if isinstance(tracking, TrackingConfig) else None
        self._depth_edges = DepthEdges()
        self._harness_ids = HarnessIds()
        self._stamp: float | None = None
        self._last: FrameResult | None = None
        self._size: tuple[int, int] | None = None
        self._region: Region | None = None
        self._next_index = 0
        self._doubted = False
        self._grid: tuple[AnyArray, ...] = ()  # some pixels of the last frame that was no repetition
        self._doubted_stamp = False
        self._has_unit = False  # of depth, as a frame was asked that has a curve in space
        self._unit_doubt: str | None = None  # what that frame says of it
        self._depth_from: tuple[PinholeCamera | None, float] | None = None  # and its unit
        self._mask: AnyArray | None = None
        self._masked: Region | None = None  # region that the mask is of
        self._prompt_again: Prompt | None = None  # of the last frame, whose mask failed
        self._kind = "binary"  # of masks: that of the first one of the stream whose values said more

    def __repr__(self) -> str:
        return f"Pipeline({count_of(len(self._tracker.tracks), 'track')}, {self._config!r})"

    @property
    def config(self) -> Config:
        """The configuration."""
        return self._config

    @property
    def segments_images(self) -> bool:
        """True if a colour, a network or a segmenter makes masks of images; grey arrays are images then."""
        return self._segments_images

    @property
    def mask(self) -> AnyArray | None:
        """Mask (H, W) of the last frame that was processed, non-zero where there is cable; None before the first."""
        return self._mask if self._mask is None or self._masked is None else self._masked.paste(self._mask)

    def process(self, frame: Frame | npt.ArrayLike) -> FrameResult:
        """Find the objects of one frame and follow them from the frames before.

        A frame with the stamp of the last one is a repetition: the last result is returned, and nothing changes. The
        first one whose pixels differ is reported: its stamp may be rounded.

        Parameters
        ----------
        frame : Frame or array_like
            A mask (H, W) and a BGR image (H, W, 3) are frames, too, numbered as they come; a picture of Pillow is
            taken by its mode. With a colour or a segmenter, uint8 (H, W) is a grey image: a mask is bool then, or
            `Frame.mask`.

        Raises
        ------
        InputError
            If the frame has no mask and there is neither a colour range nor a segmenter, if the segmenter returns no
            mask of the size of what it was given, or if the region of interest does not lie within the frame.
        """
        whole = self._as_frame(frame, self._next_index)
        region = self._region_in(whole)
        if region is not None and self._size not in (None, whole.size):
            raise InputError(
                f"the region of interest holds for the stream's frames of {self._size} (rows, columns), got one of "
                f"{whole.size}: reset the pipeline for another stream"
            )
        frame = whole if region is None else region.crop(whole)
        self._next_index = frame.index + 1
        if self._size == whole.size and self._last is not None and is_same_time(frame.stamp, self._last.stamp):
            told = self._last.diagnosis + self._doubt_repetition(frame)
            # A repetition, which changes nothing.
            return replace(self._last, index=whole.index, name=whole.name, diagnosis=told)
        self._grid = _grid_of(frame)
        preparation.prepare((*kernel_rooms(self._config, frame), "evidence.kernels.occlusion_pixels", "tracking"))
        since = perf_counter()
        predicted = self._tracker.predict(frame.stamp) if self._size in (None, whole.size) else ()
        predicted_ms = 1e3 * (perf_counter() - since)
        if whole.size != self._size or is_before(frame.stamp, self._stamp):  # another stream
            self._size = whole.size
            self._reset_scene()
        if (whole.camera, whole.depth_unit_m) != self._depth_from:
            self._depth_from = whole.camera, whole.depth_unit_m
            self._depth_edges.reset()
            self._has_unit, self._unit_doubt = False, None
        self._stamp = self._stamp if frame.stamp is None else frame.stamp
        prompt = None
        if self._segmenter is not None and self._segmenter.takes_prompt and frame.mask is None:
            # A mask that failed hides all tracks, and is no mask to go on from.
            prompt = self._prompt_again or make_prompt(predicted, self._mask, frame.size)
        run = run_stages(
            frame, self._config, self._segmenter, predicted, self._depth_edges, region, prompt, self._gate, self._kind
        )
        self._kind = run.taken_for if self._kind == "binary" else self._kind
        self._mask, self._masked = run.mask, region
        self._prompt_again = prompt if run.has_failed else None
        self._doubted = self._doubted or _warned(run, frame)  # once in a stream
        if not self._has_unit:
            self._has_unit, self._unit_doubt = _checked_unit(run, frame)
        since = perf_counter()
        inside, outline = (None, None) if region is None else (region.inside, region.outline)
        seen = None if run.has_failed else run.mask
        occlusion = OcclusionEvidence.of(frame, seen, self._config.lifting, inside)
        tracks = self._tracker.update(run.detections, frame.stamp, frame.size, occlusion=occlusion, outline=outline)
        if self._gate is not None and not run.has_failed:
            shows_tracks = any(track.state is TrackState.CONFIRMED for track in tracks)
            assert isinstance(self._tracker, Tracker)
            known = known_share((*tracks, *self._tracker.lost), frame.size) / (1.0 if region is None else region.share)
            self._gate.accept(run.share, frame.stamp, shows_tracks=shows_tracks, known=known)
        run.stage_ms["tracking"] = predicted_ms + 1e3 * (perf_counter() - since)
        result = _result(frame, run, tracks, self._unit_doubt)
        if result.harnesses:
            named = self._harness_ids.update(result.harnesses, tracks, self._tracker._held_ids)
            points = tuple([point for harness in named for point in harness.branch_points])
            result = replace(result, harnesses=named, branch_points=points)
        result = result if region is None else WholeImage(region, whole).result(result)
        self._last = result if whole.grippers is None else with_held_ends(result, whole.grippers, whole.camera)
        return self._last

    def detect(self, frame: Frame | npt.ArrayLike) -> FrameResult:
        """Find the objects of one frame by itself: the result keeps the frame, and has no tracks.

        The pipeline's tracks stay as they are.

        Raises
        ------
        InputError
            As `process`.
        """
        return self._detect_with_mask(frame)[0]

    def _detect_with_mask(self, frame: Frame | npt.ArrayLike) -> tuple[FrameResult, AnyArray]:
        """Return what `detect` does, and the mask (H, W), non-zero where there is cable.

        Raises
        ------
        InputError
            As `process`.
        """
        whole = self._as_frame(frame)
        frame, region, run = self._run_alone(whole)
        _warned(run, frame)
        result = _result(frame, run, (), _checked_unit(run, frame)[1], kept=frame)
        if region is None:
            return result, run.mask
        return WholeImage(region, whole).result(result), region.paste(run.mask)

    def reset(self) -> None:
        """Forget all tracks and what is known of the depth camera, as at the cut to another scene."""
        self._doubted = self._doubted_stamp = self._has_unit = False
        self._unit_doubt = None
        self._size = self._stamp = None
        self._tracker.reset()
        self._reset_scene()

    def _reset_scene(self) -> None:
        """Forget what is known of the camera, of its masks, and of the harnesses in them."""
        self._mask = self._masked = self._prompt_again = self._last = None
        self._kind = "binary"
        self._harness_ids.reset()
        self._depth_edges.reset()
        if self._gate is not None:
            self._gate.reset()
        if self._segmenter is not None:
            self._segmenter.reset()

    def trace(self, frame: Frame | npt.ArrayLike) -> StageTrace:
        """Run the stages on a frame and keep what each of them made; the tracks stay as they are.

        Raises
        ------
        InputError
            As `process`.
        """
        whole = self._as_frame(frame)
        frame, region, run = self._run_alone(whole)
        trace = trace_stages(frame, run.mask, run.crop, run.skeleton, _segments(run), _result(frame, run, ()))
        return trace if region is None else WholeImage(region, whole).trace(trace)

    def _as_frame(self, given: Frame | npt.ArrayLike, index: int = 0) -> Frame:
        mask_is = self._config.segmentation.mask_is
        return as_frame(given, index, grey_as_image=self._segments_images, mask_is=mask_is)

    def _run_alone(self, whole: Frame) -> tuple[Frame, Region | None, StageRun]:
        """Return the frame that the stages see of a whole one, the region that it is cut to, and what they found."""
        region = self._region_in(whole)
        frame = whole if region is None else region.crop(whole)
        segmenter = None if self._segmenter is None else self._segmenter.alone()
        with preparation.compiling_ahead(kernel_rooms(self._config, frame)):
            return frame, region, run_stages(frame, self._config, segmenter, region=region)

    def _doubt_repetition(self, frame: Frame) -> tuple[str, ...]:
        """Return what is strange about a frame with the stamp of the last one; warn of it, once in a stream."""
        if all(map(np.array_equal, self._grid, _grid_of(frame))):
            return ()
        doubt = (
            f"frame {frame.index} differs from the one before it and has the same stamp, {frame.stamp:.17g} s; such "
            "frames are taken for repetitions and get the result before them: give stamps in float64 that are not "
            "rounded, or the rate (fps, --fps)"
        )
        if not self._doubted_stamp:
            self._doubted_stamp = True
            _log.warning("%s", doubt)
        return (doubt,)

    def _region_in(self, frame: Frame) -> Region | None:
        """Return the region of interest in frames of a size; None reads all of them."""
        if self._roi is None:
            return None
        if self._region is None or self._region.image_size != frame.size:
            self._region = Region(self._roi, frame.size)
        return self._region


def _as_segmenter(given: Segmenter | str | os.PathLike[str]) -> FrameSegmenter | None:
    """Return a function of the user's as a segmenter of frames, or the network of a file."""
    if isinstance(given, (str, os.PathLike)) and Path(os.fsdecode(given)).suffix.lower() == _NETWORK:
        return make_segmenter(SegmentationConfig(onnx=NetworkConfig(file=os.path.expanduser(os.fsdecode(given)))))
    if not callable(given):
        raise InputError(
            f"segmenter must be a function from an image to a mask, or the path of a network (*{_NETWORK}), "
            f"got {shown(given)}"
        )
    return FrameSegmenter([given])


def _grid_of(frame: Frame) -> tuple[AnyArray, ...]:
    """Return a copy of some pixels of a frame: users may fill its arrays anew."""
    return tuple(one[::GRID_PX, ::GRID_PX].copy() for one in (frame.image, frame.mask) if one is not None)


def make_tracker(config: TrackingConfig | NearestTrackingConfig) -> Tracker | NearestTracker:
    """Return the tracker that a configuration asks for."""
    return Tracker(config) if isinstance(config, TrackingConfig) else NearestTracker()


def _warned(run: StageRun, frame: Frame) -> bool:
    """Warn, and return True, if a mask is soft, or so much of it is set that it is hardly one of cables."""
    doubt = doubt_mask(run.share, frame.name)
    if doubt is not None:
        _log.warning("%s See `dloftbs tune --help`", doubt)
    elif run.taken_for == "probability":
        what = f" of {frame.name}" if frame.name else ""
        _log.warning(
            "the mask%s has many grey values, and is read as a probability: mask_is (--mask-is) says so, or that it is "
            "binary, and any non-zero cable",
            what,
        )
    return doubt is not None or run.taken_for == "probability"


def _checked_unit(run: StageRun, frame: Frame) -> tuple[bool, str | None]:
    """Return whether a curve in space shows the unit of depth, and why it is hardly right, and warn if it is not."""
    if not any(detection.curve_3d is not None for detection in run.detections):
        return False, None
    doubt = doubt_unit(run.detections, frame)
    if doubt is not None:
        _log.warning("%s%s", f"{frame.name}: " if frame.name else "", doubt)
    return True, doubt


def _result(
    frame: Frame, run: StageRun, tracks: tuple[Track, ...], unit_doubt: str | None = None, kept: Frame | None = None
) -> FrameResult:
    branch_points, harnesses = find_harnesses(run.detections) if run.is_branched else ((), ())
    return unchecked(
        FrameResult,
        detections=run.detections,
        tracks=tracks,
        reason=run.reason,
        size=frame.size,
        stage_ms=run.stage_ms,
        index=frame.index,
        stamp=frame.stamp,
        name=frame.name,
        crossings=run.crossings,
        dropped=run.dropped,
        frame=kept,
        branch_points=branch_points,
        harnesses=harnesses,
        diagnosis=tuple([doubt for doubt in (doubt_mask(run.share), unit_doubt) if doubt is not None]),
    )


def _segments(run: StageRun) -> Segments | None:
    """Return the segments of whichever method ran; None where the stages did not come so far."""
    if run.crop is None:
        return None
    if run.walks is not None:
        kept, short = run.walks.open + run.walks.loops, run.walks.short
        return tuple(make_segments(run.crop, kept)), tuple(make_segments(run.crop, short))
    return None if run.graph is None else graph_segments(run.crop, run.graph)
