"""Detections with gaps that begin and end where a track does."""

from __future__ import annotations

import numpy as np
import pytest
from linking_examples import draw, hide

import dloftbs
from dloftbs import BSplineCurve, Frame, Pipeline

X = np.linspace(30.0, 370.0, 300)
WAVE = np.column_stack((X, 120.0 + 70.0 * np.sin((X - 30.0) / 54.0)))


def process(pipeline: Pipeline, masks: list[np.ndarray]) -> list[dloftbs.FrameResult]:
    return [pipeline.process(Frame(mask=mask, index=k, stamp=k / 30)) for k, mask in enumerate(masks)]


def off(curve: BSplineCurve) -> float:
    """Return the mean distance of a curve from the true one, sample by sample."""
    true = WAVE[np.searchsorted(_arc(WAVE), np.linspace(0.0, 1.0, 200)).clip(0, len(WAVE) - 1)]
    points = curve.sample(200)
    return float(min(np.hypot(*(points - true).T).mean(), np.hypot(*(points[::-1] - true).T).mean()))


def _arc(points: np.ndarray) -> np.ndarray:
    steps = np.hypot(*np.diff(points, axis=0).T)
    return np.concatenate(([0.0], np.cumsum(steps))) / steps.sum()


@pytest.mark.parametrize("radius", [20, 28, 36])
def test_a_bridged_bow_keeps_its_shape_and_its_length(radius: float) -> None:
    whole = draw(WAVE)
    bow = WAVE[np.argmax(WAVE[:, 1])]
    hidden = hide(whole, *bow, radius)
    *_, before, last = process(Pipeline(), [whole] * 10 + [hidden] * 3)
    (alone,) = dloftbs.detect(hidden)
    (track,) = last.tracks
    assert track.id == before.tracks[0].id == 1
    assert track.inferred
    assert off(track.curve) < 4.0
    assert off(track.curve) <= off(alone.curve) + 0.5
    assert abs(track.curve.length - dloftbs.detect(whole)[0].curve.length) < 8.0


def test_two_discs_leave_it_one_track() -> None:
    whole = draw(WAVE)
    top, bottom = WAVE[np.argmin(WAVE[:, 1])], WAVE[np.argmax(WAVE[:, 1])]
    hidden = hide(hide(whole, *top, 22), *bottom, 22)
    results = process(Pipeline(), [whole] * 10 + [hidden] * 20 + [whole] * 3)
    assert {track.id for result in results for track in result.tracks} == {1}
    assert all(off(result.tracks[0].curve) < 5.0 for result in results)
