"""The fit of the weights of tracking: cases, the model, its page and the module that has them."""

from __future__ import annotations

import shutil

import numpy as np
import pytest
from benchmarks.fit_tracking import (
    FITTED,
    PAGE,
    SOURCES,
    START,
    Case,
    fit,
    follow,
    list_sequences,
    lost,
    make_page,
    write_weights,
)

from dloftbs.tracking import hypotheses, readings
from dloftbs.tracking.reading_features import Features
from dloftbs.tracking.reading_weights import WEIGHTS
from dloftbs_lab.commands.evaluate import evaluate
from dloftbs_lab.evaluation.runner.known_frame import KnownFrame
from dloftbs_lab.synthetic import TrackingSequence

COLUMNS = len(Features._fields)


def made_cases(rng: np.random.Generator, weights: np.ndarray, count: int) -> list[Case]:
    """Return cases of two or three readings whose worth is what some weights say."""
    rows = [rng.normal(size=(2 + k % 2, COLUMNS)) for k in range(count)]
    return [Case(list(SOURCES)[k % 3], one, np.clip(one @ weights, -1.0, 1.0)) for k, one in enumerate(rows)]


def test_weights_that_made_the_worth_are_found_again() -> None:
    rng = np.random.default_rng(1)
    weights = rng.normal(size=COLUMNS)
    cases = made_cases(rng, weights, 600)
    found = fit(cases)
    assert found @ weights / np.linalg.norm(found) / np.linalg.norm(weights) > 0.97
    assert lost(cases, found) < 0.02 < 0.2 < lost(cases, -weights)


def test_what_is_scored_by_default_was_not_fitted_on() -> None:
    (scored,) = [parameter.default for parameter in evaluate.params if parameter.name == "seed"]
    assert {scored}.isdisjoint(one.seed for one in list_sequences("covered", PAGE.parent))


def test_a_sequence_that_is_followed_has_cases_and_leaves_the_tracker_as_it_is() -> None:
    sequence = TrackingSequence("occluded", 3, 0, frames=30, size=(360, 640))
    known = [KnownFrame(sequence.frame(i), sequence.truth(i)) for i in range(30)]
    before = readings.weigh, hypotheses.MAX_HYPOTHESES
    cases = follow("covered", [(one.frame, one) for one in known], np.array(START))
    assert (readings.weigh, hypotheses.MAX_HYPOTHESES) == before
    assert cases
    assert all(np.isfinite(case.measures).all() and np.abs(case.worth).max() < 4.0 for case in cases)
    assert all(case.measures.shape == (len(case.worth), COLUMNS) and len(case.worth) > 1 for case in cases)


def test_the_page_has_a_row_for_each_source_and_measure() -> None:
    rng = np.random.default_rng(2)
    page = make_page(made_cases(rng, np.array(WEIGHTS), 90), np.array(WEIGHTS))
    assert all(f"| {name} | {what} |" in page for name, what in SOURCES.items())
    assert all(f"| `{name}` | {weight:.2f} |" in page for name, weight in WEIGHTS._asdict().items())


def test_weights_are_written_into_their_module(tmp_path) -> None:
    path = tmp_path / FITTED.name
    shutil.copy(FITTED, path)
    wanted = np.arange(COLUMNS) / 4.0
    write_weights(path, wanted)
    space: dict[str, object] = {}
    exec(compile(path.read_text(encoding="utf-8"), str(path), "exec"), space)
    assert space["WEIGHTS"] == Features(*wanted.tolist())


@pytest.mark.parametrize("name", Features._fields)
def test_the_page_says_the_weights_in_use(name: str) -> None:
    assert f"| `{name}` | {getattr(WEIGHTS, name):.2f} |" in PAGE.read_text(encoding="utf-8")
