"""Fit the weights by which tracking decides between a frame's reading and its own.

Run it in the repository with ``python -m benchmarks.fit_tracking FOLDER``; the folder holds ``motion/cable_*.npz``,
recorded motion of real cables. It prints docs/maintainers/tracking-weights.md; ``--write`` writes it, and the weights.
Sequences are followed several times, each time with the weights of the time before, so that what is decided on is what
happens.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from copy import deepcopy
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import numpy.typing as npt
from scipy.optimize import minimize
from scipy.special import logsumexp, softmax

from dloftbs import Pipeline
from dloftbs.data.curve import BSplineCurve
from dloftbs.data.frame import Frame
from dloftbs.tracking import hypotheses, reading_weights, readings
from dloftbs.tracking.frame_view import View
from dloftbs.tracking.reading_features import Features, Reading, measure_reading
from dloftbs.tracking.readings import Group
from dloftbs.tracking.track_update import update_seen
from dloftbs_lab.evaluation.runner.found import Found
from dloftbs_lab.evaluation.runner.known_frame import KnownFrame
from dloftbs_lab.evaluation.runner.trace_pairs import compare_traces
from dloftbs_lab.known_sequence import KnownSequence
from dloftbs_lab.synthetic import SIMULATED_KINDS, PlainSightSequence, SimulatedSequence, TrackingSequence
from dloftbs_lab.synthetic.plain_sight import PLAIN_SIGHT_KINDS
from dloftbs_lab.synthetic.real_motion import RealMotionSequence

PAGE = Path(__file__).parents[1] / "docs" / "maintainers" / "tracking-weights.md"
FITTED = Path(reading_weights.__file__)

START = Features(length=-0.2, place=-0.9, clear=0.2, part_place=-0.9, unclaimed=-0.5)
"""Weights of the first time, by hand: nothing but how well a reading fits."""
_ROUNDS = 2
_EXPLORED = 0.15
"""Share of the groups in which the better reading is taken whatever the weights say, so that right tracks are seen."""

_NEAR_PX, _RIGHT_PX, _FAR_PX = 5.0, 5.0, 50.0
_OTHERS = 0.3
"""Worth of an object's curve under the id of another one, or under a new id though it has one."""
_JUNK = 0.2
"""Loss by a curve that lies on no object."""
_DECIDED = 0.1
"""Least difference in worth for which a group counts."""
_SOFT = 0.1
"""Difference in worth at which the better reading is wanted with odds of e to one."""
_RIDGE = 1.0

_Floats = npt.NDArray[np.float64]

SOURCES: Mapping[str, str] = {
    "one real": "recorded motion of one real cable",
    "two real": "of two",
    "three real": "of three",
    "real, covered": "of three, behind discs",
    "real, depth": "of three, with depth, and behind discs",
    "crossing": "three and five generated cables that cross",
    "covered": "three and five behind discs and bars",
    "told": "three behind discs and bars, which a mask or depth shows",
    "plain sight": "cables that tilt, swing, come and go, cross, with nothing hidden",
    "simulated": "a cable moved by MuJoCo, in perspective",
}


@dataclass(frozen=True, eq=False)
class Case:
    """A group of tracks and detections in a frame that has several readings.

    Parameters
    ----------
    source : str
    measures : numpy.ndarray, shape (readings, number of `Features`)
        Of each reading, that of the tracks first, and then the frame's.
    worth : numpy.ndarray, shape (readings,)
        One for each right object.
    """

    source: str
    measures: _Floats
    worth: _Floats

    @property
    def is_decided(self) -> bool:
        """True if it matters which reading is taken."""
        return bool(np.ptp(self.worth) > _DECIDED)

    def lost(self, chosen: int) -> float:
        """Return by how much a reading is worse than the best one."""
        return float(self.worth.max() - self.worth[chosen])


def list_sequences(source: str, folder: Path, seed: int = 0) -> Iterator[KnownSequence]:
    """Make the sequences of a source."""
    real = partial(RealMotionSequence, folder / "motion", seed=seed)
    cables = ("one real", "two real", "three real").index(source) + 1 if source.endswith(" real") else 0
    if cables:
        yield from (real(cables, "mask", number) for number in range((3, 8, 8)[cables - 1]))
    elif source == "real, covered":
        yield from (real(3, "occluders", number) for number in range(4))
    elif source == "real, depth":
        yield from (real(3, variant, 0) for variant in ("depth", "occluders and depth"))
    elif source == "crossing":
        yield from (TrackingSequence("crossing", cables, n, 110, seed=seed) for cables in (3, 5) for n in range(4))
    elif source == "covered":
        yield from (TrackingSequence("occluded", cables, n, seed=seed) for cables in (3, 5) for n in range(5))
    elif source == "told":
        for family, count in (("occluded", 3), ("hands", 3), ("hidden", 1)):
            for n in range(2):
                yield from (
                    TrackingSequence(family, count, n, seed=seed, evidence=(one,)) for one in ("occluders", "depth")
                )
    elif source == "plain sight":
        yield from (PlainSightSequence(kind, n, seed=seed) for kind in PLAIN_SIGHT_KINDS for n in range(2))
    else:
        yield from (SimulatedSequence(kind, n, 60, seed=seed) for kind in SIMULATED_KINDS for n in range(2))


