import csv
import json

import pytest
from lab.evaluation import joint_stubs, runner_stubs
from lab.evaluation.runner_stubs import Bars, method, suite

from dloftbs.data.centerline import JointKind
from dloftbs_lab.evaluation.report.joint_tables import EDGES, binned, calibration_error, joint_tables
from dloftbs_lab.evaluation.report.plots import write_plots
from dloftbs_lab.evaluation.report.write import write_report
from dloftbs_lab.evaluation.runner.finished_parts import JointRow
from dloftbs_lab.evaluation.runner.run import evaluate


def rows(*outcomes):
    return [JointRow(0, JointKind.GAP, confidence, right) for confidence, right in outcomes]


def test_a_bin_holds_its_lower_edge_and_the_last_one_both():
    bins = binned(rows(*((edge, True) for edge in EDGES)))
    assert [one.number for one in bins] == [1, 1, 1, 1, 1, 1, 1, 2]
    assert [(one.low, one.high) for one in bins][-1] == (0.99, 1.0)


def test_the_calibration_error_is_what_arithmetic_says():
    bins = binned(rows((0.8, True), (0.8, True), (0.8, True), (0.8, False), (0.3, True), (0.1, False)))
    stated = {one.low: (one.number, one.stated, one.right) for one in bins if one.number}
    assert stated == {0.0: (2, pytest.approx(0.2), 0.5), 0.8: (4, pytest.approx(0.8), 0.75)}
    assert calibration_error(bins) == pytest.approx((2 * 0.3 + 4 * 0.05) / 6)
    assert calibration_error(binned([])) is None


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("joints")
    suites = [suite(Bars(length=3))]
    parts = evaluate(suites, [method(joint_stubs.cut_bars), method(runner_stubs.perfect)], folder / "parts")
    return folder, write_report(suites, parts, folder, "stubs"), parts


def test_the_tables_say_how_many_are_right(run):
    data = json.loads((run[0] / "report.json").read_text())["tables"]
    by_bin = {row["stated confidence"]: row for row in data["joints"]}
    assert len(by_bin) == len(EDGES) - 1
    low, high = by_bin["0 to 0.5"], by_bin["0.9 to 0.95"]
    assert (low["all: number"], low["crossing: right, %"], low["gap: right, %"]) == (3, 0.0, None)
    assert (high["all: right, %"], high["gap: stated, %"], high["crossing: number"]) == (100.0, pytest.approx(90.0), 0)
    errors = {row["joints"]: row for row in data["joint-calibration"]}
    assert errors["all"]["expected calibration error, %"] == pytest.approx(15.0)
    assert errors["crossing"]["expected calibration error, %"] == pytest.approx(20.0)
    assert (errors["gap"]["number"], errors["gap"]["right, %"]) == (3, 100.0)
    assert "### Joints: stated confidence, share right, number" in (run[0] / "report.md").read_text()


def test_every_joint_is_in_a_file(run):
    with (run[0] / "joints.csv").open() as file:
        written = list(csv.DictReader(file))
    assert len(written) == 6
    assert written[1] == {
        "suite": "stub",
        "sequence": "bars",
        "index": "0",
        "method": "cut_bars",
        "kind": "crossing",
        "confidence": "0.2",
        "right": "False",
    }


def test_there_is_a_reliability_diagram(run):
    assert "joints.png" in [path.name for path in run[1].pictures]
    assert "(plots/joints.png)" in (run[0] / "report.md").read_text()


def test_without_joints_there_is_nothing_to_show(tmp_path):
    parts = evaluate([suite()], [method(runner_stubs.perfect)], tmp_path / "parts")
    assert joint_tables(parts) == []
    assert "joints.png" not in [path.name for path in write_plots(parts, tmp_path)]
