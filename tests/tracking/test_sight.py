"""Sight of a track: how sure it is of what was not seen."""

from __future__ import annotations

import pytest

from dloftbs.tracking.sight import Sight


def test_a_part_is_as_sure_as_it_was_seen_lately():
    sight = Sight.of_whole(())
    sight.see_part(((0.5, 1.0),), ((0.5, 1.0),), None, 50.0, 1.0)
    assert sight.confidence == pytest.approx(0.625, abs=0.01)
    assert sight.confidence_in((0.0, 0.45)) == 1.0
    assert sight.confidence_in((0.6, 1.0)) == pytest.approx(0.25)  # two half-lives
