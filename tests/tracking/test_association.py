"""Which tracks and detections are compared at all."""

from __future__ import annotations

import numpy as np
import pytest
from builders import line

from dloftbs.tracking import Tracker
from dloftbs.tracking.kernels import alignment as kernels


def rows(count: int, shift: float) -> list:
    """Return short cables in a square, far from each other."""
    side = int(np.sqrt(count))
    places = [(60.0 * x + shift, 60.0 * y) for x in range(side) for y in range(side)]
    return [line((x, y), (x + 30.0, y)) for x, y in places]


@pytest.mark.parametrize("count", [16, 144])
def test_an_object_is_compared_with_those_beside_it_alone(monkeypatch, count):
    measured = []
    align_all = kernels.align_all

    def counted(*given):
        measured.append(np.count_nonzero(given[-1]))
        return align_all(*given)

    monkeypatch.setattr(kernels, "align_all", counted)
    tracker = Tracker()
    for number in range(6):  # to and fro by too much to be taken without doubt
        tracks = tracker.update(rows(count, 1.0 * (number % 2)))
    assert [track.id for track in tracks] == list(range(1, count + 1))
    assert measured
    assert max(measured) <= 2 * count
