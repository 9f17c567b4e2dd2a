"""What is a cable at all, beside the largest object of a mask."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from linking_examples import draw

from dloftbs import Config, Prediction, detect
from dloftbs.config import LinkingConfig
from dloftbs.linking.existence import existence_of, expectations_of, with_existence
from dloftbs.linking.object_selection import choose

CABLES = [(20, 60), (380, 70)], [(30, 180), (330, 190)]
CRUMB = [(200, 120), (212, 121)]
MASK = draw(*CABLES) | draw(CRUMB, width=5)


@given(st.floats(1e-12, 1.0), st.floats(1e-12, 1.0))
def test_a_larger_share_is_no_less_probable(share: float, other: float) -> None:
    low, high = sorted((share, other))
    assert 0.0 <= existence_of(low) <= existence_of(high) < 1.0
    assert existence_of(0.0) == 0.0


def test_debris_beside_cables_is_dropped_and_reported() -> None:
    result = detect(MASK)
    assert len(result) == 2
    (crumb,) = result.dropped
    assert crumb.probability == crumb.centerline.existence < 0.33
    assert "linking.min_probability = 0.33" in crumb.reason
    assert np.hypot(*(crumb.centerline.points.mean(axis=0) - np.mean(CRUMB, axis=0))) < 3.0
    assert crumb.to_dict()["probability"] == crumb.probability
    everything = detect(MASK, config=Config().replace({"linking.min_probability": 0.0}))
    assert (len(everything), everything.dropped) == (3, ())
    assert min(one.existence for one in everything) == crumb.probability
    assert min(one.confidence for one in everything) <= crumb.probability


def test_alone_it_is_what_there_is() -> None:
    result = detect(draw(CRUMB, width=4))
    assert [one.existence for one in result] == [1.0]
    assert result.dropped == ()


def test_a_known_number_takes_its_place() -> None:
    result = detect(MASK, config=Config().replace({"linking.objects": 3}))
    assert (len(result), result.dropped) == (3, ())


@pytest.mark.parametrize("scale", [2, 3])
def test_the_scale_hardly_matters(scale: int) -> None:
    mask = draw([(20, 60), (380, 70)], [(30, 180), (150, 190)], width=6)
    large = cv2.resize(mask, None, fx=scale, fy=scale, interpolation=cv2.INTER_NEAREST)
    one, other = (min(found.existence for found in detect(each)) for each in (mask, large))
    assert one == pytest.approx(other, abs=0.01)


def test_a_short_cable_beside_a_long_one_in_a_coil_is_no_debris() -> None:
    turns = np.linspace(0.0, 2.0 * np.pi * 12, 2000)
    coil = np.column_stack((180.0 + (4.0 + turns * 2.3) * np.cos(turns), 190.0 + (4.0 + turns * 2.3) * np.sin(turns)))
    piece = [(380, 40), (450, 50)]
    result = detect(draw(coil, piece, width=6, size=(380, 480)))
    assert sorted(len(one.centerline.points) > 1000 for one in result) == [False, True]
    assert result.dropped == ()


def test_without_objects_there_is_nothing_to_judge() -> None:
    assert with_existence([]) == []


@pytest.mark.large
def test_cables_are_counted_in_the_masks_of_a_network(shared_data: Path) -> None:
    """Tile joints, tools and shadows are no cables: in four of these 27 there are some."""
    right = []
    for path in sorted((shared_data / "networks" / "ewd").glob("*.r101.png")):
        labels = cv2.imread(str(path.with_name(path.name.replace(".r101.", ".labels."))), cv2.IMREAD_GRAYSCALE)
        grey = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
        assert labels is not None
        assert grey is not None
        right.append(len(detect(grey > 127)) == len(np.unique(labels[labels > 0])))
    assert np.mean(right) > 0.92


class TestExpected:
    """What little is in sight of a cable that a stream knows is no debris."""

    CURVE = detect(draw([(150, 100), (260, 140)]))[0].curve
    CRUMB = draw([(198, 117), (210, 121)], width=5)

    def test_what_lies_along_a_predicted_curve_is_kept_as_far_as_that_is_sure(self) -> None:
        mask = draw(*CABLES)
        (crumb,) = detect(mask | self.CRUMB).dropped
        lines = [*(one.centerline for one in detect(mask)), crumb.centerline]
        for confidence, is_kept in ((0.9, True), (0.01, False)):
            kept, dropped = choose(lines, LinkingConfig(), [Prediction(self.CURVE, confidence)])
            assert (len(kept), len(dropped)) == ((3, 0) if is_kept else (2, 1))

    def test_what_lies_beside_it_across_it_or_beyond_it_is_not_expected(self) -> None:
        (line,) = (one.centerline for one in detect(self.CRUMB))
        near = self.CURVE.transformed(np.eye(2), (1.0, 1.0))
        beside = self.CURVE.transformed(np.eye(2), (0.0, 20.0))
        across = self.CURVE.transformed([[0.0, -1.0], [1.0, 0.0]], (320.0, -85.0))
        beyond = self.CURVE.transformed(np.eye(2), (90.0, 33.0))
        found = [expectations_of([line], [Prediction(one, 0.8)]) for one in (near, beside, across, beyond)]
        assert found == [[0.8], [0.0], [0.0], [0.0]]
        three = [Prediction(near, 0.3), Prediction(beside, 0.9), Prediction(near, 0.5)]
        assert expectations_of([line, line], three) == [0.5, 0.5]
        assert expectations_of([line], []) == [0.0]
        assert expectations_of([], three) == []
