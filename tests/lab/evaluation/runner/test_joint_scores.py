from dataclasses import replace

import numpy as np
import pytest
from builders import curve_through, loop
from hypothesis import given
from hypothesis import strategies as st
from lab.evaluation import joint_stubs, runner_stubs
from lab.evaluation.joint_stubs import joined, path
from lab.evaluation.runner_stubs import Bars, method, suite

from dloftbs.data.centerline import Centerline, JointKind
from dloftbs.data.detection import Detection
from dloftbs_lab.evaluation.runner.finished_parts import JointRow
from dloftbs_lab.evaluation.runner.joint_scores import judge_joints
from dloftbs_lab.evaluation.runner.run import evaluate
from dloftbs_lab.truth import Truth

SIZE = (200, 300)
ACROSS = curve_through(path((20, 100), (280, 100)))
DOWN = curve_through(path((150, 10), (150, 190)))
# A cable that comes from the left, goes once round above (150, 100), and leaves to the right.
TURN = np.linspace(0.0, 2.0 * np.pi, 200)
ROUND = np.column_stack((150.0 + 30.0 * np.sin(TURN), 70.0 + 30.0 * np.cos(TURN)))
LOOP = curve_through(np.concatenate((path((20, 100), (149, 100)), ROUND[:-1], path((150, 100), (280, 100)))))


def verdicts(detection, *curves):
    rows = judge_joints(4, (detection,), Truth(curves, (), tuple(range(len(curves)))), SIZE)
    assert all(row.index == 4 for row in rows)
    return [row.right for row in rows]


LEFT, RIGHT = path((20, 100), (144, 100)), path((156, 100), (280, 100))
BELOW = path((150, 106), (150, 190))
ABOVE = path((150, 94), (150, 10))


@pytest.mark.parametrize(
    ("first", "second", "right"),
    [
        (LEFT, RIGHT, True),
        (ABOVE[::-1], BELOW, True),
        (LEFT, BELOW, False),
        (LEFT, ABOVE, False),
        (LEFT, RIGHT[::-1], False),  # to the far end
        (LEFT, LEFT[::-1] + np.array((0.0, 2.0)), False),  # and back
        (LEFT, path((156, 112), (280, 112)), False),  # beside the cable
    ],
)
def test_at_a_crossing_straight_on_is_right(first, second, right):
    for detection in (joined(first, second), joined(first, second).reversed()):
        assert verdicts(detection, ACROSS, DOWN) == [right]
        assert verdicts(detection, DOWN, ACROSS.reversed()) == [right]


def test_a_gap_is_measured_from_segment_to_segment():
    """Its own span ends where the mask does, and that may be much nearer."""
    found = joined(LEFT[:-30], RIGHT[30:], kind=JointKind.GAP)
    (gap,) = found.joints
    middle = 0.5 * sum(gap.u)
    line = Centerline(found.centerline.segments, (replace(gap, u=(middle - 0.001, middle + 0.001)),))
    for detection in (Detection(line, found.curve), Detection(line, found.curve).reversed()):
        assert verdicts(detection, ACROSS, DOWN) == [True]


def test_an_oblique_crossing_is_not_taken_for_its_neighbour():
    flat = np.array([[20.0, 110.0], [280.0, 90.0]])
    other = curve_through(path(*flat))
    # At 9 degrees two cables of 6 px are one over 19 px to either side.
    tail = path(*flat)[175:]
    assert verdicts(joined(LEFT[:95], RIGHT[35:]), ACROSS, other) == [True]
    assert verdicts(joined(LEFT[:95], tail), ACROSS, other) == [False]


@pytest.mark.parametrize(("gap_px", "right"), [(20, True), (80, True)])
def test_a_gap_may_be_long(gap_px, right):
    detection = joined(path((20, 100), (100, 100)), path((100 + gap_px, 100), (280, 100)), kind=JointKind.GAP)
    assert verdicts(detection, ACROSS) == [right]


def test_a_joint_that_skips_a_loop_is_wrong_and_one_that_enters_it_is_right():
    before, after = path((20, 100), (130, 100)), path((170, 100), (280, 100))
    assert verdicts(joined(before, after), LOOP) == [False]
    inside = ROUND[25:-25]
    assert verdicts(joined(before, inside, after), LOOP) == [True, True]
    assert verdicts(joined(before, inside[::-1], after), LOOP) == [False, False]
    assert verdicts(joined(before, after), ACROSS) == [True]


def test_short_segments_have_no_direction_and_still_a_place():
    detection = joined(LEFT, np.array([[148.0, 100.0], [149.0, 101.0]]), RIGHT)
    assert verdicts(detection, ACROSS, DOWN) == [True, True]
    detection = joined(LEFT, np.array([[148.0, 150.0], [149.0, 150.0]]), RIGHT)
    assert verdicts(detection, ACROSS) == [False, False]


def test_around_the_seam_of_a_closed_curve():
    ring = loop(60.0, (150.0, 100.0))
    angle = np.linspace(0.2, 2.0 * np.pi - 0.2, 300)
    points = np.column_stack((150.0 + 60.0 * np.cos(angle), 100.0 + 60.0 * np.sin(angle)))
    # From the lower half across the seam, at angle 0, to the upper half.
    assert verdicts(joined(points[150:], points[:150]), ring) == [True]
    assert verdicts(joined(points[:150], points[::-1][:150]), ring) == [False]


def transposed(detection):
    return joined(*(segment.points[:, ::-1] for segment in detection.centerline.segments))


@given(st.integers(0, 10_000))
def test_transposed_and_reversed_the_verdict_is_the_same(seed):
    rng = np.random.default_rng(seed)
    pieces = [LEFT, RIGHT, ABOVE, BELOW]
    first, second = (pieces[i] for i in rng.choice(4, 2, replace=False))
    first, second = (piece[:: rng.choice((-1, 1))] + rng.normal(0.0, 2.0, 2) for piece in (first, second))
    detection = joined(first, second)
    flipped = [curve_through(curve.sample(300)[:, ::-1]) for curve in (ACROSS, DOWN)]
    verdict = verdicts(detection, ACROSS, DOWN)
    assert verdicts(transposed(detection), *flipped) == verdict
    assert verdicts(detection.reversed(), ACROSS, DOWN) == verdict


def test_nothing_is_judged_where_no_curve_is_known():
    mask = np.zeros(SIZE, bool)
    mask[95:105] = True
    detection = joined(LEFT, RIGHT)
    assert judge_joints(0, (detection,), Truth((), (mask,), (0,)), SIZE) == []
    assert judge_joints(0, (Detection(detection.centerline, detection.curve),), Truth((ACROSS,), (), (0,)), SIZE)


def test_the_joints_of_a_run_survive_a_resume(tmp_path):
    methods = [method(joint_stubs.cut_bars), method(runner_stubs.perfect)]
    first = evaluate([suite(Bars(length=2))], methods, tmp_path)
    assert first[0].joints == tuple(
        JointRow(index, kind, confidence, right, "bars")
        for index in range(2)
        for kind, confidence, right in ((JointKind.GAP, 0.9, True), (JointKind.CROSSING, 0.2, False))
    )
    assert first[1].joints == ()
    assert evaluate([suite(Bars(length=2))], methods, tmp_path) == first
