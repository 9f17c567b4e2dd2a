"""Scores of the demo's tracks: the criteria of the paper against the known truth."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np

from dloftbs.data.curve import BSplineCurve
from dloftbs.data.frame_result import FrameResult
from dloftbs.data.tracks import Track
from dloftbs.support.arrays import FloatArray
from dloftbs_lab.evaluation import l1, l2, match_curves
from dloftbs_lab.truth import Truth

NOTHING = "no curve at all"
_PX_PER_SAMPLE = 2.0  # along curves


@dataclass(frozen=True)
class CableScore:
    """One true cable in one frame.

    Parameters
    ----------
    track_id : int or None
        The track that it was given to, None where there was no curve left for it.
    l3_px : float
        Criterion 3 between its curve and the truth, hidden parts included, whichever end came first; NaN without.
    runs_forward : bool
        Whether the track runs as the truth does.
    """

    track_id: int | None = None
    l3_px: float = math.nan
    runs_forward: bool = True


@dataclass(frozen=True)
class FrameScore:
    """One frame against its truth.

    Parameters
    ----------
    index : int
    curves : int
        Number of found cables.
    l1_px, l2_px : float
        Criteria 1 and 2 between the visible pixels of all cables and all curves; NaN where there is no curve.
    cables : tuple of CableScore
        In the order of the truth.
    """

    index: int
    curves: int
    l1_px: float
    l2_px: float
    cables: tuple[CableScore, ...]

    @property
    def worst_l3_px(self) -> float:
        """Of its cables that have a curve; negative infinity where none has."""
        return max((cable.l3_px for cable in self.cables if cable.track_id is not None), default=-math.inf)


def score_frame(result: FrameResult, truth: Truth) -> FrameScore:
    """Compare the detections of a frame with its truth; hidden tracks do not count.

    Each true cable gets at most one curve, by the assignment with the least sum of L3, however far off it is.
    """
    seen = [track for track in result.tracks if track.detection is not None]
    l1_px, l2_px = _cover(seen, truth)
    return FrameScore(result.index, len(seen), l1_px, l2_px, _assign(seen, truth))


def _cover(seen: list[Track], truth: Truth) -> tuple[float, float]:
    if not seen or truth.mask is None or not truth.mask.any():
        return math.nan, math.nan
    rows, columns = np.nonzero(truth.mask)
    pixels = np.column_stack((columns, rows)).astype(np.float64)
    points = np.concatenate([_dense(track.curve) for track in seen])
    return l1(pixels, points), l2(points, pixels)


def _dense(curve: BSplineCurve) -> FloatArray:
    return curve.sample(max(2, math.ceil(curve.length / _PX_PER_SAMPLE)))


def _assign(seen: list[Track], truth: Truth) -> tuple[CableScore, ...]:
    scores = [CableScore()] * len(truth.curves)
    for pair in match_curves([track.curve for track in seen], truth.curves).pairs:
        scores[pair.true] = CableScore(seen[pair.found].id, pair.l3, pair.forward)
    return tuple(scores)


@dataclass
class Scores:
    """The frames of a sequence against their truths.

    Parameters
    ----------
    cables : int
        True number of cables.
    """

    cables: int
    frames: list[FrameScore] = field(default_factory=list)

    def add(self, score: FrameScore) -> None:
        """Count a frame."""
        self.frames.append(score)

    def to_dict(self) -> dict[str, Any]:
        """Return the figures of the whole sequence as plain values; those without a value are None."""
        l3_px = np.array([cable.l3_px for frame in self.frames for cable in frame.cables])
        worst = max(self.frames, key=lambda frame: frame.worst_l3_px)
        missing = [sum(frame.cables[i].track_id is None for frame in self.frames) for i in range(self.cables)]
        return {
            "l1_px": spread([frame.l1_px for frame in self.frames]),
            "l2_px": spread([frame.l2_px for frame in self.frames]),
            "l3_px": spread(l3_px),
            "worst_frame": worst.index,
            "frames_with_the_right_number_of_curves": sum(frame.curves == self.cables for frame in self.frames),
            "frames_with_too_many_curves": sum(frame.curves > self.cables for frame in self.frames),
            "frames_without_a_curve_for_a_cable": missing,
            "ids_of_each_cable": [self._ids(i) for i in range(self.cables)],
            "turned_around": sum(self._turns(i) for i in range(self.cables)),
        }

    def _ids(self, cable: int) -> int:
        return len({frame.cables[cable].track_id for frame in self.frames} - {None})

    def _turns(self, cable: int) -> int:
        """Count how often a track changed its direction on a cable."""
        seen = [frame.cables[cable] for frame in self.frames if frame.cables[cable].track_id is not None]
        return sum(a.track_id == b.track_id and a.runs_forward != b.runs_forward for a, b in pairwise(seen))


def spread(values: Any) -> dict[str, float | None]:
    """Return mean, median and the worst of the finite values; None where there is none."""
    known = np.asarray(values, dtype=np.float64)
    known = known[np.isfinite(known)]
    if not len(known):
        return {"mean": None, "median": None, "worst": None}
    return {"mean": float(known.mean()), "median": float(np.median(known)), "worst": float(known.max())}


def spread_text(figures: dict[str, float | None], unit: str) -> str:
    """Return in words what `spread` returns."""
    if figures["mean"] is None:
        return NOTHING
    return f"mean {figures['mean']:.2f}, median {figures['median']:.2f}, worst {figures['worst']:.2f} {unit}"