class Judge:
    """Values both readings of each group by the truth, while a sequence is followed."""

    def __init__(self, source: str, weights: _Floats, seed: int) -> None:
        self.cases: list[Case] = []
        self._source, self._weights, self._rng = source, weights, np.random.default_rng(seed)
        self._owners: dict[int, int] = {}
        self.known: KnownFrame | None = None

    def weigh(self, group: Group, candidates: Sequence[Reading], view: View) -> list[float]:
        """Return the log-odds of readings, as `readings.weigh`, or now and then their worth, and keep the case."""
        measures = np.array([measure_reading(*group, reading, view) for reading in candidates])
        worth = np.array([self._worth(group, reading, view) for reading in candidates])
        self.cases.append(Case(self._source, measures, worth))
        explored = self._rng.random() < _EXPLORED
        nats: list[float] = (worth if explored else measures @ self._weights).tolist()
        return nats

    def note(self, curves: Mapping[int, BSplineCurve]) -> None:
        """Note which objects the published tracks, by id, are now."""
        assert self.known is not None
        if curves:
            l3 = compare_traces(Found(tuple(curves.values())).traces, self.known.traces).l3
            for j, track in enumerate(curves):
                if l3[:, j].min() < _RIGHT_PX:
                    self._owners[track] = self.known.truth.ids[int(l3[:, j].argmin())]

    def _worth(self, group: Group, reading: Reading, view: View) -> float:
        """Return how many objects a reading shows rightly, in whole and in parts."""
        assert self.known is not None
        curves = _curves(group, reading, view)
        if not curves:
            return 0.0
        l3 = compare_traces(Found(tuple(curve for _, curve in curves)).traces, self.known.traces).l3
        worth = -_JUNK * float((l3.min(axis=0) > _FAR_PX).sum())
        for true_id, errors in zip(self.known.truth.ids, l3, strict=True):
            track = curves[int(errors.argmin())][0]
            stranger = self._owners.get(track, true_id) != true_id if track else true_id in self._owners.values()
            worth += float(np.exp(-errors.min() / _NEAR_PX)) * (_OTHERS if stranger else 1.0)
        return worth


def _curves(group: Group, reading: Reading, view: View) -> list[tuple[int | None, BSplineCurve]]:
    """Return the curves that a reading of a group publishes, each with the id of its track, None for a new one."""
    models, observations = group
    curves: list[tuple[int | None, BSplineCurve]] = []
    for model in models:
        if model.id in reading:
            shown, after = reading[model.id], deepcopy(model)
            update_seen(after, shown, view, 1.0 / 30.0)
            curves.append((model.id, after.curve if after.visible is None else after.visible.curve))
    used = {index for shown in reading.values() for index in shown.detection_indices}
    return curves + [(None, one.curve) for one in observations if one.detection_index not in used]


def follow(source: str, frames: Iterable[tuple[Frame, KnownFrame]], weights: _Floats, seed: int = 0) -> list[Case]:
    """Follow a sequence with some weights and return the cases that come up."""
    judge, pipeline = Judge(source, weights, seed), Pipeline()
    kept = readings.weigh, hypotheses.MAX_HYPOTHESES
    readings.weigh, hypotheses.MAX_HYPOTHESES = judge.weigh, 1  # a case is of the reading that goes on
    try:
        for frame, known in frames:
            judge.known = known
            judge.note({track.id: track.curve for track in pipeline.process(frame).tracks})
    finally:
        readings.weigh, hypotheses.MAX_HYPOTHESES = kept
    return judge.cases


def _follow_sequence(source: str, weights: _Floats, sequence: KnownSequence) -> list[Case]:
    frames = (
        (known.frame, known)
        for known in (KnownFrame(sequence.frame(i), sequence.truth(i)) for i in range(len(sequence)))
    )
    return follow(source, frames, weights)


