"""Methods on one sequence: they are called frame by frame, and what they return is scored."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields, replace
from time import perf_counter
from typing import Any

import numpy as np

from dloftbs.data.frame import Frame
from dloftbs.errors import InputError
from dloftbs.support.text import readable
from dloftbs_lab.evaluation.runner.finished_parts import FrameRow, JointRow, Key, Part, Points
from dloftbs_lab.evaluation.runner.found import Curve, Found, found_in, samples
from dloftbs_lab.evaluation.runner.frame_scores import IdentityScorer, Score, score
from dloftbs_lab.evaluation.runner.joint_scores import judge_joints
from dloftbs_lab.evaluation.runner.known_frame import KnownFrame
from dloftbs_lab.evaluation.runner.track_scores import FollowingScorer
from dloftbs_lab.evaluation.runner.visible_truth import distances_of
from dloftbs_lab.known_sequence import KnownSequence
from dloftbs_lab.truth import Truth

WORST = 10
"""Number of worst frames that are kept."""

_PICTURE_POINTS = 160  # of a curve in a picture
_SCORES = tuple(one.name for one in fields(Score) if one.name != "distances")
_SHARES = (0.0, 0.25, 0.5, 0.75, 1.0)
"""Places in a sequence at which its objects are counted."""
_FAILURES = (Exception, SystemExit)
"""What a stranger's code may raise without an end of the other frames and methods: all but Ctrl-C."""
_warm: set[tuple[str, str]] = set()


@dataclass(frozen=True)
class Method:
    """Something that finds curves.

    Parameters
    ----------
    name : str
    factory : callable
        Without arguments; returns a function from a `Frame` to what `found_in` takes. Called for each sequence,
        so that what the function remembers ends with it. Must be picklable. Where the function is an object with a
        method ``start(frame, truth)``, that is called before the first frame, with its truth: for trackers that have to
        be given where objects are, of whom nothing is scored frame by frame alone.
    settings : str
        Settings that its results depend on, besides the name: its configuration, or a digest of its code.
    one_factory : callable, optional
        The same for sequences of one object, where a method has a form of its own for these.
    branched_factory : callable, optional
        The same for sequences of objects that branch.
    alternatives : tuple of callable
        Further factories: of each sequence only the form counts whose curves are nearest to the truth, as where a paper
        counts the best of several settings.
    suites : tuple of str
        Names of the generated suites that it is for; empty for all.
    """

    name: str
    factory: Callable[[], Callable[[Frame], Any]]
    settings: str = ""
    one_factory: Callable[[], Callable[[Frame], Any]] | None = None
    alternatives: tuple[Callable[[], Callable[[Frame], Any]], ...] = ()
    suites: tuple[str, ...] = ()
    branched_factory: Callable[[], Callable[[Frame], Any]] | None = None

    @property
    def forms(self) -> list[Method]:
        """The method with each of its factories, but that for one object."""
        return [replace(self, factory=factory, alternatives=()) for factory in (self.factory, *self.alternatives)]

    def made_for(self, sequence: KnownSequence) -> Method:
        """Return the form for a sequence: that of one object where none of some frames shows more.

        Where objects branch, it is that for these.
        """
        if sequence.is_branched and self.branched_factory is not None:
            return replace(self, factory=self.branched_factory, branched_factory=None)
        if self.one_factory is None:
            return self
        some = {round(share * (len(sequence) - 1)) for share in _SHARES} if len(sequence) else set()
        # The first frame last: sequences that keep the latest drawing have that of the frame that is asked for next.
        single = all(len(sequence.truth(index).ids) <= 1 for index in sorted(some, reverse=True))
        return replace(self, factory=self.one_factory, one_factory=None) if single else self


def score_sequence(keys: Sequence[Key], sequence: KnownSequence, methods: Sequence[Method]) -> list[Part]:
    """Call a fresh instance of each method on all frames of a sequence, and score it.

    All methods get a frame before the next one is made, since to generate one often takes longer than to process it.

    Parameters
    ----------
    keys : sequence of Key
        One for each method.
    sequence : KnownSequence
    methods : sequence of Method

    Returns
    -------
    list of Part
        In the order of the methods.

    Raises
    ------
    InputError
        If a method cannot be made.
    """
    forms = [
        [_Run(key, sequence, form) for form in method.made_for(sequence).forms]
        for key, method in zip(keys, methods, strict=True)
    ]
    for index in range(len(sequence)):
        known = KnownFrame(sequence.frame(index), sequence.truth(index), getattr(sequence, "radius_m", None))
        for runs in forms:
            for run in runs:
                run.add(index, known)
    return [min((run.part() for run in runs), key=_error) for runs in forms]


def _error(part: Part) -> tuple[int, float]:
    """Return by what the best form of a method is chosen: frames without a figure, then the sum of the L3."""
    in_space = any(row.l3_mm is not None for row in part.rows)
    errors = [row.l3_mm if in_space else row.l3_whole_px for row in part.rows]
    known = [error for error in errors if error is not None]
    return len(errors) - len(known), sum(known)


