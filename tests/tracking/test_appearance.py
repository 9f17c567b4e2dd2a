"""Colours of objects: what keeps the ids of a harness whose cables change places."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from builders import detection_of
from tracked_curves import ids, level, line

from dloftbs.data.centerline import Joint, JointKind
from dloftbs.data.frame import Frame
from dloftbs.errors import InputError
from dloftbs.evidence import OcclusionEvidence
from dloftbs.pipeline import Pipeline
from dloftbs.tracking import Tracker
from dloftbs.tracking.appearance import objects_differ, with_appearances
from dloftbs.tracking.observation import make_observations
from dloftbs.tracking.track_model import TrackModel

SIZE = (300, 520)
RED, BLUE, GREY, WHITE, BLACK = (40, 40, 200), (200, 60, 30), (120, 120, 120), (240, 240, 240), (25, 25, 25)


def painted(*cables: tuple[float, tuple[int, int, int]], light: float = 1.0) -> np.ndarray:
    """Return an image of straight cables at some heights, each of a colour (BGR)."""
    image = np.full((*SIZE, 3), 90, np.uint8)
    for y, colour in cables:
        cv2.line(image, (0, round(y)), (500, round(y)), colour, 7)
    return np.rint(light * image).astype(np.uint8)


def see(tracker: Tracker, *cables: tuple[float, tuple[int, int, int]], with_image: bool = True, light: float = 1.0):
    occlusion = OcclusionEvidence(image=painted(*cables, light=light)) if with_image else None
    return tracker.update([detection_of(level(y)) for y, _ in cables], size=SIZE, occlusion=occlusion)


def heights(tracks) -> dict[int, int]:
    return {track.id: round(float(track.curve(0.5)[1])) for track in tracks}


class TestIdentity:
    @pytest.mark.parametrize("seen", [2, 12])
    @pytest.mark.parametrize("colours", [(RED, BLUE), (WHITE, BLACK), (RED, GREY)])
    def test_two_that_change_places_keep_their_ids_by_colour(self, seen, colours):
        first, second = colours
        for with_image, expected in ((True, {1: 140, 2: 100}), (False, {1: 100, 2: 140})):
            tracker = Tracker()
            for _ in range(seen):
                see(tracker, (100, first), (140, second), with_image=with_image)
            tracks = see(tracker, (100, second), (140, first), with_image=with_image)
            assert heights(tracks) == expected

    @pytest.mark.parametrize("seen", [2, 12])
    def test_another_one_in_its_place_is_another(self, seen):
        tracker = Tracker()
        for _ in range(seen):
            see(tracker, (100, RED))
        assert ids(see(tracker, (100, BLUE))) == [2]
        assert ids(see(tracker, (100, RED))) == [1]

    @pytest.mark.parametrize("colour", [RED, BLUE, GREY, WHITE, BLACK])
    @pytest.mark.parametrize("light", [0.6, 1.05])
    def test_another_light_changes_no_id(self, colour, light):
        tracker = Tracker()
        for _ in range(5):
            see(tracker, (100, colour))
        assert ids(see(tracker, (102, colour), light=light)) == [1]

    def test_frames_without_an_image_agree_with_any(self):
        tracker = Tracker()
        see(tracker, (100, RED))
        see(tracker, (100, RED), with_image=False)
        assert ids(see(tracker, (101, RED))) == [1]
        assert ids(see(tracker, (101, BLUE))) == [2]

    def test_a_pipeline_takes_them_from_its_frames(self):
        pipeline, first = Pipeline(), None
        for cables in [((100, RED), (140, BLUE))] * 8 + [((100, BLUE), (140, RED))]:
            mask = np.zeros(SIZE, np.uint8)
            for y, _ in cables:
                cv2.line(mask, (0, y), (500, y), 255, 7)
            before = pipeline.process(Frame(image=painted(*cables), mask=mask))
            rows = {track.id: round(float(track.curve(0.5)[1])) for track in before.tracks}
            image = painted(*cables)
            assert len(rows) == 2
            colours = {number: image[row, 200].tolist() for number, row in rows.items()}
            assert colours in ({1: list(RED), 2: list(BLUE)}, {1: list(BLUE), 2: list(RED)})
            first = first or colours
            assert colours == first


@pytest.mark.parametrize(("first", "second"), [((38, 57, 55), (73, 56, 49)), ((78, 58, 46), (41, 56, 77)), (RED, BLUE)])
def test_both_parts_of_a_cable_that_changes_its_colour_are_its_own(first, second):
    """A dark cable takes on some of the ground's colour in coded video, and lamps and sheen tint it in places."""
    image = painted((100, first))
    image[97:104, 200:] = second
    parts = [line((20.0, 100.0), (180.0, 100.0)), line((240.0, 100.0), (480.0, 100.0))]
    observations = make_observations([detection_of(points) for points in (level(100.0), *parts)])
    whole, *seen = with_appearances(observations, OcclusionEvidence(image=image))
    assert objects_differ([TrackModel.from_observation(1, whole)], seen).tolist() == [[False, False]]


def test_colours_are_those_along_the_curves_and_unknown_ones_agree():
    observations = make_observations([detection_of(level(y)) for y in (100.0, 140.0)])
    seen = with_appearances(observations, OcclusionEvidence(image=painted((100, RED), (140, BLUE))))
    np.testing.assert_array_equal([one.appearance.colour for one in seen], [RED, BLUE])
    models = [TrackModel.from_observation(1, one) for one in (*seen, observations[0])]
    assert objects_differ(models, [*seen, observations[1]]).tolist() == [
        [False, True, False],
        [True, False, False],
        [False, False, False],
    ]
    assert with_appearances(observations, None) == observations
    without_image = OcclusionEvidence(occluders=np.zeros((100, 200), np.uint8))
    assert with_appearances(observations, without_image) == observations
    assert with_appearances([], OcclusionEvidence(image=painted())) == []


def test_the_colour_of_what_hides_most_of_a_cable_is_not_its_own():
    image = painted((100, RED))
    image[:, 60:460] = BLUE
    gap = Joint(JointKind.GAP, (0.12, 0.92), 0.1, 2.0)
    bridged = detection_of(level(100.0), joints=(gap,))
    (one,) = with_appearances(make_observations([bridged]), OcclusionEvidence(image=image))
    np.testing.assert_array_equal(one.appearance.colour, RED)


def test_an_image_of_another_size_is_refused():
    with pytest.raises(InputError, match=r"must have the frame's size \(300, 500\), got \(300, 520\)"):
        Tracker().update([], size=(300, 500), occlusion=OcclusionEvidence(image=painted()))
    with pytest.raises(InputError, match="image must have shape"):
        OcclusionEvidence(image=painted()[..., 0])
