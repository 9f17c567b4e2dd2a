"""How objects are followed: perfect, swapped, flipped and forgetful trackers score what arithmetic says."""

import json

import numpy as np
import pytest
from lab.evaluation import following_stubs as stubs
from lab.evaluation import runner_stubs
from lab.evaluation.following_stubs import HALF, WHOLE, Hidden
from lab.evaluation.runner_stubs import Bars, method, suite

from dloftbs_lab.evaluation.report.tracking_tables import following_table, is_harmed, is_helped, refound
from dloftbs_lab.evaluation.report.write import write_report
from dloftbs_lab.evaluation.runner.finished_parts import TrackRow
from dloftbs_lab.evaluation.runner.run import evaluate
from dloftbs_lab.evaluation.runner.sequence_run import Method
from dloftbs_lab.evaluation.suites import open_suite


def followed(tmp_path, function, sequence):
    made = Method(function.__name__, function) if isinstance(function, type) else method(function)
    (part,) = evaluate([suite(sequence)], [made], tmp_path)
    return part


def table_row(*parts):
    """The first row of the table, by column."""
    table = following_table(parts, "stub")
    return dict(zip(table.columns, table.rows[0], strict=True))


def rows_of(part, number=0):
    rows = [row for row in part.following.rows if row.object == number]
    assert rows
    return rows


@pytest.mark.parametrize("hidden", [None, HALF, WHOLE])
def test_the_truth_is_perfect(tmp_path, hidden):
    part = followed(tmp_path, runner_stubs.named, Hidden(hidden=hidden))
    scores = part.following.scores
    assert (scores.switches, scores.flips, scores.misses, scores.false_positives, scores.idf1) == (0, 0, 0, 0, 1.0)
    assert max(row.track_px for row in part.following.rows) < 1e-6
    row = table_row(part)
    assert (row["no switch, %"], row["no flip, %"], row["unbroken, %"]) == (100.0, 100.0, 100.0)
    assert row["objects followed, %"] == 100.0
    assert row["clear: L3 px tracked"] == pytest.approx(0.0, abs=1e-6)


def test_swapped_names_are_switches_and_no_flips(tmp_path):
    part = followed(tmp_path, stubs.swapping, Hidden())
    assert (part.following.scores.switches, part.following.scores.flips) == (2, 0)
    assert part.following.scores.idf1 == pytest.approx(0.5)
    row = table_row(part)
    assert (row["no switch, %"], row["no flip, %"], row["unbroken, %"]) == (0.0, 100.0, 0.0)


def test_flipped_curves_are_flips_and_no_switches(tmp_path):
    part = followed(tmp_path, stubs.flipping, Hidden())
    assert (part.following.scores.switches, part.following.scores.flips) == (0, 2)
    assert part.following.scores.idf1 == 1.0
    row = table_row(part)
    assert (row["no switch, %"], row["no flip, %"], row["unbroken, %"]) == (100.0, 0.0, 0.0)


def test_what_is_never_tracked_has_no_switch_but_is_not_followed(tmp_path):
    part = followed(tmp_path, stubs.one_only, Hidden())
    row = table_row(part)
    assert (row["unbroken, %"], row["objects followed, %"]) == (100.0, 50.0)
    assert row["IDF1"] == pytest.approx(2 / 3)


def test_sequences_are_counted_not_switches(tmp_path):
    good = followed(tmp_path / "a", runner_stubs.named, Hidden())
    bad = followed(tmp_path / "b", stubs.swapping, Hidden())
    alike = [good, bad, good, good]
    table = following_table([part.__class__(good.key, part.rows, following=part.following) for part in alike], "stub")
    row = dict(zip(table.columns, table.rows[0], strict=True))
    assert (row["sequences"], row["unbroken, %"]) == (4, 75.0)
    assert row["IDF1"] == pytest.approx(1.0 - 0.5 / 4)
    assert [line[:2] for line in table.rows] == [("stub", 2), ("all", 2), ("all", None)]


