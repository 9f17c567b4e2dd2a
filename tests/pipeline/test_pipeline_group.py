"""Several pipelines on one stream: ids that tell them apart, and crossings across pipelines."""

from __future__ import annotations

import numpy as np
import pytest
from drawings import draw_cable

from dloftbs import Config, Frame, HsvRange
from dloftbs.config import SegmentationConfig
from dloftbs.errors import InputError
from dloftbs.pipeline import Pipeline
from dloftbs.pipeline.group import PipelineGroup

SIZE = (120, 200)
RED, BLUE = (30, 20, 210), (210, 20, 30)
CONFIGS = [
    Config(segmentation=SegmentationConfig(hsv=(HsvRange.parse(hue),))) for hue in ("170:10,80:255", "100:130,80:255")
]


def frame(*, red: bool = True, blue: bool = True, index: int = 0) -> Frame:
    """Return a picture of a blue cable that lies across a red one."""
    image = np.full((*SIZE, 3), 90, np.uint8)
    if red:
        image[draw_cable(np.array([(20.0, 60.0), (180.0, 60.0)]), 7, SIZE) != 0] = RED
    if blue:
        image[draw_cable(np.array([(100.0, 10.0), (100.0, 110.0)]), 7, SIZE) != 0] = BLUE
    return Frame(image=image, index=index, name="a.png")


def test_objects_come_in_the_order_of_the_pipelines():
    result = PipelineGroup(CONFIGS).process(frame(index=3))
    alone = [Pipeline(config).process(frame()).detections[0].curve for config in CONFIGS]
    assert [detection.curve for detection in result.detections] == alone
    assert (result.index, result.name, result.size, result.reason) == (3, "a.png", SIZE, None)


def test_objects_of_two_pipelines_cross():
    (crossing,) = PipelineGroup(CONFIGS).process(frame()).crossings
    np.testing.assert_allclose(crossing.position, (100.0, 60.0), atol=1.0)
    assert [detection for detection, _ in crossing.passes] == [0, 1]


def test_ids_tell_pipelines_apart_and_stay():
    group = PipelineGroup(CONFIGS)
    for index in range(3):
        result = group.process(frame(index=index))
    assert [track.id for track in result.tracks] == [1, 2]


def test_an_object_keeps_its_id_whatever_the_other_pipeline_sees():
    group = PipelineGroup(CONFIGS)
    assert [track.id for track in group.process(frame(red=False)).tracks] == [2]
    assert 2 in [track.id for track in group.process(frame(index=1)).tracks]


def test_times_add_up():
    result = PipelineGroup(CONFIGS).process(frame())
    assert set(result.stage_ms) == set(Pipeline(CONFIGS[0]).process(frame()).stage_ms)


def test_each_pipeline_says_why_it_found_nothing():
    assert PipelineGroup(CONFIGS).process(frame(red=False)).reason is None
    nothing = PipelineGroup(CONFIGS).process(frame(red=False, blue=False))
    assert str(nothing.reason).count("the mask is empty: the segmentation finds no cable in the image") == 2
    assert (nothing.detections, nothing.tracks, nothing.crossings) == ((), (), ())


def test_objects_beyond_the_known_number_are_reported_for_all_pipelines():
    configs = [config.replace({"linking.objects": 1}) for config in CONFIGS]
    picture = frame().image.copy()
    picture[20:27, 130:180] = RED
    result = PipelineGroup(configs).process(Frame(image=picture))
    assert (len(result.detections), len(result.dropped)) == (2, 1)


def test_a_pipeline_that_only_has_hidden_tracks_says_why():
    group = PipelineGroup(CONFIGS)
    for index in range(4):
        group.process(frame(index=index))
    result = group.process(frame(red=False, index=4))
    assert [(track.id, track.state.value) for track in result.tracks] == [(1, "hidden"), (2, "confirmed")]
    assert "the segmentation has failed" in str(result.reason)


def test_a_mask_that_is_the_same_for_all_is_refused():
    with pytest.raises(InputError, match="the same for all: leave it out"):
        PipelineGroup(CONFIGS).process(Frame(image=frame().image, mask=np.ones(SIZE, bool)))


def test_what_makes_no_group_or_is_no_frame_is_refused():
    with pytest.raises(InputError, match="at least one, got none"):
        PipelineGroup([])
    with pytest.raises(InputError, match="frame must be a Frame, got array"):
        PipelineGroup(CONFIGS).process(frame().image)


def test_configurations_are_taken_as_a_pipeline_takes_them():
    group = PipelineGroup([config.to_dict() for config in CONFIGS])
    assert [track.id for track in group.process(frame()).tracks] == [1, 2]


def test_after_a_reset_tracks_are_new():
    group = PipelineGroup(CONFIGS)
    group.process(frame())
    group.reset()
    assert [track.id for track in group.process(frame(index=1)).tracks] == [3, 4]
