import dataclasses

import numpy as np
import pytest
from builders import curve_through
from lab.evaluation import joint_stubs
from lab.evaluation import runner_stubs as stubs
from lab.evaluation.runner_stubs import Bars, method, suite

from dloftbs.camera import PinholeCamera
from dloftbs.config import Config
from dloftbs.data.frame import Frame
from dloftbs.data.tracks import TrackState
from dloftbs.errors import InputError
from dloftbs.pipeline import Pipeline
from dloftbs_lab.evaluation.report.all_tables import tables
from dloftbs_lab.evaluation.runner.found import found_in, samples
from dloftbs_lab.evaluation.runner.run import evaluate
from dloftbs_lab.evaluation.runner.sequence_run import Method
from dloftbs_lab.truth import Truth


def rows_of(tmp_path, function, *sequences):
    (part,) = evaluate([suite(*sequences)], [method(function)], tmp_path)
    assert part.rows
    return part.rows


@pytest.mark.parametrize("function", [stubs.perfect, stubs.named, stubs.lazy, stubs.other_order])
def test_the_truth_scores_no_error(tmp_path, function):
    for row in rows_of(tmp_path, function):
        assert (row.n_true, row.n_found, row.missing, row.redundant, row.right, row.clean) == (2, 2, 0, 0, 2, True)
        assert row.l3_px == 0.0
        assert row.l2_px < 0.5  # the pixels are centres
        assert row.l1_px == pytest.approx((2 + 1 + 0 + 1 + 2) / 5, abs=0.1)
        assert row.failure is None


@pytest.mark.parametrize(
    ("function", "l3_px", "clean"),
    [
        (stubs.reversed_truth, 0.0, True),
        (stubs.shifted, 7.0, False),
        (stubs.truncated, 40.0, False),  # the mean of 80 s over s in 0..1
        (stubs.halves_swapped, 80.0 / 3.0, False),  # the better direction, by hand
    ],
)
def test_a_spoilt_truth_scores_what_arithmetic_says(tmp_path, function, l3_px, clean):
    for row in rows_of(tmp_path, function):
        assert row.l3_px == pytest.approx(l3_px, abs=0.3)
        assert (row.missing, row.redundant, row.right, row.clean) == (0, 0, 2 * clean, clean)


class Shown(Bars):
    """Bars of which the frame's mask alone says which pixels are cable, or a soft one that does not quite go to 0."""

    is_soft = False

    def frame(self, index):
        frame = super().frame(index)
        return dataclasses.replace(frame, mask=np.where(frame.mask, 0.9, 0.02)) if self.is_soft else frame

    def truth(self, index):
        truth = super().truth(index)
        return truth if self.only_masks else dataclasses.replace(truth, visible_masks=())


class Soft(Shown):
    is_soft = True


@pytest.mark.parametrize("only_masks", [False, True])
def test_pixels_of_a_mask_that_is_a_probability_are_those_from_one_half_on(tmp_path, only_masks):
    hard, soft = (
        rows_of(tmp_path, stubs.shifted, kind(kind.__name__, length=1, only_masks=only_masks)) for kind in (Shown, Soft)
    )
    assert (soft[0].l1_px, soft[0].l2_px, soft[0].dice) == (hard[0].l1_px, hard[0].l2_px, hard[0].dice)


def test_a_shift_shows_in_both_covers(tmp_path):
    (row,) = rows_of(tmp_path, stubs.shifted, Bars(length=1))
    assert row.l1_px == pytest.approx(7.0, abs=0.1)
    assert row.l2_px == pytest.approx(5.0, abs=0.1)  # from the bar's border


@pytest.mark.parametrize(
    ("function", "found", "missing", "redundant"),
    [(stubs.lone, 1, 1, 0), (stubs.three, 3, 0, 1), (stubs.nothing, 0, 2, 0)],
)
def test_what_is_missing_or_redundant_is_counted(tmp_path, function, found, missing, redundant):
    for row in rows_of(tmp_path, function):
        assert (row.n_found, row.missing, row.redundant, row.clean) == (found, missing, redundant, False)
        assert row.failure is None
        assert (row.l3_px is None) == (row.l1_px is None) == (found == 0)


def test_an_exception_is_a_frame_with_all_missing(tmp_path):
    rows = rows_of(tmp_path, stubs.raising)
    assert [row.failure for row in rows] == [None, "RuntimeError: no idea", None]
    assert [row.missing for row in rows] == [0, 2, 0]
    assert not rows[1].clean


