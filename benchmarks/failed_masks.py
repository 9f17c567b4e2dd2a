"""Tracks through frames whose mask fails as a whole, with the gate of `dloftbs.pipeline.mask_gate` and without it.

Run it in the repository with ``python -m benchmarks.failed_masks``; it prints the table of docs/tracking-rules.md. Of
generated sequences, the mask of some frames is empty, has a twentieth of its area left, is inverted, or has noise of
ten times the area. Counted are the cables that have their id again three frames later, those that are published near
their place meanwhile, and the ids that are new.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from dloftbs import Frame, FrameResult, Pipeline
from dloftbs.data.tracks import TrackState
from dloftbs_lab import synthetic
from dloftbs_lab.evaluation import match_curves
from dloftbs_lab.truth import Truth

_SIZE = (360, 640)
_FAILS_AT, _FRAMES, _LATER = 20, 45, 3
_HERE_PX, _NEAR_PX = 8.0, 40.0
_FULLEST = 0.55
"""Share of a mask that noise may set; more is no cables in any frame."""

Mask = npt.NDArray[np.bool_]
Failure = Callable[[Mask, np.random.Generator], Mask]


def _part(mask: Mask, rng: np.random.Generator) -> Mask:
    y, x = np.nonzero(mask)
    one = rng.integers(len(x))
    distance = np.hypot(x - x[one], y - y[one])
    near = distance <= np.quantile(distance, 0.05)
    left = np.zeros_like(mask)
    left[y[near], x[near]] = True
    return left


def _noise(mask: Mask, rng: np.random.Generator) -> Mask:
    noisy, most = mask.copy(), min(10.5 * mask.sum(), _FULLEST * mask.size)
    while noisy.sum() < most:
        for x, y in rng.integers(0, mask.shape[::-1], (50, 2)):
            height, width = rng.integers(2, 24, 2)
            noisy[y : y + height, x : x + width] = True
    return noisy


FAILURES: Mapping[str, Failure] = {
    "none": lambda mask, _: mask,
    "empty": lambda mask, _: np.zeros_like(mask),
    "a twentieth is left": _part,
    "inverted": lambda mask, _: ~mask,
    "noise of ten times the area": _noise,
}


def _sequences() -> list[list[tuple[Mask, Truth]]]:
    """Return the masks and the truth of the first frames of some sequences."""
    sequences: list[Any] = [
        synthetic.TrackingSequence("crossing", cables, number, 60, _SIZE) for cables in (1, 3, 5) for number in range(3)
    ]
    kinds = "bends", "exchange", "swings"
    sequences += [synthetic.PlainSightSequence(kind, number, 60, _SIZE) for kind in kinds for number in range(2)]
    return [[(one.frame(i).mask != 0, one.truth(i)) for i in range(_FRAMES)] for one in sequences]


def _ids(result: FrameResult, truth: Truth, gate_px: float) -> dict[int, int]:
    """Return the track of each cable that is published within a distance of it, by the cable's id."""
    pairs = match_curves([track.curve for track in result.tracks], truth.curves, gate_px=gate_px).pairs
    return {truth.ids[pair.true]: result.tracks[pair.found].id for pair in pairs}


def _score(frames: Sequence[tuple[Mask, Truth]], failure: Failure, count: int, *, gated: bool) -> npt.NDArray[np.int64]:
    """Return the number of cables, of ids kept, of cables in failed frames, of those published, and of new ids."""
    rng, pipeline = np.random.default_rng(count), Pipeline()
    if not gated:
        pipeline._gate = None
    failed = range(_FAILS_AT, _FAILS_AT + count)
    results = [
        pipeline.process(Frame(mask=failure(mask, rng) if i in failed else mask, index=i, stamp=i / 30.0))
        for i, (mask, _) in enumerate(frames)
    ]
    last = failed.stop - 1 + _LATER
    before = _ids(results[_FAILS_AT - 1], frames[_FAILS_AT - 1][1], _HERE_PX)
    after = _ids(results[last], frames[last][1], _HERE_PX)
    score = np.zeros(5, np.int64)
    for cable in set(before) & set(frames[last][1].ids):
        score[:2] += 1, after.get(cable) == before[cable]
    for i in failed:
        now = _ids(results[i], frames[i][1], _NEAR_PX)
        for cable in set(before) & set(frames[i][1].ids):
            score[2:4] += 1, now.get(cable) == before[cable]
    known = {track.id for result in results[:_FAILS_AT] for track in result.tracks}
    shown = (track for result in results for track in result.tracks if track.state is not TrackState.TENTATIVE)
    score[4] = len({track.id for track in shown} - known)
    return score


def main() -> None:
    """Print the table."""
    sequences = _sequences()
    print("| the mask is | frames | ids kept | without | published meanwhile | without | new ids | without |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- |")
    for name, failure in FAILURES.items():
        for count in (1, 5, 15):
            cells = []
            for gated in (True, False):
                scores = [_score(frames, failure, count, gated=gated) for frames in sequences]
                total, kept, there, published, new = np.sum(scores, axis=0).tolist()
                cells.append((f"{kept} of {total}", f"{published / there:.2f}", str(new)))
            print(f"| {name} | {count} |", " | ".join(" | ".join(pair) for pair in zip(*cells, strict=True)), "|")


if __name__ == "__main__":
    main()
