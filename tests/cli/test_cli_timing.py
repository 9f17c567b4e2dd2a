import io
import math
import sys
from dataclasses import replace

import numpy as np
import pytest
from builders import detection_of, line

from dloftbs.cli import progress as progress_module
from dloftbs.cli.durations import ACCURACY, LatencyHistogram
from dloftbs.cli.progress import Progress, open_progress
from dloftbs.cli.shell import messages_to_stderr
from dloftbs.cli.stream_report import RunReport
from dloftbs.data.curve import BSplineCurve
from dloftbs.data.frame_result import FrameResult
from dloftbs.data.tracks import Track, TrackState

CURVE = BSplineCurve([0, 0, 0, 0, 1, 1, 1, 1], [[0, 0], [1, 0], [2, 0], [3, 0]])


def result(ids=(), reason=None, state=TrackState.CONFIRMED, **stage_ms):
    tracks = tuple(Track(i, state, CURVE, None, 1, 0, None) for i in ids)
    return FrameResult((), tracks, reason, (10, 10), stage_ms or {"skeleton": 1.0})


@pytest.mark.parametrize("count", [1, 2, 10, 5000])
@pytest.mark.parametrize("percent", [1, 50, 90, 99, 100])
def test_percentiles_are_within_the_stated_accuracy(count, percent):
    values = np.random.default_rng(count).lognormal(1.0, 2.0, count)
    histogram = LatencyHistogram()
    for value in values:
        histogram.add(float(value))
    exact = np.percentile(values, percent, method="inverted_cdf")
    assert histogram.percentile(percent) == pytest.approx(exact, rel=ACCURACY)
    assert (histogram.count, histogram.max_ms) == (count, values.max())
    assert histogram.sum_ms == pytest.approx(values.sum())


def test_the_histogram_does_not_grow():
    histogram = LatencyHistogram()
    size = len(histogram._counts)
    for ms in (0.0, 1e-9, 1.0, 1e12):
        histogram.add(ms)
    assert len(histogram._counts) == size < 2000


def test_no_durations_have_no_percentile():
    assert math.isnan(LatencyHistogram().percentile(50))


def test_tracks_are_counted_once_and_only_when_confirmed():
    report = RunReport()
    for ids in ((1,), (1, 2), (2,), (2, 3), ()):
        report.add(result(ids))
    report.add(result((4,), state=TrackState.TENTATIVE))
    assert report.steadiness.tracks == 3


def test_reasons_are_counted_by_kind_and_their_number_is_bounded():
    report = RunReport()
    for i in range(200):
        report.add(result(reason=f"the longest segment has {i + 7} px, of {0.5 * i} widths, less than 3"))
        report.add(result(reason="reason " + "x" * i))
    counts = report.reasons.counts()
    assert counts["the longest segment has 7 to 206 px, of 0.0 to 99.5 widths, less than 3"] == 200
    assert len(counts) <= 21
    assert report.reasons.total == 400
    assert "nothing found in 400 frames:" in report.summary()


def test_strange_input_is_counted():
    report = RunReport()
    for share in (61, 64):
        report.add(replace(result(), diagnosis=(f"{share} % of the mask is set",)))
    assert "strange input 2 times:\n       2  61 to 64 % of the mask is set" in report.summary()


def test_a_reason_keeps_its_numbers():
    report = RunReport()
    for _ in range(3):
        report.add(result(reason="1203 segments are more than segments.max_segments = 1000"))
    assert "       3  1203 segments are more than segments.max_segments = 1000\n" in report.summary() + "\n"


FOUND = [detection_of(line((0, 5 * i), (9, 5 * i))) for i in range(5)]


def counted(numbers, **options):
    report = RunReport(**options)
    for number in numbers:
        report.add(FrameResult(tuple(FOUND[:number]), (), None, (30, 30)))
    return report.summary()


def test_a_number_of_objects_that_nearly_all_frames_have_is_said_with_its_option():
    one = "warning: 1 object in 57 of 60 frames, more in 3; if there is one cable: --objects 1"
    assert counted([2] + [1] * 57 + [3, 2]).endswith(one)
    two = "warning: 2 objects in 27 of 30 frames, more in 2; if there are 2 cables: --objects 2"
    assert counted([2] * 27 + [1, 4, 3] + [0] * 40).endswith(two)  # whatever the frames without an object are