def test_what_is_no_curve_is_a_failure(tmp_path):
    for row in rows_of(tmp_path, stubs.junk, Bars(length=6)):
        assert row.failure.startswith("InputError: ")
        assert row.missing == 2


def test_an_output_that_cannot_be_read_is_a_failure(tmp_path):
    failures = [row.failure for row in rows_of(tmp_path, stubs.unreadable)]
    assert failures[0].startswith("TypeError: ")
    assert failures[1] == "RuntimeError: no curves after all"
    assert failures[2].startswith("InputError: ")


def test_a_method_that_leaves_the_process_fails_in_its_frames(tmp_path):
    assert {row.failure for row in rows_of(tmp_path, stubs.leaving)} == {"SystemExit: 0"}


def test_an_error_that_no_encoding_has_is_kept_with_escapes(tmp_path):
    failures = {row.failure for row in rows_of(tmp_path, stubs.raising_what_no_encoding_has)}
    assert failures == {r"RuntimeError: cannot read \udcff.png or \ud800"}


def test_nothing_to_find_and_nothing_found_is_clean(tmp_path):
    (row,) = rows_of(tmp_path, stubs.nothing, Bars(length=1, rows=()))
    assert (row.n_true, row.clean) == (0, True)


class Hiding(Bars):
    """The second bar is hidden as a whole in the first frame."""

    def _masks(self, index):
        first, second = super()._masks(index)
        return first, second & (index > 0)


@pytest.mark.parametrize(
    ("function", "found", "right", "clean"),
    [(stubs.lone, (1, 1), (1, 1), (True, False)), (stubs.perfect, (2, 2), (1, 2), (True, True))],
)
def test_an_object_of_which_nothing_shows_may_be_found_and_is_not_asked_for(tmp_path, function, found, right, clean):
    (part,) = evaluate([suite(Hiding(length=2))], [method(function)], tmp_path)
    assert [row.n_true for row in part.rows] == [1, 2]
    assert tuple(row.n_found for row in part.rows) == found
    assert tuple(row.right for row in part.rows) == right
    assert tuple(row.clean for row in part.rows) == clean
    shares = [row["right number, %"] for table in tables([part]) for row in table.records() if "right number, %" in row]
    assert shares == [pytest.approx(100.0 * sum(clean) / 2)]


class Distorted(Bars):
    """Seen through a lens whose distortion has no inverse far from its axis."""

    def frame(self, index):
        lens = PinholeCamera(100.0, 100.0, 100.0, 60.0, distortion=(-0.4, 0.0, 0.0, 0.0, 0.0))
        return dataclasses.replace(super().frame(index), camera=lens)


def beside_the_lens(frame):
    return [np.array([[0.0, 0.0, 1.0], [50.0, 0.0, 1.0]])]


def test_a_curve_that_the_camera_cannot_see_is_a_failure_and_ends_nothing(tmp_path):
    rows = rows_of(tmp_path, beside_the_lens, Distorted(length=2))
    assert [(row.failure or "").split(":")[0] for row in rows] == ["InputError", "InputError"]


def test_curves_in_space_are_scored_in_millimetres_and_in_the_image(tmp_path):
    (row,) = rows_of(tmp_path, stubs.in_space, Bars(length=1, deep=True))
    assert row.l3_mm == pytest.approx(10.0, abs=0.01)
    assert row.l3_px == pytest.approx(0.5, abs=0.01)  # 10 mm, 2 m away, seen with 100 px


def true_axes(frame):
    return [stubs.lifted(curve) for curve in stubs.bars(frame.index)]


def stretched(frame):
    return [curve.transformed(np.diag([1.02, 1.0, 1.0]), np.zeros(3)) for curve in true_axes(frame)]


def test_the_true_axes_score_nothing_in_millimetres_and_of_the_length(tmp_path):
    for row in rows_of(tmp_path, true_axes, Bars(deep=True)):
        assert (row.l3_mm, row.length_error) == (0.0, 0.0)
        assert row.l3_px < 1e-6


def test_the_length_in_space_is_off_by_its_share(tmp_path):
    for row in rows_of(tmp_path, stretched, Bars(deep=True)):
        assert row.length_error == pytest.approx(0.02, abs=1e-6)
    for row in rows_of(tmp_path / "shifted", stubs.in_space, Bars(deep=True)):
        assert row.length_error == pytest.approx(0.0, abs=1e-6)


