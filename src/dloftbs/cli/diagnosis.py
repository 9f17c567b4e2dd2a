"""Diagnosis of a stream: what its frames are, what was made of them, and what to change, the weightiest first."""

from __future__ import annotations

import heapq
from collections import Counter
from collections.abc import Sequence

import numpy as np

from dloftbs.cli.reasons import Reasons
from dloftbs.cli.stream_report import RunReport
from dloftbs.config import DepthConfig
from dloftbs.data.depth import to_metres
from dloftbs.data.frame import Frame
from dloftbs.data.frame_result import FrameResult
from dloftbs.pipeline.plausibility import GRID_PX, share_set
from dloftbs.pipeline.thickness import thickness_m
from dloftbs.sources import Source
from dloftbs.support.arrays import AnyArray
from dloftbs.support.mask_values import kind_of
from dloftbs.support.values import count_of, is_same_time

_WORST = 3
"""Number of frames that are kept to be looked at.

Source: by hand; a person looks at so many.
"""


class Diagnosis:
    """Faults that some frames of a stream show; numbers only are kept of them, and the worst frames.

    Parameters
    ----------
    report : RunReport
        On the same frames.
    depth : DepthConfig
        Range of depth that is read.
    """

    def __init__(self, report: RunReport, depth: DepthConfig) -> None:
        self._report = report
        self._depth_config = depth
        self._stamps: list[float] = []
        self._shares: list[float] = []
        self._soft = 0
        self._same: Counter[str] = Counter()  # frames whose image, or depth, is that of the frame before
        self._last: Frame | None = None
        self._kinds: Counter[str] = Counter()
        self._sizes: Counter[tuple[int, int]] = Counter()
        self._depth_m: list[tuple[float, float, float]] = []  # the 5th, 50th and 95th percentile of each frame
        self._known: list[float] = []  # share of depth that is known
        self._on_cables: list[float] = []  # and along the cables
        self._counts: Counter[int] = Counter()
        self._widths_px: list[float] = []
        self._thickness: list[tuple[float, float]] = []
        self._doubts, self._dropped = Reasons(), Reasons()
        self._worst: list[tuple[float, int, Frame, FrameResult]] = []

    def add(self, frame: Frame, mask: AnyArray | None, result: FrameResult) -> None:
        """Take a frame, the mask that was made of it, and its result."""
        self._sizes[frame.size] += 1
        self._stamps += [] if frame.stamp is None else [frame.stamp]
        is_repeated = self._last is not None and is_same_time(frame.stamp, self._last.stamp)
        for doubt in result.diagnosis if result or is_repeated else ():  # of others, the reason says so
            self._doubts.add(doubt)
        self._add_pictures(frame, mask)
        self._add_objects(frame, result)
        sure = min((one.confidence for one in result), default=-1.0)
        heapq.heappush(self._worst, (-sure, -self._report.frames, frame, result))
        if len(self._worst) > _WORST:
            heapq.heappop(self._worst)

    def _add_pictures(self, frame: Frame, mask: AnyArray | None) -> None:
        depth = frame.depth
        present = {"image": frame.image, "mask": frame.mask, "occluders": frame.occluders}
        self._kinds.update(name for name, one in present.items() if one is not None)
        if depth is not None:
            unit = "metres" if depth.dtype.kind == "f" else f"counts of {frame.depth_unit_m:g} m"
            self._kinds[f"depth ({depth.dtype}, {unit}{'' if frame.camera else ', but no camera'})"] += 1
            metres = to_metres(depth[::GRID_PX, ::GRID_PX], frame.depth_unit_m, self._depth_config)
            known = metres[np.isfinite(metres)]
            self._known.append(known.size / max(metres.size, 1))
            if known.size:
                low, middle, high = np.percentile(known, (5, 50, 95)).tolist()
                self._depth_m.append((low, middle, high))
        if mask is not None:
            self._shares.append(share_set(mask))
        self._soft += frame.mask is not None and frame.mask_is == "auto" and kind_of(frame.mask) == "probability"
        before, self._last = self._last, frame
        for kind, now in (("image", frame.image), ("depth", depth)):
            one: AnyArray | None = getattr(before, kind, None)
            self._same[kind] += one is not None and now is not None and np.array_equal(one, now)

    def _add_objects(self, frame: Frame, result: FrameResult) -> None:
        self._counts[len(result)] += 1
        self._widths_px += [one.width_px for one in result]
        self._thickness += [measured for one in result if (measured := thickness_m(one)) is not None]
        for one in result.dropped:
            self._dropped.add(one.reason)
        if frame.depth is not None and len(result):
            points = np.concatenate([one.centerline.points for one in result])
            rows, columns = frame.size
            x, y = np.clip(np.rint(points), 0, (columns - 1, rows - 1)).astype(np.intp).T
            metres = to_metres(frame.depth[y, x], frame.depth_unit_m, self._depth_config)
            self._on_cables.append(float(np.isfinite(metres).mean()))

    def worst(self) -> list[tuple[Frame, FrameResult]]:
        """Return the frames in which nothing was found, or that are the least sure, in their order."""
        return [(frame, result) for _, _, frame, result in sorted(self._worst, key=lambda one: one[2].index)]

    def page(self, source: Source) -> str:
        """Return all of it as a page of text."""
        lines = [f"source     {source.name}", f"           {self._describe_source(source)}"]
        if self._known:
            lines.append(f"depth      {self._describe_depth()}")
        if self._shares:
            lines.append(f"mask       {_spread([100.0 * one for one in self._shares], '{:.3g}')} % set")
        lines.append(f"objects    {self._describe_objects()}")
        if self._dropped.total:
            lines += [f"dropped    {self._dropped.total}:", *self._dropped.lines()]
        lines += [self._report.summary(faults=False), ""]
        findings = self.findings(source.fps)
        lines += ["findings   none: if curves are wrong, --stages FOLDER draws the least sure frames"] * (not findings)
        lines += ["findings"] * bool(findings) + [f"  {k}. {one}" for k, one in enumerate(findings, 1)]
        return "\n".join(lines)

    def _describe_source(self, source: Source) -> str:
        sizes = ", ".join(f"{columns} x {rows}" for rows, columns in self._sizes)
        parts = [f"{sizes} px", " and ".join(self._kinds)]
        rate = "no rate" if source.fps is None else f"{source.fps:.4g} frames/s"
        steps = np.diff(self._stamps)
        stamps = f"stamps {_spread((1e3 * steps).tolist(), '{:.3g}')} ms apart" if len(steps) else "no stamps"
        length = "" if source.length is None else f", {source.length} in all"
        return "; ".join([*parts, f"{rate}{length}", stamps])

    def _describe_depth(self) -> str:
        known = f"known in {_spread([100.0 * one for one in self._known], '{:.3g}')} % of the pixels"
        on_cables = f", {_spread([100.0 * one for one in self._on_cables], '{:.3g}')} % along the cables"
        if not self._depth_m:
            return known
        low, middle, high = np.median(self._depth_m, axis=0).tolist()
        return f"{low:.3g} to {high:.3g} m, median {middle:.3g} m; {known}{on_cables if self._on_cables else ''}"

    def _describe_objects(self) -> str:
        counts = ", ".join(f"{number} in {count_of(times, 'frame')}" for number, times in self._counts.most_common(4))
        more = ", ..." if len(self._counts) > 4 else ""
        if not self._widths_px:
            return counts
        widths = f"{_spread(self._widths_px, '{:.3g}')} px wide"
        if not self._thickness:
            return f"{counts}{more}; {widths}"
        thick_m, distance_m = np.array(self._thickness).T
        thick = _spread((1e3 * thick_m).tolist(), "{:.3g}")
        return f"{counts}{more}; {widths}, {thick} mm thick at {np.median(distance_m):.3g} m"

    def findings(self, fps: float | None) -> list[str]:
        """Return what is wrong and what helps: what is wrong in most frames first, and what the rest stands on.

        Parameters
        ----------
        fps : float, optional
            Frames per second of the source.
        """
        frames, report = self._report.frames, self._report
        found = [(times, f"{text} ({_of(times, frames)})") for text, times in self._doubts.counts().items()]
        found += [(n, f"nothing found in {_of(n, frames)}: {text}") for text, n in report.reasons.counts().items()]
        if self._soft:
            what = f"the mask has many grey values ({_of(self._soft, frames)}), and is read as a probability"
            found.append((self._soft, f"{what}: say --mask-is probability, or binary if it is none"))
        for kind, times in self._same.items():
            if 2 * times > frames:
                what = f"{times} of {frames} frames have the {kind} of the frame before, to the last bit"
                found.append((times, f"{what}: is the camera frozen, or does a recording repeat frames?"))
        found += [(n, f"no curve in space, {n} times: {text}") for text, n in report.reasons_3d.counts().items()]
        found += [(frames, text) for text in report.warnings()]
        if self._dropped.total > frames:
            what = f"{self._dropped.total / frames:.1f} objects a frame are dropped, as listed"
            remedy = "narrow the segmentation (dloftbs tune), or, if they are cables, --set linking.min_probability=0"
            found.append((frames, f"{what}: {remedy}"))
        found.sort(key=lambda one: -min(one[0], frames))
        texts = [text for _, text in found]
        if not self._stamps and frames > 1:
            texts.append("the frames have no stamps, and are taken for 30 per second: state it by --fps RATE")
        typical_ms = report.total.percentile(50)
        if fps is not None and typical_ms > 1e3 / fps:
            took = f"a frame takes {typical_ms:.0f} ms, and comes after {1e3 / fps:.0f} ms"
            texts.append(f"{took}: --roi or a smaller image")
        return texts


def _spread(values: Sequence[float], form: str) -> str:
    """Return the median of some numbers, and the least and the largest where they are others."""
    low, middle, high = (form.format(one) for one in (min(values), float(np.median(values)), max(values)))
    return middle if low == high else f"{middle} ({low} to {high})"


def _of(times: int, frames: int) -> str:
    return "all frames" if times == frames else f"{times} of {frames} frames"
