"""Scores of tracks through a sequence: all published tracks, hidden ones too, against the whole truth."""

from __future__ import annotations

from collections.abc import Hashable

import cv2
import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from dloftbs._arrays import FloatArray
from dloftbs.curve import BSplineCurve
from dloftbs.evaluation.curve_matching import CurveDistances, compare_curves
from dloftbs.evaluation.curves import even_distances, even_l3
from dloftbs.evaluation.identity_scores import TrackingScorer
from dloftbs.evaluation.runner.finished_parts import Following, TrackRow
from dloftbs.evaluation.runner.found import Curve, Found, samples
from dloftbs.evaluation.runner.frame_scores import TRACK_GATE, mean_width
from dloftbs.evaluation.runner.visible_truth import distances_of, visible_objects
from dloftbs.evaluation.traces import SAMPLES, align, traces_of
from dloftbs.truth import Truth


class FollowingScorer:
    """Scores a sequence, frame by frame, as long as the method gives identities.

    Parameters
    ----------
    family : str
        Kind of motion in the sequence.
    cables : int
        Number of objects.
    """

    def __init__(self, family: str, cables: int) -> None:
        self._family = family
        self._cables = cables
        self._scorer: TrackingScorer | None = None
        self._numbers: dict[Hashable, int] = {}
        self._rows: list[TrackRow] = []
        self._known = True
        self._points = self._ghosts = 0

    def wants(self, found: Found) -> bool:
        """Return whether the method has given all of its curves identities so far."""
        self._known = self._known and not (found.curves and found.ids is None)
        return self._known

    def add(
        self, index: int, found: Found, alone: Found, truth: Truth, distances: CurveDistances, size: tuple[int, int]
    ) -> None:
        """Count a frame.

        Parameters
        ----------
        index : int
        found : Found
            With all tracks.
        alone : Found
            Result of the method on the frame when it knows no other.
        truth : Truth
            With curves and masks.
        distances : CurveDistances
            Distances of the curves of `found` to what was visible; see `distances_of`.
        size : (int, int)
            ``(H, W)`` px.
        """
        self._scorer = self._scorer or TrackingScorer(gate=TRACK_GATE * max(size))
        numbers = [self._numbers.setdefault(track.id, len(self._numbers)) for track in found.tracks]
        curves = tuple(track.curve for track in found.tracks)
        if not all(track.seen for track in found.tracks):
            distances, _ = distances_of(Found(curves), truth)
        if truth.mask is not None:
            points = np.concatenate([np.empty((0, 2)), *map(samples, curves)])
            self._points += len(points)
            self._ghosts += count_ghosts(points, truth.mask)
        given = self._match(numbers, distances, truth)
        whole = compare_curves(alone.curves, truth.curves).l3
        for i, true_id in enumerate(truth.ids):
            number = given.get(true_id)
            j = None if number is None else numbers.index(number)
            errors = _nearest(curves if j is None else curves[j : j + 1], truth.curves[i])
            shown = _shown(truth, i)
            self._rows.append(
                TrackRow(
                    index,
                    true_id,
                    float(shown.mean()),
                    number,
                    j is not None and found.tracks[j].seen,
                    _mean(errors),
                    None if errors is None else _mean(errors[shown]),
                    None if errors is None else _mean(errors[~shown]),
                    float(whole[i].min()) if alone.curves else None,
                )
            )

    def _match(self, numbers: list[int], distances: CurveDistances, truth: Truth) -> dict[int, int]:
        """Count identities and directions, and return the track of each object that has one."""
        assert self._scorer is not None  # `add` saw to it
        visible = visible_objects(truth)
        hidden = [true_id for true_id, shows in zip(truth.ids, visible, strict=True) if not shows]
        lasting = {true_id: last for true_id in hidden if (last := self._scorer.track_of(true_id)) in numbers}
        # Nobody can say where something is that is hidden as a whole: right or wrong, its track does not count.
        rows = [i for i, shows in enumerate(visible) if shows]
        columns = [j for j, number in enumerate(numbers) if number not in lasting.values()]
        ids, tracks, those = [truth.ids[i] for i in rows], [numbers[j] for j in columns], np.ix_(rows, columns)
        given = self._scorer.add(ids, tracks, distances.l3[those], distances.forward[those])
        return given | lasting  # type: ignore[return-value]  # what was put in comes out

    def result(self) -> Following | None:
        """Return the scores, or None where the method has curves without identities."""
        if not self._known or self._scorer is None:
            return None
        return Following(
            self._family, self._cables, self._scorer.scores(), tuple(self._rows), self._points, self._ghosts
        )


def count_ghosts(points: FloatArray, mask: npt.NDArray[np.bool_]) -> int:
    """Return how many points (n, 2) px lie more than a mean width of the cables from anything in their mask (H, W)."""
    if not mask.any():
        return len(points)
    inside = points.clip(0.0, np.array(mask.shape[::-1]) - 1.0)
    columns, rows = np.rint(inside).astype(np.intp).T
    away, outside = np.zeros(len(points)), ~mask[rows, columns]
    if outside.any():
        # Few points lie outside of the mask: to ask for these costs less than a distance for every pixel.
        border = np.argwhere(mask & ~cv2.erode(mask.astype(np.uint8), np.ones((3, 3), np.uint8)).view(bool))
        away[outside], _ = cKDTree(border).query(np.stack((rows[outside], columns[outside]), axis=1))
    return int((away + np.linalg.norm(points - inside, axis=1) > mean_width(mask)).sum())


def _nearest(curves: tuple[Curve, ...], true: BSplineCurve) -> FloatArray | None:
    """Return the distances (SAMPLES,), of which L3 is the mean, of the curve with the least L3, along the true one."""
    if not curves:
        return None
    fits = [align(*traces_of(curve, true, SAMPLES), SAMPLES, even_l3, directed=False) for curve in curves]
    best = min(fits, key=lambda fit: fit.error)
    return even_distances(best.found, best.true)


def _shown(truth: Truth, number: int) -> npt.NDArray[np.bool_]:
    """Return at which of `SAMPLES` evenly spaced ``u`` the mask shows an object."""
    u = np.linspace(0.0, 1.0, SAMPLES)
    shown = np.zeros(SAMPLES, np.bool_)
    for low, high in truth.shown_spans[number]:
        shown |= (u >= low) & (u <= high)
    return shown


def _mean(values: FloatArray | None) -> float | None:
    return None if values is None or not len(values) else float(values.mean())