def test_without_a_curve_in_space_there_is_no_length(tmp_path):
    for row in rows_of(tmp_path, stubs.perfect, Bars(deep=True)):
        assert (row.l3_mm, row.length_error) == (None, None)


def test_curves_in_space_need_a_camera(tmp_path):
    (row,) = rows_of(tmp_path, stubs.in_space, Bars(length=1))
    assert "camera" in row.failure


def test_identities_and_directions_are_scored(tmp_path):
    steady, changing = evaluate([suite()], [method(stubs.named), method(stubs.turning)], tmp_path)
    assert (steady.tracking.switches, steady.tracking.flips, steady.tracking.idf1) == (0, 0, 1.0)
    assert (changing.tracking.switches, changing.tracking.flips) == (1, 1)


@pytest.mark.parametrize(("function", "fps"), [(stubs.perfect, 30.0), (stubs.named, None)])
def test_without_identities_or_a_rate_there_is_no_tracking_to_score(tmp_path, function, fps):
    (part,) = evaluate([suite(Bars(fps=fps))], [method(function)], tmp_path)
    assert part.tracking is None


def test_masks_alone_are_scored_by_their_overlap(tmp_path):
    for row in rows_of(tmp_path, stubs.perfect, Bars(only_masks=True)):
        assert row.dice == pytest.approx(1.0, abs=0.1)
        assert (row.l3_px, row.missing, row.redundant, row.clean) == (None, 0, 0, True)
    (row,) = rows_of(tmp_path, stubs.lone, Bars(length=1, only_masks=True))
    assert row.dice == pytest.approx(0.5, abs=0.05)
    assert (row.missing, row.redundant, row.right, row.clean) == (1, 0, 1, False)


def test_each_sequence_gets_an_instance_of_its_own(tmp_path):
    parts = evaluate([suite(Bars("a"), Bars("b"))], [Method("counting", stubs.Counting)], tmp_path)
    assert [[row.n_found for row in part.rows] for part in parts] == [[1, 2, 2], [1, 2, 2]]


def test_a_method_that_cannot_be_made_is_an_error(tmp_path):
    with pytest.raises(InputError, match="'broken' cannot be made: ZeroDivisionError"):
        evaluate([suite()], [Method("broken", lambda: 1 / 0)], tmp_path)


def test_a_method_that_leaves_when_it_is_made_is_an_error(tmp_path):
    leaves = Method("leaves", stubs.LeavesWhenItIsMade)
    with pytest.raises(InputError, match="method 'leaves' cannot be made: SystemExit: 0"):
        evaluate([suite()], [leaves], tmp_path)


def test_of_a_pipeline_the_tracks_count_while_they_are_seen():
    pipeline = Pipeline(Config())
    frame = Bars(rows=(30,)).frame(0)
    found = found_in(pipeline.process(frame), frame)
    assert found.ids == (1,)
    for _ in range(4):
        pipeline.process(frame)
    empty = Frame(mask=np.zeros_like(frame.mask))
    result = pipeline.process(empty)
    assert [track.state for track in result.tracks] == [TrackState.HIDDEN]  # a mask that is suddenly empty has failed
    assert found_in(result, empty).curves == ()


def test_the_points_of_a_polyline_are_filled_in():
    points = samples(np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 0.0], [10.0, 2.5]]))
    assert np.linalg.norm(np.diff(points, axis=0), axis=1).max() <= 1.0
    assert points[[0, -1]].tolist() == [[0.0, 0.0], [10.0, 2.5]]


def test_points_that_a_method_crowds_together_count_no_more_than_others():
    crowded = np.vstack((np.column_stack((np.linspace(0.0, 100.0, 30_000), np.zeros(30_000))), [[400.0, 0.0]]))
    np.testing.assert_allclose(samples(crowded), samples(crowded[[0, -1]]), atol=1e-9)


class HalfHidden(Bars):
    """Bars of which a hand hides the right end, a stretch in the middle, and the second one altogether."""

    def __init__(self, deep=False):
        super().__init__(length=1, deep=deep)

    def _masks(self, index):
        first, second = super()._masks(index)
        first[:, 50:60] = False
        first[:, 101:] = False
        second[:] = False
        return first, second


def visible_part(frame):
    return [np.column_stack((np.linspace(20.0, 100.0, 200), np.full(200, 30.0)))]