def fit(cases: Sequence[Case]) -> _Floats:
    """Return the weights under which the better readings are the likeliest; sources count by their cases' root."""
    decided = [case for case in cases if case.is_decided]
    counts = {name: sum(case.source == name for case in decided) for name in SOURCES}
    counted = np.array([min(float(np.ptp(case.worth)), 1.0) / np.sqrt(counts[case.source]) for case in decided])
    counted /= counted.mean()
    most = max(len(case.worth) for case in decided)
    rows, wanted = np.zeros((len(decided), most, len(Features._fields))), np.zeros((len(decided), most))
    absent = np.zeros((len(decided), most))
    for k, case in enumerate(decided):
        n = len(case.worth)
        rows[k, :n], absent[k, n:] = case.measures, -np.inf
        wanted[k, :n] = softmax((case.worth - case.worth.max()) / _SOFT)

    def loss(weights: _Floats) -> tuple[float, _Floats]:
        score = rows @ weights + absent
        shares = softmax(score, axis=1)
        value = counted @ (logsumexp(score, axis=1) - (wanted * (rows @ weights)).sum(axis=1))
        slope = np.einsum("k,kr,krf->f", counted, shares - wanted, rows)
        return float(value + 0.5 * _RIDGE * (weights @ weights)), slope + _RIDGE * weights

    found: _Floats = minimize(loss, np.zeros(rows.shape[2]), jac=True, method="L-BFGS-B").x
    return found


def lost(cases: Sequence[Case], weights: _Floats) -> float:
    """Return the mean worth that is lost by the readings that some weights choose, over decided cases."""
    losses = [case.lost(int(np.argmax(case.measures @ weights))) for case in cases if case.is_decided]
    return float(np.mean(losses)) if losses else 0.0


def make_page(cases: Sequence[Case], weights: _Floats) -> str:
    """Return the page of the weights."""
    lines = [
        "# The weights of tracking",
        "",
        "For maintainers; [Tracking](../tracking.md) says what they decide.",
        "Made by `python -m benchmarks.fit_tracking`.",
        "",
        "A frame's detections, each as one whole object, may say something else than the tracks laid through them. The",
        "log-odds of either reading are the sum of its measures times weights. A case is a group of tracks and",
        "detections, in one frame of a sequence that is followed with these weights. The worth of a reading is one for",
        "each object whose curve is right. Lost is the mean worth by which the reading chosen is worse than the best:",
        "always the tracks', always the frame's, the likelier one by the weights, and by weights that were fitted",
        "without the source.",
        "",
        "The fit looks at frames one by one, and cannot say which measures there should be: without `length`,",
        "`clear` and `bare` it loses less by frames, each source left out, and follows whole sequences with more harm.",
        "",
        "| source | what | cases | the tracks' | the frame's | fitted | left out |",
        "| --- | --- | ---: | ---: | ---: | ---: | ---: |",
    ]
    for name, what in SOURCES.items():
        own = [case for case in cases if case.source == name]
        others = [case for case in cases if case.source != name]
        decided = [case for case in own if case.is_decided]
        tracks, frame = ([case.lost(which) for case in decided] or [0.0] for which in (0, 1))
        lines.append(
            f"| {name} | {what} | {len(decided)} | {np.mean(tracks):.3f} | {np.mean(frame):.3f} | "
            f"{lost(own, weights):.3f} | {lost(own, fit(others)):.3f} |"
        )
    lines += ["", "| measure | nats a unit |", "| --- | ---: |"]
    lines += [f"| `{name}` | {weight:.2f} |" for name, weight in zip(Features._fields, weights, strict=True)]
    return "\n".join(lines) + "\n"


def write_weights(path: Path, weights: _Floats) -> None:
    """Write the weights into the module that has them."""
    text = path.read_text(encoding="utf-8")
    first, last = text.index("WEIGHTS = Features("), text.index('"""Log-odds of a reading')
    given = [f"    {name}={weight:.3g}," for name, weight in zip(Features._fields, weights.tolist(), strict=True)]
    path.write_text("\n".join([text[:first] + "WEIGHTS = Features(", *given, ")", text[last:]]), encoding="utf-8")


def main(arguments: Sequence[str] | None = None) -> None:
    """Fit, and print or write the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument(
        "--write", action="store_true", help="write docs/maintainers/tracking-weights.md, and the weights"
    )
    parser.add_argument("--jobs", type=int, default=2, help="processes; 2 by default")
    options = parser.parse_args(arguments)
    cases: list[Case] = []
    weights = np.array(START)
    for _ in range(_ROUNDS):
        with ProcessPoolExecutor(options.jobs) as pool:
            runs = [
                pool.submit(_follow_sequence, name, weights, sequence)
                for name in SOURCES
                for sequence in list_sequences(name, options.folder)
            ]
            cases += [case for run in runs for case in run.result()]
        weights = np.array([float(f"{weight:.3g}") for weight in fit(cases)])  # as they are written
    page = make_page(cases, weights)
    print(page)
    if options.write:
        write_weights(FITTED, weights)
        PAGE.write_text(page, encoding="utf-8")


if __name__ == "__main__":
    main()
