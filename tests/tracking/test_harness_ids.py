"""Ids of harnesses and branch points through a stream."""

from __future__ import annotations

import cv2
import numpy as np

from dloftbs import Config, FrameResult, Pipeline


def stream(count: int) -> list[FrameResult]:
    pipeline = Pipeline(branched=True)
    results = []
    for k in range(count):
        mask = np.zeros((480, 640), np.uint8)
        shift = 4 * k
        for start, stop in (((40, 240), (600, 240)), ((200, 240), (300, 60)), ((400, 240), (500, 420))):
            cv2.line(mask, (start[0], start[1] + shift), (stop[0], stop[1] + shift), (255,), 12)
        results.append(pipeline.process(mask))
    return results


def test_harness_branch_points_and_branches_keep_their_ids_while_they_move() -> None:
    results = stream(8)
    for result in results:
        assert [harness.id for harness in result.harnesses] == [1]
        assert sorted(track.id for track in result.tracks) == [1, 2, 3, 4, 5]
        left, right = sorted(result.branch_points, key=lambda point: point.position[0])
        assert sorted(point.position[0] for point in result.branch_points)[0] < 230
        assert (left.id, right.id) == tuple(
            point.id for point in sorted(results[0].branch_points, key=lambda point: point.position[0])
        )
        assert {left.id, right.id} == {1, 2}


def test_after_a_reset_ids_are_new() -> None:
    pipeline = Pipeline(branched=True)
    mask = np.zeros((200, 300), np.uint8)
    cv2.line(mask, (20, 100), (280, 100), (255,), 8)
    first = pipeline.process(mask).harnesses[0].id
    pipeline.reset()
    again = pipeline.process(mask).harnesses[0].id
    assert (first, again) == (1, 2)


def test_on_frames_of_another_size_branch_points_are_others() -> None:
    pipeline = Pipeline(branched=True)
    ids = []
    for size in ((200, 300), (220, 320)):
        mask = np.zeros(size, np.uint8)
        cv2.line(mask, (20, 100), (280, 100), (255,), 8)
        cv2.line(mask, (150, 100), (200, 20), (255,), 8)
        ids.append([point.id for point in pipeline.process(mask).branch_points])
    assert ids == [[1], [2]]


def test_a_branch_point_whose_tracks_have_ended_gives_its_id_to_no_other() -> None:
    pipeline = Pipeline(Config().replace({"linking.branched": True, "tracking.keep_lost_s": 0.1}))
    mask = np.zeros((240, 320), np.uint8)
    for stop in ((40, 40), (280, 40), (160, 220)):
        cv2.line(mask, (160, 120), stop, (255,), 8)
    first, *_, last = [pipeline.process(one) for one in (mask, *[np.zeros_like(mask)] * 10, mask)]
    assert not {track.id for track in first.tracks} & {track.id for track in last.tracks}
    assert [point.id for point in first.branch_points + last.branch_points] == [1, 2]
    assert [harness.id for harness in first.harnesses + last.harnesses] == [1, 2]
    assert pipeline._harness_ids._points.keys() == {2}
    assert len(pipeline._harness_ids._harness_of) == 3
