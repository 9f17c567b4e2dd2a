"""Regions of interest as users write them."""

from __future__ import annotations

import numpy as np
import pytest

from dloftbs import Config
from dloftbs.config import RegionConfig, read_roi
from dloftbs.errors import ConfigError

TRIANGLE = ((1, 2), (30, 4), (5, 60))


@pytest.mark.parametrize(
    "given", ["1,2,30,40", (1, 2, 30, 40), [1, 2, 30.0, 40], np.array([1, 2, 30, 40]), (np.int64(1), 2, 30, 40)]
)
def test_a_rectangle_is_four_whole_numbers(given):
    assert read_roi(given) == (1, 2, 30, 40)
    assert all(type(side) is int for side in read_roi(given))


@pytest.mark.parametrize(
    "given",
    [
        "1,2:30,4:5,60",
        TRIANGLE,
        np.array(TRIANGLE),
        [[1.2, 1.8], [29.6, 4.3], [5, 60]],
        [*TRIANGLE, TRIANGLE[0]],  # closed, as GeoJSON has it
        [TRIANGLE[0], *TRIANGLE],
    ],
)
def test_a_polygon_is_its_corners_once_each(given):
    assert set(read_roi(given)) == set(TRIANGLE)
    assert len(read_roi(given)) == 3


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ("1,2,3", "X,Y,W,H"),
        ("here", "X,Y,W,H"),
        (5, "polygon"),
        ({}, "polygon"),
        (True, "polygon"),
        (np.zeros((4, 4)), "polygon"),
        ((1, 2, 0, 4), "at least 1 px"),
        ((1, 2, 3, -4), "at least 1 px"),
        ((1.5, 2, 3, 4), "whole pixels"),
        ((1, 2, float("nan"), 4), "finite"),
        ((1, 2, float("inf"), 4), "finite"),
        ([(0, 0), (9, float("nan")), (3, 3)], "finite"),
        ((1, 2, 10**7, 4), "1000000 at most"),
        ((1, 2, True, 4), "finite"),
        ("1,2:3,4", "three different corners"),
        ([(0, 0), (0, 0), (5, 5), (5, 5)], "three different corners"),
        ([], "three different corners"),
        ([(0, 0), (10, 10), (10, 0), (0, 10)], "cross or overlap"),
        ([(0, 0), (10, 0), (5, 0)], "cross or overlap"),  # no area
        ([(0, 0), (10, 0), (10, 10), (5, 10), (5, 15), (5, 10), (0, 10)], "cross or overlap"),  # there and back
        ([(0, 0), (10, 0), (10, 10), (5, 0), (0, 10)], "cross or overlap"),  # a corner on an edge
        ([(0, 0), (5, 5), (10, 0), (10, 10), (5, 5), (0, 10)], "cross or overlap"),  # a corner twice
        ([(n, n * n // 10) for n in range(2000)], "1000 corners at most"),
    ],
)
def test_anything_else_is_refused(given, said):
    with pytest.raises(ConfigError, match=said):
        read_roi(given)


def test_edges_may_go_straight_on():
    assert len(read_roi([(0, 0), (5, 0), (10, 0), (10, 10)])) == 4


@pytest.mark.parametrize("roi", ["1,2,30,40", TRIANGLE, None])
def test_it_goes_through_yaml_and_plain_values(roi):
    config = Config().with_roi(roi)
    assert config.region == RegionConfig(roi=roi)
    assert Config.from_yaml(config.to_yaml()) == config
    assert Config.from_yaml(config.explain()) == config
    assert Config.from_dict(config.to_dict()) == config
    assert config.replace({"region.roi": None}) == Config()


def test_yaml_says_where_it_is_wrong():
    with pytest.raises(ConfigError, match=r"at least 1 px.*\$\.region"):
        Config.from_yaml("region: {roi: [1, 2, 0, 4]}")
    assert Config.from_yaml("region: {roi: '1,2,30,40'}").region.roi == (1, 2, 30, 40)