class _Run:
    """One method on one sequence, frame by frame."""

    def __init__(self, key: Key, sequence: KnownSequence, method: Method) -> None:
        _warm_up(method, sequence)
        self._key = key
        self._sequence = sequence
        self._method = method
        self._call = _make(method)
        self._shows_single_images = sequence.fps is None  # frames without a rate: identities mean nothing
        self._is_told_the_start = hasattr(self._call, "start")
        self._not_started: str | None = None
        self._rows: list[FrameRow] = []
        self._joints: list[JointRow] = []
        self._curves: dict[int, tuple[Curve, ...]] = {}
        self._identities: IdentityScorer | None = None
        # What is given where a track begins has no reading of a frame alone to be compared with.
        self._following = None if self._is_told_the_start else _following(sequence)

    def add(self, index: int, known: KnownFrame) -> None:
        """Score the next frame."""
        frame, truth = known.frame, known.truth
        if self._shows_single_images and index > 0 and not self._is_told_the_start:
            self._call = _make(self._method)  # an image is no news of the one before
        if index == 0 and self._is_told_the_start:
            self._not_started = _start(self._call, frame, truth)
        found, ms, failure = (
            _call(self._call, frame) if self._not_started is None else (Found(), 0.0, self._not_started)
        )
        detected = found.detected or found
        result = score(detected, known, self._sequence.tolerance_px)
        distances = result.distances
        if detected is not found:
            distances = None if distances is None else distances_of(found, known)[0]
        self._rows.append(
            _row(self._key, index, detected, known, result, ms=ms, failure=failure, scene=self._scene(index))
        )
        joints = judge_joints(index, detected.detections, truth, frame.size)
        self._joints += [replace(joint, scene=self._scene(index)) for joint in joints]
        self._identities = self._identities or IdentityScorer(frame.size)
        self._identities.add(found, known, distances)
        if self._following is not None and distances is not None and self._following.wants(found):
            # What it finds without its past: an instance that sees no other frame.
            alone, _, _ = _call(_make(self._method), frame)
            self._following.add(index, found, alone, known, distances)
        self._curves[index] = detected.curves
        _forget(self._curves, self._rows)

    def _scene(self, index: int) -> str:
        """Return the scene that a frame shows: single images show one each."""
        name = self._sequence.scene_name or self._key.sequence
        return f"{name} #{index}" if self._shows_single_images else name

    def part(self) -> Part:
        """Return the scores of all frames."""
        tracking = None if self._identities is None or self._shows_single_images else self._identities.scores()
        worst = {index: [_points(curve) for curve in of_frame] for index, of_frame in self._curves.items()}
        following = None if self._following is None else self._following.result()
        rung = _rung(self._sequence)
        return Part(self._key, tuple(self._rows), tracking, worst, tuple(self._joints), *rung, following)


def _following(sequence: Any) -> FollowingScorer | None:
    """Return what scores how objects are followed, where a sequence says that it was made for it."""
    return FollowingScorer(sequence.family, sequence.cables) if hasattr(sequence, "family") else None


def _rung(sequence: Any) -> tuple[str | None, float | None]:
    """Return the ladder that a sequence is on, with its unit, and the level, if it is on one."""
    if not hasattr(sequence, "ladder"):
        return None, None
    return f"{sequence.base}, {sequence.ladder}, {sequence.unit}", sequence.level


def _make(method: Method) -> Callable[[Frame], Any]:
    try:
        return method.factory()
    except _FAILURES as error:
        raise InputError(f"method {method.name!r} cannot be made: {_text(error)}") from error


def _warm_up(method: Method, sequence: KnownSequence) -> None:
    """Call an instance that nobody needs once a process, since compiling and loading is no part of a frame's time."""
    name = (method.name, method.settings)
    if name not in _warm and len(sequence):
        _warm.add(name)
        call, frame = _make(method), sequence.frame(0)
        if hasattr(call, "start"):
            _start(call, frame, sequence.truth(0))
        _call(call, frame)


def _start(call: Any, frame: Frame, truth: Truth) -> str | None:
    """Give a method the truth of the first frame, and return what went wrong."""
    try:
        call.start(frame, truth)
    except _FAILURES as error:
        return _text(error)
    return None


def _call(call: Callable[[Frame], Any], frame: Frame) -> tuple[Found, float, str | None]:
    """Return what a method found, the milliseconds of its call, and what went wrong."""
    since = perf_counter()
    try:
        output = call(frame)
        if isinstance(output, Iterator):
            output = list(output)
        ms = _ms(since)
        return found_in(output, frame), ms, None  # which may run a stranger's code, too: its output need not be a list
    except _FAILURES as error:
        return Found(), _ms(since), _text(error)


def _row(key: Key, index: int, found: Found, known: KnownFrame, result: Score, **others: Any) -> FrameRow:
    scores = {name: getattr(result, name) for name in _SCORES}
    n_true, n_found = int(np.count_nonzero(known.visible)), len(found.curves)
    return FrameRow(key.suite, key.sequence, index, key.method, n_true=n_true, n_found=n_found, **scores, **others)


def _forget(curves: dict[int, tuple[Curve, ...]], rows: list[FrameRow]) -> None:
    """Keep the curves of the worst frames so far."""
    if len(curves) > WORST:
        del curves[min(curves, key=lambda index: rows[index].badness)]


def _points(curve: Curve) -> Points:
    points = samples(curve)
    kept = points[np.linspace(0, len(points) - 1, _PICTURE_POINTS).round().astype(int)]
    return [(x, y) for x, y in kept.round(2).tolist()]


def _ms(since: float) -> float:
    return 1e3 * (perf_counter() - since)


def _text(error: BaseException) -> str:
    return readable(f"{type(error).__name__}: {error}")
