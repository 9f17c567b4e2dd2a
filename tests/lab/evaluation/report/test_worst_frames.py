import cv2
import numpy as np
import pytest
from lab.evaluation import runner_stubs as stubs
from lab.evaluation.runner_stubs import Bars, method, suite

from dloftbs_lab.evaluation.report.worst_frames import write_worst
from dloftbs_lab.evaluation.runner.run import evaluate


def sometimes(frame):
    """Worse in every frame; nothing in frame 2, an exception in frame 3."""
    if frame.index == 3:
        raise RuntimeError("no")
    return [] if frame.index == 2 else [c.transformed(np.eye(2), (0, frame.index)) for c in stubs.bars(frame.index)]


def test_the_worst_frames_are_kept(tmp_path):
    (part,) = evaluate([suite(Bars(length=14))], [method(sometimes)], tmp_path)
    assert sorted(part.worst) == [2, 3, *range(6, 14)]
    assert part.worst[2] == []
    assert [len(curves) for index, curves in part.worst.items() if index > 3] == [2] * 8
    worst_first = sorted(part.rows, key=lambda row: row.badness, reverse=True)
    assert [row.index for row in worst_first[:4]] == [2, 3, 13, 12]


def test_there_is_a_sheet_for_each_suite_and_method(tmp_path):
    suites = [suite(Bars("a"), Bars("b", length=12), name="moving bars"), suite(name="other")]
    parts = evaluate(suites, [method(sometimes), method(stubs.perfect)], tmp_path)
    paths = write_worst(suites, parts, tmp_path / "worst")
    names = ["moving-bars-sometimes", "moving-bars-perfect", "other-sometimes", "other-perfect"]
    assert [path.stem for path in paths] == names
    sheets = [cv2.imread(str(path)) for path in paths]
    assert sheets[0].shape[0] == pytest.approx(2.5 * sheets[2].shape[0], rel=0.05)  # five rows, two rows


def test_a_truth_of_masks_alone_is_drawn_too(tmp_path):
    suites = [suite(Bars(only_masks=True))]
    parts = evaluate(suites, [method(stubs.perfect)], tmp_path)
    assert write_worst(suites, parts, tmp_path)[0].is_file()
