"""Which tracks and detections are compared at all, and that to compare them changes nothing."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
from builders import bent, detection_of, line, loop, part, wave
from tracked_curves import level

from dloftbs.config import TrackingConfig
from dloftbs.data.centerline import Joint, JointKind
from dloftbs.data.curve_samples import SAMPLES
from dloftbs.data.tracks import EndKind
from dloftbs.evidence import OcclusionEvidence
from dloftbs.tracking import Tracker
from dloftbs.tracking.alignment import place_part
from dloftbs.tracking.association import associate
from dloftbs.tracking.frame_view import View
from dloftbs.tracking.kernels import alignment as kernels
from dloftbs.tracking.observation import make_observations
from dloftbs.tracking.partial_match import WHOLE
from dloftbs.tracking.track_model import TrackModel

GATE = TrackingConfig().gate
FRAMES, CLEAR_NATS = 5, 5.0
"""Frames that read clearly, and the log-odds by which they do."""


def rows(count: int, shift: float) -> list:
    """Return small loops, which are assigned as a whole, in a square, far from each other."""
    side = int(np.sqrt(count))
    places = [(60.0 * x + shift, 60.0 * y) for x in range(side) for y in range(side)]
    return [loop(10.0, place) for place in places]


@pytest.mark.parametrize("count", [16, 64])
def test_an_object_is_compared_with_those_beside_it_alone(monkeypatch, count):
    measured = []
    align_all = kernels.align_all

    def counted(*given):
        found = align_all(*given)
        measured.append(np.count_nonzero(np.isfinite(found[0])))
        return found

    monkeypatch.setattr(kernels, "align_all", counted)
    tracker = Tracker()
    for number in range(6):  # to and fro by too much to be taken without doubt
        tracks = tracker.update(rows(count, 1.0 * (number % 2)))
    assert [track.id for track in tracks] == list(range(1, count + 1))
    assert measured
    assert max(measured) <= 2 * count


@pytest.mark.parametrize(
    "seen",
    [
        [wave((2.0, 1.0)), level(400.0)],  # unambiguous
        [part(wave(), 0.0, 0.4), part(wave(), 0.6, 1.0).reversed(), level(400.0)],  # routed
        [wave((30.0, 20.0))],  # farther than a hand moves, and one missing
        [],
    ],
)
def test_to_associate_changes_no_track(seen):
    models = []
    for number, curve in enumerate((wave(), level(400.0)), start=1):
        (one,) = make_observations([detection_of(curve)])
        models.append(TrackModel.from_observation(number, one))
        for _ in range(10):
            models[-1].update_whole(one)
            models[-1].count_hit(1)
    before, view = pickle.dumps(models), View((600, 900))
    observations = make_observations([detection_of(curve) for curve in seen])
    shown = associate(models, observations, view, GATE)[0].shown
    assert pickle.dumps(models) == before
    assert len(shown) == 2
    assert any(one.matches for one in shown) == bool(seen)


@pytest.mark.parametrize("bridged", [(), (Joint(JointKind.GAP, (0.4, 0.5), 1.0, 1.0),)])
def test_tracks_that_exchanged_ends_do_so_no_more_where_frames_read_clearly(bridged):
    """Two cables pass each other at a small angle; each was seen from end to end, and as long as ever, for a while."""
    first, second = bent((0.0, 0.0), (250.0, 0.0), (400.0, 0.0)), bent((50.0, -260.0), (250.0, 0.0), (440.0, 40.0))
    seen = [detection_of(first), detection_of(second)]
    models = []
    for number, one in enumerate(make_observations(seen), start=1):
        models.append(TrackModel.from_observation(number, one))
        for _ in range(10):
            models[-1].update_whole(one)
            models[-1].count_hit(1)
    swapped = bent((0.0, 0.0), (250.0, 0.0), (440.0, 40.0)), bent((50.0, -260.0), (250.0, 0.0), (400.0, 0.0))
    for model, one in zip(models, swapped, strict=True):
        model.predicted = one.sample(SAMPLES)
        for _ in range(FRAMES):
            model.belief.add(-CLEAR_NATS)
    seen = [detection_of(one.curve, radius=5.0, joints=bridged) for one in seen]
    for order in (1, -1):
        observations = make_observations(seen[::order])
        shown = associate(models, observations, View((600, 900)), GATE)[0].shown
        assert [[match.track_span for match in one.matches] for one in shown] == [[WHOLE]] * 2
        assert [one.matches[0].observation.detection for one in shown] == seen


@pytest.mark.parametrize("kind", EndKind)
def test_two_tracks_of_one_detection_are_two_if_the_ends_where_they_meet_were_seen_apart(kind):
    models = []
    for number, curve in enumerate((line((0.0, 100.0), (300.0, 100.0)), line((340.0, 100.0), (500.0, 100.0))), start=1):
        (one,) = make_observations([detection_of(curve)])
        models.append(TrackModel.from_observation(number, one))
        for _ in range(10):
            models[-1].update_whole(one)
            models[-1].count_hit(1)
            models[-1].record((EndKind.BORDER, kind) if number == 1 else (EndKind.FREE, EndKind.HIDDEN))
    came = line((0.0, 100.0), (300.0, 100.0)), line((305.0, 100.0), (465.0, 100.0))
    for model, one in zip(models, came, strict=True):
        model.predicted = one.sample(SAMPLES)
    seen = make_observations([detection_of(line((0.0, 100.0), (465.0, 100.0)))])
    shown = associate(models, seen, View((600, 900)), GATE)[0].shown
    assert [one.apart_from for one in shown] == ([{2}, {1}] if kind is EndKind.FREE else [set(), set()])


@pytest.mark.parametrize("end", [0, 1])
def test_what_is_missing_of_a_part_lies_beyond_the_end_that_something_hides(end):
    cable = line((100.0, 100.0), (700.0, 100.0))
    (whole,) = make_observations([detection_of(cable, radius=6.0)])
    model = TrackModel.from_observation(1, whole)
    (seen,) = make_observations([detection_of(part(cable, *((0.4, 1.0) if end == 0 else (0.0, 0.6))), radius=6.0)])
    occluders = np.zeros((200, 800), dtype=np.uint8)
    occluders[:, slice(200, 345) if end == 0 else slice(455, 600)] = 1
    view = View((200, 800), OcclusionEvidence(occluders=occluders))
    start_px = 200.0 if end == 0 else 40.0  # the motion so far puts it 40 px from where it is
    assert place_part(model, seen, start_px, view).track_span == pytest.approx((0.4, 1.0) if end == 0 else (0.0, 0.6))