def test_the_past_is_measured_against_the_frame_alone_where_it_matters(tmp_path):
    part = followed(tmp_path, stubs.Remembering, Hidden(hidden=HALF))
    occluded = [row for row in rows_of(part) if row.index in HALF]
    assert [row.shown for row in occluded] == pytest.approx([0.5] * 3, abs=0.01)
    assert [row.track_px for row in occluded] == pytest.approx([0.0] * 3, abs=1e-6)
    # Half of a bar of 160 px: the mean of 80 s over s in 0..1.
    assert [row.alone_px for row in occluded] == pytest.approx([40.0] * 3, abs=0.3)
    assert all(row.shown == 1.0 for row in rows_of(part, 1))
    row = table_row(part)
    assert row["occluded: L3 px frame by frame"] == pytest.approx(40.0, abs=0.3)
    assert (row["occluded: less, %"], row["occluded: not detected, %"]) == (pytest.approx(100.0, abs=1e-6), 0.0)
    assert row["clear: L3 px frame by frame"] == pytest.approx(0.0, abs=1e-6)


def test_the_error_is_split_into_what_shows_and_what_is_hidden(tmp_path):
    part = followed(tmp_path, stubs.bent_where_hidden, Hidden(hidden=HALF))
    for row in rows_of(part):
        if row.index in HALF:
            assert row.shown_px == pytest.approx(0.0, abs=0.2)
            assert row.hidden_px == pytest.approx(4.0, abs=0.2)
            assert row.track_px == pytest.approx(row.shown * row.shown_px + (1.0 - row.shown) * row.hidden_px)
            assert row.track_px == pytest.approx(row.alone_px)
        else:
            assert (row.track_px, row.hidden_px) == (pytest.approx(0.0, abs=1e-6), None)


@pytest.mark.parametrize(("tracker", "after"), [(stubs.HiddenTracker, 0), (stubs.LateTracker, 2)])
def test_a_hidden_object_and_its_track_do_not_count_and_it_is_found_again(tmp_path, tracker, after):
    part = followed(tmp_path, tracker, Hidden(hidden=WHOLE))
    scores = part.following.scores
    assert (scores.objects, scores.outputs, scores.false_positives, scores.switches) == (14, 14, 0, 0)
    dark = [row for row in rows_of(part) if row.index in WHOLE]
    assert [(row.shown, row.seen, row.shown_px) for row in dark] == [(0.0, False, None)] * 2
    assert [row.track for row in dark] == [rows_of(part)[0].track] * 2
    row = table_row(part)
    assert (row["frames until re-found"], row["never re-found"]) == (float(after), 0)
    # What is hidden as a whole has no place in the comparison: no detector could find it.
    assert row["occluded: L3 px tracked"] is None


def test_another_name_afterwards_is_a_switch_and_never_found_again(tmp_path):
    part = followed(tmp_path, stubs.RenamingTracker, Hidden(hidden=WHOLE))
    assert part.following.scores.switches == 1
    row = table_row(part)
    assert (row["frames until re-found"], row["never re-found"]) == (None, 1)


@pytest.mark.parametrize(
    ("alone_px", "nearest_px", "harmed"),
    [(2.9, 5.1, 1.0), (2.9, None, 1.0), (2.9, 4.9, 0.0), (3.1, 50.0, 0.0), (None, 50.0, 0.0)],
)
def test_harm_is_a_track_that_is_off_where_the_frame_alone_is_right_and_help_the_reverse(alone_px, nearest_px, harmed):
    assert is_harmed(TrackRow(0, 0, 1.0, 1, True, 9.0, None, None, alone_px, nearest_px)) == harmed
    assert is_helped(TrackRow(0, 0, 1.0, 1, True, 9.0, None, None, nearest_px, alone_px)) == harmed