@pytest.mark.parametrize(
    ("numbers", "options"),
    [
        ([1] * 60, {}),
        ([1] * 50 + [0] * 10, {}),
        ([2] * 57 + [1] * 3, {}),  # a cable is hidden, which no option mends
        ([1] * 40 + [2] * 20, {}),  # one has come
        ([1, 1, 1, 2], {}),
        ([0] * 60, {}),
        ([2] * 57 + [3] * 3, {"objects": 3}),
        ([1] * 57 + [2] * 3, {"tracked": False}),
    ],
)
def test_there_is_no_option_where_the_number_is_known_or_the_frames_do_not_say_it(numbers, options):
    assert "--objects" not in counted(numbers, **options)


def test_the_line_says_how_the_run_stands():
    report = RunReport(100)
    for _ in range(2):
        report.add(result((1, 2), skeleton=2.0, linking=1.0))
    line = report.line()
    assert line.startswith("2/100 frames")
    assert "frames/s" in line
    assert " left  " in line
    assert "pipeline 2.99 ms" in line
    assert line.endswith("2 tracks")
    report.length = None
    assert " left" not in report.line()


def test_the_time_that_is_left_does_not_count_what_the_first_frame_compiled(monkeypatch):
    clock = iter([0.0, 400.0, 401.0, 402.0])
    monkeypatch.setattr("dloftbs.cli.stream_report.perf_counter", lambda: next(clock))
    report = RunReport(91)
    report.add(result())
    assert " left" not in report.line()
    report.add(result())
    report.add(result())
    assert "  1:28 left  " in report.line()


def test_stages_stand_in_their_order_even_if_the_first_masks_are_empty():
    report = RunReport()
    report.add(result(cleaning=1.0, tracking=2.0))
    report.add(result(cleaning=1.0, skeleton=3.0, linking=4.0, tracking=2.0))
    report.add(result(cleaning=1.0, tracking=2.0))
    assert list(report.stages) == ["cleaning", "skeleton", "linking", "tracking"]
    assert [times.count for times in report.stages.values()] == [3, 1, 1, 3]


def test_images_have_objects_and_no_tracks():
    report = RunReport(3, tracked=False)
    report.add(result())
    assert report.line().endswith("0 objects")
    assert report.summary().splitlines()[1] == "objects    0"


def test_reasons_for_no_curve_in_space_are_said_where_there_is_depth():
    report = RunReport()
    for reason in ("the frame has no depth", "the frame has depth, but no camera", "only 3 of 9 pixels", None):
        found = replace(detection_of(line((0, 0), (9, 0))), no_3d_reason=reason)
        report.add(FrameResult((found,), (), None, (9, 9)))
    text = report.summary()
    assert "no curve in space 2 times:" in text
    assert "only 3 of 9 pixels" in text
    assert "no depth" not in text


def test_an_empty_report_has_a_summary():
    assert RunReport().summary().startswith("frames     0, 0 skipped")


def test_progress_is_shown_at_most_every_few_seconds(monkeypatch):
    now = [0.0]
    monkeypatch.setattr(progress_module, "monotonic", lambda: now[0])
    shown = []
    progress = Progress(lambda report: shown.append(now[0]), 5.0)
    for tenth in range(200):
        now[0] = tenth / 10
        progress.tick(RunReport())
    assert shown == [5.0, 10.0, 15.0]


def test_off_a_terminal_progress_is_a_plain_line(monkeypatch, capsys):
    monkeypatch.setattr(progress_module, "_LINE_EVERY_S", 0.0)
    with open_progress(shares_terminal=False) as progress:
        progress.tick(RunReport(10))
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.startswith("0/10 frames")


class Terminal(io.StringIO):
    def isatty(self):
        return True


def test_warnings_are_lifted_above_the_bar(monkeypatch):
    import logging

    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    monkeypatch.setattr(progress_module, "_BAR_EVERY_S", 0.0)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.delenv("NO_COLOR", raising=False)
    with messages_to_stderr(), open_progress(shares_terminal=False) as progress:
        progress.tick(RunReport(10))
        logging.getLogger("dloftbs.sources").warning("[red]skipped[/red] %s", "it")
        progress.tick(RunReport(10))
    text = terminal.getvalue()
    # The bar's line is cleared before the message takes its place.
    assert "\x1b[2Kwarning: [red]skipped[/red] it\n" in text
    assert "0/10 frames" in text
