"""Pieces of cables: no centre line jumps within a segment."""

from __future__ import annotations

import numpy as np
import pytest
from fuzz.families import FAMILIES

import dloftbs
from dloftbs.linking.cable_pieces import Piece, Points, fill_junctions


class Branches:
    def __init__(self, points, radius):
        self.points, self.radius = np.array(points, float), np.array(radius, float)


def filled(points, radius, spans, *, closed=False):
    """Return the points of a piece after its junctions were filled."""
    buffer, piece = Points(Branches(points, radius)), Piece(list(spans), -1, 0.0, np.inf)
    fill_junctions(piece, buffer, closed=closed)
    every, _ = buffer.all()
    return np.concatenate([every[np.arange(*span)] for span in piece.spans])


def test_a_junction_is_filled_with_points_a_pixel_apart():
    points = filled([(0, 0), (1, 0), (8, 0), (9, 0)], [2.0] * 4, [(0, 2, 1), (2, 4, 1)])
    np.testing.assert_allclose(points, [(x, 0) for x in range(10)])


def test_a_branch_run_backwards_is_reached_at_its_last_point():
    points = filled([(0, 0), (1, 0), (9, 0), (8, 0)], [2.0] * 4, [(0, 2, 1), (3, 1, -1)])
    np.testing.assert_allclose(points, [(x, 0) for x in range(10)])


@pytest.mark.parametrize(("radius", "count"), [(3.4, 10), (3.6, 4)])
def test_a_junction_no_wider_than_the_cable_stays(radius, count):
    points = [(0, 0), (1, 0), (8, 0), (9, 0)]
    assert len(filled(points, [radius] * 4, [(0, 2, 1), (2, 4, 1)])) == count


def test_a_loop_is_filled_where_it_closes():
    ring = [(0, 0), (9, 0), (9, 9), (0, 9)]
    assert len(filled(ring, [1.0] * 4, [(k, k + 1, 1) for k in range(4)])) == 4 + 3 * 8
    assert len(filled(ring, [1.0] * 4, [(k, k + 1, 1) for k in range(4)], closed=True)) == 4 + 4 * 8


@pytest.mark.parametrize(
    ("family", "number"),
    [("combs", 6), ("combs", 53), ("fractals", 51), ("bars", 57), ("noise", 24), ("rings", 6), ("labyrinths", 48)],
)
def test_no_centre_line_of_a_dense_mask_jumps(family, number):
    chosen = FAMILIES[family]
    for detection in dloftbs.detect(chosen.case(99, number + len(chosen.fixed))):
        for segment in detection.centerline.segments:
            steps = np.hypot(*np.diff(segment.points, axis=0).T)
            assert steps.max(initial=0.0) <= max(detection.width_px, 2.0)