def test_the_track_of_another_object_is_no_harm_and_nothing_is_missed(tmp_path):
    row = table_row(followed(tmp_path, stubs.swapping, Hidden()))
    assert (row["harm, %"], row["help, %"], row["missed, %"]) == (0.0, 0.0, 0.0)


def test_what_has_no_track_near_it_is_missed(tmp_path):
    row = table_row(followed(tmp_path, stubs.one_only, Hidden()))
    assert row["missed, %"] == 50.0


def test_what_is_published_off_the_mask_is_a_ghost(tmp_path):
    for name, tracker in (("none", runner_stubs.named), ("drawn", stubs.ghostly)):
        part = followed(tmp_path / name, tracker, Hidden())
        row = table_row(part)
        # One of three bars of the same length, in half of the frames.
        assert row["ghosts, %"] == pytest.approx(0.0 if name == "none" else 20.0, abs=0.1)
        assert row["harm, %"] == 0.0


def track_rows(*moments):
    """Rows of one object from (shown, track, seen)."""
    return [TrackRow(i, 0, shown, track, seen, *([None] * 4)) for i, (shown, track, seen) in enumerate(moments)]


@pytest.mark.parametrize(
    ("moments", "expected"),
    [
        ([(1.0, 1, True), (0.0, 1, False), (1.0, 1, True)], [0]),
        ([(1.0, 1, True), (0.0, 1, False), (0.05, 1, True), (0.4, 1, False), (1.0, 1, True)], [1]),
        ([(1.0, 1, True), (0.0, 1, False), (1.0, 2, True), (1.0, 1, True)], [1]),
        ([(1.0, 1, True), (0.0, 1, False), (1.0, 2, True)], [None]),
        ([(1.0, 1, True), (0.0, 1, False), (1.0, 1, False), (0.0, 1, False), (1.0, 1, True)], [None, 0]),
        ([(1.0, 1, True), (0.0, 1, False)], []),
        ([(0.0, None, False), (1.0, 1, True)], []),
        ([(1.0, 1, True), (0.5, 1, True), (1.0, 1, False), (1.0, 2, True)], []),
    ],
)
def test_found_again_is_counted_in_frames(moments, expected):
    assert refound(track_rows(*moments)) == expected


def test_methods_without_identities_and_other_sequences_are_not_followed(tmp_path):
    assert followed(tmp_path / "a", runner_stubs.perfect, Hidden()).following is None
    other = followed(tmp_path / "b", runner_stubs.named, Bars())
    assert other.following is None
    assert following_table([other], "stub").rows == ()


def test_the_report_has_both_tables_and_no_target(tmp_path):
    suites = [suite(Hidden(hidden=HALF), name="tracking")]
    parts = evaluate(suites, [method(runner_stubs.named)], tmp_path / "parts")
    again = evaluate(suites, [method(runner_stubs.named)], tmp_path / "parts")
    assert again == parts
    write_report(suites, parts, tmp_path, "stubs")
    made = json.loads((tmp_path / "report.json").read_text())["tables"]
    row = made["tracking-families"][0]
    assert row["family"] == "stub"
    assert not any("bar" in column for column in row)
    assert {"tracking", "tracking-frames", "tracking-families"} <= set(made)
    assert (tmp_path / "tables" / "tracking-families.csv").exists()
    write_report(suites, parts, tmp_path, "stubs", untracked=["tracking"])
    made = json.loads((tmp_path / "report.json").read_text())["tables"]
    assert {name for name in made if name.startswith("tracking")} == {"tracking-frames"}


def test_the_suite_is_made_for_it():
    sequences = open_suite("tracking", scale=0.01, size=(180, 320)).sequences
    families = {(sequence.family, sequence.cables) for sequence in sequences}
    assert {("crossing", 5), ("hidden", 1), ("touching", 2)} <= families
    assert all(sequence.fps is not None and np.isfinite(sequence.fps) for sequence in sequences)
