"""Summary of a run over a stream or over images."""

from __future__ import annotations

from time import perf_counter

from dloftbs.cli.durations import ACCURACY, LatencyHistogram
from dloftbs.cli.reasons import Reasons
from dloftbs.data.detection import NO_DEPTH
from dloftbs.data.frame_result import FrameResult
from dloftbs.pipeline.mask_faults import MaskSamples
from dloftbs.pipeline.steadiness import Steadiness


class RunReport:
    """Rate, timing, objects and failures of a run so far; of a size that does not grow with the stream.

    The clock starts when the report is made. `skipped` counts frames that could not be read, `missed` those of a camera
    that made room for newer ones.

    Parameters
    ----------
    length : int, optional
        Number of frames to come in all, if known.
    tracked : bool
        Whether objects are followed from frame to frame.
    objects : int, optional
        Number of objects, where it is known.
    """

    def __init__(self, length: int | None = None, *, tracked: bool = True, objects: int | None = None) -> None:
        self.length = length
        self.frames = 0
        self.skipped = 0
        self.missed = 0
        self.objects = 0
        self.total = LatencyHistogram()
        self.stages: dict[str, LatencyHistogram] = {}
        self.reasons = Reasons()
        self.reasons_3d = Reasons()
        self.doubts = Reasons()
        self.steadiness = Steadiness(objects)
        self.masks: MaskSamples | None = None
        self._tracked = tracked
        self._start = perf_counter()
        self._first = self._last = self._start

    def add(self, result: FrameResult) -> None:
        """Count a frame."""
        self.frames += 1
        self._last = perf_counter()
        if self.frames == 1:
            self._first = self._last
        self.total.add(result.total_ms)
        if not self.stages.keys() >= result.stage_ms.keys():  # an empty mask passes fewer stages: in their order
            names = [*result.stage_ms, *self.stages]
            self.stages = {name: self.stages.get(name) or LatencyHistogram() for name in names}
        for stage, ms in result.stage_ms.items():
            self.stages[stage].add(ms)
        self.objects += len(result)
        self.steadiness.add(result.tracks, len(result))
        if result.reason is not None:
            self.reasons.add(result.reason)
        for doubt in result.diagnosis:
            self.doubts.add(doubt)
        for detection in result:
            if detection.no_3d_reason not in (None, NO_DEPTH):
                self.reasons_3d.add(str(detection.no_3d_reason))

    @property
    def done(self) -> int:
        """Frames that are past, the skipped ones included."""
        return self.frames + self.skipped

    @property
    def seconds(self) -> float:
        """From the start to the last frame."""
        return self._last - self._start

    @property
    def rate(self) -> float:
        """Frames per second, reading and writing included."""
        return self.frames / self.seconds if self.seconds > 0.0 else 0.0

    def line(self) -> str:
        """Return how the run stands, in a line."""
        of = "" if self.length is None else f"/{self.length}"
        parts = [f"{self.frames}{of} frames", f"{self.rate:.1f} frames/s"]
        if self.length is not None and (rate := self._steady_rate()) > 0.0:
            parts.append(f"{_clock(max(self.length - self.frames - self.skipped, 0) / rate)} left")
        parts.append(f"pipeline {self.total.percentile(50):.2f} ms (p99 {self.total.percentile(99):.2f})")
        parts.append(f"{len(self.steadiness.shown)} tracks" if self._tracked else f"{self.objects} objects")
        return "  ".join(parts)

    def outcome(self, *, printed: bool) -> list[str]:
        """Return what a single image came to, in a line or two.

        Parameters
        ----------
        printed : bool
            Whether its objects are printed anyway.
        """
        found = f"found {self.objects} object{'s' * (self.objects != 1)}"
        lines = [f"nothing found: {reason}" for reason in self.reasons.counts()] or [found] * (not printed)
        return lines + [f"no curve in space: {reason}" for reason in self.reasons_3d.counts()]

    def summary(self, *, faults: bool = True) -> str:
        """Return what the run came to, in a few lines; without its faults where those are reported elsewhere."""
        missed = f", {self.missed} left out to keep up with the camera" if self.missed else ""
        lines = [
            f"frames     {self.frames}, {self.skipped} skipped{missed}, in {self.seconds:.1f} s: "
            f"{self.rate:.1f} frames/s with reading and writing",
            f"tracks     {self.steadiness.tracks} confirmed" if self._tracked else f"objects    {self.objects}",
        ]
        if self.frames:
            lines += self._timing()
        if not faults:
            return "\n".join(lines)
        if self.reasons.total:
            lines += [f"nothing found in {self.reasons.total} frames:", *self.reasons.lines()]
        if self.reasons_3d.total:
            lines += [f"no curve in space {self.reasons_3d.total} times:", *self.reasons_3d.lines()]
        if self.doubts.total:
            lines += [f"strange input {self.doubts.total} times:", *self.doubts.lines()]
        lines += [f"warning: {warning}" for warning in self.warnings()]
        return "\n".join(lines)

    def warnings(self) -> list[str]:
        """Return what is strange about the tracks, and the options that help."""
        if not self._tracked:
            return []
        warnings = []
        if broken := self.steadiness.warning():
            faults = None if self.masks is None else self.masks.describe()
            warnings.append(f"{broken}{f': {faults}' if faults else ''}; track --stages shows where")
        if usual := self.steadiness.usual_number():
            warnings.append(f"{usual[1]}: --objects {usual[0]}")
        return warnings

    def _steady_rate(self) -> float:
        """Return frames per second since the first frame, which may have compiled the kernels."""
        seconds = self._last - self._first
        return (self.frames - 1) / seconds if seconds > 0.0 else 0.0

    def _timing(self) -> list[str]:
        rows = [*self.stages.items(), ("pipeline", self.total)]
        accuracy = f"(percentiles to within {100 * ACCURACY:.0f} %)"
        return [f"{'':14}{'p50 ms':>9}{'p99 ms':>9}{'max ms':>9}  {accuracy}"] + [
            f"{name:14}{h.percentile(50):9.3f}{h.percentile(99):9.3f}{h.max_ms:9.3f}" for name, h in rows
        ]


def _clock(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes}:{rest:02d}"