@pytest.mark.parametrize(("function", "found"), [(stubs.perfect, 2), (visible_part, 1)])
def test_neither_finding_nor_leaving_out_what_is_hidden_is_an_error(tmp_path, function, found):
    (row,) = rows_of(tmp_path, function, HalfHidden())
    assert (row.n_found, row.missing, row.redundant, row.clean) == (found, 0, 0, True)
    assert row.l3_px == pytest.approx(0.0, abs=0.2)
    # From a whole straight curve of length L, its half is off by s / 2 at each point: L / 4 in the mean, and none back.
    assert (row.l3_whole_px > 5.0) == (found == 1)


def visible_part_in_space(frame):
    flat = visible_part(frame)[0]
    return [stubs.CAMERA.deproject(flat, np.full(len(flat), stubs.DEPTH_M))]


def test_what_is_hidden_is_no_error_in_space_either(tmp_path):
    (row,) = rows_of(tmp_path, visible_part_in_space, HalfHidden(deep=True))
    assert row.l3_mm == pytest.approx(0.0, abs=10.0)  # half a pixel
    assert row.clean


def test_less_than_what_is_visible_is_an_error(tmp_path):
    (row,) = rows_of(tmp_path, lambda frame: [visible_part(frame)[0][:100]], HalfHidden())
    assert row.l3_px == pytest.approx(20.0, abs=0.5)


class OnTop(Bars):
    """A bar across another one on which it ends: seen from above its end shows, in a mask it does not."""

    def __init__(self, reach):
        super().__init__(length=1, rows=(60,))
        self.reach = reach

    def truth(self, index):
        (row,) = stubs.bars(0, self.rows)
        below = np.zeros(stubs.SIZE, bool)
        below[50:71, 20:181] = True
        above = np.zeros(stubs.SIZE, bool)
        above[10 : self.reach + 1, 98:103] = True
        curve = curve_through(np.column_stack((np.full(30, 100.0), np.linspace(10.0, self.reach, 30))))
        return Truth((row, curve), (below & ~above, above), (0, 1))

    def frame(self, index):
        return Frame(mask=self.truth(index).mask, index=index)


@pytest.mark.parametrize(("stop", "expected"), [(49.5, 0.0), (68.0, 0.0), (40.0, 5.0)])
def test_an_end_on_another_object_need_not_be_found(tmp_path, stop, expected):
    down = np.column_stack((np.full(60, 100.0), np.linspace(10.0, stop, 60)))
    (row,) = rows_of(tmp_path, lambda frame: [stubs.bars(0, (60,))[0], down], OnTop(68))
    assert 2.0 * row.l3_px == pytest.approx(expected, abs=0.6)  # the mean with the other one, which is perfect
    assert row.missing == row.redundant == 0


def test_what_a_frame_shows_and_what_a_track_remembers_are_scored_apart() -> None:
    """A hidden end is a part of the track, but nothing that was detected."""
    whole = np.zeros((120, 400), np.uint8)
    whole[56:65, 20:380] = 1
    cut = whole.copy()
    cut[:, 300:] = 0
    pipeline = Pipeline()
    results = [pipeline.process(Frame(mask=mask, index=k, stamp=k / 30)) for k, mask in enumerate([whole] * 10 + [cut])]
    clear, hidden = (found_in(result, Frame(mask=whole)) for result in results[-2:])
    assert clear.detected is None
    assert hidden.detected is not None
    assert hidden.detected.ids is None
    assert hidden.ids == clear.ids == (1,)
    (tracked,), (detected,) = hidden.curves, hidden.detected.curves
    assert tracked.length > detected.length + 50.0
    assert hidden.detected.detections == results[-1].detections


def test_curves_that_claim_to_be_right_are_counted_and_those_of_them_that_are_wrong(tmp_path):
    (row,) = rows_of(tmp_path, joint_stubs.cut_bars, Bars(length=1))
    # Both have gaps; the first states 0.9 and is a bar, the second states 0.2 and ends on another one.
    assert (row.right, row.sure, row.sure_wrong) == (1, 1, 0)


def test_a_sure_curve_that_is_wrong_or_redundant_counts(tmp_path):
    (row,) = rows_of(tmp_path, joint_stubs.sure_and_off, Bars(length=1))
    assert (row.sure, row.sure_wrong) == (3, 2)


def test_a_method_without_confidence_is_never_sure(tmp_path):
    (row,) = rows_of(tmp_path, stubs.shifted, Bars(length=1))
    assert (row.sure, row.sure_wrong) == (0, 0)
