"""Fit the confidence of tracks: how probable it is that the published curve is right.

Run it in the repository with ``python -m benchmarks.fit_track_confidence FOLDER``; the folder holds
``motion/cable_*.npz``, recorded motion of real cables. It prints docs/maintainers/track-confidence.md; ``--write``
writes it, and the numbers.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
from scipy.optimize import minimize

from benchmarks.fit_linking.confidence import calibration_error
from benchmarks.fit_tracking import SOURCES, list_sequences
from dloftbs import Pipeline
from dloftbs.tracking import confidence_weights
from dloftbs.tracking.track_confidence import Signs, probability_of, signs_of
from dloftbs.tracking.tracker import Tracker
from dloftbs_lab import KnownSequence
from dloftbs_lab.evaluation.runner.found import Found
from dloftbs_lab.evaluation.runner.known_frame import KnownFrame
from dloftbs_lab.evaluation.runner.visible_truth import distances_of

PAGE = Path(__file__).parents[1] / "docs" / "maintainers" / "track-confidence.md"
FITTED = Path(confidence_weights.__file__)

_SEED = 300  # other sequences than those of the weights
_STEP = 3  # from one frame that counts to the next
_RIGHT_PX = 5.0  # of 1280 x 720
_OF_A_SOURCE = 1000.0  # tracks that each source counts for
_SURE = 0.9
_PULL = 0.1  # towards 0, nats per square of a coefficient
_ROUNDING = 1e-9  # of a probability

_Floats = npt.NDArray[np.float64]

_ON_CONFIDENCE = """# The confidence of tracks

For maintainers; [Tracking](../tracking.md) says what it means. Made by `python -m benchmarks.fit_track_confidence`.

The confidence of a track is the probability that its curve is right. A right curve is less than {right:g} px off a true
one, or the part of it that is seen, by the [L3](../results-explained.md) of the results. The log-odds are
{line}:

- b is the log-odds of its shape, by the frames.
- p is 1 where the frame does not show all of it.
- a is the log-odds that the hypotheses followed have the same curve, 4 at most.
- l is the absolute logarithm of its length over that in most full views.

The probability is multiplied by how much of the curve was seen lately: a place counts half of what it did for each half
second in which it stays unseen. All sources have equal weight in the fit.

The table is of published tracks, in every third frame, with the source left out of the fit. It has the share that is
right, the mean stated confidence, and the mean distance between the two, over bins. The last column is of those stated
above {sure:g}.

| source | what | tracks | right | stated | error | right above {sure:g} |
| --- | --- | ---: | ---: | ---: | ---: | ---: |
"""


@dataclass(frozen=True)
class Claim:
    """A published track: the signs of its curve, how much of it was seen lately, in 0..1, and whether it is right."""

    source: str
    signs: Signs
    seen: float
    right: bool


def list_claims(source: str, sequence: KnownSequence) -> Iterator[Claim]:
    """Follow a sequence, and yield the tracks that are published in every third frame."""
    pipeline = Pipeline()
    tracker = pipeline._tracker
    assert isinstance(tracker, Tracker)
    for i in range(len(sequence)):
        frame = sequence.frame(i)
        tracks = pipeline.process(frame).tracks
        if i % _STEP or not tracks:
            continue
        known = KnownFrame(frame, sequence.truth(i))
        if not known.truth.curves:
            continue
        distances, _ = distances_of(Found(tuple(track.curve for track in tracks)), known)
        models = {model.id: model for model in tracker._hypotheses[0].models}
        for track, least in zip(tracks, distances.l3.min(axis=0).tolist(), strict=True):
            signs = signs_of(models[track.id], tracker._hypotheses)
            yield Claim(source, signs, track.confidence / probability_of(signs), least < _RIGHT_PX)


def fit(claims: Sequence[Claim]) -> _Floats:
    """Return the log-odds of a right track with no sign, and those per unit of each; sources count alike."""
    counts = {source: sum(claim.source == source for claim in claims) for source in SOURCES}
    weights = np.array([_OF_A_SOURCE / counts[claim.source] for claim in claims])
    right = np.array([claim.right for claim in claims])

    def loss(line: _Floats) -> float:
        stated = np.clip(state(claims, line), _ROUNDING, 1.0 - _ROUNDING)
        return float(weights @ -np.log(np.where(right, stated, 1.0 - stated))) + _PULL * float(line[1:] @ line[1:])

    found: _Floats = minimize(loss, np.zeros(1 + len(Signs._fields)), method="L-BFGS-B").x
    return found


def state(claims: Sequence[Claim], line: _Floats) -> _Floats:
    """Return the confidence that a line gives each track."""
    columns = np.array([(1.0, *claim.signs) for claim in claims])
    stated: _Floats = np.array([claim.seen for claim in claims]) / (1.0 + np.exp(-columns @ line))
    return stated


def make_page(claims: Sequence[Claim], line: _Floats) -> str:
    """Return the page on the confidence of tracks."""
    rows = []
    for source, what in SOURCES.items():
        own = [claim for claim in claims if claim.source == source]
        if not own:
            continue
        stated = state(own, fit([claim for claim in claims if claim.source != source]))
        right = np.array([claim.right for claim in own])
        sure = stated > _SURE
        rows.append(
            f"| {source} | {what} | {len(own)} | {right.mean():.3f} | {stated.mean():.3f} | "
            f"{calibration_error(stated, right):.3f} | {right[sure].sum()} of {sure.sum()} |"
        )
    formula = " ".join(
        [f"{line[0]:.2f}", *(f"{unit:+.2f} {name}" for unit, name in zip(line[1:], "bpal", strict=True))]
    )
    return _ON_CONFIDENCE.format(right=_RIGHT_PX, sure=_SURE, line=formula) + "\n".join(rows) + "\n"


def write_line(path: Path, line: _Floats) -> None:
    """Write the numbers into the module that has them."""
    text = path.read_text(encoding="utf-8")
    first, last = text.index("TRACK_CONFIDENCE = ("), text.index('"""Log-odds that')
    numbers = ", ".join(f"{number:.2f}" for number in line)
    path.write_text(f"{text[:first]}TRACK_CONFIDENCE = ({numbers})\n{text[last:]}", encoding="utf-8")


def _follow(source: str, sequence: KnownSequence) -> list[Claim]:
    return list(list_claims(source, sequence))


def main(arguments: Sequence[str] | None = None) -> None:
    """Fit, and print or write the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--write", action="store_true", help="write the page and the numbers")
    parser.add_argument("--jobs", type=int, default=2, help="processes; 2 by default")
    options = parser.parse_args(arguments)
    with ProcessPoolExecutor(options.jobs) as pool:
        runs = [
            pool.submit(_follow, source, sequence)
            for source in SOURCES
            for sequence in list_sequences(source, options.folder, _SEED)
        ]
        claims = [claim for run in runs for claim in run.result()]
    line = np.round(fit(claims), 2)
    page = make_page(claims, line)
    print(page)
    if options.write:
        write_line(FITTED, line)
        PAGE.write_text(page, encoding="utf-8")


if __name__ == "__main__":
    main()
