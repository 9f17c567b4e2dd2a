"""How many objects there are, and how long an object is at least: the same for both methods."""

from __future__ import annotations

import numpy as np
import pytest
from linking_examples import draw

from dloftbs import Config, Frame, Pipeline
from dloftbs.config import GreedyLinkingConfig

TWO, SPECK = ([(20, 60), (380, 70)], [(30, 180), (330, 190)]), [(200, 120), (216, 121)]


@pytest.mark.parametrize("config", [Config(), Config.paper()], ids=["default", "paper"])
def test_of_more_than_there_are_the_longest_are_kept_and_the_rest_is_reported(config: Config) -> None:
    frame = Frame(mask=draw(*TWO, SPECK))
    assert len(Pipeline(config).detect(frame).detections) == 3
    published = isinstance(config.linking, GreedyLinkingConfig)
    for objects in range(1 if published else 2, 5):  # told one, the default joins long pieces
        result = Pipeline(config.replace({"linking.objects": objects})).detect(frame)
        assert len(result.detections) == min(objects, 3)
        assert len(result.dropped) == 3 - len(result.detections)
        assert min(d.curve.length for d in result.detections) > 250 or objects > 2
        assert all(joint.kind.value != "gap" for d in result.detections for joint in d.joints)
        assert len(result.to_dict()["dropped"]) == len(result.dropped)


def test_what_is_dropped_says_of_itself_what_a_detection_says() -> None:
    frame = Frame(mask=draw([(20, 60), (380, 60)], [(200, 30), (200, 120)]))
    detection = min(Pipeline().detect(frame).detections, key=lambda one: one.curve.length).to_dict()
    dropped = Pipeline(Config().replace({"linking.objects": 1})).detect(frame).to_dict()["dropped"][0]
    assert detection["joints"]
    assert (dropped["width_px"], dropped["confidence"]) == (detection["width_px"], detection["confidence"])
    assert dropped["closed"] is detection["curve"]["closed"] is False
    ends = sorted([dropped["start"], dropped["end"]], key=lambda point: point[1])
    np.testing.assert_allclose(ends, [[200, 30], [200, 120]], atol=4.0)


@pytest.mark.parametrize("config", [Config(), Config.paper()], ids=["default", "paper"])
def test_what_is_too_short_is_no_object(config: Config) -> None:
    frame = Frame(mask=draw(*TWO, SPECK))
    for change in ({"linking.min_length_px": 40}, {"linking.min_length_widths": 5.0}):
        result = Pipeline(config.replace(change)).detect(frame)
        assert len(result.detections) == 2
        assert result.dropped == ()
    nothing = Pipeline(config.replace({"linking.min_length_widths": 100.0})).detect(frame)
    assert nothing.detections == ()
    assert "min_length" in str(nothing.reason)


def test_a_blob_is_no_object() -> None:
    result = Pipeline().detect(Frame(mask=draw([(200, 120), (203, 120)], width=20)))
    assert result.detections == result.dropped == ()
    assert len(Pipeline().detect(Frame(mask=draw([(180, 120), (240, 120)], width=20))).detections) == 1


def test_the_published_method_for_one_cable_joins_all_segments() -> None:
    mask = draw([(20, 60), (120, 60)], [(180, 150), (260, 60)], [(300, 200), (380, 200)])
    one = Pipeline(Config.paper(objects=1)).detect(Frame(mask=mask))
    assert len(one.detections) == 1
    assert len(one.detections[0].joints) == 2
    assert len(Pipeline(Config.paper()).detect(Frame(mask=mask)).detections) == 3


def test_the_published_form_depends_on_the_number() -> None:
    thresholds = [config.linking for config in (Config.paper(), Config.paper(objects=1), Config.paper(objects=3))]
    assert all(isinstance(linking, GreedyLinkingConfig) for linking in thresholds)
    assert [(linking.objects, linking.max_cost) for linking in thresholds] == [(None, 2.0), (1, None), (3, 2.0)]


def test_a_far_piece_is_dropped_rather_than_joined() -> None:
    mask = draw(TWO[0])
    mask[150:157, 30:90] = 1
    result = Pipeline(Config().replace({"linking.objects": 1})).detect(Frame(mask=mask))
    assert len(result.detections) == len(result.dropped) == 1
    assert result.detections[0].joints == ()
    assert np.ptp(result.dropped[0].centerline.points[:, 0]) > 50
