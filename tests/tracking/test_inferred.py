"""What tracks say was inferred: intervals of their own ``u``, whatever comes and goes."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from builders import detection_of, through_json, wave
from hypothesis import given
from hypothesis import strategies as st

from dloftbs.data.centerline import Joint, JointKind
from dloftbs.data.frame import Frame
from dloftbs.pipeline import Pipeline
from dloftbs.tracking import Tracker
from dloftbs.tracking.frame_view import View
from dloftbs.tracking.observation import make_observations
from dloftbs.tracking.partial_match import WHOLE, PartialMatch, gaps_on_track
from dloftbs.tracking.publication import make_visible_curve
from dloftbs.tracking.track_model import TrackModel

GAPS = ((0.1, 0.12), (0.3, 0.5), (0.6, 0.62), (0.8, 0.82))
LINKED = detection_of(wave(), joints=tuple(Joint(JointKind.GAP, span, 1.0, 1.0) for span in GAPS))
SHARES = st.floats(0.0, 1.0)


def striped(mask: np.ndarray, every: int, missing: int) -> np.ndarray:
    """Return a mask in which of so many rows the first ones are missing."""
    cut = mask.copy()
    cut[np.arange(len(mask)) % every < missing] = 0
    return cut


def check(tracks) -> None:
    for track in tracks:
        edges = [edge for span in track.inferred for edge in span]
        assert edges == sorted(edges)
        assert all(0.0 <= edge <= 1.0 for edge in edges)
        through_json(track.to_dict())


@pytest.mark.parametrize(("every", "missing"), [(8, 3), (16, 5)])
@pytest.mark.parametrize("name", ["004.png", "019.png"])
def test_stretches_that_come_and_go_stay_within_their_track(shared_data: Path, name: str, every: int, missing: int):
    mask = cv2.imread(str(shared_data / "masks" / name), cv2.IMREAD_GRAYSCALE)
    cut = striped(mask, every, missing)
    pipeline = Pipeline()
    for shown in (mask, mask, cut, cut, cut, *[cut] * 8, mask, mask):
        check(pipeline.process(Frame(mask=shown)).tracks)


def test_a_part_that_goes_on_beyond_its_track_shows_all_of_it():
    (observation,) = make_observations([LINKED])
    match = PartialMatch(observation.between(0.5, 0.9), (-0.5, 1.5), (0.5, 0.9)).clip_to_track()
    assert match.track_span == WHOLE
    assert match.curve_span == pytest.approx((0.6, 0.8))
    assert PartialMatch(observation, (0.25, 1.0), WHOLE).clip_to_track() == PartialMatch(
        observation, (0.25, 1.0), WHOLE
    )
    assert gaps_on_track(match) == [(pytest.approx(0.0, abs=1e-9), pytest.approx(0.1))]


@given(st.tuples(SHARES, SHARES, SHARES, SHARES), st.lists(SHARES, min_size=2, max_size=2, unique=True))
def test_rounding_leads_nowhere_beyond_the_ends(shares, of):
    low, high = sorted(shares[:2])
    (observation,) = make_observations([LINKED])
    match = PartialMatch(
        observation._replace(gaps=(tuple(sorted(shares[2:])), (0.0, 1.0))), (low, high), tuple(sorted(of))
    )
    assert all(0.0 <= a <= b <= 1.0 for a, b in gaps_on_track(match))


def test_a_whole_detection_has_its_own_gaps_either_way():
    (track,) = Tracker().update([LINKED])
    assert track.inferred == LINKED.inferred
    np.testing.assert_allclose(track.inferred, LINKED.curve.u_at(GAPS), atol=1e-12)
    (observation,) = make_observations([LINKED])
    assert observation.reversed().gaps == LINKED.reversed().centerline.gaps


def test_a_part_beyond_one_end_of_a_track_that_leaves_at_the_other_lies_within_it():
    (observation,) = make_observations([LINKED])
    model = TrackModel.from_observation(1, observation)
    at_border = observation._replace(points=observation.points + np.array([0.0, 500.0]))  # its start is
    visible = make_visible_curve(model, [PartialMatch(at_border, (0.2, 1.3), WHOLE)], View((1000, 1000)))
    assert visible.inferred
    assert all(0.0 <= edge <= 1.0 for span in visible.inferred for edge in span)
