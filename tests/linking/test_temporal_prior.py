"""Predicted curves as the linking of a crop uses them."""

from __future__ import annotations

import numpy as np
import pytest
from drawings import EIGHT_VERSIONS, turn, turn_points
from linking_examples import SIZE, draw, graph_of

import dloftbs
from dloftbs.data.prediction import Prediction
from dloftbs.linking.temporal_prior import TemporalPrior

GAP = (0.37, 0.63)
DASHES = [[(20, 60), (150, 70)], [(230, 76), (380, 90)]]


@pytest.mark.parametrize("version", EIGHT_VERSIONS)
def test_curves_have_the_orientation_of_the_crop(version: tuple[int, int, int]) -> None:
    whole, dashes = (turn(draw(*cables), *version) for cables in ([[(20, 60), (380, 90)]], DASHES))
    (seen,) = dloftbs.detect(whole)
    crop, graph = graph_of(dashes)
    prior = TemporalPrior([Prediction(seen.curve, 0.7)], crop, graph.width)
    rows, columns = np.triu_indices(len(graph.end_states), 1)
    found = prior.continuity(graph.end_states, rows, columns)
    (best,) = np.flatnonzero(found)
    assert 0.5 < found[best] <= 0.7
    ends = crop.to_image(graph.end_states[[rows[best], columns[best]], :2])
    expected = turn_points(np.array([[150.0, 70.0], [230.0, 76.0]]), SIZE, *version)
    assert min(np.abs(ends - expected).max(), np.abs(ends[::-1] - expected).max()) < 6.0


def test_samples_are_even() -> None:
    (seen,) = dloftbs.detect(draw([(20, 60), (380, 90)]))
    crop, graph = graph_of(draw(*DASHES))
    prior = TemporalPrior(
        [Prediction(seen.curve, 1.0), Prediction(seen.curve.reversed(), 0.5)], crop, graph.width
    ).samples
    assert prior.first.tolist() == [0, len(prior.points) // 2, len(prior.points)]
    steps = np.hypot(*np.diff(prior.points[: prior.first[1]], axis=0).T)
    np.testing.assert_allclose(steps, prior.steps[0], rtol=0.02)
    np.testing.assert_allclose(prior.points[: prior.first[1]], prior.points[prior.first[1] :][::-1], atol=1e-6)
    assert prior.weight.tolist() == [1.0, 0.5]


@pytest.mark.parametrize("version", EIGHT_VERSIONS)
def test_ends_of_two_that_do_not_hang_together_are_told(version: tuple[int, int, int]) -> None:
    crop, graph = graph_of(turn(draw(*DASHES, [(20, 160), (150, 170)]), *version))
    one, other, third = (dloftbs.detect(turn(draw(c), *version))[0].curve for c in [*DASHES, [(20, 160), (150, 170)]])
    rows, columns = np.triu_indices(len(graph.end_states), 1)
    apart = Prediction(one, 1.0, id=1), Prediction(other, 1.0, id=2, apart=frozenset({1})), Prediction(third, 1.0, id=3)
    prior = TemporalPrior(apart, crop, graph.width)
    assert prior.knows_of_cuts
    assert not TemporalPrior(apart[::2], crop, graph.width).knows_of_cuts
    pairs = np.flatnonzero(prior.are_apart(graph.end_states, rows, columns))
    assert len(pairs) == 4  # of two ends each
    places = [turn_points(np.array(dash, dtype=float), SIZE, *version) for dash in DASHES]
    for pair in pairs:
        for ends in crop.to_image(graph.end_states[[rows[pair], columns[pair]], :2])[:, None]:
            assert min(np.hypot(*(ends - place).T).min() for place in places) < 8.0


@pytest.mark.parametrize("reverse", [False, True])
def test_a_stretch_that_was_never_seen_says_nothing_about_a_joint(reverse: bool) -> None:
    (seen,) = dloftbs.detect(draw([(20, 60), (380, 90)]))
    crop, graph = graph_of(draw(*DASHES))
    curve, others = seen.curve.reversed() if reverse else seen.curve, Prediction(seen.curve, 0.5, ((0.0, 0.2),))
    prior = TemporalPrior([Prediction(curve, 1.0, (GAP,)), others], crop, graph.width)
    rows, columns = np.triu_indices(len(graph.end_states), 1)
    assert 0.0 < prior.continuity(graph.end_states, rows, columns).max() <= 0.5
    only = TemporalPrior([Prediction(curve, 1.0, (GAP,))], crop, graph.width)
    assert not only.continuity(graph.end_states, rows, columns).any()
    parts = only.samples
    assert len(parts.steps) == 2
    assert parts.first[-1] == len(parts.points)
    assert len(prior.samples.weight) == 3
