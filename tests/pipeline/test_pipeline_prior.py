"""The prior that a stream gives to its frames, and frames that outweigh it."""

from __future__ import annotations

import numpy as np
import pytest
from linking_examples import draw

import dloftbs
from dloftbs import Config, Frame, FrameResult, Pipeline
from dloftbs.data.centerline import JointKind
from dloftbs.data.detection import Detection
from dloftbs.data.tracks import Track

START = [(20, 120), (178, 120)]
LOWER, UPPER = [(205, 129), (380, 160)], [(205, 105), (380, 62)]  # beyond a gap, the lower one continues START better
WITHOUT_GAP, WITH_GAP = draw([*START, *UPPER], LOWER), draw(START, LOWER, UPPER)


def goes_up(result: FrameResult, *, tracked: bool = False) -> bool:
    """Return whether the cable that starts on the left ends at the top right, or else at the bottom right."""
    found = [track.curve for track in result.tracks] if tracked else [d.curve for d in result.detections]
    ends = [sorted(curve(np.array([0.0, 1.0])).tolist()) for curve in found]
    (right,) = [last for first, last in ends if first[0] < 60]
    return right[1] < 90


def seen_length(found: Detection | Track) -> float:
    """Return the length of a curve without what is inferred of it, px."""
    return found.curve.length * (1.0 - sum(high - low for low, high in found.inferred))


def process(pipeline: Pipeline, masks: list[np.ndarray]) -> list[FrameResult]:
    return [pipeline.process(Frame(mask=mask, index=k, stamp=k / 30)) for k, mask in enumerate(masks)]


def test_alone_the_frame_is_read_the_other_way() -> None:
    assert not goes_up(Pipeline().detect(Frame(mask=WITH_GAP)))
    assert goes_up(Pipeline().detect(Frame(mask=WITHOUT_GAP)))


def test_an_ambiguous_gap_is_read_as_the_frames_before() -> None:
    """By the track: this frame alone speaks against the gap, so that its detections leave it open."""
    last = process(Pipeline(), [WITHOUT_GAP] * 5 + [WITH_GAP])[-1]
    assert goes_up(last, tracked=True)
    assert not any(joint.kind is JointKind.GAP for one in last.detections for joint in one.joints)
    assert len(last.detections) == len(last.tracks) + 1


def test_after_ten_frames_of_clear_view_a_wrong_past_is_given_up() -> None:
    results = process(Pipeline(), [WITHOUT_GAP] * 5 + [WITH_GAP] * 25)
    assert not any(goes_up(result, tracked=True) for result in results[15:])


@pytest.mark.parametrize("frames", [3, 5, 7, 8, 12])
def test_whatever_the_past_nothing_that_a_frame_shows_is_left_out_for_long(frames: int) -> None:
    """A track on a half of a detection that bridges a gap leaves the other half to nobody."""
    last = process(Pipeline(), [WITHOUT_GAP] * frames + [WITH_GAP] * 20)[-1]
    lengths = [sum(map(seen_length, found)) for found in (last.tracks, last.detections)]
    assert lengths[0] == pytest.approx(lengths[1], rel=0.03)


@pytest.mark.parametrize("config", [Config(), Config.paper()], ids=["default", "paper"])
def test_detecting_and_resetting_leave_no_past(config: Config) -> None:
    pipeline = Pipeline(config)
    process(pipeline, [WITHOUT_GAP] * 5)
    fresh = Pipeline(config).detect(Frame(mask=WITH_GAP))
    assert fresh.detections
    for result in (pipeline.detect(Frame(mask=WITH_GAP)), dloftbs.detect(WITH_GAP, config=config)):
        detections = result.detections if isinstance(result, FrameResult) else result
        for one, other in zip(detections, fresh.detections, strict=True):
            np.testing.assert_array_equal(one.curve.control_points, other.curve.control_points)
    pipeline.reset()
    (again,) = process(pipeline, [WITH_GAP])
    assert goes_up(again) == goes_up(fresh)


def test_the_published_method_does_without_a_past() -> None:
    alone = Pipeline(Config.paper()).detect(Frame(mask=WITH_GAP))
    assert alone.detections
    last = process(Pipeline(Config.paper()), [WITHOUT_GAP] * 5 + [WITH_GAP])[-1]
    for one, other in zip(last.detections, alone.detections, strict=True):
        np.testing.assert_array_equal(one.curve.control_points, other.curve.control_points)
