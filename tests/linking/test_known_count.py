"""A number of cables that is known."""

from __future__ import annotations

import numpy as np
import pytest
from linking_examples import circle, detect, draw, matching_of

import dloftbs
from dloftbs.linking.known_count import merge_to_count

# Gaps of thirteen widths: round ends nearly bridge them.
DASHES = [[(10, 100), (60, 102)], [(158, 106), (225, 109)], [(323, 113), (395, 116)]]
LONG = [(20, 60), (380, 66)]


@pytest.mark.parametrize("objects", [1, 2, 3, 7])
def test_pieces_are_joined_until_there_are_so_many(objects: int) -> None:
    _, graph, matching = matching_of(draw(*DASHES))
    assert len(matching.chains()) == 3
    merge_to_count(graph, matching, objects)
    assert len(matching.chains()) == min(objects, 3)
    assert all(matching.partner[j] == i for i, j in enumerate(matching.partner) if j >= 0)
    joints = [i for i, j in enumerate(matching.partner) if j >= 0]
    assert len(joints) == 2 * (3 - min(objects, 3))
    assert all(matching.cost[i] > 0.0 and matching.margin[i] == 0.0 and matching.alternative[i] == -1 for i in joints)


def test_two_cables_are_not_joined_to_make_room_for_a_speck() -> None:
    _, graph, matching = matching_of(draw(*DASHES[:2], [(300, 200), (312, 203)]))
    before = list(matching.partner)
    merge_to_count(graph, matching, 2)
    assert matching.partner == before


def test_of_one_cable_all_that_is_long_is_joined_however_it_turns() -> None:
    turns_back = draw([(150, 60), (380, 66)], [(150, 180), (380, 174)])
    assert len(detect(turns_back)) == 2
    (found,) = detect(turns_back, objects=1)
    assert [joint.kind.value for joint in found.joints] == ["gap"]
    first, second = found.centerline.segments
    assert abs(first.points[-1, 0] - second.points[0, 0]) < 10.0


def test_a_short_piece_off_every_cable_is_dropped_and_reported() -> None:
    result = dloftbs.detect(draw(LONG, [(150, 160), (190, 160)]), objects=1)
    assert [len(found.joints) for found in result] == [0]
    assert len(result.dropped) == 1


def test_a_gap_longer_than_the_longest_is_bridged_where_the_number_asks_for_it() -> None:
    mask = draw([(10, 100), (130, 102)], [(330, 106), (395, 107)])
    assert len(detect(mask)) == len(detect(mask, objects=2)) == 2
    assert len(detect(mask, objects=1)) == 1


def test_an_end_at_the_border_is_joined_with_another_one_there_alone() -> None:
    (found,) = detect(draw([(60, 260), (60, 60)], [(120, 260), (120, 60)]), objects=1)
    before, after = found.centerline.segments
    assert min(before.points[-1, 1], after.points[0, 1]) > 230


def test_loops_count_and_stay_closed() -> None:
    mask = draw(circle((100, 120), 70), [(220, 60), (390, 60)], [(220, 180), (390, 180)])
    found = detect(mask, objects=2)
    assert sorted(one.curve.closed for one in found) == [False, True]
    (found,) = detect(mask, objects=1)
    assert found.curve.closed


def test_of_rings_alone_the_longest_are_kept() -> None:
    mask = draw(circle((100, 120), 70), circle((300, 120), 50))
    (found,) = detect(mask, objects=1)
    assert found.curve.closed
    assert found.curve.length == pytest.approx(2 * np.pi * 70, rel=0.02)


def test_ground_in_sight_between_two_ends_counts() -> None:
    """Of two gaps alike the one is bridged whose ground is hidden."""
    mask = draw(LONG, [(20, 180), (380, 186)])
    mask[:, 150:250] = 0
    image = np.full((*mask.shape, 3), 90, dtype=np.uint8)
    image[mask != 0] = 200
    image[120:, 148:252] = (20, 160, 30)
    found = dloftbs.detect(mask, image=image, objects=3)
    assert sorted(len(one.joints) for one in found) == [0, 0, 1]
    (joined,) = (one for one in found if one.joints)
    assert joined.curve.start[1] > 150
