"""The fit of the confidence of tracks: claims, the model, its page and the module that has the numbers."""

from __future__ import annotations

import shutil

import numpy as np
from benchmarks.fit_track_confidence import FITTED, Claim, fit, list_claims, make_page, state, write_line
from benchmarks.fit_tracking import SOURCES

from dloftbs.tracking.confidence_weights import TRACK_CONFIDENCE
from dloftbs.tracking.track_confidence import Signs, probability_of
from dloftbs_lab.synthetic import TrackingSequence

LINE = np.array(TRACK_CONFIDENCE)


def made_claims(rng: np.random.Generator, count: int) -> list[Claim]:
    """Return claims that are right as often as the numbers in use say."""
    claims = []
    for k in range(count):
        signs = Signs(rng.uniform(-4, 7), float(rng.random() < 0.3), rng.uniform(-4, 4), abs(rng.normal(0, 0.5)))
        seen = rng.choice([1.0, rng.uniform(0.5, 1.0)])
        claims.append(Claim(list(SOURCES)[k % 3], signs, seen, bool(rng.random() < seen * probability_of(signs))))
    return claims


def test_numbers_that_made_the_claims_are_found_again() -> None:
    claims = made_claims(np.random.default_rng(1), 20000)
    np.testing.assert_allclose(fit(claims), LINE, rtol=0.1, atol=0.1)
    np.testing.assert_allclose(state(claims, LINE), [claim.seen * probability_of(claim.signs) for claim in claims])


def test_each_third_frame_of_a_sequence_has_a_claim_for_each_track() -> None:
    sequence = TrackingSequence("crossing", 3, 0, frames=9, size=(360, 640))
    claims = list(list_claims("crossing", sequence))
    assert len(claims) == 9
    assert {claim.source for claim in claims} == {"crossing"}
    assert all(np.isfinite(claim.signs).all() and 0.0 < claim.seen <= 1.0 for claim in claims)
    assert sum(claim.right for claim in claims) >= 6


def test_the_page_has_a_row_for_each_source_that_has_claims() -> None:
    page = make_page(made_claims(np.random.default_rng(2), 300), LINE)
    for k, (name, what) in enumerate(SOURCES.items()):
        assert (f"| {name} | {what} | 100 |" in page) == (k < 3)
    assert f"{LINE[0]:.2f} {LINE[1]:+.2f} b" in page


def test_numbers_are_written_into_their_module(tmp_path) -> None:
    path = tmp_path / FITTED.name
    shutil.copy(FITTED, path)
    write_line(path, np.arange(5) / 4.0)
    space: dict[str, object] = {}
    exec(compile(path.read_text(encoding="utf-8"), str(path), "exec"), space)
    assert space["TRACK_CONFIDENCE"] == (0.0, 0.25, 0.5, 0.75, 1.0)
