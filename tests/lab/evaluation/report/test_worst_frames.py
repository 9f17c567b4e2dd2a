import cv2
import numpy as np
import pytest
from lab.evaluation import runner_stubs as stubs
from lab.evaluation.runner_stubs import Bars, method, suite

from dloftbs_lab.evaluation.report.pages import make_pages
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


def short(frame):
    """A curve shorter than the points that are kept of it, and one of a single place."""
    return [np.array([[10.0, 10.0], [60.0, 10.0]]), np.array([[20.0, 20.0], [20.0, 20.0]])]


def test_short_curves_are_drawn(tmp_path):
    suites = [suite(Bars())]
    (path,) = write_worst(suites, evaluate(suites, [method(short)], tmp_path), tmp_path)
    assert path.is_file()


def test_names_in_any_script_stay_apart(tmp_path):
    suites = [suite(name=name) for name in ("кабели", "провода", "my_data")]
    parts = evaluate(suites, [method(stubs.perfect)], tmp_path)
    paths = write_worst(suites, parts, tmp_path)
    assert [path.stem for path in paths] == ["кабели-perfect", "провода-perfect", "my_data-perfect"]
    pages = make_pages(suites, parts, paths, ["run"])
    for one, path in zip(suites, paths, strict=True):
        assert pages[one.name].count(".jpg") == 1
        assert path.name in pages[one.name]


def test_a_truth_of_masks_alone_is_drawn_too(tmp_path):
    suites = [suite(Bars(only_masks=True))]
    parts = evaluate(suites, [method(stubs.perfect)], tmp_path)
    assert write_worst(suites, parts, tmp_path)[0].is_file()
